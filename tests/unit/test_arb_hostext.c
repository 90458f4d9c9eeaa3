/* The extension group 24xxh (D-API-5), but for the event stream. */
#include <stdio.h>
#include <string.h>

#include "arb_version.h"
#include "hostlink.h"
#include "unity.h"

static exchange_t x;
static arb_app_t app;

void setUp(void)
{
    hostlink_start(&x, &app, false);
}

void tearDown(void) {}

/* Until the host has an answer, every millisecond, 3 s at most; frames are thrown away. */
static void wait_for_answer(void)
{
    for (int ms = 0; ms < 3000 && hostlink_waiting() == 0; ms++) {
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
    }
}

/* How many configurations are stored, and which one is active (2402h). */
static void expect_stored(uint8_t count, uint8_t active)
{
    const uint8_t *payload;
    uint16_t len;
    hostlink_request(0x2401, NULL, 0);
    TEST_ASSERT_EQUAL_HEX16(0x2402, hostlink_take(&payload, &len));
    TEST_ASSERT_EQUAL(11, len);
    TEST_ASSERT_EQUAL(count, payload[8]);
    TEST_ASSERT_EQUAL(active, payload[9]);
}

/* Complete messages, checksums computed apart. */
static void test_bytes(void)
{
    hostlink_send(&x, "FE 19 01 24 01 9F 00 00");
#ifndef __AVR__ /* there other limits may be built in */
    hostlink_expect("FE 19 02 24 01 D0 0D 00 01 00 01 00 20 80 80 00 00 00 02 21 5F");
#else
    (void)hostlink_take(&(const uint8_t *){NULL}, &(uint16_t){0});
#endif
    hostlink_send(&x, "FE 19 16 24 02 06 03 00 00 F0 E1");
    hostlink_expect("FE 19 17 24 02 5B 00 00");
    hostlink_send(&x, "FE 19 13 24 03 80 03 00 04 74 A1");
    hostlink_expect("FE 19 15 24 03 CB 03 00 02 B2 C1");
    hostlink_silence();
}

static void test_wrong_sizes(void)
{
    static const uint16_t ids[] = {0x2401, 0x2404, 0x2407, 0x240A, 0x240D, 0x2410, 0x2413, 0x2416};
    for (unsigned i = 0; i < sizeof ids / sizeof ids[0]; i++) {
        hostlink_request(ids[i], BYTES(0, 0, 0, 0));
        hostlink_error((uint16_t)(ids[i] + 2), 0x01);
    }
    hostlink_request(0x2419, BYTES(1, 0, 0, 0, 0)); /* events come from the arbitrator only */
    hostlink_reply(0x2200, NULL, 0);
}

/* --- 2401h, 2404h --- */

static uint8_t flags(void)
{
    const uint8_t *payload = NULL;
    uint16_t len = 0;
    hostlink_request(0x2401, NULL, 0);
    TEST_ASSERT_EQUAL_HEX16(0x2402, hostlink_take(&payload, &len));
    TEST_ASSERT_EQUAL(11, len);
    return payload[10];
}

static void test_arbitrator_info(void)
{
    hostlink_request(0x2401, NULL, 0);
    hostlink_reply(0x2402, BYTES(1, ARB_VERSION_MAJOR, ARB_VERSION_MINOR, ARB_VERSION_PATCH, PDCP_DEVICES_MAX,
                                 PDCP_CHANNELS_MAX, PDCP_CHANNELS_MAX, 0, 0, 0, 0x02));
#ifdef PROJECT_VERSION
    char version[20];
    (void)snprintf(version, sizeof version, "%d.%d.%d", ARB_VERSION_MAJOR, ARB_VERSION_MINOR,
                   ARB_VERSION_PATCH);
    TEST_ASSERT_EQUAL_STRING(PROJECT_VERSION, version);
#endif
}

