#include "arb_crc.h"

#include <stdbool.h>

uint32_t arb_crc32(uint32_t crc, const uint8_t *bytes, uint16_t len)
{
    for (uint16_t i = 0; i < len; i++) {
        crc ^= bytes[i];
        for (uint8_t bit = 0; bit < 8; bit++) {
            const bool low = (crc & 1u) != 0;
            crc >>= 1;
            if (low) {
                crc ^= 0xEDB88320uL;
            }
        }
    }
    return crc;
}
