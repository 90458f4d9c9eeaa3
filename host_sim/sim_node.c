#include "sim_node.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "node_state.h"

struct sim_node {
    const node_ini_t *ini;
    pdcp_device_t device;
    pdcp_device_port_t port;
    sim_node_event_fn_t on_event;
    void *ctx;
    sim_node_taken_fn_t on_taken;
    void *taken_ctx;
    uint64_t start_us;
    uint64_t now_us;                           /* of the call that is running */
    bool streaming[PDCP_DEVICE_CHANNELS_MAX];  /* outputs: was able to send at the last step */
    uint64_t due_us[PDCP_DEVICE_CHANNELS_MAX]; /* outputs with a rate: the next value */
    bool received[PDCP_DEVICE_CHANNELS_MAX];   /* inputs: there is something to copy */
    uint8_t last[PDCP_DEVICE_CHANNELS_MAX][8]; /* inputs: the bytes that came last */
    uint8_t last_len[PDCP_DEVICE_CHANNELS_MAX];
    bool dirty; /* the record is not in the state file yet */
    uint32_t store_errors;
};

/* The device's clock has milliseconds and 32 bits. */
static uint32_t ms_of(uint64_t time_us)
{
    return (uint32_t)(time_us / 1000u);
}

/* --- outputs --- */

/* What came last at an input, in the source's units. An input that was not told its source's type and profile
 * (parameter 8) takes its own. False: nothing yet, or a float. */
static bool input_value(const sim_node_t *node, uint8_t channel, profile_type_t *type, int32_t *value)
{
    const pdcp_device_source_t *source = pdcp_device_source(&node->device, channel);
    *type = node->ini->types[channel - 1];
    if (source->type != 0 || source->profile != 0) {
        (void)profile_type_decode(source->type, type);
    }
    return node->received[channel - 1] &&
           profile_type_get(type, node->last[channel - 1], node->last_len[channel - 1], value);
}

static void send_output(sim_node_t *node, uint8_t channel)
{
    const node_signal_t *signal = &node->ini->signals[channel - 1];
    const profile_type_t *type = &node->ini->types[channel - 1];
    int32_t value;
    uint8_t bytes[2];
    if (signal->kind == NODE_SIGNAL_COPY) {
        profile_type_t source;
        if (!input_value(node, signal->source, &source, &value)) {
            return;
        }
        value = node_signal_scale(value, &source, type);
    } else {
        value = node_signal_value(signal, (node->now_us - node->start_us) / 1000u);
    }
    const uint8_t len = profile_type_put(type, value, bytes);
    (void)pdcp_device_send(&node->device, ms_of(node->now_us), channel, bytes, len);
}

/* Whether it is an output that has something to send at a rate, and may. */
static bool is_streaming(const sim_node_t *node, uint8_t channel)
{
    return node->ini->signals[channel - 1].kind != NODE_SIGNAL_NONE &&
           node->ini->signals[channel - 1].rate_ms != 0 &&
           pdcp_device_state(&node->device) == PDCP_DEVICE_BOUND &&
           pdcp_device_channel(&node->device, channel)->enabled;
}

/* Sends what is due on one output. Returns when the next value is. */
static uint64_t step_output(sim_node_t *node, uint8_t channel)
{
    const uint64_t rate_us = (uint64_t)node->ini->signals[channel - 1].rate_ms * 1000u;
    uint64_t *due_us = &node->due_us[channel - 1];
    const bool streaming = is_streaming(node, channel);
    if (streaming && !node->streaming[channel - 1]) {
        *due_us = node->now_us;
    }
    node->streaming[channel - 1] = streaming;
    if (!streaming) {
        return UINT64_MAX;
    }
    if (node->now_us >= *due_us) {
        send_output(node, channel);
        *due_us += rate_us;
        if (*due_us <= node->now_us) {
            *due_us = node->now_us + rate_us;
        }
    }
    return *due_us;
}

/* --- inputs --- */

static void emit(sim_node_t *node, sim_node_event_t *event)
{
    if (node->on_event != NULL) {
        event->time_us = node->now_us;
        event->identity = node->ini->desc.identity;
        node->on_event(node->ctx, event);
    }
}

static void on_input(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len)
{
    sim_node_t *node = ctx;
    if (node->on_taken != NULL) {
        node->on_taken(node->taken_ctx, channel);
    }
    node->received[channel - 1] = true;
    node->last_len[channel - 1] = len;
    memcpy(node->last[channel - 1], data, len);
    if (node->ini->channels[channel - 1].terminal) {
        profile_type_t type;
        sim_node_event_t event = {.channel = channel, .len = len};
        memcpy(event.raw, data, len);
        event.has_value = input_value(node, channel, &type, &event.value);
        emit(node, &event);
    }
    for (uint8_t i = 0; i < node->ini->desc.channel_count; i++) {
        const node_signal_t *signal = &node->ini->signals[i];
        if (signal->kind == NODE_SIGNAL_COPY && signal->source == channel && signal->rate_ms == 0) {
            send_output(node, (uint8_t)(i + 1));
        }
    }
}

