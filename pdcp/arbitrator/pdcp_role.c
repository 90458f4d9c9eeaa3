#include "pdcp_role.h"

#include <string.h>

#include "pdcp_audit.h"
#include "pdcp_hold.h"
#include "pdcp_host.h"
#include "pdcp_link.h"
#include "pdcp_standby.h"
#include "pdcp_suspend.h"

/* Nothing is known of the bus; what is remembered and counted stays. Its devices may still speak. */
void pdcp_role_begin(pdcp_arb_t *arb)
{
    for (unsigned id = PDCP_NODE_MIN; id <= PDCP_NODE_MAX; id++) {
        if (arb->bus.tables.owner[id] != 0) {
            pdcp_unknown_note(&arb->bus.unknown, arb->bus.now_ms, (uint8_t)id);
        }
    }
    arb->bus.bind.shut = pdcp_unknown_any(&arb->bus.unknown);
    pdcp_tables_init(&arb->bus.tables);
    for (int i = 0; i < PDCP_TIMER_RECOVERY; i++) { /* a controller that is off leaves that state */
        pdcp_timers_cancel(&arb->bus.timers, (uint8_t)i);
    }
    pdcp_txq_init(&arb->bus.txq);
    pdcp_link_init(&arb->bus);
    pdcp_audit_init(&arb->bus);
    memset(&arb->bus.suspend, 0, sizeof arb->bus.suspend);
    pdcp_bus_wake(&arb->bus, PDCP_TIMER_LINK, PDCP_CLOSED_MS);
    memset(arb->bus.bind.reserved, 0, sizeof arb->bus.bind.reserved);
    arb->asked_ms = arb->bus.now_ms;
    arb->bus.started_ms = arb->bus.now_ms;
    arb->beacon_ms = arb->bus.now_ms;
    arb->held_ms = 0;
    pdcp_bus_wake(&arb->bus, PDCP_TIMER_BEACON, 0);
}

/* Without a bus what waits is stale when there is one again; requests repeat themselves, and an answer to
 * what has been given up long ago would be taken for that to a newer one (D-BUS-28). */
void pdcp_role_discard_queue(pdcp_arb_t *arb)
{
    arb->bus.stats[PDCP_STAT_TX_DISCARDED] += arb->bus.txq.count;
    pdcp_txq_init(&arb->bus.txq);
}

static void enter(pdcp_arb_t *arb, pdcp_role_t role)
{
    arb->role = (uint8_t)role;
}

/* --- Standby --- */

/* Waits for the next beacon of the other arbitrator (D-BUS-35). */
static void stand_by(pdcp_arb_t *arb)
{
    pdcp_bus_wake(&arb->bus, PDCP_TIMER_BEACON,
                  (uint16_t)(PDCP_STANDBY_MS + arb->serial % PDCP_STANDBY_SPREAD_MS));
}

/* D-BUS-42: this arbitrator goes on standby; the host, if it waits, is told. */
static void go_silent(pdcp_arb_t *arb)
{
    enter(arb, PDCP_ROLE_STANDBY);
    pdcp_host_end(&arb->bus, &arb->host, PDCP_ERR_NO_ANSWER);
    if (pdcp_link_request_waits(&arb->bus)) {
        pdcp_bus_tell(&arb->bus, PDCP_EVENT_LINK_REQUEST, PDCP_NONE, PDCP_ERR_NO_ANSWER);
    }
    pdcp_role_begin(arb);
    stand_by(arb);
    pdcp_bus_tell_device(&arb->bus, PDCP_EVENT_SILENT, PDCP_NONE);
}

/* The standby is over: the other arbitrator is gone, or serves no longer (D-BUS-42). */
void pdcp_role_take_over(pdcp_arb_t *arb)
{
    enter(arb, PDCP_ROLE_SERVING);
    pdcp_role_begin(arb);
    pdcp_bus_tell_device(&arb->bus, PDCP_EVENT_STARTED, PDCP_NONE);
}

/* Without devices of its own an arbitrator goes on standby when another one serves. With some it stays; but
 * when two with devices of their own hear each other for long, the one whose time comes first yields. That
 * the other one has devices is seen when one answers it: beacons alone, which may be forged, take no limb its
 * arbitrator (D-BUS-42). */
static bool is_to_yield(const pdcp_arb_t *arb)
{
    const uint32_t now_ms = arb->bus.now_ms;
    const uint32_t stays_ms = PDCP_YIELD_MS + arb->serial % PDCP_YIELD_SPREAD_MS;
    if (pdcp_hold_has_own(arb)) {
        return pdcp_standby_is_answered(&arb->standby, now_ms) && now_ms - arb->standby.since_ms >= stays_ms;
    }
    return pdcp_standby_serves(&arb->standby, now_ms);
}

/* --- Frames of another arbitrator --- */

