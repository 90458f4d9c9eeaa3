/* A whole limb on the simulated bus, in virtual time: the three devices of acceptance system 2
 * (profile-layer.md 6) with the real device role, the whole application, and a host that speaks bytes. The
 * arbitrator's clock wraps during every test. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arb_app.h"
#include "node_ini.h"
#include "sim_node.h"
#include "sim_world.h"
#include "unity.h"

enum { D1, D2, D3, DEVICES_COUNT };

static sim_world_t world;
static arb_app_t app;
static node_ini_t *inis[DEVICES_COUNT];
static sim_node_t *nodes[DEVICES_COUNT];
static int received[3]; /* values at D3, by channel index */
static uint8_t answer[600];
static size_t answer_len;
static uint8_t memory[32768];

static bool can_send(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    return sim_world_send(&world, frame);
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    (void)ctx;
    TEST_ASSERT_LESS_OR_EQUAL(sizeof answer, answer_len + size);
    memcpy(&answer[answer_len], bytes, size);
    answer_len += size;
    return size;
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    memcpy(bytes, &memory[address], size);
    return true;
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    memcpy(&memory[address], bytes, size);
    return true;
}

static int8_t nvm_status(void *ctx)
{
    (void)ctx;
    return 0;
}

static const arb_port_t port = {.can_send = can_send,
                                .host_write = host_write,
                                .nvm_read = nvm_read,
                                .nvm_write = nvm_write,
                                .nvm_status = nvm_status};

static void on_value(void *ctx, const sim_node_event_t *event)
{
    (void)ctx;
    if (!event->safe && event->channel < 3) {
        received[event->channel]++;
    }
}

