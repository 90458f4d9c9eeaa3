#include "complaint.h"

#include <stdio.h>
#include <string.h>

enum { ESCAPED = 4 /* characters of \xNN */ };

/* Characters that are not shown as they are: how their bytes begin, and the range of the last one. */
static const struct {
    const char *lead;
    unsigned char first;
    unsigned char last;
} unsafe_characters[] = {
    {"", 0x01, 0x1F},         /* controls */
    {"", 0x7F, 0x7F},         /* and delete */
    {"\xC2", 0x80, 0x9F},     /* U+0080 to U+009F: controls */
    {"\xE2\x80", 0x8E, 0x8F}, /* U+200E, U+200F: marks of direction */
    {"\xE2\x80", 0xA8, 0xAE}, /* U+2028 to U+202E: ends of lines, embeddings, overrides */
    {"\xE2\x81", 0xA6, 0xA9}, /* U+2066 to U+2069: isolates */
};

/* How many bytes at the beginning of the text have to be escaped. */
static size_t unsafe_bytes(const char *text)
{
    for (size_t i = 0; i < sizeof unsafe_characters / sizeof unsafe_characters[0]; i++) {
        const char *lead = unsafe_characters[i].lead;
        const size_t len = strlen(lead);
        if (strncmp(text, lead, len) != 0) {
            continue;
        }
        const unsigned char end = (unsigned char)text[len];
        if (end >= unsafe_characters[i].first && end <= unsafe_characters[i].last) {
            return len + 1;
        }
    }
    return 0;
}

void complaint_escape(char *line, size_t size, const char *text)
{
    size_t len = 0;
    size_t unsafe = 0;
    for (; *text != '\0' && len + ESCAPED < size; text++) {
        if (unsafe == 0) {
            unsafe = unsafe_bytes(text);
        }
        if (unsafe == 0) {
            line[len++] = *text;
        } else {
            unsafe--;
            len += (size_t)snprintf(&line[len], size - len, "\\x%02X", (unsigned)(unsigned char)*text);
        }
    }
    line[len] = '\0';
}

void complaint_say(const char *program, const char *text)
{
    char line[COMPLAINT_TEXT];
    complaint_escape(line, sizeof line, text);
    (void)fprintf(stderr, "%s: %s\n", program, line);
}
