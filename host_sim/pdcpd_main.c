/* pdcpd: the arbitrator as a Linux daemon. Joins the application to a CAN bus, a host and a file; with
 * --can sim the bus is in this process too, and with --node its devices are. */
#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "arb_app.h"
#include "complaint.h"
#include "hal_sys.h"
#include "linux_can.h"
#include "linux_nvm.h"
#include "linux_uart.h"
#include "loop.h"
#include "node_ini.h"
#include "pdcpd_log.h"
#include "pdcpd_options.h"
#include "sim_node.h"
#include "sim_world.h"
#include "socketcand_server.h"

enum {
    RECEIVE_BATCH = 32,
    HOST_BATCH = 256,
    PATIENCE_MS = 500, /* for the last lines to be read */
    STALL_US = 50000   /* a world that is called later than this was stopped */
};

typedef struct {
    pdcpd_options_t options;
    int status; /* to end with */
    pdcpd_log_t log;
    line_writer_t *out; /* standard output: where bus and host are, and values of --node */
    arb_app_t app;
    arb_port_t port;
    loop_t *loop;
    hal_uart_t *uart;
    hal_nvm_t *nvm;
    bool uart_ready;
    uint8_t host_bytes[HOST_BATCH]; /* read, but not taken by the application yet */
    size_t host_count;

    hal_can_t *can; /* a bus outside; NULL: the one in world */

    sim_world_t *world;     /* NULL: the bus is outside */
    uint64_t world_due_us;  /* when the world wants to go on, by the loop's clock */
    uint64_t world_late_us; /* how far its clock is behind the loop's */
    socketcand_server_t *server;
    node_ini_t *inis[PDCPD_NODES_MAX];
    sim_node_t *nodes[PDCPD_NODES_MAX];
} daemon_t;

/* --- lines for people and programs --- */

static void on_event(void *ctx, uint32_t now_ms, const pdcp_event_t *event)
{
    daemon_t *daemon = ctx;
    (void)now_ms;
    pdcpd_log_event(&daemon->log, loop_now_us(daemon->loop), &daemon->app.arb.bus.tables, event);
}

static void warn(daemon_t *daemon, const char *what, unsigned damaged, int of)
{
    if (damaged != 0) {
        pdcpd_log_say(&daemon->log, loop_now_us(daemon->loop), PDCPD_LOG_WARNING,
                      "%s: %u of %d copies of the %s are damaged", daemon->options.nvm, damaged, of, what);
    }
}

/* What the storage file could not give back. */
static void warn_of_damage(daemon_t *daemon)
{
    const arb_limb_t *limb = &daemon->app.limb;
    warn(daemon, "identities", daemon->app.store.damaged, ARB_AREAS);
    warn(daemon, "flags", limb->flags.damaged, ARB_AREAS);
    warn(daemon, "stored configurations", (unsigned)limb->config.counters[ARB_CONFIG_DAMAGED], ARB_AREAS);
}

/* --- port of the application --- */

static bool can_send(void *ctx, const can_frame_t *frame)
{
    daemon_t *daemon = ctx;
    return daemon->world != NULL ? sim_world_send(daemon->world, frame) : hal_can_send(daemon->can, frame);
}

static void can_restart(void *ctx)
{
    daemon_t *daemon = ctx;
    if (daemon->can != NULL) {
        hal_can_restart(daemon->can);
    }
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    daemon_t *daemon = ctx;
    return hal_uart_write(daemon->uart, bytes, size);
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    daemon_t *daemon = ctx;
    return hal_nvm_read(daemon->nvm, address, bytes, size);
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    daemon_t *daemon = ctx;
    return hal_nvm_write(daemon->nvm, address, bytes, size);
}

static int8_t nvm_status(void *ctx)
{
    daemon_t *daemon = ctx;
    return (int8_t)hal_nvm_status(daemon->nvm);
}

/* Neither a pseudo-terminal nor the simulated bus loses anything; of a serial line nobody tells. */
static void host_served(void *ctx, uint16_t message, const uint8_t *payload, uint16_t len, uint8_t error)
{
    daemon_t *daemon = ctx;
    pdcpd_log_served(&daemon->log, loop_now_us(daemon->loop), message, payload, len, error);
}

