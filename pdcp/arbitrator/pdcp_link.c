#include "pdcp_link.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_bind.h"
#include "pdcp_bytes.h"

/* Steps of a job in the order of making a link; undoing and removing run through them backwards. */
typedef enum {
    STEP_READ_VID_PID, /* Update Data Channel: what source the device names */
    STEP_READ_SERIAL,
    STEP_OUTPUT_ID, /* if the output has none */
    STEP_INPUT_OFF, /* before its source is replaced */
    STEP_VID_PID,
    STEP_SERIAL,
    STEP_TYPE,
    STEP_NODES,
    STEP_INPUT_ON,
    STEP_OUTPUT_ID_AGAIN, /* only when a link is written again, whatever differed (D-BUS-57) */
    STEP_OUTPUT_ON,
    STEP_END
} step_t;

/* What only silences a channel. */
#define SILENCES ((unsigned)PDCP_TODO_SILENCE | (unsigned)PDCP_TODO_AGAIN)

void pdcp_link_init(pdcp_bus_t *bus)
{
    const bool planned = bus->link.planned;
    memset(&bus->link, 0, sizeof bus->link);
    bus->link.planned = planned;
    bus->link.closed = true;
    bus->link.wish_input = PDCP_NONE;
    bus->link.at = PDCP_NONE;
}

static pdcp_channel_t *channel_of(pdcp_bus_t *bus, uint8_t channel)
{
    return channel != PDCP_NONE ? &bus->nodes.channels[channel] : NULL;
}

/* Place of the device that a channel belongs to; PDCP_NONE stands for no channel, too. */
static uint8_t owner_of(const pdcp_bus_t *bus, uint8_t channel)
{
    return channel != PDCP_NONE ? bus->nodes.channels[channel].node : (uint8_t)PDCP_NONE;
}

static bool is_ready(pdcp_bus_t *bus, uint8_t channel)
{
    const uint8_t node = owner_of(bus, channel);
    return node != PDCP_NONE && pdcp_bus_node(bus, node)->state == PDCP_NODE_READY;
}

/* What is no longer to be done, because it was done or something else does it, too. */
static void drop_todo(pdcp_channel_t *channel, unsigned todo)
{
    channel->todo = (uint8_t)(channel->todo & ~todo);
}

/* Notes what is to be done. A silence that is needed is never forgotten: what was noted before stays, until
 * its own job begins, its device is lost, or a job is noted that silences the input, too, whatever comes of
 * it. Making a link begins with the input off, and silences it again when it fails or cannot start. Taking
 * one away silences the input, and leaves nothing to be made. */
static void put_todo(pdcp_bus_t *bus, uint8_t number, pdcp_todo_t todo)
{
    pdcp_channel_t *channel = &bus->nodes.channels[number];
    channel->todo = (uint8_t)(channel->todo | (unsigned)todo);
    if ((channel->todo & PDCP_TODO_REMOVE) != 0) {
        channel->todo = PDCP_TODO_REMOVE;
    } else if ((channel->todo & PDCP_TODO_CONNECT) != 0) {
        drop_todo(channel, SILENCES);
    }
    bus->link.due = true;
    bus->link.changed = true;
}

/* The output that an input names as its source, if its device is set up; an unconnected input names none. */
static uint8_t find_source(const pdcp_bus_t *bus, const pdcp_channel_t *input)
{
    const uint8_t node = pdcp_nodes_find(&bus->nodes, &input->source);
    if (node == PDCP_NONE || node == input->node || bus->nodes.nodes[node].state != PDCP_NODE_READY) {
        return PDCP_NONE;
    }
    const uint8_t channel = pdcp_nodes_channel(&bus->nodes, node, input->source_index);
    return channel != PDCP_NONE && bus->nodes.channels[channel].transfer == PDCP_OUTPUT ? channel : PDCP_NONE;
}

uint8_t pdcp_link_listener(const pdcp_bus_t *bus, uint8_t output)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *input = &bus->nodes.channels[i];
        if (input->feed == output && input->link == PDCP_LINK_ACTIVE) {
            return i;
        }
    }
    return PDCP_NONE;
}

static bool output_is_needed(const pdcp_bus_t *bus, uint8_t output)
{
    return pdcp_link_listener(bus, output) != PDCP_NONE;
}

/* An output that no active link needs any more is to be disabled. */
static void release_output(pdcp_bus_t *bus, uint8_t output)
{
    if (is_ready(bus, output) && bus->nodes.channels[output].transfer == PDCP_OUTPUT &&
        bus->nodes.channels[output].enabled && !output_is_needed(bus, output)) {
        put_todo(bus, output, PDCP_TODO_SILENCE);
    }
}

