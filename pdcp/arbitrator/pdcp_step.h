/* One step of a link job: a request about one parameter of one channel.
 *
 * Only pdcp_job calls these functions, while a job is under way. They read the job (bus->link.job) and write
 * to the tables, but do not change the job. */
#ifndef PDCP_STEP_H
#define PDCP_STEP_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_request.h"

/* Steps in the order of making a link; undoing and removing run through them backwards. */
typedef enum {
    PDCP_STEP_READ_VID_PID, /* Update Data Channel: what source the device names */
    PDCP_STEP_READ_SERIAL,
    PDCP_STEP_OUTPUT_ID, /* if the output has none */
    PDCP_STEP_INPUT_OFF, /* before its source is replaced */
    PDCP_STEP_VID_PID,
    PDCP_STEP_SERIAL,
    PDCP_STEP_TYPE,
    PDCP_STEP_NODES,
    PDCP_STEP_INPUT_ON,
    PDCP_STEP_OUTPUT_ID_AGAIN, /* only when a link is written again, whatever differed (D-BUS-57) */
    PDCP_STEP_OUTPUT_ON,
    PDCP_STEP_END
} pdcp_step_t;

/* Outcome of a step. */
typedef enum {
    PDCP_STEP_SENT,      /* its request is under way */
    PDCP_STEP_NOTHING,   /* there is nothing to write in it */
    PDCP_STEP_LATER,     /* the device has another request under way, or it is too early (D-BUS-36) */
    PDCP_STEP_IMPOSSIBLE /* a channel that it needs is gone or not set up, or no node id is left */
} pdcp_step_result_t;

/* Is this a step that reads the source of an input? */
static inline bool pdcp_step_is_reading(uint8_t step)
{
    return step <= PDCP_STEP_READ_SERIAL;
}

/* The channel of the current step. NULL: the job has none, or it is gone. */
pdcp_channel_t *pdcp_step_channel(pdcp_bus_t *bus);

/* Sends the request of the current step. */
pdcp_step_result_t pdcp_step_send(pdcp_bus_t *bus);

/* Writes the answered step into the tables. False: the device names another source than the tables, and only
 * UPDATE takes that over. */
bool pdcp_step_take(pdcp_bus_t *bus, const pdcp_reply_t *reply);

#endif
