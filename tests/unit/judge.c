#include "judge.h"

#include <string.h>

#include "profile_channel.h"

uint8_t judge_before[PDCP_CHANNELS_MAX];
uint8_t judge_inputs[RANDOM_POOL + 1];
uint8_t judge_outputs[RANDOM_POOL + 1];

static uint8_t stood_in[PROFILE_LINKS_MAX]; /* stand-ins before it */
static bool displaced[PDCP_CHANNELS_MAX];
static uint8_t in_of[PROFILE_LINKS_MAX]; /* ends of the entries, PDCP_NONE: missing */
static uint8_t out_of[PROFILE_LINKS_MAX];

const systems_channel_t *judge_spec(uint8_t channel)
{
    const pdcp_channel_t *entry = &random_tables.tables.channels[channel];
    return &random_limb.devices[random_spec_of[entry->place]].channels[entry->index - 1];
}

bool judge_is_there(uint8_t channel, uint8_t transfer)
{
    const uint8_t place = channel != PDCP_NONE ? random_tables.tables.channels[channel].place : PDCP_NONE;
    return place != PDCP_NONE && random_tables.tables.devices[place].state == PDCP_PLACE_READY &&
           judge_spec(channel)->transfer == transfer;
}

bool judge_is_sole(uint8_t input)
{
    return (judge_spec(input)->type & 0x0200u) != 0;
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

bool judge_are_alike(uint8_t a, uint8_t b)
{
    return likeness(judge_spec(a)->type, judge_spec(a)->profile, judge_spec(b)->type,
                    judge_spec(b)->profile) >= 8;
}

static bool is_like(uint8_t channel, const profile_ref_t *end)
{
    return likeness(judge_spec(channel)->type, judge_spec(channel)->profile, end->type, end->profile) >= 8;
}

/* The channel that an end names, if it is there. */
static uint8_t end_channel(const profile_ref_t *end, const uint8_t *channels)
{
    for (; *channels != PDCP_NONE; channels++) {
        const pdcp_channel_t *channel = &random_tables.tables.channels[*channels];
        if (channel->index == end->index &&
            pdcp_identity_equal(&random_tables.tables.devices[channel->place].identity,
                                &random_tables.links.parts[end->part].identity)) {
            return *channels;
        }
    }
    return PDCP_NONE;
}

static uint8_t entry_of(uint8_t input)
{
    for (uint8_t e = 0; e < random_tables.links.count; e++) {
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

uint8_t judge_rival(const uint8_t *links, uint8_t output, uint8_t input)
{
    for (const uint8_t *i = judge_inputs; *i != PDCP_NONE; i++) {
        if (*i != input && links[*i] == output && judge_is_sole(*i)) {
            return *i;
        }
    }
    return PDCP_NONE;
}

/* Does this channel require an input that `links` does not connect? The input of the link counts as
 * connected. */
static bool misses(const uint8_t *links, uint8_t channel, uint8_t input)
{
    const uint32_t required = judge_spec(channel)->required;
    for (const uint8_t *c = judge_inputs; required != 0 && *c != PDCP_NONE; c++) {
        if (*c != input && links[*c] == PDCP_NONE &&
            random_tables.tables.channels[*c].place == random_tables.tables.channels[channel].place &&
            (required & (uint32_t)1 << random_tables.tables.channels[*c].index) != 0) {
            return true;
        }
    }
    return false;
}

static bool lacks(const uint8_t *links, uint8_t output, uint8_t input)
{
    return misses(links, output, input) || misses(links, input, input);
}

void judge_links(void)
{
    const uint8_t *want = random_tables.plan.want;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t o = want[i];
        if (o == PDCP_NONE) {
            continue;
        }
        random_check(judge_is_there(i, PDCP_INPUT) && judge_is_there(o, PDCP_OUTPUT), "an end is missing");
        random_check(random_tables.tables.channels[i].place != random_tables.tables.channels[o].place,
                     "a device feeds itself");
        random_check(!judge_is_sole(i) || judge_rival(want, o, i) == PDCP_NONE, "sole access is broken");
        const bool left_alone = is_original(o, i) && random_tables.links.entries[entry_of(i)].by_host;
        random_check(left_alone || !lacks(want, o, i), "a required input is not connected");
        for (uint8_t b = 0; b < random_tables.banned_count; b++) {
            random_check(judge_before[i] == o || random_tables.banned[b].output != o ||
                             random_tables.banned[b].input != i,
                         "a banned pair");
        }
    }
}

void judge_reasons(void)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t o = random_tables.plan.want[i];
        if (o == PDCP_NONE || o == judge_before[i]) {
            continue;
        }
        const uint8_t entry = entry_of(i);
        bool allowed = judge_are_alike(o, i) || is_original(o, i);
        allowed = allowed || (entry != PDCP_NONE && out_of[entry] == PDCP_NONE &&
                              is_like(o, &random_tables.links.entries[entry].output));
        for (uint8_t e = 0; e < random_tables.links.count; e++) {
            allowed = allowed || (random_tables.links.entries[e].stand_in == i && out_of[e] == o &&
                                  is_like(i, &random_tables.links.entries[e].input));
        }
        random_check(allowed, "no candidates");
    }
}

