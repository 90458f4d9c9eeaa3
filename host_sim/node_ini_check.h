/* Checks of a device description that need the whole file. Private to node_ini*.c. */
#ifndef NODE_INI_CHECK_H
#define NODE_INI_CHECK_H

#include "node_ini_reader.h"

/* Judges the file when all of it has been read, takes its drafts, and completes the description. False: the
 * reader has failed. */
bool node_ini_check(node_ini_reader_t *reader);

#endif
