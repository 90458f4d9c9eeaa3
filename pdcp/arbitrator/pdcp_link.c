#include "pdcp_link.h"

#include <string.h>

#include "pdcp_assert.h"
#include "pdcp_ends.h"
#include "pdcp_job.h"

void pdcp_link_init(pdcp_bus_t *bus)
{
    const bool planned = bus->link.planned;
    memset(&bus->link, 0, sizeof bus->link);
    bus->link.planned = planned;
    bus->link.closed = true;
    bus->link.requested_input = PDCP_NONE;
    bus->link.job.at = PDCP_NONE;
}

/* --- What the arbitrator asks for --- */

pdcp_status_t pdcp_link_request(pdcp_bus_t *bus, uint8_t output, uint8_t input, bool sole)
{
    if (bus->link.requested_input != PDCP_NONE) {
        return PDCP_ERR_BUSY;
    }
    bus->link.requested_input = input;
    bus->link.requested_output = output;
    bus->link.requested_sole = sole;
    bus->link.due = true;
    return PDCP_OK;
}

bool pdcp_link_request_waits(const pdcp_bus_t *bus)
{
    return bus->link.requested_input != PDCP_NONE || (bus->link.job.active && bus->link.job.for_host);
}

void pdcp_link_remove(pdcp_bus_t *bus, uint8_t input)
{
    pdcp_ends_note(bus, input, PDCP_TODO_REMOVE);
}

/* The channel is told to be silent until it answers (D-BUS-22). */
void pdcp_link_silence(pdcp_bus_t *bus, uint8_t channel)
{
    bus->tables.channels[channel].enabled = true;
    pdcp_ends_note(bus, channel, PDCP_TODO_SILENCE);
}

void pdcp_link_write(pdcp_bus_t *bus, uint8_t input)
{
    pdcp_channel_t *channel = &bus->tables.channels[input];
    if (channel->link == PDCP_LINK_NONE) {
        pdcp_tables_clear_source(channel);
    }
    pdcp_ends_note(bus, input, PDCP_TODO_WRITE);
}

/* A link becomes inactive: its input is silenced, and its output when nobody else listens. */
void pdcp_link_deactivate(pdcp_bus_t *bus, uint8_t input, pdcp_status_t status)
{
    pdcp_channel_t *channel = &bus->tables.channels[input];
    channel->link = PDCP_LINK_INACTIVE;
    pdcp_ends_drop(channel, PDCP_TODO_CONNECT);
    pdcp_ends_note(bus, input, PDCP_TODO_SILENCE);
    pdcp_ends_release(bus, channel->source.channel);
    pdcp_bus_tell_link(bus, PDCP_EVENT_LINK, input, status);
}

void pdcp_link_forget_request(pdcp_bus_t *bus, pdcp_status_t status)
{
    if (bus->link.requested_input != PDCP_NONE) {
        pdcp_bus_tell_link(bus, PDCP_EVENT_LINK_REQUEST, bus->link.requested_input, status);
        bus->link.requested_input = PDCP_NONE;
    }
}

uint8_t pdcp_link_give_up_request(pdcp_bus_t *bus)
{
    pdcp_link_forget_request(bus, PDCP_ERR_NO_ANSWER);
    return pdcp_job_give_up_request(bus);
}

void pdcp_link_open(pdcp_bus_t *bus)
{
    bus->link.closed = false;
}

/* --- What happens on the bus --- */

void pdcp_link_on_update(pdcp_bus_t *bus, uint8_t place, uint8_t index)
{
    const uint8_t number = pdcp_tables_channel(&bus->tables, place, index);
    const uint8_t state = pdcp_bus_device(bus, place)->state;
    if (state == PDCP_PLACE_SETUP && number == PDCP_NONE) {
        return; /* without a channel yet: the device asks again */
    }
    if (state == PDCP_PLACE_SETUP || (state == PDCP_PLACE_READY && number != PDCP_NONE &&
                                      bus->tables.channels[number].transfer == PDCP_INPUT)) {
        pdcp_ends_note(bus, number, PDCP_TODO_UPDATE);
    } else {
        pdcp_ends_answer_update(bus, place, index, false);
    }
}