/* Bit 4 is the event stream's: shown, not set. */
static void test_flags(void)
{
    TEST_ASSERT_EQUAL_HEX8(0x02,
                           flags()); /* from the factory 03h; no autoconfiguration by the command line */
    hostlink_request(0x2404, BYTES(0x15));
    hostlink_reply(0x2405, NULL, 0);
    TEST_ASSERT_EQUAL_HEX8(0x05, flags());
    hostlink_request(0x2416, BYTES(0x01));
    hostlink_reply(0x2417, NULL, 0);
    TEST_ASSERT_EQUAL_HEX8(0x15, flags());
    hostlink_request(0x2404, BYTES(0x02));
    hostlink_reply(0x2405, NULL, 0);
    TEST_ASSERT_EQUAL_HEX8(0x12, flags());
    hostlink_request(0x2404, BYTES(0x20));
    hostlink_error(0x2406, 0x0F);
    TEST_ASSERT_EQUAL_HEX8(0x12, flags());
}

static void test_the_strict_flag_is_in_force_at_once(void)
{
    hostlink_request(0x2404, BYTES(0x08));
    hostlink_reply(0x2405, NULL, 0);
    hostlink_send(&x, "FE 19 01 22 07 00 00 00");
    hostlink_answer(0x2203, 7, BYTES(0x0C));
    hostlink_request(0x2404, BYTES(0x00));
    hostlink_reply(0x2405, NULL, 0);
    hostlink_send(&x, "FE 19 01 22 07 00 00 00");
    hostlink_answer(0x2202, 7, BYTES(0, 0, 0, 0));
}

/* --- 2407h --- */

/* D-API-13. */
static void test_actions_that_cannot_be(void)
{
    exchange_pass(&x, 600);
    hostlink_request(0x2407, BYTES(0, 0));
    hostlink_error(0x2409, 0x0F);
    hostlink_request(0x2407, BYTES(9, 0));
    hostlink_error(0x2409, 0x0F);
    hostlink_request(0x2407, BYTES(2, 0)); /* none is active */
    hostlink_error(0x2409, 0x02);
    hostlink_request(0x2407, BYTES(3, 7));
    hostlink_error(0x2409, 0x02);
}

/* D-API-6: an action waits for a running setup, and answers 0Bh after 2 s. */
static void test_an_action_waits_for_a_running_setup(void)
{
    exchange_add_output(&x, "FE");
    exchange_rx(&x, "613#01 0900 0900 0900"); /* its setup is never answered */
    (void)exchange_drain(&x);
    hostlink_request(0x2407, BYTES(5, 0));
    for (int ms = 0; ms < 1999; ms++) {
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
        if (ms % 400 == 0) {
            exchange_rx(&x, "011#0A");
            exchange_rx(&x, "013#0A");
        }
        x.arb->bus.tables.devices[1].setup_attempts = 0; /* keeps it in its setup */
        TEST_ASSERT_EQUAL(0, hostlink_waiting());
    }
    exchange_wait(&x, 1);
    hostlink_error(0x2409, 0x0B);
}

/* D-API-4, 0Dh: the memory fails. */
static void test_storage_that_fails(void)
{
    hostlink_memory_works(false);
    exchange_pass(&x, 600);
    hostlink_request(0x2407, BYTES(1, 1));
    wait_for_answer();
    hostlink_error(0x2409, 0x0D);
    hostlink_request(0x240D, BYTES(0, 0, 12, 0, 1, 1, 0, 2, 3, 0, 3, 0, 0, 15, 0, 0));
    wait_for_answer();
    hostlink_error(0x240F, 0x0D);
}

static void test_an_action_with_its_result(void)
{
    exchange_pass(&x, 600);
    hostlink_request(0x2407, BYTES(5, 0)); /* nothing is there to be removed */
    wait_for_answer();
    hostlink_reply(0x2408, BYTES(0, 0));
    hostlink_request(0x2407, BYTES(6, 0));
    wait_for_answer();
    hostlink_reply(0x2408, BYTES(0, 0));
}

/* --- 240Ah, 240Dh --- */

/* An empty memory reads as no configurations: 1 0, 15 0 (D-API-15). */
static void test_reading_configurations(void)
{
    exchange_pass(&x, 600);
    hostlink_request(0x240A, BYTES(0, 0, 128));
    hostlink_reply(0x240B, BYTES(6, 0, 0, 0, 1, 0, 0, 15, 0, 0));
    hostlink_request(0x240A, BYTES(2, 0, 3));
    hostlink_reply(0x240B, BYTES(6, 0, 2, 0, 0, 15, 0));
    hostlink_request(0x240A, BYTES(6, 0, 3));
    hostlink_reply(0x240B, BYTES(6, 0, 6, 0));
    hostlink_request(0x240A, BYTES(7, 0, 3));
    hostlink_error(0x240C, 0x0F);
    hostlink_request(0x240A, BYTES(0, 0, 129));
    hostlink_error(0x240C, 0x0F);
}

