/* Which candidate is taken, what a link requires and desires, and what a failed write leads to
 * (profile-layer.md 3, [PROFILE 4.2], D-PRO-5). */
#include <string.h>

#include "plan.h"
#include "unity.h"

void setUp(void)
{
    systems_init(&plan_limb);
}

void tearDown(void) {}

/* --- Candidates and their order (profile-layer.md 3) --- */

static void test_candidates_have_the_same_root(void)
{
    plan_expect_of("D1 out 1 5000 2110; D2 in 1 5300 1110", "");
    plan_expect_of("D1 out 1 C400 1200; D2 in 1 5300 1110", "1.1>2.1");
    plan_expect_of("D1 out 1 5000 0000; D2 in 1 5300 0000", "");
}

static void test_a_device_does_not_feed_itself(void)
{
    plan_expect_of("D1 in 1 5300 1110, out 2 5000 1110", "");
    plan_expect_of("D1 in 1 5300 1110, out 2 5000 1110; D2 out 1 5000 1200", "2.1>1.1");
}

static void test_the_most_similar_is_taken(void)
{
    plan_expect_of("D1 out 1 5000 1200, out 2 5000 1120, out 3 5000 1110; D2 in 1 5300 1110", "1.3>2.1");
    plan_expect_of("D1 out 1 7000 1110, out 2 5000 1120; D2 in 1 5300 1110", "1.1>2.1");
    plan_expect_of("D1 out 1 5400 1110, out 2 7000 1110; D2 in 1 5300 1110", "1.2>2.1");
    plan_expect_of("D1 out 1 7000 1110, out 2 9000 1110; D2 in 1 5300 1110", "1.2>2.1");
}

static void test_ties_go_to_the_lower_profile_then_to_the_lower_identity(void)
{
    plan_expect_of("D1 1:1:1 out 1 5000 1130; D2 9:9:9 out 1 5000 1120; D3 in 1 5300 1110", "2.1>3.1");
    plan_expect_of("D1 3:1:1 out 1 5000 1110; D2 2:9:9 out 1 5000 1110; D3 in 1 5300 1110", "2.1>3.1");
    plan_expect_of("D1 2:3:1 out 1 5000 1110; D2 2:2:9 out 1 5000 1110; D3 in 1 5300 1110", "2.1>3.1");
    plan_expect_of("D1 2:2:9 out 1 5000 1110; D2 2:2:8 out 1 5000 1110; D3 in 1 5300 1110", "2.1>3.1");
    plan_expect_of("D1 2:2:9 out 1 5000 1110, out 2 5000 1110; D3 in 1 5300 1110", "1.1>3.1");
}

static void test_the_terminal_flag_alone_makes_a_channel_terminal(void)
{
    plan_expect_of("D1 out 1 5000 1110, out 2 5000 2110; D2 in 1 5200 1110 for 1110", "");
    plan_expect_of("D1 out 1 5000 1110, out 2 5000 2110; D2 in 1 5300 2110 for 1110", "1.2>2.1");
}

static void test_the_lowest_terminal_profile_is_served_first(void)
{
    plan_expect_of("D1 out 1 5000 2110; D2 in 1 5300 2110 for 1220, in 2 5300 2110 for 1210", "1.1>2.2");
    plan_expect_of("D1 out 1 5000 2110; D2 in 1 5300 2110, in 2 5300 2120 for 1210", "1.1>2.2");
    plan_expect_of("D1 out 1 5000 2110; D2 in 1 5300 2110 for 2200, in 2 5300 2120", "1.1>2.2");
    plan_expect_of("D1 out 1 5000 2110; D3 in 1 5300 2110; D2 in 1 5300 2110", "1.1>2.1");
}

static void test_sole_access(void)
{
    plan_expect_of("D1 out 1 5000 1110; D2 in 1 5300 1110, in 2 5300 1120", "1.1>2.1");
    plan_expect_of("D1 out 1 5000 1110; D2 in 1 5300 1110, in 2 5100 1120", "1.1>2.1 1.1>2.2");
    plan_expect_of("D1 out 1 5000 1110; D2 in 1 5100 1110, in 2 5300 1120, in 3 5300 1120",
                   "1.1>2.1 1.1>2.2");
    plan_expect_of("D1 out 1 5000 1110, out 2 5000 1200; D2 in 1 5300 1110, in 2 5300 1110",
                   "1.1>2.1 1.2>2.2");
}

/* --- What a link requires and desires --- */

static void test_a_required_input_is_connected_too(void)
{
    const char *const chain = "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110";
    plan_expect_of(chain, "");
    systems_add(&plan_limb, "D3 out 1 5000 2120");
    plan_expect("3.1>1.2 1.1>2.1");
}

