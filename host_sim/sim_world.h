/* A limb in memory: one simulated bus, the devices on it, and at most one arbitrator.
 *
 * Passive, like everything it holds: sim_world_run advances the world to a time, event by event, and returns
 * when the next event is due. The same world runs on the real clock (pdcpd --can sim) and on a virtual one
 * (tests). Others join the bus as further ports (sim_bus_attach). Times are microseconds; the arbitrator's
 * milliseconds are clock_ms at start_us and go on from there, so that a test can begin shortly before they
 * wrap. */
#ifndef SIM_WORLD_H
#define SIM_WORLD_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_app.h"
#include "sim_bus.h"
#include "sim_node.h"

#define SIM_WORLD_NODES_MAX 64

typedef struct sim_world sim_world_t;

typedef struct {
    sim_world_t *world;
    sim_node_t *node; /* NULL: this place is free */
    int port;
    uint64_t next_us;
} sim_world_member_t;

struct sim_world {
    sim_bus_t bus;
    uint64_t now_us;
    uint64_t start_us;
    uint32_t clock_ms;
    sim_world_member_t members[SIM_WORLD_NODES_MAX];
    arb_app_t *app; /* NULL: the bus has no arbitrator */
    int app_port;
    uint64_t app_next_us;
};

void sim_world_init(sim_world_t *world, uint64_t now_us, uint32_t clock_ms);

/* Puts a device on the bus or takes it off; the caller owns it. False: there is no place or port left. */
bool sim_world_add(sim_world_t *world, sim_node_t *node);
void sim_world_remove(sim_world_t *world, sim_node_t *node);

/* A device's plug is loose (cut), or has contact again: its power stays on (sim_bus_cut). */
void sim_world_cut(sim_world_t *world, const sim_node_t *node, bool cut);

/* The device at a port of the bus; NULL: somebody else's, or none. */
const sim_node_t *sim_world_node_at(const sim_world_t *world, int port);

/* Puts an arbitrator, already initialised at sim_world_ms, on the bus, or takes it off (NULL). Its port's
 * can_send must be sim_world_send for this world. False: no port is left. */
bool sim_world_set_app(sim_world_t *world, arb_app_t *app);
bool sim_world_send(sim_world_t *world, const can_frame_t *frame);

/* The arbitrator's milliseconds now. */
uint32_t sim_world_ms(const sim_world_t *world);

/* The arbitrator was given something from outside (host bytes): it is stepped in the next run. */
void sim_world_touch_app(sim_world_t *world);

/* Carries the world on to now_us. Returns when the next event is due; SIM_BUS_NEVER: none is. */
uint64_t sim_world_run(sim_world_t *world, uint64_t now_us);

#endif