static void test_writing_configurations_that_cannot_be(void)
{
    exchange_pass(&x, 600);
    hostlink_request(0x240D, BYTES(1, 0, 6, 0, 0)); /* not the beginning */
    wait_for_answer();
    hostlink_error(0x240F, 0x0F);
    hostlink_request(0x240D, BYTES(0, 0, 6, 0)); /* no bytes */
    hostlink_error(0x240F, 0x01);
    hostlink_request(0x240D, BYTES(0, 0, 6, 0, 1, 1, 0, 15, 0, 0)); /* one is announced, none is there */
    wait_for_answer();
    hostlink_error(0x240F, 0x0F);
    hostlink_request(0x240A, BYTES(0, 0, 128));
    hostlink_reply(0x240B, BYTES(6, 0, 0, 0, 1, 0, 0, 15, 0, 0));
}

/* One configuration, number 3, without links, in two pieces, and back. */
static void test_configurations_there_and_back(void)
{
    exchange_pass(&x, 600);
    hostlink_request(0x2416, BYTES(0x08));
    hostlink_reply(0x2417, NULL, 0);
    hostlink_request(0x240D, BYTES(0, 0, 12, 0, 1, 1, 0, 2, 3));
    wait_for_answer();
    hostlink_reply(0x240E, NULL, 0);
    hostlink_request(0x240D, BYTES(5, 0, 12, 0, 0, 3, 0, 0, 15, 0, 0));
    wait_for_answer();
    hostlink_reply(0x240E, NULL, 0);
    const uint8_t *event = NULL; /* they are not what they were: kind 4, none active, one stored */
    uint16_t len = 0;
    TEST_ASSERT_EQUAL_HEX16(0x2419, hostlink_take(&event, &len));
    TEST_ASSERT_EQUAL(7, len);
    TEST_ASSERT_EQUAL(4, event[0]);
    TEST_ASSERT_EQUAL(0, event[5]);
    TEST_ASSERT_EQUAL(1, event[6]);
    hostlink_request(0x2416, BYTES(0));
    hostlink_reply(0x2417, NULL, 0);
    hostlink_request(0x240A, BYTES(0, 0, 128));
    hostlink_reply(0x240B, BYTES(12, 0, 0, 0, 1, 1, 0, 2, 3, 0, 3, 0, 0, 15, 0, 0));
    hostlink_request(0x2407, BYTES(3, 3));
    wait_for_answer();
    hostlink_reply(0x2408, BYTES(0, 0));
    hostlink_request(0x240A, BYTES(0, 0, 128));
    hostlink_reply(0x240B, BYTES(6, 0, 0, 0, 1, 0, 0, 15, 0, 0));
}

enum { LONG = 102 };

/* One configuration, number 3, without links, with 30 entries that nobody knows. */
static void write_long_string(uint8_t *string)
{
    static const uint8_t head[] = {1, 1, 0, 2, 3, 0, 3, 0, 0};
    uint8_t piece[4 + LONG] = {0, 0, LONG, 0};
    memcpy(string, head, sizeof head);
    for (uint8_t at = sizeof head; at < (uint8_t)(LONG - 3); at = (uint8_t)(at + 3)) {
        string[at] = 0x80;
        string[at + 1] = at;
        string[at + 2] = 7;
    }
    memcpy(&string[LONG - 3], (const uint8_t[]){15, 0, 0}, 3);
    memcpy(&piece[4], string, LONG);
    exchange_pass(&x, 600);
    hostlink_request(0x240D, piece, sizeof piece);
    wait_for_answer();
    hostlink_reply(0x240E, NULL, 0);
}

/* The memory is slow: 32 bytes a step. */
static void test_many_bytes_are_read_in_steps(void)
{
    uint8_t answer[4 + LONG] = {LONG, 0, 0, 0};
    write_long_string(&answer[4]);
    hostlink_request(0x240A, BYTES(0, 0, 128));
    for (int i = 0; i < 2; i++) {
        TEST_ASSERT_EQUAL_UINT32(x.now_ms, arb_app_step(&app, x.now_ms));
        TEST_ASSERT_EQUAL(0, hostlink_waiting());
    }
    (void)arb_app_step(&app, x.now_ms);
    hostlink_reply(0x240B, answer, sizeof answer);
}

