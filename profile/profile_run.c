#include "profile_run.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_time.h"
#include "profile_match.h"

/* Before the start-up. What a plan is made from is set when one is begun. */
static void wait_for_start(profile_run_t *run, uint32_t now_ms)
{
    if (!run->frozen) {
        profile_links_init(&run->links);
    }
    memset(run->dropping, 0, sizeof run->dropping);
    memset(run->scene.awaited, 0, sizeof run->scene.awaited);
    run->state = PROFILE_WAITING;
    run->due = 0;
    run->making = PROFILE_NOT_MAKING;
    run->wishing = false;
    run->stirred_ms = now_ms;
}

void profile_run_init(profile_run_t *run, const pdcp_nodes_t *nodes, uint32_t now_ms)
{
    run->scene.nodes = nodes;
    run->scene.links = &run->links;
    run->stirred_ms = now_ms;
}

bool profile_run_is_busy(const profile_run_t *run)
{
    return run->state == PROFILE_CONFIGURING || run->due != 0;
}

/* --- The active configuration follows what happens --- */

static bool store_link(profile_run_t *run, const profile_link_t *link, bool by_host)
{
    run->stale = true;
    return profile_links_put(&run->links, link, by_host);
}

static void remove_entry(profile_run_t *run, uint8_t entry)
{
    run->stale = true;
    profile_links_remove(&run->links, entry);
}

/* Makes the link that an input has, or whose source it names, one of the configuration. By itself it does not
 * become one that breaks sole access: a device may remember what it stood in for once. False: there was no
 * room. */
static bool adopt_link(profile_run_t *run, uint8_t input, bool by_host)
{
    const pdcp_nodes_t *nodes = run->scene.nodes;
    profile_link_t link;
    profile_end_of(nodes, input, &link.input);
    if (run->frozen || !profile_source_of(nodes, input, &link.output) ||
        (!by_host && profile_links_is_claimed(&run->links, &link))) {
        return true;
    }
    if (!store_link(run, &link, by_host)) {
        return false;
    }
    run->changed = true;
    return true;
}

/* Entry whose missing input this one stands in for; PDCP_NONE: it does not. */
static uint8_t stood_in_for(const profile_run_t *run, uint8_t input)
{
    for (uint8_t e = 0; e < run->links.count; e++) {
        if (run->links.entries[e].stand_in == input) {
            return e;
        }
    }
    return PDCP_NONE;
}

static uint8_t entry_of(const profile_run_t *run, uint8_t input)
{
    return profile_links_of(&run->links, run->scene.nodes, input);
}

bool profile_run_take_up(profile_run_t *run)
{
    bool complete = true;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (profile_feed(run->scene.nodes, i) != PDCP_NONE && entry_of(run, i) == PDCP_NONE &&
            stood_in_for(run, i) == PDCP_NONE && !adopt_link(run, i, false)) {
            complete = false;
        }
    }
    return complete;
}

/* The input of a device (PDCP_NONE: of any) that names a source and comes next behind the last one;
 * PDCP_NONE: there are no more. */
static uint8_t next_input_of(const pdcp_nodes_t *nodes, uint8_t node, uint8_t last)
{
    uint8_t best = PDCP_NONE;
    profile_end_t source;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if ((node == PDCP_NONE || nodes->channels[i].node == node) &&
            profile_is_ready(nodes, i, PDCP_INPUT) && profile_source_of(nodes, i, &source) &&
            (last == PDCP_NONE || profile_is_before(nodes, last, i)) &&
            (best == PDCP_NONE || profile_is_before(nodes, i, best))) {
            best = i;
        }
    }
    return best;
}

/* Reads the configuration back from what the inputs of a device name as their sources (D-PRO-19); PDCP_NONE:
 * of all. In an order that does not depend on where they stand: of two that claim the same output the first
 * one has it.
 */
static void read_back(profile_run_t *run, uint8_t node)
{
    uint8_t input = PDCP_NONE;
    while ((input = next_input_of(run->scene.nodes, node, input)) != PDCP_NONE) {
        if (entry_of(run, input) == PDCP_NONE) {
            (void)adopt_link(run, input, false);
        }
    }
}

void profile_run_load_begin(profile_run_t *run, bool keep_host)
{
    for (uint8_t e = run->links.count; e > 0; e--) {
        if (!keep_host || !run->links.entries[e - 1].by_host) {
            remove_entry(run, (uint8_t)(e - 1));
        }
    }
}

