#include "node_ini.h"

#include <errno.h>
#include <ini.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "node_text.h"

enum { LINE_MAX_CHARS = 198, BULK_MIN = 16, PARAMETER_LONGEST = 4096 };

/* Section that the reader is in. */
enum { IN_NOTHING = 0, IN_DEVICE, IN_CHANNEL, IN_PARAMETER };

/* A channel while it is read: what can only be judged when all of the file is known. */
typedef struct {
    int line; /* of its section, 0: not seen */
    bool typed;
    bool has_safe;
    bool has_rate;
    int signal_line;
    char *signal;
    int needs_line[2];
    char *needs[2];
} draft_t;

typedef struct {
    node_ini_t *ini;
    FILE *file;
    const char *path;
    int line;
    int device_line;
    int section;           /* IN_... */
    unsigned index;        /* channel or extra */
    uint32_t keys_seen;    /* of this section */
    uint32_t device_keys;  /* of [device] */
    unsigned channel_last; /* highest index seen */
    draft_t drafts[PDCP_DEVICE_CHANNELS_MAX];
    char *error;
    size_t error_size;
    bool failed;
} reader_t;

/* Keeps the first error alone. Always false, so that it can be returned. */
__attribute__((format(printf, 3, 4))) static bool fail(reader_t *reader, int line, const char *format, ...)
{
    if (reader->failed) {
        return false;
    }
    reader->failed = true;
    const int used = snprintf(reader->error, reader->error_size, "%s:%d: ", reader->path, line);
    if (used > 0 && (size_t)used < reader->error_size) {
        va_list args;
        va_start(args, format);
        (void)vsnprintf(&reader->error[used], reader->error_size - (size_t)used, format, args);
        va_end(args);
    }
    return false;
}

static bool out_of_memory(reader_t *reader)
{
    return fail(reader, reader->line, "out of memory");
}

/* --- values --- */

static bool take_number(reader_t *reader, const char *key, const char *text, long long min, long long max,
                        long long *number)
{
    if (!node_text_number(text, number)) {
        return fail(reader, reader->line, "%s: '%s' is not a number", key, text);
    }
    if (*number < min || *number > max) {
        return fail(reader, reader->line, "%s: %s is not in the range %lld to %lld", key, text, min, max);
    }
    return true;
}

static bool take_u16(reader_t *reader, const char *key, const char *text, uint16_t *word)
{
    long long number;
    if (!take_number(reader, key, text, 0, 0xFFFF, &number)) {
        return false;
    }
    *word = (uint16_t)number;
    return true;
}

static bool take_u16_within(reader_t *reader, const char *key, const char *text, int min, int max,
                            uint16_t *word)
{
    long long number;
    if (!take_number(reader, key, text, min, max, &number)) {
        return false;
    }
    *word = (uint16_t)number;
    return true;
}

static bool take_text(reader_t *reader, const char *text, char **copy)
{
    free(*copy);
    *copy = strdup(text);
    return *copy != NULL || out_of_memory(reader);
}

/* --- [device] --- */

/* D-BUS-13 and pdcp-bus.md 4. */
static bool key_vid(reader_t *reader, const char *key, const char *text)
{
    return take_u16(reader, key, text, &reader->ini->desc.identity.vid);
}

static bool key_pid(reader_t *reader, const char *key, const char *text)
{
    return take_u16(reader, key, text, &reader->ini->desc.identity.pid);
}

static bool key_serial(reader_t *reader, const char *key, const char *text)
{
    return take_u16(reader, key, text, &reader->ini->desc.identity.sn);
}

static bool key_ean13(reader_t *reader, const char *key, const char *text)
{
    const size_t digits = strspn(text, "0123456789");
    if (digits == 0 || digits > 13 || text[digits] != '\0') {
        return fail(reader, reader->line, "%s: '%s' is not a number of up to 13 digits", key, text);
    }
    const unsigned long long number = strtoull(text, NULL, 10);
    reader->ini->desc.ean13_low = (uint32_t)(number & 0xFFFFFFFFu);
    reader->ini->desc.ean13_high = (uint32_t)(number >> 32);
    return true;
}

static bool key_firmware(reader_t *reader, const char *key, const char *text)
{
    return take_u16(reader, key, text, &reader->ini->desc.firmware);
}

