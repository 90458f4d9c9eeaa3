#include "arb_hostapi.h"

#include <stddef.h>
#include <string.h>

#include "arb_call.h"
#include "arb_error.h"
#include "pdcp_time.h"

/* The longest failure answer, 230Fh. */
enum { FAILURE_MAX = ARB_HOST_HEADER + ARB_RESET_RESULTS + ARB_HOST_CRC };

/* [API 3.2], and the extension group (D-API-5). len: 0 where there is no payload. */
static const arb_message_t messages[] = {
    {.id = ARB_MSG_SYSTEM_INFO, .handler = arb_hostbus_system_info},
    {.id = ARB_MSG_DEVICE_INFO, .len = 1, .handler = arb_hostbus_device_info},
    {.id = ARB_MSG_INPUT_INFO, .len = 1, .handler = arb_hostbus_input_info},
    {.id = ARB_MSG_OUTPUT_INFO, .len = 1, .handler = arb_hostbus_output_info},
    {.id = ARB_MSG_LINK_INFO, .len = 1, .handler = arb_hostbus_link_info},
    {.id = ARB_MSG_GET_PARAMETER, .len = ARB_AT_VALUE, .devices = 1, .handler = arb_hostbus_get_parameter},
    {.id = ARB_MSG_SET_PARAMETER,
     .len = ARB_AT_VALUE + 1,
     .longer = 1,
     .devices = 1,
     .handler = arb_hostbus_set_parameter},
    {.id = ARB_MSG_CONFIGURE_LINK,
     .len = 2 * ARB_CHANNEL_BYTES,
     .devices = 2,
     .waits = 1,
     .handler = arb_hostbus_configure_link},
    {.id = ARB_MSG_PASSTHROUGH, .len = ARB_AT_DATA + CAN_FRAME_DATA_MAX, .handler = arb_hostbus_passthrough},
    {.id = ARB_MSG_RESET, .len = 1, .handler = arb_hostbus_reset},
    {.id = ARB_MSG_ARBITRATOR_INFO, .handler = arb_hostext_arbitrator_info},
    {.id = ARB_MSG_SET_FLAGS, .len = 1, .handler = arb_hostext_set_flags},
    {.id = ARB_MSG_ACTION, .len = 2, .waits = 1, .handler = arb_hostext_action},
    {.id = ARB_MSG_READ_CONFIGS, .len = ARB_AT_LENGTH + 1, .handler = arb_hostext_read_configs},
    {.id = ARB_MSG_WRITE_CONFIGS, .len = ARB_AT_PIECE + 1, .longer = 1, .handler = arb_hostext_write_configs},
    {.id = ARB_MSG_REMOVE_LINK,
     .len = ARB_CHANNEL_BYTES,
     .devices = 1,
     .waits = 1,
     .handler = arb_hostext_remove_link},
    {.id = ARB_MSG_STATISTICS, .len = 1, .handler = arb_hostext_statistics},
    {.id = ARB_MSG_EVENT_STREAM, .len = 1, .longer = 1, .handler = arb_hostext_event_stream},
};

/* NULL: there is no message with this id. */
static const arb_message_t *find_message(uint16_t id)
{
    for (size_t i = 0; i < sizeof messages / sizeof messages[0]; i++) {
        if (messages[i].id == id) {
            return &messages[i];
        }
    }
    return NULL;
}

/* Completes the answer to a request: a success, or the failure of a reset that was begun, with the len bytes
 * of payload that stand in frame[] already; another failure; or 2200h for an id that does not exist. 230Fh
 * never carries an error code (D-API-3). Returns its length. */
static uint16_t finish(arb_hostapi_t *api, uint8_t *frame, const arb_hostrx_request_t *request, uint8_t error,
                       uint16_t len)
{
    uint16_t id = (uint16_t)(request->id + 1);
    if (find_message(request->id) == NULL) {
        api->counters[ARB_HOSTAPI_UNKNOWN]++;
        id = ARB_MSG_UNKNOWN_ID;
        len = 0;
    } else if (error != ARB_OK) {
        id++;
        if (request->id != ARB_MSG_RESET) {
            frame[ARB_HOST_HEADER] = error;
            len = 1;
        } else if (error != ARB_ERR_NO_ANSWER) { /* it was not begun, no device was reset */
            memset(&frame[ARB_HOST_HEADER], 0, ARB_RESET_RESULTS);
            len = ARB_RESET_RESULTS;
        }
    }
    return arb_hostcodec_finish(frame, id, request->reference, len);
}

