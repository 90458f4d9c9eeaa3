/* Setup of a bound device (pdcp-bus.md 6): read what it is, silence its channels, read what they are, give
 * its outputs node ids.
 *
 * Four passes: the device's own parameters; transfer enabled 0 to every channel; the direction of every
 * channel; everything else of every channel. Each device is on its own way, so that none holds up another. A
 * step that fails is tried again after a pause; when it has failed PDCP_SETUP_ATTEMPTS times, or there is no
 * room, the device is left bound but unlinked (D-BUS-17).
 *
 *   DEVICE --> SILENCE --> DIRECTION --> CHANNELS --> PDCP_PLACE_READY
 *
 * A pass is a list of steps, walked once (DEVICE) or once for each channel. A failed step pauses and stays;
 * PDCP_SETUP_ATTEMPTS failures lead to PDCP_PLACE_FAILED and, 5 s later, to DEVICE. */
#ifndef PDCP_SETUP_H
#define PDCP_SETUP_H

#include "pdcp_request.h"

/* Puts a device at the beginning of its setup, in whatever state it is; its place must have no request under
 * way. */
void pdcp_setup_start(pdcp_bus_t *bus, uint8_t place);

/* Sends the request of the current step. To be called when the device has no request under way and its
 * requests' timer does not run. */
void pdcp_setup_ask(pdcp_bus_t *bus, uint8_t place);

/* Takes over a device's acknowledgement time (parameter 11) or beacon interval (10), as read, or as written
 * by the host (D-BUS-25), within the limits of D-BUS-13. Other parameters: nothing. */
void pdcp_setup_take_time(pdcp_device_entry_t *device, uint8_t param, uint16_t time_ms);

/* A reply to a request of PDCP_CLIENT_SETUP. When the step has failed, the timer of the device's requests
 * runs until it is to be tried again. PDCP_ERR_UNKNOWN: the device is another than the bound one. */
pdcp_status_t pdcp_setup_on_reply(pdcp_bus_t *bus, uint8_t place, const pdcp_reply_t *reply);

#endif
