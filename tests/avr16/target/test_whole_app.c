/* The application as the dsPIC has it, 32 devices and 128 channels, in 16 KB RAM together with its stack:
 * a device is bound and set up, and the host is answered. Frames and bytes are written by hand from
 * pdcp-bus.md 3 to 5 and host-api.md 2. */
#include <string.h>

#include "arb_app.h"
#include "fake_port.h"
#include "unity.h"

/* Does not compile with other capacities. */
typedef char capacities_are_those_of_the_dspic[PDCP_DEVICES_MAX == 32 && PDCP_CHANNELS_MAX == 128 ? 1 : -1];

static arb_app_t app;
static uint32_t now_ms;

static can_frame_t sent[4]; /* by the application, oldest first */
static uint8_t sent_count;

static uint8_t answers[32]; /* bytes for the host */
static fake_port_t fake;

static bool take_frame(const can_frame_t *frame)
{
    if (sent_count == sizeof sent / sizeof sent[0]) {
        return false;
    }
    sent[sent_count++] = *frame;
    return true;
}

static void receive(uint16_t id, const uint8_t *data, uint8_t dlc)
{
    can_frame_t frame;
    memset(&frame, 0, sizeof frame);
    frame.id = id;
    frame.dlc = dlc;
    memcpy(frame.data, data, dlc);
    arb_app_on_frame(&app, now_ms, &frame);
    (void)arb_app_step(&app, now_ms);
}

/* The application has sent exactly this frame and no other since the last call. */
static void expect(uint16_t id, const uint8_t *data, uint8_t dlc)
{
    TEST_ASSERT_EQUAL(1, sent_count);
    TEST_ASSERT_EQUAL_HEX16(id, sent[0].id);
    TEST_ASSERT_EQUAL(dlc, sent[0].dlc);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, sent[0].data, dlc);
    sent_count = 0;
}

#define BYTES(...) (const uint8_t[]){__VA_ARGS__}, (uint8_t)sizeof((const uint8_t[]){__VA_ARGS__})

void setUp(void)
{
    static const arb_settings_t settings = {.seed = 253, .strict_crc = true};
    now_ms = 0xFFFFFF00u;
    sent_count = 0;
    fake_port_init(&fake, NULL, 0);
    fake.take_frame = take_frame;
    fake.out = answers;
    fake.out_max = sizeof answers;
    arb_app_init(&app, &fake.port, &settings, now_ms);
    (void)arb_app_step(&app, now_ms);
    expect(0x100, BYTES(0x0A));
}

void tearDown(void) {}

/* 0002:0002:0004 with id 11h, which has one output. */
static void bind_and_set_up(void)
{
    receive(0x611, BYTES(0x01, 2, 0, 2, 0, 4, 0));
    now_ms += PDCP_HOLD_MS; /* the first request is held (D-BUS-42) */
    (void)arb_app_step(&app, now_ms);
    TEST_ASSERT_EQUAL(2, sent_count); /* the grant, and the first request of the setup */
    TEST_ASSERT_EQUAL_HEX16(0x311, sent[0].id);
    TEST_ASSERT_EQUAL(8, sent[0].dlc);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(((const uint8_t[]){0x81, 0x11, 2, 0, 2, 0, 4, 0}), sent[0].data, 8);
    sent[0] = sent[1];
    sent_count = 1;
    expect(0x311, BYTES(0x03, 1, 0));
    receive(0x211, BYTES(0x83, 1, 1, 0, 2, 0, 2, 0));
    expect(0x311, BYTES(0x03, 2, 0));
    receive(0x211, BYTES(0x83, 1, 2, 0, 4, 0));
    expect(0x311, BYTES(0x03, 6, 0));
    receive(0x211, BYTES(0x83, 0, 6, 0));
    expect(0x311, BYTES(0x03, 0x0B, 0));
    receive(0x211, BYTES(0x83, 1, 0x0B, 0, 0x64, 0));
    expect(0x311, BYTES(0x03, 0x0A, 0));
    receive(0x211, BYTES(0x83, 1, 0x0A, 0, 0xF4, 1));
    expect(0x311, BYTES(0x03, 9, 0));
    receive(0x211, BYTES(0x83, 1, 9, 0, 1));
    expect(0x311, BYTES(0x04, 4, 1, 0));
    receive(0x211, BYTES(0x84, 1, 4, 1, 0));
    expect(0x311, BYTES(0x03, 3, 1));
    receive(0x211, BYTES(0x83, 1, 3, 1, 2));
    expect(0x311, BYTES(0x03, 1, 1));
    receive(0x211, BYTES(0x83, 1, 1, 1, 0, 0x50, 0x20, 0x21));
    expect(0x311, BYTES(0x03, 9, 1));
    receive(0x211, BYTES(0x83, 0, 9, 1));
    expect(0x311, BYTES(0x03, 0x0A, 1));
    receive(0x211, BYTES(0x83, 0, 0x0A, 1));
    expect(0x311, BYTES(0x04, 5, 1, 0xFE));
    receive(0x211, BYTES(0x84, 1, 5, 1, 0xFE));
    receive(0x011, BYTES(0x0A));
    TEST_ASSERT_EQUAL(0, sent_count);
}

/* 2201h, reference 07, CRC8 96h: one device, no input, one output, no link. The checksums of the answer were
 * computed apart: CRC8 over 02 22 07 06 00, CRC16 over 01 00 01 00. */
static void test_a_device_is_bound_and_the_host_sees_it(void)
{
    static const uint8_t request[] = {0xFE, 0x19, 0x01, 0x22, 0x07, 0x96, 0x00, 0x00};
    static const uint8_t want[] = {0xFE, 0x19, 0x02, 0x22, 0x07, 0x4E, 0x06, 0x00, 1, 0, 1, 0, 0x45, 0xC1};
    bind_and_set_up();
    TEST_ASSERT_EQUAL(sizeof request, arb_app_on_bytes(&app, now_ms, request, sizeof request));
    (void)arb_app_step(&app, now_ms);
    TEST_ASSERT_EQUAL(sizeof want, fake.out_len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(want, answers, sizeof want);
}

/* Its time passes: beacons every 500 ms, the write of the identity, and every 240 ms the audit asks whether
 * its output, which nobody hears, is silent (D-BUS-40). */
static void test_time_passes(void)
{
    bind_and_set_up();
    unsigned beacons = 0;
    unsigned questions = 0;
    for (unsigned i = 1; i <= 1000; i++) {
        now_ms++;
        if (i % 400 == 0) {
            receive(0x011, BYTES(0x0A));
        }
        (void)arb_app_step(&app, now_ms);
        if (sent_count != 0 && sent[0].id == 0x311) {
            expect(0x311, BYTES(0x03, 4, 1));
            receive(0x211, BYTES(0x83, 1, 4, 1, 0));
            questions++;
        } else if (sent_count != 0) {
            expect(0x100, BYTES(0x0A));
            beacons++;
        }
    }
    TEST_ASSERT_EQUAL(2, beacons);
    TEST_ASSERT_EQUAL(4, questions);
    TEST_ASSERT_FALSE(app.store.changed);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_device_is_bound_and_the_host_sees_it);
    RUN_TEST(test_time_passes);
    return UNITY_END();
}
