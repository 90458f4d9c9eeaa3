/* flood [--json] [ROW...]: measures the rows of the flood table, all of them without names.
 * flood --check [--all] [ROW...]: each row is a test; those that await something are skipped without
 * --all. */
#include <stdio.h>
#include <string.h>

#include "flood.h"
#include "unity.h"

enum { TEXT = 300 };

static flood_t flood;
static const flood_row_t *row;
static bool all;

void setUp(void) {}

void tearDown(void) {}

/* --- For people --- */

static const char *in_ms(int32_t ms, char text[16])
{
    if (ms == FLOOD_NEVER) {
        return "never";
    }
    (void)snprintf(text, 16, "%d", (int)ms);
    return text;
}

static void print_head(void)
{
    (void)printf(
        "| what is sent | longest gap of the links, ms | values of others, forged | hand on an old value, ms "
        "| "
        "whole after, ms | listed untruly, ms | pages a second | bind: refused, known part ms, new part ms "
        "|\n| --- | --- | --- | --- | --- | --- | --- | --- |\n");
}

static void print_row(const flood_result_t *result)
{
    char whole[16];
    char known[16];
    char fresh[16];
    (void)printf("| %s | %d, %d, %d | %d, %d | %d | %s | %d | %.2f | %d, %s, %s |\n", row->what,
                 (int)result->gap_ms[0], (int)result->gap_ms[1], (int)result->gap_ms[2], (int)result->foreign,
                 (int)result->forged, (int)result->stale_ms, in_ms(result->whole_ms, whole),
                 (int)result->untrue_ms, result->pages / 100.0, (int)result->refusals,
                 row->alone ? "-" : in_ms(result->known_ms, known),
                 row->alone ? "-" : in_ms(result->new_ms, fresh));
}

/* --- For tools --- */

static const char *or_null(int32_t ms, char text[16])
{
    return ms == FLOOD_NEVER ? "null" : in_ms(ms, text);
}

static void print_json(const flood_result_t *result, bool first)
{
    char whole[16];
    char known[16];
    char fresh[16];
    (void)printf(
        "%s\n {\"name\": \"%s\", \"what\": \"%s\", \"gap_ms\": [%d, %d, %d], \"foreign_values\": %d, "
        "\"forged_values\": %d, \"stale_ms\": %d, \"whole_ms\": %s, \"untrue_ms\": %d, \"pages_per_100_s\": "
        "%d, \"refusals\": %d, \"known_ms\": %s, \"new_ms\": %s}",
        first ? "[" : ",", row->name, row->what, (int)result->gap_ms[0], (int)result->gap_ms[1],
        (int)result->gap_ms[2], (int)result->foreign, (int)result->forged, (int)result->stale_ms,
        or_null(result->whole_ms, whole), (int)result->untrue_ms, (int)result->pages, (int)result->refusals,
        or_null(result->known_ms, known), or_null(result->new_ms, fresh));
}

/* --- The whole --- */

static void test_row(void)
{
    char text[TEXT];
    if (row->awaits != NULL && !all) {
        (void)snprintf(text, sizeof text, "awaits %s", row->awaits);
        TEST_IGNORE_MESSAGE(text);
    }
    flood_measure(&flood, row);
    flood_judge(row, &flood.result, text, sizeof text);
    TEST_ASSERT_TRUE_MESSAGE(text[0] == '\0', text);
}

static void measure_row(void)
{
    flood_measure(&flood, row);
}

static bool is_named(int argc, char **argv, const char *name)
{
    bool any = false;
    for (int i = 1; i < argc; i++) {
        if (argv[i][0] != '-') {
            any = true;
            if (strcmp(argv[i], name) == 0) {
                return true;
            }
        }
    }
    return !any;
}

static bool has_option(int argc, char **argv, const char *option)
{
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], option) == 0) {
            return true;
        }
    }
    return false;
}

int main(int argc, char **argv)
{
    const bool json = has_option(argc, argv, "--json");
    const bool check = has_option(argc, argv, "--check");
    bool first = true;
    all = has_option(argc, argv, "--all");
    UNITY_BEGIN();
    for (int i = 0; i < flood_row_count; i++) {
        row = &flood_rows[i];
        if (!is_named(argc, argv, row->name)) {
            continue;
        }
        if (check) {
            UnityDefaultTestRun(test_row, row->name, __LINE__);
            continue;
        }
        measure_row();
        if (json) {
            print_json(&flood.result, first);
        } else {
            if (first) {
                print_head();
            }
            print_row(&flood.result);
        }
        first = false;
    }
    if (json) {
        (void)printf("\n]\n");
    }
    return check ? UNITY_END() : 0;
}
