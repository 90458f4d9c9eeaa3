#include "pdcp_request.h"

#include <string.h>

#include "pdcp_assert.h"
#include "pdcp_bytes.h"

bool pdcp_request_is_idle(pdcp_bus_t *bus, uint8_t place)
{
    return pdcp_bus_device(bus, place)->request.state == PDCP_REQUEST_IDLE;
}

static bool is_parameter(const pdcp_request_t *request)
{
    return request->code == PDCP_GET_PARAMETER || request->code == PDCP_SET_PARAMETER;
}

/* The message that is sent in the request's state and whose answer it waits for; 0: none. */
static uint8_t code_of(const pdcp_request_t *request)
{
    static const uint8_t codes[PDCP_REQUEST_STATES] = {
        [PDCP_REQUEST_GET_SIZE] = PDCP_BULK_GET,
        [PDCP_REQUEST_SET_SIZE] = PDCP_BULK_SET,
        [PDCP_REQUEST_SET_DATA] = PDCP_BULK_DATA,
        [PDCP_REQUEST_SET_ECHO] = PDCP_BULK_DATA,
    };
    return request->state == PDCP_REQUEST_ANSWER ? request->code : codes[request->state];
}

static uint8_t packet_len(const pdcp_request_t *request)
{
    const uint16_t left = (uint16_t)(request->size - request->offset);
    return (uint8_t)(left < PDCP_BULK_PACKET_MAX ? left : PDCP_BULK_PACKET_MAX);
}

static void send_raw(pdcp_bus_t *bus, const pdcp_device_entry_t *device)
{
    const pdcp_request_t *request = &device->request;
    can_frame_t frame = {.id = pdcp_can_id(PDCP_PRIORITY_NORMAL, true, device->node_id),
                         .dlc = (uint8_t)request->size};
    memcpy(frame.data, request->bytes, frame.dlc);
    (void)pdcp_bus_send_frame(bus, &frame);
}

/* The codec takes what belongs to the message. */
static void send_message(pdcp_bus_t *bus, const pdcp_device_entry_t *device)
{
    const pdcp_request_t *request = &device->request;
    pdcp_msg_t msg = {.code = code_of(request),
                      .param = request->param,
                      .channel = request->channel,
                      .packet_id = request->packet_id,
                      .word = request->size};
    if (request->bytes != NULL) {
        msg.len = packet_len(request);
        memcpy(msg.value, &request->bytes[request->offset], msg.len);
    }
    (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, device->node_id, &msg);
}

static void wait_for_answer(pdcp_bus_t *bus, const pdcp_device_entry_t *device)
{
    pdcp_bus_wake(bus, (uint8_t)(PDCP_TIMER_REQUEST + device->place), device->ack_ms);
}

/* Sends what the state asks for and waits for its answer. A frame that finds no room is repeated at the
 * deadline, like one that got lost on the way. */
static void send(pdcp_bus_t *bus, const pdcp_device_entry_t *device)
{
    if (device->request.state == PDCP_REQUEST_RAW) {
        send_raw(bus, device);
    } else if (device->request.state != PDCP_REQUEST_GET_DATA) { /* there the device sends by itself */
        send_message(bus, device);
    }
    wait_for_answer(bus, device);
}

static void enter(pdcp_bus_t *bus, pdcp_device_entry_t *device, pdcp_request_state_t state)
{
    device->request.state = (uint8_t)state;
    device->request.tries_left = PDCP_TRIES - 1;
    send(bus, device);
}

/* From its beginning, also once more. */
static void start_bulk(pdcp_bus_t *bus, pdcp_device_entry_t *device)
{
    device->request.offset = 0;
    device->request.packet_id = 0;
    enter(bus, device,
          device->request.code == PDCP_GET_PARAMETER ? PDCP_REQUEST_GET_SIZE : PDCP_REQUEST_SET_SIZE);
}

