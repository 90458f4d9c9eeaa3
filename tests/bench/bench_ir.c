/* Work for callgrind: bench_ir WHAT COUNT sets up 32 devices, lets everything settle, and then does one thing
 * COUNT times. The difference between two counts is what that thing costs; the setup cancels out. Frames are
 * handed in without a bus, and what the application sends is taken at once. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench_bus.h"
#include "pdcp_codec.h"
#include "pdcp_setup.h"
#include "profile_start.h"

#define SETTLE_US 20000000u
#define BEACON_GAP_US (PDCP_BEACON_MS * 1000u / BENCH_DEVICES)
#define FOREIGN_ID 100u     /* nobody's, and below the outputs' ids */
#define BULK_PACKETS 10000u /* of one transfer: as many as the difference between two counts */
#define BULK_SIZE (BULK_PACKETS * PDCP_BULK_PACKET_MAX)

static void check(bool good, const char *what)
{
    if (!good) {
        (void)fprintf(stderr, "bench_ir: %s\n", what);
        exit(1);
    }
}

/* --- what the application sends is counted; the last frame is kept --- */

typedef struct {
    uint32_t count;
    can_frame_t last;
} sent_t;

static bool can_send(void *ctx, const can_frame_t *frame)
{
    sent_t *sent = ctx;
    sent->count++;
    sent->last = *frame;
    return true;
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    (void)ctx;
    (void)bytes;
    return size;
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    (void)address;
    (void)bytes;
    (void)size;
    return true;
}

static int8_t nvm_status(void *ctx)
{
    (void)ctx;
    return 0;
}

/* --- one function for each thing --- */

typedef struct {
    arb_app_t *app;
    const bench_log_t *log;
    sent_t *sent;
    uint64_t now_us;
} job_t;

static uint32_t now_ms(const job_t *job)
{
    return (uint32_t)(job->now_us / 1000u);
}

static void take(const job_t *job, const can_frame_t *frame)
{
    arb_app_on_frame(job->app, now_ms(job), frame);
    (void)arb_app_step(job->app, now_ms(job));
}

static can_frame_t beacon_of(uint32_t device)
{
    return (can_frame_t){.id = (uint16_t)(device + 1u), .dlc = 1, .data = {PDCP_BEACON}};
}

static void do_beacon(job_t *job, uint32_t count)
{
    can_frame_t beacons[BENCH_DEVICES];
    for (uint32_t i = 0; i < BENCH_DEVICES; i++) {
        beacons[i] = beacon_of(i);
    }
    const uint32_t taken = job->app->arb.bus.stats[PDCP_STAT_TAKEN];
    for (uint32_t i = 0; i < count; i++) {
        take(job, &beacons[i % BENCH_DEVICES]);
    }
    check(job->app->arb.bus.stats[PDCP_STAT_TAKEN] == taken + count, "not every beacon was taken");
}

/* As they come: 64 a second, with all deadlines that fall due on the way. */
static void do_beacon_in_time(job_t *job, uint32_t count)
{
    uint32_t next_ms = now_ms(job);
    for (uint32_t i = 0; i < count; i++) {
        const can_frame_t beacon = beacon_of(i % BENCH_DEVICES);
        job->now_us += BEACON_GAP_US;
        while ((int32_t)(next_ms - now_ms(job)) < 0) {
            next_ms = arb_app_step(job->app, next_ms);
        }
        arb_app_on_frame(job->app, now_ms(job), &beacon);
        next_ms = arb_app_step(job->app, now_ms(job));
    }
    check(job->app->arb.bus.stats[PDCP_STAT_LOST] == 0, "a device was lost");
}

/* The answers that device 0 gave in its setup, over and over, each in answer to the setup's request. */
static void do_answer(job_t *job, uint32_t count)
{
    pdcp_arb_t *arb = &job->app->arb;
    uint8_t place;
    (void)pdcp_tables_owner(&arb->bus.tables, 1, &place);
    const uint32_t requests = arb->bus.stats[PDCP_STAT_REQUESTS];
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t number = i % job->log->answer_count;
        if (number == 0) {
            check(arb->bus.tables.devices[place].state == PDCP_PLACE_READY, "the setup did not end");
            pdcp_setup_start(&arb->bus, place);
            pdcp_setup_ask(&arb->bus, place);
        }
        take(job, &job->log->answers[number]);
    }
    check(arb->bus.stats[PDCP_STAT_REQUESTS] >= requests + count, "an answer was not followed by a request");
    check(arb->bus.stats[PDCP_STAT_DROP_LATE] == 0, "an answer was not taken");
}

