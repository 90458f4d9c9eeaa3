/* Bind requests of a device (pdcp-bus.md 3). It asks for its last node id or a random one, at growing
 * intervals. Only the other files of the device role use this. */
#ifndef PDCP_DEVICE_BIND_H
#define PDCP_DEVICE_BIND_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_codec.h"
#include "pdcp_device_types.h"

/* Can a device have this id? */
static inline bool pdcp_device_bind_is_id(uint8_t id)
{
    return id >= PDCP_NODE_MIN && id <= PDCP_NODE_MAX;
}

/* Seeds the device's random numbers. They differ from those of other devices with the same seed. */
void pdcp_device_bind_seed(pdcp_device_t *dev, uint32_t seed);

/* Begins to ask: the device is unbound, and the next step sends a request. Call after the parameters were
 * reset, since one of them is the timeout. */
void pdcp_device_bind_start(pdcp_device_t *dev, uint32_t now_ms);

/* Asks if it is time. Returns the time of the next call at the latest. */
uint32_t pdcp_device_bind_step(pdcp_device_t *dev, uint32_t now_ms);

/* Takes an answer 81h. True: the id that was asked for is granted. Otherwise the device goes on asking, with
 * the suggested id if there is one. */
bool pdcp_device_bind_on_answer(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);

#endif
