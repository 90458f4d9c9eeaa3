#include "pdcp_request.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_bus.h"

static pdcp_request_t *request_of(pdcp_bus_t *bus, uint8_t node)
{
    return &pdcp_bus_node(bus, node)->request;
}

bool pdcp_request_is_idle(const pdcp_bus_t *bus, uint8_t node)
{
    return bus->nodes.nodes[node].request.state == PDCP_REQUEST_IDLE;
}

static void send_packet(pdcp_bus_t *bus, uint8_t node)
{
    const pdcp_request_t *request = request_of(bus, node);
    const uint8_t *bytes = request->bytes != NULL ? request->bytes : request->value;
    const uint16_t left = (uint16_t)(request->size - request->offset);
    pdcp_msg_t msg = {.code = PDCP_BULK_DATA, .packet_id = request->packet_id};
    msg.len = (uint8_t)(left < PDCP_BULK_PACKET_MAX ? left : PDCP_BULK_PACKET_MAX);
    memcpy(msg.value, &bytes[request->offset], msg.len);
    (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, bus->nodes.nodes[node].node_id, &msg);
}

static void send_raw(pdcp_bus_t *bus, uint8_t node)
{
    const pdcp_request_t *request = request_of(bus, node);
    can_frame_t frame = {.id = pdcp_can_id(PDCP_PRIORITY_NORMAL, true, bus->nodes.nodes[node].node_id),
                         .dlc = (uint8_t)request->size};
    memcpy(frame.data, request->bytes, frame.dlc);
    (void)pdcp_bus_send_frame(bus, &frame);
}

/* Sends what the state asks for and waits for its answer. A frame that finds no room is repeated at the
 * deadline, like one that got lost on the way. */
static void send(pdcp_bus_t *bus, uint8_t node)
{
    const pdcp_request_t *request = request_of(bus, node);
    const uint8_t node_id = bus->nodes.nodes[node].node_id;
    pdcp_msg_t msg = {.code = request->code, .param = request->param, .channel = request->channel};
    switch ((pdcp_request_state_t)request->state) {
    case PDCP_REQUEST_ANSWER:
        msg.word = request->size; /* of 08 */
        if (request->code == PDCP_SET_PARAMETER) {
            msg.len = (uint8_t)request->size;
            memcpy(msg.value, request->value, msg.len);
        }
        (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, node_id, &msg);
        break;
    case PDCP_REQUEST_GET_SIZE:
        msg.code = PDCP_BULK_GET;
        (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, node_id, &msg);
        break;
    case PDCP_REQUEST_SET_SIZE:
        msg.code = PDCP_BULK_SET;
        msg.word = request->size;
        (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, node_id, &msg);
        break;
    case PDCP_REQUEST_SET_DATA:
        send_packet(bus, node);
        break;
    case PDCP_REQUEST_RAW:
        send_raw(bus, node);
        break;
    default: /* GET_DATA: the device sends by itself */
        break;
    }
    pdcp_bus_wake(bus, (uint8_t)(PDCP_TIMER_REQUEST + node), pdcp_bus_node(bus, node)->ack_ms);
}

static void enter(pdcp_bus_t *bus, uint8_t node, pdcp_request_state_t state)
{
    pdcp_request_t *request = request_of(bus, node);
    request->state = (uint8_t)state;
    request->tries_left = PDCP_TRIES - 1;
    send(bus, node);
}

static void start(pdcp_bus_t *bus, uint8_t node, const pdcp_request_t *what)
{
    pdcp_request_t *request = request_of(bus, node);
    *request = *what;
    request->restarts_left = PDCP_BULK_RESTARTS;
    pdcp_bus_count(bus, PDCP_STAT_REQUESTS);
    enter(bus, node, (pdcp_request_state_t)what->state);
}

void pdcp_request_get(pdcp_bus_t *bus, uint8_t node, pdcp_client_t client, uint8_t channel, uint8_t param,
                      uint16_t max_size)
{
    const pdcp_request_t what = {.client = (uint8_t)client,
                                 .code = PDCP_GET_PARAMETER,
                                 .param = param,
                                 .channel = channel,
                                 .max_size = max_size,
                                 .state = PDCP_REQUEST_ANSWER};
    start(bus, node, &what);
}