static void test_the_next_candidate_is_tried_when_a_required_input_gets_nothing(void)
{
    plan_expect_of("D1 out 1 5000 1110 req 2, in 2 5200 2110, out 3 5000 1120; D2 in 1 5300 1110", "1.3>2.1");
}

/* [PROFILE 4.2.4]: two channels that open and close a hand. */
static void test_inputs_that_require_each_other(void)
{
    const char *const hand =
        "D1 out 1 5000 2110; D2 in 1 5300 2110 req 2 for 1110, in 2 5300 2110 req 1 for 1120";
    plan_expect_of(hand, "");
    systems_add(&plan_limb, "D3 out 1 5000 2120");
    plan_expect("1.1>2.1 3.1>2.2");
    plan_lose(3);
    plan_expect("");
    plan_back(3);
    plan_expect("1.1>2.1 3.1>2.2");
}

static void test_a_desired_input_is_connected_if_it_can_be(void)
{
    const char *const control =
        "D1 out 1 5000 1110 des 2, in 2 5200 2110; D2 in 1 5300 1110 des 2, in 2 5200 2200";
    plan_expect_of(control, "1.1>2.1");
    plan_expect_of(
        "D1 out 1 5000 1110 des 2, in 2 5200 2110; D2 in 1 5300 1110 des 2, in 2 5200 2200; D3 out 1 5000 "
        "2100",
        "3.1>1.2 1.1>2.1");
    plan_expect_of(
        "D1 out 1 5000 1110 des 2, in 2 5200 2110; D2 in 1 5300 1110 des 2, in 2 5200 2200;"
        "D3 out 1 5000 2100, out 2 5000 2100",
        "3.1>1.2 1.1>2.1 3.2>2.2");
}

static void test_required_inputs_come_before_desired_ones(void)
{
    plan_expect_of(
        "D1 out 1 5000 1110 req 3 des 2, in 2 5200 2110, in 3 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 "
        "2110",
        "3.1>1.3 1.1>2.1");
}

/* A motor's encoder feeds the control that drives the motor. */
static void test_feedback_ends(void)
{
    plan_expect_of("D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110 req 1, out 2 5000 2110 req 1",
                   "2.2>1.2 1.1>2.1");
    plan_expect_of("D1 out 1 5000 1110 req 2, in 2 5200 1110; D2 out 1 5000 1110 req 2, in 2 5300 1110",
                   "2.1>1.2 1.1>2.2");
}

static void test_a_failed_link_leaves_nothing(void)
{
    plan_expect_of(
        "D1 out 1 5000 1110 req 2 3 4, in 2 5200 2110, in 3 5200 2110, in 4 5200 3110; D2 in 1 5300 1110;"
        "D3 out 1 5000 2110, out 2 5000 2120",
        "");
    /* and what it had taken is free again */
    plan_expect_of(
        "D1 out 1 5000 1110 req 2 3, in 2 5200 2110, in 3 5200 3110, out 4 5000 1120 req 5, in 5 5200 2110;"
        "D2 in 1 5300 1110; D3 out 1 5000 2110",
        "3.1>1.5 1.4>2.1");
}

/* A device of a chain: each of its inputs requires the next one, and the last one's only source is the output
 * of the next device, which requires its first input. */
static void add_link_of_chain(uint8_t number, uint8_t inputs, bool last)
{
    systems_device_t device;
    memset(&device, 0, sizeof device);
    device.name = number;
    device.identity.sn = number;
    device.count = (uint8_t)(inputs + 1);
    for (uint8_t i = 0; i < inputs; i++) {
        const bool across = i + 1 == inputs && !last;
        device.channels[i].transfer = PDCP_INPUT;
        device.channels[i].type = number == 1 && i == 0 ? 0x5100 : 0x5000;
        device.channels[i].profile = (uint16_t)(across ? 0x1000u * (number + 2u) : 0x2110u);
        device.channels[i].required = i + 1 < inputs ? (uint32_t)1 << (i + 2) : 0;
    }
    device.channels[inputs].transfer = PDCP_OUTPUT;
    device.channels[inputs].type = 0x5000;
    device.channels[inputs].profile = (uint16_t)(0x1000u * (number + 1u));
    device.channels[inputs].required = 2;
    systems_set_up(&plan_limb, systems_bind(&plan_limb, &device), &device);
}