static void on_safe(void *ctx, uint8_t channel)
{
    sim_node_t *node = ctx;
    sim_node_event_t event = {
        .channel = channel, .safe = true, .has_value = true, .value = node->ini->channels[channel - 1].safe};
    emit(node, &event);
}

static void on_store(void *ctx, const pdcp_device_record_t *record)
{
    sim_node_t *node = ctx;
    (void)record; /* read when it is written */
    node->dirty = node->ini->state_path != NULL;
}

static void on_reset(void *ctx)
{
    sim_node_t *node = ctx;
    memset(node->received, 0, sizeof node->received);
}

static void save_if_dirty(sim_node_t *node)
{
    if (!node->dirty) {
        return;
    }
    node->dirty = false;
    if (!node_state_save(node->ini->state_path, &node->device.record, node->ini->desc.channel_count)) {
        node->store_errors++;
    }
}

/* --- the whole --- */

sim_node_t *sim_node_open(const node_ini_t *ini, uint32_t seed, uint64_t now_us, sim_node_event_fn_t on_event,
                          void *ctx, char *error, size_t error_size)
{
    pdcp_device_record_t record;
    node_state_blank(&record);
    if (ini->state_path != NULL && !node_state_load(ini->state_path, &record, error, error_size)) {
        return NULL;
    }
    if (record.node_id == 0) {
        record.node_id = ini->first_node_id;
    }
    sim_node_t *node = calloc(1, sizeof *node);
    if (node == NULL) {
        (void)snprintf(error, error_size, "out of memory");
        return NULL;
    }
    node->ini = ini;
    node->on_event = on_event;
    node->ctx = ctx;
    node->start_us = now_us;
    node->now_us = now_us;
    node->port = (pdcp_device_port_t){
        .ctx = node, .input = on_input, .safe = on_safe, .store = on_store, .reset = on_reset};
    if (!pdcp_device_init(&node->device, &ini->desc, &node->port, &record, seed, ms_of(now_us))) {
        (void)snprintf(error, error_size, "a device cannot have these channels");
        free(node);
        return NULL;
    }
    return node;
}

void sim_node_on_taken(sim_node_t *node, sim_node_taken_fn_t on_taken, void *ctx)
{
    node->on_taken = on_taken;
    node->taken_ctx = ctx;
}

void sim_node_close(sim_node_t *node)
{
    if (node != NULL) {
        save_if_dirty(node);
        free(node);
    }
}

void sim_node_on_frame(sim_node_t *node, uint64_t now_us, const can_frame_t *frame)
{
    node->now_us = now_us;
    pdcp_device_on_frame(&node->device, ms_of(now_us), frame);
}

uint64_t sim_node_step(sim_node_t *node, uint64_t now_us)
{
    node->now_us = now_us;
    const uint32_t now_ms = ms_of(now_us);
    const uint32_t deadline_ms = pdcp_device_step(&node->device, now_ms);
    /* Back to 64 bits: the deadline lies less than half of the 32-bit range away. */
    const int32_t wait_ms = (int32_t)(deadline_ms - now_ms);
    uint64_t next_us = (now_us / 1000u + (uint64_t)(wait_ms > 0 ? wait_ms : 0)) * 1000u;
    for (uint8_t i = 0; i < node->ini->desc.channel_count; i++) {
        const uint64_t due_us = step_output(node, (uint8_t)(i + 1));
        next_us = due_us < next_us ? due_us : next_us;
    }
    save_if_dirty(node);
    return next_us;
}

bool sim_node_tx_peek(const sim_node_t *node, can_frame_t *frame)
{
    return pdcp_device_tx_peek(&node->device, frame);
}

void sim_node_tx_pop(sim_node_t *node)
{
    pdcp_device_tx_pop(&node->device);
}

const pdcp_device_t *sim_node_device(const sim_node_t *node)
{
    return &node->device;
}

uint32_t sim_node_store_errors(const sim_node_t *node)
{
    return node->store_errors;
}

void sim_node_format(char line[SIM_NODE_LINE], const sim_node_event_t *event)
{
    char raw[2 * sizeof event->raw + 1] = "";
    char value[16] = "null";
    for (uint8_t i = 0; i < event->len; i++) {
        (void)snprintf(&raw[2u * i], 3, "%02x", event->raw[i]);
    }
    if (event->safe || event->has_value) {
        (void)snprintf(value, sizeof value, "%" PRId32, event->value);
    }
    const int n = snprintf(
        line, SIM_NODE_LINE, "{\"t_ms\":%" PRIu64 ",\"device\":\"%u:%u:%u\",\"channel\":%u,",
        event->time_us / 1000u, event->identity.vid, event->identity.pid, event->identity.sn, event->channel);
    const size_t room = SIM_NODE_LINE - (size_t)n;
    if (event->safe) {
        (void)snprintf(&line[n], room, "\"safe\":true,\"value\":%s}", value);
    } else {
        (void)snprintf(&line[n], room, "\"raw\":\"%s\",\"value\":%s}", raw, value);
    }
}
