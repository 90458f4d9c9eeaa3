/* What random lives (test_life.c) have shown, each in the smallest limb that shows it. */
#include "limb.h"
#include "pdcp_time.h"
#include "unity.h"

void setUp(void) {}

void tearDown(void) {}

/* A sensor, a controller whose output requires its input, and a motor have linked themselves. */
static limb_t *begin_case(void)
{
    static limb_t limb;
    limb_begin(&limb, 1, 0xFFFFFFFFu - 700u);
    (void)limb_add(&limb, 1, "out 5000 2110");
    (void)limb_add(&limb, 2, "in 5200 2110; out 5000 1110, required = 1, signal = copy 1");
    (void)limb_add(&limb, 3, "in 5300 1110");
    limb_want(&limb, "1.1>2.1 2.2>3.1");
    limb_plug(&limb, 0, 2);
    limb_await(&limb, 2000);
    return &limb;
}

/* The host takes away the link of a required input: what requires it rests, and comes back with it (D-PRO-9,
 * D-PRO-25), in a stored configuration, too. */
static void expect_that_it_is_missed(bool stored)
{
    limb_t *limb = begin_case();
    static const uint8_t input[] = {2, 0, 2, 0, 2, 0, 1};
    if (stored) {
        (void)limb_act(limb, ARB_ACTION_SAVE, 0);
    }
    TEST_ASSERT_EQUAL_HEX16(0x2411, limb_ask(limb, 0x2410, input, sizeof input));
    limb_run_ms(limb, 100);
    limb_expect(limb, "");
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_links(&limb->app.arb.bus.tables));
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(limb, 1, 1, 2, 1));
    limb_run_ms(limb, 100);
    limb_expect(limb, "1.1>2.1 2.2>3.1");
    limb_end(limb);
}

static void test_a_removed_link_is_missed(void)
{
    expect_that_it_is_missed(false);
    expect_that_it_is_missed(true);
}

static bool lose_all(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    (void)frame;
    return true;
}

/* A device is lost while what the host has asked for waits for the links: the plan does not insist on a link
 * that cannot be made any more. */
static void test_a_device_goes_while_sole_access_is_enforced(void)
{
    limb_t *limb = begin_case();
    pdcp_arb_t *arb = &limb->app.arb;
    const uint8_t place = pdcp_tables_find(&arb->bus.tables, &limb->parts[1].ini->desc.identity);
    limb_power_off(limb, 2);
    limb_run_ms(limb, 1000);
    while (limb->lost.time_us == 0 &&
           !pdcp_time_reached(sim_world_ms(&limb->world), arb->bus.tables.devices[2].heard_ms + 1400)) {
        limb_run_ms(limb, 1);
    }
    limb->world.bus.fault = lose_all;
    TEST_ASSERT_TRUE(
        pdcp_arb_disconnect(arb, pdcp_tables_channel(&arb->bus.tables, place, 1))); /* unanswered: 300 ms */
    profile_run_begin(&limb->app.limb.run, PROFILE_PLAN_ENFORCE, false);
    sim_world_touch_app(&limb->world);
    limb_run_ms(limb, 400);
    TEST_ASSERT_TRUE(limb->lost.time_us != 0);
    limb->world.bus.fault = NULL;
    limb_run_ms(limb, 6000);
    TEST_ASSERT_FALSE(arb_limb_is_busy(&limb->app.limb));
    limb_expect(limb, "");
    limb_end(limb);
}

/* Answers of part 3 are lost, its beacons are not. */
static bool mute_third(void *ctx, const can_frame_t *frame)
{
    const limb_t *limb = ctx;
    return frame->dlc > 1 &&
           frame->id == pdcp_can_id(PDCP_PRIORITY_NORMAL, false,
                                    pdcp_device_node_id(sim_node_device(limb->parts[2].node)));
}

/* A device that beacons and does not answer is told to be silent again and again (D-BUS-22); that must not
 * keep the others from being linked. */
