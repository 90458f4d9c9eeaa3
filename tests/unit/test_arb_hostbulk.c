/* Long values for the host, which pass by bulk transfer, and devices that are slow or vanish meanwhile
 * (D-API-3, D-API-16, D-BUS-13). */
#include <string.h>

#include "hostlink.h"
#include "unity.h"

static exchange_t x;
static arb_app_t app;

void setUp(void)
{
    hostlink_start(&x, &app, false);
}

void tearDown(void) {}

static void to_text(char *text, const uint8_t *bytes, uint16_t len)
{
    static const char digits[] = "0123456789ABCDEF";
    for (uint16_t i = 0; i < len; i++) {
        *text++ = digits[bytes[i] >> 4];
        *text++ = digits[bytes[i] & 15];
    }
    *text = '\0';
}

/* A packet of the 512 bytes, which count upwards. */
static void packet(char *text, const char *id, uint16_t at)
{
    uint8_t data[8] = {0x0E, (uint8_t)(at / 6)};
    const uint8_t len = 512 - at < 6 ? (uint8_t)(512 - at) : 6;
    for (uint8_t i = 0; i < len; i++) {
        data[2 + i] = (uint8_t)((at + i) * 7);
    }
    memcpy(text, id, 4);
    to_text(&text[4], data, (uint16_t)(2 + len));
}

/* D-BUS-13: 512 bytes pass both ways. */
static void test_a_value_of_512_bytes_is_read(void)
{
    char text[40];
    const uint8_t *payload;
    uint16_t len;
    exchange_add_output(&x, "FE");
    hostlink_request(0x2301, BYTES(DEV_OUT, 0, 7));
    exchange_tx(&x, "311#03 07 00");
    exchange_rx(&x, "211#83 02 07 00");
    exchange_tx(&x, "311#0C 07 00");
    exchange_rx(&x, "211#8C 01 07 00 0002");
    for (uint16_t at = 0; at < 512; at = (uint16_t)(at + 6)) {
        hostlink_silence();
        packet(text, "211#", at);
        exchange_rx(&x, text);
        exchange_tx(&x, "311#8E 01");
    }
    TEST_ASSERT_EQUAL_HEX16(0x2302, hostlink_take(&payload, &len));
    TEST_ASSERT_EQUAL(512, len);
    for (uint16_t i = 0; i < 512; i++) {
        TEST_ASSERT_EQUAL_HEX8((uint8_t)(i * 7), payload[i]);
    }
}

static void start_writing(void)
{
    uint8_t payload[8 + 512] = {DEV_OUT, 0, 7};
    for (uint16_t i = 0; i < 512; i++) {
        payload[8 + i] = (uint8_t)(i * 7);
    }
    exchange_add_output(&x, "FE");
    hostlink_request(0x2304, payload, sizeof payload);
    exchange_tx(&x, "311#0D 07 00 0002");
    exchange_rx(&x, "211#8D 01 07 00 0002");
}

static void test_a_value_of_512_bytes_is_written(void)
{
    char text[40];
    start_writing();
    for (uint16_t at = 0; at < 512; at = (uint16_t)(at + 6)) {
        hostlink_silence();
        packet(text, "311#", at);
        exchange_tx(&x, text);
        exchange_rx(&x, "211#8E 01");
    }
    hostlink_reply(0x2305, NULL, 0);
    exchange_silence(&x);
}

/* Until the host has an answer, every millisecond; returns how many. */
static int wait_for(uint16_t id, uint8_t error)
{
    const uint8_t *payload;
    uint16_t len;
    for (int ms = 0; ms <= 3000; ms++) {
        const uint16_t have = hostlink_take(&payload, &len);
        if (have != 0) {
            TEST_ASSERT_EQUAL_HEX16(id, have);
            TEST_ASSERT_EQUAL_HEX8(error, payload[0]);
            return ms;
        }
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
    }
    TEST_FAIL_MESSAGE("no answer within 3 s");
    return 0;
}

/* D-API-3: a device that vanishes in the middle: an answer within 3 s, and the next request works. */
static void test_a_device_vanishes_while_it_is_read(void)
{
    char text[40];
    exchange_add_output(&x, "FE");
    hostlink_request(0x2301, BYTES(DEV_OUT, 0, 7));
    exchange_tx(&x, "311#03 07 00");
    exchange_rx(&x, "211#83 02 07 00");
    exchange_tx(&x, "311#0C 07 00");
    exchange_rx(&x, "211#8C 01 07 00 0002");
    for (uint16_t at = 0; at < 60; at = (uint16_t)(at + 6)) {
        packet(text, "211#", at);
        exchange_rx(&x, text);
        exchange_tx(&x, "311#8E 01");
    }
    TEST_ASSERT_LESS_OR_EQUAL(3000, wait_for(0x2303, 0x05));
    hostlink_silence();
    hostlink_ask(&x, 0x2201, 9, NULL, 0);
    hostlink_answer(0x2202, 9, BYTES(1, 0, 1, 0));
}

