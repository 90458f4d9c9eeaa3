#include "pdcp_timers.h"

#include "pdcp_assert.h"
#include "pdcp_time.h"

static bool earlier(const pdcp_timers_t *timers, uint8_t a, uint8_t b)
{
    return pdcp_time_before(timers->deadline_ms[a], timers->deadline_ms[b]);
}

static void put(pdcp_timers_t *timers, uint16_t at, uint8_t timer)
{
    timers->heap[at] = timer;
    timers->place[timer] = (uint8_t)(at + 1u);
}

/* Puts a timer into the heap, whose entry at is to be filled: there, or above or below as its deadline is. */
static void settle(pdcp_timers_t *timers, uint16_t at, uint8_t timer)
{
    while (at > 0 && earlier(timers, timer, timers->heap[(at - 1u) / 2u])) {
        const uint16_t parent = (uint16_t)((at - 1u) / 2u);
        put(timers, at, timers->heap[parent]);
        at = parent;
    }
    for (;;) {
        uint16_t child = (uint16_t)(2u * at + 1u);
        if (child + 1u < timers->count && earlier(timers, timers->heap[child + 1u], timers->heap[child])) {
            child++;
        }
        if (child >= timers->count || !earlier(timers, timers->heap[child], timer)) {
            break;
        }
        put(timers, at, timers->heap[child]);
        at = child;
    }
    put(timers, at, timer);
}

void pdcp_timers_set(pdcp_timers_t *timers, uint8_t timer, uint32_t deadline_ms)
{
    pdcp_assert(timer < PDCP_TIMERS_MAX, "pdcp_timers.h: the timer is one");
    timers->deadline_ms[timer] = deadline_ms;
    if (timers->place[timer] == 0) {
        timers->count++;
        timers->place[timer] = timers->count;
    }
    settle(timers, (uint16_t)(timers->place[timer] - 1u), timer);
}

void pdcp_timers_cancel(pdcp_timers_t *timers, uint8_t timer)
{
    if (timers->place[timer] == 0) {
        return;
    }
    const uint16_t at = (uint16_t)(timers->place[timer] - 1u);
    timers->place[timer] = 0;
    timers->count--;
    if (at != timers->count) {
        settle(timers, at, timers->heap[timers->count]);
    }
}

bool pdcp_timers_is_set(const pdcp_timers_t *timers, uint8_t timer)
{
    return timers->place[timer] != 0;
}

bool pdcp_timers_take_due(pdcp_timers_t *timers, uint32_t now_ms, uint8_t *timer)
{
    if (timers->count == 0 || pdcp_time_before(now_ms, timers->deadline_ms[timers->heap[0]])) {
        return false;
    }
    *timer = timers->heap[0];
    pdcp_timers_cancel(timers, *timer);
    return true;
}

uint32_t pdcp_timers_next_ms(const pdcp_timers_t *timers, uint32_t now_ms)
{
    return timers->count != 0 ? timers->deadline_ms[timers->heap[0]] : now_ms + PDCP_TIME_FAR_MS;
}
