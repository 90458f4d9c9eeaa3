#include "profile_type.h"

/* Distance of a field's lowest bit from the least significant bit of the word. */
enum { SIZE_AT = 14, DATA_AT = 12, CONTROL_AT = 10, SOLE_AT = 9, TERMINAL_AT = 8, PRESCALER_AT = 5 };

static uint8_t field(uint16_t word, uint8_t at, uint8_t mask)
{
    return (uint8_t)((uint16_t)(word >> at) & mask);
}

static uint16_t placed(uint8_t value, uint8_t at, uint8_t mask)
{
    return (uint16_t)((uint16_t)(value & mask) << at);
}

static uint8_t bits_of(const profile_type_t *type)
{
    return (uint8_t)(4u * ((type->size & 3u) + 1u));
}

bool profile_type_decode(uint16_t word, profile_type_t *type)
{
    type->size = field(word, SIZE_AT, 3);
    type->data = field(word, DATA_AT, 3);
    type->control = field(word, CONTROL_AT, 3);
    type->sole_access = field(word, SOLE_AT, 1) != 0;
    type->terminal = field(word, TERMINAL_AT, 1) != 0;
    type->prescaler = field(word, PRESCALER_AT, 7);
    return type->data != PROFILE_FLOAT || type->size == PROFILE_SIZE_16;
}

uint16_t profile_type_encode(const profile_type_t *type)
{
    return (uint16_t)(placed(type->size, SIZE_AT, 3) | placed(type->data, DATA_AT, 3) |
                      placed(type->control, CONTROL_AT, 3) | placed(type->sole_access ? 1 : 0, SOLE_AT, 1) |
                      placed(type->terminal ? 1 : 0, TERMINAL_AT, 1) |
                      placed(type->prescaler, PRESCALER_AT, 7));
}

uint8_t profile_type_bytes(const profile_type_t *type)
{
    return bits_of(type) <= 8 ? 1 : 2;
}

bool profile_type_range(const profile_type_t *type, int32_t *min, int32_t *max)
{
    const uint8_t bits = bits_of(type);
    switch (type->data & 3u) {
    case PROFILE_SIGNED:
        *max = (int32_t)(((uint32_t)1 << (bits - 1)) - 1u);
        *min = -*max - 1;
        return true;
    case PROFILE_UNSIGNED:
        *max = (int32_t)(((uint32_t)1 << bits) - 1u);
        *min = 0;
        return true;
    case PROFILE_BOOLEAN:
        *max = 1;
        *min = 0;
        return true;
    default:
        return false;
    }
}

uint8_t profile_type_put(const profile_type_t *type, int32_t value, uint8_t bytes[2])
{
    int32_t min;
    int32_t max;
    if (!profile_type_range(type, &min, &max)) {
        return 0;
    }
    if (type->data == PROFILE_BOOLEAN) {
        value = value != 0 ? 1 : 0;
    }
    value = value < min ? min : value;
    value = value > max ? max : value;
    const uint32_t word = (uint32_t)value & (((uint32_t)1 << bits_of(type)) - 1u);
    bytes[0] = (uint8_t)(word & 0xFFu);
    bytes[1] = (uint8_t)(word >> 8);
    return profile_type_bytes(type);
}

bool profile_type_get(const profile_type_t *type, const uint8_t *bytes, uint8_t len, int32_t *value)
{
    int32_t min;
    int32_t max;
    if (!profile_type_range(type, &min, &max)) {
        return false;
    }
    const uint32_t span = (uint32_t)1 << bits_of(type);
    uint32_t word = len > 0 ? bytes[0] : 0;
    if (len > 1) {
        word |= (uint32_t)bytes[1] << 8;
    }
    word &= span - 1u;
    *value = (int32_t)word;
    if (type->data == PROFILE_BOOLEAN) {
        *value = word != 0 ? 1 : 0;
    } else if (*value > max) { /* the sign bit of a signed value */
        *value -= (int32_t)span;
    }
    return true;
}
