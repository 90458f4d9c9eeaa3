/* Lines that never block (D-LIN-6), against pipes and terminals of the real kernel. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "line_writer.h"
#include "unity.h"

enum { PATIENCE_MS = 10000, LINES = 20000 };

static int ends[2];
static line_writer_t *writer;
static char text[8 * LINE_WRITER_BYTES];
static size_t len;

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(0, pipe2(ends, O_CLOEXEC));
    writer = NULL;
    len = 0;
    (void)signal(SIGPIPE, SIG_IGN);
}

void tearDown(void)
{
    line_writer_close(writer, 0);
    for (int i = 0; i < 2; i++) {
        if (ends[i] >= 0) {
            (void)close(ends[i]);
        }
    }
}

static void open_writer(int fd)
{
    writer = line_writer_open(fd, "lost ", " lines");
    TEST_ASSERT_NOT_NULL(writer);
}

/* Reads until this was read. */
static void read_until(int fd, const char *wanted)
{
    text[len] = '\0';
    while (strstr(text, wanted) == NULL) {
        const ssize_t n = read(fd, &text[len], sizeof text - 1 - len);
        TEST_ASSERT_GREATER_THAN(0, n);
        len += (size_t)n;
        text[len] = '\0';
    }
}

static void test_lines_arrive_in_their_order(void)
{
    open_writer(ends[1]);
    line_writer_put(writer, "first %d", 1);
    line_writer_put(writer, "second");
    read_until(ends[0], "second\n");
    TEST_ASSERT_EQUAL_STRING("first 1\nsecond\n", text);
    TEST_ASSERT_EQUAL_UINT64(0, line_writer_lost(writer));
}

static void test_a_long_line_is_cut(void)
{
    open_writer(ends[1]);
    memset(text, 'x', 2000);
    text[2000] = '\0';
    line_writer_put(writer, "%s", text);
    line_writer_put(writer, "end");
    read_until(ends[0], "end\n");
    TEST_ASSERT_EQUAL(LINE_WRITER_LINE_MAX + 4, len);
}

/* Takes what is there; does not wait for long. */
static void read_some(void)
{
    struct pollfd waiting = {.fd = ends[0], .events = POLLIN};
    while (poll(&waiting, 1, 10) > 0 && len < sizeof text - 1) {
        const ssize_t n = read(ends[0], &text[len], sizeof text - 1 - len);
        TEST_ASSERT_GREATER_THAN(0, n);
        len += (size_t)n;
    }
    text[len] = '\0';
}

static bool has_ended_with_after(void)
{
    return len >= 6 && strcmp(&text[len - 6], "after\n") == 0;
}

/* Whoever does not read holds up nobody; when he reads again, he learns how many lines are missing, and every
 * other line is there. */
static void test_a_pipe_that_nobody_reads(void)
{
    open_writer(ends[1]);
    for (int i = 0; i < LINES; i++) {
        line_writer_put(writer, "line %d of a program that has much to say", i);
    }
    TEST_ASSERT_GREATER_THAN_UINT64(1000, line_writer_lost(writer));
    while (!has_ended_with_after()) {
        line_writer_put(writer, "after"); /* lost as long as there is no room */
        read_some();
    }
    uint64_t told = 0;
    int next = 0;
    for (const char *line = text; *line != '\0'; line = strchr(line, '\n') + 1) {
        unsigned long long count;
        int number;
        if (sscanf(line, "lost %llu lines", &count) == 1) {
            told += count;
        } else if (sscanf(line, "line %d of", &number) == 1) {
            TEST_ASSERT_GREATER_OR_EQUAL_INT(next, number);
            next = number + 1;
        }
    }
    TEST_ASSERT_EQUAL_UINT64(line_writer_lost(writer), told);
}

static void test_the_end_does_not_wait_for_a_pipe_that_nobody_reads(void)
{
    open_writer(ends[1]);
    for (int i = 0; i < LINES; i++) {
        line_writer_put(writer, "line %d of a program that has much to say", i);
    }
    line_writer_close(writer, 1);
    writer = NULL;
}

