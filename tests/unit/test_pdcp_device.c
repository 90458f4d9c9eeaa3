/* The device role (D-BUS-16) against frames written by hand from the tables of pdcp-bus.md. The clock starts
 * shortly before it wraps, so that every test but the shortest ones crosses 2^32. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pdcp_device.h"
#include "unity.h"

/* Device 0002:0003:0004h with id 10h once bound. Identifiers (P << 9 | M << 8 | N). */
enum {
    ID = 0x10,
    BIND = 0x600 | ID,   /* P=3 M=0 */
    TO = 0x300 | ID,     /* P=1 M=1 */
    FROM = 0x200 | ID,   /* P=1 M=0 */
    BEACON = 0x000 | ID, /* P=0 M=0 */
    TO_ALL = 0x300,
    ARB_BEACON = 0x100
};

static const uint8_t required[] = {0x20, 0, 0, 0, 0, 0, 0, 1};
static const uint8_t desired[] = {0x40};
static char long_text[1601];

static uint8_t gain[16];
static uint16_t gain_len;
static uint8_t fixed[] = {1, 2, 3};
static uint16_t fixed_len = sizeof fixed;
static uint8_t bulk_bytes[12];

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
    {0x50, 3, true, sizeof gain, gain, &gain_len},
    {0x51, 0, false, sizeof fixed, fixed, &fixed_len},
};

static const pdcp_device_desc_t desc = {
    .identity = {0x0002, 0x0003, 0x0004},
    .ean13_low = 0x11223344,
    .ean13_high = 0x00000055,
    .firmware = 0x0102,
    .hardware = 0x0304,
    .type = 0x0506,
    .profile = 0x0708,
    .descriptor = {long_text, 1600},
    .channels = channels,
    .channel_count = 3,
    .extras = extras,
    .extra_count = 2,
    .bulk = bulk_bytes,
    .bulk_capacity = sizeof bulk_bytes,
};

static uint32_t now;
static pdcp_device_t dev;

static struct {
    unsigned inputs;
    unsigned safes;
    unsigned stores;
    unsigned resets;
    unsigned written;
    uint8_t channel;
    uint8_t len;
    uint8_t data[8];
    pdcp_device_record_t record;
} seen;

static void on_input(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len)
{
    TEST_ASSERT_EQUAL_PTR(&seen, ctx);
    seen.inputs++;
    seen.channel = channel;
    seen.len = len;
    memcpy(seen.data, data, len);
}

static void on_safe(void *ctx, uint8_t channel)
{
    TEST_ASSERT_EQUAL_PTR(&seen, ctx);
    TEST_ASSERT_EQUAL_UINT8(2, channel);
    seen.safes++;
}

static void on_store(void *ctx, const pdcp_device_record_t *record)
{
    TEST_ASSERT_EQUAL_PTR(&seen, ctx);
    seen.stores++;
    seen.record = *record;
}

static void on_reset(void *ctx)
{
    TEST_ASSERT_EQUAL_PTR(&seen, ctx);
    seen.resets++;
}

static void on_written(void *ctx, uint8_t channel, uint8_t param)
{
    TEST_ASSERT_EQUAL_PTR(&seen, ctx);
    TEST_ASSERT_EQUAL_UINT8(3, channel);
    TEST_ASSERT_EQUAL_HEX8(0x50, param);
    seen.written++;
}

static const pdcp_device_port_t port = {&seen, on_input, on_safe, on_store, on_reset, on_written};

/* --- helpers --- */

static can_frame_t frame_of(unsigned id, const char *hex)
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

static uint32_t step(void)
{
    return pdcp_device_step(&dev, now);
}

static void rx(unsigned id, const char *hex)
{
    const can_frame_t frame = frame_of(id, hex);
    pdcp_device_on_frame(&dev, now, &frame);
    (void)step();
}

static void check_tx(unsigned line, unsigned id, const char *hex)
{
    const can_frame_t want = frame_of(id, hex);
    can_frame_t got;
    UNITY_TEST_ASSERT(pdcp_device_tx_peek(&dev, &got), line, "nothing was sent");
    pdcp_device_tx_pop(&dev);
    UNITY_TEST_ASSERT_EQUAL_HEX16(want.id, got.id, line, "identifier");
    UNITY_TEST_ASSERT_EQUAL_UINT8(want.dlc, got.dlc, line, "DLC");
    if (want.dlc != 0) {
        UNITY_TEST_ASSERT_EQUAL_HEX8_ARRAY(want.data, got.data, want.dlc, line, "data");
    }
}

static void check_quiet(unsigned line)
{
    can_frame_t got;
    UNITY_TEST_ASSERT(!pdcp_device_tx_peek(&dev, &got), line, "something was sent");
}

#define TX(id, hex) check_tx(__LINE__, (id), (hex))
#define QUIET() check_quiet(__LINE__)
#define ANSWERED(request, answer)                                                                            \
    do {                                                                                                     \
        rx(TO, (request));                                                                                   \
        TX(FROM, (answer));                                                                                  \
        QUIET();                                                                                             \
    } while (0)

static void advance(uint32_t ms)
{
    now += ms;
    (void)step();
}

/* Time passes; the arbitrator is heard, beacons are thrown away, anything else fails the test. */
static void pass_quietly(uint32_t ms)
{
    can_frame_t frame;
    while (ms != 0) {
        const uint32_t part = ms < 100 ? ms : 100;
        now += part;
        ms -= part;
        rx(ARB_BEACON, "0A");
        while (pdcp_device_tx_peek(&dev, &frame)) {
            TEST_ASSERT_EQUAL_HEX16(BEACON, frame.id);
            TEST_ASSERT_EQUAL_HEX8(0x0A, frame.data[0]);
            pdcp_device_tx_pop(&dev);
        }
    }
}

static void boot(const pdcp_device_record_t *record)
{
    TEST_ASSERT_TRUE(pdcp_device_init(&dev, &desc, &port, record, 1, now));
    (void)step();
}

static pdcp_device_record_t blank_record(uint8_t node_id)
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
static void bind_with(const pdcp_device_record_t *record)
{
    boot(record);
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "81 10 0200 0300 0400");
    TX(BEACON, "0A");
}

static void bind_blank(void)
{
    const pdcp_device_record_t record = blank_record(ID);
    bind_with(&record);
    QUIET();
}

/* Input 1 listens to 21h, input 2 to 22h, output 3 sends as 23h. */
static void link_all(void)
{
    ANSWERED("04 07 01 20 21", "84 01 07 01 20 21");
    ANSWERED("04 07 02 20 22", "84 01 07 02 20 22");
    ANSWERED("04 05 03 23", "84 01 05 03 23");
    ANSWERED("04 04 01 01", "84 01 04 01 01");
    ANSWERED("04 04 02 01", "84 01 04 02 01");
    ANSWERED("04 04 03 01", "84 01 04 03 01");
}

void setUp(void)
{
    now = UINT32_MAX - 500;
    memset(&seen, 0, sizeof seen);
    memset(long_text, 'x', sizeof long_text);
    for (unsigned i = 0; i < 1600; i++) {
        long_text[i] = (char)(i & 0x7F);
    }
    memset(gain, 0, sizeof gain);
    gain[0] = 7;
    gain_len = 1;
    memset(bulk_bytes, 0xEE, sizeof bulk_bytes);
}

void tearDown(void) {}

/* --- binding --- */

static void test_asks_for_its_last_id_and_is_bound(void)
{
    bind_blank();
    TEST_ASSERT_EQUAL_UINT8(ID, pdcp_device_node_id(&dev));
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_BOUND, pdcp_device_state(&dev));
    TEST_ASSERT_EQUAL_UINT(0, seen.stores); /* nothing new to keep */
}

static void test_random_id_is_legal_and_stored_when_granted(void)
{
    for (uint32_t seed = 0; seed < 2000; seed++) {
        can_frame_t frame;
        TEST_ASSERT_TRUE(pdcp_device_init(&dev, &desc, &port, NULL, seed, now));
        (void)step();
        TEST_ASSERT_TRUE(pdcp_device_tx_peek(&dev, &frame));
        TEST_ASSERT_EQUAL_HEX16(0x600, frame.id & 0x700);
        TEST_ASSERT_TRUE((frame.id & 0xFF) >= 1 && (frame.id & 0xFF) <= 254);
        TEST_ASSERT_EQUAL_UINT8(0, pdcp_device_node_id(&dev));
    }
    can_frame_t request;
    TEST_ASSERT_TRUE(pdcp_device_tx_peek(&dev, &request));
    const unsigned id = request.id & 0xFFu;
    char answer[32];
    (void)snprintf(answer, sizeof answer, "81 %02X 0200 0300 0400", id);
    rx(0x300 | id, answer);
    TEST_ASSERT_EQUAL_UINT8(id, pdcp_device_node_id(&dev));
    TEST_ASSERT_EQUAL_UINT(1, seen.stores);
    TEST_ASSERT_EQUAL_UINT8(id, seen.record.node_id);
}

