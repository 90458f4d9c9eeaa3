#include "sim_world.h"

#include <string.h>

enum { TURNS_MAX = 1000 }; /* of the application at one time: more is an error of its own */

void sim_world_init(sim_world_t *world, uint64_t now_us, uint32_t clock_ms)
{
    memset(world, 0, sizeof *world);
    sim_bus_init(&world->bus);
    world->now_us = now_us;
    world->start_us = now_us;
    world->clock_ms = clock_ms;
    world->app_next_us = SIM_BUS_NEVER;
}

static uint32_t ms_at(const sim_world_t *world, uint64_t time_us)
{
    return world->clock_ms + (uint32_t)((time_us - world->start_us) / 1000u);
}

uint32_t sim_world_ms(const sim_world_t *world)
{
    return ms_at(world, world->now_us);
}

void sim_world_touch_app(sim_world_t *world)
{
    world->app_next_us = world->now_us;
}

static void node_receives(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    sim_world_member_t *member = ctx;
    sim_node_on_frame(member->node, time_us, frame);
    member->next_us = time_us;
}

static void app_receives(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    sim_world_t *world = ctx;
    arb_app_on_frame(world->app, ms_at(world, time_us), frame);
    world->app_next_us = time_us;
}

bool sim_world_add(sim_world_t *world, sim_node_t *node)
{
    for (int i = 0; i < SIM_WORLD_NODES_MAX; i++) {
        sim_world_member_t *member = &world->members[i];
        if (member->node == NULL) {
            member->port = sim_bus_attach(&world->bus, node_receives, member);
            if (member->port < 0) {
                return false;
            }
            member->world = world;
            member->node = node;
            member->next_us = world->now_us;
            return true;
        }
    }
    return false;
}

void sim_world_remove(sim_world_t *world, sim_node_t *node)
{
    for (int i = 0; i < SIM_WORLD_NODES_MAX; i++) {
        if (world->members[i].node == node) {
            sim_bus_detach(&world->bus, world->members[i].port);
            world->members[i].node = NULL;
        }
    }
}

void sim_world_cut(sim_world_t *world, const sim_node_t *node, bool cut)
{
    for (int i = 0; i < SIM_WORLD_NODES_MAX; i++) {
        if (node != NULL && world->members[i].node == node) {
            sim_bus_cut(&world->bus, world->members[i].port, cut);
        }
    }
}

const sim_node_t *sim_world_node_at(const sim_world_t *world, int port)
{
    for (int i = 0; i < SIM_WORLD_NODES_MAX; i++) {
        if (world->members[i].node != NULL && world->members[i].port == port) {
            return world->members[i].node;
        }
    }
    return NULL;
}

bool sim_world_set_app(sim_world_t *world, arb_app_t *app)
{
    if (world->app != NULL) {
        sim_bus_detach(&world->bus, world->app_port);
        world->app_next_us = SIM_BUS_NEVER;
    }
    world->app = app;
    if (app == NULL) {
        return true;
    }
    world->app_port = sim_bus_attach(&world->bus, app_receives, world);
    sim_world_touch_app(world);
    return world->app_port >= 0;
}

bool sim_world_send(sim_world_t *world, const can_frame_t *frame)
{
    return sim_bus_send(&world->bus, world->app_port, frame);
}

static void step_member(sim_world_t *world, sim_world_member_t *member, uint64_t now_us)
{
    can_frame_t frame;
    member->next_us = sim_node_step(member->node, now_us);
    while (sim_node_tx_peek(member->node, &frame) && sim_bus_send(&world->bus, member->port, &frame)) {
        sim_node_tx_pop(member->node);
    }
}

/* The application's processor is as fast as it has to be: what goes on at once takes no time. */
static void step_app(sim_world_t *world, uint64_t now_us)
{
    const uint32_t now_ms = ms_at(world, now_us);
    int32_t wait_ms;
    int turns = 0;
    do {
        wait_ms = (int32_t)(arb_app_step(world->app, now_ms) - now_ms);
        turns++;
    } while (wait_ms <= 0 && turns < TURNS_MAX);
    const uint64_t tick_us = now_us - (now_us - world->start_us) % 1000u;
    world->app_next_us = wait_ms > 0 ? tick_us + (uint64_t)wait_ms * 1000u : tick_us + 1000u;
}

static bool has_frames(const sim_world_member_t *member)
{
    can_frame_t frame;
    return sim_node_tx_peek(member->node, &frame);
}

/* Steps everybody who is due at now_us, and who had no room in his port before. */
static void step_members(sim_world_t *world, uint64_t now_us)
{
    for (int i = 0; i < SIM_WORLD_NODES_MAX; i++) {
        sim_world_member_t *member = &world->members[i];
        if (member->node != NULL && (member->next_us <= now_us || has_frames(member))) {
            step_member(world, member, now_us);
        }
    }
    const bool refused = world->app != NULL && pdcp_arb_tx_peek(&world->app->arb) != NULL;
    if (world->app != NULL && (world->app_next_us <= now_us || refused)) {
        step_app(world, now_us);
    }
}

static uint64_t next_member_us(const sim_world_t *world)
{
    uint64_t next_us = world->app_next_us;
    for (int i = 0; i < SIM_WORLD_NODES_MAX; i++) {
        if (world->members[i].node != NULL && world->members[i].next_us < next_us) {
            next_us = world->members[i].next_us;
        }
    }
    return next_us;
}

uint64_t sim_world_run(sim_world_t *world, uint64_t now_us)
{
    for (;;) {
        uint64_t next_us = sim_bus_step(&world->bus, world->now_us);
        const uint64_t member_us = next_member_us(world);
        next_us = member_us < next_us ? member_us : next_us;
        if (next_us > now_us) {
            world->now_us = now_us;
            return next_us;
        }
        if (next_us > world->now_us) {
            world->now_us = next_us;
            (void)sim_bus_step(&world->bus, world->now_us);
        }
        step_members(world, world->now_us);
    }
}
