/* The 31 messages of the source on the wire [API 3.3], with every error code that they can carry (D-API-4).
 *
 * The messages of the tables were laid out by hand from [API 3.3.1] to [API 3.3.31]; their checksums were
 * computed apart from this project's code. */
#include <string.h>

#include "hostlink.h"
#include "pdcp_request.h"
#include "unity.h"

#define DEV_OUT 2, 0, 2, 0, 4, 0 /* 0002:0002:0004, id 11h, output 1 */
#define DEV_IN 2, 0, 2, 0, 6, 0  /* 0002:0002:0006, id 12h, input 1 */
#define DEV_NONE 9, 0, 9, 0, 9, 0
#define BYTES HOSTLINK_BYTES

static exchange_t x;
static arb_app_t app;

void setUp(void)
{
    hostlink_start(&x, &app, false);
}

void tearDown(void) {}

static void add_devices(void)
{
    exchange_add_output(&x, "FE");
    exchange_add_input(&x);
}

static void ask(uint16_t id, const uint8_t *payload, uint16_t len)
{
    hostlink_ask(&x, id, 1, payload, len);
}

static void expect(uint16_t id, const uint8_t *payload, uint16_t len)
{
    hostlink_answer(id, 1, payload, len);
}

static void expect_error(uint16_t id, uint8_t error)
{
    hostlink_answer(id, 1, &error, 1);
}

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
    add_devices();
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
    add_devices();
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
    add_devices();
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
    add_devices();
    RUN(rows);
    exchange_silence(&x);
}

/* --- passthrough --- */

#define PASS(dlc, ...) BYTES(DEV_OUT, dlc, __VA_ARGS__)

/* The answer is returned whatever it says, its unused bytes are 0, and a late answer to a request before is
 * not taken for it. */
static void test_passthrough_returns_the_next_answer(void)
{
    exchange_add_output(&x, "FE");
    ask(0x230A, PASS(3, 3, 7, 1, 0, 0, 0, 0, 0));
    exchange_tx(&x, "311#03 07 01");
    exchange_rx(&x, "211#83 01 05 01 FE"); /* about another parameter */
    exchange_rx(&x, "211#84 01 07 01");
    exchange_rx(&x, "011#0A");
    hostlink_silence();
    exchange_rx(&x, "211#83 02 07 01");
    expect(0x230B, PASS(4, 0x83, 2, 7, 1, 0, 0, 0, 0)); /* it wants bulk transfer: that is the answer */
    ask(0x230A, PASS(8, 0x7F, 1, 2, 3, 4, 5, 6, 7));
    exchange_tx(&x, "311#7F 01020304050607");
    exchange_rx(&x, "211#FF");
    expect(0x230B, PASS(1, 0xFF, 0, 0, 0, 0, 0, 0, 0));
    ask(0x230A, PASS(3, 8, 0xE8, 3, 9, 9, 9, 9, 9)); /* what lies behind the DLC is not sent */
    exchange_tx(&x, "311#08 E803");
    exchange_rx(&x, "211#88 00 E803");
    expect(0x230B, PASS(4, 0x88, 0, 0xE8, 3, 0, 0, 0, 0));
    exchange_silence(&x);
}

static void test_passthrough_is_repeated_and_fails(void)
{
    exchange_add_output(&x, "FE");
    ask(0x230A, PASS(2, 0x50, 1, 0, 0, 0, 0, 0, 0));
    for (int i = 0; i < 3; i++) {
        exchange_tx(&x, "311#50 01");
        hostlink_silence();
        exchange_pass(&x, 100);
    }
    expect_error(0x230C, 0x05);
    exchange_rx(&x, "211#D0");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_DROP_BAD_CODE]);
}

static void test_passthrough_of_what_is_wrong(void)
{
    exchange_add_output(&x, "FE");
    ask(0x230A, PASS(9, 0x50, 0, 0, 0, 0, 0, 0, 0));
    expect_error(0x230C, 0x01);
    ask(0x230A, BYTES(DEV_OUT, 1, 0x50));
    expect_error(0x230C, 0x01);
    ask(0x230A, BYTES(DEV_NONE, 1, 0x50, 0, 0, 0, 0, 0, 0, 0));
    expect_error(0x230C, 0x03);
}

