#include "pdcp_txq.h"

#include <stddef.h>
#include <string.h>

/* Last identifier of high priority [PDCP figure 2.3]. */
#define PDCP_TX_URGENT_ID 0x1FFu

void pdcp_txq_init(pdcp_txq_t *txq)
{
    memset(txq, 0, sizeof *txq);
}

bool pdcp_txq_put(pdcp_txq_t *txq, const can_frame_t *frame)
{
    const bool urgent = frame->id <= PDCP_TX_URGENT_ID;
    if (txq->count >= (urgent ? PDCP_TX_MAX : PDCP_TX_MAX - PDCP_TX_URGENT)) {
        return false;
    }
    uint8_t at = txq->count;
    while (at > 0 && txq->frames[at - 1].id <= frame->id) {
        txq->frames[at] = txq->frames[at - 1];
        at--;
    }
    txq->frames[at] = *frame;
    txq->count++;
    return true;
}

const can_frame_t *pdcp_txq_peek(const pdcp_txq_t *txq)
{
    return txq->count != 0 ? &txq->frames[txq->count - 1] : NULL;
}

void pdcp_txq_pop(pdcp_txq_t *txq)
{
    if (txq->count != 0) {
        txq->count--;
    }
}
