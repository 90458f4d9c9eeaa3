#include "profile_connect.h"

#include "profile_search.h"

enum { CHOOSING = PROFILE_NEEDS_END }; /* the need of a frame that has no link yet */

/* The output, if it may feed the input of the top frame and was not tried before; PDCP_NONE otherwise. */
static uint8_t only_source(const profile_board_t *board, uint8_t output)
{
    const profile_frame_t *top = &board->connect.top;
    if (top->tried != PDCP_NONE || output == PDCP_NONE) {
        return PDCP_NONE;
    }
    return profile_board_may_link(board, output, top->input) ? output : (uint8_t)PDCP_NONE;
}

/* The most similar output to the one that an entry names, if that is missing (D-PRO-10). */
static uint8_t next_replacement(profile_board_t *board, uint8_t entry)
{
    const profile_frame_t *top = &board->connect.top;
    if (profile_board_output_of(board, entry) != PDCP_NONE) {
        return PDCP_NONE;
    }
    return profile_search_next(board, top->input, &profile_board_entry(board, entry)->output, top->tried);
}

static uint8_t next_similar(profile_board_t *board)
{
    const profile_frame_t *top = &board->connect.top;
    const pdcp_channel_t *input = profile_board_channel(board, top->input);
    profile_ref_t like;
    like.type = input->type;
    like.profile = input->profile;
    return profile_search_next(board, top->input, &like, top->tried);
}

/* The next candidate for the top frame, of the kind of source that it is at; PDCP_NONE: there are no more. */
static uint8_t next_source(profile_board_t *board)
{
    const profile_frame_t *top = &board->connect.top;
    const uint8_t entry = profile_board_entry_of(board, top->input);
    if (entry != PDCP_NONE &&
        profile_scene_is_awaited(board->scene, &profile_board_entry(board, entry)->output)) {
        return PDCP_NONE; /* its source will be back in a moment */
    }
    if (top->source == PROFILE_SOURCE_GIVEN) {
        return only_source(board, board->output);
    }
    if (top->source == PROFILE_SOURCE_SIMILAR) {
        return next_similar(board);
    }
    if (entry == PDCP_NONE) {
        return PDCP_NONE;
    }
    return top->source == PROFILE_SOURCE_ORIGINAL ? only_source(board, profile_board_output_of(board, entry))
                                                  : next_replacement(board, entry);
}

/* --- Frames: a stack in place of recursion --- */

static void push(profile_board_t *board, uint8_t input, profile_source_t first)
{
    profile_frame_t *top = &board->connect.top;
    top->input = input;
    top->source = (uint8_t)first;
    top->tried = PDCP_NONE;
    top->mark = board->logged;
    top->need = CHOOSING;
}

/* A frame below the top is packed in four bits, its source in the upper two and its need in the lower two;
 * the rest is found elsewhere. */
static unsigned shift_of(uint8_t depth)
{
    return depth % 2u * 4u;
}

static void put_frame(profile_board_t *board, uint8_t depth, unsigned frame)
{
    uint8_t *packed = &board->below.packed_frames[depth / 2];
    const unsigned shift = shift_of(depth);
    *packed = (uint8_t)((*packed & ~(0xFu << shift)) | frame << shift);
}

static unsigned get_frame(const profile_board_t *board, uint8_t depth)
{
    return (unsigned)board->below.packed_frames[depth / 2] >> shift_of(depth);
}

/* Pushes an input that the link of the top frame needs. */
static void descend(profile_board_t *board, uint8_t need)
{
    const profile_frame_t *top = &board->connect.top;
    put_frame(board, board->connect.depth, (unsigned)(top->source << 2 | top->need));
    board->connect.depth++;
    pdcp_bit_set(board->below.open, top->mark, true);
    push(board, need, PROFILE_SOURCE_ORIGINAL);
}

/* Pops the top frame, which is done. Behind the last one the phase goes on. */
static void ascend(profile_board_t *board)
{
    profile_frame_t *top = &board->connect.top;
    if (board->connect.depth == 0) {
        board->connect.running = false;
        return;
    }
    board->connect.depth--;
    const unsigned frame = get_frame(board, board->connect.depth);
    do {
        top->mark--;
    } while (!pdcp_bit(board->below.open, top->mark));
    pdcp_bit_set(board->below.open, top->mark, false);
    top->cursor = top->input;
    top->input = board->log[top->mark];
    top->tried = board->want[top->input];
    top->source = (uint8_t)(frame >> 2 & 3u);
    top->need = frame & 3u;
}

/* --- The link of the top frame --- */

static bool is_required(uint8_t need)
{
    return need < PROFILE_DESIRED_BY_OUTPUT;
}

/* Undoes the link of the top frame with all that was made for it, so that its next candidate is tried. */
static void reject(profile_board_t *board)
{
    profile_board_undo_to(board, board->connect.top.mark);
    board->connect.top.need = CHOOSING;
}

/* Gives the input of the top frame its next candidate. */
static void choose(profile_board_t *board)
{
    profile_frame_t *top = &board->connect.top;
    const uint8_t output = next_source(board);
    if (output == PROFILE_SEARCH_NOT_YET) {
        return;
    }
    top->tried = output;
    if (output != PDCP_NONE) {
        top->need = PROFILE_REQUIRED_BY_OUTPUT;
        top->cursor = PDCP_NONE;
        profile_board_link(board, top->input, output);
    } else if (board->connect.depth != 0 && top->source < board->connect.last_source) {
        top->source++;
    } else {
        ascend(board);
        if (is_required(top->need)) {
            reject(board); /* what it required cannot be had */
        }
    }
}

void profile_connect_begin(profile_board_t *board, profile_source_t source, profile_source_t last)
{
    board->connect.running = true;
    board->connect.depth = 0;
    board->connect.last_source = (uint8_t)last;
    board->logged = 0;
    profile_search_begin(board);
    push(board, board->input, source);
}

void profile_connect_step(profile_board_t *board)
{
    profile_frame_t *top = &board->connect.top;
    if (top->need == CHOOSING) {
        choose(board);
        return;
    }
    top->cursor = profile_board_next_need(board, top->input, top->need, top->cursor);
    if (top->cursor == PDCP_NONE) {
        top->need++;
        if (top->need == PROFILE_NEEDS_END) {
            ascend(board); /* the link holds */
        }
    } else if (board->connect.depth < PROFILE_PLAN_DEPTH - 1) {
        descend(board, top->cursor);
    } else if (is_required(top->need)) {
        reject(board); /* too deep (D-PRO-17) */
    }
}
