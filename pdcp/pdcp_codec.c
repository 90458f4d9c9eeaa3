#include "pdcp_codec.h"

#include <stddef.h>
#include <string.h>

/* Byte offsets of one message's fields; 0 means that the field is not there, since byte 0 is the function
 * code. Packed, since there are 32 rows. */
typedef struct {
    unsigned dlcs : 9;     /* bit n: DLC n is accepted */
    unsigned dlc_min : 4;  /* DLC sent when the value is empty */
    unsigned result : 1;   /* 1 byte */
    unsigned node_id : 1;  /* 1 byte */
    unsigned packet : 1;   /* 1 byte */
    unsigned param : 2;    /* 1 byte */
    unsigned channel : 2;  /* 1 byte */
    unsigned word : 3;     /* 2 bytes */
    unsigned identity : 2; /* 6 bytes */
    unsigned value : 3;    /* to the end of the data */
} layout_t;

#define DLC(n) (1u << (n))
#define DLCS(from, to) ((1u << ((to) + 1u)) - (1u << (from)))

/* [PDCP 3.2], requests by their code and answers by their code less 70h. A DLC that only [PDCP 3.1] has is
 * accepted beside (D-BUS-3); 0 stands for a code that does not exist. */
static const layout_t layouts[32] = {
    [0x01] = {.dlcs = DLC(7), .dlc_min = 7, .identity = 1},
    [0x02] = {.dlcs = DLC(2), .dlc_min = 1, .value = 1},
    [0x03] = {.dlcs = DLC(3), .dlc_min = 3, .param = 1, .channel = 2},
    [0x04] = {.dlcs = DLCS(4, 7), .dlc_min = 3, .param = 1, .channel = 2, .value = 3},
    [0x05] = {.dlcs = DLC(4), .dlc_min = 1, .value = 1},
    [0x06] = {.dlcs = DLCS(5, 8), .dlc_min = 1, .value = 1},
    [0x07] = {.dlcs = DLC(2), .dlc_min = 1, .value = 1},
    [0x08] = {.dlcs = DLC(3), .dlc_min = 3, .word = 1},
    [0x09] = {.dlcs = DLC(1), .dlc_min = 1},
    [0x0A] = {.dlcs = DLC(1), .dlc_min = 1},
    [0x0B] = {.dlcs = DLC(1), .dlc_min = 1},
    [0x0C] = {.dlcs = DLC(3) | DLC(5), .dlc_min = 3, .param = 1, .channel = 2},
    [0x0D] = {.dlcs = DLC(5), .dlc_min = 5, .param = 1, .channel = 2, .word = 3},
    [0x0E] = {.dlcs = DLCS(3, 8), .dlc_min = 2, .packet = 1, .value = 2},
    [0x0F] = {.dlcs = DLC(2), .dlc_min = 2, .channel = 1},
    [0x11] = {.dlcs = DLC(8), .dlc_min = 8, .node_id = 1, .identity = 2},
    [0x12] = {.dlcs = DLCS(2, 6), .dlc_min = 1, .value = 1},
    [0x13] = {.dlcs = DLCS(4, 8), .dlc_min = 4, .result = 1, .param = 2, .channel = 3, .value = 4},
    [0x14] = {.dlcs = DLCS(4, 8), .dlc_min = 4, .result = 1, .param = 2, .channel = 3, .value = 4},
    [0x15] = {.dlcs = DLCS(4, 7), .dlc_min = 1, .value = 1},
    [0x16] = {.dlcs = DLC(1), .dlc_min = 1},
    [0x17] = {.dlcs = DLC(1), .dlc_min = 1},
    [0x18] = {.dlcs = DLC(1) | DLC(4), .dlc_min = 4, .result = 1, .word = 2},
    [0x19] = {.dlcs = DLC(1) | DLC(2), .dlc_min = 2, .result = 1},
    [0x1B] = {.dlcs = DLC(1) | DLC(2), .dlc_min = 2, .result = 1},
    [0x1C] = {.dlcs = DLC(6), .dlc_min = 6, .result = 1, .param = 2, .channel = 3, .word = 4},
    [0x1D] = {.dlcs = DLC(6), .dlc_min = 6, .result = 1, .param = 2, .channel = 3, .word = 4},
    [0x1E] = {.dlcs = DLC(2), .dlc_min = 2, .result = 1},
    [0x1F] = {.dlcs = DLC(3), .dlc_min = 3, .result = 1, .channel = 2},
};

