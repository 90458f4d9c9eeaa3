/* The planner on tables: the five acceptance systems, its rules one by one, and how its work grows. What is
 * expected comes from profile-layer.md 3, 4, 6 and [PROFILE 4.3.1]. */
#include "profile_plan.h"

#include <stdio.h>
#include <string.h>

#include "profile_channel.h"
#include "systems.h"
#include "unity.h"

static systems_t s;

enum { ALL = PROFILE_PLAN_ALL };

static const char as_2[] = "1.1>2.2 2.3>3.1 2.5>3.2";

void setUp(void)
{
    systems_init(&s);
}

void tearDown(void) {}

static void expect(const char *links)
{
    systems_expect(&s, ALL, links);
}

static void lose(uint8_t name)
{
    systems_lose(&s, systems_place(&s, name));
}

static void back(uint8_t name)
{
    systems_return(&s, systems_place(&s, name));
}

static void forget(uint8_t name)
{
    systems_forget(&s, systems_place(&s, name));
}

/* The parts are there and are configured like this; nothing is linked yet. */
static void set_up(const char *parts, const char *configuration)
{
    systems_init(&s);
    systems_add(&s, parts);
    systems_configure(&s, configuration, false);
}

/* The links work. */
static void run(const char *parts, const char *configuration)
{
    set_up(parts, configuration);
    expect(configuration);
}

/* The links that autoconfiguration makes of these parts, from nothing. */
static void expect_of(const char *parts, const char *links)
{
    systems_init(&s);
    systems_add(&s, parts);
    expect(links);
}

/* --- Acceptance systems (profile-layer.md 6) --- */

static void test_system_1_at_power_on(void)
{
    set_up(systems_acceptance(1), "1.1>2.1");
    forget(2);
    expect("1.1>3.2");
}

static void test_system_1_as_hot_swap(void)
{
    run("D1 2:2:4 out 1 5000 2110; D2 2:2:5 in 1 5200 2110", "1.1>2.1");
    lose(2);
    expect("");
    systems_add(&s, "D3 2:2:6 in 1 5200 2200, in 2 5200 2120");
    expect("1.1>3.2");
    back(2);
    expect("1.1>2.1");
}

static void test_system_2_at_power_on(void)
{
    systems_add(&s, systems_acceptance(2));
    expect(as_2);
}

static void come_in_order(uint8_t a, uint8_t b, uint8_t c)
{
    systems_init(&s);
    systems_add(&s, systems_acceptance(2));
    for (uint8_t i = 1; i <= 3; i++) {
        lose(i);
    }
    back(a);
    systems_plan(&s, ALL);
    systems_execute(&s);
    back(b);
    systems_plan(&s, ALL);
    systems_execute(&s);
    back(c);
    expect(as_2);
}

static void test_system_2_as_hot_swap(void)
{
    come_in_order(1, 2, 3);
    come_in_order(1, 3, 2);
    come_in_order(2, 1, 3);
    come_in_order(2, 3, 1);
    come_in_order(3, 1, 2);
    come_in_order(3, 2, 1);
}

static void test_system_2_without_one_of_its_parts(void)
{
    static const char *const left[] = {"", "", "1.1>2.2"};
    for (uint8_t part = 1; part <= 3; part++) {
        systems_init(&s);
        systems_add(&s, systems_acceptance(2));
        expect(as_2);
        lose(part);
        expect(left[part - 1]);
        back(part);
        expect(as_2);
    }
}

static void test_system_3_at_power_on(void)
{
    set_up(systems_acceptance(3), as_2);
    systems_expect(&s, PROFILE_PLAN_ORIGINALS, as_2);
}

static void test_system_3_as_hot_swap(void)
{
    run(systems_acceptance(3), as_2);
    for (uint8_t i = 1; i <= 3; i++) {
        lose(i);
        expect(i == 3 ? "1.1>2.2" : "");
        back(i);
        expect(as_2);
    }
}

static void test_system_4_at_power_on(void)
{
    set_up(systems_acceptance(4), "1.1>3.2");
    forget(1);
    expect("2.2>3.2");
}

static void test_system_4_as_hot_swap(void)
{
    run("D1 2:2:4 out 1 5000 2110; D3 2:2:6 in 1 5200 2200, in 2 5200 2110", "1.1>3.2");
    lose(1);
    expect("");
    systems_add(&s, "D2 2:2:5 out 1 5000 2200, out 2 5000 2120");
    expect("2.2>3.2");
    back(1);
    expect("1.1>3.2");
}

/* Only the sources that the inputs name are known. */
static void read_back(void)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        profile_link_t link;
        if (profile_channel_is_ready(&s.tables, i, PDCP_INPUT) &&
            profile_channel_named_source(&s.tables, i, &link.output)) {
            profile_channel_end(&s.tables, i, &link.input);
            TEST_ASSERT_TRUE(profile_links_put(&s.links, &link, false));
        }
        s.tables.channels[i].link = PDCP_LINK_NONE;
        s.tables.channels[i].source.channel = PDCP_NONE;
    }
}

