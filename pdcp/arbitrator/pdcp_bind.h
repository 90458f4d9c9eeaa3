/* Binding (pdcp-bus.md 3, D-BUS-6): which node id a device gets.
 *
 * Remembers identities with their ids, most recently used first; the application keeps that list in
 * non-volatile memory and gives it back at start-up. Ids that were suggested are reserved until their device
 * asks with them or the time is over. */
#ifndef PDCP_BIND_H
#define PDCP_BIND_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bus.h"

/* What came of a bind request. */
typedef enum {
    PDCP_BIND_GRANTED,   /* place holds the device's place, new or taken back */
    PDCP_BIND_SUGGESTED, /* it has to ask again */
    PDCP_BIND_REFUSED,   /* no node id or no place is left */
    PDCP_BIND_CHECK      /* its identity is bound: find out whether that device still answers, then see
                            pdcp_bind_after_check */
} pdcp_bind_result_t;

/* bind is all 0 before: nothing is remembered, nothing reserved. Ids of outputs are drawn from a place that
 * seed, which should differ from start to start, decides, and that moves on (D-BUS-36). */
void pdcp_bind_init(pdcp_bind_t *bind, uint32_t seed);

/* Adds an identity behind those that are there, as they come from non-volatile memory, most recently used
 * first. Entries with an invalid or already remembered id, a repeated identity, or beyond the room are left
 * out: false. */
bool pdcp_bind_remember_stored(pdcp_bind_t *bind, const pdcp_remembered_t *entry);

/* Is the identity remembered, or part of a stored limb? Others are kept out when places become few
 * (D-BUS-43). */
bool pdcp_bind_is_known(const pdcp_bus_t *bus, const pdcp_identity_t *identity);

/* A device is set up: it is remembered with its id (D-BUS-43). */
void pdcp_bind_on_ready(pdcp_bus_t *bus, const pdcp_device_entry_t *device);

/* Frees reservations that are over; to be called every few days at least. */
void pdcp_bind_on_time(pdcp_bus_t *bus);

/* A bind request with node id asked. Answers it, unless the result is PDCP_BIND_CHECK. */
pdcp_bind_result_t pdcp_bind_on_request(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked,
                                        uint8_t *place);

/* The check of a bound device is over. It answered: the asking device is another one, refuse it with id 0. It
 * did not: it was reset and is granted its id again (or suggested it). Answers the request that
 * pdcp_bind_on_request left open. */
pdcp_bind_result_t pdcp_bind_after_check(pdcp_bus_t *bus, uint8_t place, bool answered);

/* Is no output given an id at this time, because somebody may still speak on any or listen to it (D-BUS-36,
 * D-BUS-48)? */
bool pdcp_bind_is_shut(const pdcp_bus_t *bus);

/* The node id that an output without one is to have: one that nobody owns, speaks on or listens to, and while
 * there is one, that is not remembered for a device, else that of the device that was away longest; if all
 * are in use, the one that was unheard longest (D-BUS-36). A freed id comes last. 0: none is left. */
uint8_t pdcp_bind_output_id(const pdcp_bus_t *bus);

/* Gives an output without an id that one. False: none is left, or the time has not come. */
bool pdcp_bind_give_output_id(pdcp_bus_t *bus, pdcp_channel_t *output);

/* Takes the id of an output away. Somebody may still speak on it. */
void pdcp_bind_take_output_id(pdcp_bus_t *bus, pdcp_channel_t *output);

#endif
