/* A limb in virtual time for tests: parts with the real device role on the simulated bus, the whole
 * application with a memory, and a host that speaks bytes. Parts can be pulled and plugged, and everything
 * switched off and on. */
#ifndef LIMB_H
#define LIMB_H

#include "arb_app.h"
#include "node_ini.h"
#include "sim_node.h"
#include "sim_nvm.h"
#include "sim_world.h"

enum { D1, D2, D3, LIMB_DEVICES };

enum { LIMB_PARTS_MAX = 40, LIMB_TEXT = 1024 };

/* What has happened at one place in time, for measuring. */
typedef struct {
    uint64_t time_us;
    uint64_t busy_us; /* of the bus, since the start */
} limb_moment_t;

typedef struct limb limb_t;

/* An input of a part, terminal or not, takes a value. The frame is being delivered: limb->world.bus.on_wire,
 * and .delivering is its sender's port. */
typedef void (*limb_taken_fn_t)(void *ctx, int part, uint8_t input);

typedef struct {
    limb_t *limb;
    node_ini_t *ini;
    sim_node_t *node; /* NULL: not plugged in */
    int received[PDCP_DEVICE_CHANNELS_MAX +
                 1]; /* by channel index; terminal inputs: values, safe ones left out */
    int32_t value[PDCP_DEVICE_CHANNELS_MAX + 1]; /* the last of them */
    bool safe[PDCP_DEVICE_CHANNELS_MAX + 1];     /* it has gone to its safe value since */
} limb_part_t;

struct limb {
    sim_world_t world;
    arb_app_t app;
    arb_port_t port;
    arb_settings_t settings; /* of the next limb_start_arbitrator */
    sim_nvm_t nvm;
    arb_port_t memory; /* the functions of nvm */
    limb_part_t parts[LIMB_PARTS_MAX];
    int count;
    uint32_t seed;
    bool keeps;               /* parts keep their writable parameters over power-off */
    limb_taken_fn_t on_taken; /* set by whoever wants to know; NULL: nobody */
    void *taken_ctx;
    char folder[64];                 /* where; "": not made yet */
    uint8_t last[PDCP_NODE_MAX + 1]; /* first byte of the data that an output's node id has sent last */
    uint32_t events[PDCP_EVENT_REQUEST + 1]; /* how often each kind has come */
    char wanted[LIMB_TEXT];                  /* links that limb_await waits for */
    limb_moment_t lost;                      /* the first loss, and */
    limb_moment_t ready;                     /* the last end of a setup since limb_want */
    limb_moment_t linked;                    /* and when the wanted links were there; 0: not yet */
    uint8_t answer[600];
    size_t answer_len;
};

/* An arbitrator with a blank memory, its clock at clock_ms, and no parts. */
void limb_begin(limb_t *limb, uint32_t seed, uint32_t clock_ms);

/* The same with the parts of acceptance system 2, plugged in, and an arbitrator that makes no links
 * unasked. */
void limb_start(limb_t *limb, uint32_t seed, uint32_t clock_ms);
void limb_end(limb_t *limb);

/* Describes one more part, not plugged in; returns its number, from 0. The file is that of pdcp-node; the
 * text gives its channels from 1 on, separated by `;`: direction, type and profile, then lines of
 * docs/nodes.md separated by
 * `,`: "in 5200 2110; out 5000 1100, required = 1, signal = copy 1". Outputs without a signal send a sine.
 * VID and PID are 2. `more` is put in front of the channels as it is. */
int limb_add_file(limb_t *limb, const char *path);
int limb_add(limb_t *limb, uint16_t serial, const char *channels);
int limb_add_with(limb_t *limb, uint16_t serial, const char *channels, const char *more);

void limb_power_on(limb_t *limb, int device);
void limb_power_off(limb_t *limb, int device);
void limb_plug(limb_t *limb, int first, int last); /* several */
void limb_pull(limb_t *limb, int first, int last);

/* The plug of a part is loose, or has contact again; its power stays on. */
void limb_cut(limb_t *limb, int device, bool cut);

/* The part whose port of the bus this is; -1: it is nobody's, or somebody else's. */
int limb_part_at(const limb_t *limb, int port);

/* A part that is not plugged in forgets its parameters. */
void limb_blank(limb_t *limb, int device);

void limb_start_arbitrator(limb_t *limb);
void limb_stop_arbitrator(limb_t *limb);
void limb_run_ms(limb_t *limb, uint32_t ms);

/* One request of the host, answered within 4 s; its payload stays in answer[8]. Returns the answer's id. */
uint16_t limb_ask(limb_t *limb, uint16_t id, const uint8_t *payload, uint16_t len);

/* 2307h; returns the answer's id. Channels by serial number and index. */
uint16_t limb_link(limb_t *limb, uint8_t out_sn, uint8_t out, uint8_t in_sn, uint8_t in);

/* 2407h, which must succeed; returns its result. */
uint16_t limb_act(limb_t *limb, arb_action_t action, uint8_t argument);

/* The links that work, as the arbitrator's tables have them: "1.1>2.2 2.3>3.1", output D1.1 to input D2.2 and
 * so on in the order of the inputs; parts count from 1. */
void limb_links(const limb_t *limb, char text[LIMB_TEXT]);

/* From now on these links are awaited, and what limb.lost, .ready and .linked tell is of now on. */
void limb_want(limb_t *limb, const char *links);

/* Waits until the wanted links are there, max_ms at most, and for what is under way to end; then nothing else
 * may be linked, and the devices must agree with the tables. */
void limb_await(limb_t *limb, uint32_t max_ms);

/* The links are these, and the devices agree: inputs and outputs of links are enabled and name each other,
 * all others are not enabled. Nothing may be under way. */
void limb_expect(limb_t *limb, const char *links);

/* Over all links values arrive. */
void limb_expect_flow(limb_t *limb);

#endif