void pdcp_request_set(pdcp_bus_t *bus, uint8_t node, pdcp_client_t client, uint8_t channel, uint8_t param,
                      const uint8_t *bytes, uint16_t len)
{
    pdcp_request_t what = {.client = (uint8_t)client,
                           .code = PDCP_SET_PARAMETER,
                           .param = param,
                           .channel = channel,
                           .size = len,
                           .state = PDCP_REQUEST_ANSWER};
    if (len > PDCP_VALUE_MAX) {
        what.bytes = bytes;
        what.state = PDCP_REQUEST_SET_SIZE;
    } else {
        memcpy(what.value, bytes, len);
    }
    start(bus, node, &what);
}

void pdcp_request_command(pdcp_bus_t *bus, uint8_t node, pdcp_client_t client, uint8_t code, uint16_t time_ms)
{
    const pdcp_request_t what = {
        .client = (uint8_t)client, .code = code, .size = time_ms, .state = PDCP_REQUEST_ANSWER};
    start(bus, node, &what);
}

void pdcp_request_raw(pdcp_bus_t *bus, uint8_t node, pdcp_client_t client, const uint8_t *data, uint8_t dlc)
{
    const pdcp_request_t what = {
        .client = (uint8_t)client, .code = data[0], .bytes = data, .size = dlc, .state = PDCP_REQUEST_RAW};
    start(bus, node, &what);
}

void pdcp_request_try_once(pdcp_bus_t *bus, uint8_t node)
{
    request_of(bus, node)->tries_left = 0;
}

void pdcp_request_cancel(pdcp_bus_t *bus, uint8_t node)
{
    request_of(bus, node)->state = PDCP_REQUEST_IDLE;
    pdcp_timers_cancel(&bus->timers, (uint8_t)(PDCP_TIMER_REQUEST + node));
}

static void reply_head(const pdcp_request_t *request, pdcp_reply_t *reply)
{
    memset(reply, 0, sizeof *reply);
    reply->client = request->client;
    reply->code = request->code;
    reply->param = request->param;
    reply->channel = request->channel;
    reply->offset = request->offset;
}

static bool finish(pdcp_bus_t *bus, uint8_t node, pdcp_status_t status, pdcp_reply_t *reply)
{
    const pdcp_request_t *request = request_of(bus, node);
    reply->done = true;
    reply->status = (int8_t)status;
    if (status == PDCP_ERR_NO_ANSWER) {
        pdcp_bus_count(bus, PDCP_STAT_NO_ANSWER);
    }
    request_of(bus, node)->got_bulk = request->state == PDCP_REQUEST_GET_DATA;
    pdcp_request_cancel(bus, node);
    return true;
}

static bool restart_bulk(pdcp_bus_t *bus, uint8_t node, pdcp_reply_t *reply)
{
    pdcp_request_t *request = request_of(bus, node);
    if (request->restarts_left == 0) {
        return finish(bus, node, PDCP_ERR_BULK, reply);
    }
    request->restarts_left--;
    pdcp_bus_count(bus, PDCP_STAT_BULK_RESTARTS);
    enter(bus, node, request->code == PDCP_GET_PARAMETER ? PDCP_REQUEST_GET_SIZE : PDCP_REQUEST_SET_SIZE);
    return false;
}

static void start_packets(pdcp_bus_t *bus, uint8_t node, pdcp_request_state_t state)
{
    pdcp_request_t *request = request_of(bus, node);
    request->offset = 0;
    request->packet_id = 0;
    enter(bus, node, state);
}

static void late(pdcp_bus_t *bus)
{
    pdcp_bus_count(bus, PDCP_STAT_DROP_LATE);
}