static uint32_t counter(void *ctx, arb_port_counter_t which)
{
    const daemon_t *daemon = ctx;
    if (daemon->can == NULL) {
        return 0;
    }
    const hal_can_health_t health = hal_can_health(daemon->can);
    return which == ARB_PORT_FRAMES_LOST     ? health.rx_overruns
           : which == ARB_PORT_FRAMES_UNSENT ? health.tx_failed
                                             : 0;
}

/* --- work --- */

static void on_uart_ready(void *ctx)
{
    ((daemon_t *)ctx)->uart_ready = true;
}

static void on_server_changed(void *ctx)
{
    (void)ctx; /* the world runs after every turn of the loop */
}

/* Hands bytes of the host to the application until there are no more, or it takes no more: then the host does
 * not read its answers. True: it has taken some. */
static bool take_host_bytes(daemon_t *daemon, uint32_t now_ms)
{
    bool any = false;
    if (linux_uart_host_left(daemon->uart)) {
        arb_app_on_host_gone(&daemon->app);
    }
    for (;;) {
        if (daemon->host_count == 0) {
            daemon->host_count = hal_uart_read(daemon->uart, daemon->host_bytes, HOST_BATCH);
        }
        if (daemon->host_count == 0) {
            daemon->uart_ready = false;
            return any;
        }
        const uint16_t taken =
            arb_app_on_bytes(&daemon->app, now_ms, daemon->host_bytes, (uint16_t)daemon->host_count);
        daemon->host_count -= taken;
        memmove(daemon->host_bytes, &daemon->host_bytes[taken], daemon->host_count);
        any = any || taken != 0;
        if (daemon->host_count != 0) {
            return any;
        }
    }
}

/* Frames are taken here and now: a bus that is going away has no later. The rest of the work is done when the
 * loop returns. */
static void on_can_ready(void *ctx)
{
    daemon_t *daemon = ctx;
    const uint32_t now_ms = (uint32_t)(loop_now_us(daemon->loop) / 1000u);
    can_frame_t frames[RECEIVE_BATCH];
    size_t count;
    do {
        count = hal_can_receive(daemon->can, frames, RECEIVE_BATCH);
        for (size_t i = 0; i < count; i++) {
            arb_app_on_frame(&daemon->app, now_ms, &frames[i]);
        }
    } while (count == RECEIVE_BATCH);
    const hal_can_health_t health = hal_can_health(daemon->can);
    arb_app_on_errors(&daemon->app, health.tx_errors, health.rx_errors);
    arb_app_on_state(&daemon->app, now_ms, (pdcp_bus_state_t)health.state);
}

/* One turn with a bus outside. Returns the time of the next one at the latest. */
static uint64_t work_outside(daemon_t *daemon)
{
    const uint64_t now_us = loop_now_us(daemon->loop);
    const uint32_t now_ms = (uint32_t)(now_us / 1000u);
    uint32_t next_ms;
    bool again;
    do { /* a step makes room for more of the host's bytes */
        again = daemon->uart_ready && take_host_bytes(daemon, now_ms);
        next_ms = arb_app_step(&daemon->app, now_ms);
    } while (again && daemon->uart_ready);
    const int32_t wait_ms = (int32_t)(next_ms - now_ms);
    const uint64_t tick_us = now_us / 1000u * 1000u;
    return wait_ms > 0 ? tick_us + (uint64_t)wait_ms * 1000u : now_us;
}

/* The world's time. It stands still while the process is stopped: programs on the bus have gone on speaking
 * meanwhile, and their frames come in only now (D-LIN-8). */
static uint64_t world_now_us(daemon_t *daemon)
{
    const uint64_t now_us = loop_now_us(daemon->loop);
    if (now_us > daemon->world_due_us + STALL_US) {
        daemon->world_late_us += now_us - daemon->world_due_us;
    }
    return now_us - daemon->world_late_us;
}

