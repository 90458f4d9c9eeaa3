/* Transmit queue of a device, in the order of the bus (pdcp_txq.h). A frame that finds it full is lost and
 * counted. */
#ifndef PDCP_DEVICE_TX_H
#define PDCP_DEVICE_TX_H

#include <stdbool.h>
#include <stdint.h>

#include "can_frame.h"
#include "pdcp_codec.h"
#include "pdcp_device_types.h"

/* --- for the application --- */

/* Shows the frame to be sent next: lowest identifier first, oldest first among equals. False: there is
 * none. */
bool pdcp_device_tx_peek(const pdcp_device_t *dev, can_frame_t *frame);

/* Removes the frame that pdcp_device_tx_peek showed. Nothing else may be called between the two. */
void pdcp_device_tx_pop(pdcp_device_t *dev);

/* --- for the other files of the device role only --- */

/* Queues a frame, which is copied. False: there is no room, and the frame is lost. */
bool pdcp_device_tx_frame(pdcp_device_t *dev, const can_frame_t *frame);

/* Queues a message from the device's own id, with normal priority. */
void pdcp_device_tx_msg(pdcp_device_t *dev, const pdcp_msg_t *msg);

/* Queues the answer to request: same parameter, channel, word and value. */
void pdcp_device_tx_answer(pdcp_device_t *dev, const pdcp_msg_t *request, uint8_t result);

/* Queues a beacon, unless the one before still waits: a second one would say nothing new. */
void pdcp_device_tx_beacon(pdcp_device_t *dev);

/* Is there room for a frame other than an answer? The last places are kept for answers. */
bool pdcp_device_tx_has_room(const pdcp_device_t *dev);

#endif