/* D-API-11: what the arbitrator lives on, and what no device answers. */
static void test_passthrough_of_codes_that_are_not_the_hosts(void)
{
    exchange_add_output(&x, "FE");
    for (unsigned code = 0; code < 256; code++) {
        const bool is_request = code == 3 || code == 4 || code == 8 || code == 9 || code == 0x0B;
        if (!is_request && (code < 0x10 || code >= 0x80)) {
            ask(0x230A, PASS(1, (uint8_t)code, 0, 0, 0, 0, 0, 0, 0));
            expect_error(0x230C, 0x0E);
        }
    }
    exchange_silence(&x);
    hostlink_silence();
}

/* D-BUS-25: the tables follow. */
static void test_passthrough_of_a_beacon_interval(void)
{
    exchange_add_output(&x, "FE");
    ask(0x230A, PASS(5, 4, 10, 0, 0xD0, 7, 0, 0, 0));
    exchange_tx(&x, "311#04 0A 00 D007");
    exchange_rx(&x, "211#84 01 0A 00 D007");
    expect(0x230B, PASS(6, 0x84, 1, 10, 0, 0xD0, 7, 0, 0));
    TEST_ASSERT_EQUAL(2000, x.arb->bus.tables.devices[0].beacon_ms);
    ask(0x230A, PASS(5, 4, 10, 0, 0x64, 0, 0, 0, 0));
    exchange_tx(&x, "311#04 0A 00 6400");
    exchange_rx(&x, "211#84 00 0A 00"); /* refused: as before */
    expect(0x230B, PASS(4, 0x84, 0, 10, 0, 0, 0, 0, 0));
    TEST_ASSERT_EQUAL(2000, x.arb->bus.tables.devices[0].beacon_ms);
}

/* A device that was reset is lost until it binds again, also when the host has done it by hand. */
static void test_passthrough_of_a_reset(void)
{
    exchange_add_output(&x, "FE");
    ask(0x230A, PASS(1, 0x0B, 0, 0, 0, 0, 0, 0, 0));
    exchange_tx(&x, "311#0B");
    exchange_rx(&x, "211#8B 00");
    expect(0x230B, PASS(2, 0x8B, 0, 0, 0, 0, 0, 0, 0));
    ask(0x2201, NULL, 0);
    expect(0x2202, BYTES(1, 0, 1, 0));
    ask(0x230A, PASS(1, 0x0B, 0, 0, 0, 0, 0, 0, 0));
    exchange_tx(&x, "311#0B");
    exchange_rx(&x, "211#8B 01");
    expect(0x230B, PASS(2, 0x8B, 1, 0, 0, 0, 0, 0, 0));
    ask(0x2201, NULL, 0);
    expect(0x2202, BYTES(0, 0, 0, 0));
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LOST));
}

/* To all: Suspend and Release only; devices do not answer. */
static void test_passthrough_to_all(void)
{
    exchange_add_output(&x, "FE");
    ask(0x230A, BYTES(0, 0, 0, 0, 0, 0, 3, 8, 0xE8, 3, 0, 0, 0, 0, 0));
    expect(0x230B, BYTES(0, 0, 0, 0, 0, 0, 3, 8, 0xE8, 3, 0, 0, 0, 0, 0));
    exchange_tx(&x, "300#08 E803");
    ask(0x230A, BYTES(0, 0, 0, 0, 0, 0, 1, 9, 0, 0, 0, 0, 0, 0, 0));
    expect(0x230B, BYTES(0, 0, 0, 0, 0, 0, 1, 9, 0, 0, 0, 0, 0, 0, 0));
    exchange_tx(&x, "300#09");
    for (unsigned code = 0; code < 256; code++) {
        if (code != 8 && code != 9) {
            ask(0x230A, BYTES(0, 0, 0, 0, 0, 0, 1, (uint8_t)code, 0, 0, 0, 0, 0, 0, 0));
            expect_error(0x230C, 0x0E);
        }
    }
    ask(0x230A, BYTES(0, 0, 0, 0, 0, 0, 1, 8, 0, 0, 0, 0, 0, 0, 0)); /* Suspend without its time */
    expect_error(0x230C, 0x0F);
    ask(0x230A, BYTES(0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0));
    expect_error(0x230C, 0x01);
    exchange_silence(&x);
}

