/* The 31 messages of the source on the wire [API 3.3], and what is said of parameters and resets (D-API-4).
 * Passthrough, links and long values are in test_arb_hostpass.c, test_arb_hostlinks.c and
 * test_arb_hostbulk.c.
 *
 * The messages of the tables were laid out by hand from [API 3.3.1] to [API 3.3.31]; their checksums were
 * computed apart from this project's code. */
#include "hostlink.h"
#include "pdcp_request.h"
#include "unity.h"

static exchange_t x;
static arb_app_t app;

void setUp(void)
{
    hostlink_start(&x, &app, false);
}

void tearDown(void) {}

/* A request, what it leads to on the bus, its answer. */
typedef struct {
    const char *ask;
    const exchange_pair_t *bus; /* NULL: nothing */
    const char *answer;
} row_t;

static void run(const row_t *rows, unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        hostlink_send(&x, rows[i].ask);
        if (rows[i].bus != NULL) {
            hostlink_silence();
            exchange_pairs(&x, rows[i].bus);
        }
        hostlink_expect(rows[i].answer);
        hostlink_silence();
    }
}

#define RUN(rows) run(rows, sizeof(rows) / sizeof((rows)[0]))

/* [API 3.3.1] to [API 3.3.13] */
static void test_bytes_of_what_is_answered_from_the_tables(void)
{
    static const row_t rows[] = {
        {"FE 19 01 22 01 EB 00 00", NULL, "FE 19 02 22 01 33 06 00 02 01 01 00 A9 6D"},
        {"FE 19 01 22 02 69 03 00 00 F0 E1", NULL, "FE 19 03 22 02 AD 03 00 01 D1 F1"},
        {"FE 19 04 22 03 EF 03 00 01 D1 F1", NULL,
         "FE 19 05 22 03 5B 0D 00 02 00 02 00 04 00 00 00 00 00 00 1D 73"},
        {"FE 19 04 22 04 F9 03 00 03 93 D1", NULL, "FE 19 06 22 04 3D 03 00 02 B2 C1"},
        {"FE 19 07 22 05 34 03 00 01 D1 F1", NULL,
         "FE 19 08 22 05 D2 0D 00 02 00 02 00 06 00 01 00 53 10 11 52 BF"},
        {"FE 19 07 22 06 89 03 00 02 B2 C1", NULL, "FE 19 09 22 06 DB 03 00 02 B2 C1"},
        {"FE 19 0A 22 07 16 03 00 01 D1 F1", NULL,
         "FE 19 0B 22 07 A2 0D 00 02 00 02 00 04 00 01 00 50 20 21 27 B5"},
        {"FE 19 0A 22 08 51 03 00 00 F0 E1", NULL, "FE 19 0C 22 08 1A 03 00 02 B2 C1"},
        {"FE 19 22 22 15 20 00 00", NULL, "FE 19 00 22 15 80 00 00"},
    };
    exchange_add_both(&x);
    RUN(rows);
    exchange_silence(&x);
}

/* [API 3.3.17] to [API 3.3.22] */
static void test_bytes_of_parameters(void)
{
    static const exchange_pair_t get[] = {{"311#03 08 01", "211#83 01 08 01 AABBCC"}, {NULL, NULL}};
    static const exchange_pair_t refused[] = {{"311#03 63 00", "211#83 00 63 00"}, {NULL, NULL}};
    static const exchange_pair_t set[] = {{"311#04 0A 00 E803", "211#84 01 0A 00 E803"}, {NULL, NULL}};
    static const row_t rows[] = {
        {"FE 19 01 23 09 2E 0A 00 02 00 02 00 04 00 01 08 10 4D", get,
         "FE 19 02 23 09 4B 05 00 AA BB CC F6 6C"},
        {"FE 19 01 23 0A 93 0A 00 02 00 02 00 04 00 00 63 EC A3", refused,
         "FE 19 03 23 0A EA 03 00 06 36 81"},
        {"FE 19 04 23 0B 6B 0C 00 02 00 02 00 04 00 00 0A E8 03 0D D8", set, "FE 19 05 23 0B F5 00 00"},
        {"FE 19 04 23 0C 16 0B 00 09 00 09 00 09 00 00 0A 00 D5 B6", NULL,
         "FE 19 06 23 0C 7A 03 00 03 93 D1"},
    };
    exchange_add_both(&x);
    RUN(rows);
    exchange_silence(&x);
}

/* [API 3.3.14] to [API 3.3.16], [API 3.3.23] to [API 3.3.25] */
static void test_bytes_of_links(void)
{
    static const row_t rows[] = {
        {"FE 19 07 23 0D 1B 10 00 02 00 02 00 04 00 01 02 00 02 00 06 00 01 45 35", exchange_making,
         "FE 19 08 23 0D 43 03 00 02 B2 C1"},
        {"FE 19 0D 22 0E 05 03 00 01 D1 F1", NULL,
         "FE 19 0E 22 0E DE 11 00 02 00 02 00 04 00 01 02 00 02 00 06 00 01 02 B4 03"},
        {"FE 19 0D 22 0F 6E 03 00 02 B2 C1", NULL, "FE 19 0F 22 0F AA 03 00 02 B2 C1"},
        {"FE 19 07 23 10 28 10 00 02 00 02 00 04 00 02 02 00 02 00 06 00 01 30 FD", NULL,
         "FE 19 09 23 10 12 03 00 04 74 A1"},
    };
    exchange_add_both(&x);
    RUN(rows);
    exchange_silence(&x);
}

