/* The host's byte stream over a serial line. The line is a real pseudo-terminal: its kernel side takes every
 * rate and hangs up like an adapter that is pulled out; a symbolic link to it is the device's path, which
 * stays the same when it comes back. */
#define _GNU_SOURCE
#include <asm/termbits.h> /* termios2; excludes termios.h */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "linux_uart.h"
#include "looped.h"
#include "unity.h"

static char folder[] = "/tmp/test_linux_uart_serial.XXXXXX";
static char device[64];
static char port[100];
static char error[200];
static loop_t *loop;
static hal_uart_t *uart;
static int far_end; /* the other end of the line */
static uint8_t received[4096];
static size_t received_n;
static int ready_calls;

static void on_ready(void *ctx)
{
    (void)ctx;
    ready_calls++;
    size_t n;
    while (uart != NULL &&
           (n = hal_uart_read(uart, received + received_n, sizeof received - received_n)) > 0) {
        received_n += n;
    }
}

static void plug_in(void)
{
    char path[64];
    far_end = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, far_end);
    TEST_ASSERT_EQUAL_INT(0, grantpt(far_end));
    TEST_ASSERT_EQUAL_INT(0, unlockpt(far_end));
    TEST_ASSERT_EQUAL_INT(0, ptsname_r(far_end, path, sizeof path));
    unlink(device);
    TEST_ASSERT_EQUAL_INT(0, symlink(path, device));
}

static void pull_out(void)
{
    close(far_end);
    far_end = -1;
}

void setUp(void)
{
    memset(folder + strlen(folder) - 6, 'X', 6);
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    snprintf(device, sizeof device, "%s/line", folder);
    snprintf(port, sizeof port, "serial:%s", device);
    loop = loop_create();
    uart = NULL;
    received_n = 0;
    ready_calls = 0;
    error[0] = '\0';
    plug_in();
}

void tearDown(void)
{
    linux_uart_close(uart);
    loop_destroy(loop);
    close(far_end);
    unlink(device);
    rmdir(folder);
}

