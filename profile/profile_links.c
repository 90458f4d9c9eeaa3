#include "profile_links.h"

#include <string.h>

#include "profile_match.h"
#include "profile_type.h"

void profile_links_init(profile_links_t *links)
{
    memset(links, 0, sizeof *links);
}

static const pdcp_identity_t *owner_of(const profile_links_t *links, const profile_ref_t *end)
{
    return &links->parts[end->part].identity;
}

/* The part with this identity; PDCP_NONE: no entry names this device. *spare: a part that is free, PDCP_NONE:
 * there is none; *unused: how many there are. */
static uint8_t find_part(const profile_links_t *links, const pdcp_identity_t *identity, uint8_t *spare,
                         uint8_t *unused)
{
    uint8_t used[(PROFILE_PARTS_MAX + 7) / 8];
    uint8_t found = PDCP_NONE;
    memset(used, 0, sizeof used);
    for (uint8_t i = 0; i < links->count; i++) {
        profile_set_bit(used, links->entries[i].output.part, true);
        profile_set_bit(used, links->entries[i].input.part, true);
    }
    *spare = PDCP_NONE;
    *unused = 0;
    for (uint8_t i = 0; i < PROFILE_PARTS_MAX; i++) {
        if (!profile_bit(used, i)) {
            *spare = i;
            ++*unused;
        } else if (pdcp_identity_equal(&links->parts[i].identity, identity)) {
            found = i;
        }
    }
    return found;
}

static bool has_room(const profile_links_t *links, const profile_link_t *link)
{
    uint8_t spare;
    uint8_t unused;
    uint8_t needed = 0;
    if (find_part(links, &link->output.owner, &spare, &unused) == PDCP_NONE) {
        needed++;
    }
    if (find_part(links, &link->input.owner, &spare, &unused) == PDCP_NONE) {
        needed++;
    }
    return links->count < PROFILE_LINKS_MAX && needed <= unused;
}

/* Fills an end of an entry; there is room. */
static void put_end(profile_links_t *links, profile_ref_t *ref, const profile_end_t *end)
{
    uint8_t spare;
    uint8_t unused;
    uint8_t part = find_part(links, &end->owner, &spare, &unused);
    if (part == PDCP_NONE) {
        part = spare;
    }
    links->parts[part].identity = end->owner;
    links->parts[part].type = end->owner_type;
    links->parts[part].profile = end->owner_profile;
    ref->part = part;
    ref->index = end->index;
    ref->type = end->type;
    ref->profile = end->profile;
}

/* Is the input of entry a before that of entry b? */
static bool is_before(const profile_links_t *links, const profile_entry_t *a, const profile_entry_t *b)
{
    if (a->input.profile != b->input.profile) {
        return a->input.profile < b->input.profile;
    }
    const int8_t order = profile_order(owner_of(links, &a->input), owner_of(links, &b->input));
    return order != 0 ? order < 0 : a->input.index < b->input.index;
}

/* Moves the last entry to its place. */
static void sort_in(profile_links_t *links)
{
    uint8_t at = (uint8_t)(links->count - 1u);
    const profile_entry_t entry = links->entries[at];
    while (at > 0 && is_before(links, &entry, &links->entries[at - 1])) {
        links->entries[at] = links->entries[at - 1];
        at--;
    }
    links->entries[at] = entry;
}

static void append(profile_links_t *links, const profile_entry_t *entry)
{
    links->entries[links->count++] = *entry;
    sort_in(links);
}

bool profile_links_put(profile_links_t *links, const profile_link_t *link, bool by_host)
{
    const uint8_t old = profile_links_find(links, &link->input.owner, link->input.index);
    profile_entry_t removed = {.stand_in = PDCP_NONE};
    if (old != PDCP_NONE) {
        removed = links->entries[old];
        profile_links_remove(links, old);
    }
    if (!has_room(links, link)) {
        if (old != PDCP_NONE) {
            append(links, &removed);
        }
        return false;
    }
    profile_entry_t *entry = &links->entries[links->count];
    entry->stand_in = PDCP_NONE;
    entry->by_host = by_host;
    put_end(links, &entry->input, &link->input);
    entry->output.part = entry->input.part;
    links->count++; /* the part counts as used */
    put_end(links, &entry->output, &link->output);
    sort_in(links);
    return true;
}

