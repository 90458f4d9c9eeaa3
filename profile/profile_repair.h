/* Replacements for missing ends of the active configuration [PROFILE listing 4.6] (D-PRO-10).
 *
 * Of the links that have exactly one end, those whose repaired ends would be most alike are repaired first.
 * An input may get another source, or an output another input, which stands in for the missing one. Each
 * function is the phase of its name. */
#ifndef PROFILE_REPAIR_H
#define PROFILE_REPAIR_H

#include "profile_board.h"

/* Finds out how good a replacement the entry could get. */
profile_phase_t profile_repair(profile_board_t *board);

/* Chooses the entry that is repaired next. */
profile_phase_t profile_repair_choose(profile_board_t *board);

/* Tries the next input that may stand in. */
profile_phase_t profile_repair_input(profile_board_t *board);

/* Notes whether it does. */
profile_phase_t profile_repair_link(profile_board_t *board);

/* Names an input as the stand-in that is one without being known as such. */
profile_phase_t profile_repair_name(profile_board_t *board);

#endif
