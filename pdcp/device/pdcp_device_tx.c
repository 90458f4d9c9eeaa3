#include "pdcp_device_tx.h"

#include <stddef.h>
#include <string.h>

bool pdcp_device_tx_frame(pdcp_device_t *dev, const can_frame_t *frame)
{
    const pdcp_txq_put_t put = pdcp_txq_put(&dev->txq, frame);
    if (put != PDCP_TXQ_TAKEN) {
        dev->stats.tx_full++;
    }
    return put != PDCP_TXQ_FULL;
}

/* Does the same frame wait already? */
static bool is_waiting(const pdcp_device_t *dev, const can_frame_t *frame)
{
    for (uint8_t i = 0; i < dev->txq.count; i++) {
        const can_frame_t *other = &dev->txq.frames[i];
        if (other->id == frame->id && other->dlc == frame->dlc &&
            memcmp(other->data, frame->data, frame->dlc) == 0) {
            return true;
        }
    }
    return false;
}

void pdcp_device_tx_msg(pdcp_device_t *dev, const pdcp_msg_t *msg)
{
    can_frame_t frame;
    pdcp_codec_encode(pdcp_can_id(PDCP_PRIORITY_NORMAL, false, dev->node_id), msg, &frame);
    (void)pdcp_device_tx_frame(dev, &frame);
}

void pdcp_device_tx_answer(pdcp_device_t *dev, const pdcp_msg_t *request, uint8_t result)
{
    pdcp_msg_t answer = *request;
    answer.code = (uint8_t)(request->code | PDCP_ANSWER);
    answer.result = result;
    pdcp_device_tx_msg(dev, &answer);
}

void pdcp_device_tx_beacon(pdcp_device_t *dev)
{
    const pdcp_msg_t beacon = {.code = PDCP_BEACON};
    can_frame_t frame;
    pdcp_codec_encode(pdcp_can_id(PDCP_PRIORITY_HIGH, false, dev->node_id), &beacon, &frame);
    if (!is_waiting(dev, &frame)) {
        (void)pdcp_device_tx_frame(dev, &frame);
    }
}

bool pdcp_device_tx_has_room(const pdcp_device_t *dev)
{
    return dev->txq.count < PDCP_TX_MAX - PDCP_DEVICE_ANSWERS_MAX;
}

bool pdcp_device_tx_peek(const pdcp_device_t *dev, can_frame_t *frame)
{
    const can_frame_t *first = pdcp_txq_peek(&dev->txq);
    if (first == NULL) {
        return false;
    }
    *frame = *first;
    return true;
}

void pdcp_device_tx_pop(pdcp_device_t *dev)
{
    if (dev->txq.count != 0) {
        dev->stats.tx++;
        pdcp_txq_pop(&dev->txq);
    }
}
