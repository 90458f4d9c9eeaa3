/* A whole limb on the simulated bus, in virtual time. The arbitrator's clock wraps during every test. */
#include <stdio.h>
#include <string.h>

#include "limb.h"
#include "unity.h"

static limb_t limb;

void setUp(void)
{
    limb_start(&limb, 1, 0xFFFFFFFFu - 700u);
}

void tearDown(void)
{
    limb_end(&limb);
}

static void link_channels(uint8_t out_sn, uint8_t out, uint8_t in_sn, uint8_t in)
{
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(&limb, out_sn, out, in_sn, in));
    TEST_ASSERT_EQUAL(2, limb.answer[8]);
}

/* The links of acceptance system 2. */
static void link_all(void)
{
    link_channels(4, 1, 5, 2);
    link_channels(5, 3, 6, 1);
    link_channels(5, 5, 6, 2);
}

static void expect_counts(uint8_t devices, uint8_t inputs, uint8_t outputs, uint8_t links)
{
    const uint8_t want[] = {devices, inputs, outputs, links};
    TEST_ASSERT_EQUAL_HEX16(0x2202, limb_ask(&limb, 0x2201, NULL, 0));
    TEST_ASSERT_EQUAL_UINT8_ARRAY(want, &limb.answer[8], 4);
}

static void expect_all_active(void)
{
    for (uint8_t number = 1; number <= 3; number++) {
        TEST_ASSERT_EQUAL_HEX16(0x220E, limb_ask(&limb, 0x220D, &number, 1));
        TEST_ASSERT_EQUAL(2, limb.answer[8 + 14]);
    }
}

/* Values that D1 sends arrive at D3 on both its channels. */
static void expect_flow(void)
{
    limb_part_t *hand = &limb.parts[D3];
    memset(hand->received, 0, sizeof hand->received);
    limb_run_ms(&limb, 1000);
    TEST_ASSERT_GREATER_THAN(10, hand->received[1]);
    TEST_ASSERT_GREATER_THAN(10, hand->received[2]);
}

static void test_a_limb_comes_alive(void)
{
    limb_run_ms(&limb, 200);
    expect_counts(3, 4, 4, 0);
    link_all();
    expect_counts(3, 4, 4, 3);
    expect_all_active();
    expect_flow();
}

/* Bus time of binding and setting up three devices, from power-on: their frames, a few milliseconds. */
static void test_three_devices_are_ready_within_20_ms(void)
{
    uint32_t ready_ms = 0;
    while (pdcp_tables_count_channels(&limb.app.arb.bus.tables, PDCP_INPUT) < 4 && ready_ms < 1000) {
        limb_run_ms(&limb, 1);
        ready_ms++;
    }
    (void)printf(
        "three devices, eight channels: ready %u ms after power-on, %llu frames, %llu us of bus time\n",
        (unsigned)ready_ms, (unsigned long long)limb.world.bus.frames,
        (unsigned long long)limb.world.bus.busy_us);
    TEST_ASSERT_LESS_THAN(20, ready_ms);
}

/* A device that is away for a moment: old id, old links, without the host. */
static void swap(int device, uint32_t away_ms)
{
    limb_run_ms(&limb, 200);
    link_all();
    const uint8_t id = pdcp_device_node_id(sim_node_device(limb.parts[device].node));
    limb_power_off(&limb, device);
    limb_run_ms(&limb, 1600);
    TEST_ASSERT_EQUAL(2, pdcp_tables_count_devices(&limb.app.arb.bus.tables));
    limb_run_ms(&limb, away_ms);
    limb_power_on(&limb, device);
    limb_run_ms(&limb, 1000);
    expect_counts(3, 4, 4, 3);
    TEST_ASSERT_EQUAL(id, pdcp_device_node_id(sim_node_device(limb.parts[device].node)));
    expect_all_active();
    expect_flow();
}

static void test_the_source_is_unplugged_and_comes_back(void)
{
    swap(D1, 2000);
}

static void test_the_controller_is_unplugged_and_comes_back(void)
{
    swap(D2, 2000);
}

static void test_the_hand_is_unplugged_and_comes_back(void)
{
    swap(D3, 2000);
}

