/* How a plan becomes bus traffic: links that are not wanted go, then wanted ones are made one after the other
 * (D-PRO-5). While links fail, those that require what is not connected rest (D-PRO-9). */
#ifndef PROFILE_CARRY_H
#define PROFILE_CARRY_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb.h"
#include "profile_run.h"

/* Does the next thing that the plan says, once what came before is done. The plan must be made. True: the
 * arbitrator was given something to do. */
bool profile_carry_on(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms);

#endif
