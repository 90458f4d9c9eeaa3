#include "hostlink.h"

#include <stdlib.h>
#include <string.h>

#include "fake_port.h"
#include "unity.h"

#ifdef __AVR__
enum { OUT_MAX = 640 };
#else
enum { OUT_MAX = 4096 };
#endif

/* What these tests store: identities, flags, and short configurations. */
static uint8_t identities[2][32];
static uint8_t flag_pages[2][16];
static uint8_t headers[2][16]; /* of configuration strings */
static uint8_t strings[2][2 * ARB_PORT_NVM_PAGE];
enum { FIRST = ARB_NVM_CONFIG_AT, SECOND = ARB_NVM_CONFIG_AT + ARB_CONFIG_AREA };
static const fake_region_t regions[] = {
    {0, sizeof identities[0], identities[0]},
    {ARB_STORE_AREA, sizeof identities[1], identities[1]},
    {ARB_NVM_FLAGS_AT, sizeof flag_pages[0], flag_pages[0]},
    {ARB_NVM_FLAGS_AT + ARB_PORT_NVM_PAGE, sizeof flag_pages[1], flag_pages[1]},
    {FIRST, sizeof headers[0], headers[0]},
    {FIRST + ARB_PORT_NVM_PAGE, sizeof strings[0], strings[0]},
    {SECOND, sizeof headers[1], headers[1]},
    {SECOND + ARB_PORT_NVM_PAGE, sizeof strings[1], strings[1]},
};

static fake_port_t fake;
static exchange_t *started;
static uint8_t out[OUT_MAX]; /* what the host has not looked at yet */
static size_t taken;         /* of the message that was taken last */

void hostlink_start(exchange_t *x, arb_app_t *app, bool strict)
{
    const arb_settings_t settings = {
        .serial = EXCHANGE_SERIAL, .seed = EXCHANGE_SEED, .strict_crc = strict, .no_autoconfig = true};
    fake_port_init(&fake, regions, sizeof regions / sizeof regions[0]);
    fake.out = out;
    fake.out_max = sizeof out;
    taken = 0;
    started = x;
    exchange_start_app(x, app, &fake.port, &settings, 0xFFFFFF00u);
}

void hostlink_room(size_t bytes)
{
    fake.room = bytes;
}

size_t hostlink_room_left(void)
{
    return fake.room;
}

void hostlink_memory_works(bool works)
{
    fake.refuses = !works;
}

void hostlink_bytes(exchange_t *x, const uint8_t *bytes, size_t len)
{
    TEST_ASSERT_EQUAL(len, arb_app_on_bytes(x->app, x->now_ms, bytes, (uint16_t)len));
    exchange_step(x);
}

static size_t parse(const char *text, uint8_t *bytes, size_t size)
{
    size_t len = 0;
    while (*text != '\0') {
        if (*text == ' ') {
            text++;
            continue;
        }
        const char byte[3] = {text[0], text[1], '\0'};
        TEST_ASSERT_LESS_THAN(size, len);
        bytes[len++] = (uint8_t)strtoul(byte, NULL, 16);
        text += 2;
    }
    return len;
}

void hostlink_send(exchange_t *x, const char *text)
{
    uint8_t bytes[64];
    hostlink_bytes(x, bytes, parse(text, bytes, sizeof bytes));
}

void hostlink_ask(exchange_t *x, uint16_t id, uint8_t reference, const uint8_t *payload, uint16_t len)
{
    uint8_t bytes[ARB_HOST_HEADER + ARB_HOST_REQUEST_MAX + ARB_HOST_CRC];
    if (len != 0) {
        memcpy(&bytes[ARB_HOST_HEADER], payload, len);
    }
    hostlink_bytes(x, bytes, arb_hostcodec_finish(bytes, id, reference, len));
}

static void drop_taken(void)
{
    fake.out_len -= taken;
    memmove(out, &out[taken], fake.out_len);
    taken = 0;
}

void hostlink_expect(const char *text)
{
    uint8_t bytes[64];
    const size_t len = parse(text, bytes, sizeof bytes);
    drop_taken();
    TEST_ASSERT_GREATER_OR_EQUAL_MESSAGE(len, fake.out_len, text);
    TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(bytes, out, len, text);
    taken = len;
}

uint16_t hostlink_take(const uint8_t **payload, uint16_t *len)
{
    drop_taken();
    if (fake.out_len < 8 || fake.out_len < 8u + (size_t)(out[6] | out[7] << 8)) {
        return 0;
    }
    const uint16_t size = (uint16_t)(out[6] | out[7] << 8);
    TEST_ASSERT_EQUAL_HEX8(0xFE, out[0]);
    TEST_ASSERT_EQUAL_HEX8(0x19, out[1]);
    TEST_ASSERT_EQUAL_HEX8(arb_hostcodec_crc8(out), out[5]);
    *payload = &out[8];
    *len = size != 0 ? (uint16_t)(size - 2) : 0;
    if (size != 0) {
        TEST_ASSERT_EQUAL_HEX16(arb_hostcodec_crc16(*payload, *len), out[8 + *len] | out[9 + *len] << 8);
    }
    taken = 8u + size;
    return (uint16_t)(out[2] | out[3] << 8);
}

void hostlink_answer(uint16_t id, uint8_t reference, const uint8_t *payload, uint16_t len)
{
    const uint8_t *have = NULL;
    uint16_t have_len = 0;
    TEST_ASSERT_EQUAL_HEX16(id, hostlink_take(&have, &have_len));
    TEST_ASSERT_EQUAL_HEX8(reference, out[4]);
    TEST_ASSERT_EQUAL(len, have_len);
    if (len != 0) {
        TEST_ASSERT_EQUAL_HEX8_ARRAY(payload, have, len);
    }
}

void hostlink_request(uint16_t id, const uint8_t *payload, uint16_t len)
{
    hostlink_ask(started, id, 1, payload, len);
}

void hostlink_reply(uint16_t id, const uint8_t *payload, uint16_t len)
{
    hostlink_answer(id, 1, payload, len);
}

void hostlink_error(uint16_t id, uint8_t error)
{
    hostlink_answer(id, 1, &error, 1);
}

size_t hostlink_waiting(void)
{
    return fake.out_len - taken;
}

void hostlink_silence(void)
{
    drop_taken();
    TEST_ASSERT_EQUAL_MESSAGE(0, fake.out_len, "the host has got something");
}
