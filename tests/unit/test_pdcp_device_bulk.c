/* The device role (D-BUS-16): bulk transfers, against frames written by hand from pdcp-bus.md 5. */
#include "solo.h"
#include "unity.h"

void setUp(void)
{
    solo_reset();
}

void tearDown(void) {}

/* --- bulk get --- */

static void test_bulk_get_of_a_descriptor(void)
{
    solo_bind_blank();
    solo_rx(SOLO_TO, "0C 02 03");
    SOLO_TX(SOLO_FROM, "8C 01 02 03 0600");
    SOLO_TX(SOLO_FROM, "0E 00 6F7574707574"); /* "output" */
    SOLO_QUIET();
    solo_rx(SOLO_TO, "8E 01");
    SOLO_QUIET();
    solo_rx(SOLO_TO, "8E 01");
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&solo_dev)->drop_late);
}

static void test_bulk_get_of_required_inputs_ends_with_a_short_packet(void)
{
    solo_bind_blank();
    solo_rx(SOLO_TO, "0C 09 03");
    SOLO_TX(SOLO_FROM, "8C 01 09 03 0800");
    SOLO_TX(SOLO_FROM, "0E 00 200000000000");
    solo_rx(SOLO_TO, "8E 01");
    SOLO_TX(SOLO_FROM, "0E 01 0001");
    solo_rx(SOLO_TO, "8E 01");
    SOLO_QUIET();
}

static void test_bulk_get_of_short_and_of_missing_values(void)
{
    solo_bind_blank();
    solo_rx(SOLO_TO, "0C 01 00");
    SOLO_TX(SOLO_FROM, "8C 01 01 00 0400");
    SOLO_TX(SOLO_FROM, "0E 00 0200 0300");
    solo_rx(SOLO_TO, "8E 01");
    SOLO_ANSWERED("0C 02 02", "8C 01 02 02 0000"); /* empty descriptor: no packets */
    SOLO_ANSWERED("0C 33 00", "8C 00 33 00 0000");
    SOLO_ANSWERED("0C 01 09", "8C 00 01 09 0000");
}

static void test_bulk_get_packet_ids_wrap(void)
{
    solo_bind_blank();
    solo_rx(SOLO_TO, "0C 07 00");
    SOLO_TX(SOLO_FROM, "8C 01 07 00 4006");
    for (unsigned i = 0; i < 267; i++) {
        can_frame_t frame;
        TEST_ASSERT_TRUE(pdcp_device_tx_peek(&solo_dev, &frame));
        pdcp_device_tx_pop(&solo_dev);
        TEST_ASSERT_EQUAL_HEX8(0x0E, frame.data[0]);
        TEST_ASSERT_EQUAL_UINT8(i % 256, frame.data[1]);
        TEST_ASSERT_EQUAL_UINT8(i < 266 ? 8 : 6, frame.dlc); /* 1600 = 266 x 6 + 4 */
        TEST_ASSERT_EQUAL_HEX8_ARRAY(&solo_long_text[(size_t)i * 6], &frame.data[2], frame.dlc - 2u);
        solo_rx(SOLO_TO, "8E 01");
    }
    SOLO_QUIET();
}

static void test_bulk_get_repeats_a_packet_without_answer(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("04 0B 00 3200", "84 01 0B 00 3200"); /* 50 ms */
    solo_rx(SOLO_TO, "0C 02 03");
    SOLO_TX(SOLO_FROM, "8C 01 02 03 0600");
    SOLO_TX(SOLO_FROM, "0E 00 6F7574707574");
    for (unsigned i = 0; i < 2; i++) {
        TEST_ASSERT_EQUAL_UINT32(solo_now + 50, solo_step());
        solo_advance(49);
        SOLO_QUIET();
        solo_advance(1);
        SOLO_TX(SOLO_FROM, "0E 00 6F7574707574");
        SOLO_QUIET();
    }
    solo_advance(50);
    SOLO_QUIET(); /* three in all */
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&solo_dev)->bulk_failed);
    solo_rx(SOLO_TO, "8E 01");
    SOLO_QUIET();
}

static void test_bulk_get_has_three_tries_for_each_packet(void)
{
    solo_bind_blank();
    solo_rx(SOLO_TO, "0C 09 03");
    SOLO_TX(SOLO_FROM, "8C 01 09 03 0800");
    SOLO_TX(SOLO_FROM, "0E 00 200000000000");
    for (unsigned i = 0; i < 2; i++) {
        solo_advance(100);
        SOLO_TX(SOLO_FROM, "0E 00 200000000000");
    }
    solo_rx(SOLO_TO, "8E 01");
    SOLO_TX(SOLO_FROM, "0E 01 0001");
    for (unsigned i = 0; i < 2; i++) {
        solo_advance(100);
        SOLO_TX(SOLO_FROM, "0E 01 0001");
        SOLO_QUIET();
    }
    solo_rx(SOLO_TO, "8E 01");
    SOLO_QUIET();
    TEST_ASSERT_EQUAL_UINT32(0, pdcp_device_stats(&solo_dev)->bulk_failed);
}

