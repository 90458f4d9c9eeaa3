/* The application and its host: order of answers, sizes, checksums (host-api.md 1 and 2, D-API-1 to -9), with
 * hand-written bytes. */
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

static void ask(uint16_t id, uint8_t reference, const uint8_t *payload, uint16_t len)
{
    hostlink_ask(&x, id, reference, payload, len);
}

static void expect_error(uint16_t id, uint8_t reference, uint8_t error)
{
    hostlink_answer(id, reference, &error, 1);
}

static void test_unknown_ids_get_2200h_with_their_reference(void)
{
    ask(0x2200, 1, NULL, 0);
    hostlink_answer(0x2200, 1, NULL, 0);
    ask(0x2202, 2, NULL, 0);
    hostlink_answer(0x2200, 2, NULL, 0);
    ask(0x9999, 3, BYTES(1, 2, 3));
    hostlink_answer(0x2200, 3, NULL, 0);
    hostlink_silence();
}

static void test_an_empty_bus(void)
{
    ask(0x2201, 9, NULL, 0);
    hostlink_answer(0x2202, 9, BYTES(0, 0, 0, 0));
    ask(0x2204, 9, BYTES(1));
    expect_error(0x2206, 9, 0x02);
    ask(0x2207, 9, BYTES(1));
    expect_error(0x2209, 9, 0x02);
    ask(0x220A, 9, BYTES(1));
    expect_error(0x220C, 9, 0x02);
    ask(0x220D, 9, BYTES(1));
    expect_error(0x220F, 9, 0x02);
}

static void test_devices_and_channels_are_listed(void)
{
    exchange_add_both(&x);
    ask(0x2201, 1, NULL, 0);
    hostlink_answer(0x2202, 1, BYTES(2, 1, 1, 0));
    ask(0x2204, 2, BYTES(2));
    hostlink_answer(0x2205, 2, BYTES(DEV_IN, 0, 0, 0, 0, 0));
    ask(0x2204, 2, BYTES(0));
    expect_error(0x2206, 2, 0x02);
    ask(0x2207, 3, BYTES(1));
    hostlink_answer(0x2208, 3, BYTES(DEV_IN, 1, 0x00, 0x53, 0x10, 0x11));
    ask(0x220A, 4, BYTES(1));
    hostlink_answer(0x220B, 4, BYTES(DEV_OUT, 1, 0x00, 0x50, 0x20, 0x21));
}

/* D-API-6: a device counts from its first beacon, its channels all at once when its setup ends. */
static void test_a_device_in_setup_has_no_channels_yet(void)
{
    exchange_rx(&x, "611#01 0200 0200 0400");
    (void)exchange_drain(&x);
    ask(0x2201, 1, NULL, 0);
    hostlink_answer(0x2202, 1, BYTES(0, 0, 0, 0));
    exchange_rx(&x, "011#0A");
    ask(0x2201, 1, NULL, 0);
    hostlink_answer(0x2202, 1, BYTES(1, 0, 0, 0));
}

/* D-API-3: a known id with a wrong size gets its failure answer with error 01h. */
static void test_wrong_sizes(void)
{
    static const uint16_t ids[] = {0x2204, 0x2207, 0x220A, 0x220D, 0x2301, 0x2304, 0x2307};
    ask(0x2201, 1, BYTES(0));
    expect_error(0x2203, 1, 0x01);
    for (unsigned i = 0; i < sizeof ids / sizeof ids[0]; i++) {
        ask(ids[i], 1, NULL, 0);
        expect_error((uint16_t)(ids[i] + 2), 1, 0x01);
        ask(ids[i], 1, BYTES(1, 2));
        expect_error((uint16_t)(ids[i] + 2), 1, 0x01);
    }
    ask(0x2304, 1, BYTES(DEV_OUT, 0, 7)); /* no data */
    expect_error(0x2306, 1, 0x01);
}

