#include "flood.h"

#include <stdio.h>
#include <string.h>

#include "arb_hostcodec.h"
#include "pdcp_bytes.h"
#include "unity.h"

enum {
    FLOWING_MS = 50,     /* a link flows if its last value is not older */
    UNTRUE_MS = 100,     /* and is listed untruly as active if it is older than this */
    LOOK_MS = 10,        /* between two looks at the whole */
    ASK_MS = 50,         /* between two questions of the host */
    ARRIVAL_MS = 100,    /* known and new part, from the start of the attack */
    FORGOTTEN_MS = 15000 /* a lost part has no place any more */
};

#define LINKS "1.1>2.2 2.3>3.1 2.5>3.2"

static const struct {
    int from;
    uint8_t output;
    int to;
    uint8_t input;
} links[FLOOD_LINKS] = {{FLOOD_SENSOR, 1, FLOOD_CONTROLLER, 2},
                        {FLOOD_CONTROLLER, 3, FLOOD_HAND, 1},
                        {FLOOD_CONTROLLER, 5, FLOOD_HAND, 2}};

static const struct {
    uint16_t serial;
    const char *channels;
    const char *more;
} parts[FLOOD_PARTS] = {
    [FLOOD_SENSOR] = {4, "out 5000 2120, signal = sine 0 255 2000, rate_ms = 10", ""},
    [FLOOD_CONTROLLER] = {5,
                          "in 7200 2200; in 5200 2110; out 5000 1100, required = 2, signal = copy 2;"
                          "out 5000 1210, required = 1, signal = copy 1;"
                          "out 7000 1220, required = 2, signal = copy 2",
                          ""},
    [FLOOD_HAND] = {6, "in 5300 1110, terminal_profile = 0x1110; in 7300 1220, terminal_profile = 0x1220",
                    ""},
    [FLOOD_KNOWN] = {20, "in 5000 4000", ""},
    [FLOOD_NEW] = {21, "in 5000 4000", ""},
    [FLOOD_SPARE] = {7, "out 5000 2122, signal = sine 0 255 1000, rate_ms = 10", ""},
};

uint32_t flood_random(flood_t *flood, uint32_t below)
{
    flood->random ^= flood->random << 13;
    flood->random ^= flood->random >> 17;
    flood->random ^= flood->random << 5;
    return (flood->random >> 8) % below;
}

static const pdcp_device_t *device_of(const flood_t *flood, int part)
{
    return sim_node_device(flood->limb.parts[part].node);
}

uint8_t flood_node_id(const flood_t *flood, int part)
{
    return pdcp_device_node_id(device_of(flood, part));
}

uint8_t flood_output_id(const flood_t *flood, int part, uint8_t index)
{
    return pdcp_device_channel(device_of(flood, part), index)->node_id;
}

static int32_t ms_since(const flood_t *flood, uint64_t from_us)
{
    return (int32_t)((flood->limb.world.now_us - from_us) / 1000u);
}

/* --- Values: who has sent what an input takes --- */

/* The part at a port; -1: it is the arbitrator's, or the attacker's. */
static int part_at(const flood_t *flood, int port)
{
    for (int i = 0; i < SIM_WORLD_NODES_MAX; i++) {
        const sim_world_member_t *member = &flood->limb.world.members[i];
        for (int part = 0; member->node != NULL && member->port == port && part < FLOOD_PARTS; part++) {
            if (flood->limb.parts[part].node == member->node) {
                return part;
            }
        }
    }
    return -1;
}

static void note_value(flood_t *flood, int part, uint8_t input, int sender, uint8_t id)
{
    const pdcp_device_source_t *source = pdcp_device_source(device_of(flood, part), input);
    const bool named = sender >= 0 && source->identity.sn == parts[sender].serial && source->channel != 0 &&
                       source->channel <= flood->limb.parts[sender].ini->desc.channel_count &&
                       flood_output_id(flood, sender, source->channel) == id;
    for (int i = 0; i < FLOOD_LINKS; i++) {
        if (named && links[i].to == part && links[i].input == input) {
            const int32_t gap_ms = ms_since(flood, flood->right_us[i]);
            flood->result.gap_ms[i] = gap_ms > flood->result.gap_ms[i] ? gap_ms : flood->result.gap_ms[i];
            flood->right_us[i] = flood->limb.world.now_us;
        }
    }
    if (flood->counting && !named) {
        *(sender < 0 ? &flood->result.forged : &flood->result.foreign) += 1;
    }
}