/* D-BUS-42: an arbitrator on standby sends nothing. */
static void test_passthrough_to_all_on_standby(void)
{
    exchange_meet_server(&x);
    TEST_ASSERT_TRUE(pdcp_arb_is_on_standby(x.arb));
    ask(0x230A, BYTES(0, 0, 0, 0, 0, 0, 1, 9, 0, 0, 0, 0, 0, 0, 0));
    expect_error(0x230C, 0x0B);
    exchange_silence(&x);
}

/* D-API-11: node ids are given by the arbitrator, the source of an input that has a link is written by
 * 2307h. */
static void test_parameters_that_are_the_arbitrators(void)
{
    add_devices();
    pdcp_tables_t *tables = &x.arb->bus.tables;
    tables->channels[pdcp_tables_channel(tables, 1, 1)].link = PDCP_LINK_INACTIVE;
    ask(0x2304, BYTES(DEV_OUT, 0, 8, 0x22));
    expect_error(0x2306, 0x0E);
    ask(0x2304, BYTES(DEV_OUT, 1, 5, 0x22));
    expect_error(0x2306, 0x0E);
    for (uint8_t param = 5; param <= 8; param++) {
        ask(0x2304, BYTES(DEV_IN, 1, param, 1, 2));
        expect_error(0x2306, 0x0E);
        ask(0x230A, BYTES(DEV_IN, 5, 4, param, 1, 1, 2, 0, 0, 0));
        expect_error(0x230C, 0x0E);
    }
    exchange_silence(&x);
    ask(0x2304, BYTES(DEV_OUT, 1, 6, 1)); /* of an output it means nothing: the device says */
    exchange_tx(&x, "311#04 06 01 01");
    exchange_rx(&x, "211#84 00 06 01");
    expect_error(0x2306, 0x06);
}

/* D-API-11: the source that an unconnected input names is its own affair, until it is set up again; what it
 * listens to is not. */
static void test_the_source_of_an_unconnected_input(void)
{
    add_devices();
    ask(0x2304, BYTES(DEV_IN, 1, 6, 9, 0, 3));
    exchange_tx(&x, "312#04 06 01 09 00 03");
    exchange_rx(&x, "212#84 01 06 01 09 00 03");
    expect(0x2305, NULL, 0);
    ask(0x2304, BYTES(DEV_IN, 1, 7, 1, 2));
    expect_error(0x2306, 0x0E);
    exchange_silence(&x);
}

/* The arbitrator knows that an output may be sending, and stops it when its time has come. */
static void test_a_transfer_that_the_host_enables(void)
{
    exchange_add_output(&x, "FE");
    ask(0x2304, BYTES(DEV_OUT, 1, 4, 1));
    exchange_tx(&x, "311#04 04 01 01");
    exchange_rx(&x, "211#84 01 04 01 01");
    expect(0x2305, NULL, 0);
    const uint8_t output = pdcp_tables_channel(&x.arb->bus.tables, 0, 1);
    TEST_ASSERT_TRUE(x.arb->bus.tables.channels[output].enabled);
    ask(0x2304, BYTES(DEV_OUT, 1, 4, 0));
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01 00");
    expect(0x2305, NULL, 0);
    TEST_ASSERT_FALSE(x.arb->bus.tables.channels[output].enabled);
}

/* --- reset --- */

