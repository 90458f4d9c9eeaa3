#include "node_ini.h"

#include <errno.h>
#include <ini.h>
#include <stdlib.h>
#include <string.h>

#include "node_ini_check.h"
#include "node_ini_key.h"
#include "node_ini_reader.h"
#include "node_text.h"

enum { LINE_MAX_CHARS = 198 };

/* --- sections and keys --- */

static bool begin_device(node_ini_reader_t *reader)
{
    if (reader->device_line != 0) {
        return node_ini_reader_fail(reader, reader->line, "[device] is there twice");
    }
    reader->device_line = reader->line;
    reader->section = NODE_INI_DEVICE;
    return true;
}

static bool begin_channel(node_ini_reader_t *reader, const char *number)
{
    long long index;
    if (!node_text_number(number, &index) || index < 1 || index > PDCP_DEVICE_CHANNELS_MAX) {
        return node_ini_reader_fail(reader, reader->line, "[channel %s]: the index is a number from 1 to %d",
                                    number, PDCP_DEVICE_CHANNELS_MAX);
    }
    reader->index = (unsigned)index - 1;
    if (reader->drafts[reader->index].line != 0) {
        return node_ini_reader_fail(reader, reader->line, "[channel %s] is there twice", number);
    }
    reader->drafts[reader->index].line = reader->line;
    reader->section = NODE_INI_CHANNEL;
    if (reader->index >= reader->channel_last) {
        reader->channel_last = reader->index + 1;
    }
    return true;
}

static bool begin_parameter(node_ini_reader_t *reader, char *numbers)
{
    char *channel_text = strchr(numbers, ' ');
    long long param = 0;
    long long channel = 0;
    if (channel_text != NULL) {
        *channel_text++ = '\0';
    }
    if (!node_text_number(numbers, &param) || param < 0 || param > 255 || channel_text == NULL ||
        !node_text_number(channel_text, &channel) || channel < 0 || channel > 255) {
        return node_ini_reader_fail(reader, reader->line,
                                    "[parameter ID CHANNEL]: both are numbers from 0 to 255");
    }
    if (reader->ini->desc.extra_count == NODE_INI_EXTRAS_MAX) {
        return node_ini_reader_fail(reader, reader->line, "more than %d parameters", NODE_INI_EXTRAS_MAX);
    }
    reader->index = reader->ini->desc.extra_count++;
    pdcp_device_extra_t *extra = &reader->ini->extras[reader->index];
    extra->param = (uint8_t)param;
    extra->channel = (uint8_t)channel;
    extra->len = &reader->ini->extra_lens[reader->index];
    reader->section = NODE_INI_PARAMETER;
    return node_ini_key_begin_value(reader);
}

/* A line that begins a section. inih tells a section only with its first key; an empty one must not go
 * unseen. */
static bool begin_section(node_ini_reader_t *reader, const char *line)
{
    char name[LINE_MAX_CHARS + 1];
    const size_t len = strcspn(line, "]\n");
    reader->section = NODE_INI_NOTHING;
    reader->keys_seen = 0;
    if (line[len] != ']' || len > LINE_MAX_CHARS) {
        return node_ini_reader_fail(reader, reader->line, "a section ends with ]");
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
    return node_ini_reader_fail(reader, reader->line, "unknown section [%s]", name);
}

/* inih asks for one line. Counts lines, so that an error can name its own. */
static char *next_line(char *line, int size, void *ctx)
{
    node_ini_reader_t *reader = ctx;
    if (reader->failed || fgets(line, size, reader->file) == NULL) {
        return NULL;
    }
    reader->line++;
    if (strchr(line, '\n') == NULL && strlen(line) + 1 >= (size_t)size) {
        (void)node_ini_reader_fail(reader, reader->line, "the line is longer than %d characters",
                                   LINE_MAX_CHARS);
        return NULL;
    }
    const char *first = &line[strncmp(line, "\xEF\xBB\xBF", 3) == 0 ? 3 : strspn(line, " \t")];
    return *first != '[' || begin_section(reader, &first[1]) ? line : NULL;
}

/* inih found a key. */
static int on_key(void *ctx, const char *section, const char *name, const char *text)
{
    (void)section; /* begin_section knows it already */
    return node_ini_key_take(ctx, name, text);
}

/* --- the whole --- */

static bool read_all(node_ini_reader_t *reader)
{
    const int bad_line = ini_parse_stream(next_line, reader, on_key, reader);
    if (reader->failed) {
        return false;
    }
    if (ferror(reader->file) != 0) {
        return node_ini_reader_fail(reader, reader->line, "%s", strerror(errno));
    }
    if (bad_line > 0) {
        return node_ini_reader_fail(reader, bad_line, "is neither a section nor key = value");
    }
    if (bad_line < 0) {
        return node_ini_reader_out_of_memory(reader);
    }
    return node_ini_check(reader);
}

node_ini_t *node_ini_load(const char *path, char *error, size_t error_size)
{
    node_ini_reader_t reader = {.path = path, .error = error, .error_size = error_size};
    reader.file = fopen(path, "re");
    if (reader.file == NULL) {
        (void)snprintf(error, error_size, "%s: %s", path, strerror(errno));
        return NULL;
    }
    reader.ini = calloc(1, sizeof *reader.ini);
    const bool good = reader.ini != NULL ? read_all(&reader) : node_ini_reader_out_of_memory(&reader);
    (void)fclose(reader.file);
    node_ini_reader_clear(&reader);
    if (!good) {
        node_ini_free(reader.ini);
        return NULL;
    }
    return reader.ini;
}
