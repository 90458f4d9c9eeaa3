#include "pdcp_device_param.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_bytes.h"
#include "pdcp_codec.h"

/* --- reading --- */

static void value_u8(pdcp_device_value_t *value, uint8_t byte)
{
    value->small[0] = byte;
    value->bytes = value->small;
    value->len = 1;
}

static void value_u16(pdcp_device_value_t *value, uint16_t word)
{
    pdcp_bytes_put_u16(value->small, word);
    value->bytes = value->small;
    value->len = 2;
}

static void value_words(pdcp_device_value_t *value, uint16_t first, uint16_t second)
{
    pdcp_bytes_put_u16(&value->small[0], first);
    pdcp_bytes_put_u16(&value->small[2], second);
    value->bytes = value->small;
    value->len = 4;
}

static void value_u32(pdcp_device_value_t *value, uint32_t number)
{
    value_words(value, (uint16_t)(number & 0xFFFFu), (uint16_t)(number >> 16));
}

static void value_bytes(pdcp_device_value_t *value, const pdcp_device_bytes_t *bytes)
{
    value->bytes = bytes->bytes;
    value->len = bytes->len;
}

/* What the device is. */
static bool get_device_fixed(const pdcp_device_desc_t *desc, uint8_t param, pdcp_device_value_t *value)
{
    switch (param) {
    case PDCP_DEV_VID_PID:
        value_words(value, desc->identity.vid, desc->identity.pid);
        return true;
    case PDCP_DEV_SERIAL:
        value_u16(value, desc->identity.sn);
        return true;
    case PDCP_DEV_EAN13L:
        value_u32(value, desc->ean13_low);
        return true;
    case PDCP_DEV_EAN13H:
        value_u32(value, desc->ean13_high);
        return true;
    case PDCP_DEV_VERSIONS:
        value_words(value, desc->firmware, desc->hardware);
        return true;
    case PDCP_DEV_TYPE_PROFILE:
        value_words(value, desc->type, desc->profile);
        return true;
    case PDCP_DEV_DESCRIPTOR:
        value_bytes(value, &desc->descriptor);
        return true;
    case PDCP_DEV_CHANNELS:
        value_u8(value, desc->channel_count);
        return true;
    default:
        return false;
    }
}

static bool get_device(const pdcp_device_t *dev, uint8_t param, pdcp_device_value_t *value)
{
    switch (param) {
    case PDCP_DEV_NODE_ID:
        value_u8(value, pdcp_device_node_id(dev));
        return true;
    case PDCP_DEV_BEACON_INTERVAL:
        value_u16(value, dev->beacon_ms);
        return true;
    case PDCP_DEV_ACK_TIME:
        value_u16(value, dev->ack_ms);
        return true;
    case PDCP_DEV_BIND_TIMEOUT:
        value_u16(value, dev->bind_ms);
        return true;
    default:
        return get_device_fixed(dev->desc, param, value);
    }
}

static bool get_input(const pdcp_device_t *dev, uint8_t param, uint8_t channel, pdcp_device_value_t *value)
{
    const pdcp_device_source_t *source = pdcp_device_source(dev, channel);
    switch (param) {
    case PDCP_IN_SOURCE_VID_PID:
        value_words(value, source->identity.vid, source->identity.pid);
        return true;
    case PDCP_IN_SOURCE_SERIAL:
        value_words(value, source->identity.sn, source->channel);
        value->len = 3;
        return true;
    case PDCP_IN_SOURCE_NODES:
        value->small[0] = pdcp_device_channel(dev, channel)->source_device;
        value->small[1] = pdcp_device_channel(dev, channel)->source_channel;
        value->bytes = value->small;
        value->len = 2;
        return true;
    case PDCP_IN_SOURCE_TYPE:
        value_words(value, source->type, source->profile);
        return true;
    case PDCP_IN_TERMINAL_PROFILE:
        value_u16(value, dev->desc->channels[channel - 1].terminal_profile);
        return true;
    default:
        return false;
    }
}

