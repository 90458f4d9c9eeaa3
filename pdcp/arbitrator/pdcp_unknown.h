/* Node ids without an owner: when each was heard, and which were told to reset.
 *
 * An id on which somebody may still speak is not given away (D-BUS-36). Every unknown id is told to reset on
 * its own, at most once a second (D-BUS-15, D-BUS-37). Time is kept in ticks of 100 ms. Plain data: nothing
 * is sent here. */
#ifndef PDCP_UNKNOWN_H
#define PDCP_UNKNOWN_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bits.h"

enum {
    PDCP_UNKNOWN_IDS = 256,
    PDCP_UNKNOWN_TICK_MS = 100,
    PDCP_UNKNOWN_QUIET = 120,     /* ticks, 12 s: silence after which an id is quiet */
    PDCP_UNKNOWN_RESET_PAUSE = 10 /* ticks, 1 s: between two Resets to the same id (D-BUS-15) */
};

typedef struct {
    uint32_t tick_ms;                /* when the tick under way began */
    uint8_t tick;                    /* its number, 1 to 255, then 1 again */
    uint8_t swept;                   /* tick of the last sweep */
    uint8_t heard[PDCP_UNKNOWN_IDS]; /* by node id: tick of the last frame, or of the last Reset; 0: quiet */
    /* Sets of node ids. answered: told to reset, has answered, and not heard since. told: heard[] is the tick
     * of a Reset. */
    uint8_t answered[PDCP_BIT_BYTES(PDCP_UNKNOWN_IDS)];
    uint8_t told[PDCP_BIT_BYTES(PDCP_UNKNOWN_IDS)];
} pdcp_unknown_t;

/* Makes all ids quiet. */
void pdcp_unknown_init(pdcp_unknown_t *unknown, uint32_t now_ms);

/* Lets time pass. Call at least every few days. */
void pdcp_unknown_on_time(pdcp_unknown_t *unknown, uint32_t now_ms);

/* Notes a frame from this id, or that its owner was just forgotten (D-BUS-47). */
void pdcp_unknown_note(pdcp_unknown_t *unknown, uint32_t now_ms, uint8_t id);

/* Notes an answer to Reset Device from this id. If it was told to reset, its speaker is silent from now
 * on. */
void pdcp_unknown_note_answer(pdcp_unknown_t *unknown, uint32_t now_ms, uint8_t id);

/* True: the id is to be told to reset now, and counts as told. */
bool pdcp_unknown_tell(pdcp_unknown_t *unknown, uint32_t now_ms, uint8_t id);

/* Was a frame heard on any id lately? */
bool pdcp_unknown_any(const pdcp_unknown_t *unknown);

/* Ticks since a frame was heard on this id, as of the last of the calls above; PDCP_UNKNOWN_QUIET: it is
 * quiet. */
uint8_t pdcp_unknown_silence(const pdcp_unknown_t *unknown, uint8_t id);

#endif
