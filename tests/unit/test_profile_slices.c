/* A plan is made in slices, and the tables may change between two of them (D-PRO-23). */
#include <string.h>

#include "arb_app.h"
#include "hostlink.h"
#include "profile_events.h"
#include "profile_step.h"
#include "systems.h"
#include "unity.h"

enum { DEVICES = 16, HALF = 4, SLICES_MAX = 2000 };

static exchange_t x;
static arb_app_t app;
static systems_t s;

/* A limb of 128 channels, set up. */
void setUp(void)
{
    hostlink_start(&x, &app, false);
    systems_init(&s);
    for (uint8_t n = 1; n <= (uint8_t)DEVICES; n++) {
        systems_device_t device;
        memset(&device, 0, sizeof device);
        device.identity.sn = n;
        device.name = SYSTEMS_NAMES;
        device.count = 2 * HALF;
        for (uint8_t i = 0; i < (uint8_t)HALF; i++) {
            device.channels[i] = (systems_channel_t){
                .transfer = PDCP_INPUT, .type = 0x5300, .profile = (uint16_t)(0x1100u + 0x100u * (n % 3u))};
            device.channels[HALF + i] =
                (systems_channel_t){.transfer = PDCP_OUTPUT,
                                    .type = 0x5000,
                                    .profile = (uint16_t)(0x1100u + 0x100u * (n % 3u)),
                                    .required = (uint32_t)2 << i};
        }
        systems_set_up(&s, systems_bind(&s, &device), &device);
    }
    app.arb.bus.tables = s.tables;
    app.limb.run.state = PROFILE_RUN_IDLE;
    app.limb.run.at_events = PROFILE_PLAN_ALL;
}

void tearDown(void) {}

/* So many slices of a plan, none of which has done anything yet. */
static void make_slices(int count)
{
    for (int i = 0; i < count; i++) {
        (void)profile_step(&app.limb.run, &app.arb, x.now_ms);
        TEST_ASSERT_EQUAL(PROFILE_RUN_PLANNING, app.limb.run.state);
        TEST_ASSERT_EQUAL_UINT32(x.now_ms, profile_step_next_ms(&app.limb.run, &app.arb, x.now_ms));
    }
}

/* The rest of them; returns how many. */
static int finish_plan(void)
{
    int slices = 0;
    do {
        TEST_ASSERT_LESS_THAN(SLICES_MAX, ++slices);
        (void)profile_step(&app.limb.run, &app.arb, x.now_ms);
    } while (profile_run_is_planning(&app.limb.run));
    TEST_ASSERT_EQUAL(PROFILE_RUN_PLANNED, app.limb.run.state);
    return slices;
}

static void begin_plan(void)
{
    profile_run_begin(&app.limb.run, PROFILE_PLAN_ALL, true);
}

static void tell(pdcp_event_kind_t kind, uint8_t place)
{
    const pdcp_event_t event = {.kind = kind, .place = place, .channel = PDCP_NONE};
    profile_events_take(&app.limb.run, &app.arb, x.now_ms, &event);
}

/* The plan is the one that these tables give in one go. */
static void expect_plan_of_the_tables(void)
{
    s.tables = app.arb.bus.tables;
    systems_plan(&s, PROFILE_PLAN_ALL);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(s.plan.want, app.limb.run.plan.want, PDCP_CHANNELS_MAX);
}

static void test_a_plan_that_nothing_disturbs(void)
{
    begin_plan();
    TEST_ASSERT_GREATER_THAN(10, finish_plan());
    expect_plan_of_the_tables();
    (void)profile_step(&app.limb.run, &app.arb, x.now_ms);
    TEST_ASSERT_EQUAL(PROFILE_RUN_LINKING, app.limb.run.state); /* and then it is carried out */
}

/* A device goes when half of the plan is made: nothing of it is wanted any more, nobody is linked to it. */
static void test_a_device_goes_between_two_slices(void)
{
    const uint8_t gone = 1;
    begin_plan();
    make_slices(8);
    app.arb.bus.tables.devices[gone].state = PDCP_PLACE_LOST;
    tell(PDCP_EVENT_LOST, gone);
    TEST_ASSERT_GREATER_THAN(8, finish_plan()); /* from the beginning */
    expect_plan_of_the_tables();
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t output = app.limb.run.plan.want[i];
        TEST_ASSERT_TRUE(output == PDCP_NONE || (app.arb.bus.tables.channels[i].place != gone &&
                                                 app.arb.bus.tables.channels[output].place != gone));
    }
}

static void test_a_device_comes_between_two_slices(void)
{
    app.arb.bus.tables.devices[1].state = PDCP_PLACE_SETUP;
    begin_plan();
    make_slices(8);
    app.arb.bus.tables.devices[1].state = PDCP_PLACE_READY;
    tell(PDCP_EVENT_READY, 1);
    (void)finish_plan();
    expect_plan_of_the_tables();
}

/* What does not change the tables does not disturb the plan: a limb on a busy bus is planned, too. */
static void test_other_events_do_not_disturb(void)
{
    begin_plan();
    const int alone = finish_plan();
    setUp();
    begin_plan();
    for (int i = 0; i < alone - 1; i++) {
        make_slices(1);
        tell(PDCP_EVENT_REFUSED, PDCP_NONE);
        tell(PDCP_EVENT_STATE, PDCP_NONE);
        tell(PDCP_EVENT_IDENTITIES, PDCP_NONE);
        tell(PDCP_EVENT_REQUEST, 0);
    }
    TEST_ASSERT_EQUAL(1, finish_plan());
    expect_plan_of_the_tables();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_plan_that_nothing_disturbs);
    RUN_TEST(test_a_device_goes_between_two_slices);
    RUN_TEST(test_a_device_comes_between_two_slices);
    RUN_TEST(test_other_events_do_not_disturb);
    return UNITY_END();
}
