/* What is stored stands in two areas of the memory that are written in turn: a write never touches the newest
 * good copy, so that power may fail at any byte and either the old or the new one is there afterwards. Each
 * area begins with
 *
 *   byte   0   1       2       3      4    5
 *          'P' letter  version count  seq  seq
 *
 * seq counts writes, LSB first, and wraps; whoever is not a record (below) uses count otherwise. */
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

/* Records ------------------------------------------------------------------------------------------------ */

enum { ARB_RECORD_ENTRY_MAX = 7 };

/* A record: the header, count entries, the CRC-32 over everything before. */
typedef struct {
    uint16_t address; /* of the first area; the second one follows */
    uint16_t size;    /* bytes of an area, whole pages */
    uint8_t letter;
    uint8_t entry; /* bytes of an entry, ARB_RECORD_ENTRY_MAX at most */
    /* Entry k of the next copy, and of the newest one when it is loaded. */
    void (*put)(const void *table, uint8_t k, uint8_t *entry);
    void (*take)(void *table, uint8_t k, const uint8_t *entry);
} arb_record_t;

/* A copy that is written page by page; all 0 at the beginning. */
typedef struct {
    uint32_t crc;
    uint16_t written; /* bytes handed over so far */
} arb_record_copy_t;

static inline uint16_t arb_record_length(const arb_record_t *record, uint8_t count)
{
    return (uint16_t)(ARB_AREA_HEADER + record->entry * count + ARB_AREA_CRC);
}

/* Finds the newest good copy, hands its entries to take, and counts the areas that are neither empty nor
 * good.
 */
void arb_record_load(const arb_record_t *record, const arb_nvm_t *nvm, arb_area_t *newest, uint8_t *damaged,
                     void *table);

/* Hands over the next page of a copy with count entries of table, which goes to the next area. Nothing, and
 * begins anew with the next call, if they are not what they were at the page before. False: the memory does
 * not take it. */
bool arb_record_write(const arb_record_t *record, const arb_nvm_t *nvm, const arb_area_t *newest,
                      uint8_t count, const void *table, arb_record_copy_t *copy);

/* The whole copy is in the memory. */
void arb_record_written(arb_area_t *newest);

#endif