/* One turn with the bus in this process. Returns the time of the next one at the latest. */
static uint64_t work_world(daemon_t *daemon)
{
    const uint64_t now_us = world_now_us(daemon);
    (void)sim_world_run(daemon->world, now_us);
    uint64_t next_us;
    bool again;
    do {
        again = daemon->uart_ready && take_host_bytes(daemon, sim_world_ms(daemon->world));
        if (again) {
            sim_world_touch_app(daemon->world);
        }
        next_us = sim_world_run(daemon->world, now_us);
        again = (again && daemon->uart_ready) ||
                (daemon->server != NULL && socketcand_server_poll(daemon->server));
    } while (again);
    daemon->world_due_us = next_us != SIM_BUS_NEVER ? next_us + daemon->world_late_us : UINT64_MAX - STALL_US;
    return daemon->world_due_us;
}

/* --- start and end --- */

static bool complain(const char *error)
{
    complaint_say("pdcpd", error);
    return false;
}

/* What cannot be opened is not there now, if its name can be right. */
static bool complain_of(daemon_t *daemon, bool can_be_right, const char *error)
{
    daemon->status = can_be_right ? PDCPD_EXIT_MISSING : PDCPD_EXIT_USAGE;
    return complain(error);
}

/* sim or sim:PORT. */
static bool open_world(daemon_t *daemon)
{
    char error[256];
    const char *port = strchr(daemon->options.can, ':');
    daemon->world = calloc(1, sizeof *daemon->world);
    if (daemon->world == NULL) {
        return complain("out of memory");
    }
    const uint64_t now_us = loop_refresh_now_us(daemon->loop);
    sim_world_init(daemon->world, now_us, (uint32_t)(now_us / 1000u));
    if (port == NULL) {
        return true;
    }
    char *end;
    const unsigned long number = strtoul(port + 1, &end, 10);
    if (!isdigit((unsigned char)port[1]) || *end != '\0' || number > 65535) {
        (void)snprintf(error, sizeof error, "%s: '%s' is no TCP port", daemon->options.can, port + 1);
        return complain(error);
    }
    daemon->server = socketcand_server_open(daemon->loop, &daemon->world->bus, (uint16_t)number,
                                            on_server_changed, daemon, error, sizeof error);
    if (daemon->server == NULL) {
        return complain_of(daemon, true, error);
    }
    line_writer_put(daemon->out, "bus 127.0.0.1:%u", socketcand_server_port(daemon->server));
    return true;
}

static bool open_bus(daemon_t *daemon)
{
    char error[256];
    if (strcmp(daemon->options.can, "sim") == 0 || strncmp(daemon->options.can, "sim:", 4) == 0) {
        return open_world(daemon);
    }
    daemon->can =
        linux_can_open(daemon->loop, daemon->options.can, on_can_ready, daemon, error, sizeof error);
    return daemon->can != NULL || complain_of(daemon, linux_can_is_bus(daemon->options.can), error);
}

static void on_node_event(void *ctx, const sim_node_event_t *event)
{
    char line[SIM_NODE_LINE];
    sim_node_format(line, event);
    line_writer_put(((daemon_t *)ctx)->out, "%s", line);
}

static bool open_nodes(daemon_t *daemon)
{
    char error[512];
    for (unsigned i = 0; i < daemon->options.node_count; i++) {
        daemon->inis[i] = node_ini_load(daemon->options.nodes[i], error, sizeof error);
        if (daemon->inis[i] == NULL) {
            return complain(error);
        }
        const uint64_t now_us = loop_refresh_now_us(daemon->loop);
        daemon->nodes[i] = sim_node_open(daemon->inis[i], (uint32_t)now_us + i, now_us, on_node_event, daemon,
                                         error, sizeof error);
        if (daemon->nodes[i] == NULL) {
            return complain(error);
        }
        if (!sim_world_add(daemon->world, daemon->nodes[i])) {
            return complain("the simulated bus has no port left");
        }
    }
    return true;
}

static bool open_lines(daemon_t *daemon)
{
    daemon->out = line_writer_open(STDOUT_FILENO, "{\"lost\":", "}");
    return (daemon->out != NULL && pdcpd_log_open(&daemon->log, daemon->options.log)) ||
           complain("the threads for lines cannot be started");
}

