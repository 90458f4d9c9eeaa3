/* Type words and the bytes of values, against profile-layer.md 2 and the words printed in [PROFILE] appendix
 * D. */
#include "profile_type.h"
#include "unity.h"

void setUp(void) {}

void tearDown(void) {}

static void check_word(uint16_t word, uint8_t size, uint8_t data, uint8_t control, bool sole, bool terminal,
                       uint8_t prescaler)
{
    profile_type_t type;
    TEST_ASSERT_TRUE(profile_type_decode(word, &type));
    TEST_ASSERT_EQUAL_UINT8(size, type.size);
    TEST_ASSERT_EQUAL_UINT8(data, type.data);
    TEST_ASSERT_EQUAL_UINT8(control, type.control);
    TEST_ASSERT_EQUAL(sole, type.sole_access);
    TEST_ASSERT_EQUAL(terminal, type.terminal);
    TEST_ASSERT_EQUAL_UINT8(prescaler, type.prescaler);
    TEST_ASSERT_EQUAL_HEX16(word, profile_type_encode(&type));
}

/* D-PRO-1: bit 0 is the most significant. */
static void test_words_of_appendix_d(void)
{
    check_word(0x5300, PROFILE_SIZE_8, PROFILE_UNSIGNED, PROFILE_POSITION, true, true, 0);
    check_word(0x5200, PROFILE_SIZE_8, PROFILE_UNSIGNED, PROFILE_POSITION, true, false, 0);
    check_word(0x5000, PROFILE_SIZE_8, PROFILE_UNSIGNED, PROFILE_POSITION, false, false, 0);
    check_word(0x7300, PROFILE_SIZE_8, PROFILE_BOOLEAN, PROFILE_POSITION, true, true, 0);
    check_word(0x7200, PROFILE_SIZE_8, PROFILE_BOOLEAN, PROFILE_POSITION, true, false, 0);
    check_word(0x7000, PROFILE_SIZE_8, PROFILE_BOOLEAN, PROFILE_POSITION, false, false, 0);
}

static void test_every_field_has_its_bits(void)
{
    check_word(0x0000, PROFILE_SIZE_4, PROFILE_SIGNED, PROFILE_POSITION, false, false, 0);
    check_word(0x8000, PROFILE_SIZE_12, PROFILE_SIGNED, PROFILE_POSITION, false, false, 0);
    check_word(0xC000, PROFILE_SIZE_16, PROFILE_SIGNED, PROFILE_POSITION, false, false, 0);
    check_word(0xE000, PROFILE_SIZE_16, PROFILE_FLOAT, PROFILE_POSITION, false, false, 0);
    check_word(0x4400, PROFILE_SIZE_8, PROFILE_SIGNED, PROFILE_VELOCITY, false, false, 0);
    check_word(0x4800, PROFILE_SIZE_8, PROFILE_SIGNED, PROFILE_ACCELERATION, false, false, 0);
    check_word(0x4C00, PROFILE_SIZE_8, PROFILE_SIGNED, PROFILE_OTHER, false, false, 0);
    check_word(0x4020, PROFILE_SIZE_8, PROFILE_SIGNED, PROFILE_POSITION, false, false, 1); /* D-PRO-8 */
    check_word(0x40E0, PROFILE_SIZE_8, PROFILE_SIGNED, PROFILE_POSITION, false, false, 7);
}

static void test_unused_bits_are_ignored(void)
{
    profile_type_t type;
    TEST_ASSERT_TRUE(profile_type_decode(0x531F, &type));
    TEST_ASSERT_EQUAL_HEX16(0x5300, profile_type_encode(&type));
}

/* D-PRO-2. */
static void test_float_has_16_bits(void)
{
    profile_type_t type;
    TEST_ASSERT_FALSE(profile_type_decode(0x2000, &type));
    TEST_ASSERT_FALSE(profile_type_decode(0x6000, &type));
    TEST_ASSERT_FALSE(profile_type_decode(0xA000, &type));
    TEST_ASSERT_TRUE(profile_type_decode(0xE000, &type));
}

static profile_type_t type_of(uint16_t word)
{
    profile_type_t type;
    TEST_ASSERT_TRUE(profile_type_decode(word, &type));
    return type;
}

