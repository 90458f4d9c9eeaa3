/* Sets of small numbers, a bit for each: channels, or places of devices. */
#ifndef PDCP_BITS_H
#define PDCP_BITS_H

#include <stdbool.h>
#include <stdint.h>

/* Bytes of a set of the numbers 0 to count - 1. */
#define PDCP_BIT_BYTES(count) (((count) + 7) / 8)

static inline bool pdcp_bit(const uint8_t *bits, uint8_t number)
{
    return (bits[number / 8u] & (1u << (number % 8u))) != 0;
}

static inline void pdcp_set_bit(uint8_t *bits, uint8_t number, bool value)
{
    const uint8_t mask = (uint8_t)(1u << (number % 8u));
    uint8_t *byte = &bits[number / 8u];
    *byte = (uint8_t)(value ? *byte | mask : *byte & ~mask);
}

#endif