bool profile_run_load_link(profile_run_t *run, const profile_link_t *link)
{
    return profile_links_find(&run->links, &link->input.owner, link->input.index) != PDCP_NONE ||
           store_link(run, link, false);
}

/* The entry that an input's link, if it works, replaces: the one that it stands in for, or its own if its
 * source is another. PDCP_NONE: there is none. */
static uint8_t replaced_by(const profile_run_t *run, uint8_t input)
{
    const pdcp_nodes_t *nodes = run->scene.nodes;
    const uint8_t feed = profile_feed(nodes, input);
    if (feed == PDCP_NONE) {
        return PDCP_NONE;
    }
    uint8_t entry = stood_in_for(run, input);
    if (entry == PDCP_NONE) {
        entry = entry_of(run, input);
        if (entry != PDCP_NONE && profile_links_channel(&run->links, nodes, &run->links.entries[entry].output,
                                                        PDCP_OUTPUT) == feed) {
            return PDCP_NONE;
        }
    }
    return entry;
}

uint8_t profile_run_adopt(profile_run_t *run)
{
    uint8_t adopted = 0;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t entry = replaced_by(run, i);
        if (entry != PDCP_NONE) {
            remove_entry(run, entry);
            (void)adopt_link(run, i, false);
            adopted++;
        }
    }
    return adopted;
}

/* --- Events --- */

/* The next plan is due, for what is due already and this. Before the start-up there are none. */
static void make_due(profile_run_t *run, uint8_t what)
{
    if (run->state != PROFILE_WAITING) {
        run->due |= what;
        run->urgent = true;
    }
}

/* Devices have come or gone, or links may be tried again. */
static void plan_all(profile_run_t *run, uint32_t now_ms)
{
    run->stirred_ms = now_ms;
    run->scene.banned_count = 0;
    make_due(run, run->at_events);
}

static void on_ready(profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms, uint8_t node)
{
    const bool urgent = run->urgent;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) { /* it was away: nothing is being taken away any more */
        if (run->scene.nodes->channels[i].node == node) {
            pdcp_set_bit(run->dropping, i, false);
        }
    }
    pdcp_set_bit(run->scene.awaited, node, false);
    if (run->state != PROFILE_WAITING && !arb->bus.link.stored) {
        read_back(run, node);
    }
    if (run->due == 0) {
        run->arrival_ms = now_ms + PROFILE_ARRIVAL_MS;
    }
    plan_all(run, now_ms);
    run->urgent = urgent;
}

/* Leaves a pair out of plans for a while (D-PRO-14). The oldest of too many is tried again. */
static void ban(profile_run_t *run, uint32_t now_ms, profile_pair_t pair)
{
    memmove(&run->scene.banned[1], &run->scene.banned[0],
            sizeof run->scene.banned - sizeof run->scene.banned[0]);
    run->scene.banned[0] = pair;
    if (run->scene.banned_count < PROFILE_BANNED_MAX) {
        run->scene.banned_count++;
    }
    run->tries = 0;
    run->retry_ms = now_ms + PROFILE_RETRY_MS;
}

/* A link that worked does not any more, and nobody in this layer wanted that: an end is missing, which may
 * have been lost before it beaconed, its device names another source, or does not answer. To make it again
 * counts as its second try in the last case. */
static void on_broken(profile_run_t *run, uint8_t input)
{
    const pdcp_nodes_t *nodes = run->scene.nodes;
    run->plan.want[input] = PDCP_NONE;
    if (profile_is_ready(nodes, input, PDCP_INPUT) &&
        profile_is_ready(nodes, nodes->channels[input].feed, PDCP_OUTPUT)) {
        run->tries = 1;
    }
    make_due(run, run->at_events);
}

/* A link that this layer has asked for is made, or is not. On a bad line, or when a device was away for a
 * moment, an answer is missing now and then, which must not lead to another limb: it is tried again. */
static void on_wish(profile_run_t *run, uint32_t now_ms, pdcp_status_t status)
{
    run->wishing = false;
    if (status == PDCP_OK) {
        run->tries = 0;
        pdcp_set_bit(run->scene.made, run->wish.input, true);
        run->moves++;
        return;
    }
    if (run->what == PROFILE_PLAN_ENFORCE) { /* it was lost meanwhile; the action ends without it */
        on_broken(run, run->wish.input);
        return;
    }
    run->tries++;
    if (status != PDCP_ERR_NO_ANSWER || run->tries == PROFILE_TRIES_MAX) {
        ban(run, now_ms, run->wish);
    }
    make_due(run, run->what);
}

