/* Similarity of channels, and their order (profile-layer.md 3) [PROFILE listing 4.9]. */
#ifndef PROFILE_MATCH_H
#define PROFILE_MATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_tables.h"

/* Candidates have at least the root component of their profiles in common (D-PRO-3). */
#define PROFILE_CANDIDATE_MIN 8u

/* Similarity of two channels, 0 to 39: 8 for each equal component of the profiles from the root on, then 4
 * for an equal control mode, 2 for an equal data type, 1 for an equal byte size. Below PROFILE_CANDIDATE_MIN
 * they are not candidates. */
uint8_t profile_match_similarity(uint16_t type_a, uint16_t profile_a, uint16_t type_b, uint16_t profile_b);

/* Does channel a come before channel b? Lower profile, then lower VID, PID, SN, index (D-PRO-3). So equally
 * similar channels have an order that does not depend on the tables. */
bool profile_match_is_before(const pdcp_tables_t *tables, uint8_t a, uint8_t b);

/* The same for channels given by profile, owner and index. */
bool profile_match_precedes(uint16_t profile, const pdcp_identity_t *owner, uint8_t index,
                            uint16_t than_profile, const pdcp_identity_t *than_owner, uint8_t than_index);

#endif
