#include "socketcand_server.h"

#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "oneshot.h"
#include "socketcand_text.h"
#include "tcp_listener.h"

#define INPUT_MAX 4096
#define ANSWERS_MAX 1024 /* output room beyond SOCKETCAND_OUTPUT_MAX that frames leave to answers */
#define WORDS_MAX 12     /* of one element: a send of eight bytes has eleven */

typedef enum {
    STAGE_CONNECTED, /* < hi > is sent, open is awaited */
    STAGE_OPENED,    /* rawmode is awaited */
    STAGE_RAW        /* frames go both ways */
} stage_t;

typedef struct {
    socketcand_server_t *server;
    int fd;         /* -1: the client has gone, the port still has frames to send */
    int port;       /* of the bus; also the place in connections[] */
    uint32_t watch; /* events that the loop watches for */
    stage_t stage;
    bool blocked;           /* the socket took no more: EPOLLOUT is awaited */
    bool broken;            /* nothing can be written any more and the loop does not watch it */
    bool stalled;           /* the splitter's element waits for room in the port's queue */
    uint64_t held_until_us; /* frames are not written before; 0: not held */
    socketcand_text_splitter_t splitter;
    size_t in_at; /* in[] is worked through up to here; to its end unless stalled */
    size_t in_used;
    size_t out_used;
    char in[INPUT_MAX];
    char out[SOCKETCAND_OUTPUT_MAX + ANSWERS_MAX];
} connection_t;

struct socketcand_server {
    loop_t *loop;
    sim_bus_t *bus;
    socketcand_changed_t changed;
    void *ctx;
    tcp_listener_t listener;
    int timer; /* end of the next hold */
    bool due;  /* socketcand_server_poll has something to do */
    bool news; /* frames were put on the bus, or a connection has come or gone */
    socketcand_stats_t stats;
    connection_t *connections[SIM_BUS_PORTS_MAX];
};

/* ---- Output ---- */

/* Appends to the output as a whole, or drops and counts it when it would fill more than limit. */
static void put(connection_t *connection, const char *text, size_t length, size_t limit)
{
    if (connection->fd < 0 || connection->broken) {
        return;
    }
    if (connection->out_used + length > limit) {
        connection->server->stats.frames_dropped++;
        return;
    }
    memcpy(&connection->out[connection->out_used], text, length);
    connection->out_used += length;
}

static void answer(connection_t *connection, const char *text)
{
    put(connection, text, strlen(text), sizeof connection->out);
}

static void refuse(connection_t *connection, const char *wrong)
{
    char line[128];

    snprintf(line, sizeof line, "< error %s >", wrong);
    connection->server->stats.bad_elements++;
    answer(connection, line);
}

/* The socket takes no more output. What the client has sent before is still read: see settle. */
static void set_broken(connection_t *connection)
{
    if (!connection->broken) {
        connection->broken = true;
        connection->out_used = 0;
        loop_remove(connection->server->loop, connection->fd);
    }
}

static void flush(connection_t *connection)
{
    size_t written = 0;

    if (connection->fd < 0 || connection->broken) {
        return;
    }
    while (written < connection->out_used) {
        ssize_t n = send(connection->fd, &connection->out[written], connection->out_used - written,
                         MSG_NOSIGNAL | MSG_DONTWAIT);

        if (n < 0 && errno != EAGAIN && errno != EINTR) {
            set_broken(connection);
            return;
        }
        if (n < 0) {
            break;
        }
        written += (size_t)n;
    }
    connection->out_used -= written;
    memmove(connection->out, &connection->out[written], connection->out_used);
}

/* Receive callback of the connection's port. */
static void on_frame(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    connection_t *connection = ctx;
    char line[SOCKETCAND_TEXT_FRAME_BYTES];

    if (connection->stage != STAGE_RAW || connection->fd < 0) {
        return;
    }
    if (frame->kind != CAN_FRAME_BASE && frame->kind != CAN_FRAME_EXTENDED) {
        connection->server->stats.frames_unsupported++;
        return;
    }
    put(connection, line, socketcand_text_format_frame(line, sizeof line, time_us, frame),
        SOCKETCAND_OUTPUT_MAX);
    connection->server->due = true;
}

/* ---- Elements ---- */

