/* Contract: the millisecond clock. It starts at any value and wraps from FFFFFFFFh to 0 after 49.7 days. Take
 * the difference of two readings modulo 2^32 (pdcp_time.h). May be called from anywhere. */
#ifndef HAL_CLOCK_H
#define HAL_CLOCK_H

#include <stdint.h>

uint32_t hal_clock_ms(void);

#endif
