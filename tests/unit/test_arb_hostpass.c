/* Passthrough (230Ah to 230Ch): what a host may send to a device, and what comes back (D-API-4, D-API-11). */
#include "hostlink.h"
#include "unity.h"

static exchange_t x;
static arb_app_t app;

void setUp(void)
{
    hostlink_start(&x, &app, false);
}

void tearDown(void) {}

#define PASS(dlc, ...) BYTES(DEV_OUT, dlc, __VA_ARGS__)

/* The answer is returned whatever it says, its unused bytes are 0, and a late answer to a request before is
 * not taken for it. */
static void test_passthrough_returns_the_next_answer(void)
{
    exchange_add_output(&x, "FE");
    hostlink_request(0x230A, PASS(3, 3, 7, 1, 0, 0, 0, 0, 0));
    exchange_tx(&x, "311#03 07 01");
    exchange_rx(&x, "211#83 01 05 01 FE"); /* about another parameter */
    exchange_rx(&x, "211#84 01 07 01");
    exchange_rx(&x, "011#0A");
    hostlink_silence();
    exchange_rx(&x, "211#83 02 07 01");
    hostlink_reply(0x230B,
                   PASS(4, 0x83, 2, 7, 1, 0, 0, 0, 0)); /* it wants bulk transfer: that is the answer */
    hostlink_request(0x230A, PASS(8, 0x7F, 1, 2, 3, 4, 5, 6, 7));
    exchange_tx(&x, "311#7F 01020304050607");
    exchange_rx(&x, "211#FF");
    hostlink_reply(0x230B, PASS(1, 0xFF, 0, 0, 0, 0, 0, 0, 0));
    hostlink_request(0x230A, PASS(3, 8, 0xE8, 3, 9, 9, 9, 9, 9)); /* what lies behind the DLC is not sent */
    exchange_tx(&x, "311#08 E803");
    exchange_rx(&x, "211#88 00 E803");
    hostlink_reply(0x230B, PASS(4, 0x88, 0, 0xE8, 3, 0, 0, 0, 0));
    exchange_silence(&x);
}

static void test_passthrough_is_repeated_and_fails(void)
{
    exchange_add_output(&x, "FE");
    hostlink_request(0x230A, PASS(2, 0x50, 1, 0, 0, 0, 0, 0, 0));
    for (int i = 0; i < 3; i++) {
        exchange_tx(&x, "311#50 01");
        hostlink_silence();
        exchange_pass(&x, 100);
    }
    hostlink_error(0x230C, 0x05);
    exchange_rx(&x, "211#D0");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_DROP_BAD_CODE]);
}

static void test_passthrough_of_what_is_wrong(void)
{
    exchange_add_output(&x, "FE");
    hostlink_request(0x230A, PASS(9, 0x50, 0, 0, 0, 0, 0, 0, 0));
    hostlink_error(0x230C, 0x01);
    hostlink_request(0x230A, BYTES(DEV_OUT, 1, 0x50));
    hostlink_error(0x230C, 0x01);
    hostlink_request(0x230A, BYTES(DEV_NONE, 1, 0x50, 0, 0, 0, 0, 0, 0, 0));
    hostlink_error(0x230C, 0x03);
}

/* D-API-11: what the arbitrator lives on, and what no device answers. */
static void test_passthrough_of_codes_that_are_not_the_hosts(void)
{
    exchange_add_output(&x, "FE");
    for (unsigned code = 0; code < 256; code++) {
        const bool is_request = code == 3 || code == 4 || code == 8 || code == 9 || code == 0x0B;
        if (!is_request && (code < 0x10 || code >= 0x80)) {
            hostlink_request(0x230A, PASS(1, (uint8_t)code, 0, 0, 0, 0, 0, 0, 0));
            hostlink_error(0x230C, 0x0E);
        }
    }
    exchange_silence(&x);
    hostlink_silence();
}

