#include "pdcp_device.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_codec.h"
#include "pdcp_device_bind.h"
#include "pdcp_device_bulk.h"
#include "pdcp_device_param.h"
#include "pdcp_time.h"

enum {
    UPDATE_RETRY_MS = 1000, /* D-BUS-19 */
    NO_ROOM_MS = 10         /* until a request that found the queue full is tried again */
};

/* --- sending --- */

/* A full queue or a channel that may not send: the caller hears it, the bus does not. Only enabled outputs of
 * a bound device may (D-BUS-16). */
static bool may_send(const pdcp_device_t *dev, uint32_t now_ms, uint8_t channel)
{
    if (dev->state != PDCP_DEVICE_BOUND || channel == 0 || channel > dev->desc->channel_count ||
        dev->desc->channels[channel - 1].direction != PDCP_OUTPUT) {
        return false;
    }
    const bool suspended =
        dev->suspended && (dev->suspended_for_good || pdcp_time_before(now_ms, dev->suspend_deadline_ms));
    const pdcp_device_channel_t *state = &dev->channels[channel - 1];
    return state->enabled && state->node_id != 0 && !suspended;
}

bool pdcp_device_send(pdcp_device_t *dev, uint32_t now_ms, uint8_t channel, const uint8_t *data, uint8_t len)
{
    if (!may_send(dev, now_ms, channel) || len > CAN_FRAME_DATA_MAX) {
        return false;
    }
    if (!pdcp_device_tx_has_room(dev)) {
        dev->stats.tx_full++;
        return false;
    }
    can_frame_t frame;
    memset(&frame, 0, sizeof frame);
    frame.id = pdcp_can_id(PDCP_PRIORITY_HIGH, false, dev->channels[channel - 1].node_id);
    frame.dlc = len;
    if (len != 0) {
        memcpy(frame.data, data, len);
    }
    dev->stats.data_out++;
    return pdcp_device_tx_frame(dev, &frame);
}

/* --- states --- */

static void safe_inputs(pdcp_device_t *dev)
{
    for (uint8_t i = 0; i < dev->desc->channel_count; i++) {
        const pdcp_device_channel_desc_t *desc = &dev->desc->channels[i];
        if (desc->direction == PDCP_INPUT && desc->terminal && dev->port->safe != NULL) {
            dev->port->safe(dev->port->ctx, (uint8_t)(i + 1));
        }
    }
}

static void enter_asking(pdcp_device_t *dev, uint32_t now_ms)
{
    dev->suspended = false;
    dev->bulk.mode = PDCP_DEVICE_BULK_IDLE;
    pdcp_device_param_reset(dev);
    pdcp_device_bind_start(dev, now_ms);
}

static void enter_bound(pdcp_device_t *dev, uint32_t now_ms)
{
    dev->beaconed_ms = now_ms - dev->beacon_ms; /* the first one at once */
    dev->update_deadline_ms = now_ms;
    for (uint8_t i = 0; i < dev->desc->channel_count; i++) {
        dev->channels[i].asking = dev->desc->channels[i].direction == PDCP_INPUT &&
                                  pdcp_device_source_connected(&dev->record.sources[i]);
    }
    if (dev->record.node_id != dev->node_id) {
        dev->record.node_id = dev->node_id;
        if (dev->port->store != NULL) {
            dev->port->store(dev->port->ctx, &dev->record);
        }
    }
}

/* Nobody watches what it sends and hears, and its ids may be given to others meanwhile: it takes no part
 * until an arbitrator enables its channels again (D-BUS-35). */
static void enter_alone(pdcp_device_t *dev)
{
    dev->bulk.mode = PDCP_DEVICE_BULK_IDLE;
    for (uint8_t i = 0; i < dev->desc->channel_count; i++) {
        dev->channels[i].enabled = false;
    }
    dev->listen_changes++;
    safe_inputs(dev);
}

static void enter(pdcp_device_t *dev, pdcp_device_state_t state, uint32_t now_ms)
{
    const uint8_t before = dev->state;
    dev->state = (uint8_t)state;
    if (state == PDCP_DEVICE_ASKING) {
        enter_asking(dev, now_ms);
    } else if (state == PDCP_DEVICE_ALONE) {
        enter_alone(dev);
    } else if (before == PDCP_DEVICE_ASKING) {
        enter_bound(dev, now_ms);
    }
}

/* --- requests of the arbitrator --- */

typedef void (*handler_t)(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);

