/* Wire layout of the host API [API 3.1]: header, checksums, and the fields that messages are made of beside
 * those of pdcp_bytes.h.
 *
 *   byte     0    1    2       3       4    5     6         7         8 ...    last two
 *            FEh  19h  id LSB  id MSB  ref  CRC8  size LSB  size MSB  payload  CRC16 LSB, MSB
 *
 * size counts the payload and its CRC16; 0 means that neither is there. */
#ifndef ARB_HOSTCODEC_H
#define ARB_HOSTCODEC_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_nodes.h"

enum {
    ARB_HOST_SYNC1 = 0xFE,
    ARB_HOST_SYNC2 = 0x19,
    ARB_HOST_HEADER = 8, /* bytes */
    ARB_HOST_CRC = 2     /* bytes */
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

/* A message on its way to the host. */
typedef struct {
    uint16_t len; /* of the whole message; 0: there is none */
    uint16_t sent;
} arb_out_t;

/* Polynomial 07h, initial 00h, not reflected; over header bytes 2, 3, 4, 6, 7 (D-API-1). */
uint8_t arb_hostcodec_crc8(const uint8_t header[ARB_HOST_HEADER]);

/* Polynomial 1021h, initial FFFFh, not reflected; over the payload (D-API-1). */
uint16_t arb_hostcodec_crc16(const uint8_t *payload, uint16_t len);

/* Completes a message whose payload of len bytes stands at frame + ARB_HOST_HEADER: writes header and CRC16.
 * Returns the length of the whole message. frame[] needs room for header, payload and CRC16. */
uint16_t arb_hostcodec_finish(uint8_t *frame, uint16_t id, uint8_t reference, uint16_t len);

/* A channel as messages name it: the identity of its device, its index. */
void arb_hostcodec_put_channel(uint8_t bytes[7], const pdcp_identity_t *identity, uint8_t index);

/* The link of an input as 220Eh and its event tell of it: output, input, status. */
void arb_hostcodec_put_link(uint8_t bytes[15], const pdcp_nodes_t *nodes, const pdcp_channel_t *input);

#endif
