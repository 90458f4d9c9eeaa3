#include "pdcp_bind.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_time.h"

/* May a device or an output have this id (D-BUS-2)? */
static bool is_node_id(uint8_t id)
{
    return id >= PDCP_NODE_MIN && id <= PDCP_NODE_MAX;
}

void pdcp_bind_init(pdcp_bind_t *bind, uint32_t seed)
{
    bind->output_id = (uint8_t)(PDCP_NODE_MIN + seed % PDCP_NODE_MAX);
}

/* 0: it is not remembered. */
static uint8_t remembered_id(const pdcp_bind_t *bind, const pdcp_identity_t *identity)
{
    for (uint8_t i = 0; i < bind->remembered_count; i++) {
        if (pdcp_identity_equal(&bind->remembered[i].identity, identity)) {
            return bind->remembered[i].node_id;
        }
    }
    return 0;
}

static bool is_remembered(const pdcp_bind_t *bind, uint8_t id)
{
    for (uint8_t i = 0; i < bind->remembered_count; i++) {
        if (bind->remembered[i].node_id == id) {
            return true;
        }
    }
    return false;
}

bool pdcp_bind_remember_stored(pdcp_bind_t *bind, const pdcp_remembered_t *entry)
{
    if (bind->remembered_count == PDCP_IDENTITIES_MAX || !is_node_id(entry->node_id) ||
        is_remembered(bind, entry->node_id) || remembered_id(bind, &entry->identity) != 0) {
        return false;
    }
    bind->remembered[bind->remembered_count++] = *entry;
    return true;
}

/* Puts identity and id in front; whoever was remembered with this id is forgotten. */
static void remember(pdcp_bind_t *bind, const pdcp_identity_t *identity, uint8_t id)
{
    pdcp_remembered_t *const first = bind->remembered;
    const pdcp_remembered_t *const end = &first[bind->remembered_count];
    pdcp_remembered_t *kept = first;
    for (const pdcp_remembered_t *entry = first; entry != end; entry++) {
        if (entry->node_id != id && !pdcp_identity_equal(&entry->identity, identity)) {
            *kept++ = *entry;
        }
    }
    uint8_t count = (uint8_t)(kept - first);
    if (count == PDCP_IDENTITIES_MAX) {
        count--;
    }
    memmove(&first[1], first, count * sizeof *first);
    first->identity = *identity;
    first->node_id = id;
    bind->remembered_count = (uint8_t)(count + 1u);
}

/* Gives back the id that is reserved for an identity, 0: none. */
static uint8_t release_reserved(pdcp_bind_t *bind, const pdcp_identity_t *identity)
{
    for (uint8_t i = 0; i < PDCP_RESERVED_MAX; i++) {
        pdcp_reserved_t *reserved = &bind->reserved[i];
        const uint8_t id = reserved->node_id;
        if (id != 0 && pdcp_identity_equal(&reserved->identity, identity)) {
            reserved->node_id = 0;
            return id;
        }
    }
    return 0;
}

/* Reserves the id. The latest reservation stands first, so that the one that ends first falls out if no entry
 * is free. The identity has none. */
static void reserve(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t id)
{
    pdcp_reserved_t *const first = bus->bind.reserved;
    uint8_t count = 0;
    while (count < PDCP_RESERVED_MAX - 1 && first[count].node_id != 0) {
        count++;
    }
    memmove(&first[1], first, count * sizeof *first);
    first->identity = *identity;
    first->node_id = id;
    first->until_ms = bus->now_ms + PDCP_BIND_TIMEOUT_MS;
}

void pdcp_bind_on_time(pdcp_bus_t *bus)
{
    pdcp_reserved_t *reserved = bus->bind.reserved;
    for (uint8_t i = 0; i < PDCP_RESERVED_MAX; i++) {
        if (pdcp_time_reached(bus->now_ms, reserved[i].until_ms)) {
            reserved[i].node_id = 0;
        }
    }
}

