/* A bad line: frames are lost at random, for every receiver (D-BUS-17, D-BUS-26). Three devices bind, are set
 * up and linked all the same, by the host or by themselves, and no id ever belongs to two devices. */
#include <stdio.h>
#include <string.h>

#include "systems.h"
#include "unity.h"

#ifndef SEEDS
#define SEEDS 1000
#endif
#define LIMB_SEEDS 200

static limb_t limb;
static uint32_t random_state;

void setUp(void) {}

void tearDown(void) {}

static uint32_t random_number(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return random_state >> 16;
}

static bool one_in_five(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    (void)frame;
    return random_number() % 5u == 0;
}

static bool one_in_ten(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    (void)frame;
    return random_number() % 10u == 0;
}

/* Node ids of the devices themselves, as they believe to have them, and of their outputs. */
static void expect_unique_ids(void)
{
    uint8_t seen[256] = {0};
    for (int i = 0; i < LIMB_DEVICES; i++) {
        const pdcp_device_t *device = sim_node_device(limb.parts[i].node);
        const uint8_t id = pdcp_device_node_id(device);
        TEST_ASSERT_TRUE_MESSAGE(id == 0 || seen[id]++ == 0, "an id belongs to two");
        for (uint8_t c = 1; id != 0 && c <= limb.parts[i].ini->desc.channel_count; c++) {
            const uint8_t channel_id = pdcp_device_channel(device, c)->node_id;
            TEST_ASSERT_TRUE_MESSAGE(channel_id == 0 || seen[channel_id]++ == 0,
                                     "an output's id belongs to two");
        }
    }
}

static bool all_ready(void)
{
    int ready = 0;
    for (int i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_device_entry_t *device = &limb.app.arb.bus.tables.devices[i];
        ready += device->state == PDCP_PLACE_READY && device->beaconed ? 1 : 0;
    }
    return ready == LIMB_DEVICES;
}

static int active_links(void)
{
    int active = 0;
    for (int i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = &limb.app.arb.bus.tables.channels[i];
        active += channel->place != PDCP_NONE && channel->link == PDCP_LINK_ACTIVE ? 1 : 0;
    }
    return active;
}

static uint32_t run_until_ready(void)
{
    uint32_t waited_ms = 0;
    while (!all_ready() && waited_ms < 120000) {
        limb_run_ms(&limb, 10);
        waited_ms += 10;
        expect_unique_ids();
    }
    return waited_ms;
}

/* A host that asks again when the arbitrator says that a device did not answer. */
static void link_stubbornly(uint8_t out_sn, uint8_t out, uint8_t in_sn, uint8_t in)
{
    for (int i = 0; i < 100; i++) {
        if (limb_link(&limb, out_sn, out, in_sn, in) == 0x2308) {
            return;
        }
        (void)run_until_ready();
        limb_run_ms(&limb, 50);
        expect_unique_ids();
    }
    TEST_FAIL_MESSAGE("a link could not be made in 100 tries");
}

static void test_setup_and_linking_complete_with_every_seed(void)
{
    uint32_t slowest_ms = 0;
    uint64_t sum_ms = 0;
    for (uint32_t seed = 1; seed <= SEEDS; seed++) {
        char name[40];
        (void)snprintf(name, sizeof name, "seed %u", (unsigned)seed);
        random_state = seed;
        limb_start(&limb, seed, 0xFFFFFFFFu - seed * 10u);
        limb.world.bus.fault = one_in_five;
        const uint32_t ready_ms = run_until_ready();
        TEST_ASSERT_TRUE_MESSAGE(all_ready(), name);
        slowest_ms = ready_ms > slowest_ms ? ready_ms : slowest_ms;
        sum_ms += ready_ms;
        link_stubbornly(4, 1, 5, 2);
        link_stubbornly(5, 3, 6, 1);
        link_stubbornly(5, 5, 6, 2);
        for (int i = 0; i < 3000 && active_links() < 3; i++) {
            limb_run_ms(&limb,
                        10); /* a device that was thought lost for a moment gets its links back by itself */
        }
        TEST_ASSERT_EQUAL_MESSAGE(3, active_links(), name);
        expect_unique_ids();
        limb_end(&limb);
    }
    (void)printf(
        "%u seeds, one frame in five lost: three devices ready after %u ms on average, %u ms at worst\n",
        (unsigned)SEEDS, (unsigned)(sum_ms / SEEDS), (unsigned)slowest_ms);
}

/* Acceptance system 2 on a line that loses one frame in ten: the limb links itself in the end, and values
 * flow. The links must be there at some time, and again when the line is good. */
static void test_a_limb_links_itself_with_every_seed(void)
{
    uint32_t slowest_ms = 0;
    uint64_t sum_ms = 0;
    for (uint32_t seed = 1; seed <= LIMB_SEEDS; seed++) {
        char name[40];
        (void)snprintf(name, sizeof name, "seed %u", (unsigned)seed);
        random_state = seed;
        systems_begin(&limb, 2, seed);
        limb.world.bus.fault = one_in_ten;
        limb_want(&limb, systems_get(2)->expected);
        limb_plug(&limb, D1, D3);
        uint32_t waited_ms = 0;
        while (limb.linked.time_us == 0 && waited_ms < 60000) {
            limb_run_ms(&limb, 10);
            waited_ms += 10;
        }
        TEST_ASSERT_TRUE_MESSAGE(waited_ms < 60000, name);
        slowest_ms = waited_ms > slowest_ms ? waited_ms : slowest_ms;
        sum_ms += waited_ms;
        limb.world.bus.fault = NULL;
        limb_run_ms(&limb, 12000); /* whatever was about to be tried again has been */
        limb_expect(&limb, systems_get(2)->expected);
        limb_expect_flow(&limb);
        limb_end(&limb);
    }
    (void)printf(
        "%u seeds, one frame in ten lost: the limb has linked itself after %u ms on average, %u ms at "
        "worst\n",
        (unsigned)LIMB_SEEDS, (unsigned)(sum_ms / LIMB_SEEDS), (unsigned)slowest_ms);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_setup_and_linking_complete_with_every_seed);
    RUN_TEST(test_a_limb_links_itself_with_every_seed);
    return UNITY_END();
}
