/* How a device asks for its node id (pdcp-bus.md 3): the last one that it had or a random one, again and
 * again at growing intervals. Only the other files of the device role use this. */
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

/* Power-on: makes the device's random numbers others than those of any other device with the same seed. */
void pdcp_device_bind_seed(pdcp_device_t *dev, uint32_t seed);

/* The device is unbound from now on: asks with the next step. Comes after the reset of the parameters, one of
 * which is the timeout. */
void pdcp_device_bind_start(pdcp_device_t *dev, uint32_t now_ms);

/* Asks when it is due. Returns when it wants to be called again. */
uint32_t pdcp_device_bind_step(pdcp_device_t *dev, uint32_t now_ms);

/* 81h. True: the id that was asked for is granted. Else it goes on, with the id that is suggested or with
 * what the next step says. */
bool pdcp_device_bind_on_answer(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg);

#endif