static bool is_free(const pdcp_bus_t *bus, uint8_t id)
{
    if (!is_node_id(id) || bus->tables.owner[id] != 0) {
        return false;
    }
    for (uint8_t i = 0; i < PDCP_RESERVED_MAX; i++) {
        const pdcp_reserved_t *reserved = &bus->bind.reserved[i];
        if (reserved->node_id == id && pdcp_time_before(bus->now_ms, reserved->until_ms)) {
            return false;
        }
    }
    return true;
}

/* May nobody still speak on the id, or listen to it (D-BUS-36)? */
static bool is_quiet(const pdcp_bus_t *bus, uint8_t id)
{
    return pdcp_unknown_silence(&bus->unknown, id) == PDCP_UNKNOWN_QUIET &&
           !pdcp_tables_may_hear(&bus->tables, id);
}

static uint8_t next_id(uint8_t id, int8_t step)
{
    id = (uint8_t)(id + step);
    if (!is_node_id(id)) {
        return step > 0 ? PDCP_NODE_MIN : PDCP_NODE_MAX;
    }
    return id;
}

/* The free id that was unheard longest. 0: none is left. */
static uint8_t unheard_id(const pdcp_bus_t *bus)
{
    uint8_t best = 0;
    uint8_t id = PDCP_NODE_MAX;
    for (uint8_t left = PDCP_NODE_MAX; left > 0; left--) {
        id = next_id(id, 1);
        if (is_free(bus, id) && (best == 0 || pdcp_unknown_silence(&bus->unknown, id) >
                                                  pdcp_unknown_silence(&bus->unknown, best))) {
            best = id;
        }
    }
    return best;
}

/* The first free and quiet id from this one on that nobody is remembered with; while there is none, that of
 * the identity that was away longest; else the one that was unheard longest. step: 1 or -1. 0: none is
 * left. */
static uint8_t pick_id(const pdcp_bus_t *bus, uint8_t id, int8_t step)
{
    for (uint8_t left = PDCP_NODE_MAX; left > 0; left--) {
        if (is_free(bus, id) && !is_remembered(&bus->bind, id) && is_quiet(bus, id)) {
            return id;
        }
        id = next_id(id, step);
    }
    for (uint8_t i = bus->bind.remembered_count; i-- > 0;) {
        id = bus->bind.remembered[i].node_id;
        if (is_free(bus, id) && is_quiet(bus, id)) {
            return id;
        }
    }
    return unheard_id(bus);
}

/* The id that this identity is to have: its old one, the one it asks for, the one reserved for it, which is
 * given back first, or any (D-BUS-6). */
static uint8_t choose_id(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked)
{
    const uint8_t reserved = release_reserved(&bus->bind, identity);
    const uint8_t old = remembered_id(&bus->bind, identity);
    if (is_free(bus, old)) {
        return old;
    }
    if (is_free(bus, asked) && !is_remembered(&bus->bind, asked) && is_quiet(bus, asked)) {
        return asked;
    }
    return is_free(bus, reserved) ? reserved : pick_id(bus, PDCP_NODE_MIN, 1); /* D-BUS-24 */
}

/* [PDCP 3.2.1]: the answer goes to the id that was asked for. */
static void answer(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked, uint8_t id,
                   pdcp_stat_t stat)
{
    pdcp_msg_t msg = {.code = PDCP_BIND_DEVICE | PDCP_ANSWER, .node_id = id};
    msg.identity = *identity;
    pdcp_bus_count(bus, stat);
    (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, asked, &msg);
}

/* The device is to have this id: it is granted if it asked for it, else suggested. */
static pdcp_bind_result_t offer(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked, uint8_t id)
{
    (void)release_reserved(&bus->bind, identity);
    if (id != asked) {
        reserve(bus, identity, id);
        answer(bus, identity, asked, id, PDCP_STAT_BIND_SUGGESTED);
        return PDCP_BIND_SUGGESTED;
    }
    answer(bus, identity, asked, id, PDCP_STAT_BIND_GRANTED);
    if (remembered_id(&bus->bind, identity) == id) {
        remember(&bus->bind, identity, id); /* it is the one used last; order alone is not worth a write */
    }
    return PDCP_BIND_GRANTED;
}

