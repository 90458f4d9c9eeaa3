/* The life of a device: setup, beacons, loss, until it is forgotten (pdcp-bus.md 6 and 9).
 *
 * A device's place serves one request at a time. Setup, link job, host, reset and identity check take turns,
 * and each reply goes back to the part that asked. */
#ifndef PDCP_LIFE_H
#define PDCP_LIFE_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb_state.h"
#include "pdcp_bind.h"
#include "pdcp_request.h"

/* Sets the time when a device is lost or forgotten, or when its held bind request is answered. */
void pdcp_life_set(pdcp_arb_t *arb, uint8_t place, uint16_t in_ms);

/* Sets the deadline afresh, since the beacon interval may have become shorter. By itself the deadline moves
 * only when it fires. */
void pdcp_life_expect(pdcp_arb_t *arb, uint8_t place);

/* Begins the setup of a device whose bind request was granted. Other results: nothing. */
void pdcp_life_after_bind(pdcp_arb_t *arb, uint8_t place, pdcp_bind_result_t result);

/* Starts the next request to a device if its place is free: the check of its identity first, then the host's
 * request, its reset, its setup. */
void pdcp_life_serve(pdcp_arb_t *arb, uint8_t place);

/* Declares a device lost. Its ids are kept for it for PDCP_LOST_KEPT_MS. */
void pdcp_life_lose(pdcp_arb_t *arb, uint8_t place);

/* Tells the device with this id to reset, at most once a second (D-BUS-15, D-BUS-37). It will then bind. */
void pdcp_life_reset_unknown(pdcp_arb_t *arb, uint8_t id);

/* The reset that was asked for ends, if one was (PDCP_EVENT_RESET). */
void pdcp_life_end_reset(pdcp_arb_t *arb, uint8_t place, pdcp_status_t status);

/* A beacon of a device that does not count for the host yet, or is lost. */
void pdcp_life_on_first_beacon(pdcp_arb_t *arb, pdcp_device_entry_t *device);

/* A reply to a request, for whoever asked. Any reply ends the check of an identity. */
void pdcp_life_on_reply(pdcp_arb_t *arb, uint8_t place, const pdcp_reply_t *reply);

/* A frame came from a bound id whose identity asks again, and was no answer to the request under way:
 * whatever it says, its owner is alive (D-BUS-41). */
void pdcp_life_end_check(pdcp_arb_t *arb, uint8_t place);

/* PDCP_TIMER_REQUEST of this device is due. */
void pdcp_life_on_request_deadline(pdcp_arb_t *arb, uint8_t place);

/* PDCP_TIMER_LIFE of this device is due; no bind request of it is held. */
void pdcp_life_on_deadline(pdcp_arb_t *arb, uint8_t place);

#endif
