/* The device role: what a sensor, a controller or a hand runs to take part in PDCP (pdcp-bus.md 10,
 * D-BUS-16).
 *
 * Passive: frames and time go in, frames and the next deadline come out. One pdcp_device_t is one device; it
 * holds all of its state, allocates nothing, reads no clock, and several of them may live in one program. Not
 * thread-safe: call everything from one place (main loop), never from an interrupt handler.
 *
 *     pdcp_device_init(&dev, &desc, &port, record, seed, now_ms);
 *     forever:
 *         for each received frame:          pdcp_device_on_frame(&dev, now_ms, &frame);
 *         when an output has a new value:   pdcp_device_send(&dev, now_ms, channel, data, len);
 *         deadline_ms = pdcp_device_step(&dev, now_ms);
 *         while pdcp_device_tx_peek(&dev, &frame) and the controller takes it:   pdcp_device_tx_pop(&dev);
 *         sleep until a frame comes, the controller has room, or deadline_ms is reached
 *
 * Included here: pdcp_device_types.h has the descriptions to fill and the readers, pdcp_device_tx.h the
 * frames that leave. All times are 32-bit milliseconds that may start anywhere and wrap (pdcp_time.h). */
#ifndef PDCP_DEVICE_H
#define PDCP_DEVICE_H

#include <stdbool.h>
#include <stdint.h>

#include "can_frame.h"
#include "pdcp_device_tx.h"
#include "pdcp_device_types.h"

/* Power-on. desc and port must outlive the device; record (NULL: none) is copied. seed should differ between
 * devices and power cycles; the identity is mixed in. False: desc has more channels than
 * PDCP_DEVICE_CHANNELS_MAX, or a channel without a direction; the device must not be used then. The first
 * bind request is queued by the first step. */
bool pdcp_device_init(pdcp_device_t *dev, const pdcp_device_desc_t *desc, const pdcp_device_port_t *port,
                      const pdcp_device_record_t *record, uint32_t seed, uint32_t now_ms);

/* A frame was received. Own frames must not be handed in. */
void pdcp_device_on_frame(pdcp_device_t *dev, uint32_t now_ms, const can_frame_t *frame);

/* Does what is due. Call after every frame handed in and when the deadline that it returned is reached;
 * earlier is harmless. Returns when it wants to be called again; there is always such a time. */
uint32_t pdcp_device_step(pdcp_device_t *dev, uint32_t now_ms);

/* Sends len (0 to 8) bytes from an output channel, high priority. False, and nothing is sent: not an output,
 * not enabled, without a node id, suspended, unbound, alone, or no room (the last places of the queue are
 * kept for answers). */
bool pdcp_device_send(pdcp_device_t *dev, uint32_t now_ms, uint8_t channel, const uint8_t *data, uint8_t len);

/* Fills ids[] with the node ids that enabled inputs listen to and returns how many, at most max. An id may
 * come twice. */
uint8_t pdcp_device_listens_to(const pdcp_device_t *dev, uint8_t *ids, uint8_t max);

#endif
