/* The device role (D-BUS-16): asking for a node id, beacons, and the queue, against frames written by hand
 * from pdcp-bus.md 3 and 9. */
#include <stdio.h>

#include "solo.h"
#include "unity.h"

void setUp(void)
{
    solo_reset();
}

void tearDown(void) {}

/* --- binding --- */

static void test_asks_for_its_last_id_and_is_bound(void)
{
    solo_bind_blank();
    TEST_ASSERT_EQUAL_UINT8(SOLO_ID, pdcp_device_node_id(&solo_dev));
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_BOUND, pdcp_device_state(&solo_dev));
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.stores); /* nothing new to keep */
}

static void test_random_id_is_legal_and_stored_when_granted(void)
{
    for (uint32_t seed = 0; seed < 2000; seed++) {
        can_frame_t frame;
        TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &solo_desc, &solo_port, NULL, seed, solo_now));
        (void)solo_step();
        TEST_ASSERT_TRUE(pdcp_device_tx_peek(&solo_dev, &frame));
        TEST_ASSERT_EQUAL_HEX16(0x600, frame.id & 0x700);
        TEST_ASSERT_TRUE((frame.id & 0xFF) >= 1 && (frame.id & 0xFF) <= 254);
        TEST_ASSERT_EQUAL_UINT8(0, pdcp_device_node_id(&solo_dev));
    }
    can_frame_t request;
    TEST_ASSERT_TRUE(pdcp_device_tx_peek(&solo_dev, &request));
    const unsigned id = request.id & 0xFFu;
    char answer[32];
    (void)snprintf(answer, sizeof answer, "81 %02X 0200 0300 0400", id);
    solo_rx(0x300 | id, answer);
    TEST_ASSERT_EQUAL_UINT8(id, pdcp_device_node_id(&solo_dev));
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.stores);
    TEST_ASSERT_EQUAL_UINT8(id, solo_seen.record.node_id);
}

static void test_random_id_differs_between_attempts_and_devices(void)
{
    uint8_t first = 0;
    unsigned different = 0;
    for (uint32_t sn = 0; sn < 20; sn++) {
        pdcp_device_desc_t other = solo_desc;
        can_frame_t frame;
        other.identity.sn = (uint16_t)sn;
        TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &other, &solo_port, NULL, 1, solo_now));
        (void)solo_step();
        TEST_ASSERT_TRUE(pdcp_device_tx_peek(&solo_dev, &frame));
        different += (frame.id & 0xFF) != first ? 1u : 0u;
        first = (uint8_t)(frame.id & 0xFF);
    }
    TEST_ASSERT_TRUE(different > 15);
}

static void test_answer_must_match_identity_and_requested_id(void)
{
    const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    solo_boot(&record);
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "81 10 0300 0300 0400"); /* VID */
    solo_rx(SOLO_TO, "81 10 0200 0400 0400"); /* PID */
    solo_rx(SOLO_TO, "81 10 0200 0300 0401"); /* SN */
    TEST_ASSERT_EQUAL_UINT32(3, pdcp_device_stats(&solo_dev)->drop_bind);
    solo_rx(0x311, "81 10 0200 0300 0400");   /* N is not the id asked for */
    solo_rx(0x300, "81 10 0200 0300 0400");   /* to all */
    solo_rx(0x710, "81 10 0200 0300 0400");   /* P=3 M=1 is not used */
    solo_rx(0x210, "81 10 0200 0300 0400");   /* not from the arbitrator */
    solo_rx(SOLO_TO, "81 10 0200 0300");      /* too short */
    solo_rx(SOLO_TO, "81 FF 0200 0300 0400"); /* 255 is never given out (D-BUS-2) */
    SOLO_QUIET();
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ASKING, pdcp_device_state(&solo_dev));
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&solo_dev)->drop_unused_id);
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&solo_dev)->drop_bad_dlc);
    solo_rx(SOLO_TO, "81 10 0200 0300 0400");
    SOLO_TX(SOLO_BEACON, "0A");
}

