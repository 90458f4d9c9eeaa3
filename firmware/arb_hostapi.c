#include "arb_hostapi.h"

#include <stddef.h>
#include <string.h>

#include "arb_hostcall.h"
#include "pdcp_time.h"

/* Payloads of failure answers: an error code, but of 230Dh the results. */
enum { RESULTS = 8, FAILURE_MAX = ARB_HOST_HEADER + RESULTS + ARB_HOST_CRC };

void arb_hostapi_init(arb_hostapi_t *api)
{
    memset(api, 0, sizeof *api);
    arb_hostrx_init(&api->rx);
}

static const arb_message_t *find_message(uint16_t id)
{
    const arb_message_t *message = arb_hostbus_find(id);
    return message != NULL ? message : arb_hostext_find(id);
}

/* Builds a failure answer, or 2200h for an id that does not exist. results: of 230Dh; NULL: it was not begun,
 * no device was reset (230Fh never carries an error code, D-API-3). Returns its length. */
static uint16_t build_failure(arb_hostapi_t *api, uint8_t *frame, const arb_held_t *request, uint8_t error,
                              const uint8_t *results)
{
    const uint16_t id = (uint16_t)(request->id + 2);
    if (find_message(request->id) == NULL) {
        api->unknown++;
        return arb_host_finish(frame, ARB_MSG_UNKNOWN_ID, request->reference, 0);
    }
    if (request->id == ARB_MSG_RESET) {
        memset(&frame[ARB_HOST_HEADER], 0, RESULTS);
        if (results != NULL) {
            memcpy(&frame[ARB_HOST_HEADER], results, RESULTS);
        }
        return arb_host_finish(frame, id, request->reference, RESULTS);
    }
    frame[ARB_HOST_HEADER] = error;
    return arb_host_finish(frame, id, request->reference, 1);
}

static bool urgent_has_room(const arb_hostapi_t *api)
{
    return api->urgent_len + FAILURE_MAX <= ARB_URGENT_BYTES;
}

static void accept(arb_hostapi_t *api, const arb_hostrx_request_t *request)
{
    const arb_held_t what = {
        .id = request->id, .reference = request->reference, .at = api->held_used, .len = request->len};
    api->requests++;
    if (api->held_count == ARB_HELD_MAX || request->len > ARB_HELD_BYTES - api->held_used) {
        uint8_t *frame = &api->urgent[api->urgent_len];
        api->busy++;
        api->urgent_len = (uint8_t)(api->urgent_len + build_failure(api, frame, &what, ARB_ERR_BUSY, NULL));
        return;
    }
    arb_held_t *held = &api->held[api->held_count++];
    *held = what;
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
    api->received += taken;
    return taken;
}

void arb_hostapi_on_event(arb_hostapi_t *api, const pdcp_arb_t *arb, uint32_t now_ms,
                          const pdcp_event_t *event)
{
    if (api->turn.started) {
        arb_hostbus_on_event(&api->turn, api->held[0].id, event);
    }
    arb_hostevents_on_event(&api->events, arb, now_ms, event);
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
    memset(&api->turn, 0, sizeof api->turn);
}

/* results: of 230Dh, when it has failed after it was begun. */
static uint8_t handle(arb_hostapi_t *api, const arb_hostenv_t *env, uint32_t now_ms, uint16_t *answer_len,
                      uint8_t *results)
{
    const arb_held_t *front = &api->held[0];
    const arb_message_t *message = find_message(front->id);
    if (message == NULL || front->error != ARB_OK) {
        return message == NULL ? (uint8_t)ARB_ERR_SIZE : front->error;
    }
    if (front->len < message->len_min || front->len > message->len_max) {
        return ARB_ERR_SIZE;
    }
    arb_call_t call = {.api = api,
                       .turn = &api->turn,
                       .env = env,
                       .arb = env->arb,
                       .now_ms = now_ms,
                       .payload = &api->held_bytes[front->at],
                       .len = front->len,
                       .answer = &api->answer[ARB_HOST_HEADER]};
    const uint8_t error = message->handler(&call);
    *answer_len = call.answer_len;
    if (front->id == ARB_MSG_RESET) {
        arb_hostbus_reset_results(&call, results);
    }
    return error;
}

