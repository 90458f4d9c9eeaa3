/* How alike two channels are, and which of several comes first (profile-layer.md 3) [PROFILE listing 4.9]. */
#ifndef PROFILE_MATCH_H
#define PROFILE_MATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_tables.h"

/* Candidates have at least the root component of their profiles in common (D-PRO-3). */
#define PROFILE_CANDIDATE_MIN 8u

/* 8 for each equal component of the profiles from the root on, then 4 for equal control mode, 2 for equal
 * data type, 1 for equal byte size: 0 to 39. Less than PROFILE_CANDIDATE_MIN: no candidates. */
uint8_t profile_match_similarity(uint16_t type_a, uint16_t profile_a, uint16_t type_b, uint16_t profile_b);

/* Is channel a before channel b: lower profile, then lower VID, PID, SN, index? The order of channels that
 * are equally alike; it does not depend on where they stand in the tables (D-PRO-3). */
bool profile_match_is_before(const pdcp_tables_t *tables, uint8_t a, uint8_t b);

/* The same for a channel with this profile, owner and index and another one. */
bool profile_match_precedes(uint16_t profile, const pdcp_identity_t *owner, uint8_t index,
                            uint16_t than_profile, const pdcp_identity_t *than_owner, uint8_t than_index);

#endif
