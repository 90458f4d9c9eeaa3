/* Links (pdcp-bus.md 7 and 8): one output feeds many inputs, an input has one source.
 *
 * The tables say how things should be (link, source, todo), and this file makes the devices agree with them:
 * what happens on the bus and what the host asks for is noted at the channels (pdcp_ends), and one job after
 * the other (pdcp_job) carries the notes out, what silences first. The status of a link is active only when
 * its last write is answered. */
#ifndef PDCP_LINK_H
#define PDCP_LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_request.h"

/* Nothing is under way; planned stays as it is. */
void pdcp_link_init(pdcp_bus_t *bus);

/* Is there neither a job nor anything to do, but to silence again what does not answer? */
bool pdcp_link_is_settled(const pdcp_bus_t *bus);

/* Is a link being made, or to be made as soon as something else is done? */
bool pdcp_link_is_making(const pdcp_bus_t *bus);

/* Makes an active link inactive: both ends disabled, source remembered (D-PRO-9). status: why, for
 * PDCP_EVENT_LINK. */
void pdcp_link_deactivate(pdcp_bus_t *bus, uint8_t input, pdcp_status_t status);

/* A channel without an active link was found enabled: it is told not to be, until it answers (D-BUS-22). */
void pdcp_link_silence(pdcp_bus_t *bus, uint8_t channel);

/* Asks for exactly this link. PDCP_OK: the outcome comes as PDCP_EVENT_LINK_REQUEST. PDCP_ERR_BUSY: another
 * link request is under way. sole: if sole access forbids it when its turn comes, it ends with
 * PDCP_ERR_SOLE. */
pdcp_status_t pdcp_link_request(pdcp_bus_t *bus, uint8_t output, uint8_t input, bool sole);

/* A link request that has not been started ends with status. Nothing happens when there is none. */
void pdcp_link_forget_request(pdcp_bus_t *bus, pdcp_status_t status);

/* The host waits no longer: its link request ends with PDCP_ERR_NO_ANSWER, and a link half made is undone.
 * Returns the place of the device whose request was broken off, PDCP_NONE: of none. */
uint8_t pdcp_link_give_up_request(pdcp_bus_t *bus);

/* Is a link request of the host under way? */
bool pdcp_link_request_waits(const pdcp_bus_t *bus);

/* Takes the link of an input away. */
void pdcp_link_remove(pdcp_bus_t *bus, uint8_t input);

/* Writes what the tables say to an input: the source of its link, or that it has none, which the tables then
 * say (D-BUS-38); of an active link all that it is made of, to both ends. Nothing is disabled first. */
void pdcp_link_write(pdcp_bus_t *bus, uint8_t input);

/* A device sent Update Data Channel for its channel index. */
void pdcp_link_on_update(pdcp_bus_t *bus, uint8_t place, uint8_t index);

/* A device is set up (PDCP_NONE: the pause after a link that was not answered is over): inactive links whose
 * ends are both there are made. */
void pdcp_link_on_ready(pdcp_bus_t *bus, uint8_t place);

/* A device is gone or was reset: its links become inactive, what it fed is silenced (D-BUS-14). Its request
 * must be cancelled already; a job that was waiting for it goes on without it. */
void pdcp_link_on_lost(pdcp_bus_t *bus, uint8_t place);

/* A reply to a request of PDCP_CLIENT_LINK. */
void pdcp_link_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply);

/* The first time after the start is over: outputs may be enabled. */
void pdcp_link_open(pdcp_bus_t *bus);

/* Starts what can be started. Costs nothing when there is nothing to do. */
void pdcp_link_step(pdcp_bus_t *bus);

#endif
