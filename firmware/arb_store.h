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

#include "arb_nvm.h"
#include "pdcp_bind.h"

enum {
    ARB_STORE_VERSION = 1,
    ARB_STORE_HEADER = 6,
    ARB_STORE_ENTRY = 7,
    ARB_STORE_CRC = 4,
    ARB_STORE_AREAS = 2,
    ARB_STORE_DELAY_MS = 500 /* after the last change: one write for a limb that powers up */
};

/* Bytes of one area, whole pages. */
#define ARB_STORE_AREA                                                                                       \
    (((ARB_STORE_HEADER + ARB_STORE_ENTRY * PDCP_IDENTITIES_MAX + ARB_STORE_CRC + ARB_PORT_NVM_PAGE - 1) /   \
      ARB_PORT_NVM_PAGE) *                                                                                   \
     ARB_PORT_NVM_PAGE)

typedef struct {
    arb_nvm_t *nvm;    /* who may write to the memory; NULL: the table alone does */
    uint16_t sequence; /* of the newest good copy */
    uint8_t area;      /* where it stands; ARB_STORE_AREAS: there is none */
    bool changed;      /* the table is newer than the copy */
    bool writing;
    uint32_t crc;     /* of the copy being written */
    uint16_t written; /* bytes of the new copy handed over so far */
    uint32_t due_ms;
    uint32_t failures; /* writes that failed, since the start */
    uint8_t damaged;   /* areas that were neither empty nor good at start-up */
} arb_store_t;

/* Reads the newest good copy into bind, which must be empty. */
void arb_store_load(arb_store_t *store, const arb_port_t *port, pdcp_bind_t *bind);

/* Others write to the memory, too: from now on the table waits for its turn. nvm must outlive the store. */
void arb_store_share(arb_store_t *store, arb_nvm_t *nvm);

/* The table has changed: it is written ARB_STORE_DELAY_MS after the last change. */
void arb_store_touch(arb_store_t *store, uint32_t now_ms);

/* Writes the next page when it is due; at most one page a call. */
void arb_store_step(arb_store_t *store, const arb_port_t *port, const pdcp_bind_t *bind, uint32_t now_ms);

/* The time of the next call at the latest; now_ms + PDCP_TIME_FAR_MS when there is nothing to write. */
uint32_t arb_store_next_ms(const arb_store_t *store, uint32_t now_ms);

#endif