/* A string that becomes another one while it is read is read anew. */
static void test_a_string_that_changes_is_read_anew(void)
{
    uint8_t string[LONG];
    write_long_string(string);
    hostlink_request(0x240A, BYTES(0, 0, 128));
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, arb_config_erase(&app.limb.config, 3));
    wait_for_answer();
    hostlink_reply(0x240B, BYTES(6, 0, 0, 0, 1, 0, 0, 15, 0, 0));
}

/* Save 0 with none active takes the lowest free number, which becomes active. */
static void test_save_and_what_the_info_says(void)
{
    exchange_pass(&x, 600);
    hostlink_request(0x2407, BYTES(1, 0));
    wait_for_answer();
    hostlink_reply(0x2408, BYTES(0, 0));
    hostlink_request(0x2401, NULL, 0);
    hostlink_reply(0x2402, BYTES(1, ARB_VERSION_MAJOR, ARB_VERSION_MINOR, ARB_VERSION_PATCH, PDCP_DEVICES_MAX,
                                 PDCP_CHANNELS_MAX, PDCP_CHANNELS_MAX, 0, 1, 1, 0x02));
}

/* --- 2410h --- */

/* The host writes a string without the active configuration: it is not active any more, and decides
 * nothing. */
static void test_the_active_configuration_is_written_away(void)
{
    hostlink_request(0x2407, BYTES(1, 0));
    wait_for_answer();
    hostlink_reply(0x2408, BYTES(0, 0));
    TEST_ASSERT_TRUE(app.arb.bus.link.stored);
    hostlink_request(0x240D, BYTES(0, 0, 6, 0, 1, 0, 0, 15, 0, 0));
    wait_for_answer();
    hostlink_reply(0x240E, NULL, 0);
    expect_stored(0, 0);
    TEST_ASSERT_FALSE(app.arb.bus.link.stored);
}

static void make_link(void)
{
    exchange_add_both(&x);
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    exchange_run(&x, exchange_making);
    hostlink_reply(0x2308, BYTES(2));
}

/* Input off, source back to unconnected, output off (pdcp-bus.md 8). */
static void test_a_link_is_removed(void)
{
    make_link();
    hostlink_request(0x2410, BYTES(DEV_IN, 1));
    hostlink_silence();
    exchange_pairs(&x, exchange_removing);
    hostlink_reply(0x2411, NULL, 0);
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01");
    hostlink_request(0x2410, BYTES(DEV_IN, 1)); /* again: without traffic, as with 2307h */
    hostlink_reply(0x2411, NULL, 0);
    exchange_silence(&x);
    hostlink_request(0x2201, NULL, 0);
    hostlink_reply(0x2202, BYTES(2, 1, 1, 0));
}

/* Milliseconds with both devices alive; the application always wants to be called later, not at once. */
static void live(uint32_t ms)
{
    for (uint32_t i = 0; i < ms; i++) {
        if (x.now_ms % 400 == 0) {
            exchange_beacons(&x);
        }
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
        exchange_step(&x);
        TEST_ASSERT_TRUE_MESSAGE((int32_t)(app.next_ms - x.now_ms) > 0, "wants to be called at once");
    }
}

/* Auto-save is due while the plan for a new device waits for another one's setup: it comes after the plan. */
static void test_auto_save_waits_for_the_planner(void)
{
    hostlink_request(0x2404, BYTES(0x04));
    hostlink_reply(0x2405, NULL, 0);
    make_link();
    const uint32_t made_ms = x.now_ms;
    live(4800);
    exchange_rx(&x, "614#01 0300 0300 0A00"); /* and does not answer */
    (void)exchange_drain(&x);
    exchange_bind(&x, "13", "0300 0300 0900");
    exchange_set_up_device(&x, "13", "0300 0300 0900", "00");
    TEST_ASSERT_TRUE(arb_limb_is_busy(&app.limb));
    live(made_ms + 5100 - x.now_ms);
    TEST_ASSERT_TRUE(arb_limb_is_busy(&app.limb));
    expect_stored(0, 0);
    live(500);
    expect_stored(1, 1);
}