/* Which inputs take this frame of channel data (pdcp-bus.md 10)? It is about to be delivered to all ports but
 * its sender's. */
static void note_data(flood_t *flood, const can_frame_t *frame, int sender)
{
    const uint8_t id = pdcp_id_node(frame->id);
    for (int part = 0; part < FLOOD_PARTS; part++) {
        const limb_part_t *each = &flood->limb.parts[part];
        const bool hears = each->node != NULL && part != sender && !(part == FLOOD_SENSOR && flood->loose);
        bool taken = false;
        for (uint8_t i = 1; hears && id != 0 && i <= each->ini->desc.channel_count; i++) {
            const pdcp_device_channel_t *channel = pdcp_device_channel(device_of(flood, part), i);
            if (pdcp_device_state(device_of(flood, part)) == PDCP_DEVICE_BOUND && channel->enabled &&
                each->ini->desc.channels[i - 1].direction == PDCP_INPUT && channel->source_channel == id) {
                note_value(flood, part, i, sender, id);
                taken = true;
            }
        }
        flood->taken[part] += taken ? 1u : 0u;
    }
}

/* The line's fault function: it sees every frame before anybody receives it, and loses none. */
static bool see_frame(void *ctx, const can_frame_t *frame)
{
    flood_t *flood = ctx;
    TEST_ASSERT_TRUE_MESSAGE(flood->wire_end_us == flood->limb.world.bus.frame_end_us,
                             "nobody saw who sends this");
    if (frame->kind == CAN_FRAME_BASE && !pdcp_id_from_arbitrator(frame->id) &&
        pdcp_id_priority(frame->id) != PDCP_PRIORITY_BINDING && frame->dlc <= CAN_FRAME_DATA_MAX) {
        note_data(flood, frame, part_at(flood, flood->wire_port));
    }
    return false;
}

/* The devices' own counts agree with what was seen. */
static void check_taken(const flood_t *flood)
{
    for (int part = FLOOD_SENSOR; part <= FLOOD_HAND; part++) {
        TEST_ASSERT_EQUAL_MESSAGE(flood->taken[part],
                                  pdcp_device_stats(device_of(flood, part))->data_in -
                                      flood->taken_before[part],
                                  "a device took other frames than were seen");
    }
}

/* --- Time: from one event of the world to the next, so that every frame is seen while it is on the wire
 * --- */

static uint64_t step_world(flood_t *flood, uint64_t to_us)
{
    const sim_bus_t *bus = &flood->limb.world.bus;
    const uint64_t next_us = sim_world_run(&flood->limb.world, to_us);
    if (bus->sender >= 0) {
        flood->wire_end_us = bus->frame_end_us;
        flood->wire_port = bus->sender;
    }
    return next_us;
}

static bool is_over(const flood_t *flood)
{
    const flood_row_t *row = flood->row;
    const uint32_t duration_ms = row->duration_ms != 0 ? row->duration_ms : (uint32_t)FLOOD_WINDOW_MS;
    return row->make == NULL || (row->count != 0 && flood->turn >= row->count) ||
           flood->limb.world.now_us >= flood->begin_us + duration_ms * 1000u;
}

static void send_one(flood_t *flood)
{
    can_frame_t frame = {.kind = CAN_FRAME_BASE};
    if (flood->row->make(flood, &frame)) {
        (void)sim_bus_send(&flood->limb.world.bus, flood->port, &frame);
        flood->last_us = flood->limb.world.now_us;
    }
    flood->turn++;
}

/* Sends what is due. */
static void attack(flood_t *flood)
{
    const flood_row_t *row = flood->row;
    if (is_over(flood)) {
        flood->next_us = SIM_BUS_NEVER;
    } else if (row->interval_us == 0) {
        while (flood->limb.world.bus.ports[flood->port].queued < 2) {
            send_one(flood);
        }
        flood->next_us = flood->limb.world.now_us + 20u; /* sooner than the shortest frame ends */
    } else {
        send_one(flood);
        flood->next_us += row->interval_us;
    }
}

static void run_to(flood_t *flood, uint64_t end_us)
{
    while (flood->limb.world.now_us < end_us) {
        uint64_t next_us = step_world(flood, flood->limb.world.now_us);
        next_us = next_us < end_us ? next_us : end_us;
        next_us = next_us < flood->next_us ? next_us : flood->next_us;
        if (next_us > flood->limb.world.now_us) {
            (void)step_world(flood, next_us);
        }
        if (flood->limb.world.now_us >= flood->next_us) {
            attack(flood);
        }
    }
}

/* --- What the host is told --- */

