#include "bench_bus.h"

#include <string.h>

/* Bits of channels 1 and 2, the inputs: bit 7 is channel index 0 (D-BUS-8). */
static const uint8_t needs_both_inputs[] = {0x60};
static const uint8_t needs_nothing[] = {0x00};

#define BENCH_NEEDS(name)                                                                                    \
    {                                                                                                        \
        (name), sizeof(name)                                                                                 \
    }

static const pdcp_device_channel_desc_t channels[BENCH_CHANNELS] = {
    {.direction = PDCP_INPUT,
     .terminal = true,
     .type = 0x5000,
     .profile = 0x2120,
     .terminal_profile = 0x2120,
     .descriptor = {"input 1", 7},
     .required = BENCH_NEEDS(needs_nothing),
     .desired = BENCH_NEEDS(needs_nothing)},
    {.direction = PDCP_INPUT,
     .terminal = true,
     .type = 0x5000,
     .profile = 0x2120,
     .terminal_profile = 0x2120,
     .descriptor = {"input 2", 7},
     .required = BENCH_NEEDS(needs_nothing),
     .desired = BENCH_NEEDS(needs_nothing)},
    {.direction = PDCP_OUTPUT,
     .type = 0x5000,
     .profile = 0x2120,
     .descriptor = {"output 3", 8},
     .required = BENCH_NEEDS(needs_both_inputs),
     .desired = BENCH_NEEDS(needs_nothing)},
    {.direction = PDCP_OUTPUT,
     .type = 0x5000,
     .profile = 0x2120,
     .descriptor = {"output 4", 8},
     .required = BENCH_NEEDS(needs_both_inputs),
     .desired = BENCH_NEEDS(needs_nothing)},
};

/* --- the application's port --- */

static bool can_send(void *ctx, const can_frame_t *frame)
{
    bench_bus_t *bench = ctx;
    if (bench->bus.ports[bench->app_port].queued >= BENCH_MAILBOXES) {
        return false;
    }
    return sim_bus_send(&bench->bus, bench->app_port, frame);
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    (void)ctx;
    (void)bytes;
    return size;
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    const bench_bus_t *bench = ctx;
    if ((uint32_t)address + size > sizeof bench->nvm) {
        return false;
    }
    memcpy(bytes, &bench->nvm[address], size);
    return true;
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    bench_bus_t *bench = ctx;
    if ((uint32_t)address + size > sizeof bench->nvm) {
        return false;
    }
    memcpy(&bench->nvm[address], bytes, size);
    return true;
}

static int8_t nvm_status(void *ctx)
{
    (void)ctx;
    return 0;
}

/* --- the bus --- */

static void log_answer(bench_log_t *log, const can_frame_t *frame)
{
    const bool of_setup = frame->id == (PDCP_PRIORITY_NORMAL << 9 | 1) &&
                          (frame->data[0] == (PDCP_GET_PARAMETER | PDCP_ANSWER) ||
                           frame->data[0] == (PDCP_SET_PARAMETER | PDCP_ANSWER));
    if (of_setup && log->answer_count < BENCH_ANSWERS_MAX) {
        log->answers[log->answer_count++] = *frame;
    }
}

/* A port that sends nothing hears every frame. */
static void listen(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    bench_bus_t *bench = ctx;
    bench_log_t *log = &bench->log;
    const unsigned own_us = sim_bus_frame_bits(frame);
    if (frame->dlc == 1 && frame->data[0] == PDCP_BEACON) {
        log->beacons++;
        return;
    }
    if (log->frames++ == 0) {
        log->first_us = time_us - own_us;
    }
    if (frame->data[0] == (PDCP_BIND_DEVICE | PDCP_ANSWER) && log->hold_us == 0) {
        log->hold_us = time_us - own_us - log->first_us - log->own_us;
    }
    log->last_us = time_us;
    log->own_us += own_us;
    if ((frame->data[0] & 0x7Fu) == PDCP_BIND_DEVICE) {
        log->bind_frames++;
        log->bind_bus_us += own_us + SIM_BUS_INTERFRAME_BITS;
        log->bind_last_us = time_us;
    }
    if (!bench_bus_ready(bench)) { /* then answers are to questions of the audit */
        log_answer(log, frame);
    }
}

static void member_receives(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    bench_member_t *member = ctx;
    pdcp_device_on_frame(&member->device, (uint32_t)(time_us / 1000u), frame);
    member->touched = true;
}

static void app_receives(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    bench_bus_t *bench = ctx;
    arb_app_on_frame(&bench->app, (uint32_t)(time_us / 1000u), frame);
    bench->app_touched = true;
}

/* --- all together --- */

