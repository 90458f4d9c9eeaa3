#include "profile_tlv.h"

#include <stddef.h>
#include <string.h>

/* What has been declared: bits of state. */
enum {
    TLV_CONFIGURATIONS = 0x01, /* code 1 */
    TLV_LINKS = 0x02,          /* code 3 of this configuration */
    TLV_IN_LINK = 0x04,
    TLV_HAS_INPUT = 0x08, /* codes 5 and 6 of this link */
    TLV_HAS_OUTPUT = 0x10,
    TLV_AT_INPUT = 0x20, /* which of the two values belong to */
    TLV_AT_OUTPUT = 0x40,
    TLV_OF_LINK = TLV_IN_LINK | TLV_HAS_INPUT | TLV_HAS_OUTPUT | TLV_AT_INPUT | TLV_AT_OUTPUT
};

void profile_tlv_init(profile_tlv_t *reader, const profile_tlv_sink_t *sink, void *ctx)
{
    memset(reader, 0, sizeof *reader);
    reader->sink = sink;
    reader->ctx = ctx;
}

static void add_to_set(uint8_t set[PROFILE_TLV_SET_BYTES], uint8_t number)
{
    set[number / 8u] = (uint8_t)(set[number / 8u] | (1u << (number % 8u)));
}

static void end_link(profile_tlv_t *reader)
{
    if ((reader->state & TLV_IN_LINK) == 0) {
        return;
    }
    if (reader->sink != NULL && reader->sink->on_link != NULL) {
        reader->sink->on_link(reader->ctx, reader->number, &reader->link);
    }
    reader->state = (uint8_t)(reader->state & ~(unsigned)TLV_OF_LINK);
}

static profile_tlv_status_t end_configuration(profile_tlv_t *reader)
{
    end_link(reader);
    return reader->links_told == reader->links_read ? PROFILE_TLV_MORE : PROFILE_TLV_ERR_COUNT;
}

static profile_tlv_status_t read_configurations(profile_tlv_t *reader, uint16_t value)
{
    if (reader->number != 0) {
        return PROFILE_TLV_ERR_PLACE;
    }
    if ((reader->state & TLV_CONFIGURATIONS) != 0) {
        return PROFILE_TLV_ERR_TWICE;
    }
    reader->state |= TLV_CONFIGURATIONS;
    reader->configurations_told = value;
    return PROFILE_TLV_MORE;
}

static profile_tlv_status_t begin_configuration(profile_tlv_t *reader, uint16_t value)
{
    const profile_tlv_status_t status = end_configuration(reader);
    if (status != PROFILE_TLV_MORE) {
        return status;
    }
    if (value == 0 || value > 0xFFu) {
        return PROFILE_TLV_ERR_RANGE;
    }
    const uint8_t number = (uint8_t)value;
    if (profile_tlv_has(reader->numbers, number)) {
        return PROFILE_TLV_ERR_TWICE;
    }
    add_to_set(reader->numbers, number);
    memset(reader->links, 0, sizeof reader->links);
    reader->state = (uint8_t)(reader->state & ~(unsigned)TLV_LINKS);
    reader->links_told = 0;
    reader->links_read = 0;
    reader->number = number;
    reader->configurations_read++;
    if (reader->sink != NULL && reader->sink->on_configuration != NULL) {
        reader->sink->on_configuration(reader->ctx, number);
    }
    return PROFILE_TLV_MORE;
}

static profile_tlv_status_t read_links(profile_tlv_t *reader, uint16_t value)
{
    if (reader->number == 0) {
        return PROFILE_TLV_ERR_PLACE;
    }
    if ((reader->state & TLV_LINKS) != 0) {
        return PROFILE_TLV_ERR_TWICE;
    }
    reader->state |= TLV_LINKS;
    reader->links_told = value;
    return PROFILE_TLV_MORE;
}

static profile_tlv_status_t begin_link(profile_tlv_t *reader, uint16_t value)
{
    end_link(reader);
    if (reader->number == 0) {
        return PROFILE_TLV_ERR_PLACE;
    }
    if (value > 0xFFu) {
        return PROFILE_TLV_ERR_RANGE;
    }
    if (profile_tlv_has(reader->links, (uint8_t)value)) {
        return PROFILE_TLV_ERR_TWICE;
    }
    add_to_set(reader->links, (uint8_t)value);
    reader->links_read++;
    reader->state |= TLV_IN_LINK;
    memset(&reader->link, 0, sizeof reader->link);
    return PROFILE_TLV_MORE;
}

static profile_tlv_status_t begin_end(profile_tlv_t *reader, uint8_t has, uint8_t at)
{
    if ((reader->state & TLV_IN_LINK) == 0) {
        return PROFILE_TLV_ERR_PLACE;
    }
    if ((reader->state & has) != 0) {
        return PROFILE_TLV_ERR_TWICE;
    }
    const unsigned before = reader->state & ~(unsigned)(TLV_AT_INPUT | TLV_AT_OUTPUT);
    reader->state = (uint8_t)(before | has | at);
    return PROFILE_TLV_MORE;
}

