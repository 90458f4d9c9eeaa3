#include "profile_originals.h"

#include <string.h>

#include "profile_channel.h"
#include "profile_connect.h"
#include "profile_settle.h"

/* Goes to the next entry. */
static profile_phase_t go_on(profile_board_t *board)
{
    board->at++;
    return PROFILE_PHASE_ORIGINALS;
}

/* The rival of the input, if it must give way: its source stands in for the output of its own entry, or it
 * stands in for another input itself. PDCP_NONE: there is none. */
static uint8_t rival_to_go(profile_board_t *board)
{
    const uint8_t rival = profile_board_rival_of(board, board->input, board->output);
    if (rival == PDCP_NONE) {
        return PDCP_NONE;
    }
    const uint8_t own = profile_board_entry_of(board, rival);
    if (own != PDCP_NONE ? profile_board_hears_output_of(board, rival, own)
                         : !profile_board_stands_in(board, rival)) {
        return PDCP_NONE;
    }
    return rival;
}

/* Does this pass cover the original, and are both its ends there, but not linked, or one of them stood in
 * for? */
static bool can_come_back(const profile_board_t *board)
{
    const uint8_t input = board->input;
    if (input == PDCP_NONE || board->output == PDCP_NONE) {
        return false;
    }
    if (profile_channel_is_terminal(profile_board_channel(board, input)) != board->originals.pass) {
        return false;
    }
    return board->want[input] != board->output || board->stand_in[board->at] != PDCP_NONE;
}

/* Looks at the next link of the configuration: it comes back if it can, and what stood in goes (D-PRO-6). */
profile_phase_t profile_originals(profile_board_t *board)
{
    if (board->at >= board->links->count) {
        board->at = 0;
        board->originals.pass++;
        return board->originals.pass == 2 ? PROFILE_PHASE_NEXT_PART : PROFILE_PHASE_ORIGINALS;
    }
    profile_board_look_at_ends(board);
    if (!can_come_back(board)) {
        return go_on(board);
    }
    profile_board_forget_stand_ins(board);
    board->originals.source = board->want[board->input];
    board->originals.rival = rival_to_go(board);
    board->originals.costs = board->originals.rival != PDCP_NONE || board->originals.source != PDCP_NONE ||
                             board->stand_in[board->at] != PDCP_NONE;
    if (board->originals.costs) {
        profile_settle_begin_marking(board);
    }
    return PROFILE_PHASE_ORIGINALS_TAKE;
}

/* Gives back the sources of what an original replaces, or takes them away (PDCP_NONE). */
static void set_replaced(profile_board_t *board, uint8_t output, uint8_t source)
{
    profile_board_set_source(board, board->originals.rival, output);
    profile_board_set_source(board, board->stand_in[board->at], output);
    profile_board_set_source(board, board->input, source);
}

/* Only a terminal one may search for what it needs. Others must find it connected, or among originals. */
profile_phase_t profile_originals_take(profile_board_t *board)
{
    memcpy(board->scratch.marks.lacking, board->scratch.marks.gone, sizeof board->scratch.marks.lacking);
    set_replaced(board, PDCP_NONE, PDCP_NONE);
    const bool searches = profile_channel_is_terminal(profile_board_channel(board, board->input));
    profile_connect_begin(board, PROFILE_SOURCE_GIVEN,
                          searches ? PROFILE_SOURCE_SIMILAR : PROFILE_SOURCE_ORIGINAL);
    return PROFILE_PHASE_ORIGINALS_LINK;
}

/* A link that the host has made needs nothing (D-PRO-9). */
profile_phase_t profile_originals_link(profile_board_t *board)
{
    const uint8_t input = board->input;
    if (board->want[input] == PDCP_NONE && profile_board_entry(board, board->at)->by_host &&
        profile_board_may_link(board, board->output, input)) {
        profile_board_link(board, input, board->output);
    }
    board->settle.spoilt = board->want[input] == PDCP_NONE;
    if (!board->settle.spoilt && board->originals.costs) {
        profile_settle_begin_marking(board);
    }
    return PROFILE_PHASE_ORIGINALS_JUDGE;
}

/* Is the original linked with all that it requires, and has no other one lost that which it had
 * (D-PRO-24)? */
profile_phase_t profile_originals_judge(profile_board_t *board)
{
    if (board->settle.spoilt) {
        profile_board_undo_to(board, 0);
        set_replaced(board, board->output, board->originals.source);
    } else {
        board->stand_in[board->at] = PDCP_NONE;
    }
    return go_on(board);
}
