/* Audit: compares devices with the tables, and repairs what differs (D-BUS-40).
 *
 * A foreign frame, or a device that forgets, may stop all data while the tables call a link active. So while
 * there is nothing else to do, one parameter of one channel is read every PDCP_AUDIT_MS, in turn:
 *
 *   outputs that feed a link      transfer enabled (4) and node id (5)
 *   inputs with an active link    transfer enabled (4) and their source's node ids (7)
 *   inputs                        the source that they name (5, 6), if the profile layer plans the links: a
 *                                 later arbitrator reads it back
 *   channels without a link       transfer enabled (4), as each fourth question
 *
 * A difference is counted, told (PDCP_EVENT_AUDIT) and repaired: a link is written again (pdcp_link_write), a
 * channel without a link is silenced. A link that differs again after three repairs within a minute becomes
 * inactive; a source named wrongly is then only told. Silence and refusal are not differences. An answer is
 * not compared if a link has changed since the question (pdcp_link_t, changed). */
#ifndef PDCP_AUDIT_H
#define PDCP_AUDIT_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_request.h"

enum {
    PDCP_AUDIT_MS = 60,    /* between two questions */
    PDCP_AUDIT_REPAIRS = 3 /* of one link within a minute */
};

/* Forgets what was found on the bus. An audit that was begun continues. */
void pdcp_audit_init(pdcp_bus_t *bus);

/* Begins the audit. */
void pdcp_audit_begin(pdcp_bus_t *bus);

/* Lets a device that is set up again be asked what it refused before. */
void pdcp_audit_on_ready(pdcp_bus_t *bus, uint8_t place);

/* Puts the device with this node id first: a foreign frame was sent to it. */
void pdcp_audit_on_foreign(pdcp_bus_t *bus, uint8_t node_id);

/* Asks the next question: PDCP_TIMER_AUDIT is due. calm: there is nothing else to do, so a question may be
 * asked. */
void pdcp_audit_on_deadline(pdcp_bus_t *bus, bool calm);

/* Takes the reply to a question. Silence is no evidence (D-BUS-59). */
void pdcp_audit_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply);

#endif