/* Is the working link of an input another one than the plan knows or wants? */
static bool is_unexpected(const profile_run_t *run, uint8_t input)
{
    return run->making == PROFILE_MAKING ? profile_plan_links_differ(&run->plan, &run->scene)
                                         : run->scene.nodes->channels[input].feed != run->plan.want[input];
}

/* An input's device has asked for its link (Update Data Channel). It may lack what it requires, or break sole
 * access: then it does not count as working, and the plan decides. */
static void on_asked(profile_run_t *run, uint8_t input, uint8_t entry)
{
    const pdcp_nodes_t *nodes = run->scene.nodes;
    const pdcp_channel_t *channel = &nodes->channels[input];
    if (entry == PDCP_NONE && stood_in_for(run, input) == PDCP_NONE) {
        (void)adopt_link(run, input, false);
    }
    if (channel->link == PDCP_LINK_ACTIVE && is_unexpected(run, input)) {
        pdcp_set_bit(run->scene.made, input, profile_breaks_sole_access(nodes, channel->feed, input));
        make_due(run, run->at_events);
    }
}

/* The host has taken a link away: it is none of the configuration any more, no plan makes it again, and what
 * requires its input rests (D-PRO-25). */
static void on_removed(profile_run_t *run, uint8_t input, uint8_t entry)
{
    run->plan.want[input] = PDCP_NONE;
    if (entry != PDCP_NONE && !run->frozen) {
        remove_entry(run, entry);
        run->changed = true;
    }
    make_due(run, PROFILE_PLAN_SETTLE);
}

/* The audit has let the link of an input go. The pair is left out as one that could not be linked (D-PRO-14),
 * and what requires the input rests (D-BUS-40). Nothing is put in its place: somebody who disturbs a link
 * shall not get another limb by it (D-PRO-26). */
static void on_let_go(profile_run_t *run, uint32_t now_ms, uint8_t input)
{
    const profile_pair_t pair = {.output = run->scene.nodes->channels[input].feed, .input = input};
    run->plan.want[input] = PDCP_NONE;
    ban(run, now_ms, pair);
    make_due(run, PROFILE_PLAN_SETTLE);
}

/* Did the last plan, which is done, want a link that does not work any more? While it is about to be made
 * again, it is not broken. */
static bool is_broken(const profile_run_t *run, uint8_t input)
{
    const pdcp_channel_t *channel = &run->scene.nodes->channels[input];
    return run->state == PROFILE_RUNNING && run->plan.want[input] != PDCP_NONE &&
           channel->link != PDCP_LINK_ACTIVE && (channel->todo & PDCP_TODO_CONNECT) == 0;
}

/* The link of an input has changed, by whomever. That of a link which this layer has asked for comes with
 * PDCP_EVENT_WISH. */
static void on_link(profile_run_t *run, const pdcp_arb_t *arb, uint8_t input)
{
    const uint8_t link = run->scene.nodes->channels[input].link;
    const uint8_t entry = entry_of(run, input);
    const bool dropping = pdcp_bit(run->dropping, input);
    if (link == PDCP_LINK_NONE) {
        pdcp_set_bit(run->dropping, input, false);
    }
    if (dropping) {
        return;
    }
    if (link == PDCP_LINK_NONE && arb->bus.link.kind == PDCP_TODO_REMOVE) {
        on_removed(run, input, entry);
    } else if (is_broken(run, input)) {
        on_broken(run, input);
    } else if (link != PDCP_LINK_NONE && run->state != PROFILE_WAITING && !arb->bus.link.stored &&
               !run->wishing) {
        on_asked(run, input, entry);
    }
}