pdcp_status_t pdcp_link_wish(pdcp_bus_t *bus, uint8_t output, uint8_t input, bool sole)
{
    if (bus->link.wish_input != PDCP_NONE) {
        return PDCP_ERR_BUSY;
    }
    bus->link.wish_input = input;
    bus->link.wish_output = output;
    bus->link.wish_sole = sole;
    bus->link.due = true;
    return PDCP_OK;
}

bool pdcp_link_wish_waits(const pdcp_bus_t *bus)
{
    return bus->link.wish_input != PDCP_NONE || (bus->link.active && bus->link.for_host);
}

void pdcp_link_remove(pdcp_bus_t *bus, uint8_t input)
{
    put_todo(bus, input, PDCP_TODO_REMOVE);
}

void pdcp_link_silence(pdcp_bus_t *bus, uint8_t channel)
{
    bus->nodes.channels[channel].enabled = true;
    put_todo(bus, channel, PDCP_TODO_SILENCE);
}

void pdcp_link_write(pdcp_bus_t *bus, uint8_t input)
{
    pdcp_channel_t *channel = &bus->nodes.channels[input];
    if (channel->link == PDCP_LINK_NONE) {
        pdcp_nodes_clear_source(channel);
    }
    put_todo(bus, input, PDCP_TODO_WRITE);
}

static void answer_update(pdcp_bus_t *bus, uint8_t node, uint8_t index, bool connected)
{
    const pdcp_msg_t msg = {.code = PDCP_UPDATE_CHANNEL | PDCP_ANSWER,
                            .result = connected ? PDCP_SUCCESS : PDCP_FAILURE,
                            .channel = index};
    (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, pdcp_bus_node(bus, node)->node_id, &msg);
}

void pdcp_link_on_update(pdcp_bus_t *bus, uint8_t node, uint8_t index)
{
    const uint8_t number = pdcp_nodes_channel(&bus->nodes, node, index);
    const uint8_t state = pdcp_bus_node(bus, node)->state;
    if (state == PDCP_NODE_SETUP && number == PDCP_NONE) {
        return; /* without a channel yet: the device asks again */
    }
    if (state == PDCP_NODE_SETUP || (state == PDCP_NODE_READY && number != PDCP_NONE &&
                                     bus->nodes.channels[number].transfer == PDCP_INPUT)) {
        put_todo(bus, number, PDCP_TODO_UPDATE);
    } else {
        answer_update(bus, node, index, false);
    }
}

void pdcp_link_on_ready(pdcp_bus_t *bus, uint8_t node)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX && !bus->link.planned; i++) {
        pdcp_channel_t *input = &bus->nodes.channels[i];
        if (input->link != PDCP_LINK_INACTIVE) {
            continue;
        }
        input->feed = find_source(bus, input);
        const uint8_t source = owner_of(bus, input->feed);
        if (source == PDCP_NONE || (input->todo & PDCP_TODO_UPDATE) != 0) {
            continue;
        }
        if (node == PDCP_NONE || input->node == node || source == node) {
            put_todo(bus, i, PDCP_TODO_CONNECT);
        }
    }
    bus->link.due = true; /* an Update Data Channel may have waited for the end of the setup */
}

/* A link rests: its input is silenced, and its output when nobody else listens. */
void pdcp_link_rest(pdcp_bus_t *bus, uint8_t input, pdcp_status_t status)
{
    pdcp_channel_t *channel = &bus->nodes.channels[input];
    channel->link = PDCP_LINK_INACTIVE;
    drop_todo(channel, PDCP_TODO_CONNECT);
    put_todo(bus, input, PDCP_TODO_SILENCE);
    release_output(bus, channel->feed);
    pdcp_bus_tell_link(bus, PDCP_EVENT_LINK, input, status);
}

static void give_back_old(const pdcp_bus_t *bus, pdcp_channel_t *input)
{
    input->source = bus->link.old_source;
    input->source_index = bus->link.old_index;
    input->source_type = bus->link.old_type;
    input->source_profile = bus->link.old_profile;
    input->link = bus->link.old_link != PDCP_LINK_NONE ? PDCP_LINK_INACTIVE : PDCP_LINK_NONE; /* D-BUS-10 */
    input->feed = PDCP_NONE;
}

