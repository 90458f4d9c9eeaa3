/* pdcp-node: simulated devices on a real or simulated bus. All devices of one process share one
 * controller. */
#include <argp.h>
#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "arb_version.h"
#include "complaint.h"
#include "hal_can.h"
#include "hal_sys.h"
#include "line_writer.h"
#include "linux_can.h"
#include "loop.h"
#include "node_ini.h"
#include "sim_node.h"

enum {
    NODES_MAX = 64,
    RECEIVE_BATCH = 32,
    FILTERS_MAX = 256,
    EXIT_BAD_START = 2,
    EXIT_MISSING = 3,  /* the bus is not there now */
    PATIENCE_MS = 500, /* for the last lines to be read */
    OPTION_SEED = 's',
    OPTION_STATS = 1,
    OPTION_VERSION
};

typedef struct {
    const char *bus;
    const char *files[NODES_MAX];
    size_t file_count;
    bool seeded;
    uint32_t seed;
    bool stats;
} options_t;

typedef struct {
    int status;         /* to end with */
    line_writer_t *out; /* standard output: what inputs receive */
    loop_t *loop;
    hal_can_t *can;
    node_ini_t *inis[NODES_MAX];
    sim_node_t *nodes[NODES_MAX];
    uint16_t listen_changes[NODES_MAX];
    size_t count;
    uint64_t frames_received;
    uint64_t frames_sent;
    uint64_t sends_refused; /* the controller had no room; the frame was kept */
} app_t;

/* --- arguments --- */

static const struct argp_option option_table[] = {
    {"can", 'c', "BUS", 0, "Bus to join: " LINUX_CAN_CHOICES, 0},
    {"seed", OPTION_SEED, "N", 0, "Start of the random numbers; the same seed asks for the same node ids", 0},
    {"stats", OPTION_STATS, NULL, 0, "Write counters to standard error at the end, one JSON object", 0},
    {"version", OPTION_VERSION, NULL, 0, "Print the version and end", -1},
    {0},
};

static bool parse_seed(const char *text, uint32_t *seed)
{
    char *end = NULL;
    const unsigned long long number = strtoull(text, &end, 0);
    if (text[0] < '0' || text[0] > '9' || *end != '\0' || number > UINT32_MAX) {
        return false;
    }
    *seed = (uint32_t)number;
    return true;
}

static void add_file(options_t *options, char *path)
{
    if (options->file_count == NODES_MAX) {
        argp_failure(NULL, EXIT_BAD_START, 0, "more than %d devices", NODES_MAX);
        return;
    }
    options->files[options->file_count++] = path;
}

static void check_options(const options_t *options)
{
    if (options->bus == NULL || options->file_count == 0) {
        argp_failure(NULL, EXIT_BAD_START, 0, "%s is missing; --help tells more",
                     options->bus == NULL ? "--can BUS" : "FILE");
    }
}

