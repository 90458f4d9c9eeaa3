/* One job of the links: it writes to one or two devices what makes a link, removes one, silences a channel,
 * resolves an Update Data Channel, or says again what a device should have already (pdcp-bus.md 7 and 8).
 *
 * A job is a row of steps, each one request:
 *
 *   kind             steps                                          direction
 *   SILENCE, AGAIN   output off, input off, node ids 0              undoing, from the last to the node ids
 *   REMOVE           the same, then the source                      undoing, from the last one
 *   CONNECT          output id, input off, source, node ids, on     forwards
 *   UPDATE           read the source, then as CONNECT               forwards
 *   WRITE            source, node ids, on; nothing off before       forwards
 *
 * A link that cannot be made is undone from the step that failed (D-BUS-21); the input has its old source
 * back at once. A step that has nothing to write, or whose channel is gone, is left out. pdcp_link begins
 * jobs, one at a time, and drives them; what comes of one is noted at the channels (pdcp_ends) and told as
 * PDCP_EVENT_LINK and, if the host waits for it, PDCP_EVENT_LINK_REQUEST. */
#ifndef PDCP_JOB_H
#define PDCP_JOB_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_request.h"

/* Begins a job; none may be under way. input or output may be PDCP_NONE where the kind needs none. Making a
 * link names its source in the tables at once. */
void pdcp_job_begin(pdcp_bus_t *bus, pdcp_todo_t kind, uint8_t input, uint8_t output);

/* Begins to write what the tables say to an input. for_device: its device has asked, so its source is read
 * first, and written only if it differs (D-BUS-38). */
void pdcp_job_begin_write(pdcp_bus_t *bus, uint8_t input, bool for_device);

/* Carries the job on until it waits for an answer, waits for a device's place, or is over. Without a job
 * nothing happens. */
void pdcp_job_run(pdcp_bus_t *bus);

/* A reply to a request of PDCP_CLIENT_LINK. */
void pdcp_job_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply);

/* The job goes on without the channels of a device that is gone; its request must be cancelled already. */
void pdcp_job_on_lost(pdcp_bus_t *bus, uint8_t place);

/* The host waits no longer: a job of it tells PDCP_ERR_NO_ANSWER and is undone. Returns the place of the
 * device whose request was broken off, PDCP_NONE: of none. */
uint8_t pdcp_job_give_up_request(pdcp_bus_t *bus);

/* Breaks a job of PDCP_TODO_AGAIN off and notes it anew, since everybody else comes first (D-BUS-22). It goes
 * on instead while somebody waits for the place of the device that is asked. */
void pdcp_job_break_off(pdcp_bus_t *bus);

#endif
