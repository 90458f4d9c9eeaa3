/* What the files of the host API share: a request being served, and what a handler of a message gets and
 * says. Only arb_hostapi.c (queue, answers), arb_hostbus.c (2201h to 230Dh) and arb_hostext.c (24xxh) use
 * this. */
#ifndef ARB_HOSTCALL_H
#define ARB_HOSTCALL_H

#include "arb_hostapi.h"

/* What a handler says: an error code; ARB_OK, with a success payload of answer_len bytes; or that somebody
 * else has to speak first: it is called again with every step until it says something else. */
enum { ARB_PENDING = 0xFF };

typedef struct {
    arb_hostapi_t *api;
    arb_turn_t *turn; /* the api's */
    const arb_hostenv_t *env;
    pdcp_arb_t *arb; /* the env's */
    uint32_t now_ms;
    uint8_t *payload; /* of the request; stays where it is until the request is answered */
    uint16_t len;
    uint8_t *answer; /* payload of the success answer, ARB_HOST_ANSWER_MAX bytes; stays where it is too */
    uint16_t answer_len;
} arb_call_t;

typedef uint8_t (*arb_handler_t)(arb_call_t *call);

typedef struct {
    uint16_t id;
    uint16_t len_min; /* of the payload */
    uint16_t len_max;
    arb_handler_t handler;
} arb_message_t;

/* The message with this id; NULL: not one of this file's. */
const arb_message_t *arb_hostbus_find(uint16_t id);
const arb_message_t *arb_hostext_find(uint16_t id);

const arb_message_t *arb_call_find(const arb_message_t *messages, uint8_t count, uint16_t id);

/* Something was given to the arbitrator, whose end the handler waits for. */
uint8_t arb_call_started(arb_call_t *call);

/* Waits until limit_ms after the first call for this request. False: that time is over. */
bool arb_call_wait(arb_call_t *call, uint16_t limit_ms);

/* The handler is called again with the next step, which is due at once. */
uint8_t arb_call_again(arb_call_t *call);

/* Is a setup or the planner running? What changes links waits for their end (D-API-6). */
bool arb_call_is_busy(const arb_call_t *call);

/* Waits for a running setup or planner, 2 s at most (D-API-6): ARB_PENDING, or ARB_ERR_NOT_READY. */
uint8_t arb_call_wait_ready(arb_call_t *call);

/* The same as arb_call_started, but the handler is called again ARB_HOST_ANSWER_MS after the first call for
 * this request at the latest; arb_call_wait tells. To be called once at most, and after no other wait than
 * arb_call_wait_ready's. */
uint8_t arb_call_started_limited(arb_call_t *call);

/* What the bus says about a request that was begun with arb_call_started_limited, ARB_PENDING until then. At
 * the end of that time it is given up (D-API-16). */
uint8_t arb_call_outcome(arb_call_t *call);

/* Place of the device that six bytes of a request name; PDCP_NONE: it is not on the bus. */
uint8_t arb_call_device(const arb_call_t *call, const uint8_t *bytes);

/* Channel number of the seven bytes that name a channel; PDCP_NONE: the device has no such channel of this
 * direction, or is not set up. */
uint8_t arb_call_channel(const arb_call_t *call, const uint8_t *bytes, uint8_t transfer);

/* The error code for a pdcp_status_t. */
uint8_t arb_call_error(int8_t status);

/* Payload of a failed 230Dh, 8 bytes. */
void arb_hostbus_reset_results(const arb_call_t *call, uint8_t *results);

/* The bus has spoken: what the request at the front waits for may have come. */
void arb_hostbus_on_event(arb_turn_t *turn, uint16_t id, const pdcp_event_t *event);

#endif
