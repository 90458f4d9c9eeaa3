/* The device role (D-BUS-16): parameters and malformed frames, against frames written by hand from the tables
 * of pdcp-bus.md 2 and 4. */
#include "solo.h"
#include "unity.h"

void setUp(void)
{
    solo_reset();
}

void tearDown(void) {}

/* --- parameters --- */

static void test_device_parameters(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("03 01 00", "83 01 01 00 0200 0300");
    SOLO_ANSWERED("03 02 00", "83 01 02 00 0400");
    SOLO_ANSWERED("03 03 00", "83 01 03 00 44332211");
    SOLO_ANSWERED("03 04 00", "83 01 04 00 55000000");
    SOLO_ANSWERED("03 05 00", "83 01 05 00 0201 0403");
    SOLO_ANSWERED("03 06 00", "83 01 06 00 0605 0807");
    SOLO_ANSWERED("03 07 00", "83 02 07 00");
    SOLO_ANSWERED("03 08 00", "83 01 08 00 10");
    SOLO_ANSWERED("03 09 00", "83 01 09 00 03");
    SOLO_ANSWERED("03 0A 00", "83 01 0A 00 F401");
    SOLO_ANSWERED("03 0B 00", "83 01 0B 00 6400");
    SOLO_ANSWERED("03 0C 00", "83 01 0C 00 E803");
    SOLO_ANSWERED("03 00 00", "83 00 00 00");
    SOLO_ANSWERED("03 0D 00", "83 00 0D 00");
}

static void test_input_parameters_after_power_on(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("03 01 02", "83 01 01 02 0053 1011");
    SOLO_ANSWERED("03 02 01", "83 01 02 01 696E");
    SOLO_ANSWERED("03 02 02", "83 01 02 02");
    SOLO_ANSWERED("03 03 02", "83 01 03 02 01");
    SOLO_ANSWERED("03 04 02", "83 01 04 02 00");
    SOLO_ANSWERED("03 05 02", "83 01 05 02 FFFF FFFF");
    SOLO_ANSWERED("03 06 02", "83 01 06 02 FFFF FF");
    SOLO_ANSWERED("03 07 02", "83 01 07 02 00 00");
    SOLO_ANSWERED("03 08 02", "83 01 08 02 0000 0000");
    SOLO_ANSWERED("03 09 02", "83 01 09 02");
    SOLO_ANSWERED("03 0A 02", "83 01 0A 02");
    SOLO_ANSWERED("03 0B 02", "83 01 0B 02 2012");
    SOLO_ANSWERED("03 0C 02", "83 00 0C 02");
    SOLO_ANSWERED("03 01 04", "83 00 01 04"); /* no such channel */
    SOLO_ANSWERED("03 01 FF", "83 00 01 FF");
}

static void test_output_parameters(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("03 01 03", "83 01 01 03 0050 0011");
    SOLO_ANSWERED("03 02 03", "83 02 02 03");
    SOLO_ANSWERED("03 03 03", "83 01 03 03 02");
    SOLO_ANSWERED("03 04 03", "83 01 04 03 00");
    SOLO_ANSWERED("03 05 03", "83 01 05 03 00");
    SOLO_ANSWERED("03 06 03", "83 00 06 03"); /* not specified for outputs */
    SOLO_ANSWERED("03 09 03", "83 02 09 03");
    SOLO_ANSWERED("03 0A 03", "83 01 0A 03 40");
    SOLO_ANSWERED("03 0B 03", "83 00 0B 03");
    SOLO_ANSWERED("04 05 03 42", "84 01 05 03 42");
    SOLO_ANSWERED("03 05 03", "83 01 05 03 42");
    SOLO_ANSWERED("04 05 03 FF", "84 00 05 03 FF");
    SOLO_ANSWERED("03 05 03", "83 01 05 03 42");
}

static void test_source_of_an_input_is_written_and_stored(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("04 05 01 0200 0900", "84 01 05 01 0200 0900");
    SOLO_ANSWERED("04 06 01 0B00 04", "84 01 06 01 0B00 04");
    SOLO_ANSWERED("04 08 01 0050 2021", "84 01 08 01 0050 2021");
    TEST_ASSERT_EQUAL_UINT(3, solo_seen.stores);
    TEST_ASSERT_EQUAL_HEX16(2, solo_seen.record.sources[0].identity.vid);
    TEST_ASSERT_EQUAL_HEX16(9, solo_seen.record.sources[0].identity.pid);
    TEST_ASSERT_EQUAL_HEX16(0x0B, solo_seen.record.sources[0].identity.sn);
    TEST_ASSERT_EQUAL_UINT8(4, solo_seen.record.sources[0].channel);
    TEST_ASSERT_EQUAL_HEX16(0x5000, solo_seen.record.sources[0].type);
    TEST_ASSERT_EQUAL_HEX16(0x2120, solo_seen.record.sources[0].profile);
    SOLO_ANSWERED("04 08 01 0050 2021", "84 01 08 01 0050 2021");
    TEST_ASSERT_EQUAL_UINT(3, solo_seen.stores); /* unchanged: not stored again */
    SOLO_ANSWERED("03 05 01", "83 01 05 01 0200 0900");
    SOLO_ANSWERED("03 06 01", "83 01 06 01 0B00 04");
    SOLO_ANSWERED("03 08 01", "83 01 08 01 0050 2021");
    SOLO_ANSWERED("04 07 01 20 FF", "84 00 07 01 20 FF");
    SOLO_ANSWERED("03 07 01", "83 01 07 01 00 00");
}

