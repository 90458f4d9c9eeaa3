/* What is stored of a limb, and the host's actions and flags (profile-layer.md 4 and 5). The real device role
 * and application in virtual time. */
#include <string.h>

#include "swap.h"
#include "unity.h"

enum { AUTO = ARB_FLAG_AUTOCONFIGURE, SWAP = ARB_FLAG_HOT_SWAP, SAVE = ARB_FLAG_AUTO_SAVE };

static limb_t limb;

void setUp(void)
{
    swap_begin(&limb);
}

void tearDown(void)
{
    limb_end(&limb);
}

/* --- Stored configurations --- */

static void test_another_configuration_is_loaded(void)
{
    swap_run(&limb);
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    TEST_ASSERT_EQUAL(1, limb.app.limb.active);
    TEST_ASSERT_EQUAL_HEX16(0x2309, limb_link(&limb, 4, 1, 5, 1)); /* it feeds 2.2: both want sole access */
    TEST_ASSERT_EQUAL_HEX8(0x08, limb.answer[8]);
    (void)limb_act(&limb, ARB_ACTION_CLEAR, 0);
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(&limb, 4, 1, 5, 1));
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(&limb, 5, 4, 6, 1));
    limb_expect(&limb, "1.1>2.1 2.4>3.1");
    (void)limb_act(&limb, ARB_ACTION_SAVE, 7);
    TEST_ASSERT_EQUAL(7, limb.app.limb.active);
    (void)limb_act(&limb, ARB_ACTION_LOAD, 1);
    limb_expect(&limb, SWAP_LINKS);
    TEST_ASSERT_EQUAL(1, limb.app.limb.active);
    limb_expect_flow(&limb);
    (void)limb_act(&limb, ARB_ACTION_LOAD, 7);
    limb_expect(&limb, "1.1>2.1 2.4>3.1");
    (void)limb_act(&limb, ARB_ACTION_LOAD, 7); /* idempotent */
    limb_expect(&limb, "1.1>2.1 2.4>3.1");
    swap_restart(&limb, D1, D3); /* both match with all their links, 1 has more (D-PRO-4) */
    limb_want(&limb, SWAP_LINKS);
    limb_await(&limb, 2000);
    TEST_ASSERT_EQUAL(1, limb.app.limb.active);
}

/* D-PRO-15: the host sees what is missing. */
static void test_a_link_without_its_source_is_listed(void)
{
    static const uint8_t missing[] = {2, 0, 2, 0, 4, 0, 1, 2, 0, 2, 0, 5, 0, 2, PDCP_LINK_INACTIVE};
    swap_run(&limb);
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    for (int i = D1; i <= D3; i++) {
        limb_power_off(&limb, i);
        limb_blank(&limb, i);
    }
    swap_restart(&limb, D2, D3);
    limb_run_ms(&limb, 3000);
    bool listed = false;
    for (uint8_t number = 1; limb_ask(&limb, 0x220D, &number, 1) == 0x220E; number++) {
        listed = listed || memcmp(missing, &limb.answer[8], sizeof missing) == 0;
    }
    TEST_ASSERT_TRUE(listed);
}

/* D-PRO-18: the arbitrator has power long before the parts are there. */
static void test_the_start_up_waits_for_a_part(void)
{
    limb_run_ms(&limb, 3000);
    TEST_ASSERT_EQUAL(PROFILE_WAITING, arb_limb_state(&limb.app.limb));
    limb_want(&limb, SWAP_LINKS);
    limb_plug(&limb, D1, D3);
    limb_await(&limb, 1000);
    TEST_ASSERT_GREATER_OR_EQUAL(500000 - 1000u * limb.app.arb.held_ms,
                                 limb.linked.time_us - limb.ready.time_us);
}

static void test_a_configuration_is_erased(void)
{
    swap_run(&limb);
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    (void)limb_act(&limb, ARB_ACTION_ERASE, 1);
    TEST_ASSERT_EQUAL(0, limb.app.limb.active);
    TEST_ASSERT_EQUAL(0, limb.app.limb.config.stored);
    limb_expect(&limb, SWAP_LINKS);                   /* what works goes on */
    const uint8_t load_none[] = {ARB_ACTION_LOAD, 0}; /* D-PRO-16 */
    TEST_ASSERT_EQUAL_HEX16(0x2409, limb_ask(&limb, 0x2407, load_none, sizeof load_none));
    TEST_ASSERT_EQUAL_HEX8(0x02, limb.answer[8]);
    const uint8_t load[] = {ARB_ACTION_LOAD, 1};
    TEST_ASSERT_EQUAL_HEX16(0x2409, limb_ask(&limb, 0x2407, load, sizeof load));
    TEST_ASSERT_EQUAL_HEX8(0x02, limb.answer[8]);
    for (int i = D1; i <= D3; i++) {
        limb_power_off(&limb, i);
        limb_blank(&limb, i);
    }
    swap_restart(&limb, D1, D3);
    limb_run_ms(&limb, 3000);
    limb_expect(&limb, "");
}