/* A chain of so many inputs, eight a device. */
static void expect_chain(uint8_t length, bool linked)
{
    systems_init(&plan_limb);
    systems_add(&plan_limb, "D15 out 1 5000 2110");
    for (int n = 0; n < (length + 7) / 8; n++) {
        const bool last = 8 * (n + 1) >= length;
        add_link_of_chain((uint8_t)(n + 1), (uint8_t)(last ? length - 8 * n : 8), last);
    }
    systems_plan(&plan_limb, PROFILE_PLAN_ALL);
    TEST_ASSERT_EQUAL_UINT8(linked ? length : 0, plan_count_links());
}

/* D-PRO-17. */
static void test_a_chain_is_followed_to_its_depth(void)
{
    expect_chain(PROFILE_PLAN_DEPTH - 1, true);
    expect_chain(PROFILE_PLAN_DEPTH, true);
    expect_chain(PROFILE_PLAN_DEPTH + 1, false);
}

/* --- Failed writes (D-PRO-5) --- */

static void ban(const char *output, const char *input)
{
    plan_limb.banned[plan_limb.banned_count].output = systems_channel(&plan_limb, output);
    plan_limb.banned[plan_limb.banned_count].input = systems_channel(&plan_limb, input);
    plan_limb.banned_count++;
}

static void test_a_banned_pair_leads_to_the_next_candidate(void)
{
    systems_add(&plan_limb, "D1 out 1 5000 1110, out 2 5000 1120, out 3 5000 1200; D2 in 1 5300 1110");
    plan_expect("1.1>2.1");
    plan_limb.tables.channels[systems_channel(&plan_limb, "2.1")].link = PDCP_LINK_NONE;
    profile_links_init(&plan_limb.links);
    ban("1.1", "2.1");
    systems_plan(&plan_limb, PROFILE_PLAN_ALL);
    TEST_ASSERT_EQUAL_UINT8(systems_channel(&plan_limb, "1.2"),
                            plan_limb.plan.want[systems_channel(&plan_limb, "2.1")]);
    ban("1.2", "2.1");
    plan_expect("1.3>2.1");
}

static void test_a_banned_original_is_not_brought_back(void)
{
    plan_set_up("D1 out 1 5000 1110; D2 in 1 5300 1110; D3 out 1 5000 1200", "1.1>2.1");
    ban("1.1", "2.1");
    plan_expect("3.1>2.1");
    plan_limb.banned_count = 0;
    plan_expect("1.1>2.1");
}

/* Of a first control all but the last required input could be linked. */
static void test_what_a_failed_attempt_has_made_is_given_up(void)
{
    systems_add(&plan_limb,
                "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 out 1 5000 1120 req 2, in 2 5200 2110;"
                "D3 in 1 5300 1110; D4 out 1 5000 2110");
    systems_link(&plan_limb, "4.1>1.2");
    const uint8_t made = systems_channel(&plan_limb, "1.2");
    plan_limb.made[made / 8] = (uint8_t)(1u << (made % 8));
    ban("1.1", "3.1");
    systems_expect(&plan_limb, PROFILE_PLAN_ALL, "4.1>2.2 2.1>3.1");
}

static void test_a_working_link_is_kept_in_spite_of_a_ban(void)
{
    plan_run("D1 out 1 5000 1110, out 2 5000 1120; D2 in 1 5300 1110", "1.1>2.1");
    ban("1.1", "2.1");
    plan_expect("1.1>2.1");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_candidates_have_the_same_root);
    RUN_TEST(test_a_device_does_not_feed_itself);
    RUN_TEST(test_the_most_similar_is_taken);
    RUN_TEST(test_ties_go_to_the_lower_profile_then_to_the_lower_identity);
    RUN_TEST(test_the_terminal_flag_alone_makes_a_channel_terminal);
    RUN_TEST(test_the_lowest_terminal_profile_is_served_first);
    RUN_TEST(test_sole_access);
    RUN_TEST(test_a_required_input_is_connected_too);
    RUN_TEST(test_the_next_candidate_is_tried_when_a_required_input_gets_nothing);
    RUN_TEST(test_inputs_that_require_each_other);
    RUN_TEST(test_a_desired_input_is_connected_if_it_can_be);
    RUN_TEST(test_required_inputs_come_before_desired_ones);
    RUN_TEST(test_feedback_ends);
    RUN_TEST(test_a_failed_link_leaves_nothing);
    RUN_TEST(test_a_chain_is_followed_to_its_depth);
    RUN_TEST(test_a_banned_pair_leads_to_the_next_candidate);
    RUN_TEST(test_a_banned_original_is_not_brought_back);
    RUN_TEST(test_what_a_failed_attempt_has_made_is_given_up);
    RUN_TEST(test_a_working_link_is_kept_in_spite_of_a_ban);
    return UNITY_END();
}
