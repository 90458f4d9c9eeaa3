/* One simulated device, described by an INI file. docs/nodes.md has the format. */
#ifndef NODE_INI_H
#define NODE_INI_H

#include <stddef.h>
#include <stdint.h>

#include "node_signal.h"
#include "pdcp_device.h"
#include "profile_type.h"

#define NODE_INI_RATE_MS 100u /* rate_ms of an output that names none */
#define NODE_INI_EXTRAS_MAX 8

typedef struct {
    pdcp_device_desc_t desc; /* points into this struct */
    profile_type_t types[PDCP_DEVICE_CHANNELS_MAX];
    node_signal_t signals[PDCP_DEVICE_CHANNELS_MAX];
    uint8_t first_node_id; /* asked for when no state is kept; 0: a random one */
    char *state_path;      /* where writable parameters are kept; NULL: nowhere */

    /* What desc points to. */
    pdcp_device_channel_desc_t channels[PDCP_DEVICE_CHANNELS_MAX];
    uint8_t needs[PDCP_DEVICE_CHANNELS_MAX][2][PDCP_DEVICE_CHANNELS_MAX / 8 + 1]; /* required, desired */
    pdcp_device_extra_t extras[NODE_INI_EXTRAS_MAX];
    uint16_t extra_lens[NODE_INI_EXTRAS_MAX];
    char *texts[PDCP_DEVICE_CHANNELS_MAX + 1]; /* descriptors; the device's is the first */
} node_ini_t;

/* Reads a description. NULL: error[] holds one line, FILE:LINE: what is wrong, or FILE: why it cannot be
 * read. The caller owns the result, and everything that uses its desc must end before node_ini_free. */
node_ini_t *node_ini_load(const char *path, char *error, size_t error_size);
void node_ini_free(node_ini_t *ini);

#endif