static const layout_t *layout_of(uint8_t code)
{
    const uint8_t row = (uint8_t)((code & 0x0Fu) | ((code & 0x80u) >> 3));
    return (code & 0x70u) == 0 && layouts[row].dlcs != 0 ? &layouts[row] : NULL;
}

static uint8_t byte_at(const can_frame_t *frame, uint8_t at)
{
    return at != 0 ? frame->data[at] : 0;
}

static uint16_t word_at(const can_frame_t *frame, uint8_t at)
{
    return pdcp_value_u16(frame->data, frame->dlc, at);
}

pdcp_decode_t pdcp_decode(const can_frame_t *frame, pdcp_msg_t *msg)
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
    msg->result = frame->dlc > layout->result ? byte_at(frame, layout->result) : PDCP_SUCCESS;
    msg->param = byte_at(frame, layout->param);
    msg->channel = byte_at(frame, layout->channel);
    msg->node_id = byte_at(frame, layout->node_id);
    msg->packet_id = byte_at(frame, layout->packet);
    if (layout->word != 0) {
        msg->word = word_at(frame, layout->word);
    }
    if (layout->identity != 0) {
        msg->identity.vid = word_at(frame, layout->identity);
        msg->identity.pid = word_at(frame, (uint8_t)(layout->identity + 2));
        msg->identity.sn = word_at(frame, (uint8_t)(layout->identity + 4));
    }
    if (layout->value != 0) {
        msg->len = (uint8_t)(frame->dlc - layout->value);
        memcpy(msg->value, &frame->data[layout->value], msg->len);
    }
    return PDCP_DECODE_OK;
}

static void put_byte(can_frame_t *frame, uint8_t at, uint8_t byte)
{
    if (at != 0) {
        frame->data[at] = byte;
    }
}

void pdcp_encode(uint16_t can_id, const pdcp_msg_t *msg, can_frame_t *frame)
{
    const layout_t *layout = layout_of(msg->code);
    memset(frame, 0, sizeof *frame);
    frame->id = can_id;
    frame->dlc = layout->dlc_min;
    put_byte(frame, layout->result, msg->result);
    put_byte(frame, layout->param, msg->param);
    put_byte(frame, layout->channel, msg->channel);
    put_byte(frame, layout->node_id, msg->node_id);
    put_byte(frame, layout->packet, msg->packet_id);
    if (layout->word != 0) {
        pdcp_put_u16(&frame->data[layout->word], msg->word);
    }
    if (layout->identity != 0) {
        pdcp_put_u16(&frame->data[layout->identity], msg->identity.vid);
        pdcp_put_u16(&frame->data[layout->identity + 2], msg->identity.pid);
        pdcp_put_u16(&frame->data[layout->identity + 4], msg->identity.sn);
    }
    if (layout->value != 0) {
        memcpy(&frame->data[layout->value], msg->value, msg->len);
        frame->dlc = (uint8_t)(layout->value + msg->len);
    }
    frame->data[0] = msg->code;
}

uint8_t pdcp_value_u8(const uint8_t *value, uint16_t len, uint16_t at)
{
    return at < len ? value[at] : 0;
}

uint16_t pdcp_value_u16(const uint8_t *value, uint16_t len, uint16_t at)
{
    const uint16_t low = pdcp_value_u8(value, len, at);
    const uint16_t high = pdcp_value_u8(value, len, (uint16_t)(at + 1u));
    return (uint16_t)(low | (uint16_t)(high << 8));
}

void pdcp_put_u16(uint8_t *bytes, uint16_t word)
{
    bytes[0] = (uint8_t)(word & 0xFFu);
    bytes[1] = (uint8_t)(word >> 8);
}

bool pdcp_identity_equal(const pdcp_identity_t *a, const pdcp_identity_t *b)
{
    return a->vid == b->vid && a->pid == b->pid && a->sn == b->sn;
}
