/* SocketCAN: one raw socket of the kernel, bound to an interface while that is up. */
#include <arpa/inet.h>
#include <errno.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/filter.h>
#include <linux/sock_diag.h>
#include <net/if.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "can_link.h"
#include "linux_can_backend.h"
#include "linux_can_frame.h"
#include "oneshot.h"

#define BATCH_MAX 32
#define FILTERS_MAX 64 /* jumps of the filter program reach 255 instructions */
#define RECEIVE_BUFFER_BYTES (1024 * 1024)
#define QUEUE_FULL_RETRY_US 1000u
#define LOST_RECHECK_US 10000u

/* The socket is watched edge-triggered: after one wake-up for one frame the kernel need not look at it again.
 * It is therefore read until it is empty, which a batch shorter than asked for proves. */
#define WATCH_FRAMES (EPOLLIN | EPOLLET)
#define WATCH_ROOM (EPOLLIN | EPOLLOUT | EPOLLET)

typedef struct {
    hal_can_t base;
    char name[IFNAMSIZ];
    int fd; /* -1: the interface is down or gone */
    int ifindex;
    int link_fd;
    int timer;
    bool drained;        /* nothing left to read since the last EPOLLIN */
    bool backlog;        /* a full batch was read since the socket was last empty: it may have overrun */
    bool awaiting_room;  /* EPOLLOUT is watched: the socket's own buffer is full */
    bool awaiting_retry; /* the timer runs: the interface's queue is full, which nobody reports the end of */
    uint32_t drops;      /* the socket's own count of overruns, as last read */
    size_t filters_n;
    hal_can_filter_t filters[FILTERS_MAX];
    struct canfd_frame received[BATCH_MAX];
    struct iovec buffers[BATCH_MAX];
    struct mmsghdr messages[BATCH_MAX];
} can_socketcan_t;

static void on_event(void *ctx, uint32_t events);

static void notify(can_socketcan_t *can)
{
    can->base.ready(can->base.ctx);
}

/* --- the acceptance filter --- */

/* CAN_RAW's own filters look at identifiers alone and would hide FD frames with a base identifier, which are
 * to be counted; a socket filter sees the length too. Words are loaded in network order. */
static size_t build_filter(const can_socketcan_t *can, struct sock_filter *program)
{
    size_t accept = 4 + 3 * can->filters_n + 1;
    size_t at = 0;
    program[at++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_LEN, 0);
    program[at] =
        (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, CAN_MTU, 0, (uint8_t)(accept - at - 1));
    at++;
    program[at++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, 0);
    program[at] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K,
                                               htonl(CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG),
                                               (uint8_t)(accept - at - 1), 0);
    at++;
    for (size_t i = 0; i < can->filters_n; i++) {
        const hal_can_filter_t *filter = &can->filters[i];
        program[at++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, 0);
        program[at++] =
            (struct sock_filter)BPF_STMT(BPF_ALU | BPF_AND | BPF_K, htonl(filter->mask & CAN_SFF_MASK));
        program[at] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, htonl(filter->id),
                                                   (uint8_t)(accept - at - 1), 0);
        at++;
    }
    program[at++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, 0);
    program[at++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, UINT32_MAX);
    return at;
}

static void apply_filters(const can_socketcan_t *can, int fd)
{
    int unused = 0;
    if (can->filters_n == 0) {
        setsockopt(fd, SOL_SOCKET, SO_DETACH_FILTER, &unused, sizeof unused);
        return;
    }
    struct sock_filter instructions[4 + 3 * FILTERS_MAX + 2];
    struct sock_fprog program = {.len = (uint16_t)build_filter(can, instructions), .filter = instructions};
    /* Without the filter everything is accepted, which is allowed. */
    if (setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) != 0) {
        setsockopt(fd, SOL_SOCKET, SO_DETACH_FILTER, &unused, sizeof unused);
    }
}

