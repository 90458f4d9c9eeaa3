#include "pdcp_arb.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_audit.h"
#include "pdcp_bind.h"
#include "pdcp_bytes.h"
#include "pdcp_link.h"
#include "pdcp_setup.h"
#include "pdcp_suspend.h"
#include "pdcp_time.h"

/* Nothing is known of the bus; what is remembered and counted stays. Its devices may still speak. */
static void forget_bus(pdcp_arb_t *arb)
{
    for (unsigned id = PDCP_NODE_MIN; id <= PDCP_NODE_MAX; id++) {
        if (arb->bus.nodes.owner[id] != 0) {
            pdcp_unknown_note(&arb->bus.unknown, arb->bus.now_ms, (uint8_t)id);
        }
    }
    arb->bus.bind.shut = pdcp_unknown_any(&arb->bus.unknown);
    pdcp_nodes_init(&arb->bus.nodes);
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
    arb->listening = false;
    pdcp_bus_wake(&arb->bus, PDCP_TIMER_BEACON, 0);
}

void pdcp_arb_init(pdcp_arb_t *arb, uint32_t now_ms, uint32_t serial, uint32_t seed, pdcp_event_fn on_event,
                   void *ctx)
{
    memset(arb, 0, sizeof *arb);
    arb->bus.now_ms = now_ms;
    arb->bus.on_event = on_event;
    arb->bus.event_ctx = ctx;
    arb->serial = serial;
    pdcp_unknown_init(&arb->bus.unknown, now_ms);
    pdcp_bind_init(&arb->bus.bind, seed);
    forget_bus(arb);
}

void pdcp_arb_know(pdcp_arb_t *arb, pdcp_knows_fn knows)
{
    arb->bus.knows = knows;
}

static void count(pdcp_arb_t *arb, pdcp_stat_t stat)
{
    pdcp_bus_count(&arb->bus, stat);
}

/* Sends a message that has no more than a code and a word. */
static bool send(pdcp_arb_t *arb, uint8_t priority, uint8_t node_id, uint8_t code, uint16_t word)
{
    const pdcp_msg_t msg = {.code = code, .word = word};
    return pdcp_bus_send(&arb->bus, priority, node_id, &msg);
}

static pdcp_node_t *node_of(pdcp_arb_t *arb, uint8_t node)
{
    return pdcp_bus_node(&arb->bus, node);
}

static uint16_t silence_ms(const pdcp_node_t *node)
{
    return (uint16_t)(node->beacon_ms * PDCP_BEACONS_MISSED);
}

static void set_life(pdcp_arb_t *arb, uint8_t node, uint16_t in_ms)
{
    pdcp_bus_wake(&arb->bus, (uint8_t)(PDCP_TIMER_LIFE + node), in_ms);
}

/* The beacon interval of a device may have become shorter: the deadline moves by itself only when it fires.
 */
static void expect_life(pdcp_arb_t *arb, uint8_t node)
{
    set_life(arb, node, silence_ms(node_of(arb, node)));
}

/* The host's request, if it has one, ends. */
static void host_ends(pdcp_arb_t *arb, pdcp_status_t status)
{
    if (!arb->host.active) {
        return;
    }
    arb->host.active = false;
    arb->host.waiting = false;
    const pdcp_event_t event = {.kind = PDCP_EVENT_REQUEST,
                                .node = arb->host.node,
                                .channel = PDCP_NONE,
                                .status = (int8_t)status,
                                .len = arb->host.len};
    arb->bus.on_event(arb->bus.event_ctx, arb->bus.now_ms, &event);
}

static void reset_ends(pdcp_arb_t *arb, uint8_t node, pdcp_status_t status)
{
    pdcp_node_t *device = node_of(arb, node);
    if (device->reset_asked) {
        device->reset_asked = false;
        pdcp_bus_tell(&arb->bus, PDCP_EVENT_RESET, node, status);
    }
}

/* Takes a device out of service: whoever waits for it learns that it does not answer, its links become
 * inactive, and if it counted, it is lost. */
static void take_down(pdcp_arb_t *arb, uint8_t node)
{
    pdcp_node_t *device = node_of(arb, node);
    device->state = PDCP_NODE_LOST;
    pdcp_suspend_on_lost(&arb->bus, node);
    pdcp_request_cancel(&arb->bus, node);
    pdcp_link_on_lost(&arb->bus, node);
    reset_ends(arb, node, PDCP_ERR_NO_ANSWER);
    if (arb->host.node == node) {
        host_ends(arb, PDCP_ERR_NO_ANSWER);
    }
    if (device->beaconed) {
        device->beaconed = false;
        pdcp_bus_tell_node(&arb->bus, PDCP_EVENT_LOST, node);
    }
}

static void begin_setup(pdcp_arb_t *arb, uint8_t node)
{
    pdcp_node_t *device = node_of(arb, node);
    device->setup_again = false;
    device->heard_ms = arb->bus.now_ms;
    device->taken_back = false;
    pdcp_setup_start(&arb->bus, node);
    expect_life(arb, node);
}

/* The device is gone; its ids are kept for it for a while. */
static void lose(pdcp_arb_t *arb, uint8_t node)
{
    node_of(arb, node)->asked_again = false;
    set_life(arb, node, PDCP_LOST_KEPT_MS);
    take_down(arb, node);
}

static void after_bind(pdcp_arb_t *arb, uint8_t node, pdcp_bind_result_t result)
{
    if (result != PDCP_BIND_GRANTED) {
        return;
    }
    if (node_of(arb, node)->state != PDCP_NODE_LOST) {
        take_down(arb, node); /* it was reset: what was known of its channels' state is gone */
    }
    begin_setup(arb, node);
    pdcp_suspend_on_bound(&arb->bus, node);
    if (!pdcp_bind_is_known(&arb->bus, &node_of(arb, node)->identity)) {
        set_life(arb, node, PDCP_GHOST_MS);
    }
}

