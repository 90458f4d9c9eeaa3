/* The planner over random limbs: parts that match often, needs with loops, configurations with missing ends,
 * parts that go and come. A naive checker judges each plan; it shares nothing with the planner but the
 * tables. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "profile_channel.h"
#include "systems.h"
#include "unity.h"

#ifdef __AVR__
enum { LIMBS = 10, SMALL_LIMBS = 10, DEVICES = 5 }; /* a sample: the PC sees all */
#else
enum { LIMBS = 25000, SMALL_LIMBS = 5000, DEVICES = 12 };
#endif
enum { CHANNELS = 6, LINKS = 7, EVENTS = 3, POOL = DEVICES * CHANNELS };

/* Programs with another part see other limbs. */
#ifndef RANDOM_PART
#define RANDOM_PART 0
#endif

/* One random limb. Which device is where in the tables is no part of it. */
typedef struct {
    systems_device_t devices[DEVICES];
    uint8_t count;
    uint32_t absent; /* bit per device: not there at first */
    struct {
        uint8_t from, output, to, input;
        bool by_host;
    } links[LINKS];
    uint8_t link_count;
    uint32_t seed;
} limb_t;

static limb_t limb;
static systems_t s;
static uint32_t state;
static uint32_t digest = 2166136261u; /* of all plans: the same code plans the same */
static uint32_t needy;                /* percentage of the channels that require others */

/* Of the plan under check. */
static uint8_t before[PDCP_CHANNELS_MAX];   /* the links that worked */
static uint8_t stood_in[PROFILE_LINKS_MAX]; /* stand-ins before it */
static uint8_t spec_of[PDCP_DEVICES_MAX];   /* place: device of the limb */
static bool displaced[PDCP_CHANNELS_MAX];
static uint8_t inputs[POOL + 1];         /* channels that are there, ended by PDCP_NONE */
static uint8_t outputs[POOL + 1];        /* the same */
static uint8_t in_of[PROFILE_LINKS_MAX]; /* ends of the entries, PDCP_NONE: missing */
static uint8_t out_of[PROFILE_LINKS_MAX];

void setUp(void)
{
    needy = 30;
}

void tearDown(void) {}

static uint32_t random_of(uint32_t below)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return (state >> 8) % below;
}

static bool chance(uint32_t percent)
{
    return random_of(100) < percent;
}

static void fail(const char *what)
{
    char text[80];
    (void)snprintf(text, sizeof text, "%s, seed %lu", what, (unsigned long)limb.seed);
    TEST_FAIL_MESSAGE(text);
}

static void check(bool holds, const char *what)
{
    if (!holds) {
        fail(what);
    }
}

/* --- Random limbs --- */

static uint32_t random_set(const systems_device_t *device, uint32_t percent)
{
    uint32_t set = 0;
    for (uint8_t i = 0; i < device->count; i++) {
        if (device->channels[i].transfer == PDCP_INPUT && chance(percent)) {
            set |= (uint32_t)1 << (i + 1);
        }
    }
    return set;
}

static void make_channel(systems_channel_t *channel)
{
    static const uint16_t profiles[] = {0x1110, 0x1120, 0x1200, 0x1220, 0x2100, 0x2110,
                                        0x2120, 0x2121, 0x2200, 0x2000, 0x3100};
    static const uint16_t types[] = {0x5000, 0x7000, 0x4400, 0xC000};
    memset(channel, 0, sizeof *channel);
    channel->transfer = chance(50) ? PDCP_INPUT : PDCP_OUTPUT;
    channel->profile = chance(2) ? 0 : profiles[random_of(sizeof profiles / sizeof profiles[0])];
    channel->type = types[random_of(4)];
    if (channel->transfer == PDCP_INPUT) {
        channel->type = (uint16_t)(channel->type | (chance(60) ? 0x0200 : 0) | (chance(40) ? 0x0100 : 0));
        channel->terminal_profile = chance(30) ? profiles[random_of(4)] : 0;
    }
}

static void make_device(systems_device_t *device, uint8_t number, uint8_t channels)
{
    memset(device, 0, sizeof *device);
    device->name = SYSTEMS_NAMES;
    device->identity.vid = (uint16_t)(1 + random_of(2));
    device->identity.pid = (uint16_t)(1 + random_of(3));
    device->identity.sn = (uint16_t)(number * 3u % 13u); /* other than the order of binding */
    device->count = (uint8_t)(1 + random_of(channels));
    for (uint8_t i = 0; i < device->count; i++) {
        make_channel(&device->channels[i]);
    }
    for (uint8_t i = 0; i < device->count; i++) {
        device->channels[i].required = chance(needy) ? random_set(device, 35) : 0;
        device->channels[i].desired = chance(20) ? random_set(device, 35) : 0;
    }
}

