#include "profile_plan.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_assert.h"
#include "profile_connect.h"
#include "profile_originals.h"
#include "profile_repair.h"
#include "profile_search.h"
#include "profile_settle.h"

enum {
    ROUNDS_MAX = 8,
    ALWAYS = 0x80 /* a bit beside profile_plan_what_t: in every plan */
};

/* A hash (FNV-1a) tells whether links have changed. */
#define HASH_BEGIN 2166136261uL

static uint32_t hash_on(uint32_t hash, uint8_t output)
{
    return (hash ^ output) * 16777619uL;
}

static uint32_t hash_planned(profile_board_t *board)
{
    uint32_t hash = HASH_BEGIN;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        hash = hash_on(hash, board->want[i]);
    }
    board->left -= 2 * PROFILE_EFFORT_SCAN;
    return hash;
}

static uint32_t hash_working(const profile_scene_t *scene)
{
    uint32_t hash = HASH_BEGIN;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        hash = hash_on(hash, profile_scene_source(scene, i));
    }
    return hash;
}

/* --- What the plan starts from --- */

static profile_phase_t look(profile_board_t *board)
{
    profile_board_set_source(board, board->at, profile_scene_source(board->scene, board->at));
    profile_board_go_to_next(board, PDCP_CHANNELS_MAX);
    if (board->at != 0) {
        return PROFILE_PHASE_LOOK;
    }
    board->plan.base = hash_planned(board);
    board->plan.before = board->plan.base;
    return PROFILE_PHASE_AWAITED;
}

static profile_phase_t find_awaited(profile_board_t *board)
{
    if (board->at < board->links->count) {
        const profile_entry_t *entry = profile_board_entry(board, board->at);
        board->left -= 2 * PROFILE_EFFORT_FIND;
        if (profile_scene_is_awaited(board->scene, &entry->output) ||
            profile_scene_is_awaited(board->scene, &entry->input)) {
            board->waits = true;
        }
    }
    profile_board_go_to_next(board, board->links->count);
    if (board->at != 0) {
        return PROFILE_PHASE_AWAITED;
    }
    profile_board_forget_stand_ins(board);
    return PROFILE_PHASE_NEXT_PART;
}

/* --- Rounds --- */

/* Autoconfiguration: gives the next terminal input a source [PROFILE listing 4.7]. */
static profile_phase_t autoconfigure(profile_board_t *board)
{
    const uint8_t input = profile_search_next(board, PDCP_NONE, NULL, board->input);
    if (input == PROFILE_SEARCH_NOT_YET) {
        return PROFILE_PHASE_AUTO;
    }
    board->input = input;
    if (input == PDCP_NONE) {
        return PROFILE_PHASE_NEXT_PART;
    }
    if (board->want[input] == PDCP_NONE &&
        !(board->waits && profile_board_entry_of(board, input) != PDCP_NONE)) {
        profile_connect_begin(board, PROFILE_SOURCE_SIMILAR, PROFILE_SOURCE_SIMILAR);
    }
    return PROFILE_PHASE_AUTO;
}

/* What a round takes away may make room for what it has passed over, so another one follows until nothing
 * changes. */
static profile_phase_t end_round(profile_board_t *board)
{
    const uint32_t now = hash_planned(board);
    board->plan.rounds++;
    if (board->plan.rounds == ROUNDS_MAX || (now == board->plan.before && !board->repair.named)) {
        return PROFILE_PHASE_WRITE_DOWN;
    }
    board->plan.before = now;
    board->repair.named = false;
    board->plan.part = 0;
    return PROFILE_PHASE_NEXT_PART;
}

/* The next part of the round that is planned. */
static profile_phase_t next_part(profile_board_t *board)
{
    static const struct {
        uint8_t what;
        uint8_t phase;
    } parts[] = {
        {PROFILE_PLAN_ENFORCE, PROFILE_PHASE_ENFORCE}, {PROFILE_PLAN_ORIGINALS, PROFILE_PHASE_ORIGINALS},
        {PROFILE_PLAN_REPLACE, PROFILE_PHASE_REPAIR},  {ALWAYS, PROFILE_PHASE_SETTLE},
        {PROFILE_PLAN_AUTO, PROFILE_PHASE_AUTO},       {ALWAYS, PROFILE_PHASE_ROUND_END},
    };
    uint8_t part = board->plan.part;
    while ((board->plan.what & parts[part].what) == 0) {
        part++;
    }
    board->plan.part = (uint8_t)(part + 1u);
    return (profile_phase_t)parts[part].phase;
}