static void test_system_5_at_power_on(void)
{
    systems_add(&s, systems_acceptance(5));
    systems_link(&s, as_2);
    read_back();
    systems_expect(&s, PROFILE_PLAN_ORIGINALS, as_2);
}

static void test_system_5_as_hot_swap(void)
{
    systems_add(&s, systems_acceptance(5));
    systems_link(&s, as_2);
    read_back();
    expect(as_2);
    lose(1);
    expect("");
    back(1);
    expect(as_2);
}

/* --- Candidates and their order (profile-layer.md 3) --- */

static void test_candidates_have_the_same_root(void)
{
    expect_of("D1 out 1 5000 2110; D2 in 1 5300 1110", "");
    expect_of("D1 out 1 C400 1200; D2 in 1 5300 1110", "1.1>2.1");
    expect_of("D1 out 1 5000 0000; D2 in 1 5300 0000", "");
}

static void test_a_device_does_not_feed_itself(void)
{
    expect_of("D1 in 1 5300 1110, out 2 5000 1110", "");
    expect_of("D1 in 1 5300 1110, out 2 5000 1110; D2 out 1 5000 1200", "2.1>1.1");
}

static void test_the_most_similar_is_taken(void)
{
    expect_of("D1 out 1 5000 1200, out 2 5000 1120, out 3 5000 1110; D2 in 1 5300 1110", "1.3>2.1");
    expect_of("D1 out 1 7000 1110, out 2 5000 1120; D2 in 1 5300 1110", "1.1>2.1");
    expect_of("D1 out 1 5400 1110, out 2 7000 1110; D2 in 1 5300 1110", "1.2>2.1");
    expect_of("D1 out 1 7000 1110, out 2 9000 1110; D2 in 1 5300 1110", "1.2>2.1");
}

static void test_ties_go_to_the_lower_profile_then_to_the_lower_identity(void)
{
    expect_of("D1 1:1:1 out 1 5000 1130; D2 9:9:9 out 1 5000 1120; D3 in 1 5300 1110", "2.1>3.1");
    expect_of("D1 3:1:1 out 1 5000 1110; D2 2:9:9 out 1 5000 1110; D3 in 1 5300 1110", "2.1>3.1");
    expect_of("D1 2:3:1 out 1 5000 1110; D2 2:2:9 out 1 5000 1110; D3 in 1 5300 1110", "2.1>3.1");
    expect_of("D1 2:2:9 out 1 5000 1110; D2 2:2:8 out 1 5000 1110; D3 in 1 5300 1110", "2.1>3.1");
    expect_of("D1 2:2:9 out 1 5000 1110, out 2 5000 1110; D3 in 1 5300 1110", "1.1>3.1");
}

static void test_the_terminal_flag_alone_makes_a_channel_terminal(void)
{
    expect_of("D1 out 1 5000 1110, out 2 5000 2110; D2 in 1 5200 1110 for 1110", "");
    expect_of("D1 out 1 5000 1110, out 2 5000 2110; D2 in 1 5300 2110 for 1110", "1.2>2.1");
}

static void test_the_lowest_terminal_profile_is_served_first(void)
{
    expect_of("D1 out 1 5000 2110; D2 in 1 5300 2110 for 1220, in 2 5300 2110 for 1210", "1.1>2.2");
    expect_of("D1 out 1 5000 2110; D2 in 1 5300 2110, in 2 5300 2120 for 1210", "1.1>2.2");
    expect_of("D1 out 1 5000 2110; D2 in 1 5300 2110 for 2200, in 2 5300 2120", "1.1>2.2");
    expect_of("D1 out 1 5000 2110; D3 in 1 5300 2110; D2 in 1 5300 2110", "1.1>2.1");
}

static void test_sole_access(void)
{
    expect_of("D1 out 1 5000 1110; D2 in 1 5300 1110, in 2 5300 1120", "1.1>2.1");
    expect_of("D1 out 1 5000 1110; D2 in 1 5300 1110, in 2 5100 1120", "1.1>2.1 1.1>2.2");
    expect_of("D1 out 1 5000 1110; D2 in 1 5100 1110, in 2 5300 1120, in 3 5300 1120", "1.1>2.1 1.1>2.2");
    expect_of("D1 out 1 5000 1110, out 2 5000 1200; D2 in 1 5300 1110, in 2 5300 1110", "1.1>2.1 1.2>2.2");
}

/* --- What a link requires and desires --- */

static void test_a_required_input_is_connected_too(void)
{
    const char *const chain = "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110";
    expect_of(chain, "");
    systems_add(&s, "D3 out 1 5000 2120");
    expect("3.1>1.2 1.1>2.1");
}

static void test_the_next_candidate_is_tried_when_a_required_input_gets_nothing(void)
{
    expect_of("D1 out 1 5000 1110 req 2, in 2 5200 2110, out 3 5000 1120; D2 in 1 5300 1110", "1.3>2.1");
}

/* [PROFILE 4.2.4]: two channels that open and close a hand. */
static void test_inputs_that_require_each_other(void)
{
    const char *const hand =
        "D1 out 1 5000 2110; D2 in 1 5300 2110 req 2 for 1110, in 2 5300 2110 req 1 for 1120";
    expect_of(hand, "");
    systems_add(&s, "D3 out 1 5000 2120");
    expect("1.1>2.1 3.1>2.2");
    lose(3);
    expect("");
    back(3);
    expect("1.1>2.1 3.1>2.2");
}

