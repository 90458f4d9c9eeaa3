#include "arb_hostapi.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_time.h"

/* What a handler says: an error code, ARB_OK with a success payload of *len bytes, or that the bus has to
 * speak first. */
enum { PENDING = 0xFF };

typedef struct {
    arb_hostapi_t *api;
    pdcp_arb_t *arb;
    uint32_t now_ms;
    uint8_t *payload; /* of the request */
    uint16_t len;
    uint8_t *answer; /* payload of the success answer */
    uint16_t answer_len;
} call_t;

typedef uint8_t (*handler_t)(call_t *call);

typedef struct {
    uint16_t id;
    uint16_t len_min;
    uint16_t len_max;
    handler_t handler;
} message_t;

void arb_hostapi_init(arb_hostapi_t *api)
{
    memset(api, 0, sizeof *api);
    arb_hostrx_init(&api->rx);
}

/* 2201h: number of devices, inputs, outputs, links [API 3.3.2]. */
static uint8_t system_info(call_t *call)
{
    const pdcp_nodes_t *nodes = &call->arb->bus.nodes;
    call->answer[0] = pdcp_nodes_count_devices(nodes);
    call->answer[1] = pdcp_nodes_count_channels(nodes, PDCP_INPUT);
    call->answer[2] = pdcp_nodes_count_channels(nodes, PDCP_OUTPUT);
    call->answer[3] = pdcp_nodes_count_links(nodes);
    call->answer_len = 4;
    return ARB_OK;
}

static void put_info(call_t *call, const pdcp_identity_t *identity, uint8_t index, uint16_t type,
                     uint16_t profile)
{
    arb_host_put_channel(&call->answer[0], identity, index);
    arb_host_put_u16(&call->answer[7], type);
    arb_host_put_u16(&call->answer[9], profile);
    call->answer_len = 11;
}

/* 2204h [API 3.3.5] */
static uint8_t device_info(call_t *call)
{
    const pdcp_nodes_t *nodes = &call->arb->bus.nodes;
    const uint8_t place = pdcp_nodes_nth_device(nodes, call->payload[0]);
    if (place == PDCP_NONE) {
        return ARB_ERR_NUMBER;
    }
    const pdcp_node_t *node = &nodes->nodes[place];
    put_info(call, &node->identity, 0, node->type, node->profile);
    return ARB_OK;
}

static uint8_t channel_info(call_t *call, uint8_t transfer)
{
    const pdcp_nodes_t *nodes = &call->arb->bus.nodes;
    const uint8_t number = pdcp_nodes_nth_channel(nodes, transfer, call->payload[0]);
    if (number == PDCP_NONE) {
        return ARB_ERR_NUMBER;
    }
    const pdcp_channel_t *channel = &nodes->channels[number];
    put_info(call, &nodes->nodes[channel->node].identity, channel->index, channel->type, channel->profile);
    return ARB_OK;
}

/* 2207h [API 3.3.8] */
static uint8_t input_info(call_t *call)
{
    return channel_info(call, PDCP_INPUT);
}

/* 220Ah [API 3.3.11] */
static uint8_t output_info(call_t *call)
{
    return channel_info(call, PDCP_OUTPUT);
}

/* 220Dh: output, input, status [API 3.3.14] */
static uint8_t link_info(call_t *call)
{
    const pdcp_nodes_t *nodes = &call->arb->bus.nodes;
    const uint8_t number = pdcp_nodes_nth_link(nodes, call->payload[0]);
    if (number == PDCP_NONE) {
        return ARB_ERR_NUMBER;
    }
    const pdcp_channel_t *input = &nodes->channels[number];
    arb_host_put_channel(&call->answer[0], &input->source, input->source_index);
    arb_host_put_channel(&call->answer[7], &nodes->nodes[input->node].identity, input->index);
    call->answer[14] = input->link;
    call->answer_len = 15;
    return ARB_OK;
}

