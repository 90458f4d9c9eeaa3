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

/* Outcome of a bind request. */
typedef enum {
    PDCP_BIND_GRANTED,   /* place holds the device's place, new or taken back */
    PDCP_BIND_SUGGESTED, /* it has to ask again */
    PDCP_BIND_REFUSED,   /* no node id or no place is left */
    PDCP_BIND_CHECK      /* its identity is bound: find out whether that device still answers, then
                            call pdcp_bind_after_check */
} pdcp_bind_result_t;

/* Draws the position from which ids of outputs are given, which then moves on (D-BUS-36). seed should differ
 * from start to start. bind must be all 0: nothing remembered, nothing reserved. */
void pdcp_bind_init(pdcp_bind_t *bind, uint32_t seed);

/* Adds an identity from non-volatile memory behind those that are there; the most recently used comes first.
 * False: left out, since its id is invalid or taken, the identity is there already, or there is no room. */
bool pdcp_bind_remember_stored(pdcp_bind_t *bind, const pdcp_remembered_t *entry);

/* Is the identity remembered, or part of a stored limb? Others get no place when places become few
 * (D-BUS-43). */
bool pdcp_bind_is_known(const pdcp_bus_t *bus, const pdcp_identity_t *identity);

/* Remembers a device that is set up, with its id (D-BUS-43). */
void pdcp_bind_on_ready(pdcp_bus_t *bus, const pdcp_device_entry_t *device);

/* Frees reservations that are over. Call at least every few days. */
void pdcp_bind_on_time(pdcp_bus_t *bus);

/* Answers a bind request for the node id `asked`, unless the result is PDCP_BIND_CHECK. */
pdcp_bind_result_t pdcp_bind_on_request(pdcp_bus_t *bus, const pdcp_identity_t *identity, uint8_t asked,
                                        uint8_t *place);

/* Answers the request that pdcp_bind_on_request left open, after the check of the bound device. It answered:
 * the asking device is another one, which is refused with id 0. It did not answer: it was reset, and its id
 * is granted again, or suggested. */
pdcp_bind_result_t pdcp_bind_after_check(pdcp_bus_t *bus, uint8_t place, bool answered);

/* Are no ids given to outputs for now, because somebody may still speak on them or listen to them (D-BUS-36,
 * D-BUS-48)? */
bool pdcp_bind_is_shut(const pdcp_bus_t *bus);

/* The node id for the next output (D-BUS-36). Nobody owns it, speaks on it or listens to it, and a freed id
 * comes last. Ids that are remembered for devices come after all others, the device that was away longest
 * first. If all are in use, it is the one unheard longest. 0: none is left. */
uint8_t pdcp_bind_output_id(const pdcp_bus_t *bus);

/* Gives that id to an output without one. False: none is left, or the time has not come. */
bool pdcp_bind_give_output_id(pdcp_bus_t *bus, pdcp_channel_t *output);

/* Takes an output's id away. It counts as heard: somebody may still speak on it. */
void pdcp_bind_take_output_id(pdcp_bus_t *bus, pdcp_channel_t *output);

#endif
