/* The bus arbitrator: frames and time go in, frames and the next deadline come out.
 *
 * After each call that hands something in, call pdcp_arb_step, then send the waiting frames
 * (pdcp_arb_tx_peek, pdcp_arb_tx_pop). An arbitrator belongs to one thread; a process may hold several.
 * now_ms may stand still but never runs backwards; it wraps (pdcp_time.h).
 *
 * The tables may be read at any time (arb->bus.tables, arb->bus.stats); only the functions here change
 * them. */
#ifndef PDCP_ARB_H
#define PDCP_ARB_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb_state.h"

/* Starts an arbitrator; its first beacon is due at once. on_event: see pdcp_bus.h. serial differs between
 * arbitrators and spreads the times of D-BUS-42. seed should differ from start to start: it decides where the
 * ids of outputs begin (D-BUS-36). */
void pdcp_arb_init(pdcp_arb_t *arb, uint32_t now_ms, uint32_t serial, uint32_t seed, pdcp_event_fn on_event,
                   void *ctx);

/* Sets the function that says which identities are part of a stored limb. They keep their places when unknown
 * devices crowd in (D-BUS-43). knows gets the ctx of on_event. */
void pdcp_arb_know(pdcp_arb_t *arb, pdcp_knows_fn knows);

/* Takes a frame of any kind from the bus. Frames that this arbitrator has sent must not be handed in. True:
 * call pdcp_arb_step now. False: nothing is due earlier than before, as with most beacons and channel
 * data. */
bool pdcp_arb_on_frame(pdcp_arb_t *arb, uint32_t now_ms, const can_frame_t *frame);

/* Does what is due. Returns the time of the next call at the latest, absolute. */
uint32_t pdcp_arb_step(pdcp_arb_t *arb, uint32_t now_ms);

/* The frame to be sent next, NULL: none. Valid until any other function is called. */
const can_frame_t *pdcp_arb_tx_peek(const pdcp_arb_t *arb);
void pdcp_arb_tx_pop(pdcp_arb_t *arb);

/* Gets or sets a parameter for the host, from binding on. bytes[] must live until PDCP_EVENT_REQUEST. Get:
 * size is the room, the event's len what came. Set: size is the length, at least 1. PDCP_OK: the event comes
 * once. PDCP_ERR_BUSY: another request is under way. PDCP_ERR_UNKNOWN: there is no such device. */
pdcp_status_t pdcp_arb_get(pdcp_arb_t *arb, uint8_t place, uint8_t channel, uint8_t param, uint8_t *bytes,
                           uint16_t size);
pdcp_status_t pdcp_arb_set(pdcp_arb_t *arb, uint8_t place, uint8_t channel, uint8_t param, uint8_t *bytes,
                           uint16_t size);

/* Makes exactly this link (2307h); output and input are channel numbers. PDCP_OK: PDCP_EVENT_LINK_REQUEST
 * comes once. PDCP_ERR_UNKNOWN: wrong direction. PDCP_ERR_OWN: both ends are of one device. PDCP_ERR_BUSY:
 * another link request is under way. */
pdcp_status_t pdcp_arb_connect(pdcp_arb_t *arb, uint8_t output, uint8_t input);

/* The same for a host, which must respect sole access: PDCP_ERR_SOLE if pdcp_tables_rival names an input that
 * is in the way. The event has that status if such an input appears before the link has its turn. (A plan
 * respects sole access as a whole: while it is carried out, an output may feed the new and the old input.) */
pdcp_status_t pdcp_arb_connect_sole(pdcp_arb_t *arb, uint8_t output, uint8_t input);

/* Removes the link of an input (pdcp-bus.md 8). PDCP_EVENT_LINK tells when it is removed. False: the input
 * has no link. */
bool pdcp_arb_disconnect(pdcp_arb_t *arb, uint8_t input);

/* Sends Suspend (time_ms 0: until released) or Release to one device for the host. Returns and ends like
 * pdcp_arb_get. */
