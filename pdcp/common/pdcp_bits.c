#include "pdcp_bits.h"

static uint8_t mask_of(uint8_t number)
{
    return (uint8_t)(1u << (number % 8u));
}

bool pdcp_bit(const uint8_t *bits, uint8_t number)
{
    return (bits[number / 8u] & mask_of(number)) != 0;
}

void pdcp_bit_set(uint8_t *bits, uint8_t number, bool value)
{
    uint8_t *byte = &bits[number / 8u];
    *byte = (uint8_t)(value ? *byte | mask_of(number) : *byte & ~mask_of(number));
}
