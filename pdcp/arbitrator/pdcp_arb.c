#include "pdcp_arb.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_audit.h"
#include "pdcp_bind.h"
#include "pdcp_hold.h"
#include "pdcp_life.h"
#include "pdcp_link.h"
#include "pdcp_role.h"
#include "pdcp_suspend.h"
#include "pdcp_time.h"

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
    pdcp_role_begin(arb);
}

void pdcp_arb_know(pdcp_arb_t *arb, pdcp_knows_fn knows)
{
    arb->bus.knows = knows;
}

/* --- Frames --- */

static bool is_young(const pdcp_arb_t *arb)
{
    return pdcp_bus_age_ms(&arb->bus) < PDCP_YOUNG_MS;
}

/* A frame from an id that no device has, or from an output of a lost or silenced one (D-BUS-15, D-BUS-37). The
 * beacon of a lost device leads to pdcp_life_on_first_beacon instead. True: there is something to be sent. */
static bool on_unknown(pdcp_arb_t *arb, const can_frame_t *frame)
{
    const uint8_t id = pdcp_id_node(frame->id);
    pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_UNKNOWN_ID);
    if (id < PDCP_NODE_MIN || id > PDCP_NODE_MAX) {
        return false;
    }
    arb->bus.bind.shut = arb->bus.bind.shut || pdcp_bus_age_ms(&arb->bus) < PDCP_SHUT_MS;
    if (pdcp_codec_has_code(frame, PDCP_RESET | PDCP_ANSWER)) {
        pdcp_unknown_note_answer(&arb->bus.unknown, arb->bus.now_ms, id);
    } else {
        pdcp_unknown_note(&arb->bus.unknown, arb->bus.now_ms, id);
    }
    pdcp_role_on_device_frame(arb, frame);
    if (!pdcp_codec_is_beacon(frame) || pdcp_arb_is_on_standby(arb) || is_young(arb)) {
        return pdcp_arb_is_on_standby(arb);
    }
    pdcp_life_reset_unknown(arb, id);
    return true;
}

static void on_other_kind(pdcp_arb_t *arb, const can_frame_t *frame)
{
    static const uint8_t drops[] = {[CAN_FRAME_EXTENDED] = PDCP_STAT_DROP_EXTENDED,
                                    [CAN_FRAME_REMOTE] = PDCP_STAT_DROP_REMOTE,
                                    [CAN_FRAME_ERROR] = PDCP_STAT_DROP_ERROR,
                                    [CAN_FRAME_FD] = PDCP_STAT_DROP_FD};
    pdcp_bus_count(&arb->bus, (pdcp_stat_t)drops[frame->kind]);
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

/* A frame of a bound device. What is malformed or deprecated is counted by its cause, and not answered
 * (D-BUS-4, D-BUS-5). */
static void on_message(pdcp_arb_t *arb, uint8_t place, const can_frame_t *frame)
{
    pdcp_msg_t msg;
    pdcp_reply_t reply;
    pdcp_role_on_device_frame(arb, frame);
    bool replied = pdcp_request_on_frame(&arb->bus, place, frame, &reply);
    if (!replied) {
        const pdcp_decode_t decoded = pdcp_codec_decode(frame, &msg);
        if (decoded == PDCP_DECODE_UNKNOWN_CODE) {
            pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_BAD_CODE);
        } else if (decoded == PDCP_DECODE_BAD_DLC) {
            pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_BAD_DLC);
        } else if (is_deprecated(msg.code)) {
            pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_DEPRECATED);
        } else if (!is_from_device(msg.code)) {
            pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_DIRECTION);
        } else if (msg.code == PDCP_UPDATE_CHANNEL) {
            pdcp_bus_count(&arb->bus, PDCP_STAT_TAKEN);
            pdcp_link_on_update(&arb->bus, place, msg.channel);
        } else {
            replied = pdcp_request_on_message(&arb->bus, place, &msg, &reply);
        }
    }
    if (replied) {
        pdcp_life_on_reply(arb, place, &reply);
        pdcp_life_serve(arb, place);
    }
}

/* A frame on the id of an output. It is an unknown device's if the output's device is lost, or the output was
 * told to be silent and has had time to be: then it says nothing of the owner, and the output gets another id
 * before it is enabled (D-BUS-36, D-BUS-46). */
