/* Lets the profile layer work: makes the plan that is due, slice by slice, and has it carried out. */
#ifndef PROFILE_STEP_H
#define PROFILE_STEP_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb.h"
#include "profile_run.h"

/* Does what is due. True: the arbitrator was given something to do. */
bool profile_step(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms);

/* The time of the next call at the latest; now_ms + PDCP_TIME_FAR_MS when nothing depends on time. */
uint32_t profile_step_next_ms(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms);

#endif