static void test_all_links_are_removed(void)
{
    swap_run(&limb);
    TEST_ASSERT_EQUAL(3, limb_act(&limb, ARB_ACTION_CLEAR, 0));
    limb_expect(&limb, "");
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_links(&limb.app.arb.bus.tables));
    for (int i = D2; i <= D3; i++) {
        const pdcp_device_t *device = sim_node_device(limb.parts[i].node);
        TEST_ASSERT_FALSE(pdcp_device_source_connected(pdcp_device_source(device, 1)));
        TEST_ASSERT_FALSE(pdcp_device_source_connected(pdcp_device_source(device, 2)));
    }
    TEST_ASSERT_EQUAL(0, limb_act(&limb, ARB_ACTION_CLEAR, 0));
    limb_run_ms(&limb, 10000);
    limb_expect(&limb, "");
    TEST_ASSERT_EQUAL(3, limb_act(&limb, ARB_ACTION_AUTOCONFIGURE, 0));
    limb_expect(&limb, SWAP_LINKS);
    TEST_ASSERT_EQUAL(0, limb_act(&limb, ARB_ACTION_AUTOCONFIGURE, 0));
}

/* Both controllers remember the same sensor and ask for it; they have one each in turn with the other
 * absent. */
static void remember_both(void)
{
    for (int i = 0; i < 2; i++) {
        const int controller = i == 0 ? D2 : SWAP_SPARE;
        limb_power_on(&limb, D1);
        limb_power_on(&limb, controller);
        limb_power_on(&limb, D3);
        limb_want(&limb, i == 0 ? SWAP_LINKS : SWAP_LINKS_SPARE);
        limb_await(&limb, 2000);
        limb_stop_arbitrator(&limb);
        limb_power_off(&limb, D1);
        limb_power_off(&limb, controller);
        limb_power_off(&limb, D3);
        limb_blank(&limb, D3);
        sim_nvm_init(&limb.nvm);
        limb_start_arbitrator(&limb);
    }
}

/* D-PRO-19: Only one of them may have it, by its serial number; there is nothing left to be enforced. */
static void test_two_that_remember_the_same_source(void)
{
    remember_both();
    limb_plug(&limb, D1, SWAP_SPARE);
    limb_want(&limb, SWAP_LINKS);
    limb_await(&limb, 2000);
    limb_run_ms(&limb, 5000); /* they ask again and again */
    limb_expect(&limb, SWAP_LINKS);
    TEST_ASSERT_EQUAL(0, limb_act(&limb, ARB_ACTION_ENFORCE, 0));
    limb_expect(&limb, SWAP_LINKS);
}

/* Also when both have asked for it, and got it, before the start-up: it waits while parts come. */
static void test_two_that_have_got_the_same_source(void)
{
    const int last = limb_add(&limb, 20, "in 5200 2300");
    remember_both();
    limb_plug(&limb, D1, D2);
    limb_power_on(&limb, SWAP_SPARE);
    limb_run_ms(&limb, 450);
    limb_power_on(&limb, last);
    limb_run_ms(&limb, 450);
    limb_power_on(&limb, D3);
    limb_run_ms(&limb, 400);
    TEST_ASSERT_EQUAL(PROFILE_WAITING, arb_limb_state(&limb.app.limb));
    limb_expect(&limb, "1.1>2.2 1.1>4.2");
    limb_want(&limb, SWAP_LINKS);
    limb_await(&limb, 1000);
}

/* What a foreign part remembers never overrides a stored configuration, at power-on and later. */
static void test_a_foreign_part_does_not_override_what_is_stored(void)
{
    remember_both();
    limb_plug(&limb, D1, D3);
    limb_want(&limb, SWAP_LINKS);
    limb_await(&limb, 2000);
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    limb_power_on(&limb, SWAP_SPARE);
    limb_run_ms(&limb, 3000);
    limb_expect(&limb, SWAP_LINKS);
    swap_restart(&limb, D1, SWAP_SPARE);
    limb_want(&limb, SWAP_LINKS);
    limb_await(&limb, 2000);
    limb_run_ms(&limb, 5000);
    limb_expect(&limb, SWAP_LINKS);
}

/* Adopted, the spare part is the original. */
static void test_stand_ins_are_adopted(void)
{
    swap_run(&limb);
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    limb_power_on(&limb, SWAP_SPARE);
    limb_power_off(&limb, D2);
    limb_want(&limb, SWAP_LINKS_SPARE);
    limb_await(&limb, 2500);
    TEST_ASSERT_EQUAL(3, limb_act(&limb, ARB_ACTION_ADOPT, 0));
    TEST_ASSERT_EQUAL(0, limb_act(&limb, ARB_ACTION_ADOPT, 0));
    limb_power_on(&limb, D2);
    limb_run_ms(&limb, 3000);
    limb_expect(&limb, SWAP_LINKS_SPARE);
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    swap_restart(&limb, D1, SWAP_SPARE);
    limb_want(&limb, SWAP_LINKS_SPARE);
    limb_await(&limb, 2500);
}

