/* Converts frames from and to struct can_frame, which gs_usb adapters use as well. Flags stand in the
 * identifier, and error frames report the state of the controller. */
#ifndef LINUX_CAN_FRAME_H
#define LINUX_CAN_FRAME_H

#include <stdbool.h>
#include <stdint.h>

#include "can_frame.h"
#include "hal_can.h"

/* As the protocol core takes it. can_id is that of struct can_frame, flags included; data has size bytes, or
 * 8 where size is larger. fd: a CAN FD frame, of which the first 8 bytes are kept. */
void linux_can_frame_decode(uint32_t can_id, bool fd, uint8_t size, const uint8_t *data, can_frame_t *out);

/* Brings *health up to date with an error frame of 8 bytes. */
void linux_can_frame_note_error(uint32_t can_id, const uint8_t *data, hal_can_health_t *health);

#endif