static void test_suggestion_is_asked_for_at_once(void)
{
    const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    solo_boot(&record);
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "81 2A 0200 0300 0400");
    SOLO_TX(0x62A, "01 0200 0300 0400");
    SOLO_QUIET();
    solo_rx(SOLO_TO, "81 10 0200 0300 0400"); /* late answer to the first request */
    TEST_ASSERT_EQUAL_UINT8(0, pdcp_device_node_id(&solo_dev));
    solo_rx(0x32A, "81 2A 0200 0300 0400");
    SOLO_TX(0x02A, "0A");
    TEST_ASSERT_EQUAL_UINT8(0x2A, pdcp_device_node_id(&solo_dev));
    TEST_ASSERT_EQUAL_UINT8(0x2A, solo_seen.record.node_id);
}

static void test_endless_suggestions_do_not_fill_the_bus(void)
{
    const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    can_frame_t frame;
    unsigned requests = 0;
    solo_boot(&record);
    for (unsigned i = 0; i < 100 && pdcp_device_tx_peek(&solo_dev, &frame); i++) {
        char answer[32];
        pdcp_device_tx_pop(&solo_dev);
        requests++;
        (void)snprintf(answer, sizeof answer, "81 %02X 0200 0300 0400", 0x40 + i);
        solo_rx(0x300u | (frame.id & 0xFFu), answer);
    }
    TEST_ASSERT_EQUAL_UINT(9, requests);
    solo_advance(1250);
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
}

/* Waits for the next request and returns the pause before it. */
static uint32_t pause_before_request(void)
{
    const uint32_t from = solo_now;
    can_frame_t frame;
    TEST_ASSERT_FALSE(pdcp_device_tx_peek(&solo_dev, &frame));
    const uint32_t deadline = solo_step();
    solo_now = deadline - 1;
    (void)solo_step();
    TEST_ASSERT_FALSE(pdcp_device_tx_peek(&solo_dev, &frame));
    solo_now = deadline;
    (void)solo_step();
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    SOLO_QUIET();
    return solo_now - from;
}

static void test_requests_double_to_eight_seconds_and_spread(void)
{
    static const uint32_t bases[] = {1000, 2000, 4000, 8000, 8000, 8000};
    uint32_t odd = 0;
    for (uint32_t seed = 0; seed < 50; seed++) {
        const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
        solo_now = UINT32_MAX - 1500;
        TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &solo_desc, &solo_port, &record, seed, solo_now));
        (void)solo_step();
        SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
        for (unsigned i = 0; i < sizeof bases / sizeof bases[0]; i++) {
            const uint32_t pause = pause_before_request();
            TEST_ASSERT_TRUE(pause >= bases[i] && pause <= bases[i] + bases[i] / 4);
            odd += pause != bases[i] ? 1u : 0u;
        }
    }
    TEST_ASSERT_TRUE(odd > 250); /* of 300: spread at random */
}

/* D-BUS-56: a grant that comes behind a refusal is for a twin with the same identity, which asked for the
 * same id. */
static void test_after_a_refusal_no_grant_is_taken(void)
{
    const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    solo_boot(&record);
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "81 00 0200 0300 0400");
    char grant[] = "81 11 0200 0300 0400";
    (void)snprintf(grant, sizeof grant, "81 %02X 0200 0300 0400", SOLO_ID);
    solo_rx(SOLO_TO, grant);
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ASKING, pdcp_device_state(&solo_dev));
}

static void test_refusal_is_no_answer_and_suggestion_starts_the_pauses_afresh(void)
{
    const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    solo_boot(&record);
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "81 00 0200 0300 0400");
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&solo_dev)->bind_refused);
    TEST_ASSERT_TRUE(pause_before_request() >= 1000);
    TEST_ASSERT_TRUE(pause_before_request() >= 2000);
    solo_rx(SOLO_TO, "81 2A 0200 0300 0400");
    SOLO_TX(0x62A, "01 0200 0300 0400");
    const uint32_t pause = pause_before_request();
    TEST_ASSERT_TRUE(pause >= 1000 && pause <= 1250);
}

