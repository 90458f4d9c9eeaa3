#include "profile_type.h"

#include "pdcp_bytes.h"

/* Distance of a field's lowest bit from the least significant bit of the word. */
enum { SIZE_AT = 14, DATA_AT = 12, CONTROL_AT = 10, PRESCALER_AT = 5 };

/* The largest number that fits. */
static uint16_t mask_of(const profile_type_t *type)
{
    return (uint16_t)(0xFFFFu >> (12u - 4u * (type->size & 3u)));
}

/* Bit 0 is the most significant one (D-PRO-1). A float of any other size than 16 bits is refused
 * (D-PRO-2). */
bool profile_type_decode(uint16_t word, profile_type_t *type)
{
    type->size = (uint8_t)(word >> SIZE_AT);
    type->data = (uint8_t)(word >> DATA_AT & 3u);
    type->control = (uint8_t)(word >> CONTROL_AT & 3u);
    type->sole_access = (word & PROFILE_TYPE_SOLE) != 0;
    type->terminal = (word & PROFILE_TYPE_TERMINAL) != 0;
    type->prescaler = (uint8_t)(word >> PRESCALER_AT & 7u);
    return type->data != PROFILE_FLOAT || type->size == PROFILE_SIZE_16;
}

uint16_t profile_type_encode(const profile_type_t *type)
{
    return (uint16_t)((type->size & 3u) << SIZE_AT | (type->data & 3u) << DATA_AT |
                      (type->control & 3u) << CONTROL_AT | (type->sole_access ? PROFILE_TYPE_SOLE : 0u) |
                      (type->terminal ? PROFILE_TYPE_TERMINAL : 0u) | (type->prescaler & 7u) << PRESCALER_AT);
}

uint8_t profile_type_bytes(const profile_type_t *type)
{
    return (type->size & 3u) <= PROFILE_SIZE_8 ? 1 : 2;
}

bool profile_type_range(const profile_type_t *type, int32_t *min, int32_t *max)
{
    const uint8_t data = type->data & 3u;
    if (data == PROFILE_FLOAT) {
        return false;
    }
    *min = 0;
    *max = data == PROFILE_BOOLEAN ? 1 : mask_of(type);
    if (data == PROFILE_SIGNED) {
        *max /= 2;
        *min = -*max - 1;
    }
    return true;
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
    const uint16_t word = (uint16_t)((uint32_t)value & mask_of(type));
    pdcp_bytes_put_u16(bytes, word);
    return profile_type_bytes(type);
}

bool profile_type_get(const profile_type_t *type, const uint8_t *bytes, uint8_t len, int32_t *value)
{
    int32_t min;
    int32_t max;
    if (!profile_type_range(type, &min, &max)) {
        return false;
    }
    const uint16_t word = pdcp_bytes_value_u16(bytes, len, 0) & mask_of(type);
    *value = word;
    if (type->data == PROFILE_BOOLEAN) {
        *value = word != 0 ? 1 : 0;
    } else if (*value > max) { /* the sign bit of a signed value */
        *value -= (int32_t)mask_of(type) + 1;
    }
    return true;
}
