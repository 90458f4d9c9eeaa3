/* The five acceptance systems, planned on tables (profile-layer.md 6). */
#include "plan.h"
#include "profile_channel.h"
#include "unity.h"

static const char as_2[] = "1.1>2.2 2.3>3.1 2.5>3.2"; /* the links of system 2 */

void setUp(void)
{
    systems_init(&plan_limb);
}

void tearDown(void) {}

static void test_system_1_at_power_on(void)
{
    plan_set_up(systems_acceptance(1), "1.1>2.1");
    plan_forget(2);
    plan_expect("1.1>3.2");
}

static void test_system_1_as_hot_swap(void)
{
    plan_run("D1 2:2:4 out 1 5000 2110; D2 2:2:5 in 1 5200 2110", "1.1>2.1");
    plan_lose(2);
    plan_expect("");
    systems_add(&plan_limb, "D3 2:2:6 in 1 5200 2200, in 2 5200 2120");
    plan_expect("1.1>3.2");
    plan_back(2);
    plan_expect("1.1>2.1");
}

static void test_system_2_at_power_on(void)
{
    systems_add(&plan_limb, systems_acceptance(2));
    plan_expect(as_2);
}

static void come_in_order(uint8_t a, uint8_t b, uint8_t c)
{
    systems_init(&plan_limb);
    systems_add(&plan_limb, systems_acceptance(2));
    for (uint8_t i = 1; i <= 3; i++) {
        plan_lose(i);
    }
    plan_back(a);
    systems_plan(&plan_limb, PROFILE_PLAN_ALL);
    systems_execute(&plan_limb);
    plan_back(b);
    systems_plan(&plan_limb, PROFILE_PLAN_ALL);
    systems_execute(&plan_limb);
    plan_back(c);
    plan_expect(as_2);
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
        systems_init(&plan_limb);
        systems_add(&plan_limb, systems_acceptance(2));
        plan_expect(as_2);
        plan_lose(part);
        plan_expect(left[part - 1]);
        plan_back(part);
        plan_expect(as_2);
    }
}

static void test_system_3_at_power_on(void)
{
    plan_set_up(systems_acceptance(3), as_2);
    systems_expect(&plan_limb, PROFILE_PLAN_ORIGINALS, as_2);
}

static void test_system_3_as_hot_swap(void)
{
    plan_run(systems_acceptance(3), as_2);
    for (uint8_t i = 1; i <= 3; i++) {
        plan_lose(i);
        plan_expect(i == 3 ? "1.1>2.2" : "");
        plan_back(i);
        plan_expect(as_2);
    }
}

static void test_system_4_at_power_on(void)
{
    plan_set_up(systems_acceptance(4), "1.1>3.2");
    plan_forget(1);
    plan_expect("2.2>3.2");
}

static void test_system_4_as_hot_swap(void)
{
    plan_run("D1 2:2:4 out 1 5000 2110; D3 2:2:6 in 1 5200 2200, in 2 5200 2110", "1.1>3.2");
    plan_lose(1);
    plan_expect("");
    systems_add(&plan_limb, "D2 2:2:5 out 1 5000 2200, out 2 5000 2120");
    plan_expect("2.2>3.2");
    plan_back(1);
    plan_expect("1.1>3.2");
}

/* Only the sources that the inputs name are known. */
static void read_back(void)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        profile_link_t link;
        if (profile_channel_is_ready(&plan_limb.tables, i, PDCP_INPUT) &&
            profile_channel_named_source(&plan_limb.tables, i, &link.output)) {
            profile_channel_end(&plan_limb.tables, i, &link.input);
            TEST_ASSERT_TRUE(profile_links_put(&plan_limb.links, &link, false));
        }
        plan_limb.tables.channels[i].link = PDCP_LINK_NONE;
        plan_limb.tables.channels[i].source.channel = PDCP_NONE;
    }
}

static void test_system_5_at_power_on(void)
{
    systems_add(&plan_limb, systems_acceptance(5));
    systems_link(&plan_limb, as_2);
    read_back();
    systems_expect(&plan_limb, PROFILE_PLAN_ORIGINALS, as_2);
}

static void test_system_5_as_hot_swap(void)
{
    systems_add(&plan_limb, systems_acceptance(5));
    systems_link(&plan_limb, as_2);
    read_back();
    plan_expect(as_2);
    plan_lose(1);
    plan_expect("");
    plan_back(1);
    plan_expect(as_2);
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
    return UNITY_END();
}
