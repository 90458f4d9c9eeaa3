/* Brings originals back: links of the active configuration whose ends are both there (D-PRO-6)
 * [PROFILE listing 4.3].
 *
 * The original is linked in place of what stands in for it. If that costs another original what it requires,
 * everything stays as it was (D-PRO-24). Each function is the phase of its name. */
#ifndef PROFILE_ORIGINALS_H
#define PROFILE_ORIGINALS_H

#include "profile_board.h"

/* Looks for the next original that can come back, in a second pass for terminal ones. */
profile_phase_t profile_originals(profile_board_t *board);

/* Takes away what it replaces, and begins to connect it. */
profile_phase_t profile_originals_take(profile_board_t *board);

/* Links it in any case if the host has made it. Begins to look at what it costs. */
profile_phase_t profile_originals_link(profile_board_t *board);

/* Keeps it, or gives back what it replaced. */
profile_phase_t profile_originals_judge(profile_board_t *board);

#endif