static bool key_hardware(reader_t *reader, const char *key, const char *text)
{
    return take_u16(reader, key, text, &reader->ini->desc.hardware);
}

static bool key_device_type(reader_t *reader, const char *key, const char *text)
{
    return take_u16(reader, key, text, &reader->ini->desc.type);
}

static bool key_device_profile(reader_t *reader, const char *key, const char *text)
{
    return take_u16(reader, key, text, &reader->ini->desc.profile);
}

static bool key_device_descriptor(reader_t *reader, const char *key, const char *text)
{
    (void)key;
    if (!take_text(reader, text, &reader->ini->texts[0])) {
        return false;
    }
    reader->ini->desc.descriptor.bytes = reader->ini->texts[0];
    reader->ini->desc.descriptor.len = (uint16_t)strlen(text);
    return true;
}

static bool key_beacon(reader_t *reader, const char *key, const char *text)
{
    return take_u16_within(reader, key, text, PDCP_BEACON_MIN_MS, PDCP_BEACON_MAX_MS,
                           &reader->ini->desc.beacon_ms);
}

static bool key_ack(reader_t *reader, const char *key, const char *text)
{
    return take_u16_within(reader, key, text, PDCP_ACK_MIN_MS, PDCP_ACK_MAX_MS, &reader->ini->desc.ack_ms);
}

static bool key_bind(reader_t *reader, const char *key, const char *text)
{
    return take_u16_within(reader, key, text, 1, 0xFFFF, &reader->ini->desc.bind_ms);
}

static bool key_node_id(reader_t *reader, const char *key, const char *text)
{
    uint16_t id;
    if (!take_u16_within(reader, key, text, PDCP_NODE_MIN, PDCP_NODE_MAX, &id)) {
        return false;
    }
    reader->ini->first_node_id = (uint8_t)id;
    return true;
}

static bool key_state(reader_t *reader, const char *key, const char *text)
{
    if (text[0] == '\0') {
        return fail(reader, reader->line, "%s: no file is named", key);
    }
    free(reader->ini->state_path);
    reader->ini->state_path = node_text_path(reader->path, text);
    return reader->ini->state_path != NULL || out_of_memory(reader);
}

/* --- [channel N] --- */

static pdcp_device_channel_desc_t *channel_of(reader_t *reader)
{
    return &reader->ini->channels[reader->index];
}

static bool key_direction(reader_t *reader, const char *key, const char *text)
{
    if (strcmp(text, "input") == 0) {
        channel_of(reader)->direction = PDCP_INPUT;
    } else if (strcmp(text, "output") == 0) {
        channel_of(reader)->direction = PDCP_OUTPUT;
    } else {
        return fail(reader, reader->line, "%s: '%s' is neither input nor output", key, text);
    }
    return true;
}

/* Words of a type. The field tells which of them exclude each other. */
enum {
    FIELD_SIZE = 1,
    FIELD_DATA = 2,
    FIELD_CONTROL = 4,
    FIELD_SOLE = 8,
    FIELD_TERMINAL = 16,
    FIELD_PRESCALER = 32
};

static const struct {
    const char *word;
    uint8_t field;
    uint8_t value;
} type_words[] = {
    {"4bit", FIELD_SIZE, PROFILE_SIZE_4},
    {"8bit", FIELD_SIZE, PROFILE_SIZE_8},
    {"12bit", FIELD_SIZE, PROFILE_SIZE_12},
    {"16bit", FIELD_SIZE, PROFILE_SIZE_16},
    {"signed", FIELD_DATA, PROFILE_SIGNED},
    {"unsigned", FIELD_DATA, PROFILE_UNSIGNED},
    {"float", FIELD_DATA, PROFILE_FLOAT},
    {"boolean", FIELD_DATA, PROFILE_BOOLEAN},
    {"position", FIELD_CONTROL, PROFILE_POSITION},
    {"velocity", FIELD_CONTROL, PROFILE_VELOCITY},
    {"acceleration", FIELD_CONTROL, PROFILE_ACCELERATION},
    {"other", FIELD_CONTROL, PROFILE_OTHER},
    {"sole", FIELD_SOLE, 1},
    {"terminal", FIELD_TERMINAL, 1},
    {"x1", FIELD_PRESCALER, 0},
    {"x1e-6", FIELD_PRESCALER, 1},
    {"x1e-3", FIELD_PRESCALER, 2},
    {"x1e-1", FIELD_PRESCALER, 3},
    {"x1e1", FIELD_PRESCALER, 4},
    {"x1e2", FIELD_PRESCALER, 5},
    {"x1e3", FIELD_PRESCALER, 6},
    {"x1e6", FIELD_PRESCALER, 7},
};

