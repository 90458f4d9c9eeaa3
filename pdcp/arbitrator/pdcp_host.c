#include "pdcp_host.h"

#include <string.h>

#include "pdcp_bytes.h"
#include "pdcp_link.h"
#include "pdcp_setup.h"
#include "pdcp_suspend.h"

/* --- Beginning and end --- */

pdcp_status_t pdcp_host_ask(pdcp_bus_t *bus, pdcp_host_request_t *host, uint8_t place, uint8_t channel,
                            uint8_t param, uint8_t *bytes, uint16_t size, uint8_t code)
{
    if (!pdcp_tables_is_bound(&bus->tables, place)) {
        return PDCP_ERR_UNKNOWN;
    }
    if (host->active) {
        return PDCP_ERR_BUSY;
    }
    host->active = true;
    host->waiting = true;
    host->client = PDCP_CLIENT_HOST;
    host->code = code;
    host->place = place;
    host->channel = channel;
    host->param = param;
    host->bytes = bytes;
    host->size = size;
    host->len = 0;
    return PDCP_OK;
}

void pdcp_host_start(pdcp_bus_t *bus, pdcp_host_request_t *host)
{
    host->waiting = false;
    pdcp_timers_cancel(&bus->timers, PDCP_TIMER_HOST);
    pdcp_request_start(bus, host->place, (pdcp_client_t)host->client, host->code, host->channel, host->param,
                       host->bytes, host->size);
}

void pdcp_host_end(pdcp_bus_t *bus, pdcp_host_request_t *host, pdcp_status_t status)
{
    if (!host->active) {
        return;
    }
    host->active = false;
    host->waiting = false;
    const pdcp_event_t event = {.kind = PDCP_EVENT_REQUEST,
                                .place = host->place,
                                .channel = PDCP_NONE,
                                .status = (int8_t)status,
                                .len = host->len};
    bus->on_event(bus->event_ctx, bus->now_ms, &event);
}

/* The transfer is broken off where it is (D-API-16). */
uint8_t pdcp_host_give_up(pdcp_bus_t *bus, pdcp_host_request_t *host)
{
    uint8_t freed = PDCP_NONE;
    if (!host->active) {
        return pdcp_link_give_up_request(bus);
    }
    if (!host->waiting) {
        freed = host->place;
        pdcp_request_cancel(bus, freed);
    }
    pdcp_host_end(bus, host, PDCP_ERR_NO_ANSWER);
    return freed;
}

/* --- Replies --- */

/* The host has written a parameter, which may stand in the tables (D-BUS-25). */
static pdcp_host_outcome_t take_written(pdcp_bus_t *bus, const pdcp_host_request_t *host)
{
    const uint8_t head = host->client == PDCP_CLIENT_RAW ? PDCP_RAW_VALUE : 0;
    if (host->size < head) {
        return PDCP_HOST_NOTHING;
    }
    const uint8_t *value = &host->bytes[head];
    const uint16_t len = (uint16_t)(host->size - head);
    if (host->channel == 0) {
        pdcp_setup_take_time(pdcp_bus_device(bus, host->place), host->param,
                             pdcp_bytes_value_u16(value, len, 0));
        return PDCP_HOST_TIMES;
    }
    const uint8_t channel = pdcp_tables_channel(&bus->tables, host->place, host->channel);
    if (host->param == PDCP_CH_ENABLED && channel != PDCP_NONE && len != 0) {
        bus->tables.channels[channel].enabled = value[0] != 0;
    }
    return PDCP_HOST_NOTHING;
}

static bool has_succeeded(const pdcp_host_request_t *host, const pdcp_reply_t *reply)
{
    const bool is_refused = host->client == PDCP_CLIENT_RAW && reply->len > PDCP_RAW_RESULT &&
                            reply->bytes[PDCP_RAW_RESULT] != PDCP_SUCCESS;
    return reply->status == PDCP_OK && !is_refused;
}

/* What the device has done for the host follows in the tables. */
static pdcp_host_outcome_t follow(pdcp_bus_t *bus, const pdcp_host_request_t *host)
{
    if (host->code == PDCP_SET_PARAMETER) {
        return take_written(bus, host);
    }
    if (host->code == PDCP_SUSPEND || host->code == PDCP_RELEASE) {
        const uint16_t time_ms = host->client == PDCP_CLIENT_RAW
                                     ? pdcp_bytes_value_u16(host->bytes, host->size, PDCP_RAW_TIME)
                                     : host->size;
        pdcp_suspend_on_host(bus, host->place, host->code, time_ms);
    }
    return PDCP_HOST_NOTHING;
}

/* Keeps a piece of the value that was got, or the answer to a frame that was passed through, whole. */
static void keep(pdcp_host_request_t *host, const pdcp_reply_t *reply)
{
    const uint16_t end = (uint16_t)(reply->offset + reply->len);
    const bool is_got = host->code == PDCP_GET_PARAMETER && end <= host->size;
    if (reply->len != 0 && (host->client == PDCP_CLIENT_RAW || is_got)) {
        memcpy(&host->bytes[reply->offset], reply->bytes, reply->len);
        host->len = end;
    }
    if (reply->done && end == 0) {
        host->len = 0; /* a transfer that began anew may have ended empty */
    }
}

pdcp_host_outcome_t pdcp_host_on_reply(pdcp_bus_t *bus, pdcp_host_request_t *host, const pdcp_reply_t *reply)
{
    const bool success = has_succeeded(host, reply);
    const pdcp_host_outcome_t outcome = success ? follow(bus, host) : PDCP_HOST_NOTHING;
    keep(host, reply);
    if (!reply->done) {
        return outcome;
    }
    pdcp_host_end(bus, host, (pdcp_status_t)reply->status);
    if (success && host->code == PDCP_RESET) {
        pdcp_bus_tell_device(bus, PDCP_EVENT_RESET, host->place);
        return PDCP_HOST_RESET;
    }
    return outcome;
}

/* --- Waiting --- */

void pdcp_host_limit_wait(pdcp_bus_t *bus, const pdcp_host_request_t *host)
{
    const bool waits = host->waiting || bus->link.requested_input != PDCP_NONE;
    const bool limited = pdcp_timers_is_set(&bus->timers, PDCP_TIMER_HOST);
    if (waits && !limited) {
        pdcp_bus_wake(bus, PDCP_TIMER_HOST, PDCP_HOST_WAIT_MS);
    } else if (!waits && limited) {
        pdcp_timers_cancel(&bus->timers, PDCP_TIMER_HOST);
    }
}

/* What has had no turn by now ends as busy (D-API-10). */
void pdcp_host_on_deadline(pdcp_bus_t *bus, pdcp_host_request_t *host)
{
    if (host->waiting) {
        pdcp_host_end(bus, host, PDCP_ERR_BUSY);
    }
    pdcp_link_forget_request(bus, PDCP_ERR_BUSY);
}
