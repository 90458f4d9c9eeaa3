/* What is stored stands in two areas of the memory that are written in turn: a write never touches the newest
 * good copy, so that power may fail at any byte and either the old or the new one is there afterwards. Each
 * area begins with
 *
 *   byte   0   1       2       3      4    5
 *          'P' letter  version count  seq  seq
 *
 * seq counts writes, LSB first, and wraps; whoever is not a record (arb_record.h) uses count otherwise. */
#ifndef ARB_AREA_H
#define ARB_AREA_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_nvm.h"

enum { ARB_AREAS = 2, ARB_AREA_VERSION = 1, ARB_AREA_HEADER = 6, ARB_AREA_CRC = 4 };

/* The newest good copy. */
typedef struct {
    uint16_t sequence;
    uint8_t area; /* where it stands; ARB_AREAS: there is none */
} arb_area_t;

typedef enum { ARB_AREA_EMPTY, ARB_AREA_DAMAGED, ARB_AREA_GOOD } arb_area_state_t;

/* Reads the size bytes, ARB_AREA_HEADER at least, that the area at this address begins with. Good so far:
 * letter and version are right. What cannot be read counts as empty. */
arb_area_state_t arb_area_open(const arb_nvm_t *nvm, uint16_t address, uint8_t letter, uint8_t *header,
                               uint16_t size);

/* A good copy with this header was found in area. True: it is the newest one so far. */
bool arb_area_offer(arb_area_t *newest, uint8_t area, const uint8_t header[ARB_AREA_HEADER]);

/* The area that is written next. */
static inline uint8_t arb_area_next(const arb_area_t *newest)
{
    return newest->area == 0 ? 1 : 0;
}

/* The beginning of the next copy. */
void arb_area_put_header(const arb_area_t *newest, uint8_t letter, uint8_t count,
                         uint8_t header[ARB_AREA_HEADER]);

#endif
