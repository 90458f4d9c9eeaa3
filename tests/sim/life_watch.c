/* What cannot be seen at the end of a life: values of a foreign source, flags that differ for too long, ids
 * that two have at once. Knows for each frame which part has sent it, and judges each value that an input
 * takes. */
#include <stdio.h>
#include <string.h>

#include "life.h"
#include "unity.h"

enum {
    /* So long after a change an input may still take values of the source that it had. The first write of a
     * change takes its transfer away: the request before it at this device may be the host's, which lasts 3 s
     * at most (D-API-16), and it is sent three times, 500 ms apart at most (D-BUS-13). */
    CHANGE_MS = 3000 + 3 * 500,
    /* So long two may have one id. An arbitrator that has just started does nothing about it for 1200 ms,
     * then waits for the next beacon (1500 ms at most in a life), whose Reset comes a second later if the
     * first one was lost (D-BUS-15). */
    TWINS_MS = 1200 + 1500 + 1000,
    LOOK_MS = 50,
    NOBODY = 0xFFFF,
    WHY = 100,
    TEXT = 160
};

/* Has more time passed since the later of two moments? */
static bool is_over(uint32_t now_ms, uint32_t since_ms, uint32_t calm_ms, uint32_t limit_ms)
{
    const uint32_t from_ms = since_ms > calm_ms ? since_ms : calm_ms;
    return now_ms > from_ms && now_ms - from_ms > limit_ms;
}

/* --- Who is who --- */

/* Parts with one identity are the same to everybody who reads names: the first of them stands for all. */
static int first_with(const limb_t *limb, const pdcp_identity_t *identity)
{
    for (int i = 0; i < limb->count; i++) {
        if (pdcp_identity_equal(&limb->parts[i].ini->desc.identity, identity)) {
            return i;
        }
    }
    return -1;
}

static uint16_t key_of(int part, uint8_t channel)
{
    return part < 0 ? (uint16_t)NOBODY : (uint16_t)((unsigned)part << 8 | channel);
}

static const pdcp_device_t *device_of(const life_watch_t *watch, int part)
{
    return sim_node_device(watch->limb->parts[part].node);
}

/* Bound, and on the bus. */
static bool is_bound(const life_watch_t *watch, int part)
{
    return watch->limb->parts[part].node != NULL && !watch->cut[part] &&
           pdcp_device_state(device_of(watch, part)) != PDCP_DEVICE_ASKING;
}

/* Since when nothing has kept the part from being told something, and from answering. */
static uint32_t calm_ms(const life_watch_t *watch, int part)
{
    return watch->rough_ms[part] > watch->all_rough_ms ? watch->rough_ms[part] : watch->all_rough_ms;
}

void life_watch_rough(life_watch_t *watch, int part, uint32_t until_ms)
{
    uint32_t *const rough_ms = part < 0 ? &watch->all_rough_ms : &watch->rough_ms[part];
    *rough_ms = until_ms > *rough_ms ? until_ms : *rough_ms;
}

static void complain(int part, unsigned channel, const char *why)
{
    char text[TEXT];
    (void)snprintf(text, sizeof text, "channel %d.%u: %s", part + 1, channel, why);
    TEST_FAIL_MESSAGE(text);
}

/* --- The sources that the tables name --- */

/* The oldest one makes room. */
static void remember(life_source_t recent[LIFE_RECENT], uint16_t key, uint32_t now_ms)
{
    int place = 0;
    for (int i = 0; i < LIFE_RECENT; i++) {
        if (recent[i].key == key) {
            place = i;
            break;
        }
        place = recent[i].until_ms < recent[place].until_ms ? i : place;
    }
    recent[place] = (life_source_t){key, now_ms};
}

static void take_source(life_watch_t *watch, int part, uint8_t input, uint16_t key, uint32_t now_ms)
{
    uint16_t *const named = &watch->named[part][input];
    if (*named != key) {
        if (*named != NOBODY) {
            remember(watch->recent[part][input], *named, now_ms);
        }
        *named = key;
    }
}