/* The job under way goes on without the channels of a device that is gone. */
static void leave_job(pdcp_bus_t *bus, uint8_t node)
{
    if (!bus->link.active) {
        return;
    }
    if (owner_of(bus, bus->link.input) == node) {
        if (!bus->link.undoing && bus->link.kind != PDCP_TODO_WRITE) {
            give_back_old(bus, &bus->nodes.channels[bus->link.input]);
        }
        bus->link.input = PDCP_NONE;
    }
    if (owner_of(bus, bus->link.output) == node) {
        bus->link.output = PDCP_NONE;
    }
    if (bus->link.at == node) {
        bus->link.at = PDCP_NONE;
    }
}

void pdcp_link_forget_wish(pdcp_bus_t *bus, pdcp_status_t status)
{
    if (bus->link.wish_input != PDCP_NONE) {
        pdcp_bus_tell_link(bus, PDCP_EVENT_WISH, bus->link.wish_input, status);
        bus->link.wish_input = PDCP_NONE;
    }
}

void pdcp_link_on_lost(pdcp_bus_t *bus, uint8_t node)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        pdcp_channel_t *channel = &bus->nodes.channels[i];
        if (channel->link == PDCP_LINK_ACTIVE &&
            (channel->node == node || owner_of(bus, channel->feed) == node)) {
            pdcp_link_rest(bus, i, PDCP_OK);
        }
        if (channel->node == node) { /* nothing can be written to it; its next setup silences it first */
            channel->enabled = false;
            channel->todo = PDCP_TODO_NONE;
        }
    }
    leave_job(bus, node);
    if (owner_of(bus, bus->link.wish_input) == node || owner_of(bus, bus->link.wish_output) == node) {
        pdcp_link_forget_wish(bus, PDCP_ERR_NO_ANSWER); /* its channels may be others' before its turn */
    }
}

static bool is_about_output(const pdcp_bus_t *bus)
{
    return bus->link.step >= STEP_OUTPUT_ID_AGAIN || bus->link.step == STEP_OUTPUT_ID;
}

/* The channel that the current step is about. */
static uint8_t target_of(const pdcp_bus_t *bus)
{
    return is_about_output(bus) ? bus->link.output : bus->link.input;
}

static void take_old(pdcp_bus_t *bus, const pdcp_channel_t *input)
{
    bus->link.old_source = input->source;
    bus->link.old_index = input->source_index;
    bus->link.old_type = input->source_type;
    bus->link.old_profile = input->source_profile;
    bus->link.old_link = input->link;
    bus->link.old_feed = input->feed;
}

static void name_source(pdcp_bus_t *bus, pdcp_channel_t *input)
{
    const pdcp_channel_t *output = &bus->nodes.channels[bus->link.output];
    input->source = pdcp_bus_node(bus, output->node)->identity;
    input->source_index = output->index;
    input->source_type = output->type;
    input->source_profile = output->profile;
    input->feed = bus->link.output;
    input->link = PDCP_LINK_INACTIVE;
    bus->link.output_was_on = output_is_needed(bus, bus->link.output); /* enabled alone means: may be */
}

/* Begins a job at its first step; making a link names its source at once. What takes away runs through all
 * steps backwards, and leaves out those that its channels do not have. */
static void begin(pdcp_bus_t *bus, pdcp_todo_t kind, uint8_t input, uint8_t output)
{
    bus->link.changed = true;
    bus->link.active = true;
    bus->link.at = PDCP_NONE;
    bus->link.kind = (uint8_t)kind;
    bus->link.input = input;
    bus->link.output = output;
    bus->link.step = STEP_OUTPUT_ON;
    bus->link.undoing = true;
    bus->link.once = false;
    bus->link.for_host = false;
    bus->link.for_device = kind == PDCP_TODO_UPDATE;
    bus->link.differs = false;
    bus->link.output_was_on = false;
    bus->link.status = PDCP_OK;
    pdcp_channel_t *channel = channel_of(bus, input);
    if (channel != NULL) {
        take_old(bus, channel);
    }
    if (kind == PDCP_TODO_WRITE) {
        bus->link.step = STEP_VID_PID;
        bus->link.undoing = false;
    } else if (kind == PDCP_TODO_UPDATE) {
        bus->link.step = STEP_READ_VID_PID;
        bus->link.undoing = false;
    } else if (kind == PDCP_TODO_CONNECT) {
        bus->link.step = STEP_OUTPUT_ID;
        bus->link.undoing = false;
        name_source(bus, channel);
    }
}

static void tell_outcome(pdcp_bus_t *bus)
{
    const pdcp_status_t status = (pdcp_status_t)bus->link.status;
    if (bus->link.input != PDCP_NONE) {
        pdcp_bus_tell_link(bus, PDCP_EVENT_LINK, bus->link.input, status);
    }
    if (bus->link.for_host) {
        pdcp_bus_tell_link(bus, PDCP_EVENT_WISH, bus->link.input, status);
    }
}

