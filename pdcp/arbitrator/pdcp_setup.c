#include "pdcp_setup.h"

#include <stddef.h>

#include "pdcp_assert.h"
#include "pdcp_bind.h"
#include "pdcp_bytes.h"
#include "pdcp_ends.h"
#include "pdcp_link.h"

typedef enum { PASS_DEVICE, PASS_SILENCE, PASS_DIRECTION, PASS_CHANNELS } pass_t;

/* A parameter, and what is to be done with it; 0 ends a list. */
typedef uint8_t step_t;
enum {
    MANDATORY = 0x80, /* a failure answer ends the attempt; others get defaults (pdcp-bus.md 6) */
    WRITE = 0x40,
    PARAM = 0x3F
};

/* The acknowledgement time comes first of the two times (D-BUS-27). */
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

static pdcp_channel_t *current_channel(pdcp_bus_t *bus, const pdcp_device_entry_t *device)
{
    return &bus->tables.channels[device->setup_channel];
}

static step_t current_step(pdcp_bus_t *bus, const pdcp_device_entry_t *device)
{
    static const step_t *const lists[] = {device_steps, silence_steps, direction_steps, input_steps};
    const step_t *steps = lists[device->setup_pass];
    if (device->setup_pass == PASS_CHANNELS && current_channel(bus, device)->transfer == PDCP_OUTPUT) {
        steps = output_steps;
    }
    return steps[device->setup_step];
}

static void pause(pdcp_bus_t *bus, const pdcp_device_entry_t *device, uint16_t pause_ms)
{
    pdcp_bus_wake(bus, (uint8_t)(PDCP_TIMER_REQUEST + device->place), pause_ms);
}

/* The device is left bound but unlinked; reported once, and tried again from time to time (D-BUS-17). */
static void give_up(pdcp_bus_t *bus, pdcp_device_entry_t *device)
{
    device->state = PDCP_PLACE_FAILED;
    pause(bus, device, PDCP_SETUP_AGAIN_MS);
    if (!device->setup_again) {
        device->setup_again = true;
        pdcp_bus_count(bus, PDCP_STAT_SETUP_FAILED);
        pdcp_bus_tell_device(bus, PDCP_EVENT_SETUP_FAILED, device->place);
    }
}

/* The step has failed: the same again after a pause, so that on a bad line what is done stays done
 * (D-BUS-17). */
static void fail(pdcp_bus_t *bus, pdcp_device_entry_t *device)
{
    device->setup_attempts++;
    if (device->setup_attempts < PDCP_SETUP_ATTEMPTS) {
        pause(bus, device, PDCP_SETUP_PAUSE_MS);
    } else {
        give_up(bus, device);
    }
}

static void no_room(pdcp_bus_t *bus, pdcp_device_entry_t *device)
{
    pdcp_bus_count(bus, PDCP_STAT_NO_ROOM);
    give_up(bus, device);
}

/* Writes of the setup: transfer enabled 0, and the node id of an output, for which it may have to wait
 * (D-BUS-48). */
static void write_step(pdcp_bus_t *bus, pdcp_device_entry_t *device, uint8_t param)
{
    pdcp_channel_t *channel = current_channel(bus, device);
    uint8_t value = 0;
    if (param == PDCP_OUT_NODE_ID) {
        if (channel->node_id == 0 && pdcp_bind_is_shut(bus)) {
            pause(bus, device, (uint16_t)(PDCP_SHUT_MS - pdcp_bus_age_ms(bus)));
            return;
        }
        if (channel->node_id == 0 && !pdcp_bind_give_output_id(bus, channel)) {
            no_room(bus, device);
            return;
        }
        value = channel->node_id;
    }
    pdcp_request_set(bus, device->place, PDCP_CLIENT_SETUP, channel->index, param, &value, 1);
}

void pdcp_setup_ask(pdcp_bus_t *bus, uint8_t place)
{
    pdcp_device_entry_t *device = pdcp_bus_device(bus, place);
    const step_t step = current_step(bus, device);
    const uint8_t param = (uint8_t)(step & PARAM);
    if ((step & WRITE) != 0) {
        write_step(bus, device, param);
        return;
    }
    const uint8_t index = device->setup_pass == PASS_DEVICE ? 0 : current_channel(bus, device)->index;
    pdcp_request_get(bus, place, PDCP_CLIENT_SETUP, index, param, SETUP_VALUE_MAX);
}