/* Reads what source each input has in the tables, or is about to have. */
static void read_tables(life_watch_t *watch, uint32_t now_ms)
{
    const limb_t *limb = watch->limb;
    const pdcp_tables_t *tables = &limb->app.arb.bus.tables;
    uint16_t keys[LIFE_PARTS_MAX][LIFE_CHANNELS_MAX + 1];
    int part_at[PDCP_DEVICES_MAX];
    memset(keys, 0xFF, sizeof keys);
    memset(watch->ready, 0, sizeof watch->ready);
    for (int i = 0; i < PDCP_DEVICES_MAX; i++) {
        const pdcp_device_entry_t *device = &tables->devices[i];
        part_at[i] = device->state != PDCP_PLACE_FREE ? first_with(limb, &device->identity) : -1;
        if (part_at[i] >= 0) {
            watch->ready[part_at[i]] = device->state == PDCP_PLACE_READY;
        }
    }
    for (int i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *input = &tables->channels[i];
        if (input->place == PDCP_NONE || input->transfer != PDCP_INPUT || input->link == PDCP_LINK_NONE ||
            input->source.channel >= PDCP_CHANNELS_MAX || part_at[input->place] < 0) {
            continue;
        }
        const pdcp_channel_t *output = &tables->channels[input->source.channel];
        if (output->place != PDCP_NONE) {
            keys[part_at[input->place]][input->index] = key_of(part_at[output->place], output->index);
        }
    }
    for (int part = 0; part < limb->count; part++) {
        for (uint8_t i = 1; i <= limb->parts[part].ini->desc.channel_count; i++) {
            take_source(watch, part, i, keys[part][i], now_ms);
        }
    }
}

/* --- Values --- */

/* Is the second source the first one? Who has sent a frame may have forgotten meanwhile as what: then it is
 * the part that counts. */
static bool is_same(uint16_t named, uint16_t key)
{
    return named == key || (named != NOBODY && (key & 0xFFu) == 0 && (named & 0xFF00u) == key);
}

static bool was_named(const life_watch_t *watch, int part, uint8_t input, uint16_t key, uint32_t now_ms)
{
    const life_source_t *recent = watch->recent[part][input];
    for (int i = 0; i < LIFE_RECENT; i++) {
        if (is_same(recent[i].key, key) &&
            !is_over(now_ms, recent[i].until_ms, calm_ms(watch, part), CHANGE_MS)) {
            return true;
        }
    }
    return is_same(watch->named[part][input], key);
}

/* Who cannot be told of another source, or was not yet, keeps the one that it was told of last. */
static bool is_told_of(const life_watch_t *watch, int part, uint8_t input, uint16_t key, uint32_t now_ms)
{
    const pdcp_device_source_t *source = pdcp_device_source(device_of(watch, part), input);
    const int first = first_with(watch->limb, &watch->limb->parts[part].ini->desc.identity);
    const uint32_t since_ms = calm_ms(watch, part);
    const bool untold = watch->limb->world.app == NULL || !watch->ready[first] ||
                        (since_ms != 0 && !is_over(now_ms, since_ms, 0, CHANGE_MS));
    return untold && is_same(key_of(first_with(watch->limb, &source->identity), source->channel), key);
}

/* The output of a part that sends with this id; 0: it has none. */
static uint8_t output_with(const life_watch_t *watch, int part, uint8_t id)
{
    const pdcp_device_desc_t *desc = &watch->limb->parts[part].ini->desc;
    for (uint8_t i = 1; i <= desc->channel_count; i++) {
        if (desc->channels[i - 1].direction == PDCP_OUTPUT &&
            pdcp_device_channel(device_of(watch, part), i)->node_id == id) {
            return i;
        }
    }
    return 0;
}

