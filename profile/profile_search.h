/* Searches among all channels for one that may be linked to a partner (profile-layer.md 4).
 *
 * A search may take several slices. To continue it, call it again with the same arguments. */
#ifndef PROFILE_SEARCH_H
#define PROFILE_SEARCH_H

#include <stdint.h>

#include "profile_board.h"

enum { PROFILE_SEARCH_NOT_YET = 0xFE }; /* no channel has this number; the slice is over, call again */

/* Grants the searches that follow their share of the steps that are left. */
void profile_search_begin(profile_board_t *board);

/* Finds the next candidate behind `tried` (PDCP_NONE: the first one). With a partner, these are the channels
 * that may be linked to it, the most similar to `like` first. Without one (PDCP_NONE, like NULL), these are
 * terminal inputs, in the order in which they are served. Returns PDCP_NONE when there are no more, or
 * PROFILE_SEARCH_NOT_YET. It looks at one channel at least, however short the slice. */
uint8_t profile_search_next(profile_board_t *board, uint8_t partner, const profile_ref_t *like,
                            uint8_t tried);

/* Makes the channel search.best if it is better than the best one so far. */
void profile_search_compare(profile_board_t *board, const profile_ref_t *like, uint8_t channel);

#endif