static void power_on(int device)
{
    char error[256];
    nodes[device] = sim_node_open(inis[device], (uint32_t)(device + 1) * 977u + (uint32_t)world.now_us,
                                  world.now_us, on_value, NULL, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(nodes[device], error);
    TEST_ASSERT_TRUE(sim_world_add(&world, nodes[device]));
}

static void power_off(int device)
{
    sim_world_remove(&world, nodes[device]);
    sim_node_close(nodes[device]);
    nodes[device] = NULL;
}

static void run_ms(uint32_t ms)
{
    (void)sim_world_run(&world, world.now_us + (uint64_t)ms * 1000u);
}

static void start_arbitrator(void)
{
    static const arb_settings_t settings = {.strict_crc = true};
    arb_app_init(&app, &port, &settings, sim_world_ms(&world));
    TEST_ASSERT_TRUE(sim_world_set_app(&world, &app));
}

void setUp(void)
{
    memset(memory, 0xFF, sizeof memory);
    sim_world_init(&world, 0, 0xFFFFFFFFu - 700u);
    start_arbitrator();
    for (int i = 0; i < DEVICES_COUNT; i++) {
        char path[256];
        char error[256];
        (void)snprintf(path, sizeof path, DEVICES "/d%d.ini", i + 1);
        inis[i] = node_ini_load(path, error, sizeof error);
        TEST_ASSERT_NOT_NULL_MESSAGE(inis[i], error);
        power_on(i);
    }
    memset(received, 0, sizeof received);
}

void tearDown(void)
{
    for (int i = 0; i < DEVICES_COUNT; i++) {
        if (nodes[i] != NULL) {
            power_off(i);
        }
        node_ini_free(inis[i]);
    }
}

/* One request of the host, answered within 3 s; its payload stays in answer[8]. Returns the answer's id. */
static uint16_t ask(uint16_t id, const uint8_t *payload, uint16_t len)
{
    uint8_t bytes[64];
    if (len != 0) {
        memcpy(&bytes[ARB_HOST_HEADER], payload, len);
    }
    const uint16_t total = arb_host_finish(bytes, id, 1, len);
    answer_len = 0;
    TEST_ASSERT_EQUAL(total, arb_app_on_bytes(&app, sim_world_ms(&world), bytes, total));
    sim_world_touch_app(&world);
    for (int i = 0; i < 3000 && answer_len == 0; i++) {
        run_ms(1);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_MESSAGE(8, answer_len, "no answer");
    return (uint16_t)(answer[2] | answer[3] << 8);
}

static void link_channels(uint8_t out_sn, uint8_t out, uint8_t in_sn, uint8_t in)
{
    const uint8_t payload[] = {2, 0, 2, 0, out_sn, 0, out, 2, 0, 2, 0, in_sn, 0, in};
    TEST_ASSERT_EQUAL_HEX16(0x2308, ask(0x2307, payload, sizeof payload));
    TEST_ASSERT_EQUAL(2, answer[8]);
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
    TEST_ASSERT_EQUAL_HEX16(0x2202, ask(0x2201, NULL, 0));
    TEST_ASSERT_EQUAL_UINT8_ARRAY(want, &answer[8], 4);
}

static void expect_all_active(void)
{
    for (uint8_t number = 1; number <= 3; number++) {
        TEST_ASSERT_EQUAL_HEX16(0x220E, ask(0x220D, &number, 1));
        TEST_ASSERT_EQUAL(2, answer[8 + 14]);
    }
}

/* Values that D1 sends arrive at D3 on both its channels. */
static void expect_flow(void)
{
    memset(received, 0, sizeof received);
    run_ms(1000);
    TEST_ASSERT_GREATER_THAN(10, received[1]);
    TEST_ASSERT_GREATER_THAN(10, received[2]);
}

static void test_a_limb_comes_alive(void)
{
    run_ms(200);
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
    while (pdcp_nodes_count_channels(&app.arb.bus.nodes, PDCP_INPUT) < 4 && ready_ms < 1000) {
        run_ms(1);
        ready_ms++;
    }
    (void)printf(
        "three devices, eight channels: ready %u ms after power-on, %llu frames, %llu us of bus time\n",
        (unsigned)ready_ms, (unsigned long long)world.bus.frames, (unsigned long long)world.bus.busy_us);
    TEST_ASSERT_LESS_THAN(20, ready_ms);
}

/* A device that is away for a moment: old id, old links, without the host. */
static void swap(int device, uint32_t away_ms)
{
    run_ms(200);
    link_all();
    const uint8_t id = pdcp_device_node_id(sim_node_device(nodes[device]));
    power_off(device);
    run_ms(1600);
    TEST_ASSERT_EQUAL(2, pdcp_nodes_count_devices(&app.arb.bus.nodes));
    run_ms(away_ms);
    power_on(device);
    run_ms(1000);
    expect_counts(3, 4, 4, 3);
    TEST_ASSERT_EQUAL(id, pdcp_device_node_id(sim_node_device(nodes[device])));
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
    run_ms(200);
    link_all();
    power_off(D2);
    power_on(D2); /* before anybody could notice */
    run_ms(1000);
    expect_counts(3, 4, 4, 3);
    expect_all_active();
    expect_flow();
}

/* While D1 is away its link is inactive (D-BUS-14) and nothing arrives. */
static void test_a_lost_source_is_seen_at_once(void)
{
    run_ms(200);
    link_all();
    power_off(D1);
    run_ms(1600);
    expect_counts(2, 4, 3, 3);
    const uint8_t number = 1;
    TEST_ASSERT_EQUAL_HEX16(0x220E, ask(0x220D, &number, 1));
    TEST_ASSERT_EQUAL(1, answer[8 + 14]);
    memset(received, 0, sizeof received);
    run_ms(1000);
    TEST_ASSERT_EQUAL(0, received[1]);
}

/* The arbitrator is restarted under a living limb, with its memory: everybody binds again by himself with his
 * old id (D-BUS-15), and the links come back by Update Data Channel. */
static void test_the_arbitrator_is_restarted(void)
{
    uint8_t ids[DEVICES_COUNT];
    run_ms(1000); /* the identities are stored */
    link_all();
    for (int i = 0; i < DEVICES_COUNT; i++) {
        ids[i] = pdcp_device_node_id(sim_node_device(nodes[i]));
    }
    (void)sim_world_set_app(&world, NULL);
    run_ms(300);
    start_arbitrator();
    run_ms(4000);
    expect_counts(3, 4, 4, 3);
    for (int i = 0; i < DEVICES_COUNT; i++) {
        TEST_ASSERT_EQUAL(ids[i], pdcp_device_node_id(sim_node_device(nodes[i])));
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
        const int device = (int)((random >> 16) % DEVICES_COUNT);
        if (nodes[device] != NULL) {
            power_off(device);
        } else {
            power_on(device);
        }
        run_ms((random >> 8) % 3000);
        uint8_t seen[256] = {0};
        for (int i = 0; i < DEVICES_COUNT; i++) {
            const uint8_t id = nodes[i] != NULL ? pdcp_device_node_id(sim_node_device(nodes[i])) : 0;
            TEST_ASSERT_TRUE(id == 0 || seen[id]++ == 0);
        }
    }
    for (int i = 0; i < DEVICES_COUNT; i++) {
        if (nodes[i] == NULL) {
            power_on(i);
        }
    }
    run_ms(3000);
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
