/* Parameters of a device (pdcp-bus.md 4) [PROFILE tables 2.8 to 2.10, 4.2.4]. Only the other files of the
 * device role use this. */
#ifndef PDCP_DEVICE_PARAM_H
#define PDCP_DEVICE_PARAM_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_device_types.h"

/* A value to be sent. */
typedef struct {
    const uint8_t *bytes;
    uint16_t len;
    uint8_t small[PDCP_VALUE_MAX]; /* bytes points here if the value stands nowhere else as bytes */
} pdcp_device_value_t;

/* Sets parameters as after power-on: channels disabled and without node ids, 7 and 10 to 12. Sources stay. */
void pdcp_device_param_reset(pdcp_device_t *dev);

/* Gets a parameter. False: there is no such parameter. */
bool pdcp_device_param_get(const pdcp_device_t *dev, uint8_t param, uint8_t channel,
                           pdcp_device_value_t *value);

/* Sets a parameter. False: there is no such parameter, it is read-only, or the value is not allowed. */
bool pdcp_device_param_set(pdcp_device_t *dev, uint8_t param, uint8_t channel, const uint8_t *bytes,
                           uint16_t len);

/* Longest value that can be written; 0: none, the parameter is read-only or does not exist. */
uint16_t pdcp_device_param_capacity(const pdcp_device_t *dev, uint8_t param, uint8_t channel);

#endif