static void on_taken(void *ctx, int part, uint8_t input)
{
    life_watch_t *watch = ctx;
    const sim_bus_t *bus = &watch->limb->world.bus;
    const int sender = limb_part_at(watch->limb, bus->delivering);
    if (!watch->values || watch->forged_ms[part][input] > watch->now_ms || sender < 0) {
        return; /* frames of others than parts are forged */
    }
    const uint8_t output = output_with(watch, sender, pdcp_id_node(bus->on_wire.id));
    const pdcp_identity_t *identity = &watch->limb->parts[sender].ini->desc.identity;
    const uint16_t key = key_of(first_with(watch->limb, identity), output);
    const int first = first_with(watch->limb, &watch->limb->parts[part].ini->desc.identity);
    watch->taken++;
    if (!was_named(watch, first, input, key, watch->now_ms) &&
        !is_told_of(watch, part, input, key, watch->now_ms)) {
        char why[WHY];
        (void)snprintf(why, sizeof why, "takes values of %d.%u, which is not its source", sender + 1, output);
        complain(part, input, why);
    }
}

/* --- Frames of the arbitrator that the watch has to know --- */

/* The host has devices suspended and released through its arbitrator. */
static void note_suspend(life_watch_t *watch, const can_frame_t *frame)
{
    const uint8_t id = pdcp_id_node(frame->id);
    const uint8_t code = frame->dlc != 0 ? frame->data[0] : 0;
    if (code != PDCP_SUSPEND && code != PDCP_RELEASE) {
        return;
    }
    for (int part = 0; part < watch->limb->count; part++) {
        if (is_bound(watch, part) && (id == 0 || pdcp_device_node_id(device_of(watch, part)) == id)) {
            watch->suspended[part] = code == PDCP_SUSPEND;
        }
    }
}

void life_watch_frame(life_watch_t *watch, const can_frame_t *frame)
{
    const sim_world_t *world = &watch->limb->world;
    if (world->app == NULL) {
        return;
    }
    read_tables(watch, watch->now_ms);
    if (world->bus.delivering == world->app_port && pdcp_id_from_arbitrator(frame->id)) {
        note_suspend(watch, frame);
    }
}

/* --- Now and then --- */

/* Transfer enabled in the tables and in the devices. */
static void check_flags(life_watch_t *watch)
{
    const pdcp_tables_t *tables = &watch->limb->app.arb.bus.tables;
    bool differs[LIFE_PARTS_MAX][LIFE_CHANNELS_MAX + 1] = {{false}};
    for (int i = 0; i < PDCP_CHANNELS_MAX && watch->limb->world.app != NULL; i++) {
        const pdcp_channel_t *channel = &tables->channels[i];
        if (channel->place == PDCP_NONE || tables->devices[channel->place].state != PDCP_PLACE_READY) {
            continue;
        }
        const int part = first_with(watch->limb, &tables->devices[channel->place].identity);
        if (part >= 0 && is_bound(watch, part) &&
            pdcp_device_channel(device_of(watch, part), channel->index)->enabled != channel->enabled) {
            differs[part][channel->index] = true;
        }
    }
    for (int part = 0; part < watch->limb->count; part++) {
        for (uint8_t i = 1; i <= watch->limb->parts[part].ini->desc.channel_count; i++) {
            uint32_t *const since_ms = &watch->differs_ms[part][i];
            *since_ms = differs[part][i] ? *since_ms : watch->now_ms;
            if (is_over(watch->now_ms, *since_ms, calm_ms(watch, part), LIFE_AUDIT_MS)) {
                complain(part, i, "transfer enabled differs from the tables for too long");
            }
        }
    }
}

static bool have_one_identity(const life_watch_t *watch, int a, int b)
{
    return pdcp_identity_equal(&watch->limb->parts[a].ini->desc.identity,
                               &watch->limb->parts[b].ini->desc.identity);
}

/* Nobody can tell apart who has one identity and got one id at the same instant (both take an answer), or
 * while one of them could not be heard (D-BUS-41); nor those who were such twins once, since both ask for
 * that id. */
static bool is_excused(const life_watch_t *watch, int a, int b, uint32_t rough_ms)
{
    const uint32_t a_ms = watch->bound_ms[a];
    const uint32_t b_ms = watch->bound_ms[b];
    const uint32_t apart_ms = a_ms > b_ms ? a_ms - b_ms : b_ms - a_ms;
    return have_one_identity(watch, a, b) &&
           (watch->met[a] || apart_ms <= LOOK_MS ||
            (rough_ms != 0 && !is_over(watch->now_ms, rough_ms, 0, TWINS_MS)));
}

