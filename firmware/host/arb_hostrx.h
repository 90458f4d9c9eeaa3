/* Finds requests in the host's byte stream (D-API-2).
 *
 * It hunts for FE 19. If that turns out not to begin a message, the hunt continues at the next byte. So it
 * finds a correct request right behind garbage, or inside a truncated one. Messages are handed on whatever
 * their checksums (D-API-1: lenient). One exception: a message with a wrong checksum that contains a header
 * with a right one is taken for a truncated message with another behind it (D-API-8). */
#ifndef ARB_HOSTRX_H
#define ARB_HOSTRX_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_error.h"
#include "arb_hostcodec.h"
#include "arb_limits.h"

/* Silence inside a message after which it is given up (D-API-2). */
#define ARB_HOSTRX_TIMEOUT_MS 100

/* Counters since the start, in the order of 2413h (arb_hostext.h). */
typedef enum {
    ARB_HOSTRX_GARBAGE,    /* bytes skipped */
    ARB_HOSTRX_BAD_SIZES,  /* headers with an impossible size */
    ARB_HOSTRX_BAD_CRC8S,  /* messages whose CRC8 did not match, accepted or not */
    ARB_HOSTRX_BAD_CRC16S, /* and whose CRC8 did, but not the CRC16 */
    ARB_HOSTRX_GIVEN_UP,   /* messages that stopped in the middle */
    ARB_HOSTRX_COUNTERS
} arb_hostrx_counter_t;

/* All 0 at first; it has no init of its own. */
typedef struct {
    uint16_t len;
    bool overdue;     /* 100 ms without a byte: decide now what is doubtful */
    uint16_t taken;   /* bytes of the request handed out last; they go with the next call */
    uint32_t last_ms; /* of the last byte */
    uint32_t counters[ARB_HOSTRX_COUNTERS];
    uint8_t bytes[2 * ARB_HOST_HEADER + ARB_HOST_REQUEST_MAX + ARB_HOST_CRC];
} arb_hostrx_t;

/* A request. Its payload stands at rx->bytes[ARB_HOST_HEADER] until the next call. */
typedef struct {
    uint16_t id;
    uint16_t len; /* of the payload */
    uint8_t reference;
    uint8_t error; /* ARB_OK; ARB_ERR_CRC: a checksum does not match; ARB_ERR_SIZE: a set request with
                      matching CRC8 and a value beyond PDCP_PARAMETER_MAX, no payload (D-API-7) */
} arb_hostrx_request_t;

/* Takes one byte. Then call arb_hostrx_next until it returns false, before the next byte. */
void arb_hostrx_put(arb_hostrx_t *rx, uint32_t now_ms, uint8_t byte);

/* Gives up a message that has been silent for too long. Then call arb_hostrx_next until it returns false. */
void arb_hostrx_on_time(arb_hostrx_t *rx, uint32_t now_ms);

/* Takes the next request out. False: there is none. */
bool arb_hostrx_next(arb_hostrx_t *rx, arb_hostrx_request_t *request);

/* Forgets an incomplete message, which counts as garbage. */
void arb_hostrx_clear(arb_hostrx_t *rx);

/* Is a message incomplete? Then call arb_hostrx_on_time at rx->last_ms + ARB_HOSTRX_TIMEOUT_MS. */
static inline bool arb_hostrx_is_inside(const arb_hostrx_t *rx)
{
    return rx->len != 0;
}

#endif
