/* The whole arbitrator as it runs on the part: main_dspic33.c with all drivers, against fake registers.
 * Devices are pdcp_device on the other end of the controller; the host sends bytes and reads what comes
 * back. */
#include <setjmp.h>
#include <string.h>
#include <xc.h>

#include "fake.h"
#include "limb.h"
#include "unity.h"

int firmware_main(void);

enum { REQUEST_MAX = 16, FRAMES_A_TIME = 4, WATCHED = 2 };

static jmp_buf stopped;
static pdcp_device_t devices[LIMB_DEVICES];
static unsigned device_count;
static uint64_t started_us;
static uint32_t run_ms;

/* What the host sends, and when. */
static struct {
    uint32_t at_ms;
    size_t size;
    uint8_t bytes[REQUEST_MAX];
    size_t sent;
} request;

static uint32_t bus_off_ms; /* 0: never */
static bool line_error;     /* before the request comes a byte that is none */
static uint32_t held_ms;    /* the controller was kept away from the bus until then */
static unsigned inputs;     /* values that the controller's muscle input received */
static uint8_t last_input;
static uint32_t sent_value; /* the joystick's, one each 20 ms */
static unsigned idles_in_start;

static void on_input(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len)
{
    if (ctx == &devices[1] && channel == WATCHED && len == 1) {
        inputs++;
        last_input = data[0];
    }
}

static pdcp_device_port_t ports[LIMB_DEVICES];

static uint32_t now_ms(void)
{
    return (uint32_t)((fake.now_us - started_us) / 1000u);
}

static void step_devices(void)
{
    can_frame_t frame;
    while (fake_can_transmit(&frame)) {
        for (unsigned i = 0; i < device_count; i++) {
            pdcp_device_on_frame(&devices[i], now_ms(), &frame);
        }
    }
    unsigned room = FRAMES_A_TIME;
    for (unsigned i = 0; i < device_count; i++) {
        (void)pdcp_device_step(&devices[i], now_ms());
        while (room != 0 && pdcp_device_tx_peek(&devices[i], &frame) && fake_can_receive(&frame)) {
            pdcp_device_tx_pop(&devices[i]);
            room--;
            for (unsigned other = 0; other < device_count; other++) {
                if (other != i) {
                    pdcp_device_on_frame(&devices[other], now_ms(), &frame);
                }
            }
        }
    }
}

/* Bus-off ends when the controller leaves the bus (it is in disable mode). */
static void step_bus(void)
{
    if (bus_off_ms != 0 && now_ms() >= bus_off_ms && held_ms == 0) {
        held_ms = now_ms();
        fake_can_error(0x2000, 255, 0, 0x0020);
    } else if (held_ms != 0 && (fake_peek(0x0400) >> 5 & 7u) == 1) {
        held_ms = now_ms();
        fake_can_error(0, 0, 0, 0);
    }
}

static void step_world(void)
{
    step_bus();
    step_devices();
    if (line_error && now_ms() >= request.at_ms) {
        line_error = false;
        fake_uart_receive(0, true);
    } else if (now_ms() >= request.at_ms && request.sent < request.size) {
        fake_uart_receive(request.bytes[request.sent++], false);
    }
    if (now_ms() / 20u != sent_value) {
        sent_value = now_ms() / 20u;
        const uint8_t value = (uint8_t)sent_value;
        (void)pdcp_device_send(&devices[0], now_ms(), 1, &value, 1);
    }
    if (now_ms() >= run_ms) {
        longjmp(stopped, 1);
    }
}

/* D-MCU-2: Handlers wait until the part is awake, so not much may come at once. While the program starts, and
 * idles until the EEPROM has answered, the controller is not on the bus yet: nobody would take its frames,
 * and who sends them repeats them. */
static void on_idle(void)
{
    if (fake.watchdog_kicks == 0) {
        idles_in_start++;
        TEST_ASSERT_EQUAL_HEX16(0x0080, fake_peek(0x0400) & 0x00E0);
    }
    step_world();
}

/* While it does not idle, 20 register accesses take a microsecond, and the world goes on ten times a
 * millisecond. */
static void on_access(void)
{
    static unsigned accesses;
    accesses = (accesses + 1u) % 2000u;
    if (accesses == 0) {
        step_world();
        fake_run_us(100);
    }
}

