/* Keeps the writable parameters of a simulated device in a text file that people can read and edit:
 *
 *   node_id 16
 *   source 1 0002 0002 0004 1 5000 2120
 *
 * A source line holds the input, then VID, PID and serial number (hexadecimal), the channel index, and type
 * and profile (hexadecimal). A write replaces the file as a whole: a reader sees the old one or the new
 * one. */
#ifndef NODE_STATE_H
#define NODE_STATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "pdcp_device.h"

/* Everything unconnected, no node id. */
void node_state_blank(pdcp_device_record_t *record);

/* Reads the file into record, which starts blank. A file that does not exist is no error. False: error[]
 * holds one line. */
bool node_state_load(const char *path, pdcp_device_record_t *record, char *error, size_t error_size);

/* channel_count: how many sources are written at most. False: errno says why; the old file still stands. */
bool node_state_save(const char *path, const pdcp_device_record_t *record, uint8_t channel_count);

#endif
