/* What the application keeps over a power cycle: identities and their node ids (D-BUS-6). */
#include <string.h>

#include "arb_app.h"
#include "exchange.h"
#include "fake_port.h"
#include "unity.h"

static exchange_t x;
static arb_app_t app;

/* Of each area only the beginning is kept: no test writes more, and a small machine holds two of these. */
enum { KEPT = 256 };

static uint8_t memory[ARB_AREAS * KEPT];
static const fake_region_t regions[ARB_AREAS] = {{0, KEPT, memory}, {ARB_STORE_AREA, KEPT, &memory[KEPT]}};
static fake_port_t fake;

static void start(void)
{
    const arb_settings_t settings = {.seed = EXCHANGE_SEED, .no_autoconfig = true};
    exchange_start_app(&x, &app, &fake.port, &settings, 0xFFFFFF00u);
}

void setUp(void)
{
    fake_port_init(&fake, regions, ARB_AREAS);
    start();
}

void tearDown(void) {}

/* D-BUS-6: also after a power cycle. */
static void test_identities_outlive_a_power_cycle(void)
{
    exchange_add_both(&x);
    exchange_pass(&x, 600);
    TEST_ASSERT_FALSE(app.store.changed);
    start();
    TEST_ASSERT_EQUAL(2, app.arb.bus.bind.remembered_count);
    exchange_rx(&x, "655#01 0200 0200 0400");
    exchange_tx(&x, "355#81 11 0200 0200 0400");
}

static void test_unchanged_identities_are_not_written_again(void)
{
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 600);
    start();
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
    for (size_t cut = 0; cut <= ARB_AREA_HEADER + 2 * ARB_STORE_ENTRY + ARB_AREA_CRC; cut++) {
        memcpy(memory, before, sizeof memory);
        fake_port_power_on(&fake);
        start();
        exchange_add_input(&x);
        fake.whole_writes = 0;
        fake.cut_bytes = (uint16_t)cut;
        exchange_pass(&x, 600);
        start();
        const uint8_t count = app.arb.bus.bind.remembered_count;
        TEST_ASSERT_TRUE(count == 1 || count == 2);
        TEST_ASSERT_EQUAL_HEX8(0x11, app.arb.bus.bind.remembered[count - 1].node_id);
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
    exchange_pass(&x, 10600); /* the next write comes 10 s later (D-BUS-43) */
    uint8_t good[sizeof memory];
    memcpy(good, memory, sizeof memory);
    for (unsigned area = 0; area < ARB_AREAS; area++) {
        for (unsigned byte = 2; byte < 17; byte++) {
            memcpy(memory, good, sizeof memory);
            memory[area * KEPT + byte] ^= 0x10;
            start();
            TEST_ASSERT_EQUAL(1, app.store.damaged);
            TEST_ASSERT_GREATER_OR_EQUAL(1, app.arb.bus.bind.remembered_count);
        }
    }
}

/* D-BUS-43: what changes is stored together, at most once in 10 s: a flood wears no memory. */
static void test_identities_are_written_once_in_10_s(void)
{
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 600);
    TEST_ASSERT_FALSE(app.store.changed);
    const uint16_t first = app.store.newest.sequence;
    exchange_add_input(&x);
    exchange_pass(&x, 9800);
    TEST_ASSERT_TRUE(app.store.changed);
    TEST_ASSERT_EQUAL(first, app.store.newest.sequence);
    exchange_pass(&x, 800);
    TEST_ASSERT_FALSE(app.store.changed);
    TEST_ASSERT_EQUAL(first + 1, app.store.newest.sequence);
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
        TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&app.arb.bus.bind, &entry));
    }
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 506); /* 500 ms, then a page each 5 ms */
    exchange_rx(&x, "660#01 0700 0700 6400");
    exchange_pass(&x, 400);
    TEST_ASSERT_FALSE(app.store.changed);
    start();
    TEST_ASSERT_EQUAL(0, app.store.damaged);
    TEST_ASSERT_EQUAL(25, app.arb.bus.bind.remembered_count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_identities_outlive_a_power_cycle);
    RUN_TEST(test_unchanged_identities_are_not_written_again);
    RUN_TEST(test_power_may_fail_at_any_byte);
    RUN_TEST(test_a_damaged_copy_is_seen_and_not_used);
    RUN_TEST(test_identities_are_written_once_in_10_s);
    RUN_TEST(test_the_stored_bytes);
    RUN_TEST(test_a_bind_between_two_pages);
    return UNITY_END();
}
