#include "profile_events.h"

#include <string.h>

#include "profile_active.h"
#include "profile_channel.h"
#include "profile_start.h"

/* A device has come. Without a stored configuration the sources that it names count (D-PRO-6, D-PRO-19). */
static void on_ready(profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms, uint8_t place)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) { /* it was away: nothing is being taken away any more */
        if (run->scene.tables->channels[i].place == place) {
            pdcp_bit_set(run->dropping, i, false);
        }
    }
    pdcp_bit_set(run->scene.awaited, place, false);
    if (run->state != PROFILE_RUN_WAITING && !pdcp_arb_is_stored(arb)) {
        profile_active_read_back(run, place);
    }
    if (run->due == 0) {
        run->arrival_ms = now_ms + PROFILE_ARRIVAL_MS;
    }
    profile_run_stir(run, now_ms, PROFILE_AFTER_SETUPS);
}

/* The host has reset a device, which will be back in a moment. */
static void on_reset(profile_run_t *run, uint32_t now_ms, const pdcp_event_t *event)
{
    if (event->status == PDCP_OK) {
        pdcp_bit_set(run->scene.awaited, event->place, true);
        run->awaited_ms = now_ms + PROFILE_RESET_MS;
    }
}

/* Leaves a pair out of plans for a while (D-PRO-14). If there are too many, the oldest one is tried again. */
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

/* A link has stopped working, and this layer did not ask for that. Either an end is missing (it may
 * be lost before it ever beaconed), or the device names another source, or it does not answer. If both ends
 * are there, making the link again counts as the second try. */
static void on_broken(profile_run_t *run, uint8_t input)
{
    const pdcp_tables_t *tables = run->scene.tables;
    run->plan.want[input] = PDCP_NONE;
    if (profile_channel_is_ready(tables, input, PDCP_INPUT) &&
        profile_channel_is_ready(tables, tables->channels[input].source.channel, PDCP_OUTPUT)) {
        run->tries = 1;
    }
    profile_run_make_due(run, run->at_events, PROFILE_AT_ONCE);
}

/* A link that this layer has asked for was made or has failed. An answer may be missing on a bad line, or
 * when a device was away for a moment. That must not lead to another limb, so the link is tried again. After
 * that, or when it is refused, the next plan takes the next candidate (D-PRO-5). */
static void on_request_end(profile_run_t *run, uint32_t now_ms, pdcp_status_t status)
{
    profile_run_enter(run,
                      run->state == PROFILE_RUN_LINKING ? PROFILE_RUN_CARRYING_OUT : PROFILE_RUN_TO_PLAN);
    if (status == PDCP_OK) {
        run->tries = 0;
        pdcp_bit_set(run->scene.made, run->request.input, true);
        run->moves++;
        return;
    }
    if (run->what == PROFILE_PLAN_ENFORCE) { /* it was lost meanwhile; the action ends without it */
        on_broken(run, run->request.input);
        return;
    }
    run->tries++;
    if (status != PDCP_ERR_NO_ANSWER || run->tries == PROFILE_TRIES_MAX) {
        ban(run, now_ms, run->request);
    }
    profile_run_make_due(run, run->what, PROFILE_AT_ONCE);
}

/* A link that the host has asked for was made or has failed. What was inactive for lack of it comes back. */
static void on_hosts_request_end(profile_run_t *run, const pdcp_event_t *event)
{
    if (event->status == PDCP_OK) {
        (void)profile_active_adopt(run, event->channel, true);
        profile_run_make_due(run, PROFILE_PLAN_ORIGINALS, PROFILE_AT_ONCE);
    }
}

/* Does the working link of an input differ from what the plan knows or wants? */
static bool is_unexpected(const profile_run_t *run, uint8_t input)
{
    return profile_run_is_planning(run)
               ? profile_plan_links_differ(&run->plan, &run->scene)
               : run->scene.tables->channels[input].source.channel != run->plan.want[input];
}

/* A device has asked for the link of its input (Update Data Channel). The link may lack what it requires, so
 * a plan decides whether it stays. If it breaks sole access, it does not even count as working. */
