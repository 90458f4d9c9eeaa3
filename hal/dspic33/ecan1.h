/* ECAN1 with DMA as the CAN controller of hal_can.h, 1 Mbit/s.
 *
 * In: the controller puts frames by DMA into a FIFO of 24 buffers, the handler moves them to a ring of
 * PART_CAN_RX_PLACES frames, and hal_can_receive takes them from there. When the ring is full they stay in
 * the FIFO; a frame that finds that full too is lost and counted in rx_overruns. So the main loop may stay
 * away for 56 frames on the FJ part and 152 on the EP part: 2.6 and 7.1 ms of the shortest ones back to
 * back, 6.2 and 16 ms of those with 8 bytes. Frames of other kinds than base data frames come too, with id 0;
 * an error on the wire comes as a CAN_FRAME_ERROR.
 *
 * Out: one queue and one transmit buffer for each PDCP priority (bits 10 and 9 of the identifier). An urgent
 * frame overtakes all others but the one on the wire; frames of one priority leave in the order in which they
 * came.
 *
 * Bus-off: what waits is dropped and counted in tx_failed, and the controller is held off the bus until
 * hal_can_restart; it then waits for 128 x 11 recessive bits by itself.
 *
 * Erratum of the FJ part: early silicon may put a frame at a wrong place of DMA RAM at 1 Mbit/s
 * (docs/hardware.md). Such a frame is noticed, because its own buffer stays marked, and is counted as an
 * overrun. */
#ifndef ECAN1_H
#define ECAN1_H

#include <stdbool.h>

#include "hal_can.h"

/* Sets the controller up and joins the bus as soon as that is idle. The only one there is; never NULL. When
 * it does not enter configuration mode within 1 ms its state is HAL_CAN_DOWN for good: a hardware fault. */
hal_can_t *ecan1_open(void);

/* Frames can be received, or a refused frame can be offered again. For the decision whether to idle; any
 * context. */
bool ecan1_has_work(const hal_can_t *can);

#endif
