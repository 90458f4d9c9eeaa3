/* Bytes to and from USB adapters, written by hand from the wire tables of gs_usb (gs_usb_codec.h repeats
 * them) and of the kernel's error frames. */
#include <string.h>

#include "gs_usb_codec.h"
#include "unity.h"

void setUp(void) {}

void tearDown(void) {}

/* --- requests --- */

static void test_host_format(void)
{
    const uint8_t expected[] = {0xEF, 0xBE, 0x00, 0x00};
    uint8_t bytes[GS_USB_CODEC_HOST_FORMAT_SIZE];
    gs_usb_codec_encode_host_format(bytes);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, bytes, sizeof bytes);
}

static void test_timing(void)
{
    const gs_usb_codec_timing_t timing = {
        .prop = 1, .phase1 = 12, .phase2 = 0x0302, .sjw = 0x04030201, .brp = 3};
    const uint8_t expected[] = {1, 0, 0, 0, 12, 0, 0, 0, 2, 3, 0, 0, 1, 2, 3, 4, 3, 0, 0, 0};
    uint8_t bytes[GS_USB_CODEC_BITTIMING_SIZE];
    gs_usb_codec_encode_timing(&timing, bytes);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, bytes, sizeof bytes);
}

static void test_mode(void)
{
    const uint8_t start[] = {1, 0, 0, 0, 0x00, 0x00, 0x04, 0x00}; /* feature bit 18 */
    const uint8_t reset[] = {0, 0, 0, 0, 0, 0, 0, 0};
    uint8_t bytes[GS_USB_CODEC_MODE_SIZE];
    gs_usb_codec_encode_mode(true, GS_USB_CODEC_FEATURE_BUS_OFF_RECOVERY, bytes);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(start, bytes, sizeof bytes);
    gs_usb_codec_encode_mode(false, 0, bytes);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(reset, bytes, sizeof bytes);
}

static void test_constants(void)
{
    const uint8_t bytes[] = {
        0xB0, 0x20, 0x04, 0x00, /* features: time stamps, identify, pad, state, recovery */
        0x00, 0x6C, 0xDC, 0x02, /* 48 MHz */
        1,    0,    0,    0,    16, 0, 0, 0, 2,    0,    0, 0, 8, 0, 0, 0,
        4,    0,    0,    0,    3,  0, 0, 0, 0x00, 0x04, 0, 0, 5, 0, 0, 0};
    gs_usb_codec_constants_t constants;
    TEST_ASSERT_FALSE(gs_usb_codec_decode_constants(bytes, sizeof bytes - 1, &constants));
    TEST_ASSERT_TRUE(gs_usb_codec_decode_constants(bytes, sizeof bytes, &constants));
    TEST_ASSERT_EQUAL_HEX32(0x420B0, constants.features);
    TEST_ASSERT_EQUAL_UINT32(48000000, constants.clock_hz);
    TEST_ASSERT_EQUAL_UINT32(1, constants.tseg1_min);
    TEST_ASSERT_EQUAL_UINT32(16, constants.tseg1_max);
    TEST_ASSERT_EQUAL_UINT32(2, constants.tseg2_min);
    TEST_ASSERT_EQUAL_UINT32(8, constants.tseg2_max);
    TEST_ASSERT_EQUAL_UINT32(4, constants.sjw_max);
    TEST_ASSERT_EQUAL_UINT32(3, constants.brp_min);
    TEST_ASSERT_EQUAL_UINT32(1024, constants.brp_max);
    TEST_ASSERT_EQUAL_UINT32(5, constants.brp_step);
}

static void test_channels(void)
{
    const uint8_t bytes[] = {9, 9, 9, 1, 2, 0, 0, 0, 1, 0, 0, 0};
    TEST_ASSERT_EQUAL_UINT(2, gs_usb_codec_decode_channels(bytes, sizeof bytes));
    TEST_ASSERT_EQUAL_UINT(0, gs_usb_codec_decode_channels(bytes, sizeof bytes - 1));
}

