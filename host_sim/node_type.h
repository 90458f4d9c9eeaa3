/* Reads a channel type as a device description writes it. docs/nodes.md lists the words. */
#ifndef NODE_TYPE_H
#define NODE_TYPE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "profile_type.h"

/* Reads a type, as words ("8bit unsigned terminal") or as the number of parameter 8, into both of its forms.
 * False: error[] says what is wrong, and what was read is undefined. A float is refused: it cannot be
 * simulated. */
bool node_type_parse(const char *text, uint16_t *word, profile_type_t *type, char *error, size_t error_size);

#endif
