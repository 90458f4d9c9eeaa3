#include "socketcand_text.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define EXTENDED_ID_MAX 0x1FFFFFFFu
#define ID_DIGITS_MAX 8u
#define BASE_ID_DIGITS 3u
#define MICROSECONDS_PER_S 1000000u

/* --- elements --- */

static socketcand_text_event_t begin_element(socketcand_text_splitter_t *splitter)
{
    splitter->inside = true;
    splitter->cut = false;
    splitter->stray = false;
    splitter->length = 0;
    return SOCKETCAND_TEXT_MORE;
}

static socketcand_text_event_t take_stray(socketcand_text_splitter_t *splitter, char c)
{
    if (splitter->stray || socketcand_text_is_space(c)) {
        return SOCKETCAND_TEXT_MORE;
    }
    splitter->stray = true;
    return SOCKETCAND_TEXT_STRAY;
}

static socketcand_text_event_t take_inside(socketcand_text_splitter_t *splitter, char c)
{
    if (splitter->length < splitter->longest) {
        splitter->text[splitter->length++] = c;
        return SOCKETCAND_TEXT_MORE;
    }
    if (splitter->cut) {
        return SOCKETCAND_TEXT_MORE;
    }
    splitter->cut = true;
    return SOCKETCAND_TEXT_TOO_LONG;
}

socketcand_text_event_t socketcand_text_take(socketcand_text_splitter_t *splitter, char c)
{
    if (c == '<' && (!splitter->inside || splitter->restarts)) {
        return begin_element(splitter);
    }
    if (!splitter->inside) {
        return take_stray(splitter, c);
    }
    if (c != '>') {
        return take_inside(splitter, c);
    }
    splitter->inside = false;
    return SOCKETCAND_TEXT_ELEMENT;
}

socketcand_text_t socketcand_text_element(const socketcand_text_splitter_t *splitter)
{
    return (socketcand_text_t){.text = splitter->text, .length = splitter->length};
}

/* --- words --- */

bool socketcand_text_is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

bool socketcand_text_next(socketcand_text_t *rest, socketcand_text_t *word)
{
    const char *at = rest->text;
    const char *end = at + rest->length;
    while (at < end && socketcand_text_is_space(*at)) {
        at++;
    }
    word->text = at;
    while (at < end && !socketcand_text_is_space(*at)) {
        at++;
    }
    word->length = (size_t)(at - word->text);
    rest->text = at;
    rest->length = (size_t)(end - at);
    return word->length > 0;
}

size_t socketcand_text_split(socketcand_text_t text, socketcand_text_t *words, size_t max)
{
    size_t count = 0;
    while (count < max && socketcand_text_next(&text, &words[count])) {
        count++;
    }
    return count;
}

bool socketcand_text_is(socketcand_text_t word, const char *expected)
{
    return word.length == strlen(expected) && memcmp(word.text, expected, word.length) == 0;
}

/* --- numbers --- */

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    if (c >= 'a' && c <= 'f') {
        return c - 'a' + 10;
    }
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* False: the word is not one to digits_max (at most 8) hexadecimal digits. */
static bool parse_hex(socketcand_text_t word, size_t digits_max, uint32_t *value)
{
    *value = 0;
    if (word.length == 0 || word.length > digits_max) {
        return false;
    }
    for (size_t i = 0; i < word.length; i++) {
        int digit = hex_digit(word.text[i]);
        if (digit < 0) {
            return false;
        }
        *value = *value << 4 | (uint32_t)digit;
    }
    return true;
}

/* Sets kind and identifier of *frame; *id is the identifier as written. Returns what is wrong, or NULL. */
static const char *parse_id(socketcand_text_t word, uint32_t *id, can_frame_t *frame)
{
    if (!parse_hex(word, ID_DIGITS_MAX, id)) {
        return "identifier is not one to eight hexadecimal digits";
    }
    if (word.length > BASE_ID_DIGITS) {
        frame->kind = CAN_FRAME_EXTENDED;
        return NULL;
    }
    if (*id > CAN_FRAME_ID_MAX) {
        return "identifier over 7FF with three digits";
    }
    frame->kind = CAN_FRAME_BASE;
    frame->id = (uint16_t)*id;
    return NULL;
}

/* --- frames --- */