static void test_random_id_differs_between_attempts_and_devices(void)
{
    uint8_t first = 0;
    unsigned different = 0;
    for (uint32_t sn = 0; sn < 20; sn++) {
        pdcp_device_desc_t other = desc;
        can_frame_t frame;
        other.identity.sn = (uint16_t)sn;
        TEST_ASSERT_TRUE(pdcp_device_init(&dev, &other, &port, NULL, 1, now));
        (void)step();
        TEST_ASSERT_TRUE(pdcp_device_tx_peek(&dev, &frame));
        different += (frame.id & 0xFF) != first ? 1u : 0u;
        first = (uint8_t)(frame.id & 0xFF);
    }
    TEST_ASSERT_TRUE(different > 15);
}

static void test_answer_must_match_identity_and_requested_id(void)
{
    const pdcp_device_record_t record = blank_record(ID);
    boot(&record);
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "81 10 0300 0300 0400"); /* VID */
    rx(TO, "81 10 0200 0400 0400"); /* PID */
    rx(TO, "81 10 0200 0300 0401"); /* SN */
    TEST_ASSERT_EQUAL_UINT32(3, pdcp_device_stats(&dev)->drop_bind);
    rx(0x311, "81 10 0200 0300 0400"); /* N is not the id asked for */
    rx(0x300, "81 10 0200 0300 0400"); /* to all */
    rx(0x710, "81 10 0200 0300 0400"); /* P=3 M=1 is not used */
    rx(0x210, "81 10 0200 0300 0400"); /* not from the arbitrator */
    rx(TO, "81 10 0200 0300");         /* too short */
    rx(TO, "81 FF 0200 0300 0400");    /* 255 is never given out (D-BUS-2) */
    QUIET();
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ASKING, pdcp_device_state(&dev));
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&dev)->drop_unused_id);
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&dev)->drop_bad_dlc);
    rx(TO, "81 10 0200 0300 0400");
    TX(BEACON, "0A");
}

static void test_suggestion_is_asked_for_at_once(void)
{
    const pdcp_device_record_t record = blank_record(ID);
    boot(&record);
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "81 2A 0200 0300 0400");
    TX(0x62A, "01 0200 0300 0400");
    QUIET();
    rx(TO, "81 10 0200 0300 0400"); /* late answer to the first request */
    TEST_ASSERT_EQUAL_UINT8(0, pdcp_device_node_id(&dev));
    rx(0x32A, "81 2A 0200 0300 0400");
    TX(0x02A, "0A");
    TEST_ASSERT_EQUAL_UINT8(0x2A, pdcp_device_node_id(&dev));
    TEST_ASSERT_EQUAL_UINT8(0x2A, seen.record.node_id);
}

static void test_endless_suggestions_do_not_fill_the_bus(void)
{
    const pdcp_device_record_t record = blank_record(ID);
    can_frame_t frame;
    unsigned requests = 0;
    boot(&record);
    for (unsigned i = 0; i < 100 && pdcp_device_tx_peek(&dev, &frame); i++) {
        char answer[32];
        pdcp_device_tx_pop(&dev);
        requests++;
        (void)snprintf(answer, sizeof answer, "81 %02X 0200 0300 0400", 0x40 + i);
        rx(0x300u | (frame.id & 0xFFu), answer);
    }
    TEST_ASSERT_EQUAL_UINT(9, requests);
    advance(1250);
    TX(BIND, "01 0200 0300 0400");
}

/* Waits for the next request and returns the pause before it. */
static uint32_t pause_before_request(void)
{
    const uint32_t from = now;
    can_frame_t frame;
    TEST_ASSERT_FALSE(pdcp_device_tx_peek(&dev, &frame));
    const uint32_t deadline = step();
    now = deadline - 1;
    (void)step();
    TEST_ASSERT_FALSE(pdcp_device_tx_peek(&dev, &frame));
    now = deadline;
    (void)step();
    TX(BIND, "01 0200 0300 0400");
    QUIET();
    return now - from;
}

static void test_requests_double_to_eight_seconds_and_spread(void)
{
    static const uint32_t bases[] = {1000, 2000, 4000, 8000, 8000, 8000};
    uint32_t odd = 0;
    for (uint32_t seed = 0; seed < 50; seed++) {
        const pdcp_device_record_t record = blank_record(ID);
        now = UINT32_MAX - 1500;
        TEST_ASSERT_TRUE(pdcp_device_init(&dev, &desc, &port, &record, seed, now));
        (void)step();
        TX(BIND, "01 0200 0300 0400");
        for (unsigned i = 0; i < sizeof bases / sizeof bases[0]; i++) {
            const uint32_t pause = pause_before_request();
            TEST_ASSERT_TRUE(pause >= bases[i] && pause <= bases[i] + bases[i] / 4);
            odd += pause != bases[i] ? 1u : 0u;
        }
    }
    TEST_ASSERT_TRUE(odd > 250); /* of 300: spread at random */
}

/* D-BUS-56: a grant that comes behind a refusal is for a twin with the same identity, which asked for the
 * same id. */
static void test_after_a_refusal_no_grant_is_taken(void)
{
    const pdcp_device_record_t record = blank_record(ID);
    boot(&record);
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "81 00 0200 0300 0400");
    char grant[] = "81 11 0200 0300 0400";
    (void)snprintf(grant, sizeof grant, "81 %02X 0200 0300 0400", ID);
    rx(TO, grant);
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ASKING, pdcp_device_state(&dev));
}

static void test_refusal_is_no_answer_and_suggestion_starts_the_pauses_afresh(void)
{
    const pdcp_device_record_t record = blank_record(ID);
    boot(&record);
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "81 00 0200 0300 0400");
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&dev)->bind_refused);
    TEST_ASSERT_TRUE(pause_before_request() >= 1000);
    TEST_ASSERT_TRUE(pause_before_request() >= 2000);
    rx(TO, "81 2A 0200 0300 0400");
    TX(0x62A, "01 0200 0300 0400");
    const uint32_t pause = pause_before_request();
    TEST_ASSERT_TRUE(pause >= 1000 && pause <= 1250);
}

static void test_bind_timeout_comes_from_the_description(void)
{
    pdcp_device_desc_t slow = desc;
    slow.bind_ms = 10000;
    TEST_ASSERT_TRUE(pdcp_device_init(&dev, &slow, &port, NULL, 1, now));
    const uint32_t from = now;
    const uint32_t pause = step() - from;
    TEST_ASSERT_TRUE(pause >= 10000 && pause <= 12500);
}

static void test_unbound_device_answers_nothing(void)
{
    const pdcp_device_record_t record = blank_record(ID);
    boot(&record);
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "03 01 00");
    rx(TO, "0B");
    rx(TO_ALL, "08 0000");
    rx(ARB_BEACON, "0A");
    QUIET();
    TEST_ASSERT_EQUAL_UINT32(4, pdcp_device_stats(&dev)->drop_unbound);
    TEST_ASSERT_EQUAL_UINT(0, seen.resets);
    TEST_ASSERT_FALSE(pdcp_device_suspended(&dev));
}

static void test_unreadable_record_is_taken_as_none(void)
{
    const pdcp_device_record_t record = blank_record(255);
    can_frame_t frame;
    boot(&record);
    TEST_ASSERT_TRUE(pdcp_device_tx_peek(&dev, &frame));
    TEST_ASSERT_TRUE((frame.id & 0xFF) >= 1 && (frame.id & 0xFF) <= 254);
}

