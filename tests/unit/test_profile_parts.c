/* Parts that come and go, and parts that are awaited (profile-layer.md 4, D-PRO-10, D-PRO-13). */
#include <string.h>

#include "plan.h"
#include "unity.h"

void setUp(void)
{
    systems_init(&plan_limb);
}

void tearDown(void) {}

static void test_parts_that_come_later_take_nothing(void)
{
    plan_expect_of("D1 out 1 5000 1200; D2 in 1 5300 1120", "1.1>2.1");
    systems_add(&plan_limb, "D3 in 1 5300 1110; D4 out 1 5000 1120");
    plan_expect("1.1>2.1 4.1>3.1");
    systems_add(&plan_limb, "D5 1:1:1 out 1 5000 1120; D6 1:1:2 in 1 5300 1000");
    plan_expect("1.1>2.1 4.1>3.1 5.1>6.1");
}

/* 2.1 and 3.1 lose their sources; 5.1 is all there is. It is most like the end of 3.1, although 2.1 comes
 * first. */
static void test_replacements_are_made_in_order_of_similarity(void)
{
    plan_run("D1 out 1 5000 2110, out 2 5000 2120; D2 in 1 5200 2110; D3 in 1 5200 2220", "1.1>2.1 1.2>3.1");
    plan_lose(1);
    systems_add(&plan_limb, "D5 out 1 5000 2220");
    plan_expect("5.1>3.1");
}

/* D-PRO-10. */
static void test_a_replacement_is_most_like_the_missing_channel(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2200; D3 out 1 5000 2200, out 2 5000 2120", "1.1>2.1");
    plan_lose(1);
    plan_expect("3.2>2.1");
    systems_init(&plan_limb);
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2200; D3 in 1 5200 2110, in 2 5200 2220", "1.1>2.1");
    plan_lose(2);
    plan_expect("1.1>3.2");
}

static void test_an_input_that_is_configured_itself_does_not_stand_in(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2110; D3 in 1 5200 2110; D4 out 1 5000 2200",
             "1.1>2.1 4.1>3.1");
    plan_lose(2);
    plan_expect("4.1>3.1");
}

static void await(uint8_t name)
{
    const uint8_t place = systems_place(&plan_limb, name);
    plan_lose(name);
    plan_limb.awaited[place / 8] = (uint8_t)(1u << (place % 8));
}

static void test_awaited_devices_are_not_replaced(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5300 2110; D3 out 1 5000 2120; D4 in 1 5200 2110", "1.1>2.1");
    await(1);
    plan_expect("");
    plan_back(1);
    plan_expect("1.1>2.1");
    plan_lose(1);
    memset(plan_limb.awaited, 0, sizeof plan_limb.awaited);
    plan_expect("3.1>2.1");
}

static void test_an_awaited_input_is_not_replaced(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2110; D4 in 1 5200 2110", "1.1>2.1");
    await(2);
    plan_expect("");
    memset(plan_limb.awaited, 0, sizeof plan_limb.awaited);
    plan_expect("1.1>4.1");
}

/* D-PRO-13. */
static void test_an_awaited_source_is_not_replaced_for_what_requires_it(void)
{
    plan_set_up(
        "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110; D4 out 1 5000 2120",
        "3.1>1.2");
    await(3);
    plan_expect("");
    plan_back(3);
    plan_expect("3.1>1.2 1.1>2.1");
}

static void test_a_configured_input_does_not_stand_in_while_a_device_is_awaited(void)
{
    plan_run(
        "D1 out 1 5000 2110; D2 in 1 5200 2110; D3 in 1 5200 2110; D4 out 1 5000 3110; D5 out 1 5000 1110;"
        "D6 in 1 5200 1110",
        "1.1>2.1 4.1>3.1 5.1>6.1");
    plan_lose(2);
    plan_lose(4);
    await(5);
    plan_expect("");
    memset(plan_limb.awaited, 0, sizeof plan_limb.awaited);
    plan_expect("1.1>3.1");
}

/* Its own source is gone for good, but the limb is not whole for another reason: it may become so. */
static void test_a_configured_terminal_channel_is_not_autoconfigured_while_a_device_is_awaited(void)
{
    plan_run(
        "D1 out 1 5000 2110; D2 in 1 5300 1110; D3 out 1 5000 1200; D4 out 1 5000 2120; D5 in 1 5200 2110",
        "1.1>2.1 4.1>5.1");
    plan_forget(1);
    await(4);
    plan_expect("");
    plan_back(4);
    plan_expect("3.1>2.1 4.1>5.1");
}

static void test_a_device_that_is_being_set_up_is_awaited(void)
{
    plan_set_up("D1 out 1 5000 2110; D2 in 1 5300 2110; D3 out 1 5000 2120", "1.1>2.1");
    const profile_scene_t scene = systems_scene(&plan_limb);
    pdcp_device_entry_t *device = &plan_limb.tables.devices[systems_place(&plan_limb, 1)];
    TEST_ASSERT_FALSE(profile_scene_is_awaited(&scene, &plan_limb.links.entries[0].output));
    device->state = PDCP_PLACE_SETUP;
    TEST_ASSERT_TRUE(profile_scene_is_awaited(&scene, &plan_limb.links.entries[0].output));
    plan_expect("");
    device->setup_again = true; /* it has failed before (D-BUS-17) */
    TEST_ASSERT_FALSE(profile_scene_is_awaited(&scene, &plan_limb.links.entries[0].output));
    plan_expect("3.1>2.1");
    plan_forget(1);
    TEST_ASSERT_FALSE(profile_scene_is_awaited(&scene, &plan_limb.links.entries[0].output));
}

int main(void)
{
    UNITY_BEGIN();
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
    return UNITY_END();
}
