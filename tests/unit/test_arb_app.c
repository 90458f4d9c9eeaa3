/* The application: host API (host-api.md 1 and 2, D-API-1 to -9) and what it stores (D-BUS-6), with
 * hand-written bytes. */
#include <string.h>

#include "arb_app.h"
#include "exchange.h"
#include "unity.h"

static exchange_t x;
static arb_app_t app;

static uint8_t host_out[1024]; /* what the host has read */
static size_t host_len;
static size_t host_room; /* bytes that it still takes */

static uint8_t memory[ARB_STORE_AREAS * ARB_STORE_AREA];
static int writes_left; /* before the power fails; -1: it does not */
static size_t bytes_left_of_last;

static bool can_send(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    (void)frame;
    return false; /* exchange.c takes them from the queue */
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    (void)ctx;
    const size_t taken = size < host_room ? size : host_room;
    memcpy(&host_out[host_len], bytes, taken);
    host_len += taken;
    host_room -= taken;
    return taken;
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    TEST_ASSERT_LESS_OR_EQUAL(sizeof memory, (size_t)address + size);
    memcpy(bytes, &memory[address], size);
    return true;
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(ARB_PORT_NVM_PAGE, address % ARB_PORT_NVM_PAGE + size,
                                      "crosses a page");
    TEST_ASSERT_LESS_OR_EQUAL(sizeof memory, (size_t)address + size);
    if (writes_left == 0) {
        memcpy(&memory[address], bytes, bytes_left_of_last < size ? bytes_left_of_last : size);
        bytes_left_of_last = 0;
        return true;
    }
    writes_left -= writes_left > 0 ? 1 : 0;
    memcpy(&memory[address], bytes, size);
    return true;
}

static int8_t nvm_status(void *ctx)
{
    (void)ctx;
    return 0;
}

static const arb_port_t port = {.can_send = can_send,
                                .host_write = host_write,
                                .nvm_read = nvm_read,
                                .nvm_write = nvm_write,
                                .nvm_status = nvm_status};

static void start(bool strict)
{
    const arb_settings_t settings = {.strict_crc = strict};
    exchange_start_app(&x, &app, &port, &settings, 0xFFFFFF00u);
    host_len = 0;
    host_room = sizeof host_out;
}

void setUp(void)
{
    memset(memory, 0xFF, sizeof memory);
    writes_left = -1;
    start(false);
}

void tearDown(void) {}

/* The host sends a request; its checksums are right. */
static void ask(uint16_t id, uint8_t reference, const uint8_t *payload, uint16_t len)
{
    uint8_t bytes[ARB_HOST_HEADER + ARB_HOST_REQUEST_MAX + ARB_HOST_CRC];
    if (len != 0) {
        memcpy(&bytes[ARB_HOST_HEADER], payload, len);
    }
    const uint16_t total = arb_host_finish(bytes, id, reference, len);
    TEST_ASSERT_EQUAL(total, arb_app_on_bytes(&app, x.now_ms, bytes, total));
    exchange_step(&x);
}

/* The oldest answer that the host has not looked at yet. */
static void expect(uint16_t id, uint8_t reference, const uint8_t *payload, uint16_t len)
{
    const uint16_t size = len != 0 ? (uint16_t)(len + 2) : 0;
    TEST_ASSERT_GREATER_OR_EQUAL_MESSAGE(8u + size, host_len, "no answer");
    TEST_ASSERT_EQUAL_HEX8(0xFE, host_out[0]);
    TEST_ASSERT_EQUAL_HEX8(0x19, host_out[1]);
    TEST_ASSERT_EQUAL_HEX16(id, host_out[2] | host_out[3] << 8);
    TEST_ASSERT_EQUAL_HEX8(reference, host_out[4]);
    TEST_ASSERT_EQUAL_HEX8(arb_host_crc8(host_out), host_out[5]);
    TEST_ASSERT_EQUAL(size, host_out[6] | host_out[7] << 8);
    if (len != 0) {
        TEST_ASSERT_EQUAL_HEX8_ARRAY(payload, &host_out[8], len);
        TEST_ASSERT_EQUAL_HEX16(arb_host_crc16(payload, len), host_out[8 + len] | host_out[9 + len] << 8);
    }
    host_len -= 8u + size;
    memmove(host_out, &host_out[8 + size], host_len);
}

static void expect_error(uint16_t id, uint8_t reference, uint8_t error)
{
    expect(id, reference, &error, 1);
}

static void expect_nothing(void)
{
    TEST_ASSERT_EQUAL(0, host_len);
}

