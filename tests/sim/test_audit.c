/* Audit and sources (D-BUS-38, D-BUS-40) of whole limbs: what somebody else's frames and devices that forget
 * do to a limb whose data flow, and for how long. Prints the times. */
#include <stdio.h>
#include <string.h>

#include "systems.h"
#include "unity.h"

enum { LIMIT_MS = 4000, SINGLES = 40 };

static limb_t limb;
static int port; /* somebody else's */

void setUp(void) {}

void tearDown(void)
{
    limb_end(&limb);
}

/* Acceptance system 2 (profile-layer.md 6) has linked itself: D1.1 to D2.2, D2.3 to D3.1, D2.5 to D3.2. */
static void begin_system_2(void)
{
    systems_begin(&limb, 2, 1);
    port = sim_bus_attach(&limb.world.bus, NULL, NULL);
    limb_want(&limb, systems_get(2)->expected);
    limb_plug(&limb, D1, D3);
    limb_await(&limb, 2000);
    limb_run_ms(&limb, 1000);
}

static const pdcp_device_t *device(int part)
{
    return sim_node_device(limb.parts[part].node);
}

/* --- Somebody else --- */

static void send(const can_frame_t *frame)
{
    TEST_ASSERT_TRUE(sim_bus_send(&limb.world.bus, port, frame));
}

static void forge(int part, uint8_t channel, uint8_t param, uint8_t first, uint8_t second)
{
    const can_frame_t frame = {.id =
                                   pdcp_can_id(PDCP_PRIORITY_NORMAL, true, pdcp_device_node_id(device(part))),
                               .dlc = param == PDCP_IN_SOURCE_NODES ? 5 : 4,
                               .data = {PDCP_SET_PARAMETER, param, channel, first, second}};
    send(&frame);
}

static void suspend_all(void)
{
    const can_frame_t frame = {.id = pdcp_can_id(PDCP_PRIORITY_NORMAL, true, PDCP_NODE_BROADCAST),
                               .dlc = 3,
                               .data = {PDCP_SUSPEND, 0, 0}};
    send(&frame);
}

/* A device's own idea of the source of an input, without a word to anybody; written as the arbitrator
 * would. */
static void name_source(int part, uint8_t channel, uint16_t sn, uint8_t index)
{
    const uint16_t id = pdcp_can_id(PDCP_PRIORITY_NORMAL, true, pdcp_device_node_id(device(part)));
    const can_frame_t vid_pid = {
        .id = id, .dlc = 7, .data = {PDCP_SET_PARAMETER, PDCP_IN_SOURCE_VID_PID, channel, 2, 0, 2, 0}};
    const can_frame_t serial = {.id = id,
                                .dlc = 6,
                                .data = {PDCP_SET_PARAMETER, PDCP_IN_SOURCE_SERIAL, channel,
                                         (uint8_t)(sn & 0xFFu), (uint8_t)(sn >> 8), index}};
    send(&vid_pid);
    send(&serial);
    limb_run_ms(&limb, 1);
}

/* --- Tables and devices --- */

static bool input_agrees(const pdcp_channel_t *input, const pdcp_device_channel_t *there)
{
    const pdcp_tables_t *tables = &limb.app.arb.bus.tables;
    if (input->link != PDCP_LINK_ACTIVE) {
        return !there->enabled;
    }
    const pdcp_channel_t *output = &tables->channels[input->source.channel];
    return there->enabled && there->source_device == tables->devices[output->place].node_id &&
           there->source_channel == output->node_id;
}

static bool is_fed(uint8_t output)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *input = &limb.app.arb.bus.tables.channels[i];
        if (input->place != PDCP_NONE && input->link == PDCP_LINK_ACTIVE && input->source.channel == output) {
            return true;
        }
    }
    return false;
}

