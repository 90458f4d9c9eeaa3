/* What a configuration is made of: links between channels that need not be there (profile-layer.md 5)
 * [PROFILE 4.5.1]. */
#ifndef PROFILE_CONFIG_H
#define PROFILE_CONFIG_H

#include <stdint.h>

#include "pdcp_codec.h"

/* One end of a link: a channel and the device that it belongs to. */
typedef struct {
    pdcp_identity_t owner;
    uint16_t owner_type;
    uint16_t owner_profile;
    uint16_t type;
    uint16_t profile;
    uint8_t index; /* channel index, 1 to n */
} profile_end_t;

typedef struct {
    profile_end_t output;
    profile_end_t input;
} profile_link_t;

#endif