/* Two have one id. Of those who are excused nothing is expected while they last. */
static void note_twins(life_watch_t *watch, uint8_t id, int a, int b)
{
    const uint32_t now_ms = watch->now_ms;
    const uint32_t limit_ms = have_one_identity(watch, a, b) ? 0 : TWINS_MS;
    const uint32_t rough_ms = calm_ms(watch, a) > calm_ms(watch, b) ? calm_ms(watch, a) : calm_ms(watch, b);
    if (watch->twins_seen_ms[id] + LOOK_MS < now_ms) { /* they are new */
        watch->twins_ms[id] = now_ms;
        watch->twins_pass[id] = is_excused(watch, a, b, rough_ms);
        watch->met[a] = watch->met[a] || watch->twins_pass[id];
    }
    watch->twins_seen_ms[id] = now_ms;
    if (watch->twins_pass[id]) {
        life_watch_rough(watch, a, now_ms);
        life_watch_rough(watch, b, now_ms);
    } else if (is_over(now_ms, watch->twins_ms[id], rough_ms, limit_ms)) {
        char why[WHY];
        (void)snprintf(why, sizeof why, "has id %u, and so has part %d", id, b + 1);
        complain(a, 0, why);
    }
}

/* One more has this id, as its own or that of an enabled output. */
static void note_id(life_watch_t *watch, int owners[256], uint8_t id, int part)
{
    if (id != 0 && owners[id] >= 0) {
        note_twins(watch, id, part, owners[id]);
    } else if (id != 0) {
        owners[id] = part;
    }
}

static void check_ids(life_watch_t *watch)
{
    int owners[256];
    memset(owners, 0xFF, sizeof owners);
    for (int part = 0; part < watch->limb->count; part++) {
        if (!is_bound(watch, part)) {
            watch->requests[part] = 0;
            continue;
        }
        const pdcp_device_t *device = device_of(watch, part);
        const pdcp_device_desc_t *desc = &watch->limb->parts[part].ini->desc;
        const uint32_t requests = pdcp_device_stats(device)->bind_requests;
        if (watch->requests[part] != requests) {
            watch->requests[part] = requests;
            watch->bound_ms[part] = watch->now_ms;
        }
        note_id(watch, owners, pdcp_device_node_id(device), part);
        for (uint8_t i = 1; i <= desc->channel_count; i++) {
            const pdcp_device_channel_t *channel = pdcp_device_channel(device, i);
            if (desc->channels[i - 1].direction == PDCP_OUTPUT && channel->enabled) {
                note_id(watch, owners, channel->node_id, part);
            }
        }
    }
}

void life_watch_ms(life_watch_t *watch, uint32_t now_ms)
{
    watch->now_ms = now_ms;
    if (now_ms % LOOK_MS == 0) {
        if (watch->flags) {
            check_flags(watch);
        }
        if (watch->twins) {
            check_ids(watch);
        }
    }
}

void life_watch_calm(const life_watch_t *watch)
{
    for (int part = 0; part < watch->limb->count; part++) {
        if (watch->limb->parts[part].node != NULL && pdcp_device_suspended(device_of(watch, part)) &&
            !watch->suspended[part]) {
            complain(part, 0, "suspended, and not by the host");
        }
    }
}

/* --- What the life tells --- */

void life_watch_calm_down(life_watch_t *watch, uint32_t now_ms)
{
    watch->all_rough_ms = watch->all_rough_ms < now_ms ? watch->all_rough_ms : now_ms;
    for (int i = 0; i < LIFE_PARTS_MAX; i++) {
        watch->rough_ms[i] = watch->rough_ms[i] < now_ms ? watch->rough_ms[i] : now_ms;
    }
}

void life_watch_init(life_watch_t *watch, limb_t *limb)
{
    memset(watch, 0, sizeof *watch);
    memset(watch->named, 0xFF, sizeof watch->named);
    watch->limb = limb;
    limb->on_taken = on_taken;
    limb->taken_ctx = watch;
    TEST_ASSERT_LESS_OR_EQUAL(LIFE_PARTS_MAX, limb->count);
}
