#include "arb_hostcodec.h"

#include <stddef.h>

#include "pdcp_bytes.h"

static uint8_t crc8_byte(uint8_t crc, uint8_t byte)
{
    crc ^= byte;
    for (uint8_t bit = 0; bit < 8; bit++) {
        const bool high = (crc & 0x80u) != 0;
        crc = (uint8_t)(crc << 1);
        if (high) {
            crc ^= 0x07u;
        }
    }
    return crc;
}

/* CRC8 of a header (D-API-1). */
uint8_t arb_hostcodec_crc8(const uint8_t header[ARB_HOST_HEADER])
{
    uint8_t crc = 0;
    for (size_t i = 2; i < ARB_HOST_HEADER; i++) {
        if (i != 5) { /* where it stands itself */
            crc = crc8_byte(crc, header[i]);
        }
    }
    return crc;
}

/* CRC16 of a payload (D-API-1). */
uint16_t arb_hostcodec_crc16(const uint8_t *payload, uint16_t len)
{
    uint16_t crc = 0xFFFF;
    for (uint16_t i = 0; i < len; i++) {
        crc = (uint16_t)(crc ^ (uint16_t)((uint16_t)payload[i] << 8));
        for (uint8_t bit = 0; bit < 8; bit++) {
            const bool high = (crc & 0x8000u) != 0;
            crc = (uint16_t)(crc << 1);
            if (high) {
                crc ^= 0x1021u;
            }
        }
    }
    return crc;
}

uint16_t arb_hostcodec_finish(uint8_t *frame, uint16_t id, uint8_t reference, uint16_t len)
{
    const uint16_t size = len != 0 ? (uint16_t)(len + ARB_HOST_CRC) : 0;
    frame[0] = ARB_HOST_SYNC1;
    frame[1] = ARB_HOST_SYNC2;
    pdcp_bytes_put_u16(&frame[2], id);
    frame[4] = reference;
    pdcp_bytes_put_u16(&frame[6], size);
    frame[5] = arb_hostcodec_crc8(frame);
    if (len != 0) {
        pdcp_bytes_put_u16(&frame[ARB_HOST_HEADER + len], arb_hostcodec_crc16(&frame[ARB_HOST_HEADER], len));
    }
    return (uint16_t)(ARB_HOST_HEADER + size);
}

void arb_hostcodec_put_channel(uint8_t bytes[ARB_CHANNEL_BYTES], const pdcp_identity_t *identity,
                               uint8_t index)
{
    pdcp_bytes_put_identity(bytes, identity);
    bytes[ARB_AT_INDEX] = index;
}

void arb_hostcodec_put_link(uint8_t bytes[ARB_LINK_BYTES], const pdcp_tables_t *tables,
                            const pdcp_channel_t *input)
{
    arb_hostcodec_put_channel(&bytes[0], &input->source.identity, input->source.index);
    arb_hostcodec_put_channel(&bytes[ARB_CHANNEL_BYTES], &tables->devices[input->place].identity,
                              input->index);
    bytes[ARB_LINK_BYTES - 1] = input->link;
}
