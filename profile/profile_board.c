#include "profile_board.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_assert.h"
#include "profile_channel.h"

uint8_t profile_board_entry_of(profile_board_t *board, uint8_t input)
{
    board->left -= PROFILE_EFFORT_FIND;
    return profile_links_of(board->links, board->tables, input);
}

uint8_t profile_board_output_of(profile_board_t *board, uint8_t entry)
{
    board->left -= PROFILE_EFFORT_FIND;
    return profile_links_channel(board->links, board->tables, &profile_board_entry(board, entry)->output,
                                 PDCP_OUTPUT);
}

void profile_board_look_at_ends(profile_board_t *board)
{
    board->left -= PROFILE_EFFORT_FIND;
    board->input = profile_links_channel(board->links, board->tables,
                                         &profile_board_entry(board, board->at)->input, PDCP_INPUT);
    board->output = profile_board_output_of(board, board->at);
}

bool profile_board_hears_output_of(const profile_board_t *board, uint8_t input, uint8_t entry)
{
    const uint8_t output = board->want[input];
    if (output == PDCP_NONE) {
        return false;
    }
    return profile_links_name(board->links, board->tables, &profile_board_entry(board, entry)->output,
                              output);
}

uint8_t profile_board_rival_of(profile_board_t *board, uint8_t input, uint8_t output)
{
    if (output == PDCP_NONE || !profile_channel_is_sole(profile_board_channel(board, input))) {
        return PDCP_NONE;
    }
    board->left -= PROFILE_EFFORT_SCAN;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (board->want[i] == output && i != input &&
            profile_channel_is_sole(profile_board_channel(board, i))) {
            return i;
        }
    }
    return PDCP_NONE;
}

void profile_board_set_source(profile_board_t *board, uint8_t input, uint8_t output)
{
    if (input == PDCP_NONE) {
        return;
    }
    const uint8_t old = board->want[input];
    board->want[input] = output;
    if (!profile_channel_is_sole(profile_board_channel(board, input))) {
        return;
    }
    if (old != PDCP_NONE && profile_board_rival_of(board, input, old) == PDCP_NONE) {
        pdcp_bit_set(board->taken, old, false);
    }
    if (output != PDCP_NONE) {
        pdcp_bit_set(board->taken, output, true);
    }
}

bool profile_board_may_link(const profile_board_t *board, uint8_t output, uint8_t input)
{
    const pdcp_channel_t *to = profile_board_channel(board, input);
    pdcp_assert(profile_channel_is_ready(board->tables, output, PDCP_OUTPUT) &&
                    profile_channel_is_ready(board->tables, input, PDCP_INPUT),
                "profile_board.h: both ends are set up");
    if (profile_scene_is_banned(board->scene, output, input) ||
        (profile_channel_is_sole(to) && pdcp_bit(board->taken, output))) {
        return false;
    }
    return profile_board_channel(board, output)->place != to->place;
}

bool profile_board_is_connected(const profile_board_t *board, uint8_t input)
{
    return board->want[input] != PDCP_NONE &&
           !(board->settle.marking && pdcp_bit(board->scratch.marks.gone, input));
}

static bool is_by_output(uint8_t need)
{
    return need == PROFILE_REQUIRED_BY_OUTPUT || need == PROFILE_DESIRED_BY_OUTPUT;
}

uint8_t profile_board_next_need(profile_board_t *board, uint8_t input, uint8_t need, uint8_t last)
{
    const uint8_t by = is_by_output(need) ? board->want[input] : input;
    const pdcp_device_entry_t *owner = &board->tables->devices[profile_board_channel(board, by)->place];
    if (owner->needs_stride == 0) {
        return PDCP_NONE;
    }
    uint8_t c = last != PDCP_NONE ? profile_board_channel(board, last)->next : owner->first_channel;
    while (c != PDCP_NONE) {
        const pdcp_channel_t *channel = profile_board_channel(board, c);
        board->left--;
        if (!profile_board_is_connected(board, c) &&
            pdcp_tables_needs(board->tables, by, need >= PROFILE_DESIRED_BY_OUTPUT, channel->index)) {
            break;
        }
        c = channel->next;
    }
    return c;
}

void profile_board_link(profile_board_t *board, uint8_t input, uint8_t output)
{
    profile_board_set_source(board, input, output);
    board->log[board->logged++] = input;
}

void profile_board_undo_to(profile_board_t *board, uint8_t mark)
{
    while (board->logged > mark) {
        profile_board_set_source(board, board->log[--board->logged], PDCP_NONE);
    }
}

bool profile_board_stands_in(profile_board_t *board, uint8_t input)
{
    board->left -= PROFILE_EFFORT_FIND;
    return memchr(board->stand_in, input, board->links->count) != NULL;
}

void profile_board_forget_stand_ins(profile_board_t *board)
{
    uint8_t *stand_in = board->stand_in;
    for (uint8_t e = 0; e < board->links->count; e++, stand_in++) {
        if (*stand_in != PDCP_NONE && !profile_board_hears_output_of(board, *stand_in, e)) {
            *stand_in = PDCP_NONE;
        }
    }
    board->left -= PROFILE_EFFORT_SCAN;
}

void profile_board_go_to_next(profile_board_t *board, uint8_t count)
{
    board->at++;
    if (board->at >= count) {
        board->at = 0;
    }
}