pdcp_status_t pdcp_arb_command(pdcp_arb_t *arb, uint8_t place, uint8_t code, uint16_t time_ms);

/* Passes a frame of the host through. data[] has room for 8 bytes and holds dlc of them, 1 to 8; the first is
 * a function code below PDCP_ANSWER. At PDCP_EVENT_REQUEST with PDCP_OK it holds the device's answer, len
 * bytes, even if that is a failure. The tables follow Reset Device and Set Device Parameter. Otherwise like
 * pdcp_arb_set. */
pdcp_status_t pdcp_arb_passthrough(pdcp_arb_t *arb, uint8_t place, uint8_t *data, uint8_t dlc);

/* Ends what the host waits for, a request or a link, with PDCP_ERR_NO_ANSWER (D-API-16). Its event comes at
 * once. A link half made is undone; a device may already have done what it was told. */
void pdcp_arb_give_up(pdcp_arb_t *arb, uint32_t now_ms);

/* Sends Suspend or Release to all devices (N=0), which do not answer. False: on standby, or no room in the
 * transmit queue. */
bool pdcp_arb_broadcast(pdcp_arb_t *arb, uint8_t code, uint16_t time_ms);

/* Resets a device; several resets may be under way. PDCP_EVENT_RESET comes once. A device that answered is
 * lost until it binds again. False: there is no such device. */
bool pdcp_arb_reset(pdcp_arb_t *arb, uint32_t now_ms, uint8_t place);

/* Ends with PDCP_ERR_BUSY the resets that could not be sent yet because their devices have other requests
 * under way. */
void pdcp_arb_withdraw_resets(pdcp_arb_t *arb, uint32_t now_ms);

/* Takes the controller's state; call whenever it changes (pdcp_recovery.h). */
void pdcp_arb_on_state(pdcp_arb_t *arb, uint32_t now_ms, pdcp_bus_state_t state);

/* True, once: restart the controller now. */
bool pdcp_arb_take_restart(pdcp_arb_t *arb);

/* Lets the profile layer decide about links: only pdcp_arb_connect and Update Data Channel make any. stored:
 * a stored configuration is loaded, so Update Data Channel makes none either (pdcp-bus.md 7). This is
 * forgotten when the arbitrator starts again. */
void pdcp_arb_plan_links(pdcp_arb_t *arb, bool stored);

/* Has pdcp_arb_plan_links said that a stored configuration is loaded? */
static inline bool pdcp_arb_is_stored(const pdcp_arb_t *arb)
{
    return arb->bus.link.stored;
}

/* The source that an input has just lost. Call while PDCP_EVENT_LINK tells of this input. NULL: its link is
 * there, or is gone for another reason than that it was removed. Valid until the event has been handled. */
const pdcp_source_t *pdcp_arb_removed_source(const pdcp_arb_t *arb, uint8_t input);

/* Begins the audit, which never ends (D-BUS-40, pdcp_audit.h). */
void pdcp_arb_audit(pdcp_arb_t *arb, uint32_t now_ms);

/* Makes the active link of an input inactive: both ends are disabled, its source stays written (D-PRO-9);
 * PDCP_EVENT_LINK comes at once. */
void pdcp_arb_deactivate(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input);

/* Gives an input without a link an inactive one. Its source need not be on the bus: the output of the device
 * owner with this channel index, type and profile. The input is told (D-BUS-38). */
void pdcp_arb_remember(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input, const pdcp_identity_t *owner,
                       uint8_t index, uint16_t type, uint16_t profile);

/* Tells an input without a link that it has no source (D-BUS-38). */
void pdcp_arb_forget_source(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input);

/* Is nothing left to be made or removed? A device that does not answer may still be told to be silent
 * (D-BUS-22). */
bool pdcp_arb_links_settled(const pdcp_arb_t *arb);

/* Is a link being made, or is one that worked about to be made again? */
bool pdcp_arb_link_running(const pdcp_arb_t *arb);

/* Is a device being set up? */
bool pdcp_arb_setup_running(const pdcp_arb_t *arb);

#endif
