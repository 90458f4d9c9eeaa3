#include "profile_match.h"

#include "profile_type.h"

#define COMPONENT_BITS 4u
#define FIRST_COMPONENT 0xF000u

uint8_t profile_match_similarity(uint16_t type_a, uint16_t profile_a, uint16_t type_b, uint16_t profile_b)
{
    const uint16_t types = type_a ^ type_b; /* bits that differ */
    const uint16_t profiles = profile_a ^ profile_b;
    uint16_t component = FIRST_COMPONENT;
    uint8_t score = 0;
    if ((types & PROFILE_TYPE_CONTROL) == 0) {
        score = 4;
    }
    if ((types & PROFILE_TYPE_DATA) == 0) {
        score = (uint8_t)(score + 2u);
    }
    if ((types & PROFILE_TYPE_SIZE) == 0) {
        score++;
    }
    while ((profile_a & component) != 0 && (profiles & component) == 0) {
        score = (uint8_t)(score + 8u);
        component = (uint16_t)(component >> COMPONENT_BITS);
    }
    return score;
}

/* Decides between channels that are equally alike (D-PRO-3). */
bool profile_match_precedes(uint16_t profile, const pdcp_identity_t *owner, uint8_t index,
                            uint16_t than_profile, const pdcp_identity_t *than_owner, uint8_t than_index)
{
    if (profile != than_profile) {
        return profile < than_profile;
    }
    if (owner->vid != than_owner->vid) {
        return owner->vid < than_owner->vid;
    }
    if (owner->pid != than_owner->pid) {
        return owner->pid < than_owner->pid;
    }
    if (owner->sn != than_owner->sn) {
        return owner->sn < than_owner->sn;
    }
    return index < than_index;
}

bool profile_match_is_before(const pdcp_tables_t *tables, uint8_t a, uint8_t b)
{
    const pdcp_channel_t *first = &tables->channels[a];
    const pdcp_channel_t *second = &tables->channels[b];
    return profile_match_precedes(first->profile, &tables->devices[first->place].identity, first->index,
                                  second->profile, &tables->devices[second->place].identity, second->index);
}
