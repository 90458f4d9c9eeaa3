#include "pdcp_nodes.h"

#include <string.h>

#include "pdcp_bytes.h"
#include "pdcp_codec.h"

/* Makes a place free. */
static void clear_place(pdcp_node_t *node, uint8_t place)
{
    memset(node, 0, sizeof *node);
    node->place = place;
    node->first_channel = PDCP_NONE;
}

void pdcp_nodes_init(pdcp_nodes_t *nodes)
{
    memset(nodes, 0, sizeof *nodes);
    for (uint16_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        nodes->channels[i].node = PDCP_NONE;
    }
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        clear_place(&nodes->nodes[i], i);
    }
}

uint8_t pdcp_nodes_find(const pdcp_nodes_t *nodes, const pdcp_identity_t *identity)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_node_t *node = &nodes->nodes[i];
        if (node->state != PDCP_NODE_FREE && pdcp_identity_equal(&node->identity, identity)) {
            return i;
        }
    }
    return PDCP_NONE;
}

uint8_t pdcp_nodes_free_place(const pdcp_nodes_t *nodes)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (nodes->nodes[i].state == PDCP_NODE_FREE) {
            return i;
        }
    }
    return PDCP_NONE;
}

void pdcp_nodes_add(pdcp_nodes_t *nodes, uint8_t place, const pdcp_identity_t *identity, uint8_t node_id)
{
    pdcp_node_t *node = &nodes->nodes[place];
    node->state = PDCP_NODE_SETUP;
    node->identity = *identity;
    node->node_id = node_id;
    nodes->owner[node_id] = (uint8_t)(place + 1);
}

void pdcp_nodes_hold(pdcp_nodes_t *nodes, uint8_t place, const pdcp_identity_t *identity)
{
    nodes->nodes[place].state = PDCP_NODE_ASKED;
    nodes->nodes[place].identity = *identity;
}

bool pdcp_nodes_is_bound(const pdcp_nodes_t *nodes, uint8_t node)
{
    if (node >= PDCP_DEVICES_MAX) {
        return false;
    }
    const uint8_t state = nodes->nodes[node].state;
    return state != PDCP_NODE_FREE && state != PDCP_NODE_LOST && state != PDCP_NODE_ASKED;
}

uint8_t pdcp_nodes_count_state(const pdcp_nodes_t *nodes, pdcp_node_state_t state)
{
    uint8_t places = 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        places = (uint8_t)(places + (nodes->nodes[i].state == (uint8_t)state));
    }
    return places;
}

static void drop_needs(pdcp_nodes_t *nodes, pdcp_node_t *gone)
{
    const uint16_t size = (uint16_t)(2u * gone->needs_stride * gone->channel_count);
    if (size == 0) {
        return;
    }
    const uint16_t end = (uint16_t)(gone->needs_at + size);
    memmove(&nodes->needs[gone->needs_at], &nodes->needs[end], (size_t)(nodes->needs_used - end));
    nodes->needs_used = (uint16_t)(nodes->needs_used - size);
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (nodes->nodes[i].needs_at > gone->needs_at) {
            nodes->nodes[i].needs_at = (uint16_t)(nodes->nodes[i].needs_at - size);
        }
    }
    gone->needs_stride = 0;
    gone->needs_at = 0;
}

void pdcp_nodes_set_output_id(pdcp_nodes_t *nodes, pdcp_channel_t *output, uint8_t node_id)
{
    if (output->node_id != 0) {
        nodes->owner[output->node_id] = 0;
    }
    output->node_id = node_id;
    if (node_id != 0) {
        nodes->owner[node_id] = (uint8_t)(0x80u | (uint8_t)(output->node + 1u));
    }
}

void pdcp_nodes_drop_feed(pdcp_nodes_t *nodes, uint8_t channel)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (nodes->channels[i].source.feed == channel) {
            nodes->channels[i].source.feed = PDCP_NONE;
        }
    }
}

/* Frees the channels of a device from the one with index count + 1 on. */
static void cut_channels(pdcp_nodes_t *nodes, pdcp_node_t *owner, uint8_t count)
{
    uint8_t *link = &owner->first_channel;
    while (*link != PDCP_NONE) {
        const uint8_t number = *link;
        pdcp_channel_t *channel = &nodes->channels[number];
        if (channel->index <= count) {
            link = &channel->next;
        } else {
            *link = channel->next;
            if (channel->transfer == PDCP_OUTPUT) {
                pdcp_nodes_set_output_id(nodes, channel, 0);
            }
            memset(channel, 0, sizeof *channel);
            channel->node = PDCP_NONE;
            pdcp_nodes_drop_feed(nodes, number);
        }
    }
}

void pdcp_nodes_remove(pdcp_nodes_t *nodes, uint8_t node)
{
    pdcp_node_t *gone = &nodes->nodes[node];
    drop_needs(nodes, gone);
    cut_channels(nodes, gone, 0);
    nodes->owner[gone->node_id] = 0;
    clear_place(gone, node);
}