static void open_uart(const char *name)
{
    uart = linux_uart_open(loop, name, on_ready, NULL, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(uart, error);
}

static void expect_refused(const char *name, const char *reason)
{
    char expected[240];
    snprintf(expected, sizeof expected, "%s: %s", name, reason);
    TEST_ASSERT_NULL(linux_uart_open(loop, name, on_ready, NULL, error, sizeof error));
    TEST_ASSERT_EQUAL_STRING(expected, error);
}

static void expect_from_far_end(const char *text)
{
    uint64_t end_us = loop_refresh_now_us(loop) + LOOPED_LIMIT_US;
    TEST_ASSERT_EQUAL_INT(strlen(text), write(far_end, text, strlen(text)));
    loop_set_deadline_us(loop, end_us);
    while (received_n < strlen(text) && loop_now_us(loop) < end_us) {
        TEST_ASSERT_TRUE(loop_run_once(loop));
    }
    TEST_ASSERT_EQUAL_UINT(strlen(text), received_n);
    TEST_ASSERT_EQUAL_MEMORY(text, received, received_n);
    received_n = 0;
}

static void expect_at_far_end(const char *text)
{
    char bytes[64];
    size_t n = 0;
    TEST_ASSERT_EQUAL_UINT(strlen(text), hal_uart_write(uart, (const uint8_t *)text, strlen(text)));
    while (n < strlen(text)) {
        struct pollfd watched = {.fd = far_end, .events = POLLIN};
        TEST_ASSERT_EQUAL_INT(1, poll(&watched, 1, 1000));
        ssize_t step = read(far_end, bytes + n, sizeof bytes - n);
        TEST_ASSERT_GREATER_THAN_INT(0, step);
        n += (size_t)step;
    }
    TEST_ASSERT_EQUAL_MEMORY(text, bytes, n);
}

static void expect_rate(unsigned rate)
{
    struct termios2 settings;
    TEST_ASSERT_EQUAL_INT(0, ioctl(far_end, TCGETS2, &settings));
    TEST_ASSERT_EQUAL_UINT(rate, settings.c_ospeed);
    TEST_ASSERT_EQUAL_UINT(rate, settings.c_ispeed);
    TEST_ASSERT_EQUAL_HEX32(CS8, settings.c_cflag & CSIZE);
    TEST_ASSERT_EQUAL_HEX32(0, settings.c_cflag & (PARENB | CSTOPB | CRTSCTS));
    TEST_ASSERT_EQUAL_HEX32(0, settings.c_lflag);
    TEST_ASSERT_EQUAL_HEX32(0, settings.c_oflag);
}

static void test_rates(void)
{
    static const unsigned rates[] = {57600, 128000, 115200, 250000, 1200};
    open_uart(port);
    expect_rate(128000); /* no standard rate, and the one taken when none is given */
    linux_uart_close(uart);
    for (size_t i = 0; i < sizeof rates / sizeof rates[0]; i++) {
        char name[120];
        snprintf(name, sizeof name, "%s@%u", port, rates[i]);
        open_uart(name);
        expect_rate(rates[i]);
        linux_uart_close(uart);
    }
    uart = NULL;
}

static void test_bytes_pass_unchanged_in_both_directions(void)
{
    /* What a terminal that is not raw would change. */
    const char text[] = "a\r\n\x03\x04\x13\x11\x7F\xFF\x1A|";
    open_uart(port);
    TEST_ASSERT_EQUAL_STRING(device, linux_uart_path(uart));
    expect_from_far_end(text);
    expect_at_far_end(text);
    looped_settle(loop, 20000);
    TEST_ASSERT_EQUAL_UINT(0, received_n); /* nor is anything echoed */
}

static void test_what_is_wrong_is_said(void)
{
    char name[160];
    snprintf(name, sizeof name, "%s/nothing", folder);
    char missing[200];
    snprintf(missing, sizeof missing, "serial:%s", name);
    expect_refused(missing, "no such device");
    expect_refused("serial:/dev/null", "not a serial line");
    if (geteuid() != 0) { /* who may do everything is never denied anything */
        TEST_ASSERT_EQUAL_INT(0, chmod(device, 0));
        expect_refused(port, "Permission denied");
        TEST_ASSERT_EQUAL_INT(0, chmod(device, 0600));
    }
    static const char *const bad[] = {"", "fast", "0", "1199", "4000001", "-9600", "9600 ", "99999999999"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        snprintf(name, sizeof name, "%s@%s", port, bad[i]);
        expect_refused(name, "the baud rate is not a number from 1200 to 4000000");
    }
}

static void test_the_line_is_for_one_program(void)
{
    open_uart(port);
    hal_uart_t *first = uart;
    expect_refused(port, "is in use by another program");
    uart = first;
    linux_uart_close(uart);
    open_uart(port);
}

static void test_an_adapter_is_pulled_out_and_comes_back(void)
{
    open_uart(port);
    expect_from_far_end("before");
    TEST_ASSERT_FALSE(linux_uart_host_left(uart));
    for (int i = 0; i < 2; i++) {
        pull_out();
        looped_settle(loop, 20000);
        TEST_ASSERT_TRUE(linux_uart_host_left(uart));
        TEST_ASSERT_EQUAL_UINT(5, hal_uart_write(uart, (const uint8_t *)"lost!", 5));
        TEST_ASSERT_EQUAL_UINT(0, hal_uart_read(uart, received, sizeof received));
        plug_in();
        looped_settle(loop, 600000); /* it is looked for twice a second */
        expect_rate(128000);
        expect_from_far_end("after");
        expect_at_far_end("again");
    }
}

/* No more than 20 ms of the line's time waits in front of what comes next: at 57600 baud 115 bytes. */
static void test_no_more_is_taken_than_the_line_carries_soon(void)
{
    static const uint8_t bytes[1000];
    char name[120];
    snprintf(name, sizeof name, "%s@57600", port);
    open_uart(name);
    looped_settle(loop, 1000);
    TEST_ASSERT_EQUAL_UINT(115, hal_uart_write(uart, bytes, sizeof bytes));
    TEST_ASSERT_EQUAL_UINT(0, hal_uart_write(uart, bytes, sizeof bytes));
    const uint64_t from_us = loop_now_us(loop);
    size_t taken = 115;
    while (taken < 1000) {
        const int calls = ready_calls;
        while (ready_calls == calls) { /* room is reported by itself */
            TEST_ASSERT_TRUE(loop_run_once(loop));
        }
        taken += hal_uart_write(uart, bytes, sizeof bytes - taken);
        const uint64_t passed_us = loop_now_us(loop) - from_us;
        TEST_ASSERT_LESS_OR_EQUAL_UINT(115 + passed_us * 5760 / 1000000 + 1, taken);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_rates);
    RUN_TEST(test_bytes_pass_unchanged_in_both_directions);
    RUN_TEST(test_what_is_wrong_is_said);
    RUN_TEST(test_the_line_is_for_one_program);
    RUN_TEST(test_an_adapter_is_pulled_out_and_comes_back);
    RUN_TEST(test_no_more_is_taken_than_the_line_carries_soon);
    return UNITY_END();
}
