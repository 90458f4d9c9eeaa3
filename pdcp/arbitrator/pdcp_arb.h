/* The bus arbitrator: frames and time go in, frames and the next deadline come out.
 *
 * After calls that hand something in, the caller calls pdcp_arb_step and then takes the frames that
 * wait to be sent with pdcp_arb_tx_peek and pdcp_arb_tx_pop. Everything is single-threaded; several
 * arbitrators fit one process. now_ms may stand still but never runs backwards; it wraps (pdcp_time.h).
 *
 * The tables may be read at any time (arb->bus.tables, arb->bus.stats); only the functions here change
 * them. */
#ifndef PDCP_ARB_H
#define PDCP_ARB_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb_state.h"

/* on_event: see pdcp_bus.h. serial tells arbitrators apart: it spreads the times of D-BUS-42.
 * seed should differ from start to start: it decides where the ids of outputs begin (D-BUS-36). The first
 * beacon is due at once. */
void pdcp_arb_init(pdcp_arb_t *arb, uint32_t now_ms, uint32_t serial, uint32_t seed, pdcp_event_fn on_event,
                   void *ctx);

/* Who is known from a stored limb keeps its place when unknown devices crowd in (D-BUS-43). knows gets the
 * ctx of on_event. */
void pdcp_arb_know(pdcp_arb_t *arb, pdcp_knows_fn knows);

/* A frame from the bus, of any kind. Frames that this arbitrator has sent itself must not be handed in. True:
 * it may have led to something, pdcp_arb_step is to be called. False: nothing is due earlier than before; so
 * it is with the most frequent frames, beacons and channel data. */
bool pdcp_arb_on_frame(pdcp_arb_t *arb, uint32_t now_ms, const can_frame_t *frame);

/* Does what is due. Returns the absolute time at which it is to be called again at the latest. */
uint32_t pdcp_arb_step(pdcp_arb_t *arb, uint32_t now_ms);

/* The frame that leaves next, NULL: none. Valid until the next call of any other function. */
const can_frame_t *pdcp_arb_tx_peek(const pdcp_arb_t *arb);
void pdcp_arb_tx_pop(pdcp_arb_t *arb);

/* Gets or sets a parameter for the host; works from binding on. bytes[] must live until PDCP_EVENT_REQUEST.
 * Getting: size is the room, and the event's len what has come. Setting: size is the length, at least 1.
 * PDCP_OK: the event will come, once. PDCP_ERR_BUSY: another one is under way. PDCP_ERR_UNKNOWN: no such
 * device. */
pdcp_status_t pdcp_arb_get(pdcp_arb_t *arb, uint8_t place, uint8_t channel, uint8_t param, uint8_t *bytes,
                           uint16_t size);
pdcp_status_t pdcp_arb_set(pdcp_arb_t *arb, uint8_t place, uint8_t channel, uint8_t param, uint8_t *bytes,
                           uint16_t size);

/* Makes exactly this link (2307h), both ends by their channel numbers. PDCP_OK: PDCP_EVENT_LINK_REQUEST will
 * come, once. PDCP_ERR_UNKNOWN: wrong direction; PDCP_ERR_OWN: same device; PDCP_ERR_BUSY: another one is
 * under way. */
pdcp_status_t pdcp_arb_connect(pdcp_arb_t *arb, uint8_t output, uint8_t input);

/* The same with respect for sole access, for a host: PDCP_ERR_SOLE while pdcp_tables_rival names an input
 * that is in the way. The event has that status if there is one when the link has its turn. (A plan keeps
 * sole access as a whole; until it is carried out, an output may have its new input beside the old one.) */
pdcp_status_t pdcp_arb_connect_sole(pdcp_arb_t *arb, uint8_t output, uint8_t input);

/* Takes the link of an input away (pdcp-bus.md 8); PDCP_EVENT_LINK tells when that is done. False: it has
 * none. */
bool pdcp_arb_disconnect(pdcp_arb_t *arb, uint8_t input);

/* Suspend (time_ms: 0 = until released) or Release for one device, as a request of the host: answers and
 * outcome as with pdcp_arb_get. */
pdcp_status_t pdcp_arb_command(pdcp_arb_t *arb, uint8_t place, uint8_t code, uint16_t time_ms);

/* Passes a frame through: data[] holds dlc bytes, 1 to 8, beginning with a function code below PDCP_ANSWER,
 * and has room for 8. At PDCP_EVENT_REQUEST with PDCP_OK it holds the device's answer, len bytes, whatever
 * the answer says. The tables follow a Reset Device and a Set Device Parameter; otherwise as with
 * pdcp_arb_set. */
pdcp_status_t pdcp_arb_passthrough(pdcp_arb_t *arb, uint8_t place, uint8_t *data, uint8_t dlc);

/* The host waits no longer (D-API-16): what it has asked of a device, or the link that it has asked for, ends
 * with PDCP_ERR_NO_ANSWER, its event comes at once. What a device has been told already it may have done; a
 * link half made is undone. */
void pdcp_arb_give_up(pdcp_arb_t *arb, uint32_t now_ms);

/* Suspend or Release for all, sent to N=0; devices do not answer. False: no room in the transmit queue. */
bool pdcp_arb_broadcast(pdcp_arb_t *arb, uint8_t code, uint16_t time_ms);

/* Resets a device; several may be under way. PDCP_EVENT_RESET will come, once: a device that answered is lost
 * until it binds again. False: no such device. */
bool pdcp_arb_reset(pdcp_arb_t *arb, uint32_t now_ms, uint8_t place);

/* Resets that could not be sent yet, because their devices have other requests under way, end with
 * PDCP_ERR_BUSY. */
void pdcp_arb_withdraw_resets(pdcp_arb_t *arb, uint32_t now_ms);

/* The controller's state, whenever it has changed (pdcp_recovery.h). */
void pdcp_arb_on_state(pdcp_arb_t *arb, uint32_t now_ms, pdcp_bus_state_t state);

/* True, once: the controller is to be restarted now. */
bool pdcp_arb_take_restart(pdcp_arb_t *arb);

/* The profile layer takes over: no link is made but by pdcp_arb_connect and Update Data Channel, and by the
 * latter neither while stored is true, a stored configuration is loaded (pdcp-bus.md 7). stored is forgotten
 * when the bus is. */
void pdcp_arb_plan_links(pdcp_arb_t *arb, bool stored);

/* Begins to audit the devices (D-BUS-40, pdcp_audit.h), and never ends. */
void pdcp_arb_audit(pdcp_arb_t *arb, uint32_t now_ms);

/* Makes the active link of an input inactive: both ends are disabled, its source stays written (D-PRO-9);
 * PDCP_EVENT_LINK comes at once. */
void pdcp_arb_deactivate(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input);

/* Lists a link of an input that has none as inactive, with a source that need not be there: the output with
 * this channel index, type and profile, of the device owner. The input is told (D-BUS-38). */
void pdcp_arb_remember(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input, const pdcp_identity_t *owner,
                       uint8_t index, uint16_t type, uint16_t profile);

/* An input that has no link shall not name a source: it is told so (D-BUS-38). */
void pdcp_arb_forget_source(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input);

/* Have all links been made or taken away that were to be? A device that does not answer may still be told to
 * be silent (D-BUS-22). */
bool pdcp_arb_links_settled(const pdcp_arb_t *arb);

/* Is a link being made, or one that worked about to be made again? */
bool pdcp_arb_link_running(const pdcp_arb_t *arb);

/* Is a device being set up? */
bool pdcp_arb_setup_running(const pdcp_arb_t *arb);

#endif