static void arm_hold_timer(socketcand_server_t *server)
{
    uint64_t now_us = loop_now_us(server->loop);
    uint64_t next_us = UINT64_MAX;

    for (size_t i = 0; i < SIM_BUS_PORTS_MAX; i++) {
        const connection_t *connection = server->connections[i];

        if (connection != NULL && connection->held_until_us != 0 && connection->held_until_us < next_us) {
            next_us = connection->held_until_us;
        }
    }
    if (next_us != UINT64_MAX) {
        oneshot_arm_us(server->timer, next_us > now_us ? next_us - now_us : 0);
    }
}

/* The handlers of elements return false when the element must wait for room in the port's queue. */

static bool do_open(connection_t *connection, const socketcand_text_t *words, size_t count)
{
    (void)words;
    (void)count;
    if (connection->stage != STAGE_CONNECTED) {
        refuse(connection, "open: already open");
        return true;
    }
    connection->stage = STAGE_OPENED;
    answer(connection, "< ok >");
    return true;
}

static bool do_rawmode(connection_t *connection, const socketcand_text_t *words, size_t count)
{
    socketcand_server_t *server = connection->server;

    (void)words;
    (void)count;
    if (connection->stage == STAGE_CONNECTED) {
        refuse(connection, "rawmode before open");
        return true;
    }
    answer(connection, "< ok >");
    if (connection->stage != STAGE_RAW) {
        connection->stage = STAGE_RAW;
        flush(connection);
        connection->held_until_us = loop_now_us(server->loop) + SOCKETCAND_HOLD_MS * UINT64_C(1000);
        arm_hold_timer(server);
    }
    return true;
}

static bool do_send(connection_t *connection, const socketcand_text_t *words, size_t count)
{
    can_frame_t frame;
    const char *wrong;

    if (connection->stage != STAGE_RAW) {
        refuse(connection, "send before rawmode");
        return true;
    }
    wrong = socketcand_text_parse_send(words + 1, count - 1, &frame);
    if (wrong != NULL) {
        refuse(connection, wrong);
        return true;
    }
    if (!sim_bus_send(connection->server->bus, connection->port, &frame)) {
        return false;
    }
    connection->server->news = true;
    return true;
}

static bool do_echo(connection_t *connection, const socketcand_text_t *words, size_t count)
{
    (void)words;
    (void)count;
    answer(connection, "< echo >");
    return true;
}

static const struct {
    const char *name;
    size_t words_min; /* the name included */
    size_t words_max;
    bool (*run)(connection_t *connection, const socketcand_text_t *words, size_t count);
} commands[] = {
    {"send", 3, 3 + CAN_FRAME_DATA_MAX, do_send},
    {"echo", 1, 1, do_echo},
    {"open", 2, 2, do_open},
    {"rawmode", 1, 1, do_rawmode},
};

/* Carries out the element that the splitter holds. */
static bool run_element(connection_t *connection)
{
    socketcand_text_t words[WORDS_MAX];
    size_t count = socketcand_text_split(socketcand_text_element(&connection->splitter), words, WORDS_MAX);

    connection->held_until_us = 0; /* the client has read the answer to rawmode, or does not wait for it */
    for (size_t i = 0; count > 0 && i < sizeof commands / sizeof commands[0]; i++) {
        if (!socketcand_text_is(words[0], commands[i].name)) {
            continue;
        }
        if (count < commands[i].words_min || count > commands[i].words_max) {
            char wrong[64];

            snprintf(wrong, sizeof wrong, "%s: wrong number of words", commands[i].name);
            refuse(connection, wrong);
            return true;
        }
        return commands[i].run(connection, words, count);
    }
    refuse(connection, "unknown command");
    return true;
}

/* Takes one character of the input. False: the element that it completes must wait. */
static bool take_character(connection_t *connection, char c)
{
    switch (socketcand_text_take(&connection->splitter, c)) {
    case SOCKETCAND_TEXT_STRAY:
        refuse(connection, "text between elements");
        return true;
    case SOCKETCAND_TEXT_TOO_LONG:
        refuse(connection, "element too long");
        return true;
    case SOCKETCAND_TEXT_ELEMENT:
        return connection->splitter.cut || run_element(connection);
    default:
        return true;
    }
}

/* Works through the input, first the element that waits; stops and sets stalled when one must wait. */
static void consume(connection_t *connection)
{
    connection->stalled = connection->stalled && !run_element(connection);
    while (!connection->stalled && connection->in_at < connection->in_used) {
        connection->stalled = !take_character(connection, connection->in[connection->in_at++]);
    }
}

