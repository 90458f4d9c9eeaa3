/* What must be true whatever has happened. Reads the tables and the devices, and decides for itself. */
#include <stdio.h>
#include <string.h>

#include "life.h"
#include "unity.h"

enum { SOLE_ACCESS = 0x0200, SPINS_MAX = 10, TEXT = 160 };

/* --- All the time --- */

static void check_counter(uint32_t *before, uint32_t now, const char *what, unsigned number)
{
    if (now < *before) {
        char text[TEXT];
        (void)snprintf(text, sizeof text, "counter %s %u goes from %u to %u", what, number, (unsigned)*before,
                       (unsigned)now);
        TEST_FAIL_MESSAGE(text);
    }
    *before = now;
}

void life_check_counters(life_counters_t *counters, const arb_app_t *app, uint32_t now_ms)
{
    const uint32_t others[] = {app->api.counters[ARB_HOSTAPI_RECEIVED],
                               app->api.counters[ARB_HOSTAPI_SENT],
                               app->api.counters[ARB_HOSTAPI_REQUESTS],
                               app->api.counters[ARB_HOSTAPI_BUSY],
                               app->api.counters[ARB_HOSTAPI_UNKNOWN],
                               app->api.rx.counters[ARB_HOSTRX_GARBAGE],
                               app->api.rx.counters[ARB_HOSTRX_BAD_SIZES],
                               app->api.rx.counters[ARB_HOSTRX_BAD_CRC8S],
                               app->api.rx.counters[ARB_HOSTRX_BAD_CRC16S],
                               app->api.rx.counters[ARB_HOSTRX_GIVEN_UP],
                               app->api.events.counters[0],
                               app->store.failures,
                               app->limb.config.counters[0],
                               app->limb.config.counters[1],
                               app->limb.config.counters[2],
                               app->limb.config.counters[3]};
    for (unsigned i = 0; i < PDCP_STAT_COUNT; i++) {
        check_counter(&counters->bus[i], app->arb.bus.stats[i], "bus", i);
    }
    for (unsigned i = 0; i < sizeof others / sizeof others[0]; i++) {
        check_counter(&counters->others[i], others[i], "other", i);
    }
    const bool spins = !app->work && (int32_t)(app->next_ms - now_ms) <= 0;
    counters->spins = spins ? counters->spins + 1 : 0;
    TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(SPINS_MAX, counters->spins,
                                      "wants to be called at once, again and again");
}

/* --- When all is calm --- */

static const pdcp_tables_t *tables_of(const limb_t *limb)
{
    return &limb->app.arb.bus.tables;
}

static const limb_part_t *part_of(const limb_t *limb, const pdcp_identity_t *identity)
{
    for (int i = 0; i < limb->count; i++) {
        const pdcp_identity_t *own = &limb->parts[i].ini->desc.identity;
        if (own->vid == identity->vid && own->pid == identity->pid && own->sn == identity->sn) {
            return &limb->parts[i];
        }
    }
    TEST_FAIL_MESSAGE("the tables know a device that there is not");
    return NULL;
}

static const limb_part_t *owner_of(const limb_t *limb, const pdcp_channel_t *channel)
{
    return part_of(limb, &tables_of(limb)->devices[channel->place].identity);
}

/* The channel of the tables; NULL: its device is not set up. */
static const pdcp_channel_t *find_channel(const limb_t *limb, const limb_part_t *part, uint8_t index)
{
    const pdcp_tables_t *tables = tables_of(limb);
    for (int i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = &tables->channels[i];
        if (channel->place != PDCP_NONE && channel->index == index && owner_of(limb, channel) == part &&
            tables->devices[channel->place].state == PDCP_PLACE_READY) {
            return channel;
        }
    }
    return NULL;
}

static bool is_active(const pdcp_channel_t *channel)
{
    return channel != NULL && channel->transfer == PDCP_INPUT && channel->link == PDCP_LINK_ACTIVE;
}

static bool is_fed(const limb_t *limb, const pdcp_channel_t *output)
{
    for (int i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *input = &tables_of(limb)->channels[i];
        if (input->place != PDCP_NONE && is_active(input) &&
            &tables_of(limb)->channels[input->source.channel] == output) {
            return true;
        }
    }
    return false;
}

static void complain(const limb_t *limb, const limb_part_t *part, uint8_t index, const char *why)
{
    char text[TEXT];
    (void)snprintf(text, sizeof text, "channel %d.%u: %s", (int)(part - limb->parts) + 1, index, why);
    TEST_FAIL_MESSAGE(text);
}

/* Does the device refuse parameter 8? Then it is linked without (D-BUS-20). */
static bool refuses_types(const limb_part_t *part, uint8_t index)
{
    for (uint8_t i = 0; i < part->ini->desc.extra_count; i++) {
        if (part->ini->extras[i].param == PDCP_IN_SOURCE_TYPE && part->ini->extras[i].channel == index) {
            return true;
        }
    }
    return false;
}