static void on_get(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    (void)now_ms;
    pdcp_device_value_t value;
    pdcp_msg_t answer = *msg;
    if (!pdcp_device_param_get(dev, msg->param, msg->channel, &value)) {
        pdcp_device_tx_answer(dev, msg, PDCP_FAILURE);
    } else if (value.len > PDCP_VALUE_MAX) {
        pdcp_device_tx_answer(dev, msg, PDCP_USE_BULK);
    } else {
        answer.len = (uint8_t)value.len;
        if (value.len != 0) {
            memcpy(answer.value, value.bytes, value.len);
        }
        pdcp_device_tx_answer(dev, &answer, PDCP_SUCCESS);
    }
}

static void on_set(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    (void)now_ms;
    const bool good = pdcp_device_param_set(dev, msg->param, msg->channel, msg->value, msg->len);
    pdcp_device_tx_answer(dev, msg, good ? PDCP_SUCCESS : PDCP_FAILURE);
}

static void on_suspend(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    dev->suspended = true;
    dev->suspended_for_good = msg->word == 0;
    dev->suspend_deadline_ms = now_ms + msg->word;
}

static void on_release(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    (void)now_ms;
    (void)msg;
    dev->suspended = false;
}

static void on_beacon(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    (void)dev; /* that it was heard is all there is to know */
    (void)now_ms;
    (void)msg;
}

static void on_reset(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    pdcp_txq_init(&dev->txq); /* nothing of the old life may follow the answer */
    pdcp_device_tx_answer(dev, msg, PDCP_SUCCESS);
    enter(dev, PDCP_DEVICE_ASKING, now_ms);
    safe_inputs(dev);
    if (dev->port->reset != NULL) {
        dev->port->reset(dev->port->ctx);
    }
}

static void on_update_answer(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    (void)now_ms;
    if (msg->channel == 0 || msg->channel > dev->desc->channel_count ||
        !dev->channels[msg->channel - 1].asking) {
        dev->stats.drop_late++;
        return;
    }
    dev->channels[msg->channel - 1].asking = false;
    dev->channels[msg->channel - 1].ask_due = false;
}

static void on_late_answer(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    (void)now_ms;
    (void)msg;
    dev->stats.drop_late++;
}

/* Counted, and not answered (D-BUS-4). */
static void on_deprecated(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    (void)now_ms;
    (void)msg;
    dev->stats.drop_deprecated++;
}

/* What an arbitrator may send; any other code has the wrong direction. */
static const struct {
    uint8_t code;
    bool to_all;   /* also as a broadcast */
    bool answered; /* with success, here; the others answer for themselves or not at all */
    handler_t handler;
} requests[] = {
    {PDCP_GET_PARAMETER, false, false, on_get},
    {PDCP_SET_PARAMETER, false, false, on_set},
    {PDCP_SUSPEND, true, true, on_suspend},
    {PDCP_RELEASE, true, true, on_release},
    {PDCP_BEACON, true, false, on_beacon},
    {PDCP_RESET, false, false, on_reset},
    {PDCP_BULK_GET, false, false, pdcp_device_bulk_on_get},
    {PDCP_BULK_SET, false, false, pdcp_device_bulk_on_set},
    {PDCP_BULK_DATA, false, false, pdcp_device_bulk_on_packet},
    {PDCP_BULK_DATA | PDCP_ANSWER, false, false, pdcp_device_bulk_on_ack},
    {PDCP_UPDATE_CHANNEL | PDCP_ANSWER, false, false, on_update_answer},
    {PDCP_BIND_DEVICE | PDCP_ANSWER, false, false, on_late_answer},
    {PDCP_GET_DEVICE_INFO, true, false, on_deprecated},
    {PDCP_SET_NODE_ID, true, false, on_deprecated},
    {PDCP_IND_GET_PARAMETER | PDCP_ANSWER, true, false, on_deprecated},
    {PDCP_IND_SET_PARAMETER | PDCP_ANSWER, true, false, on_deprecated},
};

static void dispatch(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg, bool broadcast)
{
    for (unsigned i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        if (requests[i].code != msg->code || (broadcast && !requests[i].to_all)) {
            continue;
        }
        requests[i].handler(dev, now_ms, msg);
        if (requests[i].answered && !broadcast) {
            pdcp_device_tx_answer(dev, msg, PDCP_SUCCESS);
        }
        return;
    }
    dev->stats.drop_direction++;
}

