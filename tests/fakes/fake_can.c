/* ECAN 1 with its two DMA channels: modes, FIFO, transmit buffers, flags. */
#include <string.h>
#include <xc.h>

#include "fake_parts.h"

enum { FIFO_LAST = 31 };

static int mode_left; /* accesses until OPMODE follows REQOP; 0: it has */
static uint8_t write_buffer;
static bool fsa_written;

/* The driver's buffers, found by the lower 16 bits of their address: those of all variables in DMA memory. */
#if defined(__dsPIC33FJ64MC802__)
extern uint8_t __start_fake_dma[] __attribute__((weak));
#define DMA_MEMORY __start_fake_dma
#else
extern uint8_t __start_fake_xmemory[] __attribute__((weak));
#define DMA_MEMORY __start_fake_xmemory
#endif

static uint8_t op_mode(void)
{
    return (uint8_t)(*fake_at(0x0400) >> 5 & 7u);
}

/* The DMA channel moves whole messages of 8 words, as the controller says. NULL: it is not set up to. */
static volatile uint16_t *dma_buffer(uint16_t channel_at, uint16_t direction, uint16_t request,
                                     uint16_t peripheral, uint8_t buffer)
{
    const uint16_t start_at = PART_AT(4, 4);
    const uint16_t pad_at = PART_AT(8, 0x0C);
    const uint16_t cnt_at = PART_AT(0x0A, 0x0E);
    const bool ready = *fake_at(channel_at) == (uint16_t)(0x8020 | direction) &&
                       *fake_at((uint16_t)(channel_at + 2)) == request &&
                       *fake_at((uint16_t)(channel_at + pad_at)) == peripheral &&
                       *fake_at((uint16_t)(channel_at + cnt_at)) == 7;
    const uint16_t offset = *fake_at((uint16_t)(channel_at + start_at));
    if (!ready || offset % 512 != 0) {
        fake.misuses++;
        return NULL;
    }
    uint8_t *memory = DMA_MEMORY;
    memory += (uint16_t)(offset - (uint16_t)(uintptr_t)memory);
    return (volatile uint16_t *)(void *)(memory + buffer * 16u);
}

static bool bit_of(uint16_t at, uint8_t buffer)
{
    return (*fake_at((uint16_t)(at + buffer / 16 * 2)) & 1u << buffer % 16) != 0;
}

static void set_bit_of(uint16_t at, uint8_t buffer)
{
    fake_raise((uint16_t)(at + buffer / 16 * 2), buffer % 16);
}

static void event(uint16_t flags)
{
    *fake_at(0x040A) |= flags;
    if ((*fake_at(0x040C) & flags) != 0) {
        fake_raise(AT_IFS2, 3);
    }
}

static uint8_t fifo_first(void)
{
    return (uint8_t)(*fake_at(0x0406) & 31u);
}

static uint8_t after(uint8_t buffer)
{
    return buffer == FIFO_LAST ? fifo_first() : (uint8_t)(buffer + 1);
}

bool fake_can_receive_words(const uint16_t words[8])
{
    (void)fake_peek(0);
    if (op_mode() != 0) {
        return false;
    }
    const uint8_t buffer = write_buffer;
    if ((*fake_at(0x0414) & 1u) == 0 || *fake_at(0x1420) != 0x000F || *fake_at(0x0406) >> 13 != 6) {
        fake.misuses++; /* no filter leads into the FIFO */
        return true;
    }
    if (bit_of(0x0420, buffer)) {
        set_bit_of(0x0428, buffer);
        event(0x0004);
        return true;
    }
    volatile uint16_t *place =
        dma_buffer(PART_AT(0x0380, 0x0B00), 0, 0x22, 0x0440, fake.can_misplaces ? after(buffer) : buffer);
    for (uint8_t i = 0; place != NULL && i < 8; i++) {
        place[i] = words[i];
    }
    set_bit_of(0x0420, buffer);
    write_buffer = after(buffer);
    event(0x0002);
    return true;
}

bool fake_can_receive(const can_frame_t *frame)
{
    const uint16_t words[8] = {(uint16_t)(frame->id << 2),
                               0,
                               frame->dlc,
                               (uint16_t)(frame->data[0] | frame->data[1] << 8),
                               (uint16_t)(frame->data[2] | frame->data[3] << 8),
                               (uint16_t)(frame->data[4] | frame->data[5] << 8),
                               (uint16_t)(frame->data[6] | frame->data[7] << 8),
                               0};
    return fake_can_receive_words(words);
}

