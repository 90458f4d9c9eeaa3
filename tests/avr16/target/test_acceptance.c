/* Acceptance system 2 (profile-layer.md 6) from end to end as one 16-bit program in 16 KB RAM: the whole
 * application with 32 devices and 128 channels, and the three parts with the real device role on a bus that
 * delivers at once. Nothing is stored: the limb links itself, values go from the sensor through the
 * controller to the hand, and after the sensor was pulled and put back they do so again. */
#include <stdio.h>
#include <string.h>

#include "arb_app.h"
#include "fake_port.h"
#include "pdcp_device.h"
#include "unity.h"

/* Does not compile with other capacities. */
typedef char capacities_are_those_of_the_dspic[PDCP_DEVICES_MAX == 32 && PDCP_CHANNELS_MAX == 128 ? 1 : -1];

enum { D1, D2, D3, PARTS, WRIST = 1, GRIP = 2, SENSOR_MS = 20 };

static arb_app_t app;
static pdcp_device_t parts[PARTS];
static bool plugged[PARTS];
static uint32_t now_ms;
static uint8_t sensor;      /* what D1 sends next */
static uint8_t received[3]; /* what D3 has received last, and */
static uint16_t counts[3];  /* how often, by channel index */
static bool safe[3];

/* --- The parts: types and needs as in [PROFILE] appendix D --- */

static const uint8_t needs_1[] = {0x40}; /* channel 1: the most significant bit is channel 0 (D-BUS-8) */
static const uint8_t needs_2[] = {0x20};

static const pdcp_device_channel_desc_t sensor_channels[] = {
    {.direction = PDCP_OUTPUT, .type = 0x5000, .profile = 0x2120}};

static const pdcp_device_channel_desc_t controller_channels[] = {
    {.direction = PDCP_INPUT, .type = 0x7200, .profile = 0x2200},
    {.direction = PDCP_INPUT, .type = 0x5200, .profile = 0x2110},
    {.direction = PDCP_OUTPUT, .type = 0x5000, .profile = 0x1100, .required = {needs_2, 1}},
    {.direction = PDCP_OUTPUT, .type = 0x5000, .profile = 0x1210, .required = {needs_1, 1}},
    {.direction = PDCP_OUTPUT, .type = 0x7000, .profile = 0x1220, .required = {needs_2, 1}}};

static const pdcp_device_channel_desc_t hand_channels[] = {{.direction = PDCP_INPUT,
                                                            .type = 0x5300,
                                                            .profile = 0x1110,
                                                            .terminal_profile = 0x1110,
                                                            .terminal = true},
                                                           {.direction = PDCP_INPUT,
                                                            .type = 0x7300,
                                                            .profile = 0x1220,
                                                            .terminal_profile = 0x1220,
                                                            .terminal = true}};

static const pdcp_device_desc_t descs[PARTS] = {
    {.identity = {2, 2, 4}, .channels = sensor_channels, .channel_count = 1},
    {.identity = {2, 2, 5}, .channels = controller_channels, .channel_count = 5},
    {.identity = {2, 2, 6}, .channels = hand_channels, .channel_count = 2}};

/* The controller passes on what it receives: as it is, and whether it is in the upper half. */
static void controller_input(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len)
{
    (void)ctx;
    TEST_ASSERT_EQUAL(2, channel);
    const uint8_t closed = data[0] >= 128 ? 1 : 0;
    (void)pdcp_device_send(&parts[D2], now_ms, 3, data, len);
    (void)pdcp_device_send(&parts[D2], now_ms, 5, &closed, 1);
}

static void hand_input(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len)
{
    (void)ctx;
    TEST_ASSERT_EQUAL(1, len);
    received[channel] = data[0];
    counts[channel]++;
    safe[channel] = false;
}

static void hand_safe(void *ctx, uint8_t channel)
{
    (void)ctx;
    safe[channel] = true;
}

static const pdcp_device_port_t ports[PARTS] = {
    {.ctx = NULL}, {.input = controller_input}, {.input = hand_input, .safe = hand_safe}};

/* --- The application --- */

/* Everybody but the sender hears a frame at once. */
static void deliver(const can_frame_t *frame, int sender)
{
    for (int i = 0; i < PARTS; i++) {
        if (plugged[i] && i != sender) {
            pdcp_device_on_frame(&parts[i], now_ms, frame);
        }
    }
}

static bool take_frame(const can_frame_t *frame)
{
    deliver(frame, PARTS);
    return true;
}

static fake_port_t fake;

/* --- Time --- */

