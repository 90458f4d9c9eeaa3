#include "arb_hostevents.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_bytes.h"

/* In the queue an event is its length, then what the message holds: kind, time, data. */

/* Puts the beginning of an event into the queue, of which frames get a part only (D-API-14). Returns where
 * its len bytes of data go; NULL: it is not wanted, or finds no room. */
static uint8_t *put(arb_hostevents_t *events, uint32_t now_ms, arb_event_kind_t kind, uint8_t len)
{
    const uint8_t limit = kind == ARB_EVENT_FRAME ? ARB_EVENT_FRAMES : ARB_EVENT_QUEUE;
    uint8_t *bytes = &events->queue[events->used];
    if (!arb_hostevents_wants(events, kind)) {
        return NULL;
    }
    if (events->used + 1 + ARB_EVENT_HEAD + len > limit) {
        events->counters[kind]++;
        return NULL;
    }
    bytes[0] = (uint8_t)(ARB_EVENT_HEAD + len);
    bytes[1] = (uint8_t)kind;
    pdcp_bytes_put_u32(&bytes[2], now_ms);
    events->used = (uint8_t)(events->used + 1 + bytes[0]);
    return &bytes[1 + ARB_EVENT_HEAD];
}

void arb_hostevents_set_mask(arb_hostevents_t *events, uint16_t mask)
{
    events->mask = mask;
    if (events->out.len != 0 && events->out.sent == 0 &&
        !arb_hostevents_wants(events, (arb_event_kind_t)events->message[ARB_HOST_HEADER])) {
        events->out.len = 0;
    }
}

/* The host is gone, and the stream ends (D-API-14). */
void arb_hostevents_end(arb_hostevents_t *events)
{
    events->mask = 0;
    events->used = 0;
    events->out.len = 0;
    events->out.sent = 0;
}

static void put_device(arb_hostevents_t *events, const pdcp_arb_t *arb, uint32_t now_ms,
                       const pdcp_event_t *event)
{
    const pdcp_device_entry_t *device = &arb->bus.tables.devices[event->place];
    uint8_t *data = put(events, now_ms, event->kind == PDCP_EVENT_BOUND ? ARB_EVENT_BOUND : ARB_EVENT_LOST,
                        ARB_CHANNEL_BYTES);
    if (data != NULL) {
        arb_hostcodec_put_channel(data, &device->identity, device->node_id);
    }
}

/* An input whose link was removed has no source any more: the host is told which one it had. */
static void put_link(arb_hostevents_t *events, const pdcp_arb_t *arb, uint32_t now_ms, uint8_t number)
{
    const pdcp_channel_t *input = &arb->bus.tables.channels[number];
    const pdcp_source_t *removed = pdcp_arb_removed_source(arb, number);
    uint8_t *data = put(events, now_ms, ARB_EVENT_LINK, ARB_EVENT_DATA_MAX);
    if (data == NULL) {
        return;
    }
    arb_hostcodec_put_link(data, &arb->bus.tables, input);
    if (removed != NULL) {
        arb_hostcodec_put_channel(data, &removed->identity, removed->index);
    }
}

/* A bus that is not there at all counts as off; on standby the arbitrator is silent, however the bus is. */
static arb_bus_state_t state_of(const pdcp_arb_t *arb)
{
    if (pdcp_arb_is_on_standby(arb)) {
        return ARB_BUS_SILENT;
    }
    return arb->recovery.state < PDCP_BUS_OFF ? (arb_bus_state_t)arb->recovery.state : ARB_BUS_OFF;
}

static void put_state(arb_hostevents_t *events, const pdcp_arb_t *arb, uint32_t now_ms)
{
    uint8_t *data = put(events, now_ms, ARB_EVENT_BUS_STATE, 3);
    if (data != NULL) {
        data[0] = (uint8_t)state_of(arb);
        data[1] = events->tx_errors;
        data[2] = events->rx_errors;
    }
}

/* Kind 9: the channel and the parameter that differs (D-API-20). */
static void put_audit(arb_hostevents_t *events, const pdcp_arb_t *arb, uint32_t now_ms,
                      const pdcp_event_t *event)
{
    const pdcp_tables_t *tables = &arb->bus.tables;
    const pdcp_channel_t *channel = &tables->channels[event->channel];
    uint8_t *data = put(events, now_ms, ARB_EVENT_AUDIT, ARB_CHANNEL_BYTES + 1);
    if (data != NULL) {
        arb_hostcodec_put_channel(data, &tables->devices[channel->place].identity, channel->index);
        data[ARB_CHANNEL_BYTES] = (uint8_t)event->status;
    }
}

void arb_hostevents_on_event(arb_hostevents_t *events, const pdcp_arb_t *arb, uint32_t now_ms,
                             const pdcp_event_t *event)
{
    const pdcp_event_kind_t kind = event->kind;
    if (kind == PDCP_EVENT_BOUND || kind == PDCP_EVENT_LOST) {
        put_device(events, arb, now_ms, event);
    } else if (kind == PDCP_EVENT_LINK) {
        put_link(events, arb, now_ms, event->channel);
    } else if (kind == PDCP_EVENT_AUDIT) {
        put_audit(events, arb, now_ms, event);
    } else if (kind == PDCP_EVENT_STATE || kind == PDCP_EVENT_SILENT || kind == PDCP_EVENT_STARTED) {
        put_state(events, arb, now_ms);
    }
}

/* Only frames with 11-bit identifiers are events (D-API-14). */
void arb_hostevents_on_frame(arb_hostevents_t *events, uint32_t now_ms, const can_frame_t *frame)
{
    if (frame->kind != CAN_FRAME_BASE || frame->dlc > CAN_FRAME_DATA_MAX) {
        return;
    }
    uint8_t *data = put(events, now_ms, ARB_EVENT_FRAME, (uint8_t)(3 + frame->dlc));
    if (data != NULL) {
        pdcp_bytes_put_u16(&data[0], frame->id);
        data[2] = frame->dlc;
        memcpy(&data[3], frame->data, frame->dlc);
    }
}

void arb_hostevents_on_config(arb_hostevents_t *events, uint32_t now_ms, uint8_t active, uint8_t stored)
{
    uint8_t *data = put(events, now_ms, ARB_EVENT_CONFIG, 2);
    if (data != NULL) {
        data[0] = active;
        data[1] = stored;
    }
}

bool arb_hostevents_next(arb_hostevents_t *events)
{
    while (events->out.len == 0 && events->used != 0) {
        const uint8_t len = events->queue[0];
        memcpy(&events->message[ARB_HOST_HEADER], &events->queue[1], len);
        events->used = (uint8_t)(events->used - 1 - len);
        memmove(events->queue, &events->queue[1 + len], events->used);
        if (arb_hostevents_wants(events, (arb_event_kind_t)events->message[ARB_HOST_HEADER])) {
            events->out.len = arb_hostcodec_finish(events->message, ARB_MSG_EVENT, 0, len);
        }
    }
    return events->out.len != 0;
}
