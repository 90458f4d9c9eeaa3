/* Searches among all channels: which one comes next that may be linked to a partner (profile-layer.md 4).
 *
 * A search may take several slices; it goes on when it is asked again in the same way. */
#ifndef PROFILE_SEARCH_H
#define PROFILE_SEARCH_H

#include <stdint.h>

#include "profile_board.h"

enum { PROFILE_SEARCH_NOT_YET = 0xFE }; /* no channel has this number: the slice is over, ask again */

/* Grants the searches that follow their share of the steps that are left. */
void profile_search_begin(profile_board_t *board);

/* Of the channels that may be linked to the partner, the one that comes next behind `tried` in their likeness
 * to an end; without a partner (PDCP_NONE, like NULL) the next terminal one. tried: PDCP_NONE for the first
 * one. Returns PDCP_NONE when there are no more, or PROFILE_SEARCH_NOT_YET. It looks at one channel at least,
 * however short the slice. */
uint8_t profile_search_next(profile_board_t *board, uint8_t partner, const profile_ref_t *like,
                            uint8_t tried);

/* Notes the channel as the best one so far (search.best) if it is. */
void profile_search_compare(profile_board_t *board, const profile_ref_t *like, uint8_t channel);

#endif