static bool urgent_has_room(const arb_hostapi_t *api)
{
    return api->urgent_out.len <= ARB_URGENT_BYTES - FAILURE_MAX;
}

/* Holds a request for its turn. One too many (D-API-3), or one whose payload finds no room (D-API-9), is
 * answered as busy at once. */
static void accept(arb_hostapi_t *api, const arb_hostrx_request_t *request)
{
    api->counters[ARB_HOSTAPI_REQUESTS]++;
    if (api->held_count == ARB_HELD_MAX || request->len > ARB_HELD_BYTES - api->held_used) {
        uint8_t *frame = &api->urgent[api->urgent_out.len];
        api->counters[ARB_HOSTAPI_BUSY]++;
        api->urgent_out.len = (uint16_t)(api->urgent_out.len + finish(api, frame, request, ARB_ERR_BUSY, 0));
        return;
    }
    arb_hostrx_request_t *held = &api->held[api->held_count++];
    *held = *request;
    if (held->error == ARB_ERR_CRC && !api->strict) { /* lenient (D-API-1) */
        held->error = ARB_OK;
    }
    memcpy(&api->held_bytes[api->held_used], &api->rx.bytes[ARB_HOST_HEADER], request->len);
    api->held_used = (uint16_t)(api->held_used + request->len);
}

/* False: no more can be taken before the host reads on. */
static bool accept_all(arb_hostapi_t *api)
{
    arb_hostrx_request_t request;
    while (urgent_has_room(api)) {
        if (!arb_hostrx_next(&api->rx, &request)) {
            return true;
        }
        accept(api, &request);
    }
    return false;
}

uint16_t arb_hostapi_on_bytes(arb_hostapi_t *api, uint32_t now_ms, const uint8_t *bytes, uint16_t len)
{
    uint16_t taken = 0;
    while (accept_all(api) && taken < len) {
        arb_hostrx_put(&api->rx, now_ms, bytes[taken++]);
    }
    api->counters[ARB_HOSTAPI_RECEIVED] += taken;
    return taken;
}

void arb_hostapi_on_event(arb_hostapi_t *api, const pdcp_arb_t *arb, uint32_t now_ms,
                          const pdcp_event_t *event)
{
    if (api->turn.started) {
        arb_hostbus_on_event(api, event);
    }
    arb_hostevents_on_event(&api->events, arb, now_ms, event);
}

/* Removes the request at the front. */
static void drop_front(arb_hostapi_t *api)
{
    const uint16_t len = api->held[0].len;
    api->held_count--;
    memmove(&api->held[0], &api->held[1], sizeof api->held - sizeof api->held[0]);
    api->held_used = (uint16_t)(api->held_used - len);
    memmove(&api->held_bytes[0], &api->held_bytes[len], api->held_used);
    memset(&api->turn, 0, sizeof api->turn);
}

/* Looks up the devices of a request. What changes links waits for a running setup or plan (D-API-6). */
static uint8_t check_arguments(arb_call_t *call, const arb_message_t *message)
{
    const uint8_t *bytes = call->payload;
    for (uint8_t i = 0; i < message->devices; i++, bytes += ARB_CHANNEL_BYTES) {
        call->place[i] = arb_call_device(call, bytes);
        if (call->place[i] == PDCP_NONE) {
            return ARB_ERR_DEVICE;
        }
    }
    if (message->waits && (pdcp_arb_setup_running(call->arb) || arb_limb_is_busy(call->env->limb))) {
        return arb_call_wait_ready(call);
    }
    return ARB_OK;
}

static uint8_t handle(arb_call_t *call)
{
    const arb_hostrx_request_t *front = &call->api->held[0];
    const arb_message_t *message = find_message(front->id);
    arb_turn_t *turn = &call->api->turn;
    if (front->error != ARB_OK) {
        return front->error;
    }
    if (message == NULL || front->len < message->len || (front->len > message->len && !message->longer)) {
        return ARB_ERR_SIZE;
    }
    if (!turn->waiting) {
        turn->waiting = true;
        turn->since_ms = call->now_ms;
    }
    turn->until_ms = call->now_ms + PDCP_TIME_FAR_MS;
    const uint8_t error = turn->started ? ARB_OK : check_arguments(call, message);
    return error == ARB_OK ? message->handler(call) : error;
}

