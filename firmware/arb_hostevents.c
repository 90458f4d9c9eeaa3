#include "arb_hostevents.h"

#include <string.h>

/* In the queue an event is its length, then what the message holds: kind, time, data. */

static void put(arb_hostevents_t *events, uint32_t now_ms, arb_event_kind_t kind, const uint8_t *data,
                uint8_t len)
{
    const uint8_t limit = kind == ARB_EVENT_FRAME ? ARB_EVENT_FRAMES : ARB_EVENT_QUEUE;
    const uint8_t size = (uint8_t)(1 + ARB_EVENT_HEAD + len);
    uint8_t *bytes = &events->queue[events->used];
    if (!arb_hostevents_wants(events, kind)) {
        return;
    }
    if (events->used + size > limit) {
        events->counters[kind]++;
        return;
    }
    bytes[0] = (uint8_t)(ARB_EVENT_HEAD + len);
    bytes[1] = (uint8_t)kind;
    arb_host_put_u32(&bytes[2], now_ms);
    memcpy(&bytes[1 + ARB_EVENT_HEAD], data, len);
    events->used = (uint8_t)(events->used + size);
}

void arb_hostevents_set_mask(arb_hostevents_t *events, uint8_t mask)
{
    events->mask = mask;
    if (events->out.len != 0 && events->out.sent == 0 &&
        !arb_hostevents_wants(events, (arb_event_kind_t)events->message[ARB_HOST_HEADER])) {
        events->out.len = 0;
    }
}

void arb_hostevents_end(arb_hostevents_t *events)
{
    events->mask = 0;
    events->used = 0;
    events->out.len = 0;
    events->out.sent = 0;
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
    const pdcp_link_t *job = &arb->bus.link;
    uint8_t data[ARB_EVENT_DATA_MAX];
    arb_host_put_link(data, &arb->bus.nodes, input);
    if (input->link == PDCP_LINK_NONE && job->input == number && job->kind == PDCP_TODO_REMOVE) {
        arb_host_put_channel(data, &job->old_source, job->old_index);
    }
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
    switch (event->kind) {
    case PDCP_EVENT_BOUND:
    case PDCP_EVENT_LOST:
        put_device(events, now_ms, event->kind == PDCP_EVENT_BOUND ? ARB_EVENT_BOUND : ARB_EVENT_LOST,
                   &arb->bus.nodes.nodes[event->node]);
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
    while (events->out.len == 0 && events->used != 0) {
        const uint8_t len = events->queue[0];
        memcpy(&events->message[ARB_HOST_HEADER], &events->queue[1], len);
        events->used = (uint8_t)(events->used - 1 - len);
        memmove(events->queue, &events->queue[1 + len], events->used);
        if (arb_hostevents_wants(events, (arb_event_kind_t)events->message[ARB_HOST_HEADER])) {
            events->out.len = arb_host_finish(events->message, ARB_MSG_EVENT, 0, len);
        }
    }
    return events->out.len != 0;
}
