/* "Intelligently connect": connects one input and all that its link needs [PROFILE listing 4.5].
 *
 * The inputs that a link requires are connected first; if one cannot be, the link is undone. Then as many of
 * those that it desires are connected as possible. Loops end, because an input that is being connected counts
 * as connected. */
#ifndef PROFILE_CONNECT_H
#define PROFILE_CONNECT_H

#include "profile_board.h"

/* Where the source of an input comes from, in this order (D-PRO-9). */
typedef enum {
    PROFILE_SOURCE_GIVEN,       /* the phase's output */
    PROFILE_SOURCE_ORIGINAL,    /* the output that the active configuration names */
    PROFILE_SOURCE_REPLACEMENT, /* the most similar to that output, if it is missing */
    PROFILE_SOURCE_SIMILAR      /* the most similar to the input itself */
} profile_source_t;

/* Begins to connect the phase's input to a source of this kind. The phase waits until connect.running is
 * false. The inputs that the link needs try their sources from PROFILE_SOURCE_ORIGINAL to `last`. If the
 * input cannot be connected, nothing has changed in the end. */
void profile_connect_begin(profile_board_t *board, profile_source_t source, profile_source_t last);

/* Does one unit of the work. */
void profile_connect_step(profile_board_t *board);

#endif
