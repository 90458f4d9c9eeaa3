/* Keeps the identities and their node ids over a power cycle (D-BUS-6).
 *
 * The table stands in two areas of non-volatile memory that are written in turn: a write never touches the
 * newest good copy, so that power may fail at any byte and either the old or the new table is there
 * afterwards. One area:
 *
 *   byte     0   1   2        3      4    5    6 .. 8 + 7 n        last four
 *            'P' 'I' version  count  seq  seq  count entries       CRC-32 over everything before
 *
 * seq: 16 bits, LSB first, counts writes. An entry: VID, PID, SN (LSB first), node id. Most recently used
 * first. */
#ifndef ARB_STORE_H
#define ARB_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_record.h"
#include "pdcp_bind.h"
#include "pdcp_time.h"

enum {
    ARB_STORE_ENTRY = 7,
    ARB_STORE_DELAY_MS = 500,  /* after the last change: one write for a limb that powers up */
    ARB_STORE_PAUSE_MS = 10000 /* between two writes; changes in between are stored together (D-BUS-43) */
};

/* Bytes of one area, whole pages. */
#define ARB_STORE_AREA                                                                                       \
    (((ARB_AREA_HEADER + ARB_STORE_ENTRY * PDCP_IDENTITIES_MAX + ARB_AREA_CRC + ARB_PORT_NVM_PAGE - 1) /     \
      ARB_PORT_NVM_PAGE) *                                                                                   \
     ARB_PORT_NVM_PAGE)

typedef struct {
    arb_nvm_t *nvm;
    arb_area_t newest;
    bool changed;           /* the table is newer than the newest copy */
    arb_record_copy_t copy; /* the one being written; none while nothing is handed over */
    uint32_t due_ms;
    uint32_t pause_ms; /* no write begins before; valid while pausing */
    bool pausing;
    uint32_t failures; /* writes that failed, since the start */
    uint8_t damaged;   /* areas that were neither empty nor good at start-up */
} arb_store_t;

/* Reads the newest good copy into bind, which must be empty. nvm must outlive the store. */
void arb_store_load(arb_store_t *store, arb_nvm_t *nvm, pdcp_bind_t *bind);

/* Notes that the table has changed. It is written ARB_STORE_DELAY_MS after the last change, and not before
 * ARB_STORE_PAUSE_MS after the last write. */
void arb_store_touch(arb_store_t *store, uint32_t now_ms);

/* Writes the next page if it is due; at most one page a call. */
void arb_store_step(arb_store_t *store, const pdcp_bind_t *bind, uint32_t now_ms);

/* The time of the next call at the latest; now_ms + PDCP_TIME_FAR_MS when there is nothing to write. */
static inline uint32_t arb_store_next_ms(const arb_store_t *store, uint32_t now_ms)
{
    return store->changed ? store->due_ms : now_ms + PDCP_TIME_FAR_MS;
}

#endif
