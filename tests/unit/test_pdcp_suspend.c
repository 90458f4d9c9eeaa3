/* D-BUS-40: a Suspend of somebody else gets Release, unless the host has suspended that device. Hand-written
 * frames. */
#include "exchange.h"
#include "unity.h"

static exchange_t x;

/* Devices 0002:0002:0004 id 11h and 0002:0002:0006 id 12h. */
void setUp(void)
{
    exchange_start_limb(&x);
}

void tearDown(void) {}

/* Somebody else suspends: Release follows 10 ms later. */
static void expect_release(const char *suspend)
{
    exchange_rx(&x, suspend);
    exchange_pass(&x, 9);
    exchange_silence(&x);
    exchange_pass(&x, 1);
    exchange_tx(&x, "311#09");
    exchange_rx(&x, "211#89 01");
    exchange_pass(&x, 100);
    exchange_silence(&x);
}

static void expect_none(const char *suspend)
{
    exchange_rx(&x, suspend);
    exchange_pass(&x, 100);
    exchange_silence(&x);
}

/* With any priority, for any time. */
static void test_a_device_is_released(void)
{
    expect_release("311#08 0000");
    expect_release("111#08 E803");
    expect_release("511#08 0100");
}

/* Binding's priority is not used in the name of an arbitrator, other sizes are no Suspend, nobody has this
 * id, and that of an output is no device's. */
static void test_what_is_no_suspend(void)
{
    expect_none("711#08 0000");
    expect_none("311#08");
    expect_none("311#08 0000 00");
    expect_none("311#09 0000");
    expect_none("313#08 0000");
    expect_none("3FE#08 0000");
    expect_none("211#08 0000"); /* from the device */
}

/* Many of them lead to one Release each 10 ms. */
static void test_a_flood_of_suspends(void)
{
    int releases = 0;
    for (int ms = 0; ms < 200; ms++) {
        exchange_rx(&x, "300#08 0000");
        exchange_wait(&x, 1);
        const can_frame_t *sent = pdcp_arb_tx_peek(x.arb);
        while (sent != NULL) {
            const bool is_first = sent->id == 0x311;
            TEST_ASSERT_EQUAL_HEX8(0x09, sent->data[0]);
            TEST_ASSERT_EQUAL(1, sent->dlc);
            releases++;
            pdcp_arb_tx_pop(x.arb);
            exchange_rx(&x, is_first ? "211#89 01" : "212#89 01");
            sent = pdcp_arb_tx_peek(x.arb);
        }
    }
    TEST_ASSERT_LESS_OR_EQUAL(2 * 20, releases);
    TEST_ASSERT_GREATER_OR_EQUAL(2 * 15, releases);
}

/* A device that is being asked something is released when its place is free. */
static void test_a_busy_device_is_released_later(void)
{
    uint8_t bytes[8];
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 0, 0, 7, bytes, sizeof bytes));
    exchange_tx(&x, "311#03 07 00");
    exchange_rx(&x, "311#08 0000");
    exchange_pass(&x, 45);
    exchange_silence(&x);
    exchange_rx(&x, "211#83 01 07 00 41");
    exchange_pass(&x, 10);
    exchange_tx(&x, "311#09");
}

/* One that does not answer is told again, a second later. */
static void test_a_mute_device_is_released_later(void)
{
    exchange_rx(&x, "311#08 0000");
    exchange_pass(&x, 10);
    for (int i = 0; i < 3; i++) {
        exchange_tx(&x, "311#09");
        exchange_pass(&x, 100);
    }
    exchange_beacons(&x);
    exchange_pass(&x, 999);
    exchange_silence(&x);
    exchange_pass(&x, 1);
    exchange_tx(&x, "311#09");
    exchange_rx(&x, "211#89 01");
    exchange_beacons(&x);
    exchange_pass(&x, 1200);
    exchange_silence(&x);
}

/* One that is lost is told when it is back, if it was not reset meanwhile (D-BUS-15). */
static void test_a_lost_device_is_released_when_it_is_back(void)
{
    exchange_pass(&x, 1495);
    exchange_rx(&x, "311#08 0000"); /* just before it is lost */
    exchange_pass(&x, 500);
    exchange_silence(&x);
    exchange_rx(&x, "311#08 0000"); /* and once more while it is */
    exchange_pass(&x, 500);
    exchange_silence(&x);
    exchange_rx(&x, "011#0A");
    exchange_set_up_device(&x, "11", "0200 0200 0400", "01");
    exchange_set_up_channel(&x, "11", "FE");
    exchange_silence(&x);
    exchange_pass(&x, 10);
    exchange_tx(&x, "311#09");
    exchange_rx(&x, "211#89 01");
}

/* It was lost before it could answer. */
static void test_a_device_that_is_lost_before_it_answers(void)
{
    exchange_pass(&x, 1400);
    exchange_rx(&x, "311#08 0000");
    exchange_pass(&x, 10);
    exchange_tx(&x, "311#09");
    exchange_pass(&x, 200); /* lost */
    TEST_ASSERT_EQUAL(2, exchange_count(&x, PDCP_EVENT_LOST));
    exchange_rx(&x, "011#0A");
    exchange_tx(&x, "311#03 01 00");
    exchange_pass(&x, 100);
    exchange_set_up_device(&x, "11", "0200 0200 0400", "01"); /* it is asked once more */
    exchange_set_up_channel(&x, "11", "FE");
    exchange_pass(&x, 10);
    exchange_tx(&x, "311#09");
    exchange_rx(&x, "211#89 01");
    exchange_silence(&x);
}

