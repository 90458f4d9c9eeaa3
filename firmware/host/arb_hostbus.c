/* Messages 2201h to 230Dh [API 3.3]. */
#include <string.h>

#include "arb_call.h"
#include "arb_error.h"
#include "pdcp_bytes.h"
#include "pdcp_time.h"

enum { PASSTHROUGH = ARB_AT_DATA + CAN_FRAME_DATA_MAX }; /* bytes of the payload */

/* 2201h: number of devices, inputs, outputs, links [API 3.3.2]. */
uint8_t arb_hostbus_system_info(arb_call_t *call)
{
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    uint8_t *answer = call->answer;
    answer[0] = pdcp_tables_count_devices(tables);
    answer[1] = pdcp_tables_count_channels(tables, PDCP_INPUT);
    answer[2] = pdcp_tables_count_channels(tables, PDCP_OUTPUT);
    answer[3] = pdcp_tables_count_links(tables);
    call->answer_len = 4;
    return ARB_OK;
}

static void put_info(arb_call_t *call, const pdcp_identity_t *identity, uint8_t index, uint16_t type,
                     uint16_t profile)
{
    arb_hostcodec_put_channel(&call->answer[0], identity, index);
    pdcp_bytes_put_u16(&call->answer[ARB_CHANNEL_BYTES], type);
    pdcp_bytes_put_u16(&call->answer[ARB_CHANNEL_BYTES + 2], profile);
    call->answer_len = ARB_INFO_BYTES;
}

/* 2204h [API 3.3.5] */
uint8_t arb_hostbus_device_info(arb_call_t *call)
{
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    const uint8_t place = pdcp_tables_nth_device(tables, call->payload[0]);
    if (place == PDCP_NONE) {
        return ARB_ERR_NUMBER;
    }
    const pdcp_device_entry_t *device = &tables->devices[place];
    put_info(call, &device->identity, 0, device->type, device->profile);
    return ARB_OK;
}

static uint8_t channel_info(arb_call_t *call, uint8_t transfer)
{
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    const uint8_t number = pdcp_tables_nth_channel(tables, transfer, call->payload[0]);
    if (number == PDCP_NONE) {
        return ARB_ERR_NUMBER;
    }
    const pdcp_channel_t *channel = &tables->channels[number];
    put_info(call, &tables->devices[channel->place].identity, channel->index, channel->type,
             channel->profile);
    return ARB_OK;
}

/* 2207h [API 3.3.8] */
uint8_t arb_hostbus_input_info(arb_call_t *call)
{
    return channel_info(call, PDCP_INPUT);
}

/* 220Ah [API 3.3.11] */
uint8_t arb_hostbus_output_info(arb_call_t *call)
{
    return channel_info(call, PDCP_OUTPUT);
}

/* 220Dh: output, input, status [API 3.3.14] */
uint8_t arb_hostbus_link_info(arb_call_t *call)
{
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    const uint8_t number = pdcp_tables_nth_link(tables, call->payload[0]);
    if (number == PDCP_NONE) {
        return ARB_ERR_NUMBER;
    }
    arb_hostcodec_put_link(call->answer, tables, &tables->channels[number]);
    call->answer_len = ARB_LINK_BYTES;
    return ARB_OK;
}

/* Does the arbitrator itself decide what stands in this parameter: node ids and the sources of inputs? A
 * host's own value there would make two devices one, or a link that the tables do not know (D-API-11). */
static bool is_arbitrators(const arb_call_t *call, uint8_t index, uint8_t param)
{
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    if (index == 0) {
        return param == PDCP_DEV_NODE_ID;
    }
    const uint8_t number = pdcp_tables_channel(tables, call->place[0], index);
    if (number != PDCP_NONE && tables->channels[number].transfer == PDCP_OUTPUT) {
        return param == PDCP_OUT_NODE_ID;
    }
    const bool is_linked = number == PDCP_NONE || tables->channels[number].link != PDCP_LINK_NONE;
    return param >= PDCP_IN_SOURCE_VID_PID && param <= PDCP_IN_SOURCE_TYPE &&
           (is_linked || param == PDCP_IN_SOURCE_NODES);
}

/* 2301h and 2304h: dev, channel index, parameter id, and when setting the value [API 3.3.17, 3.3.20]. Once
 * started, the bus speaks through PDCP_EVENT_REQUEST. */