static void set_type_field(profile_type_t *type, uint8_t field, uint8_t value)
{
    switch (field) {
    case FIELD_SIZE:
        type->size = value;
        break;
    case FIELD_DATA:
        type->data = value;
        break;
    case FIELD_CONTROL:
        type->control = value;
        break;
    case FIELD_SOLE:
        type->sole_access = true;
        break;
    case FIELD_TERMINAL:
        type->terminal = true;
        break;
    default:
        type->prescaler = value;
        break;
    }
}

/* Takes one word; its field in *fields. */
static bool take_type_word(reader_t *reader, const char *word, profile_type_t *type, unsigned *fields)
{
    for (size_t i = 0; i < sizeof type_words / sizeof type_words[0]; i++) {
        if (strcmp(word, type_words[i].word) != 0) {
            continue;
        }
        if ((*fields & type_words[i].field) != 0) {
            return fail(reader, reader->line, "type: '%s' contradicts or repeats a word before it", word);
        }
        *fields |= type_words[i].field;
        set_type_field(type, type_words[i].field, type_words[i].value);
        return true;
    }
    return fail(reader, reader->line, "type: unknown word '%s'", word);
}

static bool take_type_words(reader_t *reader, const char *text, uint16_t *word)
{
    profile_type_t type = {0};
    unsigned fields = 0;
    char *copy = strdup(text);
    char *rest = copy;
    bool good = copy != NULL || out_of_memory(reader);
    for (char *part = NULL; good && (part = strsep(&rest, " ,\t")) != NULL;) {
        good = part[0] == '\0' || take_type_word(reader, part, &type, &fields);
    }
    free(copy);
    if (good && (fields & (FIELD_SIZE | FIELD_DATA)) != (FIELD_SIZE | FIELD_DATA)) {
        return fail(reader, reader->line,
                    "type: needs a size (such as 8bit) and a data type (such as unsigned)");
    }
    *word = profile_type_encode(&type);
    return good;
}

static bool key_type(reader_t *reader, const char *key, const char *text)
{
    const char *digits = strncmp(text, "0x", 2) == 0 ? &text[2] : text;
    const bool number = text[0] != '\0' && digits[strspn(digits, "0123456789ABCDEFabcdef")] == '\0';
    uint16_t word = 0;
    profile_type_t *type = &reader->ini->types[reader->index];
    if (!(number ? take_u16(reader, key, text, &word) : take_type_words(reader, text, &word))) {
        return false;
    }
    if (!profile_type_decode(word, type)) {
        return fail(reader, reader->line, "%s: a float has 16 bits", key);
    }
    if (type->data == PROFILE_FLOAT) {
        return fail(reader, reader->line, "%s: float channels cannot be simulated", key);
    }
    channel_of(reader)->type = word;
    channel_of(reader)->terminal = type->terminal;
    reader->drafts[reader->index].typed = true;
    return true;
}

static bool key_profile(reader_t *reader, const char *key, const char *text)
{
    return take_u16(reader, key, text, &channel_of(reader)->profile);
}

static bool key_descriptor(reader_t *reader, const char *key, const char *text)
{
    (void)key;
    char **copy = &reader->ini->texts[reader->index + 1];
    if (!take_text(reader, text, copy)) {
        return false;
    }
    channel_of(reader)->descriptor.bytes = *copy;
    channel_of(reader)->descriptor.len = (uint16_t)strlen(text);
    return true;
}

static bool key_required(reader_t *reader, const char *key, const char *text)
{
    (void)key;
    reader->drafts[reader->index].needs_line[0] = reader->line;
    return take_text(reader, text, &reader->drafts[reader->index].needs[0]);
}

