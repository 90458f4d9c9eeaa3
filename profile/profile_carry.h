/* Carries a plan out on the bus: removes links that it does not want, then makes those it wants one by one
 * (D-PRO-5). While links fail, those that require what is not connected become inactive (D-PRO-9). */
#ifndef PROFILE_CARRY_H
#define PROFILE_CARRY_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb.h"
#include "profile_run.h"

/* States PLANNED and CARRYING_OUT: does the next thing that the plan says, once what came before is done.
 * Returns the next state. *handed becomes true if the arbitrator was given something to do. */
profile_run_state_t profile_carry_on(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms, bool *handed);

#endif
