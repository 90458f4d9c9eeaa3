/* Positions in a ring with one writer and one reader; either may be an interrupt handler.
 *
 * head counts items put in, tail items taken out. Both wrap, so every place is usable. The capacity is a
 * power of two up to 128. The writer fills a place before it moves head; the reader empties it before it
 * moves tail. */
#ifndef RING_H
#define RING_H

#include <stdint.h>

#include "part.h"

typedef struct {
    volatile uint8_t head; /* written by the writer alone */
    volatile uint8_t tail; /* written by the reader alone */
} ring_t;

PART_INLINE uint8_t ring_count(const ring_t *ring)
{
    return (uint8_t)(ring->head - ring->tail);
}

/* The place of the entry that head or tail stands for. */
PART_INLINE uint8_t ring_place(uint8_t counter, uint8_t capacity)
{
    return (uint8_t)(counter & (capacity - 1u));
}

#endif
