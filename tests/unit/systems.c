#include "systems.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "profile_channel.h"
#include "unity.h"

void systems_init(systems_t *s)
{
    memset(s, 0, sizeof *s);
    pdcp_tables_init(&s->tables);
    profile_links_init(&s->links);
}

/* --- Texts --- */

static const char *skip_spaces(const char *at)
{
    while (*at == ' ') {
        at++;
    }
    return at;
}

/* Moves behind a word, if it is the next one. */
static bool take_word(const char **at, const char *word)
{
    const char *here = skip_spaces(*at);
    const size_t len = strlen(word);
    if (strncmp(here, word, len) != 0) {
        return false;
    }
    *at = here + len;
    return true;
}

static uint16_t take_number(const char **at, int base)
{
    char *end;
    const char *here = skip_spaces(*at);
    const unsigned long number = strtoul(here, &end, base);
    TEST_ASSERT_TRUE_MESSAGE(end != here, here);
    *at = end;
    return (uint16_t)number;
}

static uint32_t take_set(const char **at)
{
    uint32_t set = 0;
    *at = skip_spaces(*at);
    while (**at >= '0' && **at <= '9') {
        set |= (uint32_t)1 << take_number(at, 10);
        *at = skip_spaces(*at);
    }
    return set;
}

static void take_channel(const char **at, systems_device_t *device)
{
    TEST_ASSERT_LESS_THAN(SYSTEMS_CHANNELS, device->count);
    systems_channel_t *channel = &device->channels[device->count++];
    memset(channel, 0, sizeof *channel);
    channel->transfer = take_word(at, "in") ? PDCP_INPUT : PDCP_OUTPUT;
    if (channel->transfer == PDCP_OUTPUT) {
        TEST_ASSERT_TRUE_MESSAGE(take_word(at, "out"), *at);
    }
    TEST_ASSERT_EQUAL_MESSAGE(device->count, take_number(at, 10), "channel index");
    channel->type = take_number(at, 16);
    channel->profile = take_number(at, 16);
    if (take_word(at, "req")) {
        channel->required = take_set(at);
    }
    if (take_word(at, "des")) {
        channel->desired = take_set(at);
    }
    if (take_word(at, "for")) {
        channel->terminal_profile = take_number(at, 16);
    }
}

bool systems_read(const char **text, systems_device_t *device)
{
    const char *at = skip_spaces(*text);
    if (*at == '\0') {
        return false;
    }
    TEST_ASSERT_TRUE_MESSAGE(take_word(&at, "D"), at);
    memset(device, 0, sizeof *device);
    device->name = (uint8_t)take_number(&at, 10);
    device->identity.vid = 2;
    device->identity.pid = 2;
    device->identity.sn = device->name;
    at = skip_spaces(at);
    if (*at >= '0' && *at <= '9') {
        device->identity.vid = take_number(&at, 10);
        at++;
        device->identity.pid = take_number(&at, 10);
        at++;
        device->identity.sn = take_number(&at, 10);
    }
    do {
        take_channel(&at, device);
    } while (take_word(&at, ","));
    at = skip_spaces(at);
    TEST_ASSERT_TRUE_MESSAGE(*at == ';' || *at == '\0', at);
    *text = *at == ';' ? at + 1 : at;
    return true;
}

uint8_t systems_place(const systems_t *s, uint8_t name)
{
    const uint8_t place = pdcp_tables_find(&s->tables, &s->named[name]);
    TEST_ASSERT_NOT_EQUAL_MESSAGE(PDCP_NONE, place, "device is not bound");
    return place;
}

static uint8_t take_end(const systems_t *s, const char **at)
{
    const uint8_t place = systems_place(s, (uint8_t)take_number(at, 10));
    TEST_ASSERT_EQUAL_MESSAGE('.', **at, *at);
    ++*at;
    const uint8_t channel = pdcp_tables_channel(&s->tables, place, (uint8_t)take_number(at, 10));
    TEST_ASSERT_NOT_EQUAL_MESSAGE(PDCP_NONE, channel, *at);
    return channel;
}

uint8_t systems_channel(const systems_t *s, const char *text)
{
    return take_end(s, &text);
}

/* The next link of a text. False: there are no more. */
static bool take_link(const systems_t *s, const char **at, uint8_t *output, uint8_t *input)
{
    *at = skip_spaces(*at);
    if (**at == '\0') {
        return false;
    }
    *output = take_end(s, at);
    TEST_ASSERT_EQUAL_MESSAGE('>', **at, *at);
    ++*at;
    *input = take_end(s, at);
    return true;
}

/* --- Devices --- */

