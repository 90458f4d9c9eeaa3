/* What random lives have shown of links (test_life.c), each with as little as it takes. The number is the
 * seed of the life, whose last check ends each case, too. */
#include "life.h"
#include "unity.h"

enum { CALM_MS = 40000, NOBODY = -1 }; /* calm as in a life: whatever is tried again after a while has been */

static limb_t limb;
static int port; /* to speak for a part */
static int mute; /* the part whose frames do not arrive, but for beacons and data; NOBODY: all do */

static uint8_t id_of(int part)
{
    return pdcp_device_node_id(sim_node_device(limb.parts[part].node));
}

static bool loses(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    return mute != NOBODY && frame->id == pdcp_can_id(PDCP_PRIORITY_NORMAL, false, id_of(mute));
}

void setUp(void)
{
    limb_begin(&limb, 1, 0xFFFFFFFFu - 700u);
    port = sim_bus_attach(&limb.world.bus, NULL, NULL);
    mute = NOBODY;
    limb.world.bus.fault = loses;
}

void tearDown(void)
{
    limb_end(&limb);
}

/* The parts have linked themselves like this. */
static void begin_case(int parts, const char *links)
{
    limb_want(&limb, links);
    limb_plug(&limb, 0, parts - 1);
    limb_await(&limb, 2000);
}

static void calm_down(void)
{
    limb_run_ms(&limb, CALM_MS);
    life_check_calm(&limb);
}

/* A device asks for the source of its input (Update Data Channel). */
static void ask_for_source(int part, uint8_t input)
{
    const can_frame_t frame = {.id = pdcp_can_id(PDCP_PRIORITY_NORMAL, false, id_of(part)),
                               .dlc = 2,
                               .data = {PDCP_UPDATE_CHANNEL, input}};
    TEST_ASSERT_TRUE(sim_bus_send(&limb.world.bus, port, &frame));
}

/* Life 21601: an original that cannot come back, since what stands in for it is required. The host's link for
 * it is refused, for both want the output for themselves (D-API-13). */
static void test_a_stand_in_that_stays_keeps_its_sole_access(void)
{
    (void)limb_add(&limb, 1, "in 5200 2110; out 5000 2130, required = 1");
    (void)limb_add(&limb, 2, "in 5200 2110");
    (void)limb_add(&limb, 3, "out 5000 2120");
    (void)limb_add(&limb, 4, "in 5000 2120; out 5000 2110, required = 1");
    (void)limb_add(&limb, 5, "in 5100 2110");
    begin_case(5, "3.1>4.1 4.2>5.1");
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(&limb, 4, 2, 2, 1));
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    limb_power_off(&limb, 1);
    limb_want(&limb, "4.2>1.1 3.1>4.1 4.2>5.1");
    limb_await(&limb, 3000);
    limb_power_off(&limb, 2); /* now the stand-in is part of what feeds its own source */
    limb_want(&limb, "4.2>1.1 1.2>4.1 4.2>5.1");
    limb_await(&limb, 3000);
    limb_power_on(&limb, 1);
    limb_run_ms(&limb, 1000);
    limb_expect(&limb, "4.2>1.1 1.2>4.1 4.2>5.1");
    const uint16_t answer = limb_link(&limb, 4, 2, 2, 1);
    const uint8_t error = limb.answer[8];
    calm_down();
    TEST_ASSERT_EQUAL_HEX16(0x2309, answer);
    TEST_ASSERT_EQUAL_HEX8(0x08, error);
}

/* Life 39003: a source of a stored configuration is lost. While one of its inputs does not answer, the device
 * of the other one asks for it: that one is silenced all the same (D-BUS-14). */
static void test_an_input_that_is_asked_for_is_silenced(void)
{
    (void)limb_add(&limb, 1, "in 5100 2110");
    (void)limb_add(&limb, 2, "in 5000 1110; in 5100 2110");
    (void)limb_add(&limb, 3, "out 5000 2110");
    limb_power_on(&limb, 0); /* stands first in the tables */
    limb_run_ms(&limb, 100);
    limb_want(&limb, "3.1>1.1 3.1>2.2");
    limb_plug(&limb, 1, 2);
    limb_await(&limb, 2000);
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    mute = 0;
    limb_power_off(&limb, 2);
    limb_want(&limb, "");
    while (limb.lost.time_us == 0) {
        limb_run_ms(&limb, 1);
    }
    ask_for_source(1, 2);
    limb_run_ms(&limb, 1000);
    mute = NOBODY;
    calm_down();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_stand_in_that_stays_keeps_its_sole_access);
    RUN_TEST(test_an_input_that_is_asked_for_is_silenced);
    return UNITY_END();
}