static void start_host_request(pdcp_arb_t *arb)
{
    pdcp_host_request_t *host = &arb->host;
    host->waiting = false;
    pdcp_timers_cancel(&arb->bus.timers, PDCP_TIMER_HOST);
    pdcp_request_start(&arb->bus, host->node, (pdcp_client_t)host->client, host->code, host->channel,
                       host->param, host->bytes, host->size);
}

/* A device's place may have become free for its next request: the check of its identity comes first, then the
 * host, then its setup. */
static void serve(pdcp_arb_t *arb, uint8_t node)
{
    pdcp_node_t *device = node_of(arb, node);
    if (!pdcp_request_is_idle(&arb->bus, node)) {
        return;
    }
    if (device->asked_again) {
        pdcp_request_get(&arb->bus, node, PDCP_CLIENT_BIND, 0, PDCP_DEV_VID_PID, PDCP_VALUE_MAX);
        pdcp_request_limit_tries(&arb->bus, node, PDCP_CHECK_TRIES);
        return;
    }
    if (arb->host.waiting && arb->host.node == node) {
        start_host_request(arb);
        return;
    }
    if (device->reset_asked) {
        pdcp_request_command(&arb->bus, node, PDCP_CLIENT_RESET, PDCP_RESET, 0);
        return;
    }
    if (pdcp_timers_is_set(&arb->bus.timers, (uint8_t)(PDCP_TIMER_REQUEST + node))) {
        return; /* the setup pauses */
    }
    if (device->state == PDCP_NODE_FAILED) {
        pdcp_setup_start(&arb->bus, node);
    }
    if (device->state == PDCP_NODE_SETUP) {
        pdcp_setup_ask(&arb->bus, node);
    }
}

static bool is_beacon(const can_frame_t *frame)
{
    return frame->dlc == 1 && frame->data[0] == PDCP_BEACON;
}

static bool is_reset_answer(const can_frame_t *frame)
{
    return frame->dlc != 0 && frame->data[0] == (PDCP_RESET | PDCP_ANSWER);
}

/* Has it granted an id to a device (D-BUS-42)? One that is lost counts (D-BUS-50). */
static bool has_own(const pdcp_arb_t *arb)
{
    return pdcp_nodes_count_state(&arb->bus.nodes, PDCP_NODE_FREE) +
               pdcp_nodes_count_state(&arb->bus.nodes, PDCP_NODE_ASKED) !=
           PDCP_DEVICES_MAX;
}

static uint16_t own_hold_ms(const pdcp_arb_t *arb)
{
    return (uint16_t)(PDCP_HOLD_MS + arb->serial % PDCP_HOLD_SPREAD_MS);
}

/* How much longer the answer to a bind request is held that came now: another arbitrator may be there and
 * answer it (D-BUS-42). */
static uint16_t hold_ms(const pdcp_arb_t *arb)
{
    const uint16_t own_ms = own_hold_ms(arb);
    const uint32_t heard_ms = arb->bus.now_ms - arb->standby.since_ms;
    const bool waits = pdcp_standby_is_heard(&arb->standby, arb->bus.now_ms) && !arb->standby.doubted;
    return waits && heard_ms < PDCP_HOLD_FOREIGN_MS ? (uint16_t)(own_ms + PDCP_HOLD_FOREIGN_MS - heard_ms)
                                                    : own_ms;
}

/* Place of the identity whose request is held; PDCP_NONE: it is not. */
static uint8_t held_place(const pdcp_arb_t *arb, const pdcp_identity_t *identity)
{
    const uint8_t place = pdcp_nodes_find(&arb->bus.nodes, identity);
    return place != PDCP_NONE && arb->bus.nodes.nodes[place].state == PDCP_NODE_ASKED ? place
                                                                                      : (uint8_t)PDCP_NONE;
}

static void drop_held(pdcp_arb_t *arb, uint8_t place)
{
    pdcp_timers_cancel(&arb->bus.timers, (uint8_t)(PDCP_TIMER_LIFE + place));
    pdcp_nodes_remove(&arb->bus.nodes, place);
}

static void bind(pdcp_arb_t *arb, const pdcp_identity_t *identity, uint8_t asked)
{
    uint8_t node;
    const pdcp_bind_result_t result = pdcp_bind_on_request(&arb->bus, identity, asked, &node);
    after_bind(arb, node, result);
    if (node != PDCP_NONE) {
        serve(arb, node);
    }
}

/* An arbitrator without devices of its own lets another one go first. Without a place the device asks again.
 */
static void hold(pdcp_arb_t *arb, const pdcp_identity_t *identity, uint8_t asked)
{
    const uint8_t place = pdcp_nodes_free_place(&arb->bus.nodes);
    if (place == PDCP_NONE) {
        count(arb, PDCP_STAT_NO_ROOM);
        return;
    }
    pdcp_nodes_hold(&arb->bus.nodes, place, identity);
    node_of(arb, place)->asked_id = asked;
    set_life(arb, place, hold_ms(arb));
}

/* Nobody else has answered the request that is held. Of many that came together a few are set up at once, the
 * others follow one by one: they would only wait for each other (D-BUS-49). */
static void on_held(pdcp_arb_t *arb, uint8_t place)
{
    const pdcp_node_t held = *node_of(arb, place);
    arb->held_ms = own_hold_ms(arb);
    drop_held(arb, place);
    bind(arb, &held.identity, held.asked_id);
    if (pdcp_nodes_count_state(&arb->bus.nodes, PDCP_NODE_SETUP) < PDCP_HOLD_SETUPS) {
        return;
    }
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (node_of(arb, i)->state == PDCP_NODE_ASKED) {
            set_life(arb, i, PDCP_HOLD_PACE_MS);
        }
    }
}

static void on_bind_frame(pdcp_arb_t *arb, const can_frame_t *frame)
{
    pdcp_msg_t msg;
    const pdcp_decode_t decoded = pdcp_codec_decode(frame, &msg);
    if (msg.code != PDCP_BIND_DEVICE) {
        count(arb, PDCP_STAT_DROP_BINDING);
        return;
    }
    if (decoded != PDCP_DECODE_OK) {
        count(arb, PDCP_STAT_DROP_BAD_DLC);
        return;
    }
    count(arb, PDCP_STAT_TAKEN);
    arb->asked_ms = arb->bus.now_ms;
    const uint8_t place = held_place(arb, &msg.identity);
    if (place != PDCP_NONE) { /* the newer request replaces the older one */
        drop_held(arb, place);
    }
    if (has_own(arb)) {
        bind(arb, &msg.identity, pdcp_id_node(frame->id));
    } else {
        hold(arb, &msg.identity, pdcp_id_node(frame->id));
    }
}

