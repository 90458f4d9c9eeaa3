#include "profile_links.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_bits.h"
#include "profile_channel.h"
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

/* The part of a device: the used one with this identity, or an unused one, which gets it; it is used now.
 * PDCP_NONE: there is no room. */
static uint8_t take_part(profile_links_t *links, uint8_t *used, const pdcp_identity_t *owner)
{
    profile_part_t *unused = NULL;
    uint8_t part = PDCP_NONE;
    profile_part_t *at = links->parts;
    for (uint8_t i = 0; i < PROFILE_PARTS_MAX; i++, at++) {
        if (!pdcp_bit(used, i)) {
            part = i;
            unused = at;
        } else if (pdcp_identity_equal(&at->identity, owner)) {
            return i;
        }
    }
    if (unused != NULL) {
        unused->identity = *owner;
        pdcp_bit_set(used, part, true);
    }
    return part;
}

static void put_end(profile_links_t *links, profile_ref_t *ref, uint8_t part, const profile_end_t *end)
{
    profile_part_t *owner = &links->parts[part];
    owner->type = end->owner_type;
    owner->profile = end->owner_profile;
    ref->type = end->type;
    ref->profile = end->profile;
    ref->part = part;
    ref->index = end->index;
}

/* Makes room for the entry of this input, at its place in the order. */
static profile_entry_t *insert(profile_links_t *links, const profile_end_t *input)
{
    profile_entry_t *entry = &links->entries[links->count++];
    while (entry > links->entries &&
           profile_match_precedes(input->profile, &input->owner, input->index, entry[-1].input.profile,
                                  owner_of(links, &entry[-1].input), entry[-1].input.index)) {
        entry[0] = entry[-1];
        entry--;
    }
    return entry;
}

bool profile_links_put(profile_links_t *links, const profile_link_t *link, bool by_host)
{
    uint8_t used[PDCP_BIT_BYTES(PROFILE_PARTS_MAX)]; /* but for the entry that goes */
    const uint8_t old = profile_links_find(links, &link->input.owner, link->input.index);
    const uint8_t stand_in = old != PDCP_NONE ? links->entries[old].stand_in : (uint8_t)PDCP_NONE;
    memset(used, 0, sizeof used);
    const profile_entry_t *at = links->entries;
    for (uint8_t i = 0; i < links->count; i++, at++) {
        if (i != old) {
            pdcp_bit_set(used, at->output.part, true);
            pdcp_bit_set(used, at->input.part, true);
        }
    }
    /* If only the second end finds no part, the first one got that of its device in the old entry, or one
     * that nobody names: nothing has changed. */
    const uint8_t input = take_part(links, used, &link->input.owner);
    const uint8_t output = take_part(links, used, &link->output.owner);
    if (input == PDCP_NONE || output == PDCP_NONE) {
        return false;
    }
    if (old != PDCP_NONE) {
        profile_links_remove(links, old);
    }
    if (links->count == PROFILE_LINKS_MAX) {
        return false;
    }
    profile_entry_t *entry = insert(links, &link->input);
    put_end(links, &entry->input, input, &link->input);
    put_end(links, &entry->output, output, &link->output);
    entry->stand_in = stand_in;
    entry->by_host = by_host;
    return true;
}

void profile_links_remove(profile_links_t *links, uint8_t entry)
{
    profile_entry_t *gone = &links->entries[entry];
    links->count--;
    memmove(gone, gone + 1, (size_t)(links->count - entry) * sizeof *gone);
}

/* Does an end name the channel with this owner and index? */
static bool names(const profile_links_t *links, const profile_ref_t *end, const pdcp_identity_t *owner,
                  uint8_t index)
{
    return end->index == index && pdcp_identity_equal(owner_of(links, end), owner);
}

bool profile_links_is_claimed(const profile_links_t *links, const profile_link_t *link)
{
    const profile_entry_t *entry = links->entries;
    for (uint8_t i = 0; i < links->count; i++, entry++) {
        if ((link->input.type & entry->input.type & PROFILE_TYPE_SOLE) != 0 &&
            names(links, &entry->output, &link->output.owner, link->output.index) &&
            !names(links, &entry->input, &link->input.owner, link->input.index)) {
            return true;
        }
    }
    return false;
}

uint8_t profile_links_find(const profile_links_t *links, const pdcp_identity_t *owner, uint8_t index)
{
    const profile_entry_t *entry = links->entries;
    for (uint8_t i = 0; i < links->count; i++, entry++) {
        if (names(links, &entry->input, owner, index)) {
            return i;
        }
    }
    return PDCP_NONE;
}

uint8_t profile_links_of(const profile_links_t *links, const pdcp_tables_t *tables, uint8_t channel)
{
    const pdcp_channel_t *input = &tables->channels[channel];
    return profile_links_find(links, &tables->devices[input->place].identity, input->index);
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
    const profile_entry_t *from = &links->entries[entry];
    get_end(links, &from->output, &link->output);
    get_end(links, &from->input, &link->input);
}

bool profile_links_name(const profile_links_t *links, const pdcp_tables_t *tables, const profile_ref_t *end,
                        uint8_t channel)
{
    const pdcp_channel_t *named = &tables->channels[channel];
    return names(links, end, &tables->devices[named->place].identity, named->index);
}

uint8_t profile_links_place(const profile_links_t *links, const pdcp_tables_t *tables,
                            const profile_ref_t *end)
{
    return pdcp_tables_find(tables, owner_of(links, end));
}

uint8_t profile_links_channel(const profile_links_t *links, const pdcp_tables_t *tables,
                              const profile_ref_t *end, uint8_t transfer)
{
    const uint8_t place = profile_links_place(links, tables, end);
    if (place == PDCP_NONE) {
        return PDCP_NONE;
    }
    const uint8_t channel = pdcp_tables_channel(tables, place, end->index);
    return profile_channel_is_ready(tables, channel, transfer) ? channel : PDCP_NONE;
}
