/* The device role (D-BUS-16): channel data, Suspend, Reset, Update Data Channel and the silence of the
 * arbitrator, against frames written by hand from pdcp-bus.md 7, 9 and 10. */
#include "solo.h"
#include "unity.h"

void setUp(void)
{
    solo_reset();
}

void tearDown(void) {}

/* --- channel data --- */

static void test_data_comes_only_from_the_source_of_an_enabled_input(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("04 07 01 20 21", "84 01 07 01 20 21");
    solo_rx(0x021, "0102");
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.inputs); /* not enabled */
    SOLO_ANSWERED("04 04 01 01", "84 01 04 01 01");
    solo_rx(0x021, "0102");
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.inputs);
    TEST_ASSERT_EQUAL_UINT8(1, solo_seen.channel);
    TEST_ASSERT_EQUAL_UINT8(2, solo_seen.len);
    TEST_ASSERT_EQUAL_HEX8(0x02, solo_seen.data[1]);
    solo_rx(0x221, "0B");               /* normal priority; no function code here */
    solo_rx(0x421, "1122334455667788"); /* low priority */
    TEST_ASSERT_EQUAL_UINT(3, solo_seen.inputs);
    TEST_ASSERT_EQUAL_UINT8(8, solo_seen.len);
    solo_rx(0x621, "01"); /* P=3: binding */
    solo_rx(0x121, "01"); /* from the arbitrator */
    solo_rx(0x022, "01");
    solo_rx(0x020, "01"); /* the source's device id is not its channel */
    solo_rx(0x000, "01");
    TEST_ASSERT_EQUAL_UINT(3, solo_seen.inputs);
    SOLO_ANSWERED("04 07 01 00 00", "84 01 07 01 00 00");
    solo_rx(0x021, "0102");
    solo_rx(0x000, "01");
    TEST_ASSERT_EQUAL_UINT(3, solo_seen.inputs);
    TEST_ASSERT_EQUAL_UINT32(3, pdcp_device_stats(&solo_dev)->data_in);
    SOLO_QUIET();
}

/* A DLC above 8 means 8 bytes of data and is cut by the driver (can_frame.h); one that is not is no data. */
static void test_data_of_more_than_8_bytes_is_not_taken(void)
{
    can_frame_t frame = solo_frame(0x021, "0102030405060708");
    solo_bind_blank();
    solo_link_all();
    frame.dlc = 9;
    pdcp_device_on_frame(&solo_dev, solo_now, &frame);
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.inputs);
    frame.dlc = 8;
    pdcp_device_on_frame(&solo_dev, solo_now, &frame);
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.inputs);
}

static void test_one_output_feeds_two_inputs(void)
{
    uint8_t ids[4];
    solo_bind_blank();
    solo_link_all();
    TEST_ASSERT_EQUAL_UINT8(2, pdcp_device_listens_to(&solo_dev, ids, 4));
    TEST_ASSERT_EQUAL_HEX8(0x21, ids[0]);
    TEST_ASSERT_EQUAL_HEX8(0x22, ids[1]);
    TEST_ASSERT_EQUAL_UINT8(1, pdcp_device_listens_to(&solo_dev, ids, 1));
    const uint16_t changes = pdcp_device_listen_changes(&solo_dev);
    SOLO_ANSWERED("04 07 02 20 21", "84 01 07 02 20 21");
    TEST_ASSERT_TRUE(changes != pdcp_device_listen_changes(&solo_dev));
    solo_rx(0x021, "55");
    TEST_ASSERT_EQUAL_UINT(2, solo_seen.inputs);
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&solo_dev)->data_in);
}

