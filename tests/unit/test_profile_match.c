/* Similarity and order of channels by hand, from profile-layer.md 3 and [PROFILE listing 4.9]. */
#include "profile_channel.h"
#include "profile_match.h"
#include "systems.h"
#include "unity.h"

static systems_t s;

void setUp(void)
{
    systems_init(&s);
}

void tearDown(void) {}

static void check_both_ways(uint8_t expected, uint16_t type_a, uint16_t a, uint16_t type_b, uint16_t b)
{
    TEST_ASSERT_EQUAL_UINT8(expected, profile_match_similarity(type_a, a, type_b, b));
    TEST_ASSERT_EQUAL_UINT8(expected, profile_match_similarity(type_b, b, type_a, a));
}

static void test_each_equal_component_counts_8(void)
{
    check_both_ways(7, 0x5000, 0x2120, 0x5000, 0x1120);
    check_both_ways(15, 0x5000, 0x2120, 0x5000, 0x2200);
    check_both_ways(23, 0x5000, 0x2120, 0x5000, 0x2110);
    check_both_ways(31, 0x5000, 0x2120, 0x5000, 0x2120);
    check_both_ways(31, 0x5000, 0x2121, 0x5000, 0x2120);
    check_both_ways(39, 0x5000, 0x2121, 0x5000, 0x2121);
}

static void test_counting_stops_at_the_first_difference(void)
{
    check_both_ways(15, 0x5000, 0x2321, 0x5000, 0x2421);
    check_both_ways(7, 0x5000, 0x3111, 0x5000, 0x2111);
}

static void test_zero_components_do_not_count(void)
{
    check_both_ways(7, 0x5000, 0x0000, 0x5000, 0x0000);
    check_both_ways(15, 0x5000, 0x2000, 0x5000, 0x2000);
    check_both_ways(15, 0x5000, 0x2011, 0x5000, 0x2011);
}

static void test_control_mode_data_type_and_size_count_4_2_1(void)
{
    check_both_ways(7, 0x5000, 0, 0x5000, 0);
    check_both_ways(3, 0x5000, 0, 0x5400, 0);
    check_both_ways(3, 0x5C00, 0, 0x5400, 0);
    check_both_ways(5, 0x5000, 0, 0x7000, 0);
    check_both_ways(6, 0x5000, 0, 0x9000, 0);
    check_both_ways(0, 0x5000, 0, 0xE400, 0);
    check_both_ways(29, 0x5200, 0x1220, 0x7300, 0x1220);
}

static void test_flags_prescaler_and_unused_bits_do_not_count(void)
{
    check_both_ways(7, 0x5000, 0, 0x5300, 0);
    check_both_ways(7, 0x5000, 0, 0x50FF, 0);
}

/* D-PRO-3: an equal root is enough, an equal type is not. */
static void test_the_least_alike_candidates(void)
{
    TEST_ASSERT_EQUAL_UINT8(PROFILE_CANDIDATE_MIN, profile_match_similarity(0x5000, 0x2120, 0xE400, 0x2200));
    TEST_ASSERT_LESS_THAN(PROFILE_CANDIDATE_MIN, profile_match_similarity(0x5000, 0x2120, 0x5000, 0x1120));
}

static void test_flags_of_the_type(void)
{
    systems_add(&s, "D1 in 1 5200 2110, in 2 5100 2110, in 3 5300 2110, in 4 5000 2110, in 5 ACFF 2110");
    static const bool sole[] = {true, false, true, false, false};
    static const bool terminal[] = {false, true, true, false, false};
    for (uint8_t i = 0; i < 5; i++) {
        const pdcp_channel_t *channel =
            &s.tables.channels[pdcp_tables_channel(&s.tables, 0, (uint8_t)(i + 1))];
        TEST_ASSERT_EQUAL(sole[i], profile_channel_is_sole(channel));
        TEST_ASSERT_EQUAL(terminal[i], profile_channel_is_terminal(channel));
    }
}

static void test_the_terminal_profile_is_the_priority(void)
{
    systems_add(&s, "D1 in 1 5300 2110 for 1220, in 2 5300 2110");
    TEST_ASSERT_EQUAL_HEX16(0x1220, profile_channel_priority(&s.tables.channels[systems_channel(&s, "1.1")]));
    TEST_ASSERT_EQUAL_HEX16(0x2110, profile_channel_priority(&s.tables.channels[systems_channel(&s, "1.2")]));
}

