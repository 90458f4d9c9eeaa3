/* The host's byte stream over a real pseudo-terminal; the host's end is an ordinary open(2). */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include "linux_uart.h"
#include "looped.h"
#include "unity.h"

static char folder[] = "/tmp/test_linux_uart.XXXXXX";
static char link_path[64];
static char lock_path[72];
static char error[200];
static loop_t *loop;
static hal_uart_t *uart;
static uint8_t received[65536];
static size_t received_n;
static int ready_calls;

/* Takes everything, as the contract asks for. */
static void on_ready(void *ctx)
{
    (void)ctx;
    ready_calls++;
    size_t n;
    while ((n = hal_uart_read(uart, received + received_n, sizeof received - received_n)) > 0) {
        received_n += n;
    }
}

static void open_uart(const char *port)
{
    uart = linux_uart_open(loop, port, on_ready, NULL, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(uart, error);
}

void setUp(void)
{
    memset(folder + strlen(folder) - 6, 'X', 6);
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    snprintf(link_path, sizeof link_path, "%s/pty", folder);
    snprintf(lock_path, sizeof lock_path, "%s.lock", link_path);
    loop = loop_create();
    uart = NULL;
    received_n = 0;
    ready_calls = 0;
    error[0] = '\0';
}

void tearDown(void)
{
    linux_uart_close(uart);
    loop_destroy(loop);
    unlink(link_path);
    unlink(lock_path);
    rmdir(folder);
}

static int open_host(void)
{
    int host = open(linux_uart_path(uart), O_RDWR | O_NOCTTY | O_NONBLOCK);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, host);
    return host;
}

static void expect_from_host(const char *text)
{
    looped_until(loop, &received_n, strlen(text));
    TEST_ASSERT_EQUAL_MEMORY(text, received, strlen(text));
    received_n = 0;
}

static void host_sends(int host, const char *text)
{
    TEST_ASSERT_EQUAL_INT(strlen(text), write(host, text, strlen(text)));
}

static void uart_sends(const char *text)
{
    TEST_ASSERT_EQUAL_UINT(strlen(text), hal_uart_write(uart, (const uint8_t *)text, strlen(text)));
}

/* What has come by now; waits a little for the first byte only. */
static size_t host_reads(int host, char *bytes, size_t size, int timeout_ms)
{
    struct pollfd watched = {.fd = host, .events = POLLIN};
    if (poll(&watched, 1, timeout_ms) <= 0) {
        return 0;
    }
    ssize_t n = read(host, bytes, size);
    return n > 0 ? (size_t)n : 0;
}

static void expect_at_host(int host, const char *text)
{
    char bytes[64];
    size_t n = 0;
    size_t step;
    while (n < strlen(text) && (step = host_reads(host, bytes + n, sizeof bytes - n, 1000)) > 0) {
        n += step;
    }
    TEST_ASSERT_EQUAL_UINT(strlen(text), n);
    TEST_ASSERT_EQUAL_MEMORY(text, bytes, n);
}

static void expect_silence_at_host(int host)
{
    char bytes[64];
    TEST_ASSERT_EQUAL_UINT(0, host_reads(host, bytes, sizeof bytes, 30));
}

static void test_bytes_pass_unchanged_in_both_directions(void)
{
    /* What a terminal that is not raw would change: carriage return, line feed, ^C, ^D, ^S, erase, 8th
     * bit. */
    const char text[] = "a\r\n\x03\x04\x13\x11\x7F\xFF\x1A|";
    open_uart("pty");
    int host = open_host();
    host_sends(host, text);
    expect_from_host(text);
    uart_sends(text);
    expect_at_host(host, text);
    expect_silence_at_host(host); /* nor is anything echoed */
    looped_settle(loop, 20000);
    TEST_ASSERT_EQUAL_UINT(0, received_n);
    close(host);
}

static void test_all_byte_values_arrive(void)
{
    open_uart("pty");
    int host = open_host();
    uint8_t bytes[256];
    for (unsigned i = 0; i < 256; i++) {
        bytes[i] = (uint8_t)i;
    }
    TEST_ASSERT_EQUAL_INT(256, write(host, bytes, sizeof bytes));
    looped_until(loop, &received_n, 256);
    TEST_ASSERT_EQUAL_MEMORY(bytes, received, 256);
    close(host);
}

static void test_host_may_close_and_reopen(void)
{
    open_uart("pty");
    for (int i = 0; i < 3; i++) {
        int host = open_host();
        host_sends(host, "question");
        expect_from_host("question");
        uart_sends("answer");
        expect_at_host(host, "answer");
        close(host);
        looped_settle(loop, 10000);
    }
}

