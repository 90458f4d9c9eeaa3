#include "pdcp_tables.h"

#include <string.h>

#include "pdcp_assert.h"
#include "pdcp_bytes.h"
#include "pdcp_codec.h"

/* Makes a place free. */
static void clear_place(pdcp_device_entry_t *device, uint8_t place)
{
    memset(device, 0, sizeof *device);
    device->place = place;
    device->first_channel = PDCP_NONE;
}

void pdcp_tables_init(pdcp_tables_t *tables)
{
    memset(tables, 0, sizeof *tables);
    for (uint16_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        tables->channels[i].place = PDCP_NONE;
    }
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        clear_place(&tables->devices[i], i);
    }
}

uint8_t pdcp_tables_find(const pdcp_tables_t *tables, const pdcp_identity_t *identity)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_device_entry_t *device = &tables->devices[i];
        if (device->state != PDCP_PLACE_FREE && pdcp_identity_equal(&device->identity, identity)) {
            return i;
        }
    }
    return PDCP_NONE;
}

uint8_t pdcp_tables_free_place(const pdcp_tables_t *tables)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (tables->devices[i].state == PDCP_PLACE_FREE) {
            return i;
        }
    }
    return PDCP_NONE;
}

void pdcp_tables_add(pdcp_tables_t *tables, uint8_t place, const pdcp_identity_t *identity, uint8_t node_id)
{
    pdcp_device_entry_t *device = &tables->devices[place];
    pdcp_assert(device->state == PDCP_PLACE_FREE, "pdcp_tables.h: the place is free");
    pdcp_assert(tables->owner[node_id] == 0, "pdcp_tables.h: the node id is free");
    device->state = PDCP_PLACE_SETUP;
    device->identity = *identity;
    device->node_id = node_id;
    tables->owner[node_id] = (uint8_t)(place + 1);
}

void pdcp_tables_hold(pdcp_tables_t *tables, uint8_t place, const pdcp_identity_t *identity)
{
    pdcp_assert(tables->devices[place].state == PDCP_PLACE_FREE, "pdcp_tables.h: the place is free");
    tables->devices[place].state = PDCP_PLACE_ASKED;
    tables->devices[place].identity = *identity;
}

bool pdcp_tables_is_bound(const pdcp_tables_t *tables, uint8_t place)
{
    if (place >= PDCP_DEVICES_MAX) {
        return false;
    }
    const uint8_t state = tables->devices[place].state;
    return state != PDCP_PLACE_FREE && state != PDCP_PLACE_LOST && state != PDCP_PLACE_ASKED;
}

uint8_t pdcp_tables_count_state(const pdcp_tables_t *tables, pdcp_place_state_t state)
{
    uint8_t places = 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        places = (uint8_t)(places + (tables->devices[i].state == (uint8_t)state));
    }
    return places;
}

static void drop_needs(pdcp_tables_t *tables, pdcp_device_entry_t *gone)
{
    const uint16_t size = (uint16_t)(2u * gone->needs_stride * gone->channel_count);
    if (size == 0) {
        return;
    }
    const uint16_t end = (uint16_t)(gone->needs_at + size);
    memmove(&tables->needs[gone->needs_at], &tables->needs[end], (size_t)(tables->needs_used - end));
    tables->needs_used = (uint16_t)(tables->needs_used - size);
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (tables->devices[i].needs_at > gone->needs_at) {
            tables->devices[i].needs_at = (uint16_t)(tables->devices[i].needs_at - size);
        }
    }
    gone->needs_stride = 0;
    gone->needs_at = 0;
}

void pdcp_tables_set_output_id(pdcp_tables_t *tables, pdcp_channel_t *output, uint8_t node_id)
{
    pdcp_assert(node_id == 0 || node_id == output->node_id || tables->owner[node_id] == 0,
                "pdcp_tables.h: the node id is free");
    if (output->node_id != 0) {
        tables->owner[output->node_id] = 0;
    }
    output->node_id = node_id;
    if (node_id != 0) {
        tables->owner[node_id] = (uint8_t)(0x80u | (uint8_t)(output->place + 1u));
    }
}

void pdcp_tables_drop_source(pdcp_tables_t *tables, uint8_t channel)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (tables->channels[i].source.channel == channel) {
            tables->channels[i].source.channel = PDCP_NONE;
        }
    }
}

/* Frees the channels of a device from the one with index count + 1 on. */
static void cut_channels(pdcp_tables_t *tables, pdcp_device_entry_t *owner, uint8_t count)
{
    uint8_t *link = &owner->first_channel;
    while (*link != PDCP_NONE) {
        const uint8_t number = *link;
        pdcp_channel_t *channel = &tables->channels[number];
        if (channel->index <= count) {
            link = &channel->next;
        } else {
            *link = channel->next;
            if (channel->transfer == PDCP_OUTPUT) {
                pdcp_tables_set_output_id(tables, channel, 0);
            }
            memset(channel, 0, sizeof *channel);
            channel->place = PDCP_NONE;
            pdcp_tables_drop_source(tables, number);
        }
    }
}