static bool part_agrees(int part)
{
    const pdcp_tables_t *tables = &limb.app.arb.bus.tables;
    const uint8_t place = pdcp_tables_find(tables, &limb.parts[part].ini->desc.identity);
    if (pdcp_device_suspended(device(part))) {
        return false;
    }
    for (uint8_t c = tables->devices[place].first_channel; c != PDCP_NONE; c = tables->channels[c].next) {
        const pdcp_channel_t *channel = &tables->channels[c];
        const pdcp_device_channel_t *there = pdcp_device_channel(device(part), channel->index);
        if (channel->transfer == PDCP_INPUT) {
            if (!input_agrees(channel, there)) {
                return false;
            }
        } else if (there->enabled != is_fed(c) || (there->enabled && there->node_id != channel->node_id)) {
            return false;
        }
    }
    return true;
}

/* How long it takes until all is as the tables say. */
static uint32_t until_repaired(void)
{
    uint32_t ms = 0;
    limb_run_ms(&limb, 1); /* the frames arrive */
    while (ms < LIMIT_MS && !(part_agrees(D1) && part_agrees(D2) && part_agrees(D3))) {
        limb_run_ms(&limb, 1);
        ms++;
    }
    TEST_ASSERT_LESS_THAN_MESSAGE(LIMIT_MS, ms, "not repaired");
    return ms;
}

static void expect_flow(void)
{
    limb_expect(&limb, systems_get(2)->expected);
    systems_expect_flow(&limb, 2);
}

/* Every frame that stops data, one at a time and at any time of a turn. */
static void test_single_frames(void)
{
    static const struct {
        int part;
        uint8_t channel;
        uint8_t param;
        uint8_t value[2];
        const char *name;
    } frames[] = {
        {D2, 2, PDCP_CH_ENABLED, {0}, "enabled = 0 to an input"},
        {D3, 2, PDCP_CH_ENABLED, {0}, "enabled = 0 to another input"},
        {D1, 1, PDCP_CH_ENABLED, {0}, "enabled = 0 to an output"},
        {D2, 5, PDCP_CH_ENABLED, {0}, "enabled = 0 to another output"},
        {D3, 1, PDCP_IN_SOURCE_NODES, {0x22, 0x40}, "node ids of an input's source"},
        {D2, 3, PDCP_OUT_NODE_ID, {0x33}, "node id of an output"},
        {D2, 4, PDCP_CH_ENABLED, {1}, "enabled = 1 to an output without a link"},
        {D2, 1, PDCP_CH_ENABLED, {1}, "enabled = 1 to an input without a link"},
    };
    for (size_t i = 0; i < sizeof frames / sizeof frames[0]; i++) {
        uint32_t worst_ms = 0;
        uint32_t sum_ms = 0;
        begin_system_2();
        for (unsigned k = 0; k < SINGLES; k++) {
            limb_run_ms(&limb, 20000 + 37 * k); /* no more than three in a minute */
            forge(frames[i].part, frames[i].channel, frames[i].param, frames[i].value[0], frames[i].value[1]);
            const uint32_t took_ms = until_repaired();
            sum_ms += took_ms;
            worst_ms = took_ms > worst_ms ? took_ms : worst_ms;
        }
        expect_flow();
        (void)printf("%s: repaired after %u ms on average, %u ms at worst\n", frames[i].name,
                     (unsigned)(sum_ms / SINGLES), (unsigned)worst_ms);
        TEST_ASSERT_LESS_THAN(1500, worst_ms);
        limb_end(&limb);
    }
    begin_system_2();
}

/* All that can be forged at once, at all channels. */
static void test_all_at_once(void)
{
    begin_system_2();
    for (int part = D1; part <= D3; part++) {
        const pdcp_device_desc_t *desc = &limb.parts[part].ini->desc;
        for (uint8_t i = 1; i <= desc->channel_count; i++) {
            forge(part, i, PDCP_CH_ENABLED, pdcp_device_channel(device(part), i)->enabled ? 0 : 1, 0);
            limb_run_ms(&limb, 1);
            forge(part, i,
                  desc->channels[i - 1].direction == PDCP_INPUT ? PDCP_IN_SOURCE_NODES : PDCP_OUT_NODE_ID,
                  0x33, 0x44);
            limb_run_ms(&limb, 1);
        }
    }
    suspend_all();
    const uint32_t took_ms = until_repaired();
    (void)printf("all channels of three devices at once: repaired after %u ms\n", (unsigned)took_ms);
    TEST_ASSERT_LESS_THAN(3000, took_ms);
    expect_flow();
}