static bool key_desired(reader_t *reader, const char *key, const char *text)
{
    (void)key;
    reader->drafts[reader->index].needs_line[1] = reader->line;
    return take_text(reader, text, &reader->drafts[reader->index].needs[1]);
}

static bool key_terminal_profile(reader_t *reader, const char *key, const char *text)
{
    return take_u16(reader, key, text, &channel_of(reader)->terminal_profile);
}

static bool key_safe(reader_t *reader, const char *key, const char *text)
{
    long long number;
    if (!take_number(reader, key, text, -32768, 65535, &number)) {
        return false;
    }
    channel_of(reader)->safe = (int32_t)number;
    reader->drafts[reader->index].has_safe = true;
    return true;
}

static bool key_signal(reader_t *reader, const char *key, const char *text)
{
    (void)key;
    reader->drafts[reader->index].signal_line = reader->line;
    return take_text(reader, text, &reader->drafts[reader->index].signal);
}

static bool key_rate(reader_t *reader, const char *key, const char *text)
{
    long long number;
    if (!take_number(reader, key, text, 1, 60000, &number)) {
        return false;
    }
    reader->ini->signals[reader->index].rate_ms = (uint32_t)number;
    reader->drafts[reader->index].has_rate = true;
    return true;
}

/* --- [parameter ID CHANNEL] --- */

static bool keep_value(reader_t *reader, const char *text, size_t capacity)
{
    pdcp_device_extra_t *extra = &reader->ini->extras[reader->index];
    const size_t len = strlen(text);
    uint8_t *bytes = calloc(1, (capacity > len ? capacity : len) + 1);
    if (bytes == NULL) {
        return out_of_memory(reader);
    }
    memcpy(bytes, text, len + 1);
    free(extra->bytes);
    extra->bytes = bytes;
    reader->ini->extra_lens[reader->index] = (uint16_t)len;
    return true;
}

static bool key_value(reader_t *reader, const char *key, const char *text)
{
    (void)key;
    return keep_value(reader, text, reader->ini->extras[reader->index].capacity);
}

static bool key_capacity(reader_t *reader, const char *key, const char *text)
{
    pdcp_device_extra_t *extra = &reader->ini->extras[reader->index];
    long long number;
    if (!take_number(reader, key, text, 1, PARAMETER_LONGEST, &number)) {
        return false;
    }
    extra->capacity = (uint16_t)number;
    extra->writable = true;
    char *value = extra->bytes != NULL ? strdup((const char *)extra->bytes) : strdup("");
    const bool good = value != NULL ? keep_value(reader, value, extra->capacity) : out_of_memory(reader);
    free(value);
    return good;
}

/* --- sections and keys --- */

typedef struct {
    const char *name;
    int section;
    bool (*take)(reader_t *reader, const char *key, const char *text);
} key_row_t;

static const key_row_t keys[] = {
    {"vid", IN_DEVICE, key_vid},
    {"pid", IN_DEVICE, key_pid},
    {"serial", IN_DEVICE, key_serial},
    {"ean13", IN_DEVICE, key_ean13},
    {"firmware", IN_DEVICE, key_firmware},
    {"hardware", IN_DEVICE, key_hardware},
    {"type", IN_DEVICE, key_device_type},
    {"profile", IN_DEVICE, key_device_profile},
    {"descriptor", IN_DEVICE, key_device_descriptor},
    {"beacon_ms", IN_DEVICE, key_beacon},
    {"ack_ms", IN_DEVICE, key_ack},
    {"bind_timeout_ms", IN_DEVICE, key_bind},
    {"node_id", IN_DEVICE, key_node_id},
    {"state", IN_DEVICE, key_state},
    {"direction", IN_CHANNEL, key_direction},
    {"type", IN_CHANNEL, key_type},
    {"profile", IN_CHANNEL, key_profile},
    {"descriptor", IN_CHANNEL, key_descriptor},
    {"required", IN_CHANNEL, key_required},
    {"desired", IN_CHANNEL, key_desired},
    {"terminal_profile", IN_CHANNEL, key_terminal_profile},
    {"safe", IN_CHANNEL, key_safe},
    {"signal", IN_CHANNEL, key_signal},
    {"rate_ms", IN_CHANNEL, key_rate},
    {"value", IN_PARAMETER, key_value},
    {"capacity", IN_PARAMETER, key_capacity},
};