void profile_run_on_event(profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms,
                          const pdcp_event_t *event)
{
    switch (event->kind) {
    case PDCP_EVENT_READY:
        on_ready(run, arb, now_ms, event->node);
        break;
    case PDCP_EVENT_SETUP_FAILED:
    case PDCP_EVENT_LOST:
        plan_all(run, now_ms);
        break;
    case PDCP_EVENT_RESET:
        if (event->status == PDCP_OK) {
            pdcp_set_bit(run->scene.awaited, event->node, true);
            run->awaited_ms = now_ms + PROFILE_RESET_MS;
        }
        break;
    case PDCP_EVENT_WISH:
        if (run->wishing) {
            on_wish(run, now_ms, (pdcp_status_t)event->status);
        } else if (event->status == PDCP_OK) { /* the host's: what rested for want of it comes back */
            (void)adopt_link(run, event->channel, true);
            make_due(run, PROFILE_PLAN_ORIGINALS);
        }
        break;
    case PDCP_EVENT_LINK:
        if (event->status == PDCP_ERR_DIFFERS) {
            on_let_go(run, now_ms, event->channel);
        } else if (event->channel != PDCP_NONE) {
            on_link(run, arb, event->channel);
        }
        break;
    case PDCP_EVENT_SILENT:
    case PDCP_EVENT_STARTED:
        wait_for_start(run, now_ms);
        break;
    default:
        break;
    }
}

/* --- Plans --- */

/* What the plan under way was about to take away does not count as working for the next one, which would not
 * know any more that it only stood in. */
static void leave_unwanted(profile_run_t *run)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t feed = profile_feed(run->scene.nodes, i);
        if (feed != PDCP_NONE && feed != run->plan.want[i]) {
            pdcp_set_bit(run->scene.made, i, true);
        }
    }
}

static void begin_plan(profile_run_t *run)
{
    if (run->state == PROFILE_CONFIGURING && run->making != PROFILE_MAKING) {
        leave_unwanted(run);
    }
    run->state = PROFILE_CONFIGURING;
    run->due = 0;
    run->urgent = false;
    run->making = PROFILE_MAKING;
    run->stale = true;
}

/* Makes a slice of the plan, of a new one if what it is made from has changed. Nothing of it counts before it
 * is done. */
static void make_slice(profile_run_t *run)
{
    if (run->stale || profile_plan_is_stale(&run->plan, &run->scene)) {
        run->stale = false;
        profile_plan_begin(&run->plan, &run->scene, run->what);
    }
    if (profile_plan_step(&run->plan, &run->scene, PROFILE_PLAN_SLICE)) {
        run->making = PROFILE_JUST_MADE;
    }
}

/* Only links that the host has made count as working: all others are planned anew. */
static void forget_working(profile_run_t *run)
{
    memset(run->scene.made, 0xFF, sizeof run->scene.made);
    for (uint8_t e = 0; e < run->links.count; e++) {
        const profile_entry_t *entry = &run->links.entries[e];
        const uint8_t input = profile_links_channel(&run->links, run->scene.nodes, &entry->input, PDCP_INPUT);
        if (entry->by_host && input != PDCP_NONE) {
            pdcp_set_bit(run->scene.made, input, false);
        }
    }
}

void profile_run_begin(profile_run_t *run, uint8_t what, bool anew)
{
    memset(run->scene.made, 0, sizeof run->scene.made);
    if (anew) {
        forget_working(run);
        run->changed = true;
    }
    run->scene.banned_count = 0;
    run->tries = 0;
    run->moves = 0;
    run->what = what;
    begin_plan(run);
}

void profile_run_start(profile_run_t *run, pdcp_arb_t *arb, bool stored)
{
    pdcp_arb_plan_links(arb, stored);
    if (!stored) {
        read_back(run, PDCP_NONE);
    }
    profile_run_begin(run, run->at_start, true);
}

bool profile_run_is_starting(const profile_run_t *run)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX && run->state == PROFILE_WAITING; i++) {
        if (run->scene.nodes->nodes[i].state == PDCP_NODE_READY) {
            return true;
        }
    }
    return false;
}

/* When there will have been quiet for PROFILE_QUIET_MS, or was. The time by which a grant was held is taken
 * off (D-BUS-34).
 */
static uint32_t quiet_ms(const profile_run_t *run, const pdcp_arb_t *arb)
{
    const bool asked = pdcp_time_before(run->stirred_ms, arb->asked_ms);
    return (asked ? arb->asked_ms : run->stirred_ms) + PROFILE_QUIET_MS - arb->held_ms;
}

bool profile_run_is_quiet(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    return profile_run_is_starting(run) && !pdcp_arb_setup_running(arb) && pdcp_arb_links_settled(arb) &&
           pdcp_time_reached(now_ms, quiet_ms(run, arb));
}

/* --- Carrying a plan out --- */

/* What an input without a link names as its source is not part of the configuration: it shall name none
 * (D-BUS-38). */