static void test_a_suspend_to_all(void)
{
    begin_system_2();
    suspend_all();
    const uint32_t took_ms = until_repaired();
    (void)printf("Suspend to all: released after %u ms\n", (unsigned)took_ms);
    TEST_ASSERT_LESS_THAN(30, took_ms);
    expect_flow();
}

/* The host's own Suspend is nobody else's. */
static void test_a_suspend_of_the_host(void)
{
    static const uint8_t suspend[] = {2, 0, 2, 0, 4, 0, 3, PDCP_SUSPEND, 0, 0, 0, 0, 0, 0, 0};
    begin_system_2();
    TEST_ASSERT_EQUAL_HEX16(0x230B, limb_ask(&limb, 0x230A, suspend, sizeof suspend));
    suspend_all();
    limb_run_ms(&limb, 5000);
    TEST_ASSERT_TRUE(pdcp_device_suspended(device(D1)));
    TEST_ASSERT_FALSE(pdcp_device_suspended(device(D2)));
    TEST_ASSERT_FALSE(pdcp_device_suspended(device(D3)));
}

/* No frame of data is lost by a repair of what is only wrong in the node id of another device, or in
 * names. */
static void test_a_repair_costs_no_data(void)
{
    begin_system_2();
    limb_run_ms(&limb, 100);
    const uint32_t sent_before = pdcp_device_stats(device(D1))->data_out;
    const uint32_t heard_before = pdcp_device_stats(device(D2))->data_in;
    name_source(D2, 2, 77, 1); /* the arbitrator writes the whole link again */
    limb_run_ms(&limb, 3000);
    const uint32_t sent = pdcp_device_stats(device(D1))->data_out - sent_before;
    TEST_ASSERT_EQUAL(1, limb.events[PDCP_EVENT_AUDIT]);
    TEST_ASSERT_GREATER_THAN(100, sent);
    TEST_ASSERT_UINT32_WITHIN(1, sent, pdcp_device_stats(device(D2))->data_in - heard_before);
}

/* --- Three repairs in a minute --- */

/* Somebody disables the required input of the controller again and again: its link becomes inactive, what
 * requires it rests (D-PRO-9), and the pair is left out for 5 s (D-PRO-14, D-PRO-26). When it is over, all
 * comes back. */
static void test_a_link_that_cannot_be_kept(void)
{
    static const uint8_t hot_swap_only = 0x02; /* flags: nothing else is made up instead */
    begin_system_2();
    TEST_ASSERT_EQUAL_HEX16(0x2405, limb_ask(&limb, 0x2404, &hot_swap_only, 1));
    uint32_t ms = 0;
    char text[LIMB_TEXT];
    do {
        if (pdcp_device_channel(device(D2), 2)->enabled) {
            forge(D2, 2, PDCP_CH_ENABLED, 0, 0);
        }
        limb_run_ms(&limb, 1);
        limb_links(&limb, text);
    } while (text[0] != '\0' && ++ms < 10000);
    (void)printf("a link that cannot be kept: given up after %u ms\n", (unsigned)ms);
    TEST_ASSERT_EQUAL(4, limb.events[PDCP_EVENT_AUDIT]);
    TEST_ASSERT_EQUAL_STRING("", text);
    TEST_ASSERT_EQUAL(3, pdcp_tables_count_links(&limb.app.arb.bus.tables)); /* as inactive ones */
    limb_run_ms(&limb, 1000);
    limb_expect(&limb, "");
    limb_want(&limb, systems_get(2)->expected);
    limb_await(&limb, 6000);
    expect_flow();
}

/* --- A blank arbitrator that replaces this one (D-BUS-38) --- */

/* Another arbitrator, with a blank memory, that makes no links of its own accord: it reads back what the
 * devices say. */
static void replace_arbitrator(void)
{
    limb_stop_arbitrator(&limb);
    sim_nvm_init(&limb.nvm);
    limb.settings.serial = 99;
    limb.settings.no_autoconfig = true;
    limb_start_arbitrator(&limb);
}

static void expect_read_back(const char *links)
{
    replace_arbitrator();
    limb_want(&limb, links);
    limb_await(&limb, 15000); /* for 11 s no output gets an id (D-BUS-36) */
}

