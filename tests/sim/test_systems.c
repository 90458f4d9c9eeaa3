/* The five acceptance systems (profile-layer.md 6) on the simulated bus, each at power-on and as a hot swap
 * without any reset, with the real device role, the real application and its memory. Prints how long the
 * links took: from the detected loss or the end of the last device's setup at most 100 ms and the bus time of
 * the frames needed. The arbitrator's clock wraps in each of them. */
#include <stdio.h>
#include <string.h>

#include "systems.h"
#include "unity.h"

#define AFTER_LOSS "the loss"
#define AFTER_READY "the last setup"

/* profile-layer.md 4 */
enum { START_UP_QUIET_MS = 500 };

static limb_t limb;

void setUp(void) {}

void tearDown(void)
{
    limb_end(&limb);
}

/* --- Power-on --- */

static void power_on(int number)
{
    systems_begin(&limb, number, 1);
    systems_configure(&limb, number);
    limb.settings.no_autoconfig = true; /* what is there then was not made up anew */
    systems_restart(&limb, number);
    limb_await(&limb, 2000);
    systems_report(&limb, number, "power-on", AFTER_READY, &limb.ready, START_UP_QUIET_MS);
    TEST_ASSERT_EQUAL(1, limb.app.limb.active);
    systems_expect_flow(&limb, number);
}

static void test_system_1_power_on(void)
{
    power_on(1);
}

static void test_system_2_power_on(void)
{
    systems_begin(&limb, 2, 1);
    limb_want(&limb, systems_get(2)->expected);
    limb_plug(&limb, D1, D3);
    limb_await(&limb, 2000);
    systems_report(&limb, 2, "power-on", AFTER_READY, &limb.ready, START_UP_QUIET_MS);
    TEST_ASSERT_EQUAL(0, limb.app.limb.active);
    systems_expect_flow(&limb, 2);
}

static void test_system_3_power_on(void)
{
    power_on(3);
}

/* The stored configuration, and not what the devices remember, decides: they have forgotten it. */
static void test_system_3_power_on_with_devices_that_remember_nothing(void)
{
    systems_begin(&limb, 3, 1);
    systems_configure(&limb, 3);
    limb_pull(&limb, D1, D3);
    for (int i = 0; i < LIMB_DEVICES; i++) {
        limb_blank(&limb, i);
    }
    limb.settings.no_autoconfig = true;
    systems_restart(&limb, 3);
    limb_await(&limb, 2000);
    systems_expect_flow(&limb, 3);
}

static void test_system_4_power_on(void)
{
    power_on(4);
}

/* The devices lived on while the arbitrator was away: their outputs get no ids in its first 11 s
 * (D-BUS-36). */
enum { SHUT_WAIT_MS = PDCP_SHUT_MS + 2000 };

/* The blank arbitrator must not make up the links: it reads them back from the devices. */
static void blank_arbitrator(bool devices_reset)
{
    systems_begin(&limb, 5, 1);
    limb_want(&limb, systems_get(5)->configured);
    limb_plug(&limb, D1, D3);
    limb_await(&limb, 2000);
    limb_stop_arbitrator(&limb);
    if (devices_reset) {
        limb_pull(&limb, D1, D3);
        limb_run_ms(&limb, 5000);
    }
    sim_nvm_init(&limb.nvm);
    limb.settings.serial = 99;
    limb.settings.no_autoconfig = true;
    limb_want(&limb, systems_get(5)->expected);
    limb_start_arbitrator(&limb);
    if (devices_reset) {
        limb_plug(&limb, D1, D3);
    }
    limb_await(&limb, devices_reset ? 6000 : SHUT_WAIT_MS);
    systems_report(&limb, 5, devices_reset ? "power-on" : "hot swap", AFTER_READY, &limb.ready,
                   START_UP_QUIET_MS);
    TEST_ASSERT_EQUAL(0, limb.app.limb.active);
    systems_expect_flow(&limb, 5);
}

static void test_system_5_power_on(void)
{
    blank_arbitrator(true);
}

/* --- Hot swap --- */