static void check_put(uint16_t word, int32_t value, uint8_t len, uint8_t low, uint8_t high)
{
    const profile_type_t type = type_of(word);
    uint8_t bytes[2] = {0xEE, 0xEE};
    TEST_ASSERT_EQUAL_UINT8(len, profile_type_put(&type, value, bytes));
    TEST_ASSERT_EQUAL_UINT8(len, profile_type_bytes(&type));
    TEST_ASSERT_EQUAL_HEX8(low, bytes[0]);
    if (len == 2) {
        TEST_ASSERT_EQUAL_HEX8(high, bytes[1]);
    }
}

static void test_values_on_the_wire(void)
{
    check_put(0x0000, -8, 1, 0x08, 0); /* 4 bits, signed */
    check_put(0x0000, 7, 1, 0x07, 0);
    check_put(0x0000, -1, 1, 0x0F, 0);
    check_put(0x1000, 15, 1, 0x0F, 0); /* 4 bits, unsigned */
    check_put(0x4000, -1, 1, 0xFF, 0); /* 8 bits, signed */
    check_put(0x5000, 200, 1, 0xC8, 0);
    check_put(0x8000, -2, 2, 0xFE, 0x0F);   /* 12 bits, signed */
    check_put(0x9000, 0xABC, 2, 0xBC, 0xA); /* 12 bits, unsigned: least significant byte first */
    check_put(0xC000, -2, 2, 0xFE, 0xFF);
    check_put(0xD000, 0x1234, 2, 0x34, 0x12);
    check_put(0x7000, 5, 1, 0x01, 0); /* boolean */
    check_put(0x7000, 0, 1, 0x00, 0);
    check_put(0xF000, -1, 2, 0x01, 0x00);
}

static void test_values_are_clamped(void)
{
    check_put(0x0000, 8, 1, 0x07, 0);
    check_put(0x0000, -9, 1, 0x08, 0);
    check_put(0x5000, 256, 1, 0xFF, 0);
    check_put(0x5000, -1, 1, 0x00, 0);
    check_put(0x4000, 128, 1, 0x7F, 0);
    check_put(0x8000, 2048, 2, 0xFF, 0x07);
    check_put(0xD000, INT32_MAX, 2, 0xFF, 0xFF);
    check_put(0xC000, INT32_MIN, 2, 0x00, 0x80);
}

static void check_get(uint16_t word, uint8_t low, uint8_t high, uint8_t len, int32_t want)
{
    const profile_type_t type = type_of(word);
    const uint8_t bytes[3] = {low, high, 0x77};
    int32_t value = 12345678;
    TEST_ASSERT_TRUE(profile_type_get(&type, bytes, len, &value));
    TEST_ASSERT_EQUAL_INT32(want, value);
}

static void test_values_from_the_wire(void)
{
    check_get(0x0000, 0x08, 0, 1, -8);
    check_get(0x0000, 0xF7, 0, 1, 7); /* unused upper bits are ignored */
    check_get(0x1000, 0xFF, 0, 1, 15);
    check_get(0x4000, 0x80, 0, 1, -128);
    check_get(0x5000, 0xF4, 0, 1, 244);
    check_get(0x8000, 0xFE, 0x0F, 2, -2);
    check_get(0x9000, 0xBC, 0xFA, 2, 0xABC);
    check_get(0xC000, 0x00, 0x80, 2, -32768);
    check_get(0xD000, 0x34, 0x12, 2, 0x1234);
    check_get(0x7000, 0x40, 0, 1, 1);
    check_get(0x7000, 0x00, 0, 1, 0);
    check_get(0xD000, 0x34, 0x12, 1, 0x34);   /* missing bytes are 0 */
    check_get(0xD000, 0x34, 0x12, 3, 0x1234); /* extra ones are ignored */
    check_get(0xD000, 0x34, 0x12, 0, 0);
}

static void test_floats_have_no_range(void)
{
    const profile_type_t type = type_of(0xE000);
    uint8_t bytes[2] = {1, 2};
    int32_t value = 0;
    TEST_ASSERT_FALSE(profile_type_range(&type, &value, &value));
    TEST_ASSERT_EQUAL_UINT8(0, profile_type_put(&type, 1, bytes));
    TEST_ASSERT_FALSE(profile_type_get(&type, bytes, 2, &value));
    TEST_ASSERT_EQUAL_HEX8(1, bytes[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_words_of_appendix_d);
    RUN_TEST(test_every_field_has_its_bits);
    RUN_TEST(test_unused_bits_are_ignored);
    RUN_TEST(test_float_has_16_bits);
    RUN_TEST(test_values_on_the_wire);
    RUN_TEST(test_values_are_clamped);
    RUN_TEST(test_values_from_the_wire);
    RUN_TEST(test_floats_have_no_range);
    return UNITY_END();
}
