#include "pdcp_life.h"

#include <stddef.h>

#include "pdcp_audit.h"
#include "pdcp_bind.h"
#include "pdcp_host.h"
#include "pdcp_link.h"
#include "pdcp_request.h"
#include "pdcp_setup.h"
#include "pdcp_suspend.h"

static uint16_t silence_ms(const pdcp_device_entry_t *device)
{
    return (uint16_t)(device->beacon_ms * PDCP_BEACONS_MISSED);
}

void pdcp_life_set(pdcp_arb_t *arb, uint8_t place, uint16_t in_ms)
{
    pdcp_bus_wake(&arb->bus, (uint8_t)(PDCP_TIMER_LIFE + place), in_ms);
}

/* The beacon interval of a device may have become shorter: the deadline moves by itself only when it
 * fires. */
void pdcp_life_expect(pdcp_arb_t *arb, uint8_t place)
{
    pdcp_life_set(arb, place, silence_ms(pdcp_arb_device(arb, place)));
}

void pdcp_life_end_reset(pdcp_arb_t *arb, uint8_t place, pdcp_status_t status)
{
    pdcp_device_entry_t *device = pdcp_arb_device(arb, place);
    if (device->reset_asked) {
        device->reset_asked = false;
        pdcp_bus_tell(&arb->bus, PDCP_EVENT_RESET, place, status);
    }
}

/* Takes a device out of service: whoever waits for it learns that it does not answer, its links become
 * inactive, and if it counted, it is lost. */
static void take_down(pdcp_arb_t *arb, uint8_t place)
{
    pdcp_device_entry_t *device = pdcp_arb_device(arb, place);
    device->state = PDCP_PLACE_LOST;
    pdcp_suspend_on_lost(&arb->bus, place);
    pdcp_request_cancel(&arb->bus, place);
    pdcp_link_on_lost(&arb->bus, place);
    pdcp_life_end_reset(arb, place, PDCP_ERR_NO_ANSWER);
    if (arb->host.place == place) {
        pdcp_host_end(&arb->bus, &arb->host, PDCP_ERR_NO_ANSWER);
    }
    if (device->beaconed) {
        device->beaconed = false;
        pdcp_bus_tell_device(&arb->bus, PDCP_EVENT_LOST, place);
    }
}

static void begin_setup(pdcp_arb_t *arb, uint8_t place)
{
    pdcp_device_entry_t *device = pdcp_arb_device(arb, place);
    device->setup_again = false;
    device->heard_ms = arb->bus.now_ms;
    device->taken_back = false;
    pdcp_setup_start(&arb->bus, place);
    pdcp_life_expect(arb, place);
}

/* The device is gone; its ids are kept for it for a while. */
void pdcp_life_lose(pdcp_arb_t *arb, uint8_t place)
{
    pdcp_arb_device(arb, place)->asked_again = false;
    pdcp_life_set(arb, place, PDCP_LOST_KEPT_MS);
    take_down(arb, place);
}

void pdcp_life_after_bind(pdcp_arb_t *arb, uint8_t place, pdcp_bind_result_t result)
{
    if (result != PDCP_BIND_GRANTED) {
        return;
    }
    if (pdcp_arb_device(arb, place)->state != PDCP_PLACE_LOST) {
        take_down(arb, place); /* it was reset: what was known of its channels' state is gone */
    }
    begin_setup(arb, place);
    pdcp_suspend_on_bound(&arb->bus, place);
    if (!pdcp_bind_is_known(&arb->bus, &pdcp_arb_device(arb, place)->identity)) {
        pdcp_life_set(arb, place, PDCP_GHOST_MS);
    }
}

/* A device's place may have become free for its next request: the check of its identity comes first, then the
 * host, then its setup. */
void pdcp_life_serve(pdcp_arb_t *arb, uint8_t place)
{
    pdcp_device_entry_t *device = pdcp_arb_device(arb, place);
    if (!pdcp_request_is_idle(&arb->bus, place)) {
        return;
    }
    if (device->asked_again) {
        pdcp_request_get(&arb->bus, place, PDCP_CLIENT_BIND, 0, PDCP_DEV_VID_PID, PDCP_VALUE_MAX);
        pdcp_request_limit_tries(&arb->bus, place, PDCP_CHECK_TRIES);
        return;
    }
    if (arb->host.waiting && arb->host.place == place) {
        pdcp_host_start(&arb->bus, &arb->host);
        return;
    }
    if (device->reset_asked) {
        pdcp_request_command(&arb->bus, place, PDCP_CLIENT_RESET, PDCP_RESET, 0);
        return;
    }
    if (pdcp_timers_is_set(&arb->bus.timers, (uint8_t)(PDCP_TIMER_REQUEST + place))) {
        return; /* the setup pauses */
    }
    if (device->state == PDCP_PLACE_FAILED) {
        pdcp_setup_start(&arb->bus, place);
    }
    if (device->state == PDCP_PLACE_SETUP) {
        pdcp_setup_ask(&arb->bus, place);
    }
}