void pdcp_nodes_clear_source(pdcp_channel_t *input)
{
    input->source.identity.vid = PDCP_NO_SOURCE_WORD;
    input->source.identity.pid = PDCP_NO_SOURCE_WORD;
    input->source.identity.sn = PDCP_NO_SOURCE_WORD;
    input->source.index = PDCP_NO_SOURCE_INDEX;
    input->source.type = 0;
    input->source.profile = 0;
}

void pdcp_nodes_take_source(pdcp_channel_t *input, uint8_t param, uint16_t low, uint16_t high)
{
    if (param == PDCP_IN_SOURCE_VID_PID) {
        input->source.identity.vid = low;
        input->source.identity.pid = high;
    } else if (param == PDCP_IN_SOURCE_SERIAL) {
        input->source.identity.sn = low;
        input->source.index = (uint8_t)(high & 0xFFu);
    } else {
        input->source.type = low;
        input->source.profile = high;
    }
}

bool pdcp_nodes_is_source(const pdcp_channel_t *input, uint8_t param, uint16_t low, uint16_t high)
{
    if (param == PDCP_IN_SOURCE_VID_PID) {
        return input->source.identity.vid == low && input->source.identity.pid == high;
    }
    if (param == PDCP_IN_SOURCE_SERIAL) {
        return input->source.identity.sn == low && input->source.index == (uint8_t)(high & 0xFFu);
    }
    return input->source.type == low && input->source.profile == high;
}

/* Makes a free entry of the pool, which is all 0 but for its node, a channel that nothing is known of. */
static void make_channel(pdcp_channel_t *channel, uint8_t node, uint16_t index)
{
    channel->node = node;
    channel->index = (uint8_t)index;
    channel->next = PDCP_NONE;
    channel->source.feed = PDCP_NONE;
    pdcp_nodes_clear_source(channel);
}

/* Gives a device what it lacks of count channels. False: the pool is used up. */
static bool append_channels(pdcp_nodes_t *nodes, pdcp_node_t *owner, uint8_t count)
{
    uint8_t *link = &owner->first_channel;
    while (*link != PDCP_NONE) {
        link = &nodes->channels[*link].next;
    }
    uint16_t index = owner->channel_count + 1u;
    for (uint8_t i = 0; index <= count && i < PDCP_CHANNELS_MAX; i++) {
        pdcp_channel_t *channel = &nodes->channels[i];
        if (channel->node == PDCP_NONE) {
            make_channel(channel, owner->place, index);
            *link = i;
            link = &channel->next;
            index++;
        }
    }
    return index > count;
}

bool pdcp_nodes_set_channels(pdcp_nodes_t *nodes, uint8_t node, uint8_t count)
{
    pdcp_node_t *owner = &nodes->nodes[node];
    const bool fits = append_channels(nodes, owner, count);
    if (fits) {
        drop_needs(nodes, owner);
        owner->channel_count = count;
    }
    cut_channels(nodes, owner, owner->channel_count);
    return fits;
}

uint8_t pdcp_nodes_channel(const pdcp_nodes_t *nodes, uint8_t node, uint8_t index)
{
    uint8_t channel = nodes->nodes[node].first_channel;
    while (channel != PDCP_NONE && nodes->channels[channel].index != index) {
        channel = nodes->channels[channel].next;
    }
    return channel;
}

bool pdcp_nodes_may_hear(const pdcp_nodes_t *nodes, uint8_t node_id)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (nodes->channels[i].node_id == node_id && nodes->channels[i].transfer == PDCP_INPUT) {
            return true;
        }
    }
    return false;
}

uint8_t pdcp_nodes_output(const pdcp_nodes_t *nodes, uint8_t node, uint8_t node_id)
{
    uint8_t channel = nodes->nodes[node].first_channel;
    while (channel != PDCP_NONE && (nodes->channels[channel].node_id != node_id ||
                                    nodes->channels[channel].transfer != PDCP_OUTPUT)) {
        channel = nodes->channels[channel].next;
    }
    return channel;
}

bool pdcp_nodes_make_needs(pdcp_nodes_t *nodes, uint8_t node)
{
    pdcp_node_t *owner = &nodes->nodes[node];
    uint16_t inputs = 0;
    for (uint8_t c = owner->first_channel; c != PDCP_NONE; c = nodes->channels[c].next) {
        if (nodes->channels[c].transfer == PDCP_INPUT) {
            inputs++;
        }
    }
    drop_needs(nodes, owner);
    const uint16_t stride = (uint16_t)((inputs + 7u) / 8u);
    const uint16_t size = (uint16_t)(2u * stride * owner->channel_count);
    if (size > PDCP_NEEDS_BYTES - nodes->needs_used) {
        return false;
    }
    owner->needs_at = nodes->needs_used;
    owner->needs_stride = (uint8_t)stride;
    memset(&nodes->needs[nodes->needs_used], 0, size);
    nodes->needs_used = (uint16_t)(nodes->needs_used + size);
    return true;
}

