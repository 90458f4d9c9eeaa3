#include "random_limb.h"

#include <stdio.h>
#include <string.h>

#include "unity.h"

random_limb_t random_limb;
systems_t random_tables;
uint32_t random_state;
uint32_t random_needy;
uint8_t random_spec_of[PDCP_DEVICES_MAX];

uint32_t random_below(uint32_t below)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return (random_state >> 8) % below;
}

bool random_chance(uint32_t percent)
{
    return random_below(100) < percent;
}

static void fail(const char *what)
{
    char text[80];
    (void)snprintf(text, sizeof text, "%s, seed %lu", what, (unsigned long)random_limb.seed);
    TEST_FAIL_MESSAGE(text);
}

void random_check(bool holds, const char *what)
{
    if (!holds) {
        fail(what);
    }
}

static uint32_t random_set(const systems_device_t *device, uint32_t percent)
{
    uint32_t set = 0;
    for (uint8_t i = 0; i < device->count; i++) {
        if (device->channels[i].transfer == PDCP_INPUT && random_chance(percent)) {
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
    channel->transfer = random_chance(50) ? PDCP_INPUT : PDCP_OUTPUT;
    channel->profile = random_chance(2) ? 0 : profiles[random_below(sizeof profiles / sizeof profiles[0])];
    channel->type = types[random_below(4)];
    if (channel->transfer == PDCP_INPUT) {
        channel->type =
            (uint16_t)(channel->type | (random_chance(60) ? 0x0200 : 0) | (random_chance(40) ? 0x0100 : 0));
        channel->terminal_profile = random_chance(30) ? profiles[random_below(4)] : 0;
    }
}

static void make_device(systems_device_t *device, uint8_t number, uint8_t channels)
{
    memset(device, 0, sizeof *device);
    device->name = SYSTEMS_NAMES;
    device->identity.vid = (uint16_t)(1 + random_below(2));
    device->identity.pid = (uint16_t)(1 + random_below(3));
    device->identity.sn = (uint16_t)(number * 3u % 13u); /* other than the order of binding */
    device->count = (uint8_t)(1 + random_below(channels));
    for (uint8_t i = 0; i < device->count; i++) {
        make_channel(&device->channels[i]);
    }
    for (uint8_t i = 0; i < device->count; i++) {
        device->channels[i].required = random_chance(random_needy) ? random_set(device, 35) : 0;
        device->channels[i].desired = random_chance(20) ? random_set(device, 35) : 0;
    }
}

static void make_link(void)
{
    const uint8_t at = random_limb.link_count;
    const uint8_t from = (uint8_t)random_below(random_limb.count);
    const uint8_t to = (uint8_t)random_below(random_limb.count);
    const uint8_t output = (uint8_t)(1 + random_below(random_limb.devices[from].count));
    const uint8_t input = (uint8_t)(1 + random_below(random_limb.devices[to].count));
    bool is_free = from != to && random_limb.devices[from].channels[output - 1].transfer == PDCP_OUTPUT &&
                   random_limb.devices[to].channels[input - 1].transfer == PDCP_INPUT;
    for (uint8_t i = 0; i < at; i++) {
        is_free = is_free && (random_limb.links[i].to != to || random_limb.links[i].input != input);
    }
    if (is_free) {
        random_limb.links[at].from = from;
        random_limb.links[at].output = output;
        random_limb.links[at].to = to;
        random_limb.links[at].input = input;
        random_limb.links[at].by_host = random_chance(20);
        random_limb.link_count++;
    }
}

void random_make(uint32_t seed, uint8_t devices, uint8_t channels, uint8_t tries)
{
    memset(&random_limb, 0, sizeof random_limb);
    random_limb.seed = seed;
    random_state = seed * 2654435761u + 88675123u;
    random_state = random_state != 0 ? random_state : 1;
    random_limb.count = (uint8_t)(1 + random_below(devices));
    for (uint8_t d = 0; d < random_limb.count; d++) {
        make_device(&random_limb.devices[d], d, channels);
    }
    for (uint32_t tried = random_below(4u * tries + 1u); tried > 0 && random_limb.link_count < tries;
         tried--) {
        make_link();
    }
    for (uint8_t d = 0; d < random_limb.count; d++) {
        random_limb.absent |= random_chance(25) ? (uint32_t)1 << d : 0;
    }
}

uint8_t random_place(uint8_t device)
{
    return pdcp_tables_find(&random_tables.tables, &random_limb.devices[device].identity);
}

void random_come(uint8_t device)
{
    const uint8_t place = random_place(device);
    if (place != PDCP_NONE) {
        systems_return(&random_tables, place);
        return;
    }
    const uint8_t taken = systems_bind(&random_tables, &random_limb.devices[device]);
    random_spec_of[taken] = device;
    systems_set_up(&random_tables, taken, &random_limb.devices[device]);
}

void random_come_mixed(uint32_t absent)
{
    uint8_t left = 0;
    for (uint8_t d = 0; d < random_limb.count; d++) {
        const uint8_t other = (uint8_t)((d * 5u + random_limb.seed) % random_limb.count);
        const uint8_t first = random_place(other) == PDCP_NONE && (absent >> other & 1u) == 0 ? other : d;
        if (random_place(first) == PDCP_NONE && (absent >> first & 1u) == 0) {
            random_spec_of[systems_bind(&random_tables, &random_limb.devices[first])] = first;
        }
    }
    for (uint8_t d = 0; d < random_limb.count; d++) {
        if ((absent >> d & 1u) == 0 && random_place(d) == PDCP_NONE) {
            random_spec_of[systems_bind(&random_tables, &random_limb.devices[d])] = d;
        }
        left = (uint8_t)(left + random_limb.devices[d].count);
    }
    for (uint8_t turn = 1; turn <= left; turn++) {
        for (uint8_t d = random_limb.count; d > 0; d--) {
            const uint8_t place = random_place((uint8_t)(d - 1));
            if (place != PDCP_NONE && turn <= random_limb.devices[d - 1].count) {
                (void)pdcp_tables_set_channels(&random_tables.tables, place, turn);
            }
        }
    }
    for (uint8_t d = random_limb.count; d > 0; d--) {
        if (random_place((uint8_t)(d - 1)) != PDCP_NONE) {
            systems_set_up(&random_tables, random_place((uint8_t)(d - 1)), &random_limb.devices[d - 1]);
        }
    }
}

static void end_of(uint8_t device, uint8_t index, profile_end_t *end)
{
    memset(end, 0, sizeof *end);
    end->owner = random_limb.devices[device].identity;
    end->index = index;
    end->type = random_limb.devices[device].channels[index - 1].type;
    end->profile = random_limb.devices[device].channels[index - 1].profile;
}

void random_configure(bool backwards)
{
    for (uint8_t i = 0; i < random_limb.link_count; i++) {
        const uint8_t at = backwards ? (uint8_t)(random_limb.link_count - 1u - i) : i;
        profile_link_t link;
        end_of(random_limb.links[at].from, random_limb.links[at].output, &link.output);
        end_of(random_limb.links[at].to, random_limb.links[at].input, &link.input);
        random_check(profile_links_put(&random_tables.links, &link, random_limb.links[at].by_host),
                     "no room for a link");
    }
}