enum { KEYS = sizeof keys / sizeof keys[0], KEY_VID = 0, KEY_PID = 1, KEY_SERIAL = 2 };

static bool begin_device(reader_t *reader)
{
    if (reader->device_line != 0) {
        return fail(reader, reader->line, "[device] is there twice");
    }
    reader->device_line = reader->line;
    reader->section = IN_DEVICE;
    return true;
}

static bool begin_channel(reader_t *reader, const char *number)
{
    long long index;
    if (!node_text_number(number, &index) || index < 1 || index > PDCP_DEVICE_CHANNELS_MAX) {
        return fail(reader, reader->line, "[channel %s]: the index is a number from 1 to %d", number,
                    PDCP_DEVICE_CHANNELS_MAX);
    }
    reader->index = (unsigned)index - 1;
    if (reader->drafts[reader->index].line != 0) {
        return fail(reader, reader->line, "[channel %s] is there twice", number);
    }
    reader->drafts[reader->index].line = reader->line;
    reader->section = IN_CHANNEL;
    if (reader->index >= reader->channel_last) {
        reader->channel_last = reader->index + 1;
    }
    return true;
}

static bool begin_parameter(reader_t *reader, char *numbers)
{
    char *channel_text = strchr(numbers, ' ');
    long long param = 0;
    long long channel = 0;
    if (channel_text != NULL) {
        *channel_text++ = '\0';
    }
    if (!node_text_number(numbers, &param) || param < 0 || param > 255 || channel_text == NULL ||
        !node_text_number(channel_text, &channel) || channel < 0 || channel > 255) {
        return fail(reader, reader->line, "[parameter ID CHANNEL]: both are numbers from 0 to 255");
    }
    if (reader->ini->desc.extra_count == NODE_INI_EXTRAS_MAX) {
        return fail(reader, reader->line, "more than %d parameters", NODE_INI_EXTRAS_MAX);
    }
    reader->index = reader->ini->desc.extra_count++;
    pdcp_device_extra_t *extra = &reader->ini->extras[reader->index];
    extra->param = (uint8_t)param;
    extra->channel = (uint8_t)channel;
    extra->len = &reader->ini->extra_lens[reader->index];
    reader->section = IN_PARAMETER;
    return keep_value(reader, "", 0);
}

/* A line that begins a section. inih tells a section only with its first key; an empty one must not go
 * unseen. */
static bool begin_section(reader_t *reader, const char *line)
{
    char name[LINE_MAX_CHARS + 1];
    const size_t len = strcspn(line, "]\n");
    reader->section = IN_NOTHING;
    reader->keys_seen = 0;
    if (line[len] != ']' || len > LINE_MAX_CHARS) {
        return fail(reader, reader->line, "a section ends with ]");
    }
    memcpy(name, line, len);
    name[len] = '\0';
    if (strcmp(name, "device") == 0) {
        return begin_device(reader);
    }
    if (strncmp(name, "channel ", 8) == 0) {
        return begin_channel(reader, &name[8]);
    }
    if (strncmp(name, "parameter ", 10) == 0) {
        return begin_parameter(reader, &name[10]);
    }
    return fail(reader, reader->line, "unknown section [%s]", name);
}

/* inih asks for one line. Counts lines, so that an error can name its own. */
static char *next_line(char *line, int size, void *ctx)
{
    reader_t *reader = ctx;
    if (reader->failed || fgets(line, size, reader->file) == NULL) {
        return NULL;
    }
    reader->line++;
    if (strchr(line, '\n') == NULL && strlen(line) + 1 >= (size_t)size) {
        (void)fail(reader, reader->line, "the line is longer than %d characters", LINE_MAX_CHARS);
        return NULL;
    }
    const char *first = &line[strncmp(line, "\xEF\xBB\xBF", 3) == 0 ? 3 : strspn(line, " \t")];
    return *first != '[' || begin_section(reader, &first[1]) ? line : NULL;
}