static void test_a_desired_input_is_connected_if_it_can_be(void)
{
    const char *const control =
        "D1 out 1 5000 1110 des 2, in 2 5200 2110; D2 in 1 5300 1110 des 2, in 2 5200 2200";
    expect_of(control, "1.1>2.1");
    expect_of(
        "D1 out 1 5000 1110 des 2, in 2 5200 2110; D2 in 1 5300 1110 des 2, in 2 5200 2200; D3 out 1 5000 "
        "2100",
        "3.1>1.2 1.1>2.1");
    expect_of(
        "D1 out 1 5000 1110 des 2, in 2 5200 2110; D2 in 1 5300 1110 des 2, in 2 5200 2200;"
        "D3 out 1 5000 2100, out 2 5000 2100",
        "3.1>1.2 1.1>2.1 3.2>2.2");
}

static void test_required_inputs_come_before_desired_ones(void)
{
    expect_of(
        "D1 out 1 5000 1110 req 3 des 2, in 2 5200 2110, in 3 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 "
        "2110",
        "3.1>1.3 1.1>2.1");
}

/* A motor's encoder feeds the control that drives the motor. */
static void test_feedback_ends(void)
{
    expect_of("D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110 req 1, out 2 5000 2110 req 1",
              "2.2>1.2 1.1>2.1");
    expect_of("D1 out 1 5000 1110 req 2, in 2 5200 1110; D2 out 1 5000 1110 req 2, in 2 5300 1110",
              "2.1>1.2 1.1>2.2");
}

static void test_a_failed_link_leaves_nothing(void)
{
    expect_of(
        "D1 out 1 5000 1110 req 2 3 4, in 2 5200 2110, in 3 5200 2110, in 4 5200 3110; D2 in 1 5300 1110;"
        "D3 out 1 5000 2110, out 2 5000 2120",
        "");
    /* and what it had taken is free again */
    expect_of(
        "D1 out 1 5000 1110 req 2 3, in 2 5200 2110, in 3 5200 3110, out 4 5000 1120 req 5, in 5 5200 2110;"
        "D2 in 1 5300 1110; D3 out 1 5000 2110",
        "3.1>1.5 1.4>2.1");
}

static uint8_t count_links(void)
{
    uint8_t count = 0;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        count = (uint8_t)(count + (s.plan.want[i] != PDCP_NONE ? 1 : 0));
    }
    return count;
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
    systems_set_up(&s, systems_bind(&s, &device), &device);
}

/* A chain of so many inputs, eight a device. */
static void expect_chain(uint8_t length, bool linked)
{
    systems_init(&s);
    systems_add(&s, "D15 out 1 5000 2110");
    for (int n = 0; n < (length + 7) / 8; n++) {
        const bool last = 8 * (n + 1) >= length;
        add_link_of_chain((uint8_t)(n + 1), (uint8_t)(last ? length - 8 * n : 8), last);
    }
    systems_plan(&s, ALL);
    TEST_ASSERT_EQUAL_UINT8(linked ? length : 0, count_links());
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
    s.banned[s.banned_count].output = systems_channel(&s, output);
    s.banned[s.banned_count].input = systems_channel(&s, input);
    s.banned_count++;
}

static void test_a_banned_pair_leads_to_the_next_candidate(void)
{
    systems_add(&s, "D1 out 1 5000 1110, out 2 5000 1120, out 3 5000 1200; D2 in 1 5300 1110");
    expect("1.1>2.1");
    s.tables.channels[systems_channel(&s, "2.1")].link = PDCP_LINK_NONE;
    profile_links_init(&s.links);
    ban("1.1", "2.1");
    systems_plan(&s, ALL);
    TEST_ASSERT_EQUAL_UINT8(systems_channel(&s, "1.2"), s.plan.want[systems_channel(&s, "2.1")]);
    ban("1.2", "2.1");
    expect("1.3>2.1");
}

static void test_a_banned_original_is_not_brought_back(void)
{
    set_up("D1 out 1 5000 1110; D2 in 1 5300 1110; D3 out 1 5000 1200", "1.1>2.1");
    ban("1.1", "2.1");
    expect("3.1>2.1");
    s.banned_count = 0;
    expect("1.1>2.1");
}

/* Of a first control all but the last required input could be linked. */
static void test_what_a_failed_attempt_has_made_is_given_up(void)
{
    systems_add(&s,
                "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 out 1 5000 1120 req 2, in 2 5200 2110;"
                "D3 in 1 5300 1110; D4 out 1 5000 2110");
    systems_link(&s, "4.1>1.2");
    const uint8_t made = systems_channel(&s, "1.2");
    s.made[made / 8] = (uint8_t)(1u << (made % 8));
    ban("1.1", "3.1");
    systems_expect(&s, ALL, "4.1>2.2 2.1>3.1");
}

