/* Requests to a device (pdcp-bus.md 5): one at a time to one device, several devices at once.
 *
 * A request is sent and repeated after the device's acknowledgement time, PDCP_TRIES in all. It ends with
 * exactly one reply whose done is true, unless it is cancelled. Values of more than four bytes go by bulk
 * transfer, and so does any value if the device wants it. A raw request is a frame that the host made; its
 * answer is handed on whole. The request carries which part of the arbitrator asked (the client), and the
 * reply returns it.
 *
 *   get, commands   IDLE --> ANSWER --> IDLE
 *   get by bulk     IDLE --> ANSWER --> GET_SIZE --> GET_DATA --> IDLE
 *   set by bulk     IDLE --> SET_SIZE --> SET_DATA <--> SET_ECHO, SET_DATA --> IDLE
 *   raw             IDLE --> RAW --> IDLE
 *
 * A set of up to four bytes goes as a get; if the device wants it by bulk, from ANSWER to SET_SIZE. A bulk
 * transfer that fails begins again from its size. Silence through all tries leads to IDLE. */
#ifndef PDCP_REQUEST_H
#define PDCP_REQUEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "pdcp_bus.h"

/* Result of a message or a deadline. */
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

/* Two bytes of the value that came, from byte at on; missing ones are 0 (pdcp-bus.md 4). */
uint16_t pdcp_request_word(const pdcp_reply_t *reply, uint8_t at);

bool pdcp_request_is_idle(pdcp_bus_t *bus, uint8_t place);

/* Starts a request; the device's place must be idle. size: of the value to be set in bytes[], which must stay
 * where it is until the reply when it is longer than PDCP_VALUE_MAX; of the longest value that may be got,
 * longer ones fail with PDCP_ERR_BULK; 08: the time in ms, 0 = until released. PDCP_CLIENT_RAW: bytes[] is
 * the data of the frame, 1 to 8 bytes beginning with code, param and channel, and stays where it is until the
 * reply; code is below PDCP_ANSWER. */
void pdcp_request_start(pdcp_bus_t *bus, uint8_t place, pdcp_client_t client, uint8_t code, uint8_t channel,
                        uint8_t param, const uint8_t *bytes, uint16_t size);

static inline void pdcp_request_get(pdcp_bus_t *bus, uint8_t place, pdcp_client_t client, uint8_t channel,
                                    uint8_t param, uint16_t max_size)
{
    pdcp_request_start(bus, place, client, PDCP_GET_PARAMETER, channel, param, NULL, max_size);
}

static inline void pdcp_request_set(pdcp_bus_t *bus, uint8_t place, pdcp_client_t client, uint8_t channel,
                                    uint8_t param, const uint8_t *bytes, uint16_t len)
{
    pdcp_request_start(bus, place, client, PDCP_SET_PARAMETER, channel, param, bytes, len);
}

/* Suspend, Release or Reset Device [PDCP 3.2.4, 3.2.5, 3.2.7]. */
static inline void pdcp_request_command(pdcp_bus_t *bus, uint8_t place, pdcp_client_t client, uint8_t code,
                                        uint16_t time_ms)
{
    pdcp_request_start(bus, place, client, code, 0, 0, NULL, time_ms);
}

/* Limits the request that was just started to so many tries, 1 to PDCP_TRIES. */
void pdcp_request_limit_tries(pdcp_bus_t *bus, uint8_t place, uint8_t tries);

/* Forgets a request without a reply. */
void pdcp_request_cancel(pdcp_bus_t *bus, uint8_t place);

/* A frame from a device. True: it answers the device's raw request, reply says how; it is counted. An answer
 * about another parameter or channel, to a request before, is not taken for it. */
bool pdcp_request_on_frame(pdcp_bus_t *bus, uint8_t place, const can_frame_t *frame, pdcp_reply_t *reply);

/* A decoded message from a device, which is counted, or the deadline of its request. True: reply says what
 * follows. An answer that belongs to no request is counted as late and otherwise ignored. */
bool pdcp_request_on_message(pdcp_bus_t *bus, uint8_t place, const pdcp_msg_t *msg, pdcp_reply_t *reply);
bool pdcp_request_on_deadline(pdcp_bus_t *bus, uint8_t place, pdcp_reply_t *reply);

#endif