static void make_link(void)
{
    const uint8_t at = limb.link_count;
    const uint8_t from = (uint8_t)random_of(limb.count);
    const uint8_t to = (uint8_t)random_of(limb.count);
    const uint8_t output = (uint8_t)(1 + random_of(limb.devices[from].count));
    const uint8_t input = (uint8_t)(1 + random_of(limb.devices[to].count));
    bool is_free = from != to && limb.devices[from].channels[output - 1].transfer == PDCP_OUTPUT &&
                   limb.devices[to].channels[input - 1].transfer == PDCP_INPUT;
    for (uint8_t i = 0; i < at; i++) {
        is_free = is_free && (limb.links[i].to != to || limb.links[i].input != input);
    }
    if (is_free) {
        limb.links[at].from = from;
        limb.links[at].output = output;
        limb.links[at].to = to;
        limb.links[at].input = input;
        limb.links[at].by_host = chance(20);
        limb.link_count++;
    }
}

static void make_limb(uint32_t seed, uint8_t devices, uint8_t channels, uint8_t tries)
{
    memset(&limb, 0, sizeof limb);
    limb.seed = seed;
    state = seed * 2654435761u + 88675123u;
    state = state != 0 ? state : 1;
    limb.count = (uint8_t)(1 + random_of(devices));
    for (uint8_t d = 0; d < limb.count; d++) {
        make_device(&limb.devices[d], d, channels);
    }
    for (uint32_t tried = random_of(4u * tries + 1u); tried > 0 && limb.link_count < tries; tried--) {
        make_link();
    }
    for (uint8_t d = 0; d < limb.count; d++) {
        limb.absent |= chance(25) ? (uint32_t)1 << d : 0;
    }
}

/* --- Limbs in tables --- */

static uint8_t place_of(uint8_t device)
{
    return pdcp_tables_find(&s.tables, &limb.devices[device].identity);
}

static void come(uint8_t device)
{
    const uint8_t place = place_of(device);
    if (place != PDCP_NONE) {
        systems_return(&s, place);
        return;
    }
    const uint8_t taken = systems_bind(&s, &limb.devices[device]);
    spec_of[taken] = device;
    systems_set_up(&s, taken, &limb.devices[device]);
}

/* The devices come in any order, and get their channels one by one, in turns. */
static void come_mixed(uint32_t absent)
{
    uint8_t left = 0;
    for (uint8_t d = 0; d < limb.count; d++) {
        const uint8_t other = (uint8_t)((d * 5u + limb.seed) % limb.count);
        const uint8_t first = place_of(other) == PDCP_NONE && (absent >> other & 1u) == 0 ? other : d;
        if (place_of(first) == PDCP_NONE && (absent >> first & 1u) == 0) {
            spec_of[systems_bind(&s, &limb.devices[first])] = first;
        }
    }
    for (uint8_t d = 0; d < limb.count; d++) {
        if ((absent >> d & 1u) == 0 && place_of(d) == PDCP_NONE) {
            spec_of[systems_bind(&s, &limb.devices[d])] = d;
        }
        left = (uint8_t)(left + limb.devices[d].count);
    }
    for (uint8_t turn = 1; turn <= left; turn++) {
        for (uint8_t d = limb.count; d > 0; d--) {
            const uint8_t place = place_of((uint8_t)(d - 1));
            if (place != PDCP_NONE && turn <= limb.devices[d - 1].count) {
                (void)pdcp_tables_set_channels(&s.tables, place, turn);
            }
        }
    }
    for (uint8_t d = limb.count; d > 0; d--) {
        if (place_of((uint8_t)(d - 1)) != PDCP_NONE) {
            systems_set_up(&s, place_of((uint8_t)(d - 1)), &limb.devices[d - 1]);
        }
    }
}

static void end_of(uint8_t device, uint8_t index, profile_end_t *end)
{
    memset(end, 0, sizeof *end);
    end->owner = limb.devices[device].identity;
    end->index = index;
    end->type = limb.devices[device].channels[index - 1].type;
    end->profile = limb.devices[device].channels[index - 1].profile;
}