static bool is_young(const pdcp_arb_t *arb)
{
    return pdcp_bus_age_ms(&arb->bus) < PDCP_YOUNG_MS;
}

/* Tells the device with this id to reset, at most once a second (D-BUS-15, D-BUS-37). It will then bind. */
static void reset_stranger(pdcp_arb_t *arb, uint8_t id)
{
    if (!pdcp_unknown_tell(&arb->bus.unknown, arb->bus.now_ms, id)) {
        return;
    }
    if (send(arb, PDCP_PRIORITY_NORMAL, id, PDCP_RESET, 0)) {
        count(arb, PDCP_STAT_STRANGER_RESET);
    }
}

/* Without a bus what waits is stale when there is one again; requests repeat themselves, and an answer to
 * what has been given up long ago would be taken for that to a newer one (D-BUS-28). */
static void discard_queue(pdcp_arb_t *arb)
{
    arb->bus.stats[PDCP_STAT_TX_DISCARDED] += arb->bus.txq.count;
    pdcp_txq_init(&arb->bus.txq);
}

/* Waits for the next beacon of the other arbitrator (D-BUS-35). */
static void stand_by(pdcp_arb_t *arb)
{
    pdcp_bus_wake(&arb->bus, PDCP_TIMER_BEACON,
                  (uint16_t)(PDCP_STANDBY_MS + arb->serial % PDCP_STANDBY_SPREAD_MS));
}

/* D-BUS-42: this arbitrator goes on standby; the host, if it waits, is told. */
static void go_silent(pdcp_arb_t *arb)
{
    arb->silent = true;
    host_ends(arb, PDCP_ERR_NO_ANSWER);
    if (pdcp_link_wish_waits(&arb->bus)) {
        pdcp_bus_tell(&arb->bus, PDCP_EVENT_WISH, PDCP_NONE, PDCP_ERR_NO_ANSWER);
    }
    forget_bus(arb);
    stand_by(arb);
    pdcp_bus_tell_node(&arb->bus, PDCP_EVENT_SILENT, PDCP_NONE);
}

/* The standby is over: the other arbitrator is gone, or serves no longer (D-BUS-42). */
static void take_over(pdcp_arb_t *arb)
{
    arb->silent = false;
    forget_bus(arb);
    pdcp_bus_tell_node(&arb->bus, PDCP_EVENT_STARTED, PDCP_NONE);
}

/* Without devices of its own an arbitrator goes on standby when another one serves. With some it stays; but
 * when two with devices of their own hear each other for long, the one whose time comes first yields. That
 * the other one has devices is seen when one answers it: beacons alone, which may be forged, take no limb its
 * arbitrator (D-BUS-42). */
static bool is_to_yield(const pdcp_arb_t *arb)
{
    const uint32_t now_ms = arb->bus.now_ms;
    const uint32_t stays_ms = PDCP_YIELD_MS + arb->serial % PDCP_YIELD_SPREAD_MS;
    if (has_own(arb)) {
        return pdcp_standby_is_answered(&arb->standby, now_ms) && now_ms - arb->standby.since_ms >= stays_ms;
    }
    return pdcp_standby_serves(&arb->standby, now_ms);
}

static void on_foreign_beacon(pdcp_arb_t *arb)
{
    count(arb, PDCP_STAT_FOREIGN_BEACON);
    const bool is_first = pdcp_standby_on_beacon(&arb->standby, arb->bus.now_ms);
    if (arb->silent) {
        stand_by(arb);
        return;
    }
    if (is_first) {
        pdcp_bus_tell_node(&arb->bus, PDCP_EVENT_FOREIGN, PDCP_NONE);
    }
    if (is_to_yield(arb)) {
        go_silent(arb);
    }
}

/* Another arbitrator has answered a bind request: what is held of this identity is its business. */
static void on_foreign_grant(pdcp_arb_t *arb, const pdcp_identity_t *identity)
{
    const uint8_t place = held_place(arb, identity);
    if (place != PDCP_NONE) {
        drop_held(arb, place);
    }
    if (arb->silent) {
        pdcp_standby_on_sign_of_life(&arb->standby);
        pdcp_timers_cancel(&arb->bus.timers, PDCP_TIMER_STANDBY);
    }
}

