#include "linux_can_frame.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <string.h>

static can_frame_kind_t kind_of(uint32_t can_id, bool fd)
{
    if (fd) {
        return CAN_FRAME_FD;
    }
    if ((can_id & CAN_ERR_FLAG) != 0) {
        return CAN_FRAME_ERROR;
    }
    if ((can_id & CAN_RTR_FLAG) != 0) {
        return CAN_FRAME_REMOTE;
    }
    return (can_id & CAN_EFF_FLAG) != 0 ? CAN_FRAME_EXTENDED : CAN_FRAME_BASE;
}

void linux_can_frame_decode(uint32_t can_id, bool fd, uint8_t size, const uint8_t *data, can_frame_t *out)
{
    *out = (can_frame_t){0};
    out->kind = (uint8_t)kind_of(can_id, fd);
    out->id = out->kind == CAN_FRAME_BASE ? (uint16_t)(can_id & CAN_SFF_MASK) : 0;
    out->dlc = size > CAN_FRAME_DATA_MAX ? (uint8_t)CAN_FRAME_DATA_MAX : size;
    if (out->kind != CAN_FRAME_REMOTE) {
        memcpy(out->data, data, out->dlc);
    }
}

/* What the controller says of itself in byte 1. */
static void note_controller(uint8_t status, hal_can_health_t *health)
{
    if ((status & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) {
        health->state = HAL_CAN_PASSIVE;
    } else if ((status & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING | CAN_ERR_CRTL_ACTIVE)) != 0) {
        health->state = HAL_CAN_ACTIVE;
    }
    health->rx_overruns += (status & CAN_ERR_CRTL_RX_OVERFLOW) != 0 ? 1u : 0u;
    health->tx_failed += (status & CAN_ERR_CRTL_TX_OVERFLOW) != 0 ? 1u : 0u;
}

void linux_can_frame_note_error(uint32_t can_id, const uint8_t *data, hal_can_health_t *health)
{
    if ((can_id & CAN_ERR_CRTL) != 0) {
        note_controller(data[1], health);
    }
    if ((can_id & (CAN_ERR_CRTL | CAN_ERR_CNT)) != 0) {
        health->tx_errors = data[6];
        health->rx_errors = data[7];
    }
    health->tx_failed += (can_id & CAN_ERR_TX_TIMEOUT) != 0 ? 1u : 0u;
    if ((can_id & CAN_ERR_BUSOFF) != 0) {
        health->state = HAL_CAN_BUS_OFF;
    } else if ((can_id & CAN_ERR_RESTARTED) != 0) {
        health->state = HAL_CAN_ACTIVE;
        health->tx_errors = 0;
        health->rx_errors = 0;
    }
}