/* What must not go on hearing or sending is told so until it answers or its device is lost. */
static void silence_again(pdcp_bus_t *bus, uint8_t number)
{
    const pdcp_channel_t *channel = channel_of(bus, number);
    if (channel != NULL && channel->enabled) {
        put_todo(bus, number, PDCP_TODO_AGAIN);
    }
}

/* The link of an input could not be made: it is what it was before, or remembered as inactive; one that
 * worked is made anew. */
static void settle_failed(pdcp_bus_t *bus, pdcp_channel_t *input)
{
    pdcp_bus_count(bus, PDCP_STAT_LINK_FAILED);
    if (bus->link.output_was_on) {
        release_output(bus, bus->link.output); /* whose other listeners may be gone meanwhile */
    } else {
        silence_again(bus, bus->link.output);
    }
    if (bus->link.old_feed != bus->link.output) {
        release_output(bus, bus->link.old_feed);
    }
    if (input == NULL) {
        return;
    }
    input->feed = input->link != PDCP_LINK_NONE ? find_source(bus, input) : PDCP_NONE;
    if (bus->link.old_link == PDCP_LINK_ACTIVE) {
        put_todo(bus, bus->link.input, PDCP_TODO_CONNECT);
    } else if (input->link == PDCP_LINK_INACTIVE && bus->link.status == PDCP_ERR_NO_ANSWER &&
               !bus->link.planned) {
        pdcp_bus_wake(bus, PDCP_TIMER_LINK, PDCP_LINK_PAUSE_MS); /* D-BUS-26 */
    }
    silence_again(bus, bus->link.input);
}

static void settle_made(pdcp_bus_t *bus, pdcp_channel_t *input)
{
    input->link = PDCP_LINK_ACTIVE;
    drop_todo(input, PDCP_TODO_CONNECT | PDCP_TODO_WRITE | SILENCES); /* noted while it was being made */
    release_output(bus, bus->link.old_feed); /* unless it is the same: that one is needed */
}

static void settle_silenced(pdcp_bus_t *bus, pdcp_channel_t *input)
{
    if (bus->link.status == PDCP_ERR_NO_ANSWER) {
        silence_again(bus, bus->link.input);
        silence_again(bus, bus->link.output);
    }
    if (input != NULL && bus->link.kind == PDCP_TODO_REMOVE) {
        input->link = PDCP_LINK_NONE;
        input->feed = PDCP_NONE;
        release_output(bus, bus->link.old_feed);
    }
}

static void end(pdcp_bus_t *bus)
{
    pdcp_channel_t *input = channel_of(bus, bus->link.input);
    const bool writes = bus->link.kind == PDCP_TODO_WRITE; /* what the tables say already */
    bus->link.active = false;
    bus->link.due = true;
    if (bus->link.kind == PDCP_TODO_CONNECT || bus->link.kind == PDCP_TODO_UPDATE) {
        if (bus->link.status == PDCP_OK) {
            settle_made(bus, input);
        } else {
            settle_failed(bus, input);
        }
    } else if (!writes) {
        settle_silenced(bus, input);
    }
    if (bus->link.for_device && input != NULL && /* a device that was not read asks again */
        (bus->link.status != PDCP_ERR_NO_ANSWER || bus->link.step > STEP_READ_SERIAL)) {
        answer_update(bus, input->node, input->index, input->link == PDCP_LINK_ACTIVE);
    }
    if (!writes) {
        tell_outcome(bus);
    }
}

/* Nothing more is to be written forwards. Once the source was written, steps run backwards, the failed one
 * first: whether it was carried out nobody knows (D-BUS-21). */
static void give_up(pdcp_bus_t *bus, pdcp_status_t status)
{
    pdcp_channel_t *input = channel_of(bus, bus->link.input);
    bus->link.status = (int8_t)status;
    if (input != NULL) {
        give_back_old(bus, input);
    }
    if (bus->link.step < STEP_VID_PID) {
        end(bus);
        return;
    }
    bus->link.undoing = true;
}

/* Update Data Channel, once 5 and 6 are read: the job goes on if the source that they name is on the bus. */
static void resolve(pdcp_bus_t *bus)
{
    pdcp_channel_t *input = channel_of(bus, bus->link.input);
    bus->link.output = find_source(bus, input);
    if (input->link == PDCP_LINK_ACTIVE && bus->link.output == input->feed) {
        end(bus);
        return;
    }
    input->link = pdcp_nodes_is_named(input->source_index) ? PDCP_LINK_INACTIVE : PDCP_LINK_NONE;
    take_old(bus, input);
    if (bus->link.output == PDCP_NONE) {
        if (input->enabled) {
            put_todo(bus, bus->link.input, PDCP_TODO_SILENCE); /* it goes on hearing the source it had */
        }
        bus->link.status = PDCP_ERR_UNKNOWN;
        end(bus);
        return;
    }
    name_source(bus, input);
    bus->link.step++;
}

