/* The event loop against pipes, timers and signals of the real kernel. */
#define _GNU_SOURCE
#include <errno.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "loop.h"
#include "unity.h"

static loop_t *loop;
static int pipe_a[2];
static int pipe_b[2];
static int calls_a;
static int calls_b;

void setUp(void)
{
    loop = loop_create();
    TEST_ASSERT_NOT_NULL(loop);
    TEST_ASSERT_EQUAL_INT(0, pipe(pipe_a));
    TEST_ASSERT_EQUAL_INT(0, pipe(pipe_b));
    calls_a = 0;
    calls_b = 0;
}

void tearDown(void)
{
    for (int i = 0; i < 2; i++) {
        close(pipe_a[i]);
        close(pipe_b[i]);
    }
    loop_destroy(loop);
}

static void put_byte(const int *ends)
{
    TEST_ASSERT_EQUAL_INT(1, write(ends[1], "x", 1));
}

static void read_a(void *ctx, uint32_t events)
{
    char byte;
    TEST_ASSERT_EQUAL_PTR(&calls_a, ctx);
    TEST_ASSERT_EQUAL_HEX32(EPOLLIN, events);
    TEST_ASSERT_EQUAL_INT(1, read(pipe_a[0], &byte, 1));
    calls_a++;
}

static void count_only(void *ctx, uint32_t events)
{
    (void)events;
    (*(int *)ctx)++;
}

/* One round that does not sleep. */
static void round_now(void)
{
    loop_set_deadline_us(loop, 0);
    TEST_ASSERT_TRUE(loop_run_once(loop));
}

static void test_handler_runs_once_for_each_readable_byte(void)
{
    TEST_ASSERT_TRUE(loop_add(loop, pipe_a[0], EPOLLIN, read_a, &calls_a));
    round_now();
    TEST_ASSERT_EQUAL_INT(0, calls_a);
    put_byte(pipe_a);
    round_now();
    round_now();
    TEST_ASSERT_EQUAL_INT(1, calls_a);
}

static void test_edge_triggered_reports_once_until_modified(void)
{
    TEST_ASSERT_TRUE(loop_add(loop, pipe_a[0], EPOLLIN | EPOLLET, count_only, &calls_a));
    put_byte(pipe_a);
    round_now();
    round_now();
    TEST_ASSERT_EQUAL_INT(1, calls_a);
    TEST_ASSERT_TRUE(loop_modify(loop, pipe_a[0], EPOLLIN | EPOLLET));
    round_now();
    TEST_ASSERT_EQUAL_INT(2, calls_a);
}

static void remove_both(void *ctx, uint32_t events)
{
    (void)events;
    (*(int *)ctx)++;
    loop_remove(loop, pipe_a[0]);
    loop_remove(loop, pipe_b[0]);
}

static void test_event_fetched_before_removal_is_not_delivered(void)
{
    TEST_ASSERT_TRUE(loop_add(loop, pipe_a[0], EPOLLIN, remove_both, &calls_a));
    TEST_ASSERT_TRUE(loop_add(loop, pipe_b[0], EPOLLIN, remove_both, &calls_b));
    put_byte(pipe_a);
    put_byte(pipe_b);
    round_now();
    TEST_ASSERT_EQUAL_INT(1, calls_a + calls_b);
    round_now();
    TEST_ASSERT_EQUAL_INT(1, calls_a + calls_b);
}

/* Replaces pipe_b by a new one with the same descriptor numbers, in which nothing is to be read. */
static void replace_b(void *ctx, uint32_t events)
{
    (void)events;
    (*(int *)ctx)++;
    int fresh[2];
    TEST_ASSERT_EQUAL_INT(0, pipe(fresh));
    loop_remove(loop, pipe_a[0]);
    loop_remove(loop, pipe_b[0]);
    for (int i = 0; i < 2; i++) {
        TEST_ASSERT_EQUAL_INT(pipe_b[i], dup2(fresh[i], pipe_b[i]));
        close(fresh[i]);
    }
    TEST_ASSERT_TRUE(loop_add(loop, pipe_b[0], EPOLLIN | EPOLLET, count_only, &calls_b));
}

static void test_event_of_an_old_descriptor_does_not_reach_its_successor(void)
{
    TEST_ASSERT_TRUE(loop_add(loop, pipe_a[0], EPOLLIN, replace_b, &calls_a));
    TEST_ASSERT_TRUE(loop_add(loop, pipe_b[0], EPOLLIN, count_only, &calls_b));
    put_byte(pipe_a); /* the first to become ready is the first to be delivered */
    put_byte(pipe_b);
    round_now();
    TEST_ASSERT_EQUAL_INT(1, calls_a);
    TEST_ASSERT_EQUAL_INT(0, calls_b);
    put_byte(pipe_b);
    round_now();
    TEST_ASSERT_EQUAL_INT(1, calls_b);
}