/* Place of the device that six bytes of a request name; PDCP_NONE: it is not on the bus. */
static uint8_t find_device(const call_t *call, const uint8_t *bytes)
{
    const pdcp_identity_t identity = arb_host_get_identity(bytes);
    const pdcp_nodes_t *nodes = &call->arb->bus.nodes;
    const uint8_t place = pdcp_nodes_find(nodes, &identity);
    return place != PDCP_NONE && nodes->nodes[place].state != PDCP_NODE_LOST ? place : PDCP_NONE;
}

static uint8_t error_of(int8_t status)
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
    default:
        return ARB_ERR_NO_ANSWER;
    }
}

/* 2301h and 2304h: dev, channel index, parameter id, and when setting the value [API 3.3.17, 3.3.20].
 * Setting: size is the length of the value. Once started, the bus speaks through PDCP_EVENT_REQUEST. */
static uint8_t parameter(call_t *call, bool set)
{
    arb_hostapi_t *api = call->api;
    if (api->started) {
        call->answer_len = set ? 0 : api->value_len;
        return api->ended ? error_of(api->status) : PENDING;
    }
    const uint8_t place = find_device(call, call->payload);
    const uint8_t channel = call->payload[6];
    const uint8_t param = call->payload[7];
    if (place == PDCP_NONE) {
        return ARB_ERR_DEVICE;
    }
    const pdcp_nodes_t *nodes = &call->arb->bus.nodes;
    if (channel != 0 && nodes->nodes[place].state == PDCP_NODE_READY &&
        pdcp_nodes_channel(nodes, place, channel) == PDCP_NONE) {
        return ARB_ERR_CHANNEL;
    }
    const pdcp_status_t status =
        set ? pdcp_arb_set(call->arb, place, channel, param, &call->payload[8], (uint16_t)(call->len - 8))
            : pdcp_arb_get(call->arb, place, channel, param, call->answer, PDCP_PARAMETER_MAX);
    if (status != PDCP_OK) {
        return ARB_ERR_BUSY;
    }
    api->started = true;
    api->handed = true;
    return PENDING;
}

static uint8_t get_parameter(call_t *call)
{
    return parameter(call, false);
}

static uint8_t set_parameter(call_t *call)
{
    return parameter(call, true);
}

/* Channel number of the seven bytes that name a channel; PDCP_NONE: the device has no such channel of this
 * direction. */
static uint8_t find_channel(const call_t *call, const uint8_t *bytes, uint8_t transfer)
{
    const pdcp_nodes_t *nodes = &call->arb->bus.nodes;
    const uint8_t place = find_device(call, bytes);
    if (place == PDCP_NONE || nodes->nodes[place].state != PDCP_NODE_READY) {
        return PDCP_NONE;
    }
    const uint8_t number = pdcp_nodes_channel(nodes, place, bytes[6]);
    return number != PDCP_NONE && nodes->channels[number].transfer == transfer ? number : PDCP_NONE;
}

/* Waits for a running setup, 2 s at most (D-API-6). */
static uint8_t wait_ready(call_t *call)
{
    arb_hostapi_t *api = call->api;
    if (!api->waiting) {
        api->waiting = true;
        api->until_ms = call->now_ms + ARB_HOST_NOT_READY_MS;
    }
    return pdcp_time_reached(call->now_ms, api->until_ms) ? ARB_ERR_NOT_READY : PENDING;
}

/* 2307h: output channel, input channel [API 3.3.23]. Once started, the bus speaks through PDCP_EVENT_WISH. */
static uint8_t configure_link(call_t *call)
{
    arb_hostapi_t *api = call->api;
    if (api->started) {
        call->answer[0] = PDCP_LINK_ACTIVE;
        call->answer_len = 1;
        return api->ended ? error_of(api->status) : PENDING;
    }
    if (find_device(call, &call->payload[0]) == PDCP_NONE ||
        find_device(call, &call->payload[7]) == PDCP_NONE) {
        return ARB_ERR_DEVICE;
    }
    if (pdcp_arb_setup_running(call->arb)) {
        return wait_ready(call);
    }
    const uint8_t output = find_channel(call, &call->payload[0], PDCP_OUTPUT);
    const uint8_t input = find_channel(call, &call->payload[7], PDCP_INPUT);
    if (output == PDCP_NONE || input == PDCP_NONE) {
        return ARB_ERR_CHANNEL;
    }
    switch (pdcp_arb_connect(call->arb, output, input)) {
    case PDCP_OK:
        api->started = true;
        api->handed = true;
        return PENDING;
    case PDCP_ERR_OWN:
        return ARB_ERR_VALUE;
    default:
        return wait_ready(call);
    }
}

