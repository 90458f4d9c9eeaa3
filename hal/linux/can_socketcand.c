/* Client of a socketcand server in raw mode. Everything on the wire is an element "< word ... >" of text. */
#include <ctype.h>
#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "linux_can_backend.h"
#include "oneshot.h"
#include "socketcand_text.h"

#define HOST_BYTES 256
#define PORT_BYTES 8
#define NAME_BYTES 64
#define INPUT_BYTES 4096
#define OUTPUT_BYTES 128
#define HANDSHAKE_LIMIT_US 2000000u
#define BACKOFF_MIN_US 100000u
#define BACKOFF_MAX_US 5000000u
#define MICROSECONDS_PER_MS 1000u

typedef enum {
    STATE_WAITING, /* no connection; the timer starts the next attempt */
    STATE_CONNECTING,
    STATE_GREETING,  /* waits for hi */
    STATE_OPENING,   /* has sent open, waits for ok */
    STATE_SWITCHING, /* has sent rawmode, waits for ok */
    STATE_RAW
} state_t;

typedef struct {
    hal_can_t base;
    state_t state;
    int fd; /* -1 in STATE_WAITING */
    int timer;
    uint64_t backoff_us;
    struct addrinfo *addresses;
    struct addrinfo *next_address; /* NULL: start again with the first */
    char name[NAME_BYTES];

    char input[INPUT_BYTES]; /* as read, parsed up to input_at */
    size_t input_at;
    size_t input_size;
    socketcand_text_splitter_t splitter;

    char output[OUTPUT_BYTES]; /* what the kernel has not taken yet of the last element */
    size_t output_at;
    size_t output_size;
    bool output_is_frame;
    bool lost; /* noticed in a call from outside the loop; acted on inside it */

    char failure[SOCKETCAND_TEXT_MAX + 33]; /* why the last attempt failed */
} can_socketcand_t;

static void on_event(void *ctx, uint32_t events);

static void notify(can_socketcand_t *can)
{
    can->base.ready(can->base.ctx);
}

/* --- the connection --- */

static void disconnect(can_socketcand_t *can, const char *reason)
{
    snprintf(can->failure, sizeof can->failure, "%s", reason);
    if (can->fd >= 0) {
        loop_remove(can->base.loop, can->fd);
        close(can->fd);
        can->fd = -1;
    }
    if (can->output_is_frame && can->output_at < can->output_size) {
        can->base.health.tx_failed++;
    }
    can->output_at = 0;
    can->output_size = 0;
    can->input_at = 0;
    can->input_size = 0;
    can->lost = false;
    can->base.health.state = HAL_CAN_DOWN;
    can->state = STATE_WAITING;
    oneshot_arm_us(can->timer, can->backoff_us);
    can->backoff_us = can->backoff_us * 2 < BACKOFF_MAX_US ? can->backoff_us * 2 : BACKOFF_MAX_US;
}

