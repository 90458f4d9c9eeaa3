/* Wire layout of the host API [API 3.1]: header, checksums and fields of messages. pdcp_bytes.h has the
 * numbers and identities.
 *
 *   byte     0    1    2       3       4    5     6         7         8 ...    last two
 *            FEh  19h  id LSB  id MSB  ref  CRC8  size LSB  size MSB  payload  CRC16 LSB, MSB
 *
 * size counts the payload and its CRC16; 0 means that neither is there. */
#ifndef ARB_HOSTCODEC_H
#define ARB_HOSTCODEC_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_tables.h"

enum {
    ARB_HOST_SYNC1 = 0xFE,
    ARB_HOST_SYNC2 = 0x19,
    ARB_HOST_HEADER = 8, /* bytes */
    ARB_HOST_CRC = 2     /* bytes */
};

/* Sizes of fields. */
enum {
    ARB_CHANNEL_BYTES = 7,                      /* identity of the device, channel index */
    ARB_LINK_BYTES = 2 * ARB_CHANNEL_BYTES + 1, /* output, input, status */
    ARB_INFO_BYTES = ARB_CHANNEL_BYTES + 4      /* device or channel, type, profile */
};

/* Where fields begin in a payload. */
enum {
    ARB_AT_INDEX = 6, /* channel index, behind the identity that a payload begins with */
    ARB_AT_PARAM = 7, /* 2301h, 2304h */
    ARB_AT_VALUE = 8,
    ARB_AT_DLC = 6, /* 230Ah and its answer, behind the identity */
    ARB_AT_DATA = 7,
    ARB_AT_OFFSET = 0, /* 240Ah, 240Dh */
    ARB_AT_LENGTH = 2, /* 240Ah: of what is read, 8 bits; 240Dh: of the whole string, 16 bits */
    ARB_AT_PIECE = 4   /* 240Dh, and the answer to 240Ah */
};

/* Request ids; the success answer is id + 1, the failure answer id + 2 [API 3.2]. */
enum {
    ARB_MSG_UNKNOWN_ID = 0x2200, /* answer to an id that does not exist */
    ARB_MSG_SYSTEM_INFO = 0x2201,
    ARB_MSG_DEVICE_INFO = 0x2204,
    ARB_MSG_INPUT_INFO = 0x2207,
    ARB_MSG_OUTPUT_INFO = 0x220A,
    ARB_MSG_LINK_INFO = 0x220D,
    ARB_MSG_GET_PARAMETER = 0x2301,
    ARB_MSG_SET_PARAMETER = 0x2304,
    ARB_MSG_CONFIGURE_LINK = 0x2307,
    ARB_MSG_PASSTHROUGH = 0x230A,
    ARB_MSG_RESET = 0x230D,
    /* Extension group (D-API-5) */
    ARB_MSG_ARBITRATOR_INFO = 0x2401,
    ARB_MSG_SET_FLAGS = 0x2404,
    ARB_MSG_ACTION = 0x2407,
    ARB_MSG_READ_CONFIGS = 0x240A,
    ARB_MSG_WRITE_CONFIGS = 0x240D,
    ARB_MSG_REMOVE_LINK = 0x2410,
    ARB_MSG_STATISTICS = 0x2413,
    ARB_MSG_EVENT_STREAM = 0x2416,
    ARB_MSG_EVENT = 0x2419 /* from the arbitrator, unasked */
};

/* A message that is being sent to the host. */
typedef struct {
    uint16_t len; /* of the whole message; 0: there is none */
    uint16_t sent;
} arb_out_t;

/* CRC8: polynomial 07h, initial 00h, not reflected; over header bytes 2, 3, 4, 6, 7 (D-API-1). */
uint8_t arb_hostcodec_crc8(const uint8_t header[ARB_HOST_HEADER]);

/* CRC16: polynomial 1021h, initial FFFFh, not reflected; over the payload (D-API-1). */
uint16_t arb_hostcodec_crc16(const uint8_t *payload, uint16_t len);

/* Completes a message whose payload of len bytes stands at frame + ARB_HOST_HEADER: writes header and CRC16.
 * Returns the length of the whole message. frame[] needs room for header, payload and CRC16. */
uint16_t arb_hostcodec_finish(uint8_t *frame, uint16_t id, uint8_t reference, uint16_t len);

/* Writes a channel as messages name it: the identity of its device, then its index. */
void arb_hostcodec_put_channel(uint8_t bytes[ARB_CHANNEL_BYTES], const pdcp_identity_t *identity,
                               uint8_t index);

/* Writes the link of an input as in 220Eh and in its event: output, input, status. */
void arb_hostcodec_put_link(uint8_t bytes[ARB_LINK_BYTES], const pdcp_tables_t *tables,
                            const pdcp_channel_t *input);

#endif