/* A beacon that this arbitrator has not sent: there is a second one, and the host is told (D-BUS-12). */
static void on_foreign_beacon(pdcp_arb_t *arb)
{
    pdcp_bus_count(&arb->bus, PDCP_STAT_FOREIGN_BEACON);
    const bool is_first = pdcp_standby_on_beacon(&arb->standby, arb->bus.now_ms);
    if (pdcp_arb_is_on_standby(arb)) {
        stand_by(arb);
        return;
    }
    if (is_first) {
        pdcp_bus_tell_device(&arb->bus, PDCP_EVENT_FOREIGN, PDCP_NONE);
    }
    if (is_to_yield(arb)) {
        go_silent(arb);
    }
}

/* Another arbitrator has answered a bind request: what is held of this identity is its business. */
static void on_foreign_grant(pdcp_arb_t *arb, const pdcp_identity_t *identity)
{
    const uint8_t place = pdcp_hold_place(arb, identity);
    if (place != PDCP_NONE) {
        pdcp_hold_drop(arb, place);
    }
    if (pdcp_arb_is_on_standby(arb)) {
        pdcp_standby_on_sign_of_life(&arb->standby);
        pdcp_timers_cancel(&arb->bus.timers, PDCP_TIMER_STANDBY);
    }
}

/* A frame of a device may answer another arbitrator. */
void pdcp_role_on_device_frame(pdcp_arb_t *arb, const can_frame_t *frame)
{
    if (pdcp_id_node(frame->id) != arb->standby.asked_id || arb->standby.asked_id == 0 ||
        !pdcp_standby_on_answer(&arb->standby, arb->bus.now_ms, frame)) {
        return;
    }
    if (pdcp_arb_is_on_standby(arb)) {
        pdcp_standby_on_sign_of_life(&arb->standby);
    } else if (is_to_yield(arb)) {
        go_silent(arb);
    }
}

/* Somebody else speaks to devices in the name of an arbitrator: what they have may no longer be what the
 * tables say (D-BUS-40). */
static void on_foreign_request(pdcp_arb_t *arb, const can_frame_t *frame)
{
    const uint8_t id = pdcp_id_node(frame->id);
    pdcp_audit_on_foreign(&arb->bus, id);
    if (frame->dlc == 3 && pdcp_codec_has_code(frame, PDCP_SUSPEND)) {
        pdcp_suspend_on_foreign(&arb->bus, id);
    }
}

void pdcp_role_on_arbitrator_frame(pdcp_arb_t *arb, const can_frame_t *frame)
{
    pdcp_msg_t msg;
    if (pdcp_id_priority(frame->id) == PDCP_PRIORITY_BINDING) {
        pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_UNUSED_ID);
        return;
    }
    if (frame->id == pdcp_can_id(PDCP_PRIORITY_HIGH, true, PDCP_NODE_BROADCAST) &&
        pdcp_codec_is_beacon(frame)) {
        on_foreign_beacon(arb);
        return;
    }
    pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_ARBITRATOR);
    if (pdcp_codec_decode(frame, &msg) == PDCP_DECODE_OK && msg.code == (PDCP_BIND_DEVICE | PDCP_ANSWER)) {
        on_foreign_grant(arb, &msg.identity);
    } else {
        pdcp_standby_on_request(&arb->standby, frame);
        on_foreign_request(arb, frame);
    }
}

/* On standby, a bind request that stays without an answer may mean that the other arbitrator serves no
 * longer. True: it is waited for. */
bool pdcp_role_on_standby_frame(pdcp_arb_t *arb, const can_frame_t *frame)
{
    pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_SILENT);
    if (pdcp_id_priority(frame->id) != PDCP_PRIORITY_BINDING) {
        pdcp_unknown_note(&arb->bus.unknown, arb->bus.now_ms, pdcp_id_node(frame->id));
        pdcp_role_on_device_frame(arb, frame);
        return false;
    }
    if (!pdcp_timers_is_set(&arb->bus.timers, PDCP_TIMER_STANDBY)) {
        pdcp_bus_wake(&arb->bus, PDCP_TIMER_STANDBY, PDCP_UNBOUND_WAIT_MS);
    }
    return true;
}

/* --- Listening --- */

/* Its own beacons have not left for too long: others may have taken over. It sends nothing and listens
 * (D-BUS-42, D-BUS-51). */
void pdcp_role_listen(pdcp_arb_t *arb)
{
    enter(arb, PDCP_ROLE_LISTENING);
    pdcp_role_discard_queue(arb);
    pdcp_bus_wake(&arb->bus, PDCP_TIMER_STANDBY, PDCP_LISTEN_MS);
}

void pdcp_role_on_standby_deadline(pdcp_arb_t *arb)
{
    const uint32_t now_ms = arb->bus.now_ms;
    if (pdcp_arb_is_on_standby(arb)) {
        if (pdcp_standby_on_unbound(&arb->standby, now_ms, now_ms - PDCP_UNBOUND_WAIT_MS)) {
            pdcp_role_take_over(arb);
        }
    } else if (pdcp_standby_serves(&arb->standby, now_ms)) {
        go_silent(arb);
    } else {
        enter(arb, PDCP_ROLE_SERVING);
        arb->beacon_ms = now_ms;
        pdcp_role_discard_queue(arb);
        pdcp_bus_wake(&arb->bus, PDCP_TIMER_BEACON, 0);
    }
}