/* inih found a key. */
static int on_key(void *ctx, const char *section, const char *name, const char *text)
{
    reader_t *reader = ctx;
    (void)section; /* begin_section knows it already */
    for (unsigned i = 0; i < KEYS; i++) {
        if (keys[i].section != reader->section || strcmp(keys[i].name, name) != 0) {
            continue;
        }
        if ((reader->keys_seen & ((uint32_t)1 << i)) != 0) {
            return fail(reader, reader->line, "%s is there twice", name);
        }
        reader->keys_seen |= (uint32_t)1 << i;
        if (reader->section == IN_DEVICE) {
            reader->device_keys = reader->keys_seen;
        }
        return keys[i].take(reader, name, text);
    }
    if (reader->section == IN_NOTHING) {
        return fail(reader, reader->line, "%s stands before the first section", name);
    }
    return fail(reader, reader->line, "unknown key '%s'", name);
}

/* --- the whole --- */

static bool is_input(const reader_t *reader, long long channel)
{
    return channel >= 1 && channel <= (long long)reader->channel_last &&
           reader->ini->channels[channel - 1].direction == PDCP_INPUT;
}

static bool take_signal(reader_t *reader, unsigned index)
{
    const draft_t *draft = &reader->drafts[index];
    node_signal_t *signal = &reader->ini->signals[index];
    char error[256];
    if (!node_signal_parse(signal, draft->signal, &reader->ini->types[index], reader->path, error,
                           sizeof error)) {
        return fail(reader, draft->signal_line, "signal: %s", error);
    }
    if (signal->kind == NODE_SIGNAL_COPY && !is_input(reader, signal->source)) {
        return fail(reader, draft->signal_line, "signal: %d is not an input of this device", signal->source);
    }
    if (!draft->has_rate && signal->kind != NODE_SIGNAL_COPY) {
        signal->rate_ms = NODE_INI_RATE_MS;
    }
    return true;
}

/* which: 0 required, 1 desired. */
static bool take_needs(reader_t *reader, unsigned index, unsigned which)
{
    const int line = reader->drafts[index].needs_line[which];
    const char *const key = which == 0 ? "required" : "desired";
    uint8_t *bits = reader->ini->needs[index][which];
    pdcp_device_channel_desc_t *channel = &reader->ini->channels[index];
    pdcp_device_bytes_t *out = which == 0 ? &channel->required : &channel->desired;
    char *rest = reader->drafts[index].needs[which];
    for (char *part = NULL; (part = strsep(&rest, " ,\t")) != NULL;) {
        long long number = 0;
        if (part[0] == '\0') {
            continue;
        }
        if (!node_text_number(part, &number) || !is_input(reader, number)) {
            return fail(reader, line, "%s: %s is not an input of this device", key, part);
        }
        bits[number / 8] = (uint8_t)(bits[number / 8] | (0x80u >> (number % 8))); /* D-BUS-8 */
        if (out->len < number / 8 + 1) {
            out->len = (uint16_t)(number / 8 + 1);
        }
    }
    out->bytes = bits;
    return true;
}

static bool check_input(reader_t *reader, unsigned index)
{
    const draft_t *draft = &reader->drafts[index];
    const pdcp_device_channel_desc_t *channel = &reader->ini->channels[index];
    int32_t min = 0;
    int32_t max = 0;
    if (draft->signal != NULL || draft->has_rate) {
        return fail(reader, draft->line, "[channel %u]: an input has no signal and no rate_ms", index + 1);
    }
    if (draft->has_safe && !channel->terminal) {
        return fail(reader, draft->line, "[channel %u]: only a terminal input has a safe value", index + 1);
    }
    (void)profile_type_range(&reader->ini->types[index], &min, &max);
    if (channel->safe < min || channel->safe > max) {
        return fail(reader, draft->line, "[channel %u]: the safe value does not fit the type", index + 1);
    }
    return true;
}

static bool check_output(reader_t *reader, unsigned index)
{
    const draft_t *draft = &reader->drafts[index];
    const pdcp_device_channel_desc_t *channel = &reader->ini->channels[index];
    if (draft->has_safe || channel->terminal_profile != 0 || channel->terminal) {
        return fail(reader, draft->line,
                    "[channel %u]: safe, terminal_profile and the type's terminal are for inputs", index + 1);
    }
    return draft->signal == NULL || take_signal(reader, index);
}

