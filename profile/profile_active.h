/* Changes of the active configuration: adds links to it and removes them, as things happen (D-PRO-11).
 *
 * The links are run->links (profile_links.h). After each change a plan that is being made begins again.
 * Nothing is sent here. */
#ifndef PROFILE_ACTIVE_H
#define PROFILE_ACTIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "profile_run.h"

/* For the owner of the layer ----------------------------------------------------------------------------- */

/* Empties the active configuration, so that another can be loaded; keep_host leaves the links that the host
 * has made. Then call profile_active_load_link for each link. A link whose input has one already is left out.
 * False: there was no room. */
void profile_active_load_begin(profile_run_t *run, bool keep_host);
bool profile_active_load_link(profile_run_t *run, const profile_link_t *link);

/* Makes the stand-ins part of the configuration. Returns how many links have changed. */
uint8_t profile_active_adopt_stand_ins(profile_run_t *run);

/* Adds the links that work and are not in the active configuration, unless it is frozen. False: there was no
 * room for one. */
bool profile_active_take_up(profile_run_t *run);

/* For the other files of the layer ----------------------------------------------------------------------- */

/* The entry of an input. PDCP_NONE: it has none. */
uint8_t profile_active_entry_of(const profile_run_t *run, uint8_t input);

/* The entry whose missing input this input stands in for. PDCP_NONE: there is none. */
uint8_t profile_active_stood_in_for(const profile_run_t *run, uint8_t input);

/* Adds the link that an input has, or whose source it names, unless the configuration is frozen. Only the
 * host may add one that breaks sole access: a device may still name a source from a time when it stood in.
 * False: there was no room. */
bool profile_active_adopt(profile_run_t *run, uint8_t input, bool by_host);

/* Adds the links that the inputs of a device (PDCP_NONE: of all devices) name as their sources (D-PRO-19). Of
 * two inputs that claim the same output the first in order gets it, wherever they stand in the tables. */
void profile_active_read_back(profile_run_t *run, uint8_t place);

void profile_active_remove(profile_run_t *run, uint8_t entry);

#endif
