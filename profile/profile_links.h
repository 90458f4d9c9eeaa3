/* The active configuration: the links as they should be, whether their ends are there or not.
 *
 * A save stores it. An input has one entry at most. Entries are ordered by their inputs: lower profile, then
 * lower VID, PID, SN, index. So it does not matter in which order they came. A device that several entries
 * name is kept once (parts). Plain data: nothing here knows frames or time. */
#ifndef PROFILE_LINKS_H
#define PROFILE_LINKS_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_tables.h"
#include "profile_config.h"
#include "profile_limits.h"

typedef struct {
    pdcp_identity_t identity;
    uint16_t type;
    uint16_t profile;
} profile_part_t;

typedef struct {
    uint16_t type;
    uint16_t profile;
    uint8_t part;
    uint8_t index; /* channel index */
} profile_ref_t;

typedef struct {
    profile_ref_t output;
    profile_ref_t input;
    uint8_t stand_in; /* channel number of the input that stands in for a missing one; PDCP_NONE: none.
                         The planner's; an output that stands in is seen in the tables. */
    bool by_host;     /* made by 2307h: left alone when an input that it requires is lost (D-PRO-9) */
} profile_entry_t;

typedef struct {
    uint8_t count;
    profile_part_t parts[PROFILE_PARTS_MAX]; /* in use: those that an entry names */
    profile_entry_t entries[PROFILE_LINKS_MAX];
} profile_links_t;

void profile_links_init(profile_links_t *links);

/* Adds a link, and replaces the one that its input has. What stands in for that one stays noted; otherwise it
 * would stand in for good. False: there is no room, and nothing has changed. */
bool profile_links_put(profile_links_t *links, const profile_link_t *link, bool by_host);

void profile_links_remove(profile_links_t *links, uint8_t entry);

/* Would a link break sole access? Its output would have an entry with another sole-access input. */
bool profile_links_is_claimed(const profile_links_t *links, const profile_link_t *link);

/* Entry of the input with this owner and index. PDCP_NONE: it has none. */
uint8_t profile_links_find(const profile_links_t *links, const pdcp_identity_t *owner, uint8_t index);

/* Entry of an input of the tables. PDCP_NONE: it has none. */
uint8_t profile_links_of(const profile_links_t *links, const pdcp_tables_t *tables, uint8_t channel);

/* Writes an entry to *link, with the devices of both ends. */
void profile_links_get(const profile_links_t *links, uint8_t entry, profile_link_t *link);

/* Does an end name this channel of the tables? */
bool profile_links_name(const profile_links_t *links, const pdcp_tables_t *tables, const profile_ref_t *end,
                        uint8_t channel);

/* Place of the device that an end names; PDCP_NONE: it is not bound. */
uint8_t profile_links_place(const profile_links_t *links, const pdcp_tables_t *tables,
                            const profile_ref_t *end);

/* Channel number of an end that is there and set up, with this direction; PDCP_NONE: it is missing. */
uint8_t profile_links_channel(const profile_links_t *links, const pdcp_tables_t *tables,
                              const profile_ref_t *end, uint8_t transfer);

#endif
