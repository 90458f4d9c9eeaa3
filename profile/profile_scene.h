/* What a plan is made from: bus tables, active configuration, and what the planner must leave out.
 *
 * The owner (profile_run.h) fills it in. The planner only reads it, except that a plan that is made changes
 * entries of the configuration. */
#ifndef PROFILE_SCENE_H
#define PROFILE_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bits.h"
#include "pdcp_tables.h"
#include "profile_limits.h"
#include "profile_links.h"

#define PROFILE_CHANNEL_BYTES PDCP_BIT_BYTES(PDCP_CHANNELS_MAX)
#define PROFILE_PLACE_BYTES PDCP_BIT_BYTES(PDCP_DEVICES_MAX)

/* A link that a device has refused or not answered. It is not planned until the ban is lifted. */
typedef struct {
    uint8_t output;
    uint8_t input;
} profile_pair_t;

typedef struct {
    const pdcp_tables_t *tables;
    profile_links_t *links; /* when the plan is done it sets their stand_in; PROFILE_PLAN_ENFORCE removes
                               entries */
    uint8_t made[PROFILE_CHANNEL_BYTES];  /* bit per input: its link does not count as working, such as
                                             one that the plan under way has made */
    uint8_t awaited[PROFILE_PLACE_BYTES]; /* bit per place: the device is only away for a moment and keeps
                                             its links */
    uint8_t banned_count;
    profile_pair_t banned[PROFILE_BANNED_MAX];
} profile_scene_t;

/* Is the device of an end only away for a moment: awaited, or being set up at this time (D-PRO-13)? */
bool profile_scene_is_awaited(const profile_scene_t *scene, const profile_ref_t *end);

/* Is this pair banned, so that the plan must leave it out? */
bool profile_scene_is_banned(const profile_scene_t *scene, uint8_t output, uint8_t input);

/* The source of an input whose link works and counts; PDCP_NONE: there is none. */
uint8_t profile_scene_source(const profile_scene_t *scene, uint8_t input);

#endif
