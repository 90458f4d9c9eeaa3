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

/* Forgets the bus and begins afresh; remembered identities and counters stay. The next beacon is due at
 * once. */
void pdcp_role_begin(pdcp_arb_t *arb);

/* Ends the standby: the other arbitrator is gone, or does not serve any more (D-BUS-42). */
void pdcp_role_take_over(pdcp_arb_t *arb);

/* Begins to listen: its own beacons have not left for too long, and another may have taken over. */
void pdcp_role_listen(pdcp_arb_t *arb);

/* Discards and counts the frames that wait to be sent. They are stale when the bus is back: requests repeat
 * themselves, and the answer to an old one would be taken for that to a newer one (D-BUS-28). */
void pdcp_role_discard_queue(pdcp_arb_t *arb);

/* Takes a frame in the name of an arbitrator (mode 1). */
void pdcp_role_on_arbitrator_frame(pdcp_arb_t *arb, const can_frame_t *frame);

/* Takes a frame of a device on standby. True: it is a bind request that the other arbitrator has to
 * answer. */
bool pdcp_role_on_standby_frame(pdcp_arb_t *arb, const can_frame_t *frame);

/* A frame of a device, which may answer another arbitrator. */
void pdcp_role_on_device_frame(pdcp_arb_t *arb, const can_frame_t *frame);

/* PDCP_TIMER_STANDBY is due: a bind request stayed unanswered on standby, or this one has listened enough. */
void pdcp_role_on_standby_deadline(pdcp_arb_t *arb);

#endif