/* A frame of a device may answer another arbitrator. */
static void on_foreign_answer(pdcp_arb_t *arb, const can_frame_t *frame)
{
    if (pdcp_id_node(frame->id) != arb->standby.asked_id || arb->standby.asked_id == 0 ||
        !pdcp_standby_on_answer(&arb->standby, arb->bus.now_ms, frame)) {
        return;
    }
    if (arb->silent) {
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
    if (frame->dlc == 3 && frame->data[0] == PDCP_SUSPEND) {
        pdcp_suspend_on_foreign(&arb->bus, id);
    }
}

static void on_arbitrator_frame(pdcp_arb_t *arb, const can_frame_t *frame)
{
    pdcp_msg_t msg;
    if (pdcp_id_priority(frame->id) == PDCP_PRIORITY_BINDING) {
        count(arb, PDCP_STAT_DROP_UNUSED_ID);
        return;
    }
    if (frame->id == pdcp_can_id(PDCP_PRIORITY_HIGH, true, PDCP_NODE_BROADCAST) && is_beacon(frame)) {
        on_foreign_beacon(arb);
        return;
    }
    count(arb, PDCP_STAT_DROP_ARBITRATOR);
    if (pdcp_codec_decode(frame, &msg) == PDCP_DECODE_OK && msg.code == (PDCP_BIND_DEVICE | PDCP_ANSWER)) {
        on_foreign_grant(arb, &msg.identity);
    } else {
        pdcp_standby_on_request(&arb->standby, frame);
        on_foreign_request(arb, frame);
    }
}

/* On standby, a bind request that stays without an answer may mean that the other arbitrator serves no
 * longer. True: it is waited for. */
static bool on_frame_on_standby(pdcp_arb_t *arb, const can_frame_t *frame)
{
    count(arb, PDCP_STAT_DROP_SILENT);
    if (pdcp_id_priority(frame->id) != PDCP_PRIORITY_BINDING) {
        pdcp_unknown_note(&arb->bus.unknown, arb->bus.now_ms, pdcp_id_node(frame->id));
        on_foreign_answer(arb, frame);
        return false;
    }
    if (!pdcp_timers_is_set(&arb->bus.timers, PDCP_TIMER_STANDBY)) {
        pdcp_bus_wake(&arb->bus, PDCP_TIMER_STANDBY, PDCP_UNBOUND_WAIT_MS);
    }
    return true;
}

/* Its own beacons have not left for too long: others may have taken over. It sends nothing and listens
 * (D-BUS-42, D-BUS-51). */
static void listen(pdcp_arb_t *arb)
{
    arb->listening = true;
    discard_queue(arb);
    pdcp_bus_wake(&arb->bus, PDCP_TIMER_STANDBY, PDCP_LISTEN_MS);
}

static void on_standby_deadline(pdcp_arb_t *arb)
{
    const uint32_t now_ms = arb->bus.now_ms;
    if (arb->silent) {
        if (pdcp_standby_on_unbound(&arb->standby, now_ms, now_ms - PDCP_UNBOUND_WAIT_MS)) {
            take_over(arb);
        }
    } else if (pdcp_standby_serves(&arb->standby, now_ms)) {
        go_silent(arb);
    } else {
        arb->listening = false;
        arb->beacon_ms = now_ms;
        discard_queue(arb);
        pdcp_bus_wake(&arb->bus, PDCP_TIMER_BEACON, 0);
    }
}

/* A frame from an id that is not bound. True: there is something to be sent. */
static bool on_stranger(pdcp_arb_t *arb, const can_frame_t *frame)
{
    const uint8_t id = pdcp_id_node(frame->id);
    count(arb, PDCP_STAT_DROP_UNKNOWN_ID);
    if (id < PDCP_NODE_MIN || id > PDCP_NODE_MAX) {
        return false;
    }
    arb->bus.bind.shut = arb->bus.bind.shut || pdcp_bus_age_ms(&arb->bus) < PDCP_SHUT_MS;
    if (is_reset_answer(frame)) {
        pdcp_unknown_note_answer(&arb->bus.unknown, arb->bus.now_ms, id);
    } else {
        pdcp_unknown_note(&arb->bus.unknown, arb->bus.now_ms, id);
    }
    on_foreign_answer(arb, frame);
    if (!is_beacon(frame) || arb->silent || is_young(arb)) {
        return arb->silent;
    }
    reset_stranger(arb, id);
    return true;
}

/* The counters stand in the order of the kinds. */
static void on_other_kind(pdcp_arb_t *arb, const can_frame_t *frame)
{
    count(arb, (pdcp_stat_t)(PDCP_STAT_DROP_EXTENDED + frame->kind - CAN_FRAME_EXTENDED));
}

/* True: it was the first one, or the device was lost. */
static bool on_beacon(pdcp_arb_t *arb, pdcp_node_t *device)
{
    count(arb, PDCP_STAT_TAKEN);
    if (device->beaconed && device->state != PDCP_NODE_LOST) {
        return false;
    }
    if (device->state == PDCP_NODE_LOST) {
        begin_setup(arb, device->place); /* reads who it is before anything else (D-BUS-15) */
        device->taken_back = true;
        pdcp_bus_wake(&arb->bus, PDCP_TIMER_RELEASE, PDCP_RELEASE_MS); /* if it was suspended meanwhile */
        serve(arb, device->place);
    }
    device->beaconed = true;
    pdcp_bus_tell_node(&arb->bus, PDCP_EVENT_BOUND, device->place);
    return true;
}

/* The host has written a parameter, which may stand in the tables (D-BUS-25). */
static void host_has_set(pdcp_arb_t *arb)
{
    const pdcp_host_request_t *host = &arb->host;
    const uint8_t head = host->client == PDCP_CLIENT_RAW ? 3 : 0;
    if (host->size < head) {
        return;
    }
    const uint8_t *value = &host->bytes[head];
    const uint16_t len = (uint16_t)(host->size - head);
    if (host->channel == 0) {
        pdcp_setup_take_time(node_of(arb, host->node), host->param, pdcp_bytes_value_u16(value, len, 0));
        expect_life(arb, host->node);
        return;
    }
    const uint8_t channel = pdcp_nodes_channel(&arb->bus.nodes, host->node, host->channel);
    if (host->param == PDCP_CH_ENABLED && channel != PDCP_NONE && len != 0) {
        arb->bus.nodes.channels[channel].enabled = value[0] != 0;
    }
}

/* The answer to a frame that the host has passed through goes back as a whole. */
static void host_on_reply(pdcp_arb_t *arb, uint8_t node, const pdcp_reply_t *reply)
{
    pdcp_host_request_t *host = &arb->host;
    const uint16_t end = (uint16_t)(reply->offset + reply->len);
    const bool raw = host->client == PDCP_CLIENT_RAW;
    bool success = reply->status == PDCP_OK;
    if (raw && reply->len >= 2 && reply->bytes[1] != PDCP_SUCCESS) {
        success = false;
    }
    if (success && host->code == PDCP_SET_PARAMETER) {
        host_has_set(arb);
    } else if (success && (host->code == PDCP_SUSPEND || host->code == PDCP_RELEASE)) {
        pdcp_suspend_on_host(&arb->bus, node, host->code,
                             raw ? pdcp_bytes_value_u16(host->bytes, host->size, 1) : host->size);
    }
    if (reply->len != 0 && (raw || (host->code == PDCP_GET_PARAMETER && end <= host->size))) {
        memcpy(&host->bytes[reply->offset], reply->bytes, reply->len);
        host->len = end;
    }
    if (!reply->done) {
        return;
    }
    if (end == 0) {
        host->len = 0; /* a transfer that began anew may have ended empty */
    }
    host_ends(arb, (pdcp_status_t)reply->status);
    if (success && host->code == PDCP_RESET) {
        pdcp_bus_tell_node(&arb->bus, PDCP_EVENT_RESET, node);
        lose(arb, node);
    }
}

/* A device that has answered Reset Device is lost until it binds again. */
static void reset_on_reply(pdcp_arb_t *arb, uint8_t node, pdcp_status_t status)
{
    reset_ends(arb, node, status);
    if (status == PDCP_OK) {
        lose(arb, node);
    }
}

/* The check of a device whose identity has asked again (D-BUS-6): any answer shows that the asking one is
 * another. True: it was reset and is bound afresh; whoever waited for its reply has been told. */
static bool conclude_check(pdcp_arb_t *arb, uint8_t node, pdcp_status_t status)
{
    const bool answered = status != PDCP_ERR_NO_ANSWER;
    const pdcp_bind_result_t result = pdcp_bind_after_check(&arb->bus, node, answered);
    after_bind(arb, node, result);
    if (!answered && result == PDCP_BIND_SUGGESTED) { /* it was reset: known without a second check */
        lose(arb, node);
    }
    return !answered;
}

static void setup_on_reply(pdcp_arb_t *arb, uint8_t node, const pdcp_reply_t *reply)
{
    const pdcp_node_t *device = node_of(arb, node);
    if (pdcp_setup_on_reply(&arb->bus, node, reply) ==
        PDCP_ERR_UNKNOWN) { /* another device has this id, too (D-BUS-54) */
        reset_stranger(arb, device->node_id);
        lose(arb, node);
        return;
    }
    if (reply->channel == 0 && reply->param == PDCP_DEV_BEACON_INTERVAL) {
        expect_life(arb, node);
    }
    if (device->state == PDCP_NODE_READY) {
        pdcp_bind_on_ready(&arb->bus, device);
        pdcp_link_on_ready(&arb->bus, node);
        pdcp_audit_on_ready(&arb->bus, node);
    } else if (device->state == PDCP_NODE_FAILED) {
        arb->bus.link.due = true; /* an Update Data Channel may have waited for it */
    }
}

static void on_reply(pdcp_arb_t *arb, uint8_t node, const pdcp_reply_t *reply)
{
    const pdcp_status_t status = (pdcp_status_t)reply->status;
    /* Silence shows nothing when a question was asked once, or is one that no device need answer (D-BUS-41).
     */
    const bool counts = status != PDCP_ERR_NO_ANSWER ||
                        (reply->client != PDCP_CLIENT_AUDIT && reply->client != PDCP_CLIENT_RAW);
    if (reply->done && counts && node_of(arb, node)->asked_again && conclude_check(arb, node, status)) {
        return;
    }
    if (reply->client == PDCP_CLIENT_SETUP) {
        setup_on_reply(arb, node, reply);
    } else if (reply->client == PDCP_CLIENT_LINK) {
        pdcp_link_on_reply(&arb->bus, reply);
    } else if (reply->client == PDCP_CLIENT_RESET) {
        reset_on_reply(arb, node, status);
    } else if (reply->client == PDCP_CLIENT_AUDIT && reply->code == PDCP_RELEASE) {
        pdcp_suspend_on_reply(&arb->bus, node, status);
    } else if (reply->client == PDCP_CLIENT_AUDIT) {
        pdcp_audit_on_reply(&arb->bus, reply);
    } else if (reply->client == PDCP_CLIENT_HOST || reply->client == PDCP_CLIENT_RAW) {
        host_on_reply(arb, node, reply);
    }
}

/* Sets of function codes, one bit each by their low four bits. */
static bool is_in(unsigned codes, uint8_t code)
{
    return ((codes >> (code & 0xFu)) & 1u) != 0;
}

static bool is_deprecated(uint8_t code)
{
    return is_in(1u << PDCP_GET_DEVICE_INFO | 1u << PDCP_IND_GET_PARAMETER | 1u << PDCP_IND_SET_PARAMETER |
                     1u << PDCP_SET_NODE_ID,
                 code);
}

/* May a device send this code? All answers but those that it gets itself. */
static bool is_from_device(uint8_t code)
{
    const unsigned answers = 0xFFFFu ^ (1u << PDCP_BIND_DEVICE | 1u << PDCP_UPDATE_CHANNEL);
    const unsigned requests = 1u << PDCP_BULK_DATA | 1u << PDCP_UPDATE_CHANNEL;
    return is_in((code & PDCP_ANSWER) != 0 ? answers : requests, code);
}

static void on_message(pdcp_arb_t *arb, uint8_t node, const can_frame_t *frame)
{
    pdcp_msg_t msg;
    pdcp_reply_t reply;
    on_foreign_answer(arb, frame);
    bool replied = pdcp_request_on_frame(&arb->bus, node, frame, &reply);
    if (!replied) {
        const pdcp_decode_t decoded = pdcp_codec_decode(frame, &msg);
        if (decoded == PDCP_DECODE_UNKNOWN_CODE) {
            count(arb, PDCP_STAT_DROP_BAD_CODE);
        } else if (decoded == PDCP_DECODE_BAD_DLC) {
            count(arb, PDCP_STAT_DROP_BAD_DLC);
        } else if (is_deprecated(msg.code)) {
            count(arb, PDCP_STAT_DROP_DEPRECATED);
        } else if (!is_from_device(msg.code)) {
            count(arb, PDCP_STAT_DROP_DIRECTION);
        } else if (msg.code == PDCP_UPDATE_CHANNEL) {
            count(arb, PDCP_STAT_TAKEN);
            pdcp_link_on_update(&arb->bus, node, msg.channel);
        } else {
            replied = pdcp_request_on_message(&arb->bus, node, &msg, &reply);
        }
    }
    if (replied) {
        on_reply(arb, node, &reply);
        serve(arb, node);
    }
}

/* A frame on the id of an output. It is a stranger's if the output's device is lost, or the output was told
 * to be silent and has had time to be: then it says nothing of the owner, and the output gets another id
 * before it is enabled (D-BUS-36, D-BUS-46). */
static bool on_channel_data(pdcp_arb_t *arb, uint8_t node, const can_frame_t *frame)
{
    pdcp_node_t *device = node_of(arb, node);
    pdcp_channel_t *output =
        &arb->bus.nodes.channels[pdcp_nodes_output(&arb->bus.nodes, node, pdcp_id_node(frame->id))];
    const bool is_silenced = device->state == PDCP_NODE_READY && !output->enabled &&
                             arb->bus.now_ms - arb->bus.silenced_ms >= PDCP_FADING_MS;
    if (is_silenced || device->state == PDCP_NODE_LOST) {
        pdcp_bind_take_output_id(&arb->bus, output);
        return on_stranger(arb, frame);
    }
    device->heard_ms = arb->bus.now_ms;
    count(arb, PDCP_STAT_CHANNEL_DATA);
    return false;
}

/* A frame came from a bound id whose identity asks again, and was no answer to the request under way:
 * whatever it says, its owner is alive (D-BUS-23, D-BUS-41). */
static void end_check(pdcp_arb_t *arb, uint8_t node)
{
    if (node_of(arb, node)->request.client == PDCP_CLIENT_BIND) {
        pdcp_request_cancel(&arb->bus, node);
    }
    (void)conclude_check(arb, node, PDCP_OK);
    serve(arb, node);
}

bool pdcp_arb_on_frame(pdcp_arb_t *arb, uint32_t now_ms, const can_frame_t *frame)
{
    arb->bus.now_ms = now_ms;
    count(arb, PDCP_STAT_RX);
    if (frame->kind != CAN_FRAME_BASE) {
        on_other_kind(arb, frame);
        return false;
    }
    if (pdcp_id_from_arbitrator(frame->id)) {
        on_arbitrator_frame(arb, frame);
        return arb->silent;
    }
    if (arb->silent) {
        return on_frame_on_standby(arb, frame);
    }
    if (pdcp_id_priority(frame->id) == PDCP_PRIORITY_BINDING) {
        on_bind_frame(arb, frame);
        return true;
    }
    uint8_t node;
    const bool is_device = pdcp_nodes_owner(&arb->bus.nodes, pdcp_id_node(frame->id), &node);
    if (node >= PDCP_DEVICES_MAX) {
        return on_stranger(arb, frame);
    }
    pdcp_node_t *device = node_of(arb, node);
    if (!is_device) {
        return on_channel_data(arb, node, frame);
    }
    device->heard_ms = now_ms; /* any frame counts as life; the deadline moves when it fires */
    bool due = true;
    if (is_beacon(frame)) {
        due = on_beacon(arb, device); /* by far the most frequent: without decoding */
    } else {
        on_message(arb, node, frame);
    }
    if (device->asked_again) {
        end_check(arb, node);
        due = true;
    }
    return due;
}

static void send_beacon(pdcp_arb_t *arb)
{
    (void)send(arb, PDCP_PRIORITY_HIGH, PDCP_NODE_BROADCAST, PDCP_BEACON, 0);
    pdcp_bus_wake(&arb->bus, PDCP_TIMER_BEACON, PDCP_BEACON_MS);
}

/* The beacon's deadline is also the end of the standby: no other arbitrator was heard for long enough
 * (D-BUS-35). */
static void on_beacon_deadline(pdcp_arb_t *arb)
{
    arb->bus.started_ms = arb->bus.now_ms - pdcp_bus_age_ms(&arb->bus); /* a longer difference would wrap */
    pdcp_unknown_on_time(&arb->bus.unknown, arb->bus.now_ms);
    pdcp_bind_on_time(&arb->bus);
    pdcp_standby_on_time(&arb->standby, arb->bus.now_ms);
    if (arb->silent) {
        take_over(arb);
    }
    pdcp_suspend_on_beacon(&arb->bus);
    send_beacon(arb);
}

/* A device is gone for good. It may still speak on its ids, where it cannot be heard now. */
static void forget(pdcp_arb_t *arb, uint8_t node)
{
    const pdcp_node_t *device = node_of(arb, node);
    pdcp_unknown_note(&arb->bus.unknown, arb->bus.now_ms, device->node_id);
    for (uint8_t c = device->first_channel; c != PDCP_NONE; c = arb->bus.nodes.channels[c].next) {
        pdcp_channel_t *channel = &arb->bus.nodes.channels[c];
        if (channel->transfer == PDCP_OUTPUT && channel->node_id != 0) {
            pdcp_bind_take_output_id(&arb->bus, channel);
        }
    }
    pdcp_nodes_remove(&arb->bus.nodes, node);
}

/* Was an identity that is not known granted an id, and is not there (D-BUS-43)? Only its bind request was
 * ever heard. */
static bool is_ghost(const pdcp_arb_t *arb, const pdcp_node_t *device, uint32_t unheard_ms)
{
    return device->state == PDCP_NODE_SETUP && device->setup_pass == 0 && device->setup_step == 0 &&
           !device->beaconed && !device->asked_again && unheard_ms >= PDCP_GHOST_MS &&
           !pdcp_bind_is_known(&arb->bus, &device->identity);
}

static void on_life_deadline(pdcp_arb_t *arb, uint8_t node)
{
    pdcp_node_t *device = node_of(arb, node);
    const uint32_t unheard_ms = arb->bus.now_ms - device->heard_ms;
    if (device->state == PDCP_NODE_ASKED) {
        on_held(arb, node);
    } else if (device->state == PDCP_NODE_LOST) {
        forget(arb, node);
    } else if (is_ghost(arb, device, unheard_ms)) {
        pdcp_request_cancel(&arb->bus, node);
        forget(arb, node);
    } else if (unheard_ms < silence_ms(device)) {
        set_life(arb, node, (uint16_t)(silence_ms(device) - unheard_ms));
    } else {
        count(arb, PDCP_STAT_LOST);
        lose(arb, node);
    }
}

/* D-API-10: a request of the host, or a link, that cannot have its turn soon is given up, so that the host
 * has its answer in time. */
static void limit_host_wait(pdcp_arb_t *arb)
{
    bool waits = arb->host.waiting;
    if (arb->bus.link.wish_input != PDCP_NONE) {
        waits = true;
    }
    const bool limited = pdcp_timers_is_set(&arb->bus.timers, PDCP_TIMER_HOST);
    if (waits && !limited) {
        pdcp_bus_wake(&arb->bus, PDCP_TIMER_HOST, PDCP_HOST_WAIT_MS);
    } else if (!waits && limited) {
        pdcp_timers_cancel(&arb->bus.timers, PDCP_TIMER_HOST);
    }
}

static void on_host_deadline(pdcp_arb_t *arb)
{
    if (arb->host.waiting) {
        host_ends(arb, PDCP_ERR_BUSY);
    }
    pdcp_link_forget_wish(&arb->bus, PDCP_ERR_BUSY);
}

static void on_request_deadline(pdcp_arb_t *arb, uint8_t node)
{
    pdcp_reply_t reply;
    if (pdcp_request_on_deadline(&arb->bus, node, &reply)) {
        on_reply(arb, node, &reply);
    }
    serve(arb, node);
}

static void on_audit_deadline(pdcp_arb_t *arb)
{
    const bool calm = pdcp_link_is_settled(&arb->bus) && !pdcp_arb_setup_running(arb);
    pdcp_audit_on_deadline(&arb->bus, calm);
}

static void on_deadline(pdcp_arb_t *arb, uint8_t timer)
{
    if (timer == PDCP_TIMER_BEACON) {
        on_beacon_deadline(arb);
    } else if (timer == PDCP_TIMER_LINK) {
        pdcp_link_open(&arb->bus);
        pdcp_link_on_ready(&arb->bus, PDCP_NONE);
    } else if (timer == PDCP_TIMER_HOST) {
        on_host_deadline(arb);
    } else if (timer == PDCP_TIMER_AUDIT) {
        on_audit_deadline(arb);
    } else if (timer == PDCP_TIMER_RELEASE) {
        pdcp_suspend_on_deadline(&arb->bus);
    } else if (timer == PDCP_TIMER_STANDBY) {
        on_standby_deadline(arb);
    } else if (timer == PDCP_TIMER_RECOVERY) {
        discard_queue(arb);
        arb->restart = true;
    } else if (timer >= PDCP_TIMER_LIFE) {
        on_life_deadline(arb, (uint8_t)(timer - PDCP_TIMER_LIFE));
    } else {
        on_request_deadline(arb, timer);
    }
}

/* Was it not called, or off the bus, for so long that others may have taken it for gone? */
static bool is_hung(const pdcp_arb_t *arb)
{
    return !arb->silent && !arb->listening && arb->recovery.state < (uint8_t)PDCP_BUS_OFF &&
           pdcp_time_before(arb->beacon_ms + PDCP_HUNG_MS, arb->bus.now_ms);
}

uint32_t pdcp_arb_step(pdcp_arb_t *arb, uint32_t now_ms)
{
    uint8_t timer;
    arb->bus.now_ms = now_ms;
    if (is_hung(arb)) {
        listen(arb);
    }
    while (pdcp_timers_take_due(&arb->bus.timers, now_ms, &timer)) {
        on_deadline(arb, timer);
    }
    if (arb->host.waiting) {
        serve(arb, arb->host.node);
    }
    pdcp_link_step(&arb->bus);
    limit_host_wait(arb);
    return pdcp_timers_next_ms(&arb->bus.timers, now_ms);
}

const can_frame_t *pdcp_arb_tx_peek(const pdcp_arb_t *arb)
{
    return arb->listening ? NULL : pdcp_txq_peek(&arb->bus.txq);
}

void pdcp_arb_tx_pop(pdcp_arb_t *arb)
{
    if (is_beacon(pdcp_txq_peek(&arb->bus.txq))) {
        arb->beacon_ms = arb->bus.now_ms;
    }
    pdcp_txq_pop(&arb->bus.txq);
    count(arb, PDCP_STAT_TX);
}

static pdcp_status_t host_request(pdcp_arb_t *arb, uint8_t node, uint8_t channel, uint8_t param,
                                  uint8_t *bytes, uint16_t size, uint8_t code)
{
    pdcp_host_request_t *host = &arb->host;
    if (!pdcp_nodes_is_bound(&arb->bus.nodes, node)) {
        return PDCP_ERR_UNKNOWN;
    }
    if (host->active) {
        return PDCP_ERR_BUSY;
    }
    host->active = true;
    host->waiting = true;
    host->client = PDCP_CLIENT_HOST;
    host->code = code;
    host->node = node;
    host->channel = channel;
    host->param = param;
    host->bytes = bytes;
    host->size = size;
    host->len = 0;
    return PDCP_OK;
}

pdcp_status_t pdcp_arb_get(pdcp_arb_t *arb, uint8_t node, uint8_t channel, uint8_t param, uint8_t *bytes,
                           uint16_t size)
{
    return host_request(arb, node, channel, param, bytes, size, PDCP_GET_PARAMETER);
}

pdcp_status_t pdcp_arb_set(pdcp_arb_t *arb, uint8_t node, uint8_t channel, uint8_t param, uint8_t *bytes,
                           uint16_t size)
{
    return host_request(arb, node, channel, param, bytes, size, PDCP_SET_PARAMETER);
}

pdcp_status_t pdcp_arb_command(pdcp_arb_t *arb, uint8_t node, uint8_t code, uint16_t time_ms)
{
    return host_request(arb, node, 0, 0, NULL, time_ms, code);
}

pdcp_status_t pdcp_arb_passthrough(pdcp_arb_t *arb, uint8_t node, uint8_t *data, uint8_t dlc)
{
    const pdcp_status_t status = host_request(arb, node, data[2], data[1], data, dlc, data[0]);
    if (status == PDCP_OK) {
        arb->host.client = PDCP_CLIENT_RAW;
    }
    return status;
}

void pdcp_arb_give_up(pdcp_arb_t *arb, uint32_t now_ms)
{
    uint8_t freed = PDCP_NONE;
    arb->bus.now_ms = now_ms;
    if (arb->host.active) {
        if (!arb->host.waiting) {
            freed = arb->host.node;
            pdcp_request_cancel(&arb->bus, freed);
        }
        host_ends(arb, PDCP_ERR_NO_ANSWER);
    } else {
        freed = pdcp_link_give_up_wish(&arb->bus);
    }
    if (freed != PDCP_NONE) {
        serve(arb, freed);
    }
}

bool pdcp_arb_broadcast(pdcp_arb_t *arb, uint8_t code, uint16_t time_ms)
{
    if (arb->silent || !send(arb, PDCP_PRIORITY_NORMAL, PDCP_NODE_BROADCAST, code, time_ms)) {
        return false;
    }
    pdcp_suspend_on_host(&arb->bus, PDCP_NONE, code, time_ms);
    return true;
}

bool pdcp_arb_reset(pdcp_arb_t *arb, uint32_t now_ms, uint8_t node)
{
    arb->bus.now_ms = now_ms;
    if (!pdcp_nodes_is_bound(&arb->bus.nodes, node)) {
        return false;
    }
    node_of(arb, node)->reset_asked = true;
    serve(arb, node);
    return true;
}

void pdcp_arb_withdraw_resets(pdcp_arb_t *arb, uint32_t now_ms)
{
    arb->bus.now_ms = now_ms;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_request_t *request = &node_of(arb, i)->request;
        if (request->state == PDCP_REQUEST_IDLE || request->client != PDCP_CLIENT_RESET) {
            reset_ends(arb, i, PDCP_ERR_BUSY);
        }
    }
}