void judge_take_lacking(uint8_t *links)
{
    for (bool changed = true; changed;) {
        changed = false;
        for (const uint8_t *i = judge_inputs; *i != PDCP_NONE; i++) {
            const bool left_alone =
                is_original(links[*i], *i) && random_tables.links.entries[entry_of(*i)].by_host;
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
    memcpy(links, random_tables.plan.want, sizeof links);
    links[input] = PDCP_NONE;
    judge_take_lacking(links);
    for (const uint8_t *i = judge_inputs; *i != PDCP_NONE; i++) {
        if (*i != input && links[*i] == PDCP_NONE && is_original(random_tables.plan.want[*i], *i)) {
            return true;
        }
    }
    return false;
}

void judge_stand_ins(void)
{
    for (uint8_t e = 0; e < random_tables.links.count; e++) {
        const uint8_t input = random_tables.links.entries[e].stand_in;
        if (input != PDCP_NONE) {
            random_check(out_of[e] != PDCP_NONE && random_tables.plan.want[input] == out_of[e],
                         "a stand-in that is none");
            random_check(in_of[e] == PDCP_NONE || random_tables.plan.want[in_of[e]] != out_of[e] ||
                             costs_an_original(input),
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
    for (uint8_t e = 0; e < random_tables.links.count; e++) {
        if (stood_in[e] == input) {
            return true;
        }
    }
    return false;
}

/* Has an original come in the place of the link that the input had? */
static bool gives_way(uint8_t input)
{
    const uint8_t *want = random_tables.plan.want;
    const uint8_t o = judge_before[input];
    if (is_original(want[input], input)) {
        return want[input] != o;
    }
    for (uint8_t e = 0; e < random_tables.links.count; e++) {
        if (stood_in[e] == input && in_of[e] != PDCP_NONE && want[in_of[e]] == out_of[e]) {
            return true;
        }
    }
    const uint8_t rival = judge_is_sole(input) ? judge_rival(want, o, input) : PDCP_NONE;
    return rival != PDCP_NONE && stood(o, input) && is_original(o, rival);
}

/* Did the link need, directly, something that was not connected or has been displaced? */
static bool has_lost_need(uint8_t input)
{
    uint8_t left[PDCP_CHANNELS_MAX];
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        left[i] = displaced[i] ? PDCP_NONE : judge_before[i];
    }
    return lacks(left, judge_before[input], input);
}

void judge_kept(void)
{
    bool changed = true;
    memset(displaced, 0, sizeof displaced);
    while (changed) {
        changed = false;
        for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
            if (judge_before[i] != PDCP_NONE && !displaced[i] && (gives_way(i) || has_lost_need(i))) {
                displaced[i] = true;
                changed = true;
            }
        }
    }
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        random_check(judge_before[i] == PDCP_NONE || random_tables.plan.want[i] == judge_before[i] ||
                         displaced[i],
                     "a working link was taken");
    }
}

/* Could this link be made as it is, without anything else? */
static bool is_possible(uint8_t output, uint8_t input)
{
    if (random_tables.plan.want[input] != PDCP_NONE ||
        random_tables.tables.channels[output].place == random_tables.tables.channels[input].place ||
        (judge_is_sole(input) && judge_rival(random_tables.plan.want, output, input) != PDCP_NONE)) {
        return false;
    }
    for (uint8_t b = 0; b < random_tables.banned_count; b++) {
        if (random_tables.banned[b].output == output && random_tables.banned[b].input == input) {
            return false;
        }
    }
    return !lacks(random_tables.plan.want, output, input);
}

/* Nothing is left out that could be had for nothing. */
static void check_originals(void)
{
    for (uint8_t e = 0; e < random_tables.links.count; e++) {
        /* The original may need what stands in for it. */
        const bool both = in_of[e] != PDCP_NONE && out_of[e] != PDCP_NONE &&
                          random_tables.links.entries[e].stand_in == PDCP_NONE;
        random_check(!both || !is_possible(out_of[e], in_of[e]), "an original is left out");
    }
}

/* Is the device of this end, which is missing, awaited? */
static bool is_awaited(const profile_ref_t *end)
{
    for (uint8_t p = 0; p < PDCP_DEVICES_MAX; p++) {
        if (random_tables.tables.devices[p].state == PDCP_PLACE_LOST &&
            (random_tables.awaited[p / 8] & (1u << (p % 8))) != 0 &&
            pdcp_identity_equal(&random_tables.tables.devices[p].identity,
                                &random_tables.links.parts[end->part].identity)) {
            return true;
        }
    }
    return false;
}

static bool any_awaited(void)
{
    bool any = false;
    for (uint8_t e = 0; e < random_tables.links.count; e++) {
        any = any || is_awaited(&random_tables.links.entries[e].output) ||
              is_awaited(&random_tables.links.entries[e].input);
    }
    return any;
}

void judge_complete(uint8_t what)
{
    const bool waits = any_awaited();
    check_originals();
    for (const uint8_t *i = judge_inputs; *i != PDCP_NONE; i++) {
        const uint8_t entry = entry_of(*i);
        const bool replaced = (what & PROFILE_PLAN_REPLACE) != 0 && entry != PDCP_NONE &&
                              out_of[entry] == PDCP_NONE &&
                              !is_awaited(&random_tables.links.entries[entry].output);
        const bool served = (what & PROFILE_PLAN_AUTO) != 0 && (judge_spec(*i)->type & 0x0100u) != 0 &&
                            !(waits && entry != PDCP_NONE);
        if (random_tables.plan.want[*i] != PDCP_NONE || (!replaced && !served)) {
            continue;
        }
        for (const uint8_t *o = judge_outputs; *o != PDCP_NONE; o++) {
            if (is_possible(*o, *i)) {
                random_check(!replaced || !is_like(*o, &random_tables.links.entries[entry].output),
                             "a source not replaced");
                random_check(!served || !judge_are_alike(*o, *i), "a terminal channel is left out");
            }
        }
    }
}

static void list(uint8_t *channels, uint8_t transfer)
{
    for (uint8_t c = 0; c < PDCP_CHANNELS_MAX; c++) {
        if (judge_is_there(c, transfer)) {
            *channels++ = c;
        }
    }
    *channels = PDCP_NONE;
}

void judge_look_back(void)
{
    list(judge_inputs, PDCP_INPUT);
    list(judge_outputs, PDCP_OUTPUT);
    memset(judge_before, PDCP_NONE, sizeof judge_before);
    for (const uint8_t *i = judge_inputs; *i != PDCP_NONE; i++) {
        if (random_tables.tables.channels[*i].link == PDCP_LINK_ACTIVE) {
            judge_before[*i] = random_tables.tables.channels[*i].source.channel;
        }
    }
    for (uint8_t e = 0; e < random_tables.links.count; e++) {
        stood_in[e] = random_tables.links.entries[e].stand_in;
        in_of[e] = end_channel(&random_tables.links.entries[e].input, judge_inputs);
        out_of[e] = end_channel(&random_tables.links.entries[e].output, judge_outputs);
    }
}
