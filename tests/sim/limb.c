#include "limb.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "unity.h"

enum { INI_TEXT = 8192, PATH_TEXT = 160 };

/* --- What the application is given --- */

static bool can_send(void *ctx, const can_frame_t *frame)
{
    limb_t *limb = ctx;
    return sim_world_send(&limb->world, frame);
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    limb_t *limb = ctx;
    TEST_ASSERT_LESS_OR_EQUAL(sizeof limb->answer, limb->answer_len + size);
    memcpy(&limb->answer[limb->answer_len], bytes, size);
    limb->answer_len += size;
    return size;
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    const limb_t *limb = ctx;
    return limb->memory.nvm_read(limb->memory.ctx, address, bytes, size);
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    const limb_t *limb = ctx;
    return limb->memory.nvm_write(limb->memory.ctx, address, bytes, size);
}

static int8_t nvm_status(void *ctx)
{
    const limb_t *limb = ctx;
    return limb->memory.nvm_status(limb->memory.ctx);
}

static limb_moment_t now(const limb_t *limb)
{
    return (limb_moment_t){limb->world.now_us, limb->world.bus.busy_us};
}

static void on_event(void *ctx, uint32_t now_ms, const pdcp_event_t *event)
{
    limb_t *limb = ctx;
    char text[LIMB_TEXT];
    (void)now_ms;
    limb->events[event->kind]++;

    if (event->kind == PDCP_EVENT_READY) {
        limb->ready = now(limb);
    } else if (event->kind == PDCP_EVENT_LOST && limb->lost.time_us == 0) {
        limb->lost = now(limb);
    } else if (event->kind == PDCP_EVENT_LINK) {
        limb_links(limb, text);
        if (strcmp(text, limb->wanted) != 0) {
            limb->linked.time_us = 0;
        } else if (limb->linked.time_us == 0) {
            limb->linked = now(limb);
        }
    }
}

void limb_start_arbitrator(limb_t *limb)
{
    limb->port = (arb_port_t){.ctx = limb,
                              .can_send = can_send,
                              .host_write = host_write,
                              .nvm_read = nvm_read,
                              .nvm_write = nvm_write,
                              .nvm_status = nvm_status};
    arb_app_init(&limb->app, &limb->port, &limb->settings, sim_world_ms(&limb->world));
    arb_app_observe(&limb->app, on_event, limb);
    TEST_ASSERT_TRUE(sim_world_set_app(&limb->world, &limb->app));
}

void limb_stop_arbitrator(limb_t *limb)
{
    (void)sim_world_set_app(&limb->world, NULL);
}

/* --- Parts --- */

static void on_value(void *ctx, const sim_node_event_t *event)
{
    limb_part_t *part = ctx;
    if (event->safe) {
        part->safe[event->channel] = true;
        return;
    }
    part->safe[event->channel] = false;
    part->received[event->channel]++;
    part->value[event->channel] = event->value;
}

static void on_taken(void *ctx, uint8_t channel)
{
    const limb_part_t *part = ctx;
    limb_t *limb = part->limb;
    if (limb->on_taken != NULL) {
        limb->on_taken(limb->taken_ctx, (int)(part - limb->parts), channel);
    }
}

/* Where files of this limb lie; it is made when it is needed. */
static void file_name(limb_t *limb, char path[PATH_TEXT], int part, const char *extension)
{
    if (limb->folder[0] == '\0') {
        const char *folder = getenv("TMPDIR");
        (void)snprintf(limb->folder, sizeof limb->folder, "%.40s/pdcp-limb-XXXXXX",
                       folder != NULL ? folder : "/tmp");
        TEST_ASSERT_NOT_NULL_MESSAGE(mkdtemp(limb->folder), limb->folder);
    }
    (void)snprintf(path, PATH_TEXT, "%s/%d.%s", limb->folder, part, extension);
}

