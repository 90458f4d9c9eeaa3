#include "pdcp_suspend.h"

#include "pdcp_request.h"

/* Beacons until a time is over. The first one may leave at once, and a part of the last interval counts as a
 * whole one: up to a second too many, and none too few (D-BUS-58). */
static uint8_t beacons_in(uint16_t time_ms)
{
    return time_ms == 0 ? (uint8_t)PDCP_SUSPENDED_FOR_GOOD : (uint8_t)((time_ms - 1u) / PDCP_BEACON_MS + 2u);
}

void pdcp_suspend_on_host(pdcp_bus_t *bus, uint8_t place, uint8_t code, uint16_t time_ms)
{
    const uint8_t left = code == PDCP_SUSPEND ? beacons_in(time_ms) : 0;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (i == place || place == PDCP_NONE) {
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

static void wake(pdcp_bus_t *bus, uint16_t in_ms)
{
    if (!pdcp_timers_is_set(&bus->timers, PDCP_TIMER_RELEASE)) {
        pdcp_bus_wake(bus, PDCP_TIMER_RELEASE, in_ms);
    }
}

void pdcp_suspend_on_foreign(pdcp_bus_t *bus, uint8_t node_id)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (node_id == PDCP_NODE_BROADCAST || node_id == pdcp_bus_device(bus, i)->node_id) {
            pdcp_bit_set(bus->suspend.release, i, true);
        }
    }
    wake(bus, PDCP_RELEASE_MS);
}

void pdcp_suspend_on_reply(pdcp_bus_t *bus, uint8_t place, pdcp_status_t status)
{
    if (status == PDCP_ERR_NO_ANSWER) {
        pdcp_bit_set(bus->suspend.release, place, true);
        wake(bus, PDCP_RELEASE_AGAIN_MS);
    }
}

void pdcp_suspend_on_lost(pdcp_bus_t *bus, uint8_t place)
{
    const pdcp_request_t *request = &pdcp_bus_device(bus, place)->request;
    if (request->state != PDCP_REQUEST_IDLE && request->client == PDCP_CLIENT_AUDIT &&
        request->code == PDCP_RELEASE) {
        pdcp_bit_set(bus->suspend.release, place, true);
    }
}

void pdcp_suspend_on_bound(pdcp_bus_t *bus, uint8_t place)
{
    bus->suspend.left[place] = 0;
    pdcp_bit_set(bus->suspend.release, place, false);
}

/* Tells a device Release if it is to be told and can be. False: it is to be told later. */
static bool release(pdcp_bus_t *bus, uint8_t place)
{
    if (!pdcp_bit(bus->suspend.release, place) || bus->tables.devices[place].state == PDCP_PLACE_LOST) {
        return true; /* one that is lost is told when it is back */
    }
    if (!pdcp_request_is_idle(bus, place) || bus->txq.count > PDCP_TX_MAX / 2) {
        return false;
    }
    pdcp_bit_set(bus->suspend.release, place, false);
    if (bus->suspend.left[place] == 0 && pdcp_tables_is_bound(&bus->tables, place)) {
        pdcp_request_command(bus, place, PDCP_CLIENT_AUDIT, PDCP_RELEASE, 0);
    }
    return true;
}

void pdcp_suspend_on_deadline(pdcp_bus_t *bus)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (!release(bus, i)) {
            wake(bus, PDCP_RELEASE_MS);
        }
    }
}