void profile_links_remove(profile_links_t *links, uint8_t entry)
{
    links->count--;
    memmove(&links->entries[entry], &links->entries[entry + 1],
            (size_t)(links->count - entry) * sizeof links->entries[0]);
}

static bool is_sole(uint16_t word)
{
    profile_type_t type;
    (void)profile_type_decode(word, &type);
    return type.sole_access;
}

bool profile_links_is_claimed(const profile_links_t *links, const profile_link_t *link)
{
    const uint8_t own = profile_links_find(links, &link->input.owner, link->input.index);
    for (uint8_t i = 0; i < links->count && is_sole(link->input.type); i++) {
        const profile_entry_t *entry = &links->entries[i];
        if (i != own && is_sole(entry->input.type) && entry->output.index == link->output.index &&
            pdcp_identity_equal(owner_of(links, &entry->output), &link->output.owner)) {
            return true;
        }
    }
    return false;
}

uint8_t profile_links_find(const profile_links_t *links, const pdcp_identity_t *owner, uint8_t index)
{
    for (uint8_t i = 0; i < links->count; i++) {
        const profile_ref_t *input = &links->entries[i].input;
        if (input->index == index && pdcp_identity_equal(owner_of(links, input), owner)) {
            return i;
        }
    }
    return PDCP_NONE;
}

uint8_t profile_links_of(const profile_links_t *links, const pdcp_nodes_t *nodes, uint8_t channel)
{
    const pdcp_channel_t *input = &nodes->channels[channel];
    return profile_links_find(links, &nodes->nodes[input->node].identity, input->index);
}

static void get_end(const profile_links_t *links, const profile_ref_t *ref, profile_end_t *end)
{
    const profile_part_t *part = &links->parts[ref->part];
    end->owner = part->identity;
    end->owner_type = part->type;
    end->owner_profile = part->profile;
    end->type = ref->type;
    end->profile = ref->profile;
    end->index = ref->index;
}

void profile_links_get(const profile_links_t *links, uint8_t entry, profile_link_t *link)
{
    get_end(links, &links->entries[entry].output, &link->output);
    get_end(links, &links->entries[entry].input, &link->input);
}

bool profile_links_owns(const profile_links_t *links, const profile_ref_t *end, const pdcp_nodes_t *nodes,
                        uint8_t place)
{
    return pdcp_identity_equal(owner_of(links, end), &nodes->nodes[place].identity);
}

uint8_t profile_links_place(const profile_links_t *links, const pdcp_nodes_t *nodes, const profile_ref_t *end)
{
    return pdcp_nodes_find(nodes, owner_of(links, end));
}

uint8_t profile_links_channel(const profile_links_t *links, const pdcp_nodes_t *nodes,
                              const profile_ref_t *end, uint8_t transfer)
{
    const uint8_t place = profile_links_place(links, nodes, end);
    if (place == PDCP_NONE) {
        return PDCP_NONE;
    }
    const uint8_t channel = pdcp_nodes_channel(nodes, place, end->index);
    return profile_is_ready(nodes, channel, transfer) ? channel : PDCP_NONE;
}

static void put_owner(const pdcp_nodes_t *nodes, uint8_t place, profile_end_t *end)
{
    end->owner_type = place != PDCP_NONE ? nodes->nodes[place].type : 0;
    end->owner_profile = place != PDCP_NONE ? nodes->nodes[place].profile : 0;
}

void profile_end_of(const pdcp_nodes_t *nodes, uint8_t channel, profile_end_t *end)
{
    const pdcp_channel_t *entry = &nodes->channels[channel];
    end->owner = nodes->nodes[entry->node].identity;
    end->index = entry->index;
    end->type = entry->type;
    end->profile = entry->profile;
    put_owner(nodes, entry->node, end);
}

bool profile_source_of(const pdcp_nodes_t *nodes, uint8_t input, profile_end_t *end)
{
    const pdcp_channel_t *entry = &nodes->channels[input];
    if (entry->source_index == PDCP_NO_SOURCE_INDEX || entry->source_index == 0) {
        return false;
    }
    end->owner = entry->source;
    end->index = entry->source_index;
    end->type = entry->source_type;
    end->profile = entry->source_profile;
    put_owner(nodes, pdcp_nodes_find(nodes, &entry->source), end);
    return true;
}