/* ---- Life of a connection ---- */

/* Calls changed if there is a reason. Last thing in every handler, because it may lead to
 * socketcand_server_poll. */
static void tell_news(socketcand_server_t *server)
{
    if (server->news) {
        server->news = false;
        if (server->changed != NULL) {
            server->changed(server->ctx);
        }
    }
}

/* The client has gone and all it sent has been read. */
static void hang_up(connection_t *connection)
{
    socketcand_server_t *server = connection->server;

    set_broken(connection);
    if (connection->splitter.inside && !connection->splitter.cut) {
        server->stats.bad_elements++; /* one without end */
    }
    close(connection->fd);
    connection->fd = -1;
    connection->held_until_us = 0;
    server->stats.connections--;
    server->news = true;
}

/* A client that does not set TCP_NODELAY holds its next frame back until the last one is acknowledged, which
 * the kernel would delay by 40 ms. It forgets this setting, so it is repeated after each read. */
static void acknowledge_at_once(int fd)
{
    int on = 1;

    setsockopt(fd, IPPROTO_TCP, TCP_QUICKACK, &on, sizeof on);
}

/* Reads once and works through what came. The connection is not stalled: in[] is worked through. */
static void take_input(connection_t *connection)
{
    ssize_t n = recv(connection->fd, connection->in, sizeof connection->in, MSG_DONTWAIT);

    if (n > 0) {
        connection->in_at = 0;
        connection->in_used = (size_t)n;
        acknowledge_at_once(connection->fd);
        consume(connection);
    } else if (n == 0 || (errno != EAGAIN && errno != EINTR) || (connection->broken && errno == EAGAIN)) {
        hang_up(connection);
    }
}

/* Writes what may be written and watches for the rest. */
static void settle_output(connection_t *connection)
{
    bool held = connection->held_until_us != 0;
    uint32_t events = connection->stalled ? 0u : (uint32_t)EPOLLIN;

    if (!held && !connection->blocked) {
        flush(connection);
        connection->blocked = connection->out_used > 0;
    }
    if (connection->blocked) {
        events |= (uint32_t)EPOLLOUT;
    }
    if (connection->fd >= 0 && !connection->broken && events != connection->watch) {
        connection->watch = events;
        loop_modify(connection->server->loop, connection->fd, events);
    }
}

/* Does for a connection what can be done now, in the end its removal: the pointer is not valid afterwards. */
static void settle(connection_t *connection)
{
    socketcand_server_t *server = connection->server;

    if (connection->stalled) {
        consume(connection);
    }
    settle_output(connection);
    while (connection->broken && connection->fd >= 0 && !connection->stalled) {
        take_input(connection);
    }
    if (connection->fd >= 0 || server->bus->ports[connection->port].queued > 0) {
        server->due = server->due || connection->stalled || connection->fd < 0;
        return;
    }
    sim_bus_detach(server->bus, connection->port);
    server->connections[connection->port] = NULL;
    free(connection);
}

static void on_socket(void *ctx, uint32_t events)
{
    connection_t *connection = ctx;
    socketcand_server_t *server = connection->server;
    bool lost = (events & (uint32_t)(EPOLLHUP | EPOLLERR)) != 0;

    if ((events & (uint32_t)EPOLLOUT) != 0) {
        connection->blocked = false;
    }
    if (connection->stalled && lost) {
        set_broken(connection); /* or the loop would report it without end */
    } else if (!connection->stalled && (lost || (events & (uint32_t)EPOLLIN) != 0)) {
        take_input(connection);
    }
    settle(connection);
    tell_news(server);
}

/* The hold of frames behind < rawmode > is over (D-SIM-2). */
static void on_hold_over(void *ctx, uint32_t events)
{
    socketcand_server_t *server = ctx;
    uint64_t now_us = loop_now_us(server->loop);

    (void)events;
    for (size_t i = 0; i < SIM_BUS_PORTS_MAX; i++) {
        connection_t *connection = server->connections[i];

        if (connection != NULL && connection->held_until_us != 0 && connection->held_until_us <= now_us) {
            connection->held_until_us = 0;
            settle(connection);
        }
    }
    arm_hold_timer(server);
    tell_news(server);
}