/* Is msg the answer to code, about the same parameter and channel? */
static bool answers(const pdcp_request_t *request, const pdcp_msg_t *msg, pdcp_request_state_t state)
{
    return request->state == state && request->param == msg->param && request->channel == msg->channel;
}

/* 83 and 84, and the answers to commands. */
static bool on_answer(pdcp_bus_t *bus, uint8_t node, const pdcp_msg_t *msg, pdcp_reply_t *reply)
{
    const pdcp_request_t *request = request_of(bus, node);
    if (!answers(request, msg, PDCP_REQUEST_ANSWER) || msg->code != (request->code | PDCP_ANSWER)) {
        late(bus);
        return false;
    }
    const bool is_parameter = request->code == PDCP_GET_PARAMETER || request->code == PDCP_SET_PARAMETER;
    if (is_parameter && msg->result == PDCP_USE_BULK) {
        enter(bus, node, request->code == PDCP_GET_PARAMETER ? PDCP_REQUEST_GET_SIZE : PDCP_REQUEST_SET_SIZE);
        return false;
    }
    if (request->code == PDCP_GET_PARAMETER) {
        reply->bytes = msg->value;
        reply->len = msg->len;
    }
    return finish(bus, node, msg->result == PDCP_SUCCESS ? PDCP_OK : PDCP_ERR_REFUSED, reply);
}

static bool on_get_size(pdcp_bus_t *bus, uint8_t node, const pdcp_msg_t *msg, pdcp_reply_t *reply)
{
    pdcp_request_t *request = request_of(bus, node);
    if (!answers(request, msg, PDCP_REQUEST_GET_SIZE)) {
        late(bus);
        return false;
    }
    if (msg->result != PDCP_SUCCESS) {
        return finish(bus, node, PDCP_ERR_REFUSED, reply);
    }
    if (msg->word > request->max_size) {
        return finish(bus, node, PDCP_ERR_BULK, reply);
    }
    request->size = msg->word;
    if (msg->word == 0) {
        return finish(bus, node, PDCP_OK, reply);
    }
    start_packets(bus, node, PDCP_REQUEST_GET_DATA);
    return false;
}

static bool on_set_size(pdcp_bus_t *bus, uint8_t node, const pdcp_msg_t *msg, pdcp_reply_t *reply)
{
    if (!answers(request_of(bus, node), msg, PDCP_REQUEST_SET_SIZE)) {
        late(bus);
        return false;
    }
    if (msg->result != PDCP_SUCCESS) {
        return finish(bus, node, PDCP_ERR_REFUSED, reply);
    }
    start_packets(bus, node, PDCP_REQUEST_SET_DATA);
    return false;
}

static void answer_packet(pdcp_bus_t *bus, uint8_t node, uint8_t result)
{
    const pdcp_msg_t msg = {.code = PDCP_BULK_DATA | PDCP_ANSWER, .result = result};
    (void)pdcp_bus_send(bus, PDCP_PRIORITY_NORMAL, bus->nodes.nodes[node].node_id, &msg);
}

/* A packet from the device: the next one, the one before once more (its answer got lost, D-BUS-9), or a wrong
 * one. */
static bool on_packet(pdcp_bus_t *bus, uint8_t node, const pdcp_msg_t *msg, pdcp_reply_t *reply)
{
    pdcp_request_t *request = request_of(bus, node);
    const bool getting = request->state == PDCP_REQUEST_GET_DATA;
    const bool idle_after = request->state == PDCP_REQUEST_IDLE && request->got_bulk;
    const bool again = msg->packet_id == (uint8_t)(request->packet_id - 1) && request->offset != 0;
    if (!getting && !(idle_after && again)) {
        late(bus);
        return false;
    }
    if (again) {
        answer_packet(bus, node, PDCP_SUCCESS);
        return false;
    }
    const uint16_t left = (uint16_t)(request->size - request->offset);
    if (msg->packet_id != request->packet_id || msg->len > left) {
        answer_packet(bus, node, PDCP_FAILURE);
        return restart_bulk(bus, node, reply);
    }
    answer_packet(bus, node, PDCP_SUCCESS);
    reply->bytes = msg->value;
    reply->len = msg->len;
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
        return finish(bus, node, PDCP_OK, reply);
    }
    request->tries_left = PDCP_TRIES - 1;
    pdcp_bus_wake(bus, (uint8_t)(PDCP_TIMER_REQUEST + node), pdcp_bus_node(bus, node)->ack_ms);
    return !is_small;
}