/* The 16-bit values of a channel; the index is none of them. */
static uint16_t *end_field(profile_end_t *end, uint8_t code)
{
    switch (code) {
    case PROFILE_TLV_TYPE:
        return &end->type;
    case PROFILE_TLV_PROFILE:
        return &end->profile;
    case PROFILE_TLV_VID:
        return &end->owner.vid;
    case PROFILE_TLV_PID:
        return &end->owner.pid;
    case PROFILE_TLV_SN:
        return &end->owner.sn;
    case PROFILE_TLV_OWNER_TYPE:
        return &end->owner_type;
    default:
        return &end->owner_profile;
    }
}

static profile_tlv_status_t read_value(profile_tlv_t *reader, uint8_t code, uint16_t value)
{
    if ((reader->state & (TLV_AT_INPUT | TLV_AT_OUTPUT)) == 0) {
        return PROFILE_TLV_ERR_PLACE;
    }
    profile_end_t *end = (reader->state & TLV_AT_INPUT) != 0 ? &reader->link.input : &reader->link.output;
    if (code != PROFILE_TLV_INDEX) {
        *end_field(end, code) = value;
        return PROFILE_TLV_MORE;
    }
    end->index = (uint8_t)(value & 0xFFu);
    return value > 0xFFu ? PROFILE_TLV_ERR_RANGE : PROFILE_TLV_MORE;
}

static profile_tlv_status_t end_string(profile_tlv_t *reader)
{
    const profile_tlv_status_t status = end_configuration(reader);
    if (status != PROFILE_TLV_MORE) {
        return status;
    }
    return reader->configurations_told == reader->configurations_read ? PROFILE_TLV_DONE
                                                                      : PROFILE_TLV_ERR_COUNT;
}

static profile_tlv_status_t read_entry(profile_tlv_t *reader, uint8_t code, uint16_t value)
{
    switch (code) {
    case PROFILE_TLV_CONFIGURATIONS:
        return read_configurations(reader, value);
    case PROFILE_TLV_CONFIGURATION:
        return begin_configuration(reader, value);
    case PROFILE_TLV_LINKS:
        return read_links(reader, value);
    case PROFILE_TLV_LINK:
        return begin_link(reader, value);
    case PROFILE_TLV_INPUT:
        return begin_end(reader, TLV_HAS_INPUT, TLV_AT_INPUT);
    case PROFILE_TLV_OUTPUT:
        return begin_end(reader, TLV_HAS_OUTPUT, TLV_AT_OUTPUT);
    case PROFILE_TLV_END:
        return end_string(reader);
    default:
        return code >= PROFILE_TLV_TYPE && code <= PROFILE_TLV_OWNER_PROFILE ? read_value(reader, code, value)
                                                                             : PROFILE_TLV_MORE;
    }
}

profile_tlv_status_t profile_tlv_read(profile_tlv_t *reader, const uint8_t *bytes, uint16_t len)
{
    for (uint16_t i = 0; i < len && reader->status == PROFILE_TLV_MORE; i++) {
        if (reader->have < PROFILE_TLV_ENTRY_BYTES - 1) {
            reader->entry[reader->have++] = bytes[i];
        } else {
            reader->have = 0;
            const uint16_t value = (uint16_t)(reader->entry[1] | (uint16_t)((uint16_t)bytes[i] << 8));
            reader->status = (int8_t)read_entry(reader, reader->entry[0], value);
        }
    }
    return (profile_tlv_status_t)reader->status;
}

void profile_tlv_put(uint8_t bytes[PROFILE_TLV_ENTRY_BYTES], uint8_t code, uint16_t value)
{
    bytes[0] = code;
    pdcp_put_u16(&bytes[1], value);
}

void profile_tlv_put_link_entry(uint8_t bytes[PROFILE_TLV_ENTRY_BYTES], uint8_t index,
                                const profile_link_t *link, uint8_t k)
{
    const uint8_t of_end = (PROFILE_TLV_LINK_ENTRIES - 1) / 2;
    if (k == 0) {
        profile_tlv_put(bytes, PROFILE_TLV_LINK, index);
        return;
    }
    const bool is_input = k <= of_end;
    const uint8_t at = (uint8_t)(is_input ? k - 1 : k - 1 - of_end); /* 0: the end itself, then its values */
    if (at == 0) {
        profile_tlv_put(bytes, is_input ? PROFILE_TLV_INPUT : PROFILE_TLV_OUTPUT, 0);
        return;
    }
    profile_end_t end = is_input ? link->input : link->output;
    const uint8_t code = (uint8_t)(PROFILE_TLV_TYPE + at - 1);
    profile_tlv_put(bytes, code, code == PROFILE_TLV_INDEX ? end.index : *end_field(&end, code));
}
