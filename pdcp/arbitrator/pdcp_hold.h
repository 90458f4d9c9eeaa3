/* Bind requests and when they are answered (D-BUS-42, D-BUS-49). An arbitrator with devices of its own
 * answers at once; one without holds the answer for a while, so that another arbitrator may go first.
 * pdcp_bind decides which id a device gets. */
#ifndef PDCP_HOLD_H
#define PDCP_HOLD_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb_state.h"
#include "pdcp_codec.h"

/* Takes a frame of priority 3 from a device. */
void pdcp_hold_on_frame(pdcp_arb_t *arb, const can_frame_t *frame);

/* Grants the request that is held at this place: its PDCP_TIMER_LIFE is due. */
void pdcp_hold_on_deadline(pdcp_arb_t *arb, uint8_t place);

/* Has this arbitrator granted an id to a device (D-BUS-42)? */
bool pdcp_hold_has_own(const pdcp_arb_t *arb);

/* Place where a request of this identity is held. PDCP_NONE: none is. */
uint8_t pdcp_hold_place(const pdcp_arb_t *arb, const pdcp_identity_t *identity);

/* Drops the request that is held at this place, without an answer. */
void pdcp_hold_drop(pdcp_arb_t *arb, uint8_t place);

#endif