static void can_socketcan_set_filters(hal_can_t *base, const hal_can_filter_t *filters, size_t n)
{
    can_socketcan_t *can = (can_socketcan_t *)base;
    can->filters_n = n > FILTERS_MAX ? 0 : n;
    if (can->filters_n > 0) {
        memcpy(can->filters, filters, n * sizeof filters[0]);
    }
    if (can->fd >= 0) {
        apply_filters(can, can->fd);
    }
}

/* --- coming and going of the interface --- */

static bool set_option(int fd, int level, int option, uint32_t value)
{
    return setsockopt(fd, level, option, &value, sizeof value) == 0;
}

static bool set_up_socket(const can_socketcan_t *can, int fd, int ifindex)
{
    bool ok = set_option(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, CAN_ERR_MASK) &&
              set_option(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, 1);
    if (!ok) {
        return false;
    }
    /* The kernel raises this to its minimum, some six frames: less than a CAN interface's queue of ten, so
     * that a full bus shows as EAGAIN, whose end epoll reports, rather than as ENOBUFS. */
    set_option(fd, SOL_SOCKET, SO_SNDBUF, 1);
    if (!set_option(fd, SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES)) {
        set_option(fd, SOL_SOCKET, SO_RCVBUF, RECEIVE_BUFFER_BYTES);
    }
    if (can->filters_n > 0) {
        apply_filters(can, fd);
    }
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = ifindex};
    return bind(fd, (const struct sockaddr *)&address, sizeof address) == 0;
}

/* Opens a socket on an interface that is up. False: errno says why. */
static bool attach(can_socketcan_t *can, int ifindex)
{
    int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (fd < 0) {
        return false;
    }
    if (!set_up_socket(can, fd, ifindex) || !loop_add(can->base.loop, fd, WATCH_FRAMES, on_event, can)) {
        int reason = errno;
        close(fd);
        errno = reason;
        return false;
    }
    can->fd = fd;
    can->ifindex = ifindex;
    can->drained = false;
    can->drops = 0;
    can_link_health(ifindex, &can->base.health);
    return true;
}

static void detach(can_socketcan_t *can)
{
    if (can->fd >= 0) {
        loop_remove(can->base.loop, can->fd);
        close(can->fd);
    }
    can->fd = -1;
    can->backlog = false;
    can->awaiting_room = false;
    can->awaiting_retry = false;
    can->base.health.state = HAL_CAN_DOWN;
}

/* Lets the caller take the frames that came before the bus went: first the error is taken off the socket,
 * which would be reported in their place. */
static void read_rest(can_socketcan_t *can)
{
    int failure = 0;
    socklen_t size = sizeof failure;
    getsockopt(can->fd, SOL_SOCKET, SO_ERROR, &failure, &size);
    can->drained = false;
    notify(can);
}

/* The socket has failed. Whether the interface is really down is looked at a little later, from the loop: a
 * caller in the middle of hal_can_send is not called back, and a socket that fails again and again keeps
 * nobody busy. */
static void lose(can_socketcan_t *can)
{
    detach(can);
    oneshot_arm_us(can->timer, LOST_RECHECK_US);
}

/* Brings the socket in line with the interface. True: it was opened or closed. */
static bool follow_interface(can_socketcan_t *can)
{
    can_link_t link;
    bool usable = can_link_find(can->link_fd, can->name, &link) && link.is_can && link.up;
    bool changed = false;
    if (can->fd >= 0 && (!usable || link.index != can->ifindex)) {
        read_rest(can);
        detach(can);
        changed = true;
    }
    if (can->fd < 0 && usable) {
        if (attach(can, link.index)) {
            changed = true;
        } else {
            oneshot_arm_us(can->timer, LOST_RECHECK_US);
        }
    }
    return changed;
}

static void on_link(void *ctx, uint32_t events)
{
    can_socketcan_t *can = ctx;
    (void)events;
    can_link_drain(can->link_fd);
    if (follow_interface(can)) {
        notify(can);
    }
}

