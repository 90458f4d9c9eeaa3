/* Audit (D-BUS-40): do the devices still have what the tables say?
 *
 * A frame of somebody else, or a device that forgets, may stop all data while the tables call a link active.
 * So while nothing else is to be done, one parameter of one channel is read every PDCP_AUDIT_MS, in turn: of
 * outputs that feed a link transfer enabled (4) and node id (5), of inputs with an active link transfer
 * enabled and their source's node ids (7), of inputs what they name as their source (5, 6), where the profile
 * layer plans the links: a later arbitrator reads that back. Each fourth question is for transfer enabled of
 * a channel without a link.
 *
 * What differs is counted, told (PDCP_EVENT_AUDIT) and repaired: a link is written again (pdcp_link_write), a
 * channel without one is silenced. After three repairs of one link within a minute it becomes inactive when
 * it differs again; what an input names as its source is then only told. Silence and refusal are no
 * differences. An answer is not compared if a link has changed since the question (pdcp_link_t, changed). */
#ifndef PDCP_AUDIT_H
#define PDCP_AUDIT_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_request.h"

enum {
    PDCP_AUDIT_MS = 60,    /* between two questions */
    PDCP_AUDIT_REPAIRS = 3 /* of one link within a minute */
};

/* Nothing is known of the bus. What was begun goes on. */
void pdcp_audit_init(pdcp_bus_t *bus);

/* Begins to ask. */
void pdcp_audit_begin(pdcp_bus_t *bus);

/* A device is set up: it is asked again what it has refused. */
void pdcp_audit_on_ready(pdcp_bus_t *bus, uint8_t place);

/* Somebody else has spoken to the device with this node id in the name of an arbitrator: it goes first. */
void pdcp_audit_on_foreign(pdcp_bus_t *bus, uint8_t node_id);

/* PDCP_TIMER_AUDIT is due; calm: nothing else is to be done, so a question may be asked. */
void pdcp_audit_on_deadline(pdcp_bus_t *bus, bool calm);

/* A reply to a question. Silence is no evidence (D-BUS-59). */
void pdcp_audit_on_reply(pdcp_bus_t *bus, const pdcp_reply_t *reply);

#endif
