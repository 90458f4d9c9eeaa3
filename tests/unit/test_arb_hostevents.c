/* The event stream (2416h, 2419h; D-API-5): what is told, in which bytes, and that answers never wait for
 * it. */
#include <string.h>

#include "hostlink.h"
#include "unity.h"

#define TIME 0x00, 0xFF, 0xFF, 0xFF  /* hostlink_start's, LSB first */
#define LATER 0x05, 0xFF, 0xFF, 0xFF /* the first bind request was held for 5 ms (D-BUS-42) */

static exchange_t x;
static arb_app_t app;

void setUp(void)
{
    hostlink_start(&x, &app, false);
}

void tearDown(void) {}

static void subscribe(uint8_t mask)
{
    hostlink_ask(&x, 0x2416, 1, &mask, 1);
    hostlink_answer(0x2417, 1, NULL, 0);
}

static void expect_event(const uint8_t *payload, uint16_t len)
{
    hostlink_answer(0x2419, 0, payload, len);
}

/* D-API-5: nothing unasked to a host that never used the group. */
static void test_nothing_is_sent_unasked(void)
{
    exchange_add_both(&x);
    arb_app_on_state(&app, x.now_ms, PDCP_BUS_PASSIVE);
    exchange_pass(&x, 3000);
    (void)exchange_drain(&x);
    hostlink_silence();
    TEST_ASSERT_EQUAL(0, app.api.events.used);
}

/* A whole message; its checksums were computed apart. */
static void test_bytes(void)
{
    subscribe(0x10);
    exchange_rx(&x, "02A#0A");
    hostlink_expect("FE 19 19 24 00 48 0B 00 05 00 FF FF FF 2A 00 01 0A 41 09");
    hostlink_silence();
}

static void test_devices_come_and_go(void)
{
    subscribe(0x03);
    exchange_add_output(&x, "FE");
    expect_event(BYTES(1, LATER, DEV_OUT, 0x11));
    hostlink_silence();
    exchange_wait(&x, 1500);
    expect_event(BYTES(2, 0xE1, 0x04, 0, 0, DEV_OUT, 0x11));
    subscribe(0x01);
    exchange_rx(&x, "011#0A"); /* it is back */
    expect_event(BYTES(1, 0xE1, 0x04, 0, 0, DEV_OUT, 0x11));
    exchange_wait(&x, 1500);
    hostlink_silence(); /* of a kind that is not wanted */
}

static void make_link(void)
{
    hostlink_ask(&x, 0x2307, 7, BYTES(DEV_OUT, 1, DEV_IN, 1));
    exchange_run(&x, exchange_making);
}

/* Also which output it was, when a link is gone. */
static void test_links_change(void)
{
    exchange_add_both(&x);
    subscribe(0x04);
    make_link();
    hostlink_answer(0x2308, 7, BYTES(2)); /* the answer goes first */
    expect_event(BYTES(3, LATER, DEV_OUT, 1, DEV_IN, 1, 2));
    hostlink_ask(&x, 0x2410, 8, BYTES(DEV_IN, 1));
    exchange_pairs(&x, exchange_removing);
    hostlink_answer(0x2411, 8, NULL, 0);
    expect_event(BYTES(3, LATER, DEV_OUT, 1, DEV_IN, 1, 0));
    hostlink_silence();
}

static void test_the_configuration_changes(void)
{
    subscribe(0x08);
    arb_limb_on_written(&app.limb, &app.arb);
    app.work = true;
    exchange_step(&x);
    expect_event(BYTES(4, TIME, 0, 0));
    hostlink_silence();
}

/* Frames of both directions; only base frames. */
static void test_frames(void)
{
    static const can_frame_t extended = {.kind = CAN_FRAME_EXTENDED, .dlc = 8};
    subscribe(0x10);
    exchange_rx(&x, "7FF#0102030405060708");
    expect_event(BYTES(5, TIME, 0xFF, 7, 8, 1, 2, 3, 4, 5, 6, 7, 8));
    exchange_rx(&x, "123#");
    expect_event(BYTES(5, TIME, 0x23, 1, 0));
    arb_app_on_frame(&app, x.now_ms, &extended);
    exchange_step(&x);
    hostlink_silence();
}