/* Runs the firmware from its first instruction for so long; the request is sent on the way. */
static void run(uint32_t ms, uint32_t request_ms, const uint8_t *bytes, size_t size)
{
    started_us = fake.now_us;
    run_ms = ms;
    inputs = 0;
    held_ms = 0;
    idles_in_start = 0;
    fake.watchdog_kicks = 0;
    fake.uart_sent_count = 0;
    fake.on_idle = on_idle;
    fake.on_access = on_access;
    sent_value = 0;
    memset(&request, 0, sizeof request);
    request.at_ms = request_ms;
    request.size = size;
    memcpy(request.bytes, bytes, size);
    for (unsigned i = 0; i < LIMB_DEVICES; i++) {
        ports[i] = (pdcp_device_port_t){.ctx = &devices[i], .input = on_input};
        TEST_ASSERT_TRUE(pdcp_device_init(&devices[i], limb_devices[i], &ports[i], NULL, i + 1u, 0));
    }
    if (setjmp(stopped) == 0) {
        (void)firmware_main();
    }
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

/* The newest answer in what was sent. */
static void assert_answer(const uint8_t *bytes, size_t size)
{
    TEST_ASSERT_TRUE(fake.uart_sent_count >= size);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(bytes, &fake.uart_sent[fake.uart_sent_count - size], size);
}

/* host-api.md 1 and 2: 2201h, and 2202h with 3 devices, 4 inputs, 4 outputs, 3 links. */
static const uint8_t get_info[] = {0xFE, 0x19, 0x01, 0x22, 0x01, 0xEB, 0x00, 0x00};
static const uint8_t info[] = {0xFE, 0x19, 0x02, 0x22, 0x01, 0x33, 0x06,
                               0x00, 0x03, 0x04, 0x04, 0x03, 0x7B, 0x3F};
static const uint8_t empty_info[] = {0xFE, 0x19, 0x02, 0x22, 0x01, 0x33, 0x06,
                                     0x00, 0x00, 0x00, 0x00, 0x00, 0xC0, 0x84};
/* 2407h, save the active configuration; 2408h, 0. */
static const uint8_t save[] = {0xFE, 0x19, 0x07, 0x24, 0x02, 0x3D, 0x04, 0x00, 0x01, 0x00, 0x3E, 0x2E};
static const uint8_t saved[] = {0xFE, 0x19, 0x08, 0x24, 0x02, 0x0D, 0x04, 0x00, 0x00, 0x00, 0x0F, 0x1D};

void setUp(void)
{
    fake_power_on(false);
    bus_off_ms = 0;
    device_count = LIMB_DEVICES;
}

void tearDown(void) {}

static void test_limb_links_itself_and_the_host_sees_it(void)
{
    run(3000, 2500, get_info, sizeof get_info);
    assert_answer(info, sizeof info);
    TEST_ASSERT_TRUE(inputs >= 20);
    TEST_ASSERT_UINT8_WITHIN(1, 3000 / 20 % 256, last_input);
    TEST_ASSERT_TRUE(fake.watchdog_kicks >= 2500);
    TEST_ASSERT_TRUE(idles_in_start != 0);
}

static void test_no_devices(void)
{
    device_count = 0;
    run(400, 100, get_info, sizeof get_info);
    assert_answer(empty_info, sizeof empty_info);
}

static void test_configuration_outlives_power_off(void)
{
    run(3500, 2500, save, sizeof save);
    assert_answer(saved, sizeof saved);
    fake_power_on(true);
    /* 2401h: the stored configuration is the active one. */
    static const uint8_t get_arbitrator[] = {0xFE, 0x19, 0x01, 0x24, 0x03, 0x49, 0x00, 0x00};
    run(3500, 3000, get_arbitrator, sizeof get_arbitrator);
    const uint8_t *answer = &fake.uart_sent[fake.uart_sent_count - 21];
    TEST_ASSERT_EQUAL_HEX8(0x02, answer[2]);
    TEST_ASSERT_EQUAL_UINT8(2, answer[8 + 7]); /* running */
    TEST_ASSERT_EQUAL_UINT8(1, answer[8 + 8]); /* active */
    TEST_ASSERT_EQUAL_UINT8(1, answer[8 + 9]); /* stored */
    TEST_ASSERT_TRUE(inputs >= 20);
}

/* Off the bus at 1.5 s: the controller is held away until the application wants it back, and the limb goes
 * on. */
static void test_bus_off_is_got_over(void)
{
    bus_off_ms = 1500;
    run(4000, 3500, get_info, sizeof get_info);
    assert_answer(info, sizeof info);
    TEST_ASSERT_TRUE(held_ms > bus_off_ms && held_ms < bus_off_ms + 1000u);
    TEST_ASSERT_UINT8_WITHIN(1, 4000 / 20 % 256, last_input);
}

/* D-API-18: what the drivers lost is told to the host, 2413h group 3. */
static void test_the_host_sees_what_was_lost(void)
{
    static const uint8_t get[] = {0xFE, 0x19, 0x13, 0x24, 0x01, 0x56, 0x03, 0x00, 0x03, 0x93, 0xD1};
    static const uint8_t lost[] = {0xFE, 0x19, 0x14, 0x24, 0x01, 0x83, 0x0F, 0x00, 0x03, 0,    0,   0,
                                   0,    0,    0,    0,    0,    1,    0,    0,    0,    0x1D, 0x91};
    line_error = true;
    run(400, 100, get, sizeof get);
    assert_answer(lost, sizeof lost);
}

/* The crystal is missing: the part restarts instead of running with a clock that CAN cannot use. */
static void test_without_a_crystal_it_restarts(void)
{
    fake.crystal = false;
    fake.on_reset = &stopped;
    run(1000, 0, get_info, sizeof get_info);
    TEST_ASSERT_EQUAL_UINT(0, fake.idles);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_limb_links_itself_and_the_host_sees_it);
    RUN_TEST(test_no_devices);
    RUN_TEST(test_configuration_outlives_power_off);
    RUN_TEST(test_bus_off_is_got_over);
    RUN_TEST(test_the_host_sees_what_was_lost);
    RUN_TEST(test_without_a_crystal_it_restarts);
    return UNITY_END();
}