static void test_links_that_cannot_be_removed(void)
{
    make_link();
    hostlink_request(0x2410, BYTES(9, 0, 9, 0, 9, 0, 1));
    hostlink_error(0x2412, 0x03);
    hostlink_request(0x2410, BYTES(DEV_IN, 2));
    hostlink_error(0x2412, 0x04);
    hostlink_request(0x2410, BYTES(DEV_OUT, 1));
    hostlink_error(0x2412, 0x04);
    exchange_silence(&x);
}

/* Its device does not answer: the link is gone all the same, and the host is told. */
static void test_a_link_is_removed_from_a_silent_device(void)
{
    make_link();
    hostlink_request(0x2410, BYTES(DEV_IN, 1));
    wait_for_answer();
    hostlink_error(0x2412, 0x05);
    hostlink_silence();
}

static void test_the_device_goes_while_its_link_is_removed(void)
{
    make_link();
    exchange_pass(&x, 1450);
    (void)exchange_drain(&x);
    hostlink_request(0x2410, BYTES(DEV_IN, 1));
    for (int ms = 0; ms < 60; ms++) {
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
    }
    hostlink_error(0x2412, 0x05);
    hostlink_silence();
}

/* A device that answers, but each write only when it comes the third time: the host has its answer after 3
 * s. */
static void test_a_link_is_removed_too_slowly(void)
{
    make_link();
    x.arb->bus.tables.devices[0].beacon_ms = 10000;
    x.arb->bus.tables.devices[1].beacon_ms = 10000;
    x.arb->bus.tables.devices[1].ack_ms = 500;
    hostlink_request(0x2410, BYTES(DEV_IN, 1));
    int writes = 0;
    for (int ms = 0; ms < 3000; ms++) {
        const can_frame_t *sent;
        while ((sent = pdcp_arb_tx_peek(x.arb)) != NULL) {
            const can_frame_t answer = {.id = 0x212, .dlc = 4, .data = {0x84, 1, sent->data[1], 1}};
            const bool answered = sent->id == 0x312 && ++writes % 3 == 0;
            pdcp_arb_tx_pop(x.arb);
            if (answered) {
                arb_app_on_frame(&app, x.now_ms, &answer);
            }
        }
        hostlink_silence();
        exchange_wait(&x, 1);
    }
    hostlink_error(0x2412, 0x05);
}

/* --- 2413h --- */

