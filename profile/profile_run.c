#include "profile_run.h"

#include <string.h>

#include "profile_channel.h"

void profile_run_init(profile_run_t *run, const pdcp_tables_t *tables, uint32_t now_ms)
{
    memset(run, 0, sizeof *run);
    run->scene.tables = tables;
    run->scene.links = &run->links;
    run->stirred_ms = now_ms;
}

bool profile_run_is_busy(const profile_run_t *run)
{
    return profile_run_status(run) == PROFILE_CONFIGURING || run->due != 0;
}

void profile_run_enter(profile_run_t *run, profile_run_state_t state)
{
    run->state = (uint8_t)state;
    if (state == PROFILE_RUN_IDLE) {
        run->what = 0;
        memset(run->scene.made, 0, sizeof run->scene.made);
    }
}

bool profile_run_is_planning(const profile_run_t *run)
{
    return run->state == PROFILE_RUN_TO_PLAN || run->state == PROFILE_RUN_PLANNING;
}

bool profile_run_is_linking(const profile_run_t *run)
{
    return run->state == PROFILE_RUN_LINKING || run->state == PROFILE_RUN_LINKING_LAST;
}

void profile_run_note_change(profile_run_t *run)
{
    if (run->state == PROFILE_RUN_PLANNING) {
        profile_run_enter(run, PROFILE_RUN_TO_PLAN);
    }
}

void profile_run_make_due(profile_run_t *run, uint8_t what, profile_urgency_t urgency)
{
    if (run->state != PROFILE_RUN_WAITING) {
        run->due |= what;
        if (urgency == PROFILE_AT_ONCE) {
            run->urgency = PROFILE_AT_ONCE;
        }
    }
}

void profile_run_stir(profile_run_t *run, uint32_t now_ms, profile_urgency_t urgency)
{
    run->stirred_ms = now_ms;
    run->scene.banned_count = 0;
    profile_run_make_due(run, run->at_events, urgency);
}

/* Links that the plan under way was about to take away do not count as working for the next one. It would not
 * know that they only stood in. */
static void leave_unwanted(profile_run_t *run)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t source = profile_channel_source(run->scene.tables, i);
        if (source != PDCP_NONE && source != run->plan.want[i]) {
            pdcp_bit_set(run->scene.made, i, true);
        }
    }
}

/* Is there a plan that is made, and not carried out to its end? */
static bool has_plan(const profile_run_t *run)
{
    return run->state == PROFILE_RUN_PLANNED || run->state == PROFILE_RUN_CARRYING_OUT ||
           run->state == PROFILE_RUN_LINKING;
}

static void begin_plan(profile_run_t *run)
{
    if (has_plan(run)) {
        leave_unwanted(run);
    }
    run->due = 0;
    run->urgency = PROFILE_AFTER_SETUPS;
    profile_run_enter(run, profile_run_is_linking(run) ? PROFILE_RUN_LINKING_LAST : PROFILE_RUN_TO_PLAN);
}

/* Only links that the host has made count as working, so that all others are planned again. */
static void forget_working(profile_run_t *run)
{
    memset(run->scene.made, 0xFF, sizeof run->scene.made);
    for (uint8_t e = 0; e < run->links.count; e++) {
        const profile_entry_t *entry = &run->links.entries[e];
        const uint8_t input =
            profile_links_channel(&run->links, run->scene.tables, &entry->input, PDCP_INPUT);
        if (entry->by_host && input != PDCP_NONE) {
            pdcp_bit_set(run->scene.made, input, false);
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

void profile_run_begin_due(profile_run_t *run)
{
    run->what |= run->due;
    begin_plan(run);
}