/* [API 3.3.26] to [API 3.3.31] */
static void test_bytes_of_passthrough_and_reset(void)
{
    static const exchange_pair_t own[] = {{"311#50 AA BB", "211#D0 01 02 03"}, {NULL, NULL}};
    static const exchange_pair_t both[] = {{"311#0B", "211#8B 01"}, {"312#0B", "212#8B 01"}, {NULL, NULL}};
    static const row_t rows[] = {
        {"FE 19 0A 23 11 A2 11 00 02 00 02 00 04 00 03 50 AA BB 00 00 00 00 00 F4 30", own,
         "FE 19 0B 23 11 C0 11 00 02 00 02 00 04 00 04 D0 01 02 03 00 00 00 00 62 AF"},
        {"FE 19 0A 23 12 1F 11 00 02 00 02 00 04 00 00 00 00 00 00 00 00 00 00 9B D8", NULL,
         "FE 19 0C 23 12 29 03 00 01 D1 F1"},
        {"FE 19 0D 23 13 20 03 00 03 93 D1", NULL, "FE 19 0F 23 13 59 0A 00 00 00 00 00 00 00 00 00 3E 31"},
        {"FE 19 0D 23 14 36 03 00 00 F0 E1", both, "FE 19 0E 23 14 AF 00 00"},
    };
    exchange_add_both(&x);
    RUN(rows);
    exchange_silence(&x);
}

/* --- parameters --- */

/* D-API-11: node ids are given by the arbitrator, the source of an input that has a link is written by
 * 2307h. */
static void test_parameters_that_are_the_arbitrators(void)
{
    exchange_add_both(&x);
    pdcp_tables_t *tables = &x.arb->bus.tables;
    tables->channels[pdcp_tables_channel(tables, 1, 1)].link = PDCP_LINK_INACTIVE;
    hostlink_request(0x2304, BYTES(DEV_OUT, 0, 8, 0x22));
    hostlink_error(0x2306, 0x0E);
    hostlink_request(0x2304, BYTES(DEV_OUT, 1, 5, 0x22));
    hostlink_error(0x2306, 0x0E);
    for (uint8_t param = 5; param <= 8; param++) {
        hostlink_request(0x2304, BYTES(DEV_IN, 1, param, 1, 2));
        hostlink_error(0x2306, 0x0E);
        hostlink_request(0x230A, BYTES(DEV_IN, 5, 4, param, 1, 1, 2, 0, 0, 0));
        hostlink_error(0x230C, 0x0E);
    }
    exchange_silence(&x);
    hostlink_request(0x2304, BYTES(DEV_OUT, 1, 6, 1)); /* of an output it means nothing: the device says */
    exchange_tx(&x, "311#04 06 01 01");
    exchange_rx(&x, "211#84 00 06 01");
    hostlink_error(0x2306, 0x06);
}

/* D-API-11: the source that an unconnected input names is its own affair, until it is set up again; what it
 * listens to is not. */
static void test_the_source_of_an_unconnected_input(void)
{
    exchange_add_both(&x);
    hostlink_request(0x2304, BYTES(DEV_IN, 1, 6, 9, 0, 3));
    exchange_tx(&x, "312#04 06 01 09 00 03");
    exchange_rx(&x, "212#84 01 06 01 09 00 03");
    hostlink_reply(0x2305, NULL, 0);
    hostlink_request(0x2304, BYTES(DEV_IN, 1, 7, 1, 2));
    hostlink_error(0x2306, 0x0E);
    exchange_silence(&x);
}

/* The arbitrator knows that an output may be sending, and stops it when its time has come. */
static void test_a_transfer_that_the_host_enables(void)
{
    exchange_add_output(&x, "FE");
    hostlink_request(0x2304, BYTES(DEV_OUT, 1, 4, 1));
    exchange_tx(&x, "311#04 04 01 01");
    exchange_rx(&x, "211#84 01 04 01 01");
    hostlink_reply(0x2305, NULL, 0);
    exchange_pass(&x, 100);
    exchange_rx(&x, "0FE#55");
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_CHANNEL_DATA]);
    hostlink_request(0x2304, BYTES(DEV_OUT, 1, 4, 0));
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01 00");
    hostlink_reply(0x2305, NULL, 0);
    exchange_pass(&x, 100);
    exchange_rx(&x, "0FE#55"); /* an unknown device's (D-BUS-36) */
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_CHANNEL_DATA]);
}

/* --- reset --- */

