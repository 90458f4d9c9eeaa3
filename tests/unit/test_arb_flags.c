/* The stored flags of 2404h (host-api.md 3) and what one memory's users owe each other. */
#include <string.h>

#include "arb_crc.h"
#include "arb_flags.h"
#include "fake_port.h"
#include "unity.h"

static uint8_t memory[2 * 64];
static const fake_region_t region = {ARB_NVM_FLAGS_AT, sizeof memory, memory};
static fake_port_t fake;
static arb_nvm_t nvm;
static arb_flags_t flags;
static uint32_t now_ms;

static void power_on(void)
{
    fake_port_power_on(&fake);
    arb_nvm_init(&nvm, &fake.port);
    arb_flags_load(&flags, &nvm);
}

void setUp(void)
{
    fake_port_init(&fake, &region, 1);
    fake.write_polls = 2;
    now_ms = 0xFFFFFFF0u;
    power_on();
}

void tearDown(void) {}

static bool idle(void)
{
    return arb_flags_next_ms(&flags, now_ms) == now_ms + 0x3FFFFFFFu;
}

static void run(void)
{
    for (int i = 0; !idle(); i++) {
        TEST_ASSERT_LESS_THAN(100, i);
        now_ms = arb_flags_next_ms(&flags, now_ms);
        arb_flags_step(&flags, &nvm, now_ms);
    }
    TEST_ASSERT_EQUAL(ARB_NVM_NOBODY, nvm.owner);
}

static void set(uint8_t value)
{
    arb_flags_set(&flags, value, now_ms);
    run();
}

static void test_from_the_factory(void)
{
    TEST_ASSERT_EQUAL_HEX8(0x03, arb_flags_get(&flags));
    TEST_ASSERT_TRUE(idle());
    set(0x03);
    TEST_ASSERT_EQUAL(0, fake.writes);
}

/* The bytes of the table in arb_flags.h; the CRC-32 computed apart. */
static void test_the_stored_bytes(void)
{
    static const uint8_t record[] = {'P', 'F', 1, 1, 1, 0, 0x06, 0x6F, 0x5E, 0xC5, 0x0A};
    set(0xF6); /* the upper bits are not stored */
    TEST_ASSERT_EQUAL_HEX8(0x06, arb_flags_get(&flags));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(record, memory, sizeof record);
    TEST_ASSERT_EACH_EQUAL_HEX8(0xFF, &memory[64], 64);
}

static void test_all_values_survive_and_the_pages_take_turns(void)
{
    for (uint8_t value = 0; value < 16; value++) {
        set(value);
        TEST_ASSERT_EQUAL(value + 1, fake.writes);
        TEST_ASSERT_EQUAL(value % 2, flags.newest.area);
        power_on();
        TEST_ASSERT_EQUAL_HEX8(value, arb_flags_get(&flags));
        TEST_ASSERT_EQUAL(0, flags.damaged);
        set(value);
        TEST_ASSERT_EQUAL(value + 1, fake.writes);
    }
}

static void test_the_number_of_writes_wraps(void)
{
    set(0x01);
    flags.newest.sequence = 0xFFFE;
    set(0x02);
    set(0x04);
    set(0x08);
    power_on();
    TEST_ASSERT_EQUAL_HEX8(0x08, arb_flags_get(&flags));
    TEST_ASSERT_EQUAL(1, flags.newest.sequence);
}

static void test_there_and_back_before_it_is_written_writes_nothing(void)
{
    arb_flags_set(&flags, 0x00, now_ms);
    TEST_ASSERT_FALSE(idle());
    set(0x03);
    TEST_ASSERT_EQUAL(0, fake.writes);
}

static void test_a_change_while_the_page_is_under_way(void)
{
    arb_flags_set(&flags, 0x01, now_ms);
    arb_flags_step(&flags, &nvm, now_ms);
    TEST_ASSERT_EQUAL(1, fake.writes);
    set(0x02);
    TEST_ASSERT_EQUAL(2, fake.writes);
    power_on();
    TEST_ASSERT_EQUAL_HEX8(0x02, arb_flags_get(&flags));
    arb_flags_set(&flags, 0x01, now_ms);
    arb_flags_step(&flags, &nvm, now_ms);
    set(0x02); /* back to what was there before the page under way */
    power_on();
    TEST_ASSERT_EQUAL_HEX8(0x02, arb_flags_get(&flags));
}

static void test_a_failing_write_is_repeated(void)
{
    set(0x01);
    fake.fails = true;
    arb_flags_set(&flags, 0x02, now_ms);
    for (int i = 0; i < 4; i++) {
        now_ms = arb_flags_next_ms(&flags, now_ms);
        arb_flags_step(&flags, &nvm, now_ms);
    }
    TEST_ASSERT_EQUAL(1, flags.failures);
    TEST_ASSERT_EQUAL(now_ms + 500, arb_flags_next_ms(&flags, now_ms));
    TEST_ASSERT_EQUAL(ARB_NVM_NOBODY, nvm.owner);
    fake.fails = false;
    fake.refuses = true;
    now_ms = arb_flags_next_ms(&flags, now_ms);
    arb_flags_step(&flags, &nvm, now_ms);
    TEST_ASSERT_EQUAL(2, flags.failures);
    fake.refuses = false;
    run();
    power_on();
    TEST_ASSERT_EQUAL_HEX8(0x02, arb_flags_get(&flags));
}

