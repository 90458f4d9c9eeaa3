/* Sets of small numbers, one bit each: channel numbers, places, node ids. */
#ifndef PDCP_BITS_H
#define PDCP_BITS_H

#include <stdbool.h>
#include <stdint.h>

/* Bytes of a set of the numbers 0 to count - 1. */
#define PDCP_BIT_BYTES(count) (((count) + 7) / 8)

bool pdcp_bit(const uint8_t *bits, uint8_t number);
void pdcp_bit_set(uint8_t *bits, uint8_t number, bool value);

#endif