/* Several at once; the results of those that were and those that were not. */
static void test_a_reset_of_all_of_which_one_fails(void)
{
    exchange_add_both(&x);
    hostlink_request(0x230D, BYTES(0));
    exchange_tx(&x, "311#0B");
    exchange_tx(&x, "312#0B");
    exchange_rx(&x, "212#8B 01");
    for (int i = 0; i < 2; i++) {
        exchange_pass(&x, 100);
        exchange_tx(&x, "311#0B");
        hostlink_silence();
    }
    exchange_pass(&x, 100);
    hostlink_reply(0x230F, BYTES(0x02, 0, 0, 0, 0, 0, 0, 0));
    hostlink_request(0x2201, NULL, 0);
    hostlink_reply(0x2202, BYTES(1, 0, 1, 0)); /* the silent one is not lost for that */
}

/* Bits of devices that were not asked to be reset are cleared, as are those of devices that do not exist
 * (D-API-12). */
static void test_a_reset_of_one(void)
{
    exchange_add_both(&x);
    hostlink_request(0x230D, BYTES(2));
    exchange_tx(&x, "312#0B");
    exchange_rx(&x, "212#8B 00"); /* it refuses */
    hostlink_reply(0x230F, BYTES(0, 0, 0, 0, 0, 0, 0, 0));
    hostlink_request(0x230D, BYTES(2));
    exchange_tx(&x, "312#0B");
    exchange_rx(&x, "212#8B");
    hostlink_reply(0x230E, NULL, 0);
    hostlink_request(0x2201, NULL, 0);
    hostlink_reply(0x2202, BYTES(1, 0, 1, 0));
    exchange_silence(&x);
}

/* D-API-3: 230Fh never carries an error code. */
static void test_a_reset_that_is_not_begun(void)
{
    static const uint8_t none[8];
    exchange_add_both(&x);
    hostlink_request(0x230D, NULL, 0);
    hostlink_reply(0x230F, none, 8);
    hostlink_request(0x230D, BYTES(0, 0));
    hostlink_reply(0x230F, none, 8);
    hostlink_request(0x230D, BYTES(3));
    hostlink_reply(0x230F, none, 8);
    hostlink_request(0x230D, BYTES(255));
    hostlink_reply(0x230F, none, 8);
    for (int i = 0; i < 4; i++) {
        hostlink_request(0x2301, BYTES(DEV_OUT, 0, 8));
    }
    hostlink_request(0x230D, BYTES(1));
    hostlink_reply(0x230F, none, 8); /* the fifth */
    exchange_tx(&x, "311#03 08 00");
    exchange_silence(&x);
    hostlink_start(&x, &app, true);
    hostlink_send(&x, "FE 19 0D 23 14 37 03 00 00 F0 E1");
    const uint8_t *payload;
    uint16_t len;
    TEST_ASSERT_EQUAL_HEX16(0x230F, hostlink_take(&payload, &len));
    TEST_ASSERT_EQUAL(8, len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(none, payload, 8);
}

static void test_a_reset_of_an_empty_bus(void)
{
    hostlink_request(0x230D, BYTES(0));
    hostlink_reply(0x230E, NULL, 0);
    exchange_silence(&x);
}

/* A device that has another request under way for too long is not reset; the answer is there within 3 s. */
static void test_a_reset_behind_a_long_transfer(void)
{
    exchange_add_output(&x, "FE");
    x.arb->bus.tables.devices[0].ack_ms = 500;
    pdcp_request_get(&x.arb->bus, 0, PDCP_CLIENT_NONE, 0, 7, 512);
    exchange_tx(&x, "311#03 07 00");
    hostlink_request(0x230D, BYTES(0));
    for (int ms = 0; ms < 999; ms++) {
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
        hostlink_silence();
    }
    exchange_wait(&x, 1);
    hostlink_reply(0x230F, BYTES(0, 0, 0, 0, 0, 0, 0, 0));
    (void)exchange_drain(&x);
    exchange_rx(&x, "211#83 01 07 00 41"); /* nor later */
    exchange_silence(&x);
}

/* D-BUS-12: the arbitrator forgets all devices in the middle of it. */
static void test_a_reset_and_the_standby(void)
{
    exchange_add_output(&x, "FE");
    exchange_meet_rival(&x);
    hostlink_request(0x230D, BYTES(0));
    exchange_rx(&x, "100#0A");
    hostlink_reply(0x230F, BYTES(0, 0, 0, 0, 0, 0, 0, 0));
    hostlink_silence();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bytes_of_what_is_answered_from_the_tables);
    RUN_TEST(test_bytes_of_parameters);
    RUN_TEST(test_bytes_of_links);
    RUN_TEST(test_bytes_of_passthrough_and_reset);
    RUN_TEST(test_parameters_that_are_the_arbitrators);
    RUN_TEST(test_the_source_of_an_unconnected_input);
    RUN_TEST(test_a_transfer_that_the_host_enables);
    RUN_TEST(test_a_reset_of_all_of_which_one_fails);
    RUN_TEST(test_a_reset_of_one);
    RUN_TEST(test_a_reset_that_is_not_begun);
    RUN_TEST(test_a_reset_of_an_empty_bus);
    RUN_TEST(test_a_reset_behind_a_long_transfer);
    RUN_TEST(test_a_reset_and_the_standby);
    return UNITY_END();
}
