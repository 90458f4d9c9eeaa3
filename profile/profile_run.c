#include "profile_run.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_time.h"
#include "profile_match.h"

static const pdcp_nodes_t *nodes_of(const pdcp_arb_t *arb)
{
    return &arb->bus.nodes;
}

static const pdcp_channel_t *channel_of(const pdcp_arb_t *arb, uint8_t channel)
{
    return &arb->bus.nodes.channels[channel];
}

static void wait_for_start(profile_run_t *run, uint32_t now_ms)
{
    if (!run->frozen) {
        profile_links_init(&run->links);
    }
    memset(run->made, 0, sizeof run->made);
    memset(run->dropping, 0, sizeof run->dropping);
    memset(run->awaited, 0, sizeof run->awaited);
    run->banned_count = 0;
    run->state = PROFILE_WAITING;
    run->due = 0;
    run->planning = false;
    run->making = PROFILE_NOT_MAKING;
    run->wishing = false;
    run->stored = false;
    run->stirred_ms = now_ms;
}

void profile_run_init(profile_run_t *run, uint32_t now_ms)
{
    memset(run, 0, sizeof *run);
    wait_for_start(run, now_ms);
}

bool profile_run_is_busy(const profile_run_t *run)
{
    return run->planning || run->due != 0;
}

bool profile_run_take_change(profile_run_t *run)
{
    const bool changed = run->changed;
    run->changed = false;
    return changed;
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

static void put_link(profile_run_t *run, const profile_link_t *link, bool by_host)
{
    if (!run->frozen && store_link(run, link, by_host)) {
        run->changed = true;
    }
}

/* The link that an input has, or whose source it names. False: it may not become one of the configuration,
 * because it would break sole access: a device may remember what it stood in for once. */
static bool link_of(const profile_run_t *run, const pdcp_arb_t *arb, uint8_t input, profile_link_t *link)
{
    profile_end_of(nodes_of(arb), input, &link->input);
    return profile_source_of(nodes_of(arb), input, &link->output) &&
           !profile_links_is_claimed(&run->links, link);
}

static void adopt_link(profile_run_t *run, const pdcp_arb_t *arb, uint8_t input)
{
    profile_link_t link;
    if (link_of(run, arb, input, &link)) {
        put_link(run, &link, false);
    }
}

static void put_host_link(profile_run_t *run, const pdcp_arb_t *arb, uint8_t input)
{
    profile_link_t link;
    profile_end_of(nodes_of(arb), input, &link.input);
    if (profile_source_of(nodes_of(arb), input, &link.output)) {
        put_link(run, &link, true);
    }
}

static bool is_stand_in(const profile_run_t *run, uint8_t input)
{
    for (uint8_t e = 0; e < run->links.count; e++) {
        if (run->links.entries[e].stand_in == input) {
            return true;
        }
    }
    return false;
}

static uint8_t entry_of(const profile_run_t *run, const pdcp_arb_t *arb, uint8_t input)
{
    return profile_links_of(&run->links, nodes_of(arb), input);
}

/* Does a link work that is in no entry and should be? */
static bool is_new(const profile_run_t *run, const pdcp_arb_t *arb, uint8_t input)
{
    profile_link_t link;
    return channel_of(arb, input)->link == PDCP_LINK_ACTIVE &&
           profile_is_ready(nodes_of(arb), input, PDCP_INPUT) && entry_of(run, arb, input) == PDCP_NONE &&
           !is_stand_in(run, input) && link_of(run, arb, input, &link);
}

/* Such links become part of the configuration. */
static void take_up(profile_run_t *run, const pdcp_arb_t *arb)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (is_new(run, arb, i)) {
            adopt_link(run, arb, i);
        }
    }
}

bool profile_run_is_complete(const profile_run_t *run, const pdcp_arb_t *arb)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (is_new(run, arb, i)) {
            return false;
        }
    }
    return true;
}