/* An active link stands in both devices as it does in the tables. */
static void check_active(const limb_t *limb, const limb_part_t *part, const pdcp_channel_t *input)
{
    const pdcp_channel_t *output = &tables_of(limb)->channels[input->source.channel];
    const uint8_t index = input->index;
    TEST_ASSERT_TRUE_MESSAGE(input->source.channel < PDCP_CHANNELS_MAX && output->place != PDCP_NONE,
                             "an active link without source");
    const limb_part_t *feeder = owner_of(limb, output);
    if (feeder->node == NULL || find_channel(limb, feeder, output->index) != output) {
        complain(limb, part, index, "linked to a device that is not there");
    }
    const pdcp_device_t *from = sim_node_device(feeder->node);
    const pdcp_device_channel_t *here = pdcp_device_channel(sim_node_device(part->node), index);
    const pdcp_device_source_t *source = pdcp_device_source(sim_node_device(part->node), index);
    const pdcp_device_channel_t *there = pdcp_device_channel(from, output->index);
    if (!here->enabled || !there->enabled) {
        complain(limb, part, index, here->enabled ? "its source is not enabled" : "linked, but not enabled");
    }
    if (here->source_device != pdcp_device_node_id(from) || here->source_channel != there->node_id ||
        there->node_id != output->node_id) {
        complain(limb, part, index, "listens to other node ids");
    }
    if (!pdcp_identity_equal(&source->identity, &feeder->ini->desc.identity) ||
        source->channel != output->index) {
        complain(limb, part, index, "names another source");
    }
    if ((source->type != output->type || source->profile != output->profile) && !refuses_types(part, index)) {
        complain(limb, part, index, "does not know its source's type");
    }
}

/* Is something pending or under way that silences a channel? A job sees to the output that its input has
 * heard so far, too. */
static bool is_being_silenced(const limb_t *limb, uint8_t number)
{
    const unsigned silences = (unsigned)PDCP_TODO_SILENCE | (unsigned)PDCP_TODO_REMOVE |
                              (unsigned)PDCP_TODO_CONNECT | (unsigned)PDCP_TODO_AGAIN;
    const pdcp_job_t *job = &limb->app.arb.bus.link.job;
    return (tables_of(limb)->channels[number].todo & silences) != 0 ||
           (job->active && (job->input == number || job->output == number || job->old.channel == number));
}

void life_check_silences(const limb_t *limb)
{
    const pdcp_tables_t *tables = tables_of(limb);
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = &tables->channels[i];
        if (channel->place == PDCP_NONE || tables->devices[channel->place].state != PDCP_PLACE_READY) {
            continue;
        }
        const limb_part_t *part = owner_of(limb, channel);
        if (part->node != NULL && pdcp_device_channel(sim_node_device(part->node), channel->index)->enabled &&
            !is_active(channel) && !is_fed(limb, channel) && !is_being_silenced(limb, i)) {
            complain(limb, part, channel->index, "enabled without a link, and nothing ends it");
        }
    }
}

/* Has the host made this link, so that it may lack what it requires (D-PRO-9)? */
static bool is_hosts(const limb_t *limb, const limb_part_t *part, uint8_t index)
{
    const profile_links_t *links = &limb->app.limb.run.links;
    const uint8_t entry = profile_links_find(links, &part->ini->desc.identity, index);
    return entry != PDCP_NONE && links->entries[entry].by_host;
}

static bool requires(const pdcp_device_channel_desc_t *desc, uint8_t index)
{
    const uint8_t *bytes = desc->required.bytes;
    return index / 8 < desc->required.len && (bytes[index / 8] & (0x80u >> (index % 8))) != 0;
}

/* Inputs that a channel requires are connected. */
static bool has_needs(const limb_t *limb, const limb_part_t *part, uint8_t index)
{
    const pdcp_device_desc_t *desc = &part->ini->desc;
    for (uint8_t i = 1; i <= desc->channel_count; i++) {
        if (desc->channels[i - 1].direction == PDCP_INPUT && requires(&desc->channels[index - 1], i) &&
            !is_active(find_channel(limb, part, i))) {
            return false;
        }
    }
    return true;
}

static void check_input(const limb_t *limb, const limb_part_t *part, const pdcp_channel_t *input)
{
    const pdcp_tables_t *tables = tables_of(limb);
    const pdcp_channel_t *output = &tables->channels[input->source.channel];
    check_active(limb, part, input);
    if (!is_hosts(limb, part, input->index) &&
        (!has_needs(limb, part, input->index) || !has_needs(limb, owner_of(limb, output), output->index))) {
        complain(limb, part, input->index, "linked without what it requires");
    }
    for (int i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *other = &tables->channels[i];
        if (other->place != PDCP_NONE && other != input && is_active(other) &&
            other->source.channel == input->source.channel &&
            (other->type & input->type & SOLE_ACCESS) != 0) {
            complain(limb, part, input->index, "sole access is broken");
        }
    }
}

