#include "pdcp_audit.h"

#include <string.h>

#include "pdcp_bus.h"
#include "pdcp_bytes.h"
#include "pdcp_ends.h"
#include "pdcp_link.h"

enum {
    SPARE_EVERY = 4,                   /* of so many questions one is for a channel without a link */
    WINDOW = 60000 / PDCP_AUDIT_MS,    /* a minute */
    TOO_MANY = PDCP_AUDIT_REPAIRS + 2, /* differences, of which the host is told no more */
    WALK_END = PDCP_AUDIT_KINDS * PDCP_CHANNELS_MAX
};

void pdcp_audit_begin(pdcp_bus_t *bus)
{
    bus->audit.on = true;
    pdcp_bus_wake(bus, PDCP_TIMER_AUDIT, PDCP_AUDIT_MS);
}

void pdcp_audit_init(pdcp_bus_t *bus)
{
    const bool on = bus->audit.on;
    memset(&bus->audit, 0, sizeof bus->audit);
    bus->audit.asked = PDCP_NONE;
    bus->audit.at[PDCP_AUDIT_HURRY] = WALK_END;
    if (on) {
        pdcp_audit_begin(bus);
    }
}

void pdcp_audit_on_ready(pdcp_bus_t *bus, uint8_t place)
{
    for (unsigned at = 0; at < WALK_END; at++) {
        const uint8_t number = (uint8_t)(at % PDCP_CHANNELS_MAX);
        if (bus->tables.channels[number].place == place) {
            pdcp_bit_set(bus->audit.refused[at / PDCP_CHANNELS_MAX], number, false);
        }
    }
    if (bus->audit.asleep) {
        bus->audit.asleep = false;
        pdcp_bus_wake(bus, PDCP_TIMER_AUDIT, PDCP_AUDIT_MS);
    }
}

void pdcp_audit_on_foreign(pdcp_bus_t *bus, uint8_t node_id)
{
    uint8_t place;
    if (pdcp_tables_owner(&bus->tables, node_id, &place) && place != PDCP_NONE) {
        pdcp_bit_set(bus->audit.hurried, place, true);
    }
}

/* --- Questions --- */

static bool is_output(const pdcp_channel_t *channel)
{
    return channel->transfer == PDCP_OUTPUT;
}

/* The parameter that a question is for. */
static uint8_t param_of(const pdcp_channel_t *channel, uint8_t kind)
{
    static const uint8_t params[PDCP_AUDIT_KINDS] = {PDCP_CH_ENABLED, PDCP_IN_SOURCE_NODES,
                                                     PDCP_IN_SOURCE_VID_PID, PDCP_IN_SOURCE_SERIAL};
    return kind == PDCP_AUDIT_NODES && is_output(channel) ? (uint8_t)PDCP_OUT_NODE_ID : params[kind];
}

/* Is the channel an end of an active link? */
static bool is_linked(const pdcp_bus_t *bus, uint8_t number)
{
    const pdcp_channel_t *channel = &bus->tables.channels[number];
    if (!is_output(channel)) {
        return channel->link == PDCP_LINK_ACTIVE;
    }
    return channel->enabled && pdcp_ends_listener(bus, number) != PDCP_NONE;
}

/* Is the input to be asked what it names as its source? Without a link it must name none, which parameter 6
 * tells, but not while the tables have one for it: whether it gets that link is still to be decided. */
static bool is_source_asked(const pdcp_channel_t *input, uint8_t kind)
{
    return input->link != PDCP_LINK_NONE ||
           (kind == PDCP_AUDIT_SERIAL && !pdcp_tables_is_named(input->source.index));
}

/* Is this question asked on this walk? */
static bool is_asked(const pdcp_bus_t *bus, uint8_t number, uint8_t kind, pdcp_audit_walk_t walk)
{
    const pdcp_channel_t *channel = &bus->tables.channels[number];
    if (kind <= PDCP_AUDIT_NODES && is_linked(bus, number)) {
        return walk != PDCP_AUDIT_SPARE;
    }
    if (kind <= PDCP_AUDIT_NODES || walk == PDCP_AUDIT_SPARE) {
        return walk != PDCP_AUDIT_TURN && kind == PDCP_AUDIT_ENABLED;
    }
    return !is_output(channel) && bus->link.planned && is_source_asked(channel, kind);
}

static bool may_ask(pdcp_bus_t *bus, uint8_t place)
{
    return place != PDCP_NONE && pdcp_bus_device(bus, place)->state == PDCP_PLACE_READY &&
           pdcp_request_is_idle(bus, place);
}