static void test_a_device_vanishes_while_it_is_written(void)
{
    start_writing();
    (void)exchange_drain(&x);
    TEST_ASSERT_LESS_OR_EQUAL(3000, wait_for(0x2306, 0x05));
    hostlink_silence();
    hostlink_ask(&x, 0x2201, 9, NULL, 0);
    hostlink_answer(0x2202, 9, BYTES(1, 0, 1, 0));
}

/* One millisecond after the other until the host has an answer, limit_ms at most; whether it has. */
static bool answered_within(int limit_ms, int *ms, uint16_t id, uint8_t error)
{
    const uint8_t *payload;
    uint16_t len;
    for (int i = 0; i < limit_ms; i++) {
        exchange_wait(&x, 1);
        ++*ms;
        const uint16_t have = hostlink_take(&payload, &len);
        if (have != 0) {
            TEST_ASSERT_EQUAL_HEX16(id, have);
            TEST_ASSERT_EQUAL_HEX8(error, payload[0]);
            return true;
        }
    }
    return false;
}

static void expect_next_request_works(void)
{
    (void)exchange_drain(&x);
    hostlink_silence();
    hostlink_request(0x2301, BYTES(DEV_OUT, 0, 7));
    exchange_tx(&x, "311#03 07 00");
    exchange_rx(&x, "211#83 01 07 00 2A");
    hostlink_reply(0x2302, BYTES(0x2A));
    exchange_silence(&x);
}

/* D-API-16: a transfer whose every packet comes in time, 90 ms after the one before, would take 7.7 s. */
static void test_a_slow_device_is_read(void)
{
    char text[40];
    int ms = 0;
    exchange_add_output(&x, "FE");
    hostlink_request(0x2301, BYTES(DEV_OUT, 0, 7));
    exchange_rx(&x, "211#83 02 07 00");
    exchange_rx(&x, "211#8C 01 07 00 0002");
    uint16_t at = 0;
    do {
        (void)exchange_drain(&x);
        packet(text, "211#", at);
        exchange_rx(&x, text);
        exchange_tx(&x, "311#8E 01");
        at = (uint16_t)(at + 6);
    } while (!answered_within(90, &ms, 0x2303, 0x05));
    TEST_ASSERT_EQUAL(3000, ms);
    packet(text, "211#", at);
    exchange_rx(&x, text); /* nobody listens any more */
    expect_next_request_works();
}

static void test_a_slow_device_is_written(void)
{
    int ms = 0;
    start_writing();
    while (!answered_within(90, &ms, 0x2306, 0x05)) {
        exchange_rx(&x, "211#8E 01");
    }
    TEST_ASSERT_EQUAL(3000, ms);
    exchange_rx(&x, "211#8E 01");
    expect_next_request_works();
}

/* The same with a link: every write is answered at the last moment. It is undone, and can be made after. */
static void expect_that_it_is_undone(uint32_t quiet_ms)
{
    int ms = 0;
    int k = 0;
    exchange_add_both(&x);
    exchange_pass(&x, quiet_ms);
    exchange_beacons(&x);
    x.arb->bus.tables.devices[1].ack_ms = 500;
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    while (!answered_within(1400, &ms, 0x2309, 0x05)) {
        exchange_beacons(&x);
        exchange_rx(&x, exchange_making[k++].rx);
    }
    TEST_ASSERT_EQUAL(3000, ms);
    TEST_ASSERT_EQUAL(2, k);
    for (ms = 0; ms < 3000; ms += 500) {
        exchange_beacons(&x);
        exchange_wait(&x, 500);
    }
    (void)exchange_drain(&x);
    TEST_ASSERT_EQUAL(0, hostlink_waiting());
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    exchange_run(&x, exchange_making);
    hostlink_reply(0x2308, BYTES(2));
    TEST_ASSERT_EQUAL(0, hostlink_waiting());
}

static void test_a_slow_device_is_linked(void)
{
    expect_that_it_is_undone(600); /* after the start-up */
}

/* The start-up does not take a link that is half made for one of the limb's. */
static void test_a_slow_device_is_linked_before_the_start_up(void)
{
    expect_that_it_is_undone(0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_value_of_512_bytes_is_read);
    RUN_TEST(test_a_value_of_512_bytes_is_written);
    RUN_TEST(test_a_device_vanishes_while_it_is_read);
    RUN_TEST(test_a_device_vanishes_while_it_is_written);
    RUN_TEST(test_a_slow_device_is_read);
    RUN_TEST(test_a_slow_device_is_written);
    RUN_TEST(test_a_slow_device_is_linked);
    RUN_TEST(test_a_slow_device_is_linked_before_the_start_up);
    return UNITY_END();
}
