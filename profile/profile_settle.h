/* Finds links that lack what they require, marks them or takes them away (D-PRO-9); enforces sole access. */
#ifndef PROFILE_SETTLE_H
#define PROFILE_SETTLE_H

#include "profile_board.h"

/* Begins to mark as gone the links that lack something, and those that require one of these. The phase waits
 * until settle.marking is false. Then settle.spoilt says whether the phase's input is among them, or an
 * original that lacked nothing before (scratch.marks.lacking). */
void profile_settle_begin_marking(profile_board_t *board);

/* Looks at one more input. */
void profile_settle_mark(profile_board_t *board);

/* Phase SETTLE: takes away links that require an input which is not connected, until nothing changes. A loop
 * in which all are connected stays. */
profile_phase_t profile_settle(profile_board_t *board);

/* Phase ENFORCE: leaves each output to the first of its sole-access inputs. The others are marked as gone. */
profile_phase_t profile_settle_enforce(profile_board_t *board);

/* Removes the entries of the inputs that ENFORCE has marked. */
void profile_settle_remove_marked(const profile_board_t *board);

#endif