/* Is the last step of the job done? Of an input without an active link no more is written than its source. */
static bool is_done(pdcp_bus_t *bus)
{
    const bool silences = bus->link.kind == PDCP_TODO_SILENCE || bus->link.kind == PDCP_TODO_AGAIN;
    const pdcp_channel_t *input = channel_of(bus, bus->link.input);
    uint8_t last = STEP_OUTPUT_ON;
    if (bus->link.undoing) {
        return bus->link.step == (silences ? STEP_NODES : STEP_VID_PID);
    }
    if (bus->link.kind == PDCP_TODO_WRITE && (input == NULL || input->link != PDCP_LINK_ACTIVE)) {
        last = STEP_TYPE;
    }
    return bus->link.step >= last;
}

/* Goes on to the step that comes next in the job's direction; behind the last one the job is over. */
static void advance(pdcp_bus_t *bus)
{
    if (is_done(bus)) {
        end(bus);
    } else if (bus->link.undoing) {
        bus->link.step--;
    } else {
        bus->link.step++;
    }
}

static bool has_id(const pdcp_bus_t *bus, uint8_t output)
{
    return output != PDCP_NONE && bus->nodes.channels[output].node_id != 0;
}

/* Is the output there that the current step needs, with a node id or, in the step that gives it one, one to
 * be had? */
static bool has_output(pdcp_bus_t *bus)
{
    const uint8_t output = bus->link.output;
    const bool is_giving = bus->link.step == STEP_OUTPUT_ID;
    return is_ready(bus, output) && (has_id(bus, output) || (is_giving && pdcp_bind_output_id(bus) != 0));
}

/* Can the current step be carried out? Making a link needs its input in every step. */
static bool step_possible(pdcp_bus_t *bus)
{
    if (bus->link.undoing) {
        return is_ready(bus, target_of(bus));
    }
    if ((is_about_output(bus) || bus->link.step == STEP_NODES) && !has_output(bus)) {
        return false;
    }
    return is_ready(bus, bus->link.input);
}

/* What the current step reads or writes: the parameter, and the value for it in bytes[]. Returns the value's
 * length; 0: nothing is to be written. */
static uint8_t value_of(pdcp_bus_t *bus, uint8_t *param, uint8_t *bytes)
{
    const pdcp_channel_t *input = channel_of(bus, bus->link.input);
    const pdcp_channel_t *output = channel_of(bus, bus->link.output);
    uint16_t low = 0;
    uint16_t high = 0;
    uint8_t len = 4;
    switch ((step_t)bus->link.step) {
    case STEP_READ_VID_PID:
    case STEP_VID_PID:
        *param = PDCP_IN_SOURCE_VID_PID;
        low = input->source.vid;
        high = input->source.pid;
        break;
    case STEP_READ_SERIAL:
    case STEP_SERIAL:
        *param = PDCP_IN_SOURCE_SERIAL;
        low = input->source.sn;
        high = input->source_index;
        len = 3;
        break;
    case STEP_TYPE:
        *param = PDCP_IN_SOURCE_TYPE;
        low = input->source_type;
        high = input->source_profile;
        break;
    case STEP_NODES:
        *param = PDCP_IN_SOURCE_NODES;
        len = 2;
        if (!bus->link.undoing) {
            low = (uint16_t)(pdcp_bus_node(bus, output->node)->node_id |
                             (uint16_t)((uint16_t)output->node_id << 8));
        }
        break;
    case STEP_OUTPUT_ID:
    case STEP_OUTPUT_ID_AGAIN:
        *param = PDCP_OUT_NODE_ID;
        low = output->node_id;
        len = bus->link.step == STEP_OUTPUT_ID || bus->link.kind == PDCP_TODO_WRITE ? 1 : 0;
        break;
    case STEP_INPUT_OFF:
        *param = PDCP_CH_ENABLED;
        len = input->enabled ? 1 : 0;
        break;
    default: /* STEP_INPUT_ON, STEP_OUTPUT_ON */
        *param = PDCP_CH_ENABLED;
        low = bus->link.undoing ? 0 : 1;
        len = bus->link.step == STEP_OUTPUT_ON && bus->link.output_was_on ? 0 : 1;
        break;
    }
    pdcp_bytes_put_u16(&bytes[0], low);
    pdcp_bytes_put_u16(&bytes[2], high);
    return len;
}

