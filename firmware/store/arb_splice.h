/* How the new configuration string comes of the stored one: a block of bytes stands where others are cut out.
 *
 *   stored   head ...... [from  cut  to) tail ......
 *   new      head ...... [from  block  ) tail ......
 *
 * The block is a configuration, behind the number of configurations if the stored string has none, or bytes
 * of the host. Plain data: the memory is read and written by arb_config.c. */
#ifndef ARB_SPLICE_H
#define ARB_SPLICE_H

#include <stdbool.h>
#include <stdint.h>

#include "profile_tlv.h"

typedef struct {
    const uint8_t *piece; /* the block when it is the host's; NULL: it is a configuration */
    uint16_t from;        /* what is cut out of the stored string: from here */
    uint16_t to;          /* up to here */
    uint16_t block;       /* bytes that stand there instead */
    uint16_t end;         /* of the stored string as arb_splice_scan found it; 0: not read so far */
    uint16_t count_at;    /* where the stored string says how many configurations it has; */
    bool has_count;       /* it says so */
    uint8_t found;        /* arb_splice_found_t */
    uint8_t number;       /* the configuration that is replaced, or added behind the last one */
    uint8_t links;        /* of the new configuration */
} arb_splice_t;

/* The configuration of this number in the stored string. */
typedef enum {
    ARB_SPLICE_NOT_FOUND,
    ARB_SPLICE_BEGUN, /* its beginning was read, the end was not */
    ARB_SPLICE_FOUND
} arb_splice_found_t;

/* Gives link k, from 0, of the new configuration. */
typedef void (*arb_splice_link_t)(void *ctx, uint8_t k, profile_link_t *link);

/* The configuration is replaced by block bytes: 0, or arb_splice_block of what it is to be. What is cut is
 * known when arb_splice_scan has seen the stored string to its end. */
void arb_splice_replace(arb_splice_t *splice, uint8_t number, uint8_t links, uint16_t block);

/* Bytes of a configuration with so many links. */
static inline uint16_t arb_splice_block(uint8_t links)
{
    return (uint16_t)(PROFILE_TLV_CONFIGURATION_BYTES + (uint16_t)PROFILE_TLV_LINK_BYTES * links);
}

/* The bytes of the host stand at from, up to the end of what is asked for: there is no tail. */
void arb_splice_insert(arb_splice_t *splice, uint16_t from, const uint8_t *piece, uint16_t len);

/* Takes the entry at byte at of the stored string; to be called for each, in order, until splice->end. */
void arb_splice_scan(arb_splice_t *splice, uint16_t at, const uint8_t entry[PROFILE_TLV_ENTRY_BYTES]);

/* Length of the new string, after the scan. */
static inline uint16_t arb_splice_length(const arb_splice_t *splice)
{
    return (uint16_t)(splice->end - (splice->to - splice->from) + splice->block);
}

/* In which part of the new string its byte *at stands. True: in the head or the tail, which are kept, and *at
 * becomes its place in the stored string. False: in the block, and *at becomes its place there. *len becomes
 * how many bytes, of the *len behind it at most, stand in the same part. */
bool arb_splice_is_kept(const arb_splice_t *splice, uint16_t *at, uint16_t *len);

/* Writes bytes of the block from byte at on, of one entry at most. Returns how many, 1 to len. */
uint16_t arb_splice_put(const arb_splice_t *splice, arb_splice_link_t link, void *ctx, uint16_t at,
                        uint8_t *bytes, uint16_t len);

#endif