static void test_description_that_cannot_be_is_refused(void)
{
    pdcp_device_desc_t bad = desc;
    pdcp_device_channel_desc_t channel = channels[0];
    bad.channel_count = PDCP_DEVICE_CHANNELS_MAX + 1;
    TEST_ASSERT_FALSE(pdcp_device_init(&dev, &bad, &port, NULL, 1, now));
    channel.direction = 0;
    bad.channels = &channel;
    bad.channel_count = 1;
    TEST_ASSERT_FALSE(pdcp_device_init(&dev, &bad, &port, NULL, 1, now));
}

/* A random number generator of this kind never leaves 0: neither may a seed lead there. This one would. */
static void test_no_seed_stops_the_random_ids(void)
{
    can_frame_t frame;
    unsigned different = 0;
    unsigned last = 0;
    TEST_ASSERT_TRUE(pdcp_device_init(&dev, &desc, &port, NULL, 0x227B4C90, now));
    for (unsigned i = 0; i < 10; i++) {
        now = step();
        (void)step();
        TEST_ASSERT_TRUE(pdcp_device_tx_peek(&dev, &frame));
        pdcp_device_tx_pop(&dev);
        TEST_ASSERT_EQUAL_HEX16(0x600, frame.id & 0x700);
        different += (frame.id & 0xFFu) != last ? 1u : 0u;
        last = frame.id & 0xFFu;
    }
    TEST_ASSERT_TRUE(different > 7);
}

/* --- beacons --- */

static void test_beacons_keep_their_interval(void)
{
    bind_blank();
    for (unsigned i = 0; i < 4; i++) {
        const uint32_t due = step();
        TEST_ASSERT_EQUAL_UINT32(now + 500, due);
        advance(499);
        QUIET();
        advance(1);
        rx(ARB_BEACON, "0A");
        TX(BEACON, "0A");
        QUIET();
    }
    advance(503); /* late once: the next one is not late */
    TX(BEACON, "0A");
    advance(497);
    TX(BEACON, "0A");
    advance(1700); /* three missed: one is sent, not three */
    TX(BEACON, "0A");
    QUIET();
}

static void test_beacon_interval_can_be_changed_within_its_limits(void)
{
    bind_blank();
    ANSWERED("04 0A 00 3100", "84 00 0A 00 3100"); /* 49 ms */
    ANSWERED("04 0A 00 1127", "84 00 0A 00 1127"); /* 10001 ms */
    ANSWERED("03 0A 00", "83 01 0A 00 F401");
    ANSWERED("04 0A 00 6400", "84 01 0A 00 6400");
    ANSWERED("03 0A 00", "83 01 0A 00 6400");
    advance(100);
    TX(BEACON, "0A");
    QUIET();
    ANSWERED("04 0A 00 1027", "84 01 0A 00 1027"); /* 10 s */
    pass_quietly(9900);
    advance(100);
    TX(BEACON, "0A");
}

static void test_blocked_bus_gathers_one_beacon(void)
{
    bind_blank();
    for (unsigned i = 0; i < 20; i++) {
        advance(500);
    }
    TX(BEACON, "0A");
    QUIET();
    TEST_ASSERT_EQUAL_UINT32(0, pdcp_device_stats(&dev)->tx_full);
}

static void test_answers_that_find_no_room_are_counted(void)
{
    bind_blank();
    for (unsigned i = 0; i < PDCP_TX_MAX + 4; i++) {
        rx(TO, "03 09 00");
    }
    TEST_ASSERT_EQUAL_UINT32(4, pdcp_device_stats(&dev)->tx_full);
    advance(500); /* a beacon pushes the last one out */
    TEST_ASSERT_EQUAL_UINT32(5, pdcp_device_stats(&dev)->tx_full);
    TX(BEACON, "0A");
    for (unsigned i = 0; i < PDCP_TX_MAX - 1; i++) {
        TX(FROM, "83 01 09 00 03");
    }
    QUIET();
}

static void test_nothing_can_be_taken_out_of_an_empty_queue(void)
{
    bind_blank();
    const uint32_t taken = pdcp_device_stats(&dev)->tx;
    pdcp_device_tx_pop(&dev);
    TEST_ASSERT_EQUAL_UINT32(taken, pdcp_device_stats(&dev)->tx);
    ANSWERED("03 09 00", "83 01 09 00 03");
}

/* --- parameters --- */

static void test_device_parameters(void)
{
    bind_blank();
    ANSWERED("03 01 00", "83 01 01 00 0200 0300");
    ANSWERED("03 02 00", "83 01 02 00 0400");
    ANSWERED("03 03 00", "83 01 03 00 44332211");
    ANSWERED("03 04 00", "83 01 04 00 55000000");
    ANSWERED("03 05 00", "83 01 05 00 0201 0403");
    ANSWERED("03 06 00", "83 01 06 00 0605 0807");
    ANSWERED("03 07 00", "83 02 07 00");
    ANSWERED("03 08 00", "83 01 08 00 10");
    ANSWERED("03 09 00", "83 01 09 00 03");
    ANSWERED("03 0A 00", "83 01 0A 00 F401");
    ANSWERED("03 0B 00", "83 01 0B 00 6400");
    ANSWERED("03 0C 00", "83 01 0C 00 E803");
    ANSWERED("03 00 00", "83 00 00 00");
    ANSWERED("03 0D 00", "83 00 0D 00");
}

static void test_input_parameters_after_power_on(void)
{
    bind_blank();
    ANSWERED("03 01 02", "83 01 01 02 0053 1011");
    ANSWERED("03 02 01", "83 01 02 01 696E");
    ANSWERED("03 02 02", "83 01 02 02");
    ANSWERED("03 03 02", "83 01 03 02 01");
    ANSWERED("03 04 02", "83 01 04 02 00");
    ANSWERED("03 05 02", "83 01 05 02 FFFF FFFF");
    ANSWERED("03 06 02", "83 01 06 02 FFFF FF");
    ANSWERED("03 07 02", "83 01 07 02 00 00");
    ANSWERED("03 08 02", "83 01 08 02 0000 0000");
    ANSWERED("03 09 02", "83 01 09 02");
    ANSWERED("03 0A 02", "83 01 0A 02");
    ANSWERED("03 0B 02", "83 01 0B 02 2012");
    ANSWERED("03 0C 02", "83 00 0C 02");
    ANSWERED("03 01 04", "83 00 01 04"); /* no such channel */
    ANSWERED("03 01 FF", "83 00 01 FF");
}

static void test_output_parameters(void)
{
    bind_blank();
    ANSWERED("03 01 03", "83 01 01 03 0050 0011");
    ANSWERED("03 02 03", "83 02 02 03");
    ANSWERED("03 03 03", "83 01 03 03 02");
    ANSWERED("03 04 03", "83 01 04 03 00");
    ANSWERED("03 05 03", "83 01 05 03 00");
    ANSWERED("03 06 03", "83 00 06 03"); /* not specified for outputs */
    ANSWERED("03 09 03", "83 02 09 03");
    ANSWERED("03 0A 03", "83 01 0A 03 40");
    ANSWERED("03 0B 03", "83 00 0B 03");
    ANSWERED("04 05 03 42", "84 01 05 03 42");
    ANSWERED("03 05 03", "83 01 05 03 42");
    ANSWERED("04 05 03 FF", "84 00 05 03 FF");
    ANSWERED("03 05 03", "83 01 05 03 42");
}

static void test_source_of_an_input_is_written_and_stored(void)
{
    bind_blank();
    ANSWERED("04 05 01 0200 0900", "84 01 05 01 0200 0900");
    ANSWERED("04 06 01 0B00 04", "84 01 06 01 0B00 04");
    ANSWERED("04 08 01 0050 2021", "84 01 08 01 0050 2021");
    TEST_ASSERT_EQUAL_UINT(3, seen.stores);
    TEST_ASSERT_EQUAL_HEX16(2, seen.record.sources[0].identity.vid);
    TEST_ASSERT_EQUAL_HEX16(9, seen.record.sources[0].identity.pid);
    TEST_ASSERT_EQUAL_HEX16(0x0B, seen.record.sources[0].identity.sn);
    TEST_ASSERT_EQUAL_UINT8(4, seen.record.sources[0].channel);
    TEST_ASSERT_EQUAL_HEX16(0x5000, seen.record.sources[0].type);
    TEST_ASSERT_EQUAL_HEX16(0x2120, seen.record.sources[0].profile);
    ANSWERED("04 08 01 0050 2021", "84 01 08 01 0050 2021");
    TEST_ASSERT_EQUAL_UINT(3, seen.stores); /* unchanged: not stored again */
    ANSWERED("03 05 01", "83 01 05 01 0200 0900");
    ANSWERED("03 06 01", "83 01 06 01 0B00 04");
    ANSWERED("03 08 01", "83 01 08 01 0050 2021");
    ANSWERED("04 07 01 20 FF", "84 00 07 01 20 FF");
    ANSWERED("03 07 01", "83 01 07 01 00 00");
}

