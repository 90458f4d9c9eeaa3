/* State of an arbitrator: all of it hangs from pdcp_arb_t. Its users include pdcp_arb.h.
 *
 *   member                                    who writes it
 *   host                                      pdcp_host
 *   bus                                       pdcp_bus.h says who
 *   standby                                   pdcp_standby
 *   held_ms, asked_ms                         pdcp_hold
 *   role                                      pdcp_role, which sets the times afresh when it begins
 *   beacon_ms, restart, recovery              pdcp_arb */
#ifndef PDCP_ARB_STATE_H
#define PDCP_ARB_STATE_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bus.h"
#include "pdcp_host.h"
#include "pdcp_recovery.h"
#include "pdcp_standby.h"

/* Role on a bus that may have another arbitrator (pdcp_role.h). */
typedef enum {
    PDCP_ROLE_SERVING = 0,
    PDCP_ROLE_STANDBY,  /* sends nothing: another arbitrator serves (D-BUS-42) */
    PDCP_ROLE_LISTENING /* sends nothing for a while: its own beacons did not leave (D-BUS-51) */
} pdcp_role_t;

typedef struct {
    uint32_t asked_ms;  /* when a device asked to bind last, or the start */
    uint32_t beacon_ms; /* when its last beacon left */
    uint32_t serial;
    uint16_t
        held_ms;  /* how long the first grants were held; taken off the start-up's quiet time (D-BUS-34) */
    uint8_t role; /* pdcp_role_t */
    bool restart; /* the controller is to be restarted */
    pdcp_host_request_t host;
    pdcp_bus_t bus;
    pdcp_recovery_t recovery;
    pdcp_standby_t standby;
} pdcp_arb_t;

/* The device at this place, which must be below PDCP_DEVICES_MAX. */
static inline pdcp_device_entry_t *pdcp_arb_device(pdcp_arb_t *arb, uint8_t place)
{
    return pdcp_bus_device(&arb->bus, place);
}

static inline bool pdcp_arb_is_on_standby(const pdcp_arb_t *arb)
{
    return arb->role == PDCP_ROLE_STANDBY;
}

#endif
