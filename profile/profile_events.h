/* How the profile layer answers what happens on the bus: it makes plans due, and lets the active
 * configuration follow. Nothing is sent here. */
#ifndef PROFILE_EVENTS_H
#define PROFILE_EVENTS_H

#include <stdint.h>

#include "pdcp_arb.h"
#include "profile_run.h"

/* Takes an event of the arbitrator; hand all of them in. */
void profile_events_take(profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms,
                         const pdcp_event_t *event);

#endif
