/* The images of the bench's nodes, each on the fake part with an arbitrator and the two other devices of the
 * limb on its bus. NODE_ROLE is that of the image, as in node_dspic33.c. */
#include <setjmp.h>
#include <string.h>
#include <xc.h>

#include "arb_app.h"
#include "fake.h"
#include "fake_port.h"
#include "limb.h"
#include "unity.h"

int firmware_main(void);

enum { PART = NODE_ROLE - 1, ARBITRATOR = LIMB_DEVICES, FRAMES_A_TIME = 4, OLATA = 0x14, VALUE = 200 };

static jmp_buf stopped;
static arb_app_t app;
static pdcp_device_t devices[LIMB_DEVICES]; /* the part's place is not used */
static pdcp_device_port_t ports[LIMB_DEVICES];
static uint64_t started_us;
static uint32_t run_ms;
static uint32_t sent_value;
static uint8_t joystick_value;
static int received[LIMB_DEVICES][9]; /* by device and channel; -1: nothing yet */
static unsigned part_frames;          /* waiting for the part to take them */

static uint32_t now_ms(void)
{
    return (uint32_t)((fake.now_us - started_us) / 1000u);
}

/* A frame of one member of the bus reaches all others. */
static void broadcast(unsigned from, const can_frame_t *frame)
{
    for (unsigned i = 0; i < LIMB_DEVICES; i++) {
        if (i != from && i != PART) {
            pdcp_device_on_frame(&devices[i], now_ms(), frame);
        }
    }
    if (from != ARBITRATOR) {
        arb_app_on_frame(&app, now_ms(), frame);
    }
    if (from != PART && fake_can_receive(frame)) {
        part_frames++;
    }
}

/* The other devices do what node_dspic33.c does: the controller copies, the joystick sends. */
static void on_input(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len)
{
    pdcp_device_t *device = ctx;
    const uint8_t switched = data[0] > 127;
    TEST_ASSERT_EQUAL_UINT8(1, len);
    received[device - devices][channel] = data[0];
    if (device == &devices[LIMB_CONTROLLER] && channel == 2) {
        (void)pdcp_device_send(device, now_ms(), 3, data, 1);
        (void)pdcp_device_send(device, now_ms(), 5, &switched, 1);
    }
}

static bool take_frame(const can_frame_t *frame)
{
    if (part_frames >= FRAMES_A_TIME) {
        return false;
    }
    broadcast(ARBITRATOR, frame);
    return true;
}

static fake_port_t outside; /* without a memory */

static void step_world(void)
{
    can_frame_t frame;
    part_frames = 0;
    while (fake_can_transmit(&frame)) {
        broadcast(PART, &frame);
    }
    for (unsigned i = 0; i < LIMB_DEVICES; i++) {
        if (i != PART) {
            (void)pdcp_device_step(&devices[i], now_ms());
            while (part_frames < FRAMES_A_TIME && pdcp_device_tx_peek(&devices[i], &frame)) {
                pdcp_device_tx_pop(&devices[i]);
                broadcast(i, &frame);
            }
        }
    }
    (void)arb_app_step(&app, now_ms());
    if (now_ms() / 20u != sent_value) {
        sent_value = now_ms() / 20u;
        (void)pdcp_device_send(&devices[LIMB_JOYSTICK], now_ms(), 1, &joystick_value, 1);
    }
    if (now_ms() >= run_ms) {
        longjmp(stopped, 1);
    }
}

/* While the part does not idle, 20 register accesses take a microsecond, as in test_main.c. */
static void on_access(void)
{
    static unsigned accesses;
    accesses = (accesses + 1u) % 2000u;
    if (accesses == 0) {
        step_world();
        fake_run_us(100);
    }
}

static void run(uint32_t ms)
{
    const arb_settings_t settings = {.serial = 1};
    started_us = fake.now_us;
    run_ms = ms;
    sent_value = 0;
    fake.on_idle = step_world;
    fake.on_access = on_access;
    memset(received, 0xFF, sizeof received);
    for (unsigned i = 0; i < LIMB_DEVICES; i++) {
        ports[i] = (pdcp_device_port_t){.ctx = &devices[i], .input = on_input};
        TEST_ASSERT_TRUE(pdcp_device_init(&devices[i], limb_devices[i], &ports[i], NULL, i + 1u, 0));
    }
    fake_port_init(&outside, NULL, 0);
    outside.take_frame = take_frame;
    outside.refuses = true;
    outside.fails = true;
    arb_app_init(&app, &outside.port, &settings, 0);
    if (setjmp(stopped) == 0) {
        (void)firmware_main();
    }
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

/* What the hand shows, or receives, for the value of the stick. */
static void assert_limb_works(void)
{
#if NODE_ROLE == 3
    TEST_ASSERT_EQUAL_HEX8(0x00, fake.expander[OLATA]); /* 200 of 255: eight LEDs of ten, low is on */
    TEST_ASSERT_EQUAL_HEX8(0x03, fake.expander[OLATA + 1] & 0x03);
#else
    TEST_ASSERT_EQUAL_INT(VALUE, received[LIMB_HAND][1]);
    TEST_ASSERT_EQUAL_INT(1, received[LIMB_HAND][2]);
#endif
}

void setUp(void)
{
    fake_power_on(false);
    fake.adc[4] = VALUE << 2;
    fake.adc[5] = 512;
    joystick_value = VALUE;
}

void tearDown(void) {}

static void test_it_takes_its_place_in_the_limb(void)
{
    run(3000);
    assert_limb_works();
}

/* The record names its node id and what it listens to; one of two places of 256 bytes is written. */
static void test_it_remembers(void)
{
    run(3000);
    const uint8_t *place = &fake.eeprom[fake.eeprom[0] != 0xFF ? 0 : 0x100];
    TEST_ASSERT_EQUAL_HEX8(0x50, place[0]);
    TEST_ASSERT_EQUAL_HEX8(0x4E, place[1]);
    fake_power_on(true);
    run(3000);
    assert_limb_works();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_takes_its_place_in_the_limb);
    RUN_TEST(test_it_remembers);
    return UNITY_END();
}