static void test_unknown_descriptors_are_refused(void)
{
    TEST_ASSERT_FALSE(loop_add(loop, -1, EPOLLIN, read_a, &calls_a));
    TEST_ASSERT_EQUAL_INT(EBADF, errno);
    TEST_ASSERT_FALSE(loop_modify(loop, pipe_a[0], EPOLLIN));
    TEST_ASSERT_EQUAL_INT(ENOENT, errno);
    loop_remove(loop, pipe_a[0]);
    loop_remove(loop, 100000);
}

/* Rounds until the time is reached; a round may end early. */
static int rounds_until(uint64_t end_us)
{
    int rounds = 0;
    while (loop_now_us(loop) < end_us) {
        TEST_ASSERT_TRUE(loop_run_once(loop));
        rounds++;
    }
    return rounds;
}

static void test_sleeps_until_the_deadline_and_not_longer(void)
{
    uint64_t end_us = loop_refresh_now_us(loop) + 20000;
    loop_set_deadline_us(loop, end_us);
    TEST_ASSERT_EQUAL_INT(1, rounds_until(end_us));
    TEST_ASSERT_TRUE(loop_now_us(loop) < end_us + 500000);
}

static void test_earlier_deadline_replaces_the_armed_one(void)
{
    uint64_t start_us = loop_refresh_now_us(loop);
    TEST_ASSERT_TRUE(loop_add(loop, pipe_a[0], EPOLLIN, read_a, &calls_a));
    put_byte(pipe_a);
    loop_set_deadline_us(loop, start_us + 60000000);
    TEST_ASSERT_TRUE(loop_run_once(loop)); /* arms the timer, returns for the byte */
    loop_set_deadline_us(loop, start_us + 10000);
    TEST_ASSERT_EQUAL_INT(1, rounds_until(start_us + 10000));
    TEST_ASSERT_TRUE(loop_now_us(loop) < start_us + 1000000);
}

static void test_later_deadline_costs_one_empty_round(void)
{
    uint64_t start_us = loop_refresh_now_us(loop);
    TEST_ASSERT_TRUE(loop_add(loop, pipe_a[0], EPOLLIN, read_a, &calls_a));
    put_byte(pipe_a);
    loop_set_deadline_us(loop, start_us + 10000);
    TEST_ASSERT_TRUE(loop_run_once(loop));
    loop_set_deadline_us(loop, start_us + 30000);
    TEST_ASSERT_EQUAL_INT(2, rounds_until(start_us + 30000));
}

static void test_signals_end_the_program(void)
{
    const int signals[] = {SIGTERM, SIGINT, SIGHUP};
    for (size_t i = 0; i < 3; i++) {
        loop_destroy(loop);
        loop = loop_create();
        round_now();
        TEST_ASSERT_EQUAL_INT(0, raise(signals[i]));
        loop_set_deadline_us(loop, UINT64_MAX);
        TEST_ASSERT_FALSE(loop_run_once(loop));
        TEST_ASSERT_FALSE(loop_run_once(loop));
    }
}

static void test_a_signal_that_nohup_ignores_stays_ignored(void)
{
    loop_destroy(loop);
    TEST_ASSERT_TRUE(signal(SIGHUP, SIG_IGN) != SIG_ERR);
    loop = loop_create();
    TEST_ASSERT_EQUAL_INT(0, raise(SIGHUP));
    round_now();
    TEST_ASSERT_TRUE(signal(SIGHUP, SIG_DFL) != SIG_ERR);
}

static void stop_loop(void *ctx, uint32_t events)
{
    (void)events;
    (*(int *)ctx)++;
    loop_stop(loop);
}

static void test_stop_ends_the_round_after_the_other_handlers(void)
{
    TEST_ASSERT_TRUE(loop_add(loop, pipe_a[0], EPOLLIN, stop_loop, &calls_a));
    TEST_ASSERT_TRUE(loop_add(loop, pipe_b[0], EPOLLIN, stop_loop, &calls_b));
    put_byte(pipe_a);
    put_byte(pipe_b);
    TEST_ASSERT_FALSE(loop_run_once(loop));
    TEST_ASSERT_EQUAL_INT(1, calls_a);
    TEST_ASSERT_EQUAL_INT(1, calls_b);
}

static void test_sigpipe_is_ignored(void)
{
    close(pipe_a[0]);
    TEST_ASSERT_EQUAL_INT(-1, write(pipe_a[1], "x", 1));
    TEST_ASSERT_EQUAL_INT(EPIPE, errno);
    pipe_a[0] = dup(pipe_a[1]);
}

