/* Keeps the active configuration in step with what happens (D-PRO-11): adds links to it and removes them.
 *
 * The links themselves are run->links (profile_links.h). Every change of them makes a plan that is being made
 * stale. Nothing is sent here. */
#ifndef PROFILE_ACTIVE_H
#define PROFILE_ACTIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "profile_run.h"

/* For the owner of the layer ----------------------------------------------------------------------------- */

/* Empties the active configuration for one that is to be loaded; keep_host leaves links that the host has
 * made. Then call profile_active_load_link for each link of the new one: a link whose input has one already
 * is left out, and false means that there was no room. */
void profile_active_load_begin(profile_run_t *run, bool keep_host);
bool profile_active_load_link(profile_run_t *run, const profile_link_t *link);

/* Replaces the entries of missing ends by what stands in for them. Returns how many links have changed. */
uint8_t profile_active_adopt_stand_ins(profile_run_t *run);

/* Adds links that work without being in the active configuration, unless it is frozen. False: there was no
 * room for one. */
bool profile_active_take_up(profile_run_t *run);

/* For the other files of the layer ----------------------------------------------------------------------- */

/* The entry of an input; PDCP_NONE: it has none. */
uint8_t profile_active_entry_of(const profile_run_t *run, uint8_t input);

/* The entry whose missing input this one stands in for; PDCP_NONE: it does not stand in. */
uint8_t profile_active_stood_in_for(const profile_run_t *run, uint8_t input);

/* Adds the link that an input has, or whose source it names, unless the configuration is frozen. Only the
 * host may add one that breaks sole access: a device may still remember a source that it once stood in with.
 * False: there was no room. */
bool profile_active_adopt(profile_run_t *run, uint8_t input, bool by_host);

/* Reads the configuration back from the sources that the inputs of a device (PDCP_NONE: of all) name
 * (D-PRO-19). The order does not depend on where they stand in the tables: of two that claim the same output
 * the first one gets it. */
void profile_active_read_back(profile_run_t *run, uint8_t place);

void profile_active_remove(profile_run_t *run, uint8_t entry);

#endif