static void begin_stored(void)
{
    begin_system_2();
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    limb_run_ms(&limb, 1000);
}

/* A device changes its mind and says so, while a stored configuration decides. */
static void test_a_device_that_asks_for_another_source(void)
{
    begin_stored();
    const can_frame_t update = {.id =
                                    pdcp_can_id(PDCP_PRIORITY_NORMAL, false, pdcp_device_node_id(device(D3))),
                                .dlc = 2,
                                .data = {PDCP_UPDATE_CHANNEL, 1}};
    name_source(D3, 1, 5, 4);
    send(&update);
    limb_run_ms(&limb, 20); /* long before an audit */
    TEST_ASSERT_EQUAL_HEX16(5, pdcp_device_source(device(D3), 1)->identity.sn);
    TEST_ASSERT_EQUAL(3, pdcp_device_source(device(D3), 1)->channel);
    expect_flow();
    expect_read_back(systems_get(2)->expected);
}

/* Devices change what they name, silently: linked inputs and one without a link. */
static void test_devices_that_name_other_sources(void)
{
    begin_stored();
    name_source(D3, 1, 5, 4);
    name_source(D2, 2, 4, 2);
    name_source(D2, 1, 4, 1);
    limb_run_ms(&limb, 3000);
    expect_flow();
    expect_read_back(systems_get(2)->expected);
}

/* A part that comes with a source in mind which the stored configuration does not have. */
static void test_a_part_that_remembers_a_source(void)
{
    systems_begin(&limb, 3, 1);
    port = sim_bus_attach(&limb.world.bus, NULL, NULL);
    systems_configure(&limb, 3);
    limb_run_ms(&limb, 1000);
    const int other = limb_add(&limb, 30, "in 5000 2120");
    limb_power_on(&limb, other);
    limb_run_ms(&limb, 500);
    limb_expect(&limb, systems_get(3)->expected);
    name_source(other, 1, 4, 1);
    limb_power_off(&limb, other);
    limb_run_ms(&limb, 15000); /* forgotten */
    limb_power_on(&limb, other);
    limb_run_ms(&limb, 1000);
    TEST_ASSERT_EQUAL(PDCP_NO_SOURCE_INDEX, pdcp_device_source(device(other), 1)->channel);
    limb_expect(&limb, systems_get(3)->expected);
    expect_read_back(systems_get(3)->expected);
}

/* A link of the stored configuration whose source is missing: its input names that, whatever it named before,
 * and when the source comes, the next arbitrator links the two. */
static void test_a_missing_source_is_named(void)
{
    systems_begin(&limb, 3, 1);
    port = sim_bus_attach(&limb.world.bus, NULL, NULL);
    systems_configure(&limb, 3);
    limb_run_ms(&limb, 1000);
    limb_pull(&limb, D1, D2);
    limb_run_ms(&limb, 15000);
    limb_power_off(&limb, D3);
    limb_blank(&limb, D3);
    limb_run_ms(&limb, 15000);
    limb_power_on(&limb, D3); /* it has forgotten everything */
    limb_run_ms(&limb, 1000);
    TEST_ASSERT_EQUAL_HEX16(5, pdcp_device_source(device(D3), 1)->identity.sn);
    TEST_ASSERT_EQUAL(3, pdcp_device_source(device(D3), 1)->channel);
    replace_arbitrator();
    limb_plug(&limb, D1, D2);
    limb_want(&limb, systems_get(3)->expected);
    limb_await(&limb, 15000);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_single_frames);
    RUN_TEST(test_all_at_once);
    RUN_TEST(test_a_suspend_to_all);
    RUN_TEST(test_a_suspend_of_the_host);
    RUN_TEST(test_a_repair_costs_no_data);
    RUN_TEST(test_a_link_that_cannot_be_kept);
    RUN_TEST(test_a_device_that_asks_for_another_source);
    RUN_TEST(test_devices_that_name_other_sources);
    RUN_TEST(test_a_part_that_remembers_a_source);
    RUN_TEST(test_a_missing_source_is_named);
    return UNITY_END();
}