static void on_timer(void *ctx, uint32_t events)
{
    can_socketcan_t *can = ctx;
    (void)events;
    can->awaiting_retry = false;
    if (can->fd < 0) {
        follow_interface(can);
    }
    notify(can);
}

static void on_event(void *ctx, uint32_t events)
{
    can_socketcan_t *can = ctx;
    if ((events & EPOLLIN) != 0) {
        can->drained = false;
    }
    if ((events & EPOLLOUT) != 0 && can->awaiting_room) {
        can->awaiting_room = false;
        loop_modify(can->base.loop, can->fd, WATCH_FRAMES);
    }
    if ((events & EPOLLERR) != 0) {
        read_rest(can);
        lose(can);
        return;
    }
    notify(can);
    if (can->fd >= 0 && !can->drained) {
        loop_modify(can->base.loop, can->fd, can->awaiting_room ? WATCH_ROOM : WATCH_FRAMES);
    }
}

/* --- frames --- */

/* The socket counts what did not fit; asked once after each backlog, so that a quiet bus costs nothing. */
static void count_overruns(can_socketcan_t *can)
{
    uint32_t info[SK_MEMINFO_VARS] = {0};
    socklen_t size = sizeof info;
    if (getsockopt(can->fd, SOL_SOCKET, SO_MEMINFO, info, &size) == 0) {
        can->base.health.rx_overruns += info[SK_MEMINFO_DROPS] - can->drops;
        can->drops = info[SK_MEMINFO_DROPS];
    }
}

static bool is_momentary(int reason)
{
    return reason == EAGAIN || reason == EINTR || reason == ENOMEM || reason == ENOBUFS;
}

static size_t can_socketcan_receive(hal_can_t *base, can_frame_t *frames, size_t max)
{
    can_socketcan_t *can = (can_socketcan_t *)base;
    if (can->drained || can->fd < 0 || max == 0) {
        return 0;
    }
    unsigned room = max < BATCH_MAX ? (unsigned)max : BATCH_MAX;
    int n = recvmmsg(can->fd, can->messages, room, MSG_DONTWAIT, NULL);
    if (n < 0 && !is_momentary(errno)) {
        lose(can);
        return 0;
    }
    size_t received = n < 0 ? 0 : (size_t)n;
    can->drained = received < room;
    if (!can->drained) {
        can->backlog = true;
    } else if (can->backlog) {
        can->backlog = false;
        count_overruns(can);
    }
    for (size_t i = 0; i < received; i++) {
        const struct canfd_frame *in = &can->received[i];
        linux_can_frame_decode(in->can_id, can->messages[i].msg_len != CAN_MTU, in->len, in->data,
                               &frames[i]);
        if (frames[i].kind == CAN_FRAME_ERROR) {
            linux_can_frame_note_error(in->can_id, in->data, &base->health);
        }
    }
    return received;
}

static void refuse_for_now(can_socketcan_t *can, int reason)
{
    if (reason == EAGAIN) {
        can->awaiting_room = true;
        loop_modify(can->base.loop, can->fd, WATCH_ROOM);
    } else if (is_momentary(reason)) {
        can->awaiting_retry = true;
        oneshot_arm_us(can->timer, QUEUE_FULL_RETRY_US);
    } else {
        lose(can);
    }
}

static bool can_socketcan_send(hal_can_t *base, const can_frame_t *frame)
{
    can_socketcan_t *can = (can_socketcan_t *)base;
    if (can->fd < 0 || can->awaiting_room || can->awaiting_retry) {
        return false;
    }
    struct can_frame out = {.can_id = frame->id & CAN_SFF_MASK,
                            .can_dlc = frame->dlc > CAN_MAX_DLEN ? CAN_MAX_DLEN : frame->dlc};
    memcpy(out.data, frame->data, out.can_dlc);
    if (send(can->fd, &out, sizeof out, MSG_DONTWAIT) == (ssize_t)sizeof out) {
        return true;
    }
    refuse_for_now(can, errno);
    return false;
}

