#include "node_signal.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "node_text.h"

enum { PERIOD_MIN_MS = 2, PERIOD_MAX_MS = 3600000, REPLAY_MAX_MS = 86400000, PARTS_MAX = 4 };

/* One signal while it is read. */
typedef struct {
    node_signal_t *signal;
    const profile_type_t *type;
    const char *beside;
    char *parts[PARTS_MAX]; /* words of the text */
    char *error;
    size_t error_size;
} reader_t;

/* --- reading --- */

/* Always false, so that it can be returned. */
__attribute__((format(printf, 2, 3))) static bool fail(reader_t *reader, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    (void)vsnprintf(reader->error, reader->error_size, format, args);
    va_end(args);
    return false;
}

static bool in_range(const profile_type_t *type, long long number)
{
    int32_t min = 0;
    int32_t max = 0;
    return profile_type_range(type, &min, &max) && number >= min && number <= max;
}

static bool take_level(reader_t *reader, const char *text, int32_t *level)
{
    long long number;
    if (!node_text_number(text, &number)) {
        return fail(reader, "'%s' is not a number", text);
    }
    if (!in_range(reader->type, number)) {
        return fail(reader, "%s does not fit the channel's type", text);
    }
    *level = (int32_t)number;
    return true;
}

static bool take_constant(reader_t *reader)
{
    return take_level(reader, reader->parts[1], &reader->signal->min);
}

/* sine and square. */
static bool take_wave(reader_t *reader)
{
    node_signal_t *signal = reader->signal;
    long long period;
    if (!take_level(reader, reader->parts[1], &signal->min) ||
        !take_level(reader, reader->parts[2], &signal->max)) {
        return false;
    }
    if (signal->min > signal->max) {
        return fail(reader, "%s is more than %s", reader->parts[1], reader->parts[2]);
    }
    if (!node_text_number(reader->parts[3], &period) || period < PERIOD_MIN_MS || period > PERIOD_MAX_MS) {
        return fail(reader, "the period is a number from %d to %d ms", PERIOD_MIN_MS, PERIOD_MAX_MS);
    }
    signal->period_ms = (uint32_t)period;
    return true;
}

static bool take_copy(reader_t *reader)
{
    long long source;
    if (!node_text_number(reader->parts[1], &source) || source < 1 || source > UINT8_MAX) {
        return fail(reader, "%s is not an input of this device", reader->parts[1]);
    }
    reader->signal->source = (uint8_t)source;
    return true;
}

static bool add_point(reader_t *reader, long long time_ms, long long value)
{
    node_signal_t *signal = reader->signal;
    node_signal_point_t *points = realloc(signal->points, (signal->point_count + 1) * sizeof *points);
    if (points == NULL) {
        return fail(reader, "out of memory");
    }
    points[signal->point_count].time_ms = (uint32_t)time_ms;
    points[signal->point_count].value = (int32_t)value;
    signal->points = points;
    signal->point_count++;
    return true;
}

/* One line of a replay: time_ms,value. Empty lines and those that begin with # are skipped. */
static bool take_point(reader_t *reader, const char *path, unsigned line, char *text)
{
    const node_signal_t *signal = reader->signal;
    long long time_ms;
    long long value;
    text[strcspn(text, "\r\n")] = '\0';
    if (text[0] == '\0' || text[0] == '#') {
        return true;
    }
    char *comma = strchr(text, ',');
    if (comma != NULL) {
        *comma++ = '\0';
        comma += strspn(comma, " \t");
    }
    if (comma == NULL || !node_text_number(text, &time_ms) || !node_text_number(comma, &value)) {
        return fail(reader, "%s:%u: not of the form time_ms,value", path, line);
    }
    if (!in_range(reader->type, value)) {
        return fail(reader, "%s:%u: %s does not fit the channel's type", path, line, comma);
    }
    const long long least_ms =
        signal->point_count == 0 ? 0 : (long long)signal->points[signal->point_count - 1].time_ms + 1;
    if (time_ms < least_ms || time_ms > (signal->point_count == 0 ? 0 : REPLAY_MAX_MS)) {
        return fail(reader, "%s:%u: times begin with 0 and rise, to one day at most", path, line);
    }
    return add_point(reader, time_ms, value);
}

static bool take_points(reader_t *reader, const char *path)
{
    node_signal_t *signal = reader->signal;
    char text[128];
    FILE *file = fopen(path, "re");
    if (file == NULL) {
        return fail(reader, "%s: %s", path, strerror(errno));
    }
    bool good = true;
    for (unsigned line = 1; good && fgets(text, sizeof text, file) != NULL; line++) {
        good = take_point(reader, path, line, text);
    }
    (void)fclose(file);
    if (good && signal->point_count == 0) {
        return fail(reader, "%s: no values", path);
    }
    /* The last value holds as long as the one before it, then the first one follows. */
    if (good && signal->point_count > 1) {
        const node_signal_point_t *last = &signal->points[signal->point_count - 1];
        signal->period_ms = last->time_ms + (last->time_ms - (last - 1)->time_ms);
    }
    return good;
}