static bool on_channel_data(pdcp_arb_t *arb, uint8_t place, const can_frame_t *frame)
{
    pdcp_device_entry_t *device = pdcp_arb_device(arb, place);
    pdcp_channel_t *output =
        &arb->bus.tables.channels[pdcp_tables_output(&arb->bus.tables, place, pdcp_id_node(frame->id))];
    const bool is_silenced = device->state == PDCP_PLACE_READY && !output->enabled &&
                             arb->bus.now_ms - arb->bus.silenced_ms >= PDCP_FADING_MS;
    if (is_silenced || device->state == PDCP_PLACE_LOST) {
        pdcp_bind_take_output_id(&arb->bus, output);
        return on_unknown(arb, frame);
    }
    device->heard_ms = arb->bus.now_ms;
    pdcp_bus_count(&arb->bus, PDCP_STAT_CHANNEL_DATA);
    return false;
}

bool pdcp_arb_on_frame(pdcp_arb_t *arb, uint32_t now_ms, const can_frame_t *frame)
{
    arb->bus.now_ms = now_ms;
    pdcp_bus_count(&arb->bus, PDCP_STAT_RX);
    if (frame->kind != CAN_FRAME_BASE) {
        on_other_kind(arb, frame);
        return false;
    }
    if (pdcp_id_from_arbitrator(frame->id)) {
        pdcp_role_on_arbitrator_frame(arb, frame);
        return pdcp_arb_is_on_standby(arb);
    }
    if (pdcp_arb_is_on_standby(arb)) {
        return pdcp_role_on_standby_frame(arb, frame);
    }
    if (pdcp_id_priority(frame->id) == PDCP_PRIORITY_BINDING) {
        pdcp_hold_on_frame(arb, frame);
        return true;
    }
    uint8_t place;
    const bool is_device = pdcp_tables_owner(&arb->bus.tables, pdcp_id_node(frame->id), &place);
    if (place >= PDCP_DEVICES_MAX) {
        return on_unknown(arb, frame);
    }
    pdcp_device_entry_t *device = pdcp_arb_device(arb, place);
    if (!is_device) {
        return on_channel_data(arb, place, frame);
    }
    device->heard_ms = now_ms; /* any frame counts as life; the deadline moves when it fires */
    bool due = true;
    if (pdcp_codec_is_beacon(frame)) { /* by far the most frequent: without decoding */
        pdcp_bus_count(&arb->bus, PDCP_STAT_TAKEN);
        due = !device->beaconed || device->state == PDCP_PLACE_LOST;
        if (due) {
            pdcp_life_on_first_beacon(arb, device);
        }
    } else {
        on_message(arb, place, frame);
    }
    if (device->asked_again) {
        pdcp_life_end_check(arb, place);
        due = true;
    }
    return due;
}

/* --- Deadlines --- */

/* Sends the beacon of the arbitrator, and waits for the next one (D-BUS-11). */
static void send_beacon(pdcp_arb_t *arb)
{
    (void)pdcp_bus_send_word(&arb->bus, PDCP_PRIORITY_HIGH, PDCP_NODE_BROADCAST, PDCP_BEACON, 0);
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
    if (pdcp_arb_is_on_standby(arb)) {
        pdcp_role_take_over(arb);
    }
    pdcp_suspend_on_beacon(&arb->bus);
    send_beacon(arb);
}

static void on_audit_deadline(pdcp_arb_t *arb)
{
    const bool calm = pdcp_link_is_settled(&arb->bus) && !pdcp_arb_setup_running(arb);
    pdcp_audit_on_deadline(&arb->bus, calm);
}

static void on_life_deadline(pdcp_arb_t *arb, uint8_t place)
{
    if (pdcp_arb_device(arb, place)->state == PDCP_PLACE_ASKED) {
        pdcp_hold_on_deadline(arb, place);
    } else {
        pdcp_life_on_deadline(arb, place);
    }
}

static void on_deadline(pdcp_arb_t *arb, uint8_t timer)
{
    if (timer == PDCP_TIMER_BEACON) {
        on_beacon_deadline(arb);
    } else if (timer == PDCP_TIMER_LINK) {
        pdcp_link_open(&arb->bus);
        pdcp_link_on_ready(&arb->bus, PDCP_NONE);
    } else if (timer == PDCP_TIMER_HOST) {
        pdcp_host_on_deadline(&arb->bus, &arb->host);
    } else if (timer == PDCP_TIMER_AUDIT) {
        on_audit_deadline(arb);
    } else if (timer == PDCP_TIMER_RELEASE) {
        pdcp_suspend_on_deadline(&arb->bus);
    } else if (timer == PDCP_TIMER_STANDBY) {
        pdcp_role_on_standby_deadline(arb);
    } else if (timer == PDCP_TIMER_RECOVERY) {
        pdcp_role_discard_queue(arb);
        arb->restart = true;
    } else if (timer >= PDCP_TIMER_LIFE) {
        on_life_deadline(arb, (uint8_t)(timer - PDCP_TIMER_LIFE));
    } else {
        pdcp_life_on_request_deadline(arb, timer);
    }
}

