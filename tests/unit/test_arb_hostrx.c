/* Finding requests in the host's bytes: [API 3.1], D-API-1, D-API-2, D-API-7, D-API-8. */
#include <string.h>

#include "arb_hostrx.h"
#include "unity.h"

#ifdef __AVR__ /* simulated, and slow */
enum { ROUNDS = 50 };
#else
enum { ROUNDS = 10000 };
#endif

static arb_hostrx_t rx;
static arb_hostrx_request_t request;

void setUp(void)
{
    memset(&rx, 0, sizeof rx);
}

void tearDown(void) {}

/* 2201h with reference 07; CRC8 over 01 22 07 00 00 = 96h. */
static const uint8_t info[] = {0xFE, 0x19, 0x01, 0x22, 0x07, 0x96, 0x00, 0x00};
/* 2204h for device 1, reference 08; CRC8 over 04 22 08 03 00 = 03h; CRC16 over 01 = F1D1h. */
static const uint8_t device[] = {0xFE, 0x19, 0x04, 0x22, 0x08, 0x03, 0x03, 0x00, 0x01, 0xD1, 0xF1};

/* Feeds bytes; returns how many requests came, the last of them in request. */
static int feed(const uint8_t *bytes, size_t len, uint32_t now_ms)
{
    int count = 0;
    arb_hostrx_request_t found;
    for (size_t i = 0; i < len; i++) {
        arb_hostrx_put(&rx, now_ms, bytes[i]);
        while (arb_hostrx_next(&rx, &found)) {
            request = found;
            count++;
        }
    }
    return count;
}

static int silence_until(uint32_t now_ms)
{
    int count = 0;
    arb_hostrx_request_t found;
    arb_hostrx_on_time(&rx, now_ms);
    while (arb_hostrx_next(&rx, &found)) {
        request = found;
        count++;
    }
    return count;
}

/* D-API-1: check values over "123456789". */
static void test_check_values(void)
{
    const uint8_t digits[] = "123456789";
    TEST_ASSERT_EQUAL_HEX16(0x29B1, arb_hostcodec_crc16(digits, 9));
    /* CRC8 is taken over header bytes 2, 3, 4, 6, 7 alone; its check value has nine bytes, and the polynomial
     * 07h with initial value 00h makes of 00 00 00 00 01 its own polynomial, of 00 00 00 01 00 that times
     * x^8. */
    const uint8_t one[ARB_HOST_HEADER] = {0xFF, 0xFF, 0, 0, 0, 0xFF, 0, 1};
    TEST_ASSERT_EQUAL_HEX8(0x07, arb_hostcodec_crc8(one));
    const uint8_t two[ARB_HOST_HEADER] = {0xFF, 0xFF, 0, 0, 0, 0xFF, 1, 0};
    TEST_ASSERT_EQUAL_HEX8(0x15, arb_hostcodec_crc8(two));
}

static void test_a_request_without_a_payload(void)
{
    TEST_ASSERT_EQUAL(1, feed(info, sizeof info, 0));
    TEST_ASSERT_EQUAL_HEX16(0x2201, request.id);
    TEST_ASSERT_EQUAL_HEX8(7, request.reference);
    TEST_ASSERT_EQUAL(0, request.len);
    TEST_ASSERT_EQUAL_HEX8(ARB_OK, request.error);
}

static void test_a_request_with_a_payload(void)
{
    TEST_ASSERT_EQUAL(1, feed(device, sizeof device, 0));
    TEST_ASSERT_EQUAL_HEX16(0x2204, request.id);
    TEST_ASSERT_EQUAL(1, request.len);
    TEST_ASSERT_EQUAL_HEX8(1, rx.bytes[8]);
    TEST_ASSERT_EQUAL_HEX8(ARB_OK, request.error);
    TEST_ASSERT_EQUAL(0, rx.counters[ARB_HOSTRX_GARBAGE]);
}

/* D-API-1: as the original, any checksum is handed on, and counted. */
static void test_wrong_checksums_are_seen(void)
{
    uint8_t bytes[sizeof device];
    memcpy(bytes, device, sizeof bytes);
    bytes[5] = 0;
    TEST_ASSERT_EQUAL(1, feed(bytes, sizeof bytes, 0));
    TEST_ASSERT_EQUAL_HEX8(ARB_ERR_CRC, request.error);
    memcpy(bytes, device, sizeof bytes);
    bytes[9] ^= 1;
    TEST_ASSERT_EQUAL(1, feed(bytes, sizeof bytes, 0));
    TEST_ASSERT_EQUAL_HEX8(ARB_ERR_CRC, request.error);
    TEST_ASSERT_EQUAL(1, rx.counters[ARB_HOSTRX_BAD_CRC8S]);
    TEST_ASSERT_EQUAL(1, rx.counters[ARB_HOSTRX_BAD_CRC16S]);
}

