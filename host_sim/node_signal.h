/* The signals that outputs of a simulated device send. docs/nodes.md lists them. */
#ifndef NODE_SIGNAL_H
#define NODE_SIGNAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "profile_type.h"

typedef enum {
    NODE_SIGNAL_NONE = 0,
    NODE_SIGNAL_CONSTANT,
    NODE_SIGNAL_SINE,
    NODE_SIGNAL_SQUARE,
    NODE_SIGNAL_CSV,
    NODE_SIGNAL_COPY /* of an input; when rate_ms is 0, whenever the input receives */
} node_signal_kind_t;

/* From time_ms of the replay on, the value is this. */
typedef struct {
    uint32_t time_ms;
    int32_t value;
} node_signal_point_t;

/* Values lie within the range of the channel's type. */
typedef struct {
    node_signal_kind_t kind;
    int32_t min; /* constant: the value */
    int32_t max;
    uint32_t period_ms; /* sine, square, csv: of one round; csv with one point: 0, it never changes */
    node_signal_point_t *points; /* csv: by time, the first at 0; freed by node_signal_clear */
    size_t point_count;
    uint8_t source;   /* copy: channel index of the input; whether there is such a one is not checked here */
    uint32_t rate_ms; /* not part of the text: the caller's */
} node_signal_t;

/* Reads a signal for a channel of this type into *signal, which is empty but for rate_ms. beside: the
 * description that a replay's file lies relative to. False: error[] says what is wrong. */
bool node_signal_parse(node_signal_t *signal, const char *text, const profile_type_t *type,
                       const char *beside, char *error, size_t error_size);
void node_signal_clear(node_signal_t *signal);

/* Value at this time since the start, for every kind but copy. */
int32_t node_signal_value(const node_signal_t *signal, uint64_t time_ms);

/* Maps a value from the full range of one type to the full range of another, rounded. Both types have a
 * range. */
int32_t node_signal_scale(int32_t value, const profile_type_t *from, const profile_type_t *to);

#endif