static void forget_source(const profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    profile_end_t source;
    if (profile_source_of(run->scene.nodes, input, &source)) {
        pdcp_arb_forget_source(arb, now_ms, input);
    }
}

/* The link of an input is not to be: what the configuration has rests, what it has not goes. The host sees a
 * link of the configuration whose source is missing as inactive (D-BUS-10, D-PRO-15). */
static void unlink_one(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    const pdcp_channel_t *channel = &run->scene.nodes->channels[input];
    const uint8_t entry = entry_of(run, input);
    bool original = false;
    if (entry != PDCP_NONE) {
        const profile_ref_t *output = &run->links.entries[entry].output;
        const pdcp_identity_t *owner = &run->links.parts[output->part].identity;
        if (channel->link == PDCP_LINK_NONE) {
            pdcp_arb_remember(arb, now_ms, input, owner, output->index, output->type, output->profile);
            return;
        }
        original = output->index == channel->source_index && pdcp_identity_equal(owner, &channel->source);
    }
    if (channel->link == PDCP_LINK_NONE) {
        forget_source(run, arb, now_ms, input);
        return;
    }
    if (channel->link == PDCP_LINK_ACTIVE) {
        run->moves++;
        if (original) {
            pdcp_arb_rest(arb, now_ms, input);
        }
    }
    if (!original) {
        pdcp_set_bit(run->dropping, input, true);
        (void)pdcp_arb_disconnect(arb, input);
    }
}

/* Takes away what is not wanted. */
static void unlink_all(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (run->plan.want[i] == PDCP_NONE && profile_is_ready(run->scene.nodes, i, PDCP_INPUT)) {
            unlink_one(run, arb, now_ms, i);
        }
    }
}

/* Does a channel require an input of its device that is not connected? */
static bool misses_something(const pdcp_nodes_t *nodes, uint8_t channel)
{
    const pdcp_node_t *owner = &nodes->nodes[nodes->channels[channel].node];
    uint8_t c = owner->needs_stride != 0 ? owner->first_channel : (uint8_t)PDCP_NONE;
    while (c != PDCP_NONE && (profile_feed(nodes, c) != PDCP_NONE ||
                              !pdcp_nodes_needs(nodes, channel, false, nodes->channels[c].index))) {
        c = nodes->channels[c].next;
    }
    return c != PDCP_NONE;
}

/* Is this a link of the host's, which needs nothing (D-PRO-9)? */
static bool is_hosts(const profile_run_t *run, uint8_t input, uint8_t feed)
{
    const uint8_t entry = entry_of(run, input);
    if (entry == PDCP_NONE) {
        return false;
    }
    const profile_entry_t *own = &run->links.entries[entry];
    return own->by_host && profile_links_name(&run->links, run->scene.nodes, &own->output, feed);
}

/* Does a link work that should not, because something that it requires is not connected? Links that the plan
 * under way has made are left alone: those of a loop would never be made. */
static bool is_lacking(const profile_run_t *run, uint8_t input)
{
    const pdcp_nodes_t *nodes = run->scene.nodes;
    const uint8_t feed = profile_feed(nodes, input);
    return feed != PDCP_NONE && !pdcp_bit(run->scene.made, input) && !is_hosts(run, input, feed) &&
           (misses_something(nodes, feed) || misses_something(nodes, input));
}

/* A plan may mean to connect what a working link requires, and most often that is done at once. When it does
 * not go well, the link rests meanwhile (D-PRO-9): a device that does not answer may take long, and a hand
 * would obey a controller that hears nothing. True: a link rests now. */
static bool rest_lacking(const profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    bool rested = false;
    uint8_t i = 0;
    if (run->tries + run->scene.banned_count == 0 || run->what == PROFILE_PLAN_ENFORCE) {
        return false;
    }
    while (i < PDCP_CHANNELS_MAX) {
        if (is_lacking(run, i)) {
            pdcp_arb_rest(arb, now_ms, i);
            rested = true;
            i = 0; /* others may require this one */
        } else {
            i++;
        }
    }
    return rested;
}

/* The next input whose link is still to be made, terminal ones last; PDCP_NONE: all are made. Ends that have
 * gone since the plan was made are the next plan's business. */