static void test_output_sends_with_its_node_id_when_enabled(void)
{
    static const uint8_t data[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    solo_bind_blank();
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_ANSWERED("04 04 03 01", "84 01 04 03 01");
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1)); /* no node id */
    SOLO_ANSWERED("04 05 03 23", "84 01 05 03 23");
    TEST_ASSERT_TRUE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_TX(0x023, "01");
    TEST_ASSERT_TRUE(pdcp_device_send(&solo_dev, solo_now, 3, data, 8));
    SOLO_TX(0x023, "0102030405060708");
    TEST_ASSERT_TRUE(pdcp_device_send(&solo_dev, solo_now, 3, NULL, 0));
    SOLO_TX(0x023, "");
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data, 9));
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 1, data, 1)); /* an input */
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 0, data, 1));
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 4, data, 1));
    SOLO_ANSWERED("04 04 03 00", "84 01 04 03 00");
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_QUIET();
}

static void test_data_leaves_room_for_answers(void)
{
    static const uint8_t data[1] = {9};
    unsigned sent = 0;
    solo_bind_blank();
    solo_link_all();
    while (pdcp_device_send(&solo_dev, solo_now, 3, data, 1)) {
        sent++;
        TEST_ASSERT_TRUE(sent < 100);
    }
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&solo_dev)->tx_full);
    TEST_ASSERT_EQUAL_UINT32(sent, pdcp_device_stats(&solo_dev)->data_out);
    solo_rx(SOLO_TO, "03 09 00");
    solo_advance(500); /* a beacon: 010h comes before 023h, the answer 210h behind all */
    SOLO_TX(SOLO_BEACON, "0A");
    for (unsigned i = 0; i < sent; i++) {
        SOLO_TX(0x023, "09");
    }
    SOLO_TX(SOLO_FROM, "83 01 09 00 03");
    SOLO_QUIET();
}

/* --- suspend, release, reset --- */

static void test_suspend_for_a_time(void)
{
    static const uint8_t data[1] = {9};
    solo_bind_blank();
    solo_link_all();
    SOLO_ANSWERED("08 E803", "88 01 E803"); /* 1000 ms */
    TEST_ASSERT_TRUE(pdcp_device_suspended(&solo_dev));
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_ANSWERED("03 09 00", "83 01 09 00 03"); /* answers, and takes data */
    solo_rx(0x021, "05");
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.inputs);
    solo_pass(500);
    solo_now += 499;
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    solo_now += 1; /* without a step between */
    TEST_ASSERT_TRUE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_TX(0x023, "09");
}

static void test_suspend_deadline_is_reported(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("08 0A00", "88 01 0A00");
    TEST_ASSERT_EQUAL_UINT32(solo_now + 10, solo_step());
    solo_advance(10);
    TEST_ASSERT_FALSE(pdcp_device_suspended(&solo_dev));
}

static void test_suspend_until_released(void)
{
    static const uint8_t data[1] = {9};
    solo_bind_blank();
    solo_link_all();
    SOLO_ANSWERED("08 0000", "88 01 0000");
    solo_pass(100000);
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_ANSWERED("09", "89 01");
    TEST_ASSERT_TRUE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_TX(0x023, "09");
    SOLO_ANSWERED("09", "89 01"); /* released already */
}

static void test_suspend_and_release_to_all_are_not_answered(void)
{
    solo_bind_blank();
    solo_rx(SOLO_TO_ALL, "08 0000");
    SOLO_QUIET();
    TEST_ASSERT_TRUE(pdcp_device_suspended(&solo_dev));
    solo_rx(0x100, "09");
    SOLO_QUIET();
    TEST_ASSERT_FALSE(pdcp_device_suspended(&solo_dev));
}

