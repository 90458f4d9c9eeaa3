/* What is asked of the planner, sole access enforced, and how the planner's work grows (profile-layer.md
 * 4). */
#include <stdio.h>
#include <string.h>

#include "plan.h"
#include "profile_channel.h"
#include "unity.h"

void setUp(void)
{
    systems_init(&plan_limb);
}

void tearDown(void) {}

/* --- What is asked for --- */

static void test_only_what_is_asked_for_is_planned(void)
{
    const char *const parts =
        "D1 out 1 5000 2110; D2 in 1 5200 2110; D3 out 1 5000 2120; D4 in 1 5200 2120;"
        "D5 in 1 5300 2110; D6 out 1 5000 2200";
    plan_set_up(parts, "1.1>2.1 3.1>4.1");
    plan_forget(3);
    systems_plan(&plan_limb, 0);
    char text[SYSTEMS_TEXT];
    systems_planned(&plan_limb, text);
    TEST_ASSERT_EQUAL_STRING("", text);
    systems_expect(&plan_limb, PROFILE_PLAN_ORIGINALS, "1.1>2.1");
    systems_expect(&plan_limb, PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_REPLACE, "1.1>2.1 6.1>4.1");
    systems_add(&plan_limb, "D7 out 1 5000 2000");
    systems_expect(&plan_limb, PROFILE_PLAN_AUTO, "1.1>2.1 6.1>4.1 7.1>5.1");
}

/* --- Sole access enforced --- */

static void enforce(const char *links)
{
    char text[SYSTEMS_TEXT];
    for (uint8_t i = 0; i < 2; i++) {
        systems_plan(&plan_limb, PROFILE_PLAN_ENFORCE);
        systems_planned(&plan_limb, text);
        TEST_ASSERT_EQUAL_STRING(links, text);
        systems_execute(&plan_limb);
    }
}

static void test_enforce_keeps_the_lowest_profile(void)
{
    const char *const links = "1.1>2.1 1.1>2.2 1.1>2.3 1.1>2.4";
    plan_set_up("D1 out 1 5000 2110; D2 in 1 5200 2200, in 2 5200 2110, in 3 5200 2120, in 4 5000 2100",
                links);
    systems_link(&plan_limb, links);
    enforce("1.1>2.2 1.1>2.4");
    TEST_ASSERT_EQUAL_UINT8(2, plan_limb.links.count);
    plan_expect("1.1>2.2 1.1>2.4");
}

static void test_enforce_takes_what_then_lacks_something(void)
{
    const char *const links = "1.1>2.1 2.3>3.1 1.1>3.2";
    plan_set_up(
        "D1 out 1 5000 2110; D2 in 1 5200 2200, in 2 5000 2110, out 3 5000 1110 req 1;"
        "D3 in 1 5200 1110, in 2 5200 2110",
        links);
    systems_link(&plan_limb, links);
    enforce("1.1>3.2");
}

static void test_a_second_sole_access_input_breaks_sole_access(void)
{
    systems_add(&plan_limb,
                "D1 out 1 5000 2110, out 2 5000 2110; D2 in 1 5200 2110, in 2 5200 2110, in 3 5000 2110");
    const uint8_t output = systems_channel(&plan_limb, "1.1");
    systems_link(&plan_limb, "1.1>2.1 1.2>2.3");
    TEST_ASSERT_TRUE(
        profile_channel_breaks_sole_access(&plan_limb.tables, output, systems_channel(&plan_limb, "2.2")));
    TEST_ASSERT_FALSE(
        profile_channel_breaks_sole_access(&plan_limb.tables, output, systems_channel(&plan_limb, "2.1")));
    TEST_ASSERT_FALSE(
        profile_channel_breaks_sole_access(&plan_limb.tables, output, systems_channel(&plan_limb, "2.3")));
    TEST_ASSERT_FALSE(profile_channel_breaks_sole_access(
        &plan_limb.tables, systems_channel(&plan_limb, "1.2"), systems_channel(&plan_limb, "2.2")));
    plan_limb.tables.channels[systems_channel(&plan_limb, "2.1")].link = PDCP_LINK_INACTIVE;
    TEST_ASSERT_FALSE(
        profile_channel_breaks_sole_access(&plan_limb.tables, output, systems_channel(&plan_limb, "2.2")));
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
    systems_set_up(&plan_limb, systems_bind(&plan_limb, &device), &device);
}

static void plan_symmetric(uint8_t channels, uint8_t half)
{
    systems_init(&plan_limb);
    plan_limb.slice = PROFILE_PLAN_SLICE;
    for (int n = 0; n < channels / 2 / half; n++) {
        add_symmetric((uint8_t)(n + 1), half);
    }
    systems_plan(&plan_limb, PROFILE_PLAN_ALL);
    printf("%3u channels, %2u a device: %5lu steps, %2u links\n", channels, 2u * half,
           (unsigned long)plan_limb.plan.steps, plan_count_links());
}

static void test_steps_grow_with_the_channels(void)
{
    static const uint8_t sizes[] = {8, 32, 64, 128};
    for (uint8_t half = 2; half <= 8; half = (uint8_t)(half * 2)) {
        for (unsigned i = 0; i < sizeof sizes; i++) {
            plan_symmetric(sizes[i], half);
            TEST_ASSERT_LESS_OR_EQUAL_UINT32(PROFILE_PLAN_STEPS, plan_limb.plan.steps);
            TEST_ASSERT_LESS_OR_EQUAL_INT16(PROFILE_PLAN_UNIT, plan_limb.beyond);
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
    systems_set_up(&plan_limb, systems_bind(&plan_limb, &device), &device);
}

static void plan_hopeless(uint8_t devices)
{
    systems_init(&plan_limb);
    for (uint8_t n = 1; n <= devices; n++) {
        add_hopeless(n, 8);
    }
    systems_add(&plan_limb, "D1 9:9:9 out 1 5000 2110; D2 9:9:10 in 1 5300 2110");
    systems_plan(&plan_limb, PROFILE_PLAN_ALL);
    printf("%u inputs that cannot hold: %lu steps\n", 8u * devices, (unsigned long)plan_limb.plan.steps);
}

static void test_a_hopeless_search_ends(void)
{
    plan_hopeless(7);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(PROFILE_PLAN_STEPS, plan_limb.plan.steps);
}

static void test_a_hopeless_search_leaves_steps_for_the_rest(void)
{
    plan_hopeless(4);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(PROFILE_PLAN_STEPS, plan_limb.plan.steps);
    TEST_ASSERT_EQUAL_UINT8(1, plan_count_links());
    TEST_ASSERT_EQUAL_UINT8(systems_channel(&plan_limb, "1.1"),
                            plan_limb.plan.want[systems_channel(&plan_limb, "2.1")]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_only_what_is_asked_for_is_planned);
    RUN_TEST(test_enforce_keeps_the_lowest_profile);
    RUN_TEST(test_enforce_takes_what_then_lacks_something);
    RUN_TEST(test_a_second_sole_access_input_breaks_sole_access);
    RUN_TEST(test_steps_grow_with_the_channels);
    RUN_TEST(test_a_hopeless_search_ends);
    RUN_TEST(test_a_hopeless_search_leaves_steps_for_the_rest);
    return UNITY_END();
}
