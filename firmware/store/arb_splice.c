#include "arb_splice.h"

#include <stddef.h>
#include <string.h>

static inline uint16_t at_most(uint16_t a, uint16_t b)
{
    return a < b ? a : b;
}

void arb_splice_replace(arb_splice_t *splice, uint8_t number, uint8_t links, uint16_t block)
{
    memset(splice, 0, sizeof *splice);
    splice->number = number;
    splice->links = links;
    splice->block = block;
}

void arb_splice_insert(arb_splice_t *splice, uint16_t from, const uint8_t *piece, uint16_t len)
{
    splice->piece = piece;
    splice->from = from;
    splice->block = len;
    splice->has_count = false; /* the host's string is taken as it is */
}

/* The stored string ends here. A configuration that it does not have goes in front of its end. */
static void end_scan(arb_splice_t *splice, uint16_t at)
{
    splice->end = (uint16_t)(at + PROFILE_TLV_ENTRY_BYTES);
    if (splice->found == ARB_SPLICE_NOT_FOUND) {
        splice->from = at;
        splice->to = at;
    }
    if (!splice->has_count) { /* only what had no configurations may not have said so */
        splice->block = (uint16_t)(splice->block + PROFILE_TLV_ENTRY_BYTES);
    }
}

void arb_splice_scan(arb_splice_t *splice, uint16_t at, const uint8_t entry[PROFILE_TLV_ENTRY_BYTES])
{
    const uint8_t code = entry[0];
    if (code == PROFILE_TLV_CONFIGURATIONS) {
        splice->has_count = true;
        splice->count_at = at;
    }
    if (code != PROFILE_TLV_CONFIGURATION && code != PROFILE_TLV_END) {
        return;
    }
    if (splice->found == ARB_SPLICE_BEGUN) {
        splice->found = ARB_SPLICE_FOUND;
        splice->to = at;
    }
    if (code == PROFILE_TLV_END) {
        end_scan(splice, at);
    } else if (entry[1] == splice->number) {
        splice->found = ARB_SPLICE_BEGUN;
        splice->from = at;
    }
}

bool arb_splice_is_kept(const arb_splice_t *splice, uint16_t *at, uint16_t *len)
{
    if (*at < splice->from) {
        *len = at_most(*len, (uint16_t)(splice->from - *at));
        return true;
    }
    *at = (uint16_t)(*at - splice->from);
    if (*at < splice->block) {
        *len = at_most(*len, (uint16_t)(splice->block - *at));
        return false;
    }
    *at = (uint16_t)(*at - splice->block + splice->to);
    return true;
}

/* Entry k of the number of configurations and the new configuration. */
static void put_entry(const arb_splice_t *splice, arb_splice_link_t link, void *ctx, uint16_t k,
                      uint8_t entry[PROFILE_TLV_ENTRY_BYTES])
{
    if (k == 0) {
        profile_tlv_put(entry, PROFILE_TLV_CONFIGURATIONS, 1);
    } else if (k == 1) {
        profile_tlv_put(entry, PROFILE_TLV_CONFIGURATION, splice->number);
    } else if (k == 2) {
        profile_tlv_put(entry, PROFILE_TLV_LINKS, splice->links);
    } else {
        const uint8_t link_k = (uint8_t)((k - 3) / PROFILE_TLV_LINK_ENTRIES);
        profile_link_t full;
        link(ctx, link_k, &full);
        profile_tlv_put_link_entry(entry, (uint8_t)(link_k + 1), &full,
                                   (uint8_t)((k - 3) % PROFILE_TLV_LINK_ENTRIES));
    }
}

uint16_t arb_splice_put(const arb_splice_t *splice, arb_splice_link_t link, void *ctx, uint16_t at,
                        uint8_t *bytes, uint16_t len)
{
    uint8_t entry[PROFILE_TLV_ENTRY_BYTES];
    if (splice->piece != NULL) {
        memcpy(bytes, &splice->piece[at], len);
        return len;
    }
    const uint16_t skip = at % PROFILE_TLV_ENTRY_BYTES;
    const uint16_t run = at_most(len, (uint16_t)(PROFILE_TLV_ENTRY_BYTES - skip));
    const uint16_t first = splice->has_count ? 1 : 0; /* then the stored string has entry 0 */
    put_entry(splice, link, ctx, (uint16_t)(first + at / PROFILE_TLV_ENTRY_BYTES), entry);
    memcpy(bytes, &entry[skip], run);
    return run;
}