/* The input of a device (PDCP_NONE: of any) that names a source and comes next behind the last one;
 * PDCP_NONE: there are no more. */
static uint8_t next_read_back(const pdcp_nodes_t *nodes, uint8_t node, uint8_t last)
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

/* Reads the configuration back from what the inputs of a device name as their sources; PDCP_NONE: of all. In
 * an order that does not depend on where they stand: of two that claim the same output the first one has it.
 */
static void read_back(profile_run_t *run, const pdcp_arb_t *arb, uint8_t node)
{
    uint8_t input = PDCP_NONE;
    while ((input = next_read_back(nodes_of(arb), node, input)) != PDCP_NONE) {
        if (entry_of(run, arb, input) == PDCP_NONE) {
            adopt_link(run, arb, input);
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
    if (profile_links_find(&run->links, &link->input.owner, link->input.index) != PDCP_NONE) {
        return true;
    }
    return store_link(run, link, false);
}

/* The entry that the working link of an input replaces: the one that it stands in for, or its own if its
 * source is another. PDCP_NONE: there is none. */
static uint8_t replaced_by(const profile_run_t *run, const pdcp_arb_t *arb, uint8_t input)
{
    for (uint8_t e = 0; e < run->links.count; e++) {
        if (run->links.entries[e].stand_in == input) {
            return e;
        }
    }
    const uint8_t own = entry_of(run, arb, input);
    const bool other =
        own != PDCP_NONE && profile_links_channel(&run->links, nodes_of(arb), &run->links.entries[own].output,
                                                  PDCP_OUTPUT) != channel_of(arb, input)->feed;
    return other ? own : PDCP_NONE;
}

uint8_t profile_run_adopt(profile_run_t *run, const pdcp_arb_t *arb)
{
    uint8_t adopted = 0;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const bool works =
            profile_is_ready(nodes_of(arb), i, PDCP_INPUT) && channel_of(arb, i)->link == PDCP_LINK_ACTIVE;
        const uint8_t entry = works ? replaced_by(run, arb, i) : PDCP_NONE;
        if (entry != PDCP_NONE) {
            remove_entry(run, entry);
            adopt_link(run, arb, i);
            adopted++;
        }
    }
    return adopted;
}

void profile_run_freeze(profile_run_t *run, const pdcp_arb_t *arb, bool frozen)
{
    run->frozen = frozen;
    if (!frozen) {
        take_up(run, arb);
    }
}

/* --- Events --- */

static profile_scene_t scene_of(profile_run_t *run, const pdcp_arb_t *arb)
{
    const profile_scene_t scene = {.nodes = nodes_of(arb),
                                   .links = &run->links,
                                   .made = run->made,
                                   .awaited = run->awaited,
                                   .banned = run->banned,
                                   .banned_count = run->banned_count};
    return scene;
}

/* All that is to be planned, as far as the flags allow it. */
static uint8_t what_of(const profile_run_t *run, bool replace)
{
    uint8_t what = PROFILE_PLAN_ORIGINALS;
    if (replace) {
        what |= PROFILE_PLAN_REPLACE;
        if (run->autoconfigure) {
            what |= PROFILE_PLAN_AUTO;
        }
    }
    return what;
}

/* The next plan is due, for what is due already and this. */
static void make_due(profile_run_t *run, uint8_t what)
{
    run->due |= what;
    run->urgent = true;
}

static void plan_soon(profile_run_t *run, uint32_t now_ms, bool urgent)
{
    if (run->state == PROFILE_WAITING) {
        run->stirred_ms = now_ms;
        return;
    }
    if (run->due == 0) {
        run->arrived_ms = now_ms;
        run->urgent = false;
    }
    run->banned_count = 0;
    run->due |= what_of(run, run->hot_swap);
    run->urgent = run->urgent || urgent;
}

/* The host has changed a link: what follows from it. */
static void plan_at_once(profile_run_t *run, profile_plan_what_t what)
{
    if (run->state != PROFILE_WAITING) {
        make_due(run, (uint8_t)what);
    }
}

/* A device has left: nothing of its links is being taken away any more. */
static void forget_dropping(profile_run_t *run, const pdcp_arb_t *arb, uint8_t node)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (channel_of(arb, i)->node == node) {
            profile_set_bit(run->dropping, i, false);
        }
    }
}