/* Serves the request at the front. False: it waits for the bus. */
static bool serve(arb_hostapi_t *api, const arb_hostenv_t *env, uint32_t now_ms)
{
    const arb_held_t *front = &api->held[0];
    uint8_t results[RESULTS] = {0};
    uint16_t len = 0;
    const uint8_t error = handle(api, env, now_ms, &len, results);
    if (error == ARB_PENDING) {
        return false;
    }
    if (error == ARB_OK) {
        api->answer_len = arb_host_finish(api->answer, (uint16_t)(front->id + 1), front->reference, len);
    } else {
        api->answer_len = build_failure(api, api->answer, front, error, results);
    }
    api->answer_sent = 0;
    drop_front(api);
    return true;
}

/* Returns how many bytes the host has taken. */
static uint16_t write_host(arb_hostapi_t *api, const arb_port_t *port, const uint8_t *bytes, uint16_t len)
{
    const uint16_t written = (uint16_t)port->host_write(port->ctx, bytes, len);
    api->sent += written;
    api->blocked = written < len;
    return written;
}

/* Sends on the event at the front. False: there is none, or no room for it. */
static bool flush_event(arb_hostapi_t *api, const arb_port_t *port)
{
    arb_hostevents_t *events = &api->events;
    if (!arb_hostevents_next(events)) {
        return false;
    }
    const uint8_t left = (uint8_t)(events->message_len - events->message_sent);
    arb_hostevents_taken(events,
                         (uint8_t)write_host(api, port, &events->message[events->message_sent], left));
    return !api->blocked;
}

/* Sends what waits but for events that are not begun: first what is, so that no message is torn, then the
 * answer, then the urgent ones. */
static void flush(arb_hostapi_t *api, const arb_port_t *port)
{
    if (api->events.message_sent != 0 && !flush_event(api, port)) {
        return;
    }
    if (api->answer_len != 0) {
        const uint16_t left = (uint16_t)(api->answer_len - api->answer_sent);
        api->answer_sent =
            (uint16_t)(api->answer_sent + write_host(api, port, &api->answer[api->answer_sent], left));
        if (api->answer_sent < api->answer_len) {
            return;
        }
        api->answer_len = 0;
    }
    if (api->urgent_len != 0) {
        const uint8_t written = (uint8_t)write_host(api, port, api->urgent, api->urgent_len);
        api->urgent_len = (uint8_t)(api->urgent_len - written);
        memmove(api->urgent, &api->urgent[written], api->urgent_len);
    }
}

/* Answers go first. */
static void flush_events(arb_hostapi_t *api, const arb_port_t *port)
{
    while (api->answer_len == 0 && api->urgent_len == 0 && flush_event(api, port)) {
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
            api->held[i].error = ARB_ERR_NOT_READY; /* it would be the next host's */
        }
    }
}

bool arb_hostapi_step(arb_hostapi_t *api, const arb_hostenv_t *env, uint32_t now_ms)
{
    api->handed = false;
    const bool refusing = !urgent_has_room(api);
    if (!refusing) {
        arb_hostrx_on_time(&api->rx, now_ms);
    }
    accept_all(api);
    flush(api, env->port);
    if (refusing) {
        api->rx.last_ms = now_ms; /* the silence is ours: bytes were not taken */
    }
    while (api->held_count != 0 && api->answer_len == 0 && api->urgent_len == 0 && serve(api, env, now_ms)) {
        flush(api, env->port);
    }
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
    const bool blocked = api->answer_len != 0 || api->urgent_len != 0; /* until the host reads on */
    if (api->turn.waiting && !blocked && pdcp_time_before(api->turn.until_ms, next_ms)) {
        next_ms = api->turn.until_ms;
    }
    return next_ms;
}