/* Power fails at every byte of a write: the old or the new flags. */
static void test_power_cuts(void)
{
    for (uint16_t at = 0; at <= 11; at++) {
        setUp();
        set(0x01);
        set(0x02);
        fake.whole_writes = 0;
        fake.cut_bytes = at;
        set(0x04);
        power_on();
        TEST_ASSERT_EQUAL_HEX8(at == 11 ? 0x04 : 0x02, arb_flags_get(&flags));
        set(0x08);
        power_on();
        TEST_ASSERT_EQUAL_HEX8(0x08, arb_flags_get(&flags));
        TEST_ASSERT_EQUAL(0, flags.damaged);
    }
}

static void test_bit_rot(void)
{
    for (int bit = 0; bit < 11 * 8; bit++) {
        for (int page = 0; page < 2; page++) {
            setUp();
            set(0x01);
            set(0x02);
            memory[64 * page + bit / 8] ^= (uint8_t)(1 << bit % 8);
            power_on();
            TEST_ASSERT_EQUAL_HEX8(page == 0 ? 0x02 : 0x01, arb_flags_get(&flags));
            TEST_ASSERT_EQUAL(1, flags.damaged);
        }
    }
}

/* A later version stores more settings behind the flags. */
static void test_a_longer_record_is_read(void)
{
    uint8_t record[64] = {'P', 'F', 1, 54, 1, 0, 0x0C};
    const uint32_t crc = ~arb_crc32(ARB_CRC32_INIT, record, 60);
    for (uint8_t i = 0; i < 4; i++) {
        record[60 + i] = (uint8_t)((crc >> (8u * i)) & 0xFFu);
    }
    memcpy(memory, record, sizeof record);
    power_on();
    TEST_ASSERT_EQUAL_HEX8(0x0C, arb_flags_get(&flags));
    record[3] = 55; /* beyond the page */
    memcpy(memory, record, sizeof record);
    power_on();
    TEST_ASSERT_EQUAL_HEX8(0x03, arb_flags_get(&flags));
    TEST_ASSERT_EQUAL(1, flags.damaged);
}

static void test_another_owner_is_waited_for(void)
{
    (void)arb_nvm_take(&nvm, ARB_NVM_CONFIG);
    arb_flags_set(&flags, 0x01, now_ms);
    for (int i = 0; i < 300; i++) {
        now_ms = arb_flags_next_ms(&flags, now_ms);
        arb_flags_step(&flags, &nvm, now_ms);
    }
    TEST_ASSERT_EQUAL(0, fake.writes);
    arb_nvm_give(&nvm, ARB_NVM_FLAGS); /* not its own */
    TEST_ASSERT_EQUAL(ARB_NVM_CONFIG, nvm.owner);
    arb_nvm_give(&nvm, ARB_NVM_CONFIG);
    run();
    TEST_ASSERT_EQUAL(1, fake.writes);
}

/* Set and set back while another one's page is being written: whoever waits for the memory gets it. */
static void test_there_and_back_while_the_memory_is_not_ready_gives_it_up(void)
{
    fake.polls_left = 1;
    arb_flags_set(&flags, 0x01, now_ms);
    arb_flags_step(&flags, &nvm, now_ms);
    arb_flags_set(&flags, ARB_FLAGS_FACTORY, now_ms);
    TEST_ASSERT_TRUE(idle());
    arb_flags_step(&flags, &nvm, now_ms);
    TEST_ASSERT_TRUE(arb_nvm_take(&nvm, ARB_NVM_STORE));
    TEST_ASSERT_EQUAL(0, fake.writes);
}

/* The usual check value of CRC-32. */
static void test_crc32(void)
{
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, ~arb_crc32(ARB_CRC32_INIT, (const uint8_t *)"123456789", 9));
    TEST_ASSERT_EQUAL_HEX32(ARB_CRC32_RESIDUE,
                            arb_crc32(ARB_CRC32_INIT, (const uint8_t *)"123456789\x26\x39\xF4\xCB", 13));
}

static void test_the_state_is_small(void)
{
    TEST_ASSERT_LESS_OR_EQUAL(sizeof(void *) == 2 ? 15 : 32, sizeof(arb_flags_t) + sizeof(arb_nvm_t));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_from_the_factory);
    RUN_TEST(test_the_stored_bytes);
    RUN_TEST(test_all_values_survive_and_the_pages_take_turns);
    RUN_TEST(test_the_number_of_writes_wraps);
    RUN_TEST(test_there_and_back_before_it_is_written_writes_nothing);
    RUN_TEST(test_a_change_while_the_page_is_under_way);
    RUN_TEST(test_a_failing_write_is_repeated);
    RUN_TEST(test_power_cuts);
    RUN_TEST(test_bit_rot);
    RUN_TEST(test_a_longer_record_is_read);
    RUN_TEST(test_another_owner_is_waited_for);
    RUN_TEST(test_there_and_back_while_the_memory_is_not_ready_gives_it_up);
    RUN_TEST(test_crc32);
    RUN_TEST(test_the_state_is_small);
    return UNITY_END();
}
