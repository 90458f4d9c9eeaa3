/* The start-up of a limb (profile-layer.md 4): when it may begin, and how (D-PRO-18). */
#ifndef PROFILE_START_H
#define PROFILE_START_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb.h"
#include "profile_run.h"

/* Goes back to the time before the start-up: the arbitrator has begun anew. The configuration is emptied
 * unless it is frozen. The rest of what a plan is made from is set when one is begun. */
void profile_start_wait(profile_run_t *run, uint32_t now_ms);

/* Is a device set up, and the start-up still to come? */
bool profile_start_is_pending(const profile_run_t *run);

/* When there will have been quiet for PROFILE_QUIET_MS, or was. The time by which a grant was held is taken
 * off (D-BUS-34). */
uint32_t profile_start_ms(const profile_run_t *run, const pdcp_arb_t *arb);

/* May the start-up begin: is it pending, no link half made, and has there been quiet for long enough? */
bool profile_start_may_begin(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms);

/* Begins the start-up. stored: a stored configuration has been loaded. Otherwise the configuration is read
 * back from the sources that the devices name. */
void profile_start_begin(profile_run_t *run, pdcp_arb_t *arb, bool stored);

#endif
