/* Requests to a device (pdcp-bus.md 5): one at a time to one device, several devices at once.
 *
 * A request is sent, repeated after the device's acknowledgement time, PDCP_TRIES in all, and ends with
 * exactly one reply whose done is true, unless it is cancelled. Values of more than four bytes go by bulk
 * transfer, as does a value that the device itself wants so. A raw request is a frame as the host made it,
 * whose answer is handed on whole. Which part of the arbitrator asked (the client) travels with the request
 * and comes back in the reply: this file decides nothing about it. */
#ifndef PDCP_REQUEST_H
#define PDCP_REQUEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "pdcp_codec.h"

struct pdcp_bus;

typedef enum {
    PDCP_CLIENT_NONE = 0,
    PDCP_CLIENT_SETUP,
    PDCP_CLIENT_LINK,
    PDCP_CLIENT_HOST,
    PDCP_CLIENT_RAW, /* the host, with a frame that is sent as it is */
    PDCP_CLIENT_RESET,
    PDCP_CLIENT_BIND, /* is the device with this identity still there? */
    PDCP_CLIENT_AUDIT /* the audit's questions, and the Release of what somebody else has suspended */
} pdcp_client_t;

typedef enum {
    PDCP_OK = 0,
    PDCP_ERR_NO_ANSWER = -1, /* silent through all tries, or lost meanwhile */
    PDCP_ERR_REFUSED = -2,   /* answered with failure */
    PDCP_ERR_BULK = -3,    /* transfer failed PDCP_BULK_RESTARTS times, or the value is longer than allowed */
    PDCP_ERR_BUSY = -4,    /* not now: try again later */
    PDCP_ERR_UNKNOWN = -5, /* no such device or channel, or wrong direction */
    PDCP_ERR_OWN = -6,     /* an output never feeds an input of its own device (D-API-6) */
    PDCP_ERR_SOLE = -7,    /* another input wants the output for itself, as this one does (D-API-13) */
    PDCP_ERR_DIFFERS = -8  /* the device does not keep what it is told (D-BUS-40) */
} pdcp_status_t;

typedef enum {
    PDCP_REQUEST_IDLE = 0,
    PDCP_REQUEST_ANSWER,   /* sent, waiting for its answer */
    PDCP_REQUEST_GET_SIZE, /* 0C sent, waiting for 8C */
    PDCP_REQUEST_GET_DATA, /* waiting for the device's next 0E */
    PDCP_REQUEST_SET_SIZE, /* 0D sent, waiting for 8D */
    PDCP_REQUEST_SET_DATA, /* 0E sent, waiting for 8E */
    PDCP_REQUEST_SET_ECHO, /* 8E came, but 0E was sent more than once: waiting for its other answers
                              (D-BUS-39) */
    PDCP_REQUEST_RAW,      /* a frame of the host sent, waiting for its answer */
    PDCP_REQUEST_STATES
} pdcp_request_state_t;

/* Belongs to one device's place in the table. */
typedef struct {
    const uint8_t *bytes; /* value to be set, or data of a raw request; NULL: there is none */
    uint16_t size;        /* of the whole value: to be set, or as 8C says; 08: the time in ms; raw: the DLC */
    uint16_t max_size;    /* longest value that may be got */
    uint16_t offset;      /* bytes transferred so far */
    uint8_t state;        /* pdcp_request_state_t */
    uint8_t client;       /* pdcp_client_t */
    uint8_t code;         /* function code of the request */
    uint8_t param;
    uint8_t channel;
    uint8_t tries_left; /* PDCP_REQUEST_SET_ECHO: answers that may still come */
    uint8_t restarts_left;
    uint8_t packet_id; /* next bulk packet */
    uint8_t value[PDCP_VALUE_MAX];
    bool got_bulk; /* idle, after a bulk get: the last packet may come once more */
} pdcp_request_t;

/* What a message or a deadline has led to. */
typedef struct {
    uint8_t client;
    int8_t status; /* pdcp_status_t; means something when done */
    bool done;     /* the request has ended */
    uint8_t code;  /* function code of the request */
    uint8_t param;
    uint8_t channel;
    uint16_t offset;      /* of bytes in the value; values of up to 4 bytes come in one piece */
    uint16_t len;         /* bytes that came now, 0 to 6; raw: the whole data of the answer, 1 to 8 */
    const uint8_t *bytes; /* valid during the call only; never NULL */
} pdcp_reply_t;

bool pdcp_request_is_idle(struct pdcp_bus *bus, uint8_t node);

/* Starts a request; the device's place must be idle. size: of the value to be set in bytes[], which must stay
 * where it is until the reply when it is longer than PDCP_VALUE_MAX; of the longest value that may be got,
 * longer ones fail with PDCP_ERR_BULK; 08: the time in ms, 0 = until released. PDCP_CLIENT_RAW: bytes[] is
 * the data of the frame, 1 to 8 bytes beginning with code, param and channel, and stays where it is until the
 * reply; code is below PDCP_ANSWER. */
void pdcp_request_start(struct pdcp_bus *bus, uint8_t node, pdcp_client_t client, uint8_t code,
                        uint8_t channel, uint8_t param, const uint8_t *bytes, uint16_t size);

static inline void pdcp_request_get(struct pdcp_bus *bus, uint8_t node, pdcp_client_t client, uint8_t channel,
                                    uint8_t param, uint16_t max_size)
{
    pdcp_request_start(bus, node, client, PDCP_GET_PARAMETER, channel, param, NULL, max_size);
}

static inline void pdcp_request_set(struct pdcp_bus *bus, uint8_t node, pdcp_client_t client, uint8_t channel,
                                    uint8_t param, const uint8_t *bytes, uint16_t len)
{
    pdcp_request_start(bus, node, client, PDCP_SET_PARAMETER, channel, param, bytes, len);
}

/* Suspend, Release or Reset Device [PDCP 3.2.4, 3.2.5, 3.2.7]. */
static inline void pdcp_request_command(struct pdcp_bus *bus, uint8_t node, pdcp_client_t client,
                                        uint8_t code, uint16_t time_ms)
{
    pdcp_request_start(bus, node, client, code, 0, 0, NULL, time_ms);
}

/* Limits the request that was just started to so many tries, 1 to PDCP_TRIES. */
void pdcp_request_limit_tries(struct pdcp_bus *bus, uint8_t node, uint8_t tries);

/* Forgets a request without a reply. */
void pdcp_request_cancel(struct pdcp_bus *bus, uint8_t node);

/* A frame from a device. True: it answers the device's raw request, reply says how; it is counted. An answer
 * about another parameter or channel, to a request before, is not taken for it. */
bool pdcp_request_on_frame(struct pdcp_bus *bus, uint8_t node, const can_frame_t *frame, pdcp_reply_t *reply);

/* A decoded message from a device, which is counted, or the deadline of its request. True: reply says what
 * follows. An answer that belongs to no request is counted as late and otherwise ignored. */
bool pdcp_request_on_message(struct pdcp_bus *bus, uint8_t node, const pdcp_msg_t *msg, pdcp_reply_t *reply);
bool pdcp_request_on_deadline(struct pdcp_bus *bus, uint8_t node, pdcp_reply_t *reply);

#endif
