/* The planner (profile-layer.md 4): which output every input is to hear, decided on tables alone (D-PRO-5).
 *
 * It starts from the links that work, and never takes one away but for the original that it stands in for, or
 * because an input that it requires is not connected. Its result does not depend on where devices and
 * channels stand in the tables. Nothing is sent here: profile_carry.h carries the plan out, and
 * profile_step.h plans anew without a pair that could not be linked.
 *
 * A plan is made in slices, so that the bus is served in between: profile_plan_begin, then profile_plan_step
 * until it is done. The tables must not change meanwhile; when they do, the plan is begun anew (D-PRO-23).
 * How long the slices are makes no difference to the plan.
 *
 * All of it stands on a board (profile_board.h). This file goes through the phases in rounds; what they do
 * stands in profile_originals.h, profile_repair.h and profile_settle.h, which use profile_connect.h and
 * profile_search.h. Of the board, callers read `want`, `steps` and `left` alone. */
#ifndef PROFILE_PLAN_H
#define PROFILE_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#include "profile_board.h"
#include "profile_scene.h"

/* What is to be planned, in this order. */
typedef enum {
    PROFILE_PLAN_ORIGINALS = 1, /* the links of the active configuration whose ends are there (D-PRO-6) */
    PROFILE_PLAN_REPLACE = 2,   /* replacements for missing ends [PROFILE listing 4.6] */
    PROFILE_PLAN_AUTO = 4,      /* unconnected terminal channels [PROFILE listing 4.7] */
    PROFILE_PLAN_ALL = 7,
    PROFILE_PLAN_SETTLE =
        8, /* nothing new: links that miss a required input rest, as they do in every plan */
    PROFILE_PLAN_ENFORCE = 16 /* nothing else: of the sole-access inputs of one output only the one with the
                                 lowest profile keeps it, the others' entries are removed; links that then
                                 miss a required input are not wanted any more */
} profile_plan_what_t;

enum {
    PROFILE_PLAN_SLICE = 150, /* effort of a slice: half a millisecond of a dsPIC33 at 40 MIPS (D-PRO-23) */
    PROFILE_PLAN_UNIT = 300   /* what cannot be cut takes no more: a slice may be longer by so much */
};

/* Begins a plan; one that was under way is forgotten. what: profile_plan_what_t bits. */
void profile_plan_begin(profile_board_t *board, const profile_scene_t *scene, uint8_t what);

/* Makes a slice of the plan, which takes this effort, PROFILE_PLAN_SLICE, or up to PROFILE_PLAN_UNIT more.
 * True: the plan is done. */
bool profile_plan_step(profile_board_t *board, const profile_scene_t *scene, int16_t effort);

/* Has a device come or gone since the plan was begun? Then it must be begun anew. */
bool profile_plan_is_stale(const profile_board_t *board, const profile_scene_t *scene);

/* Do other links work than those that the plan was begun with? */
bool profile_plan_links_differ(const profile_board_t *board, const profile_scene_t *scene);

#endif
