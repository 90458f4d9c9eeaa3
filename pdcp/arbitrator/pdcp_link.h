/* Links (pdcp-bus.md 7 and 8): one output feeds many inputs, an input has one source.
 *
 * The tables say how things should be (link, source, todo). This file makes the devices agree with them:
 * events and the host's requests are noted at the channels (pdcp_ends), and one job after the other
 * (pdcp_job) carries the notes out. Jobs that silence come first. A link is active only when its last write
 * is answered. */
#ifndef PDCP_LINK_H
#define PDCP_LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_request.h"

/* Forgets all that is under way; planned stays as it is. */
void pdcp_link_init(pdcp_bus_t *bus);

/* Is there nothing to do, except to silence once more what does not answer? */
bool pdcp_link_is_settled(const pdcp_bus_t *bus);

/* Is a link being made, or waiting to be made? */
bool pdcp_link_is_making(const pdcp_bus_t *bus);

/* Makes an active link inactive: both ends disabled, source remembered (D-PRO-9). status: why, for
 * PDCP_EVENT_LINK. */
void pdcp_link_deactivate(pdcp_bus_t *bus, uint8_t input, pdcp_status_t status);

/* Disables a channel without an active link that was found enabled. It is told until it answers
 * (D-BUS-22). */
void pdcp_link_silence(pdcp_bus_t *bus, uint8_t channel);

/* Asks for exactly this link. PDCP_OK: PDCP_EVENT_LINK_REQUEST tells the outcome. PDCP_ERR_BUSY: another link
 * request is under way. sole: the request ends with PDCP_ERR_SOLE if sole access forbids the link when its
 * turn comes. */
pdcp_status_t pdcp_link_request(pdcp_bus_t *bus, uint8_t output, uint8_t input, bool sole);

/* Ends a link request that has not been started with this status. Does nothing without one. */
void pdcp_link_forget_request(pdcp_bus_t *bus, pdcp_status_t status);

/* Ends the host's link request with PDCP_ERR_NO_ANSWER and undoes a link half made. Returns the place of the
 * device whose request was broken off; PDCP_NONE: there was none. */
uint8_t pdcp_link_give_up_request(pdcp_bus_t *bus);

/* Is a link request of the host under way? */
bool pdcp_link_request_waits(const pdcp_bus_t *bus);

/* Removes the link of an input. */
void pdcp_link_remove(pdcp_bus_t *bus, uint8_t input);

/* Writes to an input what the tables say: its source or, without a link, that it has none (D-BUS-38). Writes
 * an active link as a whole, to both ends. Nothing is disabled first. */
void pdcp_link_write(pdcp_bus_t *bus, uint8_t input);

/* Takes an Update Data Channel of a device for this channel index. */
void pdcp_link_on_update(pdcp_bus_t *bus, uint8_t place, uint8_t index);

/* Makes the inactive links whose ends are both there: a device is set up or, with PDCP_NONE, the pause after
 * an unanswered link is over. */
void pdcp_link_on_ready(pdcp_bus_t *bus, uint8_t place);

/* Makes the links of a lost or reset device inactive and silences the inputs that it fed (D-BUS-14). Its
 * request must be cancelled already. A job that waited for the device continues without it. */
void pdcp_link_on_lost(pdcp_bus_t *bus, uint8_t place);

/* Takes the reply to a request of PDCP_CLIENT_LINK. */
void pdcp_link_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply);

/* Lets outputs be enabled: the time after the start is over (D-BUS-36). */
void pdcp_link_open(pdcp_bus_t *bus);

/* Starts the next job if it can be started. */
void pdcp_link_step(pdcp_bus_t *bus);

#endif
