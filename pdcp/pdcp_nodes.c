#include "pdcp_nodes.h"

#include <string.h>

/* Makes a place free. */
static void clear_place(pdcp_nodes_t *nodes, uint8_t place)
{
    pdcp_node_t *node = &nodes->nodes[place];
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
        clear_place(nodes, i);
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

static uint8_t free_place(const pdcp_nodes_t *nodes)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (nodes->nodes[i].state == PDCP_NODE_FREE) {
            return i;
        }
    }
    return PDCP_NONE;
}

bool pdcp_nodes_has_place(const pdcp_nodes_t *nodes)
{
    return free_place(nodes) != PDCP_NONE;
}

uint8_t pdcp_nodes_add(pdcp_nodes_t *nodes, const pdcp_identity_t *identity, uint8_t node_id)
{
    const uint8_t place = free_place(nodes);
    if (place == PDCP_NONE) {
        return PDCP_NONE;
    }
    pdcp_node_t *node = &nodes->nodes[place];
    node->state = PDCP_NODE_SETUP;
    node->identity = *identity;
    node->node_id = node_id;
    node->beacon_ms = PDCP_BEACON_MS;
    node->ack_ms = PDCP_ACK_MS;
    nodes->owner[node_id] = (uint8_t)(place + 1);
    return place;
}

static void drop_needs(pdcp_nodes_t *nodes, uint8_t node)
{
    pdcp_node_t *gone = &nodes->nodes[node];
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

void pdcp_nodes_set_output_id(pdcp_nodes_t *nodes, uint8_t channel, uint8_t node_id)
{
    pdcp_channel_t *output = &nodes->channels[channel];
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
        if (nodes->channels[i].feed == channel) {
            nodes->channels[i].feed = PDCP_NONE;
        }
    }
}

static void free_channel(pdcp_nodes_t *nodes, uint8_t channel)
{
    pdcp_nodes_set_output_id(nodes, channel, 0);
    memset(&nodes->channels[channel], 0, sizeof nodes->channels[channel]);
    nodes->channels[channel].node = PDCP_NONE;
    pdcp_nodes_drop_feed(nodes, channel);
}

/* Frees the channels of a device from the one with index count + 1 on. */
static void cut_channels(pdcp_nodes_t *nodes, uint8_t node, uint8_t count)
{
    uint8_t *link = &nodes->nodes[node].first_channel;
    while (*link != PDCP_NONE && nodes->channels[*link].index <= count) {
        link = &nodes->channels[*link].next;
    }
    uint8_t channel = *link;
    *link = PDCP_NONE;
    while (channel != PDCP_NONE) {
        const uint8_t next = nodes->channels[channel].next;
        free_channel(nodes, channel);
        channel = next;
    }
}

void pdcp_nodes_remove(pdcp_nodes_t *nodes, uint8_t node)
{
    drop_needs(nodes, node);
    cut_channels(nodes, node, 0);
    nodes->owner[nodes->nodes[node].node_id] = 0;
    clear_place(nodes, node);
}

static uint8_t free_channels(const pdcp_nodes_t *nodes)
{
    uint8_t count = 0;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (nodes->channels[i].node == PDCP_NONE) {
            count++;
        }
    }
    return count;
}

void pdcp_nodes_clear_source(pdcp_channel_t *input)
{
    input->source.vid = PDCP_NO_SOURCE_WORD;
    input->source.pid = PDCP_NO_SOURCE_WORD;
    input->source.sn = PDCP_NO_SOURCE_WORD;
    input->source_index = PDCP_NO_SOURCE_INDEX;
    input->source_type = 0;
    input->source_profile = 0;
}

void pdcp_nodes_take_source(pdcp_channel_t *input, uint8_t param, uint16_t low, uint16_t high)
{
    if (param == PDCP_IN_SOURCE_VID_PID) {
        input->source.vid = low;
        input->source.pid = high;
    } else if (param == PDCP_IN_SOURCE_SERIAL) {
        input->source.sn = low;
        input->source_index = (uint8_t)(high & 0xFFu);
    } else {
        input->source_type = low;
        input->source_profile = high;
    }
}

/* The first free one from number i on. */
static uint8_t take_channel(pdcp_nodes_t *nodes, uint8_t node, uint8_t index, uint8_t i)
{
    while (nodes->channels[i].node != PDCP_NONE) {
        i++;
    }
    pdcp_channel_t *channel = &nodes->channels[i];
    memset(channel, 0, sizeof *channel);
    channel->node = node;
    channel->index = index;
    channel->next = PDCP_NONE;
    channel->feed = PDCP_NONE;
    pdcp_nodes_clear_source(channel);
    return i;
}

bool pdcp_nodes_set_channels(pdcp_nodes_t *nodes, uint8_t node, uint8_t count)
{
    pdcp_node_t *owner = &nodes->nodes[node];
    if (count > owner->channel_count && count - owner->channel_count > free_channels(nodes)) {
        return false;
    }
    drop_needs(nodes, node);
    cut_channels(nodes, node, count);
    uint8_t *link = &owner->first_channel;
    uint8_t from = 0;
    for (uint16_t index = 1; index <= count; index++) {
        if (*link == PDCP_NONE) {
            *link = take_channel(nodes, node, (uint8_t)index, from);
            from = *link;
        }
        link = &nodes->channels[*link].next;
    }
    owner->channel_count = count;
    return true;
}

