#include "pdcp_recovery.h"

#include "pdcp_spec.h"
#include "pdcp_time.h"

static uint16_t next_pause(const pdcp_recovery_t *recovery, uint32_t now_ms)
{
    if (recovery->pause_ms == 0 || pdcp_time_reached(now_ms, recovery->changed_ms + recovery->pause_ms)) {
        return PDCP_RECOVERY_MS;
    }
    const uint16_t doubled = (uint16_t)(2u * recovery->pause_ms);
    return doubled < (uint16_t)PDCP_RECOVERY_MAX_MS ? doubled : (uint16_t)PDCP_RECOVERY_MAX_MS;
}

uint16_t pdcp_recovery_on_state(pdcp_recovery_t *recovery, uint32_t now_ms, pdcp_bus_state_t state)
{
    if (state == PDCP_BUS_OFF) {
        recovery->pause_ms = next_pause(recovery, now_ms);
    }
    recovery->state = (uint8_t)state;
    recovery->changed_ms = now_ms;
    return state == PDCP_BUS_OFF ? recovery->pause_ms : 0;
}
