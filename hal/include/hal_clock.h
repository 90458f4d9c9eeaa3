/* Contract: the millisecond clock. Starts anywhere, counts up, wraps from FFFFFFFFh to 0 after 49.7 days.
 * Differences of two readings are taken modulo 2^32 (pdcp_time.h). May be called from anywhere. */
#ifndef HAL_CLOCK_H
#define HAL_CLOCK_H

#include <stdint.h>

uint32_t hal_clock_ms(void);

#endif
