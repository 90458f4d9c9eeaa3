/* Parameters as the device keeps them (pdcp-bus.md 4) [PROFILE tables 2.8 to 2.10, 4.2.4]. Only the other
 * files of the device role use this. */
#ifndef PDCP_DEVICE_PARAM_H
#define PDCP_DEVICE_PARAM_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_device_types.h"

/* A value on its way out: bytes of the caller, or small when they stand nowhere. */
typedef struct {
    const uint8_t *bytes;
    uint16_t len;
    uint8_t small[PDCP_VALUE_MAX]; /* bytes points here for a value of this kind */
} pdcp_device_value_t;

/* Everything unbound and disabled, parameters 7 and 10 to 12 as after power-on. Sources stay. */
void pdcp_device_param_reset(pdcp_device_t *dev);

/* False: there is no such parameter. */
bool pdcp_device_param_get(const pdcp_device_t *dev, uint8_t param, uint8_t channel,
                           pdcp_device_value_t *value);

/* False: there is no such parameter, it is read-only, or the value cannot be. */
bool pdcp_device_param_set(pdcp_device_t *dev, uint8_t param, uint8_t channel, const uint8_t *bytes,
                           uint16_t len);

/* Longest value that can be written; 0: none, the parameter is read-only or does not exist. */
uint16_t pdcp_device_param_capacity(const pdcp_device_t *dev, uint8_t param, uint8_t channel);

#endif