static void test_bind_timeout_comes_from_the_description(void)
{
    pdcp_device_desc_t slow = solo_desc;
    slow.bind_ms = 10000;
    TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &slow, &solo_port, NULL, 1, solo_now));
    const uint32_t from = solo_now;
    const uint32_t pause = solo_step() - from;
    TEST_ASSERT_TRUE(pause >= 10000 && pause <= 12500);
}

static void test_unbound_device_answers_nothing(void)
{
    const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    solo_boot(&record);
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "03 01 00");
    solo_rx(SOLO_TO, "0B");
    solo_rx(SOLO_TO_ALL, "08 0000");
    solo_rx(SOLO_ARB_BEACON, "0A");
    SOLO_QUIET();
    TEST_ASSERT_EQUAL_UINT32(4, pdcp_device_stats(&solo_dev)->drop_unbound);
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.resets);
    TEST_ASSERT_FALSE(pdcp_device_suspended(&solo_dev));
}

static void test_unreadable_record_is_taken_as_none(void)
{
    const pdcp_device_record_t record = solo_blank_record(255);
    can_frame_t frame;
    solo_boot(&record);
    TEST_ASSERT_TRUE(pdcp_device_tx_peek(&solo_dev, &frame));
    TEST_ASSERT_TRUE((frame.id & 0xFF) >= 1 && (frame.id & 0xFF) <= 254);
}

static void test_description_that_cannot_be_is_refused(void)
{
    pdcp_device_desc_t bad = solo_desc;
    pdcp_device_channel_desc_t channel = solo_desc.channels[0];
    bad.channel_count = PDCP_DEVICE_CHANNELS_MAX + 1;
    TEST_ASSERT_FALSE(pdcp_device_init(&solo_dev, &bad, &solo_port, NULL, 1, solo_now));
    channel.direction = 0;
    bad.channels = &channel;
    bad.channel_count = 1;
    TEST_ASSERT_FALSE(pdcp_device_init(&solo_dev, &bad, &solo_port, NULL, 1, solo_now));
}

/* A random number generator of this kind never leaves 0: neither may a seed lead there. This one would. */
static void test_no_seed_stops_the_random_ids(void)
{
    can_frame_t frame;
    unsigned different = 0;
    unsigned last = 0;
    TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &solo_desc, &solo_port, NULL, 0x227B4C90, solo_now));
    for (unsigned i = 0; i < 10; i++) {
        solo_now = solo_step();
        (void)solo_step();
        TEST_ASSERT_TRUE(pdcp_device_tx_peek(&solo_dev, &frame));
        pdcp_device_tx_pop(&solo_dev);
        TEST_ASSERT_EQUAL_HEX16(0x600, frame.id & 0x700);
        different += (frame.id & 0xFFu) != last ? 1u : 0u;
        last = frame.id & 0xFFu;
    }
    TEST_ASSERT_TRUE(different > 7);
}

/* --- beacons --- */

static void test_beacons_keep_their_interval(void)
{
    solo_bind_blank();
    for (unsigned i = 0; i < 4; i++) {
        const uint32_t due = solo_step();
        TEST_ASSERT_EQUAL_UINT32(solo_now + 500, due);
        solo_advance(499);
        SOLO_QUIET();
        solo_advance(1);
        solo_rx(SOLO_ARB_BEACON, "0A");
        SOLO_TX(SOLO_BEACON, "0A");
        SOLO_QUIET();
    }
    solo_advance(503); /* late once: the next one is not late */
    SOLO_TX(SOLO_BEACON, "0A");
    solo_advance(497);
    SOLO_TX(SOLO_BEACON, "0A");
    solo_advance(1700); /* three missed: one is sent, not three */
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_QUIET();
}

