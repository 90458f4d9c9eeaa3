/* What the parts of the device role (pdcp_device.c, pdcp_device_param.c, pdcp_device_bulk.c) share. Not for
 * others. */
#ifndef PDCP_DEVICE_PARTS_H
#define PDCP_DEVICE_PARTS_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_codec.h"
#include "pdcp_device.h"

/* Queues a message from the device's own id, normal priority. A full queue is counted. */
void pdcp_device_put(pdcp_device_t *dev, const pdcp_msg_t *msg);

/* Queues the answer to request: same parameter, channel, word and value. */
void pdcp_device_answer(pdcp_device_t *dev, const pdcp_msg_t *request, uint8_t result);

/* --- parameters (pdcp-bus.md 4) --- */

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

/* --- bulk transfers (pdcp-bus.md 5) --- */

void pdcp_device_bulk_on_get(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);
void pdcp_device_bulk_on_set(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);
void pdcp_device_bulk_on_packet(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);
void pdcp_device_bulk_on_ack(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);

/* Repeats a packet that was not acknowledged. Returns when it wants to be called again. */
uint32_t pdcp_device_bulk_step(pdcp_device_t *dev, uint32_t now_ms);

#endif