/* Every field of the source counts, however little of it has changed. */
static void test_any_change_of_a_source_is_stored(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("04 06 01 0B00 04", "84 01 06 01 0B00 04");
    SOLO_ANSWERED("04 08 01 0050 2021", "84 01 08 01 0050 2021");
    TEST_ASSERT_EQUAL_UINT(2, solo_seen.stores);
    SOLO_ANSWERED("04 06 01 0B00 05", "84 01 06 01 0B00 05");
    TEST_ASSERT_EQUAL_UINT(3, solo_seen.stores);
    TEST_ASSERT_EQUAL_UINT8(5, solo_seen.record.sources[0].channel);
    SOLO_ANSWERED("04 08 01 0050 2022", "84 01 08 01 0050 2022");
    TEST_ASSERT_EQUAL_UINT(4, solo_seen.stores);
    TEST_ASSERT_EQUAL_HEX16(0x2220, solo_seen.record.sources[0].profile);
}

/* D-BUS-2: 255 is nobody's id. */
static void test_a_source_cannot_have_id_255(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("04 07 01 FF 21", "84 00 07 01 FF 21");
    SOLO_ANSWERED("03 07 01", "83 01 07 01 00 00");
}

static void test_short_values_are_filled_with_zero_and_long_ones_cut(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("04 05 01 0200", "84 01 05 01 0200");
    SOLO_ANSWERED("03 05 01", "83 01 05 01 0200 0000");
    SOLO_ANSWERED("04 06 01 0B00 04 99", "84 01 06 01 0B00 04 99");
    SOLO_ANSWERED("03 06 01", "83 01 06 01 0B00 04");
    SOLO_ANSWERED("04 04 01 01 02 03 04", "84 01 04 01 01 02 03 04");
    SOLO_ANSWERED("03 04 01", "83 01 04 01 01");
}

static void test_read_only_parameters_stay(void)
{
    static const char *const writes[][2] = {
        {"04 01 00 01", "84 00 01 00 01"}, {"04 02 00 01", "84 00 02 00 01"},
        {"04 03 00 01", "84 00 03 00 01"}, {"04 05 00 01", "84 00 05 00 01"},
        {"04 07 00 41", "84 00 07 00 41"}, {"04 08 00 20", "84 00 08 00 20"},
        {"04 09 00 01", "84 00 09 00 01"}, {"04 01 01 01", "84 00 01 01 01"},
        {"04 03 01 02", "84 00 03 01 02"}, {"04 09 01 01", "84 00 09 01 01"},
        {"04 0B 02 01", "84 00 0B 02 01"}, {"04 06 03 01", "84 00 06 03 01"},
        {"04 04 04 01", "84 00 04 04 01"}, {"04 33 00 01", "84 00 33 00 01"},
        {"04 04 FF 01", "84 00 04 FF 01"},
    };
    solo_bind_blank();
    for (unsigned i = 0; i < sizeof writes / sizeof writes[0]; i++) {
        SOLO_ANSWERED(writes[i][0], writes[i][1]);
    }
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.stores);
    SOLO_ANSWERED("03 08 00", "83 01 08 00 10");
}

static void test_times_have_limits(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("04 0B 00 1300", "84 00 0B 00 1300"); /* 19 ms */
    SOLO_ANSWERED("04 0B 00 F501", "84 00 0B 00 F501"); /* 501 ms */
    SOLO_ANSWERED("04 0B 00 1400", "84 01 0B 00 1400");
    SOLO_ANSWERED("03 0B 00", "83 01 0B 00 1400");
    SOLO_ANSWERED("04 0C 00 0000", "84 00 0C 00 0000");
    SOLO_ANSWERED("04 0C 00 D007", "84 01 0C 00 D007");
    SOLO_ANSWERED("03 0C 00", "83 01 0C 00 D007");
}