static void test_a_parameter_is_read(void)
{
    exchange_add_output(&x, "FE");
    ask(0x2301, 5, BYTES(DEV_OUT, 1, 1));
    hostlink_silence();
    exchange_tx(&x, "311#03 01 01");
    exchange_rx(&x, "211#83 01 01 01 0050 2021");
    hostlink_answer(0x2302, 5, BYTES(0x00, 0x50, 0x20, 0x21));
}

/* Longer values by bulk transfer, when the device asks for it. */
static void test_a_long_parameter_is_read_by_bulk(void)
{
    exchange_add_output(&x, "FE");
    ask(0x2301, 5, BYTES(DEV_OUT, 0, 7));
    exchange_tx(&x, "311#03 07 00");
    exchange_rx(&x, "211#83 02 07 00");
    exchange_tx(&x, "311#0C 07 00");
    exchange_rx(&x, "211#8C 01 07 00 0900");
    exchange_rx(&x, "211#0E 00 656C626F7731");
    exchange_tx(&x, "311#8E 01");
    exchange_rx(&x, "211#0E 01 202020");
    exchange_tx(&x, "311#8E 01");
    hostlink_answer(0x2302, 5, BYTES('e', 'l', 'b', 'o', 'w', '1', ' ', ' ', ' '));
}

/* D-BUS-13: a value of more than 512 bytes is error 0Ah on reading. */
static void test_a_value_that_is_too_long_to_read(void)
{
    exchange_add_output(&x, "FE");
    ask(0x2301, 5, BYTES(DEV_OUT, 0, 7));
    exchange_tx(&x, "311#03 07 00");
    exchange_rx(&x, "211#83 02 07 00");
    exchange_tx(&x, "311#0C 07 00");
    exchange_rx(&x, "211#8C 01 07 00 0102");
    expect_error(0x2303, 5, 0x0A);
}

static void test_a_parameter_is_written(void)
{
    exchange_add_output(&x, "FE");
    ask(0x2304, 6, BYTES(DEV_OUT, 0, 10, 0xE8, 0x03));
    exchange_tx(&x, "311#04 0A 00 E803");
    exchange_rx(&x, "211#84 01 0A 00 E803");
    hostlink_answer(0x2305, 6, NULL, 0);
}

static void test_a_long_parameter_is_written_by_bulk(void)
{
    exchange_add_output(&x, "FE");
    ask(0x2304, 6, BYTES(DEV_OUT, 0, 7, 'h', 'a', 'n', 'd', ' ', '2', '!'));
    exchange_tx(&x, "311#0D 07 00 0700");
    exchange_rx(&x, "211#8D 01 07 00 0700");
    exchange_tx(&x, "311#0E 00 68616E642032");
    exchange_rx(&x, "211#8E 01");
    exchange_tx(&x, "311#0E 01 21");
    exchange_rx(&x, "211#8E 01");
    hostlink_answer(0x2305, 6, NULL, 0);
}

/* A packet that is refused starts the transfer from its configure frame again, at most three times. */
static void test_a_refused_packet_restarts_the_transfer(void)
{
    exchange_add_output(&x, "FE");
    ask(0x2304, 6, BYTES(DEV_OUT, 0, 7, 'h', 'a', 'n', 'd', '!'));
    for (int i = 0; i < 4; i++) {
        exchange_tx(&x, "311#0D 07 00 0500");
        exchange_rx(&x, "211#8D 01 07 00 0500");
        exchange_tx(&x, "311#0E 00 68616E6421");
        hostlink_silence();
        exchange_rx(&x, "211#8E 00");
    }
    expect_error(0x2306, 6, 0x0A);
}

static void test_errors_of_parameters(void)
{
    exchange_add_output(&x, "FE");
    ask(0x2301, 1, BYTES(9, 0, 9, 0, 9, 0, 0, 1)); /* unknown device */
    expect_error(0x2303, 1, 0x03);
    ask(0x2301, 1, BYTES(DEV_OUT, 2, 1)); /* unknown channel */
    expect_error(0x2303, 1, 0x04);
    ask(0x2301, 1, BYTES(DEV_OUT, 0, 99));
    exchange_tx(&x, "311#03 63 00");
    exchange_rx(&x, "211#83 00 63 00");
    expect_error(0x2303, 1, 0x06);
    ask(0x2304, 2, BYTES(DEV_OUT, 0, 99, 1));
    for (int i = 0; i < 3; i++) {
        exchange_tx(&x, "311#04 63 00 01");
        hostlink_silence();
        exchange_pass(&x, 100);
    }
    expect_error(0x2306, 2, 0x05);
}

