/* Replaces missing ends of the active configuration [PROFILE listing 4.6] (D-PRO-10).
 *
 * A link is broken if exactly one of its ends is there. An input then gets another source, or an output
 * another input, which stands in for the missing one. The links whose ends would be most alike are repaired
 * first. Each function is the phase of its name. */
#ifndef PROFILE_REPAIR_H
#define PROFILE_REPAIR_H

#include "profile_board.h"

/* Finds out how good a replacement the entry could get. */
profile_phase_t profile_repair(profile_board_t *board);

/* Chooses the entry to repair next. */
profile_phase_t profile_repair_choose(profile_board_t *board);

/* Tries the next input that could stand in. */
profile_phase_t profile_repair_input(profile_board_t *board);

/* Notes whether it stands in now. */
profile_phase_t profile_repair_link(profile_board_t *board);

/* Finds an input that stands in without being known to. */
profile_phase_t profile_repair_name(profile_board_t *board);

#endif