static void check_state(uint8_t state, hal_can_state_t expected)
{
    const uint8_t bytes[] = {state, 0, 0, 0, 7, 0, 0, 0, 0x00, 0x01, 0, 0};
    hal_can_health_t health = {.state = HAL_CAN_DOWN, .rx_overruns = 3, .tx_failed = 4};
    TEST_ASSERT_TRUE(gs_usb_codec_decode_state(bytes, sizeof bytes, &health));
    TEST_ASSERT_EQUAL(expected, health.state);
    TEST_ASSERT_EQUAL_UINT8(7, health.rx_errors);
    TEST_ASSERT_EQUAL_UINT8(255, health.tx_errors); /* 256 does not fit */
    TEST_ASSERT_EQUAL_UINT32(3, health.rx_overruns);
    TEST_ASSERT_EQUAL_UINT32(4, health.tx_failed);
}

static void test_states(void)
{
    check_state(0, HAL_CAN_ACTIVE);
    check_state(1, HAL_CAN_ACTIVE); /* a warning is no state of ISO 11898-1 */
    check_state(2, HAL_CAN_PASSIVE);
    check_state(3, HAL_CAN_BUS_OFF);
    check_state(4, HAL_CAN_DOWN);
    check_state(5, HAL_CAN_DOWN);
    const uint8_t bytes[11] = {3};
    hal_can_health_t health = {.state = HAL_CAN_ACTIVE};
    TEST_ASSERT_FALSE(gs_usb_codec_decode_state(bytes, sizeof bytes, &health));
    TEST_ASSERT_EQUAL(HAL_CAN_ACTIVE, health.state);
}

/* --- frames --- */

static void test_frame_to_the_adapter(void)
{
    const can_frame_t frame = {.id = 0x123, .dlc = 3, .data = {0x11, 0x22, 0x33, 0x44}};
    const uint8_t expected[] = {0x04, 0x03, 0x02, 0x01, 0x23, 0x01, 0, 0, 3, 1,
                                0,    0,    0x11, 0x22, 0x33, 0,    0, 0, 0, 0};
    uint8_t bytes[GS_USB_CODEC_FRAME_SIZE];
    memset(bytes, 0xFF, sizeof bytes);
    gs_usb_codec_encode_frame(&frame, 0x01020304, 1, bytes);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, bytes, sizeof bytes);
}

static void test_longest_frame_to_the_adapter(void)
{
    const can_frame_t frame = {.id = 0x7FF, .dlc = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    const uint8_t expected[] = {0, 0, 0, 0, 0xFF, 0x07, 0, 0, 8, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8};
    uint8_t bytes[GS_USB_CODEC_FRAME_SIZE];
    gs_usb_codec_encode_frame(&frame, 0, 0, bytes);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, bytes, sizeof bytes);
}

/* A received frame 321h with two bytes; with a time stamp; filled up to 32 and 64 bytes. */
static void test_frame_from_the_adapter_in_all_sizes(void)
{
    uint8_t bytes[64] = {0xFF, 0xFF, 0xFF, 0xFF, 0x21, 0x03, 0, 0, 2,    0,    0,    0,
                         0xAA, 0xBB, 0,    0,    0,    0,    0, 0, 0x78, 0x56, 0x34, 0x12};
    const size_t sizes[] = {20, 24, 32, 64};
    gs_usb_codec_frame_t in;
    TEST_ASSERT_FALSE(gs_usb_codec_decode_frame(bytes, 19, &in));
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        can_frame_t frame;
        memset(&in, 0x55, sizeof in);
        TEST_ASSERT_TRUE(gs_usb_codec_decode_frame(bytes, sizes[i], &in));
        TEST_ASSERT_EQUAL_HEX32(GS_USB_CODEC_NO_ECHO, in.echo_tag);
        TEST_ASSERT_EQUAL_UINT8(0, in.channel);
        TEST_ASSERT_FALSE(in.overflow);
        gs_usb_codec_to_can_frame(&in, &frame);
        TEST_ASSERT_EQUAL(CAN_FRAME_BASE, frame.kind);
        TEST_ASSERT_EQUAL_HEX16(0x321, frame.id);
        TEST_ASSERT_EQUAL_UINT8(2, frame.dlc);
        const uint8_t data[8] = {0xAA, 0xBB};
        TEST_ASSERT_EQUAL_HEX8_ARRAY(data, frame.data, sizeof data);
    }
}

