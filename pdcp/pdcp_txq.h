/* Frames that wait for the controller, in the order in which they would win arbitration: by identifier,
 * oldest first among equals. An urgent frame overtakes all others; a full queue refuses, and the caller
 * decides what that means. */
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

void pdcp_txq_init(pdcp_txq_t *txq);

/* Copies the frame in. False: full; the last PDCP_TX_URGENT places are for high priority alone. */
bool pdcp_txq_put(pdcp_txq_t *txq, const can_frame_t *frame);

/* The frame that leaves next, NULL when there is none. Valid until the queue is changed. */
const can_frame_t *pdcp_txq_peek(const pdcp_txq_t *txq);

/* Removes the frame that pdcp_txq_peek showed. */
void pdcp_txq_pop(pdcp_txq_t *txq);

#endif
