/* The log of pdcpd: what it says of events, how often, and when (D-LIN-7). Its lines go through a pipe. */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pdcpd_log.h"
#include "unity.h"

enum { SECOND_US = 1000000 };

static int ends[2];
static int standard_error; /* the program's own */
static pdcpd_log_t log_of_test;
static pdcp_tables_t tables;
static char text[65536];

void setUp(void)
{
    static const pdcp_identity_t identity = {.vid = 2, .pid = 2, .sn = 4};
    TEST_ASSERT_EQUAL_INT(0, pipe2(ends, O_CLOEXEC));
    standard_error = dup(STDERR_FILENO);
    TEST_ASSERT_EQUAL_INT(STDERR_FILENO, dup2(ends[1], STDERR_FILENO));
    (void)close(ends[1]);
    memset(&tables, 0, sizeof tables);
    pdcp_tables_init(&tables);
    pdcp_tables_add(&tables, 0, &identity, 0x11);
}

void tearDown(void)
{
    (void)dup2(standard_error, STDERR_FILENO);
    (void)close(standard_error);
    (void)close(ends[0]);
    (void)unsetenv("JOURNAL_STREAM");
}

static void open_log(void)
{
    TEST_ASSERT_TRUE(pdcpd_log_open(&log_of_test, PDCPD_LOG_INFO));
}

/* Without the time, in which tests do not live. */
static void open_log_without_time(void)
{
    open_log();
    log_of_test.has_time = false;
}

/* All that was said. */
static const char *close_log(void)
{
    size_t len = 0;
    ssize_t n;
    pdcpd_log_close(&log_of_test);
    TEST_ASSERT_EQUAL_INT(STDERR_FILENO,
                          dup2(standard_error, STDERR_FILENO)); /* the last writing end is closed */
    while ((n = read(ends[0], &text[len], sizeof text - 1 - len)) > 0) {
        len += (size_t)n;
    }
    text[len] = '\0';
    return text;
}

static void tell(uint64_t now_us, pdcp_event_kind_t kind)
{
    const pdcp_event_t event = {.kind = kind, .place = 0, .channel = PDCP_NONE};
    pdcpd_log_event(&log_of_test, now_us, &tables, &event);
}

static void test_an_event_is_told_with_its_device(void)
{
    open_log_without_time();
    tell(0, PDCP_EVENT_READY);
    tell(0, PDCP_EVENT_LOST);
    TEST_ASSERT_EQUAL_STRING("pdcpd: 2:2:4 (id 17) is set up\npdcpd: 2:2:4 (id 17) is gone\n", close_log());
}

static void test_a_level_that_is_not_wanted_is_not_told(void)
{
    open_log_without_time();
    pdcpd_log_say(&log_of_test, 0, PDCPD_LOG_DEBUG, "too much");
    pdcpd_log_say(&log_of_test, 0, PDCPD_LOG_INFO, "enough");
    TEST_ASSERT_EQUAL_STRING("pdcpd: enough\n", close_log());
}

/* 20 lines of one kind a second; then how many there were more, when the second is over. Another kind is told
 * all the same. */
static void test_a_flood_of_one_kind_is_summed_up(void)
{
    open_log_without_time();
    for (int i = 0; i < 1000; i++) {
        tell(5 * SECOND_US + (uint64_t)i, PDCP_EVENT_LOST);
    }
    tell(5 * SECOND_US + 1000, PDCP_EVENT_READY);
    TEST_ASSERT_EQUAL_UINT64(6 * SECOND_US, pdcpd_log_step(&log_of_test, 5 * SECOND_US + 2000));
    TEST_ASSERT_EQUAL_UINT64(UINT64_MAX, pdcpd_log_step(&log_of_test, 6 * SECOND_US));
    tell(6 * SECOND_US + 1, PDCP_EVENT_LOST);
    const char *said = close_log();
    int lines = 0;
    for (const char *line = said; (line = strstr(line, "is gone\n")) != NULL; line++) {
        lines++;
    }
    TEST_ASSERT_EQUAL(20 + 1 + 1, lines);
    TEST_ASSERT_NOT_NULL(strstr(said,
                                "pdcpd: 2:2:4 (id 17) is set up\n"
                                "pdcpd: 980 lines like this were left out: 2:2:4 (id 17) is gone\n"
                                "pdcpd: 2:2:4 (id 17) is gone\n"));
}

static void test_one_line_too_many_is_told_itself(void)
{
    open_log_without_time();
    for (int i = 0; i < PDCPD_LOG_RATE + 1; i++) {
        tell(0, PDCP_EVENT_LOST);
    }
    (void)pdcpd_log_step(&log_of_test, SECOND_US);
    TEST_ASSERT_NULL(strstr(close_log(), "left out"));
}

static void test_lines_begin_with_the_time(void)
{
    int year;
    int rest[6];
    open_log();
    pdcpd_log_say(&log_of_test, 0, PDCPD_LOG_INFO, "now");
    TEST_ASSERT_EQUAL_INT(7, sscanf(close_log(), "%4d-%2d-%2d %2d:%2d:%2d.%3d pdcpd: now\n", &year, &rest[0],
                                    &rest[1], &rest[2], &rest[3], &rest[4], &rest[5]));
    TEST_ASSERT_NOT_NULL(strstr(text, " pdcpd: now\n"));
}