static void test_reset_answers_and_binds_anew(void)
{
    static const uint8_t data[1] = {9};
    uint8_t ids[4];
    solo_bind_blank();
    solo_link_all();
    SOLO_ANSWERED("04 05 01 0200 0900", "84 01 05 01 0200 0900");
    SOLO_ANSWERED("04 0A 00 6400", "84 01 0A 00 6400");
    SOLO_ANSWERED("08 0000", "88 01 0000");
    solo_rx(0x310, "0B");
    SOLO_TX(SOLO_FROM, "8B 01");
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    SOLO_QUIET();
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.resets);
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.safes);
    TEST_ASSERT_EQUAL_UINT8(0, pdcp_device_node_id(&solo_dev));
    TEST_ASSERT_FALSE(pdcp_device_suspended(&solo_dev));
    TEST_ASSERT_EQUAL_UINT8(0, pdcp_device_listens_to(&solo_dev, ids, 4));
    solo_rx(0x021, "05");
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.inputs);
    solo_rx(SOLO_TO, "81 10 0200 0300 0400");
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_TX(SOLO_FROM, "0F 01");
    SOLO_QUIET();
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_ANSWERED("03 04 03", "83 01 04 03 00");
    SOLO_ANSWERED("03 05 03", "83 01 05 03 00");
    SOLO_ANSWERED("03 07 01", "83 01 07 01 00 00");
    SOLO_ANSWERED("03 05 01", "83 01 05 01 0200 0900"); /* kept */
    SOLO_ANSWERED("03 0A 00", "83 01 0A 00 F401");
}

static void test_reset_drops_what_waits(void)
{
    static const uint8_t data[1] = {9};
    solo_bind_blank();
    solo_link_all();
    TEST_ASSERT_TRUE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    solo_rx(SOLO_TO, "0B");
    SOLO_TX(SOLO_FROM, "8B 01");
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    SOLO_QUIET();
}

/* --- update data channel --- */

static pdcp_device_record_t linked_record(void)
{
    pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    for (unsigned i = 0; i < 2; i++) {
        record.sources[i].identity.vid = 2;
        record.sources[i].identity.pid = 2;
        record.sources[i].identity.sn = 9;
        record.sources[i].channel = (uint8_t)(i + 1);
    }
    return record;
}

static void test_stored_sources_are_asked_for_until_answered(void)
{
    const pdcp_device_record_t record = linked_record();
    solo_bind_with(&record);
    SOLO_TX(SOLO_FROM, "0F 01");
    SOLO_TX(SOLO_FROM, "0F 02");
    SOLO_QUIET();
    solo_rx(SOLO_TO, "8F 00 02"); /* failure is an answer */
    solo_pass(900);
    solo_advance(99);
    SOLO_QUIET();
    solo_advance(1);
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_TX(SOLO_FROM, "0F 01");
    SOLO_QUIET();
    solo_rx(SOLO_TO, "8F 01 02"); /* late */
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&solo_dev)->drop_late);
    solo_pass(900);
    solo_advance(100);
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_TX(SOLO_FROM, "0F 01");
    solo_rx(SOLO_TO, "8F 01 01");
    solo_pass(5000);
    solo_rx(SOLO_TO, "8F 01 00");
    solo_rx(SOLO_TO, "8F 01 03"); /* an output */
    solo_rx(SOLO_TO, "8F 01 09");
    TEST_ASSERT_EQUAL_UINT32(4, pdcp_device_stats(&solo_dev)->drop_late);
}

/* D-BUS-7: unconnected is FFFF, FFFF, FFFF and FF together. One of them alone says nothing. */
static void test_a_source_is_unconnected_only_as_a_whole(void)
{
    for (unsigned field = 0; field < 4; field++) {
        pdcp_device_record_t record = solo_blank_record(SOLO_ID);
        pdcp_device_source_t *source = &record.sources[0];
        source->identity.vid = field == 0 ? 2 : 0xFFFF;
        source->identity.pid = field == 1 ? 2 : 0xFFFF;
        source->identity.sn = field == 2 ? 2 : 0xFFFF;
        source->channel = field == 3 ? 2 : 0xFF;
        solo_bind_with(&record);
        SOLO_TX(SOLO_FROM, "0F 01");
        SOLO_QUIET();
    }
}

