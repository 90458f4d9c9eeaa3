/* Opening the host's byte stream on Linux. What can be done with it then stands in hal_uart.h.
 *
 * PORT is pty or pty:LINKPATH, a new pseudo-terminal in raw mode; with LINKPATH a symbolic link to it is
 * made, replacing a stale one, and removed at the end. A path that is no symbolic link is never replaced.
 *
 * When the last host closes its end, what it has not read is thrown away and the end is put back into raw
 * mode. A host that reopens before the loop has come round may still find bytes that were meant for the one
 * before. */
#ifndef LINUX_UART_H
#define LINUX_UART_H

#include <stddef.h>

#include "hal_uart.h"
#include "loop.h"

/* Called from the loop when bytes may be waiting (take them until hal_uart_read gives 0) or when there is
 * room to write again. */
typedef void (*linux_uart_ready_t)(void *ctx);

/* NULL: error[] holds one line that names the port and the reason. The caller owns the result and closes it
 * before the loop. */
hal_uart_t *linux_uart_open(loop_t *loop, const char *port, linux_uart_ready_t ready, void *ctx, char *error,
                            size_t error_size);
void linux_uart_close(hal_uart_t *uart);

/* Path that a host opens: the pseudo-terminal's own name, not the link. Valid until closed. */
const char *linux_uart_path(const hal_uart_t *uart);

#endif
