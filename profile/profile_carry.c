#include "profile_carry.h"

#include <string.h>

#include "pdcp_assert.h"
#include "profile_active.h"
#include "profile_channel.h"

/* An input without a link and without an entry must not name a source (D-BUS-38). */
static void forget_source(const profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    profile_end_t source;
    if (profile_channel_named_source(run->scene.tables, input, &source)) {
        pdcp_arb_forget_source(arb, now_ms, input);
    }
}

/* Takes the link of an input away: it becomes inactive if the configuration has it, and goes otherwise. The
 * host sees a link of the configuration whose source is missing as inactive (D-BUS-10, D-PRO-15). */
static void unlink_one(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    const pdcp_channel_t *channel = &run->scene.tables->channels[input];
    const uint8_t entry = profile_active_entry_of(run, input);
    bool original = false;
    if (entry != PDCP_NONE) {
        const profile_ref_t *output = &run->links.entries[entry].output;
        const pdcp_identity_t *owner = &run->links.parts[output->part].identity;
        if (channel->link == PDCP_LINK_NONE) {
            pdcp_arb_remember(arb, now_ms, input, owner, output->index, output->type, output->profile);
            return;
        }
        original =
            output->index == channel->source.index && pdcp_identity_equal(owner, &channel->source.identity);
    }
    if (channel->link == PDCP_LINK_NONE) {
        forget_source(run, arb, now_ms, input);
        return;
    }
    if (channel->link == PDCP_LINK_ACTIVE) {
        run->moves++;
        if (original) {
            pdcp_arb_deactivate(arb, now_ms, input);
        }
    }
    if (!original) {
        pdcp_bit_set(run->dropping, input, true);
        (void)pdcp_arb_disconnect(arb, input);
    }
}

/* Takes away all links that the plan does not want. */
static void unlink_all(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (run->plan.want[i] == PDCP_NONE && profile_channel_is_ready(run->scene.tables, i, PDCP_INPUT)) {
            unlink_one(run, arb, now_ms, i);
        }
    }
}

/* Does a channel require an input of its device that is not connected? */
static bool misses_something(const pdcp_tables_t *tables, uint8_t channel)
{
    const pdcp_device_entry_t *owner = &tables->devices[tables->channels[channel].place];
    uint8_t c = owner->needs_stride != 0 ? owner->first_channel : (uint8_t)PDCP_NONE;
    while (c != PDCP_NONE && (profile_channel_source(tables, c) != PDCP_NONE ||
                              !pdcp_tables_needs(tables, channel, false, tables->channels[c].index))) {
        c = tables->channels[c].next;
    }
    return c != PDCP_NONE;
}

/* Has the host made this link? Then it needs nothing (D-PRO-9). */
static bool is_hosts(const profile_run_t *run, uint8_t input, uint8_t source)
{
    const uint8_t entry = profile_active_entry_of(run, input);
    if (entry == PDCP_NONE) {
        return false;
    }
    const profile_entry_t *own = &run->links.entries[entry];
    return own->by_host && profile_links_name(&run->links, run->scene.tables, &own->output, source);
}

/* Does this link work although something that it requires is not connected? Links that the plan under way has
 * made are left alone: otherwise those of a loop would never be made. */
static bool is_lacking(const profile_run_t *run, uint8_t input)
{
    const pdcp_tables_t *tables = run->scene.tables;
    const uint8_t source = profile_channel_source(tables, input);
    return source != PDCP_NONE && !pdcp_bit(run->scene.made, input) && !is_hosts(run, input, source) &&
           (misses_something(tables, source) || misses_something(tables, input));
}

/* Makes links inactive that lack something, once the plan has met a link that fails (D-PRO-9). Most often the
 * plan connects what they lack at once. But a device that does not answer may take long, and meanwhile a hand
 * would obey a controller that hears nothing. True: a link was made inactive. */
static bool deactivate_lacking(const profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    bool any = false;
    uint8_t i = 0;
    if (run->tries + run->scene.banned_count == 0 || run->what == PROFILE_PLAN_ENFORCE) {
        return false;
    }
    while (i < PDCP_CHANNELS_MAX) {
        if (is_lacking(run, i)) {
            pdcp_arb_deactivate(arb, now_ms, i);
            any = true;
            i = 0; /* others may require this one */
        } else {
            i++;
        }
    }
    return any;
}

/* The next input whose link must still be made, terminal ones last; PDCP_NONE: all are made. Ends that have
 * gone since the plan was made are left to the next plan. */
static uint8_t next_input(const profile_run_t *run)
{
    const pdcp_tables_t *tables = run->scene.tables;
    uint8_t found = PDCP_NONE;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t output = run->plan.want[i];
        const pdcp_channel_t *channel = &tables->channels[i];
        if (!profile_channel_is_ready(tables, output, PDCP_OUTPUT) ||
            !profile_channel_is_ready(tables, i, PDCP_INPUT) ||
            (channel->link == PDCP_LINK_ACTIVE && channel->source.channel == output)) {
            continue;
        }
        if (!profile_channel_is_terminal(channel)) {
            return i;
        }
        if (found == PDCP_NONE) {
            found = i;
        }
    }
    return found;
}

/* Asks for the link of an input. If it cannot be asked for, a device has changed its channels meanwhile. */
static profile_run_state_t begin_link(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    run->request.input = input;
    run->request.output = run->plan.want[input];
    if (pdcp_arb_connect(arb, run->request.output, input) == PDCP_OK) {
        return PROFILE_RUN_LINKING;
    }
    profile_run_stir(run, now_ms, PROFILE_AT_ONCE);
    return PROFILE_RUN_CARRYING_OUT;
}

profile_run_state_t profile_carry_on(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, bool *handed)
{
    pdcp_assert(run->state == PROFILE_RUN_PLANNED || run->state == PROFILE_RUN_CARRYING_OUT,
                "profile_carry.h: the plan is made");
    if (!pdcp_arb_links_settled(arb)) {
        return PROFILE_RUN_CARRYING_OUT;
    }
    unlink_all(run, arb, now_ms);
    if (!pdcp_arb_links_settled(arb) || deactivate_lacking(run, arb, now_ms)) {
        *handed = true;
        return PROFILE_RUN_CARRYING_OUT;
    }
    const uint8_t input = next_input(run);
    if (input == PDCP_NONE) { /* all links are made, or their ends have gone */
        (void)profile_active_take_up(run);
        return PROFILE_RUN_IDLE;
    }
    *handed = true;
    return begin_link(run, arb, now_ms, input);
}
