/* A small table that is kept as a whole: a record stands in two areas (arb_area.h), header, count entries,
 * then the CRC-32 over everything before. It is written page by page. */
#ifndef ARB_RECORD_H
#define ARB_RECORD_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_area.h"

enum { ARB_RECORD_ENTRY_MAX = 7 };

/* Where a record stands, and what it is made of. Constant. */
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

/* Finds the newest good copy, hands its entries to take, and counts in damaged the areas that are neither
 * empty nor good. */
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