static void test_the_end_waits_for_what_is_being_written(void)
{
    open_writer(ends[1]);
    line_writer_put(writer, "the last words");
    line_writer_close(writer, PATIENCE_MS);
    writer = NULL;
    (void)close(ends[1]);
    ends[1] = -1;
    read_until(ends[0], "words\n");
}

/* Ctrl-S in its terminal. */
static void test_a_stopped_terminal(void)
{
    const int master = posix_openpt(O_RDWR | O_NOCTTY);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, master);
    TEST_ASSERT_EQUAL_INT(0, grantpt(master));
    TEST_ASSERT_EQUAL_INT(0, unlockpt(master));
    const int terminal = open(ptsname(master), O_RDWR | O_NOCTTY);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, terminal);
    TEST_ASSERT_EQUAL_INT(0, tcflow(terminal, TCOOFF));
    open_writer(terminal);
    for (int i = 0; i < LINES; i++) {
        line_writer_put(writer, "line %d of a program that has much to say", i);
    }
    TEST_ASSERT_GREATER_THAN_UINT64(0, line_writer_lost(writer));
    TEST_ASSERT_EQUAL_INT(0, tcflow(terminal, TCOON));
    read_until(master, "line 0 of a program that has much to say\r\n");
    line_writer_close(writer, 1);
    writer = NULL;
    (void)close(terminal);
    (void)close(master);
}

static void test_a_reader_that_has_gone(void)
{
    open_writer(ends[1]);
    (void)close(ends[0]);
    ends[0] = -1;
    line_writer_put(writer, "nobody hears this");
    while (!line_writer_is_broken(writer)) {
        (void)poll(NULL, 0, 1);
    }
    line_writer_put(writer, "nor this");
    TEST_ASSERT_EQUAL_UINT64(2, line_writer_lost(writer));
}

/* The disk may have room again. */
static void test_a_full_disk_loses_lines_and_breaks_nothing(void)
{
    const int full = open("/dev/full", O_WRONLY | O_CLOEXEC);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, full);
    open_writer(full);
    line_writer_put(writer, "no room");
    while (line_writer_lost(writer) == 0) {
        (void)poll(NULL, 0, 1);
    }
    TEST_ASSERT_FALSE(line_writer_is_broken(writer));
    TEST_ASSERT_EQUAL_INT(full, dup2(ends[1], full)); /* now there is room */
    line_writer_put(writer, "room");
    read_until(ends[0], "room\n");
    TEST_ASSERT_EQUAL_STRING("lost 1 lines\nroom\n", text);
    line_writer_close(writer, PATIENCE_MS);
    writer = NULL;
    (void)close(full);
}

/* A descriptor that another program has made non-blocking loses nothing. */
static void test_a_descriptor_that_does_not_block(void)
{
    TEST_ASSERT_EQUAL_INT(0, fcntl(ends[1], F_SETFL, O_NONBLOCK));
    open_writer(ends[1]);
    for (int i = 0; i < 3000; i++) {
        line_writer_put(writer, "line %d of a program that has much to say", i);
    }
    read_until(ends[0], "line 2999 of a program that has much to say\n");
    TEST_ASSERT_EQUAL_UINT64(0, line_writer_lost(writer));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_lines_arrive_in_their_order);
    RUN_TEST(test_a_long_line_is_cut);
    RUN_TEST(test_a_pipe_that_nobody_reads);
    RUN_TEST(test_the_end_does_not_wait_for_a_pipe_that_nobody_reads);
    RUN_TEST(test_the_end_waits_for_what_is_being_written);
    RUN_TEST(test_a_stopped_terminal);
    RUN_TEST(test_a_reader_that_has_gone);
    RUN_TEST(test_a_full_disk_loses_lines_and_breaks_nothing);
    RUN_TEST(test_a_descriptor_that_does_not_block);
    return UNITY_END();
}
