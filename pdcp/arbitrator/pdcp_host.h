/* The host's request to a device, one at a time. It waits for the device's place, is sent, and tells its
 * outcome once, as PDCP_EVENT_REQUEST. */
#ifndef PDCP_HOST_H
#define PDCP_HOST_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bus.h"
#include "pdcp_request.h"

typedef struct {
    bool active;
    bool waiting;   /* for the device's place */
    uint8_t client; /* PDCP_CLIENT_HOST; PDCP_CLIENT_RAW: a frame that the host made, its data in bytes (room
                       for 8), its DLC in size */
    uint8_t code; /* PDCP_GET_PARAMETER, PDCP_SET_PARAMETER, PDCP_SUSPEND, PDCP_RELEASE; raw: any request's */
    uint8_t place;
    uint8_t channel;
    uint8_t param;
    uint8_t *bytes; /* the application's, size bytes of room or of value */
    uint16_t size;  /* of PDCP_SUSPEND: the time in ms */
    uint16_t len;   /* got so far */
} pdcp_host_request_t;

/* What the caller does after a reply, besides the event. */
typedef enum {
    PDCP_HOST_NOTHING,
    PDCP_HOST_TIMES, /* the host has written a time of the device: set its deadline afresh (D-BUS-25) */
    PDCP_HOST_RESET  /* the host has reset the device: declare it lost until it binds again */
} pdcp_host_outcome_t;

/* Begins a request of PDCP_CLIENT_HOST; it waits until pdcp_host_start. PDCP_ERR_UNKNOWN: no such device.
 * PDCP_ERR_BUSY: another one is under way. */
pdcp_status_t pdcp_host_ask(pdcp_bus_t *bus, pdcp_host_request_t *host, uint8_t place, uint8_t channel,
                            uint8_t param, uint8_t *bytes, uint16_t size, uint8_t code);

/* Sends the waiting request: the device's place is free. */
void pdcp_host_start(pdcp_bus_t *bus, pdcp_host_request_t *host);

/* Ends the request and tells its status. Does nothing without a request. */
void pdcp_host_end(pdcp_bus_t *bus, pdcp_host_request_t *host, pdcp_status_t status);

/* Ends the host's request, or else its link request, with PDCP_ERR_NO_ANSWER (D-API-16). Returns the place
 * that became free; PDCP_NONE: none did. */
uint8_t pdcp_host_give_up(pdcp_bus_t *bus, pdcp_host_request_t *host);

/* Takes a reply to the request. The tables follow what the device has done. */
pdcp_host_outcome_t pdcp_host_on_reply(pdcp_bus_t *bus, pdcp_host_request_t *host, const pdcp_reply_t *reply);

/* Sets or cancels PDCP_TIMER_HOST. A request or link request that does not get its turn soon is given up, so
 * that the host has its answer in time (D-API-10). */
void pdcp_host_limit_wait(pdcp_bus_t *bus, const pdcp_host_request_t *host);

/* Gives up what waits for its turn: PDCP_TIMER_HOST is due. */
void pdcp_host_on_deadline(pdcp_bus_t *bus, pdcp_host_request_t *host);

#endif