static bool takes(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    (void)frame;
    return true;
}

static void test_frames_that_are_sent(void)
{
    arb_port_t sending = *app.port;
    sending.can_send = takes;
    subscribe(0x10);
    app.port = &sending;
    exchange_wait(&x, 500);
    expect_event(BYTES(5, 0xF4, 0, 0, 0, 0, 1, 1, 0x0A));
    hostlink_silence();
}

static void test_the_bus_has_another_state(void)
{
    subscribe(0x20);
    arb_app_on_errors(&app, 130, 7);
    arb_app_on_state(&app, x.now_ms, PDCP_BUS_PASSIVE);
    exchange_step(&x);
    expect_event(BYTES(6, TIME, 1, 130, 7));
    arb_app_on_errors(&app, 255, 7);
    arb_app_on_state(&app, x.now_ms, PDCP_BUS_OFF);
    exchange_step(&x);
    expect_event(BYTES(6, TIME, 2, 255, 7));
    arb_app_on_errors(&app, 0, 0);
    arb_app_on_state(&app, x.now_ms, PDCP_BUS_ACTIVE);
    exchange_step(&x);
    expect_event(BYTES(6, TIME, 0, 0, 0));
    arb_app_on_state(&app, x.now_ms, PDCP_BUS_DOWN);
    exchange_step(&x);
    expect_event(BYTES(6, TIME, 2, 0, 0));
    arb_app_on_state(&app, x.now_ms, PDCP_BUS_ACTIVE);
    exchange_step(&x);
    expect_event(BYTES(6, TIME, 0, 0, 0));
    exchange_meet_server(&x);
    expect_event(BYTES(6, TIME, 3, 0, 0));
    exchange_wait(&x, 1856);
    expect_event(BYTES(6, 0x40, 0x06, 0, 0, 0, 0, 0));
    hostlink_silence();
}

/* D-API-20, D-BUS-40: an audit finds a channel whose parameter is not what it should be. */
static void test_the_audit_finds_a_difference(void)
{
    exchange_add_both(&x);
    make_link();
    hostlink_answer(0x2308, 7, BYTES(2));
    hostlink_ask(&x, 0x2416, 1, BYTES(0x00, 0x01));
    hostlink_answer(0x2417, 1, NULL, 0);
    pdcp_arb_audit(&app.arb, x.now_ms);
    app.work = true;
    exchange_pass(&x, 60);
    exchange_tx(&x, "311#03 04 01");
    exchange_rx(&x, "211#83 01 04 01 01");
    exchange_pass(&x, 60);
    exchange_tx(&x, "312#03 04 01");
    exchange_rx(&x, "212#83 01 04 01 01");
    exchange_pass(&x, 60);
    exchange_tx(&x, "311#03 05 01");
    exchange_rx(&x, "211#83 01 05 01 33");
    expect_event(BYTES(9, 0xB9, 0xFF, 0xFF, 0xFF, DEV_OUT, 1, 5)); /* 5 ms of D-BUS-42 and 3 times 60 */
    hostlink_silence();
}