static void test_a_mute_device_holds_up_nobody(void)
{
    limb_t *limb = begin_case();
    limb->world.bus.fault_ctx = limb;
    limb->world.bus.fault = mute_third;
    limb_power_off(limb, 1);
    limb_run_ms(limb, 4000);
    limb_want(limb, "1.1>2.1");
    limb_power_on(limb, 1);
    limb_run_ms(limb, 3000);
    TEST_ASSERT_TRUE_MESSAGE(limb->linked.time_us != 0 && limb->linked.time_us - limb->ready.time_us < 120000,
                             "the others wait for it");
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(limb, 1, 1, 2, 1));
    limb->world.bus.fault = NULL;
    limb_want(limb, "1.1>2.1 2.2>3.1");
    limb_await(limb, 7000);
    limb_end(limb);
}

/* An action of the host before the start-up does not take its place: what is stored is loaded all the
 * same. */
static void test_an_action_does_not_forestall_the_start_up(void)
{
    static const arb_action_t actions[] = {ARB_ACTION_AUTOCONFIGURE, ARB_ACTION_CLEAR, ARB_ACTION_ENFORCE,
                                           ARB_ACTION_REPLACE};
    limb_t *limb = begin_case();
    (void)limb_act(limb, ARB_ACTION_SAVE, 0);
    limb_stop_arbitrator(limb);
    limb_pull(limb, 0, 2);
    limb_start_arbitrator(limb);
    for (unsigned i = 0; i < sizeof actions / sizeof actions[0]; i++) {
        TEST_ASSERT_EQUAL(0, limb_act(limb, actions[i], 0)); /* no devices */
    }
    limb_want(limb, "1.1>2.1 2.2>3.1");
    limb->ready.time_us = 0;
    limb_plug(limb, 0, 2);
    while (limb->ready.time_us == 0) {
        limb_run_ms(limb, 1);
    }
    (void)limb_act(limb, ARB_ACTION_ENFORCE, 0); /* waits for it */
    TEST_ASSERT_EQUAL(PROFILE_RUNNING, arb_limb_state(&limb->app.limb));
    limb_await(limb, 1000);
    TEST_ASSERT_EQUAL(1, limb->app.limb.active);
    limb_end(limb);
}

/* What was to be saved is forgotten with the limb when another arbitrator takes over. */
static void test_nothing_is_saved_on_standby(void)
{
    limb_t *limb = begin_case();
    const can_frame_t beacon = {.id = 0x100, .dlc = 1, .data = {PDCP_BEACON}};
    const uint8_t flags = ARB_FLAGS_FACTORY | ARB_FLAG_AUTO_SAVE;
    const int port = sim_bus_attach(&limb->world.bus, NULL, NULL);
    limb_stop_arbitrator(limb);
    limb_run_ms(limb, 100);
    limb_start_arbitrator(limb);
    TEST_ASSERT_EQUAL_HEX16(0x2405, limb_ask(limb, 0x2404, &flags, 1));
    limb->ready.time_us = 0;
    limb_pull(limb, 0, 2);
    limb_plug(limb, 0, 2);
    while (limb->events[PDCP_EVENT_READY] < 6) {
        limb_run_ms(limb, 1);
    }
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(limb, 1, 1, 2, 1)); /* a change that is to be saved */
    for (int i = 0; i < 16; i++) { /* it serves: a device answers it (D-BUS-42) */
        const uint8_t id = pdcp_device_node_id(sim_node_device(limb->parts[0].node));
        const can_frame_t question = {.id = (uint16_t)(0x300u + id), .dlc = 3, .data = {0x03, 0x0A, 0x00}};
        TEST_ASSERT_TRUE(sim_bus_send(&limb->world.bus, port, &beacon));
        TEST_ASSERT_TRUE(sim_bus_send(&limb->world.bus, port, &question));
        limb_run_ms(limb, 500);
    }
    TEST_ASSERT_EQUAL(1, limb->events[PDCP_EVENT_SILENT]);
    TEST_ASSERT_EQUAL(0, limb->app.limb.config.stored);
    limb_end(limb);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_removed_link_is_missed);
    RUN_TEST(test_a_mute_device_holds_up_nobody);
    RUN_TEST(test_an_action_does_not_forestall_the_start_up);
    RUN_TEST(test_nothing_is_saved_on_standby);
    RUN_TEST(test_a_device_goes_while_sole_access_is_enforced);
    return UNITY_END();
}
