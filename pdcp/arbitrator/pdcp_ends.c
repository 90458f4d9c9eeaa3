#include "pdcp_ends.h"

#include <stddef.h>

pdcp_channel_t *pdcp_ends_channel(pdcp_bus_t *bus, uint8_t number)
{
    return number != PDCP_NONE ? &bus->nodes.channels[number] : NULL;
}

uint8_t pdcp_ends_place(const pdcp_bus_t *bus, uint8_t number)
{
    return number != PDCP_NONE ? bus->nodes.channels[number].node : (uint8_t)PDCP_NONE;
}

bool pdcp_ends_is_ready(pdcp_bus_t *bus, uint8_t number)
{
    const uint8_t node = pdcp_ends_place(bus, number);
    return node != PDCP_NONE && pdcp_bus_node(bus, node)->state == PDCP_NODE_READY;
}

uint8_t pdcp_ends_source(const pdcp_bus_t *bus, const pdcp_channel_t *input)
{
    const uint8_t node = pdcp_nodes_find(&bus->nodes, &input->source.identity);
    if (node == PDCP_NONE || node == input->node || bus->nodes.nodes[node].state != PDCP_NODE_READY) {
        return PDCP_NONE;
    }
    const uint8_t channel = pdcp_nodes_channel(&bus->nodes, node, input->source.index);
    return channel != PDCP_NONE && bus->nodes.channels[channel].transfer == PDCP_OUTPUT ? channel : PDCP_NONE;
}

uint8_t pdcp_ends_listener(const pdcp_bus_t *bus, uint8_t output)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *input = &bus->nodes.channels[i];
        if (input->source.feed == output && input->link == PDCP_LINK_ACTIVE) {
            return i;
        }
    }
    return PDCP_NONE;
}

void pdcp_ends_drop(pdcp_channel_t *channel, unsigned todo)
{
    channel->todo = (uint8_t)(channel->todo & ~todo);
}

void pdcp_ends_note(pdcp_bus_t *bus, uint8_t number, pdcp_todo_t todo)
{
    pdcp_channel_t *channel = &bus->nodes.channels[number];
    channel->todo = (uint8_t)(channel->todo | (unsigned)todo);
    if ((channel->todo & PDCP_TODO_REMOVE) != 0) {
        channel->todo = PDCP_TODO_REMOVE;
    } else if ((channel->todo & PDCP_TODO_CONNECT) != 0) {
        pdcp_ends_drop(channel, PDCP_ENDS_SILENCES);
    }
    bus->link.due = true;
    bus->link.changed = true;
}

void pdcp_ends_release(pdcp_bus_t *bus, uint8_t output)
{
    if (pdcp_ends_is_ready(bus, output) && bus->nodes.channels[output].transfer == PDCP_OUTPUT &&
        bus->nodes.channels[output].enabled && pdcp_ends_listener(bus, output) == PDCP_NONE) {
        pdcp_ends_note(bus, output, PDCP_TODO_SILENCE);
    }
}

void pdcp_ends_silence_again(pdcp_bus_t *bus, uint8_t number)
{
    const pdcp_channel_t *channel = pdcp_ends_channel(bus, number);
    if (channel != NULL && channel->enabled) {
        pdcp_ends_note(bus, number, PDCP_TODO_AGAIN);
    }
}

void pdcp_ends_on_disabled(pdcp_bus_t *bus, pdcp_channel_t *channel)
{
    channel->enabled = false;
    if (channel->transfer == PDCP_INPUT) {
        channel->node_id = 0;
    } else {
        bus->silenced_ms = bus->now_ms;
    }
}

void pdcp_ends_answer_update(pdcp_bus_t *bus, uint8_t node, uint8_t index, bool connected)
{
    const pdcp_msg_t msg = {.code = PDCP_UPDATE_CHANNEL | PDCP_ANSWER,
                            .result = connected ? PDCP_SUCCESS : PDCP_FAILURE,
                            .channel = index};
    (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, pdcp_bus_node(bus, node)->node_id, &msg);
}
