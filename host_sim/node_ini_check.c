#include "node_ini_check.h"

#include <stdlib.h>
#include <string.h>

#include "node_ini_key.h"
#include "node_text.h"

enum { BULK_MIN = 16 };

static bool is_input(const node_ini_reader_t *reader, long long channel)
{
    return channel >= 1 && channel <= (long long)reader->channel_last &&
           reader->ini->channels[channel - 1].direction == PDCP_INPUT;
}

static bool take_signal(node_ini_reader_t *reader, unsigned index)
{
    const node_ini_draft_t *draft = &reader->drafts[index];
    node_signal_t *signal = &reader->ini->signals[index];
    char error[256];
    if (!node_signal_parse(signal, draft->signal.text, &reader->ini->types[index], reader->path, error,
                           sizeof error)) {
        return node_ini_reader_fail(reader, draft->signal.line, "signal: %s", error);
    }
    if (signal->kind == NODE_SIGNAL_COPY && !is_input(reader, signal->source)) {
        return node_ini_reader_fail(reader, draft->signal.line, "signal: %d is not an input of this device",
                                    signal->source);
    }
    if (!draft->has_rate && signal->kind != NODE_SIGNAL_COPY) {
        signal->rate_ms = NODE_INI_RATE_MS;
    }
    return true;
}

/* which: 0 required, 1 desired. */
static bool take_needs(node_ini_reader_t *reader, unsigned index, unsigned which)
{
    const int line = reader->drafts[index].needs[which].line;
    const char *const key = which == 0 ? "required" : "desired";
    uint8_t *bits = reader->ini->needs[index][which];
    pdcp_device_channel_desc_t *channel = &reader->ini->channels[index];
    pdcp_device_bytes_t *out = which == 0 ? &channel->required : &channel->desired;
    char *rest = reader->drafts[index].needs[which].text;
    for (char *part = NULL; (part = strsep(&rest, " ,\t")) != NULL;) {
        long long number = 0;
        if (part[0] == '\0') {
            continue;
        }
        if (!node_text_number(part, &number) || !is_input(reader, number)) {
            return node_ini_reader_fail(reader, line, "%s: %s is not an input of this device", key, part);
        }
        bits[number / 8] = (uint8_t)(bits[number / 8] | (0x80u >> (number % 8))); /* D-BUS-8 */
        if (out->len < number / 8 + 1) {
            out->len = (uint16_t)(number / 8 + 1);
        }
    }
    out->bytes = bits;
    return true;
}

static bool check_input(node_ini_reader_t *reader, unsigned index)
{
    const node_ini_draft_t *draft = &reader->drafts[index];
    const pdcp_device_channel_desc_t *channel = &reader->ini->channels[index];
    int32_t min = 0;
    int32_t max = 0;
    if (draft->signal.text != NULL || draft->has_rate) {
        return node_ini_reader_fail(reader, draft->line,
                                    "[channel %u]: an input has no signal and no rate_ms", index + 1);
    }
    if (draft->has_safe && !channel->terminal) {
        return node_ini_reader_fail(reader, draft->line,
                                    "[channel %u]: only a terminal input has a safe value", index + 1);
    }
    (void)profile_type_range(&reader->ini->types[index], &min, &max);
    if (channel->safe < min || channel->safe > max) {
        return node_ini_reader_fail(reader, draft->line, "[channel %u]: the safe value does not fit the type",
                                    index + 1);
    }
    return true;
}

static bool check_output(node_ini_reader_t *reader, unsigned index)
{
    const node_ini_draft_t *draft = &reader->drafts[index];
    const pdcp_device_channel_desc_t *channel = &reader->ini->channels[index];
    if (draft->has_safe || channel->terminal_profile != 0 || channel->terminal) {
        return node_ini_reader_fail(
            reader, draft->line,
            "[channel %u]: safe, terminal_profile and the type's terminal are for inputs", index + 1);
    }
    return draft->signal.text == NULL || take_signal(reader, index);
}

static bool check_channel(node_ini_reader_t *reader, unsigned index)
{
    const node_ini_draft_t *draft = &reader->drafts[index];
    const pdcp_device_channel_desc_t *channel = &reader->ini->channels[index];
    if (draft->line == 0) {
        return node_ini_reader_fail(reader, reader->drafts[reader->channel_last - 1].line,
                                    "[channel %u] is missing", index + 1);
    }
    if (channel->direction == 0 || !draft->typed) {
        return node_ini_reader_fail(reader, draft->line, "[channel %u]: needs %s", index + 1,
                                    channel->direction == 0 ? "direction" : "type");
    }
    return (channel->direction == PDCP_INPUT ? check_input(reader, index) : check_output(reader, index)) &&
           take_needs(reader, index, 0) && take_needs(reader, index, 1);
}

static bool check_device(node_ini_reader_t *reader)
{
    if (reader->device_line == 0) {
        return node_ini_reader_fail(reader, reader->line != 0 ? reader->line : 1, "[device] is missing");
    }
    if (!node_ini_key_has_identity(reader)) {
        return node_ini_reader_fail(reader, reader->device_line, "[device]: needs vid, pid and serial");
    }
    for (unsigned i = 0; i < reader->channel_last; i++) {
        if (!check_channel(reader, i)) {
            return false;
        }
    }
    return true;
}

static bool complete(node_ini_reader_t *reader)
{
    node_ini_t *ini = reader->ini;
    size_t longest = BULK_MIN;
    for (uint8_t i = 0; i < ini->desc.extra_count; i++) {
        if (ini->extras[i].channel > reader->channel_last) {
            return node_ini_reader_fail(reader, reader->line, "[parameter %d %d]: there is no such channel",
                                        ini->extras[i].param, ini->extras[i].channel);
        }
        if (ini->extras[i].capacity > longest) {
            longest = ini->extras[i].capacity;
        }
    }
    ini->desc.bulk = malloc(longest);
    if (ini->desc.bulk == NULL) {
        return node_ini_reader_out_of_memory(reader);
    }
    ini->desc.bulk_capacity = (uint16_t)longest;
    ini->desc.channels = ini->channels;
    ini->desc.channel_count = (uint8_t)reader->channel_last;
    ini->desc.extras = ini->extras;
    return true;
}

bool node_ini_check(node_ini_reader_t *reader)
{
    return check_device(reader) && complete(reader);
}