static void test_bytes_sent_just_before_closing_still_arrive(void)
{
    open_uart("pty");
    int host = open_host();
    host_sends(host, "last words");
    close(host);
    expect_from_host("last words");
}

static void test_bytes_written_without_a_host_are_discarded(void)
{
    open_uart("pty");
    uart_sends("to nobody");
    int host = open_host();
    expect_silence_at_host(host);
    close(host);
    looped_settle(loop, 10000);
    uart_sends("to nobody again");
    host = open_host();
    expect_silence_at_host(host);
    uart_sends("to you");
    expect_at_host(host, "to you");
    close(host);
}

static void test_answers_that_a_host_left_unread_do_not_reach_the_next(void)
{
    open_uart("pty");
    int host = open_host();
    uart_sends("stale");
    close(host);
    looped_settle(loop, 10000);
    host = open_host();
    expect_silence_at_host(host);
    uart_sends("fresh");
    expect_at_host(host, "fresh");
    close(host);
}

static int next_host = -1;

/* Comes first of two events in one round: the next host is there and has its answer before the loop tells
 * that the last one has left. */
static void on_other(void *ctx, uint32_t events)
{
    (void)ctx;
    (void)events;
    next_host = open_host();
    host_sends(next_host, "request");
    on_ready(NULL);
    uart_sends("answer");
}

static void test_the_answer_of_the_next_host_survives_late_news_of_the_last(void)
{
    open_uart("pty");
    int other[2];
    TEST_ASSERT_EQUAL_INT(0, pipe(other));
    TEST_ASSERT_TRUE(loop_add(loop, other[0], EPOLLIN | EPOLLET, on_other, NULL));
    int host = open_host();
    host_sends(host, "first");
    expect_from_host("first");
    looped_settle(loop, 1000);
    TEST_ASSERT_EQUAL_INT(1, write(other[1], "x", 1));
    close(host);
    loop_set_deadline_us(loop, loop_refresh_now_us(loop) + 1000);
    TEST_ASSERT_TRUE(loop_run_once(loop));
    looped_settle(loop, 1000);
    expect_at_host(next_host, "answer");
    close(next_host);
    loop_remove(loop, other[0]);
    close(other[0]);
    close(other[1]);
}

/* Writes until there is no more room. Returns how many bytes went. */
static size_t fill(void)
{
    uint8_t bytes[1024];
    size_t total = 0;
    size_t n;
    memset(bytes, 's', sizeof bytes);
    do {
        n = hal_uart_write(uart, bytes, sizeof bytes);
        total += n;
        TEST_ASSERT_TRUE(total < 1024u * 1024u);
    } while (n == sizeof bytes);
    return total;
}

static void test_more_unread_bytes_than_one_buffer_holds_do_not_reach_the_next_host(void)
{
    open_uart("pty");
    int host = open_host();
    fill();
    close(host);
    looped_settle(loop, 10000);
    host = open_host();
    expect_silence_at_host(host);
    close(host);
}

static void test_full_host_end_takes_less_and_reports_room_later(void)
{
    open_uart("pty");
    int host = open_host();
    size_t total = 0;
    size_t taken;
    do { /* the kernel carries bytes on, which makes room for more for a while */
        taken = fill();
        total += taken;
        looped_settle(loop, 20000);
    } while (taken > 0);
    TEST_ASSERT_GREATER_THAN_UINT(0, total);
    int calls = ready_calls;
    static char bytes[65536];
    size_t read_n = 0;
    size_t n;
    while ((n = host_reads(host, bytes, sizeof bytes, 100)) > 0) {
        read_n += n;
    }
    TEST_ASSERT_EQUAL_UINT(total, read_n);
    looped_settle(loop, 20000);
    TEST_ASSERT_GREATER_THAN_INT(calls, ready_calls);
    uart_sends("more");
    expect_at_host(host, "more");
    close(host);
}

static void test_host_that_goes_while_the_end_is_full_gives_room(void)
{
    open_uart("pty");
    int host = open_host();
    fill();
    int calls = ready_calls;
    close(host);
    looped_settle(loop, 20000);
    TEST_ASSERT_GREATER_THAN_INT(calls, ready_calls);
    uart_sends("to nobody");
}