/* D-API-20: a mask has 8 or 16 bits. There are the kinds 1 to 6 and 9: bits 0 to 5 and 8. */
static void test_masks_of_both_sizes(void)
{
    static const uint16_t wrong[] = {0x0040, 0x0080, 0x0200, 0x8000, 0x0141, 0xFFFF};
    for (unsigned i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        hostlink_ask(&x, 0x2416, 1, BYTES((uint8_t)(wrong[i] & 0xFFu), (uint8_t)(wrong[i] >> 8)));
        hostlink_answer(0x2418, 1, BYTES(0x0F));
    }
    hostlink_ask(&x, 0x2416, 2, BYTES(0x3F, 0x01));
    hostlink_answer(0x2417, 2, NULL, 0);
    TEST_ASSERT_EQUAL_HEX16(0x013F, app.api.events.mask);
    hostlink_ask(&x, 0x2416, 3, BYTES(0x10, 0x00));
    hostlink_answer(0x2417, 3, NULL, 0);
    TEST_ASSERT_EQUAL_HEX16(0x0010, app.api.events.mask);
    hostlink_ask(&x, 0x2416, 4, BYTES(0x10, 0x00, 0x00));
    hostlink_answer(0x2418, 4, BYTES(0x01));
    hostlink_ask(&x, 0x2416, 5, NULL, 0);
    hostlink_answer(0x2418, 5, BYTES(0x01));
    TEST_ASSERT_EQUAL_HEX16(0x0010, app.api.events.mask);
    hostlink_ask(&x, 0x2416, 6, BYTES(0x20)); /* one byte takes kind 9 away */
    hostlink_answer(0x2417, 6, NULL, 0);
    TEST_ASSERT_EQUAL_HEX16(0x0020, app.api.events.mask);
}

static void test_masks(void)
{
    hostlink_ask(&x, 0x2416, 1, BYTES(0x40));
    hostlink_answer(0x2418, 1, BYTES(0x0F));
    subscribe(0x10);
    exchange_rx(&x, "02A#0A");
    hostlink_ask(&x, 0x2416, 2, BYTES(0));
    expect_event(BYTES(5, TIME, 0x2A, 0, 1, 0x0A));
    hostlink_answer(0x2417, 2, NULL, 0);
    exchange_rx(&x, "02A#0A");
    hostlink_silence();
}

/* After the answer to a mask no event of another kind comes, not even one that waited. */
static void test_what_waits_when_the_mask_changes(void)
{
    subscribe(0x30);
    hostlink_room(0);
    exchange_rx(&x, "02A#0A");
    exchange_rx(&x, "02B#0A");
    arb_app_on_state(&app, x.now_ms, PDCP_BUS_PASSIVE);
    exchange_step(&x);
    hostlink_ask(&x, 0x2416, 2, BYTES(0x20));
    hostlink_room(1000);
    exchange_step(&x);
    hostlink_answer(0x2417, 2, NULL, 0);
    expect_event(BYTES(6, TIME, 1, 0, 0));
    hostlink_silence();
    TEST_ASSERT_EQUAL(1, app.api.events.counters[0]);
    TEST_ASSERT_EQUAL(0, app.api.events.counters[ARB_EVENT_FRAME]);
}

/* An event of which the first bytes have left is sent to its end, then the answer, then the other events. */
static void test_no_message_is_torn_and_answers_go_first(void)
{
    subscribe(0x10);
    hostlink_room(5);
    for (int i = 0; i < 3; i++) {
        exchange_rx(&x, "02A#0A");
    }
    hostlink_ask(&x, 0x2201, 9, NULL, 0);
    hostlink_room(1000);
    exchange_step(&x);
    expect_event(BYTES(5, TIME, 0x2A, 0, 1, 0x0A));
    hostlink_answer(0x2202, 9, BYTES(0, 0, 0, 0));
    expect_event(BYTES(5, TIME, 0x2A, 0, 1, 0x0A));
    expect_event(BYTES(5, TIME, 0x2A, 0, 1, 0x0A));
    hostlink_silence();
}

static size_t writes_three(void *ctx, const uint8_t *bytes, size_t size)
{
    const arb_port_t *const *whole = ctx;
    return (*whole)->host_write((*whole)->ctx, bytes, size < 3 ? size : 3);
}

/* A driver that takes three bytes at a time, whatever it is offered. */
static void test_no_message_is_torn_by_a_driver_that_takes_little(void)
{
    const arb_port_t *whole = app.port;
    arb_port_t little = *whole;
    const uint8_t *payload;
    uint16_t len;
    unsigned answers = 0;
    little.ctx = &whole;
    little.host_write = writes_three;
    subscribe(0x10);
    app.port = &little;
    for (int i = 0; i < 200; i++) {
        exchange_rx(&x, "02A#0102030405060708");
        if (i % 20 == 0) {
            hostlink_ask(&x, 0x2201, (uint8_t)i, NULL, 0);
        }
        uint16_t id;
        while ((id = hostlink_take(&payload, &len)) != 0) {
            answers += id == 0x2202 ? 1 : 0;
            TEST_ASSERT_TRUE(id == 0x2202 || id == 0x2419);
        }
    }
    TEST_ASSERT_EQUAL(10, answers);
}

