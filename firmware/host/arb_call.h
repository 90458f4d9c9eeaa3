/* A request of the host being served, as its handler sees it. Only arb_hostapi.c (queue, answers),
 * arb_hostbus.c (2201h to 230Dh) and arb_hostext.c (24xxh) use this. */
#ifndef ARB_CALL_H
#define ARB_CALL_H

#include "arb_error.h"
#include "arb_hoststate.h"

/* A handler returns an error code, or ARB_OK with a success payload of answer_len bytes, or ARB_PENDING: then
 * it is called again in every step. */
enum { ARB_PENDING = 0xFF };

enum { ARB_RESET_RESULTS = 8 }; /* bytes: the payload of 230Fh */

typedef struct {
    arb_hostapi_t *api;
    const arb_hostenv_t *env;
    pdcp_arb_t *arb; /* the env's */
    uint32_t now_ms;
    uint8_t *payload; /* of the request; stays where it is until the request is answered */
    uint16_t len;
    uint8_t place[2]; /* places of the devices that the payload names */
    uint8_t *answer;  /* payload of the success answer, ARB_HOST_ANSWER_MAX bytes; stays where it is too */
    uint16_t answer_len;
} arb_call_t;

typedef uint8_t (*arb_handler_t)(arb_call_t *call);

/* A message, and what is checked before its handler is called. */
typedef struct {
    uint16_t id;
    unsigned len : 8;     /* of the payload; another one: ARB_ERR_SIZE */
    unsigned longer : 1;  /* or longer */
    unsigned devices : 2; /* whose channels the payload begins with: their places, or ARB_ERR_DEVICE */
    unsigned waits : 1;   /* for the end of a running setup or planner: it changes links (D-API-6) */
    arb_handler_t handler;
} arb_message_t;

/* Notes that the arbitrator was given something whose end the handler waits for. Returns ARB_PENDING. */
uint8_t arb_call_started(arb_call_t *call);

/* Waits, limit_ms at most from the first call for this request. False: that time is over. */
bool arb_call_wait(arb_call_t *call, uint16_t limit_ms);

/* Waits for a running setup or planner, 2 s at most (D-API-6): ARB_PENDING, or ARB_ERR_NOT_READY. */
uint8_t arb_call_wait_ready(arb_call_t *call);

/* The outcome of a request that was begun on the bus, with the value that came as the answer; ARB_PENDING
 * until then. The request is given up ARB_HOST_ANSWER_MS after its first call (D-API-16). */
uint8_t arb_call_outcome(arb_call_t *call);

/* Place of the device that six bytes of a request name. PDCP_NONE: it is not on the bus. */
uint8_t arb_call_device(const arb_call_t *call, const uint8_t *bytes);

/* Number of the channel that the payload names at this end; its device was found. PDCP_NONE: the device has
 * no such channel of this direction, or is not set up. */
uint8_t arb_call_channel(const arb_call_t *call, uint8_t end, uint8_t transfer);

/* The error code for a pdcp_status_t. */
uint8_t arb_call_error(int8_t status);

/* Takes an event: what the request at the front waits for may have come. */
void arb_hostbus_on_event(arb_hostapi_t *api, const pdcp_event_t *event);

/* The handlers, by the names of their messages. */
uint8_t arb_hostbus_system_info(arb_call_t *call);
uint8_t arb_hostbus_device_info(arb_call_t *call);
uint8_t arb_hostbus_input_info(arb_call_t *call);
uint8_t arb_hostbus_output_info(arb_call_t *call);
uint8_t arb_hostbus_link_info(arb_call_t *call);
uint8_t arb_hostbus_get_parameter(arb_call_t *call);
uint8_t arb_hostbus_set_parameter(arb_call_t *call);
uint8_t arb_hostbus_configure_link(arb_call_t *call);
uint8_t arb_hostbus_passthrough(arb_call_t *call);
uint8_t arb_hostbus_reset(arb_call_t *call); /* ARB_ERR_NO_ANSWER: with the results as its payload */
uint8_t arb_hostext_arbitrator_info(arb_call_t *call);
uint8_t arb_hostext_set_flags(arb_call_t *call);
uint8_t arb_hostext_action(arb_call_t *call);
uint8_t arb_hostext_read_configs(arb_call_t *call);
uint8_t arb_hostext_write_configs(arb_call_t *call);
uint8_t arb_hostext_remove_link(arb_call_t *call);
uint8_t arb_hostext_statistics(arb_call_t *call);
uint8_t arb_hostext_event_stream(arb_call_t *call);

#endif