/* Several at once; the results of those that were and those that were not. */
static void test_a_reset_of_all_of_which_one_fails(void)
{
    add_devices();
    ask(0x230D, BYTES(0));
    exchange_tx(&x, "311#0B");
    exchange_tx(&x, "312#0B");
    exchange_rx(&x, "212#8B 01");
    for (int i = 0; i < 2; i++) {
        exchange_pass(&x, 100);
        exchange_tx(&x, "311#0B");
        hostlink_silence();
    }
    exchange_pass(&x, 100);
    expect(0x230F, BYTES(0x02, 0, 0, 0, 0, 0, 0, 0));
    ask(0x2201, NULL, 0);
    expect(0x2202, BYTES(1, 0, 1, 0)); /* the silent one is not lost for that */
}

/* Bits of devices that were not asked to be reset are cleared, as are those of devices that do not exist
 * (D-API-12). */
static void test_a_reset_of_one(void)
{
    add_devices();
    ask(0x230D, BYTES(2));
    exchange_tx(&x, "312#0B");
    exchange_rx(&x, "212#8B 00"); /* it refuses */
    expect(0x230F, BYTES(0, 0, 0, 0, 0, 0, 0, 0));
    ask(0x230D, BYTES(2));
    exchange_tx(&x, "312#0B");
    exchange_rx(&x, "212#8B");
    expect(0x230E, NULL, 0);
    ask(0x2201, NULL, 0);
    expect(0x2202, BYTES(1, 0, 1, 0));
    exchange_silence(&x);
}

/* D-API-3: 230Fh never carries an error code. */
static void test_a_reset_that_is_not_begun(void)
{
    static const uint8_t none[8];
    add_devices();
    ask(0x230D, NULL, 0);
    expect(0x230F, none, 8);
    ask(0x230D, BYTES(0, 0));
    expect(0x230F, none, 8);
    ask(0x230D, BYTES(3));
    expect(0x230F, none, 8);
    ask(0x230D, BYTES(255));
    expect(0x230F, none, 8);
    for (int i = 0; i < 4; i++) {
        ask(0x2301, BYTES(DEV_OUT, 0, 8));
    }
    ask(0x230D, BYTES(1));
    expect(0x230F, none, 8); /* the fifth */
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
    ask(0x230D, BYTES(0));
    expect(0x230E, NULL, 0);
    exchange_silence(&x);
}

/* A device that has another request under way for too long is not reset; the answer is there within 3 s. */
static void test_a_reset_behind_a_long_transfer(void)
{
    exchange_add_output(&x, "FE");
    x.arb->bus.tables.devices[0].ack_ms = 500;
    pdcp_request_get(&x.arb->bus, 0, PDCP_CLIENT_NONE, 0, 7, 512);
    exchange_tx(&x, "311#03 07 00");
    ask(0x230D, BYTES(0));
    for (int ms = 0; ms < 999; ms++) {
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
        hostlink_silence();
    }
    exchange_wait(&x, 1);
    expect(0x230F, BYTES(0, 0, 0, 0, 0, 0, 0, 0));
    TEST_ASSERT_FALSE(x.arb->bus.tables.devices[0].reset_asked);
}

/* D-BUS-12: the arbitrator forgets all devices in the middle of it. */
static void test_a_reset_and_the_standby(void)
{
    exchange_add_output(&x, "FE");
    exchange_meet_rival(&x);
    ask(0x230D, BYTES(0));
    exchange_rx(&x, "100#0A");
    expect(0x230F, BYTES(0, 0, 0, 0, 0, 0, 0, 0));
    hostlink_silence();
}

/* --- links --- */

static pdcp_channel_t *channel(uint8_t place)
{
    pdcp_tables_t *tables = &x.arb->bus.tables;
    return &tables->channels[pdcp_tables_channel(tables, place, 1)];
}