/* Every field of the source counts, however little of it has changed. */
static void test_any_change_of_a_source_is_stored(void)
{
    bind_blank();
    ANSWERED("04 06 01 0B00 04", "84 01 06 01 0B00 04");
    ANSWERED("04 08 01 0050 2021", "84 01 08 01 0050 2021");
    TEST_ASSERT_EQUAL_UINT(2, seen.stores);
    ANSWERED("04 06 01 0B00 05", "84 01 06 01 0B00 05");
    TEST_ASSERT_EQUAL_UINT(3, seen.stores);
    TEST_ASSERT_EQUAL_UINT8(5, seen.record.sources[0].channel);
    ANSWERED("04 08 01 0050 2022", "84 01 08 01 0050 2022");
    TEST_ASSERT_EQUAL_UINT(4, seen.stores);
    TEST_ASSERT_EQUAL_HEX16(0x2220, seen.record.sources[0].profile);
}

/* D-BUS-2: 255 is nobody's id. */
static void test_a_source_cannot_have_id_255(void)
{
    bind_blank();
    ANSWERED("04 07 01 FF 21", "84 00 07 01 FF 21");
    ANSWERED("03 07 01", "83 01 07 01 00 00");
}

static void test_short_values_are_filled_with_zero_and_long_ones_cut(void)
{
    bind_blank();
    ANSWERED("04 05 01 0200", "84 01 05 01 0200");
    ANSWERED("03 05 01", "83 01 05 01 0200 0000");
    ANSWERED("04 06 01 0B00 04 99", "84 01 06 01 0B00 04 99");
    ANSWERED("03 06 01", "83 01 06 01 0B00 04");
    ANSWERED("04 04 01 01 02 03 04", "84 01 04 01 01 02 03 04");
    ANSWERED("03 04 01", "83 01 04 01 01");
}

static void test_read_only_parameters_stay(void)
{
    static const char *const writes[][2] = {
        {"04 01 00 01", "84 00 01 00 01"}, {"04 02 00 01", "84 00 02 00 01"},
        {"04 03 00 01", "84 00 03 00 01"}, {"04 05 00 01", "84 00 05 00 01"},
        {"04 07 00 41", "84 00 07 00 41"}, {"04 08 00 20", "84 00 08 00 20"},
        {"04 09 00 01", "84 00 09 00 01"}, {"04 01 01 01", "84 00 01 01 01"},
        {"04 03 01 02", "84 00 03 01 02"}, {"04 09 01 01", "84 00 09 01 01"},
        {"04 0B 02 01", "84 00 0B 02 01"}, {"04 06 03 01", "84 00 06 03 01"},
        {"04 04 04 01", "84 00 04 04 01"}, {"04 33 00 01", "84 00 33 00 01"},
        {"04 04 FF 01", "84 00 04 FF 01"},
    };
    bind_blank();
    for (unsigned i = 0; i < sizeof writes / sizeof writes[0]; i++) {
        ANSWERED(writes[i][0], writes[i][1]);
    }
    TEST_ASSERT_EQUAL_UINT(0, seen.stores);
    ANSWERED("03 08 00", "83 01 08 00 10");
}

static void test_times_have_limits(void)
{
    bind_blank();
    ANSWERED("04 0B 00 1300", "84 00 0B 00 1300"); /* 19 ms */
    ANSWERED("04 0B 00 F501", "84 00 0B 00 F501"); /* 501 ms */
    ANSWERED("04 0B 00 1400", "84 01 0B 00 1400");
    ANSWERED("03 0B 00", "83 01 0B 00 1400");
    ANSWERED("04 0C 00 0000", "84 00 0C 00 0000");
    ANSWERED("04 0C 00 D007", "84 01 0C 00 D007");
    ANSWERED("03 0C 00", "83 01 0C 00 D007");
}

static void test_extras_are_read_and_written(void)
{
    bind_blank();
    ANSWERED("03 50 03", "83 01 50 03 07");
    ANSWERED("04 50 03 0102 0304", "84 01 50 03 0102 0304");
    TEST_ASSERT_EQUAL_UINT(1, seen.written);
    TEST_ASSERT_EQUAL_UINT16(4, gain_len);
    ANSWERED("03 50 03", "83 01 50 03 0102 0304");
    ANSWERED("03 50 00", "83 00 50 00"); /* belongs to channel 3 */
    ANSWERED("03 51 00", "83 01 51 00 0102 03");
    ANSWERED("04 51 00 01", "84 00 51 00 01");
    gain_len = 5;
    ANSWERED("03 50 03", "83 02 50 03");
}

static void test_a_value_longer_than_its_extra_is_refused(void)
{
    pdcp_device_extra_t narrow = extras[0];
    pdcp_device_desc_t other = desc;
    const pdcp_device_record_t record = blank_record(ID);
    narrow.capacity = 2;
    other.extras = &narrow;
    other.extra_count = 1;
    TEST_ASSERT_TRUE(pdcp_device_init(&dev, &other, &port, &record, 1, now));
    (void)step();
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "81 10 0200 0300 0400");
    TX(BEACON, "0A");
    ANSWERED("04 50 03 0A0B0C", "84 00 50 03 0A0B0C");
    TEST_ASSERT_EQUAL_UINT(0, seen.written);
    ANSWERED("03 50 03", "83 01 50 03 07");
    ANSWERED("04 50 03 0A0B", "84 01 50 03 0A0B");
    TEST_ASSERT_EQUAL_UINT(1, seen.written);
}

/* --- malformed and foreign frames --- */

static void test_malformed_frames_are_counted_and_not_answered(void)
{
    can_frame_t odd = frame_of(TO, "03 01 00");
    bind_blank();
    rx(TO, "");
    rx(TO, "03 01");
    rx(TO, "04 04 01");
    rx(TO, "44 00");
    rx(TO, "D5");
    rx(TO, "0F 01");             /* only a device asks this */
    rx(TO, "83 01 01 00");       /* an answer that only a device gives */
    rx(TO, "01 0200 0300 0400"); /* only a device asks this */
    rx(TO, "02 00");
    rx(TO, "07 11");
    rx(TO, "8E 01");                /* no transfer */
    rx(TO, "8F 01 01");             /* nothing asked */
    rx(TO, "81 10 0200 0300 0400"); /* bound already */
    rx(0x710, "03 01 00");
    rx(0x311, "03 01 00"); /* another device's */
    rx(TO_ALL, "03 01 00");
    rx(TO_ALL, "0B");
    for (unsigned kind = CAN_FRAME_EXTENDED; kind <= CAN_FRAME_FD; kind++) {
        odd.kind = (uint8_t)kind;
        pdcp_device_on_frame(&dev, now, &odd);
    }
    QUIET();
    const pdcp_device_stats_t *stats = pdcp_device_stats(&dev);
    TEST_ASSERT_EQUAL_UINT32(2, stats->drop_bad_dlc);
    TEST_ASSERT_EQUAL_UINT32(3, stats->drop_bad_code);
    TEST_ASSERT_EQUAL_UINT32(5, stats->drop_direction);
    TEST_ASSERT_EQUAL_UINT32(2, stats->drop_deprecated);
    TEST_ASSERT_EQUAL_UINT32(3, stats->drop_late);
    TEST_ASSERT_EQUAL_UINT32(1, stats->drop_unused_id);
    TEST_ASSERT_EQUAL_UINT32(4, stats->drop_kind);
    TEST_ASSERT_EQUAL_UINT(0, seen.resets);
    ANSWERED("03 09 00", "83 01 09 00 03");
}

/* --- channel data --- */

