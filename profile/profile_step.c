#include "profile_step.h"

#include <string.h>

#include "pdcp_time.h"
#include "profile_carry.h"
#include "profile_start.h"

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
    if (run->scene.banned_count != 0 && run->state == PROFILE_RUN_IDLE) {
        next_ms = pdcp_time_earlier(next_ms, run->retry_ms);
    }
    return next_ms;
}

/* A plan for a new device waits for others that come with it (D-PRO-12). */
static bool awaits_arrivals(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    return run->urgency == PROFILE_AFTER_SETUPS && pdcp_arb_setup_running(arb) &&
           pdcp_time_before(now_ms, run->arrival_ms);
}

/* An action or a link that the host has asked for is finished first. A plan made while a link is half made
 * would take it away again when it is whole, and could not be carried out earlier anyway (D-PRO-27). */
static bool is_held_back(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    return run->what == PROFILE_PLAN_ENFORCE || pdcp_arb_link_running(arb) ||
           awaits_arrivals(run, arb, now_ms);
}

static void take_alarm(profile_run_t *run, uint32_t now_ms)
{
    if (!pdcp_time_reached(now_ms, alarm_ms(run, now_ms))) {
        return;
    }
    if (pdcp_time_reached(now_ms, run->awaited_ms)) {
        memset(run->scene.awaited, 0, sizeof run->scene.awaited);
    }
    profile_run_stir(run, now_ms, PROFILE_AT_ONCE);
}

/* --- States: each handler does what is due and returns the next state --- */

/* Nothing of a plan counts before it is made (D-PRO-23). */
static profile_run_state_t make_slice(profile_run_t *run)
{
    const bool made = profile_plan_step(&run->plan, &run->scene, PROFILE_PLAN_SLICE);
    return made ? PROFILE_RUN_PLANNED : PROFILE_RUN_PLANNING;
}

static profile_run_state_t on_to_plan(profile_run_t *run)
{
    profile_plan_begin(&run->plan, &run->scene, run->what);
    return make_slice(run);
}

/* If a device has come or gone, the plan begins again (D-PRO-23). */
static profile_run_state_t on_planning(profile_run_t *run)
{
    return profile_plan_is_stale(&run->plan, &run->scene) ? on_to_plan(run) : make_slice(run);
}

static profile_run_state_t handle(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, bool *handed)
{
    switch ((profile_run_state_t)run->state) {
    case PROFILE_RUN_TO_PLAN:
        return on_to_plan(run);
    case PROFILE_RUN_PLANNING:
        return on_planning(run);
    case PROFILE_RUN_PLANNED:
    case PROFILE_RUN_CARRYING_OUT:
        return profile_carry_on(run, arb, now_ms, handed);
    default: /* only an event leads on */
        return (profile_run_state_t)run->state;
    }
}

bool profile_step(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms)
{
    bool handed = false;
    if (run->state == PROFILE_RUN_WAITING) {
        return false;
    }
    take_alarm(run, now_ms);
    if (run->due != 0 && !profile_run_is_linking(run) && !is_held_back(run, arb, now_ms)) {
        profile_run_begin_due(run);
    }
    const profile_run_state_t next = handle(run, arb, now_ms, &handed);
    if (next != run->state) {
        profile_run_enter(run, next);
    }
    return handed;
}

uint32_t profile_step_next_ms(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    switch ((profile_run_state_t)run->state) {
    case PROFILE_RUN_WAITING: {
        const uint32_t start_ms = profile_start_ms(run, arb);
        return pdcp_time_before(now_ms, start_ms) ? start_ms : now_ms + PDCP_TIME_FAR_MS;
    }
    case PROFILE_RUN_TO_PLAN:
    case PROFILE_RUN_PLANNING:
    case PROFILE_RUN_PLANNED:
        return now_ms; /* the next step follows without delay (D-PRO-23) */
    default:
        break;
    }
    const uint32_t next_ms = alarm_ms(run, now_ms);
    if (run->due == 0 || run->state != PROFILE_RUN_IDLE || pdcp_arb_link_running(arb)) {
        return next_ms;
    }
    return awaits_arrivals(run, arb, now_ms) ? pdcp_time_earlier(next_ms, run->arrival_ms) : now_ms;
}