static void test_beacon_interval_can_be_changed_within_its_limits(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("04 0A 00 3100", "84 00 0A 00 3100"); /* 49 ms */
    SOLO_ANSWERED("04 0A 00 1127", "84 00 0A 00 1127"); /* 10001 ms */
    SOLO_ANSWERED("03 0A 00", "83 01 0A 00 F401");
    SOLO_ANSWERED("04 0A 00 6400", "84 01 0A 00 6400");
    SOLO_ANSWERED("03 0A 00", "83 01 0A 00 6400");
    solo_advance(100);
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_QUIET();
    SOLO_ANSWERED("04 0A 00 1027", "84 01 0A 00 1027"); /* 10 s */
    solo_pass(9900);
    solo_advance(100);
    SOLO_TX(SOLO_BEACON, "0A");
}

static void test_blocked_bus_gathers_one_beacon(void)
{
    solo_bind_blank();
    for (unsigned i = 0; i < 20; i++) {
        solo_advance(500);
    }
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_QUIET();
    TEST_ASSERT_EQUAL_UINT32(0, pdcp_device_stats(&solo_dev)->tx_full);
}

static void test_answers_that_find_no_room_are_counted(void)
{
    solo_bind_blank();
    for (unsigned i = 0; i < PDCP_TX_MAX + 4; i++) {
        solo_rx(SOLO_TO, "03 09 00");
    }
    TEST_ASSERT_EQUAL_UINT32(4, pdcp_device_stats(&solo_dev)->tx_full);
    solo_advance(500); /* a beacon pushes the last one out */
    TEST_ASSERT_EQUAL_UINT32(5, pdcp_device_stats(&solo_dev)->tx_full);
    SOLO_TX(SOLO_BEACON, "0A");
    for (unsigned i = 0; i < PDCP_TX_MAX - 1; i++) {
        SOLO_TX(SOLO_FROM, "83 01 09 00 03");
    }
    SOLO_QUIET();
}

static void test_nothing_can_be_taken_out_of_an_empty_queue(void)
{
    solo_bind_blank();
    const uint32_t taken = pdcp_device_stats(&solo_dev)->tx;
    pdcp_device_tx_pop(&solo_dev);
    TEST_ASSERT_EQUAL_UINT32(taken, pdcp_device_stats(&solo_dev)->tx);
    SOLO_ANSWERED("03 09 00", "83 01 09 00 03");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_asks_for_its_last_id_and_is_bound);
    RUN_TEST(test_random_id_is_legal_and_stored_when_granted);
    RUN_TEST(test_random_id_differs_between_attempts_and_devices);
    RUN_TEST(test_answer_must_match_identity_and_requested_id);
    RUN_TEST(test_suggestion_is_asked_for_at_once);
    RUN_TEST(test_endless_suggestions_do_not_fill_the_bus);
    RUN_TEST(test_requests_double_to_eight_seconds_and_spread);
    RUN_TEST(test_after_a_refusal_no_grant_is_taken);
    RUN_TEST(test_refusal_is_no_answer_and_suggestion_starts_the_pauses_afresh);
    RUN_TEST(test_bind_timeout_comes_from_the_description);
    RUN_TEST(test_unbound_device_answers_nothing);
    RUN_TEST(test_unreadable_record_is_taken_as_none);
    RUN_TEST(test_description_that_cannot_be_is_refused);
    RUN_TEST(test_no_seed_stops_the_random_ids);
    RUN_TEST(test_beacons_keep_their_interval);
    RUN_TEST(test_beacon_interval_can_be_changed_within_its_limits);
    RUN_TEST(test_blocked_bus_gathers_one_beacon);
    RUN_TEST(test_answers_that_find_no_room_are_counted);
    RUN_TEST(test_nothing_can_be_taken_out_of_an_empty_queue);
    return UNITY_END();
}