/* Was it not called, or off the bus, for so long that others may have taken it for gone? */
static bool is_hung(const pdcp_arb_t *arb)
{
    return arb->role == PDCP_ROLE_SERVING && arb->recovery.state < (uint8_t)PDCP_BUS_OFF &&
           pdcp_time_before(arb->beacon_ms + PDCP_HUNG_MS, arb->bus.now_ms);
}

uint32_t pdcp_arb_step(pdcp_arb_t *arb, uint32_t now_ms)
{
    uint8_t timer;
    arb->bus.now_ms = now_ms;
    if (is_hung(arb)) {
        pdcp_role_listen(arb);
    }
    while (pdcp_timers_take_due(&arb->bus.timers, now_ms, &timer)) {
        on_deadline(arb, timer);
    }
    if (arb->host.waiting) {
        pdcp_life_serve(arb, arb->host.place);
    }
    pdcp_link_step(&arb->bus);
    pdcp_host_limit_wait(&arb->bus, &arb->host);
    return pdcp_timers_next_ms(&arb->bus.timers, now_ms);
}

/* --- Frames to be sent, and the controller --- */

const can_frame_t *pdcp_arb_tx_peek(const pdcp_arb_t *arb)
{
    return arb->role == PDCP_ROLE_LISTENING ? NULL : pdcp_txq_peek(&arb->bus.txq);
}

void pdcp_arb_tx_pop(pdcp_arb_t *arb)
{
    if (pdcp_codec_is_beacon(pdcp_txq_peek(&arb->bus.txq))) {
        arb->beacon_ms = arb->bus.now_ms;
    }
    pdcp_txq_pop(&arb->bus.txq);
    pdcp_bus_count(&arb->bus, PDCP_STAT_TX);
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
        pdcp_bus_count(&arb->bus, PDCP_STAT_BUS_OFF);
        pdcp_bus_wake(&arb->bus, PDCP_TIMER_RECOVERY, pause_ms);
    }
    if (was_away || pause_ms != 0) {
        pdcp_role_discard_queue(arb);
    }
    pdcp_bus_tell(&arb->bus, PDCP_EVENT_STATE, PDCP_NONE, (pdcp_status_t)state);
}

bool pdcp_arb_take_restart(pdcp_arb_t *arb)
{
    const bool restart = arb->restart;
    arb->restart = false;
    return restart;
}

/* --- The host's requests --- */

pdcp_status_t pdcp_arb_get(pdcp_arb_t *arb, uint8_t place, uint8_t channel, uint8_t param, uint8_t *bytes,
                           uint16_t size)
{
    return pdcp_host_ask(&arb->bus, &arb->host, place, channel, param, bytes, size, PDCP_GET_PARAMETER);
}

pdcp_status_t pdcp_arb_set(pdcp_arb_t *arb, uint8_t place, uint8_t channel, uint8_t param, uint8_t *bytes,
                           uint16_t size)
{
    return pdcp_host_ask(&arb->bus, &arb->host, place, channel, param, bytes, size, PDCP_SET_PARAMETER);
}

pdcp_status_t pdcp_arb_command(pdcp_arb_t *arb, uint8_t place, uint8_t code, uint16_t time_ms)
{
    return pdcp_host_ask(&arb->bus, &arb->host, place, 0, 0, NULL, time_ms, code);
}

pdcp_status_t pdcp_arb_passthrough(pdcp_arb_t *arb, uint8_t place, uint8_t *data, uint8_t dlc)
{
    const pdcp_status_t status = pdcp_host_ask(&arb->bus, &arb->host, place, data[PDCP_RAW_CHANNEL],
                                               data[PDCP_RAW_PARAM], data, dlc, data[PDCP_RAW_CODE]);
    if (status == PDCP_OK) {
        arb->host.client = PDCP_CLIENT_RAW;
    }
    return status;
}

