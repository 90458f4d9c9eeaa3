/* Reads the elements of a device description: numbers and file names. */
#ifndef NODE_TEXT_H
#define NODE_TEXT_H

#include <stdbool.h>

/* Decimal, or hexadecimal with 0x; a leading zero is no octal. The whole text must be the number. */
bool node_text_number(const char *text, long long *number);

/* The path of a file that lies relative to the file beside; an absolute path stays. NULL: out of memory. The
 * caller frees it. */
char *node_text_path(const char *beside, const char *path);

#endif