/* A question is asked once (D-BUS-59). */
static void ask(pdcp_bus_t *bus, uint8_t number, uint8_t kind)
{
    const pdcp_channel_t *channel = &bus->tables.channels[number];
    bus->link.changed = false;
    bus->audit.asked = number;
    bus->audit.asked_kind = kind;
    bus->audit.asked_place = channel->place;
    pdcp_request_get(bus, channel->place, PDCP_CLIENT_AUDIT, channel->index, param_of(channel, kind),
                     PDCP_VALUE_MAX);
    pdcp_request_limit_tries(bus, channel->place, 1);
}

/* Asks what comes next on a walk. False: it is at its end, and begins anew. */
static bool ask_on(pdcp_bus_t *bus, pdcp_audit_walk_t walk)
{
    pdcp_audit_t *audit = &bus->audit;
    while (audit->at[walk] < WALK_END) {
        const uint8_t number = (uint8_t)(audit->at[walk] % PDCP_CHANNELS_MAX);
        const uint8_t kind = (uint8_t)(audit->at[walk] / PDCP_CHANNELS_MAX);
        const uint8_t place = bus->tables.channels[number].place;
        audit->at[walk]++;
        if ((walk != PDCP_AUDIT_HURRY || place == audit->first) && may_ask(bus, place) &&
            !pdcp_bit(audit->refused[kind], number) && is_asked(bus, number, kind, walk)) {
            ask(bus, number, kind);
            return true;
        }
    }
    audit->at[walk] = 0;
    return false;
}

/* The same, from the beginning of the walk when it is at its end. False: there is nothing to ask. */
static bool ask_round(pdcp_bus_t *bus, pdcp_audit_walk_t walk)
{
    if (ask_on(bus, walk)) {
        return true;
    }
    return ask_on(bus, walk);
}

/* Asks what comes next of the devices that go first, one after the other. */
static bool ask_hurried(pdcp_bus_t *bus)
{
    pdcp_audit_t *audit = &bus->audit;
    for (uint8_t i = 0; i <= PDCP_DEVICES_MAX; i++) {
        if (audit->at[PDCP_AUDIT_HURRY] != WALK_END && ask_on(bus, PDCP_AUDIT_HURRY)) {
            return true;
        }
        audit->first = (uint8_t)((audit->first + 1u) % PDCP_DEVICES_MAX);
        audit->at[PDCP_AUDIT_HURRY] = pdcp_bit(audit->hurried, audit->first) ? 0 : WALK_END;
        pdcp_bit_set(audit->hurried, audit->first, false);
    }
    return false;
}

/* Each second question at most is for a device that goes first: however many frames somebody else sends, the
 * others have their turn. */
static void ask_next(pdcp_bus_t *bus)
{
    const uint8_t count = bus->audit.count++;
    const bool is_spare_due = count % SPARE_EVERY == SPARE_EVERY - 1;
    if (!(is_spare_due && ask_round(bus, PDCP_AUDIT_SPARE)) && !(count % 2 == 0 && ask_hurried(bus))) {
        (void)ask_round(bus, PDCP_AUDIT_TURN);
    }
}

static bool is_asking(pdcp_bus_t *bus)
{
    const uint8_t place = bus->audit.asked_place;
    return !pdcp_request_is_idle(bus, place) &&
           pdcp_bus_device(bus, place)->request.client == PDCP_CLIENT_AUDIT;
}

/* Without devices an arbitrator sleeps from beacon to beacon. */
void pdcp_audit_on_deadline(pdcp_bus_t *bus, bool calm)
{
    pdcp_audit_t *audit = &bus->audit;
    if (audit->window != 0 && --audit->window == 0) {
        memset(audit->found, 0, sizeof audit->found);
    }
    audit->asleep = audit->window == 0 && pdcp_tables_count_state(&bus->tables, PDCP_PLACE_READY) == 0;
    if (audit->asleep) {
        return;
    }
    pdcp_bus_wake(bus, PDCP_TIMER_AUDIT, PDCP_AUDIT_MS);
    if (calm && !is_asking(bus)) {
        ask_next(bus);
    }
}

/* --- Answers --- */

