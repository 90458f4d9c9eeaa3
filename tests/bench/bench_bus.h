/* A full limb for measuring: up to 32 devices of the device role and the real application on the simulated
 * bus, in virtual time, all switched on at the same instant. Every processor answers at once: what is
 * measured is the protocol and the bus.
 *
 * Every device has 4 channels (1 and 2 inputs, 3 and 4 outputs) with all parameters of the specification, and
 * asks for a free node id of its own: device i (from 0) for i + 1. The arbitrator's controller has
 * BENCH_MAILBOXES transmit buffers. */
#ifndef BENCH_BUS_H
#define BENCH_BUS_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_app.h"
#include "pdcp_device.h"
#include "sim_bus.h"

#define BENCH_DEVICES 32
#define BENCH_CHANNELS 4
#define BENCH_MAILBOXES 3u /* as a small controller has them */
#define BENCH_ANSWERS_MAX 64
#define BENCH_NVM_SIZE 4096u

typedef struct bench_bus bench_bus_t;

typedef struct {
    bench_bus_t *bench;
    pdcp_device_desc_t desc;
    pdcp_device_t device;
    int port;
    bool touched; /* has received something since its last step */
    uint32_t next_ms;
} bench_member_t;

/* What was on the bus. Lengths in microseconds; own length: without the interframe space. */
typedef struct {
    uint32_t frames; /* all but beacons */
    uint32_t beacons;
    uint64_t own_us;       /* own lengths of frames */
    uint64_t bind_bus_us;  /* of bind requests and their answers, interframe space included */
    uint32_t bind_frames;  /* how many they are */
    uint64_t first_us;     /* start of the first frame that is no beacon */
    uint64_t last_us;      /* end of the last one */
    uint64_t bind_last_us; /* end of the last bind answer */
    uint64_t hold_us;      /* the bus was idle so long before the first bind answer: it is held (D-BUS-42) */
    can_frame_t answers[BENCH_ANSWERS_MAX]; /* of device 0 to the requests of its setup, in their order */
    uint32_t answer_count;
} bench_log_t;

struct bench_bus {
    sim_bus_t bus;
    uint64_t now_us;
    arb_port_t port;
    arb_app_t app;
    int app_port;
    bool app_touched;
    uint32_t app_next_ms;
    bench_log_t log;
    uint8_t member_count;
    bench_member_t members[BENCH_DEVICES];
    uint8_t nvm[BENCH_NVM_SIZE];
};

/* Switches everything on at time 0; devices: 1 to BENCH_DEVICES. False: a device cannot be. */
bool bench_bus_start(bench_bus_t *bench, uint8_t devices);

/* Milliseconds of all clocks. */
uint32_t bench_bus_ms(const bench_bus_t *bench);

/* Is every device set up? */
bool bench_bus_ready(const bench_bus_t *bench);

/* Carries everything on to the next event. */
void bench_bus_advance(bench_bus_t *bench);

#endif