static bool check_channel(reader_t *reader, unsigned index)
{
    const draft_t *draft = &reader->drafts[index];
    const pdcp_device_channel_desc_t *channel = &reader->ini->channels[index];
    if (draft->line == 0) {
        return fail(reader, reader->drafts[reader->channel_last - 1].line, "[channel %u] is missing",
                    index + 1);
    }
    if (channel->direction == 0 || !draft->typed) {
        return fail(reader, draft->line, "[channel %u]: needs %s", index + 1,
                    channel->direction == 0 ? "direction" : "type");
    }
    return (channel->direction == PDCP_INPUT ? check_input(reader, index) : check_output(reader, index)) &&
           take_needs(reader, index, 0) && take_needs(reader, index, 1);
}

static bool check_device(reader_t *reader)
{
    static const uint32_t needed = (1u << KEY_VID) | (1u << KEY_PID) | (1u << KEY_SERIAL);
    if (reader->device_line == 0) {
        return fail(reader, reader->line != 0 ? reader->line : 1, "[device] is missing");
    }
    if ((reader->device_keys & needed) != needed) {
        return fail(reader, reader->device_line, "[device]: needs vid, pid and serial");
    }
    for (unsigned i = 0; i < reader->channel_last; i++) {
        if (!check_channel(reader, i)) {
            return false;
        }
    }
    return true;
}

static bool finish(reader_t *reader)
{
    node_ini_t *ini = reader->ini;
    size_t longest = BULK_MIN;
    for (uint8_t i = 0; i < ini->desc.extra_count; i++) {
        if (ini->extras[i].channel > reader->channel_last) {
            return fail(reader, reader->line, "[parameter %d %d]: there is no such channel",
                        ini->extras[i].param, ini->extras[i].channel);
        }
        if (ini->extras[i].capacity > longest) {
            longest = ini->extras[i].capacity;
        }
    }
    ini->desc.bulk = malloc(longest);
    if (ini->desc.bulk == NULL) {
        return out_of_memory(reader);
    }
    ini->desc.bulk_capacity = (uint16_t)longest;
    ini->desc.channels = ini->channels;
    ini->desc.channel_count = (uint8_t)reader->channel_last;
    ini->desc.extras = ini->extras;
    return true;
}

static bool read_all(reader_t *reader)
{
    const int bad_line = ini_parse_stream(next_line, reader, on_key, reader);
    if (reader->failed) {
        return false;
    }
    if (ferror(reader->file) != 0) {
        return fail(reader, reader->line, "%s", strerror(errno));
    }
    if (bad_line > 0) {
        return fail(reader, bad_line, "is neither a section nor key = value");
    }
    if (bad_line < 0) {
        return out_of_memory(reader);
    }
    return check_device(reader) && finish(reader);
}

node_ini_t *node_ini_load(const char *path, char *error, size_t error_size)
{
    reader_t reader = {.path = path, .error = error, .error_size = error_size};
    reader.file = fopen(path, "re");
    if (reader.file == NULL) {
        (void)snprintf(error, error_size, "%s: %s", path, strerror(errno));
        return NULL;
    }
    reader.ini = calloc(1, sizeof *reader.ini);
    const bool good = reader.ini != NULL ? read_all(&reader) : out_of_memory(&reader);
    (void)fclose(reader.file);
    for (unsigned i = 0; i < PDCP_DEVICE_CHANNELS_MAX; i++) {
        free(reader.drafts[i].signal);
        free(reader.drafts[i].needs[0]);
        free(reader.drafts[i].needs[1]);
    }
    if (!good) {
        node_ini_free(reader.ini);
        return NULL;
    }
    return reader.ini;
}

void node_ini_free(node_ini_t *ini)
{
    if (ini == NULL) {
        return;
    }
    for (unsigned i = 0; i < PDCP_DEVICE_CHANNELS_MAX; i++) {
        node_signal_clear(&ini->signals[i]);
        free(ini->texts[i + 1]);
    }
    for (unsigned i = 0; i < NODE_INI_EXTRAS_MAX; i++) {
        free(ini->extras[i].bytes);
    }
    free(ini->texts[0]);
    free(ini->desc.bulk);
    free(ini->state_path);
    free(ini);
}