void pdcp_request_start(pdcp_bus_t *bus, uint8_t place, pdcp_client_t client, uint8_t code, uint8_t channel,
                        uint8_t param, const uint8_t *bytes, uint16_t size)
{
    pdcp_device_entry_t *device = pdcp_bus_device(bus, place);
    pdcp_request_t *request = &device->request;
    pdcp_assert(request->state == PDCP_REQUEST_IDLE, "pdcp_request.h: the place is idle");
    pdcp_assert(client != PDCP_CLIENT_RAW || (size != 0 && size <= CAN_FRAME_DATA_MAX && code < PDCP_ANSWER),
                "pdcp_request.h: a raw request is a frame with the code of a request");
    memset(request, 0, sizeof *request);
    request->bytes = bytes;
    request->size = size;
    request->max_size = size;
    request->client = (uint8_t)client;
    request->code = code;
    request->param = param;
    request->channel = channel;
    request->restarts_left = PDCP_BULK_RESTARTS;
    pdcp_bus_count(bus, PDCP_STAT_REQUESTS);
    if (client == PDCP_CLIENT_RAW) {
        enter(bus, device, PDCP_REQUEST_RAW);
        return;
    }
    if (code == PDCP_SET_PARAMETER) {
        if (size > PDCP_VALUE_MAX) {
            start_bulk(bus, device);
            return;
        }
        memcpy(request->value, bytes, size);
        request->bytes = request->value;
    }
    enter(bus, device, PDCP_REQUEST_ANSWER);
}

void pdcp_request_limit_tries(pdcp_bus_t *bus, uint8_t place, uint8_t tries)
{
    pdcp_bus_device(bus, place)->request.tries_left = (uint8_t)(tries - 1u);
}

void pdcp_request_cancel(pdcp_bus_t *bus, uint8_t place)
{
    pdcp_bus_device(bus, place)->request.state = PDCP_REQUEST_IDLE;
    pdcp_timers_cancel(&bus->timers, (uint8_t)(PDCP_TIMER_REQUEST + place));
}

static void reply_head(const pdcp_request_t *request, pdcp_reply_t *reply, const uint8_t *bytes, uint8_t len)
{
    memset(reply, 0, sizeof *reply);
    reply->client = request->client;
    reply->code = request->code;
    reply->param = request->param;
    reply->channel = request->channel;
    reply->offset = request->offset;
    reply->bytes = bytes;
    reply->len = len;
}

static bool finish(pdcp_bus_t *bus, pdcp_device_entry_t *device, pdcp_status_t status, pdcp_reply_t *reply)
{
    reply->done = true;
    reply->status = (int8_t)status;
    device->request.got_bulk = device->request.state == PDCP_REQUEST_GET_DATA;
    pdcp_request_cancel(bus, device->place);
    return true;
}

static bool restart_bulk(pdcp_bus_t *bus, pdcp_device_entry_t *device, pdcp_reply_t *reply)
{
    if (device->request.restarts_left == 0) {
        return finish(bus, device, PDCP_ERR_BULK, reply);
    }
    device->request.restarts_left--;
    pdcp_bus_count(bus, PDCP_STAT_BULK_RESTARTS);
    start_bulk(bus, device);
    return false;
}

static bool late(pdcp_bus_t *bus)
{
    pdcp_bus_count(bus, PDCP_STAT_DROP_LATE);
    return false;
}

/* Waits for the answer to a packet, which names no packet. */
static bool is_packet(const pdcp_request_t *request)
{
    return request->state == PDCP_REQUEST_SET_DATA || request->state == PDCP_REQUEST_SET_ECHO;
}

/* What was sent has failed: the device wants a parameter by bulk, or a packet again, or it refuses. */
static bool on_failure(pdcp_bus_t *bus, pdcp_device_entry_t *device, uint8_t result, pdcp_reply_t *reply)
{
    const pdcp_request_t *request = &device->request;
    if (is_packet(request)) {
        return restart_bulk(bus, device, reply);
    }
    if (request->state == PDCP_REQUEST_ANSWER && result == PDCP_USE_BULK && is_parameter(request)) {
        start_bulk(bus, device);
        return false;
    }
    return finish(bus, device, PDCP_ERR_REFUSED, reply);
}