static void configure(bool backwards)
{
    for (uint8_t i = 0; i < limb.link_count; i++) {
        const uint8_t at = backwards ? (uint8_t)(limb.link_count - 1u - i) : i;
        profile_link_t link;
        end_of(limb.links[at].from, limb.links[at].output, &link.output);
        end_of(limb.links[at].to, limb.links[at].input, &link.input);
        check(profile_links_put(&s.links, &link, limb.links[at].by_host), "no room for a link");
    }
}

/* --- The checker --- */

static const systems_channel_t *spec(uint8_t channel)
{
    const pdcp_channel_t *entry = &s.tables.channels[channel];
    return &limb.devices[spec_of[entry->place]].channels[entry->index - 1];
}

static bool is_there(uint8_t channel, uint8_t transfer)
{
    const uint8_t place = channel != PDCP_NONE ? s.tables.channels[channel].place : PDCP_NONE;
    return place != PDCP_NONE && s.tables.devices[place].state == PDCP_PLACE_READY &&
           spec(channel)->transfer == transfer;
}

static bool is_sole(uint8_t input)
{
    return (spec(input)->type & 0x0200u) != 0;
}

/* Listing 4.9, the other way round: how many leading digits agree. */
static int likeness(uint16_t type_a, uint16_t a, uint16_t type_b, uint16_t b)
{
    int score = 0;
    for (int digits = 1; digits <= 4; digits++) {
        const int shift = 16 - 4 * digits;
        if (a >> shift == b >> shift && (a >> shift & 0xF) != 0 && score == 8 * (digits - 1)) {
            score = 8 * digits;
        }
    }
    const uint16_t differing = type_a ^ type_b;
    return score + ((differing & 0x0C00u) == 0 ? 4 : 0) + ((differing & 0x3000u) == 0 ? 2 : 0) +
           ((differing & 0xC000u) == 0 ? 1 : 0);
}

static bool are_alike(uint8_t a, uint8_t b)
{
    return likeness(spec(a)->type, spec(a)->profile, spec(b)->type, spec(b)->profile) >= 8;
}

static bool is_like(uint8_t channel, const profile_ref_t *end)
{
    return likeness(spec(channel)->type, spec(channel)->profile, end->type, end->profile) >= 8;
}

/* The channel that an end names, if it is there. */
static uint8_t end_channel(const profile_ref_t *end, const uint8_t *channels)
{
    for (; *channels != PDCP_NONE; channels++) {
        const pdcp_channel_t *channel = &s.tables.channels[*channels];
        if (channel->index == end->index && pdcp_identity_equal(&s.tables.devices[channel->place].identity,
                                                                &s.links.parts[end->part].identity)) {
            return *channels;
        }
    }
    return PDCP_NONE;
}

static uint8_t entry_of(uint8_t input)
{
    for (uint8_t e = 0; e < s.links.count; e++) {
        if (in_of[e] == input) {
            return e;
        }
    }
    return PDCP_NONE;
}

/* Is the link the one that the configuration has for this input? */
static bool is_original(uint8_t output, uint8_t input)
{
    const uint8_t entry = entry_of(input);
    return entry != PDCP_NONE && output != PDCP_NONE && out_of[entry] == output;
}

/* Another sole-access input that hears this output. */
static uint8_t rival_of(const uint8_t *links, uint8_t output, uint8_t input)
{
    for (const uint8_t *i = inputs; *i != PDCP_NONE; i++) {
        if (*i != input && links[*i] == output && is_sole(*i)) {
            return *i;
        }
    }
    return PDCP_NONE;
}

/* Does this channel require an input that `links` does not connect? The input of the link counts as
 * connected. */
static bool misses(const uint8_t *links, uint8_t channel, uint8_t input)
{
    const uint32_t required = spec(channel)->required;
    for (const uint8_t *c = inputs; required != 0 && *c != PDCP_NONE; c++) {
        if (*c != input && links[*c] == PDCP_NONE &&
            s.tables.channels[*c].place == s.tables.channels[channel].place &&
            (required & (uint32_t)1 << s.tables.channels[*c].index) != 0) {
            return true;
        }
    }
    return false;
}

static bool lacks(const uint8_t *links, uint8_t output, uint8_t input)
{
    return misses(links, output, input) || misses(links, input, input);
}