/* A malformed frame is counted by its cause, and not answered (D-BUS-5). */
static bool decode(pdcp_device_t *dev, const can_frame_t *frame, pdcp_msg_t *msg)
{
    switch (pdcp_codec_decode(frame, msg)) {
    case PDCP_DECODE_OK:
        return true;
    case PDCP_DECODE_BAD_DLC:
        dev->stats.drop_bad_dlc++;
        return false;
    default:
        dev->stats.drop_bad_code++;
        return false;
    }
}

/* --- receiving --- */

static void on_arbitrator(pdcp_device_t *dev, uint32_t now_ms, const can_frame_t *frame)
{
    const uint8_t node = pdcp_id_node(frame->id);
    pdcp_msg_t msg;
    dev->heard_ms = now_ms;
    if (dev->state == PDCP_DEVICE_ALONE) {
        enter(dev, PDCP_DEVICE_BOUND, now_ms);
    }
    if ((node != PDCP_NODE_BROADCAST && node != dev->node_id) || !decode(dev, frame, &msg)) {
        return;
    }
    if (dev->state != PDCP_DEVICE_ASKING) {
        dispatch(dev, now_ms, &msg, node == PDCP_NODE_BROADCAST);
    } else if (msg.code == (PDCP_BIND_DEVICE | PDCP_ANSWER) && node != PDCP_NODE_BROADCAST) {
        if (pdcp_device_bind_on_answer(dev, now_ms, &msg)) {
            enter(dev, PDCP_DEVICE_BOUND, now_ms);
        }
    } else {
        dev->stats.drop_unbound++;
    }
}

/* Channel data: taken by every enabled input that names this node id in parameter 7 (D-BUS-16). */
static void on_data(pdcp_device_t *dev, const can_frame_t *frame)
{
    const uint8_t node = pdcp_id_node(frame->id);
    bool taken = false;
    for (uint8_t i = 0; i < dev->desc->channel_count && node != 0; i++) {
        const pdcp_device_channel_t *state = &dev->channels[i];
        if (dev->desc->channels[i].direction == PDCP_INPUT && state->enabled &&
            state->source_channel == node) {
            taken = true;
            if (dev->port->input != NULL) {
                dev->port->input(dev->port->ctx, (uint8_t)(i + 1), frame->data, frame->dlc);
            }
        }
    }
    dev->stats.data_in += taken ? 1u : 0u;
}

void pdcp_device_on_frame(pdcp_device_t *dev, uint32_t now_ms, const can_frame_t *frame)
{
    const bool binding = pdcp_id_priority(frame->id) == PDCP_PRIORITY_BINDING;
    dev->stats.rx++;
    if (frame->kind != CAN_FRAME_BASE) {
        dev->stats.drop_kind++;
    } else if (pdcp_id_from_arbitrator(frame->id)) {
        if (binding) {
            dev->stats.drop_unused_id++;
        } else {
            on_arbitrator(dev, now_ms, frame);
        }
    } else if (!binding && dev->state == PDCP_DEVICE_BOUND && frame->dlc <= CAN_FRAME_DATA_MAX) {
        on_data(dev, frame);
    }
}

/* --- time --- */

static uint32_t step_beacon(pdcp_device_t *dev, uint32_t now_ms)
{
    if (pdcp_time_reached(now_ms, dev->beaconed_ms + dev->beacon_ms)) {
        pdcp_device_tx_beacon(dev);
        dev->beaconed_ms += dev->beacon_ms;
        if (pdcp_time_reached(now_ms, dev->beaconed_ms + dev->beacon_ms)) {
            dev->beaconed_ms = now_ms; /* late by more than one: go on from here */
        }
    }
    return dev->beaconed_ms + dev->beacon_ms;
}

/* Update Data Channel for every input that has a source and no answer yet (pdcp-bus.md 7, D-BUS-19). */
static uint32_t step_updates(pdcp_device_t *dev, uint32_t now_ms)
{
    const bool again = pdcp_time_reached(now_ms, dev->update_deadline_ms);
    uint32_t next_ms = now_ms + PDCP_TIME_FAR_MS;
    if (again) {
        dev->update_deadline_ms = now_ms + UPDATE_RETRY_MS;
    }
    for (uint8_t i = 0; i < dev->desc->channel_count; i++) {
        pdcp_device_channel_t *state = &dev->channels[i];
        if (!state->asking) {
            continue;
        }
        state->ask_due = state->ask_due || again;
        next_ms = pdcp_time_earlier(next_ms, dev->update_deadline_ms);
        if (state->ask_due && pdcp_device_tx_has_room(dev)) {
            const pdcp_msg_t request = {.code = PDCP_UPDATE_CHANNEL, .channel = (uint8_t)(i + 1)};
            pdcp_device_tx_msg(dev, &request);
            state->ask_due = false;
        } else if (state->ask_due) {
            next_ms = pdcp_time_earlier(next_ms, now_ms + NO_ROOM_MS);
        }
    }
    return next_ms;
}

