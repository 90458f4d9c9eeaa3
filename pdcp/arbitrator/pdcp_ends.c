#include "pdcp_ends.h"

#include <stddef.h>

pdcp_channel_t *pdcp_ends_channel(pdcp_bus_t *bus, uint8_t number)
{
    return number != PDCP_NONE ? &bus->tables.channels[number] : NULL;
}

uint8_t pdcp_ends_place(const pdcp_bus_t *bus, uint8_t number)
{
    return number != PDCP_NONE ? bus->tables.channels[number].place : (uint8_t)PDCP_NONE;
}

bool pdcp_ends_is_ready(pdcp_bus_t *bus, uint8_t number)
{
    const uint8_t place = pdcp_ends_place(bus, number);
    return place != PDCP_NONE && pdcp_bus_device(bus, place)->state == PDCP_PLACE_READY;
}

uint8_t pdcp_ends_source(const pdcp_bus_t *bus, const pdcp_channel_t *input)
{
    const uint8_t place = pdcp_tables_find(&bus->tables, &input->source.identity);
    if (place == PDCP_NONE || place == input->place || bus->tables.devices[place].state != PDCP_PLACE_READY) {
        return PDCP_NONE;
    }
    const uint8_t channel = pdcp_tables_channel(&bus->tables, place, input->source.index);
    return channel != PDCP_NONE && bus->tables.channels[channel].transfer == PDCP_OUTPUT ? channel
                                                                                         : PDCP_NONE;
}

uint8_t pdcp_ends_listener(const pdcp_bus_t *bus, uint8_t output)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *input = &bus->tables.channels[i];
        if (input->source.channel == output && input->link == PDCP_LINK_ACTIVE) {
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
    pdcp_channel_t *channel = &bus->tables.channels[number];
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
    if (pdcp_ends_is_ready(bus, output) && bus->tables.channels[output].transfer == PDCP_OUTPUT &&
        bus->tables.channels[output].enabled && pdcp_ends_listener(bus, output) == PDCP_NONE) {
        pdcp_ends_note(bus, output, PDCP_TODO_SILENCE);
    }
}

/* The channel has not answered yet: it is told again when nothing else is to be done (D-BUS-22). */
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

void pdcp_ends_answer_update(pdcp_bus_t *bus, uint8_t place, uint8_t index, bool connected)
{
    const pdcp_msg_t msg = {.code = PDCP_UPDATE_CHANNEL | PDCP_ANSWER,
                            .result = connected ? PDCP_SUCCESS : PDCP_FAILURE,
                            .channel = index};
    (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, pdcp_bus_device(bus, place)->node_id, &msg);
}