/* A journal adds the time itself, and says by this variable that standard error is one. */
static void test_a_journal_gets_no_time(void)
{
    struct stat status;
    char stream[64];
    TEST_ASSERT_EQUAL_INT(0, fstat(STDERR_FILENO, &status));
    (void)snprintf(stream, sizeof stream, "%llu:%llu", (unsigned long long)status.st_dev,
                   (unsigned long long)status.st_ino);
    TEST_ASSERT_EQUAL_INT(0, setenv("JOURNAL_STREAM", stream, 1));
    open_log();
    pdcpd_log_say(&log_of_test, 0, PDCPD_LOG_INFO, "now");
    TEST_ASSERT_EQUAL_STRING("pdcpd: now\n", close_log());
}

/* A request of the host as [API 3.3] and D-API-5 lay it out, and what the log says of it. */
typedef struct {
    uint16_t message;
    uint16_t len;
    uint8_t payload[26];
    const char *line;
} order_t;

static void test_what_a_host_changes_is_told(void)
{
    static const order_t orders[] = {
        {0x2304, 10, {2, 0, 2, 0, 4, 0, 1, 7, 0x40, 0x03}, "sets parameter 7 of 2:2:4.1 to 40 03"},
        {0x2304,
         26,
         {2, 0, 2, 0, 4, 0, 0, 9, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1},
         "sets parameter 9 of 2:2:4.0 to 01 01 01 01 01 01 01 01 01 01 01 01 01 01 01 01 ..."},
        {0x2307, 14, {2, 0, 2, 0, 4, 0, 1, 0x34, 0x12, 2, 0, 5, 0, 2}, "links 2:2:4.1 -> 4660:2:5.2"},
        {0x230A, 15, {2, 0, 2, 0, 4, 0, 3, 3, 0xF4, 1, 9, 9, 9, 9, 9}, "sends 03 F4 01 to 2:2:4"},
        {0x230A,
         15,
         {2, 0, 2, 0, 4, 0, 255, 1, 2, 3, 4, 5, 6, 7, 8},
         "sends 01 02 03 04 05 06 07 08 to 2:2:4"},
        {0x230D, 1, {0}, "resets all devices"},
        {0x230D, 1, {3}, "resets device 3 of the list"},
        {0x2404, 1, {0x0B}, "sets the flags to 0Bh"},
        {0x2407, 2, {1, 9}, "saves configuration 9"},
        {0x2407, 2, {2, 0}, "loads configuration 0, the active one"},
        {0x2407, 2, {3, 255}, "erases configuration 255"},
        {0x2407, 2, {4, 0}, "has terminal channels linked"},
        {0x2407, 2, {5, 0}, "removes all links"},
        {0x2407, 2, {6, 0}, "enforces sole access"},
        {0x2407, 2, {7, 0}, "has stand-ins sought"},
        {0x2407, 2, {8, 0}, "adopts stand-ins"},
        {0x2407, 2, {9, 0}, "wants action 9"},
        {0x240D, 6, {0, 1, 2, 1, 0, 0}, "writes configurations, bytes 256 to 257 of 258"},
        {0x2410, 7, {2, 0, 2, 0, 5, 0, 2}, "unlinks 2:2:5.2"},
    };
    char expected[4096] = "";
    open_log_without_time();
    for (size_t i = 0; i < sizeof orders / sizeof orders[0]; i++) {
        pdcpd_log_served(&log_of_test, 0, orders[i].message, orders[i].payload, orders[i].len, 0);
        const size_t len = strlen(expected);
        (void)snprintf(&expected[len], sizeof expected - len, "pdcpd: the host: %s\n", orders[i].line);
    }
    TEST_ASSERT_EQUAL_STRING(expected, close_log());
}

static void test_what_a_host_was_refused_is_told(void)
{
    static const uint8_t link[14] = {2, 0, 2, 0, 4, 0, 1, 2, 0, 2, 0, 5, 0, 2};
    open_log_without_time();
    pdcpd_log_served(&log_of_test, 0, 0x2307, link, sizeof link, 0x08);
    TEST_ASSERT_EQUAL_STRING("pdcpd: the host: links 2:2:4.1 -> 2:2:5.2: refused with error 08h\n",
                             close_log());
}

/* What only reads, what nobody knows, and what is too short to say what it was meant to do. */
static void test_what_changes_nothing_is_not_told(void)
{
    static const uint8_t zeros[32];
    static const uint16_t messages[] = {0x2201, 0x2204, 0x2301, 0x2401, 0x240A, 0x2413, 0x2416, 0x7777};
    open_log_without_time();
    for (size_t i = 0; i < sizeof messages / sizeof messages[0]; i++) {
        pdcpd_log_served(&log_of_test, 0, messages[i], zeros, sizeof zeros, 0);
    }
    pdcpd_log_served(&log_of_test, 0, 0x2304, zeros, 8, 0x01);
    pdcpd_log_served(&log_of_test, 0, 0x2307, zeros, 13, 0x01);
    pdcpd_log_served(&log_of_test, 0, 0x230A, zeros, 14, 0x01);
    pdcpd_log_served(&log_of_test, 0, 0x240D, zeros, 4, 0x01);
    pdcpd_log_served(&log_of_test, 0, 0x2410, zeros, 6, 0x01);
    TEST_ASSERT_EQUAL_STRING("", close_log());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_event_is_told_with_its_device);
    RUN_TEST(test_a_level_that_is_not_wanted_is_not_told);
    RUN_TEST(test_a_flood_of_one_kind_is_summed_up);
    RUN_TEST(test_one_line_too_many_is_told_itself);
    RUN_TEST(test_lines_begin_with_the_time);
    RUN_TEST(test_a_journal_gets_no_time);
    RUN_TEST(test_what_a_host_changes_is_told);
    RUN_TEST(test_what_a_host_was_refused_is_told);
    RUN_TEST(test_what_changes_nothing_is_not_told);
    return UNITY_END();
}
