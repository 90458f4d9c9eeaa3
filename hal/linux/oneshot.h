/* A timer for a module that must not use the loop's only deadline. Arming it makes it fire once. */
#ifndef ONESHOT_H
#define ONESHOT_H

#include <stdbool.h>
#include <stdint.h>

#include "loop.h"

/* Returns a descriptor watched by the loop, not armed, or -1 (errno says why). handler runs at each
 * expiry. */
int oneshot_open(loop_t *loop, loop_handler_t handler, void *ctx);
void oneshot_close(loop_t *loop, int timer);

/* Replaces what was armed before. delay_us 0: in the loop's next round. */
void oneshot_arm_us(int timer, uint64_t delay_us);

#endif