static bool on_packet_answer(pdcp_bus_t *bus, uint8_t node, const pdcp_msg_t *msg, pdcp_reply_t *reply)
{
    pdcp_request_t *request = request_of(bus, node);
    if (request->state != PDCP_REQUEST_SET_DATA) {
        late(bus);
        return false;
    }
    if (msg->result != PDCP_SUCCESS) {
        return restart_bulk(bus, node, reply);
    }
    const uint16_t left = (uint16_t)(request->size - request->offset);
    request->offset =
        (uint16_t)(request->offset + (left < PDCP_BULK_PACKET_MAX ? left : PDCP_BULK_PACKET_MAX));
    request->packet_id++;
    if (request->offset == request->size) {
        return finish(bus, node, PDCP_OK, reply);
    }
    enter(bus, node, PDCP_REQUEST_SET_DATA);
    return false;
}

/* Is the frame a well-formed answer about another parameter or channel than the raw request's? */
static bool is_about_another(const pdcp_request_t *request, const can_frame_t *frame)
{
    const bool is_parameter = request->code == PDCP_GET_PARAMETER || request->code == PDCP_SET_PARAMETER;
    return is_parameter && request->size >= 3 && frame->dlc >= 4 &&
           (frame->data[2] != request->bytes[1] || frame->data[3] != request->bytes[2]);
}

bool pdcp_request_on_frame(pdcp_bus_t *bus, uint8_t node, const can_frame_t *frame, pdcp_reply_t *reply)
{
    const pdcp_request_t *request = request_of(bus, node);
    if (request->state != PDCP_REQUEST_RAW || frame->dlc == 0 ||
        frame->data[0] != (request->code | PDCP_ANSWER) || is_about_another(request, frame)) {
        return false;
    }
    reply_head(request, reply);
    reply->bytes = frame->data;
    reply->len = frame->dlc;
    return finish(bus, node, PDCP_OK, reply);
}

bool pdcp_request_on_message(pdcp_bus_t *bus, uint8_t node, const pdcp_msg_t *msg, pdcp_reply_t *reply)
{
    reply_head(request_of(bus, node), reply);
    switch (msg->code) {
    case PDCP_GET_PARAMETER | PDCP_ANSWER:
    case PDCP_SET_PARAMETER | PDCP_ANSWER:
    case PDCP_SUSPEND | PDCP_ANSWER:
    case PDCP_RELEASE | PDCP_ANSWER:
    case PDCP_RESET | PDCP_ANSWER:
        return on_answer(bus, node, msg, reply);
    case PDCP_BULK_GET | PDCP_ANSWER:
        return on_get_size(bus, node, msg, reply);
    case PDCP_BULK_SET | PDCP_ANSWER:
        return on_set_size(bus, node, msg, reply);
    case PDCP_BULK_DATA:
        return on_packet(bus, node, msg, reply);
    default: /* 8E: the arbitrator hands in no other */
        return on_packet_answer(bus, node, msg, reply);
    }
}

bool pdcp_request_on_deadline(pdcp_bus_t *bus, uint8_t node, pdcp_reply_t *reply)
{
    pdcp_request_t *request = request_of(bus, node);
    reply_head(request, reply);
    if (request->state == PDCP_REQUEST_IDLE) {
        return false;
    }
    if (request->tries_left != 0) {
        request->tries_left--;
        pdcp_bus_count(bus, PDCP_STAT_REPEATS);
        send(bus, node);
        return false;
    }
    if (request->state == PDCP_REQUEST_GET_DATA) {
        return restart_bulk(bus, node, reply);
    }
    return finish(bus, node, PDCP_ERR_NO_ANSWER, reply);
}