/* [API 3.2]; sizes without CRC16. */
static const message_t messages[] = {
    {ARB_MSG_SYSTEM_INFO, 0, 0, system_info},
    {ARB_MSG_DEVICE_INFO, 1, 1, device_info},
    {ARB_MSG_INPUT_INFO, 1, 1, input_info},
    {ARB_MSG_OUTPUT_INFO, 1, 1, output_info},
    {ARB_MSG_LINK_INFO, 1, 1, link_info},
    {ARB_MSG_GET_PARAMETER, 8, 8, get_parameter},
    {ARB_MSG_SET_PARAMETER, 9, ARB_HOST_REQUEST_MAX, set_parameter},
    {ARB_MSG_CONFIGURE_LINK, 14, 14, configure_link},
};

static const message_t *find_message(uint16_t id)
{
    for (size_t i = 0; i < sizeof messages / sizeof messages[0]; i++) {
        if (messages[i].id == id) {
            return &messages[i];
        }
    }
    return NULL;
}

/* Builds a failure answer, or 2200h for an id that does not exist. Returns its length. */
static uint16_t build_failure(uint8_t *frame, uint16_t id, uint8_t reference, uint8_t error)
{
    if (find_message(id) == NULL) {
        return arb_host_finish(frame, ARB_MSG_UNKNOWN_ID, reference, 0);
    }
    frame[ARB_HOST_HEADER] = error;
    return arb_host_finish(frame, (uint16_t)(id + 2), reference, 1);
}

static bool urgent_has_room(const arb_hostapi_t *api)
{
    return api->urgent_len + ARB_HOST_HEADER + 1 + ARB_HOST_CRC <= ARB_URGENT_BYTES;
}

static void accept(arb_hostapi_t *api, const arb_hostrx_request_t *request)
{
    if (api->held_count == ARB_HELD_MAX || request->len > ARB_HELD_BYTES - api->held_used) {
        uint8_t *frame = &api->urgent[api->urgent_len];
        const uint16_t len = build_failure(frame, request->id, request->reference, ARB_ERR_BUSY);
        api->urgent_len = (uint8_t)(api->urgent_len + len);
        return;
    }
    arb_held_t *held = &api->held[api->held_count++];
    held->id = request->id;
    held->reference = request->reference;
    held->at = api->held_used;
    held->len = request->len;
    held->error = ARB_OK;
    if (request->too_long) {
        held->error = ARB_ERR_SIZE;
    } else if (api->strict && !request->crc_ok) {
        held->error = ARB_ERR_CRC;
    }
    if (request->len != 0) {
        memcpy(&api->held_bytes[held->at], request->payload, request->len);
    }
    api->held_used = (uint16_t)(api->held_used + request->len);
}

static void accept_all(arb_hostapi_t *api)
{
    arb_hostrx_request_t request;
    while (urgent_has_room(api) && arb_hostrx_next(&api->rx, &request)) {
        accept(api, &request);
    }
}

uint16_t arb_hostapi_on_bytes(arb_hostapi_t *api, uint32_t now_ms, const uint8_t *bytes, uint16_t len)
{
    uint16_t taken = 0;
    while (taken < len) {
        accept_all(api);
        if (!urgent_has_room(api)) {
            break;
        }
        arb_hostrx_put(&api->rx, now_ms, bytes[taken++]);
    }
    accept_all(api);
    return taken;
}

void arb_hostapi_on_event(arb_hostapi_t *api, const pdcp_event_t *event)
{
    if (api->started && (event->kind == PDCP_EVENT_REQUEST || event->kind == PDCP_EVENT_WISH)) {
        api->ended = true;
        api->status = event->status;
        api->value_len = event->len;
    }
}

