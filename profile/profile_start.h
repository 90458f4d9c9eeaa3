/* Begins the start-up of a limb once the bus is quiet (profile-layer.md 4, D-PRO-18). */
#ifndef PROFILE_START_H
#define PROFILE_START_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb.h"
#include "profile_run.h"

/* Waits for the start-up again: the arbitrator has started afresh. Empties the configuration unless it is
 * frozen. */
void profile_start_wait(profile_run_t *run, uint32_t now_ms);

/* Is a device set up, but the start-up has not begun? */
bool profile_start_is_pending(const profile_run_t *run);

/* The time from which the bus has been quiet for PROFILE_QUIET_MS. The time for which grants were held is
 * taken off (D-BUS-34). */
uint32_t profile_start_ms(const profile_run_t *run, const pdcp_arb_t *arb);

/* May the start-up begin? It must be pending, no link half made, and the bus quiet for long enough. */
bool profile_start_may_begin(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms);

/* Begins the start-up. stored: a stored configuration has been loaded. Otherwise the configuration is read
 * back from the sources that the devices name. */
void profile_start_begin(profile_run_t *run, pdcp_arb_t *arb, bool stored);

#endif