static bool take_csv(reader_t *reader)
{
    char *path = node_text_path(reader->beside, reader->parts[1]);
    const bool good = path != NULL ? take_points(reader, path) : fail(reader, "out of memory");
    free(path);
    return good;
}

static const struct {
    const char *word;
    node_signal_kind_t kind;
    size_t parts; /* with the word itself */
    const char *usage;
    bool (*take)(reader_t *reader);
} words[] = {
    {"constant", NODE_SIGNAL_CONSTANT, 2, "constant VALUE", take_constant},
    {"sine", NODE_SIGNAL_SINE, 4, "sine MIN MAX PERIOD_MS", take_wave},
    {"square", NODE_SIGNAL_SQUARE, 4, "square MIN MAX PERIOD_MS", take_wave},
    {"csv", NODE_SIGNAL_CSV, 2, "csv FILE", take_csv},
    {"copy", NODE_SIGNAL_COPY, 2, "copy CHANNEL", take_copy},
};

/* Splits text at blanks. Returns how many parts there are; more than PARTS_MAX means too many. */
static size_t split(reader_t *reader, char *text)
{
    size_t count = 0;
    for (char *part = NULL; (part = strsep(&text, " \t")) != NULL;) {
        if (part[0] == '\0') {
            continue;
        }
        if (count < PARTS_MAX) {
            reader->parts[count] = part;
        }
        count++;
    }
    return count;
}

static bool take_signal(reader_t *reader, char *text)
{
    const size_t count = split(reader, text);
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (count == 0 || strcmp(reader->parts[0], words[i].word) != 0) {
            continue;
        }
        reader->signal->kind = words[i].kind;
        return count == words[i].parts ? words[i].take(reader)
                                       : fail(reader, "is written %s", words[i].usage);
    }
    return fail(reader, "is constant, sine, square, csv or copy");
}

bool node_signal_parse(node_signal_t *signal, const char *text, const profile_type_t *type,
                       const char *beside, char *error, size_t error_size)
{
    reader_t reader = {
        .signal = signal, .type = type, .beside = beside, .error = error, .error_size = error_size};
    char *copy = strdup(text);
    const bool good = copy != NULL ? take_signal(&reader, copy) : fail(&reader, "out of memory");
    free(copy);
    return good;
}

void node_signal_clear(node_signal_t *signal)
{
    free(signal->points);
    memset(signal, 0, sizeof *signal);
}

/* --- values --- */

static int32_t sine_value(const node_signal_t *signal, uint64_t time_ms)
{
    const double turn = (double)(time_ms % signal->period_ms) / (double)signal->period_ms;
    const double middle = ((double)signal->min + (double)signal->max) / 2.0;
    const double swing = ((double)signal->max - (double)signal->min) / 2.0;
    return (int32_t)lround(middle + swing * sin(turn * 2.0 * 3.14159265358979323846));
}

static int32_t csv_value(const node_signal_t *signal, uint64_t time_ms)
{
    const uint64_t at_ms = signal->period_ms != 0 ? time_ms % signal->period_ms : 0;
    size_t i = signal->point_count - 1;
    while (i > 0 && signal->points[i].time_ms > at_ms) {
        i--;
    }
    return signal->points[i].value;
}

int32_t node_signal_value(const node_signal_t *signal, uint64_t time_ms)
{
    switch (signal->kind) {
    case NODE_SIGNAL_SINE:
        return sine_value(signal, time_ms);
    case NODE_SIGNAL_SQUARE: /* the lower half first */
        return time_ms % signal->period_ms < signal->period_ms / 2 ? signal->min : signal->max;
    case NODE_SIGNAL_CSV:
        return csv_value(signal, time_ms);
    default:
        return signal->min;
    }
}

int32_t node_signal_scale(int32_t value, const profile_type_t *from, const profile_type_t *to)
{
    int32_t from_min = 0;
    int32_t from_max = 1;
    int32_t to_min = 0;
    int32_t to_max = 1;
    (void)profile_type_range(from, &from_min, &from_max);
    (void)profile_type_range(to, &to_min, &to_max);
    const int64_t span = (int64_t)from_max - from_min;
    const int64_t scaled = ((int64_t)value - from_min) * ((int64_t)to_max - to_min);
    return (int32_t)(to_min + (scaled + span / 2) / span);
}
