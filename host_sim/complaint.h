/* Reports an error as one line on standard error, safe for a terminal. */
#ifndef COMPLAINT_H
#define COMPLAINT_H

#include <stddef.h>

enum { COMPLAINT_TEXT = 1024 };

/* Writes "PROGRAM: TEXT". The text may quote a file: see complaint_escape. */
void complaint_say(const char *program, const char *text);

/* Copies UTF-8 text. Control characters, which steer a terminal, and those that turn the direction of writing
 * become \xNN, byte by byte. Longer text than line[] holds is cut. */
void complaint_escape(char *line, size_t size, const char *text);

#endif