static void test_input_that_is_unconnected_meanwhile_is_not_asked_for(void)
{
    const pdcp_device_record_t record = linked_record();
    solo_bind_with(&record);
    SOLO_TX(SOLO_FROM, "0F 01");
    SOLO_TX(SOLO_FROM, "0F 02");
    solo_rx(SOLO_TO, "8F 01 02");
    SOLO_ANSWERED("04 05 01 FFFF FFFF", "84 01 05 01 FFFF FFFF");
    SOLO_ANSWERED("04 06 01 FFFF FF", "84 01 06 01 FFFF FF");
    solo_pass(3000);
}

/* More inputs than the queue has places, on a bus that takes nothing for a while. */
static void test_every_source_is_asked_for_though_the_queue_is_small(void)
{
    pdcp_device_channel_desc_t inputs[PDCP_DEVICE_CHANNELS_MAX];
    pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    pdcp_device_desc_t wide = solo_desc;
    uint32_t asked = 0;
    can_frame_t frame;
    for (unsigned i = 0; i < PDCP_DEVICE_CHANNELS_MAX; i++) {
        inputs[i] = solo_desc.channels[0];
        record.sources[i].identity.vid = 2;
    }
    wide.channels = inputs;
    wide.channel_count = PDCP_DEVICE_CHANNELS_MAX;
    TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &wide, &solo_port, &record, 1, solo_now));
    (void)solo_step();
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "81 10 0200 0300 0400");
    TEST_ASSERT_EQUAL_UINT32(solo_now + 10, solo_step());
    for (unsigned round = 0; round < 5; round++) {
        solo_advance(10);
        while (pdcp_device_tx_peek(&solo_dev, &frame)) {
            pdcp_device_tx_pop(&solo_dev);
            if (frame.id == SOLO_FROM) {
                TEST_ASSERT_EQUAL_HEX8(0x0F, frame.data[0]);
                asked |= (uint32_t)1 << (frame.data[1] - 1);
            }
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFu, asked);
    TEST_ASSERT_EQUAL_UINT32(0, pdcp_device_stats(&solo_dev)->tx_full);
}

/* --- silence of the arbitrator --- */

static void test_silence_is_among_the_deadlines(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("04 0A 00 1027", "84 01 0A 00 1027"); /* a beacon every 10 s */
    TEST_ASSERT_EQUAL_UINT32(solo_now + 3000, solo_step());
    const uint32_t heard = solo_now;
    solo_now += 1000;
    solo_rx(SOLO_ARB_BEACON, "0A");
    TEST_ASSERT_EQUAL_UINT32(heard + 4000, solo_step());
}

static void test_silence_stops_streaming_and_makes_inputs_safe(void)
{
    static const uint8_t data[1] = {9};
    solo_bind_blank();
    solo_link_all();
    solo_now += 2999;
    (void)solo_step();
    SOLO_TX(SOLO_BEACON, "0A");
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.safes);
    TEST_ASSERT_TRUE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_TX(0x023, "09");
    solo_advance(1);
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ALONE, pdcp_device_state(&solo_dev));
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.safes);
    TEST_ASSERT_EQUAL_UINT8(SOLO_ID, pdcp_device_node_id(&solo_dev));
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    solo_rx(0x022, "05"); /* data does not wake an input that is safe */
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.inputs);
    for (unsigned i = 0; i < 10; i++) {
        const uint32_t due = solo_step();
        TEST_ASSERT_TRUE(due - solo_now <= 500);
        solo_now = due;
        (void)solo_step();
        SOLO_TX(SOLO_BEACON, "0A");
        SOLO_QUIET();
    }
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.safes);
    solo_rx(0x355, "03 01 00"); /* a request to another device is a sign of life, too */
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_BOUND, pdcp_device_state(&solo_dev));
    TEST_ASSERT_FALSE(pdcp_device_send(&solo_dev, solo_now, 3, data,
                                       1)); /* its ids may be others' by solo_now (D-BUS-35) */
    solo_rx(0x022, "05");
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.inputs);
}