static void test_data_comes_only_from_the_source_of_an_enabled_input(void)
{
    bind_blank();
    ANSWERED("04 07 01 20 21", "84 01 07 01 20 21");
    rx(0x021, "0102");
    TEST_ASSERT_EQUAL_UINT(0, seen.inputs); /* not enabled */
    ANSWERED("04 04 01 01", "84 01 04 01 01");
    rx(0x021, "0102");
    TEST_ASSERT_EQUAL_UINT(1, seen.inputs);
    TEST_ASSERT_EQUAL_UINT8(1, seen.channel);
    TEST_ASSERT_EQUAL_UINT8(2, seen.len);
    TEST_ASSERT_EQUAL_HEX8(0x02, seen.data[1]);
    rx(0x221, "0B");               /* normal priority; no function code here */
    rx(0x421, "1122334455667788"); /* low priority */
    TEST_ASSERT_EQUAL_UINT(3, seen.inputs);
    TEST_ASSERT_EQUAL_UINT8(8, seen.len);
    rx(0x621, "01"); /* P=3: binding */
    rx(0x121, "01"); /* from the arbitrator */
    rx(0x022, "01");
    rx(0x020, "01"); /* the source's device id is not its channel */
    rx(0x000, "01");
    TEST_ASSERT_EQUAL_UINT(3, seen.inputs);
    ANSWERED("04 07 01 00 00", "84 01 07 01 00 00");
    rx(0x021, "0102");
    rx(0x000, "01");
    TEST_ASSERT_EQUAL_UINT(3, seen.inputs);
    TEST_ASSERT_EQUAL_UINT32(3, pdcp_device_stats(&dev)->data_in);
    QUIET();
}

/* A DLC above 8 means 8 bytes of data and is cut by the driver (can_frame.h); one that is not is no data. */
static void test_data_of_more_than_8_bytes_is_not_taken(void)
{
    can_frame_t frame = frame_of(0x021, "0102030405060708");
    bind_blank();
    link_all();
    frame.dlc = 9;
    pdcp_device_on_frame(&dev, now, &frame);
    TEST_ASSERT_EQUAL_UINT(0, seen.inputs);
    frame.dlc = 8;
    pdcp_device_on_frame(&dev, now, &frame);
    TEST_ASSERT_EQUAL_UINT(1, seen.inputs);
}

static void test_one_output_feeds_two_inputs(void)
{
    uint8_t ids[4];
    bind_blank();
    link_all();
    TEST_ASSERT_EQUAL_UINT8(2, pdcp_device_listens_to(&dev, ids, 4));
    TEST_ASSERT_EQUAL_HEX8(0x21, ids[0]);
    TEST_ASSERT_EQUAL_HEX8(0x22, ids[1]);
    TEST_ASSERT_EQUAL_UINT8(1, pdcp_device_listens_to(&dev, ids, 1));
    const uint16_t changes = pdcp_device_listen_changes(&dev);
    ANSWERED("04 07 02 20 21", "84 01 07 02 20 21");
    TEST_ASSERT_TRUE(changes != pdcp_device_listen_changes(&dev));
    rx(0x021, "55");
    TEST_ASSERT_EQUAL_UINT(2, seen.inputs);
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&dev)->data_in);
}

static void test_output_sends_with_its_node_id_when_enabled(void)
{
    static const uint8_t data[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    bind_blank();
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 1));
    ANSWERED("04 04 03 01", "84 01 04 03 01");
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 1)); /* no node id */
    ANSWERED("04 05 03 23", "84 01 05 03 23");
    TEST_ASSERT_TRUE(pdcp_device_send(&dev, now, 3, data, 1));
    TX(0x023, "01");
    TEST_ASSERT_TRUE(pdcp_device_send(&dev, now, 3, data, 8));
    TX(0x023, "0102030405060708");
    TEST_ASSERT_TRUE(pdcp_device_send(&dev, now, 3, NULL, 0));
    TX(0x023, "");
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 9));
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 1, data, 1)); /* an input */
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 0, data, 1));
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 4, data, 1));
    ANSWERED("04 04 03 00", "84 01 04 03 00");
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 1));
    QUIET();
}

static void test_data_leaves_room_for_answers(void)
{
    static const uint8_t data[1] = {9};
    unsigned sent = 0;
    bind_blank();
    link_all();
    while (pdcp_device_send(&dev, now, 3, data, 1)) {
        sent++;
        TEST_ASSERT_TRUE(sent < 100);
    }
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&dev)->tx_full);
    TEST_ASSERT_EQUAL_UINT32(sent, pdcp_device_stats(&dev)->data_out);
    rx(TO, "03 09 00");
    advance(500); /* a beacon: 010h comes before 023h, the answer 210h behind all */
    TX(BEACON, "0A");
    for (unsigned i = 0; i < sent; i++) {
        TX(0x023, "09");
    }
    TX(FROM, "83 01 09 00 03");
    QUIET();
}

/* --- suspend, release, reset --- */

static void test_suspend_for_a_time(void)
{
    static const uint8_t data[1] = {9};
    bind_blank();
    link_all();
    ANSWERED("08 E803", "88 01 E803"); /* 1000 ms */
    TEST_ASSERT_TRUE(pdcp_device_suspended(&dev));
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 1));
    ANSWERED("03 09 00", "83 01 09 00 03"); /* answers, and takes data */
    rx(0x021, "05");
    TEST_ASSERT_EQUAL_UINT(1, seen.inputs);
    pass_quietly(500);
    now += 499;
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 1));
    now += 1; /* without a step between */
    TEST_ASSERT_TRUE(pdcp_device_send(&dev, now, 3, data, 1));
    TX(0x023, "09");
}

static void test_suspend_deadline_is_reported(void)
{
    bind_blank();
    ANSWERED("08 0A00", "88 01 0A00");
    TEST_ASSERT_EQUAL_UINT32(now + 10, step());
    advance(10);
    TEST_ASSERT_FALSE(pdcp_device_suspended(&dev));
}

static void test_suspend_until_released(void)
{
    static const uint8_t data[1] = {9};
    bind_blank();
    link_all();
    ANSWERED("08 0000", "88 01 0000");
    pass_quietly(100000);
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 1));
    ANSWERED("09", "89 01");
    TEST_ASSERT_TRUE(pdcp_device_send(&dev, now, 3, data, 1));
    TX(0x023, "09");
    ANSWERED("09", "89 01"); /* released already */
}

static void test_suspend_and_release_to_all_are_not_answered(void)
{
    bind_blank();
    rx(TO_ALL, "08 0000");
    QUIET();
    TEST_ASSERT_TRUE(pdcp_device_suspended(&dev));
    rx(0x100, "09");
    QUIET();
    TEST_ASSERT_FALSE(pdcp_device_suspended(&dev));
}

static void test_reset_answers_and_binds_anew(void)
{
    static const uint8_t data[1] = {9};
    uint8_t ids[4];
    bind_blank();
    link_all();
    ANSWERED("04 05 01 0200 0900", "84 01 05 01 0200 0900");
    ANSWERED("04 0A 00 6400", "84 01 0A 00 6400");
    ANSWERED("08 0000", "88 01 0000");
    rx(0x310, "0B");
    TX(FROM, "8B 01");
    TX(BIND, "01 0200 0300 0400");
    QUIET();
    TEST_ASSERT_EQUAL_UINT(1, seen.resets);
    TEST_ASSERT_EQUAL_UINT(1, seen.safes);
    TEST_ASSERT_EQUAL_UINT8(0, pdcp_device_node_id(&dev));
    TEST_ASSERT_FALSE(pdcp_device_suspended(&dev));
    TEST_ASSERT_EQUAL_UINT8(0, pdcp_device_listens_to(&dev, ids, 4));
    rx(0x021, "05");
    TEST_ASSERT_EQUAL_UINT(0, seen.inputs);
    rx(TO, "81 10 0200 0300 0400");
    TX(BEACON, "0A");
    TX(FROM, "0F 01");
    QUIET();
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 1));
    ANSWERED("03 04 03", "83 01 04 03 00");
    ANSWERED("03 05 03", "83 01 05 03 00");
    ANSWERED("03 07 01", "83 01 07 01 00 00");
    ANSWERED("03 05 01", "83 01 05 01 0200 0900"); /* kept */
    ANSWERED("03 0A 00", "83 01 0A 00 F401");
}

static void test_reset_drops_what_waits(void)
{
    static const uint8_t data[1] = {9};
    bind_blank();
    link_all();
    TEST_ASSERT_TRUE(pdcp_device_send(&dev, now, 3, data, 1));
    rx(TO, "0B");
    TX(FROM, "8B 01");
    TX(BIND, "01 0200 0300 0400");
    QUIET();
}

/* --- update data channel --- */