static void ask_for_links(flood_t *flood)
{
    limb_t *limb = &flood->limb;
    limb->answer_len = 0;
    for (int number = 1; number <= FLOOD_LINKS + 1; number++) {
        uint8_t bytes[ARB_HOST_HEADER + 1 + ARB_HOST_CRC];
        bytes[ARB_HOST_HEADER] = (uint8_t)number;
        const uint16_t len = arb_hostcodec_finish(bytes, ARB_MSG_LINK_INFO, (uint8_t)number, 1);
        (void)arb_app_on_bytes(&limb->app, sim_world_ms(&limb->world), bytes, len);
    }
    sim_world_touch_app(&limb->world);
}

static bool is_channel(const uint8_t *chan, int part, uint8_t index)
{
    return chan[0] == 2 && chan[2] == 2 && chan[4] == parts[part].serial && chan[5] == 0 && chan[6] == index;
}

/* 220Eh: output chan, input chan, status. */
static void take_link(const uint8_t *payload, bool active[FLOOD_LINKS])
{
    for (int i = 0; i < FLOOD_LINKS; i++) {
        if (is_channel(&payload[7], links[i].to, links[i].input) &&
            is_channel(&payload[0], links[i].from, links[i].output) && payload[14] == PDCP_LINK_ACTIVE) {
            active[i] = true;
        }
    }
}

static void read_links(flood_t *flood)
{
    const limb_t *limb = &flood->limb;
    bool active[FLOOD_LINKS] = {false};
    size_t at = 0;
    while (at + ARB_HOST_HEADER <= limb->answer_len) {
        const uint8_t *message = &limb->answer[at];
        if (pdcp_bytes_get_u16(&message[2]) == ARB_MSG_LINK_INFO + 1) {
            take_link(&message[ARB_HOST_HEADER], active);
        }
        at += ARB_HOST_HEADER + pdcp_bytes_get_u16(&message[6]);
    }
    for (int i = 0; i < FLOOD_LINKS; i++) {
        if (active[i] && !flood->listed[i]) {
            flood->listed_us[i] = limb->world.now_us;
        }
        flood->listed[i] = active[i];
    }
}

/* --- Is the limb whole? --- */

static bool agrees(const flood_t *flood, int link)
{
    const pdcp_device_t *from = device_of(flood, links[link].from);
    const pdcp_device_t *to = device_of(flood, links[link].to);
    const pdcp_device_channel_t *output = pdcp_device_channel(from, links[link].output);
    const pdcp_device_channel_t *input = pdcp_device_channel(to, links[link].input);
    const pdcp_device_source_t *source = pdcp_device_source(to, links[link].input);
    return pdcp_device_state(from) == PDCP_DEVICE_BOUND && pdcp_device_state(to) == PDCP_DEVICE_BOUND &&
           output->enabled && input->enabled && input->source_channel == output->node_id &&
           input->source_device == pdcp_device_node_id(from) &&
           source->identity.sn == parts[links[link].from].serial && source->channel == links[link].output;
}

/* Input 1 and output 4 of the controller have no link. */
static bool others_are_silent(const flood_t *flood)
{
    const pdcp_device_t *controller = device_of(flood, FLOOD_CONTROLLER);
    return !pdcp_device_channel(controller, 1)->enabled && !pdcp_device_channel(controller, 4)->enabled;
}

static bool is_whole(const flood_t *flood)
{
    for (int i = 0; i < FLOOD_LINKS; i++) {
        if (!agrees(flood, i) || !flood->listed[i] || ms_since(flood, flood->right_us[i]) > FLOWING_MS) {
            return false;
        }
    }
    return others_are_silent(flood);
}

static void note_untruth(flood_t *flood)
{
    for (int i = 0; i < FLOOD_LINKS; i++) {
        const uint64_t since_us =
            flood->right_us[i] > flood->listed_us[i] ? flood->right_us[i] : flood->listed_us[i];
        const int32_t ms = ms_since(flood, since_us);
        if (flood->listed[i] && ms > UNTRUE_MS && ms > flood->result.untrue_ms) {
            flood->result.untrue_ms = ms;
        }
    }
}

/* An input of the hand keeps its last value until it goes to its safe one. */
static void note_stale(flood_t *flood)
{
    for (int i = 0; i < FLOOD_LINKS; i++) {
        const int32_t ms = ms_since(flood, flood->right_us[i]);
        if (links[i].to == FLOOD_HAND && !flood->limb.parts[FLOOD_HAND].safe[links[i].input] &&
            ms > flood->result.stale_ms) {
            flood->result.stale_ms = ms;
        }
    }
}

