#include "limb.h"

#include <stdio.h>
#include <string.h>

#include "unity.h"

static bool can_send(void *ctx, const can_frame_t *frame)
{
    limb_t *limb = ctx;
    return sim_world_send(&limb->world, frame);
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    limb_t *limb = ctx;
    TEST_ASSERT_LESS_OR_EQUAL(sizeof limb->answer, limb->answer_len + size);
    memcpy(&limb->answer[limb->answer_len], bytes, size);
    limb->answer_len += size;
    return size;
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    const limb_t *limb = ctx;
    memcpy(bytes, &limb->memory[address], size);
    return true;
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    limb_t *limb = ctx;
    memcpy(&limb->memory[address], bytes, size);
    return true;
}

static int8_t nvm_status(void *ctx)
{
    (void)ctx;
    return 0;
}

static void on_value(void *ctx, const sim_node_event_t *event)
{
    limb_t *limb = ctx;
    if (!event->safe && event->channel < 3) {
        limb->received[event->channel]++;
    }
}

void limb_power_on(limb_t *limb, int device)
{
    char error[256];
    const uint32_t seed = limb->seed + (uint32_t)(device + 1) * 977u + (uint32_t)limb->world.now_us;
    limb->nodes[device] =
        sim_node_open(limb->inis[device], seed, limb->world.now_us, on_value, limb, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(limb->nodes[device], error);
    TEST_ASSERT_TRUE(sim_world_add(&limb->world, limb->nodes[device]));
}

void limb_power_off(limb_t *limb, int device)
{
    sim_world_remove(&limb->world, limb->nodes[device]);
    sim_node_close(limb->nodes[device]);
    limb->nodes[device] = NULL;
}

void limb_run_ms(limb_t *limb, uint32_t ms)
{
    (void)sim_world_run(&limb->world, limb->world.now_us + (uint64_t)ms * 1000u);
}

static arb_port_t port; /* the same for every limb but for ctx: one limb at a time */

void limb_start_arbitrator(limb_t *limb)
{
    const arb_settings_t settings = {.serial = limb->seed, .strict_crc = true};
    port = (arb_port_t){.ctx = limb,
                        .can_send = can_send,
                        .host_write = host_write,
                        .nvm_read = nvm_read,
                        .nvm_write = nvm_write,
                        .nvm_status = nvm_status};
    arb_app_init(&limb->app, &port, &settings, sim_world_ms(&limb->world));
    TEST_ASSERT_TRUE(sim_world_set_app(&limb->world, &limb->app));
}

void limb_start(limb_t *limb, uint32_t seed, uint32_t clock_ms)
{
    memset(limb, 0, sizeof *limb);
    memset(limb->memory, 0xFF, sizeof limb->memory);
    limb->seed = seed;
    sim_world_init(&limb->world, 0, clock_ms);
    limb_start_arbitrator(limb);
    for (int i = 0; i < LIMB_DEVICES; i++) {
        char path[256];
        char error[256];
        (void)snprintf(path, sizeof path, LIMB_FILES "/d%d.ini", i + 1);
        limb->inis[i] = node_ini_load(path, error, sizeof error);
        TEST_ASSERT_NOT_NULL_MESSAGE(limb->inis[i], error);
        limb_power_on(limb, i);
    }
}

void limb_end(limb_t *limb)
{
    for (int i = 0; i < LIMB_DEVICES; i++) {
        if (limb->nodes[i] != NULL) {
            limb_power_off(limb, i);
        }
        node_ini_free(limb->inis[i]);
    }
}

uint16_t limb_ask(limb_t *limb, uint16_t id, const uint8_t *payload, uint16_t len)
{
    uint8_t bytes[64];
    if (len != 0) {
        memcpy(&bytes[ARB_HOST_HEADER], payload, len);
    }
    const uint16_t total = arb_host_finish(bytes, id, 1, len);
    limb->answer_len = 0;
    TEST_ASSERT_EQUAL(total, arb_app_on_bytes(&limb->app, sim_world_ms(&limb->world), bytes, total));
    sim_world_touch_app(&limb->world);
    for (int i = 0; i < 4000 && limb->answer_len == 0; i++) {
        limb_run_ms(limb, 1);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_MESSAGE(8, limb->answer_len, "no answer");
    return (uint16_t)(limb->answer[2] | limb->answer[3] << 8);
}

uint16_t limb_link(limb_t *limb, uint8_t out_sn, uint8_t out, uint8_t in_sn, uint8_t in)
{
    const uint8_t payload[] = {2, 0, 2, 0, out_sn, 0, out, 2, 0, 2, 0, in_sn, 0, in};
    return limb_ask(limb, 0x2307, payload, sizeof payload);
}
