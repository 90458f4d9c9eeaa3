/* A CAN frame as every room of the house passes it on.
 *
 * pdcp/ shares only this type with hal/. It holds what a controller reports, and nothing of what PDCP makes
 * of it. A frame carries no time: whoever hands it on says when it came. */
#ifndef CAN_FRAME_H
#define CAN_FRAME_H

#include <stdint.h>

#define CAN_FRAME_DATA_MAX 8u
#define CAN_FRAME_ID_MAX 0x7FFu

/* Kind of a frame. PDCP uses CAN_FRAME_BASE only. The others exist to be counted by cause instead of
 * vanishing in a driver [PDCP 2.2]. */
typedef enum {
    CAN_FRAME_BASE = 0,     /* CAN 2.0A data frame, 11-bit identifier */
    CAN_FRAME_EXTENDED = 1, /* data frame with a 29-bit identifier */
    CAN_FRAME_REMOTE = 2,   /* remote frame, either identifier */
    CAN_FRAME_ERROR = 3,    /* error report of the controller or its driver */
    CAN_FRAME_FD = 4        /* CAN FD frame */
} can_frame_kind_t;

typedef struct {
    uint16_t id;  /* 0 to 7FFh; 0 when kind is not CAN_FRAME_BASE */
    uint8_t kind; /* can_frame_kind_t */
    uint8_t dlc;  /* number of data bytes, 0 to 8; a DLC of 9 to 15 on the wire means 8 bytes */
    uint8_t data[CAN_FRAME_DATA_MAX];
} can_frame_t;

#endif