static bool step_parts(void)
{
    bool any = false;
    for (int i = 0; i < PARTS; i++) {
        can_frame_t frame;
        if (!plugged[i]) {
            continue;
        }
        (void)pdcp_device_step(&parts[i], now_ms);
        while (pdcp_device_tx_peek(&parts[i], &frame)) {
            pdcp_device_tx_pop(&parts[i]);
            deliver(&frame, i);
            arb_app_on_frame(&app, now_ms, &frame);
            (void)arb_app_step(&app, now_ms);
            any = true;
        }
    }
    return any;
}

static void run_ms(uint16_t ms)
{
    for (uint16_t i = 0; i < ms; i++) {
        now_ms++;
        (void)arb_app_step(&app, now_ms);
        if (now_ms % SENSOR_MS == 0 && plugged[D1]) {
            sensor = (uint8_t)(sensor + 7u);
            (void)pdcp_device_send(&parts[D1], now_ms, 1, &sensor, 1);
        }
        while (step_parts()) {
        }
    }
}

static void plug(int part)
{
    TEST_ASSERT_TRUE(
        pdcp_device_init(&parts[part], &descs[part], &ports[part], NULL, (uint32_t)part + 1u, now_ms));
    plugged[part] = true;
}

void setUp(void)
{
    static const arb_settings_t settings = {.seed = 253, .strict_crc = true};
    now_ms = 0xFFFFFF00u; /* wraps */
    memset(plugged, 0, sizeof plugged);
    fake_port_init(&fake, NULL, 0);
    fake.take_frame = take_frame;
    arb_app_init(&app, &fake.port, &settings, now_ms);
    plug(D1);
    plug(D2);
    plug(D3);
}

void tearDown(void) {}

/* --- What is expected --- */

/* The input of a part has this output as its source, and both are enabled. */
static void expect_link(int from, uint8_t output, int to, uint8_t input)
{
    const pdcp_device_source_t *source = pdcp_device_source(&parts[to], input);
    TEST_ASSERT_EQUAL(descs[from].identity.sn, source->identity.sn);
    TEST_ASSERT_EQUAL(output, source->channel);
    TEST_ASSERT_TRUE(pdcp_device_channel(&parts[from], output)->enabled);
    TEST_ASSERT_TRUE(pdcp_device_channel(&parts[to], input)->enabled);
}

static void expect_limb(void)
{
    TEST_ASSERT_EQUAL(3, pdcp_tables_count_links(&app.arb.bus.tables));
    expect_link(D1, 1, D2, 2);
    expect_link(D2, 3, D3, WRIST);
    expect_link(D2, 5, D3, GRIP);
    TEST_ASSERT_FALSE(pdcp_device_channel(&parts[D2], 1)->enabled);
    TEST_ASSERT_FALSE(pdcp_device_channel(&parts[D2], 4)->enabled);
    memset(counts, 0, sizeof counts);
    run_ms(400);
    TEST_ASSERT_GREATER_OR_EQUAL(19, counts[WRIST]);
    TEST_ASSERT_GREATER_OR_EQUAL(19, counts[GRIP]);
    TEST_ASSERT_EQUAL(sensor, received[WRIST]);
    TEST_ASSERT_EQUAL(sensor >= 128 ? 1 : 0, received[GRIP]);
}

/* Power on, nothing stored. */
static void test_the_limb_links_itself(void)
{
    char text[60];
    (void)snprintf(text, sizeof text, "arb_app_t: %u bytes of %u\n", (unsigned)sizeof app,
                   (unsigned)ARB_RAM_BUDGET);
    for (const char *at = text; *at != '\0'; at++) {
        support_put(*at);
    }
    TEST_ASSERT_LESS_OR_EQUAL(ARB_RAM_BUDGET, sizeof app);
    run_ms(450);
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_links(&app.arb.bus.tables));
    run_ms(100);
    expect_limb();
}

/* Hot swap: what requires the sensor rests while it is away. */
static void test_the_sensor_is_pulled_and_put_back(void)
{
    run_ms(600);
    plugged[D1] = false;
    run_ms(1600);
    TEST_ASSERT_TRUE(safe[WRIST] && safe[GRIP]);
    TEST_ASSERT_FALSE(pdcp_device_channel(&parts[D2], 3)->enabled);
    TEST_ASSERT_FALSE(pdcp_device_channel(&parts[D2], 5)->enabled);
    plug(D1);
    run_ms(20);
    expect_limb();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_limb_links_itself);
    RUN_TEST(test_the_sensor_is_pulled_and_put_back);
    return UNITY_END();
}