static pdcp_device_record_t linked_record(void)
{
    pdcp_device_record_t record = blank_record(ID);
    for (unsigned i = 0; i < 2; i++) {
        record.sources[i].identity.vid = 2;
        record.sources[i].identity.pid = 2;
        record.sources[i].identity.sn = 9;
        record.sources[i].channel = (uint8_t)(i + 1);
    }
    return record;
}

static void test_stored_sources_are_asked_for_until_answered(void)
{
    const pdcp_device_record_t record = linked_record();
    bind_with(&record);
    TX(FROM, "0F 01");
    TX(FROM, "0F 02");
    QUIET();
    rx(TO, "8F 00 02"); /* failure is an answer */
    pass_quietly(900);
    advance(99);
    QUIET();
    advance(1);
    TX(BEACON, "0A");
    TX(FROM, "0F 01");
    QUIET();
    rx(TO, "8F 01 02"); /* late */
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&dev)->drop_late);
    pass_quietly(900);
    advance(100);
    TX(BEACON, "0A");
    TX(FROM, "0F 01");
    rx(TO, "8F 01 01");
    pass_quietly(5000);
    rx(TO, "8F 01 00");
    rx(TO, "8F 01 03"); /* an output */
    rx(TO, "8F 01 09");
    TEST_ASSERT_EQUAL_UINT32(4, pdcp_device_stats(&dev)->drop_late);
}

/* D-BUS-7: unconnected is FFFF, FFFF, FFFF and FF together. One of them alone says nothing. */
static void test_a_source_is_unconnected_only_as_a_whole(void)
{
    for (unsigned field = 0; field < 4; field++) {
        pdcp_device_record_t record = blank_record(ID);
        pdcp_device_source_t *source = &record.sources[0];
        source->identity.vid = field == 0 ? 2 : 0xFFFF;
        source->identity.pid = field == 1 ? 2 : 0xFFFF;
        source->identity.sn = field == 2 ? 2 : 0xFFFF;
        source->channel = field == 3 ? 2 : 0xFF;
        bind_with(&record);
        TX(FROM, "0F 01");
        QUIET();
    }
}

static void test_input_that_is_unconnected_meanwhile_is_not_asked_for(void)
{
    const pdcp_device_record_t record = linked_record();
    bind_with(&record);
    TX(FROM, "0F 01");
    TX(FROM, "0F 02");
    rx(TO, "8F 01 02");
    ANSWERED("04 05 01 FFFF FFFF", "84 01 05 01 FFFF FFFF");
    ANSWERED("04 06 01 FFFF FF", "84 01 06 01 FFFF FF");
    pass_quietly(3000);
}

/* More inputs than the queue has places, on a bus that takes nothing for a while. */
static void test_every_source_is_asked_for_though_the_queue_is_small(void)
{
    pdcp_device_channel_desc_t inputs[PDCP_DEVICE_CHANNELS_MAX];
    pdcp_device_record_t record = blank_record(ID);
    pdcp_device_desc_t wide = desc;
    uint32_t asked = 0;
    can_frame_t frame;
    for (unsigned i = 0; i < PDCP_DEVICE_CHANNELS_MAX; i++) {
        inputs[i] = channels[0];
        record.sources[i].identity.vid = 2;
    }
    wide.channels = inputs;
    wide.channel_count = PDCP_DEVICE_CHANNELS_MAX;
    TEST_ASSERT_TRUE(pdcp_device_init(&dev, &wide, &port, &record, 1, now));
    (void)step();
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "81 10 0200 0300 0400");
    TEST_ASSERT_EQUAL_UINT32(now + 10, step());
    for (unsigned round = 0; round < 5; round++) {
        advance(10);
        while (pdcp_device_tx_peek(&dev, &frame)) {
            pdcp_device_tx_pop(&dev);
            if (frame.id == FROM) {
                TEST_ASSERT_EQUAL_HEX8(0x0F, frame.data[0]);
                asked |= (uint32_t)1 << (frame.data[1] - 1);
            }
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFu, asked);
    TEST_ASSERT_EQUAL_UINT32(0, pdcp_device_stats(&dev)->tx_full);
}

/* --- silence of the arbitrator --- */

static void test_silence_is_among_the_deadlines(void)
{
    bind_blank();
    ANSWERED("04 0A 00 1027", "84 01 0A 00 1027"); /* a beacon every 10 s */
    TEST_ASSERT_EQUAL_UINT32(now + 3000, step());
    const uint32_t heard = now;
    now += 1000;
    rx(ARB_BEACON, "0A");
    TEST_ASSERT_EQUAL_UINT32(heard + 4000, step());
}

static void test_silence_stops_streaming_and_makes_inputs_safe(void)
{
    static const uint8_t data[1] = {9};
    bind_blank();
    link_all();
    now += 2999;
    (void)step();
    TX(BEACON, "0A");
    TEST_ASSERT_EQUAL_UINT(0, seen.safes);
    TEST_ASSERT_TRUE(pdcp_device_send(&dev, now, 3, data, 1));
    TX(0x023, "09");
    advance(1);
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ALONE, pdcp_device_state(&dev));
    TEST_ASSERT_EQUAL_UINT(1, seen.safes);
    TEST_ASSERT_EQUAL_UINT8(ID, pdcp_device_node_id(&dev));
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 1));
    rx(0x022, "05"); /* data does not wake an input that is safe */
    TEST_ASSERT_EQUAL_UINT(0, seen.inputs);
    for (unsigned i = 0; i < 10; i++) {
        const uint32_t due = step();
        TEST_ASSERT_TRUE(due - now <= 500);
        now = due;
        (void)step();
        TX(BEACON, "0A");
        QUIET();
    }
    TEST_ASSERT_EQUAL_UINT(1, seen.safes);
    rx(0x355, "03 01 00"); /* a request to another device is a sign of life, too */
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_BOUND, pdcp_device_state(&dev));
    TEST_ASSERT_FALSE(pdcp_device_send(&dev, now, 3, data, 1)); /* its ids may be others' by now (D-BUS-35) */
    rx(0x022, "05");
    TEST_ASSERT_EQUAL_UINT(0, seen.inputs);
}

static void test_devices_are_no_sign_of_an_arbitrator(void)
{
    bind_blank();
    for (unsigned i = 0; i < 30; i++) {
        rx(0x033, "0A");
        rx(0x733, "0A"); /* P=3 M=1 is not used by the protocol */
        now += 100;
    }
    (void)step();
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ALONE, pdcp_device_state(&dev));
}

static void test_answers_while_alone_come_with_the_arbitrator(void)
{
    bind_blank();
    advance(3000);
    TX(BEACON, "0A");
    ANSWERED("03 09 00", "83 01 09 00 03");
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_BOUND, pdcp_device_state(&dev));
}

static void test_disabled_terminal_input_becomes_safe(void)
{
    bind_blank();
    link_all();
    ANSWERED("04 04 01 00", "84 01 04 01 00"); /* not terminal */
    TEST_ASSERT_EQUAL_UINT(0, seen.safes);
    ANSWERED("04 04 02 00", "84 01 04 02 00");
    TEST_ASSERT_EQUAL_UINT(1, seen.safes);
    ANSWERED("04 04 02 00", "84 01 04 02 00"); /* was so already */
    TEST_ASSERT_EQUAL_UINT(1, seen.safes);
}

/* pdcp_device.h: every function of the port may be NULL. */
static void test_a_device_without_an_application(void)
{
    static const pdcp_device_port_t none = {0};
    static const uint8_t data[1] = {9};
    TEST_ASSERT_TRUE(pdcp_device_init(&dev, &desc, &none, NULL, 1, now));
    (void)step();
    can_frame_t request;
    TEST_ASSERT_TRUE(pdcp_device_tx_peek(&dev, &request));
    pdcp_device_tx_pop(&dev);
    rx(0x300u | (request.id & 0xFFu), "81 10 0200 0300 0400"); /* id 10h is suggested, stored nowhere */
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "81 10 0200 0300 0400");
    TX(BEACON, "0A");
    ANSWERED("04 05 01 0200 0900", "84 01 05 01 0200 0900");
    ANSWERED("04 50 03 01", "84 01 50 03 01");
    link_all();
    rx(0x021, "0102");
    rx(0x022, "0102");
    TEST_ASSERT_EQUAL_UINT32(2, pdcp_device_stats(&dev)->data_in);
    TEST_ASSERT_TRUE(pdcp_device_send(&dev, now, 3, data, 1));
    TX(0x023, "09");
    ANSWERED("04 04 02 00", "84 01 04 02 00"); /* a terminal input */
    rx(TO, "0B");
    TX(FROM, "8B 01");
    TX(BIND, "01 0200 0300 0400");
    TEST_ASSERT_EQUAL_INT(PDCP_DEVICE_ASKING, pdcp_device_state(&dev));
}

