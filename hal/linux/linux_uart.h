/* Opens the host's byte stream on Linux. hal_uart.h says what an open one can do.
 *
 * PORT is one of
 *
 *   pty, pty:LINKPATH       a new pseudo-terminal in raw mode; with LINKPATH a symbolic link to it is made and
 *                           removed at the end. LINKPATH.lock is locked as long as the link is ours. A link
 *                           that a crash has left is replaced: its lock is free, or it leads nowhere. Nothing
 *                           else is ever replaced (D-LIN-4)
 *   serial:DEVICE[@BAUD]    a serial line, raw, 8N1, for this program alone; any rate that the driver can
 *                           make, 128000 when none is given. While its adapter is pulled out there is no host
 *
 * When the last host of a pseudo-terminal closes its end, unread bytes are discarded and the terminal returns
 * to raw mode. A host that opens it before the loop has noticed may still read bytes meant for the previous
 * host. */
#ifndef LINUX_UART_H
#define LINUX_UART_H

#include <stdbool.h>
#include <stddef.h>

#include "hal_uart.h"
#include "loop.h"

/* Called from the loop when bytes may be waiting, or when there is room to write again. Take bytes until
 * hal_uart_read gives 0, now or later: those that are left are not told of again. */
typedef void (*linux_uart_ready_t)(void *ctx);

/* Can PORT be right? If so, and it cannot be opened, something outside is missing now. */
bool linux_uart_is_port(const char *port);

/* NULL: error[] holds one line that names the port and the reason. The caller owns the result and closes it
 * before the loop. */
hal_uart_t *linux_uart_open(loop_t *loop, const char *port, linux_uart_ready_t ready, void *ctx, char *error,
                            size_t error_size);
void linux_uart_close(hal_uart_t *uart);

/* Path that a host opens: the pseudo-terminal's own name, not the link; of a serial line the device. Valid
 * until closed. */
const char *linux_uart_path(const hal_uart_t *uart);

/* True, once: the host has closed its end since the last call, or the adapter was pulled out. Bytes that it
 * has sent before were all taken. A host that closes and reopens a serial line is not seen. */
bool linux_uart_host_left(hal_uart_t *uart);

#endif