static void check_links(void)
{
    const uint8_t *want = s.plan.want;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t o = want[i];
        if (o == PDCP_NONE) {
            continue;
        }
        check(is_there(i, PDCP_INPUT) && is_there(o, PDCP_OUTPUT), "an end is missing");
        check(s.tables.channels[i].place != s.tables.channels[o].place, "a device feeds itself");
        check(!is_sole(i) || rival_of(want, o, i) == PDCP_NONE, "sole access is broken");
        const bool left_alone = is_original(o, i) && s.links.entries[entry_of(i)].by_host;
        check(left_alone || !lacks(want, o, i), "a required input is not connected");
        for (uint8_t b = 0; b < s.banned_count; b++) {
            check(before[i] == o || s.banned[b].output != o || s.banned[b].input != i, "a banned pair");
        }
    }
}

/* Why may a new link be made? */
static void check_reasons(void)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t o = s.plan.want[i];
        if (o == PDCP_NONE || o == before[i]) {
            continue;
        }
        const uint8_t entry = entry_of(i);
        bool allowed = are_alike(o, i) || is_original(o, i);
        allowed = allowed || (entry != PDCP_NONE && out_of[entry] == PDCP_NONE &&
                              is_like(o, &s.links.entries[entry].output));
        for (uint8_t e = 0; e < s.links.count; e++) {
            allowed = allowed || (s.links.entries[e].stand_in == i && out_of[e] == o &&
                                  is_like(i, &s.links.entries[e].input));
        }
        check(allowed, "no candidates");
    }
}

/* Takes away what lacks something, until nothing changes, but for what the host has made. */
static void take_lacking(uint8_t *links)
{
    for (bool changed = true; changed;) {
        changed = false;
        for (const uint8_t *i = inputs; *i != PDCP_NONE; i++) {
            const bool left_alone = is_original(links[*i], *i) && s.links.entries[entry_of(*i)].by_host;
            if (links[*i] != PDCP_NONE && !left_alone && lacks(links, links[*i], *i)) {
                links[*i] = PDCP_NONE;
                changed = true;
            }
        }
    }
}

/* Would an original be lost with the link of this input? */
static bool costs_an_original(uint8_t input)
{
    uint8_t links[PDCP_CHANNELS_MAX];
    memcpy(links, s.plan.want, sizeof links);
    links[input] = PDCP_NONE;
    take_lacking(links);
    for (const uint8_t *i = inputs; *i != PDCP_NONE; i++) {
        if (*i != input && links[*i] == PDCP_NONE && is_original(s.plan.want[*i], *i)) {
            return true;
        }
    }
    return false;
}

static void check_stand_ins(void)
{
    for (uint8_t e = 0; e < s.links.count; e++) {
        const uint8_t input = s.links.entries[e].stand_in;
        if (input != PDCP_NONE) {
            check(out_of[e] != PDCP_NONE && s.plan.want[input] == out_of[e], "a stand-in that is none");
            check(in_of[e] == PDCP_NONE || s.plan.want[in_of[e]] != out_of[e] || costs_an_original(input),
                  "original and stand-in");
        }
    }
}

/* Did this link only stand in? */
static bool stood(uint8_t output, uint8_t input)
{
    if (entry_of(input) != PDCP_NONE) {
        return !is_original(output, input);
    }
    for (uint8_t e = 0; e < s.links.count; e++) {
        if (stood_in[e] == input) {
            return true;
        }
    }
    return false;
}

/* Has an original come in the place of the link that the input had? */
static bool gives_way(uint8_t input)
{
    const uint8_t *want = s.plan.want;
    const uint8_t o = before[input];
    if (is_original(want[input], input)) {
        return want[input] != o;
    }
    for (uint8_t e = 0; e < s.links.count; e++) {
        if (stood_in[e] == input && in_of[e] != PDCP_NONE && want[in_of[e]] == out_of[e]) {
            return true;
        }
    }
    const uint8_t rival = is_sole(input) ? rival_of(want, o, input) : PDCP_NONE;
    return rival != PDCP_NONE && stood(o, input) && is_original(o, rival);
}

/* Did the link need, directly, something that was not connected or has been displaced? */
static bool has_lost_need(uint8_t input)
{
    uint8_t left[PDCP_CHANNELS_MAX];
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        left[i] = displaced[i] ? PDCP_NONE : before[i];
    }
    return lacks(left, before[input], input);
}