static void test_extras_are_read_and_written(void)
{
    solo_bind_blank();
    SOLO_ANSWERED("03 50 03", "83 01 50 03 07");
    SOLO_ANSWERED("04 50 03 0102 0304", "84 01 50 03 0102 0304");
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.written);
    TEST_ASSERT_EQUAL_UINT16(4, solo_gain_len);
    SOLO_ANSWERED("03 50 03", "83 01 50 03 0102 0304");
    SOLO_ANSWERED("03 50 00", "83 00 50 00"); /* belongs to channel 3 */
    SOLO_ANSWERED("03 51 00", "83 01 51 00 0102 03");
    SOLO_ANSWERED("04 51 00 01", "84 00 51 00 01");
    solo_gain_len = 5;
    SOLO_ANSWERED("03 50 03", "83 02 50 03");
}

static void test_a_value_longer_than_its_extra_is_refused(void)
{
    pdcp_device_extra_t narrow = solo_desc.extras[0];
    pdcp_device_desc_t other = solo_desc;
    const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    narrow.capacity = 2;
    other.extras = &narrow;
    other.extra_count = 1;
    TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &other, &solo_port, &record, 1, solo_now));
    (void)solo_step();
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "81 10 0200 0300 0400");
    SOLO_TX(SOLO_BEACON, "0A");
    SOLO_ANSWERED("04 50 03 0A0B0C", "84 00 50 03 0A0B0C");
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.written);
    SOLO_ANSWERED("03 50 03", "83 01 50 03 07");
    SOLO_ANSWERED("04 50 03 0A0B", "84 01 50 03 0A0B");
    TEST_ASSERT_EQUAL_UINT(1, solo_seen.written);
}

/* --- malformed and foreign frames --- */

static void test_malformed_frames_are_counted_and_not_answered(void)
{
    can_frame_t odd = solo_frame(SOLO_TO, "03 01 00");
    solo_bind_blank();
    solo_rx(SOLO_TO, "");
    solo_rx(SOLO_TO, "03 01");
    solo_rx(SOLO_TO, "04 04 01");
    solo_rx(SOLO_TO, "44 00");
    solo_rx(SOLO_TO, "D5");
    solo_rx(SOLO_TO, "0F 01");             /* only a device asks this */
    solo_rx(SOLO_TO, "83 01 01 00");       /* an answer that only a device gives */
    solo_rx(SOLO_TO, "01 0200 0300 0400"); /* only a device asks this */
    solo_rx(SOLO_TO, "02 00");
    solo_rx(SOLO_TO, "07 11");
    solo_rx(SOLO_TO, "8E 01");                /* no transfer */
    solo_rx(SOLO_TO, "8F 01 01");             /* nothing asked */
    solo_rx(SOLO_TO, "81 10 0200 0300 0400"); /* bound already */
    solo_rx(0x710, "03 01 00");
    solo_rx(0x311, "03 01 00"); /* another device's */
    solo_rx(SOLO_TO_ALL, "03 01 00");
    solo_rx(SOLO_TO_ALL, "0B");
    for (unsigned kind = CAN_FRAME_EXTENDED; kind <= CAN_FRAME_FD; kind++) {
        odd.kind = (uint8_t)kind;
        pdcp_device_on_frame(&solo_dev, solo_now, &odd);
    }
    SOLO_QUIET();
    const pdcp_device_stats_t *stats = pdcp_device_stats(&solo_dev);
    TEST_ASSERT_EQUAL_UINT32(2, stats->drop_bad_dlc);
    TEST_ASSERT_EQUAL_UINT32(3, stats->drop_bad_code);
    TEST_ASSERT_EQUAL_UINT32(5, stats->drop_direction);
    TEST_ASSERT_EQUAL_UINT32(2, stats->drop_deprecated);
    TEST_ASSERT_EQUAL_UINT32(3, stats->drop_late);
    TEST_ASSERT_EQUAL_UINT32(1, stats->drop_unused_id);
    TEST_ASSERT_EQUAL_UINT32(4, stats->drop_kind);
    TEST_ASSERT_EQUAL_UINT(0, solo_seen.resets);
    SOLO_ANSWERED("03 09 00", "83 01 09 00 03");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_device_parameters);
    RUN_TEST(test_input_parameters_after_power_on);
    RUN_TEST(test_output_parameters);
    RUN_TEST(test_source_of_an_input_is_written_and_stored);
    RUN_TEST(test_any_change_of_a_source_is_stored);
    RUN_TEST(test_a_source_cannot_have_id_255);
    RUN_TEST(test_short_values_are_filled_with_zero_and_long_ones_cut);
    RUN_TEST(test_read_only_parameters_stay);
    RUN_TEST(test_times_have_limits);
    RUN_TEST(test_extras_are_read_and_written);
    RUN_TEST(test_a_value_longer_than_its_extra_is_refused);
    RUN_TEST(test_malformed_frames_are_counted_and_not_answered);
    return UNITY_END();
}
