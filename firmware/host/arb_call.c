#include "arb_call.h"

#include "pdcp_bytes.h"
#include "pdcp_time.h"
#include "profile_channel.h"

uint8_t arb_call_started(arb_call_t *call)
{
    call->api->turn.started = true;
    call->api->handed = true;
    return ARB_PENDING;
}

bool arb_call_wait(arb_call_t *call, uint16_t limit_ms)
{
    arb_turn_t *turn = &call->api->turn;
    const uint32_t until_ms = turn->since_ms + limit_ms;
    if (pdcp_time_reached(call->now_ms, until_ms)) {
        return false;
    }
    turn->until_ms = until_ms;
    return true;
}

/* A request is given up 3 s after its first call (D-API-16). */
uint8_t arb_call_outcome(arb_call_t *call)
{
    const arb_turn_t *turn = &call->api->turn;
    if (!turn->ended && !arb_call_wait(call, ARB_HOST_ANSWER_MS)) {
        pdcp_arb_give_up(call->arb, call->now_ms); /* its event ends the turn */
    }
    call->answer_len = turn->value_len;
    return turn->ended ? arb_call_error(turn->status) : (uint8_t)ARB_PENDING;
}

/* Waits 2 s at most (D-API-6). */
uint8_t arb_call_wait_ready(arb_call_t *call)
{
    return arb_call_wait(call, ARB_HOST_NOT_READY_MS) ? ARB_PENDING : ARB_ERR_NOT_READY;
}

uint8_t arb_call_device(const arb_call_t *call, const uint8_t *bytes)
{
    const pdcp_identity_t identity = pdcp_bytes_get_identity(bytes);
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    const uint8_t place = pdcp_tables_find(tables, &identity);
    return pdcp_tables_is_bound(tables, place) ? place : (uint8_t)PDCP_NONE;
}

uint8_t arb_call_channel(const arb_call_t *call, uint8_t end, uint8_t transfer)
{
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    const uint8_t number =
        pdcp_tables_channel(tables, call->place[end], call->payload[ARB_CHANNEL_BYTES * end + ARB_AT_INDEX]);
    return profile_channel_is_ready(tables, number, transfer) ? number : PDCP_NONE;
}

/* What the host is told (D-API-4). */
uint8_t arb_call_error(int8_t status)
{
    switch (status) {
    case PDCP_OK:
        return ARB_OK;
    case PDCP_ERR_REFUSED:
        return ARB_ERR_REFUSED;
    case PDCP_ERR_BULK:
        return ARB_ERR_BULK;
    case PDCP_ERR_BUSY:
        return ARB_ERR_BUSY;
    case PDCP_ERR_SOLE:
        return ARB_ERR_SOLE_ACCESS;
    default:
        return ARB_ERR_NO_ANSWER;
    }
}