static void can_socketcan_restart(hal_can_t *base)
{
    can_socketcan_t *can = (can_socketcan_t *)base;
    if (base->health.state == HAL_CAN_BUS_OFF) {
        can_link_restart(can->link_fd, can->ifindex);
    }
}

/* --- opening and closing --- */

static void can_socketcan_close(hal_can_t *base)
{
    can_socketcan_t *can = (can_socketcan_t *)base;
    detach(can);
    oneshot_close(base->loop, can->timer);
    if (can->link_fd >= 0) {
        loop_remove(base->loop, can->link_fd);
        close(can->link_fd);
    }
    free(can);
}

static const char *reason_of(int error)
{
    switch (error) {
    case EAFNOSUPPORT:
    case EPROTONOSUPPORT:
        return "this kernel has no CAN (modules can and can-raw)";
    case EPERM:
    case EACCES:
        return "not permitted to open a CAN socket";
    default:
        return strerror(error);
    }
}

/* 0, or why this process cannot have a CAN socket at all. */
static int probe_kernel(void)
{
    int fd = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    if (fd < 0) {
        return errno;
    }
    close(fd);
    return 0;
}

static bool first_attach(can_socketcan_t *can, const linux_can_request_t *request)
{
    can_link_t link;
    int lack = probe_kernel();
    if (!can_link_find(can->link_fd, can->name, &link)) {
        linux_can_backend_refuse(request, lack == EAFNOSUPPORT
                                              ? "no such network interface, and this kernel has no CAN"
                                              : "no such network interface");
        return false;
    }
    if (!link.is_can) {
        linux_can_backend_refuse(request, "not a CAN interface");
        return false;
    }
    if (lack != 0 || (link.up && !attach(can, link.index))) {
        linux_can_backend_refuse(request, reason_of(lack != 0 ? lack : errno));
        return false;
    }
    return true;
}

static void prepare_messages(can_socketcan_t *can)
{
    for (size_t i = 0; i < BATCH_MAX; i++) {
        can->buffers[i].iov_base = &can->received[i];
        can->buffers[i].iov_len = sizeof can->received[i];
        can->messages[i].msg_hdr.msg_iov = &can->buffers[i];
        can->messages[i].msg_hdr.msg_iovlen = 1;
    }
}

static bool prepare(can_socketcan_t *can)
{
    can->timer = oneshot_open(can->base.loop, on_timer, can);
    if (can->timer < 0) {
        return false;
    }
    can->link_fd = can_link_open();
    return can->link_fd >= 0 && loop_add(can->base.loop, can->link_fd, EPOLLIN, on_link, can);
}

static hal_can_t *can_socketcan_open(const linux_can_request_t *request)
{
    size_t length = strlen(request->address);
    if (length == 0 || length >= IFNAMSIZ) {
        linux_can_backend_refuse(request, "no such network interface");
        return NULL;
    }
    can_socketcan_t *can = calloc(1, sizeof *can);
    if (can == NULL) {
        linux_can_backend_refuse(request, strerror(errno));
        return NULL;
    }
    linux_can_backend_init(&can->base, &can_socketcan_backend, request);
    memcpy(can->name, request->address, length);
    can->fd = -1;
    can->timer = -1;
    can->link_fd = -1;
    prepare_messages(can);
    bool ready = prepare(can);
    if (!ready) {
        linux_can_backend_refuse(request, strerror(errno));
    }
    if (!ready || !first_attach(can, request)) {
        can_socketcan_close(&can->base);
        return NULL;
    }
    return &can->base;
}

const linux_can_backend_t can_socketcan_backend = {.kind = "socketcan",
                                                   .open = can_socketcan_open,
                                                   .close = can_socketcan_close,
                                                   .send = can_socketcan_send,
                                                   .receive = can_socketcan_receive,
                                                   .restart = can_socketcan_restart,
                                                   .set_filters = can_socketcan_set_filters};