/* Tells the device with this id to reset, at most once a second (D-BUS-15, D-BUS-37). It will then bind. */
void pdcp_life_reset_unknown(pdcp_arb_t *arb, uint8_t id)
{
    if (!pdcp_unknown_tell(&arb->bus.unknown, arb->bus.now_ms, id)) {
        return;
    }
    if (pdcp_bus_send_word(&arb->bus, PDCP_PRIORITY_NORMAL, id, PDCP_RESET, 0)) {
        pdcp_bus_count(&arb->bus, PDCP_STAT_UNKNOWN_RESET);
    }
}

/* A first beacon makes the device count; that of a lost device takes it back. */
void pdcp_life_on_first_beacon(pdcp_arb_t *arb, pdcp_device_entry_t *device)
{
    if (device->state == PDCP_PLACE_LOST) {
        begin_setup(arb, device->place); /* reads who it is before anything else (D-BUS-15) */
        device->taken_back = true;
        pdcp_bus_wake(&arb->bus, PDCP_TIMER_RELEASE, PDCP_RELEASE_MS); /* if it was suspended meanwhile */
        pdcp_life_serve(arb, device->place);
    }
    device->beaconed = true;
    pdcp_bus_tell_device(&arb->bus, PDCP_EVENT_BOUND, device->place);
}

/* --- Replies --- */

/* A device that has answered Reset Device is lost until it binds again. */
static void reset_on_reply(pdcp_arb_t *arb, uint8_t place, pdcp_status_t status)
{
    pdcp_life_end_reset(arb, place, status);
    if (status == PDCP_OK) {
        pdcp_life_lose(arb, place);
    }
}

/* The check of a device whose identity has asked again (D-BUS-6): any answer shows that the asking one is
 * another. True: it was reset and is bound afresh; whoever waited for its reply has been told. */
static bool conclude_check(pdcp_arb_t *arb, uint8_t place, pdcp_status_t status)
{
    const bool answered = status != PDCP_ERR_NO_ANSWER;
    const pdcp_bind_result_t result = pdcp_bind_after_check(&arb->bus, place, answered);
    pdcp_life_after_bind(arb, place, result);
    if (!answered && result == PDCP_BIND_SUGGESTED) { /* it was reset: known without a second check */
        pdcp_life_lose(arb, place);
    }
    return !answered;
}

static void setup_on_reply(pdcp_arb_t *arb, uint8_t place, const pdcp_reply_t *reply)
{
    const pdcp_device_entry_t *device = pdcp_arb_device(arb, place);
    if (pdcp_setup_on_reply(&arb->bus, place, reply) ==
        PDCP_ERR_UNKNOWN) { /* another device has this id, too (D-BUS-54) */
        pdcp_life_reset_unknown(arb, device->node_id);
        pdcp_life_lose(arb, place);
        return;
    }
    if (reply->channel == 0 && reply->param == PDCP_DEV_BEACON_INTERVAL) {
        pdcp_life_expect(arb, place);
    }
    if (device->state == PDCP_PLACE_READY) {
        pdcp_bind_on_ready(&arb->bus, device);
        pdcp_link_on_ready(&arb->bus, place);
        pdcp_audit_on_ready(&arb->bus, place);
    } else if (device->state == PDCP_PLACE_FAILED) {
        arb->bus.link.due = true; /* an Update Data Channel may have waited for it */
    }
}

static void host_on_reply(pdcp_arb_t *arb, uint8_t place, const pdcp_reply_t *reply)
{
    const pdcp_host_outcome_t outcome = pdcp_host_on_reply(&arb->bus, &arb->host, reply);
    if (outcome == PDCP_HOST_TIMES) {
        pdcp_life_expect(arb, place);
    } else if (outcome == PDCP_HOST_RESET) {
        pdcp_life_lose(arb, place);
    }
}