/* What finds no room is dropped and counted by its kind; frames leave room for the others. */
static void test_events_are_dropped_and_counted(void)
{
    subscribe(0x30);
    hostlink_room(0);
    for (int i = 0; i < 100; i++) {
        exchange_rx(&x, "02A#0102030405060708");
    }
    TEST_ASSERT_EQUAL(0, app.api.events.counters[ARB_EVENT_BUS_STATE]);
    TEST_ASSERT_GREATER_THAN(90, app.api.events.counters[ARB_EVENT_FRAME]);
    for (int i = 0; i < 40; i++) {
        arb_app_on_state(&app, x.now_ms, i % 2 == 0 ? PDCP_BUS_PASSIVE : PDCP_BUS_ACTIVE);
    }
    TEST_ASSERT_GREATER_THAN(10, app.api.events.counters[ARB_EVENT_BUS_STATE]);
    const uint32_t dropped =
        app.api.events.counters[ARB_EVENT_FRAME] + app.api.events.counters[ARB_EVENT_BUS_STATE];
    hostlink_room(4000);
    exchange_step(&x);
    uint32_t came = 0;
    const uint8_t *payload;
    uint16_t len;
    while (hostlink_take(&payload, &len) == 0x2419) {
        came++;
    }
    TEST_ASSERT_EQUAL(140, came + dropped);
    TEST_ASSERT_EQUAL(came, app.api.events.counters[0]);
    hostlink_silence();
}

/* D-API-14: A host that has gone takes its stream with it: the next one has asked for nothing. */
static void test_the_stream_ends_with_its_host(void)
{
    subscribe(0x10);
    hostlink_room(0);
    exchange_rx(&x, "02A#0A");
    arb_app_on_host_gone(&app);
    hostlink_room(1000);
    exchange_rx(&x, "02A#0A");
    hostlink_silence();
}

/* D-API-17: What it has asked for and was not served yet is served, but for the stream. */
static void test_no_stream_begins_when_its_host_is_gone(void)
{
    exchange_add_output(&x, "FE");
    (void)exchange_drain(&x);
    hostlink_ask(&x, 0x2301, 7, BYTES(DEV_OUT, 0, 7)); /* waits for its device */
    hostlink_ask(&x, 0x2416, 8, BYTES(0x10));
    arb_app_on_host_gone(&app);
    exchange_rx(&x, "211#83 01 07 00 41");
    hostlink_answer(0x2302, 7, BYTES(0x41));
    hostlink_answer(0x2418, 8, BYTES(0x0B));
    exchange_rx(&x, "02A#0A");
    hostlink_silence();
}

/* Nor by what stood in the middle of something when it went. */
static void test_what_was_begun_ends_with_its_host(void)
{
    hostlink_send(&x, "FE 19 04 23 00 00 40 00 02 00"); /* 54 bytes are missing */
    hostlink_ask(&x, 0x2416, 8, BYTES(0x10));
    const uint32_t garbage = app.api.rx.counters[ARB_HOSTRX_GARBAGE];
    arb_app_on_host_gone(&app);
    TEST_ASSERT_EQUAL(garbage + 21, app.api.rx.counters[ARB_HOSTRX_GARBAGE]);
    exchange_pass(&x, 200);
    hostlink_silence();
    hostlink_ask(&x, 0x2201, 9, NULL, 0);
    hostlink_answer(0x2202, 9, BYTES(0, 0, 0, 0));
}

/* --- full bus load over 128000 baud --- */

#ifdef __AVR__
enum { LOAD_MS = 150 };
#else
enum { LOAD_MS = 5000 };
#endif