static void on_ready(profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms, uint8_t node)
{
    forget_dropping(run, arb, node);
    profile_set_bit(run->awaited, node, false);
    if (run->state != PROFILE_WAITING && !run->stored) {
        read_back(run, arb, node);
    }
    plan_soon(run, now_ms, false);
}

static void ban(profile_run_t *run, uint32_t now_ms)
{
    if (run->banned_count == PROFILE_BANNED_MAX) { /* the oldest one is tried again */
        run->banned_count--;
        memmove(&run->banned[0], &run->banned[1], run->banned_count * sizeof run->banned[0]);
    }
    run->tries = 1;
    run->banned[run->banned_count].output = run->wish_output;
    run->banned[run->banned_count].input = run->wish_input;
    run->banned_count++;
    run->retry_ms = now_ms + PROFILE_RETRY_MS;
}

/* Is a link to be tried again? On a bad line, or when a device was away for a moment, an answer is missing
 * now and then, which must not lead to another limb. */
static bool is_worth_another_try(profile_run_t *run, pdcp_status_t status)
{
    if (status != PDCP_ERR_NO_ANSWER || run->tries == PROFILE_TRIES_MAX) {
        return false;
    }
    run->tries++;
    return true;
}

/* A link that was asked for is made, or is not. */
static void on_wish(profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms, const pdcp_event_t *event)
{
    if (!run->wishing) { /* it was the host's */
        if (event->status == PDCP_OK) {
            put_host_link(run, arb, event->channel);
            plan_at_once(run, PROFILE_PLAN_ORIGINALS); /* what rested for want of it comes back */
        }
        return;
    }
    run->wishing = false;
    if (event->status == PDCP_OK) {
        run->tries = 1;
        profile_set_bit(run->made, run->wish_input, true);
        run->moves++;
    } else {
        if (!is_worth_another_try(run, (pdcp_status_t)event->status)) {
            ban(run, now_ms);
        }
        make_due(run, run->what);
    }
}

/* Is the working link of an input another one than the plan knows or wants? */
static bool is_unexpected(profile_run_t *run, const pdcp_arb_t *arb, uint8_t input)
{
    if (run->making == PROFILE_MAKING) {
        const profile_scene_t scene = scene_of(run, arb);
        return profile_plan_links_differ(&run->plan, &scene);
    }
    return channel_of(arb, input)->feed != run->plan.want[input];
}

/* An input's device has asked for its link (Update Data Channel). It may lack what it requires, or break sole
 * access: then it does not count as working, and the plan decides. */
static void on_asked(profile_run_t *run, const pdcp_arb_t *arb, uint8_t input, uint8_t entry)
{
    const pdcp_channel_t *channel = channel_of(arb, input);
    if (entry == PDCP_NONE && !is_stand_in(run, input)) {
        adopt_link(run, arb, input);
    }
    if (channel->link == PDCP_LINK_ACTIVE && is_unexpected(run, arb, input)) {
        profile_set_bit(run->made, input, profile_breaks_sole_access(nodes_of(arb), channel->feed, input));
        make_due(run, what_of(run, run->hot_swap));
    }
}

/* The host has taken a link away: it is none of the configuration any more, no plan makes it again, and what
 * requires its input rests. */
static void on_removed(profile_run_t *run, uint8_t input, uint8_t entry)
{
    run->plan.want[input] = PDCP_NONE;
    if (entry != PDCP_NONE && !run->frozen) {
        remove_entry(run, entry);
        run->changed = true;
    }
    plan_at_once(run, PROFILE_PLAN_SETTLE);
}

