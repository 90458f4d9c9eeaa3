/* State shared by the parts of node_ini while they read one file. Private to node_ini*.c.
 *
 * node_ini_load reads sections, node_ini_key their keys; node_ini_check checks what needs the whole file. */
#ifndef NODE_INI_READER_H
#define NODE_INI_READER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "node_ini.h"

/* Section that the reader is in. */
typedef enum {
    NODE_INI_NOTHING = 0,
    NODE_INI_DEVICE,
    NODE_INI_CHANNEL,
    NODE_INI_PARAMETER
} node_ini_section_t;

/* A text that is read when the whole file is known; the reader owns it. */
typedef struct {
    int line;
    char *text; /* NULL: not seen */
} node_ini_draft_text_t;

/* What is known of a channel besides its description. */
typedef struct {
    int line; /* of its section, 0: not seen */
    bool typed;
    bool has_safe;
    bool has_rate;
    node_ini_draft_text_t signal;
    node_ini_draft_text_t needs[2]; /* required, desired */
} node_ini_draft_t;

typedef struct {
    node_ini_t *ini;
    FILE *file;
    const char *path;
    int line;
    int device_line;
    node_ini_section_t section;
    unsigned index;        /* channel or extra */
    uint32_t keys_seen;    /* of this section */
    uint32_t device_keys;  /* of [device] */
    unsigned channel_last; /* highest index seen */
    node_ini_draft_t drafts[PDCP_DEVICE_CHANNELS_MAX];
    char *error;
    size_t error_size;
    bool failed;
} node_ini_reader_t;

/* Writes FILE:LINE: and the text to error[]; only the first failure counts. Always false, so that it can be
 * returned. */
__attribute__((format(printf, 3, 4))) bool node_ini_reader_fail(node_ini_reader_t *reader, int line,
                                                                const char *format, ...);
bool node_ini_reader_out_of_memory(node_ini_reader_t *reader);

/* Frees the drafts. */
void node_ini_reader_clear(node_ini_reader_t *reader);

#endif