/* Suspended by the host, until released. */
static void suspend(uint16_t time_ms, const char *frame, const char *answer)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_command(x.arb, 0, PDCP_SUSPEND, time_ms));
    exchange_tx(&x, frame);
    exchange_rx(&x, answer);
}

static void test_what_the_host_has_suspended_stays_so(void)
{
    suspend(0, "311#08 0000", "211#88 01 0000");
    expect_none("311#08 0000");
    for (int i = 0; i < 400; i++) {
        exchange_pass(&x, 500);
        exchange_beacons(&x);
    }
    expect_none("311#08 0000");
    expect_none("311#08 E803");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_command(x.arb, 0, PDCP_RELEASE, 0));
    exchange_tx(&x, "311#09");
    exchange_rx(&x, "211#89 01");
    expect_release("311#08 0000");
}

/* D-BUS-58: for a time: it counts as suspended for that time at least, and up to a second longer. */
static void suspended_for(uint16_t time_ms, const char *frame, const char *answer)
{
    setUp();
    suspend(time_ms, frame, answer);
    uint32_t left_ms = time_ms;
    while (left_ms > 400) {
        exchange_pass(&x, 400);
        exchange_beacons(&x);
        left_ms -= 400;
    }
    exchange_pass(&x, left_ms - 1);
    exchange_rx(&x, "311#08 0000");
    exchange_pass(&x, 1);
    exchange_silence(&x);
    exchange_beacons(&x);
    exchange_pass(&x, 1000);
    exchange_silence(&x);
    expect_release("311#08 0000");
}

static void test_a_suspension_for_a_time(void)
{
    suspended_for(1, "311#08 0100", "211#88 01 0100");
    suspended_for(500, "311#08 F401", "211#88 01 F401");
    suspended_for(501, "311#08 F501", "211#88 01 F501");
    suspended_for(65535, "311#08 FFFF", "211#88 01 FFFF");
}

/* Refused, or not answered: it is not suspended. */
static void test_a_suspension_that_was_refused(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_command(x.arb, 0, PDCP_SUSPEND, 0));
    exchange_tx(&x, "311#08 0000");
    exchange_rx(&x, "211#88 00 0000");
    expect_release("311#08 0000");
}

static void test_a_suspension_by_passthrough(void)
{
    uint8_t suspend_it[8] = {0x08, 0x00, 0x00};
    uint8_t release_it[8] = {0x09};
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_passthrough(x.arb, 0, suspend_it, 3));
    exchange_tx(&x, "311#08 0000");
    exchange_rx(&x, "211#88 01 0000");
    expect_none("311#08 0000");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_passthrough(x.arb, 0, release_it, 1));
    exchange_tx(&x, "311#09");
    exchange_rx(&x, "211#89 01");
    expect_release("311#08 0000");
}

/* Its time stands behind the code. */
static void test_a_time_by_passthrough(void)
{
    uint8_t bytes[8] = {0x08, 0x64, 0x00};
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_passthrough(x.arb, 0, bytes, 3));
    exchange_tx(&x, "311#08 6400");
    exchange_rx(&x, "211#88 01 6400");
    expect_none("311#08 0000");
    exchange_pass(&x, 1100);
    expect_release("311#08 0000");
}

static void test_a_suspension_of_all(void)
{
    TEST_ASSERT_TRUE(pdcp_arb_broadcast(x.arb, PDCP_SUSPEND, 0));
    exchange_tx(&x, "300#08 0000");
    expect_none("300#08 0000");
    expect_none("312#08 0000");
    TEST_ASSERT_TRUE(pdcp_arb_broadcast(x.arb, PDCP_RELEASE, 0));
    exchange_tx(&x, "300#09");
    expect_release("311#08 0000");
}

/* A device that was bound anew is not suspended any more (D-BUS-58). */
static void test_a_suspension_ends_with_the_binding(void)
{
    suspend(0, "311#08 0000", "211#88 01 0000");
    TEST_ASSERT_TRUE(pdcp_arb_reset(x.arb, x.now_ms, 0));
    exchange_tx(&x, "311#0B");
    exchange_rx(&x, "211#8B 01");
    exchange_add_output(&x, "FE");
    expect_release("311#08 0000");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_device_is_released);
    RUN_TEST(test_what_is_no_suspend);
    RUN_TEST(test_a_flood_of_suspends);
    RUN_TEST(test_a_busy_device_is_released_later);
    RUN_TEST(test_a_mute_device_is_released_later);
    RUN_TEST(test_a_lost_device_is_released_when_it_is_back);
    RUN_TEST(test_a_device_that_is_lost_before_it_answers);
    RUN_TEST(test_what_the_host_has_suspended_stays_so);
    RUN_TEST(test_a_suspension_for_a_time);
    RUN_TEST(test_a_suspension_that_was_refused);
    RUN_TEST(test_a_suspension_by_passthrough);
    RUN_TEST(test_a_time_by_passthrough);
    RUN_TEST(test_a_suspension_of_all);
    RUN_TEST(test_a_suspension_ends_with_the_binding);
    return UNITY_END();
}
