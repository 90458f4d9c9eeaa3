/* State of the host API, shared by its files. arb_hostapi.c owns queue and answers; arb_hostbus.c and
 * arb_hostext.c serve the request at the front through arb_call.h. */
#ifndef ARB_HOSTSTATE_H
#define ARB_HOSTSTATE_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_hostcodec.h"
#include "arb_hostevents.h"
#include "arb_hostrx.h"
#include "arb_limb.h"
#include "arb_limits.h"
#include "arb_nvm.h"
#include "arb_port.h"
#include "arb_store.h"
#include "pdcp_arb.h"
#include "pdcp_bits.h"

enum {
    ARB_HOST_NOT_READY_MS = 2000, /* longest wait for a running setup (D-API-6) */
    ARB_HOST_ANSWER_MS = 3000     /* every request has its answer within this time (D-API-3) */
};

/* What the API uses. */
typedef struct {
    const arb_port_t *port; /* takes the bytes for the host, and knows what drivers have counted */
    pdcp_arb_t *arb;
    arb_limb_t *limb;
    arb_nvm_t *nvm;
    const arb_store_t *store;
} arb_hostenv_t;

/* Progress of the request at the front that cannot be answered at once. */
typedef struct {
    bool waiting;    /* the handler was called first at since_ms; it is called again by until_ms */
    bool started;    /* the bus works on it */
    bool ended;      /* the bus has answered: status, value_len */
    int8_t status;   /* pdcp_status_t */
    uint8_t channel; /* 2410h: number of the input */
    uint8_t open;    /* 230Dh: devices whose reset has not ended */
    uint16_t value_len;
    uint32_t since_ms;
    uint32_t until_ms;
    uint8_t asked[PDCP_BIT_BYTES(PDCP_DEVICES_MAX)]; /* 230Dh: places of the devices to be reset */
    uint8_t reset[PDCP_BIT_BYTES(PDCP_DEVICES_MAX)]; /* and that were */
} arb_turn_t;

/* Counters since the start. */
typedef enum {
    ARB_HOSTAPI_RECEIVED, /* bytes */
    ARB_HOSTAPI_SENT,     /* bytes */
    ARB_HOSTAPI_REQUESTS, /* messages received, those below included */
    ARB_HOSTAPI_BUSY,     /* answered with 07h because four were held */
    ARB_HOSTAPI_UNKNOWN,  /* answered with 2200h */
    ARB_HOSTAPI_COUNTERS
} arb_hostapi_counter_t;

/* All 0 at first; it has no init of its own. Small state stands first, as in pdcp_bus.h. */
typedef struct {
    arb_turn_t turn;
    arb_hostrx_request_t held[ARB_HELD_MAX]; /* in the order in which they came */
    uint8_t held_count;
    uint16_t held_used; /* bytes of held_bytes */
    bool strict;        /* checksums are enforced (D-API-1) */
    bool handed;        /* in this step the arbitrator was given something to do */
    bool blocked;       /* the host did not take all that it was offered last */
    arb_out_t answer_out;
    arb_out_t urgent_out;
    uint32_t counters[ARB_HOSTAPI_COUNTERS];
    arb_hostevents_t events;
    arb_hostrx_t rx;
    uint8_t urgent[ARB_URGENT_BYTES];
    uint8_t held_bytes[ARB_HELD_BYTES]; /* their payloads, without gaps */
    uint8_t answer[ARB_HOST_HEADER + ARB_HOST_ANSWER_MAX + ARB_HOST_CRC];
} arb_hostapi_t;

#endif
