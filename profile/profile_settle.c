#include "profile_settle.h"

#include <string.h>

#include "profile_match.h"

/* The entry of an input, if the input hears the output that it names; PDCP_NONE otherwise. */
static uint8_t original_of(profile_board_t *board, uint8_t input)
{
    const uint8_t entry = profile_board_entry_of(board, input);
    return entry != PDCP_NONE && profile_board_hears_output_of(board, input, entry) ? entry : PDCP_NONE;
}

/* Does the link of this input lack what it requires? A link that the host has made requires nothing. */
static bool is_lacking(profile_board_t *board, uint8_t input)
{
    if (!profile_board_is_connected(board, input)) {
        return false;
    }
    if (profile_board_next_need(board, input, PROFILE_REQUIRED_BY_OUTPUT, PDCP_NONE) == PDCP_NONE &&
        profile_board_next_need(board, input, PROFILE_REQUIRED_BY_INPUT, PDCP_NONE) == PDCP_NONE) {
        return false;
    }
    const uint8_t original = original_of(board, input);
    if (original == PDCP_NONE) {
        return true;
    }
    return !profile_board_entry(board, original)->by_host;
}

void profile_settle_begin_marking(profile_board_t *board)
{
    memset(board->scratch.marks.gone, 0, sizeof board->scratch.marks.gone);
    board->settle.marking = true;
    board->settle.spoilt = false;
    board->settle.at = 0;
    board->changed = false;
}

void profile_settle_mark(profile_board_t *board)
{
    const uint8_t input = board->settle.at;
    if (is_lacking(board, input)) {
        pdcp_bit_set(board->scratch.marks.gone, input, true);
        board->changed = true;
        if (input == board->input ||
            (!pdcp_bit(board->scratch.marks.lacking, input) && original_of(board, input) != PDCP_NONE)) {
            board->settle.spoilt = true;
        }
    }
    board->settle.at++;
    if (board->settle.at == PDCP_CHANNELS_MAX) {
        board->settle.at = 0;
        board->settle.marking = board->changed; /* until nothing changes */
        board->changed = false;
    }
}

profile_phase_t profile_settle(profile_board_t *board)
{
    if (is_lacking(board, board->at)) {
        profile_board_set_source(board, board->at, PDCP_NONE);
        board->changed = true;
    }
    profile_board_go_to_next(board, PDCP_CHANNELS_MAX);
    if (board->at != 0) {
        return PROFILE_PHASE_SETTLE;
    }
    if (board->changed) {
        board->changed = false;
        return PROFILE_PHASE_SETTLE;
    }
    return PROFILE_PHASE_NEXT_PART;
}

profile_phase_t profile_settle_enforce(profile_board_t *board)
{
    const uint8_t rival = profile_board_rival_of(board, board->at, board->want[board->at]);
    if (rival != PDCP_NONE) {
        const uint8_t last = profile_match_is_before(board->tables, rival, board->at) ? board->at : rival;
        profile_board_set_source(board, last, PDCP_NONE);
        pdcp_bit_set(board->scratch.marks.gone, last, true);
        return PROFILE_PHASE_ENFORCE;
    }
    profile_board_go_to_next(board, PDCP_CHANNELS_MAX);
    return board->at != 0 ? PROFILE_PHASE_ENFORCE : PROFILE_PHASE_NEXT_PART;
}

void profile_settle_remove_marked(const profile_board_t *board)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t entry = pdcp_bit(board->scratch.marks.gone, i)
                                  ? profile_links_of(board->links, board->tables, i)
                                  : PDCP_NONE;
        if (entry != PDCP_NONE) {
            profile_links_remove(board->links, entry);
        }
    }
}
