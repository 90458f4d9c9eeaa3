/* Contract: the byte stream to the host (UART on a microcontroller, pty or serial port on Linux).
 *
 * No function blocks; call all of them from the main loop. It is no error if the host is absent, or closes
 * and reopens its end: bytes written in the meantime are discarded. */
#ifndef HAL_UART_H
#define HAL_UART_H

#include <stddef.h>
#include <stdint.h>

typedef struct hal_uart hal_uart_t;

/* Takes up to size received bytes, oldest first. Returns how many; 0 means that there are none now. */
size_t hal_uart_read(hal_uart_t *uart, uint8_t *bytes, size_t size);

/* Hands up to size bytes over; they are copied. Returns how many were taken, in order from the first;
 * less than size means that there is no more room now, and the caller offers the rest again. On a line with a
 * baud rate no more than it carries within some 20 ms waits behind this, so that what comes next is never
 * late. */
size_t hal_uart_write(hal_uart_t *uart, const uint8_t *bytes, size_t size);

#endif