static void test_absent_host_costs_no_processor_time(void)
{
    open_uart("pty");
    int host = open_host();
    host_sends(host, "x");
    expect_from_host("x");
    uart_sends("unread");
    close(host);
    looped_settle(loop, 10000);
    struct rusage before;
    struct rusage after;
    getrusage(RUSAGE_SELF, &before);
    int calls = ready_calls;
    looped_settle(loop, 100000);
    getrusage(RUSAGE_SELF, &after);
    TEST_ASSERT_EQUAL_INT(calls, ready_calls);
    TEST_ASSERT_LESS_OR_EQUAL_INT(3, after.ru_nvcsw - before.ru_nvcsw);
}

static void test_settings_of_a_host_do_not_stay_for_the_next(void)
{
    open_uart("pty");
    int host = open_host();
    struct termios settings;
    TEST_ASSERT_EQUAL_INT(0, tcgetattr(host, &settings));
    settings.c_lflag |= ICANON | ECHO;
    TEST_ASSERT_EQUAL_INT(0, tcsetattr(host, TCSANOW, &settings));
    host_sends(host, "line\n");
    expect_from_host("line\n");
    close(host);
    looped_settle(loop, 10000);
    host = open_host();
    TEST_ASSERT_EQUAL_INT(0, tcgetattr(host, &settings));
    TEST_ASSERT_EQUAL_HEX32(0, settings.c_lflag & (ICANON | ECHO));
    close(host);
}

static void expect_link_to_us(void)
{
    char target[100] = "";
    TEST_ASSERT_GREATER_THAN_INT(0, readlink(link_path, target, sizeof target - 1));
    TEST_ASSERT_EQUAL_STRING(linux_uart_path(uart), target);
}

static void open_linked(void)
{
    char port[80];
    snprintf(port, sizeof port, "pty:%s", link_path);
    open_uart(port);
}

static void close_uart(void)
{
    linux_uart_close(uart);
    uart = NULL;
}

static bool link_exists(void)
{
    struct stat status;
    return lstat(link_path, &status) == 0;
}

static bool lock_exists(void)
{
    struct stat status;
    return lstat(lock_path, &status) == 0;
}

static void test_link_is_made_and_removed(void)
{
    open_linked();
    expect_link_to_us();
    int host = open(link_path, O_RDWR | O_NOCTTY);
    host_sends(host, "by link");
    expect_from_host("by link");
    close(host);
    close_uart();
    TEST_ASSERT_FALSE(link_exists());
}

static void test_stale_link_is_replaced(void)
{
    TEST_ASSERT_EQUAL_INT(0, symlink("/dev/pts/no-such-number", link_path));
    open_linked();
    expect_link_to_us();
}

/* D-LIN-4: a second program does not take a running one's host away. */
static void test_link_of_a_running_program_is_left(void)
{
    char port[80];
    char expected[200];
    open_linked();
    snprintf(port, sizeof port, "pty:%s", link_path);
    TEST_ASSERT_NULL(linux_uart_open(loop, port, on_ready, NULL, error, sizeof error));
    snprintf(expected, sizeof expected, "%s: is in use by another program", port);
    TEST_ASSERT_EQUAL_STRING(expected, error);
    expect_link_to_us();
}

/* A program that locks nothing, such as an older daemon or socat, keeps its link as long as that leads
 * somewhere. */
static void test_link_of_a_program_without_a_lock_is_left(void)
{
    char port[80];
    char expected[200];
    TEST_ASSERT_EQUAL_INT(0, symlink("/dev/null", link_path));
    snprintf(port, sizeof port, "pty:%s", link_path);
    TEST_ASSERT_NULL(linux_uart_open(loop, port, on_ready, NULL, error, sizeof error));
    snprintf(expected, sizeof expected, "%s: is in use: it leads to a terminal that exists", port);
    TEST_ASSERT_EQUAL_STRING(expected, error);
    TEST_ASSERT_TRUE(link_exists());
    TEST_ASSERT_FALSE(lock_exists());
}

/* D-LIN-4: after a crash the link may lead into somebody's terminal. Its lock is free: it is taken over. */
static void test_link_with_a_free_lock_is_taken_over(void)
{
    TEST_ASSERT_EQUAL_INT(0, symlink("/dev/null", link_path));
    (void)close(open(lock_path, O_RDWR | O_CREAT, 0600));
    open_linked();
    expect_link_to_us();
    close_uart();
    TEST_ASSERT_FALSE(link_exists());
    TEST_ASSERT_FALSE(lock_exists());
}