/* D-API-4, 08h: an output feeds no more than one input that wants it for itself (5300h has the bit). */
static void test_sole_access(void)
{
    add_devices();
    exchange_add_second_input(&x);
    channel(1)->link = PDCP_LINK_INACTIVE; /* remembered: it comes back */
    channel(1)->source.identity = x.arb->bus.tables.devices[0].identity;
    channel(1)->source.index = 1;
    ask(0x2307, BYTES(DEV_OUT, 1, 2, 0, 2, 0, 7, 0, 1));
    expect_error(0x2309, 0x08);
    exchange_silence(&x);
    channel(2)->type = 0x0051; /* the second one would share it */
    ask(0x2307, BYTES(DEV_OUT, 1, 2, 0, 2, 0, 7, 0, 1));
    exchange_tx(&x, "313#04 05 01 0200 0200");
    hostlink_silence();
}

/* The input of this device has a link to the output. */
static void remember_link(uint8_t place, uint8_t status)
{
    channel(place)->link = status;
    channel(place)->source.channel = pdcp_tables_channel(&x.arb->bus.tables, 0, 1);
    channel(place)->source.identity = x.arb->bus.tables.devices[0].identity;
    channel(place)->source.index = 1;
}

/* D-API-13: an input that has the link already, inactive, does not get it while another one works. One that
 * works may be asked for again, and of two that rest one may be made. */
