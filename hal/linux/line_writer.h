/* Writes lines for people and other programs, and never blocks the caller (D-LIN-6).
 *
 * A thread writes from a buffer of LINE_WRITER_BYTES. Only that thread waits for a stopped terminal (Ctrl-S),
 * a pipe that nobody reads, or a slow disk. Lines that do not fit are lost; once there is room again, a line
 * says how many. Call all functions from one thread. */
#ifndef LINE_WRITER_H
#define LINE_WRITER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { LINE_WRITER_BYTES = 256 * 1024, LINE_WRITER_LINE_MAX = 512 };

typedef struct line_writer line_writer_t;

/* Writes to fd, which must stay open until line_writer_close. before and after: the text around the number in
 * the line that tells of lost lines, without its end; they must outlive the writer. NULL: errno says why. */
line_writer_t *line_writer_open(int fd, const char *before, const char *after);

/* Waits up to patience_ms for what is left to be written, then throws it away. NULL: does nothing. */
void line_writer_close(line_writer_t *writer, unsigned patience_ms);

/* Puts one line; its end is added. Longer lines than LINE_WRITER_LINE_MAX - 1 bytes are cut. */
void line_writer_put(line_writer_t *writer, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Lines lost so far: no room, or the disk is full. */
uint64_t line_writer_lost(line_writer_t *writer);

/* Has the reader closed its end? Then nothing is written any more. */
bool line_writer_is_broken(line_writer_t *writer);

#endif