static void test_echo(void)
{
    const uint8_t bytes[20] = {0x04, 0x03, 0x02, 0x01, 0x23, 0x01, 0, 0, 0, 2};
    gs_usb_codec_frame_t in;
    TEST_ASSERT_TRUE(gs_usb_codec_decode_frame(bytes, sizeof bytes, &in));
    TEST_ASSERT_EQUAL_HEX32(0x01020304, in.echo_tag);
    TEST_ASSERT_EQUAL_UINT8(2, in.channel);
}

static can_frame_t kind_of(uint8_t highest, uint8_t flags, uint8_t dlc)
{
    const uint8_t bytes[20] = {0xFF,  0xFF, 0xFF, 0xFF, 0x21, 0x03, 0, highest, dlc, 0,
                               flags, 0,    1,    2,    3,    4,    5, 6,       7,   8};
    gs_usb_codec_frame_t in;
    can_frame_t frame;
    TEST_ASSERT_TRUE(gs_usb_codec_decode_frame(bytes, sizeof bytes, &in));
    gs_usb_codec_to_can_frame(&in, &frame);
    return frame;
}

static void test_kinds_of_frames(void)
{
    const uint8_t none[8] = {0};
    can_frame_t frame = kind_of(0x80, 0, 8);
    TEST_ASSERT_EQUAL(CAN_FRAME_EXTENDED, frame.kind);
    TEST_ASSERT_EQUAL_HEX16(0, frame.id);
    frame = kind_of(0x40, 0, 8);
    TEST_ASSERT_EQUAL(CAN_FRAME_REMOTE, frame.kind);
    TEST_ASSERT_EQUAL_UINT8(8, frame.dlc);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(none, frame.data, sizeof none);
    TEST_ASSERT_EQUAL(CAN_FRAME_REMOTE, kind_of(0xC0, 0, 0).kind);
    TEST_ASSERT_EQUAL(CAN_FRAME_ERROR, kind_of(0x20, 0, 8).kind);
    TEST_ASSERT_EQUAL(CAN_FRAME_FD, kind_of(0, 0x02, 15).kind);
    TEST_ASSERT_EQUAL_UINT8(8, kind_of(0, 0x02, 15).dlc);
    frame = kind_of(0, 0, 12); /* a DLC of 9 to 15 on the wire is 8 bytes */
    TEST_ASSERT_EQUAL(CAN_FRAME_BASE, frame.kind);
    TEST_ASSERT_EQUAL_UINT8(8, frame.dlc);
    TEST_ASSERT_EQUAL_UINT8(8, frame.data[7]);
}

/* --- health --- */

/* An error frame: classes in the identifier, what the controller says in byte 1, counters in bytes 6 and
 * 7. */
static void note(uint16_t classes, uint8_t controller, uint8_t tx, uint8_t rx, hal_can_health_t *health)
{
    const uint8_t bytes[20] = {0xFF,
                               0xFF,
                               0xFF,
                               0xFF,
                               (uint8_t)classes,
                               (uint8_t)(classes >> 8),
                               0,
                               0x20,
                               8,
                               0,
                               0,
                               0,
                               0,
                               controller,
                               0,
                               0,
                               0,
                               0,
                               tx,
                               rx};
    gs_usb_codec_frame_t in;
    TEST_ASSERT_TRUE(gs_usb_codec_decode_frame(bytes, sizeof bytes, &in));
    gs_usb_codec_note(&in, health);
}

