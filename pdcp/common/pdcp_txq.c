#include "pdcp_txq.h"

#include <stddef.h>
#include <string.h>

void pdcp_txq_init(pdcp_txq_t *txq)
{
    memset(txq, 0, sizeof *txq);
}

pdcp_txq_put_t pdcp_txq_put(pdcp_txq_t *txq, const can_frame_t *frame)
{
    const bool full = txq->count == PDCP_TX_MAX;
    if (full && frame->id >= txq->frames[0].id) {
        return PDCP_TXQ_FULL;
    }
    if (full) {
        txq->count--;
        memmove(&txq->frames[0], &txq->frames[1], txq->count * sizeof txq->frames[0]);
    }
    uint8_t at = txq->count;
    while (at > 0 && txq->frames[at - 1].id <= frame->id) {
        at--;
    }
    memmove(&txq->frames[at + 1], &txq->frames[at], (size_t)(txq->count - at) * sizeof txq->frames[0]);
    txq->frames[at] = *frame;
    txq->count++;
    return full ? PDCP_TXQ_PUSHED_OUT : PDCP_TXQ_TAKEN;
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