static void test_a_lock_that_is_a_link_is_not_followed(void)
{
    char port[80];
    TEST_ASSERT_EQUAL_INT(0, symlink("/dev/null", lock_path));
    snprintf(port, sizeof port, "pty:%s", link_path);
    TEST_ASSERT_NULL(linux_uart_open(loop, port, on_ready, NULL, error, sizeof error));
    TEST_ASSERT_FALSE(link_exists());
    TEST_ASSERT_EQUAL_INT(0, unlink(lock_path));
}

/* What a program that was killed leaves behind: its terminal's number may be the new one's. */
static void test_link_to_the_number_of_the_new_terminal_is_stale(void)
{
    open_uart("pty");
    TEST_ASSERT_EQUAL_INT(0, symlink(linux_uart_path(uart), link_path));
    close_uart();
    open_linked();
    expect_link_to_us();
}

static void test_a_host_that_has_left_is_told_once(void)
{
    open_uart("pty");
    looped_settle(loop, 10000);
    TEST_ASSERT_FALSE(linux_uart_host_left(uart));
    int host = open_host();
    host_sends(host, "x");
    expect_from_host("x");
    TEST_ASSERT_FALSE(linux_uart_host_left(uart));
    close(host);
    looped_settle(loop, 10000);
    TEST_ASSERT_TRUE(linux_uart_host_left(uart));
    TEST_ASSERT_FALSE(linux_uart_host_left(uart));
}

static void test_link_that_now_belongs_to_another_is_left(void)
{
    open_linked();
    TEST_ASSERT_EQUAL_INT(0, unlink(link_path));
    TEST_ASSERT_EQUAL_INT(0, symlink("/dev/null", link_path));
    close_uart();
    TEST_ASSERT_TRUE(link_exists());
}

static void test_file_in_the_place_of_the_link_is_an_error_and_left(void)
{
    char port[80];
    char expected[200];
    snprintf(port, sizeof port, "pty:%s", link_path);
    close(open(link_path, O_WRONLY | O_CREAT, 0600));
    TEST_ASSERT_NULL(linux_uart_open(loop, port, on_ready, NULL, error, sizeof error));
    snprintf(expected, sizeof expected, "%s: exists and is not a symbolic link", port);
    TEST_ASSERT_EQUAL_STRING(expected, error);
    TEST_ASSERT_TRUE(link_exists());
}

static void test_unknown_ports_are_refused_by_name(void)
{
    const char *const ports[] = {"", "pty:", "ptyx", "tcp:1", "serial", "serial:"};
    for (size_t i = 0; i < sizeof ports / sizeof ports[0]; i++) {
        char expected[120];
        TEST_ASSERT_NULL(linux_uart_open(loop, ports[i], on_ready, NULL, error, sizeof error));
        snprintf(expected, sizeof expected,
                 "%s: not a host port; expected pty, pty:LINKPATH or serial:DEVICE[@BAUD]", ports[i]);
        TEST_ASSERT_EQUAL_STRING(expected, error);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bytes_pass_unchanged_in_both_directions);
    RUN_TEST(test_all_byte_values_arrive);
    RUN_TEST(test_host_may_close_and_reopen);
    RUN_TEST(test_bytes_sent_just_before_closing_still_arrive);
    RUN_TEST(test_bytes_written_without_a_host_are_discarded);
    RUN_TEST(test_answers_that_a_host_left_unread_do_not_reach_the_next);
    RUN_TEST(test_the_answer_of_the_next_host_survives_late_news_of_the_last);
    RUN_TEST(test_more_unread_bytes_than_one_buffer_holds_do_not_reach_the_next_host);
    RUN_TEST(test_full_host_end_takes_less_and_reports_room_later);
    RUN_TEST(test_host_that_goes_while_the_end_is_full_gives_room);
    RUN_TEST(test_absent_host_costs_no_processor_time);
    RUN_TEST(test_settings_of_a_host_do_not_stay_for_the_next);
    RUN_TEST(test_link_is_made_and_removed);
    RUN_TEST(test_stale_link_is_replaced);
    RUN_TEST(test_link_of_a_running_program_is_left);
    RUN_TEST(test_link_to_the_number_of_the_new_terminal_is_stale);
    RUN_TEST(test_link_of_a_program_without_a_lock_is_left);
    RUN_TEST(test_link_with_a_free_lock_is_taken_over);
    RUN_TEST(test_a_lock_that_is_a_link_is_not_followed);
    RUN_TEST(test_a_host_that_has_left_is_told_once);
    RUN_TEST(test_link_that_now_belongs_to_another_is_left);
    RUN_TEST(test_file_in_the_place_of_the_link_is_an_error_and_left);
    RUN_TEST(test_unknown_ports_are_refused_by_name);
    return UNITY_END();
}