static uint8_t parameter(arb_call_t *call, bool set)
{
    if (call->api->turn.started) {
        return arb_call_outcome(call);
    }
    const uint8_t place = call->place[0];
    const uint8_t channel = call->payload[ARB_AT_INDEX];
    const uint8_t param = call->payload[ARB_AT_PARAM];
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    if (channel != 0 && tables->devices[place].state == PDCP_PLACE_READY &&
        pdcp_tables_channel(tables, place, channel) == PDCP_NONE) {
        return ARB_ERR_CHANNEL;
    }
    if (set && is_arbitrators(call, channel, param)) {
        return ARB_ERR_NOT_SUPPORTED;
    }
    const pdcp_status_t status =
        set ? pdcp_arb_set(call->arb, place, channel, param, &call->payload[ARB_AT_VALUE],
                           (uint16_t)(call->len - ARB_AT_VALUE))
            : pdcp_arb_get(call->arb, place, channel, param, call->answer, PDCP_PARAMETER_MAX);
    return status == PDCP_OK ? arb_call_started(call) : ARB_ERR_BUSY;
}

uint8_t arb_hostbus_get_parameter(arb_call_t *call)
{
    return parameter(call, false);
}

uint8_t arb_hostbus_set_parameter(arb_call_t *call)
{
    return parameter(call, true);
}

/* Why there is no link to be made: an output whose device could not be set up because all node ids are given
 * out is one without a node id (D-API-13). */
static uint8_t error_of_ends(const arb_call_t *call)
{
    const pdcp_tables_t *tables = &call->arb->bus.tables;
    const uint8_t number = pdcp_tables_channel(tables, call->place[0], call->payload[ARB_AT_INDEX]);
    if (number != PDCP_NONE && tables->channels[number].transfer == PDCP_OUTPUT &&
        tables->channels[number].node_id == 0) {
        return ARB_ERR_NO_NODE_ID;
    }
    return ARB_ERR_CHANNEL;
}

/* 2307h: output channel, input channel [API 3.3.23]. Once started, the bus speaks through
 * PDCP_EVENT_LINK_REQUEST. */
uint8_t arb_hostbus_configure_link(arb_call_t *call)
{
    if (call->api->turn.started) {
        const uint8_t error = arb_call_outcome(call);
        call->answer[0] = PDCP_LINK_ACTIVE;
        call->answer_len = 1;
        return error;
    }
    const uint8_t output = arb_call_channel(call, 0, PDCP_OUTPUT);
    const uint8_t input = arb_call_channel(call, 1, PDCP_INPUT);
    if (output == PDCP_NONE || input == PDCP_NONE) {
        return error_of_ends(call);
    }
    if (call->place[0] == call->place[1]) {
        return ARB_ERR_VALUE;
    }
    const pdcp_status_t status = pdcp_arb_connect_sole(call->arb, output, input);
    if (status == PDCP_ERR_SOLE) {
        return ARB_ERR_SOLE_ACCESS;
    }
    return status == PDCP_OK ? arb_call_started(call) : arb_call_wait_ready(call);
}

/* To all devices: Suspend (with its time) or Release only [PDCP 3.2.4, 3.2.5] (D-API-11). */
static uint8_t broadcast(arb_call_t *call, uint8_t dlc, const uint8_t *data)
{
    const uint8_t code = data[PDCP_RAW_CODE];
    if (code != PDCP_SUSPEND && code != PDCP_RELEASE) {
        return ARB_ERR_NOT_SUPPORTED;
    }
    if (dlc != (code == PDCP_SUSPEND ? 3 : 1)) {
        return ARB_ERR_VALUE;
    }
    if (pdcp_arb_is_on_standby(call->arb)) {
        return ARB_ERR_NOT_READY;
    }
    if (!pdcp_arb_broadcast(call->arb, code,
                            pdcp_bytes_get_u16(&data[PDCP_RAW_TIME]))) { /* Release has no time */
        return ARB_ERR_BUSY;
    }
    call->api->handed = true;
    call->answer_len = PASSTHROUGH;
    return ARB_OK;
}

/* What a host may pass through: requests that a device answers, whose answer means nothing to the arbitrator
 * or is followed by it. Not binding, deprecated codes, beacons, bulk transfers (2301h and 2304h make them by
 * themselves) and answers (D-API-11). */
static bool may_pass(uint8_t code)
{
    switch (code) {
    case PDCP_GET_PARAMETER:
    case PDCP_SET_PARAMETER:
    case PDCP_SUSPEND:
    case PDCP_RELEASE:
    case PDCP_RESET:
        return true;
    default:
        return code > PDCP_UPDATE_CHANNEL && code < PDCP_ANSWER;
    }
}