static void connect_next(can_socketcand_t *can)
{
    const struct addrinfo *to = can->next_address != NULL ? can->next_address : can->addresses;
    can->next_address = to->ai_next;
    can->state = STATE_CONNECTING;
    can->fd = socket(to->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (can->fd < 0) {
        disconnect(can, strerror(errno));
        return;
    }
    int on = 1;
    setsockopt(can->fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    oneshot_arm_us(can->timer, HANDSHAKE_LIMIT_US);
    if ((connect(can->fd, to->ai_addr, to->ai_addrlen) != 0 && errno != EINPROGRESS) ||
        !loop_add(can->base.loop, can->fd, EPOLLIN | EPOLLOUT, on_event, can)) {
        disconnect(can, strerror(errno));
    }
}

/* Sends what is left of the last element and watches for room while something stays. False: the connection
 * failed. */
static bool flush_output(can_socketcand_t *can)
{
    ssize_t n = send(can->fd, can->output + can->output_at, can->output_size - can->output_at,
                     MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n < 0 && errno != EAGAIN && errno != EINTR) {
        return false;
    }
    can->output_at += n > 0 ? (size_t)n : 0;
    if (can->output_at < can->output_size) {
        loop_modify(can->base.loop, can->fd, EPOLLIN | EPOLLOUT);
    }
    return true;
}

/* Sends the element that has been written to output, size characters. */
static bool put_element(can_socketcand_t *can, size_t size)
{
    can->output_at = 0;
    can->output_size = size;
    can->output_is_frame = can->state == STATE_RAW;
    return flush_output(can);
}

/* --- elements --- */

/* Reads what has come. False: the connection is gone. */
static bool fill_input(can_socketcand_t *can)
{
    ssize_t n = recv(can->fd, can->input, sizeof can->input, MSG_DONTWAIT);
    can->input_at = 0;
    can->input_size = n > 0 ? (size_t)n : 0;
    return n > 0 || (n < 0 && (errno == EAGAIN || errno == EINTR));
}

static bool next_element(can_socketcand_t *can)
{
    while (can->input_at < can->input_size) {
        char c = can->input[can->input_at++];
        if (!isprint((unsigned char)c)) {
            c = ' '; /* the user may be shown the element */
        }
        if (socketcand_text_take(&can->splitter, c) == SOCKETCAND_TEXT_ELEMENT) {
            return true;
        }
    }
    return false;
}

/* Makes a frame of the complete element. False: it is none. */
static bool take_frame(can_socketcand_t *can, can_frame_t *frame)
{
    socketcand_text_t rest = socketcand_text_element(&can->splitter);
    socketcand_text_t name;
    (void)socketcand_text_next(&rest, &name);
    if (socketcand_text_is(name, "frame")) {
        if (!can->splitter.cut && socketcand_text_parse_frame(rest, frame)) {
            return true;
        }
        can->base.health.rx_overruns++;
    } else if (socketcand_text_is(name, "error")) {
        if (socketcand_text_parse_error(rest)) {
            *frame = (can_frame_t){.kind = CAN_FRAME_ERROR};
            return true;
        }
        can->base.health.tx_failed++; /* all that a server gets in raw mode are frames to send */
    }
    return false;
}

/* --- the handshake --- */

static bool answer_greeting(can_socketcand_t *can, socketcand_text_t word)
{
    if (socketcand_text_is(word, "hi") && can->state == STATE_GREETING) {
        can->state = STATE_OPENING;
        return put_element(can, (size_t)snprintf(can->output, sizeof can->output, "< open %s >", can->name));
    }
    if (socketcand_text_is(word, "ok") && can->state == STATE_OPENING) {
        can->state = STATE_SWITCHING;
        return put_element(can, (size_t)snprintf(can->output, sizeof can->output, "< rawmode >"));
    }
    if (socketcand_text_is(word, "ok") && can->state == STATE_SWITCHING) {
        can->state = STATE_RAW;
        can->backoff_us = BACKOFF_MIN_US;
        can->base.health.state = HAL_CAN_ACTIVE;
    }
    return true;
}

/* The server refuses the bus. text: what follows the word "error". */
static void take_refusal(can_socketcand_t *can, socketcand_text_t text)
{
    char reason[sizeof can->failure];
    while (text.length > 0 && text.text[text.length - 1] == ' ') {
        text.length--;
    }
    snprintf(reason, sizeof reason, "the server says:%.*s", (int)text.length, text.text);
    disconnect(can, reason);
}

/* Works through the elements that have come, up to raw mode. What follows then is left in the input. */
static void shake_hands(can_socketcand_t *can)
{
    if (!fill_input(can)) {
        disconnect(can, "the server closed the connection");
        return;
    }
    while (can->state != STATE_RAW && next_element(can)) {
        socketcand_text_t rest = socketcand_text_element(&can->splitter);
        socketcand_text_t word;
        (void)socketcand_text_next(&rest, &word);
        if (socketcand_text_is(word, "error")) {
            take_refusal(can, rest);
            return;
        }
        if (!answer_greeting(can, word)) {
            disconnect(can, strerror(errno));
            return;
        }
    }
}

static void finish_connect(can_socketcand_t *can)
{
    int failure = 0;
    socklen_t size = sizeof failure;
    getsockopt(can->fd, SOL_SOCKET, SO_ERROR, &failure, &size);
    if (failure != 0) {
        disconnect(can, strerror(failure));
        return;
    }
    can->state = STATE_GREETING;
    loop_modify(can->base.loop, can->fd, EPOLLIN);
}

/* One step from the connection to raw mode. */
static void advance(can_socketcand_t *can, uint32_t events)
{
    if (can->state == STATE_CONNECTING) {
        finish_connect(can);
        return;
    }
    if ((events & EPOLLOUT) != 0) {
        loop_modify(can->base.loop, can->fd, EPOLLIN);
        if (!flush_output(can)) {
            disconnect(can, strerror(errno));
            return;
        }
    }
    if ((events & (EPOLLIN | EPOLLERR | EPOLLHUP)) != 0) {
        shake_hands(can);
    }
}

static void on_raw_event(can_socketcand_t *can, uint32_t events)
{
    if ((events & EPOLLOUT) != 0) {
        loop_modify(can->base.loop, can->fd, EPOLLIN);
        can->lost = !flush_output(can) || can->lost;
    }
    notify(can);
    if (can->lost) {
        disconnect(can, "the connection was lost");
        notify(can);
    }
}

/* What the caller left in the input is offered again: the socket may have nothing new to report. */
static void offer_rest(can_socketcand_t *can)
{
    if (can->state == STATE_RAW && can->input_at < can->input_size) {
        oneshot_arm_us(can->timer, 0);
    }
}

static void on_event(void *ctx, uint32_t events)
{
    can_socketcand_t *can = ctx;
    if (can->state == STATE_RAW) {
        on_raw_event(can, events);
    } else {
        advance(can, events);
        if (can->state == STATE_RAW) {
            notify(can);
        }
    }
    offer_rest(can);
}

static void on_timer(void *ctx, uint32_t events)
{
    can_socketcand_t *can = ctx;
    (void)events;
    switch (can->state) {
    case STATE_WAITING:
        connect_next(can);
        break;
    case STATE_RAW:
        on_raw_event(can, 0);
        offer_rest(can);
        break;
    default:
        disconnect(can, "no answer within 2 s");
        break;
    }
}

/* --- the contract --- */

static size_t can_socketcand_receive(hal_can_t *base, can_frame_t *frames, size_t max)
{
    can_socketcand_t *can = (can_socketcand_t *)base;
    size_t n = 0;
    bool drained = can->state != STATE_RAW;
    while (n < max) {
        if (can->state == STATE_RAW && next_element(can)) {
            n += take_frame(can, &frames[n]) ? 1u : 0u;
        } else if (drained) {
            break;
        } else if (!fill_input(can)) {
            can->lost = true;
            break;
        } else {
            drained = can->input_size < sizeof can->input;
        }
    }
    return n;
}

static bool can_socketcand_send(hal_can_t *base, const can_frame_t *frame)
{
    can_socketcand_t *can = (can_socketcand_t *)base;
    if (can->state != STATE_RAW || can->output_at < can->output_size) {
        return false;
    }
    if (put_element(can, socketcand_text_format_send(can->output, sizeof can->output, frame))) {
        return true;
    }
    can->output_size = 0; /* not taken; epoll reports the lost connection */
    can->output_at = 0;
    return false;
}

/* The protocol says nothing of bus-off and has no filters in raw mode. */
static void can_socketcand_restart(hal_can_t *base)
{
    (void)base;
}

static void can_socketcand_set_filters(hal_can_t *base, const hal_can_filter_t *filters, size_t n)
{
    (void)base;
    (void)filters;
    (void)n;
}

static void can_socketcand_close(hal_can_t *base)
{
    can_socketcand_t *can = (can_socketcand_t *)base;
    if (can->fd >= 0) {
        loop_remove(base->loop, can->fd);
        close(can->fd);
    }
    oneshot_close(base->loop, can->timer);
    if (can->addresses != NULL) {
        freeaddrinfo(can->addresses);
    }
    free(can);
}

/* HOST:PORT/NAME. Returns what is wrong with it, or NULL. */
static const char *take_address(can_socketcand_t *can, const char *address)
{
    const char *slash = strchr(address, '/');
    const char *colon = slash == NULL ? NULL : memrchr(address, ':', (size_t)(slash - address));
    if (colon == NULL) {
        return "expected socketcand:HOST:PORT/NAME";
    }
    const char *name = slash + 1;
    if (name[0] == '\0' || strlen(name) >= sizeof can->name || strpbrk(name, "<> \t\r\n") != NULL) {
        return "not a bus name after the slash";
    }
    memcpy(can->name, name, strlen(name) + 1);
    char host[HOST_BYTES];
    char port[PORT_BYTES];
    size_t host_size = (size_t)(colon - address);
    size_t port_size = (size_t)(slash - colon - 1);
    if (host_size == 0 || host_size >= sizeof host || port_size == 0 || port_size >= sizeof port) {
        return "expected socketcand:HOST:PORT/NAME";
    }
    memcpy(host, address, host_size);
    host[host_size] = '\0';
    memcpy(port, colon + 1, port_size);
    port[port_size] = '\0';
    struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM, .ai_flags = AI_NUMERICSERV};
    int failure = getaddrinfo(host, port, &hints, &can->addresses);
    return failure == 0 ? NULL : gai_strerror(failure);
}

static bool is_address(const char *address)
{
    const char *slash = strchr(address, '/');
    const char *colon = slash == NULL ? NULL : memrchr(address, ':', (size_t)(slash - address));
    return colon != NULL && colon > address && colon + 1 < slash && slash[1] != '\0';
}

/* Waits for the next step of the handshake. False: the time is over. */
static bool wait_for_step(can_socketcand_t *can, uint64_t limit_us)
{
    uint64_t now_us = loop_refresh_now_us(can->base.loop);
    if (now_us >= limit_us) {
        return false;
    }
    bool writes = can->state == STATE_CONNECTING || can->output_at < can->output_size;
    struct pollfd watched = {.fd = can->fd, .events = (short)(POLLIN | (writes ? POLLOUT : 0))};
    int timeout_ms = (int)((limit_us - now_us) / MICROSECONDS_PER_MS) + 1;
    if (poll(&watched, 1, timeout_ms) > 0) {
        advance(can, (uint32_t)watched.revents); /* EPOLLIN and POLLIN are the same bits */
    }
    return true;
}

/* The first connection is waited for: what is wrong with the arguments is to be told at the start. Returns
 * what went wrong, or NULL. */
static const char *connect_now(can_socketcand_t *can)
{
    uint64_t limit_us = loop_refresh_now_us(can->base.loop) + HANDSHAKE_LIMIT_US;
    connect_next(can);
    while (can->state != STATE_RAW) {
        if (can->state != STATE_WAITING) {
            if (!wait_for_step(can, limit_us)) {
                return "no answer within 2 s";
            }
        } else if (can->next_address != NULL) {
            connect_next(can);
        } else {
            return can->failure;
        }
    }
    return NULL;
}

static const char *start(can_socketcand_t *can, const char *address)
{
    can->timer = oneshot_open(can->base.loop, on_timer, can);
    if (can->timer < 0) {
        return strerror(errno);
    }
    const char *reason = take_address(can, address);
    return reason != NULL ? reason : connect_now(can);
}

static hal_can_t *can_socketcand_open(const linux_can_request_t *request)
{
    can_socketcand_t *can = calloc(1, sizeof *can);
    if (can == NULL) {
        linux_can_backend_refuse(request, strerror(errno));
        return NULL;
    }
    linux_can_backend_init(&can->base, &can_socketcand_backend, request);
    can->fd = -1;
    can->timer = -1;
    can->backoff_us = BACKOFF_MIN_US;
    can->splitter.longest = SOCKETCAND_TEXT_MAX;
    can->splitter.restarts = true;
    const char *reason = start(can, request->address);
    if (reason != NULL) {
        linux_can_backend_refuse(request, reason);
        can_socketcand_close(&can->base);
        return NULL;
    }
    offer_rest(can);
    return &can->base;
}

const linux_can_backend_t can_socketcand_backend = {.kind = "socketcand",
                                                    .is_address = is_address,
                                                    .open = can_socketcand_open,
                                                    .close = can_socketcand_close,
                                                    .send = can_socketcand_send,
                                                    .receive = can_socketcand_receive,
                                                    .restart = can_socketcand_restart,
                                                    .set_filters = can_socketcand_set_filters};
