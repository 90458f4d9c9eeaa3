#include "pdcp_bind.h"

#include <string.h>

#include "pdcp_bus.h"
#include "pdcp_time.h"

static bool is_node_id(uint8_t id)
{
    return id >= PDCP_NODE_MIN && id <= PDCP_NODE_MAX;
}

static uint8_t remembered_place(const pdcp_bind_t *bind, const pdcp_identity_t *identity)
{
    for (uint8_t i = 0; i < bind->remembered_count; i++) {
        if (pdcp_identity_equal(&bind->remembered[i].identity, identity)) {
            return i;
        }
    }
    return PDCP_NONE;
}

static uint8_t remembered_id(const pdcp_bind_t *bind, const pdcp_identity_t *identity)
{
    const uint8_t place = remembered_place(bind, identity);
    return place != PDCP_NONE ? bind->remembered[place].node_id : 0;
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
        is_remembered(bind, entry->node_id) || remembered_place(bind, &entry->identity) != PDCP_NONE) {
        return false;
    }
    bind->remembered[bind->remembered_count++] = *entry;
    return true;
}

static void forget_place(pdcp_bind_t *bind, uint8_t place)
{
    bind->remembered_count--;
    memmove(&bind->remembered[place], &bind->remembered[place + 1],
            (size_t)(bind->remembered_count - place) * sizeof bind->remembered[0]);
}

/* Puts identity and id in front; whoever was remembered with this id is forgotten. True: the table has
 * changed in more than its order. Order alone is not worth a write to non-volatile memory. */
static bool remember(pdcp_bind_t *bind, const pdcp_identity_t *identity, uint8_t id)
{
    const bool changed = remembered_id(bind, identity) != id;
    for (uint8_t i = bind->remembered_count; i-- > 0;) {
        if (bind->remembered[i].node_id == id ||
            pdcp_identity_equal(&bind->remembered[i].identity, identity)) {
            forget_place(bind, i);
        }
    }
    if (bind->remembered_count == PDCP_IDENTITIES_MAX) {
        bind->remembered_count--;
    }
    memmove(&bind->remembered[1], &bind->remembered[0], bind->remembered_count * sizeof bind->remembered[0]);
    bind->remembered[0].identity = *identity;
    bind->remembered[0].node_id = id;
    bind->remembered_count++;
    return changed;
}

/* Is the id kept for another than identity (NULL: for anybody)? */
static bool is_reserved(const pdcp_bus_t *bus, uint8_t id, const pdcp_identity_t *identity)
{
    for (uint8_t i = 0; i < PDCP_RESERVED_MAX; i++) {
        const pdcp_reserved_t *reserved = &bus->bind.reserved[i];
        if (reserved->node_id == id && pdcp_time_before(bus->now_ms, reserved->until_ms) &&
            (identity == NULL || !pdcp_identity_equal(&reserved->identity, identity))) {
            return true;
        }
    }
    return false;
}