void pdcp_bind_on_ready(pdcp_bus_t *bus, const pdcp_device_entry_t *device)
{
    if (remembered_id(&bus->bind, &device->identity) != device->node_id) {
        remember(&bus->bind, &device->identity, device->node_id);
        pdcp_bus_tell_device(bus, PDCP_EVENT_IDENTITIES, PDCP_NONE);
    }
}

bool pdcp_bind_is_known(const pdcp_bus_t *bus, const pdcp_identity_t *identity)
{
    return remembered_id(&bus->bind, identity) != 0 ||
           (bus->knows != NULL && bus->knows(bus->event_ctx, identity));
}

/* Have identities that are not known as many places as they may (D-BUS-43)? */
static bool is_crowded(const pdcp_bus_t *bus)
{
    uint8_t places = 0;
    if (pdcp_bus_age_ms(bus) < PDCP_CROWD_MS) {
        return false;
    }
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_device_entry_t *device = &bus->tables.devices[i];
        places = (uint8_t)(places +
                           (device->state != PDCP_PLACE_FREE && !pdcp_bind_is_known(bus, &device->identity)));
    }
    return places >= PDCP_UNKNOWN_PLACES;
}

pdcp_bind_result_t pdcp_bind_on_request(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked,
                                        uint8_t *place)
{
    *place = pdcp_tables_find(&bus->tables, identity);
    if (*place != PDCP_NONE) {
        pdcp_device_entry_t *known = &bus->tables.devices[*place];
        if (known->state == PDCP_PLACE_LOST) { /* it gets its old id and no other */
            return offer(bus, identity, asked, known->node_id);
        }
        known->asked_again = true;
        known->asked_id = asked;
        return PDCP_BIND_CHECK;
    }
    /* Without a place nothing is given back. With one, an id that is reserved is there to be had. */
    uint8_t free_place = pdcp_tables_free_place(&bus->tables);
    if (!pdcp_bind_is_known(bus, identity) && is_crowded(bus)) {
        free_place = PDCP_NONE;
    }
    const uint8_t id = free_place != PDCP_NONE ? choose_id(bus, identity, asked) : 0;
    if (id == 0) {
        answer(bus, identity, asked, PDCP_NODE_REFUSED, PDCP_STAT_BIND_REFUSED);
        pdcp_bus_tell_device(bus, PDCP_EVENT_REFUSED, PDCP_NONE);
        return PDCP_BIND_REFUSED;
    }
    if (id == asked) {
        *place = free_place;
        pdcp_tables_add(&bus->tables, free_place, identity, asked);
    }
    return offer(bus, identity, asked, id);
}

pdcp_bind_result_t pdcp_bind_after_check(pdcp_bus_t *bus, uint8_t place, bool answered)
{
    pdcp_device_entry_t *known = &bus->tables.devices[place];
    known->asked_again = false;
    if (!answered) {
        return offer(bus, &known->identity, known->asked_id, known->node_id);
    }
    answer(bus, &known->identity, known->asked_id, PDCP_NODE_REFUSED, PDCP_STAT_BIND_DUPLICATE);
    pdcp_bus_tell_device(bus, PDCP_EVENT_DUPLICATE, place);
    return PDCP_BIND_REFUSED;
}

bool pdcp_bind_is_shut(const pdcp_bus_t *bus)
{
    return bus->bind.shut && pdcp_bus_age_ms(bus) < PDCP_SHUT_MS;
}

uint8_t pdcp_bind_output_id(const pdcp_bus_t *bus)
{
    return pdcp_bind_is_shut(bus) ? 0 : pick_id(bus, bus->bind.output_id, -1);
}

bool pdcp_bind_give_output_id(pdcp_bus_t *bus, pdcp_channel_t *output)
{
    const uint8_t id = pdcp_bind_output_id(bus);
    if (id == 0) {
        return false;
    }
    pdcp_tables_set_output_id(&bus->tables, output, id);
    bus->bind.output_id = next_id(id, -1);
    return true;
}

void pdcp_bind_take_output_id(pdcp_bus_t *bus, pdcp_channel_t *output)
{
    pdcp_unknown_note(&bus->unknown, bus->now_ms, output->node_id);
    pdcp_tables_set_output_id(&bus->tables, output, 0);
}
