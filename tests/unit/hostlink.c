#include "hostlink.h"

#include <stdlib.h>
#include <string.h>

#include "unity.h"

#ifdef __AVR__
enum { OUT_MAX = 640 };
#else
enum { OUT_MAX = 4096 };
#endif

/* The memory: only pages that were written take room, since a small machine holds this, too. */
enum { PAGES = 6 };

static struct {
    uint16_t address;
    uint8_t bytes[ARB_PORT_NVM_PAGE];
} pages[PAGES];
static uint8_t page_count;
static bool memory_works;
static uint8_t out[OUT_MAX]; /* what the host has not looked at yet */
static size_t out_len;
static size_t taken; /* of the message that was taken last */
static size_t room;

static bool can_send(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    (void)frame;
    return false; /* exchange.c takes them from the queue */
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    (void)ctx;
    const size_t count = size < room ? size : room;
    TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(OUT_MAX, out_len + count, "the host has not looked for too long");
    memcpy(&out[out_len], bytes, count);
    out_len += count;
    room -= count;
    return count;
}

/* The page that holds this address; NULL: it was never written. */
static uint8_t *page_of(uint16_t address)
{
    for (uint8_t i = 0; i < page_count; i++) {
        if (pages[i].address == address - address % ARB_PORT_NVM_PAGE) {
            return pages[i].bytes;
        }
    }
    return NULL;
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    for (uint16_t i = 0; i < size; i++) {
        const uint16_t at = (uint16_t)(address + i);
        const uint8_t *page = page_of(at);
        bytes[i] = page != NULL ? page[at % ARB_PORT_NVM_PAGE] : 0xFF;
    }
    return true;
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    if (!memory_works) {
        return false;
    }
    if (page_of(address) == NULL) {
        TEST_ASSERT_LESS_THAN_MESSAGE(PAGES, page_count, "this memory is too small for the test");
        pages[page_count].address = (uint16_t)(address - address % ARB_PORT_NVM_PAGE);
        memset(pages[page_count].bytes, 0xFF, sizeof pages[0].bytes);
        page_count++;
    }
    memcpy(&page_of(address)[address % ARB_PORT_NVM_PAGE], bytes, size);
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

void hostlink_start(exchange_t *x, arb_app_t *app, bool strict)
{
    const arb_settings_t settings = {
        .serial = EXCHANGE_SERIAL, .seed = EXCHANGE_SEED, .strict_crc = strict, .no_autoconfig = true};
    page_count = 0;
    memory_works = true;
    out_len = 0;
    taken = 0;
    room = SIZE_MAX;
    exchange_start_app(x, app, &port, &settings, 0xFFFFFF00u);
}

void hostlink_room(size_t bytes)
{
    room = bytes;
}

size_t hostlink_room_left(void)
{
    return room;
}

void hostlink_memory_works(bool works)
{
    memory_works = works;
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
    out_len -= taken;
    memmove(out, &out[taken], out_len);
    taken = 0;
}

void hostlink_expect(const char *text)
{
    uint8_t bytes[64];
    const size_t len = parse(text, bytes, sizeof bytes);
    drop_taken();
    TEST_ASSERT_GREATER_OR_EQUAL_MESSAGE(len, out_len, text);
    TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(bytes, out, len, text);
    taken = len;
}

uint16_t hostlink_take(const uint8_t **payload, uint16_t *len)
{
    drop_taken();
    if (out_len < 8 || out_len < 8u + (size_t)(out[6] | out[7] << 8)) {
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

size_t hostlink_waiting(void)
{
    return out_len - taken;
}

void hostlink_silence(void)
{
    drop_taken();
    TEST_ASSERT_EQUAL_MESSAGE(0, out_len, "the host has got something");
}
