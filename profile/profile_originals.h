/* Originals come back: the links of the active configuration whose ends are both there
 * [PROFILE listing 4.3] (D-PRO-6).
 *
 * What stands in for one goes, and the original is linked in its place. If that costs another original what
 * it requires, all stays as it was (D-PRO-24). Each function is the phase of its name. */
#ifndef PROFILE_ORIGINALS_H
#define PROFILE_ORIGINALS_H

#include "profile_board.h"

/* Looks for the next original that is to come back, terminal ones in the second pass. */
profile_phase_t profile_originals(profile_board_t *board);

/* Takes away what it replaces, and begins to connect it. */
profile_phase_t profile_originals_take(profile_board_t *board);

/* Links it even so if the host has made it, and begins to look at what it costs. */
profile_phase_t profile_originals_link(profile_board_t *board);

/* Keeps it, or gives back what it has replaced. */
profile_phase_t profile_originals_judge(profile_board_t *board);

#endif