/* Sends the request of the current step, which concerns this channel. False: there is nothing to write in
 * it. */
static bool send_step(pdcp_bus_t *bus, pdcp_channel_t *channel)
{
    uint8_t param;
    uint8_t bytes[PDCP_VALUE_MAX];
    if (bus->link.step == STEP_OUTPUT_ID && !pdcp_bind_give_output_id(bus, channel)) {
        return false;
    }
    const uint8_t len = value_of(bus, &param, bytes);
    if (bus->link.step <= STEP_READ_SERIAL) {
        pdcp_request_get(bus, channel->node, PDCP_CLIENT_LINK, channel->index, param, PDCP_VALUE_MAX);
        return true;
    }
    if (len == 0) {
        return false;
    }
    if (param == PDCP_CH_ENABLED && bytes[0] != 0) {
        channel->enabled = true; /* from now on it may be */
    }
    if (bus->link.step == STEP_NODES && !bus->link.undoing) {
        channel->node_id = bytes[1]; /* from now on it may listen to it */
    }
    pdcp_request_set(bus, channel->node, PDCP_CLIENT_LINK, channel->index, param, bytes, len);
    if (bus->link.once) {
        pdcp_request_limit_tries(bus, channel->node, 1);
    }
    return true;
}

/* An output is not enabled in the arbitrator's first time (D-BUS-36). */
static bool is_too_early(const pdcp_bus_t *bus)
{
    return bus->link.closed && bus->link.step == STEP_OUTPUT_ON && !bus->link.undoing;
}

/* Carries the job on until it waits for an answer, waits for a device's place, or is over. */
static void run(pdcp_bus_t *bus)
{
    while (bus->link.active && bus->link.at == PDCP_NONE) {
        pdcp_channel_t *channel = channel_of(bus, target_of(bus));
        const bool is_idle = bus->link.step == STEP_OUTPUT_ID && has_id(bus, bus->link.output);
        if (!step_possible(bus)) {
            if (bus->link.undoing || bus->link.kind == PDCP_TODO_WRITE) {
                advance(bus);
            } else {
                give_up(bus, PDCP_ERR_NO_ANSWER);
            }
        } else if (!is_idle && (!pdcp_request_is_idle(bus, channel->node) || is_too_early(bus))) {
            return;
        } else if (!is_idle && send_step(bus, channel)) {
            bus->link.at = channel->node;
        } else {
            advance(bus);
        }
    }
}

void pdcp_link_is_disabled(pdcp_bus_t *bus, pdcp_channel_t *channel)
{
    channel->enabled = false;
    if (channel->transfer == PDCP_INPUT) {
        channel->node_id = 0;
    } else {
        bus->silenced_ms = bus->now_ms;
    }
}

void pdcp_link_open(pdcp_bus_t *bus)
{
    bus->link.closed = false;
}

static void took_effect(pdcp_bus_t *bus, const pdcp_reply_t *reply)
{
    pdcp_channel_t *channel = channel_of(bus, target_of(bus));
    if (bus->link.step <= STEP_READ_SERIAL) {
        const uint16_t low = pdcp_request_word(reply, 0);
        const uint16_t high = pdcp_request_word(reply, 2);
        if (bus->link.kind == PDCP_TODO_UPDATE) {
            pdcp_nodes_take_source(channel, reply->param, low, high);
        } else if (!pdcp_nodes_is_source(channel, reply->param, low, high)) {
            bus->link.differs = true;
        }
    } else if (bus->link.step == STEP_INPUT_OFF || (bus->link.step >= STEP_INPUT_ON && bus->link.undoing)) {
        pdcp_link_is_disabled(bus, channel);
    } else if (bus->link.step == STEP_NODES && bus->link.undoing) {
        channel->node_id = 0;
    }
}

/* Update Data Channel while a stored configuration decides: 5 and 6 are read, and written if the device names
 * something else (D-BUS-38). */
static void look_at_source(pdcp_bus_t *bus)
{
    if (bus->link.step == STEP_READ_VID_PID) {
        bus->link.step++;
    } else if (bus->link.differs) {
        bus->link.step = STEP_VID_PID;
    } else {
        end(bus);
    }
}

/* What a device refuses is left out, and so is all else that is for a silent one: an audit finds what is
 * still wrong (D-BUS-40). A device that cannot be read asks again. */
