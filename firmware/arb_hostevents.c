#include "arb_hostevents.h"

#include <string.h>

/* In the ring an event is its length, then what the message holds: kind, time, data. */

static void ring_put(arb_hostevents_t *events, uint8_t byte)
{
    events->ring[(events->first + events->used) % ARB_EVENT_RING] = byte;
    events->used++;
}

static uint8_t ring_take(arb_hostevents_t *events)
{
    const uint8_t byte = events->ring[events->first];
    events->first = (uint8_t)((events->first + 1) % ARB_EVENT_RING);
    events->used--;
    return byte;
}

static void put(arb_hostevents_t *events, uint32_t now_ms, arb_event_kind_t kind, const uint8_t *data,
                uint8_t len)
{
    const uint8_t limit = kind == ARB_EVENT_FRAME ? ARB_EVENT_FRAMES : ARB_EVENT_RING;
    if (!arb_hostevents_wants(events, kind)) {
        return;
    }
    if (1u + ARB_EVENT_HEAD + len + events->used > limit) {
        events->dropped[kind - 1]++;
        return;
    }
    ring_put(events, (uint8_t)(ARB_EVENT_HEAD + len));
    ring_put(events, (uint8_t)kind);
    for (uint8_t shift = 0; shift < 32; shift = (uint8_t)(shift + 8)) {
        ring_put(events, (uint8_t)((now_ms >> shift) & 0xFFu));
    }
    for (uint8_t i = 0; i < len; i++) {
        ring_put(events, data[i]);
    }
}

void arb_hostevents_set_mask(arb_hostevents_t *events, uint8_t mask)
{
    events->mask = mask;
    if (events->message_len != 0 && events->message_sent == 0 &&
        !arb_hostevents_wants(events, (arb_event_kind_t)events->message[ARB_HOST_HEADER])) {
        events->message_len = 0;
    }
}

void arb_hostevents_end(arb_hostevents_t *events)
{
    events->mask = 0;
    events->used = 0;
    events->message_len = 0;
    events->message_sent = 0;
}

static void put_device(arb_hostevents_t *events, uint32_t now_ms, arb_event_kind_t kind,
                       const pdcp_node_t *node)
{
    uint8_t data[7];
    arb_host_put_channel(data, &node->identity, node->node_id);
    put(events, now_ms, kind, data, sizeof data);
}

/* An input whose link was taken away has no source any more: the job that has done it still knows. */
static void put_link(arb_hostevents_t *events, const pdcp_arb_t *arb, uint32_t now_ms, uint8_t number)
{
    const pdcp_channel_t *input = &arb->bus.nodes.channels[number];
    const bool removed = input->link == PDCP_LINK_NONE && arb->bus.link.input == number &&
                         arb->bus.link.kind == PDCP_TODO_REMOVE;
    uint8_t data[ARB_EVENT_DATA_MAX];
    if (removed) {
        arb_host_put_channel(&data[0], &arb->bus.link.old_source, arb->bus.link.old_index);
    } else {
        arb_host_put_channel(&data[0], &input->source, input->source_index);
    }
    arb_host_put_channel(&data[7], &arb->bus.nodes.nodes[input->node].identity, input->index);
    data[14] = input->link;
    put(events, now_ms, ARB_EVENT_LINK, data, sizeof data);
}

static void put_state(arb_hostevents_t *events, uint32_t now_ms, arb_bus_state_t state)
{
    const uint8_t data[] = {(uint8_t)state, events->tx_errors, events->rx_errors};
    put(events, now_ms, ARB_EVENT_BUS_STATE, data, sizeof data);
}

/* A bus that is not there at all counts as off; on standby the arbitrator is silent, however the bus is. */
static arb_bus_state_t state_of(const pdcp_arb_t *arb)
{
    if (arb->silent) {
        return ARB_BUS_SILENT;
    }
    return arb->recovery.state < PDCP_BUS_OFF ? (arb_bus_state_t)arb->recovery.state : ARB_BUS_OFF;
}

void arb_hostevents_on_event(arb_hostevents_t *events, const pdcp_arb_t *arb, uint32_t now_ms,
                             const pdcp_event_t *event)
{
    if (events->mask == 0) {
        return;
    }
    switch (event->kind) {
    case PDCP_EVENT_BOUND:
        put_device(events, now_ms, ARB_EVENT_BOUND, &arb->bus.nodes.nodes[event->node]);
        break;
    case PDCP_EVENT_LOST:
        put_device(events, now_ms, ARB_EVENT_LOST, &arb->bus.nodes.nodes[event->node]);
        break;
    case PDCP_EVENT_LINK:
        put_link(events, arb, now_ms, event->channel);
        break;
    case PDCP_EVENT_STATE:
    case PDCP_EVENT_SILENT:
    case PDCP_EVENT_STARTED:
        put_state(events, now_ms, state_of(arb));
        break;
    default:
        break;
    }
}

void arb_hostevents_on_frame(arb_hostevents_t *events, uint32_t now_ms, const can_frame_t *frame)
{
    uint8_t data[3 + CAN_FRAME_DATA_MAX];
    if (frame->kind != CAN_FRAME_BASE || frame->dlc > CAN_FRAME_DATA_MAX) {
        return;
    }
    arb_host_put_u16(&data[0], frame->id);
    data[2] = frame->dlc;
    memcpy(&data[3], frame->data, frame->dlc);
    put(events, now_ms, ARB_EVENT_FRAME, data, (uint8_t)(3 + frame->dlc));
}

void arb_hostevents_on_config(arb_hostevents_t *events, uint32_t now_ms, uint8_t active, uint8_t stored)
{
    const uint8_t data[] = {active, stored};
    put(events, now_ms, ARB_EVENT_CONFIG, data, sizeof data);
}

bool arb_hostevents_next(arb_hostevents_t *events)
{
    while (events->message_len == 0 && events->used != 0) {
        const uint8_t len = ring_take(events);
        for (uint8_t i = 0; i < len; i++) {
            events->message[ARB_HOST_HEADER + i] = ring_take(events);
        }
        if (arb_hostevents_wants(events, (arb_event_kind_t)events->message[ARB_HOST_HEADER])) {
            events->message_len = (uint8_t)arb_host_finish(events->message, ARB_MSG_EVENT, 0, len);
        }
    }
    return events->message_len != 0;
}

void arb_hostevents_taken(arb_hostevents_t *events, uint8_t count)
{
    events->message_sent = (uint8_t)(events->message_sent + count);
    if (events->message_sent == events->message_len) {
        events->message_len = 0;
        events->message_sent = 0;
        events->sent++;
    }
}