/* Does the value say what the tables say? An output without a link may be the host's (D-BUS-60). */
static bool agrees(pdcp_bus_t *bus, uint8_t number, const pdcp_reply_t *reply)
{
    const pdcp_channel_t *channel = &bus->tables.channels[number];
    const uint8_t first = pdcp_bytes_value_u8(reply->bytes, reply->len, 0);
    if (bus->audit.asked_kind == PDCP_AUDIT_ENABLED && !is_linked(bus, number)) {
        return first == 0 || (is_output(channel) && channel->enabled); /* by the host, who reads it */
    }
    if (bus->audit.asked_kind == PDCP_AUDIT_ENABLED) {
        return first != 0;
    }
    if (is_output(channel)) {
        return first == channel->node_id;
    }
    if (bus->audit.asked_kind == PDCP_AUDIT_NODES) {
        const pdcp_channel_t *source = &bus->tables.channels[channel->source.channel];
        return first == pdcp_bus_device(bus, source->place)->node_id &&
               pdcp_bytes_value_u8(reply->bytes, reply->len, 1) == source->node_id;
    }
    return channel->link != PDCP_LINK_NONE
               ? pdcp_tables_is_source(channel, reply->param, pdcp_request_word(reply, 0),
                                       pdcp_request_word(reply, 2))
               : !pdcp_tables_is_named(pdcp_bytes_value_u8(reply->bytes, reply->len, 2));
}

/* Counts a difference. Returns how many of its kind there are in the minute under way, which begins with the
 * first one; no more than TOO_MANY. When too many channels differ, the last entry counts anew for each of
 * them. */
static uint8_t count_difference(pdcp_audit_t *audit, uint8_t number, bool source)
{
    pdcp_audit_found_t *entry = audit->found;
    const pdcp_audit_found_t *last = &audit->found[PDCP_AUDIT_FOUND_MAX - 1];
    while (entry != last && entry->times != 0 && (entry->channel != number || entry->source != source)) {
        entry++;
    }
    if (entry->channel != number || entry->source != source) {
        *entry = (pdcp_audit_found_t){.channel = number, .source = source};
    }
    if (entry->times < TOO_MANY) {
        entry->times++;
    }
    if (audit->window == 0) {
        audit->window = WINDOW;
    }
    return entry->times;
}

/* A link cannot be kept. What the device does not keep is the input's, or the output's, which may feed
 * several. */
static void let_go(pdcp_bus_t *bus, uint8_t number, uint8_t input)
{
    while (input != PDCP_NONE) {
        pdcp_link_deactivate(bus, input, PDCP_ERR_DIFFERS);
        input = pdcp_ends_listener(bus, number);
    }
}

/* Repairs what differs. An output stands for the first of its links. */
static void on_difference(pdcp_bus_t *bus, uint8_t number)
{
    const pdcp_channel_t *channel = &bus->tables.channels[number];
    const uint8_t kind = bus->audit.asked_kind;
    const bool source = kind > PDCP_AUDIT_NODES;
    const bool linked = is_linked(bus, number);
    const uint8_t input = is_output(channel) && linked ? pdcp_ends_listener(bus, number) : number;
    const uint8_t times = count_difference(&bus->audit, input, source);
    pdcp_bus_count(bus, PDCP_STAT_AUDIT);
    if (times < TOO_MANY) {
        pdcp_bus_tell_link(bus, PDCP_EVENT_AUDIT, number, (pdcp_status_t)param_of(channel, kind));
    }
    if (!linked && !source) {
        pdcp_link_silence(bus, number);
    } else if (times <= PDCP_AUDIT_REPAIRS) {
        pdcp_link_write(bus, input);
    } else if (!source) {
        let_go(bus, number, input);
    }
}

/* Silence is no difference (D-BUS-59). A refusal is none either, and is not asked again (D-BUS-40). */
void pdcp_audit_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply)
{
    const uint8_t number = bus->audit.asked;
    if (number == PDCP_NONE || bus->link.changed || reply->status == PDCP_ERR_NO_ANSWER) {
        return; /* the tables may say something else than when it was asked */
    }
    bus->audit.asked = PDCP_NONE;
    if (reply->status != PDCP_OK) {
        pdcp_bit_set(bus->audit.refused[bus->audit.asked_kind], number, true);
    } else if (!agrees(bus, number, reply)) {
        on_difference(bus, number);
    } else if (bus->audit.asked_kind == PDCP_AUDIT_ENABLED && !is_linked(bus, number)) {
        /* What was to be disabled may have refused that before. */
        bus->tables.channels[number].enabled = pdcp_bytes_value_u8(reply->bytes, reply->len, 0) != 0;
    }
}