#define DEV_OUT 2, 0, 2, 0, 4, 0 /* 0002:0002:0004, id 11h, output 1 */
#define DEV_IN 2, 0, 2, 0, 6, 0  /* 0002:0002:0006, id 12h, input 1 */
#define BYTES(...) (const uint8_t[]){__VA_ARGS__}, (uint16_t)sizeof((const uint8_t[]){__VA_ARGS__})

static void test_unknown_ids_get_2200h_with_their_reference(void)
{
    ask(0x2200, 1, NULL, 0);
    expect(0x2200, 1, NULL, 0);
    ask(0x2202, 2, NULL, 0);
    expect(0x2200, 2, NULL, 0);
    ask(0x9999, 3, BYTES(1, 2, 3));
    expect(0x2200, 3, NULL, 0);
    expect_nothing();
}

static void test_an_empty_bus(void)
{
    ask(0x2201, 9, NULL, 0);
    expect(0x2202, 9, BYTES(0, 0, 0, 0));
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
    exchange_add_output(&x, "FE");
    exchange_add_input(&x);
    ask(0x2201, 1, NULL, 0);
    expect(0x2202, 1, BYTES(2, 1, 1, 0));
    ask(0x2204, 2, BYTES(2));
    expect(0x2205, 2, BYTES(DEV_IN, 0, 0, 0, 0, 0));
    ask(0x2204, 2, BYTES(0));
    expect_error(0x2206, 2, 0x02);
    ask(0x2207, 3, BYTES(1));
    expect(0x2208, 3, BYTES(DEV_IN, 1, 0x00, 0x53, 0x10, 0x11));
    ask(0x220A, 4, BYTES(1));
    expect(0x220B, 4, BYTES(DEV_OUT, 1, 0x00, 0x50, 0x20, 0x21));
}

/* D-API-6: a device counts from its first beacon, its channels all at once when its setup ends. */
static void test_a_device_in_setup_has_no_channels_yet(void)
{
    exchange_rx(&x, "611#01 0200 0200 0400");
    (void)exchange_drain(&x);
    ask(0x2201, 1, NULL, 0);
    expect(0x2202, 1, BYTES(0, 0, 0, 0));
    exchange_rx(&x, "011#0A");
    ask(0x2201, 1, NULL, 0);
    expect(0x2202, 1, BYTES(1, 0, 0, 0));
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
    expect_nothing();
    exchange_tx(&x, "311#03 01 01");
    exchange_rx(&x, "211#83 01 01 01 0050 2021");
    expect(0x2302, 5, BYTES(0x00, 0x50, 0x20, 0x21));
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
    expect(0x2302, 5, BYTES('e', 'l', 'b', 'o', 'w', '1', ' ', ' ', ' '));
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
    expect(0x2305, 6, NULL, 0);
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
    expect(0x2305, 6, NULL, 0);
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
        expect_nothing();
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
        expect_nothing();
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
    static const exchange_pair_t making[] = {
        {"312#04 05 01 0200 0200", "212#84 01 05 01"},
        {"312#04 06 01 0400 01", "212#84 01 06 01"},
        {"312#04 08 01 0050 2021", "212#84 01 08 01"},
        {"312#04 07 01 11 FE", "212#84 01 07 01"},
        {"312#04 04 01 01", "212#84 01 04 01"},
        {"311#04 04 01 01", "211#84 01 04 01"},
        {NULL, NULL},
    };
    exchange_add_output(&x, "FE");
    exchange_add_input(&x);
    ask(0x2307, 7, BYTES(DEV_OUT, 1, DEV_IN, 1));
    expect_nothing();
    exchange_run(&x, making);
    expect(0x2308, 7, BYTES(2));
    ask(0x2201, 8, NULL, 0);
    expect(0x2202, 8, BYTES(2, 1, 1, 1));
    ask(0x220D, 9, BYTES(1));
    expect(0x220E, 9, BYTES(DEV_OUT, 1, DEV_IN, 1, 2));
    ask(0x220D, 9, BYTES(2));
    expect_error(0x220F, 9, 0x02);
    ask(0x2307, 7, BYTES(DEV_OUT, 1, DEV_IN, 1)); /* again: without traffic */
    expect(0x2308, 7, BYTES(2));
    exchange_silence(&x);
}