void pdcp_arb_on_state(pdcp_arb_t *arb, uint32_t now_ms, pdcp_bus_state_t state)
{
    if (state == arb->recovery.state) {
        return;
    }
    arb->bus.now_ms = now_ms;
    const bool was_away = arb->recovery.state >= (uint8_t)PDCP_BUS_OFF;
    const uint16_t pause_ms = pdcp_recovery_on_state(&arb->recovery, now_ms, state);
    pdcp_timers_cancel(&arb->bus.timers, PDCP_TIMER_RECOVERY);
    if (pause_ms != 0) {
        count(arb, PDCP_STAT_BUS_OFF);
        pdcp_bus_wake(&arb->bus, PDCP_TIMER_RECOVERY, pause_ms);
    }
    if (was_away || pause_ms != 0) {
        discard_queue(arb);
    }
    pdcp_bus_tell(&arb->bus, PDCP_EVENT_STATE, PDCP_NONE, (pdcp_status_t)state);
}

bool pdcp_arb_take_restart(pdcp_arb_t *arb)
{
    const bool restart = arb->restart;
    arb->restart = false;
    return restart;
}

static pdcp_status_t connect(pdcp_arb_t *arb, uint8_t output, uint8_t input, bool sole)
{
    const pdcp_channel_t *channels = arb->bus.nodes.channels;
    if (output >= PDCP_CHANNELS_MAX || input >= PDCP_CHANNELS_MAX ||
        channels[output].transfer != PDCP_OUTPUT || channels[input].transfer != PDCP_INPUT) {
        return PDCP_ERR_UNKNOWN;
    }
    if (channels[output].node == channels[input].node) {
        return PDCP_ERR_OWN;
    }
    if (sole && pdcp_nodes_rival(&arb->bus.nodes, output, input) != PDCP_NONE) {
        return PDCP_ERR_SOLE;
    }
    return pdcp_link_wish(&arb->bus, output, input, sole);
}