/* D-API-3: also when the device dies while it is being served. */
static void test_a_device_that_dies_meanwhile(void)
{
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 1450);
    ask(0x2301, 1, BYTES(DEV_OUT, 0, 8));
    exchange_tx(&x, "311#03 08 00");
    exchange_pass(&x, 50);
    expect_error(0x2303, 1, 0x05);
    ask(0x2301, 1, BYTES(DEV_OUT, 0, 8));
    expect_error(0x2303, 1, 0x03);
}

static void test_a_link_is_configured_and_listed(void)
{
    exchange_add_both(&x);
    ask(0x2307, 7, BYTES(DEV_OUT, 1, DEV_IN, 1));
    hostlink_silence();
    exchange_run(&x, exchange_making);
    hostlink_answer(0x2308, 7, BYTES(2));
    ask(0x2201, 8, NULL, 0);
    hostlink_answer(0x2202, 8, BYTES(2, 1, 1, 1));
    ask(0x220D, 9, BYTES(1));
    hostlink_answer(0x220E, 9, BYTES(DEV_OUT, 1, DEV_IN, 1, 2));
    ask(0x220D, 9, BYTES(2));
    expect_error(0x220F, 9, 0x02);
    ask(0x2307, 7, BYTES(DEV_OUT, 1, DEV_IN, 1)); /* again: without traffic */
    hostlink_answer(0x2308, 7, BYTES(2));
    exchange_silence(&x);
}

static void test_links_that_cannot_be(void)
{
    exchange_add_both(&x);
    ask(0x2307, 1, BYTES(9, 0, 9, 0, 9, 0, 1, DEV_IN, 1));
    expect_error(0x2309, 1, 0x03);
    ask(0x2307, 1, BYTES(DEV_OUT, 1, 9, 0, 9, 0, 9, 0, 1));
    expect_error(0x2309, 1, 0x03);
    ask(0x2307, 1, BYTES(DEV_OUT, 2, DEV_IN, 1)); /* no such channel */
    expect_error(0x2309, 1, 0x04);
    ask(0x2307, 1, BYTES(DEV_IN, 1, DEV_OUT, 1)); /* wrong direction */
    expect_error(0x2309, 1, 0x04);
    ask(0x2307, 1, BYTES(DEV_OUT, 1, DEV_IN, 1)); /* refused by the device */
    exchange_tx(&x, "312#04 05 01 0200 0200");
    exchange_rx(&x, "212#84 00 05 01");
    exchange_tx(&x, "312#04 05 01 FFFF FFFF");
    exchange_rx(&x, "212#84 01 05 01");
    expect_error(0x2309, 1, 0x06);
    exchange_silence(&x);
}

/* D-API-6: 2307h waits for a running setup, and answers 0Bh after 2 s. */
static void test_a_link_waits_for_a_running_setup(void)
{
    exchange_add_both(&x);
    exchange_rx(&x, "613#01 0900 0900 0900"); /* its setup is never answered */
    (void)exchange_drain(&x);
    ask(0x2307, 1, BYTES(DEV_OUT, 1, DEV_IN, 1));
    for (int i = 0; i < 1999; i++) {
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
        if (i % 400 == 0) {
            exchange_beacons(&x);
            exchange_rx(&x, "013#0A");
        }
        /* every attempt ends after 300 ms, and the third is the last: keep it in its setup */
        x.arb->bus.tables.devices[2].setup_attempts = 0;
        hostlink_silence();
    }
    exchange_wait(&x, 1);
    expect_error(0x2309, 1, 0x0B);
}