/* Reserves the id, in the entry that the identity has already, a free one, or the one that ends first. */
static void reserve(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t id)
{
    pdcp_reserved_t *best = &bus->bind.reserved[0];
    for (uint8_t i = 0; i < PDCP_RESERVED_MAX; i++) {
        pdcp_reserved_t *entry = &bus->bind.reserved[i];
        if (entry->node_id != 0 && pdcp_identity_equal(&entry->identity, identity)) {
            best = entry;
            break;
        }
        if (best->node_id != 0 &&
            (entry->node_id == 0 || pdcp_time_before(entry->until_ms, best->until_ms))) {
            best = entry;
        }
    }
    best->identity = *identity;
    best->node_id = id;
    best->until_ms = bus->now_ms + PDCP_BIND_TIMEOUT_MS;
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

static void release_reserved(pdcp_bus_t *bus, const pdcp_identity_t *identity)
{
    pdcp_reserved_t *reserved = bus->bind.reserved;
    pdcp_bind_on_time(bus);
    for (uint8_t i = 0; i < PDCP_RESERVED_MAX; i++) {
        if (pdcp_identity_equal(&reserved[i].identity, identity)) {
            reserved[i].node_id = 0;
        }
    }
}

static bool is_free(const pdcp_bus_t *bus, uint8_t id, const pdcp_identity_t *identity)
{
    return is_node_id(id) && bus->nodes.owner[id] == 0 && !is_reserved(bus, id, identity);
}

/* The lowest free id that nobody is remembered with; while there is none, that of the identity that was away
 * longest. */
static uint8_t pick_id(const pdcp_bus_t *bus, const pdcp_identity_t *identity)
{
    const pdcp_bind_t *bind = &bus->bind;
    for (uint16_t i = PDCP_NODE_MIN; i <= (uint16_t)PDCP_NODE_MAX; i++) {
        const uint8_t id = (uint8_t)i;
        if (is_free(bus, id, identity) && !is_remembered(bind, id)) {
            return id;
        }
    }
    for (uint8_t i = bind->remembered_count; i-- > 0;) {
        const uint8_t id = bind->remembered[i].node_id;
        if (is_free(bus, id, identity)) {
            return id;
        }
    }
    return 0;
}

/* The id that this identity is to have: its old one, the one it asks for, or any (D-BUS-6). */
static uint8_t choose_id(const pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked)
{
    const pdcp_bind_t *bind = &bus->bind;
    const uint8_t old = remembered_id(bind, identity);
    if (old != 0 && is_free(bus, old, identity)) {
        return old;
    }
    if (is_free(bus, asked, identity) && !is_remembered(bind, asked)) {
        return asked;
    }
    for (uint8_t i = 0; i < PDCP_RESERVED_MAX; i++) {
        const pdcp_reserved_t *own = &bind->reserved[i];
        if (own->node_id != 0 && pdcp_identity_equal(&own->identity, identity) &&
            is_free(bus, own->node_id, identity)) {
            return own->node_id;
        }
    }
    return pick_id(bus, identity);
}

/* [PDCP 3.2.1]: the answer goes to the id that was asked for. */
static void answer(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked, uint8_t id)
{
    const pdcp_msg_t msg = {.code = PDCP_BIND_DEVICE | PDCP_ANSWER, .node_id = id, .identity = *identity};
    (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, asked, &msg);
}

static pdcp_bind_result_t refuse(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked)
{
    pdcp_bus_count(bus, PDCP_STAT_BIND_REFUSED);
    answer(bus, identity, asked, PDCP_NODE_REFUSED);
    pdcp_bus_tell_node(bus, PDCP_EVENT_REFUSED, PDCP_NONE);
    return PDCP_BIND_REFUSED;
}

static pdcp_bind_result_t grant(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked)
{
    release_reserved(bus, identity);
    pdcp_bus_count(bus, PDCP_STAT_BIND_GRANTED);
    answer(bus, identity, asked, asked);
    if (remember(&bus->bind, identity, asked)) {
        pdcp_bus_tell_node(bus, PDCP_EVENT_IDENTITIES, PDCP_NONE);
    }
    return PDCP_BIND_GRANTED;
}

static pdcp_bind_result_t suggest(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked, uint8_t id)
{
    reserve(bus, identity, id);
    pdcp_bus_count(bus, PDCP_STAT_BIND_SUGGESTED);
    answer(bus, identity, asked, id);
    return PDCP_BIND_SUGGESTED;
}

/* A device whose place is kept gets its old id and no other. */
static pdcp_bind_result_t take_back(pdcp_bus_t *bus, uint8_t node, uint8_t asked)
{
    const pdcp_node_t *back = &bus->nodes.nodes[node];
    if (asked != back->node_id) {
        return suggest(bus, &back->identity, asked, back->node_id);
    }
    return grant(bus, &back->identity, asked);
}

pdcp_bind_result_t pdcp_bind_on_request(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked,
                                        uint8_t *node)
{
    *node = pdcp_nodes_find(&bus->nodes, identity);
    if (*node != PDCP_NONE) {
        pdcp_node_t *known = &bus->nodes.nodes[*node];
        if (known->state == PDCP_NODE_LOST) {
            return take_back(bus, *node, asked);
        }
        known->asked_again = true;
        known->asked_id = asked;
        return PDCP_BIND_CHECK;
    }
    const uint8_t id = choose_id(bus, identity, asked);
    const uint8_t place = pdcp_nodes_free_place(&bus->nodes);
    if (id == 0 || place == PDCP_NONE) {
        return refuse(bus, identity, asked);
    }
    if (id != asked) {
        return suggest(bus, identity, asked, id);
    }
    *node = place;
    pdcp_nodes_add(&bus->nodes, place, identity, asked);
    return grant(bus, identity, asked);
}

pdcp_bind_result_t pdcp_bind_after_check(pdcp_bus_t *bus, uint8_t node, bool answered)
{
    pdcp_node_t *known = &bus->nodes.nodes[node];
    known->asked_again = false;
    if (!answered) {
        return take_back(bus, node, known->asked_id);
    }
    pdcp_bus_count(bus, PDCP_STAT_BIND_DUPLICATE);
    answer(bus, &known->identity, known->asked_id, PDCP_NODE_REFUSED);
    pdcp_bus_tell_node(bus, PDCP_EVENT_DUPLICATE, node);
    return PDCP_BIND_REFUSED;
}

uint8_t pdcp_bind_output_id(const pdcp_bus_t *bus)
{
    uint8_t remembered = 0;
    for (uint8_t id = PDCP_NODE_MAX; id >= PDCP_NODE_MIN; id--) {
        if (is_free(bus, id, NULL)) {
            if (!is_remembered(&bus->bind, id)) {
                return id;
            }
            remembered = id;
        }
    }
    return remembered;
}
