/* What links require: those that lack something are marked, or go; sole access is enforced (D-PRO-9). */
#ifndef PROFILE_SETTLE_H
#define PROFILE_SETTLE_H

#include "profile_board.h"

/* Begins to mark as gone the links that lack something they require, and those that require one of these. The
 * phase goes on when settle.marking is false; settle.spoilt says then whether the phase's input, or an
 * original that did not lack anything before (scratch.marks.lacking), is among them. */
void profile_settle_begin_marking(profile_board_t *board);

/* Marks one input more. */
void profile_settle_mark(profile_board_t *board);

/* Phase SETTLE: takes away, until nothing changes, links that require an input which is not connected. A loop
 * in which all are connected stays. */
profile_phase_t profile_settle(profile_board_t *board);

/* Phase ENFORCE: of the sole-access inputs of one output the first one keeps it. The others are marked as
 * gone. */
profile_phase_t profile_settle_enforce(profile_board_t *board);

/* Removes the entries of the inputs that ENFORCE has marked. */
void profile_settle_remove_marked(const profile_board_t *board);

#endif