static uint32_t step_alone(pdcp_device_t *dev, uint32_t now_ms)
{
    return step_beacon(dev, now_ms);
}

/* A bound device beacons and asks for its sources until no arbitrator was heard for too long (D-BUS-16). */
static uint32_t step_bound(pdcp_device_t *dev, uint32_t now_ms)
{
    const uint32_t silence_ms = dev->heard_ms + PDCP_DEVICE_SILENCE_MS;
    if (pdcp_time_reached(now_ms, silence_ms)) {
        enter(dev, PDCP_DEVICE_ALONE, now_ms);
        return step_alone(dev, now_ms);
    }
    uint32_t next_ms = pdcp_time_earlier(silence_ms, step_beacon(dev, now_ms));
    next_ms = pdcp_time_earlier(next_ms, step_updates(dev, now_ms));
    return pdcp_time_earlier(next_ms, pdcp_device_bulk_step(dev, now_ms));
}

uint32_t pdcp_device_step(pdcp_device_t *dev, uint32_t now_ms)
{
    static uint32_t (*const steps[])(pdcp_device_t *, uint32_t) = {
        [PDCP_DEVICE_ASKING] = pdcp_device_bind_step,
        [PDCP_DEVICE_BOUND] = step_bound,
        [PDCP_DEVICE_ALONE] = step_alone,
    };
    if (dev->suspended && !dev->suspended_for_good && pdcp_time_reached(now_ms, dev->suspend_deadline_ms)) {
        dev->suspended = false;
    }
    const uint32_t next_ms = steps[dev->state](dev, now_ms);
    return dev->suspended && !dev->suspended_for_good ? pdcp_time_earlier(next_ms, dev->suspend_deadline_ms)
                                                      : next_ms;
}

/* --- start and readers --- */

/* An input without a source (D-BUS-7). */
static void unconnect(pdcp_device_source_t *source)
{
    memset(source, 0, sizeof *source);
    source->identity.vid = PDCP_NO_SOURCE_WORD;
    source->identity.pid = PDCP_NO_SOURCE_WORD;
    source->identity.sn = PDCP_NO_SOURCE_WORD;
    source->channel = PDCP_NO_SOURCE_INDEX;
}

uint8_t pdcp_device_listens_to(const pdcp_device_t *dev, uint8_t *ids, uint8_t max)
{
    uint8_t count = 0;
    for (uint8_t i = 0; i < dev->desc->channel_count && count < max; i++) {
        if (dev->channels[i].enabled && dev->channels[i].source_channel != 0) {
            ids[count++] = dev->channels[i].source_channel;
        }
    }
    return count;
}

static bool usable(const pdcp_device_desc_t *desc)
{
    if (desc->channel_count > PDCP_DEVICE_CHANNELS_MAX) {
        return false;
    }
    for (uint8_t i = 0; i < desc->channel_count; i++) {
        if (desc->channels[i].direction != PDCP_INPUT && desc->channels[i].direction != PDCP_OUTPUT) {
            return false;
        }
    }
    return true;
}

bool pdcp_device_init(pdcp_device_t *dev, const pdcp_device_desc_t *desc, const pdcp_device_port_t *port,
                      const pdcp_device_record_t *record, uint32_t seed, uint32_t now_ms)
{
    if (!usable(desc)) {
        return false;
    }
    memset(dev, 0, sizeof *dev);
    dev->desc = desc;
    dev->port = port;
    pdcp_device_bind_seed(dev, seed);
    pdcp_txq_init(&dev->txq);
    for (uint8_t i = 0; i < PDCP_DEVICE_CHANNELS_MAX; i++) {
        unconnect(&dev->record.sources[i]);
    }
    if (record != NULL) {
        dev->record = *record;
        if (!pdcp_device_bind_is_id(dev->record.node_id)) {
            dev->record.node_id = 0;
        }
    }
    enter(dev, PDCP_DEVICE_ASKING, now_ms);
    return true;
}