void pdcp_setup_start(pdcp_bus_t *bus, uint8_t place)
{
    pdcp_device_entry_t *device = pdcp_bus_device(bus, place);
    pdcp_assert(pdcp_request_is_idle(bus, place), "pdcp_setup.h: no request is under way");
    device->state = PDCP_PLACE_SETUP;
    device->setup_pass = PASS_DEVICE;
    device->setup_step = 0;
    device->setup_channel = PDCP_NONE;
    device->setup_attempts = 0;
    device->ack_ms = PDCP_ACK_MS;
    device->beacon_ms = PDCP_BEACON_MS;
}

static void enter_next_pass(pdcp_bus_t *bus, pdcp_device_entry_t *device)
{
    device->setup_pass++;
    device->setup_channel = device->first_channel;
    if (device->setup_channel == PDCP_NONE || device->setup_pass > PASS_CHANNELS) {
        device->state = PDCP_PLACE_READY;
        device->setup_again = false;
        pdcp_bus_tell_device(bus, PDCP_EVENT_READY, device->place);
    } else if (device->setup_pass == PASS_CHANNELS && !pdcp_tables_make_needs(&bus->tables, device->place)) {
        no_room(bus, device);
    }
}

/* The next step of this channel, the next channel, the next pass. */
static void go_on(pdcp_bus_t *bus, pdcp_device_entry_t *device)
{
    device->setup_step++;
    device->setup_attempts = 0;
    if (current_step(bus, device) != 0) {
        return;
    }
    device->setup_step = 0;
    if (device->setup_pass != PASS_DEVICE) {
        device->setup_channel = current_channel(bus, device)->next;
    }
    if (device->setup_channel == PDCP_NONE) {
        enter_next_pass(bus, device);
    }
}

static uint16_t clamp(uint16_t value, uint16_t low, uint16_t high)
{
    if (value < low) {
        return low;
    }
    return value > high ? high : value;
}

/* Both times are kept within their limits (D-BUS-13). */
void pdcp_setup_take_time(pdcp_device_entry_t *device, uint8_t param, uint16_t time_ms)
{
    if (param == PDCP_DEV_ACK_TIME) {
        device->ack_ms = clamp(time_ms, PDCP_ACK_MIN_MS, PDCP_ACK_MAX_MS);
    } else if (param == PDCP_DEV_BEACON_INTERVAL) {
        device->beacon_ms = clamp(time_ms, PDCP_BEACON_MIN_MS, PDCP_BEACON_MAX_MS);
    }
}

/* What is known of the node ids of a channel does not hold any more. */
static void forget_id(pdcp_bus_t *bus, pdcp_channel_t *channel)
{
    if (channel->transfer == PDCP_OUTPUT && channel->node_id != 0) {
        pdcp_bind_take_output_id(bus, channel);
    }
    channel->node_id = 0;
}

/* The channels of a device with a higher index than this are no more. */
static void forget_ids_behind(pdcp_bus_t *bus, const pdcp_device_entry_t *device, uint8_t count)
{
    for (uint8_t c = device->first_channel; c != PDCP_NONE; c = bus->tables.channels[c].next) {
        if (bus->tables.channels[c].index > count) {
            forget_id(bus, &bus->tables.channels[c]);
        }
    }
}

/* Takes over a device parameter, a number or two. False: it does not fit, the attempt has failed. */
static bool take_device(pdcp_bus_t *bus, pdcp_device_entry_t *device, uint8_t param, uint16_t low,
                        uint16_t high)
{
    switch (param) {
    case PDCP_DEV_VID_PID:
        if (low != device->identity.vid || high != device->identity.pid) {
            return false;
        }
        break;
    case PDCP_DEV_SERIAL:
        if (low != device->identity.sn) {
            return false;
        }
        break;
    case PDCP_DEV_TYPE_PROFILE:
        device->type = low;
        device->profile = high;
        break;
    case PDCP_DEV_CHANNELS:
        forget_ids_behind(bus, device, (uint8_t)(low & 0xFFu));
        if (!pdcp_tables_set_channels(&bus->tables, device->place, (uint8_t)(low & 0xFFu))) {
            pdcp_bus_count(bus, PDCP_STAT_NO_ROOM);
            return false;
        }
        break;
    default:
        pdcp_setup_take_time(device, param, low);
        break;
    }
    return true;
}

