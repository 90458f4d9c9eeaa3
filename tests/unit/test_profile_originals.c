/* Originals, what stands in for them, and what is required with them (D-PRO-6, D-PRO-9). */
#include "plan.h"
#include "unity.h"

static const char as_2[] = "1.1>2.2 2.3>3.1 2.5>3.2"; /* the links of system 2 */

void setUp(void)
{
    systems_init(&plan_limb);
}

void tearDown(void) {}

/* --- Originals and what stands in for them (D-PRO-6) --- */

static void test_an_original_replaces_an_output_that_stands_in(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2110; D3 out 1 5000 2120", "1.1>2.1");
    plan_lose(1);
    plan_expect("3.1>2.1");
    plan_back(1);
    plan_expect("1.1>2.1");
}

static void test_an_original_replaces_an_input_that_stands_in(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2110; D3 in 1 5000 2110", "1.1>2.1");
    plan_lose(2);
    plan_expect("1.1>3.1");
    TEST_ASSERT_EQUAL_UINT8(systems_channel(&plan_limb, "3.1"), plan_limb.links.entries[0].stand_in);
    TEST_ASSERT_EQUAL_UINT8(1, plan_limb.links.count); /* it is not part of the configuration */
    plan_back(2);
    plan_expect("1.1>2.1");
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE, plan_limb.links.entries[0].stand_in);
}

/* 2.2 comes back as what 2.1 requires. */
static void test_a_stand_in_goes_whatever_has_brought_the_original_back(void)
{
    plan_run(
        "D1 out 1 5000 2110, out 2 5000 2120; D2 in 1 5000 2110 req 2, in 2 5000 2120; D3 in 1 5000 2120",
        "1.1>2.1 1.2>2.2");
    plan_lose(2);
    plan_expect("1.2>3.1");
    plan_back(2);
    plan_expect("1.1>2.1 1.2>2.2");
}

/* The output of a stand-in is wanted back by another input, with sole access. */
static void test_a_stand_in_gives_up_its_sole_access(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2120; D3 out 1 5000 2120; D4 in 1 5200 2110",
             "3.1>2.1 1.1>4.1");
    plan_lose(2);
    plan_expect("1.1>4.1");
    plan_lose(1);
    plan_expect("3.1>4.1");
    plan_back(2);
    plan_expect("3.1>2.1");
    plan_back(1);
    plan_expect("3.1>2.1 1.1>4.1");
}

static void test_a_replacement_that_fits_less_well_is_kept_until_the_original_comes(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2110; D3 out 1 5000 2200", "1.1>2.1");
    plan_lose(1);
    plan_expect("3.1>2.1");
    systems_add(&plan_limb, "D4 out 1 5000 2110");
    plan_expect("3.1>2.1");
    plan_back(1);
    plan_expect("1.1>2.1");
}

/* An original that would not hold takes nothing away: its output requires an input that nobody feeds. */
static void test_an_original_that_cannot_hold_replaces_nothing(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2110, in 2 5000 2110; D3 out 1 5000 2120", "1.1>2.1");
    plan_forget(1);
    plan_expect("3.1>2.1");
    systems_add(&plan_limb, "D1 out 1 5000 2110 req 2, in 2 5200 3110");
    plan_expect("3.1>2.1");
}

/* 2.2 requires 2.1, and both have the same source in the configuration: only one of them can have it. */
static void test_an_original_that_cannot_hold_is_in_nobodys_way(void)
{
    plan_set_up("D1 out 1 5000 2110; D2 in 1 5300 1110, in 2 5200 1100 req 1", "1.1>2.1 1.1>2.2");
    plan_expect("1.1>2.1");
}

/* 2.1 requires 2.2, which has taken its source. */
static void test_an_original_does_not_take_what_it_needs(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5200 2110 req 2, in 2 5200 2110; D3 out 1 5000 2120",
             "1.1>2.1 3.1>2.2");
    plan_lose(3);
    plan_expect("1.1>2.2");
    plan_back(3);
    plan_expect("1.1>2.1 3.1>2.2");
}

/* 2.2 requires 2.1, which has the source that 5.1 had: a working original is not given up for
 * another one (D-PRO-24). */
static void test_an_original_does_not_cost_another_one(void)
{
    plan_run(
        "D1 out 1 5000 2110; D2 in 1 5200 2110, in 2 5200 1110 req 1; D3 out 1 5000 1110; D4 out 1 5000 2120;"
        "D5 in 1 5200 2200",
        "4.1>2.1 3.1>2.2 1.1>5.1");
    plan_lose(5);
    plan_lose(4);
    plan_expect("1.1>2.1 3.1>2.2");
    plan_back(5);
    plan_expect("1.1>2.1 3.1>2.2");
    plan_back(4);
    plan_expect("4.1>2.1 3.1>2.2 1.1>5.1");
}

/* A control is replaced by another one: what its outputs require is connected with them, and stands in as
 * well. */
static void test_what_a_replacement_requires_stands_in_too(void)
{
    systems_add(&plan_limb, systems_acceptance(2));
    plan_expect(as_2);
    plan_lose(2);
    systems_add(&plan_limb,
                "D5 2:2:9 in 1 7200 2200, in 2 5200 2110, out 3 5000 1100 req 2, out 4 5000 1210 req 1,"
                "out 5 7000 1220 req 2");
    plan_expect("5.3>3.1 5.5>3.2 1.1>5.2");
    plan_back(2);
    plan_expect(as_2);
}