/* The link of an input has changed, by whomever. */
static void on_link(profile_run_t *run, const pdcp_arb_t *arb, uint8_t input)
{
    const uint8_t status = channel_of(arb, input)->link;
    const uint8_t entry = entry_of(run, arb, input);
    if (status == PDCP_LINK_NONE) {
        if (arb->bus.link.kind == PDCP_TODO_REMOVE && !profile_bit(run->dropping, input)) {
            on_removed(run, input, entry);
        }
        profile_set_bit(run->dropping, input, false);
    } else if (run->state != PROFILE_WAITING && !run->stored && !run->wishing &&
               !profile_bit(run->dropping, input)) {
        on_asked(run, arb, input, entry);
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
        plan_soon(run, now_ms, true);
        break;
    case PDCP_EVENT_RESET:
        if (event->status == PDCP_OK) {
            profile_set_bit(run->awaited, event->node, true);
            run->awaited_ms = now_ms + PROFILE_RESET_MS;
        }
        break;
    case PDCP_EVENT_WISH:
        on_wish(run, arb, now_ms, event);
        break;
    case PDCP_EVENT_LINK:
        if (event->channel != PDCP_NONE) {
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
static void leave_unwanted(profile_run_t *run, const pdcp_arb_t *arb)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = channel_of(arb, i);
        if (profile_is_ready(nodes_of(arb), i, PDCP_INPUT) && channel->link == PDCP_LINK_ACTIVE &&
            channel->feed != run->plan.want[i]) {
            profile_set_bit(run->made, i, true);
        }
    }
}

static void begin_plan(profile_run_t *run, const pdcp_arb_t *arb)
{
    if (run->planning && run->making != PROFILE_MAKING) {
        leave_unwanted(run, arb);
    }
    run->state = PROFILE_CONFIGURING;
    run->planning = true;
    run->due = 0;
    run->urgent = false;
    run->making = PROFILE_MAKING;
    run->stale = true;
    if (run->purpose == PROFILE_FOR_CLEAR) {
        run->making = PROFILE_JUST_MADE;
        memset(run->plan.want, PDCP_NONE, sizeof run->plan.want);
    }
}

/* Makes a slice of the plan, of a new one if what it is made from has changed. Nothing of it counts before it
 * is done. */
static void make_slice(profile_run_t *run, const pdcp_arb_t *arb)
{
    const profile_scene_t scene = scene_of(run, arb);
    if (run->stale || profile_plan_is_stale(&run->plan, &scene)) {
        run->stale = false;
        profile_plan_begin(&run->plan, &scene,
                           run->purpose == PROFILE_FOR_ENFORCE ? PROFILE_PLAN_ENFORCE : run->what);
    }
    if (profile_plan_step(&run->plan, &scene, PROFILE_PLAN_SLICE)) {
        run->making = PROFILE_JUST_MADE;
    }
}

/* Only links that the host has made count as working: all others are planned anew. */
static void forget_working(profile_run_t *run, const pdcp_arb_t *arb)
{
    memset(run->made, 0xFF, sizeof run->made);
    for (uint8_t e = 0; e < run->links.count; e++) {
        const uint8_t input =
            profile_links_channel(&run->links, nodes_of(arb), &run->links.entries[e].input, PDCP_INPUT);
        if (run->links.entries[e].by_host && input != PDCP_NONE) {
            profile_set_bit(run->made, input, false);
        }
    }
}

void profile_run_begin(profile_run_t *run, pdcp_arb_t *arb, profile_purpose_t purpose, uint8_t what)
{
    memset(run->made, 0, sizeof run->made);
    run->banned_count = 0;
    run->tries = 1;
    run->moves = 0;
    run->purpose = (uint8_t)purpose;
    run->what = what;
    run->stored = run->stored || purpose == PROFILE_FOR_LOAD;
    if (purpose == PROFILE_FOR_LOAD || purpose == PROFILE_FOR_START) {
        forget_working(run, arb);
    } else if (purpose == PROFILE_FOR_CLEAR) {
        profile_links_init(&run->links);
        run->changed = true;
    }
    pdcp_arb_plan_links(arb, run->stored);
    begin_plan(run, arb);
}

void profile_run_start(profile_run_t *run, pdcp_arb_t *arb, bool stored)
{
    run->stored = stored;
    if (!stored) {
        read_back(run, arb, PDCP_NONE);
    }
    profile_run_begin(run, arb, stored ? PROFILE_FOR_LOAD : PROFILE_FOR_START, what_of(run, true));
}

bool profile_run_is_starting(const profile_run_t *run, const pdcp_arb_t *arb)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX && run->state == PROFILE_WAITING; i++) {
        if (nodes_of(arb)->nodes[i].state == PDCP_NODE_READY) {
            return true;
        }
    }
    return false;
}