/* --- The plan is made; profile_carry.c carries it out and ends it --- */

/* The plan is made: writes down in the configuration what it has decided. Nothing is sent here;
 * profile_carry.c carries the plan out. */
static profile_phase_t write_down(profile_board_t *board)
{
    profile_board_forget_stand_ins(board);
    for (uint8_t e = 0; e < board->links->count; e++) {
        profile_board_entry(board, e)->stand_in = board->stand_in[e];
    }
    if ((board->plan.what & PROFILE_PLAN_ENFORCE) != 0) {
        profile_settle_remove_marked(board);
    }
    return PROFILE_PHASE_DONE;
}

/* --- Phases --- */

/* Does a unit of the phase that the plan is at. */
static void do_phase(profile_board_t *board)
{
    static profile_phase_t (*const phases[])(profile_board_t *) = {
        [PROFILE_PHASE_LOOK] = look,
        [PROFILE_PHASE_AWAITED] = find_awaited,
        [PROFILE_PHASE_ENFORCE] = profile_settle_enforce,
        [PROFILE_PHASE_ORIGINALS] = profile_originals,
        [PROFILE_PHASE_ORIGINALS_TAKE] = profile_originals_take,
        [PROFILE_PHASE_ORIGINALS_LINK] = profile_originals_link,
        [PROFILE_PHASE_ORIGINALS_JUDGE] = profile_originals_judge,
        [PROFILE_PHASE_REPAIR] = profile_repair,
        [PROFILE_PHASE_REPAIR_CHOOSE] = profile_repair_choose,
        [PROFILE_PHASE_REPAIR_INPUT] = profile_repair_input,
        [PROFILE_PHASE_REPAIR_LINK] = profile_repair_link,
        [PROFILE_PHASE_REPAIR_NAME] = profile_repair_name,
        [PROFILE_PHASE_SETTLE] = profile_settle,
        [PROFILE_PHASE_AUTO] = autoconfigure,
        [PROFILE_PHASE_ROUND_END] = end_round,
        [PROFILE_PHASE_WRITE_DOWN] = write_down,
    };
    profile_phase_t next = phases[board->phase](board);
    if (next == PROFILE_PHASE_NEXT_PART) {
        next = next_part(board);
        board->originals.pass = 0;
        board->input = PDCP_NONE;
    }
    board->phase = (uint8_t)next;
}

/* --- Public interface --- */

static bool is_ready(const profile_scene_t *scene, uint8_t place)
{
    return scene->tables->devices[place].state == PDCP_PLACE_READY;
}

/* A plan is made on the board alone, and is carried out when it is whole (D-PRO-5). */
void profile_plan_begin(profile_board_t *board, const profile_scene_t *scene, uint8_t what)
{
    memset(board, 0, sizeof *board);
    memset(board->want, PDCP_NONE, sizeof board->want);
    board->plan.what = what | ALWAYS;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        pdcp_bit_set(board->plan.ready, i, is_ready(scene, i));
    }
    for (uint8_t e = 0; e < scene->links->count; e++) {
        board->stand_in[e] = scene->links->entries[e].stand_in;
    }
}

/* A device that has come or gone begins the plan again (D-PRO-23). */
bool profile_plan_is_stale(const profile_board_t *board, const profile_scene_t *scene)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (is_ready(scene, i) != pdcp_bit(board->plan.ready, i)) {
            return true;
        }
    }
    return false;
}

/* A slice of the plan: units are done until the effort is used up (D-PRO-23). */
bool profile_plan_step(profile_board_t *board, const profile_scene_t *scene, int16_t effort)
{
    pdcp_assert(!profile_plan_is_stale(board, scene),
                "profile_plan.h: the tables are those of the beginning");
    board->scene = scene;
    board->tables = scene->tables;
    board->links = scene->links;
    board->left = effort;
    while (board->phase != PROFILE_PHASE_DONE && board->left > 0) {
        board->left--;
        if (board->connect.running) {
            profile_connect_step(board);
        } else if (board->settle.marking) {
            profile_settle_mark(board);
        } else {
            do_phase(board);
        }
    }
    return board->phase == PROFILE_PHASE_DONE;
}

bool profile_plan_links_differ(const profile_board_t *board, const profile_scene_t *scene)
{
    return hash_working(scene) != board->plan.base;
}