/* Reads pairs of digits to the end; blanks may stand between them. */
static bool parse_data(socketcand_text_t rest, can_frame_t *frame)
{
    size_t bytes = 0;
    socketcand_text_t word;
    while (socketcand_text_next(&rest, &word)) {
        for (size_t i = 0; i < word.length; i += 2, bytes++) {
            uint32_t value;
            socketcand_text_t pair = {.text = word.text + i, .length = 2};
            if (i + 1 >= word.length || !parse_hex(pair, 2, &value)) {
                return false;
            }
            if (bytes < CAN_FRAME_DATA_MAX) {
                frame->data[bytes] = (uint8_t)value;
            }
        }
    }
    if (bytes > CAN_FRAME_DATA_MAX) {
        frame->kind = CAN_FRAME_FD;
        frame->id = 0;
    }
    frame->dlc = (uint8_t)(bytes > CAN_FRAME_DATA_MAX ? CAN_FRAME_DATA_MAX : bytes);
    return true;
}

bool socketcand_text_parse_frame(socketcand_text_t rest, can_frame_t *frame)
{
    socketcand_text_t id_word;
    socketcand_text_t time;
    uint32_t id;
    *frame = (can_frame_t){0};
    (void)socketcand_text_next(&rest, &id_word);
    return parse_id(id_word, &id, frame) == NULL && socketcand_text_next(&rest, &time) &&
           parse_data(rest, frame);
}

bool socketcand_text_parse_error(socketcand_text_t rest)
{
    socketcand_text_t id;
    socketcand_text_t time;
    uint32_t value;
    (void)socketcand_text_next(&rest, &id);
    return socketcand_text_next(&rest, &time) && parse_hex(id, ID_DIGITS_MAX, &value) &&
           memchr(time.text, '.', time.length) != NULL;
}

const char *socketcand_text_parse_send(const socketcand_text_t *words, size_t count, can_frame_t *frame)
{
    uint32_t value;
    *frame = (can_frame_t){0};
    const char *wrong = parse_id(words[0], &value, frame);
    if (wrong != NULL) {
        return wrong;
    }
    if (value > EXTENDED_ID_MAX) {
        return "identifier over 1FFFFFFF";
    }
    if (!parse_hex(words[1], 1, &value) || value > CAN_FRAME_DATA_MAX) {
        return "DLC is not 0 to 8";
    }
    frame->dlc = (uint8_t)value;
    if (count - 2 != frame->dlc) {
        return "DLC and number of data bytes differ";
    }
    for (size_t i = 0; i < frame->dlc; i++) {
        if (!parse_hex(words[2 + i], 2, &value)) {
            return "data byte is not one or two hexadecimal digits";
        }
        frame->data[i] = (uint8_t)value;
    }
    return NULL;
}

static unsigned data_length(const can_frame_t *frame)
{
    return frame->dlc > CAN_FRAME_DATA_MAX ? CAN_FRAME_DATA_MAX : frame->dlc;
}

size_t socketcand_text_format_frame(char *line, size_t size, uint64_t time_us, const can_frame_t *frame)
{
    char data[2 * CAN_FRAME_DATA_MAX + 1] = "";
    int id_digits = frame->kind == CAN_FRAME_EXTENDED ? (int)ID_DIGITS_MAX : (int)BASE_ID_DIGITS;
    for (unsigned i = 0; i < data_length(frame); i++) {
        snprintf(&data[2 * i], 3, "%02X", frame->data[i]);
    }
    return (size_t)snprintf(line, size, "< frame %0*X %" PRIu64 ".%06u %s >", id_digits, frame->id,
                            time_us / MICROSECONDS_PER_S, (unsigned)(time_us % MICROSECONDS_PER_S), data);
}

size_t socketcand_text_format_send(char *line, size_t size, const can_frame_t *frame)
{
    char data[3 * CAN_FRAME_DATA_MAX + 1] = "";
    for (unsigned i = 0, at = 0; i < data_length(frame); i++) {
        at += (unsigned)snprintf(data + at, sizeof data - at, " %X", frame->data[i]);
    }
    return (size_t)snprintf(line, size, "< send %03X %u%s >", frame->id & CAN_FRAME_ID_MAX,
                            data_length(frame), data);
}