static void test_links_that_cannot_be(void)
{
    exchange_add_output(&x, "FE");
    exchange_add_input(&x);
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
    exchange_add_output(&x, "FE");
    exchange_add_input(&x);
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
        x.arb->bus.nodes.nodes[2].setup_attempts = 0;
        expect_nothing();
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
    expect_nothing();
    ask(0x2201, 5, NULL, 0);
    expect_error(0x2203, 5, 0x07);
    ask(0x9999, 6, NULL, 0);
    expect(0x2200, 6, NULL, 0);
    exchange_tx(&x, "311#03 08 00");
    exchange_rx(&x, "211#83 01 08 00 11");
    expect(0x2302, 1, BYTES(0x11));
    expect(0x2202, 2, BYTES(1, 0, 1, 0));
    expect(0x2200, 3, NULL, 0);
    exchange_tx(&x, "311#03 03 00"); /* the next one starts by itself */
    exchange_rx(&x, "211#83 01 03 00 01020304");
    expect(0x2302, 4, BYTES(1, 2, 3, 4));
    expect_nothing();
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
    expect_nothing();
    exchange_tx(&x, "311#03 08 00");
    exchange_rx(&x, "211#83 01 08 00 11");
    expect(0x2302, 1, BYTES(0x11));
    exchange_tx(&x, "311#0D 07 00 0002");
    exchange_rx(&x, "211#8D 00 07 00 0002"); /* it has no room for 512 bytes */
    expect_error(0x2306, 2, 0x06);
    exchange_tx(&x, "311#03 08 00");
    exchange_rx(&x, "211#83 01 08 00 11");
    expect(0x2302, 4, BYTES(0x11));
    expect(0x2202, 5, BYTES(1, 0, 1, 0));
}

/* D-API-1: strict: error 0Ch, and the request is not carried out; an unknown id stays unknown. */
static void test_strict_checksums(void)
{
    uint8_t bytes[] = {0xFE, 0x19, 0x01, 0x22, 0x07, 0x00, 0x00, 0x00};
    (void)arb_app_on_bytes(&app, x.now_ms, bytes, sizeof bytes);
    exchange_step(&x);
    expect(0x2202, 7, BYTES(0, 0, 0, 0)); /* lenient */
    start(true);
    (void)arb_app_on_bytes(&app, x.now_ms, bytes, sizeof bytes);
    exchange_step(&x);
    expect_error(0x2203, 7, 0x0C);
    bytes[2] = 0x99;
    (void)arb_app_on_bytes(&app, x.now_ms, bytes, sizeof bytes);
    exchange_step(&x);
    expect(0x2200, 7, NULL, 0);
    ask(0x2201, 8, NULL, 0);
    expect(0x2202, 8, BYTES(0, 0, 0, 0));
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
    host_room = 3;
    uint16_t taken = 0;
    unsigned answered = 0;
    for (int turn = 0; turn < 2000 && answered < 100; turn++) {
        taken = (uint16_t)(taken + arb_app_on_bytes(&app, x.now_ms, &stream[taken],
                                                    (uint16_t)(sizeof stream - taken)));
        exchange_step(&x);
        host_room += 3;
        while (host_len >= 11) {
            TEST_ASSERT_EQUAL_HEX8(0xFE, host_out[0]);
            TEST_ASSERT_EQUAL_HEX8(0x22, host_out[3]);
            const size_t size = 8u + host_out[6];
            if (host_len < size) {
                break;
            }
            answered++;
            host_len -= size;
            memmove(host_out, &host_out[size], host_len);
        }
    }
    TEST_ASSERT_EQUAL(sizeof stream, taken);
    TEST_ASSERT_EQUAL(100, answered);
    expect_nothing();
}

/* D-BUS-6: also after a power cycle. */
static void test_identities_outlive_a_power_cycle(void)
{
    exchange_add_output(&x, "FE");
    exchange_add_input(&x);
    exchange_pass(&x, 600);
    TEST_ASSERT_FALSE(app.store.changed);
    start(false);
    TEST_ASSERT_EQUAL(2, app.arb.bind.remembered_count);
    exchange_rx(&x, "655#01 0200 0200 0400");
    exchange_tx(&x, "355#81 11 0200 0200 0400");
}

static void test_unchanged_identities_are_not_written_again(void)
{
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 600);
    start(false);
    uint8_t before[sizeof memory];
    memcpy(before, memory, sizeof memory);
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 2000);
    TEST_ASSERT_EQUAL_MEMORY(before, memory, sizeof memory);
}

/* Power fails at every byte of the write that adds the second identity: afterwards there are one or two,
 * never none. */
static void test_power_may_fail_at_any_byte(void)
{
    uint8_t before[sizeof memory];
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 600);
    memcpy(before, memory, sizeof memory);
    int old = 0;
    int fresh = 0;
    for (size_t cut = 0; cut <= ARB_STORE_HEADER + 2 * ARB_STORE_ENTRY + ARB_STORE_CRC; cut++) {
        memcpy(memory, before, sizeof memory);
        writes_left = -1;
        start(false);
        exchange_add_input(&x);
        writes_left = 0;
        bytes_left_of_last = cut;
        exchange_pass(&x, 600);
        start(false);
        const uint8_t count = app.arb.bind.remembered_count;
        TEST_ASSERT_TRUE(count == 1 || count == 2);
        TEST_ASSERT_EQUAL_HEX8(0x11, app.arb.bind.remembered[count - 1].node_id);
        old += count == 1 ? 1 : 0;
        fresh += count == 2 ? 1 : 0;
    }
    TEST_ASSERT_EQUAL(1, fresh);
    TEST_ASSERT_GREATER_THAN(20, old);
}

