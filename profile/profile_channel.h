/* Channels of the bus tables, read in the terms of the profile layer. */
#ifndef PROFILE_CHANNEL_H
#define PROFILE_CHANNEL_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_tables.h"
#include "profile_config.h"

/* Does the type of an input say sole access, or terminal? */
bool profile_channel_is_sole(const pdcp_channel_t *channel);
bool profile_channel_is_terminal(const pdcp_channel_t *channel);

/* The priority of a terminal channel, lowest first: its terminal profile, or its own profile if that is 0
 * (D-PRO-3). */
uint16_t profile_channel_priority(const pdcp_channel_t *channel);

/* Does this channel belong to a device that is set up, and have this direction (PDCP_INPUT, PDCP_OUTPUT)?
 * False for PDCP_NONE. */
bool profile_channel_is_ready(const pdcp_tables_t *tables, uint8_t channel, uint8_t transfer);

/* The source of an input that is ready and has an active link; PDCP_NONE: there is none. */
uint8_t profile_channel_source(const pdcp_tables_t *tables, uint8_t input);

/* Would the link give an output a second sole-access input? */
bool profile_channel_breaks_sole_access(const pdcp_tables_t *tables, uint8_t output, uint8_t input);

/* Describes a channel as the end of a link. */
void profile_channel_end(const pdcp_tables_t *tables, uint8_t channel, profile_end_t *end);

/* Describes the source that an input names, which need not be on the bus. False: it names none. */
bool profile_channel_named_source(const pdcp_tables_t *tables, uint8_t input, profile_end_t *end);

#endif
