#include "profile_search.h"

#include <stddef.h>

#include "profile_channel.h"
#include "profile_match.h"

/* May this input take the place of a missing one? It must not be linked, nor have an entry that could be. */
static bool is_spare(profile_board_t *board, uint8_t input)
{
    if (board->want[input] != PDCP_NONE) {
        return false;
    }
    const uint8_t entry = profile_board_entry_of(board, input);
    return entry == PDCP_NONE || (!board->waits && profile_board_output_of(board, entry) == PDCP_NONE);
}

/* May a channel be linked to the partner, or is it terminal if there is none? */
static bool is_candidate(profile_board_t *board, uint8_t partner, uint8_t channel)
{
    if (partner != PDCP_NONE && profile_board_channel(board, partner)->transfer == PDCP_INPUT) {
        return profile_channel_is_ready(board->tables, channel, PDCP_OUTPUT) &&
               profile_board_may_link(board, channel, partner);
    }
    if (!profile_channel_is_ready(board->tables, channel, PDCP_INPUT)) {
        return false;
    }
    if (partner == PDCP_NONE) {
        return profile_channel_is_terminal(profile_board_channel(board, channel));
    }
    return is_spare(board, channel) && profile_board_may_link(board, partner, channel);
}

/* The channel with the highest score comes first: the most similar to an end, or (NULL) the terminal one that
 * is served first. */
static uint16_t score_of(const profile_board_t *board, const profile_ref_t *like, uint8_t channel)
{
    const pdcp_channel_t *entry = profile_board_channel(board, channel);
    return like != NULL ? profile_match_similarity(entry->type, entry->profile, like->type, like->profile)
                        : (uint16_t)~profile_channel_priority(entry);
}

static bool comes_before(const profile_board_t *board, const profile_ref_t *like, uint8_t a, uint8_t b)
{
    const uint16_t first = score_of(board, like, a);
    const uint16_t second = score_of(board, like, b);
    return first != second ? first > second : profile_match_is_before(board->tables, a, b);
}

/* Keeps the better of two channels. One with another root component is no candidate (D-PRO-3). */
void profile_search_compare(profile_board_t *board, const profile_ref_t *like, uint8_t channel)
{
    if (board->search.best != PDCP_NONE) {
        if (!comes_before(board, like, channel, board->search.best)) {
            return;
        }
    } else if (like != NULL && score_of(board, like, channel) < PROFILE_CANDIDATE_MIN) {
        return;
    }
    board->search.best = channel;
}

/* A search has its share of the comparisons that are left (D-PRO-17). */
void profile_search_begin(profile_board_t *board)
{
    board->search.left = (uint16_t)((PROFILE_PLAN_STEPS - board->steps) / PROFILE_PLAN_SHARE);
}

/* Takes the steps of one search off those that are left. False: too few are left. */
static bool take_steps(profile_board_t *board)
{
    if (board->search.left < PDCP_CHANNELS_MAX) {
        return false;
    }
    board->search.left = (uint16_t)(board->search.left - PDCP_CHANNELS_MAX);
    board->steps += PDCP_CHANNELS_MAX;
    return true;
}

uint8_t profile_search_next(profile_board_t *board, uint8_t partner, const profile_ref_t *like, uint8_t tried)
{
    if (board->search.at == 0) {
        board->search.best = PDCP_NONE;
        if (partner != PDCP_NONE && !take_steps(board)) {
            return PDCP_NONE;
        }
    }
    do {
        const uint8_t c = board->search.at;
        if (is_candidate(board, partner, c)) {
            board->left -= 4;
            if (tried == PDCP_NONE || comes_before(board, like, tried, c)) {
                profile_search_compare(board, like, c);
            }
        }
        board->left--;
        board->search.at = (uint8_t)(c + 1u);
        if (board->search.at == PDCP_CHANNELS_MAX) {
            board->search.at = 0;
            return board->search.best;
        }
    } while (board->left > 0);
    return PROFILE_SEARCH_NOT_YET;
}
