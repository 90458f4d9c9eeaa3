/* One job of the link engine. It makes or removes a link, silences a channel, resolves an Update Data
 * Channel, or writes again what a device should have (pdcp-bus.md 7 and 8).
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
 * A link that cannot be made is undone from the step that failed (D-BUS-21); the input gets its old source
 * back at once. A step is left out when it has nothing to write or its channel is gone. pdcp_link begins the
 * jobs, one at a time. The outcome is noted at the channels (pdcp_ends) and told as PDCP_EVENT_LINK and, if
 * the host waits for it, PDCP_EVENT_LINK_REQUEST. */
#ifndef PDCP_JOB_H
#define PDCP_JOB_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_request.h"

/* Begins a job; none may be under way. input or output may be PDCP_NONE if the kind needs none. A job that
 * makes a link names the source in the tables at once. */
void pdcp_job_begin(pdcp_bus_t *bus, pdcp_todo_t kind, uint8_t input, uint8_t output);

/* Begins a job that writes to an input what the tables say. for_device: the device has asked, so its source
 * is read first and written only if it differs (D-BUS-38). */
void pdcp_job_begin_write(pdcp_bus_t *bus, uint8_t input, bool for_device);

/* Continues the job until it waits for an answer or for a device's place, or is over. Does nothing without a
 * job. */
void pdcp_job_run(pdcp_bus_t *bus);

/* Takes the reply to a request of PDCP_CLIENT_LINK. */
void pdcp_job_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply);

/* Continues the job without the channels of a lost device, whose request must be cancelled already. */
void pdcp_job_on_lost(pdcp_bus_t *bus, uint8_t place);

/* Ends the host's job with PDCP_ERR_NO_ANSWER and undoes it. Returns the place of the device whose request
 * was broken off; PDCP_NONE: there was none. */
uint8_t pdcp_job_give_up_request(pdcp_bus_t *bus);

/* Breaks off a job of PDCP_TODO_AGAIN and notes it again, since all else comes first (D-BUS-22). The job
 * continues instead if its device is being asked and somebody waits for that place. */
void pdcp_job_break_off(pdcp_bus_t *bus);

#endif