/* Takes over the direction of a channel, and forgets what was known of it if that has changed. */
static bool take_direction(pdcp_bus_t *bus, uint8_t number, uint8_t transfer)
{
    pdcp_channel_t *channel = &bus->tables.channels[number];
    if (transfer != PDCP_INPUT && transfer != PDCP_OUTPUT) {
        return false;
    }
    if (channel->transfer != 0 && channel->transfer != transfer) {
        forget_id(bus, channel);
        pdcp_tables_drop_source(&bus->tables, number);
        channel->link = PDCP_LINK_NONE;
        channel->todo = PDCP_TODO_NONE;
        channel->source.channel = PDCP_NONE;
    }
    channel->transfer = transfer;
    return true;
}

/* What an input names as its source counts only while the arbitrator knows of no link: else the device is
 * told what it should name (D-BUS-38). */
static void take_source(pdcp_bus_t *bus, uint8_t number, uint8_t param, uint16_t low, uint16_t high)
{
    pdcp_channel_t *input = &bus->tables.channels[number];
    if (input->link == PDCP_LINK_NONE) {
        pdcp_tables_take_source(input, param, low, high);
    } else if (!pdcp_tables_is_source(input, param, low, high)) {
        pdcp_link_write(bus, number);
    }
}

/* Takes over a channel parameter; low, high: its numbers if it has some. False: the attempt has failed. */
static bool take_channel(pdcp_bus_t *bus, uint8_t number, const pdcp_reply_t *reply, uint16_t low,
                         uint16_t high)
{
    pdcp_channel_t *channel = &bus->tables.channels[number];
    switch (reply->param) {
    case PDCP_CH_TYPE_PROFILE:
        channel->type = low;
        channel->profile = high;
        break;
    case PDCP_CH_TRANSFER_TYPE:
        return take_direction(bus, number, (uint8_t)(low & 0xFFu));
    case PDCP_CH_ENABLED:
        pdcp_ends_on_disabled(bus, channel);
        break;
    case PDCP_IN_TERMINAL_PROFILE:
        channel->terminal_profile = low;
        break;
    case PDCP_IN_SOURCE_VID_PID: /* of an output: its node id was written */
    case PDCP_IN_SOURCE_SERIAL:
    case PDCP_IN_SOURCE_TYPE:
        if (reply->code == PDCP_GET_PARAMETER) {
            take_source(bus, number, reply->param, low, high);
        }
        break;
    default:
        break;
    }
    return true;
}

/* Takes over a value or a piece of one. Bit strings may have many, numbers stand in the first one. */
static bool take(pdcp_bus_t *bus, pdcp_device_entry_t *device, const pdcp_reply_t *reply)
{
    if (device->setup_pass != PASS_DEVICE &&
        (reply->param == PDCP_CH_REQUIRED || reply->param == PDCP_CH_DESIRED)) {
        pdcp_tables_put_needs(&bus->tables, device->setup_channel, reply->param == PDCP_CH_DESIRED,
                              reply->offset, reply->bytes, reply->len);
        return true;
    }
    if (reply->offset != 0) {
        return true;
    }
    const uint16_t low = pdcp_request_word(reply, 0);
    const uint16_t high = pdcp_request_word(reply, 2);
    return device->setup_pass == PASS_DEVICE ? take_device(bus, device, reply->param, low, high)
                                             : take_channel(bus, device->setup_channel, reply, low, high);
}

pdcp_status_t pdcp_setup_on_reply(pdcp_bus_t *bus, uint8_t place, const pdcp_reply_t *reply)
{
    pdcp_device_entry_t *device = pdcp_bus_device(bus, place);
    bool done_well = false;
    if (reply->status == PDCP_OK) { /* a value, or a piece of one */
        done_well = take(bus, device, reply);
    } else if (reply->status != PDCP_ERR_NO_ANSWER) {
        done_well = (current_step(bus, device) & MANDATORY) == 0;
    }
    if (!done_well) {
        pdcp_request_cancel(bus, place);
        fail(bus, device);
        if (reply->status == PDCP_OK && device->setup_pass == PASS_DEVICE &&
            reply->param <= PDCP_DEV_SERIAL) {
            return PDCP_ERR_UNKNOWN;
        }
    } else if (reply->done) {
        go_on(bus, device);
    }
    return PDCP_OK;
}