static void look(flood_t *flood)
{
    flood->whole = is_whole(flood);
    if (!flood->whole) {
        flood->unwhole_us = flood->limb.world.now_us;
    }
    note_untruth(flood);
}

/* --- Parts that come --- */

static void note_arrival(flood_t *flood, int part, int32_t *took_ms)
{
    if (flood->limb.parts[part].node != NULL && *took_ms == FLOOD_NEVER &&
        pdcp_device_state(device_of(flood, part)) == PDCP_DEVICE_BOUND) {
        *took_ms = ms_since(flood, flood->begin_us) - ARRIVAL_MS;
    }
}

void flood_loosen(flood_t *flood)
{
    sim_world_remove(&flood->limb.world, flood->limb.parts[FLOOD_SENSOR].node);
    flood->loose = true;
}

void flood_fasten(flood_t *flood)
{
    flood->loose = false;
    TEST_ASSERT_TRUE(sim_world_add(&flood->limb.world, flood->limb.parts[FLOOD_SENSOR].node));
    flood_note_act(flood);
}

void flood_note_act(flood_t *flood)
{
    flood->last_us = flood->limb.world.now_us;
}

/* --- A row --- */

static void pass_ms(flood_t *flood, uint32_t ms)
{
    limb_t *limb = &flood->limb;
    if (flood->loose) { /* what it would send fills its queue */
        (void)sim_node_step(limb->parts[FLOOD_SENSOR].node, limb->world.now_us);
    }
    if (ms == ARRIVAL_MS && !flood->row->alone) {
        limb_plug(limb, FLOOD_KNOWN, FLOOD_NEW);
    }
    if (ms % ASK_MS == 0) {
        ask_for_links(flood);
    }
    run_to(flood, limb->world.now_us + 1000u);
    if (ms % ASK_MS == LOOK_MS) {
        read_links(flood);
    }
    if (ms % LOOK_MS == 0) {
        look(flood);
    }
    note_arrival(flood, FLOOD_KNOWN, &flood->result.known_ms);
    note_arrival(flood, FLOOD_NEW, &flood->result.new_ms);
    note_stale(flood);
}

/* The limb links itself and is saved; the known part becomes known. */
static void make_limb(flood_t *flood)
{
    limb_t *limb = &flood->limb;
    limb_begin(limb, 1, 0xFFFFFFFFu - 30000u);
    limb->keeps = true;
    for (int part = 0; part < FLOOD_PARTS; part++) {
        (void)limb_add_with(limb, parts[part].serial, parts[part].channels, parts[part].more);
    }
    limb_want(limb, LINKS);
    limb_plug(limb, FLOOD_SENSOR, FLOOD_KNOWN);
    limb_await(limb, 2000);
    (void)limb_act(limb, ARB_ACTION_SAVE, 0);
    limb_run_ms(limb, FORGOTTEN_MS); /* its identity is stored, too */
    limb_power_off(limb, FLOOD_KNOWN);
    limb_run_ms(limb, FORGOTTEN_MS);
    limb_expect(limb, LINKS);
}

static void power_up(flood_t *flood)
{
    limb_stop_arbitrator(&flood->limb);
    limb_pull(&flood->limb, FLOOD_SENSOR, FLOOD_HAND);
    limb_run_ms(&flood->limb, 5000);
    limb_start_arbitrator(&flood->limb);
    limb_plug(&flood->limb, FLOOD_SENSOR, FLOOD_HAND);
}

static void begin(flood_t *flood)
{
    limb_t *limb = &flood->limb;
    flood->port = sim_bus_attach(&limb->world.bus, NULL, NULL);
    TEST_ASSERT_GREATER_OR_EQUAL(0, flood->port);
    if (flood->row->at_power_up) {
        power_up(flood);
    }
    limb->world.bus.fault = see_frame;
    limb->world.bus.fault_ctx = flood;
    if (limb->world.bus.sender >= 0) { /* a frame is on the wire just now */
        flood->wire_end_us = limb->world.bus.frame_end_us;
        flood->wire_port = limb->world.bus.sender;
    }
    flood->counting = true;
    flood->begin_us = limb->world.now_us;
    flood->last_us = limb->world.now_us;
    flood->unwhole_us = limb->world.now_us;
    flood->next_us =
        flood->row->make != NULL ? flood->begin_us + flood->row->first_ms * 1000u : SIM_BUS_NEVER;
    for (int i = 0; i < FLOOD_LINKS; i++) {
        flood->right_us[i] = flood->begin_us;
        flood->listed[i] = !flood->row->at_power_up;
    }
    limb->parts[FLOOD_HAND].safe[1] = flood->row->at_power_up; /* it has no value yet */
    limb->parts[FLOOD_HAND].safe[2] = flood->row->at_power_up;
    for (int part = FLOOD_SENSOR; part <= FLOOD_HAND; part++) {
        flood->taken_before[part] = pdcp_device_stats(device_of(flood, part))->data_in;
    }
}