/* A packet that was sent more than once may be answered more than once. An answer that came later would be
 * taken for that to the next packet, which may be lost: the next one waits (D-BUS-39, D-BUS-52). */
static void await_echoes(pdcp_bus_t *bus, pdcp_device_entry_t *device)
{
    device->request.tries_left = (uint8_t)(PDCP_TRIES - 1 - device->request.tries_left);
    device->request.state = PDCP_REQUEST_SET_ECHO;
    wait_for_answer(bus, device);
}

static bool on_success(pdcp_bus_t *bus, pdcp_device_entry_t *device, const pdcp_msg_t *msg,
                       pdcp_reply_t *reply)
{
    pdcp_request_t *request = &device->request;
    pdcp_request_state_t next = PDCP_REQUEST_SET_DATA;
    switch ((pdcp_request_state_t)request->state) {
    case PDCP_REQUEST_GET_SIZE:
        if (msg->word > request->max_size) {
            return finish(bus, device, PDCP_ERR_BULK, reply);
        }
        request->size = msg->word;
        next = PDCP_REQUEST_GET_DATA;
        break;
    case PDCP_REQUEST_SET_SIZE:
        break;
    case PDCP_REQUEST_SET_DATA:
        request->offset = (uint16_t)(request->offset + packet_len(request));
        request->packet_id++;
        if (request->tries_left < PDCP_TRIES - 1 && request->offset != request->size) {
            await_echoes(bus, device);
            return false;
        }
        break;
    case PDCP_REQUEST_SET_ECHO:
        request->tries_left--;
        if (request->tries_left != 0) {
            return false;
        }
        break;
    default: /* PDCP_REQUEST_ANSWER */
        return finish(bus, device, PDCP_OK, reply);
    }
    if (request->offset == request->size) {
        return finish(bus, device, PDCP_OK, reply);
    }
    enter(bus, device, next);
    return false;
}

static void answer_packet(pdcp_bus_t *bus, const pdcp_device_entry_t *device, uint8_t result)
{
    const pdcp_msg_t msg = {.code = PDCP_BULK_DATA | PDCP_ANSWER, .result = result};
    (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, device->node_id, &msg);
}

/* A packet from the device: the next one, the one before once more (its answer got lost, D-BUS-9), or a wrong
 * one. */
static bool on_packet(pdcp_bus_t *bus, pdcp_device_entry_t *device, const pdcp_msg_t *msg,
                      pdcp_reply_t *reply)
{
    pdcp_request_t *request = &device->request;
    const uint16_t left = (uint16_t)(request->size - request->offset);
    bool again = false;
    uint8_t result = PDCP_SUCCESS;
    if (request->offset != 0 && msg->packet_id == (uint8_t)(request->packet_id - 1)) {
        again = true;
    } else if (msg->packet_id != request->packet_id || msg->len > left) {
        result = PDCP_FAILURE;
    }
    if (request->state != PDCP_REQUEST_GET_DATA && !(again && request->got_bulk)) {
        return late(bus);
    }
    pdcp_bus_count(bus, PDCP_STAT_TAKEN);
    answer_packet(bus, device, result);
    if (result != PDCP_SUCCESS) {
        reply->len = 0;
        return restart_bulk(bus, device, reply);
    }
    if (again) {
        return false;
    }
    request->packet_id++;
    request->offset = (uint16_t)(request->offset + msg->len);
    const bool is_small = request->size <= PDCP_VALUE_MAX;
    if (is_small) { /* a number: handed on in one piece, however it came */
        memcpy(&request->value[reply->offset], msg->value, msg->len);
        reply->bytes = request->value;
        reply->len = request->offset;
        reply->offset = 0;
    }
    if (request->offset == request->size) {
        return finish(bus, device, PDCP_OK, reply);
    }
    request->tries_left = PDCP_TRIES - 1;
    wait_for_answer(bus, device);
    return !is_small;
}

