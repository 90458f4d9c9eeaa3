#include "profile_tlv.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_bytes.h"

/* What has been declared: bits of state. */
enum {
    TLV_CONFIGURATIONS = 0x01, /* code 1 */
    TLV_LINKS = 0x02,          /* code 3 of this configuration */
    TLV_LINK = 0x04,           /* code 4, and the link goes on */
    TLV_INPUT = 0x08,          /* codes 5 and 6 of this link */
    TLV_OUTPUT = 0x10,
    TLV_OF_LINK = TLV_LINK | TLV_INPUT | TLV_OUTPUT
};

void profile_tlv_init(profile_tlv_t *reader, profile_tlv_on_link_t on_link, void *ctx)
{
    memset(reader, 0, sizeof *reader);
    reader->on_link = on_link;
    reader->ctx = ctx;
}

/* Number of the bit that stands for an identity; others may share it (D-BUS-53). */
static uint8_t name_of(const pdcp_identity_t *identity)
{
    const uint16_t hash = (uint16_t)(identity->vid * 31u + identity->pid * 7u + identity->sn);
    return (uint8_t)((hash ^ (hash >> 8)) % (8u * PROFILE_TLV_NAMES_BYTES));
}

bool profile_tlv_names(const uint8_t names[PROFILE_TLV_NAMES_BYTES], const pdcp_identity_t *identity)
{
    return pdcp_bit(names, name_of(identity));
}

static void end_link(profile_tlv_t *reader)
{
    if ((reader->state & TLV_LINK) != 0) {
        pdcp_bit_set(reader->names, name_of(&reader->link.input.owner), true);
        pdcp_bit_set(reader->names, name_of(&reader->link.output.owner), true);
        if (reader->on_link != NULL) {
            reader->on_link(reader->ctx, reader->number, &reader->link);
        }
    }
    reader->state = (uint8_t)(reader->state & ~(unsigned)TLV_OF_LINK);
    reader->end = 0;
}

static profile_tlv_status_t end_configuration(profile_tlv_t *reader)
{
    end_link(reader);
    return reader->links_missing == 0 ? PROFILE_TLV_MORE : PROFILE_TLV_ERR_COUNT;
}

/* What may stand once in what it belongs to (D-PRO-20); within 0: it stands elsewhere. */
static profile_tlv_status_t declare(profile_tlv_t *reader, uint8_t within, uint8_t what)
{
    if (within == 0) {
        return PROFILE_TLV_ERR_PLACE;
    }
    if ((reader->state & what) != 0) {
        return PROFILE_TLV_ERR_TWICE;
    }
    reader->state |= what;
    return PROFILE_TLV_MORE;
}

/* The number of a configuration or link, up to 255 and each once (D-PRO-20). */
static profile_tlv_status_t take_number(uint8_t taken[PROFILE_TLV_SET_BYTES], uint16_t number)
{
    if (number > 0xFFu) {
        return PROFILE_TLV_ERR_RANGE;
    }
    if (profile_tlv_has(taken, (uint8_t)number)) {
        return PROFILE_TLV_ERR_TWICE;
    }
    pdcp_bit_set(taken, (uint8_t)number, true);
    return PROFILE_TLV_MORE;
}

/* There is no configuration 0 (D-PRO-20). */
static profile_tlv_status_t begin_configuration(profile_tlv_t *reader, uint16_t value)
{
    profile_tlv_status_t status = end_configuration(reader);
    if (status == PROFILE_TLV_MORE) {
        status = value == 0 ? PROFILE_TLV_ERR_RANGE : take_number(reader->numbers, value);
    }
    if (status != PROFILE_TLV_MORE) {
        return status;
    }
    memset(reader->links, 0, sizeof reader->links);
    reader->state &= TLV_CONFIGURATIONS;
    reader->number = (uint8_t)value;
    reader->configurations_read++;
    return PROFILE_TLV_MORE;
}

static profile_tlv_status_t begin_link(profile_tlv_t *reader, uint16_t value)
{
    end_link(reader);
    memset(&reader->link, 0, sizeof reader->link);
    reader->links_missing--;
    const profile_tlv_status_t status = declare(reader, reader->number, TLV_LINK);
    return status == PROFILE_TLV_MORE ? take_number(reader->links, value) : status;
}

static profile_tlv_status_t begin_end(profile_tlv_t *reader, uint8_t end)
{
    reader->end = end;
    return declare(reader, reader->state & TLV_LINK, end);
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
    if (reader->end == 0) {
        return PROFILE_TLV_ERR_PLACE;
    }
    profile_end_t *end = reader->end == TLV_INPUT ? &reader->link.input : &reader->link.output;
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
        reader->configurations_told = value;
        return declare(reader, reader->number == 0 ? 1 : 0, TLV_CONFIGURATIONS);
    case PROFILE_TLV_CONFIGURATION:
        return begin_configuration(reader, value);
    case PROFILE_TLV_LINKS:
        reader->links_missing = (uint16_t)(reader->links_missing + value);
        return declare(reader, reader->number, TLV_LINKS);
    case PROFILE_TLV_LINK:
        return begin_link(reader, value);
    case PROFILE_TLV_INPUT:
        return begin_end(reader, TLV_INPUT);
    case PROFILE_TLV_OUTPUT:
        return begin_end(reader, TLV_OUTPUT);
    default:
        break;
    }
    if (code == PROFILE_TLV_END) {
        return end_string(reader);
    }
    return code >= PROFILE_TLV_TYPE && code <= PROFILE_TLV_OWNER_PROFILE ? read_value(reader, code, value)
                                                                         : PROFILE_TLV_MORE;
}

/* The value behind the code has its least significant byte first (D-PRO-7). */
profile_tlv_status_t profile_tlv_read(profile_tlv_t *reader, const uint8_t *bytes, uint16_t len)
{
    for (; len > 0 && reader->status == PROFILE_TLV_MORE; len--) {
        reader->entry[reader->have++] = *bytes++;
        if (reader->have == PROFILE_TLV_ENTRY_BYTES) {
            reader->have = 0;
            const uint16_t value = pdcp_bytes_value_u16(reader->entry, PROFILE_TLV_ENTRY_BYTES, 1);
            reader->status = (int8_t)read_entry(reader, reader->entry[0], value);
        }
    }
    return (profile_tlv_status_t)reader->status;
}

/* Puts an entry, the least significant byte of its value first (D-PRO-7). */
void profile_tlv_put(uint8_t bytes[PROFILE_TLV_ENTRY_BYTES], uint8_t code, uint16_t value)
{
    bytes[0] = code;
    pdcp_bytes_put_u16(&bytes[1], value);
}

void profile_tlv_put_link_entry(uint8_t bytes[PROFILE_TLV_ENTRY_BYTES], uint8_t index,
                                const profile_link_t *link, uint8_t k)
{
    const uint8_t of_end = (PROFILE_TLV_LINK_ENTRIES - 1) / 2;
    if (k == 0) {
        profile_tlv_put(bytes, PROFILE_TLV_LINK, index);
        return;
    }
    uint8_t code = PROFILE_TLV_INPUT;
    profile_end_t end = link->input;
    if (k > of_end) {
        code = PROFILE_TLV_OUTPUT;
        end = link->output;
        k = (uint8_t)(k - of_end);
    }
    uint16_t value = 0;
    if (k > 1) { /* not the end itself, but one of its values */
        code = (uint8_t)(PROFILE_TLV_TYPE + k - 2);
        value = code == PROFILE_TLV_INDEX ? end.index : *end_field(&end, code);
    }
    profile_tlv_put(bytes, code, value);
}