static uint32_t refusals(const flood_t *flood)
{
    return flood->limb.events[PDCP_EVENT_REFUSED];
}

static void suffer(flood_t *flood)
{
    const uint32_t duration_ms =
        flood->row->duration_ms != 0 ? flood->row->duration_ms : (uint32_t)FLOOD_WINDOW_MS;
    const uint32_t writes = flood->limb.nvm.writes;
    const uint32_t refused = refusals(flood);
    for (uint32_t ms = 0; ms < duration_ms; ms++) {
        if (flood->row->script != NULL) {
            flood->row->script(flood, ms);
        }
        pass_ms(flood, ms);
    }
    for (int i = 0; i < FLOOD_LINKS; i++) { /* what still lasts */
        const int32_t gap_ms = ms_since(flood, flood->right_us[i]);
        flood->result.gap_ms[i] = gap_ms > flood->result.gap_ms[i] ? gap_ms : flood->result.gap_ms[i];
    }
    flood->result.pages = (int32_t)((flood->limb.nvm.writes - writes) * 100000u / duration_ms);
    flood->result.refusals = (int32_t)(refusals(flood) - refused);
}

static void recover(flood_t *flood)
{
    int32_t gap_ms[FLOOD_LINKS];
    memcpy(gap_ms, flood->result.gap_ms, sizeof gap_ms);
    for (uint32_t ms = 0; ms < FLOOD_WATCH_MS; ms++) {
        pass_ms(flood, ms + ARRIVAL_MS + 1);
    }
    memcpy(flood->result.gap_ms, gap_ms, sizeof gap_ms);
    if (!flood->whole) {
        flood->result.whole_ms = FLOOD_NEVER;
    } else if (flood->unwhole_us > flood->last_us) {
        flood->result.whole_ms = (int32_t)((flood->unwhole_us - flood->last_us) / 1000u);
    }
}

void flood_measure(flood_t *flood, const flood_row_t *row)
{
    memset(flood, 0, sizeof *flood);
    flood->row = row;
    flood->random = 2463534242u;
    flood->result.known_ms = FLOOD_NEVER;
    flood->result.new_ms = FLOOD_NEVER;
    make_limb(flood);
    begin(flood);
    suffer(flood);
    recover(flood);
    check_taken(flood);
    sim_bus_detach(&flood->limb.world.bus, flood->port);
    limb_end(&flood->limb);
}

/* --- The judge --- */

static int32_t worst_gap(const flood_result_t *result)
{
    int32_t worst_ms = 0;
    for (int i = 0; i < FLOOD_LINKS; i++) {
        worst_ms = result->gap_ms[i] > worst_ms ? result->gap_ms[i] : worst_ms;
    }
    return worst_ms;
}

void flood_judge(const flood_row_t *row, const flood_result_t *result, char *text, size_t size)
{
    const flood_limits_t *limits = &row->limits;
    const struct {
        const char *name;
        int32_t limit;
        int32_t value;
    } figures[] = {{"longest gap", limits->gap_ms, worst_gap(result)},
                   {"values of another part", limits->foreign, result->foreign},
                   {"forged values", limits->forged, result->forged},
                   {"whole again", limits->whole_ms, result->whole_ms},
                   {"listed untruly", limits->untrue_ms, result->untrue_ms},
                   {"pages", limits->pages, result->pages},
                   {"known part", row->alone ? FLOOD_NEVER : limits->known_ms, result->known_ms},
                   {"new part", row->alone ? FLOOD_NEVER : limits->new_ms, result->new_ms}};
    size_t used = 0;
    text[0] = '\0';
    for (size_t i = 0; i < sizeof figures / sizeof figures[0] && used < size; i++) {
        if (figures[i].limit != FLOOD_NEVER &&
            (figures[i].value == FLOOD_NEVER || figures[i].value > figures[i].limit)) {
            used += (size_t)snprintf(&text[used], size - used, "%s%s %d of at most %d", used == 0 ? "" : ", ",
                                     figures[i].name, (int)figures[i].value, (int)figures[i].limit);
        }
    }
}
