/* The host API: takes the host's bytes, holds up to four requests, and answers them in order (host-api.md).
 *
 * A fifth request is answered with error 07h at once, the only answer out of order (D-API-3). Requests about
 * the tables are answered in the same call; requests to the bus stay at the front until the bus has answered.
 * Events (arb_hostevents.h) are sent when no answer waits.
 *
 * How long an answer waits behind events that were handed over already is up to the port: host_write should
 * take no more than the line carries within some 20 ms. */
#ifndef ARB_HOSTAPI_H
#define ARB_HOSTAPI_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_hoststate.h"

/* Takes bytes from the host. Returns how many were taken. If the host does not read its answers, some are
 * left: offer them again after the next step. */
uint16_t arb_hostapi_on_bytes(arb_hostapi_t *api, uint32_t now_ms, const uint8_t *bytes, uint16_t len);

/* Takes an event of the arbitrator. */
void arb_hostapi_on_event(arb_hostapi_t *api, const pdcp_arb_t *arb, uint32_t now_ms,
                          const pdcp_event_t *event);

/* Does the host want CAN frames? Called for every frame. */
static inline bool arb_hostapi_wants_frames(const arb_hostapi_t *api)
{
    return arb_hostevents_wants(&api->events, ARB_EVENT_FRAME);
}

/* Takes a frame on the bus, received or sent, for a host that wants them. It is handed over at once if the
 * host has room. */
void arb_hostapi_on_frame(arb_hostapi_t *api, const arb_port_t *port, uint32_t now_ms,
                          const can_frame_t *frame);

/* Ends the session of a host that has closed its end: the event stream and a half-sent message. Its whole
 * requests are served, except those that would begin a stream (D-API-17). */
void arb_hostapi_on_host_gone(arb_hostapi_t *api);

/* Serves and sends what it can. True: the arbitrator was given something to do. */
bool arb_hostapi_step(arb_hostapi_t *api, const arb_hostenv_t *env, uint32_t now_ms);

/* Do answers wait for room at the host? */
static inline bool arb_hostapi_has_answer(const arb_hostapi_t *api)
{
    return (api->answer_out.len | api->urgent_out.len) != 0;
}

/* Do answers or events wait for room at the host? */
static inline bool arb_hostapi_has_output(const arb_hostapi_t *api)
{
    return arb_hostapi_has_answer(api) || arb_hostevents_wait(&api->events);
}

/* The time of the next call at the latest; now_ms + PDCP_TIME_FAR_MS when nothing depends on time. */
uint32_t arb_hostapi_next_ms(const arb_hostapi_t *api, uint32_t now_ms);

#endif
