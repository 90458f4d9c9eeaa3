/* A limb in virtual time for tests: the three devices of acceptance system 2 (profile-layer.md 6) with the
 * real device role on the simulated bus, the whole application, and a host that speaks bytes. */
#ifndef LIMB_H
#define LIMB_H

#include "arb_app.h"
#include "node_ini.h"
#include "sim_node.h"
#include "sim_world.h"

enum { D1, D2, D3, LIMB_DEVICES };

typedef struct {
    sim_world_t world;
    arb_app_t app;
    node_ini_t *inis[LIMB_DEVICES];
    sim_node_t *nodes[LIMB_DEVICES]; /* NULL: switched off */
    uint32_t seed;
    int received[3]; /* values at D3, by channel index */
    uint8_t answer[600];
    size_t answer_len;
    uint8_t memory[2048];
} limb_t;

/* Builds the limb, everything switched on, the arbitrator's clock at clock_ms. */
void limb_start(limb_t *limb, uint32_t seed, uint32_t clock_ms);
void limb_end(limb_t *limb);

void limb_power_on(limb_t *limb, int device);
void limb_power_off(limb_t *limb, int device);
void limb_start_arbitrator(limb_t *limb);
void limb_run_ms(limb_t *limb, uint32_t ms);

/* One request of the host, answered within 4 s; its payload stays in answer[8]. Returns the answer's id. */
uint16_t limb_ask(limb_t *limb, uint16_t id, const uint8_t *payload, uint16_t len);

/* 2307h; returns the answer's id. Channels by serial number and index. */
uint16_t limb_link(limb_t *limb, uint8_t out_sn, uint8_t out, uint8_t in_sn, uint8_t in);

#endif