static void test_a_working_link_is_kept_in_spite_of_a_ban(void)
{
    run("D1 out 1 5000 1110, out 2 5000 1120; D2 in 1 5300 1110", "1.1>2.1");
    ban("1.1", "2.1");
    expect("1.1>2.1");
}

/* --- Originals and what stands in for them (D-PRO-6) --- */

static void test_an_original_replaces_an_output_that_stands_in(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2110; D3 out 1 5000 2120", "1.1>2.1");
    lose(1);
    expect("3.1>2.1");
    back(1);
    expect("1.1>2.1");
}

static void test_an_original_replaces_an_input_that_stands_in(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2110; D3 in 1 5000 2110", "1.1>2.1");
    lose(2);
    expect("1.1>3.1");
    TEST_ASSERT_EQUAL_UINT8(systems_channel(&s, "3.1"), s.links.entries[0].stand_in);
    TEST_ASSERT_EQUAL_UINT8(1, s.links.count); /* it is not part of the configuration */
    back(2);
    expect("1.1>2.1");
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE, s.links.entries[0].stand_in);
}

/* 2.2 comes back as what 2.1 requires. */
static void test_a_stand_in_goes_whatever_has_brought_the_original_back(void)
{
    run("D1 out 1 5000 2110, out 2 5000 2120; D2 in 1 5000 2110 req 2, in 2 5000 2120; D3 in 1 5000 2120",
        "1.1>2.1 1.2>2.2");
    lose(2);
    expect("1.2>3.1");
    back(2);
    expect("1.1>2.1 1.2>2.2");
}

/* The output of a stand-in is wanted back by another input, with sole access. */
static void test_a_stand_in_gives_up_its_sole_access(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2120; D3 out 1 5000 2120; D4 in 1 5200 2110", "3.1>2.1 1.1>4.1");
    lose(2);
    expect("1.1>4.1");
    lose(1);
    expect("3.1>4.1");
    back(2);
    expect("3.1>2.1");
    back(1);
    expect("3.1>2.1 1.1>4.1");
}

static void test_a_replacement_that_fits_less_well_is_kept_until_the_original_comes(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2110; D3 out 1 5000 2200", "1.1>2.1");
    lose(1);
    expect("3.1>2.1");
    systems_add(&s, "D4 out 1 5000 2110");
    expect("3.1>2.1");
    back(1);
    expect("1.1>2.1");
}

/* An original that would not hold takes nothing away: its output requires an input that nobody feeds. */
static void test_an_original_that_cannot_hold_replaces_nothing(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2110, in 2 5000 2110; D3 out 1 5000 2120", "1.1>2.1");
    forget(1);
    expect("3.1>2.1");
    systems_add(&s, "D1 out 1 5000 2110 req 2, in 2 5200 3110");
    expect("3.1>2.1");
}

/* 2.2 requires 2.1, and both have the same source in the configuration: only one of them can have it. */
static void test_an_original_that_cannot_hold_is_in_nobodys_way(void)
{
    set_up("D1 out 1 5000 2110; D2 in 1 5300 1110, in 2 5200 1100 req 1", "1.1>2.1 1.1>2.2");
    expect("1.1>2.1");
}

/* 2.1 requires 2.2, which has taken its source. */
static void test_an_original_does_not_take_what_it_needs(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2110 req 2, in 2 5200 2110; D3 out 1 5000 2120", "1.1>2.1 3.1>2.2");
    lose(3);
    expect("1.1>2.2");
    back(3);
    expect("1.1>2.1 3.1>2.2");
}

/* 2.2 requires 2.1, which has the source that 5.1 had: a working original is not given up for
 * another one (D-PRO-24). */
static void test_an_original_does_not_cost_another_one(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2110, in 2 5200 1110 req 1; D3 out 1 5000 1110; D4 out 1 5000 2120;"
        "D5 in 1 5200 2200",
        "4.1>2.1 3.1>2.2 1.1>5.1");
    lose(5);
    lose(4);
    expect("1.1>2.1 3.1>2.2");
    back(5);
    expect("1.1>2.1 3.1>2.2");
    back(4);
    expect("4.1>2.1 3.1>2.2 1.1>5.1");
}

/* A control is replaced by another one: what its outputs require is connected with them, and stands in as
 * well. */
static void test_what_a_replacement_requires_stands_in_too(void)
{
    systems_add(&s, systems_acceptance(2));
    expect(as_2);
    lose(2);
    systems_add(&s,
                "D5 2:2:9 in 1 7200 2200, in 2 5200 2110, out 3 5000 1100 req 2, out 4 5000 1210 req 1,"
                "out 5 7000 1220 req 2");
    expect("5.3>3.1 5.5>3.2 1.1>5.2");
    back(2);
    expect(as_2);
}

/* 2.2 is found by autoconfiguration only after 2.1 has lost what its source requires; but it is like the
 * missing 5.1, so it is 2.1 that has the output in the end. */
