/* Times in milliseconds, 32 bits, which wrap after 49.7 days. Times are compared by the sign of their
 * difference. That is right while they are less than 24.8 days apart. */
#ifndef PDCP_TIME_H
#define PDCP_TIME_H

#include <stdbool.h>
#include <stdint.h>

/* The longest delay there is: it stands for never, and can still be compared. */
#define PDCP_TIME_FAR_MS 0x3FFFFFFFuL

static inline bool pdcp_time_before(uint32_t a_ms, uint32_t b_ms)
{
    return (int32_t)(a_ms - b_ms) < 0;
}

static inline bool pdcp_time_reached(uint32_t now_ms, uint32_t deadline_ms)
{
    return !pdcp_time_before(now_ms, deadline_ms);
}

/* The earlier of two times. */
static inline uint32_t pdcp_time_earlier(uint32_t a_ms, uint32_t b_ms)
{
    return pdcp_time_before(b_ms, a_ms) ? b_ms : a_ms;
}

#endif
