/* Wire layout of identifiers and of CAN data [PDCP 2.2, 3.2]. Nobody else shifts bytes of a CAN frame.
 *
 * Pure functions. Fields of several bytes are pdcp_bytes.h's. */
#ifndef PDCP_CODEC_H
#define PDCP_CODEC_H

#include <stdbool.h>
#include <stdint.h>

#include "can_frame.h"
#include "pdcp_identity.h"
#include "pdcp_spec.h"

/* One message, decoded. Which members mean something depends on code; the others are 0. */
typedef struct {
    uint8_t code;             /* function code, 01 to 0F or 81 to 8F */
    uint8_t result;           /* answers: PDCP_FAILURE, PDCP_SUCCESS, PDCP_USE_BULK */
    uint8_t param;            /* 03 04 83 84 0C 0D 8C 8D: parameter id */
    uint8_t channel;          /* the same and 0F 8F: channel index, 0 = the device */
    uint8_t node_id;          /* 81: granted or suggested, 0 = refused */
    uint8_t packet_id;        /* 0E */
    uint8_t len;              /* bytes in value */
    uint8_t value[7];         /* 04 83 84: 0 to 4 bytes; 0E: 1 to 6; deprecated codes: all behind the code */
    uint16_t word;            /* 08 88: time in ms; 0D 8C 8D: size in bytes */
    pdcp_identity_t identity; /* 01 81 */
} pdcp_msg_t;

typedef enum {
    PDCP_DECODE_OK = 0,
    PDCP_DECODE_BAD_DLC = -1,     /* the code is known, the DLC is not one of its own (D-BUS-5) */
    PDCP_DECODE_UNKNOWN_CODE = -2 /* reserved or device-specific code, or no data at all */
} pdcp_decode_t;

/* Identifier [PDCP figure 2.3]: bits 10-9 priority, bit 8 mode (1: from the arbitrator), bits 7-0 node id. */
static inline uint16_t pdcp_can_id(uint8_t priority, bool from_arbitrator, uint8_t node_id)
{
    return (uint16_t)((uint16_t)((uint16_t)priority << 9) | (from_arbitrator ? 0x100u : 0u) | node_id);
}

static inline uint8_t pdcp_id_priority(uint16_t can_id)
{
    return (uint8_t)((can_id >> 9) & 3u);
}

static inline bool pdcp_id_from_arbitrator(uint16_t can_id)
{
    return (can_id & 0x100u) != 0;
}

static inline uint8_t pdcp_id_node(uint16_t can_id)
{
    return (uint8_t)(can_id & 0xFFu);
}

/* Bytes of data that is passed through undecoded: a frame that a host has made, and the answer to it. */
enum {
    PDCP_RAW_CODE = 0,
    PDCP_RAW_PARAM = 1,   /* requests 03 and 04: parameter id */
    PDCP_RAW_CHANNEL = 2, /* the same: channel index */
    PDCP_RAW_VALUE = 3,   /* 04: value */
    PDCP_RAW_TIME = 1,    /* 08: time in ms, two bytes */
    PDCP_RAW_RESULT = 1,  /* answers but 81: response code */
    PDCP_RAW_ANSWER_PARAM = 2,
    PDCP_RAW_ANSWER_CHANNEL = 3
};

/* Does the frame carry this function code? */
static inline bool pdcp_codec_has_code(const can_frame_t *frame, unsigned code)
{
    return frame->dlc != 0 && frame->data[PDCP_RAW_CODE] == code;
}

/* Is the frame a beacon, of whomever? */
static inline bool pdcp_codec_is_beacon(const can_frame_t *frame)
{
    return frame->dlc == 1 && frame->data[PDCP_RAW_CODE] == PDCP_BEACON;
}

/* The value of parameter 7 as one number: node id of the source's device, then that of the output. */
static inline uint16_t pdcp_codec_node_ids(uint8_t device, uint8_t output)
{
    return (uint16_t)(device | (uint16_t)((uint16_t)output << 8));
}

/* Decodes the data of a frame that carries a function code. Accepts the sizes of both tables of the source
 * (D-BUS-3); an answer too short to hold its response code means success (D-BUS-18). On anything but
 * PDCP_DECODE_OK msg holds the code alone. */
pdcp_decode_t pdcp_codec_decode(const can_frame_t *frame, pdcp_msg_t *msg);

/* Builds the frame of a message, with the sizes of [PDCP 3.2]. msg->code must be one of the codes above,
 * msg->len at most what the code's value field holds. */
void pdcp_codec_encode(uint16_t can_id, const pdcp_msg_t *msg, can_frame_t *frame);

#endif
