/* What a plan is made from: the tables of the bus, the active configuration, and what is not to be counted
 * on.
 *
 * Its owner (profile_run.h) keeps it; the planner reads it, and changes nothing of it but the entries of the
 * configuration, when the plan is done. */
#ifndef PROFILE_SCENE_H
#define PROFILE_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bits.h"
#include "pdcp_nodes.h"
#include "profile_links.h"

enum { PROFILE_BANNED_MAX = 8 };

#define PROFILE_CHANNEL_BYTES PDCP_BIT_BYTES(PDCP_CHANNELS_MAX)
#define PROFILE_PLACE_BYTES PDCP_BIT_BYTES(PDCP_DEVICES_MAX)

/* A link that a device has refused or not answered: not planned until the ban is lifted. */
typedef struct {
    uint8_t output;
    uint8_t input;
} profile_pair_t;

typedef struct {
    const pdcp_nodes_t *nodes;
    profile_links_t *links; /* changed only when the plan is done: their stand_in, and entries are removed by
                               PROFILE_PLAN_ENFORCE */
    uint8_t made[PROFILE_CHANNEL_BYTES];  /* inputs whose links do not count as working: those that the plan
                                             has made so far */
    uint8_t awaited[PROFILE_PLACE_BYTES]; /* devices that are away for a moment only and not replaced */
    uint8_t banned_count;
    profile_pair_t banned[PROFILE_BANNED_MAX];
} profile_scene_t;

/* Is the device of an end only away for a moment: awaited, or being set up at this time (D-PRO-13)? */
bool profile_scene_is_awaited(const profile_scene_t *scene, const profile_ref_t *end);

/* Is this pair to be left out of the plan? */
bool profile_scene_is_banned(const profile_scene_t *scene, uint8_t output, uint8_t input);

/* The output that feeds an input and counts as working; PDCP_NONE: none does. */
uint8_t profile_scene_feed(const profile_scene_t *scene, uint8_t input);

#endif
