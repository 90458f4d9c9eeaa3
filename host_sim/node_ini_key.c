#include "node_ini_key.h"

#include <stdlib.h>
#include <string.h>

#include "node_text.h"
#include "node_type.h"

enum { PARAMETER_LONGEST = 4096, RATE_LONGEST_MS = 60000 };

typedef struct key_row key_row_t;

/* Takes the value of a key. False: the reader has failed. */
typedef bool (*take_t)(node_ini_reader_t *reader, const key_row_t *row, const char *text);

struct key_row {
    const char *name;
    node_ini_section_t section;
    take_t take;
    size_t offset; /* take_word: in node_ini_t, or in a channel's description; take_draft: in a channel's
                      draft */
    int32_t min;   /* of a number */
    int32_t max;
};

static pdcp_device_channel_desc_t *channel_of(node_ini_reader_t *reader)
{
    return &reader->ini->channels[reader->index];
}

static node_ini_draft_t *draft_of(node_ini_reader_t *reader)
{
    return &reader->drafts[reader->index];
}

static pdcp_device_extra_t *extra_of(node_ini_reader_t *reader)
{
    return &reader->ini->extras[reader->index];
}

/* --- values of several keys --- */

/* Reads a number of the row's range. */
static bool read_number(node_ini_reader_t *reader, const key_row_t *row, const char *text, long long *number)
{
    if (!node_text_number(text, number)) {
        return node_ini_reader_fail(reader, reader->line, "%s: '%s' is not a number", row->name, text);
    }
    if (*number < row->min || *number > row->max) {
        return node_ini_reader_fail(reader, reader->line, "%s: %s is not in the range %d to %d", row->name,
                                    text, (int)row->min, (int)row->max);
    }
    return true;
}

static bool take_word(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    char *base = row->section == NODE_INI_DEVICE ? (char *)reader->ini : (char *)channel_of(reader);
    uint16_t *word = (uint16_t *)(void *)(base + row->offset);
    long long number;
    if (!read_number(reader, row, text, &number)) {
        return false;
    }
    *word = (uint16_t)number;
    return true;
}

static bool copy_text(node_ini_reader_t *reader, const char *text, char **copy)
{
    free(*copy);
    *copy = strdup(text);
    return *copy != NULL || node_ini_reader_out_of_memory(reader);
}

static bool take_draft(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    node_ini_draft_text_t *draft = (node_ini_draft_text_t *)(void *)((char *)draft_of(reader) + row->offset);
    draft->line = reader->line;
    return copy_text(reader, text, &draft->text);
}

static bool take_descriptor(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    const bool device = row->section == NODE_INI_DEVICE;
    pdcp_device_bytes_t *descriptor =
        device ? &reader->ini->desc.descriptor : &channel_of(reader)->descriptor;
    char **copy = &reader->ini->texts[device ? 0 : reader->index + 1];
    if (!copy_text(reader, text, copy)) {
        return false;
    }
    descriptor->bytes = *copy;
    descriptor->len = (uint16_t)strlen(text);
    return true;
}

/* --- [device] --- */

static bool take_ean13(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    const size_t digits = strspn(text, "0123456789");
    if (digits == 0 || digits > 13 || text[digits] != '\0') {
        return node_ini_reader_fail(reader, reader->line, "%s: '%s' is not a number of up to 13 digits",
                                    row->name, text);
    }
    const unsigned long long number = strtoull(text, NULL, 10);
    reader->ini->desc.ean13_low = (uint32_t)(number & 0xFFFFFFFFu);
    reader->ini->desc.ean13_high = (uint32_t)(number >> 32);
    return true;
}

static bool take_node_id(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    long long id;
    if (!read_number(reader, row, text, &id)) {
        return false;
    }
    reader->ini->first_node_id = (uint8_t)id;
    return true;
}

static bool take_state(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    if (text[0] == '\0') {
        return node_ini_reader_fail(reader, reader->line, "%s: no file is named", row->name);
    }
    free(reader->ini->state_path);
    reader->ini->state_path = node_text_path(reader->path, text);
    return reader->ini->state_path != NULL || node_ini_reader_out_of_memory(reader);
}

/* --- [channel N] --- */

static bool take_direction(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    if (strcmp(text, "input") == 0) {
        channel_of(reader)->direction = PDCP_INPUT;
    } else if (strcmp(text, "output") == 0) {
        channel_of(reader)->direction = PDCP_OUTPUT;
    } else {
        return node_ini_reader_fail(reader, reader->line, "%s: '%s' is neither input nor output", row->name,
                                    text);
    }
    return true;
}

static bool take_type(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    profile_type_t *type = &reader->ini->types[reader->index];
    char error[256];
    if (!node_type_parse(text, &channel_of(reader)->type, type, error, sizeof error)) {
        return node_ini_reader_fail(reader, reader->line, "%s: %s", row->name, error);
    }
    channel_of(reader)->terminal = type->terminal;
    draft_of(reader)->typed = true;
    return true;
}

static bool take_safe(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    long long number;
    if (!read_number(reader, row, text, &number)) {
        return false;
    }
    channel_of(reader)->safe = (int32_t)number;
    draft_of(reader)->has_safe = true;
    return true;
}

static bool take_rate(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    long long number;
    if (!read_number(reader, row, text, &number)) {
        return false;
    }
    reader->ini->signals[reader->index].rate_ms = (uint32_t)number;
    draft_of(reader)->has_rate = true;
    return true;
}

/* --- [parameter ID CHANNEL] --- */

static bool keep_value(node_ini_reader_t *reader, const char *text, size_t capacity)
{
    const size_t len = strlen(text);
    uint8_t *bytes = calloc(1, (capacity > len ? capacity : len) + 1);
    if (bytes == NULL) {
        return node_ini_reader_out_of_memory(reader);
    }
    memcpy(bytes, text, len + 1);
    free(extra_of(reader)->bytes);
    extra_of(reader)->bytes = bytes;
    reader->ini->extra_lens[reader->index] = (uint16_t)len;
    return true;
}

