/* Contract: one CAN controller.
 *
 * Each target's own header says how a controller is opened; this one says what an open controller can do. No
 * function blocks, and none keeps a pointer that it is given. Call all of them from the main loop, never from
 * an interrupt handler. */
#ifndef HAL_CAN_H
#define HAL_CAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_frame.h"

typedef struct hal_can hal_can_t;

/* Error state of the controller as ISO 11898-1 has it, and one of our own for a bus that is not there:
 * interface down, adapter unplugged, connection lost. */
typedef enum {
    HAL_CAN_ACTIVE = 0,
    HAL_CAN_PASSIVE = 1,
    HAL_CAN_BUS_OFF = 2,
    HAL_CAN_DOWN = 3
} hal_can_state_t;

typedef struct {
    hal_can_state_t state;
    uint8_t tx_errors;    /* transmit error counter, 255 when it is higher */
    uint8_t rx_errors;    /* receive error counter */
    uint32_t rx_overruns; /* frames that the controller or its driver lost, since it was opened */
    uint32_t tx_failed;   /* frames accepted by hal_can_send that are known not to have left */
} hal_can_health_t;

/* A frame passes a filter when (frame id & mask) == id. Frames that are no base data frames pass always:
 * they are to be counted. */
typedef struct {
    uint16_t id;
    uint16_t mask;
} hal_can_filter_t;

/* Hands one frame to the controller; it is copied. False: no room now, or the bus is down; the frame is
 * not taken and the caller offers it again, at the latest when the controller reports room
 * (interrupt, writability). Never drops an accepted frame silently: tx_failed counts it. */
bool hal_can_send(hal_can_t *can, const can_frame_t *frame);

/* Takes up to max received frames, oldest first, into frames[]. Returns how many; 0 means that there are
 * none now. */
size_t hal_can_receive(hal_can_t *can, can_frame_t *frames, size_t max);

/* State as last known; costs no bus or system call. */
hal_can_health_t hal_can_health(const hal_can_t *can);

/* Starts recovery from bus-off (128 x 11 recessive bits, done by the controller); without effect in any
 * other state, and on targets whose driver recovers by itself. */
void hal_can_restart(hal_can_t *can);

/* Replaces the acceptance filters; n = 0 accepts everything, which is the state after opening. When the
 * target has fewer filters than n, everything is accepted: filtering saves work, it decides nothing. */
void hal_can_set_filters(hal_can_t *can, const hal_can_filter_t *filters, size_t n);

#endif