static void check_before(const char *first, const char *second)
{
    const uint8_t a = systems_channel(&s, first);
    const uint8_t b = systems_channel(&s, second);
    TEST_ASSERT_TRUE_MESSAGE(profile_match_is_before(&s.tables, a, b), first);
    TEST_ASSERT_FALSE_MESSAGE(profile_match_is_before(&s.tables, b, a), second);
    TEST_ASSERT_FALSE_MESSAGE(profile_match_is_before(&s.tables, a, a), first);
}

/* D-PRO-3: profile, then VID, PID, SN, index; each decides over all that come behind it. */
static void test_the_order_of_equally_alike_channels(void)
{
    systems_add(&s,
                "D1 3:3:3 out 1 5000 2110, out 2 5000 2120, out 3 5000 2110;"
                "D2 2:4:4 out 1 5000 2110; D3 3:2:4 out 1 5000 2110; D4 3:3:2 out 1 5000 2110,"
                "out 2 5000 2110, out 3 5000 2110, out 4 5000 2110");
    check_before("1.1", "1.2");
    check_before("1.1", "1.3");
    check_before("1.3", "1.2");
    check_before("2.1", "1.1");
    check_before("3.1", "1.1");
    check_before("4.4", "1.1");
}

static void check_precedes(const pdcp_identity_t *a, const pdcp_identity_t *b)
{
    TEST_ASSERT_TRUE(profile_match_precedes(0x2110, a, 1, 0x2110, b, 1));
    TEST_ASSERT_FALSE(profile_match_precedes(0x2110, b, 1, 0x2110, a, 1));
    TEST_ASSERT_TRUE(profile_match_precedes(0x2110, b, 1, 0x2120, a, 1));
}

static void test_the_order_of_identities(void)
{
    const pdcp_identity_t a = {.vid = 1, .pid = 900, .sn = 900};
    const pdcp_identity_t b = {.vid = 2, .pid = 1, .sn = 900};
    const pdcp_identity_t c = {.vid = 2, .pid = 1, .sn = 0xFFFF};
    check_precedes(&a, &b);
    check_precedes(&b, &c);
    TEST_ASSERT_FALSE(profile_match_precedes(0x2110, &b, 1, 0x2110, &b, 1));
}

static void test_only_channels_of_devices_that_are_set_up_are_ready(void)
{
    systems_add(&s, "D1 in 1 5000 2110, out 2 5000 2110");
    const uint8_t in = systems_channel(&s, "1.1");
    const uint8_t out = systems_channel(&s, "1.2");
    TEST_ASSERT_TRUE(profile_channel_is_ready(&s.tables, in, PDCP_INPUT));
    TEST_ASSERT_FALSE(profile_channel_is_ready(&s.tables, in, PDCP_OUTPUT));
    TEST_ASSERT_TRUE(profile_channel_is_ready(&s.tables, out, PDCP_OUTPUT));
    TEST_ASSERT_FALSE(profile_channel_is_ready(&s.tables, PDCP_NONE, PDCP_INPUT));
    TEST_ASSERT_FALSE(profile_channel_is_ready(&s.tables, PDCP_CHANNELS_MAX - 1, PDCP_INPUT));
    static const uint8_t states[] = {PDCP_PLACE_SETUP, PDCP_PLACE_FAILED, PDCP_PLACE_LOST};
    for (unsigned i = 0; i < sizeof states; i++) {
        s.tables.devices[0].state = states[i];
        TEST_ASSERT_FALSE(profile_channel_is_ready(&s.tables, in, PDCP_INPUT));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_equal_component_counts_8);
    RUN_TEST(test_counting_stops_at_the_first_difference);
    RUN_TEST(test_zero_components_do_not_count);
    RUN_TEST(test_control_mode_data_type_and_size_count_4_2_1);
    RUN_TEST(test_flags_prescaler_and_unused_bits_do_not_count);
    RUN_TEST(test_the_least_alike_candidates);
    RUN_TEST(test_flags_of_the_type);
    RUN_TEST(test_the_terminal_profile_is_the_priority);
    RUN_TEST(test_the_order_of_equally_alike_channels);
    RUN_TEST(test_the_order_of_identities);
    RUN_TEST(test_only_channels_of_devices_that_are_set_up_are_ready);
    return UNITY_END();
}