/* 2.2 is found by autoconfiguration only after 2.1 has lost what its source requires; but it is like the
 * missing 5.1, so it is 2.1 that has the output in the end. */
static void test_a_stand_in_that_was_found_by_chance_gives_way_at_once(void)
{
    plan_set_up(
        "D1 out 1 5000 1110 req 2, in 2 5100 2110; D2 in 1 5200 1200, in 2 5300 1110; D3 out 1 5000 3110;"
        "D4 out 1 5000 2110; D5 in 1 5300 1110",
        "3.1>1.2 1.1>2.1 1.1>5.1");
    plan_lose(5);
    plan_expect("3.1>1.2 1.1>2.1");
    plan_lose(3);
    plan_expect("4.1>1.2 1.1>2.1");
}

/* What stands in for 3.1 is required by what the original requires. */
static void test_an_original_does_not_pull_away_what_it_needs(void)
{
    plan_set_up(
        "D1 out 1 5000 2110 req 2, in 2 5000 1100; D2 out 1 5000 1120 req 2, in 2 5000 2120; D3 in 1 5000 "
        "1120",
        "2.1>3.1 1.1>2.2");
    plan_lose(3);
    plan_expect("2.1>1.2 1.1>2.2");
    plan_back(3);
    plan_expect("2.1>1.2 1.1>2.2");
}

/* A stand-in ends when its output gets another source of its own: the next one is looked for in the same
 * plan. */
static void test_a_stand_in_that_is_wanted_elsewhere_is_replaced_at_once(void)
{
    plan_run("D1 out 1 5000 2110; D2 in 1 5000 2110; D3 in 1 5000 2120, in 2 5000 2200; D4 out 1 5000 2200",
             "1.1>2.1 4.1>3.1");
    plan_lose(4);
    plan_lose(2);
    plan_expect("1.1>3.1");
    plan_back(4);
    plan_expect("4.1>3.1 1.1>3.2");
}

/* --- What is required follows the configuration (D-PRO-9) --- */

static void test_a_required_input_is_connected_by_the_configuration(void)
{
    const char *const parts =
        "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110;"
        "D4 out 1 5000 2200";
    plan_set_up(parts, "4.1>1.2");
    plan_expect("4.1>1.2 1.1>2.1");
    plan_expect_of(parts, "3.1>1.2 1.1>2.1");
}

/* 4.1 could not be linked before: it requires an input itself, for which a search is due. */
static void test_a_required_input_has_its_original_with_all_that_it_needs(void)
{
    plan_set_up(
        "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110;"
        "D4 out 1 5000 2200 req 2, in 2 5200 2120; D5 out 1 5000 2120",
        "4.1>1.2");
    plan_expect("4.1>1.2 1.1>2.1 5.1>4.2");
}

/* Listing 4.3: what is not terminal is just connected, and rests while it lacks something. */
static void test_nothing_is_searched_for_an_original_that_is_not_terminal(void)
{
    plan_set_up("D1 out 1 5000 2110 req 2, in 2 5200 2110; D2 in 1 5200 2110; D3 out 1 5000 2110", "1.1>2.1");
    plan_expect("");
    systems_configure(&plan_limb, "3.1>1.2", false);
    plan_expect("3.1>1.2 1.1>2.1");
}

static void test_originals_that_are_not_terminal_come_first(void)
{
    plan_set_up("D1 out 1 5000 2110; D2 in 1 5300 1110, in 2 5200 1200", "1.1>2.1 1.1>2.2");
    plan_expect("1.1>2.2");
}

/* 3.1 is more like the input, 5.1 more like the missing source. */
static void test_a_missing_source_is_replaced_by_likeness_to_it(void)
{
    plan_set_up(
        "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110; D4 out 1 5000 2200;"
        "D5 out 1 5000 2220",
        "4.1>1.2");
    plan_forget(4);
    plan_expect("5.1>1.2 1.1>2.1");
}

static void test_links_rest_while_what_they_require_is_missing(void)
{
    plan_run("D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5300 1110; D3 out 1 5000 2110",
             "3.1>1.2 1.1>2.1");
    plan_lose(3);
    plan_expect("");
    TEST_ASSERT_EQUAL_UINT8(PDCP_LINK_INACTIVE,
                            plan_limb.tables.channels[systems_channel(&plan_limb, "2.1")].link);
    systems_add(&plan_limb, "D4 out 1 5000 2200");
    plan_expect("4.1>1.2 1.1>2.1");
}

static void test_links_by_the_host_are_left_alone(void)
{
    systems_add(&plan_limb,
                "D1 out 1 5000 1110 req 2, in 2 5200 2110; D2 in 1 5200 1110; D3 out 1 5000 2110");
    systems_configure(&plan_limb, "3.1>1.2 1.1>2.1", true);
    systems_link(&plan_limb, "3.1>1.2 1.1>2.1");
    plan_expect("3.1>1.2 1.1>2.1");
    plan_lose(3);
    plan_expect("1.1>2.1");
    plan_lose(1);
    plan_expect("");
    plan_back(1);
    plan_expect("1.1>2.1");
}

int main(void)
{
    UNITY_BEGIN();
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
    return UNITY_END();
}