static int add_text(limb_t *limb, const char *text)
{
    char path[PATH_TEXT];
    char error[256];
    const int number = limb->count++;
    limb_part_t *part = &limb->parts[number];
    TEST_ASSERT_LESS_THAN(LIMB_PARTS_MAX, number);
    file_name(limb, path, number, "ini");
    FILE *file = fopen(path, "we");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    const size_t len = strlen(text);
    TEST_ASSERT_EQUAL(len, fwrite(text, 1, len, file));
    TEST_ASSERT_EQUAL(0, fclose(file));
    part->limb = limb;
    part->ini = node_ini_load(path, error, sizeof error);
    (void)unlink(path);
    TEST_ASSERT_NOT_NULL_MESSAGE(part->ini, error);
    return number;
}

static int state_line(const limb_t *limb, char *text, size_t size)
{
    return limb->keeps ? snprintf(text, size, "state = %d.state\n", limb->count) : 0;
}

int limb_add_file(limb_t *limb, const char *path)
{
    static const char device[] = "[device]\n";
    char file_text[INI_TEXT];
    char text[INI_TEXT + 64] = "";
    FILE *file = fopen(path, "re");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    const size_t size = fread(file_text, 1, sizeof file_text - 1, file);
    (void)fclose(file);
    file_text[size] = '\0';
    const char *head = strstr(file_text, device);
    TEST_ASSERT_NOT_NULL_MESSAGE(head, path);
    int used = snprintf(text, sizeof text, "%s", device);
    used += state_line(limb, &text[used], sizeof text - (size_t)used);
    (void)snprintf(&text[used], sizeof text - (size_t)used, "%s", head + sizeof device - 1);
    return add_text(limb, text);
}

/* One channel of a text, as lines of a description. Returns how long they are. */
static int channel_lines(char *lines, size_t size, int index, char *text)
{
    char direction[8];
    unsigned type;
    unsigned profile;
    char *rest = strchr(text, ',');
    const bool has_signal = strstr(text, "signal") != NULL;
    TEST_ASSERT_EQUAL_MESSAGE(3, sscanf(text, " %7s %x %x", direction, &type, &profile), text);
    const bool is_output = strcmp(direction, "out") == 0;
    int used = snprintf(lines, size, "[channel %d]\ndirection = %sput\ntype = 0x%04X\nprofile = 0x%04X\n",
                        index, direction, type, profile);
    if (is_output && !has_signal) {
        used += snprintf(&lines[used], size - (size_t)used, "signal = sine 0 1 700\nrate_ms = 20\n");
    }
    for (char *line = rest; line != NULL; line = rest) {
        rest = strchr(line + 1, ',');
        if (rest != NULL) {
            *rest = '\0';
        }
        used += snprintf(&lines[used], size - (size_t)used, "%s\n", line + 1 + strspn(line + 1, " "));
    }
    return used;
}

int limb_add_with(limb_t *limb, uint16_t serial, const char *channels, const char *more)
{
    char copy[2048];
    char text[INI_TEXT];
    TEST_ASSERT_LESS_THAN(sizeof copy, strlen(channels));
    (void)snprintf(copy, sizeof copy, "%s", channels);
    int used = snprintf(text, sizeof text, "[device]\nvid = 2\npid = 2\nserial = %u\n", serial);
    used += state_line(limb, &text[used], sizeof text - (size_t)used);
    used += snprintf(&text[used], sizeof text - (size_t)used, "%s\n", more);
    int index = 1;
    char *rest = NULL;
    for (char *at = strtok_r(copy, ";", &rest); at != NULL; at = strtok_r(NULL, ";", &rest)) {
        used += channel_lines(&text[used], sizeof text - (size_t)used, index++, at);
        TEST_ASSERT_LESS_THAN(sizeof text, used);
    }
    return add_text(limb, text);
}

int limb_add(limb_t *limb, uint16_t serial, const char *channels)
{
    return limb_add_with(limb, serial, channels, "");
}

