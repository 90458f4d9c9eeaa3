#include "pdcp_setup.h"

#include <stddef.h>

typedef enum { PASS_DEVICE, PASS_SILENCE, PASS_DIRECTION, PASS_CHANNELS } pass_t;

/* A parameter, and what is to be done with it; 0 ends a list. */
typedef uint8_t step_t;
enum {
    MANDATORY = 0x80, /* a failure answer ends the attempt; others get defaults (pdcp-bus.md 6) */
    WRITE = 0x40,
    PARAM = 0x3F
};

static const step_t device_steps[] = {PDCP_DEV_VID_PID | MANDATORY,
                                      PDCP_DEV_SERIAL,
                                      PDCP_DEV_TYPE_PROFILE,
                                      PDCP_DEV_ACK_TIME,
                                      PDCP_DEV_BEACON_INTERVAL,
                                      PDCP_DEV_CHANNELS | MANDATORY,
                                      0};
static const step_t silence_steps[] = {PDCP_CH_ENABLED | WRITE, 0};
static const step_t direction_steps[] = {PDCP_CH_TRANSFER_TYPE | MANDATORY, 0};
static const step_t input_steps[] = {PDCP_CH_TYPE_PROFILE | MANDATORY,
                                     PDCP_IN_SOURCE_VID_PID,
                                     PDCP_IN_SOURCE_SERIAL,
                                     PDCP_IN_SOURCE_TYPE,
                                     PDCP_CH_REQUIRED,
                                     PDCP_CH_DESIRED,
                                     PDCP_IN_TERMINAL_PROFILE,
                                     0};
static const step_t output_steps[] = {PDCP_CH_TYPE_PROFILE | MANDATORY, PDCP_CH_REQUIRED, PDCP_CH_DESIRED,
                                      PDCP_OUT_NODE_ID | MANDATORY | WRITE, 0};

/* Longest values that a setup has use for: a bit string of 256 channels. */
#define SETUP_VALUE_MAX 32u

static pdcp_channel_t *current_channel(pdcp_bus_t *bus, uint8_t node)
{
    return &bus->nodes.channels[bus->nodes.nodes[node].setup_channel];
}

static const step_t *steps_of(pdcp_bus_t *bus, uint8_t node)
{
    switch ((pass_t)bus->nodes.nodes[node].setup_pass) {
    case PASS_DEVICE:
        return device_steps;
    case PASS_SILENCE:
        return silence_steps;
    case PASS_DIRECTION:
        return direction_steps;
    default:
        return current_channel(bus, node)->transfer == PDCP_INPUT ? input_steps : output_steps;
    }
}

/* The device is left bound but unlinked; reported once, and tried again from time to time. */
static void give_up(pdcp_bus_t *bus, uint8_t node)
{
    pdcp_node_t *device = pdcp_bus_node(bus, node);
    device->state = PDCP_NODE_FAILED;
    pdcp_bus_wake(bus, (uint8_t)(PDCP_TIMER_REQUEST + node), PDCP_SETUP_AGAIN_MS);
    if (!device->setup_again) {
        device->setup_again = true;
        pdcp_bus_count(bus, PDCP_STAT_SETUP_FAILED);
        pdcp_bus_tell_node(bus, PDCP_EVENT_SETUP_FAILED, node);
    }
}

/* The step has failed: the same again after a pause, so that on a bad line what is done stays done. */
static void fail(pdcp_bus_t *bus, uint8_t node)
{
    pdcp_node_t *device = pdcp_bus_node(bus, node);
    device->setup_attempts++;
    if (device->setup_attempts < PDCP_SETUP_ATTEMPTS) {
        pdcp_bus_wake(bus, (uint8_t)(PDCP_TIMER_REQUEST + node), PDCP_SETUP_PAUSE_MS);
    } else {
        give_up(bus, node);
    }
}

static void no_room(pdcp_bus_t *bus, uint8_t node)
{
    pdcp_bus_count(bus, PDCP_STAT_NO_ROOM);
    give_up(bus, node);
}

/* Writes of the setup: transfer enabled 0, and the node id of an output. False: no node id is left. */
static bool write_step(pdcp_bus_t *bus, uint8_t node, uint8_t param)
{
    pdcp_channel_t *channel = current_channel(bus, node);
    uint8_t value = 0;
    if (param == PDCP_OUT_NODE_ID) {
        if (channel->node_id == 0) {
            pdcp_nodes_set_output_id(&bus->nodes, bus->nodes.nodes[node].setup_channel,
                                     pdcp_bind_output_id(bus));
        }
        value = channel->node_id;
        if (value == 0) {
            return false;
        }
    }
    pdcp_request_set(bus, node, PDCP_CLIENT_SETUP, channel->index, param, &value, 1);
    return true;
}