/* Where the channel's set of required or desired inputs begins. */
static uint16_t set_at(const pdcp_node_t *owner, const pdcp_channel_t *channel, bool desired)
{
    const uint16_t set = (uint16_t)(2u * (channel->index - 1u) + (desired ? 1u : 0u));
    return (uint16_t)(owner->needs_at + set * owner->needs_stride);
}

static uint8_t mask_of(uint16_t bit)
{
    return (uint8_t)(0x80u >> (bit % 8u));
}

void pdcp_nodes_put_needs(pdcp_nodes_t *nodes, uint8_t channel, bool desired, uint16_t offset,
                          const uint8_t *bytes, uint16_t len)
{
    const pdcp_channel_t *needing = &nodes->channels[channel];
    const pdcp_node_t *owner = &nodes->nodes[needing->node];
    uint8_t *set = &nodes->needs[set_at(owner, needing, desired)];
    uint16_t bit = 0; /* of an input in a set of its device */
    for (uint8_t c = owner->first_channel; c != PDCP_NONE; c = nodes->channels[c].next) {
        const pdcp_channel_t *input = &nodes->channels[c];
        if (input->transfer == PDCP_INPUT) {
            const uint16_t from = (uint16_t)(input->index - 8u * offset); /* large before the offset */
            if (from / 8u < len && (bytes[from / 8u] & mask_of(from)) != 0) {
                set[bit / 8u] |= mask_of(bit);
            }
            bit++;
        }
    }
}

bool pdcp_nodes_needs(const pdcp_nodes_t *nodes, uint8_t channel, bool desired, uint8_t index)
{
    const pdcp_channel_t *needing = &nodes->channels[channel];
    const pdcp_node_t *owner = &nodes->nodes[needing->node];
    const uint8_t *set = &nodes->needs[set_at(owner, needing, desired)];
    uint16_t bit = 0;
    for (uint8_t c = owner->first_channel; c != PDCP_NONE; c = nodes->channels[c].next) {
        const pdcp_channel_t *input = &nodes->channels[c];
        if (input->transfer == PDCP_INPUT) {
            if (input->index == index) {
                return (set[bit / 8u] & mask_of(bit)) != 0;
            }
            bit++;
        }
    }
    return false;
}

/* Status of the link that an input has to an output; PDCP_LINK_NONE: it has none, or not to this one. */
static uint8_t link_to(const pdcp_nodes_t *nodes, const pdcp_channel_t *input, uint8_t output)
{
    const pdcp_channel_t *source = &nodes->channels[output];
    if (input->source.index != source->index ||
        !pdcp_identity_equal(&input->source.identity, &nodes->nodes[source->node].identity)) {
        return PDCP_LINK_NONE;
    }
    return input->link;
}

uint8_t pdcp_nodes_rival(const pdcp_nodes_t *nodes, uint8_t output, uint8_t input)
{
    const pdcp_channel_t *asked = &nodes->channels[input];
    const uint8_t own = link_to(nodes, asked, output);
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *other = &nodes->channels[i];
        if (other != asked && (other->type & asked->type & PDCP_TYPE_SOLE) != 0 &&
            link_to(nodes, other, output) > own) {
            return i;
        }
    }
    return PDCP_NONE;
}

/* Does this device, or do its channels, count for the host? Links count whatever becomes of their devices. */
static bool counts(const pdcp_node_t *node, uint8_t kind)
{
    if (kind == PDCP_COUNTS_LINK) {
        return true;
    }
    return node->beaconed &&
           (kind == PDCP_COUNTS_DEVICE ? node->state != PDCP_NODE_LOST : node->state == PDCP_NODE_READY);
}

static bool is_of_kind(const pdcp_channel_t *channel, uint8_t kind)
{
    return kind == PDCP_COUNTS_LINK ? channel->link != PDCP_LINK_NONE : channel->transfer == kind;
}

/* Walks over the places in their order and each device's channels: the number-th that counts, PDCP_NONE:
 * there are fewer. number 0: how many there are. */
static uint8_t walk(const pdcp_nodes_t *nodes, uint8_t kind, uint8_t number)
{
    uint8_t count = 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_node_t *node = &nodes->nodes[i];
        if (!counts(node, kind)) {
            continue;
        }
        if (kind == PDCP_COUNTS_DEVICE && ++count == number) {
            return i;
        }
        for (uint8_t c = node->first_channel; c != PDCP_NONE; c = nodes->channels[c].next) {
            if (is_of_kind(&nodes->channels[c], kind) && ++count == number) {
                return c;
            }
        }
    }
    return number == 0 ? count : PDCP_NONE;
}

uint8_t pdcp_nodes_nth(const pdcp_nodes_t *nodes, uint8_t kind, uint8_t number)
{
    return number == 0 ? PDCP_NONE : walk(nodes, kind, number);
}

uint8_t pdcp_nodes_count(const pdcp_nodes_t *nodes, uint8_t kind)
{
    return walk(nodes, kind, 0);
}
