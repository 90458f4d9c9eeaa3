#include "socketcand_server.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "oneshot.h"

#define INPUT_MAX 4096
#define ANSWERS_MAX 1024 /* output room beyond SOCKETCAND_OUTPUT_MAX that frames leave to answers */
#define WORDS_MAX 12     /* of one element: a send of eight bytes has eleven */
#define LISTEN_BACKLOG 128

#define EXTENDED_ID_MAX 0x1FFFFFFFu
#define BASE_ID_DIGITS 3u

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
    bool stalled;           /* the first element of in[] waits for room in the port's queue */
    bool skipping;          /* up to the next ">": an element was too long */
    bool noise;             /* text between elements has been reported */
    uint64_t held_until_us; /* frames are not written before; 0: not held */
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
    int listen_fd;
    int spare_fd; /* given up for a moment to refuse a client when descriptors have run out */
    int timer;    /* end of the next hold */
    bool due;     /* socketcand_server_poll has something to do */
    bool news;    /* frames were put on the bus, or a connection has come or gone */
    socketcand_stats_t stats;
    connection_t *connections[SIM_BUS_PORTS_MAX];
};

typedef struct {
    const char *text;
    size_t length;
} word_t;

/* ---- Text of the protocol ---- */

static bool is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/* Splits at white space. Stops at WORDS_MAX words, which no element may have. */
static size_t split(const char *text, size_t length, word_t words[WORDS_MAX])
{
    size_t count = 0;
    size_t i = 0;

    while (count < WORDS_MAX) {
        while (i < length && is_space(text[i])) {
            i++;
        }
        if (i == length) {
            break;
        }
        words[count].text = &text[i];
        while (i < length && !is_space(text[i])) {
            i++;
        }
        words[count].length = (size_t)(&text[i] - words[count].text);
        count++;
    }
    return count;
}

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    if (c >= 'A' && c <= 'F') {
        return c - 'A' + 10;
    }
    if (c >= 'a' && c <= 'f') {
        return c - 'a' + 10;
    }
    return -1;
}

/* False: not one to digits_max (at most 8) hexadecimal digits. */
static bool parse_hex(word_t word, size_t digits_max, uint32_t *value)
{
    *value = 0;
    if (word.length > digits_max) {
        return false;
    }
    for (size_t i = 0; i < word.length; i++) {
        int digit = hex_digit(word.text[i]);

        if (digit < 0) {
            return false;
        }
        *value = *value << 4 | (uint32_t)digit;
    }
    return word.length > 0;
}

/* Returns what is wrong with the identifier, or NULL. */
static const char *parse_id(word_t word, can_frame_t *frame)
{
    uint32_t id;

    if (!parse_hex(word, 8, &id)) {
        return "identifier is not one to eight hexadecimal digits";
    }
    if (word.length > BASE_ID_DIGITS) {
        frame->kind = CAN_FRAME_EXTENDED;
        return id > EXTENDED_ID_MAX ? "identifier over 1FFFFFFF" : NULL;
    }
    if (id > CAN_FRAME_ID_MAX) {
        return "identifier over 7FF with three digits";
    }
    frame->kind = CAN_FRAME_BASE;
    frame->id = (uint16_t)id;
    return NULL;
}

/* Words of < send ID DLC BYTE... >. Returns what is wrong with them, or NULL. */
static const char *parse_frame(const word_t *words, size_t count, can_frame_t *frame)
{
    uint32_t value;
    const char *wrong;

    memset(frame, 0, sizeof *frame);
    wrong = parse_id(words[1], frame);
    if (wrong != NULL) {
        return wrong;
    }
    if (!parse_hex(words[2], 1, &value) || value > CAN_FRAME_DATA_MAX) {
        return "DLC is not 0 to 8";
    }
    frame->dlc = (uint8_t)value;
    if (count - 3 != frame->dlc) {
        return "DLC and number of data bytes differ";
    }
    for (size_t i = 0; i < frame->dlc; i++) {
        if (!parse_hex(words[3 + i], 2, &value)) {
            return "data byte is not one or two hexadecimal digits";
        }
        frame->data[i] = (uint8_t)value;
    }
    return NULL;
}

/* < frame ... >; returns its length. Without data two spaces remain: python-can counts on both. */
static size_t format_frame(char *line, size_t size, uint64_t time_us, const can_frame_t *frame)
{
    char data[2 * CAN_FRAME_DATA_MAX + 1] = "";
    int id_digits = frame->kind == CAN_FRAME_EXTENDED ? 8 : (int)BASE_ID_DIGITS;

    for (size_t i = 0; i < frame->dlc && i < CAN_FRAME_DATA_MAX; i++) {
        snprintf(&data[2 * i], 3, "%02X", frame->data[i]);
    }
    return (size_t)snprintf(line, size, "< frame %0*X %" PRIu64 ".%06u %s >", id_digits, frame->id,
                            time_us / 1000000u, (unsigned)(time_us % 1000000u), data);
}

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
    char line[64];

    if (connection->stage != STAGE_RAW || connection->fd < 0) {
        return;
    }
    if (frame->kind != CAN_FRAME_BASE && frame->kind != CAN_FRAME_EXTENDED) {
        connection->server->stats.frames_unsupported++;
        return;
    }
    put(connection, line, format_frame(line, sizeof line, time_us, frame), SOCKETCAND_OUTPUT_MAX);
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

static bool do_open(connection_t *connection, const word_t *words, size_t count)
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

static bool do_rawmode(connection_t *connection, const word_t *words, size_t count)
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

