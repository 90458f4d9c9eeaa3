/* Keeps the flags of 2404h (host-api.md 3, D-API-5) over a power cycle.
 *
 * The record stands in two pages of the memory that are written in turn: power may fail at any byte of a
 * write. One page:
 *
 *   byte   0   1   2        3       4    5    6 .. 5 + length   then
 *          'P' 'F' version  length  seq  seq  settings          CRC-32 over everything before
 *
 * seq counts writes; both are LSB first. Settings: the flags byte. A longer record is read too: settings may
 * be added behind. */
#ifndef ARB_FLAGS_H
#define ARB_FLAGS_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_record.h"

enum {
    ARB_FLAGS_LENGTH = 1, /* bytes of settings that are written */
    ARB_FLAGS_RETRY_MS = 500
};

/* The flags of 2404h (host-api.md 3). The two highest are not stored: the event stream is a session's. */
enum {
    ARB_FLAG_AUTOCONFIGURE = 0x01,
    ARB_FLAG_HOT_SWAP = 0x02,
    ARB_FLAG_AUTO_SAVE = 0x04,
    ARB_FLAG_STRICT_CRC = 0x08,
    ARB_FLAG_EVENTS = 0x10,
    ARB_FLAGS_STORED = 0x0F, /* those that are stored */
    ARB_FLAGS_FACTORY = 0x03
};

typedef struct {
    uint32_t due_ms;
    arb_area_t newest;
    uint8_t flags;    /* as set */
    uint8_t stored;   /* as in the memory; the default ones if there is nothing */
    uint8_t writing;  /* flags of the page under way; equal to stored: none is */
    uint8_t failures; /* writes that failed, since the start, FFh at most */
    uint8_t damaged;  /* pages that were neither empty nor good at the start */
} arb_flags_t;

/* Reads the newest good copy. Blocks for as long as the memory needs to be read. */
void arb_flags_load(arb_flags_t *flags, arb_nvm_t *nvm);

/* Sets the flags, and stores them if they differ from the stored ones. Only those of ARB_FLAGS_STORED
 * count. */
void arb_flags_set(arb_flags_t *flags, uint8_t value, uint32_t now_ms);

/* The flags as they were set or stored last. */
static inline uint8_t arb_flags_get(const arb_flags_t *flags)
{
    return flags->flags;
}

/* Writes if it is due; at most one page a call. */
void arb_flags_step(arb_flags_t *flags, arb_nvm_t *nvm, uint32_t now_ms);

/* The time of the next call at the latest; now_ms + PDCP_TIME_FAR_MS when there is nothing to write. */
uint32_t arb_flags_next_ms(const arb_flags_t *flags, uint32_t now_ms);

#endif
