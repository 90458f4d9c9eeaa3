#include "pdcp_suspend.h"

#include "pdcp_bus.h"

/* Most Releases at once: half of the transmit queue is left to others. */
enum { RELEASES_MAX = PDCP_TX_MAX / 2 };

/* Beacons until a time is over. The first one may leave at once, and a part of the last interval counts as a
 * whole one: up to a second too many, and none too few. */
static uint8_t beacons_in(uint16_t time_ms)
{
    return time_ms == 0 ? (uint8_t)PDCP_SUSPENDED_FOR_GOOD : (uint8_t)((time_ms - 1u) / PDCP_BEACON_MS + 2u);
}

void pdcp_suspend_on_host(pdcp_bus_t *bus, uint8_t node, uint8_t code, uint16_t time_ms)
{
    const uint8_t left = code == PDCP_SUSPEND ? beacons_in(time_ms) : 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (i == node || node == PDCP_NONE) {
            bus->suspend.left[i] = left;
        }
    }
}

void pdcp_suspend_on_beacon(pdcp_bus_t *bus)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        uint8_t *left = &bus->suspend.left[i];
        if (*left != 0 && *left != PDCP_SUSPENDED_FOR_GOOD) {
            (*left)--;
        }
    }
}

void pdcp_suspend_on_foreign(pdcp_bus_t *bus, uint8_t node_id)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (node_id == PDCP_NODE_BROADCAST || node_id == pdcp_bus_node(bus, i)->node_id) {
            pdcp_set_bit(bus->suspend.release, i, true);
        }
    }
    if (!pdcp_timers_is_set(&bus->timers, PDCP_TIMER_RELEASE)) {
        pdcp_bus_wake(bus, PDCP_TIMER_RELEASE, PDCP_RELEASE_MS);
    }
}

/* Does a device have to be told? */
static bool is_due(const pdcp_bus_t *bus, uint8_t node)
{
    const uint8_t state = bus->nodes.nodes[node].state;
    return pdcp_bit(bus->suspend.release, node) && bus->suspend.left[node] == 0 &&
           (state == PDCP_NODE_SETUP || state == PDCP_NODE_READY || state == PDCP_NODE_FAILED);
}

void pdcp_suspend_on_deadline(pdcp_bus_t *bus)
{
    uint8_t told = 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        const bool due = is_due(bus, i);
        if (due && (told == RELEASES_MAX || !pdcp_request_is_idle(bus, i))) {
            pdcp_bus_wake(bus, PDCP_TIMER_RELEASE, PDCP_RELEASE_MS);
            continue;
        }
        pdcp_set_bit(bus->suspend.release, i, false);
        if (due) {
            pdcp_request_command(bus, i, PDCP_CLIENT_AUDIT, PDCP_RELEASE, 0);
            told++;
        }
    }
}