static bool start_member(bench_bus_t *bench, uint8_t number)
{
    static const pdcp_device_port_t no_port = {NULL, NULL, NULL, NULL, NULL, NULL};
    bench_member_t *member = &bench->members[number];
    pdcp_device_record_t record;
    memset(&record, 0xFF, sizeof record); /* sources: unconnected, but for type and profile */
    for (uint8_t i = 0; i < BENCH_CHANNELS; i++) {
        record.sources[i].type = 0;
        record.sources[i].profile = 0;
    }
    record.node_id = (uint8_t)(number + 1u);
    member->bench = bench;
    member->desc = (pdcp_device_desc_t){.identity = {0x0102, 0x0304, (uint16_t)(0x1000u + number)},
                                        .ean13_low = 0x12345678,
                                        .firmware = 0x0100,
                                        .hardware = 0x0100,
                                        .type = 0x0001,
                                        .profile = 0x2120,
                                        .descriptor = {"bench device", 12},
                                        .channels = channels,
                                        .channel_count = BENCH_CHANNELS};
    member->touched = true;
    member->port = sim_bus_attach(&bench->bus, member_receives, member);
    return member->port >= 0 &&
           pdcp_device_init(&member->device, &member->desc, &no_port, &record, number, 0);
}

bool bench_bus_start(bench_bus_t *bench, uint8_t devices)
{
    /* The seed gives outputs ids from 254 downwards (D-BUS-36). */
    const arb_settings_t settings = {.serial = 1, .seed = PDCP_NODE_MAX - PDCP_NODE_MIN};
    memset(bench, 0, sizeof *bench);
    memset(bench->nvm, 0xFF, sizeof bench->nvm);
    sim_bus_init(&bench->bus);
    bench->port = (arb_port_t){.ctx = bench,
                               .can_send = can_send,
                               .host_write = host_write,
                               .nvm_read = nvm_read,
                               .nvm_write = nvm_write,
                               .nvm_status = nvm_status};
    bench->app_port = sim_bus_attach(&bench->bus, app_receives, bench);
    bench->app_touched = true;
    arb_app_init(&bench->app, &bench->port, &settings, 0);
    for (uint8_t i = 0; i < devices; i++) {
        if (!start_member(bench, i)) {
            return false;
        }
    }
    bench->member_count = devices;
    return sim_bus_attach(&bench->bus, listen, bench) >= 0;
}

uint32_t bench_bus_ms(const bench_bus_t *bench)
{
    return (uint32_t)(bench->now_us / 1000u);
}

bool bench_bus_ready(const bench_bus_t *bench)
{
    const pdcp_device_entry_t *devices = bench->app.arb.bus.tables.devices;
    uint8_t ready = 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        ready = (uint8_t)(ready + (devices[i].state == PDCP_PLACE_READY));
    }
    return ready == bench->member_count;
}

static void step_member(bench_member_t *member, uint32_t now_ms)
{
    sim_bus_t *bus = &member->bench->bus;
    can_frame_t frame;
    member->touched = false;
    member->next_ms = pdcp_device_step(&member->device, now_ms);
    while (pdcp_device_tx_peek(&member->device, &frame) && sim_bus_send(bus, member->port, &frame)) {
        pdcp_device_tx_pop(&member->device);
    }
}

/* Steps everybody who received something, whose time has come, or who had no room in his controller. */
static void step_all(bench_bus_t *bench)
{
    const uint32_t now_ms = bench_bus_ms(bench);
    can_frame_t frame;
    for (uint8_t i = 0; i < bench->member_count; i++) {
        bench_member_t *member = &bench->members[i];
        if (member->touched || member->next_ms <= now_ms || pdcp_device_tx_peek(&member->device, &frame)) {
            step_member(member, now_ms);
        }
    }
    if (bench->app_touched || bench->app_next_ms <= now_ms || pdcp_arb_tx_peek(&bench->app.arb) != NULL) {
        bench->app_touched = false;
        bench->app_next_ms = arb_app_step(&bench->app, now_ms);
    }
}

void bench_bus_advance(bench_bus_t *bench)
{
    step_all(bench);
    const uint64_t frame_us = sim_bus_step(&bench->bus, bench->now_us);
    const uint32_t soonest_ms = bench_bus_ms(bench) + 1u;
    uint32_t next_ms = bench->app_next_ms;
    for (uint8_t i = 0; i < bench->member_count; i++) {
        next_ms = bench->members[i].next_ms < next_ms ? bench->members[i].next_ms : next_ms;
    }
    const uint64_t step_us = (uint64_t)(next_ms > soonest_ms ? next_ms : soonest_ms) * 1000u;
    bench->now_us = frame_us < step_us ? frame_us : step_us;
    (void)sim_bus_step(&bench->bus, bench->now_us);
}