/* D-API-3: exactly four are held, a fifth gets error 07h at once, the only answer out of order. */
static void test_four_are_held_and_a_fifth_is_refused(void)
{
    exchange_add_output(&x, "FE");
    ask(0x2301, 1, BYTES(DEV_OUT, 0, 8));
    ask(0x2201, 2, NULL, 0);
    ask(0x9999, 3, NULL, 0);
    ask(0x2301, 4, BYTES(DEV_OUT, 0, 3));
    hostlink_silence();
    ask(0x2201, 5, NULL, 0);
    expect_error(0x2203, 5, 0x07);
    ask(0x9999, 6, NULL, 0);
    hostlink_answer(0x2200, 6, NULL, 0);
    exchange_tx(&x, "311#03 08 00");
    exchange_rx(&x, "211#83 01 08 00 11");
    hostlink_answer(0x2302, 1, BYTES(0x11));
    hostlink_answer(0x2202, 2, BYTES(1, 0, 1, 0));
    hostlink_answer(0x2200, 3, NULL, 0);
    exchange_tx(&x, "311#03 03 00"); /* the next one starts by itself */
    exchange_rx(&x, "211#83 01 03 00 01020304");
    hostlink_answer(0x2302, 4, BYTES(1, 2, 3, 4));
    hostlink_silence();
}

/* D-API-9: the longest request and three short ones are held together; what does not fit beside them is
 * answered like a fifth one. */
static void test_the_longest_request_and_three_short_ones_are_held(void)
{
    static const uint8_t longest[ARB_HOST_REQUEST_MAX] = {DEV_OUT, 0, 7, 'x'};
    exchange_add_output(&x, "FE");
    ask(0x2301, 1, BYTES(DEV_OUT, 0, 8));
    ask(0x2304, 2, longest, sizeof longest);
    ask(0x2304, 3, longest, sizeof longest);
    expect_error(0x2306, 3, 0x07);
    ask(0x2301, 4, BYTES(DEV_OUT, 0, 8));
    ask(0x2201, 5, NULL, 0);
    hostlink_silence();
    exchange_tx(&x, "311#03 08 00");
    exchange_rx(&x, "211#83 01 08 00 11");
    hostlink_answer(0x2302, 1, BYTES(0x11));
    exchange_tx(&x, "311#0D 07 00 0002");
    exchange_rx(&x, "211#8D 00 07 00 0002"); /* it has no room for 512 bytes */
    expect_error(0x2306, 2, 0x06);
    exchange_tx(&x, "311#03 08 00");
    exchange_rx(&x, "211#83 01 08 00 11");
    hostlink_answer(0x2302, 4, BYTES(0x11));
    hostlink_answer(0x2202, 5, BYTES(1, 0, 1, 0));
}

/* D-API-1: strict: error 0Ch, and the request is not carried out; an unknown id stays unknown. */
static void test_strict_checksums(void)
{
    uint8_t bytes[] = {0xFE, 0x19, 0x01, 0x22, 0x07, 0x00, 0x00, 0x00};
    (void)arb_app_on_bytes(&app, x.now_ms, bytes, sizeof bytes);
    exchange_step(&x);
    hostlink_answer(0x2202, 7, BYTES(0, 0, 0, 0)); /* lenient */
    hostlink_start(&x, &app, true);
    (void)arb_app_on_bytes(&app, x.now_ms, bytes, sizeof bytes);
    exchange_step(&x);
    expect_error(0x2203, 7, 0x0C);
    bytes[2] = 0x99;
    (void)arb_app_on_bytes(&app, x.now_ms, bytes, sizeof bytes);
    exchange_step(&x);
    hostlink_answer(0x2200, 7, NULL, 0);
    ask(0x2201, 8, NULL, 0);
    hostlink_answer(0x2202, 8, BYTES(0, 0, 0, 0));
}