/* A link that worked stays, unless an original takes its place, or takes that of something that it needs. */
static void check_kept(void)
{
    bool changed = true;
    memset(displaced, 0, sizeof displaced);
    while (changed) {
        changed = false;
        for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
            if (before[i] != PDCP_NONE && !displaced[i] && (gives_way(i) || has_lost_need(i))) {
                displaced[i] = true;
                changed = true;
            }
        }
    }
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        check(before[i] == PDCP_NONE || s.plan.want[i] == before[i] || displaced[i],
              "a working link was taken");
    }
}

/* Could this link be made as it is, without anything else? */
static bool is_possible(uint8_t output, uint8_t input)
{
    if (s.plan.want[input] != PDCP_NONE ||
        s.tables.channels[output].place == s.tables.channels[input].place ||
        (is_sole(input) && rival_of(s.plan.want, output, input) != PDCP_NONE)) {
        return false;
    }
    for (uint8_t b = 0; b < s.banned_count; b++) {
        if (s.banned[b].output == output && s.banned[b].input == input) {
            return false;
        }
    }
    return !lacks(s.plan.want, output, input);
}

/* Nothing is left out that could be had for nothing. */
static void check_originals(void)
{
    for (uint8_t e = 0; e < s.links.count; e++) {
        /* The original may need what stands in for it. */
        const bool both =
            in_of[e] != PDCP_NONE && out_of[e] != PDCP_NONE && s.links.entries[e].stand_in == PDCP_NONE;
        check(!both || !is_possible(out_of[e], in_of[e]), "an original is left out");
    }
}

/* Is the device of this end, which is missing, awaited? */
static bool is_awaited(const profile_ref_t *end)
{
    for (uint8_t p = 0; p < PDCP_DEVICES_MAX; p++) {
        if (s.tables.devices[p].state == PDCP_PLACE_LOST && (s.awaited[p / 8] & (1u << (p % 8))) != 0 &&
            pdcp_identity_equal(&s.tables.devices[p].identity, &s.links.parts[end->part].identity)) {
            return true;
        }
    }
    return false;
}

static bool any_awaited(void)
{
    bool any = false;
    for (uint8_t e = 0; e < s.links.count; e++) {
        any = any || is_awaited(&s.links.entries[e].output) || is_awaited(&s.links.entries[e].input);
    }
    return any;
}

static void check_complete(uint8_t what)
{
    const bool waits = any_awaited();
    check_originals();
    for (const uint8_t *i = inputs; *i != PDCP_NONE; i++) {
        const uint8_t entry = entry_of(*i);
        const bool replaced = (what & PROFILE_PLAN_REPLACE) != 0 && entry != PDCP_NONE &&
                              out_of[entry] == PDCP_NONE && !is_awaited(&s.links.entries[entry].output);
        const bool served = (what & PROFILE_PLAN_AUTO) != 0 && (spec(*i)->type & 0x0100u) != 0 &&
                            !(waits && entry != PDCP_NONE);
        if (s.plan.want[*i] != PDCP_NONE || (!replaced && !served)) {
            continue;
        }
        for (const uint8_t *o = outputs; *o != PDCP_NONE; o++) {
            if (is_possible(*o, *i)) {
                check(!replaced || !is_like(*o, &s.links.entries[entry].output), "a source not replaced");
                check(!served || !are_alike(*o, *i), "a terminal channel is left out");
            }
        }
    }
}

static uint32_t mix(uint32_t hash, uint32_t value)
{
    hash = (hash ^ value) * 16777619u;
    return hash ^ hash >> 15;
}

static uint32_t hash_channel(uint32_t hash, uint8_t channel)
{
    const pdcp_channel_t *entry = &s.tables.channels[channel];
    const pdcp_identity_t *owner = &s.tables.devices[entry->place].identity;
    return mix(mix(mix(mix(hash, owner->vid), owner->pid), owner->sn), entry->index);
}

/* The same for the same links, wherever their ends stand in the tables. */
static uint32_t fingerprint(void)
{
    uint32_t sum = 0;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (s.plan.want[i] != PDCP_NONE) {
            sum += hash_channel(hash_channel(2166136261u, i), s.plan.want[i]);
        }
    }
    return sum;
}

/* Plans, and adds what was planned, and in how many steps, to the digest. */
static void plan(uint8_t what)
{
    systems_plan(&s, what);
    const uint32_t print = fingerprint();
    digest = mix(mix(digest, print), s.plan.steps);
}

static void list(uint8_t *channels, uint8_t transfer)
{
    for (uint8_t c = 0; c < PDCP_CHANNELS_MAX; c++) {
        if (is_there(c, transfer)) {
            *channels++ = c;
        }
    }
    *channels = PDCP_NONE;
}

