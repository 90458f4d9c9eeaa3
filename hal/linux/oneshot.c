#include "oneshot.h"

#include <errno.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

int oneshot_open(loop_t *loop, loop_handler_t handler, void *ctx)
{
    int timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    if (timer < 0) {
        return -1;
    }
    /* Edge-triggered: an expiry is reported once and needs no read. */
    if (!loop_add(loop, timer, EPOLLIN | EPOLLET, handler, ctx)) {
        int reason = errno;
        close(timer);
        errno = reason;
        return -1;
    }
    return timer;
}

void oneshot_close(loop_t *loop, int timer)
{
    if (timer >= 0) {
        loop_remove(loop, timer);
        close(timer);
    }
}

void oneshot_arm_us(int timer, uint64_t delay_us)
{
    /* All zero would disarm the timer. */
    struct itimerspec in = {.it_value = {.tv_sec = (time_t)(delay_us / 1000000u),
                                         .tv_nsec = (long)(delay_us % 1000000u) * 1000 + 1}};
    timerfd_settime(timer, 0, &in, NULL);
}
