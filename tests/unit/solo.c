#include "solo.h"

#include <stdlib.h>
#include <string.h>

#include "unity.h"

static const uint8_t required[] = {0x20, 0, 0, 0, 0, 0, 0, 1};
static const uint8_t desired[] = {0x40};
char solo_long_text[1601];

uint8_t solo_gain[16];
uint16_t solo_gain_len;
static uint8_t fixed[] = {1, 2, 3};
static uint16_t fixed_len = sizeof fixed;
uint8_t solo_bulk_bytes[12];

static const pdcp_device_channel_desc_t channels[] = {
    {.direction = PDCP_INPUT, .type = 0x5200, .profile = 0x2110, .descriptor = {"in", 2}},
    {.direction = PDCP_INPUT,
     .terminal = true,
     .type = 0x5300,
     .profile = 0x1110,
     .terminal_profile = 0x1220},
    {.direction = PDCP_OUTPUT,
     .type = 0x5000,
     .profile = 0x1100,
     .descriptor = {"output", 6},
     .required = {required, sizeof required},
     .desired = {desired, sizeof desired}},
};

static const pdcp_device_extra_t extras[] = {
    {0x50, 3, true, sizeof solo_gain, solo_gain, &solo_gain_len},
    {0x51, 0, false, sizeof fixed, fixed, &fixed_len},
};

const pdcp_device_desc_t solo_desc = {
    .identity = {0x0002, 0x0003, 0x0004},
    .ean13_low = 0x11223344,
    .ean13_high = 0x00000055,
    .firmware = 0x0102,
    .hardware = 0x0304,
    .type = 0x0506,
    .profile = 0x0708,
    .descriptor = {solo_long_text, 1600},
    .channels = channels,
    .channel_count = 3,
    .extras = extras,
    .extra_count = 2,
    .bulk = solo_bulk_bytes,
    .bulk_capacity = sizeof solo_bulk_bytes,
};

uint32_t solo_now;
pdcp_device_t solo_dev;

solo_seen_t solo_seen;

static void on_input(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len)
{
    TEST_ASSERT_EQUAL_PTR(&solo_seen, ctx);
    solo_seen.inputs++;
    solo_seen.channel = channel;
    solo_seen.len = len;
    memcpy(solo_seen.data, data, len);
}

static void on_safe(void *ctx, uint8_t channel)
{
    TEST_ASSERT_EQUAL_PTR(&solo_seen, ctx);
    TEST_ASSERT_EQUAL_UINT8(2, channel);
    solo_seen.safes++;
}

static void on_store(void *ctx, const pdcp_device_record_t *record)
{
    TEST_ASSERT_EQUAL_PTR(&solo_seen, ctx);
    solo_seen.stores++;
    solo_seen.record = *record;
}

static void on_reset(void *ctx)
{
    TEST_ASSERT_EQUAL_PTR(&solo_seen, ctx);
    solo_seen.resets++;
}

static void on_written(void *ctx, uint8_t channel, uint8_t param)
{
    TEST_ASSERT_EQUAL_PTR(&solo_seen, ctx);
    TEST_ASSERT_EQUAL_UINT8(3, channel);
    TEST_ASSERT_EQUAL_HEX8(0x50, param);
    solo_seen.written++;
}

const pdcp_device_port_t solo_port = {&solo_seen, on_input, on_safe, on_store, on_reset, on_written};

can_frame_t solo_frame(unsigned id, const char *hex)
{
    can_frame_t frame;
    memset(&frame, 0, sizeof frame);
    frame.id = (uint16_t)id;
    while (*hex != '\0') {
        if (*hex == ' ') {
            hex++;
            continue;
        }
        const char digits[3] = {hex[0], hex[1], '\0'};
        frame.data[frame.dlc++] = (uint8_t)strtoul(digits, NULL, 16);
        hex += 2;
    }
    return frame;
}

uint32_t solo_step(void)
{
    return pdcp_device_step(&solo_dev, solo_now);
}

void solo_rx(unsigned id, const char *hex)
{
    const can_frame_t frame = solo_frame(id, hex);
    pdcp_device_on_frame(&solo_dev, solo_now, &frame);
    (void)solo_step();
}

