#include "pdcp_codec.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_assert.h"
#include "pdcp_bytes.h"

/* Fields of a message, in the order in which they stand behind the function code. */
enum {
    RESULT = 0x01,   /* 1 byte */
    NODE_ID = 0x02,  /* 1 byte */
    PACKET = 0x04,   /* 1 byte */
    PARAM = 0x08,    /* 1 byte */
    CHANNEL = 0x10,  /* 1 byte */
    WORD = 0x20,     /* 2 bytes */
    IDENTITY = 0x40, /* 6 bytes */
    VALUE = 0x80     /* to the end of the data */
};

typedef struct {
    uint8_t dlcs; /* bit n - 1: DLC n is accepted; 0: there is no such code */
    uint8_t fields;
} layout_t;

#define DLC(n) (1u << ((n)-1u))
#define DLCS(from, to) ((1u << (to)) - DLC(from))

/* [PDCP 3.2], requests by their code and answers by their code less 70h. A DLC that only [PDCP 3.1] has is
 * accepted beside (D-BUS-3). */
static const layout_t layouts[32] = {
    [0x01] = {DLC(7), IDENTITY},
    [0x02] = {DLC(2), VALUE},
    [0x03] = {DLC(3), PARAM | CHANNEL},
    [0x04] = {DLCS(4, 7), PARAM | CHANNEL | VALUE},
    [0x05] = {DLC(4), VALUE},
    [0x06] = {DLCS(5, 8), VALUE},
    [0x07] = {DLC(2), VALUE},
    [0x08] = {DLC(3), WORD},
    [0x09] = {DLC(1), 0},
    [0x0A] = {DLC(1), 0},
    [0x0B] = {DLC(1), 0},
    [0x0C] = {DLC(3) | DLC(5), PARAM | CHANNEL},
    [0x0D] = {DLC(5), PARAM | CHANNEL | WORD},
    [0x0E] = {DLCS(3, 8), PACKET | VALUE},
    [0x0F] = {DLC(2), CHANNEL},
    [0x11] = {DLC(8), NODE_ID | IDENTITY},
    [0x12] = {DLCS(2, 6), VALUE},
    [0x13] = {DLCS(4, 8), RESULT | PARAM | CHANNEL | VALUE},
    [0x14] = {DLCS(4, 8), RESULT | PARAM | CHANNEL | VALUE},
    [0x15] = {DLCS(4, 7), VALUE},
    [0x16] = {DLC(1), 0},
    [0x17] = {DLC(1), 0},
    [0x18] = {DLC(1) | DLC(4), RESULT | WORD},
    [0x19] = {DLC(1) | DLC(2), RESULT},
    [0x1B] = {DLC(1) | DLC(2), RESULT},
    [0x1C] = {DLC(6), RESULT | PARAM | CHANNEL | WORD},
    [0x1D] = {DLC(6), RESULT | PARAM | CHANNEL | WORD},
    [0x1E] = {DLC(2), RESULT},
    [0x1F] = {DLC(3), RESULT | CHANNEL},
};

static const layout_t *layout_of(uint8_t code)
{
    const uint8_t row = (uint8_t)((code & 0x0Fu) | ((code & 0x80u) >> 3));
    return (code & 0x70u) == 0 && layouts[row].dlcs != 0 ? &layouts[row] : NULL;
}

/* Takes the fields out of the data behind the function code. */
static void take_fields(uint8_t fields, const uint8_t *at, const uint8_t *end, pdcp_msg_t *msg)
{
    if ((fields & RESULT) != 0) {
        msg->result = *at++;
    }
    if ((fields & NODE_ID) != 0) {
        msg->node_id = *at++;
    }
    if ((fields & PACKET) != 0) {
        msg->packet_id = *at++;
    }
    if ((fields & PARAM) != 0) {
        msg->param = *at++;
    }
    if ((fields & CHANNEL) != 0) {
        msg->channel = *at++;
    }
    if ((fields & WORD) != 0) {
        msg->word = pdcp_bytes_get_u16(at);
    }
    if ((fields & IDENTITY) != 0) {
        msg->identity = pdcp_bytes_get_identity(at);
    }
    if ((fields & VALUE) != 0) {
        msg->len = (uint8_t)(end - at);
        memcpy(msg->value, at, msg->len);
    }
}

/* The layout of its code decides whether a frame is malformed (D-BUS-5). */
pdcp_decode_t pdcp_codec_decode(const can_frame_t *frame, pdcp_msg_t *msg)
{
    memset(msg, 0, sizeof *msg);
    if (frame->dlc == 0) {
        return PDCP_DECODE_UNKNOWN_CODE;
    }
    msg->code = frame->data[0];
    const layout_t *layout = layout_of(msg->code);
    if (layout == NULL) {
        return PDCP_DECODE_UNKNOWN_CODE;
    }
    if (frame->dlc > CAN_FRAME_DATA_MAX || (layout->dlcs & DLC(frame->dlc)) == 0) {
        return PDCP_DECODE_BAD_DLC;
    }
    if (frame->dlc > 1) {
        take_fields(layout->fields, &frame->data[1], &frame->data[frame->dlc], msg);
    } else if ((layout->fields & RESULT) != 0) {
        msg->result = PDCP_SUCCESS; /* D-BUS-18 */
    }
    return PDCP_DECODE_OK;
}

/* Returns where the fields end. */
static uint8_t *put_fields(uint8_t fields, const pdcp_msg_t *msg, uint8_t *at)
{
    if ((fields & RESULT) != 0) {
        *at++ = msg->result;
    }
    if ((fields & NODE_ID) != 0) {
        *at++ = msg->node_id;
    }
    if ((fields & PACKET) != 0) {
        *at++ = msg->packet_id;
    }
    if ((fields & PARAM) != 0) {
        *at++ = msg->param;
    }
    if ((fields & CHANNEL) != 0) {
        *at++ = msg->channel;
    }
    if ((fields & WORD) != 0) {
        pdcp_bytes_put_u16(at, msg->word);
        at += 2;
    }
    if ((fields & IDENTITY) != 0) {
        pdcp_bytes_put_identity(at, &msg->identity);
        at += PDCP_BYTES_IDENTITY;
    }
    if ((fields & VALUE) != 0) {
        memcpy(at, msg->value, msg->len);
        at += msg->len;
    }
    return at;
}

void pdcp_codec_encode(uint16_t can_id, const pdcp_msg_t *msg, can_frame_t *frame)
{
    pdcp_assert(layout_of(msg->code) != NULL, "pdcp_codec.h: the code is known");
    pdcp_assert(msg->len <= sizeof msg->value, "pdcp_codec.h: the value fits its field");
    memset(frame, 0, sizeof *frame);
    frame->id = can_id;
    frame->data[0] = msg->code;
    frame->dlc = (uint8_t)(put_fields(layout_of(msg->code)->fields, msg, &frame->data[1]) - frame->data);
}
