/* Recovery from bus-off (pdcp-bus.md 9.6). The controller is restarted after 100 ms. Each time that it goes
 * off again the pause doubles, up to 5 s. After as long on the bus as the last pause it is 100 ms again.
 *
 * Pure policy: the owner of the controller reports its state and restarts it when told. */
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

/* Takes the state of the controller. Returns in how many ms to restart it; 0: no restart. */
uint16_t pdcp_recovery_on_state(pdcp_recovery_t *recovery, uint32_t now_ms, pdcp_bus_state_t state);

#endif