/* Bit rot in either area: the other one is used, and it is seen. */
static void test_a_damaged_copy_is_seen_and_not_used(void)
{
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 600);
    exchange_add_input(&x);
    exchange_pass(&x, 600);
    uint8_t good[sizeof memory];
    memcpy(good, memory, sizeof memory);
    for (unsigned area = 0; area < ARB_STORE_AREAS; area++) {
        for (unsigned byte = 2; byte < 17; byte++) {
            memcpy(memory, good, sizeof memory);
            memory[area * ARB_STORE_AREA + byte] ^= 0x10;
            start(false);
            TEST_ASSERT_EQUAL(1, app.store.damaged);
            TEST_ASSERT_GREATER_OR_EQUAL(1, app.arb.bind.remembered_count);
        }
    }
}

/* What stands on the memory, from the table in arb_store.h; CRC-32 of the 13 bytes computed apart. */
static void test_the_stored_bytes(void)
{
    static const uint8_t want[] = {'P', 'I', 1, 1, 1, 0, 2, 0, 2, 0, 4, 0, 0x11, 0x48, 0x96, 0xE5, 0x12};
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 600);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(want, memory, sizeof want);
}

/* A known device binds between two pages of a write: the order of the table changes, and what is stored is
 * still whole. */
static void test_a_bind_between_two_pages(void)
{
    for (uint8_t i = 0; i < 24; i++) {
        const pdcp_remembered_t entry = {.identity = {7, 7, (uint16_t)(100 + i)},
                                         .node_id = (uint8_t)(0x60 + i)};
        TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&app.arb.bind, &entry));
    }
    exchange_rx(&x, "650#01 0900 0900 0900");
    (void)exchange_drain(&x);
    exchange_pass(&x, 506); /* 500 ms, then a page each 5 ms */
    exchange_rx(&x, "660#01 0700 0700 6400");
    exchange_pass(&x, 400);
    TEST_ASSERT_FALSE(app.store.changed);
    start(false);
    TEST_ASSERT_EQUAL(0, app.store.damaged);
    TEST_ASSERT_EQUAL(25, app.arb.bind.remembered_count);
}

/* The host does not read for long while it sends: what could not be taken then is taken later, nothing in
 * between is given up. */
static void test_a_stall_of_the_host_loses_no_request(void)
{
    uint8_t request[8] = {0xFE, 0x19, 0x01, 0x22, 0x00, 0x00, 0x00, 0x00};
    uint8_t stream[8 * 12];
    for (unsigned i = 0; i < 12; i++) {
        request[4] = (uint8_t)i;
        request[5] = arb_host_crc8(request);
        memcpy(&stream[8 * i], request, 8);
    }
    host_room = 0;
    uint16_t taken = 0;
    for (int ms = 0; ms < 500; ms++) {
        const uint16_t some = (uint16_t)(sizeof stream - taken < 5 ? sizeof stream - taken : 5);
        taken = (uint16_t)(taken + arb_app_on_bytes(&app, x.now_ms, &stream[taken], some));
        exchange_wait(&x, 1);
    }
    TEST_ASSERT_LESS_THAN(sizeof stream, taken);
    host_room = sizeof host_out;
    for (int ms = 0; ms < 100; ms++) {
        exchange_wait(&x, 1);
        const uint16_t some = (uint16_t)(sizeof stream - taken < 5 ? sizeof stream - taken : 5);
        taken = (uint16_t)(taken + arb_app_on_bytes(&app, x.now_ms, &stream[taken], some));
        exchange_step(&x);
    }
    TEST_ASSERT_EQUAL(sizeof stream, taken);
    unsigned answers = 0;
    for (size_t at = 0; at < host_len; at += 8u + host_out[at + 6]) {
        answers++;
    }
    TEST_ASSERT_EQUAL(12, answers);
    TEST_ASSERT_EQUAL(0, app.api.rx.given_up);
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
    RUN_TEST(test_identities_outlive_a_power_cycle);
    RUN_TEST(test_unchanged_identities_are_not_written_again);
    RUN_TEST(test_power_may_fail_at_any_byte);
    RUN_TEST(test_a_damaged_copy_is_seen_and_not_used);
    RUN_TEST(test_the_stored_bytes);
    RUN_TEST(test_a_bind_between_two_pages);
    RUN_TEST(test_a_stall_of_the_host_loses_no_request);
    return UNITY_END();
}