void pdcp_tables_remove(pdcp_tables_t *tables, uint8_t place)
{
    pdcp_device_entry_t *gone = &tables->devices[place];
    drop_needs(tables, gone);
    cut_channels(tables, gone, 0);
    tables->owner[gone->node_id] = 0;
    clear_place(gone, place);
}

/* The input is unconnected (D-BUS-7). */
void pdcp_tables_clear_source(pdcp_channel_t *input)
{
    input->source.identity.vid = PDCP_NO_SOURCE_WORD;
    input->source.identity.pid = PDCP_NO_SOURCE_WORD;
    input->source.identity.sn = PDCP_NO_SOURCE_WORD;
    input->source.index = PDCP_NO_SOURCE_INDEX;
    input->source.type = 0;
    input->source.profile = 0;
}

void pdcp_tables_take_source(pdcp_channel_t *input, uint8_t param, uint16_t low, uint16_t high)
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

bool pdcp_tables_is_source(const pdcp_channel_t *input, uint8_t param, uint16_t low, uint16_t high)
{
    if (param == PDCP_IN_SOURCE_VID_PID) {
        return input->source.identity.vid == low && input->source.identity.pid == high;
    }
    if (param == PDCP_IN_SOURCE_SERIAL) {
        return input->source.identity.sn == low && input->source.index == (uint8_t)(high & 0xFFu);
    }
    return input->source.type == low && input->source.profile == high;
}

/* Makes a free entry of the pool, which is all 0 but for its place, a channel that nothing is known of. */
static void make_channel(pdcp_channel_t *channel, uint8_t place, uint16_t index)
{
    channel->place = place;
    channel->index = (uint8_t)index;
    channel->next = PDCP_NONE;
    channel->source.channel = PDCP_NONE;
    pdcp_tables_clear_source(channel);
}

/* Gives a device what it lacks of count channels. False: the pool is used up. */
static bool append_channels(pdcp_tables_t *tables, pdcp_device_entry_t *owner, uint8_t count)
{
    uint8_t *link = &owner->first_channel;
    while (*link != PDCP_NONE) {
        link = &tables->channels[*link].next;
    }
    uint16_t index = owner->channel_count + 1u;
    for (uint8_t i = 0; index <= count && i < PDCP_CHANNELS_MAX; i++) {
        pdcp_channel_t *channel = &tables->channels[i];
        if (channel->place == PDCP_NONE) {
            make_channel(channel, owner->place, index);
            *link = i;
            link = &channel->next;
            index++;
        }
    }
    return index > count;
}

bool pdcp_tables_set_channels(pdcp_tables_t *tables, uint8_t place, uint8_t count)
{
    pdcp_device_entry_t *owner = &tables->devices[place];
    const bool fits = append_channels(tables, owner, count);
    if (fits) {
        drop_needs(tables, owner);
        owner->channel_count = count;
    }
    cut_channels(tables, owner, owner->channel_count);
    return fits;
}

uint8_t pdcp_tables_channel(const pdcp_tables_t *tables, uint8_t place, uint8_t index)
{
    uint8_t channel = tables->devices[place].first_channel;
    while (channel != PDCP_NONE && tables->channels[channel].index != index) {
        channel = tables->channels[channel].next;
    }
    return channel;
}

bool pdcp_tables_may_hear(const pdcp_tables_t *tables, uint8_t node_id)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (tables->channels[i].node_id == node_id && tables->channels[i].transfer == PDCP_INPUT) {
            return true;
        }
    }
    return false;
}

uint8_t pdcp_tables_output(const pdcp_tables_t *tables, uint8_t place, uint8_t node_id)
{
    uint8_t channel = tables->devices[place].first_channel;
    while (channel != PDCP_NONE && (tables->channels[channel].node_id != node_id ||
                                    tables->channels[channel].transfer != PDCP_OUTPUT)) {
        channel = tables->channels[channel].next;
    }
    return channel;
}

bool pdcp_tables_make_needs(pdcp_tables_t *tables, uint8_t place)
{
    pdcp_device_entry_t *owner = &tables->devices[place];
    uint16_t inputs = 0;
    for (uint8_t c = owner->first_channel; c != PDCP_NONE; c = tables->channels[c].next) {
        if (tables->channels[c].transfer == PDCP_INPUT) {
            inputs++;
        }
    }
    drop_needs(tables, owner);
    const uint16_t stride = (uint16_t)((inputs + 7u) / 8u);
    const uint16_t size = (uint16_t)(2u * stride * owner->channel_count);
    if (size > PDCP_NEEDS_BYTES - tables->needs_used) {
        return false;
    }
    owner->needs_at = tables->needs_used;
    owner->needs_stride = (uint8_t)stride;
    memset(&tables->needs[tables->needs_used], 0, size);
    tables->needs_used = (uint16_t)(tables->needs_used + size);
    return true;
}