static void look_back(void)
{
    list(inputs, PDCP_INPUT);
    list(outputs, PDCP_OUTPUT);
    memset(before, PDCP_NONE, sizeof before);
    for (const uint8_t *i = inputs; *i != PDCP_NONE; i++) {
        if (s.tables.channels[*i].link == PDCP_LINK_ACTIVE) {
            before[*i] = s.tables.channels[*i].source.channel;
        }
    }
    for (uint8_t e = 0; e < s.links.count; e++) {
        stood_in[e] = s.links.entries[e].stand_in;
        in_of[e] = end_channel(&s.links.entries[e].input, inputs);
        out_of[e] = end_channel(&s.links.entries[e].output, outputs);
    }
}

/* The slices, of any length, make no difference to the plan (D-PRO-23). */
static void plan_in_slices(uint8_t what)
{
    const profile_links_t links = s.links;
    plan(what);
    const profile_links_t planned = s.links;
    const uint32_t steps = s.plan.steps;
    uint8_t want[PDCP_CHANNELS_MAX];
    memcpy(want, s.plan.want, sizeof want);
    s.links = links;
    s.slice = (int16_t)(1 + limb.seed * 7919u % 400u);
    plan(what);
    s.slice = 0;
    check(memcmp(want, s.plan.want, sizeof want) == 0 && steps == s.plan.steps, "slices give another plan");
    for (uint8_t e = 0; e < planned.count; e++) {
        check(planned.entries[e].stand_in == s.links.entries[e].stand_in, "slices give another stand-in");
    }
}

/* Plans, judges, carries out, and plans once more. */
static uint32_t plan_and_check(uint8_t what)
{
    look_back();
    if (limb.seed % 4 == 0) {
        plan_in_slices(what);
    } else {
        plan(what);
    }
    check(s.plan.steps <= PROFILE_PLAN_STEPS, "too many steps");
    check_links();
    check_reasons();
    check_stand_ins();
    check_kept();
    check_complete(what);
    const uint32_t first = fingerprint();
    systems_execute(&s);
    plan(what);
    check(fingerprint() == first, "the plan is not stable");
    systems_execute(&s);
    return first;
}

/* --- Plays --- */

static uint8_t any_channel(void)
{
    const uint8_t device = (uint8_t)random_of(limb.count);
    const uint8_t index = (uint8_t)(1 + random_of(limb.devices[device].count));
    return place_of(device) != PDCP_NONE ? pdcp_tables_channel(&s.tables, place_of(device), index)
                                         : PDCP_NONE;
}

/* The host makes a link, which does not break sole access. */
static void link_by_host(void)
{
    profile_link_t link;
    const uint8_t output = any_channel();
    const uint8_t input = any_channel();
    if (is_there(output, PDCP_OUTPUT) && is_there(input, PDCP_INPUT) &&
        s.tables.channels[output].place != s.tables.channels[input].place &&
        !profile_channel_breaks_sole_access(&s.tables, output, input)) {
        systems_connect(&s, output, input);
        profile_channel_end(&s.tables, output, &link.output);
        profile_channel_end(&s.tables, input, &link.input);
        check(profile_links_put(&s.links, &link, true), "no room for the host's link");
    }
}

static void happen(void)
{
    if (chance(10)) {
        link_by_host();
        return;
    }
    const uint8_t device = (uint8_t)random_of(limb.count);
    const uint8_t place = place_of(device);
    const bool forgets = chance(30);
    if (place == PDCP_NONE || s.tables.devices[place].state != PDCP_PLACE_READY) {
        come(device);
    } else if (forgets) {
        systems_forget(&s, place);
    } else {
        systems_lose(&s, place);
    }
}

/* Some pairs have failed, a device may be awaited. */
static void disturb(void)
{
    s.banned_count = (uint8_t)(chance(20) ? random_of(PROFILE_BANNED_MAX + 1) : 0);
    for (uint8_t b = 0; b < s.banned_count; b++) {
        s.banned[b].output = any_channel();
        s.banned[b].input = any_channel();
    }
    memset(s.awaited, 0, sizeof s.awaited);
    const uint8_t place = chance(15) ? place_of((uint8_t)random_of(limb.count)) : PDCP_NONE;
    if (place != PDCP_NONE) {
        s.awaited[place / 8] = (uint8_t)(1u << (place % 8));
    }
}

