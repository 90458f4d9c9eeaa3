/* Role of this arbitrator on a bus that may have another one (D-BUS-12, D-BUS-35, D-BUS-42, D-BUS-51).
 *
 *           another one serves                 own beacons do not leave
 *   STANDBY <------------------- SERVING ------------------------------> LISTENING
 *      ^    ------------------->    ^                                     |    |
 *      |    it is gone, or serves   +-------------------------------------+    |
 *      |    no longer                 nobody else serves                       |
 *      +-----------------------------------------------------------------------+
 *                                     another one serves
 *
 * pdcp_standby.h keeps what is known of the other arbitrator. */
#ifndef PDCP_ROLE_H
#define PDCP_ROLE_H

#include <stdbool.h>

#include "pdcp_arb_state.h"

/* Begins with an empty bus: nothing is known of it; what is remembered and counted stays. The next beacon is
 * due at once. */
void pdcp_role_begin(pdcp_arb_t *arb);

/* The standby is over: the other arbitrator is gone, or serves no longer (D-BUS-42). */
void pdcp_role_take_over(pdcp_arb_t *arb);

/* Sends nothing and listens: its own beacons have not left for too long, others may have taken over. */
void pdcp_role_listen(pdcp_arb_t *arb);

/* Drops what waits to be sent, and counts it. Without a bus what waits is stale when there is one again;
 * requests repeat themselves, and an answer to what has been given up long ago would be taken for that to a
 * newer one (D-BUS-28). */
void pdcp_role_discard_queue(pdcp_arb_t *arb);

/* A frame in the name of an arbitrator (mode 1). */
void pdcp_role_on_arbitrator_frame(pdcp_arb_t *arb, const can_frame_t *frame);

/* A frame of a device while this arbitrator is on standby. True: a bind request that the other one has to
 * answer. */
bool pdcp_role_on_standby_frame(pdcp_arb_t *arb, const can_frame_t *frame);

/* A frame of a device, which may answer another arbitrator. */
void pdcp_role_on_device_frame(pdcp_arb_t *arb, const can_frame_t *frame);

/* PDCP_TIMER_STANDBY is due: a bind request stayed unanswered on standby, or this one has listened enough. */
void pdcp_role_on_standby_deadline(pdcp_arb_t *arb);

#endif