void pdcp_setup_ask(pdcp_bus_t *bus, uint8_t node)
{
    pdcp_node_t *device = pdcp_bus_node(bus, node);
    device->setup_due = false;
    const step_t step = steps_of(bus, node)[device->setup_step];
    if ((step & WRITE) != 0) {
        if (!write_step(bus, node, (uint8_t)(step & PARAM))) {
            no_room(bus, node);
        }
        return;
    }
    const uint8_t index = device->setup_pass == PASS_DEVICE ? 0 : current_channel(bus, node)->index;
    pdcp_request_get(bus, node, PDCP_CLIENT_SETUP, index, (uint8_t)(step & PARAM), SETUP_VALUE_MAX);
}

void pdcp_setup_start(pdcp_bus_t *bus, uint8_t node)
{
    pdcp_node_t *device = pdcp_bus_node(bus, node);
    device->state = PDCP_NODE_SETUP;
    device->setup_pass = PASS_DEVICE;
    device->setup_step = 0;
    device->setup_channel = PDCP_NONE;
    device->setup_attempts = 0;
    device->setup_due = true;
    device->ack_ms = PDCP_ACK_MS;
    device->beacon_ms = PDCP_BEACON_MS;
}

static void enter_pass(pdcp_bus_t *bus, uint8_t node, pass_t pass)
{
    pdcp_node_t *device = pdcp_bus_node(bus, node);
    if (device->first_channel == PDCP_NONE || pass > PASS_CHANNELS) {
        device->state = PDCP_NODE_READY;
        device->setup_again = false;
        pdcp_bus_tell_node(bus, PDCP_EVENT_READY, node);
        return;
    }
    if (pass == PASS_CHANNELS && !pdcp_nodes_make_needs(&bus->nodes, node)) {
        no_room(bus, node);
        return;
    }
    device->setup_pass = (uint8_t)pass;
    device->setup_channel = device->first_channel;
    device->setup_due = true;
}

/* The next step of this channel, the next channel, the next pass. */
static void go_on(pdcp_bus_t *bus, uint8_t node)
{
    pdcp_node_t *device = pdcp_bus_node(bus, node);
    device->setup_step++;
    device->setup_attempts = 0;
    device->setup_due = true;
    if (steps_of(bus, node)[device->setup_step] != 0) {
        return;
    }
    device->setup_step = 0;
    if (device->setup_pass != PASS_DEVICE) {
        device->setup_channel = current_channel(bus, node)->next;
        if (device->setup_channel != PDCP_NONE) {
            return;
        }
    }
    device->setup_due = false;
    enter_pass(bus, node, (pass_t)(device->setup_pass + 1));
}

static uint16_t clamp(uint16_t value, uint16_t low, uint16_t high)
{
    if (value < low) {
        return low;
    }
    return value > high ? high : value;
}

void pdcp_setup_take_time(pdcp_node_t *device, uint8_t param, const uint8_t *value, uint8_t len)
{
    const uint16_t time_ms = pdcp_value_u16(value, len, 0);
    if (param == PDCP_DEV_ACK_TIME) {
        device->ack_ms = clamp(time_ms, PDCP_ACK_MIN_MS, PDCP_ACK_MAX_MS);
    } else if (param == PDCP_DEV_BEACON_INTERVAL) {
        device->beacon_ms = clamp(time_ms, PDCP_BEACON_MIN_MS, PDCP_BEACON_MAX_MS);
    }
}

/* Takes over a device parameter. False: it does not fit, the attempt has failed. */
static bool take_device(pdcp_bus_t *bus, uint8_t node, uint8_t param, const uint8_t *value, uint8_t len)
{
    pdcp_node_t *device = pdcp_bus_node(bus, node);
    const uint16_t low = pdcp_value_u16(value, len, 0);
    const uint16_t high = pdcp_value_u16(value, len, 2);
    switch (param) {
    case PDCP_DEV_VID_PID:
        return low == device->identity.vid && high == device->identity.pid;
    case PDCP_DEV_SERIAL:
        return low == device->identity.sn;
    case PDCP_DEV_TYPE_PROFILE:
        device->type = low;
        device->profile = high;
        return true;
    case PDCP_DEV_ACK_TIME:
    case PDCP_DEV_BEACON_INTERVAL:
        pdcp_setup_take_time(device, param, value, len);
        return true;
    default: /* PDCP_DEV_CHANNELS */
        if (!pdcp_nodes_set_channels(&bus->nodes, node, pdcp_value_u8(value, len, 0))) {
            pdcp_bus_count(bus, PDCP_STAT_NO_ROOM);
            return false;
        }
        return true;
    }
}

