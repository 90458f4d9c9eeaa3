/* Leaving bus-off (pdcp-bus.md 9): the controller is restarted after 100 ms, and when it goes off again,
 * after twice the time, up to 5 s. A controller that stayed on the bus for as long as the last pause starts
 * from 100 ms again.
 *
 * Pure policy: who owns the controller says what state it is in and restarts it when told. */
#ifndef PDCP_RECOVERY_H
#define PDCP_RECOVERY_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    PDCP_BUS_ACTIVE = 0,
    PDCP_BUS_PASSIVE = 1,
    PDCP_BUS_OFF = 2,
    PDCP_BUS_DOWN = 3 /* there is no bus: interface down, adapter unplugged */
} pdcp_bus_state_t;

typedef struct {
    uint8_t state;       /* pdcp_bus_state_t */
    uint16_t pause_ms;   /* before the next restart; 0: the controller was never off */
    uint32_t changed_ms; /* when the state was entered */
} pdcp_recovery_t;

/* The state of the controller. Returns the time from now after which it is to be restarted; 0: not at all. */
uint16_t pdcp_recovery_on_state(pdcp_recovery_t *recovery, uint32_t now_ms, pdcp_bus_state_t state);

#endif