static void leave_out(pdcp_bus_t *bus, pdcp_status_t status)
{
    const bool silent = status == PDCP_ERR_NO_ANSWER;
    if (bus->link.step <= STEP_READ_SERIAL) {
        if (silent) {
            bus->link.status = (int8_t)status;
            end(bus);
        } else {
            look_at_source(bus);
        }
        return;
    }
    if (silent) {
        bus->link.step = bus->link.step < STEP_OUTPUT_ID_AGAIN ? STEP_INPUT_ON : STEP_OUTPUT_ON;
    }
    advance(bus);
}

/* A step was refused or not answered. */
static void on_failure(pdcp_bus_t *bus, pdcp_status_t status)
{
    const bool silent = status == PDCP_ERR_NO_ANSWER;
    if (bus->link.kind == PDCP_TODO_WRITE) {
        leave_out(bus, status);
        return;
    }
    if (bus->link.step == STEP_OUTPUT_ID && has_id(bus, bus->link.output)) {
        pdcp_bind_take_output_id(
            bus, channel_of(bus, bus->link.output)); /* it may have it, and gets another one */
    }
    if (!bus->link.undoing) {
        if (bus->link.step == STEP_TYPE && status == PDCP_ERR_REFUSED) {
            advance(bus); /* a device without the profile layer (D-BUS-20) */
        } else {
            bus->link.once = silent;
            give_up(bus, status);
        }
        return;
    }
    if (silent) {
        bus->link.status = (int8_t)status;
    }
    if (silent && bus->link.step != STEP_OUTPUT_ON) {
        end(bus); /* the rest is for the same silent device */
    } else {
        advance(bus);
    }
}

uint8_t pdcp_link_give_up_wish(pdcp_bus_t *bus)
{
    const uint8_t at = bus->link.at;
    pdcp_link_forget_wish(bus, PDCP_ERR_NO_ANSWER);
    if (!bus->link.active || !bus->link.for_host) {
        return PDCP_NONE;
    }
    bus->link.for_host = false;
    pdcp_bus_tell_link(bus, PDCP_EVENT_WISH, bus->link.input, PDCP_ERR_NO_ANSWER);
    if (bus->link.undoing) {
        return PDCP_NONE;
    }
    if (at != PDCP_NONE) {
        pdcp_request_cancel(bus, at);
        bus->link.at = PDCP_NONE;
    }
    on_failure(bus, PDCP_ERR_NO_ANSWER);
    run(bus);
    return at;
}

static void on_success(pdcp_bus_t *bus, const pdcp_reply_t *reply)
{
    took_effect(bus, reply);
    bus->link.once = false;
    if (bus->link.kind == PDCP_TODO_WRITE && bus->link.step <= STEP_READ_SERIAL) {
        look_at_source(bus);
    } else if (bus->link.step == STEP_READ_SERIAL) {
        resolve(bus);
    } else if (bus->link.undoing || bus->link.input != PDCP_NONE) { /* else run finds out, and gives up */
        advance(bus);
    }
}

void pdcp_link_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply)
{
    bus->link.at = PDCP_NONE;
    if (reply->status == PDCP_OK) {
        on_success(bus, reply);
    } else {
        on_failure(bus, (pdcp_status_t)reply->status);
    }
    run(bus);
}

/* Begins to write what the tables say; for a device that has asked only if it names another source. */
static void begin_writing(pdcp_bus_t *bus, uint8_t number, bool for_device)
{
    const pdcp_channel_t *input = &bus->nodes.channels[number];
    const bool is_active = input->link == PDCP_LINK_ACTIVE;
    begin(bus, PDCP_TODO_WRITE, number, is_active ? input->feed : (uint8_t)PDCP_NONE);
    if (for_device) {
        bus->link.for_device = true;
        bus->link.step = STEP_READ_VID_PID;
    }
}

/* Starts a job that a channel has to do, if it can be done now. */
static void start_todo(pdcp_bus_t *bus, uint8_t number, pdcp_todo_t todo)
{
    pdcp_channel_t *channel = &bus->nodes.channels[number];
    uint8_t input = number;
    uint8_t output = PDCP_NONE;
    drop_todo(channel, todo == PDCP_TODO_SILENCE ? SILENCES : (unsigned)todo);
    if (todo == PDCP_TODO_CONNECT) {
        output = find_source(bus, channel);
        channel->feed = output;
        if (output == PDCP_NONE || !is_ready(bus, number)) {
            silence_again(bus, number);
            pdcp_bus_tell_link(bus, PDCP_EVENT_LINK, number, PDCP_ERR_NO_ANSWER);
            return;
        }
    } else if (channel->transfer != PDCP_INPUT) {
        input = PDCP_NONE;
        output = number;
    }
    if (todo == PDCP_TODO_UPDATE && input == PDCP_NONE) { /* its direction was not known when it came */
        answer_update(bus, channel->node, channel->index, false);
        return;
    }
    if (input == PDCP_NONE && output_is_needed(bus, number)) {
        return; /* by a link made meanwhile */
    }
    if (todo == PDCP_TODO_WRITE || (todo == PDCP_TODO_UPDATE && bus->link.stored)) {
        begin_writing(bus, number, todo == PDCP_TODO_UPDATE);
        return;
    }
    begin(bus, todo, input, output);
    if (todo == PDCP_TODO_REMOVE) {
        pdcp_nodes_clear_source(channel);
    }
}