static void test_a_stand_in_that_was_found_by_chance_gives_way_at_once(void)
{
    set_up(
        "D1 out 1 5000 1110 req 2, in 2 5100 2110; D2 in 1 5200 1200, in 2 5300 1110; D3 out 1 5000 3110;"
        "D4 out 1 5000 2110; D5 in 1 5300 1110",
        "3.1>1.2 1.1>2.1 1.1>5.1");
    lose(5);
    expect("3.1>1.2 1.1>2.1");
    lose(3);
    expect("4.1>1.2 1.1>2.1");
}

/* What stands in for 3.1 is required by what the original requires. */
static void test_an_original_does_not_pull_away_what_it_needs(void)
{
    set_up(
        "D1 out 1 5000 2110 req 2, in 2 5000 1100; D2 out 1 5000 1120 req 2, in 2 5000 2120; D3 in 1 5000 "
        "1120",
        "2.1>3.1 1.1>2.2");
    lose(3);
    expect("2.1>1.2 1.1>2.2");
    back(3);
    expect("2.1>1.2 1.1>2.2");
}

/* A stand-in ends when its output gets another source of its own: the next one is looked for in the same
 * plan. */
static void test_a_stand_in_that_is_wanted_elsewhere_is_replaced_at_once(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5000 2110; D3 in 1 5000 2120, in 2 5000 2200; D4 out 1 5000 2200",
        "1.1>2.1 4.1>3.1");
    lose(4);
    lose(2);
    expect("1.1>3.1");
    back(4);
    expect("4.1>3.1 1.1>3.2");
}

/* --- What is required follows the configuration (D-PRO-9) --- */

static void test_a_required_input_is_connected_by_the_configuration(void)
{
    const char *const parts =
        "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110;"
        "D4 out 1 5000 2200";
    set_up(parts, "4.1>1.2");
    expect("4.1>1.2 1.1>2.1");
    expect_of(parts, "3.1>1.2 1.1>2.1");
}

/* 4.1 could not be linked before: it requires an input itself, for which a search is due. */
static void test_a_required_input_has_its_original_with_all_that_it_needs(void)
{
    set_up(
        "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110;"
        "D4 out 1 5000 2200 req 2, in 2 5200 2120; D5 out 1 5000 2120",
        "4.1>1.2");
    expect("4.1>1.2 1.1>2.1 5.1>4.2");
}

/* Listing 4.3: what is not terminal is just connected, and rests while it lacks something. */
static void test_nothing_is_searched_for_an_original_that_is_not_terminal(void)
{
    set_up("D1 out 1 5000 2110 req 2, in 2 5200 2110; D2 in 1 5200 2110; D3 out 1 5000 2110", "1.1>2.1");
    expect("");
    systems_configure(&s, "3.1>1.2", false);
    expect("3.1>1.2 1.1>2.1");
}

static void test_originals_that_are_not_terminal_come_first(void)
{
    set_up("D1 out 1 5000 2110; D2 in 1 5300 1110, in 2 5200 1200", "1.1>2.1 1.1>2.2");
    expect("1.1>2.2");
}

/* 3.1 is more like the input, 5.1 more like the missing source. */
static void test_a_missing_source_is_replaced_by_likeness_to_it(void)
{
    set_up(
        "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110; D4 out 1 5000 2200;"
        "D5 out 1 5000 2220",
        "4.1>1.2");
    forget(4);
    expect("5.1>1.2 1.1>2.1");
}

static void test_links_rest_while_what_they_require_is_missing(void)
{
    run("D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110", "3.1>1.2 1.1>2.1");
    lose(3);
    expect("");
    TEST_ASSERT_EQUAL_UINT8(PDCP_LINK_INACTIVE, s.tables.channels[systems_channel(&s, "2.1")].link);
    systems_add(&s, "D4 out 1 5000 2200");
    expect("4.1>1.2 1.1>2.1");
}

static void test_links_by_the_host_are_left_alone(void)
{
    systems_add(&s, "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5200 1110; D3 out 1 5000 2110");
    systems_configure(&s, "3.1>1.2 1.1>2.1", true);
    systems_link(&s, "3.1>1.2 1.1>2.1");
    expect("3.1>1.2 1.1>2.1");
    lose(3);
    expect("1.1>2.1");
    lose(1);
    expect("");
    back(1);
    expect("1.1>2.1");
}

/* --- Parts that come and go --- */

static void test_parts_that_come_later_take_nothing(void)
{
    expect_of("D1 out 1 5000 1200; D2 in 1 5300 1120", "1.1>2.1");
    systems_add(&s, "D3 in 1 5300 1110; D4 out 1 5000 1120");
    expect("1.1>2.1 4.1>3.1");
    systems_add(&s, "D5 1:1:1 out 1 5000 1120; D6 1:1:2 in 1 5300 1000");
    expect("1.1>2.1 4.1>3.1 5.1>6.1");
}

/* 2.1 and 3.1 lose their sources; 5.1 is all there is. It is most like the end of 3.1, although 2.1 comes
 * first. */
static void test_replacements_are_made_in_order_of_similarity(void)
{
    run("D1 out 1 5000 2110, out 2 5000 2120; D2 in 1 5200 2110; D3 in 1 5200 2220", "1.1>2.1 1.2>3.1");
    lose(1);
    systems_add(&s, "D5 out 1 5000 2220");
    expect("5.1>3.1");
}