/* --- bulk get --- */

static void test_bulk_get_of_a_descriptor(void)
{
    bind_blank();
    rx(TO, "0C 02 03");
    TX(FROM, "8C 01 02 03 0600");
    TX(FROM, "0E 00 6F7574707574"); /* "output" */
    QUIET();
    rx(TO, "8E 01");
    QUIET();
    rx(TO, "8E 01");
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&dev)->drop_late);
}

static void test_bulk_get_of_required_inputs_ends_with_a_short_packet(void)
{
    bind_blank();
    rx(TO, "0C 09 03");
    TX(FROM, "8C 01 09 03 0800");
    TX(FROM, "0E 00 200000000000");
    rx(TO, "8E 01");
    TX(FROM, "0E 01 0001");
    rx(TO, "8E 01");
    QUIET();
}

static void test_bulk_get_of_short_and_of_missing_values(void)
{
    bind_blank();
    rx(TO, "0C 01 00");
    TX(FROM, "8C 01 01 00 0400");
    TX(FROM, "0E 00 0200 0300");
    rx(TO, "8E 01");
    ANSWERED("0C 02 02", "8C 01 02 02 0000"); /* empty descriptor: no packets */
    ANSWERED("0C 33 00", "8C 00 33 00 0000");
    ANSWERED("0C 01 09", "8C 00 01 09 0000");
}

static void test_bulk_get_packet_ids_wrap(void)
{
    bind_blank();
    rx(TO, "0C 07 00");
    TX(FROM, "8C 01 07 00 4006");
    for (unsigned i = 0; i < 267; i++) {
        can_frame_t frame;
        TEST_ASSERT_TRUE(pdcp_device_tx_peek(&dev, &frame));
        pdcp_device_tx_pop(&dev);
        TEST_ASSERT_EQUAL_HEX8(0x0E, frame.data[0]);
        TEST_ASSERT_EQUAL_UINT8(i % 256, frame.data[1]);
        TEST_ASSERT_EQUAL_UINT8(i < 266 ? 8 : 6, frame.dlc); /* 1600 = 266 x 6 + 4 */
        TEST_ASSERT_EQUAL_HEX8_ARRAY(&long_text[(size_t)i * 6], &frame.data[2], frame.dlc - 2u);
        rx(TO, "8E 01");
    }
    QUIET();
}

static void test_bulk_get_repeats_a_packet_without_answer(void)
{
    bind_blank();
    ANSWERED("04 0B 00 3200", "84 01 0B 00 3200"); /* 50 ms */
    rx(TO, "0C 02 03");
    TX(FROM, "8C 01 02 03 0600");
    TX(FROM, "0E 00 6F7574707574");
    for (unsigned i = 0; i < 2; i++) {
        TEST_ASSERT_EQUAL_UINT32(now + 50, step());
        advance(49);
        QUIET();
        advance(1);
        TX(FROM, "0E 00 6F7574707574");
        QUIET();
    }
    advance(50);
    QUIET(); /* three in all */
    TEST_ASSERT_EQUAL_UINT32(1, pdcp_device_stats(&dev)->bulk_failed);
    rx(TO, "8E 01");
    QUIET();
}

static void test_bulk_get_has_three_tries_for_each_packet(void)
{
    bind_blank();
    rx(TO, "0C 09 03");
    TX(FROM, "8C 01 09 03 0800");
    TX(FROM, "0E 00 200000000000");
    for (unsigned i = 0; i < 2; i++) {
        advance(100);
        TX(FROM, "0E 00 200000000000");
    }
    rx(TO, "8E 01");
    TX(FROM, "0E 01 0001");
    for (unsigned i = 0; i < 2; i++) {
        advance(100);
        TX(FROM, "0E 01 0001");
        QUIET();
    }
    rx(TO, "8E 01");
    QUIET();
    TEST_ASSERT_EQUAL_UINT32(0, pdcp_device_stats(&dev)->bulk_failed);
}

static void test_bulk_get_refused_or_started_anew(void)
{
    bind_blank();
    rx(TO, "0C 09 03");
    TX(FROM, "8C 01 09 03 0800");
    TX(FROM, "0E 00 200000000000");
    rx(TO, "8E 00"); /* the receiver found it wrong */
    QUIET();
    pass_quietly(1000);
    rx(TO, "0C 09 03");
    TX(FROM, "8C 01 09 03 0800");
    TX(FROM, "0E 00 200000000000");
    rx(TO, "8E 01");
    TX(FROM, "0E 01 0001");
    rx(TO, "0C 09 03"); /* anew, in the middle */
    TX(FROM, "8C 01 09 03 0800");
    TX(FROM, "0E 00 200000000000");
    rx(TO, "8E 01");
    TX(FROM, "0E 01 0001");
    rx(TO, "8E 01");
    QUIET();
}

/* --- bulk set --- */