static void test_idle_loop_uses_no_processor_time(void)
{
    struct rusage before;
    struct rusage after;
    uint64_t end_us = loop_refresh_now_us(loop) + 100000;
    getrusage(RUSAGE_SELF, &before);
    loop_set_deadline_us(loop, end_us);
    TEST_ASSERT_EQUAL_INT(1, rounds_until(end_us));
    getrusage(RUSAGE_SELF, &after);
    TEST_ASSERT_LESS_OR_EQUAL_INT(3, after.ru_nvcsw - before.ru_nvcsw);
}

/* The state of a process as /proc tells it: S asleep, T stopped. */
static void await_state(pid_t pid, char state)
{
    char path[32];
    char text[256];
    char now = '?';
    (void)snprintf(path, sizeof path, "/proc/%d/stat", (int)pid);
    while (now != state) {
        FILE *file = fopen(path, "r");
        if (file == NULL) {
            _exit(1);
        }
        const char *behind_name = fgets(text, sizeof text, file) != NULL ? strrchr(text, ')') : NULL;
        if (behind_name != NULL) {
            now = behind_name[2];
        }
        (void)fclose(file);
    }
}

/* Stops its parent in its sleep, lets the deadline pass, gives it a byte and wakes it. */
static void stop_parent(uint64_t deadline_us)
{
    struct timespec now;
    const pid_t parent = getppid();
    await_state(parent, 'S');
    (void)kill(parent, SIGSTOP);
    await_state(parent, 'T');
    do {
        (void)clock_gettime(CLOCK_MONOTONIC, &now);
    } while ((uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u <= deadline_us);
    _exit(write(pipe_a[1], "x", 1) == 1 && kill(parent, SIGCONT) == 0 ? 0 : 1);
}

/* D-LIN-8: a program that was stopped (Ctrl-Z, a debugger) finds its deadline passed and bytes that came
 * before: it hears them before it judges who was silent. */
static void test_what_came_while_it_was_stopped_is_handled_before_the_deadline(void)
{
    int status;
    TEST_ASSERT_TRUE(loop_add(loop, pipe_a[0], EPOLLIN, read_a, &calls_a));
    const uint64_t deadline_us = loop_refresh_now_us(loop) + 200000;
    loop_set_deadline_us(loop, deadline_us);
    const pid_t child = fork();
    if (child == 0) {
        stop_parent(deadline_us);
    }
    TEST_ASSERT_TRUE(loop_run_once(loop));
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(deadline_us, loop_now_us(loop));
    TEST_ASSERT_EQUAL_INT(1, calls_a);
    TEST_ASSERT_EQUAL_INT(child, waitpid(child, &status, 0));
    TEST_ASSERT_EQUAL_INT(0, status);
}

/* More descriptors are ready than one fetch takes: all are handled before the deadline is judged. */
static void test_all_that_has_come_is_handled_before_the_deadline(void)
{
    enum { PIPES = 40 };
    int ends[PIPES][2];
    int calls = 0;
    for (int i = 0; i < PIPES; i++) {
        TEST_ASSERT_EQUAL_INT(0, pipe(ends[i]));
        TEST_ASSERT_TRUE(loop_add(loop, ends[i][0], EPOLLIN | EPOLLET, count_only, &calls));
        put_byte(ends[i]);
    }
    round_now();
    TEST_ASSERT_EQUAL_INT(PIPES, calls);
    for (int i = 0; i < PIPES; i++) {
        loop_remove(loop, ends[i][0]);
        close(ends[i][0]);
        close(ends[i][1]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_handler_runs_once_for_each_readable_byte);
    RUN_TEST(test_edge_triggered_reports_once_until_modified);
    RUN_TEST(test_event_fetched_before_removal_is_not_delivered);
    RUN_TEST(test_event_of_an_old_descriptor_does_not_reach_its_successor);
    RUN_TEST(test_unknown_descriptors_are_refused);
    RUN_TEST(test_sleeps_until_the_deadline_and_not_longer);
    RUN_TEST(test_earlier_deadline_replaces_the_armed_one);
    RUN_TEST(test_later_deadline_costs_one_empty_round);
    RUN_TEST(test_signals_end_the_program);
    RUN_TEST(test_a_signal_that_nohup_ignores_stays_ignored);
    RUN_TEST(test_stop_ends_the_round_after_the_other_handlers);
    RUN_TEST(test_sigpipe_is_ignored);
    RUN_TEST(test_what_came_while_it_was_stopped_is_handled_before_the_deadline);
    RUN_TEST(test_all_that_has_come_is_handled_before_the_deadline);
    RUN_TEST(test_idle_loop_uses_no_processor_time);
    return UNITY_END();
}
