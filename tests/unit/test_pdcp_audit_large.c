/* The audit of a large limb: 32 devices with two outputs and two inputs each, 64 links (D-BUS-40). What it
 * asks for, when, and how much of the bus that takes. */
#include <string.h>

#include "exchange.h"
#include "pdcp_bytes.h"
#include "unity.h"

static exchange_t x;

/* Device 0002:0002:0004 id 11h, output 1 with id FEh; device 0002:0002:0006 id 12h, input 1. */
void setUp(void)
{
    exchange_start_limb(&x);
}

void tearDown(void) {}

enum { DEVICES = PDCP_DEVICES_MAX, CHANNELS = PDCP_CHANNELS_MAX, PARAMS = 4 };

#define LIMIT_MS 40000uL
#define BITS_A_MS 1000uL

static uint32_t last_ms[CHANNELS][PARAMS]; /* when it was asked, 0: never */
static uint32_t bus_bits;
static unsigned asked; /* questions, */
static unsigned spare; /* and those for channels without a link */

static void build_limb(void)
{
    pdcp_tables_t *tables = &x.arb->bus.tables;
    pdcp_tables_init(tables);
    for (unsigned at = 0; at < DEVICES; at++) {
        const uint8_t place = (uint8_t)at;
        const pdcp_identity_t identity = {2, 2, (uint16_t)(place + 1)};
        pdcp_tables_add(tables, place, &identity, (uint8_t)(place + 1));
        tables->devices[place].state = PDCP_PLACE_READY;
        tables->devices[place].ack_ms = 100;
        TEST_ASSERT_TRUE(pdcp_tables_set_channels(tables, place, CHANNELS / DEVICES));
    }
    for (unsigned i = 0; i < CHANNELS; i++) {
        pdcp_channel_t *channel = &tables->channels[i];
        channel->transfer = i % 4 < 2 ? PDCP_OUTPUT : PDCP_INPUT;
        channel->enabled = true;
        if (channel->transfer == PDCP_OUTPUT) {
            pdcp_tables_set_output_id(tables, channel, (uint8_t)(254 - i));
        }
    }
    for (unsigned i = 2; i < CHANNELS; i += i % 4 == 2 ? 1 : 3) {
        pdcp_channel_t *channel = &tables->channels[i];
        channel->source.channel = (uint8_t)((i + 2) % CHANNELS); /* an output of the next device */
        channel->source.identity = tables->devices[tables->channels[channel->source.channel].place].identity;
        channel->source.index = tables->channels[channel->source.channel].index;
        channel->link = PDCP_LINK_ACTIVE;
    }
}

/* Bits of a frame with as many stuff bits as can be, and the interframe space. */
static uint32_t bits_of(uint8_t dlc)
{
    return 44u + 8u * dlc + (34u + 8u * dlc - 1u) / 4u + 3u;
}

/* What the device answers when all is as it should be. */
static void answer(uint8_t number, uint8_t param)
{
    const pdcp_tables_t *tables = &x.arb->bus.tables;
    const pdcp_channel_t *channel = &tables->channels[number];
    can_frame_t frame = {.id = (uint16_t)(0x200u | tables->devices[channel->place].node_id),
                         .dlc = 5,
                         .data = {0x83, 1, param, channel->index, channel->enabled ? 1 : 0}};
    if (param == 5 && channel->transfer == PDCP_OUTPUT) {
        frame.data[4] = channel->node_id;
    } else if (param == 5) {
        frame.dlc = 8;
        pdcp_bytes_put_u16(&frame.data[4], channel->source.identity.vid);
        pdcp_bytes_put_u16(&frame.data[6], channel->source.identity.pid);
    } else if (param == 6) {
        frame.dlc = 7;
        pdcp_bytes_put_u16(&frame.data[4], channel->source.identity.sn);
        frame.data[6] = channel->source.index;
    } else if (param == 7) {
        frame.dlc = 6;
        frame.data[4] = tables->devices[tables->channels[channel->source.channel].place].node_id;
        frame.data[5] = tables->channels[channel->source.channel].node_id;
    }
    bus_bits += bits_of(frame.dlc);
    (void)pdcp_arb_on_frame(x.arb, x.now_ms, &frame);
}