void limb_power_on(limb_t *limb, int device)
{
    char error[256];
    limb_part_t *part = &limb->parts[device];
    const uint32_t seed = limb->seed + (uint32_t)(device + 1) * 977u + (uint32_t)limb->world.now_us;
    part->node = sim_node_open(part->ini, seed, limb->world.now_us, on_value, part, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(part->node, error);
    sim_node_on_taken(part->node, on_taken, part);
    TEST_ASSERT_TRUE(sim_world_add(&limb->world, part->node));
}

void limb_power_off(limb_t *limb, int device)
{
    sim_world_remove(&limb->world, limb->parts[device].node);
    sim_node_close(limb->parts[device].node);
    limb->parts[device].node = NULL;
}

void limb_cut(limb_t *limb, int device, bool cut)
{
    sim_world_cut(&limb->world, limb->parts[device].node, cut);
}

int limb_part_at(const limb_t *limb, int port)
{
    const sim_node_t *node = sim_world_node_at(&limb->world, port);
    for (int i = 0; node != NULL && i < limb->count; i++) {
        if (limb->parts[i].node == node) {
            return i;
        }
    }
    return -1;
}

void limb_plug(limb_t *limb, int first, int last)
{
    for (int i = first; i <= last; i++) {
        limb_power_on(limb, i);
    }
}

void limb_pull(limb_t *limb, int first, int last)
{
    for (int i = first; i <= last; i++) {
        limb_power_off(limb, i);
    }
}

void limb_blank(limb_t *limb, int device)
{
    char path[PATH_TEXT];
    file_name(limb, path, device, "state");
    (void)unlink(path);
}

void limb_run_ms(limb_t *limb, uint32_t ms)
{
    (void)sim_world_run(&limb->world, limb->world.now_us + (uint64_t)ms * 1000u);
}

/* --- The whole --- */

/* Hears all frames: what an output sends. */
static void on_frame(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    limb_t *limb = ctx;
    (void)time_us;
    const uint8_t id = pdcp_id_node(frame->id);
    if (!pdcp_id_from_arbitrator(frame->id) && id <= PDCP_NODE_MAX && frame->dlc != 0) {
        limb->last[id] = frame->data[0];
    }
}

void limb_begin(limb_t *limb, uint32_t seed, uint32_t clock_ms)
{
    memset(limb, 0, sizeof *limb);
    limb->seed = seed;
    limb->settings = (arb_settings_t){.serial = seed, .seed = seed};
    sim_nvm_init(&limb->nvm);
    sim_nvm_port(&limb->nvm, &limb->memory);
    sim_world_init(&limb->world, 0, clock_ms);
    TEST_ASSERT_GREATER_OR_EQUAL(0, sim_bus_attach(&limb->world.bus, on_frame, limb));
    limb_start_arbitrator(limb);
}

void limb_start(limb_t *limb, uint32_t seed, uint32_t clock_ms)
{
    limb_begin(limb, seed, clock_ms);
    limb->settings =
        (arb_settings_t){.serial = seed, .seed = seed, .strict_crc = true, .no_autoconfig = true};
    limb_stop_arbitrator(limb);
    limb_start_arbitrator(limb);
    for (int i = 0; i < LIMB_DEVICES; i++) {
        char path[PATH_TEXT];
        (void)snprintf(path, sizeof path, LIMB_FILES "/d%d.ini", i + 1);
        limb_power_on(limb, limb_add_file(limb, path));
    }
}

void limb_end(limb_t *limb)
{
    for (int i = 0; i < limb->count; i++) {
        if (limb->parts[i].node != NULL) {
            limb_power_off(limb, i);
        }
        node_ini_free(limb->parts[i].ini);
        limb_blank(limb, i);
    }
    if (limb->folder[0] != '\0') {
        (void)rmdir(limb->folder);
    }
}

/* --- The host --- */

uint16_t limb_ask(limb_t *limb, uint16_t id, const uint8_t *payload, uint16_t len)
{
    uint8_t bytes[64];
    if (len != 0) {
        memcpy(&bytes[ARB_HOST_HEADER], payload, len);
    }
    const uint16_t total = arb_hostcodec_finish(bytes, id, 1, len);
    limb->answer_len = 0;
    TEST_ASSERT_EQUAL(total, arb_app_on_bytes(&limb->app, sim_world_ms(&limb->world), bytes, total));
    sim_world_touch_app(&limb->world);
    for (int i = 0; i < 4000 && limb->answer_len == 0; i++) {
        limb_run_ms(limb, 1);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_MESSAGE(8, limb->answer_len, "no answer");
    return (uint16_t)(limb->answer[2] | limb->answer[3] << 8);
}

uint16_t limb_link(limb_t *limb, uint8_t out_sn, uint8_t out, uint8_t in_sn, uint8_t in)
{
    const uint8_t payload[] = {2, 0, 2, 0, out_sn, 0, out, 2, 0, 2, 0, in_sn, 0, in};
    return limb_ask(limb, 0x2307, payload, sizeof payload);
}

uint16_t limb_act(limb_t *limb, arb_action_t action, uint8_t argument)
{
    const uint8_t payload[] = {(uint8_t)action, argument};
    const uint16_t id = limb_ask(limb, 0x2407, payload, sizeof payload);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(0x2408, id, "the action failed");
    return (uint16_t)(limb->answer[8] | limb->answer[9] << 8);
}

/* --- Links --- */

/* The part that is bound at a place of the tables. */
static int part_at(const limb_t *limb, uint8_t place)
{
    for (int i = 0; i < limb->count; i++) {
        if (pdcp_identity_equal(&limb->parts[i].ini->desc.identity,
                                &limb->app.arb.bus.tables.devices[place].identity)) {
            return i;
        }
    }
    TEST_FAIL_MESSAGE("nobody's identity is bound");
    return 0;
}

/* The input of a part in the tables; NULL: it is not there. */
static const pdcp_channel_t *input_of(const limb_t *limb, int part, uint8_t index)
{
    const pdcp_tables_t *tables = &limb->app.arb.bus.tables;
    const uint8_t place = pdcp_tables_find(tables, &limb->parts[part].ini->desc.identity);
    const uint8_t channel = place != PDCP_NONE ? pdcp_tables_channel(tables, place, index) : PDCP_NONE;
    return channel != PDCP_NONE && tables->channels[channel].transfer == PDCP_INPUT
               ? &tables->channels[channel]
               : NULL;
}

static const pdcp_channel_t *active_input(const limb_t *limb, int part, uint8_t index)
{
    const pdcp_channel_t *input = input_of(limb, part, index);
    return input != NULL && input->link == PDCP_LINK_ACTIVE ? input : NULL;
}

void limb_links(const limb_t *limb, char text[LIMB_TEXT])
{
    const pdcp_tables_t *tables = &limb->app.arb.bus.tables;
    int used = 0;
    text[0] = '\0';
    for (int part = 0; part < limb->count; part++) {
        for (uint8_t i = 1; i <= limb->parts[part].ini->desc.channel_count; i++) {
            const pdcp_channel_t *input = active_input(limb, part, i);
            if (input != NULL) {
                const pdcp_channel_t *output = &tables->channels[input->source.channel];
                used +=
                    snprintf(&text[used], (size_t)(LIMB_TEXT - used), "%s%d.%u>%d.%u", used == 0 ? "" : " ",
                             part_at(limb, output->place) + 1, output->index, part + 1, i);
                TEST_ASSERT_LESS_THAN(LIMB_TEXT, used);
            }
        }
    }
}

void limb_want(limb_t *limb, const char *links)
{
    TEST_ASSERT_LESS_THAN(LIMB_TEXT, strlen(links));
    (void)snprintf(limb->wanted, sizeof limb->wanted, "%s", links);
    memset(&limb->lost, 0, sizeof limb->lost);
    memset(&limb->ready, 0, sizeof limb->ready);
    memset(&limb->linked, 0, sizeof limb->linked);
}

/* Does an active link have this output as its source? */
static bool is_source(const limb_t *limb, int part, uint8_t index)
{
    const pdcp_tables_t *tables = &limb->app.arb.bus.tables;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *input = &tables->channels[i];
        if (input->place != PDCP_NONE && input->link == PDCP_LINK_ACTIVE &&
            input->source.channel != PDCP_NONE && tables->channels[input->source.channel].index == index &&
            part_at(limb, tables->channels[input->source.channel].place) == part) {
            return true;
        }
    }
    return false;
}

static void check_channel(const limb_t *limb, int part, uint8_t index)
{
    const pdcp_tables_t *tables = &limb->app.arb.bus.tables;
    const pdcp_device_t *device = sim_node_device(limb->parts[part].node);
    const pdcp_device_channel_t *channel = pdcp_device_channel(device, index);
    const pdcp_channel_t *input = active_input(limb, part, index);
    char name[32];
    (void)snprintf(name, sizeof name, "channel %d.%u", part + 1, index);
    if (input == NULL) {
        TEST_ASSERT_EQUAL_MESSAGE(is_source(limb, part, index), channel->enabled, name);
        return;
    }
    const pdcp_channel_t *output = &tables->channels[input->source.channel];
    const pdcp_device_source_t *source = pdcp_device_source(device, index);
    TEST_ASSERT_TRUE_MESSAGE(channel->enabled, name);
    TEST_ASSERT_EQUAL_MESSAGE(tables->devices[output->place].node_id, channel->source_device, name);
    TEST_ASSERT_EQUAL_MESSAGE(output->node_id, channel->source_channel, name);
    TEST_ASSERT_EQUAL_MESSAGE(output->index, source->channel, name);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(tables->devices[output->place].identity.sn, source->identity.sn, name);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(output->profile, source->profile, name);
}

void limb_expect(limb_t *limb, const char *links)
{
    char text[LIMB_TEXT];
    limb_links(limb, text);
    TEST_ASSERT_EQUAL_STRING(links, text);
    for (int part = 0; part < limb->count; part++) {
        for (uint8_t i = 1; limb->parts[part].node != NULL && i <= limb->parts[part].ini->desc.channel_count;
             i++) {
            check_channel(limb, part, i);
        }
    }
}

static bool is_at_rest(const limb_t *limb)
{
    return !arb_limb_is_busy(&limb->app.limb) && pdcp_arb_links_settled(&limb->app.arb) &&
           arb_limb_state(&limb->app.limb) == PROFILE_RUNNING;
}

void limb_await(limb_t *limb, uint32_t max_ms)
{
    char text[LIMB_TEXT];
    for (uint32_t ms = 0; ms < max_ms; ms++) {
        limb_run_ms(limb, 1);
        limb_links(limb, text);
        if (strcmp(text, limb->wanted) == 0 && is_at_rest(limb)) {
            break;
        }
    }
    TEST_ASSERT_EQUAL_STRING(limb->wanted, text);
    limb_run_ms(limb, 20);
    limb_expect(limb, limb->wanted);
}

/* So many values have arrived at a part. Those at inputs that are not terminal its device counts together. */
static uint32_t arrived_at(const limb_t *limb, int part, uint8_t index)
{
    const limb_part_t *each = &limb->parts[part];
    return each->ini->channels[index - 1].terminal ? (uint32_t)each->received[index]
                                                   : pdcp_device_stats(sim_node_device(each->node))->data_in;
}

void limb_expect_flow(limb_t *limb)
{
    static uint32_t before[LIMB_PARTS_MAX][PDCP_DEVICE_CHANNELS_MAX + 1];
    for (int pass = 0; pass < 2; pass++) {
        for (int part = 0; part < limb->count; part++) {
            for (uint8_t i = 1; i <= limb->parts[part].ini->desc.channel_count; i++) {
                if (active_input(limb, part, i) == NULL) {
                    continue;
                }
                const uint32_t count = arrived_at(limb, part, i);
                TEST_ASSERT_TRUE_MESSAGE(pass == 0 || count - before[part][i] >= 10, "too few values arrive");
                before[part][i] = count;
            }
        }
        limb_run_ms(limb, pass == 0 ? 400 : 0);
    }
}