static error_t on_option(int key, char *text, struct argp_state *state)
{
    options_t *options = state->input;
    switch (key) {
    case ARGP_KEY_INIT:
        state->err_stream = NULL; /* one line says what is wrong; no second one how to get help */
        return 0;
    case 'c':
        options->bus = text;
        return 0;
    case OPTION_SEED:
        options->seeded = true;
        if (!parse_seed(text, &options->seed)) {
            argp_failure(NULL, EXIT_BAD_START, 0, "--seed: '%s' is not a number from 0 to 4294967295", text);
        }
        return 0;
    case OPTION_STATS:
        options->stats = true;
        return 0;
    case OPTION_VERSION:
        (void)printf("pdcp-node %d.%d.%d\n", ARB_VERSION_MAJOR, ARB_VERSION_MINOR, ARB_VERSION_PATCH);
        exit(EXIT_SUCCESS);
    case ARGP_KEY_ARG:
        add_file(options, text);
        return 0;
    case ARGP_KEY_END:
        check_options(options);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* --- the devices and their bus --- */

static void on_event(void *ctx, const sim_node_event_t *event)
{
    char line[SIM_NODE_LINE];
    sim_node_format(line, event);
    line_writer_put(((app_t *)ctx)->out, "%s", line);
}

/* The node whose frame would win arbitration. NULL: nobody has one. */
static sim_node_t *next_sender(const app_t *app, can_frame_t *frame)
{
    sim_node_t *sender = NULL;
    for (size_t i = 0; i < app->count; i++) {
        can_frame_t offered;
        if (sim_node_tx_peek(app->nodes[i], &offered) && (sender == NULL || offered.id < frame->id)) {
            sender = app->nodes[i];
            *frame = offered;
        }
    }
    return sender;
}

/* Gives a frame to all nodes but its sender. */
static void deliver(app_t *app, uint64_t now_us, const sim_node_t *sender, const can_frame_t *frame)
{
    for (size_t i = 0; i < app->count; i++) {
        if (app->nodes[i] != sender) {
            sim_node_on_frame(app->nodes[i], now_us, frame);
        }
    }
}

/* Sends what the nodes have, the lowest identifier first. The controller does not receive what it sends
 * itself: the other nodes of this process get it from here. What it refuses stays in its node's queue until
 * there is room. */
static void send_all(app_t *app, uint64_t now_us)
{
    can_frame_t frame;
    sim_node_t *sender;
    while ((sender = next_sender(app, &frame)) != NULL) {
        if (!hal_can_send(app->can, &frame)) {
            app->sends_refused++;
            return;
        }
        sim_node_tx_pop(sender);
        app->frames_sent++;
        deliver(app, now_us, sender, &frame);
    }
}

/* Whether a node listens to other sources than at the last call. */
static bool listening_changed(app_t *app)
{
    bool changed = false;
    for (size_t i = 0; i < app->count; i++) {
        const uint16_t changes = pdcp_device_listen_changes(sim_node_device(app->nodes[i]));
        changed = changed || app->listen_changes[i] != changes;
        app->listen_changes[i] = changes;
    }
    return changed;
}

/* Only the arbitrator and the sources of enabled inputs are of interest. */
static void set_filters(app_t *app)
{
    hal_can_filter_t filters[FILTERS_MAX];
    size_t count = 0;
    if (!listening_changed(app)) {
        return;
    }
    filters[count++] = (hal_can_filter_t){.id = 0x100, .mask = 0x100};
    for (size_t i = 0; i < app->count; i++) {
        uint8_t ids[PDCP_DEVICE_CHANNELS_MAX];
        const uint8_t listens_to =
            pdcp_device_listens_to(sim_node_device(app->nodes[i]), ids, PDCP_DEVICE_CHANNELS_MAX);
        for (uint8_t j = 0; j < listens_to && count < FILTERS_MAX; j++) {
            filters[count++] = (hal_can_filter_t){.id = ids[j], .mask = 0x1FF}; /* any priority, mode 0 */
        }
    }
    hal_can_set_filters(app->can, filters, count < FILTERS_MAX ? count : 0);
}

static void receive_all(app_t *app, uint64_t now_us)
{
    can_frame_t frames[RECEIVE_BATCH];
    size_t count;
    while ((count = hal_can_receive(app->can, frames, RECEIVE_BATCH)) != 0) {
        for (size_t i = 0; i < count; i++) {
            deliver(app, now_us, NULL, &frames[i]);
            set_filters(app);      /* before the answer: the source may send right after it */
            send_all(app, now_us); /* what is copied leaves at once and fills no queue */
        }
        app->frames_received += count;
    }
}

/* Everything that is due. Frames lead to frames: again until no node has anything new. */
static void work(app_t *app)
{
    const uint64_t now_us = loop_now_us(app->loop);
    uint64_t next_us = UINT64_MAX;
    for (bool again = true; again;) {
        const uint64_t sent = app->frames_sent;
        for (size_t i = 0; i < app->count; i++) {
            (void)sim_node_step(app->nodes[i], now_us);
        }
        send_all(app, now_us);
        again = app->frames_sent != sent;
    }
    for (size_t i = 0; i < app->count; i++) {
        const uint64_t due_us = sim_node_step(app->nodes[i], now_us);
        next_us = due_us < next_us ? due_us : next_us;
    }
    set_filters(app);
    loop_set_deadline_us(app->loop, next_us);
}

/* Takes the frames within the call; the rest of the work is done when the loop returns. */
static void on_ready(void *ctx)
{
    app_t *app = ctx;
    receive_all(app, loop_now_us(app->loop));
}

/* --- start and end --- */

static bool complain(const char *error)
{
    complaint_say("pdcp-node", error);
    return false;
}

static bool open_all(app_t *app, const options_t *options)
{
    char error[512];
    const uint32_t seed = options->seeded ? options->seed : hal_sys_serial();
    for (size_t i = 0; i < options->file_count; i++) {
        app->inis[i] = node_ini_load(options->files[i], error, sizeof error);
        if (app->inis[i] == NULL) {
            return complain(error);
        }
    }
    app->out = line_writer_open(STDOUT_FILENO, "{\"lost\":", "}");
    if (app->out == NULL) {
        return complain("the thread for lines cannot be started");
    }
    app->loop = loop_create();
    if (app->loop == NULL) {
        return complain("the event loop cannot be made");
    }
    app->can = linux_can_open(app->loop, options->bus, on_ready, app, error, sizeof error);
    if (app->can == NULL) {
        app->status = linux_can_is_bus(options->bus) ? EXIT_MISSING : EXIT_BAD_START;
        return complain(error);
    }
    for (size_t i = 0; i < options->file_count; i++) {
        app->nodes[i] = sim_node_open(app->inis[i], seed, loop_refresh_now_us(app->loop), on_event, app,
                                      error, sizeof error);
        if (app->nodes[i] == NULL) {
            return complain(error);
        }
        app->count++;
    }
    return true;
}

static void close_all(app_t *app)
{
    for (size_t i = 0; i < NODES_MAX; i++) {
        sim_node_close(app->nodes[i]);
        node_ini_free(app->inis[i]);
    }
    if (app->can != NULL) {
        linux_can_close(app->can);
    }
    if (app->loop != NULL) {
        loop_destroy(app->loop);
    }
    line_writer_close(app->out, PATIENCE_MS);
}

static void print_stats(const app_t *app)
{
    pdcp_device_stats_t sum;
    uint32_t store_errors = 0;
    memset(&sum, 0, sizeof sum);
    for (size_t i = 0; i < app->count; i++) {
        const pdcp_device_stats_t *one = pdcp_device_stats(sim_node_device(app->nodes[i]));
        sum.data_in += one->data_in;
        sum.data_out += one->data_out;
        sum.tx_full += one->tx_full;
        sum.bind_requests += one->bind_requests;
        sum.bind_refused += one->bind_refused;
        sum.bulk_failed += one->bulk_failed;
        store_errors += sim_node_store_errors(app->nodes[i]);
    }
    (void)fprintf(stderr,
                  "{\"frames_received\":%" PRIu64 ",\"frames_sent\":%" PRIu64 ",\"sends_refused\":%" PRIu64
                  ",\"data_in\":%" PRIu32 ",\"data_out\":%" PRIu32 ",\"tx_full\":%" PRIu32
                  ",\"bind_requests\":%" PRIu32 ",\"bind_refused\":%" PRIu32 ",\"bulk_failed\":%" PRIu32
                  ",\"store_errors\":%" PRIu32 "}\n",
                  app->frames_received, app->frames_sent, app->sends_refused, sum.data_in, sum.data_out,
                  sum.tx_full, sum.bind_requests, sum.bind_refused, sum.bulk_failed, store_errors);
}

/* Until SIGTERM or SIGINT, or until nobody reads the standard output any more. */
static int run(app_t *app)
{
    do {
        work(app);
        if (line_writer_is_broken(app->out)) {
            (void)complain("standard output cannot be written");
            return EXIT_FAILURE;
        }
    } while (loop_run_once(app->loop));
    return EXIT_SUCCESS;
}

int main(int argc, char **argv)
{
    static const struct argp parser = {option_table,
                                       on_option,
                                       "FILE...",
                                       "Simulated PDCP devices, one described by each FILE (docs/nodes.md). "
                                       "What terminal inputs receive is written to standard output, "
                                       "one JSON object a line.",
                                       NULL,
                                       NULL,
                                       NULL};
    app_t app;
    options_t options;
    memset(&app, 0, sizeof app);
    memset(&options, 0, sizeof options);
    argv[0] = program_invocation_short_name; /* what is wrong with an option is told without a path */
    if (argp_parse(&parser, argc, argv, 0, NULL, &options) != 0) {
        return EXIT_BAD_START;
    }
    app.status = EXIT_BAD_START;
    if (open_all(&app, &options)) {
        app.status = run(&app);
        if (options.stats) {
            print_stats(&app);
        }
    }
    close_all(&app);
    return app.status;
}