/* The replacement is there before the loss, or comes after it. */
static void replace(int number, bool before)
{
    const systems_t *system = systems_get(number);
    systems_begin(&limb, number, 1);
    systems_configure(&limb, number);
    limb_want(&limb, system->expected);
    limb_power_off(&limb, system->replaced);
    if (!before) {
        limb_run_ms(&limb, 2500);
        TEST_ASSERT_NOT_EQUAL(0, limb.lost.time_us);
        limb_expect(&limb, "");
    }
    limb_power_on(&limb, system->replacement);
    limb_await(&limb, 2500);
    if (before) {
        TEST_ASSERT_TRUE(limb.ready.time_us < limb.lost.time_us);
        systems_report(&limb, number, "hot swap, replacement there", AFTER_LOSS, &limb.lost, 0);
    } else {
        systems_report(&limb, number, "hot swap, replacement plugged later", AFTER_READY, &limb.ready, 0);
    }
    systems_expect_flow(&limb, number);
    limb_want(&limb, system->configured); /* the original returns and replaces what stood in (D-PRO-6) */
    limb_power_on(&limb, system->replaced);
    limb_await(&limb, 2500);
    systems_report(&limb, number, "hot swap, original back", AFTER_READY, &limb.ready, 0);
    systems_expect_flow(&limb, number);
}

static void test_system_1_hot_swap(void)
{
    replace(1, true);
}

static void test_system_1_hot_swap_with_a_gap(void)
{
    replace(1, false);
}

static void test_system_4_hot_swap(void)
{
    replace(4, true);
}

static void test_system_4_hot_swap_with_a_gap(void)
{
    replace(4, false);
}

/* The arbitrator runs, with two of the parts; the third one is plugged in. */
static void complete(int last)
{
    char what[40];
    (void)snprintf(what, sizeof what, "hot swap, D%d plugged last", last + 1);
    systems_begin(&limb, 2, 1);
    limb_want(&limb, systems_get(2)->expected);
    for (int i = 0; i < LIMB_DEVICES; i++) {
        if (i != last) {
            limb_power_on(&limb, i);
        }
    }
    limb_run_ms(&limb, 3000);
    TEST_ASSERT_EQUAL(PROFILE_RUNNING, arb_limb_state(&limb.app.limb));
    limb_expect(&limb, "");
    limb_power_on(&limb, last);
    limb_await(&limb, 2000);
    systems_report(&limb, 2, what, AFTER_READY, &limb.ready, 0);
    systems_expect_flow(&limb, 2);
}

static void test_system_2_hot_swap_sensor(void)
{
    complete(D1);
}

static void test_system_2_hot_swap_controller(void)
{
    complete(D2);
}

static void test_system_2_hot_swap_hand(void)
{
    complete(D3);
}

/* Parts of the saved limb are pulled and come back while all runs. */
static void pull_and_plug(int first, int last, const char *what)
{
    systems_begin(&limb, 3, 1);
    systems_configure(&limb, 3);
    limb_want(&limb, systems_get(3)->expected);
    limb_pull(&limb, first, last);
    limb_run_ms(&limb, 3000);
    limb_expect(&limb, first == D3 ? "1.1>2.2" : "");
    limb_plug(&limb, first, last);
    limb_await(&limb, 2000);
    systems_report(&limb, 3, what, AFTER_READY, &limb.ready, 0);
    systems_expect_flow(&limb, 3);
}

static void test_system_3_hot_swap_sensor(void)
{
    pull_and_plug(D1, D1, "hot swap, D1");
}

static void test_system_3_hot_swap_controller(void)
{
    pull_and_plug(D2, D2, "hot swap, D2");
}

static void test_system_3_hot_swap_hand(void)
{
    pull_and_plug(D3, D3, "hot swap, D3");
}

/* D-PRO-12: they are planned together, not as they come. */
static void test_system_3_hot_swap_all(void)
{
    pull_and_plug(D1, D3, "hot swap, all parts at once");
}

static void test_system_5_hot_swap(void)
{
    blank_arbitrator(false);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_system_1_power_on);
    RUN_TEST(test_system_1_hot_swap);
    RUN_TEST(test_system_1_hot_swap_with_a_gap);
    RUN_TEST(test_system_2_power_on);
    RUN_TEST(test_system_2_hot_swap_sensor);
    RUN_TEST(test_system_2_hot_swap_controller);
    RUN_TEST(test_system_2_hot_swap_hand);
    RUN_TEST(test_system_3_power_on);
    RUN_TEST(test_system_3_power_on_with_devices_that_remember_nothing);
    RUN_TEST(test_system_3_hot_swap_sensor);
    RUN_TEST(test_system_3_hot_swap_controller);
    RUN_TEST(test_system_3_hot_swap_hand);
    RUN_TEST(test_system_3_hot_swap_all);
    RUN_TEST(test_system_4_power_on);
    RUN_TEST(test_system_4_hot_swap);
    RUN_TEST(test_system_4_hot_swap_with_a_gap);
    RUN_TEST(test_system_5_power_on);
    RUN_TEST(test_system_5_hot_swap);
    return UNITY_END();
}