/* D-PRO-10. */
static void test_a_replacement_is_most_like_the_missing_channel(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2200; D3 out 1 5000 2200, out 2 5000 2120", "1.1>2.1");
    lose(1);
    expect("3.2>2.1");
    systems_init(&s);
    run("D1 out 1 5000 2110; D2 in 1 5200 2200; D3 in 1 5200 2110, in 2 5200 2220", "1.1>2.1");
    lose(2);
    expect("1.1>3.2");
}

static void test_an_input_that_is_configured_itself_does_not_stand_in(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2110; D3 in 1 5200 2110; D4 out 1 5000 2200", "1.1>2.1 4.1>3.1");
    lose(2);
    expect("4.1>3.1");
}

static void await(uint8_t name)
{
    const uint8_t place = systems_place(&s, name);
    lose(name);
    s.awaited[place / 8] = (uint8_t)(1u << (place % 8));
}

static void test_awaited_devices_are_not_replaced(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5300 2110; D3 out 1 5000 2120; D4 in 1 5200 2110", "1.1>2.1");
    await(1);
    expect("");
    back(1);
    expect("1.1>2.1");
    lose(1);
    memset(s.awaited, 0, sizeof s.awaited);
    expect("3.1>2.1");
}

static void test_an_awaited_input_is_not_replaced(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2110; D4 in 1 5200 2110", "1.1>2.1");
    await(2);
    expect("");
    memset(s.awaited, 0, sizeof s.awaited);
    expect("1.1>4.1");
}

/* D-PRO-13. */
static void test_an_awaited_source_is_not_replaced_for_what_requires_it(void)
{
    set_up(
        "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110; D4 out 1 5000 2120",
        "3.1>1.2");
    await(3);
    expect("");
    back(3);
    expect("3.1>1.2 1.1>2.1");
}

static void test_a_configured_input_does_not_stand_in_while_a_device_is_awaited(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5200 2110; D3 in 1 5200 2110; D4 out 1 5000 3110; D5 out 1 5000 1110;"
        "D6 in 1 5200 1110",
        "1.1>2.1 4.1>3.1 5.1>6.1");
    lose(2);
    lose(4);
    await(5);
    expect("");
    memset(s.awaited, 0, sizeof s.awaited);
    expect("1.1>3.1");
}

/* Its own source is gone for good, but the limb is not whole for another reason: it may become so. */
static void test_a_configured_terminal_channel_is_not_autoconfigured_while_a_device_is_awaited(void)
{
    run("D1 out 1 5000 2110; D2 in 1 5300 1110; D3 out 1 5000 1200; D4 out 1 5000 2120; D5 in 1 5200 2110",
        "1.1>2.1 4.1>5.1");
    forget(1);
    await(4);
    expect("");
    back(4);
    expect("3.1>2.1 4.1>5.1");
}

static void test_a_device_that_is_being_set_up_is_awaited(void)
{
    set_up("D1 out 1 5000 2110; D2 in 1 5300 2110; D3 out 1 5000 2120", "1.1>2.1");
    const profile_scene_t scene = systems_scene(&s);
    pdcp_device_entry_t *device = &s.tables.devices[systems_place(&s, 1)];
    TEST_ASSERT_FALSE(profile_scene_is_awaited(&scene, &s.links.entries[0].output));
    device->state = PDCP_PLACE_SETUP;
    TEST_ASSERT_TRUE(profile_scene_is_awaited(&scene, &s.links.entries[0].output));
    expect("");
    device->setup_again = true; /* it has failed before (D-BUS-17) */
    TEST_ASSERT_FALSE(profile_scene_is_awaited(&scene, &s.links.entries[0].output));
    expect("3.1>2.1");
    forget(1);
    TEST_ASSERT_FALSE(profile_scene_is_awaited(&scene, &s.links.entries[0].output));
}

/* --- What is asked for --- */

static void test_only_what_is_asked_for_is_planned(void)
{
    const char *const parts =
        "D1 out 1 5000 2110; D2 in 1 5200 2110; D3 out 1 5000 2120; D4 in 1 5200 2120;"
        "D5 in 1 5300 2110; D6 out 1 5000 2200";
    set_up(parts, "1.1>2.1 3.1>4.1");
    forget(3);
    systems_plan(&s, 0);
    char text[SYSTEMS_TEXT];
    systems_planned(&s, text);
    TEST_ASSERT_EQUAL_STRING("", text);
    systems_expect(&s, PROFILE_PLAN_ORIGINALS, "1.1>2.1");
    systems_expect(&s, PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_REPLACE, "1.1>2.1 6.1>4.1");
    systems_add(&s, "D7 out 1 5000 2000");
    systems_expect(&s, PROFILE_PLAN_AUTO, "1.1>2.1 6.1>4.1 7.1>5.1");
}

/* --- Sole access enforced --- */

static void enforce(const char *links)
{
    char text[SYSTEMS_TEXT];
    for (uint8_t i = 0; i < 2; i++) {
        systems_plan(&s, PROFILE_PLAN_ENFORCE);
        systems_planned(&s, text);
        TEST_ASSERT_EQUAL_STRING(links, text);
        systems_execute(&s);
    }
}

