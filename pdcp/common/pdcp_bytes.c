#include "pdcp_bytes.h"

/* The least significant byte comes first, here and below (D-BUS-1). */
uint16_t pdcp_bytes_get_u16(const uint8_t bytes[2])
{
    return (uint16_t)(bytes[0] | (uint16_t)((uint16_t)bytes[1] << 8));
}

void pdcp_bytes_put_u16(uint8_t bytes[2], uint16_t number)
{
    bytes[0] = (uint8_t)(number & 0xFFu);
    bytes[1] = (uint8_t)(number >> 8);
}

void pdcp_bytes_put_u32(uint8_t bytes[4], uint32_t number)
{
    pdcp_bytes_put_u16(&bytes[0], (uint16_t)(number & 0xFFFFu));
    pdcp_bytes_put_u16(&bytes[2], (uint16_t)(number >> 16));
}

pdcp_identity_t pdcp_bytes_get_identity(const uint8_t bytes[PDCP_BYTES_IDENTITY])
{
    const pdcp_identity_t identity = {.vid = pdcp_bytes_get_u16(&bytes[0]),
                                      .pid = pdcp_bytes_get_u16(&bytes[2]),
                                      .sn = pdcp_bytes_get_u16(&bytes[4])};
    return identity;
}

void pdcp_bytes_put_identity(uint8_t bytes[PDCP_BYTES_IDENTITY], const pdcp_identity_t *identity)
{
    pdcp_bytes_put_u16(&bytes[0], identity->vid);
    pdcp_bytes_put_u16(&bytes[2], identity->pid);
    pdcp_bytes_put_u16(&bytes[4], identity->sn);
}

uint8_t pdcp_bytes_value_u8(const uint8_t *value, uint16_t len, uint16_t at)
{
    return at < len ? value[at] : 0;
}

uint16_t pdcp_bytes_value_u16(const uint8_t *value, uint16_t len, uint16_t at)
{
    return at + 1u < len ? pdcp_bytes_get_u16(&value[at]) : pdcp_bytes_value_u8(value, len, at);
}
