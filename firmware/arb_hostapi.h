/* The host API (host-api.md): takes the host's bytes, holds up to four requests, serves them in order, one
 * answer each.
 *
 * A fifth request is answered with error 07h at once, the only answer out of order (D-API-3). What is
 * answered from the tables is answered in the same call; what needs the bus stays at the front until the bus
 * has spoken. */
#ifndef ARB_HOSTAPI_H
#define ARB_HOSTAPI_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_hostcodec.h"
#include "arb_hostrx.h"
#include "arb_port.h"
#include "pdcp_arb.h"

enum {
    ARB_HELD_MAX = 4,            /* D-API-3 */
    ARB_HOST_NOT_READY_MS = 2000 /* 2307h waits so long for a running setup (D-API-6) */
};

/* Payloads of the held requests together: the longest one and three short ones. A request that does not fit
 * is answered like a fifth one (D-API-9). */
#define ARB_HELD_BYTES (ARB_HOST_REQUEST_MAX + 3 * 24)

/* Answers out of order that wait behind the one being sent: four of the longest kind, 8 + 1 + 2 bytes. */
#define ARB_URGENT_BYTES 44

typedef struct {
    uint16_t id;
    uint16_t at;  /* of the payload in held_bytes */
    uint16_t len; /* of the payload */
    uint8_t reference;
    uint8_t error; /* found on reception: ARB_OK, ARB_ERR_CRC (strict), ARB_ERR_SIZE (too long) */
} arb_held_t;

typedef struct {
    arb_hostrx_t rx;
    arb_held_t held[ARB_HELD_MAX];
    uint8_t held_count;
    uint8_t held_bytes[ARB_HELD_BYTES];
    uint16_t held_used;

    uint8_t answer[ARB_HOST_HEADER + ARB_HOST_ANSWER_MAX + ARB_HOST_CRC];
    uint16_t answer_len; /* of the answer being sent; 0: none */
    uint16_t answer_sent;
    uint8_t urgent[ARB_URGENT_BYTES];
    uint8_t urgent_len;

    bool strict; /* checksums are enforced (D-API-1) */
    /* The request at the front, when it needs the bus. */
    bool waiting;  /* until it can be started, at the latest until_ms */
    bool started;  /* the bus works on it */
    bool handed;   /* in this step the arbitrator was given something to do */
    bool ended;    /* the bus has spoken: status, value_len */
    int8_t status; /* pdcp_status_t */
    uint16_t value_len;
    uint32_t until_ms;
} arb_hostapi_t;

void arb_hostapi_init(arb_hostapi_t *api);

/* Bytes from the host. Returns how many were taken; the rest is to be offered again after the next step: the
 * host does not read its answers. */
uint16_t arb_hostapi_on_bytes(arb_hostapi_t *api, uint32_t now_ms, const uint8_t *bytes, uint16_t len);

/* An event of the arbitrator. */
void arb_hostapi_on_event(arb_hostapi_t *api, const pdcp_event_t *event);

/* Serves what can be served and sends what can be sent. Returns true when the arbitrator was given something
 * to do. */
bool arb_hostapi_step(arb_hostapi_t *api, pdcp_arb_t *arb, const arb_port_t *port, uint32_t now_ms);

/* Do answers wait for room at the host? */
static inline bool arb_hostapi_has_output(const arb_hostapi_t *api)
{
    return api->answer_len != 0 || api->urgent_len != 0;
}

/* The time of the next call at the latest; now_ms + PDCP_TIME_FAR_MS when nothing depends on time. */
uint32_t arb_hostapi_next_ms(const arb_hostapi_t *api, uint32_t now_ms);

#endif
