#include "node_text.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool node_text_number(const char *text, long long *number)
{
    const char *digits = text[0] == '-' ? &text[1] : text;
    const bool hex = digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X');
    char *end = NULL;
    if (!isdigit((unsigned char)digits[0])) {
        return false;
    }
    errno = 0;
    *number = strtoll(text, &end, hex ? 16 : 10);
    return errno == 0 && end != text && *end == '\0';
}

char *node_text_path(const char *beside, const char *path)
{
    const char *slash = strrchr(beside, '/');
    char *joined = NULL;
    if (path[0] == '/' || slash == NULL) {
        return strdup(path);
    }
    return asprintf(&joined, "%.*s%s", (int)(slash - beside + 1), beside, path) >= 0 ? joined : NULL;
}