static void test_bulk_get_refused_or_started_anew(void)
{
    solo_bind_blank();
    solo_rx(SOLO_TO, "0C 09 03");
    SOLO_TX(SOLO_FROM, "8C 01 09 03 0800");
    SOLO_TX(SOLO_FROM, "0E 00 200000000000");
    solo_rx(SOLO_TO, "8E 00"); /* the receiver found it wrong */
    SOLO_QUIET();
    solo_pass(1000);
    solo_rx(SOLO_TO, "0C 09 03");
    SOLO_TX(SOLO_FROM, "8C 01 09 03 0800");
    SOLO_TX(SOLO_FROM, "0E 00 200000000000");
    solo_rx(SOLO_TO, "8E 01");
    SOLO_TX(SOLO_FROM, "0E 01 0001");
    solo_rx(SOLO_TO, "0C 09 03"); /* anew, in the middle */
    SOLO_TX(SOLO_FROM, "8C 01 09 03 0800");
    SOLO_TX(SOLO_FROM, "0E 00 200000000000");
    solo_rx(SOLO_TO, "8E 01");
    SOLO_TX(SOLO_FROM, "0E 01 0001");
    solo_rx(SOLO_TO, "8E 01");
    SOLO_QUIET();
}

/* --- bulk set --- */

static void test_bulk_set_of_an_extra(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    SOLO_ANSWERED("0E 00 010203040506", "8E 01");
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.written); /* not before it is whole */
    TEST_ASSERT_EQUAL_UINT8(7, solo_gain[0]);
    SOLO_ANSWERED("0E 01 0708", "8E 01");
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.written);
    TEST_ASSERT_EQUAL_UINT16(8, solo_gain_len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\1\2\3\4\5\6\7\10", solo_gain, 8);
}

static void test_bulk_set_of_a_source(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("0D 05 01 0400", "8D 01 05 01 0400");
    SOLO_ANSWERED("0E 00 02", "8E 01"); /* packets of any length from 1 to 6 */
    SOLO_ANSWERED("0E 01 000900", "8E 01");
    SOLO_ANSWERED("03 05 01", "83 01 05 01 0200 0900");
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.stores);
}

static void test_bulk_set_repeated_packets_are_stored_once(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    SOLO_ANSWERED("0E 00 010203040506", "8E 01");
    SOLO_ANSWERED("0E 00 010203040506", "8E 01");
    SOLO_ANSWERED("0E 01 0708", "8E 01");
    SOLO_ANSWERED("0E 01 0708", "8E 01");
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.written);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\1\2\3\4\5\6\7\10", solo_gain, 8);
}

static void test_bulk_set_wrong_packet_fails_until_configured_anew(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("0E 00 01", "8E 00"); /* without a configure frame */
    SOLO_ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    SOLO_ANSWERED("0E FF 01", "8E 00"); /* FFh is no repetition of a packet that never came */
    SOLO_ANSWERED("0E 00 010203040506", "8E 00");
    SOLO_ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    SOLO_ANSWERED("0E 00 010203040506", "8E 01");
    SOLO_ANSWERED("0E 02 0708", "8E 00");
    SOLO_ANSWERED("0E 01 0708", "8E 00");
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.written);
    SOLO_ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    SOLO_ANSWERED("0E 00 010203040506", "8E 01");
    SOLO_ANSWERED("0E 01 070809", "8E 00"); /* more than was announced */
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.written);
    TEST_ASSERT_EQUAL_UINT8(7, solo_gain[0]);
    TEST_ASSERT_EQUAL_UINT32(4, pdcp_device_stats(&solo_dev)->bulk_failed);
}

static void test_bulk_set_started_anew_begins_with_packet_0(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    SOLO_ANSWERED("0E 00 FFFFFFFFFFFF", "8E 01");
    SOLO_ANSWERED("0D 50 03 0200", "8D 01 50 03 0200");
    SOLO_ANSWERED("0E 00 0A0B", "8E 01");
    TEST_ASSERT_EQUAL_UINT16(2, solo_gain_len);
    TEST_ASSERT_EQUAL_HEX8(0x0A, solo_gain[0]);
}

