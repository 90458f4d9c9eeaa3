/* The keys of a device description: one row each. Private to node_ini*.c. */
#ifndef NODE_INI_KEY_H
#define NODE_INI_KEY_H

#include "node_ini_reader.h"

/* Takes a key of the section that the reader is in. False: the reader has failed. */
bool node_ini_key_take(node_ini_reader_t *reader, const char *name, const char *text);

/* Whether [device] had the keys that it needs: vid, pid and serial. */
bool node_ini_key_has_identity(const node_ini_reader_t *reader);

/* Gives the parameter whose section has begun an empty value. False: the reader has failed. */
bool node_ini_key_begin_value(node_ini_reader_t *reader);

#endif