/* A line that carries 12.8 bytes a ms and whose driver takes up to 20 ms ahead. */
typedef struct {
    uint32_t written; /* bytes that the application has handed over */
    uint32_t sent_10; /* tenths of bytes that have left */
} line_t;

static const uint32_t ahead = 256;

static void carry(line_t *line)
{
    line->sent_10 += 128;
    if (line->sent_10 > line->written * 10) {
        line->sent_10 = line->written * 10;
    }
    hostlink_room(ahead - (line->written - line->sent_10 / 10));
}

static void load_one_ms(line_t *line)
{
    carry(line);
    const size_t room = hostlink_room_left();
    x.now_ms++;
    for (int i = 0; i < 8; i++) { /* 1 Mbit/s: a frame of 8 bytes takes 125 us */
        const can_frame_t frame = exchange_frame("2A5#0102030405060708");
        arb_app_on_frame(&app, x.now_ms, &frame);
        exchange_step(&x);
    }
    line->written += (uint32_t)(room - hostlink_room_left());
    (void)exchange_drain(&x);
}

/* Every request that is served from the tables has its answer, to the last byte on the line, within 50 ms. */
static void test_answers_at_full_bus_load(void)
{
    static const uint16_t ids[] = {0x2201, 0x2204, 0x2207, 0x220A, 0x220D, 0x2401, 0x2413};
    line_t line = {0, 0};
    uint32_t taken = 0; /* bytes looked at so far */
    uint32_t end = 0;   /* where the answer ends in the stream; 0: it has not been handed over */
    uint32_t asked = 0; /* requests */
    uint32_t since = 0; /* ms since the last one */
    uint32_t worst = 0;
    subscribe(0x3F);
    hostlink_ask(&x, 0x2201, 0, NULL, 0);
    for (int ms = 0; ms < LOAD_MS; ms++) {
        load_one_ms(&line);
        since++;
        const uint8_t *payload;
        uint16_t len;
        uint16_t id;
        while ((id = hostlink_take(&payload, &len)) != 0) {
            taken += 8u + (len != 0 ? len + 2u : 0u);
            end = id != 0x2419 ? taken : end;
        }
        if (end != 0 && line.sent_10 >= end * 10) {
            worst = since > worst ? since : worst;
            end = 0;
            since = 0;
            asked++;
            const uint16_t what = ids[asked % 7];
            const uint8_t group = 0;
            hostlink_ask(&x, what, (uint8_t)asked, &group, what == 0x2201 || what == 0x2401 ? 0 : 1);
        }
        TEST_ASSERT_LESS_OR_EQUAL(50, since);
    }
    TEST_ASSERT_GREATER_THAN(LOAD_MS / 50, asked);
    TEST_ASSERT_GREATER_THAN(20, worst); /* the line was full */
    TEST_ASSERT_GREATER_THAN(LOAD_MS * 7, app.api.events.counters[ARB_EVENT_FRAME]);
    TEST_ASSERT_GREATER_THAN(LOAD_MS / 4, app.api.events.counters[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_sent_unasked);
    RUN_TEST(test_bytes);
    RUN_TEST(test_devices_come_and_go);
    RUN_TEST(test_links_change);
    RUN_TEST(test_the_configuration_changes);
    RUN_TEST(test_frames);
    RUN_TEST(test_frames_that_are_sent);
    RUN_TEST(test_the_bus_has_another_state);
    RUN_TEST(test_the_audit_finds_a_difference);
    RUN_TEST(test_masks);
    RUN_TEST(test_masks_of_both_sizes);
    RUN_TEST(test_what_waits_when_the_mask_changes);
    RUN_TEST(test_no_message_is_torn_and_answers_go_first);
    RUN_TEST(test_no_message_is_torn_by_a_driver_that_takes_little);
    RUN_TEST(test_events_are_dropped_and_counted);
    RUN_TEST(test_the_stream_ends_with_its_host);
    RUN_TEST(test_no_stream_begins_when_its_host_is_gone);
    RUN_TEST(test_what_was_begun_ends_with_its_host);
    RUN_TEST(test_answers_at_full_bus_load);
    return UNITY_END();
}