static bool open_all(daemon_t *daemon)
{
    char error[256];
    daemon->loop = loop_create();
    if (daemon->loop == NULL) {
        return complain("the event loop cannot be made");
    }
    daemon->uart =
        linux_uart_open(daemon->loop, daemon->options.host, on_uart_ready, daemon, error, sizeof error);
    if (daemon->uart == NULL) {
        return complain_of(daemon, linux_uart_is_port(daemon->options.host), error);
    }
    if (!open_bus(daemon)) {
        return false;
    }
    daemon->nvm = linux_nvm_open(daemon->options.nvm, error, sizeof error);
    if (daemon->nvm == NULL) {
        return complain(error);
    }
    return open_nodes(daemon);
}

static bool start(daemon_t *daemon)
{
    daemon->port = (arb_port_t){.ctx = daemon,
                                .can_send = can_send,
                                .can_restart = can_restart,
                                .host_write = host_write,
                                .nvm_read = nvm_read,
                                .nvm_write = nvm_write,
                                .nvm_status = nvm_status,
                                .counter = counter,
                                .host_served = host_served};
    const arb_settings_t settings = {.serial = hal_sys_serial(),
                                     .seed = hal_sys_random(),
                                     .strict_crc = daemon->options.strict_crc,
                                     .no_autoconfig = daemon->options.no_autoconfig};
    /* The simulated bus begins where it was opened: the application's time never runs backwards. */
    const uint32_t now_ms = daemon->world != NULL ? sim_world_ms(daemon->world)
                                                  : (uint32_t)(loop_refresh_now_us(daemon->loop) / 1000u);
    arb_app_init(&daemon->app, &daemon->port, &settings, now_ms);
    arb_app_observe(&daemon->app, on_event, daemon);
    warn_of_damage(daemon);
    if (daemon->world != NULL && !sim_world_set_app(daemon->world, &daemon->app)) {
        return complain("the simulated bus has no port left");
    }
    line_writer_put(daemon->out, "host %s", linux_uart_path(daemon->uart));
    return true;
}

static void close_all(daemon_t *daemon)
{
    for (unsigned i = 0; i < PDCPD_NODES_MAX; i++) {
        sim_node_close(daemon->nodes[i]);
        node_ini_free(daemon->inis[i]);
    }
    socketcand_server_close(daemon->server);
    if (daemon->can != NULL) {
        linux_can_close(daemon->can);
    }
    if (daemon->uart != NULL) {
        linux_uart_close(daemon->uart);
    }
    if (daemon->nvm != NULL) {
        linux_nvm_close(daemon->nvm);
    }
    if (daemon->loop != NULL) {
        loop_destroy(daemon->loop);
    }
    free(daemon->world);
    pdcpd_log_close(&daemon->log);
    line_writer_close(daemon->out, PATIENCE_MS);
    pdcpd_options_free(&daemon->options);
}

static void run(daemon_t *daemon)
{
    daemon->world_due_us = loop_now_us(daemon->loop);
    daemon->uart_ready = true;
    do {
        const uint64_t next_us = daemon->world != NULL ? work_world(daemon) : work_outside(daemon);
        const uint64_t log_us = pdcpd_log_step(&daemon->log, loop_now_us(daemon->loop));
        loop_set_deadline_us(daemon->loop, log_us < next_us ? log_us : next_us);
    } while (loop_run_once(daemon->loop));
}

int main(int argc, char **argv)
{
    static daemon_t daemon;
    pdcpd_options_parse(&daemon.options, argc, argv);
    daemon.status = PDCPD_EXIT_USAGE;
    (void)umask(S_IRWXG | S_IRWXO);
    if (open_lines(&daemon) && open_all(&daemon) && start(&daemon)) {
        run(&daemon);
        pdcpd_log_say(&daemon.log, loop_now_us(daemon.loop), PDCPD_LOG_INFO, "ends");
        daemon.status = EXIT_SUCCESS;
    }
    close_all(&daemon);
    return daemon.status;
}