static void test_bulk_set_of_an_extra(void)
{
    bind_blank();
    ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    ANSWERED("0E 00 010203040506", "8E 01");
    TEST_ASSERT_EQUAL_UINT(0, seen.written); /* not before it is whole */
    TEST_ASSERT_EQUAL_UINT8(7, gain[0]);
    ANSWERED("0E 01 0708", "8E 01");
    TEST_ASSERT_EQUAL_UINT(1, seen.written);
    TEST_ASSERT_EQUAL_UINT16(8, gain_len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\1\2\3\4\5\6\7\10", gain, 8);
}

static void test_bulk_set_of_a_source(void)
{
    bind_blank();
    ANSWERED("0D 05 01 0400", "8D 01 05 01 0400");
    ANSWERED("0E 00 02", "8E 01"); /* packets of any length from 1 to 6 */
    ANSWERED("0E 01 000900", "8E 01");
    ANSWERED("03 05 01", "83 01 05 01 0200 0900");
    TEST_ASSERT_EQUAL_UINT(1, seen.stores);
}

static void test_bulk_set_repeated_packets_are_stored_once(void)
{
    bind_blank();
    ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    ANSWERED("0E 00 010203040506", "8E 01");
    ANSWERED("0E 00 010203040506", "8E 01");
    ANSWERED("0E 01 0708", "8E 01");
    ANSWERED("0E 01 0708", "8E 01");
    TEST_ASSERT_EQUAL_UINT(1, seen.written);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\1\2\3\4\5\6\7\10", gain, 8);
}

static void test_bulk_set_wrong_packet_fails_until_configured_anew(void)
{
    bind_blank();
    ANSWERED("0E 00 01", "8E 00"); /* without a configure frame */
    ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    ANSWERED("0E FF 01", "8E 00"); /* FFh is no repetition of a packet that never came */
    ANSWERED("0E 00 010203040506", "8E 00");
    ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    ANSWERED("0E 00 010203040506", "8E 01");
    ANSWERED("0E 02 0708", "8E 00");
    ANSWERED("0E 01 0708", "8E 00");
    TEST_ASSERT_EQUAL_UINT(0, seen.written);
    ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    ANSWERED("0E 00 010203040506", "8E 01");
    ANSWERED("0E 01 070809", "8E 00"); /* more than was announced */
    TEST_ASSERT_EQUAL_UINT(0, seen.written);
    TEST_ASSERT_EQUAL_UINT8(7, gain[0]);
    TEST_ASSERT_EQUAL_UINT32(4, pdcp_device_stats(&dev)->bulk_failed);
}

static void test_bulk_set_started_anew_begins_with_packet_0(void)
{
    bind_blank();
    ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    ANSWERED("0E 00 FFFFFFFFFFFF", "8E 01");
    ANSWERED("0D 50 03 0200", "8D 01 50 03 0200");
    ANSWERED("0E 00 0A0B", "8E 01");
    TEST_ASSERT_EQUAL_UINT16(2, gain_len);
    TEST_ASSERT_EQUAL_HEX8(0x0A, gain[0]);
}

static void test_bulk_set_is_refused_at_configure_time(void)
{
    bind_blank();
    ANSWERED("0D 50 03 0D00", "8D 00 50 03 0D00"); /* 13: larger than the buffer of 12 */
    ANSWERED("0E 00 01", "8E 00");
    ANSWERED("0D 50 03 0C00", "8D 01 50 03 0C00");
    ANSWERED("0D 07 00 0800", "8D 00 07 00 0800"); /* read-only */
    ANSWERED("0D 33 00 0800", "8D 00 33 00 0800"); /* unknown */
    ANSWERED("0D 51 00 0200", "8D 00 51 00 0200"); /* read-only extra */
    ANSWERED("0D 04 09 0100", "8D 00 04 09 0100"); /* no such channel */
    TEST_ASSERT_EQUAL_UINT(0, seen.written);
}

/* What can be written at all can be written by bulk, and nothing else (pdcp-bus.md 4). */
static void test_bulk_set_of_channel_parameters(void)
{
    bind_blank();
    ANSWERED("0D 03 01 0100", "8D 00 03 01 0100"); /* transfer type */
    ANSWERED("0D 09 01 0100", "8D 00 09 01 0100"); /* required channels */
    ANSWERED("0D 06 03 0100", "8D 00 06 03 0100"); /* not specified for outputs */
    ANSWERED("0D 04 03 0100", "8D 01 04 03 0100");
    ANSWERED("0E 00 01", "8E 01");
    ANSWERED("03 04 03", "83 01 04 03 01");
    ANSWERED("0D 05 03 0100", "8D 01 05 03 0100");
    ANSWERED("0E 00 23", "8E 01");
    ANSWERED("03 05 03", "83 01 05 03 23");
    ANSWERED("0D 0D 00 0100", "8D 00 0D 00 0100"); /* behind the last parameter of the device */
}

static void test_bulk_set_without_a_buffer_and_of_nothing(void)
{
    pdcp_device_desc_t small = desc;
    const pdcp_device_record_t record = blank_record(ID);
    small.bulk = NULL;
    small.bulk_capacity = 0;
    TEST_ASSERT_TRUE(pdcp_device_init(&dev, &small, &port, &record, 1, now));
    (void)step();
    TX(BIND, "01 0200 0300 0400");
    rx(TO, "81 10 0200 0300 0400");
    TX(BEACON, "0A");
    ANSWERED("0D 50 03 0100", "8D 00 50 03 0100");
    ANSWERED("0D 50 03 0000", "8D 01 50 03 0000"); /* an empty value has no packets */
    TEST_ASSERT_EQUAL_UINT16(0, gain_len);
    ANSWERED("0D 51 00 0000", "8D 00 51 00 0000");
}

static void test_bulk_set_of_a_value_that_cannot_be(void)
{
    bind_blank();
    ANSWERED("0D 0A 00 0200", "8D 01 0A 00 0200");
    ANSWERED("0E 00 0100", "8E 00"); /* beacon every millisecond */
    ANSWERED("03 0A 00", "83 01 0A 00 F401");
}

static void test_requests_are_answered_during_a_transfer(void)
{
    bind_blank();
    ANSWERED("0D 50 03 0800", "8D 01 50 03 0800");
    ANSWERED("03 09 00", "83 01 09 00 03");
    ANSWERED("0E 00 010203040506", "8E 01");
    ANSWERED("04 04 03 01", "84 01 04 03 01");
    ANSWERED("0E 01 0708", "8E 01");
    TEST_ASSERT_EQUAL_UINT(1, seen.written);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_asks_for_its_last_id_and_is_bound);
    RUN_TEST(test_random_id_is_legal_and_stored_when_granted);
    RUN_TEST(test_random_id_differs_between_attempts_and_devices);
    RUN_TEST(test_answer_must_match_identity_and_requested_id);
    RUN_TEST(test_suggestion_is_asked_for_at_once);
    RUN_TEST(test_endless_suggestions_do_not_fill_the_bus);
    RUN_TEST(test_requests_double_to_eight_seconds_and_spread);
    RUN_TEST(test_after_a_refusal_no_grant_is_taken);
    RUN_TEST(test_refusal_is_no_answer_and_suggestion_starts_the_pauses_afresh);
    RUN_TEST(test_bind_timeout_comes_from_the_description);
    RUN_TEST(test_unbound_device_answers_nothing);
    RUN_TEST(test_unreadable_record_is_taken_as_none);
    RUN_TEST(test_description_that_cannot_be_is_refused);
    RUN_TEST(test_no_seed_stops_the_random_ids);
    RUN_TEST(test_beacons_keep_their_interval);
    RUN_TEST(test_beacon_interval_can_be_changed_within_its_limits);
    RUN_TEST(test_blocked_bus_gathers_one_beacon);
    RUN_TEST(test_answers_that_find_no_room_are_counted);
    RUN_TEST(test_nothing_can_be_taken_out_of_an_empty_queue);
    RUN_TEST(test_device_parameters);
    RUN_TEST(test_input_parameters_after_power_on);
    RUN_TEST(test_output_parameters);
    RUN_TEST(test_source_of_an_input_is_written_and_stored);
    RUN_TEST(test_any_change_of_a_source_is_stored);
    RUN_TEST(test_a_source_cannot_have_id_255);
    RUN_TEST(test_short_values_are_filled_with_zero_and_long_ones_cut);
    RUN_TEST(test_read_only_parameters_stay);
    RUN_TEST(test_times_have_limits);
    RUN_TEST(test_extras_are_read_and_written);
    RUN_TEST(test_a_value_longer_than_its_extra_is_refused);
    RUN_TEST(test_malformed_frames_are_counted_and_not_answered);
    RUN_TEST(test_data_comes_only_from_the_source_of_an_enabled_input);
    RUN_TEST(test_data_of_more_than_8_bytes_is_not_taken);
    RUN_TEST(test_one_output_feeds_two_inputs);
    RUN_TEST(test_output_sends_with_its_node_id_when_enabled);
    RUN_TEST(test_data_leaves_room_for_answers);
    RUN_TEST(test_suspend_for_a_time);
    RUN_TEST(test_suspend_deadline_is_reported);
    RUN_TEST(test_suspend_until_released);
    RUN_TEST(test_suspend_and_release_to_all_are_not_answered);
    RUN_TEST(test_reset_answers_and_binds_anew);
    RUN_TEST(test_reset_drops_what_waits);
    RUN_TEST(test_stored_sources_are_asked_for_until_answered);
    RUN_TEST(test_a_source_is_unconnected_only_as_a_whole);
    RUN_TEST(test_input_that_is_unconnected_meanwhile_is_not_asked_for);
    RUN_TEST(test_every_source_is_asked_for_though_the_queue_is_small);
    RUN_TEST(test_silence_is_among_the_deadlines);
    RUN_TEST(test_silence_stops_streaming_and_makes_inputs_safe);
    RUN_TEST(test_devices_are_no_sign_of_an_arbitrator);
    RUN_TEST(test_answers_while_alone_come_with_the_arbitrator);
    RUN_TEST(test_disabled_terminal_input_becomes_safe);
    RUN_TEST(test_a_device_without_an_application);
    RUN_TEST(test_bulk_get_of_a_descriptor);
    RUN_TEST(test_bulk_get_of_required_inputs_ends_with_a_short_packet);
    RUN_TEST(test_bulk_get_of_short_and_of_missing_values);
    RUN_TEST(test_bulk_get_packet_ids_wrap);
    RUN_TEST(test_bulk_get_repeats_a_packet_without_answer);
    RUN_TEST(test_bulk_get_has_three_tries_for_each_packet);
    RUN_TEST(test_bulk_get_refused_or_started_anew);
    RUN_TEST(test_bulk_set_of_an_extra);
    RUN_TEST(test_bulk_set_of_a_source);
    RUN_TEST(test_bulk_set_repeated_packets_are_stored_once);
    RUN_TEST(test_bulk_set_wrong_packet_fails_until_configured_anew);
    RUN_TEST(test_bulk_set_started_anew_begins_with_packet_0);
    RUN_TEST(test_bulk_set_is_refused_at_configure_time);
    RUN_TEST(test_bulk_set_of_channel_parameters);
    RUN_TEST(test_bulk_set_without_a_buffer_and_of_nothing);
    RUN_TEST(test_bulk_set_of_a_value_that_cannot_be);
    RUN_TEST(test_requests_are_answered_during_a_transfer);
    return UNITY_END();
}
