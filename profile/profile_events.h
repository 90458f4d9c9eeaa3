/* Answers what happens on the bus: makes plans due and changes the active configuration. Nothing is sent
 * here. */
#ifndef PROFILE_EVENTS_H
#define PROFILE_EVENTS_H

#include <stdint.h>

#include "pdcp_arb.h"
#include "profile_run.h"

/* Takes an event of the arbitrator. The owner must hand in all of them. */
void profile_events_take(profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms,
                         const pdcp_event_t *event);

#endif
