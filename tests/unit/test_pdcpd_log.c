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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_event_is_told_with_its_device);
    RUN_TEST(test_a_level_that_is_not_wanted_is_not_told);
    RUN_TEST(test_a_flood_of_one_kind_is_summed_up);
    RUN_TEST(test_one_line_too_many_is_told_itself);
    RUN_TEST(test_lines_begin_with_the_time);
    RUN_TEST(test_a_journal_gets_no_time);
    return UNITY_END();
}