static void on_question(const can_frame_t *frame, uint32_t ms)
{
    uint8_t place;
    TEST_ASSERT_EQUAL_HEX16(0x300, frame->id & 0x700u);
    TEST_ASSERT_EQUAL(3, frame->dlc);
    TEST_ASSERT_EQUAL_HEX8(0x03, frame->data[0]);
    TEST_ASSERT_TRUE(pdcp_tables_owner(&x.arb->bus.tables, (uint8_t)(frame->id & 0xFFu), &place));
    const uint8_t number = pdcp_tables_channel(&x.arb->bus.tables, place, frame->data[2]);
    const uint8_t param = frame->data[1];
    uint32_t *last = &last_ms[number][param - 4];
    TEST_ASSERT_LESS_THAN_UINT32(LIMIT_MS, ms - *last);
    *last = ms;
    bus_bits += bits_of(frame->dlc);
    asked++;
    if (!x.arb->bus.tables.channels[number].enabled) {
        TEST_ASSERT_EQUAL(4, param);
        spare++;
    }
    answer(number, param);
}

/* Audits for two minutes. Everything that is to be asked is, no longer than LIMIT_MS after the last time. */
static void audit_limb(void)
{
    memset(last_ms, 0, sizeof last_ms);
    bus_bits = 0;
    asked = 0;
    spare = 0;
    pdcp_arb_plan_links(x.arb, false);
    pdcp_arb_audit(x.arb, x.now_ms);
    const uint32_t start_ms = x.now_ms;
    while (x.now_ms - start_ms < 3 * LIMIT_MS) {
        x.now_ms = pdcp_arb_step(x.arb, x.now_ms);
        (void)pdcp_arb_step(x.arb, x.now_ms);
        const can_frame_t *sent = pdcp_arb_tx_peek(x.arb);
        while (sent != NULL) {
            const can_frame_t frame = *sent;
            pdcp_arb_tx_pop(x.arb);
            if (frame.id != 0x100) {
                on_question(&frame, x.now_ms - start_ms);
            }
            sent = pdcp_arb_tx_peek(x.arb);
        }
    }
    TEST_ASSERT_EQUAL(0, x.arb->bus.stats[PDCP_STAT_AUDIT]);
    TEST_ASSERT_LESS_THAN_UINT32(3 * LIMIT_MS * BITS_A_MS / 100, bus_bits); /* 1 % */
}

static void expect_asked(unsigned number, uint8_t param)
{
    TEST_ASSERT_GREATER_THAN_UINT32(2 * LIMIT_MS, last_ms[number][param - 4]);
}

/* D-BUS-40: a turn of 64 links takes less than 40 s, and less than 1 % of the bus. */
static void test_a_turn_of_64_links(void)
{
    exchange_start(&x, 0xFFFFFF00u);
    build_limb();
    audit_limb();
    for (unsigned i = 0; i < CHANNELS; i++) {
        expect_asked(i, 4);
        expect_asked(i, 5);
        if (i % 4 >= 2) {
            expect_asked(i, 6);
            expect_asked(i, 7);
        } else {
            TEST_ASSERT_EQUAL(0, last_ms[i][6 - 4]);
        }
    }
}

/* 64 inputs that hear one output, and 63 outputs that nobody hears: each fourth question is for one of these,
 * whether it is enabled (4), and nothing else. */
static void test_a_turn_with_channels_that_have_no_link(void)
{
    exchange_start(&x, 0xFFFFFF00u);
    build_limb();
    for (unsigned i = 0; i < CHANNELS; i++) {
        pdcp_channel_t *channel = &x.arb->bus.tables.channels[i];
        if (i % 4 < 2) {
            channel->enabled = i == 0;
        } else {
            channel->source.channel = 0;
            channel->source.identity = x.arb->bus.tables.devices[0].identity;
            channel->source.index = 1;
        }
    }
    audit_limb();
    TEST_ASSERT_EQUAL(asked / 4, spare);
    for (unsigned i = 0; i < CHANNELS; i++) {
        expect_asked(i, 4);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_turn_of_64_links);
    RUN_TEST(test_a_turn_with_channels_that_have_no_link);
    return UNITY_END();
}
