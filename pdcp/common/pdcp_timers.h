/* Deadlines in a binary heap. The earliest one is known at once. Setting or cancelling one costs at most
 * log2(PDCP_TIMERS_MAX) levels, never a scan of all devices. */
#ifndef PDCP_TIMERS_H
#define PDCP_TIMERS_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_limits.h"

/* Two for each device and the arbitrator's own. */
enum {
    PDCP_TIMER_REQUEST = 0,             /* + place: acknowledgement time, pause between attempts */
    PDCP_TIMER_LIFE = PDCP_DEVICES_MAX, /* + place: silence of a device, keeping of a lost one */
    PDCP_TIMER_BEACON = 2 * PDCP_DEVICES_MAX,
    PDCP_TIMER_LINK,     /* links that were not answered are tried again */
    PDCP_TIMER_HOST,     /* the host's request or link has waited long enough for its turn */
    PDCP_TIMER_STANDBY,  /* standby: a bind request is not answered; else: the end of listening (D-BUS-42) */
    PDCP_TIMER_AUDIT,    /* the next question of the audit */
    PDCP_TIMER_RELEASE,  /* devices that somebody else has suspended are released */
    PDCP_TIMER_RECOVERY, /* the controller leaves bus-off */
    PDCP_TIMERS_MAX
};

/* All 0: none is set. */
typedef struct {
    uint8_t heap[PDCP_TIMERS_MAX];  /* timer numbers; earliest first */
    uint8_t place[PDCP_TIMERS_MAX]; /* where a timer stands in heap, plus 1; 0: not set */
    uint8_t count;
    uint32_t deadline_ms[PDCP_TIMERS_MAX];
} pdcp_timers_t;

/* Sets timer to deadline_ms, replacing what it was set to. */
void pdcp_timers_set(pdcp_timers_t *timers, uint8_t timer, uint32_t deadline_ms);
void pdcp_timers_cancel(pdcp_timers_t *timers, uint8_t timer);

bool pdcp_timers_is_set(const pdcp_timers_t *timers, uint8_t timer);

/* Takes the earliest timer out if its deadline is reached. False: none is due. */
bool pdcp_timers_take_due(pdcp_timers_t *timers, uint32_t now_ms, uint8_t *timer);

/* The earliest deadline; now_ms + PDCP_TIME_FAR_MS when none is set. */
uint32_t pdcp_timers_next_ms(const pdcp_timers_t *timers, uint32_t now_ms);

#endif