static uint8_t any_what(void)
{
    const uint8_t whats[] = {PROFILE_PLAN_ALL,
                             PROFILE_PLAN_ALL,
                             PROFILE_PLAN_ALL,
                             PROFILE_PLAN_ORIGINALS,
                             PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_AUTO,
                             PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_REPLACE};
    return whats[random_of(6)];
}

static void start(bool mixed)
{
    systems_init(&s);
    state = limb.seed * 747796405u + 2891336453u;
    state = state != 0 ? state : 1;
    if (mixed) {
        come_mixed(limb.absent);
    }
    for (uint8_t d = 0; d < limb.count && !mixed; d++) {
        if ((limb.absent >> d & 1u) == 0) {
            come(d);
        }
    }
    configure(mixed);
}

/* The same events on the same limb, however its parts stand in the tables; notes what was planned. */
static void play(bool mixed, uint32_t prints[EVENTS + 1])
{
    start(mixed);
    prints[0] = plan_and_check(PROFILE_PLAN_ALL);
    for (unsigned i = 1; i <= EVENTS; i++) {
        happen();
        if (chance(20)) {
            happen();
        }
        disturb();
        prints[i] = plan_and_check(any_what());
    }
}

static uint32_t first_of(uint32_t count)
{
    return 1 + RANDOM_PART * count;
}

static void play_all(uint32_t first_seed, uint32_t count)
{
    uint32_t one[EVENTS + 1];
    uint32_t other[EVENTS + 1];
    for (uint32_t n = 0; n < count; n++) {
        make_limb(first_seed + n, DEVICES, CHANNELS, LINKS);
        play(false, one);
        play(true, other);
        check(memcmp(one, other, sizeof one) == 0, "the order in the tables matters");
    }
}

static void test_random_limbs(void)
{
    play_all(first_of(LIMBS), LIMBS);
}

/* --- Enforce, save and load, clear --- */

/* The host links whatever it likes. */
static void link_anything(void)
{
    for (uint8_t n = (uint8_t)random_of(8); n > 0; n--) {
        const uint8_t output = any_channel();
        const uint8_t input = any_channel();
        if (is_there(output, PDCP_OUTPUT) && is_there(input, PDCP_INPUT) &&
            s.tables.channels[output].place != s.tables.channels[input].place) {
            s.plan.want[input] = output;
        }
    }
    systems_execute(&s);
}

/* Is a before b by profile, VID, PID, SN, index? */
static bool comes_first(uint8_t a, uint8_t b)
{
    const pdcp_channel_t *one = &s.tables.channels[a];
    const pdcp_channel_t *other = &s.tables.channels[b];
    const pdcp_identity_t *first = &s.tables.devices[one->place].identity;
    const pdcp_identity_t *second = &s.tables.devices[other->place].identity;
    const uint16_t left[] = {one->profile, first->vid, first->pid, first->sn, one->index};
    const uint16_t right[] = {other->profile, second->vid, second->pid, second->sn, other->index};
    for (uint8_t i = 0; i < 5; i++) {
        if (left[i] != right[i]) {
            return left[i] < right[i];
        }
    }
    return false;
}

/* What must be left of the links: one sole-access input an output, and nothing that lacks something. */
static void enforce_naively(uint8_t *links)
{
    for (const uint8_t *i = inputs; *i != PDCP_NONE; i++) {
        for (const uint8_t *k = inputs; *k != PDCP_NONE; k++) {
            if (before[*i] != PDCP_NONE && before[*i] == before[*k] && is_sole(*i) && is_sole(*k) &&
                comes_first(*k, *i)) {
                links[*i] = PDCP_NONE;
            }
        }
    }
    take_lacking(links);
}

static void check_enforce(void)
{
    uint8_t links[PDCP_CHANNELS_MAX];
    look_back();
    memcpy(links, before, sizeof links);
    enforce_naively(links);
    plan(PROFILE_PLAN_ENFORCE);
    check(memcmp(links, s.plan.want, sizeof links) == 0, "enforce");
    systems_execute(&s);
    plan(PROFILE_PLAN_ENFORCE);
    check(memcmp(links, s.plan.want, sizeof links) == 0, "enforce twice");
    systems_execute(&s);
}

static bool are_equal(const profile_end_t *a, const profile_end_t *b)
{
    return pdcp_identity_equal(&a->owner, &b->owner) && a->index == b->index && a->type == b->type &&
           a->profile == b->profile && a->owner_type == b->owner_type && a->owner_profile == b->owner_profile;
}