uint8_t systems_bind(systems_t *s, const systems_device_t *device)
{
    uint8_t id = 1;
    while (s->tables.owner[id] != 0) {
        id++;
    }
    const uint8_t place = pdcp_tables_free_place(&s->tables);
    TEST_ASSERT_NOT_EQUAL(PDCP_NONE, place);
    pdcp_tables_add(&s->tables, place, &device->identity, id);
    if (device->name < SYSTEMS_NAMES) {
        s->named[device->name] = device->identity;
    }
    return place;
}

static void put_set(systems_t *s, uint8_t channel, bool desired, uint32_t set)
{
    if (set == 0) {
        return;
    }
    uint8_t bytes[4] = {0}; /* the most significant bit of the first byte is channel index 0 */
    for (uint8_t i = 0; i < 32; i++) {
        if ((set & (uint32_t)1 << i) != 0) {
            bytes[i / 8] = (uint8_t)(bytes[i / 8] | (0x80u >> (i % 8)));
        }
    }
    pdcp_tables_put_needs(&s->tables, channel, desired, 0, bytes, sizeof bytes);
}

void systems_set_up(systems_t *s, uint8_t place, const systems_device_t *device)
{
    TEST_ASSERT_TRUE(pdcp_tables_set_channels(&s->tables, place, device->count));
    for (uint8_t i = 0; i < device->count; i++) {
        pdcp_channel_t *channel =
            &s->tables.channels[pdcp_tables_channel(&s->tables, place, (uint8_t)(i + 1))];
        channel->transfer = device->channels[i].transfer;
        channel->type = device->channels[i].type;
        channel->profile = device->channels[i].profile;
        channel->terminal_profile = device->channels[i].terminal_profile;
    }
    TEST_ASSERT_TRUE(pdcp_tables_make_needs(&s->tables, place));
    for (uint8_t i = 0; i < device->count; i++) {
        const uint8_t channel = pdcp_tables_channel(&s->tables, place, (uint8_t)(i + 1));
        put_set(s, channel, false, device->channels[i].required);
        put_set(s, channel, true, device->channels[i].desired);
    }
    s->tables.devices[place].state = PDCP_PLACE_READY;
    s->tables.devices[place].beaconed = true;
}

void systems_add(systems_t *s, const char *devices)
{
    systems_device_t device;
    while (systems_read(&devices, &device)) {
        systems_set_up(s, systems_bind(s, &device), &device);
    }
}

void systems_lose(systems_t *s, uint8_t place)
{
    s->tables.devices[place].state = PDCP_PLACE_LOST;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        pdcp_channel_t *channel = &s->tables.channels[i];
        const bool own = channel->place == place;
        const bool fed = channel->place != PDCP_NONE && channel->source.channel != PDCP_NONE &&
                         s->tables.channels[channel->source.channel].place == place;
        if ((own || fed) && channel->link == PDCP_LINK_ACTIVE) {
            channel->link = PDCP_LINK_INACTIVE;
        }
    }
}

void systems_return(systems_t *s, uint8_t place)
{
    s->tables.devices[place].state = PDCP_PLACE_READY;
}

void systems_forget(systems_t *s, uint8_t place)
{
    systems_lose(s, place);
    pdcp_tables_remove(&s->tables, place);
}

/* --- Links --- */

static void put_entry(systems_t *s, uint8_t output, uint8_t input, bool by_host)
{
    profile_link_t link;
    profile_channel_end(&s->tables, output, &link.output);
    profile_channel_end(&s->tables, input, &link.input);
    TEST_ASSERT_TRUE(profile_links_put(&s->links, &link, by_host));
}

void systems_configure(systems_t *s, const char *links, bool by_host)
{
    uint8_t output;
    uint8_t input;
    while (take_link(s, &links, &output, &input)) {
        put_entry(s, output, input, by_host);
    }
}

void systems_connect(systems_t *s, uint8_t output, uint8_t input)
{
    pdcp_channel_t *channel = &s->tables.channels[input];
    const pdcp_channel_t *source = &s->tables.channels[output];
    channel->link = PDCP_LINK_ACTIVE;
    channel->source.channel = output;
    channel->source.identity = s->tables.devices[source->place].identity;
    channel->source.index = source->index;
    channel->source.type = source->type;
    channel->source.profile = source->profile;
}

void systems_link(systems_t *s, const char *links)
{
    uint8_t output;
    uint8_t input;
    while (take_link(s, &links, &output, &input)) {
        systems_connect(s, output, input);
    }
}

profile_scene_t systems_scene(systems_t *s)
{
    profile_scene_t scene = {.tables = &s->tables, .links = &s->links, .banned_count = s->banned_count};
    memcpy(scene.made, s->made, sizeof scene.made);
    memcpy(scene.awaited, s->awaited, sizeof scene.awaited);
    memcpy(scene.banned, s->banned, sizeof scene.banned);
    return scene;
}

