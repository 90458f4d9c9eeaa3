#include "profile_step.h"

#include <string.h>

#include "pdcp_time.h"
#include "profile_carry.h"
#include "profile_start.h"

/* Makes a slice of the plan, or of a new one if what it is made from has changed. Nothing of a plan counts
 * before it is done (D-PRO-23). */
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

static bool has_awaited(const profile_run_t *run)
{
    uint8_t all = 0;
    for (uint8_t i = 0; i < (uint8_t)PROFILE_PLACE_BYTES; i++) {
        all |= run->scene.awaited[i];
    }
    return all != 0;
}

/* When a plan is due although nothing happens: the wait for a device is over, or banned links are tried
 * again. */
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

/* An action or a link that the host has asked for is finished first. A plan made while a link is half made
 * would take it away again when it is whole, and could not be carried out earlier anyway (D-PRO-27). */
static bool is_held_back(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    return run->what == PROFILE_PLAN_ENFORCE || pdcp_arb_link_running(arb) ||
           awaits_arrivals(run, arb, now_ms);
}

bool profile_step(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    if (run->state == PROFILE_WAITING) {
        return false;
    }
    if (pdcp_time_reached(now_ms, alarm_ms(run, now_ms))) {
        if (pdcp_time_reached(now_ms, run->awaited_ms)) {
            memset(run->scene.awaited, 0, sizeof run->scene.awaited);
        }
        profile_run_stir(run, now_ms);
    }
    if (run->requesting) {
        return false;
    }
    if (run->due != 0 && !is_held_back(run, arb, now_ms)) {
        profile_run_begin_due(run);
    }
    if (run->making == PROFILE_MAKING) {
        make_slice(run);
        return false;
    }
    run->making = PROFILE_NOT_MAKING;
    return run->state == PROFILE_CONFIGURING && profile_carry_on(run, arb, now_ms);
}

uint32_t profile_step_next_ms(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    if (run->state == PROFILE_WAITING) {
        const uint32_t start_ms = profile_start_ms(run, arb);
        return pdcp_time_before(now_ms, start_ms) ? start_ms : now_ms + PDCP_TIME_FAR_MS;
    }
    if (run->making != PROFILE_NOT_MAKING && !run->requesting) {
        return now_ms;
    }
    const uint32_t next_ms = alarm_ms(run, now_ms);
    if (run->due == 0 || run->state == PROFILE_CONFIGURING || pdcp_arb_link_running(arb)) {
        return next_ms;
    }
    return awaits_arrivals(run, arb, now_ms) ? pdcp_time_earlier(next_ms, run->arrival_ms) : now_ms;
}
