#include "uart1.h"

#include <string.h>

#include "handlers.h"
#include "ring.h"

enum { PLACES = 128, STA_OERR = 0x0002, STA_FERR = 0x0004, STA_URXDA = 0x0001 };

struct hal_uart {
    ring_t rx_ring;
    ring_t tx_ring;
    size_t refused; /* bytes of the last write that were not taken */
    volatile uint16_t lost;
    uint8_t rx_bytes[PLACES];
    uint8_t tx_bytes[PLACES];
};

static struct hal_uart uart1;

hal_uart_t *uart1_open(uint16_t brg)
{
    IEC0bits.U1RXIE = 0;
    IEC0bits.U1TXIE = 0;
    memset(&uart1, 0, sizeof uart1);
    U1MODE = 0x0008; /* 8N1, BRGH, off while the rate changes */
    U1BRG = brg;
    U1MODE = 0x8008;
    U1STA = 0x8400; /* transmitter on, after the UART; an interrupt for each byte in, and when all are out */
    IPC2bits.U1RXIP = PART_LEVEL_UART_RX;
    IPC3bits.U1TXIP = PART_LEVEL_UART_TX;
    IFS0bits.U1RXIF = 0;
    IFS0bits.U1TXIF = 1; /* nothing is on its way out: enabling the interrupt is to run the handler */
    IEC0bits.U1RXIE = 1;
    return &uart1;
}

size_t hal_uart_read(hal_uart_t *uart, uint8_t *bytes, size_t size)
{
    size_t count = 0;
    while (count < size && ring_count(&uart->rx_ring) != 0) {
        bytes[count++] = uart->rx_bytes[ring_place(uart->rx_ring.tail, PLACES)];
        uart->rx_ring.tail++;
    }
    return count;
}

size_t hal_uart_write(hal_uart_t *uart, const uint8_t *bytes, size_t size)
{
    size_t count = 0;
    while (count < size && ring_count(&uart->tx_ring) < PLACES) {
        uart->tx_bytes[ring_place(uart->tx_ring.head, PLACES)] = bytes[count++];
        uart->tx_ring.head++;
    }
    uart->refused = size - count;
    if (count != 0) {
        IEC0bits.U1TXIE = 1;
    }
    return count;
}

bool uart1_has_work(const hal_uart_t *uart)
{
    return ring_count(&uart->rx_ring) != 0 || (uart->refused != 0 && ring_count(&uart->tx_ring) < PLACES);
}

uint16_t uart1_lost(const hal_uart_t *uart)
{
    return uart->lost;
}

static void take_byte(uint16_t status)
{
    ring_t *ring = &uart1.rx_ring;
    const uint8_t byte = (uint8_t)U1RXREG;
    if ((status & STA_FERR) != 0 || ring_count(ring) == PLACES) {
        uart1.lost++;
        return;
    }
    uart1.rx_bytes[ring_place(ring->head, PLACES)] = byte;
    ring->head++;
}

/* The error bits belong to the byte that is read next, so they are read first. Clearing an overrun empties
 * the receiver, so that is done last; until then nothing more is received.
 * 88 cycles with one byte, 2.2 us; some 50 for each further one, of which there are four at most. */
void PART_HANDLER _U1RXInterrupt(void)
{
    IFS0bits.U1RXIF = 0;
    uint16_t status = U1STA;
    while ((status & STA_URXDA) != 0) {
        take_byte(status);
        status = U1STA;
    }
    if ((status & STA_OERR) != 0) {
        uart1.lost++;
        U1STAbits.OERR = 0;
    }
}

/* 144 cycles with four bytes, 3.6 us. */
void PART_HANDLER _U1TXInterrupt(void)
{
    ring_t *ring = &uart1.tx_ring;
    IFS0bits.U1TXIF = 0;
    while (ring_count(ring) != 0 && !U1STAbits.UTXBF) {
        U1TXREG = uart1.tx_bytes[ring_place(ring->tail, PLACES)];
        ring->tail++;
    }
    if (ring_count(ring) == 0) {
        IEC0bits.U1TXIE = 0;
        IFS0bits.U1TXIF = 1; /* the next write is to run the handler at once */
    }
}