/* A host that does not read loses nothing: answers wait, and bytes that cannot be held are not taken. */
static void test_a_host_that_does_not_read(void)
{
    uint8_t request[8] = {0xFE, 0x19, 0x01, 0x22, 0x00, 0x00, 0x00, 0x00};
    uint8_t stream[8 * 100];
    for (unsigned i = 0; i < 100; i++) {
        request[4] = (uint8_t)i;
        memcpy(&stream[8 * i], request, 8);
    }
    size_t room = 3;
    uint16_t taken = 0;
    unsigned answered = 0;
    for (int turn = 0; turn < 2000 && answered < 100; turn++) {
        taken = (uint16_t)(taken + arb_app_on_bytes(&app, x.now_ms, &stream[taken],
                                                    (uint16_t)(sizeof stream - taken)));
        hostlink_room(room);
        exchange_step(&x);
        room = hostlink_room_left() + 3;
        const uint8_t *payload;
        uint16_t len;
        while (hostlink_take(&payload, &len) != 0) {
            answered++;
        }
    }
    TEST_ASSERT_EQUAL(sizeof stream, taken);
    TEST_ASSERT_EQUAL(100, answered);
    hostlink_silence();
}

/* The host does not read for long while it sends: what could not be taken then is taken later, nothing in
 * between is given up. */
static void test_a_stall_of_the_host_loses_no_request(void)
{
    uint8_t request[8] = {0xFE, 0x19, 0x01, 0x22, 0x00, 0x00, 0x00, 0x00};
    uint8_t stream[8 * 12];
    for (unsigned i = 0; i < 12; i++) {
        request[4] = (uint8_t)i;
        request[5] = arb_hostcodec_crc8(request);
        memcpy(&stream[8 * i], request, 8);
    }
    hostlink_room(0);
    uint16_t taken = 0;
    for (int ms = 0; ms < 500; ms++) {
        const uint16_t some = (uint16_t)(sizeof stream - taken < 5 ? sizeof stream - taken : 5);
        taken = (uint16_t)(taken + arb_app_on_bytes(&app, x.now_ms, &stream[taken], some));
        exchange_wait(&x, 1);
    }
    TEST_ASSERT_LESS_THAN(sizeof stream, taken);
    hostlink_room(1000);
    for (int ms = 0; ms < 100; ms++) {
        exchange_wait(&x, 1);
        const uint16_t some = (uint16_t)(sizeof stream - taken < 5 ? sizeof stream - taken : 5);
        taken = (uint16_t)(taken + arb_app_on_bytes(&app, x.now_ms, &stream[taken], some));
        exchange_step(&x);
    }
    TEST_ASSERT_EQUAL(sizeof stream, taken);
    unsigned answers = 0;
    const uint8_t *payload;
    uint16_t len;
    while (hostlink_take(&payload, &len) != 0) {
        answers++;
    }
    TEST_ASSERT_EQUAL(12, answers);
    TEST_ASSERT_EQUAL(0, app.api.rx.counters[ARB_HOSTRX_GIVEN_UP]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_unknown_ids_get_2200h_with_their_reference);
    RUN_TEST(test_an_empty_bus);
    RUN_TEST(test_devices_and_channels_are_listed);
    RUN_TEST(test_a_device_in_setup_has_no_channels_yet);
    RUN_TEST(test_wrong_sizes);
    RUN_TEST(test_a_parameter_is_read);
    RUN_TEST(test_a_long_parameter_is_read_by_bulk);
    RUN_TEST(test_a_value_that_is_too_long_to_read);
    RUN_TEST(test_a_parameter_is_written);
    RUN_TEST(test_a_long_parameter_is_written_by_bulk);
    RUN_TEST(test_a_refused_packet_restarts_the_transfer);
    RUN_TEST(test_errors_of_parameters);
    RUN_TEST(test_a_device_that_dies_meanwhile);
    RUN_TEST(test_a_link_is_configured_and_listed);
    RUN_TEST(test_links_that_cannot_be);
    RUN_TEST(test_a_link_waits_for_a_running_setup);
    RUN_TEST(test_four_are_held_and_a_fifth_is_refused);
    RUN_TEST(test_the_longest_request_and_three_short_ones_are_held);
    RUN_TEST(test_strict_checksums);
    RUN_TEST(test_a_host_that_does_not_read);
    RUN_TEST(test_a_stall_of_the_host_loses_no_request);
    return UNITY_END();
}