static bool take_value(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    (void)row;
    return keep_value(reader, text, extra_of(reader)->capacity);
}

static bool take_capacity(node_ini_reader_t *reader, const key_row_t *row, const char *text)
{
    pdcp_device_extra_t *extra = extra_of(reader);
    long long number;
    if (!read_number(reader, row, text, &number)) {
        return false;
    }
    extra->capacity = (uint16_t)number;
    extra->writable = true;
    char *value = extra->bytes != NULL ? strdup((const char *)extra->bytes) : strdup("");
    const bool good =
        value != NULL ? keep_value(reader, value, extra->capacity) : node_ini_reader_out_of_memory(reader);
    free(value);
    return good;
}

bool node_ini_key_begin_value(node_ini_reader_t *reader)
{
    return keep_value(reader, "", 0);
}

/* --- the rows --- */

#define OF_DEVICE(member) offsetof(node_ini_t, desc.member)
#define OF_CHANNEL(member) offsetof(pdcp_device_channel_desc_t, member)
#define OF_DRAFT(member) offsetof(node_ini_draft_t, member)
#define WORD 0, UINT16_MAX /* range of a number that may be any word */
#define TEXT 0, 0, 0       /* no number, and no offset */

/* Limits of times: D-BUS-13 and pdcp-bus.md 4. */
static const key_row_t rows[] = {
    {"vid", NODE_INI_DEVICE, take_word, OF_DEVICE(identity.vid), WORD},
    {"pid", NODE_INI_DEVICE, take_word, OF_DEVICE(identity.pid), WORD},
    {"serial", NODE_INI_DEVICE, take_word, OF_DEVICE(identity.sn), WORD},
    {"ean13", NODE_INI_DEVICE, take_ean13, TEXT},
    {"firmware", NODE_INI_DEVICE, take_word, OF_DEVICE(firmware), WORD},
    {"hardware", NODE_INI_DEVICE, take_word, OF_DEVICE(hardware), WORD},
    {"type", NODE_INI_DEVICE, take_word, OF_DEVICE(type), WORD},
    {"profile", NODE_INI_DEVICE, take_word, OF_DEVICE(profile), WORD},
    {"descriptor", NODE_INI_DEVICE, take_descriptor, TEXT},
    {"beacon_ms", NODE_INI_DEVICE, take_word, OF_DEVICE(beacon_ms), PDCP_BEACON_MIN_MS, PDCP_BEACON_MAX_MS},
    {"ack_ms", NODE_INI_DEVICE, take_word, OF_DEVICE(ack_ms), PDCP_ACK_MIN_MS, PDCP_ACK_MAX_MS},
    {"bind_timeout_ms", NODE_INI_DEVICE, take_word, OF_DEVICE(bind_ms), 1, UINT16_MAX},
    {"node_id", NODE_INI_DEVICE, take_node_id, 0, PDCP_NODE_MIN, PDCP_NODE_MAX},
    {"state", NODE_INI_DEVICE, take_state, TEXT},
    {"direction", NODE_INI_CHANNEL, take_direction, TEXT},
    {"type", NODE_INI_CHANNEL, take_type, TEXT},
    {"profile", NODE_INI_CHANNEL, take_word, OF_CHANNEL(profile), WORD},
    {"descriptor", NODE_INI_CHANNEL, take_descriptor, TEXT},
    {"required", NODE_INI_CHANNEL, take_draft, OF_DRAFT(needs[0]), 0, 0},
    {"desired", NODE_INI_CHANNEL, take_draft, OF_DRAFT(needs[1]), 0, 0},
    {"terminal_profile", NODE_INI_CHANNEL, take_word, OF_CHANNEL(terminal_profile), WORD},
    {"safe", NODE_INI_CHANNEL, take_safe, 0, INT16_MIN, UINT16_MAX},
    {"signal", NODE_INI_CHANNEL, take_draft, OF_DRAFT(signal), 0, 0},
    {"rate_ms", NODE_INI_CHANNEL, take_rate, 0, 1, RATE_LONGEST_MS},
    {"value", NODE_INI_PARAMETER, take_value, TEXT},
    {"capacity", NODE_INI_PARAMETER, take_capacity, 0, 1, PARAMETER_LONGEST},
};

enum { ROWS = sizeof rows / sizeof rows[0], ROW_VID = 0, ROW_PID = 1, ROW_SERIAL = 2 };

bool node_ini_key_take(node_ini_reader_t *reader, const char *name, const char *text)
{
    for (unsigned i = 0; i < ROWS; i++) {
        if (rows[i].section != reader->section || strcmp(rows[i].name, name) != 0) {
            continue;
        }
        if ((reader->keys_seen & ((uint32_t)1 << i)) != 0) {
            return node_ini_reader_fail(reader, reader->line, "%s is there twice", name);
        }
        reader->keys_seen |= (uint32_t)1 << i;
        if (reader->section == NODE_INI_DEVICE) {
            reader->device_keys = reader->keys_seen;
        }
        return rows[i].take(reader, &rows[i], text);
    }
    if (reader->section == NODE_INI_NOTHING) {
        return node_ini_reader_fail(reader, reader->line, "%s stands before the first section", name);
    }
    return node_ini_reader_fail(reader, reader->line, "unknown key '%s'", name);
}

bool node_ini_key_has_identity(const node_ini_reader_t *reader)
{
    static const uint32_t needed = (1u << ROW_VID) | (1u << ROW_PID) | (1u << ROW_SERIAL);
    return (reader->device_keys & needed) == needed;
}
