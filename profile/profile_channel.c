#include "profile_channel.h"

#include "profile_type.h"

bool profile_channel_is_sole(const pdcp_channel_t *channel)
{
    return (channel->type & PROFILE_TYPE_SOLE) != 0;
}

bool profile_channel_is_terminal(const pdcp_channel_t *channel)
{
    return (channel->type & PROFILE_TYPE_TERMINAL) != 0;
}

/* The terminal profile gives the priority, or else the profile (D-PRO-3). */
uint16_t profile_channel_priority(const pdcp_channel_t *channel)
{
    return channel->terminal_profile != 0 ? channel->terminal_profile : channel->profile;
}

bool profile_channel_is_ready(const pdcp_tables_t *tables, uint8_t channel, uint8_t transfer)
{
    if (channel == PDCP_NONE) {
        return false;
    }
    const pdcp_channel_t *entry = &tables->channels[channel];
    return entry->transfer == transfer && /* a free entry of the pool has none */
           tables->devices[entry->place].state == PDCP_PLACE_READY;
}

uint8_t profile_channel_source(const pdcp_tables_t *tables, uint8_t input)
{
    const pdcp_channel_t *channel = &tables->channels[input];
    return channel->link == PDCP_LINK_ACTIVE && profile_channel_is_ready(tables, input, PDCP_INPUT)
               ? channel->source.channel
               : PDCP_NONE;
}

bool profile_channel_breaks_sole_access(const pdcp_tables_t *tables, uint8_t output, uint8_t input)
{
    if (!profile_channel_is_sole(&tables->channels[input])) {
        return false;
    }
    const pdcp_channel_t *channel = tables->channels;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++, channel++) {
        if (i != input && profile_channel_source(tables, i) == output && profile_channel_is_sole(channel)) {
            return true;
        }
    }
    return false;
}

void profile_channel_end(const pdcp_tables_t *tables, uint8_t channel, profile_end_t *end)
{
    const pdcp_channel_t *entry = &tables->channels[channel];
    const pdcp_device_entry_t *device = &tables->devices[entry->place];
    end->owner = device->identity;
    end->owner_type = device->type;
    end->owner_profile = device->profile;
    end->type = entry->type;
    end->profile = entry->profile;
    end->index = entry->index;
}

bool profile_channel_named_source(const pdcp_tables_t *tables, uint8_t input, profile_end_t *end)
{
    const pdcp_channel_t *entry = &tables->channels[input];
    if (entry->source.index == PDCP_NO_SOURCE_INDEX || entry->source.index == 0) {
        return false;
    }
    const uint8_t place = pdcp_tables_find(tables, &entry->source.identity);
    end->owner = entry->source.identity;
    end->owner_type = 0;
    end->owner_profile = 0;
    if (place != PDCP_NONE) {
        const pdcp_device_entry_t *owner = &tables->devices[place];
        end->owner_type = owner->type;
        end->owner_profile = owner->profile;
    }
    end->type = entry->source.type;
    end->profile = entry->source.profile;
    end->index = entry->source.index;
    return true;
}