uint8_t pdcp_nodes_channel(const pdcp_nodes_t *nodes, uint8_t node, uint8_t index)
{
    uint8_t channel = nodes->nodes[node].first_channel;
    while (channel != PDCP_NONE && nodes->channels[channel].index != index) {
        channel = nodes->channels[channel].next;
    }
    return channel;
}

bool pdcp_nodes_make_needs(pdcp_nodes_t *nodes, uint8_t node)
{
    pdcp_node_t *owner = &nodes->nodes[node];
    uint16_t inputs = 0;
    for (uint8_t c = owner->first_channel; c != PDCP_NONE; c = nodes->channels[c].next) {
        inputs = (uint16_t)(inputs + (nodes->channels[c].transfer == PDCP_INPUT ? 1u : 0u));
    }
    drop_needs(nodes, node);
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

/* Where the bit of the input with this index stands in a set of its device; 8 * stride or more: it is no
 * input. */
static uint16_t need_bit(const pdcp_nodes_t *nodes, uint8_t node, uint8_t index)
{
    uint16_t bit = 0;
    for (uint8_t c = nodes->nodes[node].first_channel; c != PDCP_NONE; c = nodes->channels[c].next) {
        const bool is_input = nodes->channels[c].transfer == PDCP_INPUT;
        if (nodes->channels[c].index == index) {
            return is_input ? bit : 0xFFFFu;
        }
        bit = (uint16_t)(bit + (is_input ? 1u : 0u));
    }
    return 0xFFFFu;
}

static uint16_t set_at(const pdcp_nodes_t *nodes, uint8_t channel, bool desired)
{
    const pdcp_node_t *owner = &nodes->nodes[nodes->channels[channel].node];
    const uint16_t set = (uint16_t)(2u * (nodes->channels[channel].index - 1u) + (desired ? 1u : 0u));
    return (uint16_t)(owner->needs_at + set * owner->needs_stride);
}

void pdcp_nodes_put_needs(pdcp_nodes_t *nodes, uint8_t channel, bool desired, uint16_t offset,
                          const uint8_t *bytes, uint16_t len)
{
    const uint8_t node = nodes->channels[channel].node;
    const uint16_t bits = (uint16_t)(8u * nodes->nodes[node].needs_stride);
    uint8_t *set = &nodes->needs[set_at(nodes, channel, desired)];
    for (uint16_t i = 0; i < len && offset + i < 32; i++) {
        for (uint8_t b = 0; b < 8; b++) {
            const uint8_t index = (uint8_t)(8u * (offset + i) + b);
            const uint16_t bit = need_bit(nodes, node, index);
            if ((bytes[i] & (0x80u >> b)) != 0 && bit < bits) {
                set[bit / 8] = (uint8_t)(set[bit / 8] | (0x80u >> (bit % 8)));
            }
        }
    }
}

bool pdcp_nodes_needs(const pdcp_nodes_t *nodes, uint8_t channel, bool desired, uint8_t index)
{
    const uint8_t node = nodes->channels[channel].node;
    const uint16_t bit = need_bit(nodes, node, index);
    if (bit >= 8u * nodes->nodes[node].needs_stride) {
        return false;
    }
    return (nodes->needs[set_at(nodes, channel, desired) + bit / 8] & (0x80u >> (bit % 8))) != 0;
}

/* Walks over the devices that count: returns the number-th and, in *count, how many there were up to it. */
static uint8_t walk_devices(const pdcp_nodes_t *nodes, uint8_t number, uint8_t *count)
{
    *count = 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (pdcp_nodes_device_counts(&nodes->nodes[i]) && ++*count == number) {
            return i;
        }
    }
    return PDCP_NONE;
}

uint8_t pdcp_nodes_nth_device(const pdcp_nodes_t *nodes, uint8_t number)
{
    uint8_t count;
    return walk_devices(nodes, number, &count);
}

uint8_t pdcp_nodes_count_devices(const pdcp_nodes_t *nodes)
{
    uint8_t count;
    (void)walk_devices(nodes, 0, &count);
    return count;
}

/* Links do not have a direction: 0 stands for them. */
static bool channel_counts(const pdcp_nodes_t *nodes, const pdcp_channel_t *channel, uint8_t transfer)
{
    const pdcp_node_t *owner = &nodes->nodes[channel->node];
    if (transfer == 0) {
        return channel->link != PDCP_LINK_NONE;
    }
    return owner->beaconed && owner->state == PDCP_NODE_READY && channel->transfer == transfer;
}

static uint8_t walk_channels(const pdcp_nodes_t *nodes, uint8_t transfer, uint8_t number, uint8_t *count)
{
    *count = 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        for (uint8_t c = nodes->nodes[i].first_channel; c != PDCP_NONE; c = nodes->channels[c].next) {
            if (channel_counts(nodes, &nodes->channels[c], transfer) && ++*count == number) {
                return c;
            }
        }
    }
    return PDCP_NONE;
}

uint8_t pdcp_nodes_nth_channel(const pdcp_nodes_t *nodes, uint8_t transfer, uint8_t number)
{
    uint8_t count;
    return walk_channels(nodes, transfer, number, &count);
}

uint8_t pdcp_nodes_count_channels(const pdcp_nodes_t *nodes, uint8_t transfer)
{
    uint8_t count;
    (void)walk_channels(nodes, transfer, 0, &count);
    return count;
}

uint8_t pdcp_nodes_nth_link(const pdcp_nodes_t *nodes, uint8_t number)
{
    return pdcp_nodes_nth_channel(nodes, 0, number);
}

uint8_t pdcp_nodes_count_links(const pdcp_nodes_t *nodes)
{
    return pdcp_nodes_count_channels(nodes, 0);
}