/* FE FE 19 must synchronise. */
static void test_garbage_in_front(void)
{
    const uint8_t garbage[] = {0x00, 0x19, 0xFE, 0x00, 0x55, 0xFE};
    TEST_ASSERT_EQUAL(0, feed(garbage, sizeof garbage, 0));
    TEST_ASSERT_EQUAL(1, feed(info, sizeof info, 0));
    TEST_ASSERT_EQUAL(6, rx.counters[ARB_HOSTRX_GARBAGE]);
}

/* A size of 1 or 2 is an error: the hunt goes on from the byte after FE. */
static void test_sizes_that_cannot_be(void)
{
    const uint8_t one[] = {0xFE, 0x19, 0x01, 0x22, 0x07, 0x00, 0x01, 0x00};
    const uint8_t two[] = {0xFE, 0x19, 0x01, 0x22, 0x07, 0x00, 0x02, 0x00};
    const uint8_t huge[] = {0xFE, 0x19, 0x01, 0x22, 0x07, 0x00, 0xFF, 0xFF};
    TEST_ASSERT_EQUAL(0, feed(one, sizeof one, 0));
    TEST_ASSERT_EQUAL(0, feed(two, sizeof two, 0));
    TEST_ASSERT_EQUAL(0, feed(huge, sizeof huge, 0));
    TEST_ASSERT_EQUAL(3, rx.counters[ARB_HOSTRX_BAD_SIZES]);
    TEST_ASSERT_EQUAL(1, feed(info, sizeof info, 0));
}

/* A header inside what looked like a header. */
static void test_a_request_that_begins_inside_a_bad_header(void)
{
    const uint8_t bytes[] = {0xFE, 0x19, 0x01, 0xFE, 0x19, 0x01, 0x22, 0x07, 0x96, 0x00, 0x00};
    TEST_ASSERT_EQUAL(1, feed(bytes, sizeof bytes, 0));
    TEST_ASSERT_EQUAL_HEX16(0x2201, request.id);
}

/* 100 ms without a byte inside a frame drops it; what it had swallowed is looked at again. */
static void test_a_truncated_message_is_given_up(void)
{
    TEST_ASSERT_EQUAL(0, feed(device, 9, 1000));
    TEST_ASSERT_EQUAL(0, silence_until(1099));
    TEST_ASSERT_EQUAL(0, rx.counters[ARB_HOSTRX_GIVEN_UP]);
    TEST_ASSERT_EQUAL(0, silence_until(1100));
    TEST_ASSERT_EQUAL(1, rx.counters[ARB_HOSTRX_GIVEN_UP]);
    TEST_ASSERT_EQUAL(1, feed(device, sizeof device, 1100));
}

/* At every byte: a correct request behind a truncated one is found, at the latest after 100 ms of silence,
 * and once. */
static void test_a_request_behind_a_truncated_one_is_found(void)
{
    uint8_t longer[40] = {0xFE, 0x19, 0x04, 0x23, 0x09, 0x00, 0x1E, 0x00};
    for (size_t cut = 1; cut < sizeof longer - 1; cut++) {
        memset(&rx, 0, sizeof rx);
        int found = feed(longer, cut, 0);
        TEST_ASSERT_EQUAL(cut >= 38 ? 1 : 0, found); /* a whole message is one, whatever its checksums */
        found = feed(info, sizeof info, 10);
        found += silence_until(110);
        TEST_ASSERT_EQUAL(1, found);
        TEST_ASSERT_EQUAL_HEX16(0x2201, request.id);
    }
}

/* D-API-8: in a stream without pauses, too. */
static void test_a_truncated_message_without_a_pause(void)
{
    uint8_t longer[20] = {0xFE, 0x19, 0x04, 0x23, 0x09, 0x00, 0x1E, 0x00};
    TEST_ASSERT_EQUAL(0, feed(longer, sizeof longer, 0));
    int found = 0;
    for (int i = 0; i < 10; i++) {
        found += feed(info, sizeof info, 0);
    }
    TEST_ASSERT_EQUAL(10, found);
}

