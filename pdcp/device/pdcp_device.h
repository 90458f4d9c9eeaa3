/* The device role: what a sensor, a controller or a hand runs to take part in PDCP (pdcp-bus.md 10,
 * D-BUS-16).
 *
 * Passive: frames and time go in, frames and the next deadline come out. A pdcp_device_t is one device and
 * holds all of its state. It allocates nothing and reads no clock, and a program may have several. Not
 * thread-safe: call everything from the main loop, never from an interrupt handler.
 *
 *     pdcp_device_init(&dev, &desc, &port, record, seed, now_ms);
 *     forever:
 *         for each received frame:          pdcp_device_on_frame(&dev, now_ms, &frame);
 *         when an output has a new value:   pdcp_device_send(&dev, now_ms, channel, data, len);
 *         deadline_ms = pdcp_device_step(&dev, now_ms);
 *         while pdcp_device_tx_peek(&dev, &frame) and the controller takes it:   pdcp_device_tx_pop(&dev);
 *         sleep until a frame comes, the controller has room, or deadline_ms is reached
 *
 * This header includes pdcp_device_types.h, which has the descriptions to fill and the readers, and
 * pdcp_device_tx.h, which has the frames to be sent. All times are 32-bit milliseconds that may start
 * anywhere and wrap (pdcp_time.h). */
#ifndef PDCP_DEVICE_H
#define PDCP_DEVICE_H

#include <stdbool.h>
#include <stdint.h>

#include "can_frame.h"
#include "pdcp_device_tx.h"
#include "pdcp_device_types.h"

/* Starts the device, as at power-on. desc and port must outlive it; record (NULL: none) is copied. seed
 * should differ between devices and power cycles; the identity is mixed in. The first step queues the first
 * bind request. False: desc has more channels than PDCP_DEVICE_CHANNELS_MAX, or a channel without a
 * direction, and the device must not be used. */
bool pdcp_device_init(pdcp_device_t *dev, const pdcp_device_desc_t *desc, const pdcp_device_port_t *port,
                      const pdcp_device_record_t *record, uint32_t seed, uint32_t now_ms);

/* Takes a received frame. Frames that the device has sent must not be handed in. */
void pdcp_device_on_frame(pdcp_device_t *dev, uint32_t now_ms, const can_frame_t *frame);

/* Does what is due. Call after every frame handed in, and when the time that it returned is reached; earlier
 * is harmless. Returns the time of the next call at the latest. */
uint32_t pdcp_device_step(pdcp_device_t *dev, uint32_t now_ms);

/* Queues len (0 to 8) bytes of an output channel, with high priority. False: nothing is sent, since it is not
 * an output, is not enabled, has no node id, the device is suspended, unbound or alone, or there is no room
 * (the last places of the queue are kept for answers). */
bool pdcp_device_send(pdcp_device_t *dev, uint32_t now_ms, uint8_t channel, const uint8_t *data, uint8_t len);

/* Fills ids[] with the node ids that enabled inputs listen to. Returns how many, at most max. An id may come
 * twice. */
uint8_t pdcp_device_listens_to(const pdcp_device_t *dev, uint8_t *ids, uint8_t max);

#endif
