/* Waiting with the loop of hal/linux for what a driver does. */
#ifndef LOOPED_H
#define LOOPED_H

#include "hal_can.h"
#include "loop.h"

/* No wait takes longer: what is waited for does not come. */
#define LOOPED_LIMIT_US 5000000u

/* Rounds for this long. Returns how many. */
int looped_settle(loop_t *loop, uint64_t time_us);

/* Until so many have come. */
void looped_until(loop_t *loop, const size_t *count, size_t wanted);

/* Until the controller is in this state. */
void looped_until_state(loop_t *loop, hal_can_t *can, hal_can_state_t state);

#endif
