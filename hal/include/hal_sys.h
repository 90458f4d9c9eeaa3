/* Contract: numbers that only the target can provide, its serial number and random ones. */
#ifndef HAL_SYS_H
#define HAL_SYS_H

#include <stdint.h>

/* A number that tells this device from others of its kind: a serial number where the part has one, otherwise
 * a random one, another at every call. May be called from anywhere. */
uint32_t hal_sys_serial(void);

/* A number that differs from call to call and, as far as the target can, from start to start. May be called
 * from anywhere. */
uint32_t hal_sys_random(void);

#endif
