#include "loop.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#define LOOP_EVENTS_MAX 16
#define LOOP_FETCHES_MAX 16 /* in one round, for descriptors that stay ready */
#define LOOP_NEVER UINT64_MAX

/* One watched descriptor. The generation tells an event that was fetched for a removed descriptor from one
 * for a new descriptor with the same number. */
typedef struct {
    loop_handler_t handler; /* NULL: not watched */
    void *ctx;
    uint32_t generation;
} loop_slot_t;

struct loop {
    int epoll_fd;
    int timer_fd;
    int signal_fd;
    bool stopped;
    uint32_t generation;
    uint64_t now_us;
    uint64_t deadline_us;
    uint64_t armed_us;  /* what the timer is armed for */
    loop_slot_t *slots; /* by descriptor number */
    size_t slots_size;
    sigset_t signals_before;
    void (*sigpipe_before)(int);
};

static uint64_t monotonic_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

/* Edge-triggered: an expiry is reported once and needs no read. */
static void on_timer(void *ctx, uint32_t events)
{
    loop_t *loop = ctx;
    (void)events;
    loop->armed_us = LOOP_NEVER;
}

static void on_signal(void *ctx, uint32_t events)
{
    loop_t *loop = ctx;
    (void)events;
    struct signalfd_siginfo info;
    if (read(loop->signal_fd, &info, sizeof info) == (ssize_t)sizeof info) {
        loop->stopped = true;
    }
}

static bool is_ignored(int number)
{
    struct sigaction action;
    return sigaction(number, NULL, &action) == 0 && action.sa_handler == SIG_IGN;
}

static bool block_signals(loop_t *loop, sigset_t *signals)
{
    sigemptyset(signals);
    sigaddset(signals, SIGTERM);
    sigaddset(signals, SIGINT);
    if (!is_ignored(SIGHUP)) { /* nohup has it ignored */
        sigaddset(signals, SIGHUP);
    }
    if (sigprocmask(SIG_BLOCK, signals, &loop->signals_before) != 0) {
        return false;
    }
    loop->sigpipe_before = signal(SIGPIPE, SIG_IGN);
    return true;
}

static bool open_descriptors(loop_t *loop, const sigset_t *signals)
{
    loop->epoll_fd = epoll_create1(EPOLL_CLOEXEC);
    if (loop->epoll_fd < 0) {
        return false;
    }
    loop->timer_fd = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    if (loop->timer_fd < 0) {
        return false;
    }
    loop->signal_fd = signalfd(-1, signals, SFD_NONBLOCK | SFD_CLOEXEC);
    if (loop->signal_fd < 0) {
        return false;
    }
    return loop_add(loop, loop->timer_fd, EPOLLIN | EPOLLET, on_timer, loop) &&
           loop_add(loop, loop->signal_fd, EPOLLIN, on_signal, loop);
}

loop_t *loop_create(void)
{
    loop_t *loop = calloc(1, sizeof *loop);
    if (loop == NULL) {
        return NULL;
    }
    loop->epoll_fd = -1;
    loop->timer_fd = -1;
    loop->signal_fd = -1;
    loop->deadline_us = LOOP_NEVER;
    loop->armed_us = LOOP_NEVER;
    loop->now_us = monotonic_us();
    sigset_t signals;
    if (!block_signals(loop, &signals)) {
        free(loop);
        return NULL;
    }
    if (!open_descriptors(loop, &signals)) {
        int reason = errno;
        loop_destroy(loop);
        errno = reason;
        return NULL;
    }
    return loop;
}

static void close_if_open(int fd)
{
    if (fd >= 0) {
        close(fd);
    }
}

void loop_destroy(loop_t *loop)
{
    if (loop == NULL) {
        return;
    }
    close_if_open(loop->signal_fd);
    close_if_open(loop->timer_fd);
    close_if_open(loop->epoll_fd);
    signal(SIGPIPE, loop->sigpipe_before);
    sigprocmask(SIG_SETMASK, &loop->signals_before, NULL);
    free(loop->slots);
    free(loop);
}

static bool make_slot(loop_t *loop, int fd)
{
    if (fd < 0) {
        errno = EBADF;
        return false;
    }
    size_t needed = (size_t)fd + 1u;
    if (needed <= loop->slots_size) {
        return true;
    }
    size_t size = needed + 16u;
    loop_slot_t *slots = realloc(loop->slots, size * sizeof *slots);
    if (slots == NULL) {
        return false;
    }
    for (size_t i = loop->slots_size; i < size; i++) {
        slots[i] = (loop_slot_t){0};
    }
    loop->slots = slots;
    loop->slots_size = size;
    return true;
}

