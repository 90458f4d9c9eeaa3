/* The rows of the table: what is sent, and what must hold. */
#include <string.h>

#include "flood.h"

enum { ANY = FLOOD_NEVER, IDS = 254 };

/* --- Frames --- */

static void put(can_frame_t *frame, uint16_t id, const uint8_t *data, uint8_t len)
{
    frame->id = id;
    frame->dlc = len;
    memcpy(frame->data, data, len);
}

static uint8_t random_id(flood_t *flood)
{
    return (uint8_t)(PDCP_NODE_MIN + flood_random(flood, IDS));
}

static bool make_bind_request(flood_t *flood, can_frame_t *frame)
{
    uint8_t data[7] = {PDCP_BIND_DEVICE};
    for (int i = 1; i < 7; i++) {
        data[i] = (uint8_t)flood_random(flood, 256);
    }
    put(frame, pdcp_can_id(PDCP_PRIORITY_BINDING, false, random_id(flood)), data, sizeof data);
    return true;
}

static bool make_id_0(flood_t *flood, can_frame_t *frame)
{
    static const uint8_t data[8] = {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55};
    (void)flood;
    put(frame, 0, data, sizeof data);
    return true;
}

static bool make_any(flood_t *flood, can_frame_t *frame)
{
    frame->id = (uint16_t)flood_random(flood, CAN_FRAME_ID_MAX + 1u);
    frame->dlc = (uint8_t)flood_random(flood, CAN_FRAME_DATA_MAX + 1u);
    for (int i = 0; i < frame->dlc; i++) {
        frame->data[i] = (uint8_t)flood_random(flood, 256);
    }
    return true;
}

/* A request to a part, in the name of its arbitrator. False: the part is not bound. */
static bool forge(const flood_t *flood, can_frame_t *frame, int part, const uint8_t *data, uint8_t len)
{
    const uint8_t id = flood_node_id(flood, part);
    put(frame, pdcp_can_id(PDCP_PRIORITY_NORMAL, true, id), data, len);
    return id != 0;
}

/* Anything that an arbitrator may ask of a part: codes 03 to 0F, any parameter of any channel. */
static bool make_request(flood_t *flood, can_frame_t *frame)
{
    const uint8_t len = (uint8_t)(1 + flood_random(flood, 7));
    uint8_t data[7];
    data[0] = (uint8_t)(PDCP_GET_PARAMETER + flood_random(flood, 13));
    data[1] = (uint8_t)flood_random(flood, 13);
    data[2] = (uint8_t)flood_random(flood, 6);
    for (int i = 3; i < 7; i++) {
        data[i] = (uint8_t)flood_random(flood, 256);
    }
    return forge(flood, frame, (int)flood_random(flood, 3), data, len);
}

/* Does a part of the limb, or one of its outputs, have this id? */
static bool is_ours(const flood_t *flood, uint8_t id)
{
    for (int part = 0; part < FLOOD_PARTS; part++) {
        const limb_part_t *each = &flood->limb.parts[part];
        if (each->node == NULL) {
            continue;
        }
        for (uint8_t i = 1; i <= each->ini->desc.channel_count; i++) {
            if (flood_output_id(flood, part, i) == id) {
                return true;
            }
        }
        if (flood_node_id(flood, part) == id) {
            return true;
        }
    }
    return false;
}

static bool make_unknown_beacon(flood_t *flood, can_frame_t *frame)
{
    static const uint8_t data[1] = {PDCP_BEACON};
    uint8_t id = (uint8_t)(PDCP_NODE_MIN + flood->turn % IDS);
    while (is_ours(flood, id)) {
        id = random_id(flood);
    }
    put(frame, pdcp_can_id(PDCP_PRIORITY_HIGH, false, id), data, sizeof data);
    return true;
}

static bool make_foreign_beacon(flood_t *flood, can_frame_t *frame)
{
    static const uint8_t data[1] = {PDCP_BEACON};
    (void)flood;
    put(frame, pdcp_can_id(PDCP_PRIORITY_HIGH, true, PDCP_NODE_BROADCAST), data, sizeof data);
    return true;
}

static bool make_reset(flood_t *flood, can_frame_t *frame)
{
    static const int parts[] = {FLOOD_CONTROLLER, FLOOD_SENSOR, FLOOD_HAND};
    static const uint8_t data[1] = {PDCP_RESET};
    return forge(flood, frame, parts[flood->turn % 3], data, sizeof data);
}

static bool make_suspend(flood_t *flood, can_frame_t *frame)
{
    static const uint8_t data[3] = {PDCP_SUSPEND, 0, 0}; /* until released */
    return forge(flood, frame, (int)(flood->turn % 3), data, sizeof data);
}