static bool do_send(connection_t *connection, const word_t *words, size_t count)
{
    can_frame_t frame;
    const char *wrong;

    if (connection->stage != STAGE_RAW) {
        refuse(connection, "send before rawmode");
        return true;
    }
    wrong = parse_frame(words, count, &frame);
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

static bool do_echo(connection_t *connection, const word_t *words, size_t count)
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
    bool (*run)(connection_t *connection, const word_t *words, size_t count);
} commands[] = {
    {"send", 3, 3 + CAN_FRAME_DATA_MAX, do_send},
    {"echo", 1, 1, do_echo},
    {"open", 2, 2, do_open},
    {"rawmode", 1, 1, do_rawmode},
};

/* text: what stands between "<" and ">". */
static bool run_element(connection_t *connection, const char *text, size_t length)
{
    word_t words[WORDS_MAX];
    size_t count = split(text, length, words);

    connection->held_until_us = 0; /* the client has read the answer to rawmode, or does not wait for it */
    for (size_t i = 0; count > 0 && i < sizeof commands / sizeof commands[0]; i++) {
        if (strlen(commands[i].name) != words[0].length ||
            memcmp(commands[i].name, words[0].text, words[0].length) != 0) {
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

/* Returns the place of the next "<", or in_used. Text before it is reported once. */
static size_t find_element(connection_t *connection, size_t from)
{
    size_t at = from;

    while (at < connection->in_used && connection->skipping) {
        connection->skipping = connection->in[at++] != '>';
    }
    while (at < connection->in_used && connection->in[at] != '<') {
        if (!is_space(connection->in[at]) && !connection->noise) {
            connection->noise = true;
            refuse(connection, "text between elements");
        }
        at++;
    }
    if (at < connection->in_used) {
        connection->noise = false;
    }
    return at;
}

/* Works through the complete elements of the input; stops and sets stalled when one must wait. */
static void consume(connection_t *connection)
{
    size_t at = 0;

    connection->stalled = false;
    for (;;) {
        at = find_element(connection, at);

        const char *start = &connection->in[at];
        size_t left = connection->in_used - at;
        const char *end = memchr(start, '>', left);
        size_t length = end != NULL ? (size_t)(end - start) + 1 : left;

        if (length > SOCKETCAND_ELEMENT_MAX) {
            refuse(connection, "element too long");
            connection->skipping = end == NULL;
        } else if (end == NULL) {
            break;
        } else if (!run_element(connection, start + 1, length - 2)) {
            connection->stalled = true;
            break;
        }
        at += length;
    }
    connection->in_used -= at;
    memmove(connection->in, &connection->in[at], connection->in_used);
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
    if (connection->in_used > 0) {
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

/* Reads once and works through what came. The connection is not stalled: in[] has room. */
static void take_input(connection_t *connection)
{
    ssize_t n = recv(connection->fd, &connection->in[connection->in_used],
                     sizeof connection->in - connection->in_used, MSG_DONTWAIT);

    if (n > 0) {
        connection->in_used += (size_t)n;
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

/* Descriptors have run out. A client that waits in the backlog would wake the loop without end: it is
 * accepted with the spare descriptor and closed. False: that did not help. */
static bool turn_away(socketcand_server_t *server)
{
    int fd;

    if (server->spare_fd < 0) {
        return false;
    }
    close(server->spare_fd);
    fd = accept4(server->listen_fd, NULL, NULL, SOCK_CLOEXEC);
    if (fd >= 0) {
        close(fd);
    }
    server->spare_fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
    return fd >= 0;
}

static void on_listen(void *ctx, uint32_t events)
{
    socketcand_server_t *server = ctx;
    bool more = true;

    (void)events;
    while (more) {
        int fd = accept4(server->listen_fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);

        if (fd >= 0) {
            welcome(server, fd);
        } else {
            more = (errno == EMFILE || errno == ENFILE) && turn_away(server);
        }
    }
    tell_news(server);
}

/* ---- The server ---- */

/* Returns the listening socket, or -1: errno says why. */
static int open_listener(uint16_t port)
{
    struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    int on = 1;
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);

    if (fd < 0) {
        return -1;
    }
    if (setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
        bind(fd, (const struct sockaddr *)&address, sizeof address) != 0 || listen(fd, LISTEN_BACKLOG) != 0) {
        int reason = errno;

        close(fd);
        errno = reason;
        return -1;
    }
    return fd;
}

/* False: errno says why; what was opened is left to socketcand_server_close. */
static bool open_descriptors(socketcand_server_t *server, uint16_t port)
{
    server->listen_fd = open_listener(port);
    if (server->listen_fd < 0) {
        return false;
    }
    server->timer = oneshot_open(server->loop, on_hold_over, server);
    if (server->timer < 0) {
        return false;
    }
    server->spare_fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
    return server->spare_fd >= 0 && loop_add(server->loop, server->listen_fd, EPOLLIN, on_listen, server);
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
    server->listen_fd = -1;
    server->spare_fd = -1;
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
    if (server->listen_fd >= 0) {
        loop_remove(server->loop, server->listen_fd);
        close(server->listen_fd);
    }
    if (server->timer >= 0) {
        oneshot_close(server->loop, server->timer);
    }
    if (server->spare_fd >= 0) {
        close(server->spare_fd);
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
    struct sockaddr_in address = {.sin_port = 0};
    socklen_t size = sizeof address;

    (void)getsockname(server->listen_fd, (struct sockaddr *)&address, &size);
    return ntohs(address.sin_port);
}

socketcand_stats_t socketcand_server_stats(const socketcand_server_t *server)
{
    return server->stats;
}