/* The slot of a watched descriptor, or NULL. */
static loop_slot_t *find_slot(const loop_t *loop, uint32_t fd)
{
    if (fd >= loop->slots_size || loop->slots[fd].handler == NULL) {
        return NULL;
    }
    return &loop->slots[fd];
}

static bool control(loop_t *loop, int operation, int fd, uint32_t events, uint32_t generation)
{
    struct epoll_event event = {.events = events, .data.u64 = (uint64_t)generation << 32 | (uint32_t)fd};
    return epoll_ctl(loop->epoll_fd, operation, fd, &event) == 0;
}

bool loop_add(loop_t *loop, int fd, uint32_t events, loop_handler_t handler, void *ctx)
{
    if (!make_slot(loop, fd)) {
        return false;
    }
    uint32_t generation = loop->generation + 1u;
    if (!control(loop, EPOLL_CTL_ADD, fd, events, generation)) {
        return false;
    }
    loop->generation = generation;
    loop->slots[fd] = (loop_slot_t){.handler = handler, .ctx = ctx, .generation = generation};
    return true;
}

bool loop_modify(loop_t *loop, int fd, uint32_t events)
{
    const loop_slot_t *slot = find_slot(loop, (uint32_t)fd);
    if (slot == NULL) {
        errno = ENOENT;
        return false;
    }
    return control(loop, EPOLL_CTL_MOD, fd, events, slot->generation);
}

void loop_remove(loop_t *loop, int fd)
{
    loop_slot_t *slot = find_slot(loop, (uint32_t)fd);
    if (slot != NULL) {
        slot->handler = NULL;
        epoll_ctl(loop->epoll_fd, EPOLL_CTL_DEL, fd, NULL);
    }
}

uint64_t loop_now_us(const loop_t *loop)
{
    return loop->now_us;
}

uint64_t loop_refresh_now_us(loop_t *loop)
{
    loop->now_us = monotonic_us();
    return loop->now_us;
}

void loop_set_deadline_us(loop_t *loop, uint64_t deadline_us)
{
    loop->deadline_us = deadline_us;
}

/* Arms the timer only when it would fire too late. Returns the timeout for epoll_wait. */
static int prepare_sleep(loop_t *loop)
{
    if (loop->stopped || loop->deadline_us <= loop->now_us) {
        return 0;
    }
    if (loop->deadline_us < loop->armed_us) {
        struct itimerspec at = {.it_value = {.tv_sec = (time_t)(loop->deadline_us / 1000000u),
                                             .tv_nsec = (long)(loop->deadline_us % 1000000u) * 1000}};
        if (timerfd_settime(loop->timer_fd, TFD_TIMER_ABSTIME, &at, NULL) != 0) {
            return 0;
        }
        loop->armed_us = loop->deadline_us;
    }
    return -1;
}

static void dispatch(loop_t *loop, const struct epoll_event *event)
{
    const loop_slot_t *slot = find_slot(loop, (uint32_t)event->data.u64);
    if (slot != NULL && slot->generation == (uint32_t)(event->data.u64 >> 32)) {
        slot->handler(slot->ctx, event->events);
    }
}

/* Waits for events. Returns how many there are; none after a signal, such as the one that continues a stopped
 * program. */
static int fetch(loop_t *loop, struct epoll_event events[LOOP_EVENTS_MAX], int timeout_ms)
{
    const int n = epoll_wait(loop->epoll_fd, events, LOOP_EVENTS_MAX, timeout_ms);
    if (n < 0 && errno != EINTR) {
        loop->stopped = true;
    }
    return n;
}

static void dispatch_all(loop_t *loop, const struct epoll_event *events, int n)
{
    for (int i = 0; i < n; i++) {
        dispatch(loop, &events[i]);
    }
}

/* When the deadline is reached, all that came before now is handled first (D-LIN-8). The program may have
 * been stopped since the last fetch, and would take for silent whoever spoke meanwhile. */
bool loop_run_once(loop_t *loop)
{
    struct epoll_event events[LOOP_EVENTS_MAX];
    int n = fetch(loop, events, prepare_sleep(loop));
    loop->now_us = monotonic_us();
    const bool is_due = loop->deadline_us <= loop->now_us;
    dispatch_all(loop, events, n);
    n = LOOP_EVENTS_MAX;
    for (int i = 0; i < LOOP_FETCHES_MAX && is_due && !loop->stopped && n == LOOP_EVENTS_MAX; i++) {
        n = fetch(loop, events, 0);
        dispatch_all(loop, events, n);
    }
    return !loop->stopped;
}

void loop_stop(loop_t *loop)
{
    loop->stopped = true;
}
