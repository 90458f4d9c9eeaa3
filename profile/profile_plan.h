/* The planner (profile-layer.md 4): which output every input is to hear, decided on tables alone (D-PRO-5).
 *
 * It starts from the links that work, and never takes one away but for the original that it stands in for, or
 * because an input that it requires is not connected. Its result does not depend on where devices and
 * channels stand in the tables. Nothing is sent here: profile_run.h carries the plan out, and plans anew
 * without a pair that could not be linked. */
#ifndef PROFILE_PLAN_H
#define PROFILE_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_nodes.h"
#include "profile_links.h"

/* What is to be planned, in this order. */
typedef enum {
    PROFILE_PLAN_ORIGINALS = 1, /* the links of the active configuration whose ends are there (D-PRO-6) */
    PROFILE_PLAN_REPLACE = 2,   /* replacements for missing ends [PROFILE listing 4.6] */
    PROFILE_PLAN_AUTO = 4,      /* unconnected terminal channels [PROFILE listing 4.7] */
    PROFILE_PLAN_ALL = 7,
    PROFILE_PLAN_SETTLE = 8 /* nothing new: links that miss a required input rest, as they do in every plan */
} profile_plan_what_t;

enum {
    PROFILE_PLAN_DEPTH = 64, /* a chain of required inputs is followed so far; deeper ones fail */
    PROFILE_PLAN_SHARE = 8,  /* the search for one link with all that it requires may take one part in so many
                                of the steps that are left: those behind it get theirs */
    PROFILE_BANNED_MAX = 8
};

/* Channels looked at in one plan. What is not found within is not found. */
#define PROFILE_PLAN_STEPS 200000uL

/* A link that a device has refused or not answered: not planned until the ban is lifted. */
typedef struct {
    uint8_t output;
    uint8_t input;
} profile_pair_t;

/* What a plan is made from. */
typedef struct {
    const pdcp_nodes_t *nodes;
    profile_links_t *links; /* the plan writes their stand_in only */
    const uint8_t *made;    /* bit per channel: links that this plan has made in vain so far do not count as
                               working; PROFILE_CHANNEL_BYTES bytes */
    const uint8_t *awaited; /* bit per place: the device is away for a moment only and is not replaced;
                               PROFILE_PLACE_BYTES bytes */
    const profile_pair_t *banned;
    uint8_t banned_count;
} profile_scene_t;

#define PROFILE_CHANNEL_BYTES ((PDCP_CHANNELS_MAX + 7) / 8)
#define PROFILE_PLACE_BYTES ((PDCP_DEVICES_MAX + 7) / 8)

typedef struct {
    uint8_t want[PDCP_CHANNELS_MAX]; /* of inputs: channel number of the source, PDCP_NONE: none */
    uint32_t steps;                  /* channels looked at */
} profile_plan_t;

/* Makes a plan. what: profile_plan_what_t bits. */
void profile_plan_make(profile_plan_t *plan, const profile_scene_t *scene, uint8_t what);

/* A plan for enforce: of the sole-access inputs of one output only the one with the lowest profile keeps it;
 * the others' entries are removed. Links that then miss a required input are not wanted any more. */
void profile_plan_enforce(profile_plan_t *plan, const profile_scene_t *scene);

/* Would the link give an output a second sole-access input, as the tables are? */
bool profile_breaks_sole_access(const pdcp_nodes_t *nodes, uint8_t output, uint8_t input);

/* Is the device of an end only away for a moment: awaited, or being set up at this time? */
bool profile_is_awaited(const profile_scene_t *scene, const profile_ref_t *end);

#endif
