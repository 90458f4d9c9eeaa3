/* Node ids in whole limbs: nobody hears whom it should not, and nobody is kept waiting (D-BUS-36,
 * D-BUS-37). */
#include <stdio.h>
#include <string.h>

#include "limb.h"
#include "unity.h"

static limb_t limb;

void setUp(void)
{
    limb_begin(&limb, 1, 0xFFFFFFFFu - 700u);
}

void tearDown(void)
{
    limb_end(&limb);
}

/* The plug of part 1 is loose: nothing of it reaches the others, though it has power and hears them. Its
 * values are 1. */
static bool is_of_first(void *ctx, const can_frame_t *frame)
{
    const pdcp_device_t *device = sim_node_device(limb.parts[0].node);
    const uint8_t id = pdcp_id_node(frame->id);
    (void)ctx;
    return !pdcp_id_from_arbitrator(frame->id) &&
           (id == pdcp_device_node_id(device) ||
            (id == pdcp_device_channel(device, 1)->node_id && frame->data[0] == 1));
}

static bool are_linked(const char *links)
{
    char text[LIMB_TEXT];
    limb_links(&limb, text);
    return strcmp(text, links) == 0;
}

/* D-BUS-36: a sensor with a loose plug comes back while another one has taken its place: the hand never obeys
 * it. */
static void test_a_sensor_with_a_loose_plug_is_not_obeyed(void)
{
    (void)limb_add(&limb, 1, "out 5000 1110, signal = constant 1, rate_ms = 10");
    (void)limb_add(&limb, 2, "out 5000 1110, signal = constant 2, rate_ms = 10");
    (void)limb_add(&limb, 3, "in 5300 1110");
    limb_power_on(&limb, 0);
    limb_power_on(&limb, 2);
    limb_want(&limb, "1.1>3.1");
    limb_await(&limb, 2000);
    TEST_ASSERT_EQUAL(1, limb.parts[2].value[1]);
    limb.world.bus.fault = is_of_first;
    limb_run_ms(&limb, 13000); /* its ids were kept for 10 s */
    limb_power_on(&limb, 1);
    limb_run_ms(&limb, 2000);
    TEST_ASSERT_TRUE(are_linked("2.1>3.1"));
    TEST_ASSERT_EQUAL(2, limb.parts[2].value[1]);
    limb.world.bus.fault = NULL;
    for (int ms = 0; ms < 3000; ms++) {
        limb_run_ms(&limb, 1);
        if (are_linked("2.1>3.1")) {
            TEST_ASSERT_EQUAL_MESSAGE(2, limb.parts[2].value[1], "the hand obeys the wrong sensor");
        }
    }
}

/* D-BUS-37: thirty devices live on while their arbitrator starts again. */
static void test_thirty_devices_are_back_within_2_s(void)
{
    for (uint16_t i = 0; i < 30; i++) {
        limb_power_on(&limb, limb_add(&limb, (uint16_t)(i + 1), "out 5000 2110"));
    }
    limb_run_ms(&limb, 3000);
    limb_stop_arbitrator(&limb);
    limb_run_ms(&limb, 500);
    limb_start_arbitrator(&limb);
    limb_run_ms(&limb, 2000);
    TEST_ASSERT_EQUAL(30, pdcp_tables_count_devices(&limb.app.arb.bus.tables));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_sensor_with_a_loose_plug_is_not_obeyed);
    RUN_TEST(test_thirty_devices_are_back_within_2_s);
    return UNITY_END();
}