static bool make_disabled(flood_t *flood, can_frame_t *frame)
{
    static const struct {
        int part;
        uint8_t channel;
    } ends[] = {{FLOOD_SENSOR, 1},     {FLOOD_HAND, 1},       {FLOOD_CONTROLLER, 5},
                {FLOOD_CONTROLLER, 2}, {FLOOD_CONTROLLER, 3}, {FLOOD_HAND, 2}};
    const unsigned k = flood->turn % (sizeof ends / sizeof ends[0]);
    const uint8_t data[4] = {PDCP_SET_PARAMETER, PDCP_CH_ENABLED, ends[k].channel, 0};
    return forge(flood, frame, ends[k].part, data, sizeof data);
}

/* The hand is to hear the sensor; the controller is to hear an id that nobody has. */
static bool make_other_source(flood_t *flood, can_frame_t *frame)
{
    static const struct {
        int part;
        uint8_t channel;
    } inputs[] = {{FLOOD_HAND, 1}, {FLOOD_HAND, 2}, {FLOOD_CONTROLLER, 2}};
    const unsigned k = flood->turn % (sizeof inputs / sizeof inputs[0]);
    const bool hand = inputs[k].part == FLOOD_HAND;
    const uint8_t data[5] = {PDCP_SET_PARAMETER, PDCP_IN_SOURCE_NODES, inputs[k].channel,
                             flood_node_id(flood, FLOOD_SENSOR),
                             hand ? flood_output_id(flood, FLOOD_SENSOR, 1) : 100};
    return forge(flood, frame, inputs[k].part, data, sizeof data);
}

/* What the sensor would say, and it does not. */
static bool make_data(flood_t *flood, can_frame_t *frame)
{
    static const uint8_t data[1] = {0xFF};
    const uint8_t id = flood_output_id(flood, FLOOD_SENSOR, 1);
    put(frame, pdcp_can_id(PDCP_PRIORITY_HIGH, false, id), data, sizeof data);
    return id != 0;
}

/* --- Scripts --- */

/* The sensor's plug is loose. It is given up, a spare one takes its place, and then its plug has contact
 * again. */
static void loose_plug(flood_t *flood, uint32_t ms)
{
    if (ms == 0) {
        flood_loosen(flood);
    } else if (ms == 12000) {
        limb_power_on(&flood->limb, FLOOD_SPARE);
    } else if (ms == 14000) {
        flood_fasten(flood);
    }
}

/* The same, and the contact bounces: what the arbitrator says to the unknown device at once is not heard. */
static void bouncing_plug(flood_t *flood, uint32_t ms)
{
    loose_plug(flood, ms);
    if (ms == 14001) {
        flood_loosen(flood);
    } else if (ms == 14050) {
        flood_fasten(flood);
    }
}

/* A sensor that beacons once in 10 s goes on streaming while the arbitrator is replaced and a new sensor
 * comes. */
static void restart(flood_t *flood, uint32_t ms)
{
    static const uint8_t slow[5] = {PDCP_SET_PARAMETER, PDCP_DEV_BEACON_INTERVAL, 0, 0x10, 0x27};
    can_frame_t frame = {.kind = CAN_FRAME_BASE};
    if (ms == 0 && forge(flood, &frame, FLOOD_SENSOR, slow, sizeof slow)) {
        (void)sim_bus_send(&flood->limb.world.bus, flood->port, &frame);
    } else if (ms == 900) {
        limb_stop_arbitrator(&flood->limb);
        limb_start_arbitrator(&flood->limb);
        limb_power_on(&flood->limb, FLOOD_SPARE);
        flood_note_act(flood);
    }
}

/* --- The table --- */

