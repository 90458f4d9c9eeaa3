/* Intelligently connect: one input with all that its link needs [PROFILE listing 4.5].
 *
 * What a link requires is connected first, or the link is undone; of what it desires as much is connected as
 * can be. Loops end, because an input that is being connected counts as connected. */
#ifndef PROFILE_CONNECT_H
#define PROFILE_CONNECT_H

#include "profile_board.h"

/* Where the source of an input comes from, in this order (D-PRO-9). */
typedef enum {
    PROFILE_SOURCE_GIVEN,       /* the phase's output */
    PROFILE_SOURCE_ORIGINAL,    /* the one that the active configuration names */
    PROFILE_SOURCE_REPLACEMENT, /* the most similar to the one that it names, which is missing */
    PROFILE_SOURCE_SIMILAR      /* the most similar to the input itself */
} profile_source_t;

/* Begins to connect the phase's input to this source; the phase goes on when connect.running is false. What
 * its link needs gets sources from PROFILE_SOURCE_ORIGINAL to the last one given. If it cannot be connected,
 * nothing has changed then. */
void profile_connect_begin(profile_board_t *board, profile_source_t source, profile_source_t last);

/* One unit more. */
void profile_connect_step(profile_board_t *board);

#endif