static void test_enforce_keeps_the_lowest_profile(void)
{
    const char *const links = "1.1>2.1 1.1>2.2 1.1>2.3 1.1>2.4";
    set_up("D1 out 1 5000 2110; D2 in 1 5200 2200, in 2 5200 2110, in 3 5200 2120, in 4 5000 2100", links);
    systems_link(&s, links);
    enforce("1.1>2.2 1.1>2.4");
    TEST_ASSERT_EQUAL_UINT8(2, s.links.count);
    expect("1.1>2.2 1.1>2.4");
}

static void test_enforce_takes_what_then_lacks_something(void)
{
    const char *const links = "1.1>2.1 2.3>3.1 1.1>3.2";
    set_up(
        "D1 out 1 5000 2110; D2 in 1 5200 2200, in 2 5000 2110, out 3 5000 1110 req 1;"
        "D3 in 1 5200 1110, in 2 5200 2110",
        links);
    systems_link(&s, links);
    enforce("1.1>3.2");
}

static void test_a_second_sole_access_input_breaks_sole_access(void)
{
    systems_add(&s, "D1 out 1 5000 2110, out 2 5000 2110; D2 in 1 5200 2110, in 2 5200 2110, in 3 5000 2110");
    const uint8_t output = systems_channel(&s, "1.1");
    systems_link(&s, "1.1>2.1 1.2>2.3");
    TEST_ASSERT_TRUE(profile_channel_breaks_sole_access(&s.tables, output, systems_channel(&s, "2.2")));
    TEST_ASSERT_FALSE(profile_channel_breaks_sole_access(&s.tables, output, systems_channel(&s, "2.1")));
    TEST_ASSERT_FALSE(profile_channel_breaks_sole_access(&s.tables, output, systems_channel(&s, "2.3")));
    TEST_ASSERT_FALSE(profile_channel_breaks_sole_access(&s.tables, systems_channel(&s, "1.2"),
                                                         systems_channel(&s, "2.2")));
    s.tables.channels[systems_channel(&s, "2.1")].link = PDCP_LINK_INACTIVE;
    TEST_ASSERT_FALSE(profile_channel_breaks_sole_access(&s.tables, output, systems_channel(&s, "2.2")));
}

/* --- Growth --- */

/* A device with `half` terminal inputs and then as many outputs. Output n requires inputs n and n + 1. */
static void add_symmetric(uint8_t number, uint8_t half)
{
    systems_device_t device;
    memset(&device, 0, sizeof device);
    device.identity.sn = number;
    device.name = SYSTEMS_NAMES;
    device.count = (uint8_t)(2 * half);
    for (uint8_t i = 0; i < half; i++) {
        systems_channel_t *input = &device.channels[i];
        systems_channel_t *output = &device.channels[half + i];
        input->transfer = PDCP_INPUT;
        input->type = 0x5300;
        input->profile = (uint16_t)(0x1000u + 0x100u * (1u + number % 3u) + 0x10u * (i % 4u));
        output->transfer = PDCP_OUTPUT;
        output->type = 0x5000;
        output->profile = (uint16_t)(0x1000u + 0x100u * (1u + (number + 1u) % 3u) + 0x10u * (i % 5u));
        output->required = (uint32_t)3 << (i + 1) & (((uint32_t)1 << (half + 1)) - 1u);
    }
    systems_set_up(&s, systems_bind(&s, &device), &device);
}

static void plan_symmetric(uint8_t channels, uint8_t half)
{
    systems_init(&s);
    s.slice = PROFILE_PLAN_SLICE;
    for (int n = 0; n < channels / 2 / half; n++) {
        add_symmetric((uint8_t)(n + 1), half);
    }
    systems_plan(&s, ALL);
    printf("%3u channels, %2u a device: %5lu steps, %2u links\n", channels, 2u * half,
           (unsigned long)s.plan.steps, count_links());
}

static void test_steps_grow_with_the_channels(void)
{
    static const uint8_t sizes[] = {8, 32, 64, 128};
    for (uint8_t half = 2; half <= 8; half = (uint8_t)(half * 2)) {
        for (unsigned i = 0; i < sizeof sizes; i++) {
            plan_symmetric(sizes[i], half);
            TEST_ASSERT_LESS_OR_EQUAL_UINT32(PROFILE_PLAN_STEPS, s.plan.steps);
            TEST_ASSERT_LESS_OR_EQUAL_INT16(PROFILE_PLAN_UNIT, s.beyond);
        }
    }
}

/* Every output requires all inputs of its device, all have sole access, and there is one output too few:
 * nothing can hold, whatever is tried. Behind them all comes a simple pair. */
static void add_hopeless(uint8_t number, uint8_t half)
{
    systems_device_t device;
    memset(&device, 0, sizeof device);
    device.identity.sn = number;
    device.name = SYSTEMS_NAMES;
    device.count = (uint8_t)(2 * half - (number == 1 ? 1 : 0));
    for (uint8_t i = 0; i < device.count; i++) {
        systems_channel_t *channel = &device.channels[i];
        channel->transfer = i < half ? PDCP_INPUT : PDCP_OUTPUT;
        channel->type = i < half ? 0x5300 : 0x5000;
        channel->profile = (uint16_t)(0x1000u + 0x100u * (i % 2u) + 0x10u * (number % 4u));
        channel->required = i < half ? 0 : (((uint32_t)1 << half) - 1u) << 1;
    }
    systems_set_up(&s, systems_bind(&s, &device), &device);
}

