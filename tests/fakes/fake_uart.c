/* UART 1: four bytes of receive buffer with their error bits, four of transmit buffer and a shift
 * register. */
#include <string.h>
#include <xc.h>

#include "fake_parts.h"

enum { NOT_WRITTEN = 0x8000 };

static uint8_t received[4];
static bool framing[4];
static unsigned received_count;
static uint8_t sending[5]; /* the first one is being shifted out */
static unsigned sending_count;
static uint32_t shift_left_us;

static uint32_t byte_us(void)
{
    return 10u * 4u * (*fake_at(0x0228) + 1u) / 40u;
}

static bool receiver_on(void)
{
    return (*fake_at(0x0220) & 0x8000) != 0;
}

static void show_status(void)
{
    uint16_t status = (uint16_t)(*fake_at(0x0222) & ~0x0305u);
    status =
        (uint16_t)(status | (received_count != 0 ? 1u : 0u) | (received_count != 0 && framing[0] ? 4u : 0u) |
                   (sending_count == 5 ? 0x0200u : 0u) | (sending_count == 0 ? 0x0100u : 0u));
    *fake_at(0x0222) = status;
}

void fake_uart_receive(uint8_t byte, bool framing_error)
{
    (void)fake_peek(0);
    if (!receiver_on() || (*fake_at(0x0222) & 2u) != 0) {
        return;
    }
    if (received_count == 4) {
        *fake_at(0x0222) |= 2u;
    } else {
        received[received_count] = byte;
        framing[received_count++] = framing_error;
    }
    show_status();
    fake_raise(AT_IFS0, 11);
}

void fake_uart_access(uint16_t at)
{
    if (at == 0x0226 && received_count != 0) {
        *fake_at(at) = received[0];
        received_count--;
        memmove(received, &received[1], received_count);
        memmove(framing, &framing[1], received_count);
    }
    if (at == 0x0224) {
        *fake_at(at) = NOT_WRITTEN;
    }
    show_status();
}

void fake_uart_changed(uint16_t at, uint16_t after)
{
    if (at == 0x0222 && (after & 2u) == 0 && received_count == 4) {
        received_count = 0; /* clearing an overrun empties the buffer */
        show_status();
    }
    if (at == 0x0224 && after != NOT_WRITTEN) {
        if (sending_count == 5 || (*fake_at(0x0222) & 0x0400) == 0) {
            fake.misuses++;
            return;
        }
        if (sending_count == 0) {
            shift_left_us = byte_us();
        }
        sending[sending_count++] = (uint8_t)after;
        show_status();
    }
}

uint32_t fake_uart_next_us(void)
{
    return sending_count != 0 ? shift_left_us : UINT32_MAX;
}

void fake_uart_pass_us(uint32_t us)
{
    if (sending_count == 0) {
        return;
    }
    shift_left_us -= us;
    if (shift_left_us != 0) {
        return;
    }
    if (fake.uart_sent_count < FAKE_UART_SENT_MAX) {
        fake.uart_sent[fake.uart_sent_count++] = sending[0];
    }
    sending_count--;
    memmove(sending, &sending[1], sending_count);
    shift_left_us = byte_us();
    if (sending_count == 1) {
        fake_raise(AT_IFS0, 12); /* the last one went to the shift register */
    }
    show_status();
}

void fake_uart_power_on(void)
{
    received_count = 0;
    sending_count = 0;
    show_status();
}
