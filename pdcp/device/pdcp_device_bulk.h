/* Bulk transfers of a device (pdcp-bus.md 5) [PDCP 3.2.8 to 3.2.10]. One packet is under way at a time, and
 * each is acknowledged. Only the other files of the device role use this. */
#ifndef PDCP_DEVICE_BULK_H
#define PDCP_DEVICE_BULK_H

#include <stdint.h>

#include "pdcp_codec.h"
#include "pdcp_device_types.h"

/* Take and answer the messages of a bulk transfer; the device is bound. */
void pdcp_device_bulk_on_get(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);
void pdcp_device_bulk_on_set(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);
void pdcp_device_bulk_on_packet(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);
void pdcp_device_bulk_on_ack(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);

/* Repeats a packet that was not acknowledged. Returns the time of the next call at the latest. */
uint32_t pdcp_device_bulk_step(pdcp_device_t *dev, uint32_t now_ms);

#endif