/* Hands a reply to whoever asked. */
static void hand_on(pdcp_arb_t *arb, uint8_t place, const pdcp_reply_t *reply)
{
    const pdcp_status_t status = (pdcp_status_t)reply->status;
    switch ((pdcp_client_t)reply->client) {
    case PDCP_CLIENT_SETUP:
        setup_on_reply(arb, place, reply);
        break;
    case PDCP_CLIENT_LINK:
        pdcp_link_on_reply(&arb->bus, reply);
        break;
    case PDCP_CLIENT_RESET:
        reset_on_reply(arb, place, status);
        break;
    case PDCP_CLIENT_AUDIT:
        if (reply->code == PDCP_RELEASE) {
            pdcp_suspend_on_reply(&arb->bus, place, status);
        } else {
            pdcp_audit_on_reply(&arb->bus, reply);
        }
        break;
    case PDCP_CLIENT_HOST:
    case PDCP_CLIENT_RAW:
        host_on_reply(arb, place, reply);
        break;
    default: /* the check of an identity, concluded already */
        break;
    }
}

void pdcp_life_on_reply(pdcp_arb_t *arb, uint8_t place, const pdcp_reply_t *reply)
{
    const pdcp_status_t status = (pdcp_status_t)reply->status;
    /* Silence shows nothing when a question was asked once, or is one that no device need answer
     * (D-BUS-41). */
    const bool counts = status != PDCP_ERR_NO_ANSWER ||
                        (reply->client != PDCP_CLIENT_AUDIT && reply->client != PDCP_CLIENT_RAW);
    if (reply->done && counts && pdcp_arb_device(arb, place)->asked_again &&
        conclude_check(arb, place, status)) {
        return;
    }
    hand_on(arb, place, reply);
}

/* A frame came from a bound id whose identity asks again, and was no answer to the request under way:
 * whatever it says, its owner is alive (D-BUS-23, D-BUS-41). */
void pdcp_life_end_check(pdcp_arb_t *arb, uint8_t place)
{
    if (pdcp_arb_device(arb, place)->request.client == PDCP_CLIENT_BIND) {
        pdcp_request_cancel(&arb->bus, place);
    }
    (void)conclude_check(arb, place, PDCP_OK);
    pdcp_life_serve(arb, place);
}

void pdcp_life_on_request_deadline(pdcp_arb_t *arb, uint8_t place)
{
    pdcp_reply_t reply;
    if (pdcp_request_on_deadline(&arb->bus, place, &reply)) {
        pdcp_life_on_reply(arb, place, &reply);
    }
    pdcp_life_serve(arb, place);
}

/* --- Deadlines --- */

/* A device is gone for good. It may still speak on its ids, where it cannot be heard now: they count as
 * heard (D-BUS-47). */
static void forget(pdcp_arb_t *arb, uint8_t place)
{
    const pdcp_device_entry_t *device = pdcp_arb_device(arb, place);
    pdcp_unknown_note(&arb->bus.unknown, arb->bus.now_ms, device->node_id);
    for (uint8_t c = device->first_channel; c != PDCP_NONE; c = arb->bus.tables.channels[c].next) {
        pdcp_channel_t *channel = &arb->bus.tables.channels[c];
        if (channel->transfer == PDCP_OUTPUT && channel->node_id != 0) {
            pdcp_bind_take_output_id(&arb->bus, channel);
        }
    }
    pdcp_tables_remove(&arb->bus.tables, place);
}

/* Was an identity that is not known granted an id, and is not there (D-BUS-43)? Only its bind request was
 * ever heard. */
static bool is_ghost(const pdcp_arb_t *arb, const pdcp_device_entry_t *device, uint32_t unheard_ms)
{
    return device->state == PDCP_PLACE_SETUP && device->setup_pass == 0 && device->setup_step == 0 &&
           !device->beaconed && !device->asked_again && unheard_ms >= PDCP_GHOST_MS &&
           !pdcp_bind_is_known(&arb->bus, &device->identity);
}

void pdcp_life_on_deadline(pdcp_arb_t *arb, uint8_t place)
{
    pdcp_device_entry_t *device = pdcp_arb_device(arb, place);
    const uint32_t unheard_ms = arb->bus.now_ms - device->heard_ms;
    if (device->state == PDCP_PLACE_LOST) {
        forget(arb, place);
    } else if (is_ghost(arb, device, unheard_ms)) {
        pdcp_request_cancel(&arb->bus, place);
        forget(arb, place);
    } else if (unheard_ms < silence_ms(device)) {
        pdcp_life_set(arb, place, (uint16_t)(silence_ms(device) - unheard_ms));
    } else {
        pdcp_bus_count(&arb->bus, PDCP_STAT_LOST);
        pdcp_life_lose(arb, place);
    }
}