static void test_devices_are_no_sign_of_an_arbitrator(void)
{
    solo_bind_blank();
    for (unsigned i = 0; i < 30; i++) {
        solo_rx(0x033, "0A");
        solo_rx(0x733, "0A"); /* P=3 M=1 is not used by the protocol */
        solo_now += 100;
    }
    (void)solo_step();
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ALONE, pdcp_device_state(&solo_dev));
}

static void test_answers_while_alone_come_with_the_arbitrator(void)
{
    solo_bind_blank();
    solo_advance(3000);
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_ANSWERED("03 09 00", "83 01 09 00 03");
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_BOUND, pdcp_device_state(&solo_dev));
}

static void test_disabled_terminal_input_becomes_safe(void)
{
    solo_bind_blank();
    solo_link_all();
    SOLO_ANSWERED("04 04 01 00", "84 01 04 01 00"); /* not terminal */
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.safes);
    SOLO_ANSWERED("04 04 02 00", "84 01 04 02 00");
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.safes);
    SOLO_ANSWERED("04 04 02 00", "84 01 04 02 00"); /* was so already */
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.safes);
}

/* pdcp_device.h: every function of the solo_port may be NULL. */
static void test_a_device_without_an_application(void)
{
    static const pdcp_device_port_t none = {0};
    static const uint8_t data[1] = {9};
    TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &solo_desc, &none, NULL, 1, solo_now));
    (void)solo_step();
    can_frame_t request;
    TEST_ASSERT_TRUE(pdcp_device_tx_peek(&solo_dev, &request));
    pdcp_device_tx_pop(&solo_dev);
    solo_rx(0x300u | (request.id & 0xFFu), "81 10 0200 0300 0400"); /* id 10h is suggested, stored nowhere */
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "81 10 0200 0300 0400");
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_ANSWERED("04 05 01 0200 0900", "84 01 05 01 0200 0900");
    SOLO_ANSWERED("04 50 03 01", "84 01 50 03 01");
    solo_link_all();
    solo_rx(0x021, "0102");
    solo_rx(0x022, "0102");
    TEST_ASSERT_EQUAL_UINT32(2, pdcp_device_stats(&solo_dev)->data_in);
    TEST_ASSERT_TRUE(pdcp_device_send(&solo_dev, solo_now, 3, data, 1));
    SOLO_TX(0x023, "09");
    SOLO_ANSWERED("04 04 02 00", "84 01 04 02 00"); /* a terminal input */
    solo_rx(SOLO_TO, "0B");
    SOLO_TX(SOLO_FROM, "8B 01");
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ASKING, pdcp_device_state(&solo_dev));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_data_comes_only_from_the_source_of_an_enabled_input);
    RUN_TEST(test_data_of_more_than_8_bytes_is_not_taken);
    RUN_TEST(test_one_output_feeds_two_inputs);
    RUN_TEST(test_output_sends_with_its_node_id_when_enabled);
    RUN_TEST(test_data_leaves_room_for_answers);
    RUN_TEST(test_suspend_for_a_time);
    RUN_TEST(test_suspend_deadline_is_reported);
    RUN_TEST(test_suspend_until_released);
    RUN_TEST(test_suspend_and_release_to_all_are_not_answered);
    RUN_TEST(test_reset_answers_and_binds_anew);
    RUN_TEST(test_reset_drops_what_waits);
    RUN_TEST(test_stored_sources_are_asked_for_until_answered);
    RUN_TEST(test_a_source_is_unconnected_only_as_a_whole);
    RUN_TEST(test_input_that_is_unconnected_meanwhile_is_not_asked_for);
    RUN_TEST(test_every_source_is_asked_for_though_the_queue_is_small);
    RUN_TEST(test_silence_is_among_the_deadlines);
    RUN_TEST(test_silence_stops_streaming_and_makes_inputs_safe);
    RUN_TEST(test_devices_are_no_sign_of_an_arbitrator);
    RUN_TEST(test_answers_while_alone_come_with_the_arbitrator);
    RUN_TEST(test_disabled_terminal_input_becomes_safe);
    RUN_TEST(test_a_device_without_an_application);
    return UNITY_END();
}