const flood_row_t flood_rows[] = {
    {.name = "nothing", .what = "nothing", .limits = {20, 0, 0, 0, 0, 100, 100, 100}},
    {.name = "bind",
     .what = "5,000 bind requests a second, random identities",
     .make = make_bind_request,
     .interval_us = 200,
     .limits = {50, 0, 0, 0, 0, 100, 5000, ANY}},
    {.name = "bind-40",
     .what = "40 bind requests once, then new parts",
     .make = make_bind_request,
     .interval_us = 200,
     .count = 40,
     .limits = {20, 0, 0, 0, 0, 100, 2000, 2000}},
    {.name = "bind-minute",
     .what = "1.6 new identities a second for a minute",
     .make = make_bind_request,
     .interval_us = 625000,
     .duration_ms = 60000,
     .limits = {20, 0, 0, 0, 0, 80, 100, 2000}},
    {.name = "id-0",
     .what = "frames of id 0, the bus is full",
     .make = make_id_0,
     .limits = {ANY, 0, 0, 3000, 2000, 80, ANY, ANY}},
    {.name = "random",
     .what = "2,000 random frames a second",
     .make = make_any,
     .interval_us = 500,
     .limits = {ANY, 0, ANY, 10000, ANY, 100, ANY, ANY}},
    {.name = "random-full",
     .what = "random frames, the bus is full",
     .make = make_any,
     .limits = {ANY, 0, ANY, 10000, ANY, 100, ANY, ANY}},
    {.name = "requests",
     .what = "100 random requests a second to the parts",
     .make = make_request,
     .interval_us = 10000,
     .limits = {ANY, ANY, 0, 10000, 2500, 100, ANY, ANY}},
    {.name = "unknown",
     .what = "1,000 beacons of unknown ids a second",
     .make = make_unknown_beacon,
     .interval_us = 1000,
     .limits = {50, 0, 0, 0, 0, 80, 2000, 2000}},
    {.name = "reset-once",
     .what = "a forged Reset, once",
     .make = make_reset,
     .interval_us = 100000,
     .count = 1,
     .limits = {2000, 0, 0, 2000, ANY, 80, 100, 100}},
    {.name = "reset",
     .what = "10 forged Resets a second",
     .make = make_reset,
     .interval_us = 100000,
     .limits = {ANY, 0, 0, 10000, ANY, 100, ANY, ANY}},
    {.name = "suspend-once",
     .what = "a forged Suspend, once",
     .make = make_suspend,
     .interval_us = 100000,
     .count = 1,
     .limits = {ANY, 0, 0, 2000, 2000, 80, 100, 100}},
    {.name = "suspend",
     .what = "10 forged Suspends a second",
     .make = make_suspend,
     .interval_us = 100000,
     .limits = {ANY, 0, 0, 5000, 5000, 80, 2000, 2000}},
    {.name = "disabled-once",
     .what = "a forged transfer enabled = 0, once",
     .make = make_disabled,
     .interval_us = 100000,
     .count = 1,
     .limits = {ANY, 0, 0, 5000, 5000, 80, 100, 100}},
    {.name = "disabled",
     .what = "10 forged transfer enabled = 0 a second",
     .make = make_disabled,
     .interval_us = 100000,
     .limits = {ANY, 0, 0, ANY, 5000, 80, 2000, 2000}},
    {.name = "source-once",
     .what = "a forged parameter 7 to the hand, once",
     .make = make_other_source,
     .interval_us = 100000,
     .count = 1,
     .limits = {ANY, 500, 0, 5000, 5000, 80, 100, 100}},
    /* Nothing takes the place of the links that are given up (D-PRO-26). */
    {.name = "source",
     .what = "10 forged parameters 7 a second",
     .make = make_other_source,
     .interval_us = 100000,
     .limits = {ANY, ANY, 0, ANY, 5000, 80, 2000, 2000}},
    {.name = "data",
     .what = "100 forged values a second on the sensor's output id",
     .make = make_data,
     .interval_us = 10000,
     .limits = {50, 0, ANY, 0, 0, 80, 100, 100}},
    {.name = "power-up",
     .what = "nothing, at power-up",
     .at_power_up = true,
     .limits = {700, 0, 0, 700, 0, 100, 1500, 1500}},
    {.name = "arbitrator-power-up-once",
     .what = "a foreign arbitrator's beacon at power-up, once",
     .make = make_foreign_beacon,
     .interval_us = 500000,
     .first_ms = 300,
     .count = 1,
     .at_power_up = true,
     .limits = {2000, 0, 0, 2000, 0, 100, 3000, 3000}},
    {.name = "arbitrator-power-up",
     .what = "a foreign arbitrator's beacon every 500 ms from power-up on",
     .make = make_foreign_beacon,
     .interval_us = 500000,
     .first_ms = 300,
     .at_power_up = true,
     .limits = {ANY, 0, 0, 5000, 0, 100, ANY, ANY}},
    {.name = "arbitrator-once",
     .what = "a foreign arbitrator's beacon later, once",
     .make = make_foreign_beacon,
     .interval_us = 500000,
     .count = 1,
     .limits = {20, 0, 0, 0, 0, 80, 1000, 1000}},
    {.name = "arbitrator",
     .what = "a foreign arbitrator's beacon every 500 ms, later",
     .make = make_foreign_beacon,
     .interval_us = 500000,
     .limits = {20, 0, 0, 0, 0, 80, 1000, 1000}},
    {.name = "loose-plug",
     .what = "a sensor's plug is loose for 14 s; a new sensor comes after 12 s",
     .duration_ms = 20000,
     .alone = true,
     .script = loose_plug,
     .limits = {ANY, 0, 0, 5000, ANY, 80, ANY, ANY}},
    {.name = "bouncing-plug",
     .what = "the same, and the contact bounces once",
     .duration_ms = 20000,
     .alone = true,
     .script = bouncing_plug,
     .limits = {ANY, 0, 0, 5000, ANY, 80, ANY, ANY}},
    {.name = "restart",
     .what =
         "the arbitrator restarts and a new sensor comes while a sensor that beacons once in 10 s streams on",
     .duration_ms = 20000,
     .alone = true,
     .script = restart,
     .limits = {ANY, 0, 0, ANY, ANY, ANY, ANY, ANY}},
};

const int flood_row_count = (int)(sizeof flood_rows / sizeof flood_rows[0]);