bool profile_run_is_quiet(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    return profile_run_is_starting(run, arb) && !pdcp_arb_setup_running(arb) && pdcp_arb_links_settled(arb) &&
           pdcp_time_reached(now_ms, arb->asked_ms + PROFILE_QUIET_MS) &&
           pdcp_time_reached(now_ms, run->stirred_ms + PROFILE_QUIET_MS);
}

/* --- Carrying a plan out --- */

/* The link of an input is not to be: what the configuration has rests, what it has not goes. */
static void unlink_one(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    const pdcp_channel_t *channel = channel_of(arb, input);
    const uint8_t entry = entry_of(run, arb, input);
    const profile_ref_t *source = entry != PDCP_NONE ? &run->links.entries[entry].output : NULL;
    const bool original = source != NULL && source->index == channel->source_index &&
                          pdcp_identity_equal(&run->links.parts[source->part].identity, &channel->source);
    if (original) {
        if (channel->link == PDCP_LINK_ACTIVE) {
            pdcp_arb_rest(arb, now_ms, input);
            run->moves++;
        }
        return;
    }
    if (channel->link == PDCP_LINK_ACTIVE) {
        run->moves++;
    }
    profile_set_bit(run->dropping, input, true);
    (void)pdcp_arb_disconnect(arb, input);
}

/* The host sees a link of the configuration whose source is missing as inactive (D-BUS-10). */
static void list_missing(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    const uint8_t entry = entry_of(run, arb, input);
    if (entry == PDCP_NONE) {
        return;
    }
    profile_link_t link;
    profile_links_get(&run->links, entry, &link);
    const pdcp_link_source_t source = {.identity = link.output.owner,
                                       .type = link.output.type,
                                       .profile = link.output.profile,
                                       .index = link.output.index};
    pdcp_arb_remember(arb, now_ms, input, &source);
}

/* Takes away what is not wanted. True: there was something. */
static bool unlink_all(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    bool any = false;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (run->plan.want[i] != PDCP_NONE || !profile_is_ready(nodes_of(arb), i, PDCP_INPUT)) {
            continue;
        }
        if (channel_of(arb, i)->link == PDCP_LINK_NONE) {
            list_missing(run, arb, now_ms, i);
        } else {
            unlink_one(run, arb, now_ms, i);
            any = any || !pdcp_arb_links_settled(arb);
        }
    }
    return any;
}

/* The next input whose link is still to be made, terminal ones last; PDCP_NONE: all are made. Ends that have
 * gone since the plan was made are the next plan's business. */
