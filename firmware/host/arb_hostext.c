/* Messages 2401h to 2416h (D-API-5). */
#include "arb_hostext.h"

#include <string.h>

#include "arb_call.h"
#include "arb_error.h"
#include "arb_version.h"
#include "pdcp_bytes.h"
#include "profile_channel.h"

/* 2401h */
uint8_t arb_hostext_arbitrator_info(arb_call_t *call)
{
    static const uint8_t constants[] = {ARB_VERSION_PROTOCOL, ARB_VERSION_MAJOR, ARB_VERSION_MINOR,
                                        ARB_VERSION_PATCH,    PDCP_DEVICES_MAX,  PDCP_CHANNELS_MAX,
                                        PDCP_CHANNELS_MAX /* every input may have a link */};
    const arb_limb_t *limb = call->env->limb;
    uint8_t *answer = call->answer;
    memcpy(answer, constants, sizeof constants);
    answer[7] = arb_limb_state(limb);
    answer[8] = limb->active;
    answer[9] = limb->config.stored;
    answer[10] = arb_limb_flags(limb);
    if (call->api->events.mask != 0) {
        answer[10] |= ARB_FLAG_EVENTS;
    }
    call->answer_len = 11;
    return ARB_OK;
}

/* 2404h: flags; the event stream has a message of its own. Bits without a meaning are refused (D-API-13). */
uint8_t arb_hostext_set_flags(arb_call_t *call)
{
    const uint8_t flags = call->payload[0];
    if ((flags & ~(ARB_FLAGS_STORED | ARB_FLAG_EVENTS)) != 0) {
        return ARB_ERR_VALUE;
    }
    arb_limb_set_flags(call->env->limb, call->now_ms, flags);
    call->api->strict = (flags & ARB_FLAG_STRICT_CRC) != 0;
    call->api->handed = true;
    return ARB_OK;
}

/* 2407h: action, argument. One that takes too long goes on without the host (D-API-13). */
uint8_t arb_hostext_action(arb_call_t *call)
{
    arb_limb_t *limb = call->env->limb;
    uint8_t error;
    uint16_t result;
    if (call->api->turn.started) {
        if (!arb_limb_take_outcome(limb, &error, &result)) {
            return arb_call_wait(call, ARB_HOST_ANSWER_MS) ? ARB_PENDING : ARB_ERR_BUSY;
        }
        pdcp_bytes_put_u16(call->answer, result);
        call->answer_len = 2;
        return error;
    }
    if (arb_limb_is_starting(limb)) {
        return arb_call_wait_ready(call);
    }
    error = arb_limb_act(limb, call->payload[0], call->payload[1]);
    if (error == ARB_ERR_BUSY) {
        return arb_call_wait_ready(call);
    }
    return error == ARB_OK ? arb_call_started(call) : error;
}

static uint8_t error_of_config(arb_call_t *call, int8_t status)
{
    if (status == ARB_CONFIG_ERR_BUSY) { /* a plan reads or saves */
        return arb_call_wait(call, ARB_HOST_NOT_READY_MS) ? ARB_PENDING : ARB_ERR_BUSY;
    }
    return arb_limb_error((arb_config_status_t)status);
}

/* 240Ah: offset, length. Read in pieces, a step each: the bus goes on between them. */
uint8_t arb_hostext_read_configs(arb_call_t *call)
{
    arb_turn_t *turn = &call->api->turn;
    arb_config_t *config = &call->env->limb->config;
    const uint16_t offset = pdcp_bytes_get_u16(&call->payload[ARB_AT_OFFSET]);
    const uint8_t len = call->payload[ARB_AT_LENGTH];
    uint8_t piece = (uint8_t)(len - turn->value_len);
    if (len > ARB_CONFIG_RAW_MAX) {
        return ARB_ERR_VALUE;
    }
    const arb_config_status_t status =
        arb_config_read_raw(config, call->env->nvm, (uint16_t)(offset + turn->value_len),
                            &call->answer[ARB_AT_PIECE + turn->value_len], &piece);
    if (status == ARB_CONFIG_ERR_BUSY && turn->value_len != 0) { /* it may become another string */
        turn->value_len = 0;
        turn->since_ms = call->now_ms;
    }
    if (status != ARB_CONFIG_OK) {
        return error_of_config(call, (int8_t)status);
    }
    turn->value_len = (uint16_t)(turn->value_len + piece);
    if (piece == ARB_CONFIG_READ_MAX && turn->value_len < len) {
        turn->until_ms = call->now_ms; /* called again with the next step, which is due at once */
        return ARB_PENDING;
    }
    pdcp_bytes_put_u16(&call->answer[0], arb_config_length(config));
    pdcp_bytes_put_u16(&call->answer[2], offset);
    call->answer_len = (uint16_t)(ARB_AT_PIECE + turn->value_len);
    return ARB_OK;
}

/* 240Dh: offset, total length, bytes. Each piece is a job of the storage, the last one that of the whole
 * string. */
