/* Bind requests: an arbitrator with devices of its own answers at once, one without lets another one go first
 * and holds the answer for a while (D-BUS-42, D-BUS-49). Which id a device gets says pdcp_bind. */
#ifndef PDCP_HOLD_H
#define PDCP_HOLD_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb_state.h"
#include "pdcp_codec.h"

/* A frame of priority 3 from a device. */
void pdcp_hold_on_frame(pdcp_arb_t *arb, const can_frame_t *frame);

/* PDCP_TIMER_LIFE of a place in state PDCP_PLACE_ASKED is due. */
void pdcp_hold_on_deadline(pdcp_arb_t *arb, uint8_t place);

/* Has this arbitrator granted an id to a device (D-BUS-42)? */
bool pdcp_hold_has_own(const pdcp_arb_t *arb);

/* Place of the identity whose request is held; PDCP_NONE: it is not. */
uint8_t pdcp_hold_place(const pdcp_arb_t *arb, const pdcp_identity_t *identity);

/* Drops the request that is held at this place: it has no answer. */
void pdcp_hold_drop(pdcp_arb_t *arb, uint8_t place);

#endif