static void test_error_counters_and_states(void)
{
    hal_can_health_t health = {.state = HAL_CAN_ACTIVE};
    note(0x204, 0x08, 97, 1, &health); /* transmit warning */
    TEST_ASSERT_EQUAL(HAL_CAN_ACTIVE, health.state);
    TEST_ASSERT_EQUAL_UINT8(97, health.tx_errors);
    TEST_ASSERT_EQUAL_UINT8(1, health.rx_errors);
    note(0x204, 0x20, 130, 1, &health); /* transmit passive */
    TEST_ASSERT_EQUAL(HAL_CAN_PASSIVE, health.state);
    note(0x204, 0x40, 5, 0, &health); /* active again */
    TEST_ASSERT_EQUAL(HAL_CAN_ACTIVE, health.state);
    note(0x204, 0x10, 5, 129, &health); /* receive passive */
    TEST_ASSERT_EQUAL(HAL_CAN_PASSIVE, health.state);
    TEST_ASSERT_EQUAL_UINT8(129, health.rx_errors);
    note(0x204, 0x04, 5, 100, &health); /* receive warning */
    TEST_ASSERT_EQUAL(HAL_CAN_ACTIVE, health.state);
    note(0x088, 0, 1, 1, &health); /* bus error without counters: they stay */
    TEST_ASSERT_EQUAL_UINT8(5, health.tx_errors);
    TEST_ASSERT_EQUAL_UINT8(100, health.rx_errors);
}

static void test_bus_off_and_restart(void)
{
    hal_can_health_t health = {.state = HAL_CAN_PASSIVE, .tx_errors = 200, .rx_errors = 9};
    note(0x040, 0, 0, 0, &health);
    TEST_ASSERT_EQUAL(HAL_CAN_BUS_OFF, health.state);
    TEST_ASSERT_EQUAL_UINT8(200, health.tx_errors);
    note(0x100, 0, 0, 0, &health);
    TEST_ASSERT_EQUAL(HAL_CAN_ACTIVE, health.state);
    TEST_ASSERT_EQUAL_UINT8(0, health.tx_errors);
    TEST_ASSERT_EQUAL_UINT8(0, health.rx_errors);
}

/* Firmware that does not tell: who receives is not bus-off any more. */
static void test_a_received_frame_ends_bus_off(void)
{
    const gs_usb_codec_frame_t frame = {.echo_tag = GS_USB_CODEC_NO_ECHO, .can_id = 0x123};
    hal_can_health_t health = {.state = HAL_CAN_BUS_OFF, .tx_errors = 255};
    gs_usb_codec_note(&frame, &health);
    TEST_ASSERT_EQUAL(HAL_CAN_ACTIVE, health.state);
    health.state = HAL_CAN_PASSIVE;
    gs_usb_codec_note(&frame, &health);
    TEST_ASSERT_EQUAL(HAL_CAN_PASSIVE, health.state);
}

static void test_losses_are_counted(void)
{
    hal_can_health_t health = {.state = HAL_CAN_ACTIVE};
    const gs_usb_codec_frame_t frame = {.can_id = 0x123, .overflow = true};
    gs_usb_codec_note(&frame, &health); /* the adapter's own queue */
    TEST_ASSERT_EQUAL_UINT32(1, health.rx_overruns);
    note(0x004, 0x01, 0, 0, &health); /* the controller's */
    TEST_ASSERT_EQUAL_UINT32(2, health.rx_overruns);
    note(0x004, 0x02, 0, 0, &health);
    TEST_ASSERT_EQUAL_UINT32(1, health.tx_failed);
    note(0x001, 0, 0, 0, &health); /* given up */
    TEST_ASSERT_EQUAL_UINT32(2, health.tx_failed);
    const uint8_t overflown[20] = {0xFF, 0xFF, 0xFF, 0xFF, 0x21, 0x03, 0, 0, 0, 0, 0x01};
    gs_usb_codec_frame_t in;
    TEST_ASSERT_TRUE(gs_usb_codec_decode_frame(overflown, sizeof overflown, &in));
    TEST_ASSERT_TRUE(in.overflow);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_host_format);
    RUN_TEST(test_timing);
    RUN_TEST(test_mode);
    RUN_TEST(test_constants);
    RUN_TEST(test_channels);
    RUN_TEST(test_states);
    RUN_TEST(test_frame_to_the_adapter);
    RUN_TEST(test_longest_frame_to_the_adapter);
    RUN_TEST(test_frame_from_the_adapter_in_all_sizes);
    RUN_TEST(test_echo);
    RUN_TEST(test_kinds_of_frames);
    RUN_TEST(test_error_counters_and_states);
    RUN_TEST(test_bus_off_and_restart);
    RUN_TEST(test_a_received_frame_ends_bus_off);
    RUN_TEST(test_losses_are_counted);
    return UNITY_END();
}