/* Longer than its ids are kept: the link is remembered by identity. */
static void test_the_source_is_away_for_long(void)
{
    swap(D1, 20000);
}

static void test_a_device_that_is_reset_comes_back(void)
{
    limb_run_ms(&limb, 200);
    link_all();
    limb_power_off(&limb, D2);
    limb_power_on(&limb, D2); /* before anybody could notice */
    limb_run_ms(&limb, 1000);
    expect_counts(3, 4, 4, 3);
    expect_all_active();
    expect_flow();
}

/* While D1 is away its link is inactive (D-BUS-14) and nothing arrives. */
static void test_a_lost_source_is_seen_at_once(void)
{
    limb_run_ms(&limb, 200);
    link_all();
    limb_power_off(&limb, D1);
    limb_run_ms(&limb, 1600);
    expect_counts(2, 4, 3, 3);
    const uint8_t number = 1;
    TEST_ASSERT_EQUAL_HEX16(0x220E, limb_ask(&limb, 0x220D, &number, 1));
    TEST_ASSERT_EQUAL(1, limb.answer[8 + 14]);
    limb_part_t *hand = &limb.parts[D3];
    memset(hand->received, 0, sizeof hand->received);
    limb_run_ms(&limb, 1000);
    TEST_ASSERT_EQUAL(0, hand->received[1]);
}

/* The arbitrator is restarted under a living limb, with its memory: everybody binds again by himself with his
 * old id (D-BUS-15), and the links come back from what the devices remember. */
static void test_the_arbitrator_is_restarted(void)
{
    uint8_t ids[LIMB_DEVICES];
    limb_run_ms(&limb, 1000); /* the identities are stored */
    link_all();
    for (int i = 0; i < LIMB_DEVICES; i++) {
        ids[i] = pdcp_device_node_id(sim_node_device(limb.parts[i].node));
    }
    (void)sim_world_set_app(&limb.world, NULL);
    limb_run_ms(&limb, 300);
    limb_start_arbitrator(&limb);
    limb_run_ms(&limb, PDCP_SHUT_MS + 2000); /* outputs get no ids before (D-BUS-36) */
    expect_counts(3, 4, 4, 3);
    for (int i = 0; i < LIMB_DEVICES; i++) {
        TEST_ASSERT_EQUAL(ids[i], pdcp_device_node_id(sim_node_device(limb.parts[i].node)));
    }
    expect_all_active();
    expect_flow();
}

/* No id is ever given twice, whatever order the devices come in. */
static void test_many_power_cycles(void)
{
    uint32_t random = 7;
    for (int round = 0; round < 60; round++) {
        random = random * 1664525u + 1013904223u;
        const int device = (int)((random >> 16) % LIMB_DEVICES);
        if (limb.parts[device].node != NULL) {
            limb_power_off(&limb, device);
        } else {
            limb_power_on(&limb, device);
        }
        limb_run_ms(&limb, (random >> 8) % 3000);
        uint8_t seen[256] = {0};
        for (int i = 0; i < LIMB_DEVICES; i++) {
            const uint8_t id =
                limb.parts[i].node != NULL ? pdcp_device_node_id(sim_node_device(limb.parts[i].node)) : 0;
            TEST_ASSERT_TRUE(id == 0 || seen[id]++ == 0);
        }
    }
    for (int i = 0; i < LIMB_DEVICES; i++) {
        if (limb.parts[i].node == NULL) {
            limb_power_on(&limb, i);
        }
    }
    limb_run_ms(&limb, 3000);
    link_all();
    expect_all_active();
    expect_flow();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_limb_comes_alive);
    RUN_TEST(test_three_devices_are_ready_within_20_ms);
    RUN_TEST(test_the_source_is_unplugged_and_comes_back);
    RUN_TEST(test_the_controller_is_unplugged_and_comes_back);
    RUN_TEST(test_the_hand_is_unplugged_and_comes_back);
    RUN_TEST(test_the_source_is_away_for_long);
    RUN_TEST(test_a_device_that_is_reset_comes_back);
    RUN_TEST(test_a_lost_source_is_seen_at_once);
    RUN_TEST(test_the_arbitrator_is_restarted);
    RUN_TEST(test_many_power_cycles);
    return UNITY_END();
}