/* Makes a connection of an accepted socket. NULL: *wrong says why not. */
static connection_t *connect_client(socketcand_server_t *server, int fd, const char **wrong)
{
    connection_t *connection = calloc(1, sizeof *connection);

    if (connection == NULL) {
        *wrong = "< error out of memory >";
        return NULL;
    }
    connection->server = server;
    connection->fd = fd;
    connection->watch = EPOLLIN;
    connection->splitter.longest = SOCKETCAND_ELEMENT_MAX - 2; /* without "<" and ">" */
    connection->port = sim_bus_attach(server->bus, on_frame, connection);
    if (connection->port < 0) {
        *wrong = "< error bus full >";
        free(connection);
        return NULL;
    }
    if (!loop_add(server->loop, fd, connection->watch, on_socket, connection)) {
        *wrong = "< error out of descriptors >";
        sim_bus_detach(server->bus, connection->port);
        free(connection);
        return NULL;
    }
    return connection;
}

static void welcome(socketcand_server_t *server, int fd)
{
    const char *wrong = "";
    int on = 1;
    connection_t *connection = connect_client(server, fd, &wrong);

    if (connection == NULL) {
        (void)send(fd, wrong, strlen(wrong), MSG_NOSIGNAL | MSG_DONTWAIT);
        close(fd);
        return;
    }
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    acknowledge_at_once(fd);
    server->connections[connection->port] = connection;
    server->stats.connections++;
    server->news = true;
    answer(connection, "< hi >");
    settle(connection);
}

static void on_listen(void *ctx, uint32_t events)
{
    socketcand_server_t *server = ctx;
    int fd;

    (void)events;
    while ((fd = tcp_listener_accept(&server->listener)) >= 0) {
        welcome(server, fd);
    }
    tell_news(server);
}

/* ---- The server ---- */

/* False: errno says why; what was opened is left to socketcand_server_close. */
static bool open_descriptors(socketcand_server_t *server, uint16_t port)
{
    if (!tcp_listener_open(&server->listener, port)) {
        return false;
    }
    server->timer = oneshot_open(server->loop, on_hold_over, server);
    return server->timer >= 0 && loop_add(server->loop, server->listener.fd, EPOLLIN, on_listen, server);
}

socketcand_server_t *socketcand_server_open(loop_t *loop, sim_bus_t *bus, uint16_t port,
                                            socketcand_changed_t changed, void *ctx, char *error,
                                            size_t error_size)
{
    socketcand_server_t *server = calloc(1, sizeof *server);

    if (server == NULL) {
        snprintf(error, error_size, "127.0.0.1:%u: %s", (unsigned)port, strerror(ENOMEM));
        return NULL;
    }
    server->loop = loop;
    server->bus = bus;
    server->changed = changed;
    server->ctx = ctx;
    server->listener = TCP_LISTENER_CLOSED;
    server->timer = -1;
    if (!open_descriptors(server, port)) {
        snprintf(error, error_size, "127.0.0.1:%u: %s", (unsigned)port, strerror(errno));
        socketcand_server_close(server);
        return NULL;
    }
    return server;
}

static void drop_connection(connection_t *connection)
{
    if (connection->fd >= 0) {
        set_broken(connection);
        close(connection->fd);
    }
    sim_bus_detach(connection->server->bus, connection->port);
    free(connection);
}

void socketcand_server_close(socketcand_server_t *server)
{
    if (server == NULL) {
        return;
    }
    for (size_t i = 0; i < SIM_BUS_PORTS_MAX; i++) {
        if (server->connections[i] != NULL) {
            drop_connection(server->connections[i]);
        }
    }
    if (server->listener.fd >= 0) {
        loop_remove(server->loop, server->listener.fd);
    }
    tcp_listener_close(&server->listener);
    if (server->timer >= 0) {
        oneshot_close(server->loop, server->timer);
    }
    free(server);
}

bool socketcand_server_poll(socketcand_server_t *server)
{
    bool news = false;

    if (server->due) {
        server->due = false;
        for (size_t i = 0; i < SIM_BUS_PORTS_MAX; i++) {
            if (server->connections[i] != NULL) {
                settle(server->connections[i]);
            }
        }
        news = server->news;
        server->news = false;
    }
    return news;
}

uint16_t socketcand_server_port(const socketcand_server_t *server)
{
    return tcp_listener_port(&server->listener);
}

socketcand_stats_t socketcand_server_stats(const socketcand_server_t *server)
{
    return server->stats;
}
