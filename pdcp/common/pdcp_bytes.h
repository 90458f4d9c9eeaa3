/* Numbers and identities as bytes, least significant byte first (D-BUS-1). CAN frames, host messages, stored
 * records and configuration strings all hold them in this way.
 *
 * Pure functions. Without a length the caller owns as many bytes as the name says. */
#ifndef PDCP_BYTES_H
#define PDCP_BYTES_H

#include <stdint.h>

#include "pdcp_identity.h"

enum { PDCP_BYTES_IDENTITY = 6 }; /* VID, PID, SN */

uint16_t pdcp_bytes_get_u16(const uint8_t bytes[2]);
void pdcp_bytes_put_u16(uint8_t bytes[2], uint16_t number);
void pdcp_bytes_put_u32(uint8_t bytes[4], uint32_t number);

pdcp_identity_t pdcp_bytes_get_identity(const uint8_t bytes[PDCP_BYTES_IDENTITY]);
void pdcp_bytes_put_identity(uint8_t bytes[PDCP_BYTES_IDENTITY], const pdcp_identity_t *identity);

/* Reads the field at byte `at` of a parameter's value, which has len bytes. A value may be shorter
 * or longer than its fields: missing bytes are 0, extra ones are ignored (pdcp-bus.md 4). */
uint8_t pdcp_bytes_value_u8(const uint8_t *value, uint16_t len, uint16_t at);
uint16_t pdcp_bytes_value_u16(const uint8_t *value, uint16_t len, uint16_t at);

#endif
