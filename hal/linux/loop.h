/* The one event loop of a Linux program: epoll for descriptors, a timerfd for the next deadline, a signalfd
 * for SIGTERM, SIGINT and SIGHUP. A program that has nothing to do sleeps in epoll_wait and uses no processor
 * time.
 *
 * Single-threaded. Handlers run inside loop_run_once and may call every function of this header, loop_remove
 * for their own or another descriptor included. */
#ifndef LOOP_H
#define LOOP_H

#include <stdbool.h>
#include <stdint.h>

typedef struct loop loop_t;

/* events: the EPOLLIN, EPOLLOUT, EPOLLERR and EPOLLHUP bits that are set. */
typedef void (*loop_handler_t)(void *ctx, uint32_t events);

/* NULL when the kernel refuses one of the descriptors; errno says why. SIGTERM, SIGINT and SIGHUP are
 * blocked and taken by the loop from here on (SIGHUP not if it is ignored, as nohup does it); SIGPIPE is
 * ignored. The caller owns the loop. */
loop_t *loop_create(void);
void loop_destroy(loop_t *loop);

/* Watches fd for events: EPOLLIN, EPOLLOUT, and EPOLLET for who reads or writes until there is no more. ctx
 * must live until loop_remove. loop_modify replaces the events, and reports anew what is the case already,
 * edge-triggered or not. False: errno says why. */
bool loop_add(loop_t *loop, int fd, uint32_t events, loop_handler_t handler, void *ctx);
bool loop_modify(loop_t *loop, int fd, uint32_t events);

/* Events of fd that were fetched already are not delivered any more. To be called before fd is closed. */
void loop_remove(loop_t *loop, int fd);

/* Microseconds of CLOCK_MONOTONIC, read once after each wake-up. */
uint64_t loop_now_us(const loop_t *loop);

/* Reads the clock again, for a handler that has worked for long. */
uint64_t loop_refresh_now_us(loop_t *loop);

/* loop_run_once returns at the latest at this time (loop_now_us clock); UINT64_MAX: no limit. Replaces the
 * time set before and stays until replaced: with a time that is past the loop does not sleep. Setting a later
 * time than the timer is armed for costs no system call: the loop then wakes once for nothing. */
void loop_set_deadline_us(loop_t *loop, uint64_t deadline_us);

/* Sleeps until a descriptor is ready, the deadline is reached or a signal came, and runs the handlers. When
 * the deadline is reached, everything that had come by then has been handled. False: one of the signals came,
 * or loop_stop was called: the program should end. */
bool loop_run_once(loop_t *loop);
void loop_stop(loop_t *loop);

#endif