/* The host reads a long value. */
static void do_bulk(job_t *job, uint32_t count)
{
    static uint8_t value[BULK_SIZE];
    static const can_frame_t use_bulk = {.id = 0x201, .dlc = 4, .data = {0x83, 2, PDCP_DEV_DESCRIPTOR, 0}};
    static const can_frame_t size = {
        .id = 0x201,
        .dlc = 6,
        .data = {0x8C, 1, PDCP_DEV_DESCRIPTOR, 0, (uint8_t)(BULK_SIZE & 0xFFu), (uint8_t)(BULK_SIZE >> 8)}};
    can_frame_t packet = {.id = 0x201, .dlc = 8, .data = {PDCP_BULK_DATA, 0, 1, 2, 3, 4, 5, 6}};
    uint8_t place;
    (void)pdcp_tables_owner(&job->app->arb.bus.tables, 1, &place);
    for (uint32_t i = 0; i < count; i++) {
        if (i % BULK_PACKETS == 0) {
            const pdcp_status_t status =
                pdcp_arb_get(&job->app->arb, place, 0, PDCP_DEV_DESCRIPTOR, value, BULK_SIZE);
            check(status == PDCP_OK, "the request was refused");
            job->app->work = true;
            (void)arb_app_step(job->app, now_ms(job));
            take(job, &use_bulk);
            take(job, &size);
        }
        packet.data[1] = (uint8_t)(i % BULK_PACKETS);
        take(job, &packet);
    }
    check(job->sent->last.data[0] == (PDCP_BULK_DATA | PDCP_ANSWER), "a packet was not acknowledged");
    check(job->sent->last.data[1] == PDCP_SUCCESS, "a packet was refused");
}

static void do_channel_data(job_t *job, uint32_t count)
{
    const uint32_t before = job->app->arb.bus.stats[PDCP_STAT_CHANNEL_DATA];
    for (uint32_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        job->app->arb.bus.tables.channels[i].enabled =
            true; /* else their data is an unknown device's (D-BUS-36) */
    }
    for (uint32_t i = 0; i < count; i++) {
        const can_frame_t frame = {.id = (uint16_t)(PDCP_NODE_MAX - i % (2u * BENCH_DEVICES)), .dlc = 2};
        take(job, &frame);
    }
    check(job->app->arb.bus.stats[PDCP_STAT_CHANNEL_DATA] == before + count, "the ids are no outputs'");
}

static void do_foreign(job_t *job, uint32_t count)
{
    static const can_frame_t frame = {.id = FOREIGN_ID, .dlc = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    const uint32_t before = job->app->arb.bus.stats[PDCP_STAT_DROP_UNKNOWN_ID];
    for (uint32_t i = 0; i < count; i++) {
        take(job, &frame);
    }
    check(job->app->arb.bus.stats[PDCP_STAT_DROP_UNKNOWN_ID] == before + count, "the id is somebody's");
}

static void do_idle_step(job_t *job, uint32_t count)
{
    const uint32_t sent = job->sent->count;
    for (uint32_t i = 0; i < count; i++) {
        (void)arb_app_step(job->app, now_ms(job));
    }
    check(job->sent->count == sent, "something was due");
}

/* The longest piece of work that cannot be interrupted: the whole limb is looked through and taken up. */
static void do_profile_start(job_t *job, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        profile_start_begin(&job->app->limb.run, &job->app->arb, false);
    }
    check(job->app->limb.run.state == PROFILE_RUN_TO_PLAN, "no plan was begun");
}

typedef struct {
    const char *name;
    void (*run)(job_t *job, uint32_t count);
} thing_t;

static const thing_t things[] = {
    {"beacon", do_beacon},       {"beacon_in_time", do_beacon_in_time}, {"answer", do_answer},
    {"bulk", do_bulk},           {"channel_data", do_channel_data},     {"foreign", do_foreign},
    {"idle_step", do_idle_step}, {"profile_start", do_profile_start},
};

static const thing_t *find(const char *name)
{
    for (size_t i = 0; i < sizeof things / sizeof things[0]; i++) {
        if (strcmp(things[i].name, name) == 0) {
            return &things[i];
        }
    }
    return NULL;
}

int main(int argc, char **argv)
{
    static bench_bus_t bench;
    static sent_t sent;
    static const arb_port_t port = {.ctx = &sent,
                                    .can_send = can_send,
                                    .host_write = host_write,
                                    .nvm_write = nvm_write,
                                    .nvm_status = nvm_status};
    const thing_t *thing = argc == 3 ? find(argv[1]) : NULL;
    check(thing != NULL, "usage: bench_ir WHAT COUNT");
    check(bench_bus_start(&bench, BENCH_DEVICES), "a device cannot be");
    while (bench.now_us < SETTLE_US) {
        bench_bus_advance(&bench);
    }
    check(bench_bus_ready(&bench), "not every device is set up");
    bench.app.port = &port;
    bench.app.nvm.port = &port;
    job_t job = {&bench.app, &bench.log, &sent, bench.now_us};
    (void)arb_app_step(job.app, now_ms(&job));
    thing->run(&job, (uint32_t)strtoul(argv[2], NULL, 10));
    return 0;
}