/* Not adopted, a link that is stood in for is saved as its original. */
static void test_originals_are_saved(void)
{
    swap_run(&limb);
    limb_power_on(&limb, SWAP_SPARE);
    limb_power_off(&limb, D2);
    limb_want(&limb, SWAP_LINKS_SPARE);
    limb_await(&limb, 2500);
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    swap_restart(&limb, D1, SWAP_SPARE);
    limb_want(&limb, SWAP_LINKS);
    limb_await(&limb, 2500);
}

static void test_a_change_is_saved_after_5_s(void)
{
    swap_set_flags(&limb, AUTO | SWAP | SAVE);
    swap_run(&limb);
    limb_run_ms(&limb, 4000);
    TEST_ASSERT_EQUAL(0, limb.app.limb.config.stored);
    limb_run_ms(&limb, 1500);
    TEST_ASSERT_EQUAL(1, limb.app.limb.config.stored);
    TEST_ASSERT_EQUAL(1, limb.app.limb.active);
    const uint32_t writes = limb.nvm.writes;
    limb_run_ms(&limb, 30000);
    TEST_ASSERT_EQUAL(writes, limb.nvm.writes);
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(&limb, 5, 4, 6, 2));
    limb_run_ms(&limb, 6000);
    TEST_ASSERT_GREATER_THAN(writes, limb.nvm.writes);
    swap_restart(&limb, D1, D3);
    limb_want(&limb, "1.1>2.2 2.3>3.1");
    limb_await(&limb, 2500); /* 2.4 requires 2.1, and the host's word is not stored */
}

/* --- Flags --- */

static void test_flags_outlast_a_restart(void)
{
    swap_set_flags(&limb, SAVE);
    limb_run_ms(&limb, 200);
    limb_stop_arbitrator(&limb);
    limb_start_arbitrator(&limb);
    TEST_ASSERT_EQUAL_HEX8(SAVE, arb_limb_flags(&limb.app.limb));
    limb_plug(&limb, D1, D3);
    limb_run_ms(&limb, 3000);
    limb_expect(&limb, ""); /* autoconfigure is off */
    swap_set_flags(&limb, AUTO | SWAP);
    TEST_ASSERT_EQUAL(3, limb_act(&limb, ARB_ACTION_AUTOCONFIGURE, 0));
    limb_expect(&limb, SWAP_LINKS);
}

/* The command line's word is not stored. */
static void test_the_command_line_overrides_the_flags(void)
{
    limb_stop_arbitrator(&limb);
    limb.settings.no_autoconfig = true;
    limb_start_arbitrator(&limb);
    limb_plug(&limb, D1, D3);
    limb_run_ms(&limb, 3000);
    limb_expect(&limb, "");
    limb_stop_arbitrator(&limb);
    limb.settings.no_autoconfig = false;
    limb_start_arbitrator(&limb);
    limb_want(&limb, SWAP_LINKS);
    limb_await(&limb, PDCP_SHUT_MS + 2000); /* the parts lived on (D-BUS-36) */
}

/* Nothing stands in, but an original comes back. */
static void test_hot_swap_is_off(void)
{
    swap_set_flags(&limb, AUTO);
    swap_run(&limb);
    limb_power_on(&limb, SWAP_SPARE);
    limb_power_off(&limb, D2);
    limb_run_ms(&limb, 5000);
    limb_expect(&limb, "");
    limb_want(&limb, SWAP_LINKS);
    limb_power_on(&limb, D2);
    limb_await(&limb, 2500);
    limb_power_off(&limb, D2);
    limb_run_ms(&limb, 3000);
    limb_expect(&limb, "");
    limb_want(&limb, SWAP_LINKS_SPARE); /* until the host asks for it */
    TEST_ASSERT_EQUAL(3, limb_act(&limb, ARB_ACTION_REPLACE, 0));
    limb_await(&limb, 100);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_another_configuration_is_loaded);
    RUN_TEST(test_a_link_without_its_source_is_listed);
    RUN_TEST(test_the_start_up_waits_for_a_part);
    RUN_TEST(test_a_configuration_is_erased);
    RUN_TEST(test_all_links_are_removed);
    RUN_TEST(test_two_that_remember_the_same_source);
    RUN_TEST(test_two_that_have_got_the_same_source);
    RUN_TEST(test_a_foreign_part_does_not_override_what_is_stored);
    RUN_TEST(test_stand_ins_are_adopted);
    RUN_TEST(test_originals_are_saved);
    RUN_TEST(test_a_change_is_saved_after_5_s);
    RUN_TEST(test_flags_outlast_a_restart);
    RUN_TEST(test_the_command_line_overrides_the_flags);
    RUN_TEST(test_hot_swap_is_off);
    return UNITY_END();
}
