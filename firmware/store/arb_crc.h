/* CRC-32 as Ethernet has it: polynomial 04C11DB7h, reflected, initial and final FFFFFFFFh; the check value of
 * "123456789" is CBF43926h. */
#ifndef ARB_CRC_H
#define ARB_CRC_H

#include <stdint.h>

#define ARB_CRC32_INIT 0xFFFFFFFFuL
#define ARB_CRC32_RESIDUE 0xDEBB20E3uL /* the register behind a message and its own CRC-32, LSB first */

/* The register behind these bytes, too; it begins as ARB_CRC32_INIT, and inverted it is the CRC-32. */
uint32_t arb_crc32(uint32_t crc, const uint8_t *bytes, uint16_t len);

#endif