/* Does an answer tell of another value than the one that this arbitrator has written by itself, so that it
 * belongs to an earlier write? A device that repeats none, or less, is believed; what the host writes, a
 * device may correct (D-BUS-55). */
static bool tells_of_another_write(const pdcp_request_t *request, const pdcp_msg_t *msg)
{
    const size_t len = msg->len < request->size ? msg->len : request->size;
    return request->code == PDCP_SET_PARAMETER && request->state == PDCP_REQUEST_ANSWER &&
           (request->client == PDCP_CLIENT_LINK || request->client == PDCP_CLIENT_SETUP) &&
           msg->result == PDCP_SUCCESS && memcmp(msg->value, request->value, len) != 0;
}

bool pdcp_request_on_message(pdcp_bus_t *bus, uint8_t place, const pdcp_msg_t *msg, pdcp_reply_t *reply)
{
    pdcp_device_entry_t *device = pdcp_bus_device(bus, place);
    const pdcp_request_t *request = &device->request;
    reply_head(request, reply, msg->value, msg->len);
    if (msg->code == PDCP_BULK_DATA) {
        return on_packet(bus, device, msg, reply);
    }
    if (msg->code != (code_of(request) | PDCP_ANSWER) ||
        (!is_packet(request) && /* 8E names no parameter */
         (msg->param != request->param || msg->channel != request->channel)) ||
        tells_of_another_write(request, msg)) {
        return late(bus);
    }
    pdcp_bus_count(bus, PDCP_STAT_TAKEN);
    return msg->result == PDCP_SUCCESS ? on_success(bus, device, msg, reply)
                                       : on_failure(bus, device, msg->result, reply);
}

bool pdcp_request_on_frame(pdcp_bus_t *bus, uint8_t place, const can_frame_t *frame, pdcp_reply_t *reply)
{
    pdcp_device_entry_t *device = pdcp_bus_device(bus, place);
    const pdcp_request_t *request = &device->request;
    if (request->state != PDCP_REQUEST_RAW ||
        !pdcp_codec_has_code(frame, request->code | (unsigned)PDCP_ANSWER)) {
        return false;
    }
    if (is_parameter(request) && request->size > PDCP_RAW_CHANNEL && frame->dlc > PDCP_RAW_ANSWER_CHANNEL &&
        (frame->data[PDCP_RAW_ANSWER_PARAM] != request->param ||
         frame->data[PDCP_RAW_ANSWER_CHANNEL] != request->channel)) {
        return false; /* well-formed, and about another parameter or channel (D-API-11) */
    }
    pdcp_bus_count(bus, PDCP_STAT_TAKEN);
    reply_head(request, reply, frame->data, frame->dlc);
    return finish(bus, device, PDCP_OK, reply);
}

bool pdcp_request_on_deadline(pdcp_bus_t *bus, uint8_t place, pdcp_reply_t *reply)
{
    pdcp_device_entry_t *device = pdcp_bus_device(bus, place);
    pdcp_request_t *request = &device->request;
    reply_head(request, reply, request->value, 0);
    if (request->state == PDCP_REQUEST_IDLE) {
        return false;
    }
    if (request->state == PDCP_REQUEST_SET_ECHO) { /* no more answers come (D-BUS-39) */
        enter(bus, device, PDCP_REQUEST_SET_DATA);
        return false;
    }
    if (request->tries_left != 0) {
        request->tries_left--;
        pdcp_bus_count(bus, PDCP_STAT_REPEATS);
        send(bus, device);
        return false;
    }
    if (request->state == PDCP_REQUEST_GET_DATA) {
        return restart_bulk(bus, device, reply);
    }
    if (request->client != PDCP_CLIENT_AUDIT) { /* which asks again, and whose one try may be lost */
        pdcp_bus_count(bus, PDCP_STAT_NO_ANSWER);
    }
    return finish(bus, device, PDCP_ERR_NO_ANSWER, reply);
}

uint16_t pdcp_request_word(const pdcp_reply_t *reply, uint8_t at)
{
    return pdcp_bytes_value_u16(reply->bytes, reply->len, at);
}
