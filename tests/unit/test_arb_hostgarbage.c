/* Nothing that a host sends stops the arbitrator (D-API-2): after whatever came, a correct request is
 * answered. Runs with lenient and with strict checksums; the same seed gives the same bytes. */
#include <string.h>

#include "hostlink.h"
#include "pdcp_bytes.h"
#include "unity.h"

#ifdef __AVR__
enum { RANDOM_BYTES = 3000, HEADERS = 60 };
#else
enum { RANDOM_BYTES = 1000000, HEADERS = 20000 };
#endif

static exchange_t x;
static arb_app_t app;
static uint32_t seed;
static uint8_t reference;

void setUp(void)
{
    seed = 2463534242u;
    reference = 0;
    hostlink_start(&x, &app, false);
}

void tearDown(void) {}

static uint32_t chance(uint32_t limit)
{
    seed ^= seed << 13;
    seed ^= seed >> 17;
    seed ^= seed << 5;
    return seed % limit;
}

static void drop_answers(void)
{
    const uint8_t *payload;
    uint16_t len;
    while (hostlink_take(&payload, &len) != 0) {
    }
    hostlink_silence(); /* nothing torn */
}

static void hand_in(const uint8_t *bytes, size_t len)
{
    size_t done = 0;
    while (done < len) { /* answers are read, so it goes on */
        done += arb_app_on_bytes(&app, x.now_ms, &bytes[done], (uint16_t)(len - done));
        exchange_step(&x);
        drop_answers();
    }
}

/* Long enough for every request that the garbage may have contained. */
static void let_it_finish(void)
{
    for (int i = 0; i < 40 && app.api.held_count != 0; i++) {
        exchange_wait(&x, 100);
        (void)exchange_drain(&x);
        drop_answers();
    }
    TEST_ASSERT_EQUAL(0, app.api.held_count);
}

/* A correct request, at once: what came before may be the beginning of a message that it then seems to be
 * part of. It is answered once that is found out, at the latest when the line has been silent for 100 ms. */
static void expect_an_answer(void)
{
    uint8_t request[ARB_HOST_HEADER];
    const uint8_t *payload;
    uint16_t len;
    bool answered = false;
    reference++;
    (void)arb_hostcodec_finish(request, 0x2201, reference, 0);
    size_t done = 0;
    for (int i = 0; i < 50 && !answered; i++) {
        done += arb_app_on_bytes(&app, x.now_ms, &request[done], (uint16_t)(sizeof request - done));
        exchange_step(&x);
        uint16_t id;
        while ((id = hostlink_take(&payload, &len)) != 0) {
            answered = answered || (id == 0x2202 && payload[-4] == reference);
        }
        if (!answered) {
            exchange_wait(&x, 100);
            (void)exchange_drain(&x);
        }
    }
    TEST_ASSERT_TRUE_MESSAGE(answered, "a correct request is not answered");
}

static void random_bytes(bool strict)
{
    uint8_t bytes[200];
    hostlink_start(&x, &app, strict);
    for (uint32_t sent = 0; sent < RANDOM_BYTES;) {
        const size_t len = 1 + chance(sizeof bytes);
        for (size_t i = 0; i < len; i++) {
            static const uint8_t likely[] = {0xFE, 0x19, 0x01, 0x22, 0x23, 0x24, 0x00};
            bytes[i] = chance(3) == 0 ? likely[chance(sizeof likely)] : (uint8_t)chance(256);
        }
        hand_in(bytes, len);
        expect_an_answer();
        sent += (uint32_t)len;
    }
    let_it_finish();
}

static void test_random_bytes(void)
{
    random_bytes(false);
}

static void test_random_bytes_strict(void)
{
    random_bytes(true);
}

/* Requests of every kind with any size and content, right checksums among them. */
static void random_messages(bool strict)
{
    uint8_t bytes[ARB_HOST_HEADER + 64 + ARB_HOST_CRC];
    hostlink_start(&x, &app, strict);
    exchange_add_both(&x);
    for (int n = 0; n < HEADERS; n++) {
        const uint16_t id = (uint16_t)(0x2200u + 0x100u * chance(3) + chance(0x1C));
        const uint16_t len = (uint16_t)chance(65);
        for (uint16_t i = 0; i < len; i++) {
            bytes[ARB_HOST_HEADER + i] = (uint8_t)(chance(2) == 0 ? chance(8) : chance(256));
        }
        if (len >= 6 && chance(2) == 0) { /* a device that there is */
            static const uint8_t dev[] = {2, 0, 2, 0, 4, 0};
            memcpy(&bytes[ARB_HOST_HEADER], dev, sizeof dev);
        }
        uint16_t total = arb_hostcodec_finish(bytes, id, (uint8_t)n, len);
        if (chance(4) == 0) {
            pdcp_bytes_put_u16(&bytes[6], (uint16_t)chance(0x10000));
        }
        if (chance(4) == 0) {
            total = (uint16_t)chance(total + 1u); /* truncated */
        }
        hand_in(bytes, total);
        app.api.events.mask = 0; /* 2416h may have been among them: events are no answers */
        let_it_finish();
        expect_an_answer();
        app.api.events.mask = 0;
        exchange_clear(&x);
    }
}

static void test_random_messages(void)
{
    random_messages(false);
}

static void test_random_messages_strict(void)
{
    random_messages(true);
}

/* A correct message, cut at every byte, at once followed by a correct request. */
static void test_truncated_messages(void)
{
    uint8_t bytes[ARB_HOST_HEADER + 15 + ARB_HOST_CRC];
    static const uint8_t payload[15] = {2, 0, 2, 0, 4, 0, 3, 0xFE, 0x19, 0x01};
    for (uint8_t strict = 0; strict < 2; strict++) {
        for (size_t cut = 0; cut <= sizeof bytes; cut++) {
            hostlink_start(&x, &app, strict != 0);
            memcpy(&bytes[ARB_HOST_HEADER], payload, sizeof payload);
            (void)arb_hostcodec_finish(bytes, 0x230A, 1, sizeof payload);
            hand_in(bytes, cut);
            expect_an_answer();
            let_it_finish();
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_random_bytes);
    RUN_TEST(test_random_bytes_strict);
    RUN_TEST(test_random_messages);
    RUN_TEST(test_random_messages_strict);
    RUN_TEST(test_truncated_messages);
    return UNITY_END();
}
