/* UART1, 8N1, as the byte stream to the host (hal_uart.h). Each direction has a ring of 128 bytes: 10 ms at
 * 128000 baud, 22 ms at 57600. Lost bytes are counted: those that find the ring full, those with a framing
 * error, and those that overran the receiver while the processor was stalled. */
#ifndef UART1_H
#define UART1_H

#include <stdbool.h>
#include <stdint.h>

#include "board.h"
#include "hal_uart.h"
#include "part.h"

/* The rate generator's value for a baud rate, BRGH = 1: FCY / 4 / baud - 1, rounded. The other setting, FCY /
 * 16, is 0.9 % off at 57600. */
#define UART1_BRG(baud) ((uint16_t)((BOARD_FCY / 4u + (baud) / 2u) / (baud)-1u))

/* How far off the rate is, in parts of 10000. */
#define UART1_RATE(baud) (BOARD_FCY / 4u / (UART1_BRG(baud) + 1u))
#define UART1_OFF(baud)                                                                                      \
    ((UART1_RATE(baud) > (baud) ? UART1_RATE(baud) - (baud) : (baud)-UART1_RATE(baud)) * 10000u / (baud))

PART_ASSERT(uart1_57600_within_half_a_percent, UART1_OFF(57600uL) < 50u);
PART_ASSERT(uart1_128000_within_half_a_percent, UART1_OFF(128000uL) < 50u);

/* Opens the line; brg is UART1_BRG of its rate. The only one there is. */
hal_uart_t *uart1_open(uint16_t brg);

/* Bytes can be read, or there is room again after a write that was not taken whole. Any context. */
bool uart1_has_work(const hal_uart_t *uart);

/* Received bytes that were lost since uart1_open; wraps. */
uint16_t uart1_lost(const hal_uart_t *uart);

#endif