void pdcp_arb_give_up(pdcp_arb_t *arb, uint32_t now_ms)
{
    arb->bus.now_ms = now_ms;
    const uint8_t freed = pdcp_host_give_up(&arb->bus, &arb->host);
    if (freed != PDCP_NONE) {
        pdcp_life_serve(arb, freed);
    }
}

bool pdcp_arb_broadcast(pdcp_arb_t *arb, uint8_t code, uint16_t time_ms)
{
    if (pdcp_arb_is_on_standby(arb) ||
        !pdcp_bus_send_word(&arb->bus, PDCP_PRIORITY_NORMAL, PDCP_NODE_BROADCAST, code, time_ms)) {
        return false;
    }
    pdcp_suspend_on_host(&arb->bus, PDCP_NONE, code, time_ms);
    return true;
}

bool pdcp_arb_reset(pdcp_arb_t *arb, uint32_t now_ms, uint8_t place)
{
    arb->bus.now_ms = now_ms;
    if (!pdcp_tables_is_bound(&arb->bus.tables, place)) {
        return false;
    }
    pdcp_arb_device(arb, place)->reset_asked = true;
    pdcp_life_serve(arb, place);
    return true;
}

void pdcp_arb_withdraw_resets(pdcp_arb_t *arb, uint32_t now_ms)
{
    arb->bus.now_ms = now_ms;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_request_t *request = &pdcp_arb_device(arb, i)->request;
        if (request->state == PDCP_REQUEST_IDLE || request->client != PDCP_CLIENT_RESET) {
            pdcp_life_end_reset(arb, i, PDCP_ERR_BUSY);
        }
    }
}

/* --- Links --- */

/* An output never feeds an input of its own device (D-API-6). sole: nor a second input that wants it for
 * itself (D-API-13). */
static pdcp_status_t connect(pdcp_arb_t *arb, uint8_t output, uint8_t input, bool sole)
{
    const pdcp_channel_t *channels = arb->bus.tables.channels;
    if (output >= PDCP_CHANNELS_MAX || input >= PDCP_CHANNELS_MAX ||
        channels[output].transfer != PDCP_OUTPUT || channels[input].transfer != PDCP_INPUT) {
        return PDCP_ERR_UNKNOWN;
    }
    if (channels[output].place == channels[input].place) {
        return PDCP_ERR_OWN;
    }
    if (sole && pdcp_tables_rival(&arb->bus.tables, output, input) != PDCP_NONE) {
        return PDCP_ERR_SOLE;
    }
    return pdcp_link_request(&arb->bus, output, input, sole);
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
    const pdcp_channel_t *channels = arb->bus.tables.channels;
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

/* The job that removes a link still knows the source. */
const pdcp_source_t *pdcp_arb_removed_source(const pdcp_arb_t *arb, uint8_t input)
{
    const pdcp_job_t *job = &arb->bus.link.job;
    const bool removed = arb->bus.tables.channels[input].link == PDCP_LINK_NONE && job->input == input &&
                         job->kind == PDCP_TODO_REMOVE;
    return removed ? &job->old : NULL;
}

void pdcp_arb_deactivate(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    arb->bus.now_ms = now_ms;
    pdcp_link_deactivate(&arb->bus, input, PDCP_OK);
}

void pdcp_arb_remember(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input, const pdcp_identity_t *owner,
                       uint8_t index, uint16_t type, uint16_t profile)
{
    pdcp_channel_t *channel = &arb->bus.tables.channels[input];
    arb->bus.now_ms = now_ms;
    channel->source.identity = *owner;
    channel->source.index = index;
    channel->source.type = type;
    channel->source.profile = profile;
    channel->link = PDCP_LINK_INACTIVE;
    pdcp_link_write(&arb->bus, input);
    pdcp_bus_tell_link(&arb->bus, PDCP_EVENT_LINK, input, PDCP_OK);
}

void pdcp_arb_forget_source(pdcp_arb_t *arb, uint32_t now_ms, uint8_t input)
{
    arb->bus.now_ms = now_ms;
    pdcp_link_write(&arb->bus, input);
}

/* --- Audit, and what is under way --- */

void pdcp_arb_audit(pdcp_arb_t *arb, uint32_t now_ms)
{
    arb->bus.now_ms = now_ms;
    pdcp_audit_begin(&arb->bus);
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
        const pdcp_device_entry_t *device = &arb->bus.tables.devices[i];
        if (device->state == PDCP_PLACE_SETUP && !device->setup_again) {
            return true;
        }
    }
    return false;
}