static void test_sole_access_of_a_link_that_rests(void)
{
    add_devices();
    exchange_add_second_input(&x);
    remember_link(1, PDCP_LINK_INACTIVE);
    remember_link(2, PDCP_LINK_ACTIVE);
    ask(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    expect_error(0x2309, 0x08);
    ask(0x2307, BYTES(DEV_OUT, 1, 2, 0, 2, 0, 7, 0, 1));
    expect(0x2308, BYTES(2));
    exchange_silence(&x);
    remember_link(2, PDCP_LINK_INACTIVE);
    ask(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    exchange_tx(&x, "312#04 05 01 0200 0200");
    hostlink_silence();
}

/* D-API-13: what counts is how things are when the link is made: the other input's device asks for the output
 * first (Update Data Channel), and gets it while the host's link waits. */
static void test_sole_access_of_a_link_that_waits(void)
{
    static const exchange_pair_t asked_for[] = {
        {"313#03 06 01", "213#83 01 06 01 0400 01"},
        {"313#04 05 01 0200 0200", "213#84 01 05 01 0200 0200"},
        {"313#04 06 01 0400 01", "213#84 01 06 01 0400 01"},
        {"313#04 08 01 0050 2021", "213#84 01 08 01 0050 2021"},
        {"313#04 07 01 11 FE", "213#84 01 07 01 11 FE"},
        {"313#04 04 01 01", "213#84 01 04 01 01"},
        {"311#04 04 01 01", "211#84 01 04 01 01"},
        {"313#8F 01 01", NULL},
        {NULL, NULL},
    };
    add_devices();
    exchange_add_second_input(&x);
    exchange_rx(&x, "213#0F 01");
    exchange_tx(&x, "313#03 05 01");
    ask(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    hostlink_silence();
    exchange_rx(&x, "213#83 01 05 01 0200 0200");
    exchange_run(&x, asked_for);
    expect_error(0x2309, 0x08);
}

/* D-API-4, 09h: all node ids are given out, so that the device could not be set up. */
static void test_an_output_without_a_node_id(void)
{
    add_devices();
    x.arb->bus.tables.devices[0].state = PDCP_PLACE_FAILED;
    channel(0)->node_id = 0;
    ask(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    expect_error(0x2309, 0x09);
    ask(0x2307, BYTES(DEV_OUT, 2, DEV_IN, 1));
    expect_error(0x2309, 0x04);
}

/* D-API-6: an output never feeds an input of its own device: 0Fh. */
static void test_an_output_for_its_own_device(void)
{
    add_devices();
    exchange_add_second_input(&x);
    channel(2)->link = PDCP_LINK_INACTIVE; /* another input has it for itself: that comes second */
    channel(2)->source.identity = x.arb->bus.tables.devices[0].identity;
    channel(2)->source.index = 1;
    channel(1)->place = 0;
    channel(0)->next = pdcp_tables_channel(&x.arb->bus.tables, 1, 1);
    channel(1)->index = 2;
    ask(0x2307, BYTES(DEV_OUT, 1, DEV_OUT, 2));
    expect_error(0x2309, 0x0F);
}

/* A request whose waiting is over, behind an answer that the host does not take: nothing to be done at once,
 * again and again. */
static void test_a_host_that_does_not_read_costs_no_time(void)
{
    add_devices();
    exchange_rx(&x, "613#01 0200 0200 0700"); /* its setup is waited for */
    hostlink_room(0);
    ask(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    for (int i = 0; i < 4; i++) {
        ask(0x2201, NULL, 0); /* the last one is the fifth */
    }
    TEST_ASSERT_TRUE(app.api.turn.waiting);
    TEST_ASSERT_EQUAL(1, app.api.counters[ARB_HOSTAPI_BUSY]);
    exchange_wait(&x, 2100);
    (void)exchange_drain(&x);
    TEST_ASSERT_GREATER_THAN_INT32(0, (int32_t)(arb_app_step(&app, x.now_ms) - x.now_ms));
}

/* --- bulk transfer --- */

static void to_text(char *text, const uint8_t *bytes, uint16_t len)
{
    static const char digits[] = "0123456789ABCDEF";
    for (uint16_t i = 0; i < len; i++) {
        *text++ = digits[bytes[i] >> 4];
        *text++ = digits[bytes[i] & 15];
    }
    *text = '\0';
}

/* A packet of the 512 bytes, which count upwards. */
static void packet(char *text, const char *id, uint16_t at)
{
    uint8_t data[8] = {0x0E, (uint8_t)(at / 6)};
    const uint8_t len = 512 - at < 6 ? (uint8_t)(512 - at) : 6;
    for (uint8_t i = 0; i < len; i++) {
        data[2 + i] = (uint8_t)((at + i) * 7);
    }
    memcpy(text, id, 4);
    to_text(&text[4], data, (uint16_t)(2 + len));
}

/* D-BUS-13: 512 bytes pass both ways. */
static void test_a_value_of_512_bytes_is_read(void)
{
    char text[40];
    const uint8_t *payload;
    uint16_t len;
    exchange_add_output(&x, "FE");
    ask(0x2301, BYTES(DEV_OUT, 0, 7));
    exchange_tx(&x, "311#03 07 00");
    exchange_rx(&x, "211#83 02 07 00");
    exchange_tx(&x, "311#0C 07 00");
    exchange_rx(&x, "211#8C 01 07 00 0002");
    for (uint16_t at = 0; at < 512; at = (uint16_t)(at + 6)) {
        hostlink_silence();
        packet(text, "211#", at);
        exchange_rx(&x, text);
        exchange_tx(&x, "311#8E 01");
    }
    TEST_ASSERT_EQUAL_HEX16(0x2302, hostlink_take(&payload, &len));
    TEST_ASSERT_EQUAL(512, len);
    for (uint16_t i = 0; i < 512; i++) {
        TEST_ASSERT_EQUAL_HEX8((uint8_t)(i * 7), payload[i]);
    }
}

static void start_writing(void)
{
    uint8_t payload[8 + 512] = {DEV_OUT, 0, 7};
    for (uint16_t i = 0; i < 512; i++) {
        payload[8 + i] = (uint8_t)(i * 7);
    }
    exchange_add_output(&x, "FE");
    ask(0x2304, payload, sizeof payload);
    exchange_tx(&x, "311#0D 07 00 0002");
    exchange_rx(&x, "211#8D 01 07 00 0002");
}

static void test_a_value_of_512_bytes_is_written(void)
{
    char text[40];
    start_writing();
    for (uint16_t at = 0; at < 512; at = (uint16_t)(at + 6)) {
        hostlink_silence();
        packet(text, "311#", at);
        exchange_tx(&x, text);
        exchange_rx(&x, "211#8E 01");
    }
    expect(0x2305, NULL, 0);
    exchange_silence(&x);
}

/* Until the host has an answer, every millisecond; returns how many. */
static int wait_for(uint16_t id, uint8_t error)
{
    const uint8_t *payload;
    uint16_t len;
    for (int ms = 0; ms <= 3000; ms++) {
        const uint16_t have = hostlink_take(&payload, &len);
        if (have != 0) {
            TEST_ASSERT_EQUAL_HEX16(id, have);
            TEST_ASSERT_EQUAL_HEX8(error, payload[0]);
            return ms;
        }
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
    }
    TEST_FAIL_MESSAGE("no answer within 3 s");
    return 0;
}

/* D-API-3: a device that vanishes in the middle: an answer within 3 s, and the next request works. */
static void test_a_device_vanishes_while_it_is_read(void)
{
    char text[40];
    exchange_add_output(&x, "FE");
    ask(0x2301, BYTES(DEV_OUT, 0, 7));
    exchange_tx(&x, "311#03 07 00");
    exchange_rx(&x, "211#83 02 07 00");
    exchange_tx(&x, "311#0C 07 00");
    exchange_rx(&x, "211#8C 01 07 00 0002");
    for (uint16_t at = 0; at < 60; at = (uint16_t)(at + 6)) {
        packet(text, "211#", at);
        exchange_rx(&x, text);
        exchange_tx(&x, "311#8E 01");
    }
    TEST_ASSERT_LESS_OR_EQUAL(3000, wait_for(0x2303, 0x05));
    hostlink_silence();
    hostlink_ask(&x, 0x2201, 9, NULL, 0);
    hostlink_answer(0x2202, 9, BYTES(1, 0, 1, 0));
}

static void test_a_device_vanishes_while_it_is_written(void)
{
    start_writing();
    (void)exchange_drain(&x);
    TEST_ASSERT_LESS_OR_EQUAL(3000, wait_for(0x2306, 0x05));
    hostlink_silence();
    hostlink_ask(&x, 0x2201, 9, NULL, 0);
    hostlink_answer(0x2202, 9, BYTES(1, 0, 1, 0));
}

/* One millisecond after the other until the host has an answer, limit_ms at most; whether it has. */
static bool answered_within(int limit_ms, int *ms, uint16_t id, uint8_t error)
{
    const uint8_t *payload;
    uint16_t len;
    for (int i = 0; i < limit_ms; i++) {
        exchange_wait(&x, 1);
        ++*ms;
        const uint16_t have = hostlink_take(&payload, &len);
        if (have != 0) {
            TEST_ASSERT_EQUAL_HEX16(id, have);
            TEST_ASSERT_EQUAL_HEX8(error, payload[0]);
            return true;
        }
    }
    return false;
}

static void expect_next_request_works(void)
{
    (void)exchange_drain(&x);
    hostlink_silence();
    ask(0x2301, BYTES(DEV_OUT, 0, 7));
    exchange_tx(&x, "311#03 07 00");
    exchange_rx(&x, "211#83 01 07 00 2A");
    expect(0x2302, BYTES(0x2A));
    exchange_silence(&x);
}

/* D-API-16: a transfer whose every packet comes in time, 90 ms after the one before, would take 7.7 s. */
static void test_a_slow_device_is_read(void)
{
    char text[40];
    int ms = 0;
    exchange_add_output(&x, "FE");
    ask(0x2301, BYTES(DEV_OUT, 0, 7));
    exchange_rx(&x, "211#83 02 07 00");
    exchange_rx(&x, "211#8C 01 07 00 0002");
    uint16_t at = 0;
    do {
        (void)exchange_drain(&x);
        packet(text, "211#", at);
        exchange_rx(&x, text);
        exchange_tx(&x, "311#8E 01");
        at = (uint16_t)(at + 6);
    } while (!answered_within(90, &ms, 0x2303, 0x05));
    TEST_ASSERT_EQUAL(3000, ms);
    packet(text, "211#", at);
    exchange_rx(&x, text); /* nobody listens any more */
    expect_next_request_works();
}

static void test_a_slow_device_is_written(void)
{
    int ms = 0;
    start_writing();
    while (!answered_within(90, &ms, 0x2306, 0x05)) {
        exchange_rx(&x, "211#8E 01");
    }
    TEST_ASSERT_EQUAL(3000, ms);
    exchange_rx(&x, "211#8E 01");
    expect_next_request_works();
}

/* The same with a link: every write is answered at the last moment. It is undone, and can be made after. */
static void expect_that_it_is_undone(uint32_t quiet_ms)
{
    int ms = 0;
    int k = 0;
    add_devices();
    exchange_pass(&x, quiet_ms);
    exchange_beacons(&x);
    x.arb->bus.tables.devices[1].ack_ms = 500;
    ask(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    while (!answered_within(1400, &ms, 0x2309, 0x05)) {
        exchange_beacons(&x);
        exchange_rx(&x, exchange_making[k++].rx);
    }
    TEST_ASSERT_EQUAL(3000, ms);
    TEST_ASSERT_EQUAL(2, k);
    for (ms = 0; ms < 3000; ms += 500) {
        exchange_beacons(&x);
        exchange_wait(&x, 500);
    }
    (void)exchange_drain(&x);
    TEST_ASSERT_EQUAL(0, hostlink_waiting());
    ask(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    exchange_run(&x, exchange_making);
    expect(0x2308, BYTES(2));
    TEST_ASSERT_EQUAL(0, hostlink_waiting());
}

static void test_a_slow_device_is_linked(void)
{
    expect_that_it_is_undone(600); /* after the start-up */
}

/* The start-up does not take a link that is half made for one of the limb's. */
static void test_a_slow_device_is_linked_before_the_start_up(void)
{
    expect_that_it_is_undone(0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bytes_of_what_is_answered_from_the_tables);
    RUN_TEST(test_bytes_of_parameters);
    RUN_TEST(test_bytes_of_links);
    RUN_TEST(test_bytes_of_passthrough_and_reset);
    RUN_TEST(test_passthrough_returns_the_next_answer);
    RUN_TEST(test_passthrough_is_repeated_and_fails);
    RUN_TEST(test_passthrough_of_what_is_wrong);
    RUN_TEST(test_passthrough_of_codes_that_are_not_the_hosts);
    RUN_TEST(test_passthrough_of_a_beacon_interval);
    RUN_TEST(test_passthrough_of_a_reset);
    RUN_TEST(test_passthrough_to_all);
    RUN_TEST(test_passthrough_to_all_on_standby);
    RUN_TEST(test_parameters_that_are_the_arbitrators);
    RUN_TEST(test_the_source_of_an_unconnected_input);
    RUN_TEST(test_a_transfer_that_the_host_enables);
    RUN_TEST(test_a_reset_of_all_of_which_one_fails);
    RUN_TEST(test_a_reset_of_one);
    RUN_TEST(test_a_reset_that_is_not_begun);
    RUN_TEST(test_a_reset_of_an_empty_bus);
    RUN_TEST(test_a_reset_behind_a_long_transfer);
    RUN_TEST(test_a_reset_and_the_standby);
    RUN_TEST(test_sole_access);
    RUN_TEST(test_sole_access_of_a_link_that_rests);
    RUN_TEST(test_sole_access_of_a_link_that_waits);
    RUN_TEST(test_an_output_without_a_node_id);
    RUN_TEST(test_an_output_for_its_own_device);
    RUN_TEST(test_a_host_that_does_not_read_costs_no_time);
    RUN_TEST(test_a_value_of_512_bytes_is_read);
    RUN_TEST(test_a_value_of_512_bytes_is_written);
    RUN_TEST(test_a_device_vanishes_while_it_is_read);
    RUN_TEST(test_a_device_vanishes_while_it_is_written);
    RUN_TEST(test_a_slow_device_is_read);
    RUN_TEST(test_a_slow_device_is_written);
    RUN_TEST(test_a_slow_device_is_linked);
    RUN_TEST(test_a_slow_device_is_linked_before_the_start_up);
    return UNITY_END();
}