/* Serves the request at the front. False: it waits for the bus. */
static bool serve(arb_hostapi_t *api, const arb_hostenv_t *env, uint32_t now_ms)
{
    arb_call_t call = {.api = api,
                       .env = env,
                       .arb = env->arb,
                       .now_ms = now_ms,
                       .payload = api->held_bytes,
                       .len = api->held[0].len,
                       .answer = &api->answer[ARB_HOST_HEADER]};
    const uint8_t error = handle(&call);
    if (error == ARB_PENDING) {
        return false;
    }
    if (env->port->host_served != NULL) {
        env->port->host_served(env->port->ctx, api->held[0].id, call.payload, call.len, error);
    }
    api->answer_out.len = finish(api, api->answer, &api->held[0], error, call.answer_len);
    drop_front(api);
    return true;
}

/* Offers the host what of bytes[] is not sent yet. False: it has no room for all. */
static bool send(arb_hostapi_t *api, const arb_port_t *port, const uint8_t *bytes, arb_out_t *out)
{
    const uint16_t left = (uint16_t)(out->len - out->sent);
    if (left == 0) {
        return true;
    }
    const uint16_t written = (uint16_t)port->host_write(port->ctx, &bytes[out->sent], left);
    api->counters[ARB_HOSTAPI_SENT] += written;
    out->sent = (uint16_t)(out->sent + written);
    api->blocked = out->sent < out->len;
    if (api->blocked) {
        return false;
    }
    memset(out, 0, sizeof *out);
    return true;
}

/* Sends on the event at the front. False: there is none, or no room for it. */
static bool flush_event(arb_hostapi_t *api, const arb_port_t *port)
{
    arb_hostevents_t *events = &api->events;
    if (!arb_hostevents_next(events) || !send(api, port, events->message, &events->out)) {
        return false;
    }
    events->counters[0]++;
    return true;
}

/* Sends what waits but for events that are not begun: first what is, so that no message is torn, then the
 * answer, then the urgent ones. */
static void flush(arb_hostapi_t *api, const arb_port_t *port)
{
    if (api->events.out.sent != 0 && !flush_event(api, port)) {
        return;
    }
    if (arb_hostapi_has_answer(api) && send(api, port, api->answer, &api->answer_out)) {
        (void)send(api, port, api->urgent, &api->urgent_out);
    }
}

/* Answers go first. */
static void flush_events(arb_hostapi_t *api, const arb_port_t *port)
{
    while (!arb_hostapi_has_answer(api) && flush_event(api, port)) {
    }
}

void arb_hostapi_on_frame(arb_hostapi_t *api, const arb_port_t *port, uint32_t now_ms,
                          const can_frame_t *frame)
{
    arb_hostevents_on_frame(&api->events, now_ms, frame);
    if (!api->blocked) {
        flush_events(api, port);
    }
}

void arb_hostapi_on_host_gone(arb_hostapi_t *api)
{
    arb_hostevents_end(&api->events);
    arb_hostrx_clear(&api->rx);
    for (uint8_t i = 0; i < api->held_count; i++) {
        if (api->held[i].id == ARB_MSG_EVENT_STREAM) {
            api->held[i].error = ARB_ERR_NOT_READY; /* it would be the next host's (D-API-17) */
        }
    }
}

bool arb_hostapi_step(arb_hostapi_t *api, const arb_hostenv_t *env, uint32_t now_ms)
{
    api->handed = false;
    if (urgent_has_room(api)) {
        arb_hostrx_on_time(&api->rx, now_ms);
    } else {
        api->rx.last_ms = now_ms; /* the silence is ours: bytes were not taken */
    }
    (void)accept_all(api);
    do {
        flush(api, env->port);
    } while (api->held_count != 0 && !arb_hostapi_has_answer(api) && serve(api, env, now_ms));
    if (arb_limb_take_change(env->limb)) {
        arb_hostevents_on_config(&api->events, now_ms, env->limb->active, env->limb->config.stored);
    }
    flush_events(api, env->port);
    return api->handed;
}

uint32_t arb_hostapi_next_ms(const arb_hostapi_t *api, uint32_t now_ms)
{
    uint32_t next_ms = now_ms + PDCP_TIME_FAR_MS;
    if (arb_hostrx_is_inside(&api->rx)) {
        next_ms = api->rx.last_ms + ARB_HOSTRX_TIMEOUT_MS;
    }
    const bool blocked = arb_hostapi_has_answer(api); /* until the host reads on */
    if (api->turn.waiting && !blocked) {
        next_ms = pdcp_time_earlier(next_ms, api->turn.until_ms);
    }
    return next_ms;
}