static uint8_t next_input(const profile_run_t *run, const pdcp_arb_t *arb)
{
    uint8_t found = PDCP_NONE;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t output = run->plan.want[i];
        const pdcp_channel_t *channel = channel_of(arb, i);
        if (!profile_is_ready(nodes_of(arb), output, PDCP_OUTPUT) ||
            !profile_is_ready(nodes_of(arb), i, PDCP_INPUT) ||
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

static void finish(profile_run_t *run, const pdcp_arb_t *arb)
{
    run->planning = false;
    run->state = PROFILE_RUNNING;
    run->purpose = PROFILE_FOR_EVENT;
    memset(run->made, 0, sizeof run->made);
    take_up(run, arb);
}

/* Does the next thing that the plan says, when what came before is done. True: the arbitrator has something
 * to do. */
static bool carry_on(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    if (!pdcp_arb_links_settled(arb)) {
        return false;
    }
    if (unlink_all(run, arb, now_ms)) {
        return true;
    }
    const uint8_t input = next_input(run, arb);
    if (input == PDCP_NONE) {
        finish(run, arb);
        return false;
    }
    run->wish_input = input;
    run->wish_output = run->plan.want[input];
    run->wishing = pdcp_arb_connect(arb, run->wish_output, input) == PDCP_OK;
    if (!run->wishing) { /* a device has changed its channels meanwhile */
        plan_soon(run, now_ms, true);
    }
    return true;
}

static bool has_awaited(const profile_run_t *run)
{
    uint8_t all = 0;
    for (uint8_t i = 0; i < (uint8_t)PROFILE_PLACE_BYTES; i++) {
        all |= run->awaited[i];
    }
    return all != 0;
}

/* What the host has asked for is finished first. A plan for a new device waits for others that come with it.
 */
static bool is_held_back(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    if (run->planning && (run->purpose == PROFILE_FOR_CLEAR || run->purpose == PROFILE_FOR_ENFORCE)) {
        return true;
    }
    return !run->urgent && pdcp_arb_setup_running(arb) &&
           pdcp_time_before(now_ms, run->arrived_ms + PROFILE_ARRIVAL_MS);
}

static void on_time(profile_run_t *run, uint32_t now_ms)
{
    if (has_awaited(run) && pdcp_time_reached(now_ms, run->awaited_ms)) {
        memset(run->awaited, 0, sizeof run->awaited);
        plan_soon(run, now_ms, true);
    }
    if (run->banned_count != 0 && !run->planning && pdcp_time_reached(now_ms, run->retry_ms)) {
        plan_soon(run, now_ms, true);
    }
}

bool profile_run_step(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    if (run->state == PROFILE_WAITING) {
        return false;
    }
    on_time(run, now_ms);
    if (run->wishing) {
        return false;
    }
    if (run->due != 0 && !is_held_back(run, arb, now_ms)) {
        if (!run->planning) {
            run->moves = 0;
            run->what = 0;
        }
        run->what |= run->due;
        begin_plan(run, arb);
    }
    if (run->making == PROFILE_MAKING) {
        make_slice(run, arb);
        return false;
    }
    run->making = PROFILE_NOT_MAKING;
    return run->planning && carry_on(run, arb, now_ms);
}

static uint32_t earlier(uint32_t a_ms, uint32_t b_ms)
{
    return pdcp_time_before(b_ms, a_ms) ? b_ms : a_ms;
}

uint32_t profile_run_next_ms(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    uint32_t next_ms = now_ms + PDCP_TIME_FAR_MS;
    if (run->state == PROFILE_WAITING) {
        const uint32_t quiet_ms =
            (pdcp_time_before(run->stirred_ms, arb->asked_ms) ? arb->asked_ms : run->stirred_ms) +
            PROFILE_QUIET_MS;
        return pdcp_time_before(now_ms, quiet_ms) ? quiet_ms : next_ms;
    }
    if (run->making != PROFILE_NOT_MAKING) {
        return now_ms;
    }
    if (has_awaited(run)) {
        next_ms = earlier(next_ms, run->awaited_ms);
    }
    if (run->banned_count != 0 && !run->planning) {
        next_ms = earlier(next_ms, run->retry_ms);
    }
    if (run->due != 0 && !run->planning && is_held_back(run, arb, now_ms)) {
        next_ms = earlier(next_ms, run->arrived_ms + PROFILE_ARRIVAL_MS);
    }
    return next_ms;
}