static uint8_t next_input(const profile_run_t *run)
{
    const pdcp_nodes_t *nodes = run->scene.nodes;
    uint8_t found = PDCP_NONE;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t output = run->plan.want[i];
        const pdcp_channel_t *channel = &nodes->channels[i];
        if (!profile_is_ready(nodes, output, PDCP_OUTPUT) || !profile_is_ready(nodes, i, PDCP_INPUT) ||
            (channel->link == PDCP_LINK_ACTIVE && channel->feed == output)) {
            continue;
        }
        if (!profile_is_terminal(channel)) {
            return i;
        }
        if (found == PDCP_NONE) {
            found = i;
        }
    }
    return found;
}

static void finish(profile_run_t *run)
{
    run->state = PROFILE_RUNNING;
    run->what = 0;
    memset(run->scene.made, 0, sizeof run->scene.made);
    (void)profile_run_take_up(run);
}

/* Does the next thing that the plan says, when what came before is done. True: the arbitrator has something
 * to do. */
static bool carry_on(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    if (!pdcp_arb_links_settled(arb)) {
        return false;
    }
    unlink_all(run, arb, now_ms);
    if (!pdcp_arb_links_settled(arb)) {
        return true;
    }
    if (rest_lacking(run, arb, now_ms)) {
        return true;
    }
    const uint8_t input = next_input(run);
    if (input == PDCP_NONE) {
        finish(run);
        return false;
    }
    run->wish.input = input;
    run->wish.output = run->plan.want[input];
    run->wishing = pdcp_arb_connect(arb, run->wish.output, input) == PDCP_OK;
    if (!run->wishing) { /* a device has changed its channels meanwhile */
        plan_all(run, now_ms);
    }
    return true;
}

static bool has_awaited(const profile_run_t *run)
{
    uint8_t all = 0;
    for (uint8_t i = 0; i < (uint8_t)PROFILE_PLACE_BYTES; i++) {
        all |= run->scene.awaited[i];
    }
    return all != 0;
}

/* When a plan is due though nothing happens: a device is awaited no longer, or links are tried again. */
static uint32_t alarm_ms(const profile_run_t *run, uint32_t now_ms)
{
    uint32_t next_ms = now_ms + PDCP_TIME_FAR_MS;
    if (has_awaited(run)) {
        next_ms = run->awaited_ms;
    }
    if (run->scene.banned_count != 0 && run->state != PROFILE_CONFIGURING) {
        next_ms = pdcp_time_earlier(next_ms, run->retry_ms);
    }
    return next_ms;
}

/* A plan for a new device waits for others that come with it (D-PRO-12). */
static bool awaits_arrivals(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    return !run->urgent && pdcp_arb_setup_running(arb) && pdcp_time_before(now_ms, run->arrival_ms);
}

/* What the host has asked for is finished first: an action, or a link. A plan made while a link is half made
 * would take it away again when it is whole; it could not be carried out earlier anyway (D-PRO-27). */
static bool is_held_back(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    return run->what == PROFILE_PLAN_ENFORCE || pdcp_arb_link_running(arb) ||
           awaits_arrivals(run, arb, now_ms);
}

bool profile_run_step(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    if (run->state == PROFILE_WAITING) {
        return false;
    }
    if (pdcp_time_reached(now_ms, alarm_ms(run, now_ms))) {
        if (pdcp_time_reached(now_ms, run->awaited_ms)) {
            memset(run->scene.awaited, 0, sizeof run->scene.awaited);
        }
        plan_all(run, now_ms);
    }
    if (run->wishing) {
        return false;
    }
    if (run->due != 0 && !is_held_back(run, arb, now_ms)) {
        run->what |= run->due;
        begin_plan(run);
    }
    if (run->making == PROFILE_MAKING) {
        make_slice(run);
        return false;
    }
    run->making = PROFILE_NOT_MAKING;
    return run->state == PROFILE_CONFIGURING && carry_on(run, arb, now_ms);
}

uint32_t profile_run_next_ms(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    if (run->state == PROFILE_WAITING) {
        const uint32_t start_ms = quiet_ms(run, arb);
        return pdcp_time_before(now_ms, start_ms) ? start_ms : now_ms + PDCP_TIME_FAR_MS;
    }
    if (run->making != PROFILE_NOT_MAKING && !run->wishing) {
        return now_ms;
    }
    const uint32_t next_ms = alarm_ms(run, now_ms);
    if (run->due == 0 || run->state == PROFILE_CONFIGURING || pdcp_arb_link_running(arb)) {
        return next_ms;
    }
    return awaits_arrivals(run, arb, now_ms) ? pdcp_time_earlier(next_ms, run->arrival_ms) : now_ms;
}