uint8_t arb_hostext_write_configs(arb_call_t *call)
{
    arb_limb_t *limb = call->env->limb;
    arb_config_t *config = &limb->config;
    const uint16_t offset = pdcp_bytes_get_u16(&call->payload[ARB_AT_OFFSET]);
    const uint16_t total = pdcp_bytes_get_u16(&call->payload[ARB_AT_LENGTH]);
    const uint16_t len = (uint16_t)(call->len - ARB_AT_PIECE);
    if (!call->api->turn.started) {
        const arb_config_status_t status =
            arb_config_write_raw(config, offset, total, &call->payload[ARB_AT_PIECE], len);
        return status == ARB_CONFIG_OK ? arb_call_started(call) : error_of_config(call, (int8_t)status);
    }
    if (config->raw_status == ARB_CONFIG_RUNNING) {
        return ARB_PENDING;
    }
    if (config->raw_status >= 0 && (uint16_t)(total - offset) == len) {
        arb_limb_on_written(limb, call->arb);
    }
    return error_of_config(call, config->raw_status);
}

/* 2410h: input channel. The outcome is seen in the tables: a job before it may tell of the same link. */
uint8_t arb_hostext_remove_link(arb_call_t *call)
{
    arb_turn_t *turn = &call->api->turn;
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    if (turn->started) {
        if (!profile_channel_is_ready(tables, turn->channel, PDCP_INPUT) ||
            !arb_call_wait(call, ARB_HOST_ANSWER_MS)) {
            return ARB_ERR_NO_ANSWER;
        }
        return tables->channels[turn->channel].link == PDCP_LINK_NONE ? arb_call_error(turn->status)
                                                                      : ARB_PENDING;
    }
    turn->channel = arb_call_channel(call, 0, PDCP_INPUT);
    if (turn->channel == PDCP_NONE) {
        return ARB_ERR_CHANNEL;
    }
    if (!pdcp_arb_disconnect(call->arb, turn->channel)) {
        return ARB_OK; /* like a link that is made twice (D-API-13) */
    }
    return arb_call_started(call);
}

static void put_counter(arb_call_t *call, uint32_t value)
{
    pdcp_bytes_put_u32(&call->answer[call->answer_len], value);
    call->answer_len = (uint16_t)(call->answer_len + 4);
}

static void put_counters(arb_call_t *call, const uint32_t *values, uint8_t count)
{
    for (; count > 0; count--) {
        put_counter(call, *values++);
    }
}

/* Group 1 has the requests in front of what hostrx counts, those that failed behind it: an enumeration in
 * another order, or with one more, does not compile. */
typedef char arb_hostext_group_1[ARB_HOSTAPI_RECEIVED == 0 && ARB_HOSTAPI_SENT == 1 &&
                                         ARB_HOSTAPI_REQUESTS == 2 && ARB_HOSTAPI_BUSY == 3 &&
                                         ARB_HOSTAPI_UNKNOWN == 4 && ARB_HOSTAPI_COUNTERS == 5
                                     ? 1
                                     : -1];

static void put_host_counters(arb_call_t *call)
{
    const arb_hostapi_t *api = call->api;
    put_counters(call, &api->counters[ARB_HOSTAPI_RECEIVED], ARB_HOSTAPI_BUSY - ARB_HOSTAPI_RECEIVED);
    put_counters(call, api->rx.counters, ARB_HOSTRX_COUNTERS);
    put_counters(call, &api->counters[ARB_HOSTAPI_BUSY], ARB_HOSTAPI_COUNTERS - ARB_HOSTAPI_BUSY);
    put_counters(call, api->events.counters, 1 + ARB_EVENT_KINDS);
}

/* Group 3: what the drivers have lost, 0 where they cannot know it (D-API-18). */
static void put_driver_counters(arb_call_t *call)
{
    const arb_port_t *port = call->env->port;
    for (uint8_t i = 0; i < (uint8_t)ARB_PORT_COUNTERS; i++) {
        put_counter(call, port->counter != NULL ? port->counter(port->ctx, (arb_port_counter_t)i) : 0);
    }
}

static void put_storage_counters(arb_call_t *call)
{
    const arb_store_t *store = call->env->store;
    const arb_limb_t *limb = call->env->limb;
    put_counter(call, store->failures);
    put_counter(call, store->damaged);
    put_counter(call, limb->flags.failures);
    put_counter(call, limb->flags.damaged);
    put_counters(call, limb->config.counters, ARB_CONFIG_COUNTERS);
}

/* 2413h: group. */
uint8_t arb_hostext_statistics(arb_call_t *call)
{
    call->answer[0] = call->payload[0];
    call->answer_len = 1;
    switch (call->payload[0]) {
    case ARB_STATS_BUS:
        put_counters(call, call->arb->bus.stats, PDCP_STAT_COUNT);
        return ARB_OK;
    case ARB_STATS_HOST:
        put_host_counters(call);
        return ARB_OK;
    case ARB_STATS_STORAGE:
        put_storage_counters(call);
        return ARB_OK;
    case ARB_STATS_DRIVERS:
        put_driver_counters(call);
        return ARB_OK;
    default:
        return ARB_ERR_NUMBER;
    }
}

/* 2416h: a mask of 8 or 16 bits (D-API-20). */
uint8_t arb_hostext_event_stream(arb_call_t *call)
{
    if (call->len > 2) {
        return ARB_ERR_SIZE;
    }
    const uint16_t mask = call->len == 2 ? pdcp_bytes_get_u16(call->payload) : call->payload[0];
    if ((mask & ~ARB_EVENT_MASK) != 0) {
        return ARB_ERR_VALUE;
    }
    arb_hostevents_set_mask(&call->api->events, mask);
    return ARB_OK;
}
