#include "profile_start.h"

#include <string.h>

#include "pdcp_time.h"
#include "profile_active.h"

void profile_start_wait(profile_run_t *run, uint32_t now_ms)
{
    if (!run->frozen) {
        profile_links_init(&run->links);
    }
    memset(run->dropping, 0, sizeof run->dropping);
    memset(run->scene.awaited, 0, sizeof run->scene.awaited);
    profile_run_enter(run, PROFILE_RUN_WAITING);
    run->due = 0;
    run->urgency = PROFILE_AFTER_SETUPS;
    run->stirred_ms = now_ms;
}

/* The start-up waits for one device at least (D-PRO-18). */
bool profile_start_is_pending(const profile_run_t *run)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX && run->state == PROFILE_RUN_WAITING; i++) {
        if (run->scene.tables->devices[i].state == PDCP_PLACE_READY) {
            return true;
        }
    }
    return false;
}

/* The time by which grants were held is taken off the quiet time (D-BUS-34). */
uint32_t profile_start_ms(const profile_run_t *run, const pdcp_arb_t *arb)
{
    const bool asked = pdcp_time_before(run->stirred_ms, arb->asked_ms);
    return (asked ? arb->asked_ms : run->stirred_ms) + PROFILE_QUIET_MS - arb->held_ms;
}

bool profile_start_may_begin(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms)
{
    return profile_start_is_pending(run) && !pdcp_arb_setup_running(arb) && pdcp_arb_links_settled(arb) &&
           pdcp_time_reached(now_ms, profile_start_ms(run, arb));
}

void profile_start_begin(profile_run_t *run, pdcp_arb_t *arb, bool stored)
{
    pdcp_arb_plan_links(arb, stored);
    if (!stored) {
        profile_active_read_back(run, PDCP_NONE);
    }
    profile_run_begin(run, run->at_start, true);
}