static bool get_channel(const pdcp_device_t *dev, uint8_t param, uint8_t channel, pdcp_device_value_t *value)
{
    const pdcp_device_channel_desc_t *desc = &dev->desc->channels[channel - 1];
    switch (param) {
    case PDCP_CH_TYPE_PROFILE:
        value_words(value, desc->type, desc->profile);
        return true;
    case PDCP_CH_DESCRIPTOR:
        value_bytes(value, &desc->descriptor);
        return true;
    case PDCP_CH_TRANSFER_TYPE:
        value_u8(value, desc->direction);
        return true;
    case PDCP_CH_ENABLED:
        value_u8(value, pdcp_device_channel(dev, channel)->enabled ? 1 : 0);
        return true;
    case PDCP_CH_REQUIRED:
        value_bytes(value, &desc->required);
        return true;
    case PDCP_CH_DESIRED:
        value_bytes(value, &desc->desired);
        return true;
    default:
        break;
    }
    if (desc->direction == PDCP_INPUT) {
        return get_input(dev, param, channel, value);
    }
    if (param == PDCP_OUT_NODE_ID) {
        value_u8(value, pdcp_device_channel(dev, channel)->node_id);
        return true;
    }
    return false;
}

static const pdcp_device_extra_t *find_extra(const pdcp_device_t *dev, uint8_t param, uint8_t channel)
{
    for (uint8_t i = 0; i < dev->desc->extra_count; i++) {
        const pdcp_device_extra_t *extra = &dev->desc->extras[i];
        if (extra->param == param && extra->channel == channel) {
            return extra;
        }
    }
    return NULL;
}

bool pdcp_device_param_get(const pdcp_device_t *dev, uint8_t param, uint8_t channel,
                           pdcp_device_value_t *value)
{
    memset(value, 0, sizeof *value);
    const pdcp_device_extra_t *extra = find_extra(dev, param, channel);
    if (extra != NULL) {
        value->bytes = extra->bytes;
        value->len = *extra->len;
        return true;
    }
    if (channel > dev->desc->channel_count) {
        return false;
    }
    return channel == 0 ? get_device(dev, param, value) : get_channel(dev, param, channel, value);
}

/* --- writing --- */

static bool set_word_within(uint16_t *word, uint16_t now, uint16_t min, uint16_t max)
{
    if (now < min || now > max) {
        return false;
    }
    *word = now;
    return true;
}

static bool set_device(pdcp_device_t *dev, uint8_t param, const uint8_t *bytes, uint8_t len)
{
    const uint16_t word = pdcp_bytes_value_u16(bytes, len, 0);
    switch (param) {
    case PDCP_DEV_BEACON_INTERVAL:
        return set_word_within(&dev->beacon_ms, word, PDCP_BEACON_MIN_MS, PDCP_BEACON_MAX_MS);
    case PDCP_DEV_ACK_TIME:
        return set_word_within(&dev->ack_ms, word, PDCP_ACK_MIN_MS, PDCP_ACK_MAX_MS);
    case PDCP_DEV_BIND_TIMEOUT:
        return set_word_within(&dev->bind_ms, word, 1, UINT16_MAX);
    default:
        return false;
    }
}

static void set_enabled(pdcp_device_t *dev, uint8_t channel, bool enabled)
{
    pdcp_device_channel_t *state = &dev->channels[channel - 1];
    const bool stopped = state->enabled && !enabled;
    state->enabled = enabled;
    dev->listen_changes++;
    if (stopped && dev->desc->channels[channel - 1].terminal && dev->port->safe != NULL) {
        dev->port->safe(dev->port->ctx, channel);
    }
}

static bool set_source(pdcp_device_t *dev, uint8_t param, uint8_t channel, const uint8_t *bytes, uint8_t len)
{
    pdcp_device_source_t *source = &dev->record.sources[channel - 1];
    const pdcp_device_source_t before = *source;
    switch (param) {
    case PDCP_IN_SOURCE_VID_PID:
        source->identity.vid = pdcp_bytes_value_u16(bytes, len, 0);
        source->identity.pid = pdcp_bytes_value_u16(bytes, len, 2);
        break;
    case PDCP_IN_SOURCE_SERIAL:
        source->identity.sn = pdcp_bytes_value_u16(bytes, len, 0);
        source->channel = pdcp_bytes_value_u8(bytes, len, 2);
        break;
    case PDCP_IN_SOURCE_TYPE:
        source->type = pdcp_bytes_value_u16(bytes, len, 0);
        source->profile = pdcp_bytes_value_u16(bytes, len, 2);
        break;
    default:
        return false;
    }
    const bool same = pdcp_identity_equal(&before.identity, &source->identity) &&
                      before.channel == source->channel && before.type == source->type &&
                      before.profile == source->profile;
    if (!same && dev->port->store != NULL) {
        dev->port->store(dev->port->ctx, &dev->record);
    }
    if (!pdcp_device_source_connected(source)) {
        dev->channels[channel - 1].asking = false;
    }
    return true;
}