static void start_wish(pdcp_bus_t *bus)
{
    pdcp_channel_t *input = &bus->nodes.channels[bus->link.wish_input];
    if (!is_ready(bus, bus->link.wish_input) || !is_ready(bus, bus->link.wish_output)) {
        pdcp_link_forget_wish(bus, PDCP_ERR_NO_ANSWER);
        return;
    }
    if (input->link == PDCP_LINK_ACTIVE && input->feed == bus->link.wish_output) {
        pdcp_link_forget_wish(bus, PDCP_OK);
        return;
    }
    if (bus->link.wish_sole &&
        pdcp_nodes_rival(&bus->nodes, bus->link.wish_output, bus->link.wish_input) != PDCP_NONE) {
        pdcp_link_forget_wish(bus, PDCP_ERR_SOLE); /* another link was made while this one waited */
        return;
    }
    drop_todo(input, PDCP_TODO_CONNECT | SILENCES); /* it begins with the input off */
    begin(bus, PDCP_TODO_CONNECT, bus->link.wish_input, bus->link.wish_output);
    bus->link.for_host = true;
    bus->link.wish_input = PDCP_NONE;
}

/* What is to be done next, PDCP_TODO_NONE: nothing, and for which channel: what silences comes before what
 * connects. */
static pdcp_todo_t next_todo(const pdcp_bus_t *bus, uint8_t *number)
{
    unsigned best = PDCP_TODO_NONE;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = &bus->nodes.channels[i];
        const unsigned lowest = channel->todo & (0u - channel->todo);
        if (lowest != PDCP_TODO_NONE && (best == PDCP_TODO_NONE || lowest < best) &&
            bus->nodes.nodes[channel->node].state != PDCP_NODE_SETUP) {
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
    if (bus->link.wish_input != PDCP_NONE) {
        return true;
    }
    const pdcp_todo_t todo = bus->link.due ? next_todo(bus, &number) : PDCP_TODO_NONE;
    return todo != PDCP_TODO_NONE && todo != PDCP_TODO_AGAIN;
}

bool pdcp_link_is_settled(const pdcp_bus_t *bus)
{
    return (!bus->link.active || bus->link.kind == PDCP_TODO_AGAIN) && !has_work(bus);
}

bool pdcp_link_is_making(const pdcp_bus_t *bus)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = &bus->nodes.channels[i];
        if ((channel->todo & PDCP_TODO_CONNECT) != 0 &&
            bus->nodes.nodes[channel->node].state == PDCP_NODE_READY) {
            return true;
        }
    }
    return bus->link.active && bus->link.kind == PDCP_TODO_CONNECT;
}

/* Everybody else comes first (D-BUS-22): a device that beacons and does not answer holds up nobody. But who
 * waits for its place is served when a request of it ends, so that none may be broken off. */
static void break_off(pdcp_bus_t *bus)
{
    if (bus->link.at != PDCP_NONE) {
        const pdcp_node_t *device = pdcp_bus_node(bus, bus->link.at);
        if (device->asked_again || device->reset_asked) {
            return;
        }
        pdcp_request_cancel(bus, bus->link.at);
        bus->link.at = PDCP_NONE;
    }
    bus->link.active = false;
    silence_again(bus, bus->link.input);
    silence_again(bus, bus->link.output);
}

void pdcp_link_step(pdcp_bus_t *bus)
{
    if (bus->link.active && bus->link.kind == PDCP_TODO_AGAIN && has_work(bus)) {
        break_off(bus);
    }
    run(bus);
    while (!bus->link.active && bus->link.due) {
        uint8_t number = PDCP_NONE;
        const pdcp_todo_t todo = next_todo(bus, &number);
        if (bus->link.wish_input != PDCP_NONE && todo != PDCP_TODO_SILENCE && todo != PDCP_TODO_REMOVE) {
            start_wish(bus);
        } else if (todo != PDCP_TODO_NONE) {
            start_todo(bus, number, todo);
        } else {
            bus->link.due = false;
        }
        run(bus);
    }
}