static uint32_t counter(uint8_t group, uint8_t number, uint8_t count)
{
    const uint8_t *payload = NULL;
    uint16_t len = 0;
    hostlink_request(0x2413, &group, 1);
    TEST_ASSERT_EQUAL_HEX16(0x2414, hostlink_take(&payload, &len));
    TEST_ASSERT_EQUAL(group, payload[0]);
    TEST_ASSERT_EQUAL(1 + 4 * count, len);
    const uint8_t *at = &payload[1 + 4 * number];
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static void test_statistics_of_the_bus(void)
{
    exchange_rx(&x, "013#0B");
    TEST_ASSERT_EQUAL(1, counter(0, PDCP_STAT_RX, PDCP_STAT_COUNT));
    TEST_ASSERT_EQUAL(1, counter(0, PDCP_STAT_DROP_UNKNOWN_ID, PDCP_STAT_COUNT));
    x.arb->bus.stats[PDCP_STAT_RX] = 0x12345678;
    TEST_ASSERT_EQUAL_HEX32(0x12345678, counter(0, 0, PDCP_STAT_COUNT));
}

/* The order stands in arb_hostext.h. */
static void test_statistics_of_the_host_link(void)
{
    enum { COUNTERS = 20 };                                /* events dropped of kind 1 to 9 stand last */
    hostlink_send(&x, "00 00 00");                         /* garbage */
    hostlink_send(&x, "FE 19 01 22 07 00 00 00");          /* wrong CRC8 */
    hostlink_send(&x, "FE 19 04 22 04 F9 03 00 03 93 D0"); /* wrong CRC16 */
    hostlink_send(&x, "FE 19 99 22 04 00 FF FF");          /* impossible size: 8 more bytes of garbage */
    hostlink_send(&x, "FE 19 01");                         /* never finished: 3 more */
    exchange_wait(&x, 100);
    hostlink_ask(&x, 0x2222, 1, NULL, 0);
    const uint8_t *payload;
    uint16_t len;
    while (hostlink_take(&payload, &len) != 0) {
    }
    static const uint32_t want[COUNTERS] = {
        3 + 8 + 11 + 8 + 3 + 8, 14 + 11 + 8, 3, 3 + 8 + 3, 1, 1, 1, 1, 0, 1};
    for (unsigned i = 0; i < COUNTERS; i++) {
        const uint32_t own_in = i == 0 ? 11u * (i + 1u) : 0; /* the bytes of asking */
        const uint32_t have = counter(1, (uint8_t)i, COUNTERS);
        if (i == 0) {
            TEST_ASSERT_EQUAL(want[i] + own_in, have);
        } else if (i == 1) { /* one answer has left since */
            TEST_ASSERT_EQUAL(want[i] + 8 + 1 + 4 * COUNTERS + 2, have);
        } else if (i == 2) { /* and this is the third request about it */
            TEST_ASSERT_EQUAL(want[i] + 3, have);
        } else {
            TEST_ASSERT_EQUAL_MESSAGE(want[i], have, "counter");
        }
    }
}

static void test_statistics_of_the_storage(void)
{
    app.store.failures = 3;
    app.limb.flags.damaged = 1;
    app.limb.config.counters[ARB_CONFIG_DAMAGED] = 2;
    TEST_ASSERT_EQUAL(3, counter(2, 0, 4 + ARB_CONFIG_COUNTERS));
    TEST_ASSERT_EQUAL(1, counter(2, 3, 4 + ARB_CONFIG_COUNTERS));
    TEST_ASSERT_EQUAL(2, counter(2, 4 + ARB_CONFIG_DAMAGED, 4 + ARB_CONFIG_COUNTERS));
}

static uint32_t driver_counter(void *ctx, arb_port_counter_t which)
{
    (void)ctx;
    static const uint32_t values[] = {0x01020304, 5, 6};
    return values[which];
}

static void test_statistics_of_the_drivers(void) /* D-API-18 */
{
    TEST_ASSERT_EQUAL_HEX32(0, counter(3, 0, 3));
    arb_port_t counting = *app.port;
    counting.counter = driver_counter;
    app.port = &counting;
    hostlink_request(0x2413, BYTES(3));
    hostlink_reply(0x2414, BYTES(3, 4, 3, 2, 1, 5, 0, 0, 0, 6, 0, 0, 0));
    hostlink_request(0x2413, BYTES(4));
    hostlink_error(0x2415, 0x02);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bytes);
    RUN_TEST(test_wrong_sizes);
    RUN_TEST(test_arbitrator_info);
    RUN_TEST(test_flags);
    RUN_TEST(test_the_strict_flag_is_in_force_at_once);
    RUN_TEST(test_actions_that_cannot_be);
    RUN_TEST(test_an_action_waits_for_a_running_setup);
    RUN_TEST(test_storage_that_fails);
    RUN_TEST(test_an_action_with_its_result);
    RUN_TEST(test_reading_configurations);
    RUN_TEST(test_writing_configurations_that_cannot_be);
    RUN_TEST(test_configurations_there_and_back);
    RUN_TEST(test_many_bytes_are_read_in_steps);
    RUN_TEST(test_a_string_that_changes_is_read_anew);
    RUN_TEST(test_save_and_what_the_info_says);
    RUN_TEST(test_the_active_configuration_is_written_away);
    RUN_TEST(test_a_link_is_removed);
    RUN_TEST(test_auto_save_waits_for_the_planner);
    RUN_TEST(test_links_that_cannot_be_removed);
    RUN_TEST(test_a_link_is_removed_from_a_silent_device);
    RUN_TEST(test_the_device_goes_while_its_link_is_removed);
    RUN_TEST(test_a_link_is_removed_too_slowly);
    RUN_TEST(test_statistics_of_the_bus);
    RUN_TEST(test_statistics_of_the_host_link);
    RUN_TEST(test_statistics_of_the_storage);
    RUN_TEST(test_statistics_of_the_drivers);
    return UNITY_END();
}