static bool set_source_nodes(pdcp_device_t *dev, uint8_t channel, const uint8_t *bytes, uint8_t len)
{
    const uint8_t device = pdcp_bytes_value_u8(bytes, len, 0);
    const uint8_t output = pdcp_bytes_value_u8(bytes, len, 1);
    if (device > PDCP_NODE_MAX || output > PDCP_NODE_MAX) {
        return false;
    }
    dev->channels[channel - 1].source_device = device;
    dev->channels[channel - 1].source_channel = output;
    dev->listen_changes++;
    return true;
}

static bool set_channel(pdcp_device_t *dev, uint8_t param, uint8_t channel, const uint8_t *bytes, uint8_t len)
{
    if (param == PDCP_CH_ENABLED) {
        set_enabled(dev, channel, pdcp_bytes_value_u8(bytes, len, 0) != 0);
        return true;
    }
    if (dev->desc->channels[channel - 1].direction == PDCP_INPUT) {
        return param == PDCP_IN_SOURCE_NODES ? set_source_nodes(dev, channel, bytes, len)
                                             : set_source(dev, param, channel, bytes, len);
    }
    if (param == PDCP_OUT_NODE_ID && pdcp_bytes_value_u8(bytes, len, 0) <= PDCP_NODE_MAX) {
        dev->channels[channel - 1].node_id = pdcp_bytes_value_u8(bytes, len, 0);
        return true;
    }
    return false;
}

static bool set_extra(pdcp_device_t *dev, const pdcp_device_extra_t *extra, const uint8_t *bytes,
                      uint16_t len)
{
    if (!extra->writable || len > extra->capacity) {
        return false;
    }
    if (len != 0) {
        memcpy(extra->bytes, bytes, len);
    }
    *extra->len = len;
    if (dev->port->written != NULL) {
        dev->port->written(dev->port->ctx, extra->channel, extra->param);
    }
    return true;
}

bool pdcp_device_param_set(pdcp_device_t *dev, uint8_t param, uint8_t channel, const uint8_t *bytes,
                           uint16_t len)
{
    const pdcp_device_extra_t *extra = find_extra(dev, param, channel);
    if (extra != NULL) {
        return set_extra(dev, extra, bytes, len);
    }
    if (channel > dev->desc->channel_count) {
        return false;
    }
    const uint8_t used = (uint8_t)(len < PDCP_VALUE_MAX ? len : PDCP_VALUE_MAX);
    return channel == 0 ? set_device(dev, param, bytes, used) : set_channel(dev, param, channel, bytes, used);
}

static bool writable(const pdcp_device_t *dev, uint8_t param, uint8_t channel)
{
    if (channel > dev->desc->channel_count) {
        return false;
    }
    if (channel == 0) {
        return param >= PDCP_DEV_BEACON_INTERVAL && param <= PDCP_DEV_BIND_TIMEOUT;
    }
    if (dev->desc->channels[channel - 1].direction == PDCP_INPUT) {
        return param >= PDCP_CH_ENABLED && param <= PDCP_IN_SOURCE_TYPE;
    }
    return param == PDCP_CH_ENABLED || param == PDCP_OUT_NODE_ID;
}

uint16_t pdcp_device_param_capacity(const pdcp_device_t *dev, uint8_t param, uint8_t channel)
{
    const pdcp_device_extra_t *extra = find_extra(dev, param, channel);
    if (extra != NULL) {
        return extra->writable ? extra->capacity : 0;
    }
    return writable(dev, param, channel) ? UINT16_MAX : 0; /* bytes behind the field are ignored */
}

static uint16_t or_default(uint16_t word, uint16_t without)
{
    return word != 0 ? word : without;
}

void pdcp_device_param_reset(pdcp_device_t *dev)
{
    memset(dev->channels, 0, sizeof dev->channels);
    dev->listen_changes++;
    dev->beacon_ms = or_default(dev->desc->beacon_ms, PDCP_BEACON_MS);
    dev->ack_ms = or_default(dev->desc->ack_ms, PDCP_ACK_MS);
    dev->bind_ms = or_default(dev->desc->bind_ms, PDCP_BIND_TIMEOUT_MS);
}
