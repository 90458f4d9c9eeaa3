/* Bulk transfers as the device sees them (pdcp-bus.md 5): one packet under way at a time, each acknowledged
 * [PDCP 3.2.8 to 3.2.10]. Only the other files of the device role use this. */
#ifndef PDCP_DEVICE_BULK_H
#define PDCP_DEVICE_BULK_H

#include <stdint.h>

#include "pdcp_codec.h"
#include "pdcp_device_types.h"

/* The messages of a bound device, each answered here. */
void pdcp_device_bulk_on_get(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);
void pdcp_device_bulk_on_set(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);
void pdcp_device_bulk_on_packet(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);
void pdcp_device_bulk_on_ack(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);

/* Repeats a packet that was not acknowledged. Returns when it wants to be called again. */
uint32_t pdcp_device_bulk_step(pdcp_device_t *dev, uint32_t now_ms);

#endif