/* Removes the request at the front. */
static void drop_front(arb_hostapi_t *api)
{
    const uint16_t len = api->held[0].len;
    api->held_count--;
    memmove(&api->held[0], &api->held[1], api->held_count * sizeof api->held[0]);
    for (uint8_t i = 0; i < api->held_count; i++) {
        api->held[i].at = (uint16_t)(api->held[i].at - len);
    }
    api->held_used = (uint16_t)(api->held_used - len);
    memmove(&api->held_bytes[0], &api->held_bytes[len], api->held_used);
    api->waiting = false;
    api->started = false;
    api->ended = false;
}

static uint8_t handle(arb_hostapi_t *api, pdcp_arb_t *arb, uint32_t now_ms, uint16_t *answer_len)
{
    const arb_held_t *front = &api->held[0];
    const message_t *message = find_message(front->id);
    if (message == NULL || front->error != ARB_OK) {
        return message == NULL ? (uint8_t)ARB_ERR_SIZE : front->error;
    }
    if (front->len < message->len_min || front->len > message->len_max) {
        return ARB_ERR_SIZE;
    }
    call_t call = {.api = api,
                   .arb = arb,
                   .now_ms = now_ms,
                   .payload = &api->held_bytes[front->at],
                   .len = front->len,
                   .answer = &api->answer[ARB_HOST_HEADER]};
    const uint8_t error = message->handler(&call);
    *answer_len = call.answer_len;
    return error;
}

/* Serves the request at the front. False: it waits for the bus. */
static bool serve(arb_hostapi_t *api, pdcp_arb_t *arb, uint32_t now_ms)
{
    const arb_held_t *front = &api->held[0];
    uint16_t len = 0;
    const uint8_t error = handle(api, arb, now_ms, &len);
    if (error == PENDING) {
        return false;
    }
    if (error == ARB_OK) {
        api->answer_len = arb_host_finish(api->answer, (uint16_t)(front->id + 1), front->reference, len);
    } else {
        api->answer_len = build_failure(api->answer, front->id, front->reference, error);
    }
    api->answer_sent = 0;
    drop_front(api);
    return true;
}

/* Sends what waits: the answer under way first, so that none is torn, then the urgent ones. */
static void flush(arb_hostapi_t *api, const arb_port_t *port)
{
    if (api->answer_len != 0) {
        const uint16_t left = (uint16_t)(api->answer_len - api->answer_sent);
        const size_t written = port->host_write(port->ctx, &api->answer[api->answer_sent], left);
        api->answer_sent = (uint16_t)(api->answer_sent + written);
        if (api->answer_sent < api->answer_len) {
            return;
        }
        api->answer_len = 0;
    }
    if (api->urgent_len != 0) {
        const size_t written = port->host_write(port->ctx, api->urgent, api->urgent_len);
        api->urgent_len = (uint8_t)(api->urgent_len - written);
        memmove(api->urgent, &api->urgent[written], api->urgent_len);
    }
}

bool arb_hostapi_step(arb_hostapi_t *api, pdcp_arb_t *arb, const arb_port_t *port, uint32_t now_ms)
{
    api->handed = false;
    const bool refusing = !urgent_has_room(api);
    if (!refusing) {
        arb_hostrx_on_time(&api->rx, now_ms);
    }
    accept_all(api);
    flush(api, port);
    if (refusing) {
        api->rx.last_ms = now_ms; /* the silence is ours: bytes were not taken */
    }
    while (api->held_count != 0 && api->answer_len == 0 && api->urgent_len == 0 && serve(api, arb, now_ms)) {
        flush(api, port);
    }
    return api->handed;
}

uint32_t arb_hostapi_next_ms(const arb_hostapi_t *api, uint32_t now_ms)
{
    uint32_t next_ms = now_ms + PDCP_TIME_FAR_MS;
    if (arb_hostrx_is_inside(&api->rx)) {
        next_ms = api->rx.last_ms + ARB_HOSTRX_TIMEOUT_MS;
    }
    if (api->waiting && !api->started && pdcp_time_before(api->until_ms, next_ms)) {
        next_ms = api->until_ms;
    }
    return next_ms;
}