static void check_saved(void)
{
    profile_links_t loaded;
    profile_link_t one;
    profile_link_t other;
    const uint8_t count = s.links.count;
    profile_links_init(&loaded);
    for (uint8_t e = count; e > 0; e--) {
        profile_links_get(&s.links, (uint8_t)((e + limb.seed) % count), &one);
        check(profile_links_put(&loaded, &one, false), "no room");
    }
    check(loaded.count == count, "links lost");
    for (uint8_t e = 0; e < count; e++) {
        profile_links_get(&s.links, e, &one);
        profile_links_get(&loaded, e, &other);
        check(are_equal(&one.output, &other.output) && are_equal(&one.input, &other.input),
              "a link has changed");
    }
}

static void check_clear(void)
{
    profile_links_init(&s.links);
    memset(s.plan.want, PDCP_NONE, sizeof s.plan.want);
    systems_execute(&s);
    plan(PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_REPLACE);
    check(fingerprint() == 0, "something is left");
}

static void test_enforce_save_and_load_clear(void)
{
    for (uint32_t n = 0; n < LIMBS; n++) {
        make_limb(first_of(LIMBS) + n, DEVICES, CHANNELS, LINKS);
        start(chance(50));
        plan(PROFILE_PLAN_ALL);
        link_anything();
        check_saved();
        check_enforce();
        check_saved();
        check_clear();
    }
}

/* --- Is all found that could be found? --- */

static bool can_complete(uint8_t *links);

/* Can this input get any source such that all holds? */
static bool can_connect(uint8_t *links, uint8_t input)
{
    for (const uint8_t *o = outputs; *o != PDCP_NONE; o++) {
        if (s.tables.channels[*o].place != s.tables.channels[input].place && are_alike(*o, input) &&
            !(is_sole(input) && rival_of(links, *o, input) != PDCP_NONE)) {
            links[input] = *o;
            if (can_complete(links)) {
                return true;
            }
        }
    }
    links[input] = PDCP_NONE;
    return false;
}

/* Tries all ways of connecting what the links require. */
static bool can_complete(uint8_t *links)
{
    for (const uint8_t *i = inputs; *i != PDCP_NONE; i++) {
        for (const uint8_t *c = inputs; *c != PDCP_NONE && links[*i] != PDCP_NONE; c++) {
            const uint32_t bit = (uint32_t)1 << s.tables.channels[*c].index;
            const uint8_t place = s.tables.channels[*c].place;
            const bool needed =
                (s.tables.channels[*i].place == place && (spec(*i)->required & bit) != 0) ||
                (s.tables.channels[links[*i]].place == place && (spec(links[*i])->required & bit) != 0);
            if (needed && links[*c] == PDCP_NONE) {
                return can_connect(links, *c);
            }
        }
    }
    return true;
}

/* What [PROFILE listing 4.5] finds is not all: it does not take back what one required input has got when the
 * next one then gets nothing. How often does that matter? */
static void test_how_often_a_terminal_channel_is_missed(void)
{
    uint32_t missed = 0;
    uint32_t unserved = 0;
    uint8_t links[PDCP_CHANNELS_MAX];
    needy = 80;
    for (uint32_t n = 0; n < SMALL_LIMBS; n++) {
        make_limb(first_of(SMALL_LIMBS) + n, 3, 6, 0);
        limb.absent = 0;
        start(false);
        look_back();
        plan(PROFILE_PLAN_AUTO);
        for (const uint8_t *i = inputs; *i != PDCP_NONE; i++) {
            if (s.plan.want[*i] == PDCP_NONE && (spec(*i)->type & 0x0100u) != 0) {
                memcpy(links, s.plan.want, sizeof links);
                unserved++;
                missed += can_connect(links, *i) ? 1u : 0u;
            }
        }
    }
    printf("of %lu unserved terminal channels of %lu limbs, %lu could have been served\n",
           (unsigned long)unserved, (unsigned long)SMALL_LIMBS, (unsigned long)missed);
    TEST_ASSERT_LESS_OR_EQUAL(SMALL_LIMBS / 1000, missed);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_random_limbs);
    RUN_TEST(test_enforce_save_and_load_clear);
    RUN_TEST(test_how_often_a_terminal_channel_is_missed);
    (void)printf("digest %08lX\n", (unsigned long)digest);
    return UNITY_END();
}
