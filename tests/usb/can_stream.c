/* Sends numbered frames on a bus as fast as it takes them, and checks the numbers of those that another one
 * sends.
 *
 *     can_stream BUS ID SEND RECEIVE [wait]
 *
 * Prints "open"; then, when SEND frames were sent and RECEIVE received, "result" and a JSON object. With wait
 * it sends nothing before it has received a frame. After bus-off it restarts the controller as the arbitrator
 * does. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "linux_can.h"
#include "loop.h"

enum { BATCH = 32, RESTART_US = 100000 };

typedef struct {
    loop_t *loop;
    hal_can_t *can;
    uint16_t id;
    uint32_t to_send, to_receive, sent, received, gaps, errors, bus_offs, downs;
    uint64_t started_us, ended_us;
    hal_can_state_t state;
    bool waits;
} stream_t;

static void send_all(stream_t *stream)
{
    while (stream->sent < stream->to_send && !stream->waits) {
        can_frame_t frame = {.id = stream->id, .dlc = 4};
        memcpy(frame.data, &stream->sent, sizeof stream->sent);
        if (!hal_can_send(stream->can, &frame)) {
            return;
        }
        stream->sent++;
    }
}

static void take(stream_t *stream, const can_frame_t *frame)
{
    uint32_t number;
    if (frame->kind == CAN_FRAME_ERROR) {
        stream->errors++;
        return;
    }
    memcpy(&number, frame->data, sizeof number);
    stream->gaps += number == stream->received ? 0u : 1u;
    stream->received++;
    stream->waits = false;
}

static void on_ready(void *ctx)
{
    stream_t *stream = ctx;
    can_frame_t frames[BATCH];
    size_t count;
    do {
        count = hal_can_receive(stream->can, frames, BATCH);
        for (size_t i = 0; i < count; i++) {
            take(stream, &frames[i]);
        }
    } while (count == BATCH);
    const hal_can_state_t state = hal_can_health(stream->can).state;
    stream->bus_offs += state == HAL_CAN_BUS_OFF && stream->state != state ? 1u : 0u;
    stream->downs += state == HAL_CAN_DOWN && stream->state != state ? 1u : 0u;
    if (state == HAL_CAN_BUS_OFF && stream->state != state) {
        loop_set_deadline_us(stream->loop, loop_now_us(stream->loop) + RESTART_US);
    }
    stream->state = state;
    send_all(stream);
}

static bool is_done(const stream_t *stream)
{
    return stream->sent == stream->to_send && stream->received >= stream->to_receive;
}

/* Waits until all is done, and then a little longer for what should not come. */
static void run(stream_t *stream)
{
    const uint64_t rest_us = 300000;
    bool runs = true;
    while (runs) {
        runs = loop_run_once(stream->loop);
        const uint64_t now_us = loop_now_us(stream->loop);
        if (stream->state == HAL_CAN_BUS_OFF) {
            hal_can_restart(stream->can);
            loop_set_deadline_us(stream->loop, now_us + RESTART_US);
            continue;
        }
        loop_set_deadline_us(stream->loop, UINT64_MAX);
        if (stream->ended_us == 0 && is_done(stream)) {
            stream->ended_us = now_us;
        }
        if (stream->ended_us != 0) {
            loop_set_deadline_us(stream->loop, stream->ended_us + rest_us);
            runs = runs && now_us < stream->ended_us + rest_us;
        }
    }
}

int main(int argc, char **argv)
{
    char error[256];
    stream_t stream;
    memset(&stream, 0, sizeof stream);
    if (argc < 5) {
        (void)fprintf(stderr, "usage: can_stream BUS ID SEND RECEIVE [wait]\n");
        return 2;
    }
    stream.loop = loop_create();
    stream.id = (uint16_t)strtoul(argv[2], NULL, 16);
    stream.to_send = (uint32_t)strtoul(argv[3], NULL, 10);
    stream.to_receive = (uint32_t)strtoul(argv[4], NULL, 10);
    stream.waits = argc > 5;
    stream.can = linux_can_open(stream.loop, argv[1], on_ready, &stream, error, sizeof error);
    if (stream.can == NULL) {
        (void)fprintf(stderr, "can_stream: %s\n", error);
        return 2;
    }
    (void)setvbuf(stdout, NULL, _IOLBF, 0);
    (void)printf("open\n");
    stream.state = hal_can_health(stream.can).state;
    stream.started_us = loop_refresh_now_us(stream.loop);
    send_all(&stream);
    run(&stream);
    const hal_can_health_t health = hal_can_health(stream.can);
    (void)printf(
        "result {\"sent\":%u,\"received\":%u,\"gaps\":%u,\"errors\":%u,\"bus_offs\":%u,\"downs\":%u,"
        "\"overruns\":%u,\"failed\":%u,\"ms\":%u}\n",
        stream.sent, stream.received, stream.gaps, stream.errors, stream.bus_offs, stream.downs,
        health.rx_overruns, health.tx_failed, (unsigned)((stream.ended_us - stream.started_us) / 1000u));
    linux_can_close(stream.can);
    loop_destroy(stream.loop);
    return 0;
}