/* Where the channel's set of required or desired inputs begins. */
static uint16_t set_at(const pdcp_device_entry_t *owner, const pdcp_channel_t *channel, bool desired)
{
    const uint16_t set = (uint16_t)(2u * (channel->index - 1u) + (desired ? 1u : 0u));
    return (uint16_t)(owner->needs_at + set * owner->needs_stride);
}

/* Bit strings begin with the most significant bit (D-BUS-8). */
static uint8_t mask_of(uint16_t bit)
{
    return (uint8_t)(0x80u >> (bit % 8u));
}

/* The bits of the device's inputs are packed together; all others are dropped (D-BUS-13). */
void pdcp_tables_put_needs(pdcp_tables_t *tables, uint8_t channel, bool desired, uint16_t offset,
                           const uint8_t *bytes, uint16_t len)
{
    const pdcp_channel_t *needing = &tables->channels[channel];
    const pdcp_device_entry_t *owner = &tables->devices[needing->place];
    uint8_t *set = &tables->needs[set_at(owner, needing, desired)];
    uint16_t bit = 0; /* of an input in a set of its device */
    for (uint8_t c = owner->first_channel; c != PDCP_NONE; c = tables->channels[c].next) {
        const pdcp_channel_t *input = &tables->channels[c];
        if (input->transfer == PDCP_INPUT) {
            const uint16_t from = (uint16_t)(input->index - 8u * offset); /* large before the offset */
            if (from / 8u < len && (bytes[from / 8u] & mask_of(from)) != 0) {
                set[bit / 8u] |= mask_of(bit);
            }
            bit++;
        }
    }
}

bool pdcp_tables_needs(const pdcp_tables_t *tables, uint8_t channel, bool desired, uint8_t index)
{
    const pdcp_channel_t *needing = &tables->channels[channel];
    const pdcp_device_entry_t *owner = &tables->devices[needing->place];
    pdcp_assert(owner->needs_stride != 0, "pdcp_tables.h: the device has room for needs");
    const uint8_t *set = &tables->needs[set_at(owner, needing, desired)];
    uint16_t bit = 0;
    for (uint8_t c = owner->first_channel; c != PDCP_NONE; c = tables->channels[c].next) {
        const pdcp_channel_t *input = &tables->channels[c];
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
static uint8_t link_to(const pdcp_tables_t *tables, const pdcp_channel_t *input, uint8_t output)
{
    const pdcp_channel_t *source = &tables->channels[output];
    if (input->source.index != source->index ||
        !pdcp_identity_equal(&input->source.identity, &tables->devices[source->place].identity)) {
        return PDCP_LINK_NONE;
    }
    return input->link;
}

/* An inactive link counts as well, but less than an active one (D-API-13). */
uint8_t pdcp_tables_rival(const pdcp_tables_t *tables, uint8_t output, uint8_t input)
{
    const pdcp_channel_t *asked = &tables->channels[input];
    pdcp_assert(asked->place != tables->channels[output].place,
                "pdcp_tables.h: the input is another device's");
    const uint8_t own = link_to(tables, asked, output);
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *other = &tables->channels[i];
        if (other != asked && (other->type & asked->type & PDCP_TYPE_SOLE) != 0 &&
            link_to(tables, other, output) > own) {
            return i;
        }
    }
    return PDCP_NONE;
}

/* Does this device, or do its channels, count for the host? A device counts from its first beacon, its
 * channels from the end of its setup (D-API-6), and links whatever becomes of their devices. */
static bool counts(const pdcp_device_entry_t *device, uint8_t kind)
{
    if (kind == PDCP_COUNTS_LINK) {
        return true;
    }
    return device->beaconed && (kind == PDCP_COUNTS_DEVICE ? device->state != PDCP_PLACE_LOST
                                                           : device->state == PDCP_PLACE_READY);
}

static bool is_of_kind(const pdcp_channel_t *channel, uint8_t kind)
{
    return kind == PDCP_COUNTS_LINK ? channel->link != PDCP_LINK_NONE : channel->transfer == kind;
}

/* Walks over the places in their order and each device's channels: the number-th that counts, PDCP_NONE:
 * there are fewer. number 0: how many there are. */
static uint8_t walk(const pdcp_tables_t *tables, uint8_t kind, uint8_t number)
{
    uint8_t count = 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_device_entry_t *device = &tables->devices[i];
        if (!counts(device, kind)) {
            continue;
        }
        if (kind == PDCP_COUNTS_DEVICE && ++count == number) {
            return i;
        }
        for (uint8_t c = device->first_channel; c != PDCP_NONE; c = tables->channels[c].next) {
            if (is_of_kind(&tables->channels[c], kind) && ++count == number) {
                return c;
            }
        }
    }
    return number == 0 ? count : PDCP_NONE;
}

uint8_t pdcp_tables_nth(const pdcp_tables_t *tables, uint8_t kind, uint8_t number)
{
    return number == 0 ? PDCP_NONE : walk(tables, kind, number);
}

uint8_t pdcp_tables_count(const pdcp_tables_t *tables, uint8_t kind)
{
    return walk(tables, kind, 0);
}