/* 230Ah: dev, DLC, 8 data bytes [API 3.3.26]. Once started, the bus speaks through PDCP_EVENT_REQUEST. */
uint8_t arb_hostbus_passthrough(arb_call_t *call)
{
    static const uint8_t all[PDCP_BYTES_IDENTITY];
    if (call->api->turn.started) {
        const uint8_t error = arb_call_outcome(call);
        if (error == ARB_PENDING) {
            return error; /* what is to be sent stands in the answer */
        }
        call->answer[ARB_AT_DLC] = (uint8_t)call->answer_len;
        memset(&call->answer[ARB_AT_DATA + call->answer_len], 0, CAN_FRAME_DATA_MAX - call->answer_len);
        call->answer_len = PASSTHROUGH;
        return error;
    }
    const uint8_t dlc = call->payload[ARB_AT_DLC];
    const uint8_t *data = &call->payload[ARB_AT_DATA];
    if (dlc == 0 || dlc > CAN_FRAME_DATA_MAX) {
        return ARB_ERR_SIZE;
    }
    memcpy(call->answer, call->payload, PASSTHROUGH);
    if (memcmp(call->payload, all, sizeof all) == 0) {
        return broadcast(call, dlc, data);
    }
    call->place[0] = arb_call_device(call, call->payload);
    if (call->place[0] == PDCP_NONE) {
        return ARB_ERR_DEVICE;
    }
    if (!may_pass(data[PDCP_RAW_CODE]) ||
        (data[PDCP_RAW_CODE] == PDCP_SET_PARAMETER && dlc > PDCP_RAW_CHANNEL &&
         is_arbitrators(call, data[PDCP_RAW_CHANNEL], data[PDCP_RAW_PARAM]))) {
        return ARB_ERR_NOT_SUPPORTED;
    }
    const pdcp_status_t status =
        pdcp_arb_passthrough(call->arb, call->place[0], &call->answer[ARB_AT_DATA], dlc);
    return status == PDCP_OK ? arb_call_started(call) : (uint8_t)ARB_ERR_BUSY;
}

static void start_resets(arb_call_t *call, uint8_t first, uint8_t last)
{
    arb_turn_t *turn = &call->api->turn;
    for (uint8_t number = first; number <= last; number++) {
        const uint8_t place = pdcp_tables_nth_device(&call->arb->bus.tables, number);
        pdcp_bit_set(turn->asked, place, true);
        turn->open++;
        (void)pdcp_arb_reset(call->arb, call->now_ms, place);
    }
}

/* D-API-12: devices have the numbers that they had when the request came, and only those that were reset
 * have their bit. */
static void put_results(arb_call_t *call)
{
    const arb_turn_t *turn = &call->api->turn;
    uint8_t number = call->payload[0] == 0 ? 0 : (uint8_t)(call->payload[0] - 1);
    memset(call->answer, 0, ARB_RESET_RESULTS);
    call->answer_len = ARB_RESET_RESULTS;
    for (uint8_t place = 0; place < PDCP_DEVICES_MAX; place++) {
        if (pdcp_bit(turn->asked, place)) {
            pdcp_bit_set(call->answer, number, pdcp_bit(turn->reset, place));
            number++;
        }
    }
}

/* 230Dh: 0 for all devices, else the number of one [API 3.3.29]. The bus speaks through PDCP_EVENT_RESET,
 * once for each. A device that is busy otherwise for too long is not reset. */
uint8_t arb_hostbus_reset(arb_call_t *call)
{
    const arb_turn_t *turn = &call->api->turn;
    if (!turn->started) {
        const uint8_t count = pdcp_tables_count_devices(&call->arb->bus.tables);
        const uint8_t number = call->payload[0];
        if (number > count) {
            return ARB_ERR_NUMBER;
        }
        (void)arb_call_started(call);
        start_resets(call, number == 0 ? 1 : number, number == 0 ? count : number);
    }
    if (!arb_call_wait(call, PDCP_HOST_WAIT_MS)) {
        pdcp_arb_withdraw_resets(call->arb, call->now_ms);
    }
    if (turn->open != 0) {
        return ARB_PENDING;
    }
    if (memcmp(turn->asked, turn->reset, sizeof turn->asked) == 0) {
        return ARB_OK;
    }
    put_results(call);
    return ARB_ERR_NO_ANSWER;
}

/* Link requests and links may also be the planner's; the other events come only of what the host has asked
 * for. */
void arb_hostbus_on_event(arb_hostapi_t *api, const pdcp_event_t *event)
{
    arb_turn_t *turn = &api->turn;
    const uint16_t id = api->held[0].id;
    if (event->kind == PDCP_EVENT_REQUEST ||
        (event->kind == PDCP_EVENT_LINK_REQUEST && id == ARB_MSG_CONFIGURE_LINK)) {
        turn->ended = true;
        turn->status = event->status;
        turn->value_len = event->len;
    } else if (event->kind == PDCP_EVENT_LINK && id == ARB_MSG_REMOVE_LINK &&
               event->channel == turn->channel) {
        turn->status = event->status;
    } else if (event->kind == PDCP_EVENT_RESET) {
        turn->open--;
        pdcp_bit_set(turn->reset, event->place, event->status == PDCP_OK);
    } else if (event->kind == PDCP_EVENT_SILENT) {
        turn->open = 0; /* all devices are forgotten */
    }
}