/* D-BUS-25: the tables follow. */
static void test_passthrough_of_a_beacon_interval(void)
{
    exchange_add_output(&x, "FE");
    hostlink_request(0x230A, PASS(5, 4, 10, 0, 0xD0, 7, 0, 0, 0));
    exchange_tx(&x, "311#04 0A 00 D007");
    exchange_rx(&x, "211#84 01 0A 00 D007");
    hostlink_reply(0x230B, PASS(6, 0x84, 1, 10, 0, 0xD0, 7, 0, 0));
    hostlink_request(0x230A, PASS(5, 4, 10, 0, 0x64, 0, 0, 0, 0));
    exchange_tx(&x, "311#04 0A 00 6400");
    exchange_rx(&x, "211#84 00 0A 00"); /* refused: as before */
    hostlink_reply(0x230B, PASS(4, 0x84, 0, 10, 0, 0, 0, 0, 0));
    exchange_pass(&x, 5999);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LOST));
    exchange_pass(&x, 1);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LOST));
}

/* A device that was reset is lost until it binds again, also when the host has done it by hand. */
static void test_passthrough_of_a_reset(void)
{
    exchange_add_output(&x, "FE");
    hostlink_request(0x230A, PASS(1, 0x0B, 0, 0, 0, 0, 0, 0, 0));
    exchange_tx(&x, "311#0B");
    exchange_rx(&x, "211#8B 00");
    hostlink_reply(0x230B, PASS(2, 0x8B, 0, 0, 0, 0, 0, 0, 0));
    hostlink_request(0x2201, NULL, 0);
    hostlink_reply(0x2202, BYTES(1, 0, 1, 0));
    hostlink_request(0x230A, PASS(1, 0x0B, 0, 0, 0, 0, 0, 0, 0));
    exchange_tx(&x, "311#0B");
    exchange_rx(&x, "211#8B 01");
    hostlink_reply(0x230B, PASS(2, 0x8B, 1, 0, 0, 0, 0, 0, 0));
    hostlink_request(0x2201, NULL, 0);
    hostlink_reply(0x2202, BYTES(0, 0, 0, 0));
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LOST));
}

/* To all: Suspend and Release only; devices do not answer. */
static void test_passthrough_to_all(void)
{
    exchange_add_output(&x, "FE");
    hostlink_request(0x230A, BYTES(0, 0, 0, 0, 0, 0, 3, 8, 0xE8, 3, 0, 0, 0, 0, 0));
    hostlink_reply(0x230B, BYTES(0, 0, 0, 0, 0, 0, 3, 8, 0xE8, 3, 0, 0, 0, 0, 0));
    exchange_tx(&x, "300#08 E803");
    hostlink_request(0x230A, BYTES(0, 0, 0, 0, 0, 0, 1, 9, 0, 0, 0, 0, 0, 0, 0));
    hostlink_reply(0x230B, BYTES(0, 0, 0, 0, 0, 0, 1, 9, 0, 0, 0, 0, 0, 0, 0));
    exchange_tx(&x, "300#09");
    for (unsigned code = 0; code < 256; code++) {
        if (code != 8 && code != 9) {
            hostlink_request(0x230A, BYTES(0, 0, 0, 0, 0, 0, 1, (uint8_t)code, 0, 0, 0, 0, 0, 0, 0));
            hostlink_error(0x230C, 0x0E);
        }
    }
    hostlink_request(0x230A,
                     BYTES(0, 0, 0, 0, 0, 0, 1, 8, 0, 0, 0, 0, 0, 0, 0)); /* Suspend without its time */
    hostlink_error(0x230C, 0x0F);
    hostlink_request(0x230A, BYTES(0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0));
    hostlink_error(0x230C, 0x01);
    exchange_silence(&x);
}

/* D-BUS-42: an arbitrator on standby sends nothing. */
static void test_passthrough_to_all_on_standby(void)
{
    exchange_meet_server(&x);
    TEST_ASSERT_TRUE(pdcp_arb_is_on_standby(x.arb));
    hostlink_request(0x230A, BYTES(0, 0, 0, 0, 0, 0, 1, 9, 0, 0, 0, 0, 0, 0, 0));
    hostlink_error(0x230C, 0x0B);
    exchange_silence(&x);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_passthrough_returns_the_next_answer);
    RUN_TEST(test_passthrough_is_repeated_and_fails);
    RUN_TEST(test_passthrough_of_what_is_wrong);
    RUN_TEST(test_passthrough_of_codes_that_are_not_the_hosts);
    RUN_TEST(test_passthrough_of_a_beacon_interval);
    RUN_TEST(test_passthrough_of_a_reset);
    RUN_TEST(test_passthrough_to_all);
    RUN_TEST(test_passthrough_to_all_on_standby);
    return UNITY_END();
}