/* D-API-8: its last bytes may be the beginning of another message, but no more comes: it is a whole one. */
static void test_a_doubtful_message_is_handed_on_after_the_pause(void)
{
    uint8_t bytes[sizeof device];
    memcpy(bytes, device, sizeof bytes);
    bytes[9] = 0xFE;
    bytes[10] = 0x19;
    TEST_ASSERT_EQUAL(0, feed(bytes, sizeof bytes, 1000));
    TEST_ASSERT_EQUAL(0, silence_until(1099));
    TEST_ASSERT_EQUAL(1, silence_until(1100));
    TEST_ASSERT_EQUAL_HEX16(0x2204, request.id);
    TEST_ASSERT_EQUAL_HEX8(ARB_ERR_CRC, request.error);
    TEST_ASSERT_EQUAL(1, rx.counters[ARB_HOSTRX_BAD_CRC16S]);
    TEST_ASSERT_EQUAL(0, rx.counters[ARB_HOSTRX_GIVEN_UP]);
}

/* D-API-7: a set request with a longer value than any is answered, not just dropped. */
static void test_a_value_that_is_too_long(void)
{
    /* 2304h, reference 09, size 8 + 513 + 2 = 020Bh; CRC8 over 04 23 09 0B 02 = D8h. */
    uint8_t bytes[8 + 523] = {0xFE, 0x19, 0x04, 0x23, 0x09, 0xD8, 0x0B, 0x02};
    TEST_ASSERT_EQUAL(1, feed(bytes, sizeof bytes, 0));
    TEST_ASSERT_EQUAL_HEX8(ARB_ERR_SIZE, request.error);
    TEST_ASSERT_EQUAL_HEX8(9, request.reference);
    TEST_ASSERT_EQUAL(1, feed(info, sizeof info, 0));
    TEST_ASSERT_EQUAL_HEX8(ARB_OK, request.error);
}

static void test_the_longest_value(void)
{
    /* size 8 + 512 + 2 = 020Ah */
    uint8_t bytes[8 + 522] = {0xFE, 0x19, 0x04, 0x23, 0x09, 0x00, 0x0A, 0x02};
    TEST_ASSERT_EQUAL(1, feed(bytes, sizeof bytes, 0));
    TEST_ASSERT_EQUAL(520, request.len);
    TEST_ASSERT_EQUAL_HEX8(ARB_ERR_CRC, request.error); /* and not its size */
}

/* Bytes from a fixed generator, a million on a fast machine, with a correct request after every hundred: each
 * is found once its 100 ms are over. */
static void test_nothing_stops_the_receiver(void)
{
    uint32_t random = 12345;
    uint32_t now_ms = 0xFFFF0000u;
    for (int round = 0; round < ROUNDS; round++) {
        for (int i = 0; i < 100; i++) {
            random = random * 1664525u + 1013904223u;
            const uint32_t high = random >> 24;
            const uint8_t byte = high < 16 ? 0xFE : high < 32 ? 0x19 : (uint8_t)(random >> 16);
            (void)feed(&byte, 1, now_ms);
        }
        request.id = 0;
        int found = feed(info, sizeof info, now_ms);
        for (int i = 0; i < 600 && request.id != 0x2201; i++) {
            now_ms += 100;
            found += silence_until(now_ms);
        }
        TEST_ASSERT_EQUAL_HEX16(0x2201, request.id);
        now_ms += 100;
        while (rx.len != 0) {
            (void)silence_until(now_ms);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_check_values);
    RUN_TEST(test_a_request_without_a_payload);
    RUN_TEST(test_a_request_with_a_payload);
    RUN_TEST(test_wrong_checksums_are_seen);
    RUN_TEST(test_garbage_in_front);
    RUN_TEST(test_sizes_that_cannot_be);
    RUN_TEST(test_a_request_that_begins_inside_a_bad_header);
    RUN_TEST(test_a_truncated_message_is_given_up);
    RUN_TEST(test_a_request_behind_a_truncated_one_is_found);
    RUN_TEST(test_a_truncated_message_without_a_pause);
    RUN_TEST(test_a_doubtful_message_is_handed_on_after_the_pause);
    RUN_TEST(test_a_value_that_is_too_long);
    RUN_TEST(test_the_longest_value);
    RUN_TEST(test_nothing_stops_the_receiver);
    return UNITY_END();
}
