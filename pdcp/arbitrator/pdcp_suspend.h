/* Suspended devices (pdcp-bus.md 9.3): what the host has suspended stays so, what somebody else has suspended
 * is released (D-BUS-40).
 *
 * Only times are kept here. No link changes: those of a suspended device stay active (D-BUS-61). Nobody but
 * the arbitrator sends Suspend, and it does so only for its host. A Suspend of somebody else stops data that
 * the tables call active. Release follows some milliseconds later, so that many Suspends lead to few
 * Releases. */
#ifndef PDCP_SUSPEND_H
#define PDCP_SUSPEND_H

#include <stdint.h>

#include "pdcp_bus.h"

enum {
    PDCP_SUSPENDED_FOR_GOOD = 0xFF, /* until released */
    PDCP_RELEASE_MS = 10,        /* from somebody else's Suspend to the Release, and to the next Releases */
    PDCP_RELEASE_AGAIN_MS = 1000 /* until a device that did not answer is told again */
};

/* Notes that the host has sent Suspend (time_ms 0: until released) or Release to a device, PDCP_NONE: to
 * all. */
void pdcp_suspend_on_host(pdcp_bus_t *bus, uint8_t place, uint8_t code, uint16_t time_ms);

/* Notes that a device was bound: it is not suspended. */
void pdcp_suspend_on_bound(pdcp_bus_t *bus, uint8_t place);

/* Notes a foreign Suspend to this node id, 0: to all. */
void pdcp_suspend_on_foreign(pdcp_bus_t *bus, uint8_t node_id);

/* Counts half a second: a beacon of the arbitrator leaves. */
void pdcp_suspend_on_beacon(pdcp_bus_t *bus);

/* Notes that a device is lost, before its request is cancelled: an unanswered Release is due again when it is
 * back. */
void pdcp_suspend_on_lost(pdcp_bus_t *bus, uint8_t place);

/* Takes the outcome of a Release. */
void pdcp_suspend_on_reply(pdcp_bus_t *bus, uint8_t place, pdcp_status_t status);

/* Sends Release to the devices whose places are free: PDCP_TIMER_RELEASE is due. */
void pdcp_suspend_on_deadline(pdcp_bus_t *bus);

#endif