static void on_asked(profile_run_t *run, uint8_t input, uint8_t entry)
{
    const pdcp_tables_t *tables = run->scene.tables;
    const pdcp_channel_t *channel = &tables->channels[input];
    if (entry == PDCP_NONE && profile_active_stood_in_for(run, input) == PDCP_NONE) {
        (void)profile_active_adopt(run, input, false);
    }
    if (channel->link == PDCP_LINK_ACTIVE && is_unexpected(run, input)) {
        pdcp_bit_set(run->scene.made, input,
                     profile_channel_breaks_sole_access(tables, channel->source.channel, input));
        profile_run_make_due(run, run->at_events, PROFILE_AT_ONCE);
    }
}

/* The host has taken a link away. It leaves the configuration, so that no plan makes it again, and what
 * requires its input becomes inactive (D-PRO-25). */
static void on_removed(profile_run_t *run, uint8_t input, uint8_t entry)
{
    run->plan.want[input] = PDCP_NONE;
    if (entry != PDCP_NONE && !run->frozen) {
        profile_active_remove(run, entry);
        run->changed = true;
    }
    profile_run_make_due(run, PROFILE_PLAN_SETTLE, PROFILE_AT_ONCE);
}

/* The audit has let the link of an input go. The pair is left out like one that could not be linked
 * (D-PRO-14), and what requires the input becomes inactive (D-BUS-40). Nothing is put in its place: whoever
 * disturbs a link must not get another limb by it (D-PRO-26). */
static void on_let_go(profile_run_t *run, uint32_t now_ms, uint8_t input)
{
    const profile_pair_t pair = {.output = run->scene.tables->channels[input].source.channel, .input = input};
    run->plan.want[input] = PDCP_NONE;
    ban(run, now_ms, pair);
    profile_run_make_due(run, PROFILE_PLAN_SETTLE, PROFILE_AT_ONCE);
}

/* Has a link that the finished plan wants stopped working? It is not broken while it is about to be made
 * again. */
static bool is_broken(const profile_run_t *run, uint8_t input)
{
    const pdcp_channel_t *channel = &run->scene.tables->channels[input];
    return run->state == PROFILE_RUN_IDLE && run->plan.want[input] != PDCP_NONE &&
           channel->link != PDCP_LINK_ACTIVE && (channel->todo & PDCP_TODO_CONNECT) == 0;
}

/* The link of an input has changed, whoever changed it. The outcome of a link that this layer has asked for
 * comes with PDCP_EVENT_LINK_REQUEST. */
static void on_link(profile_run_t *run, const pdcp_arb_t *arb, uint8_t input)
{
    const uint8_t link = run->scene.tables->channels[input].link;
    const uint8_t entry = profile_active_entry_of(run, input);
    const bool dropping = pdcp_bit(run->dropping, input);
    if (link == PDCP_LINK_NONE) {
        pdcp_bit_set(run->dropping, input, false);
    }
    if (dropping) {
        return;
    }
    if (pdcp_arb_removed_source(arb, input) != NULL) {
        on_removed(run, input, entry);
    } else if (is_broken(run, input)) {
        on_broken(run, input);
    } else if (link != PDCP_LINK_NONE && run->state != PROFILE_RUN_WAITING && !pdcp_arb_is_stored(arb) &&
               !profile_run_is_linking(run)) {
        on_asked(run, input, entry);
    }
}

void profile_events_take(profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms,
                         const pdcp_event_t *event)
{
    switch (event->kind) {
    case PDCP_EVENT_READY:
        on_ready(run, arb, now_ms, event->place);
        break;
    case PDCP_EVENT_SETUP_FAILED:
    case PDCP_EVENT_LOST:
        profile_run_stir(run, now_ms, PROFILE_AT_ONCE);
        break;
    case PDCP_EVENT_RESET:
        on_reset(run, now_ms, event);
        break;
    case PDCP_EVENT_LINK_REQUEST:
        if (profile_run_is_linking(run)) {
            on_request_end(run, now_ms, (pdcp_status_t)event->status);
        } else {
            on_hosts_request_end(run, event);
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
        profile_start_wait(run, now_ms);
        break;
    default:
        break;
    }
}
