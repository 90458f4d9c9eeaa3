#include "profile_active.h"

#include "pdcp_assert.h"
#include "profile_channel.h"
#include "profile_match.h"

uint8_t profile_active_entry_of(const profile_run_t *run, uint8_t input)
{
    return profile_links_of(&run->links, run->scene.tables, input);
}

uint8_t profile_active_stood_in_for(const profile_run_t *run, uint8_t input)
{
    for (uint8_t e = 0; e < run->links.count; e++) {
        if (run->links.entries[e].stand_in == input) {
            return e;
        }
    }
    return PDCP_NONE;
}

static bool store_link(profile_run_t *run, const profile_link_t *link, bool by_host)
{
    pdcp_assert(!run->frozen, "profile_run.h: the configuration may change");
    profile_run_note_change(run);
    return profile_links_put(&run->links, link, by_host);
}

void profile_active_remove(profile_run_t *run, uint8_t entry)
{
    pdcp_assert(!run->frozen, "profile_run.h: the configuration may change");
    profile_run_note_change(run);
    profile_links_remove(&run->links, entry);
}

/* A link that is made or named becomes part of the configuration (D-PRO-11), but for one that is only named
 * and whose output is taken (D-PRO-19). */
bool profile_active_adopt(profile_run_t *run, uint8_t input, bool by_host)
{
    const pdcp_tables_t *tables = run->scene.tables;
    profile_link_t link;
    profile_channel_end(tables, input, &link.input);
    if (run->frozen || !profile_channel_named_source(tables, input, &link.output) ||
        (!by_host && profile_links_is_claimed(&run->links, &link))) {
        return true;
    }
    if (!store_link(run, &link, by_host)) {
        return false;
    }
    run->changed = true;
    return true;
}

/* A link that stands in for another is left out (D-PRO-11). */
bool profile_active_take_up(profile_run_t *run)
{
    bool complete = true;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (profile_channel_source(run->scene.tables, i) != PDCP_NONE &&
            profile_active_entry_of(run, i) == PDCP_NONE &&
            profile_active_stood_in_for(run, i) == PDCP_NONE && !profile_active_adopt(run, i, false)) {
            complete = false;
        }
    }
    return complete;
}

/* The input of a device (PDCP_NONE: of any) that names a source and comes next behind the last one;
 * PDCP_NONE: there are no more. */
static uint8_t next_input_of(const pdcp_tables_t *tables, uint8_t place, uint8_t last)
{
    uint8_t best = PDCP_NONE;
    profile_end_t source;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if ((place == PDCP_NONE || tables->channels[i].place == place) &&
            profile_channel_is_ready(tables, i, PDCP_INPUT) &&
            profile_channel_named_source(tables, i, &source) &&
            (last == PDCP_NONE || profile_match_is_before(tables, last, i)) &&
            (best == PDCP_NONE || profile_match_is_before(tables, i, best))) {
            best = i;
        }
    }
    return best;
}

/* Sources that inputs name become part of the configuration (D-PRO-19). */
void profile_active_read_back(profile_run_t *run, uint8_t place)
{
    uint8_t input = PDCP_NONE;
    while ((input = next_input_of(run->scene.tables, place, input)) != PDCP_NONE) {
        if (profile_active_entry_of(run, input) == PDCP_NONE) {
            (void)profile_active_adopt(run, input, false);
        }
    }
}

void profile_active_load_begin(profile_run_t *run, bool keep_host)
{
    for (uint8_t e = run->links.count; e > 0; e--) {
        if (!keep_host || !run->links.entries[e - 1].by_host) {
            profile_active_remove(run, (uint8_t)(e - 1));
        }
    }
}

bool profile_active_load_link(profile_run_t *run, const profile_link_t *link)
{
    return profile_links_find(&run->links, &link->input.owner, link->input.index) != PDCP_NONE ||
           store_link(run, link, false);
}

/* The entry that an input's link, if it works, replaces: the one that it stands in for, or its own if its
 * source is another. PDCP_NONE: there is none. */
static uint8_t replaced_by(const profile_run_t *run, uint8_t input)
{
    const pdcp_tables_t *tables = run->scene.tables;
    const uint8_t source = profile_channel_source(tables, input);
    if (source == PDCP_NONE) {
        return PDCP_NONE;
    }
    uint8_t entry = profile_active_stood_in_for(run, input);
    if (entry == PDCP_NONE) {
        entry = profile_active_entry_of(run, input);
        if (entry != PDCP_NONE &&
            profile_links_channel(&run->links, tables, &run->links.entries[entry].output, PDCP_OUTPUT) ==
                source) {
            return PDCP_NONE;
        }
    }
    return entry;
}

uint8_t profile_active_adopt_stand_ins(profile_run_t *run)
{
    uint8_t adopted = 0;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t entry = replaced_by(run, i);
        if (entry != PDCP_NONE) {
            profile_active_remove(run, entry);
            (void)profile_active_adopt(run, i, false);
            adopted++;
        }
    }
    return adopted;
}
