#include "profile_repair.h"

#include <stddef.h>

#include "profile_connect.h"
#include "profile_match.h"
#include "profile_search.h"

/* Looks up the ends of the entry, and returns the missing one if the link is broken and nothing stands in for
 * it; NULL otherwise. */
static const profile_ref_t *broken_end(profile_board_t *board)
{
    const profile_entry_t *entry = profile_board_entry(board, board->at);
    const profile_ref_t *missing = &entry->output;
    profile_board_look_at_ends(board);
    if (board->input == PDCP_NONE) {
        missing = &entry->input;
        if (board->output == PDCP_NONE || board->stand_in[board->at] != PDCP_NONE) {
            return NULL;
        }
    } else if (board->output != PDCP_NONE || board->want[board->input] != PDCP_NONE) {
        return NULL;
    }
    return profile_scene_is_awaited(board->scene, missing) ? NULL : missing;
}

/* How alike the two ends would be with the best replacement, plus 1; 0: there is none. Which one is best says
 * the missing channel alone (D-PRO-10). It may return PROFILE_SEARCH_NOT_YET. */
static uint8_t repair_key(profile_board_t *board)
{
    if (board->search.at == 0) {
        profile_search_begin(board);
    }
    const profile_ref_t *missing = broken_end(board);
    if (missing == NULL) {
        return 0;
    }
    const uint8_t partner = board->input != PDCP_NONE ? board->input : board->output;
    const uint8_t best = profile_search_next(board, partner, missing, PDCP_NONE);
    if (best == PROFILE_SEARCH_NOT_YET) {
        return PROFILE_SEARCH_NOT_YET;
    }
    if (best == PDCP_NONE) {
        return 0;
    }
    const pdcp_channel_t *one = profile_board_channel(board, partner);
    const pdcp_channel_t *other = profile_board_channel(board, best);
    return (uint8_t)(profile_match_similarity(one->type, one->profile, other->type, other->profile) + 1u);
}

profile_phase_t profile_repair(profile_board_t *board)
{
    if (board->at == 0 && board->search.at == 0) {
        profile_board_forget_stand_ins(board);
    }
    if (board->at < board->links->count) {
        const uint8_t key = repair_key(board);
        if (key == PROFILE_SEARCH_NOT_YET) {
            return PROFILE_PHASE_REPAIR;
        }
        board->scratch.repair_keys[board->at] = key;
    }
    profile_board_go_to_next(board, board->links->count);
    return board->at != 0 ? PROFILE_PHASE_REPAIR : PROFILE_PHASE_REPAIR_CHOOSE;
}

/* Goes to the entry with the highest key. False: no entry is left to repair. */
static bool go_to_best(profile_board_t *board)
{
    uint8_t best_key = 0;
    for (uint8_t e = 0; e < board->links->count; e++) {
        if (board->scratch.repair_keys[e] > best_key) {
            best_key = board->scratch.repair_keys[e];
            board->at = e;
        }
    }
    board->left -= PROFILE_EFFORT_FIND;
    return best_key != 0;
}

profile_phase_t profile_repair_choose(profile_board_t *board)
{
    if (!go_to_best(board)) {
        board->at = 0;
        return PROFILE_PHASE_REPAIR_NAME;
    }
    board->scratch.repair_keys[board->at] = 0;
    if (broken_end(board) == NULL) { /* it may have been connected as a need of another */
        return PROFILE_PHASE_REPAIR_CHOOSE;
    }
    if (board->input != PDCP_NONE) {
        profile_connect_begin(board, PROFILE_SOURCE_REPLACEMENT, PROFILE_SOURCE_SIMILAR);
        return PROFILE_PHASE_REPAIR_CHOOSE;
    }
    profile_search_begin(board);
    return PROFILE_PHASE_REPAIR_INPUT; /* input is PDCP_NONE: none was tried yet */
}

profile_phase_t profile_repair_input(profile_board_t *board)
{
    const profile_ref_t *missing = &profile_board_entry(board, board->at)->input;
    const uint8_t input = profile_search_next(board, board->output, missing, board->input);
    if (input == PROFILE_SEARCH_NOT_YET) {
        return PROFILE_PHASE_REPAIR_INPUT;
    }
    if (input == PDCP_NONE) {
        return PROFILE_PHASE_REPAIR_CHOOSE;
    }
    board->input = input;
    profile_connect_begin(board, PROFILE_SOURCE_GIVEN, PROFILE_SOURCE_SIMILAR);
    return PROFILE_PHASE_REPAIR_LINK;
}

profile_phase_t profile_repair_link(profile_board_t *board)
{
    if (board->want[board->input] == PDCP_NONE) {
        return PROFILE_PHASE_REPAIR_INPUT;
    }
    board->stand_in[board->at] = board->input;
    return PROFILE_PHASE_REPAIR_CHOOSE;
}

/* The input without an entry that hears the output and is most like the missing one; PDCP_NONE: there is
 * none. */
static uint8_t fed_instead(profile_board_t *board)
{
    const profile_ref_t *missing = &profile_board_entry(board, board->at)->input;
    board->search.best = PDCP_NONE;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (board->want[i] == board->output && !profile_board_stands_in(board, i) &&
            profile_board_entry_of(board, i) == PDCP_NONE) {
            profile_search_compare(board, missing, i);
        }
    }
    board->left -= PROFILE_EFFORT_SCAN;
    return board->search.best;
}

/* An output whose input is missing may have been linked to what a replacement requires. That input stands in,
 * too, and goes when the original comes back. */
profile_phase_t profile_repair_name(profile_board_t *board)
{
    uint8_t *stand_in = &board->stand_in[board->at];
    if (board->at < board->links->count && *stand_in == PDCP_NONE) {
        profile_board_look_at_ends(board);
        if (board->input == PDCP_NONE && board->output != PDCP_NONE) {
            *stand_in = fed_instead(board);
            if (*stand_in != PDCP_NONE) {
                board->repair.named = true;
            }
        }
    }
    profile_board_go_to_next(board, board->links->count);
    return board->at != 0 ? PROFILE_PHASE_REPAIR_NAME : PROFILE_PHASE_NEXT_PART;
}