/* Inactive links are made whose ends are both there: those of this device, or all (PDCP_NONE) when one was
 * not answered and is tried again (D-BUS-26). */
void pdcp_link_on_ready(pdcp_bus_t *bus, uint8_t place)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX && !bus->link.planned; i++) {
        pdcp_channel_t *input = &bus->tables.channels[i];
        if (input->link != PDCP_LINK_INACTIVE) {
            continue;
        }
        input->source.channel = pdcp_ends_source(bus, input);
        const uint8_t source = pdcp_ends_place(bus, input->source.channel);
        if (source == PDCP_NONE || (input->todo & PDCP_TODO_UPDATE) != 0) {
            continue;
        }
        if (place == PDCP_NONE || input->place == place || source == place) {
            pdcp_ends_note(bus, i, PDCP_TODO_CONNECT);
        }
    }
    bus->link.due = true; /* an Update Data Channel may have waited for the end of the setup */
}

/* The links of a lost device become inactive: what its outputs fed is silenced (D-BUS-14). */
void pdcp_link_on_lost(pdcp_bus_t *bus, uint8_t place)
{
    pdcp_assert(pdcp_request_is_idle(bus, place), "pdcp_link.h: the request is cancelled");
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        pdcp_channel_t *channel = &bus->tables.channels[i];
        if (channel->link == PDCP_LINK_ACTIVE &&
            (channel->place == place || pdcp_ends_place(bus, channel->source.channel) == place)) {
            pdcp_link_deactivate(bus, i, PDCP_OK);
        }
        if (channel->place == place) { /* nothing can be written to it; its next setup silences it first */
            channel->enabled = false;
            channel->todo = PDCP_TODO_NONE;
        }
    }
    pdcp_job_on_lost(bus, place);
    if (pdcp_ends_place(bus, bus->link.requested_input) == place ||
        pdcp_ends_place(bus, bus->link.requested_output) == place) {
        pdcp_link_forget_request(bus, PDCP_ERR_NO_ANSWER); /* its channels may be others' before its turn */
    }
}

void pdcp_link_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply)
{
    pdcp_job_on_reply(bus, reply);
}

/* --- The next job --- */

/* Makes the link to the source that an input has, if it can be made now. */
static void start_connect(pdcp_bus_t *bus, uint8_t input)
{
    pdcp_channel_t *channel = &bus->tables.channels[input];
    channel->source.channel = pdcp_ends_source(bus, channel);
    if (channel->source.channel == PDCP_NONE || !pdcp_ends_is_ready(bus, input)) {
        pdcp_ends_silence_again(bus, input);
        pdcp_bus_tell_link(bus, PDCP_EVENT_LINK, input, PDCP_ERR_NO_ANSWER);
        return;
    }
    pdcp_job_begin(bus, PDCP_TODO_CONNECT, input, channel->source.channel);
}

/* Starts any other job that a channel has to do, unless there is nothing left to do. */
static void start_other(pdcp_bus_t *bus, uint8_t number, pdcp_todo_t todo)
{
    pdcp_channel_t *channel = &bus->tables.channels[number];
    const bool is_input = channel->transfer == PDCP_INPUT;
    if (!is_input && todo == PDCP_TODO_UPDATE) { /* its direction was not known when it came */
        pdcp_ends_answer_update(bus, channel->place, channel->index, false);
        return;
    }
    if (!is_input && pdcp_ends_listener(bus, number) != PDCP_NONE) {
        return; /* a link made meanwhile needs the output */
    }
    if (todo == PDCP_TODO_WRITE || (todo == PDCP_TODO_UPDATE && bus->link.stored)) {
        pdcp_job_begin_write(bus, number, todo == PDCP_TODO_UPDATE);
        return;
    }
    pdcp_job_begin(bus, todo, is_input ? number : PDCP_NONE, is_input ? PDCP_NONE : number);
    if (todo == PDCP_TODO_REMOVE) {
        pdcp_tables_clear_source(channel);
    }
}

