#include "profile_match.h"

#include "profile_type.h"

#define COMPONENT_BITS 4u
#define FIRST_COMPONENT 0xF000u

static uint8_t profile_score(uint16_t a, uint16_t b)
{
    uint8_t score = 0;
    while ((a & FIRST_COMPONENT) != 0 && (a & FIRST_COMPONENT) == (b & FIRST_COMPONENT)) {
        score = (uint8_t)(score + 8);
        a = (uint16_t)((uint32_t)a << COMPONENT_BITS);
        b = (uint16_t)((uint32_t)b << COMPONENT_BITS);
    }
    return score;
}

uint8_t profile_similarity(uint16_t type_a, uint16_t profile_a, uint16_t type_b, uint16_t profile_b)
{
    profile_type_t a;
    profile_type_t b;
    (void)profile_type_decode(type_a, &a);
    (void)profile_type_decode(type_b, &b);
    return (uint8_t)(profile_score(profile_a, profile_b) + (a.control == b.control ? 4 : 0) +
                     (a.data == b.data ? 2 : 0) + (a.size == b.size ? 1 : 0));
}

bool profile_is_sole(const pdcp_channel_t *channel)
{
    profile_type_t type;
    (void)profile_type_decode(channel->type, &type);
    return type.sole_access;
}

bool profile_is_terminal(const pdcp_channel_t *channel)
{
    profile_type_t type;
    (void)profile_type_decode(channel->type, &type);
    return type.terminal;
}

uint16_t profile_priority(const pdcp_channel_t *channel)
{
    return channel->terminal_profile != 0 ? channel->terminal_profile : channel->profile;
}

static int8_t order_words(uint16_t a, uint16_t b)
{
    return (int8_t)(a < b ? -1 : (a > b ? 1 : 0));
}

int8_t profile_order(const pdcp_identity_t *a, const pdcp_identity_t *b)
{
    int8_t order = order_words(a->vid, b->vid);
    if (order == 0) {
        order = order_words(a->pid, b->pid);
    }
    return (int8_t)(order != 0 ? order : order_words(a->sn, b->sn));
}

bool profile_is_before(const pdcp_nodes_t *nodes, uint8_t a, uint8_t b)
{
    const pdcp_channel_t *first = &nodes->channels[a];
    const pdcp_channel_t *second = &nodes->channels[b];
    int8_t order = order_words(first->profile, second->profile);
    if (order == 0) {
        order = profile_order(&nodes->nodes[first->node].identity, &nodes->nodes[second->node].identity);
    }
    return order != 0 ? order < 0 : first->index < second->index;
}

bool profile_is_ready(const pdcp_nodes_t *nodes, uint8_t channel, uint8_t transfer)
{
    if (channel == PDCP_NONE) {
        return false;
    }
    const pdcp_channel_t *entry = &nodes->channels[channel];
    return entry->node != PDCP_NONE && entry->transfer == transfer &&
           nodes->nodes[entry->node].state == PDCP_NODE_READY;
}

bool profile_bit(const uint8_t *bits, uint8_t number)
{
    return (bits[number / 8] & (1u << (number % 8))) != 0;
}

void profile_set_bit(uint8_t *bits, uint8_t number, bool value)
{
    const uint8_t mask = (uint8_t)(1u << (number % 8));
    bits[number / 8] = (uint8_t)(value ? bits[number / 8] | mask : bits[number / 8] & ~mask);
}