static void plan_hopeless(uint8_t devices)
{
    systems_init(&s);
    for (uint8_t n = 1; n <= devices; n++) {
        add_hopeless(n, 8);
    }
    systems_add(&s, "D1 9:9:9 out 1 5000 2110; D2 9:9:10 in 1 5300 2110");
    systems_plan(&s, ALL);
    printf("%u inputs that cannot hold: %lu steps\n", 8u * devices, (unsigned long)s.plan.steps);
}

static void test_a_hopeless_search_ends(void)
{
    plan_hopeless(7);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(PROFILE_PLAN_STEPS, s.plan.steps);
}

static void test_a_hopeless_search_leaves_steps_for_the_rest(void)
{
    plan_hopeless(4);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(PROFILE_PLAN_STEPS, s.plan.steps);
    TEST_ASSERT_EQUAL_UINT8(1, count_links());
    TEST_ASSERT_EQUAL_UINT8(systems_channel(&s, "1.1"), s.plan.want[systems_channel(&s, "2.1")]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_system_1_at_power_on);
    RUN_TEST(test_system_1_as_hot_swap);
    RUN_TEST(test_system_2_at_power_on);
    RUN_TEST(test_system_2_as_hot_swap);
    RUN_TEST(test_system_2_without_one_of_its_parts);
    RUN_TEST(test_system_3_at_power_on);
    RUN_TEST(test_system_3_as_hot_swap);
    RUN_TEST(test_system_4_at_power_on);
    RUN_TEST(test_system_4_as_hot_swap);
    RUN_TEST(test_system_5_at_power_on);
    RUN_TEST(test_system_5_as_hot_swap);
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
    RUN_TEST(test_an_original_replaces_an_output_that_stands_in);
    RUN_TEST(test_an_original_replaces_an_input_that_stands_in);
    RUN_TEST(test_a_stand_in_goes_whatever_has_brought_the_original_back);
    RUN_TEST(test_a_stand_in_gives_up_its_sole_access);
    RUN_TEST(test_a_replacement_that_fits_less_well_is_kept_until_the_original_comes);
    RUN_TEST(test_an_original_that_cannot_hold_replaces_nothing);
    RUN_TEST(test_an_original_that_cannot_hold_is_in_nobodys_way);
    RUN_TEST(test_an_original_does_not_take_what_it_needs);
    RUN_TEST(test_an_original_does_not_cost_another_one);
    RUN_TEST(test_what_a_replacement_requires_stands_in_too);
    RUN_TEST(test_a_stand_in_that_was_found_by_chance_gives_way_at_once);
    RUN_TEST(test_an_original_does_not_pull_away_what_it_needs);
    RUN_TEST(test_a_stand_in_that_is_wanted_elsewhere_is_replaced_at_once);
    RUN_TEST(test_a_required_input_is_connected_by_the_configuration);
    RUN_TEST(test_a_required_input_has_its_original_with_all_that_it_needs);
    RUN_TEST(test_nothing_is_searched_for_an_original_that_is_not_terminal);
    RUN_TEST(test_originals_that_are_not_terminal_come_first);
    RUN_TEST(test_a_missing_source_is_replaced_by_likeness_to_it);
    RUN_TEST(test_links_rest_while_what_they_require_is_missing);
    RUN_TEST(test_links_by_the_host_are_left_alone);
    RUN_TEST(test_parts_that_come_later_take_nothing);
    RUN_TEST(test_replacements_are_made_in_order_of_similarity);
    RUN_TEST(test_a_replacement_is_most_like_the_missing_channel);
    RUN_TEST(test_an_input_that_is_configured_itself_does_not_stand_in);
    RUN_TEST(test_awaited_devices_are_not_replaced);
    RUN_TEST(test_an_awaited_input_is_not_replaced);
    RUN_TEST(test_an_awaited_source_is_not_replaced_for_what_requires_it);
    RUN_TEST(test_a_configured_input_does_not_stand_in_while_a_device_is_awaited);
    RUN_TEST(test_a_configured_terminal_channel_is_not_autoconfigured_while_a_device_is_awaited);
    RUN_TEST(test_a_device_that_is_being_set_up_is_awaited);
    RUN_TEST(test_only_what_is_asked_for_is_planned);
    RUN_TEST(test_enforce_keeps_the_lowest_profile);
    RUN_TEST(test_enforce_takes_what_then_lacks_something);
    RUN_TEST(test_a_second_sole_access_input_breaks_sole_access);
    RUN_TEST(test_steps_grow_with_the_channels);
    RUN_TEST(test_a_hopeless_search_ends);
    RUN_TEST(test_a_hopeless_search_leaves_steps_for_the_rest);
    return UNITY_END();
}
