/* The planner (profile-layer.md 4) decides from tables alone which output every input shall hear (D-PRO-5).
 *
 * It starts from the links that work. It takes one away only in favour of the original that it stands in for,
 * or because an input that it requires is not connected. The result does not depend on where devices and
 * channels stand in the tables. Nothing is sent here: profile_carry.h carries the plan out.
 *
 * A plan is made in slices, so that the bus is served in between: call profile_plan_begin, then
 * profile_plan_step until it is done. If the tables change meanwhile, begin the plan again (D-PRO-23). The
 * length of the slices makes no difference to the plan.
 *
 * The plan stands on a board (profile_board.h); callers read its `want`, `steps` and `left` only. This file
 * goes through the phases in rounds. The phases themselves stand in profile_originals.h, profile_repair.h and
 * profile_settle.h, which use profile_connect.h and profile_search.h. */
#ifndef PROFILE_PLAN_H
#define PROFILE_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#include "profile_board.h"
#include "profile_scene.h"

/* What to plan, in this order. */
typedef enum {
    PROFILE_PLAN_ORIGINALS = 1, /* the links of the active configuration whose ends are there (D-PRO-6) */
    PROFILE_PLAN_REPLACE = 2,   /* replacements for missing ends [PROFILE listing 4.6] */
    PROFILE_PLAN_AUTO = 4,      /* unconnected terminal channels [PROFILE listing 4.7] */
    PROFILE_PLAN_ALL = 7,
    PROFILE_PLAN_SETTLE = 8,  /* nothing new: only takes away links that lack a required input, as every
                                 plan does */
    PROFILE_PLAN_ENFORCE = 16 /* nothing else: of the sole-access inputs of one output, only the one with the
                                 lowest profile keeps it; the entries of the others are removed, and links
                                 that then lack a required input are taken away */
} profile_plan_what_t;

enum {
    PROFILE_PLAN_SLICE = 150, /* effort of a slice: half a millisecond of a dsPIC33 at 40 MIPS (D-PRO-23) */
    PROFILE_PLAN_UNIT = 300   /* longest work that cannot be cut: a slice may be longer by so much */
};

/* Begins a plan and forgets one that was under way. what: profile_plan_what_t bits. */
void profile_plan_begin(profile_board_t *board, const profile_scene_t *scene, uint8_t what);

/* Makes a slice of the plan, which takes this effort (PROFILE_PLAN_SLICE) or up to PROFILE_PLAN_UNIT more.
 * True: the plan is done. */
bool profile_plan_step(profile_board_t *board, const profile_scene_t *scene, int16_t effort);

/* Has a device come or gone since the plan was begun? Then it must be begun again. */
bool profile_plan_is_stale(const profile_board_t *board, const profile_scene_t *scene);

/* Do the links that work differ from those when the plan was begun? */
bool profile_plan_links_differ(const profile_board_t *board, const profile_scene_t *scene);

#endif