static void test_bulk_set_is_refused_at_configure_time(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("0D 50 03 0D00", "8D 00 50 03 0D00"); /* 13: larger than the buffer of 12 */
    SOLO_ANSWERED("0E 00 01", "8E 00");
    SOLO_ANSWERED("0D 50 03 0C00", "8D 01 50 03 0C00");
    SOLO_ANSWERED("0D 07 00 0800", "8D 00 07 00 0800"); /* read-only */
    SOLO_ANSWERED("0D 33 00 0800", "8D 00 33 00 0800"); /* unknown */
    SOLO_ANSWERED("0D 51 00 0200", "8D 00 51 00 0200"); /* read-only extra */
    SOLO_ANSWERED("0D 04 09 0100", "8D 00 04 09 0100"); /* no such channel */
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.written);
}

/* What can be written at all can be written by bulk, and nothing else (pdcp-bus.md 4). */
static void test_bulk_set_of_channel_parameters(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("0D 03 01 0100", "8D 00 03 01 0100"); /* transfer type */
    SOLO_ANSWERED("0D 09 01 0100", "8D 00 09 01 0100"); /* required channels */
    SOLO_ANSWERED("0D 06 03 0100", "8D 00 06 03 0100"); /* not specified for outputs */
    SOLO_ANSWERED("0D 04 03 0100", "8D 01 04 03 0100");
    SOLO_ANSWERED("0E 00 01", "8E 01");
    SOLO_ANSWERED("03 04 03", "83 01 04 03 01");
    SOLO_ANSWERED("0D 05 03 0100", "8D 01 05 03 0100");
    SOLO_ANSWERED("0E 00 23", "8E 01");
    SOLO_ANSWERED("03 05 03", "83 01 05 03 23");
    SOLO_ANSWERED("0D 0D 00 0100", "8D 00 0D 00 0100"); /* behind the last parameter of the device */
}

static void test_bulk_set_without_a_buffer_and_of_nothing(void)
{
    pdcp_device_desc_t small = solo_desc;
    const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    small.bulk = NULL;
    small.bulk_capacity = 0;
    TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &small, &solo_port, &record, 1, solo_now));
    (void)solo_step();
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "81 10 0200 0300 0400");
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_ANSWERED("0D 50 03 0100", "8D 00 50 03 0100");
    SOLO_ANSWERED("0D 50 03 0000", "8D 01 50 03 0000"); /* an empty value has no packets */
    TEST_ASSERT_EQUAL_UINT16(0, solo_gain_len);
    SOLO_ANSWERED("0D 51 00 0000", "8D 00 51 00 0000");
}

static void test_bulk_set_of_a_value_that_cannot_be(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("0D 0A 00 0200", "8D 01 0A 00 0200");
    SOLO_ANSWERED("0E 00 0100", "8E 00"); /* beacon every millisecond */
    SOLO_ANSWERED("03 0A 00", "83 01 0A 00 F401");
}

static void test_requests_are_answered_during_a_transfer(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    SOLO_ANSWERED("03 09 00", "83 01 09 00 03");
    SOLO_ANSWERED("0E 00 010203040506", "8E 01");
    SOLO_ANSWERED("04 04 03 01", "84 01 04 03 01");
    SOLO_ANSWERED("0E 01 0708", "8E 01");
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.written);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bulk_get_of_a_descriptor);
    RUN_TEST(test_bulk_get_of_required_inputs_ends_with_a_short_packet);
    RUN_TEST(test_bulk_get_of_short_and_of_missing_values);
    RUN_TEST(test_bulk_get_packet_ids_wrap);
    RUN_TEST(test_bulk_get_repeats_a_packet_without_answer);
    RUN_TEST(test_bulk_get_has_three_tries_for_each_packet);
    RUN_TEST(test_bulk_get_refused_or_started_anew);
    RUN_TEST(test_bulk_set_of_an_extra);
    RUN_TEST(test_bulk_set_of_a_source);
    RUN_TEST(test_bulk_set_repeated_packets_are_stored_once);
    RUN_TEST(test_bulk_set_wrong_packet_fails_until_configured_anew);
    RUN_TEST(test_bulk_set_started_anew_begins_with_packet_0);
    RUN_TEST(test_bulk_set_is_refused_at_configure_time);
    RUN_TEST(test_bulk_set_of_channel_parameters);
    RUN_TEST(test_bulk_set_without_a_buffer_and_of_nothing);
    RUN_TEST(test_bulk_set_of_a_value_that_cannot_be);
    RUN_TEST(test_requests_are_answered_during_a_transfer);
    return UNITY_END();
}