pdcp_status_t pdcp_arb_connect(pdcp_arb_t *arb, uint8_t output, uint8_t input)
{
    return connect(arb, output, input, false);
}

pdcp_status_t pdcp_arb_connect_sole(pdcp_arb_t *arb, uint8_t output, uint8_t input)
{
    return connect(arb, output, input, true);
}

bool pdcp_arb_disconnect(pdcp_arb_t *arb, uint8_t input)
{
    const pdcp_channel_t *channels = arb->bus.nodes.channels;
    if (input >= PDCP_CHANNELS_MAX || channels[input].link == PDCP_LINK_NONE) {
        return false;
    }
    pdcp_link_remove(&arb->bus, input);
    return true;
}

void pdcp_arb_plan_links(pdcp_arb_t *arb, bool stored)
{
    arb->bus.link.planned = true;
    arb->bus.link.stored = stored;
}

void pdcp_arb_audit(pdcp_arb_t *arb, uint32_t now_ms)
{
    arb->bus.now_ms = now_ms;
    pdcp_audit_begin(&arb->bus);
}

void pdcp_arb_rest(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    arb->bus.now_ms = now_ms;
    pdcp_link_rest(&arb->bus, input, PDCP_OK);
}

void pdcp_arb_remember(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input, const pdcp_identity_t *owner,
                       uint8_t index, uint16_t type, uint16_t profile)
{
    pdcp_channel_t *channel = &arb->bus.nodes.channels[input];
    arb->bus.now_ms = now_ms;
    channel->source = *owner;
    channel->source_index = index;
    channel->source_type = type;
    channel->source_profile = profile;
    channel->link = PDCP_LINK_INACTIVE;
    pdcp_link_write(&arb->bus, input);
    pdcp_bus_tell_link(&arb->bus, PDCP_EVENT_LINK, input, PDCP_OK);
}

void pdcp_arb_forget_source(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    arb->bus.now_ms = now_ms;
    pdcp_link_write(&arb->bus, input);
}

bool pdcp_arb_links_settled(const pdcp_arb_t *arb)
{
    return pdcp_link_is_settled(&arb->bus);
}

bool pdcp_arb_link_running(const pdcp_arb_t *arb)
{
    return pdcp_link_is_making(&arb->bus);
}

bool pdcp_arb_setup_running(const pdcp_arb_t *arb)
{
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_node_t *node = &arb->bus.nodes.nodes[i];
        if (node->state == PDCP_NODE_SETUP && !node->setup_again) {
            return true;
        }
    }
    return false;
}
