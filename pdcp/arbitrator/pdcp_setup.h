/* Setup of a bound device: reads what it is, silences its channels, gives its outputs node ids
 * (pdcp-bus.md 6).
 *
 * There are four passes: the device's own parameters; transfer enabled 0 to every channel; the direction of
 * every channel; everything else of every channel. Devices are set up independently, so that none holds up
 * another. A step that fails is tried again after a pause. After PDCP_SETUP_ATTEMPTS failures, or without
 * room, the device is left bound but unlinked (D-BUS-17).
 *
 *   DEVICE --> SILENCE --> DIRECTION --> CHANNELS --> PDCP_PLACE_READY
 *
 * A pass is a list of steps, walked once (DEVICE) or once for each channel. A failed step pauses and stays;
 * PDCP_SETUP_ATTEMPTS failures lead to PDCP_PLACE_FAILED and, 5 s later, to DEVICE. */
#ifndef PDCP_SETUP_H
#define PDCP_SETUP_H

#include "pdcp_request.h"

/* Puts a device, in any state, at the beginning of its setup. It must have no request under way. */
void pdcp_setup_start(pdcp_bus_t *bus, uint8_t place);

/* Sends the request of the current step. Call when the device has no request under way and the timer of its
 * requests does not run. */
void pdcp_setup_ask(pdcp_bus_t *bus, uint8_t place);

/* Takes a device's acknowledgement time (parameter 11) or beacon interval (10), read or written by the host
 * (D-BUS-25), within the limits of D-BUS-13. Ignores other parameters. */
void pdcp_setup_take_time(pdcp_device_entry_t *device, uint8_t param, uint16_t time_ms);

/* Takes the reply to a request of PDCP_CLIENT_SETUP. After a failed step, the timer of the device's requests
 * runs until the next try. PDCP_ERR_UNKNOWN: this is not the device that was bound. */
pdcp_status_t pdcp_setup_on_reply(pdcp_bus_t *bus, uint8_t place, const pdcp_reply_t *reply);

#endif