/* The one with the highest TXPRI; the highest number among equals. */
static int pick_buffer(void)
{
    int best = -1;
    int best_priority = -1;
    for (int buffer = 0; buffer < 8; buffer++) {
        const uint16_t control = (uint16_t)(*fake_at((uint16_t)(0x0430 + buffer / 2 * 2)) >> buffer % 2 * 8);
        if ((control & 0x88u) == 0x88u && (int)(control & 3u) >= best_priority) {
            best = buffer;
            best_priority = (int)(control & 3u);
        }
    }
    return best;
}

bool fake_can_transmit(can_frame_t *frame)
{
    (void)fake_peek(0);
    const int buffer = op_mode() == 0 ? pick_buffer() : -1;
    if (buffer < 0) {
        return false;
    }
    const volatile uint16_t *words =
        dma_buffer(PART_AT(0x038C, 0x0B10), 0x2000, 0x46, 0x0442, (uint8_t)buffer);
    *fake_at((uint16_t)(0x0430 + buffer / 2 * 2)) &= (uint16_t)(buffer % 2 != 0 ? 0xF7FF : 0xFFF7);
    if (words == NULL) {
        return false;
    }
    memset(frame, 0, sizeof *frame);
    frame->id = (uint16_t)(words[0] >> 2);
    frame->dlc = (uint8_t)words[2];
    for (uint8_t i = 0; i < frame->dlc && i < 8; i++) {
        frame->data[i] = (uint8_t)(words[3 + i / 2] >> i % 2 * 8);
    }
    event(0x0001);
    fake_deliver();
    return true;
}

void fake_can_error(uint16_t status, uint8_t tx_errors, uint8_t rx_errors, uint16_t events)
{
    (void)fake_peek(0);
    *fake_at(0x040A) = (uint16_t)((*fake_at(0x040A) & 0x00FFu) | status);
    *fake_at(0x040E) = (uint16_t)(tx_errors << 8 | rx_errors);
    event(events);
    fake_deliver();
}

/* Flags that only a 0 changes. The pointer to the next buffer moves with its flag. */
static void flags_changed(uint16_t at, uint16_t before, uint16_t written)
{
    const uint16_t result = (uint16_t)(before & written);
    *fake_at(at) = result;
    for (uint8_t bit = 0; (at == 0x0420 || at == 0x0422) && bit < 16; bit++) {
        if (((unsigned)(before & ~result) >> bit & 1u) != 0) {
            const uint8_t buffer = (uint8_t)(bit + (at == 0x0422 ? 16 : 0));
            *fake_at(0x0408) = (uint16_t)((*fake_at(0x0408) & 0xFF00u) | after(buffer));
        }
    }
}

/* Byte by byte, FSA first. */
static void fifo_control_changed(uint16_t before, uint16_t written)
{
    const bool low = ((before ^ written) & 0x00FFu) != 0;
    const bool high = ((before ^ written) & 0xFF00u) != 0;
    if ((low && high) || (high && !fsa_written)) {
        fake.misuses++;
        *fake_at(0x0406) = before;
        return;
    }
    fsa_written = low;
    write_buffer = fifo_first();
    *fake_at(0x0408) = (uint16_t)(write_buffer << 8 | write_buffer);
}

void fake_can_changed(uint16_t at, uint16_t before, uint16_t after_value)
{
    const bool configures =
        at == 0x0406 || at == 0x0410 || at == 0x0412 || at == 0x0418 || (at >= 0x1420 && at <= 0x147E);
    if (configures && op_mode() != 4) {
        fake.misuses++;
        *fake_at(at) = before;
        return;
    }
    switch (at) {
    case 0x0400:
        *fake_at(at) = (uint16_t)((after_value & ~0x00E0u) | (before & 0x00E0u));
        if (((before ^ after_value) & 0x0700u) != 0) {
            mode_left = fake.can_mode_delay;
        }
        break;
    case 0x0406:
        fifo_control_changed(before, after_value);
        break;
    case 0x040A:
        *fake_at(at) = (uint16_t)((before & 0xFF00u) | (before & after_value & 0x00FFu));
        break;
    case 0x0420:
    case 0x0422:
    case 0x0428:
    case 0x042A:
        flags_changed(at, before, after_value);
        break;
    default:
        break;
    }
}

void fake_can_access(uint16_t at)
{
    const bool window = (*fake_at(0x0400) & 1u) != 0;
    if ((at >= 0x1420 && at <= 0x147E && !window) || (at >= 0x0420 && at <= 0x0436 && window)) {
        fake.misuses++;
    }
    if (mode_left > 0 && --mode_left == 0) {
        *fake_at(0x0400) = (uint16_t)((*fake_at(0x0400) & ~0x00E0u) | (*fake_at(0x0400) >> 8 & 7u) << 5);
    }
}

void fake_can_power_on(void)
{
    *fake_at(0x0400) = 0x0480; /* configuration mode */
    mode_left = 0;
    write_buffer = 0;
    fsa_written = false;
}
