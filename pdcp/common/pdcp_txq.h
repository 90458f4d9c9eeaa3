/* Transmit queue: frames in the order in which they win arbitration, by identifier, oldest first among
 * equals. An urgent frame overtakes the others. When the queue is full it pushes the least urgent one out, so
 * that frames of low priority never keep a beacon or a link change waiting. */
#ifndef PDCP_TXQ_H
#define PDCP_TXQ_H

#include <stdbool.h>
#include <stdint.h>

#include "can_frame.h"
#include "pdcp_limits.h"

typedef struct {
    can_frame_t frames[PDCP_TX_MAX]; /* what leaves next stands last */
    uint8_t count;
} pdcp_txq_t;

typedef enum {
    PDCP_TXQ_TAKEN = 0,
    PDCP_TXQ_PUSHED_OUT, /* taken, but the frame that would have left last is gone */
    PDCP_TXQ_FULL        /* not taken */
} pdcp_txq_put_t;

void pdcp_txq_init(pdcp_txq_t *txq);

/* Copies the frame in. A full queue takes it only if it is more urgent than the frame that would leave
 * last. */
pdcp_txq_put_t pdcp_txq_put(pdcp_txq_t *txq, const can_frame_t *frame);

/* The frame that leaves next, NULL when there is none. Valid until the queue is changed. */
const can_frame_t *pdcp_txq_peek(const pdcp_txq_t *txq);

/* Removes the frame that pdcp_txq_peek showed. */
void pdcp_txq_pop(pdcp_txq_t *txq);

#endif