void systems_plan(systems_t *s, uint8_t what)
{
    const profile_scene_t scene = systems_scene(s);
    profile_plan_begin(&s->plan, &scene, what);
    const int16_t slice = (int16_t)(s->slice != 0 ? s->slice : 30000);
    while (!profile_plan_step(&s->plan, &scene, slice)) {
        if (-s->plan.left > s->beyond) {
            s->beyond = (int16_t)-s->plan.left;
        }
    }
}

static bool stands_in(const systems_t *s, uint8_t input)
{
    for (uint8_t e = 0; e < s->links.count; e++) {
        if (s->links.entries[e].stand_in == input) {
            return true;
        }
    }
    return false;
}

/* A link that is not wanted: one of the configuration rests, another one goes. */
static void take_link_away(systems_t *s, uint8_t input)
{
    pdcp_channel_t *channel = &s->tables.channels[input];
    const uint8_t entry = profile_links_of(&s->links, &s->tables, input);
    if (entry != PDCP_NONE &&
        channel->source.channel ==
            profile_links_channel(&s->links, &s->tables, &s->links.entries[entry].output, PDCP_OUTPUT)) {
        channel->link = PDCP_LINK_INACTIVE;
        return;
    }
    channel->link = PDCP_LINK_NONE;
    channel->source.channel = PDCP_NONE;
    pdcp_tables_clear_source(channel);
}

void systems_execute(systems_t *s)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t output = s->plan.want[i];
        if (output != PDCP_NONE) {
            systems_connect(s, output, i);
        } else if (s->tables.channels[i].place != PDCP_NONE &&
                   s->tables.channels[i].link == PDCP_LINK_ACTIVE) {
            take_link_away(s, i);
        }
    }
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (s->plan.want[i] != PDCP_NONE && profile_links_of(&s->links, &s->tables, i) == PDCP_NONE &&
            !stands_in(s, i)) {
            put_entry(s, s->plan.want[i], i, false);
        }
    }
}

static unsigned name_of(const systems_t *s, uint8_t channel)
{
    for (unsigned n = 0; n < SYSTEMS_NAMES; n++) {
        const pdcp_device_entry_t *owner = &s->tables.devices[s->tables.channels[channel].place];
        if (pdcp_identity_equal(&s->named[n], &owner->identity)) {
            return n;
        }
    }
    return SYSTEMS_NAMES;
}

void systems_planned(const systems_t *s, char text[SYSTEMS_TEXT])
{
    int used = 0;
    text[0] = '\0';
    for (unsigned n = 0; n < SYSTEMS_NAMES; n++) {
        const uint8_t place = pdcp_tables_find(&s->tables, &s->named[n]);
        uint8_t i = place != PDCP_NONE ? s->tables.devices[place].first_channel : PDCP_NONE;
        for (; i != PDCP_NONE; i = s->tables.channels[i].next) {
            const uint8_t output = s->plan.want[i];
            if (output != PDCP_NONE) {
                used += snprintf(&text[used], (size_t)(SYSTEMS_TEXT - used), "%s%u.%u>%u.%u",
                                 used == 0 ? "" : " ", name_of(s, output), s->tables.channels[output].index,
                                 n, s->tables.channels[i].index);
                TEST_ASSERT_LESS_THAN(SYSTEMS_TEXT, used);
            }
        }
    }
}

void systems_expect(systems_t *s, uint8_t what, const char *links)
{
    char text[SYSTEMS_TEXT];
    systems_plan(s, what);
    systems_planned(s, text);
    TEST_ASSERT_EQUAL_STRING(links, text);
    systems_execute(s);
    systems_plan(s, what);
    systems_planned(s, text);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(links, text, "planned again");
}

const char *systems_acceptance(uint8_t number)
{
    if (number == 1) {
        return "D1 2:2:4 out 1 5000 2110; D2 2:2:5 in 1 5200 2110; D3 2:2:6 in 1 5200 2200, in 2 5200 2120";
    }
    if (number == 4) {
        return "D1 2:2:4 out 1 5000 2110; D2 2:2:5 out 1 5000 2200, out 2 5000 2120;"
               "D3 2:2:6 in 1 5200 2200, in 2 5200 2110";
    }
    return "D1 2:2:4 out 1 5000 2120;"
           "D2 2:2:5 in 1 7200 2200, in 2 5200 2110, out 3 5000 1100 req 2, out 4 5000 1210 req 1,"
           " out 5 7000 1220 req 2;"
           "D3 2:2:6 in 1 5300 1110 for 1110, in 2 7300 1220 for 1220";
}