/* Forgets what was known of a channel whose direction has changed. */
static void set_direction(pdcp_bus_t *bus, uint8_t number, uint8_t transfer)
{
    pdcp_channel_t *channel = &bus->nodes.channels[number];
    if (channel->transfer != 0 && channel->transfer != transfer) {
        pdcp_nodes_set_output_id(&bus->nodes, number, 0);
        pdcp_nodes_drop_feed(&bus->nodes, number);
        channel->link = PDCP_LINK_NONE;
        channel->todo = PDCP_TODO_NONE;
        channel->feed = PDCP_NONE;
    }
    channel->transfer = transfer;
}

/* Takes over a channel parameter; bit strings come in pieces. False: the attempt has failed. */
static bool take_channel(pdcp_bus_t *bus, uint8_t node, const pdcp_reply_t *reply)
{
    const uint8_t number = pdcp_bus_node(bus, node)->setup_channel;
    pdcp_channel_t *channel = &bus->nodes.channels[number];
    const uint8_t len = (uint8_t)reply->len;
    const uint16_t low = pdcp_value_u16(reply->bytes, len, 0);
    switch (reply->param) {
    case PDCP_CH_TYPE_PROFILE:
        channel->type = low;
        channel->profile = pdcp_value_u16(reply->bytes, len, 2);
        break;
    case PDCP_CH_TRANSFER_TYPE: {
        const uint8_t transfer = (uint8_t)(low & 0xFFu);
        if (transfer != PDCP_INPUT && transfer != PDCP_OUTPUT) {
            return false;
        }
        set_direction(bus, number, transfer);
        break;
    }
    case PDCP_CH_REQUIRED:
    case PDCP_CH_DESIRED:
        pdcp_nodes_put_needs(&bus->nodes, number, reply->param == PDCP_CH_DESIRED, reply->offset,
                             reply->bytes, reply->len);
        break;
    case PDCP_IN_TERMINAL_PROFILE:
        channel->terminal_profile = low;
        break;
    default: /* its own idea of its source counts only while the arbitrator knows of no link */
        if (channel->link == PDCP_LINK_NONE) {
            pdcp_nodes_take_source(channel, reply->param, reply->bytes, len);
        }
        break;
    }
    return true;
}

/* Takes over a value or a piece of one. Numbers stand in the first piece; bit strings may have more. */
static bool take(pdcp_bus_t *bus, uint8_t node, const pdcp_reply_t *reply)
{
    const bool is_device = bus->nodes.nodes[node].setup_pass == PASS_DEVICE;
    const bool is_bits = !is_device && (reply->param == PDCP_CH_REQUIRED || reply->param == PDCP_CH_DESIRED);
    if (reply->offset != 0 && !is_bits) {
        return true;
    }
    if (reply->code == PDCP_SET_PARAMETER) {
        if (reply->param == PDCP_CH_ENABLED) {
            current_channel(bus, node)->enabled = false;
        }
        return true;
    }
    if (is_device) {
        return take_device(bus, node, reply->param, reply->bytes, (uint8_t)reply->len);
    }
    return take_channel(bus, node, reply);
}

pdcp_status_t pdcp_setup_on_reply(pdcp_bus_t *bus, uint8_t node, const pdcp_reply_t *reply)
{
    static const uint8_t nothing[1] = {0};
    const pdcp_node_t *device = pdcp_bus_node(bus, node);
    const bool mandatory = (steps_of(bus, node)[device->setup_step] & MANDATORY) != 0;
    const bool has_value = !reply->done || reply->status == PDCP_OK;
    pdcp_reply_t part = *reply;
    if (part.bytes == NULL) {
        part.bytes = nothing;
    }
    if (has_value && !take(bus, node, &part)) {
        const bool other = device->setup_pass == PASS_DEVICE && reply->param <= PDCP_DEV_SERIAL;
        pdcp_request_cancel(bus, node);
        fail(bus, node);
        return other ? PDCP_ERR_UNKNOWN : PDCP_OK;
    }
    if (!reply->done) {
        return PDCP_OK;
    }
    if (reply->status == PDCP_ERR_NO_ANSWER || (reply->status != PDCP_OK && mandatory)) {
        fail(bus, node);
    } else {
        go_on(bus, node);
    }
    return PDCP_OK;
}