/* An input names the source that it has in the tables, or none (D-BUS-38). Not one that has refused to tell:
 * it is not asked again before it is set up again. */
static void check_source(const limb_t *limb, const limb_part_t *part, const pdcp_channel_t *input)
{
    const uint8_t number = (uint8_t)(input - tables_of(limb)->channels);
    const pdcp_device_source_t *named = pdcp_device_source(sim_node_device(part->node), input->index);
    const bool names_one = named->channel != PDCP_NO_SOURCE_INDEX && named->channel != 0;
    const bool has_source = input->link != PDCP_LINK_NONE;
    if (pdcp_bit(limb->app.arb.bus.audit.refused[PDCP_AUDIT_SERIAL], number)) {
        return;
    }
    if (names_one != has_source ||
        (has_source && (!pdcp_identity_equal(&named->identity, &input->source.identity) ||
                        named->channel != input->source.index))) {
        complain(limb, part, input->index, "names another source than the tables");
    }
}

static void check_channel(const limb_t *limb, const limb_part_t *part, uint8_t index)
{
    const pdcp_channel_t *channel = find_channel(limb, part, index);
    const bool enabled = pdcp_device_channel(sim_node_device(part->node), index)->enabled;
    if (channel == NULL) {
        complain(limb, part, index, "not in the tables");
        return;
    }
    if (channel->transfer == PDCP_OUTPUT) {
        if (enabled && !is_fed(limb, channel)) {
            complain(limb, part, index, "sends, and nobody listens");
        }
    } else if (is_active(channel)) {
        check_input(limb, part, channel);
    } else if (enabled) {
        complain(limb, part, index, "listens without a link");
    }
    if (channel->transfer == PDCP_INPUT) {
        check_source(limb, part, channel);
    }
    if (channel->todo != PDCP_TODO_NONE) {
        complain(limb, part, index, "something is still to be done");
    }
}

void life_check_calm(const limb_t *limb)
{
    int there = 0;
    for (int i = 0; i < limb->count; i++) {
        const limb_part_t *part = &limb->parts[i];
        if (part->node == NULL) {
            continue;
        }
        there++;
        if (pdcp_device_state(sim_node_device(part->node)) != PDCP_DEVICE_BOUND) {
            complain(limb, part, 0, "not bound");
        }
        for (uint8_t index = 1; index <= part->ini->desc.channel_count; index++) {
            check_channel(limb, part, index);
        }
    }
    TEST_ASSERT_EQUAL_MESSAGE(there, pdcp_tables_count_devices(tables_of(limb)), "devices that count");
    TEST_ASSERT_FALSE_MESSAGE(arb_limb_is_busy(&limb->app.limb), "the planner is busy");
    TEST_ASSERT_TRUE_MESSAGE(pdcp_arb_links_settled(&limb->app.arb), "links are not settled");
    TEST_ASSERT_TRUE_MESSAGE(there == 0 || arb_limb_state(&limb->app.limb) == PROFILE_RUNNING,
                             "the profile layer has not started");
}

/* A question of the audit, or its answer (D-BUS-40): reading 4 to 7 of a channel. */
static bool is_audit(const can_frame_t *frame)
{
    const bool asks = (frame->id & 0x700u) == 0x300 && frame->dlc == 3 && frame->data[0] == 0x03;
    const bool answers = (frame->id & 0x700u) == 0x200 && frame->dlc >= 4 && frame->data[0] == 0x83;
    const uint8_t *what = &frame->data[asks ? 1 : 2]; /* parameter, channel index */
    return (asks || answers) && what[0] >= PDCP_CH_ENABLED && what[0] <= PDCP_IN_SOURCE_NODES && what[1] != 0;
}

bool life_check_is_calm_frame(const limb_t *limb, const can_frame_t *frame)
{
    const uint8_t id = (uint8_t)(frame->id & 0xFFu);
    if (frame->dlc == 1 && frame->data[0] == PDCP_BEACON && (frame->id == 0x100 || frame->id == id)) {
        return true;
    }
    if (is_audit(frame)) {
        return true;
    }
    for (int i = 0; i < PDCP_CHANNELS_MAX && frame->id == id; i++) {
        const pdcp_channel_t *channel = &tables_of(limb)->channels[i];
        if (channel->place != PDCP_NONE && channel->transfer == PDCP_OUTPUT && channel->node_id == id) {
            return is_fed(limb, channel);
        }
    }
    return false;
}