void solo_check_tx(unsigned line, unsigned id, const char *hex)
{
    const can_frame_t want = solo_frame(id, hex);
    can_frame_t got;
    UNITY_TEST_ASSERT(pdcp_device_tx_peek(&solo_dev, &got), line, "nothing was sent");
    pdcp_device_tx_pop(&solo_dev);
    UNITY_TEST_ASSERT_EQUAL_HEX16(want.id, got.id, line, "identifier");
    UNITY_TEST_ASSERT_EQUAL_UINT8(want.dlc, got.dlc, line, "DLC");
    if (want.dlc != 0) {
        UNITY_TEST_ASSERT_EQUAL_HEX8_ARRAY(want.data, got.data, want.dlc, line, "data");
    }
}

void solo_check_quiet(unsigned line)
{
    can_frame_t got;
    UNITY_TEST_ASSERT(!pdcp_device_tx_peek(&solo_dev, &got), line, "something was sent");
}

void solo_advance(uint32_t ms)
{
    solo_now += ms;
    (void)solo_step();
}

/* Time passes; the arbitrator is heard, beacons are thrown away, anything else fails the test. */
void solo_pass(uint32_t ms)
{
    can_frame_t frame;
    while (ms != 0) {
        const uint32_t part = ms < 100 ? ms : 100;
        solo_now += part;
        ms -= part;
        solo_rx(SOLO_ARB_BEACON, "0A");
        while (pdcp_device_tx_peek(&solo_dev, &frame)) {
            TEST_ASSERT_EQUAL_HEX16(SOLO_BEACON, frame.id);
            TEST_ASSERT_EQUAL_HEX8(0x0A, frame.data[0]);
            pdcp_device_tx_pop(&solo_dev);
        }
    }
}

void solo_boot(const pdcp_device_record_t *record)
{
    TEST_ASSERT_TRUE(pdcp_device_init(&solo_dev, &solo_desc, &solo_port, record, 1, solo_now));
    (void)solo_step();
}

pdcp_device_record_t solo_blank_record(uint8_t node_id)
{
    pdcp_device_record_t record;
    memset(&record, 0, sizeof record);
    record.node_id = node_id;
    for (unsigned i = 0; i < PDCP_DEVICE_CHANNELS_MAX; i++) {
        record.sources[i].identity.vid = 0xFFFF;
        record.sources[i].identity.pid = 0xFFFF;
        record.sources[i].identity.sn = 0xFFFF;
        record.sources[i].channel = 0xFF;
    }
    return record;
}

/* Powered on, bound to id 10h, first beacon taken. */
void solo_bind_with(const pdcp_device_record_t *record)
{
    solo_boot(record);
    SOLO_TX(SOLO_BIND, "01 0200 0300 0400");
    solo_rx(SOLO_TO, "81 10 0200 0300 0400");
    SOLO_TX(SOLO_BEACON, "0A");
}

void solo_bind_blank(void)
{
    const pdcp_device_record_t record = solo_blank_record(SOLO_ID);
    solo_bind_with(&record);
    SOLO_QUIET();
}

/* Input 1 listens to 21h, input 2 to 22h, output 3 sends as 23h. */
void solo_link_all(void)
{
    SOLO_ANSWERED("04 07 01 20 21", "84 01 07 01 20 21");
    SOLO_ANSWERED("04 07 02 20 22", "84 01 07 02 20 22");
    SOLO_ANSWERED("04 05 03 23", "84 01 05 03 23");
    SOLO_ANSWERED("04 04 01 01", "84 01 04 01 01");
    SOLO_ANSWERED("04 04 02 01", "84 01 04 02 01");
    SOLO_ANSWERED("04 04 03 01", "84 01 04 03 01");
}

void solo_reset(void)
{
    solo_now = UINT32_MAX - 500;
    memset(&solo_seen, 0, sizeof solo_seen);
    memset(solo_long_text, 'x', sizeof solo_long_text);
    for (unsigned i = 0; i < 1600; i++) {
        solo_long_text[i] = (char)(i & 0x7F);
    }
    memset(solo_gain, 0, sizeof solo_gain);
    solo_gain[0] = 7;
    solo_gain_len = 1;
    memset(solo_bulk_bytes, 0xEE, sizeof solo_bulk_bytes);
}