static void start_todo(pdcp_bus_t *bus, uint8_t number, pdcp_todo_t todo)
{
    pdcp_channel_t *channel = &bus->tables.channels[number];
    pdcp_ends_drop(channel, todo == PDCP_TODO_SILENCE ? PDCP_ENDS_SILENCES : (unsigned)todo);
    if (todo == PDCP_TODO_CONNECT) {
        start_connect(bus, number);
    } else {
        start_other(bus, number, todo);
    }
}

/* Makes the link that was asked for. If it is there already, nothing is sent (D-API-6). */
static void start_request(pdcp_bus_t *bus)
{
    pdcp_channel_t *input = &bus->tables.channels[bus->link.requested_input];
    if (!pdcp_ends_is_ready(bus, bus->link.requested_input) ||
        !pdcp_ends_is_ready(bus, bus->link.requested_output)) {
        pdcp_link_forget_request(bus, PDCP_ERR_NO_ANSWER);
        return;
    }
    if (input->link == PDCP_LINK_ACTIVE && input->source.channel == bus->link.requested_output) {
        pdcp_link_forget_request(bus, PDCP_OK);
        return;
    }
    if (bus->link.requested_sole &&
        pdcp_tables_rival(&bus->tables, bus->link.requested_output, bus->link.requested_input) != PDCP_NONE) {
        pdcp_link_forget_request(bus, PDCP_ERR_SOLE); /* another link was made meanwhile (D-API-13) */
        return;
    }
    pdcp_ends_drop(input, PDCP_TODO_CONNECT | PDCP_ENDS_SILENCES); /* it begins with the input off */
    pdcp_job_begin(bus, PDCP_TODO_CONNECT, bus->link.requested_input, bus->link.requested_output);
    bus->link.job.for_host = true;
    bus->link.requested_input = PDCP_NONE;
}

/* What is to be done next, PDCP_TODO_NONE: nothing, and for which channel: what silences comes before what
 * connects. */
static pdcp_todo_t next_todo(const pdcp_bus_t *bus, uint8_t *number)
{
    unsigned best = PDCP_TODO_NONE;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = &bus->tables.channels[i];
        const unsigned lowest = channel->todo & (0u - channel->todo);
        if (lowest != PDCP_TODO_NONE && (best == PDCP_TODO_NONE || lowest < best) &&
            bus->tables.devices[channel->place].state != PDCP_PLACE_SETUP) {
            best = lowest;
            *number = i;
        }
    }
    return (pdcp_todo_t)best;
}

/* Is there something to be done, other than to silence again? */
static bool has_work(const pdcp_bus_t *bus)
{
    uint8_t number;
    if (bus->link.requested_input != PDCP_NONE) {
        return true;
    }
    const pdcp_todo_t todo = bus->link.due ? next_todo(bus, &number) : PDCP_TODO_NONE;
    return todo != PDCP_TODO_NONE && todo != PDCP_TODO_AGAIN;
}

bool pdcp_link_is_settled(const pdcp_bus_t *bus)
{
    return (!bus->link.job.active || bus->link.job.kind == PDCP_TODO_AGAIN) && !has_work(bus);
}

bool pdcp_link_is_making(const pdcp_bus_t *bus)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = &bus->tables.channels[i];
        if ((channel->todo & PDCP_TODO_CONNECT) != 0 &&
            bus->tables.devices[channel->place].state == PDCP_PLACE_READY) {
            return true;
        }
    }
    return bus->link.job.active && bus->link.job.kind == PDCP_TODO_CONNECT;
}

/* A job that silences a channel again is broken off for anything else (D-BUS-22). */
void pdcp_link_step(pdcp_bus_t *bus)
{
    if (bus->link.job.active && bus->link.job.kind == PDCP_TODO_AGAIN && has_work(bus)) {
        pdcp_job_break_off(bus);
    }
    pdcp_job_run(bus);
    while (!bus->link.job.active && bus->link.due) {
        uint8_t number = PDCP_NONE;
        const pdcp_todo_t todo = next_todo(bus, &number);
        if (bus->link.requested_input != PDCP_NONE && todo != PDCP_TODO_SILENCE && todo != PDCP_TODO_REMOVE) {
            start_request(bus);
        } else if (todo != PDCP_TODO_NONE) {
            start_todo(bus, number, todo);
        } else {
            bus->link.due = false;
        }
        pdcp_job_run(bus);
    }
}
