/* Things that happen in the middle of others, each found by a randomised run: devices that vanish or are
 * reset in a link job, answers that are lost at the wrong moment, clocks that are weeks old (D-BUS-6,
 * D-BUS-10, D-BUS-12, D-BUS-14, D-BUS-15, D-BUS-19, D-API-10). */
#include "exchange.h"
#include "unity.h"

static exchange_t x;

void setUp(void)
{
    exchange_start_limb(&x);
}

void tearDown(void) {}

/* All steps but the last, which is to the output. */
static void make_input(void)
{
    for (const exchange_pair_t *pair = exchange_making; pair[1].tx != NULL; pair++) {
        exchange_tx(&x, pair->tx);
        exchange_rx(&x, pair->rx);
    }
}

static void connect_to_the_last_step(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    make_input();
    exchange_tx(&x, "311#04 04 01 01");
}

static void make_link(void)
{
    connect_to_the_last_step();
    exchange_rx(&x, "211#84 01 04 01");
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
}

/* The input's device is reset while the output's answer is awaited: there is no link, and the output is told
 * to be silent. */
static void test_the_input_vanishes_at_the_last_step(void)
{
    connect_to_the_last_step();
    exchange_rx(&x, "612#01 0200 0200 0600");
    exchange_tx(&x, "312#03 01 00");
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#04 04 01 01");
    exchange_tx(&x, "312#03 01 00");
    exchange_pass(&x, 99);
    exchange_rx(&x, "011#0A");
    exchange_pass(&x, 1); /* the check of 12h and the third try to 11h */
    exchange_tx(&x, "311#04 04 01 01");
    exchange_tx(&x, "312#81 12 0200 0200 0600");
    exchange_tx(&x, "312#03 01 00");
    exchange_rx(&x, "211#84 01 04 01");
    TEST_ASSERT_NOT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01");
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LINK_REQUEST));
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
}

/* An output that may be on, because its answers were lost, is written again by the next link. */
static void test_an_output_in_doubt_is_written_again(void)
{
    connect_to_the_last_step();
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#04 04 01 01");
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#04 04 01 01");
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#04 04 01 00"); /* the undo, one try, carried out but not answered */
    exchange_pass(&x, 100);
    exchange_tx(&x, "312#04 04 01 00");
    exchange_beacons(&x);
    exchange_rx(&x, "212#84 01 04 01");
    exchange_tx(&x, "312#04 07 01 0000");
    exchange_rx(&x, "212#84 01 07 01");
    exchange_tx(&x, "312#04 08 01 0000 0000");
    exchange_rx(&x, "212#84 01 08 01");
    exchange_tx(&x, "312#04 06 01 FFFF FF");
    exchange_rx(&x, "212#84 01 06 01");
    exchange_tx(&x, "312#04 05 01 FFFF FFFF");
    exchange_rx(&x, "212#84 01 05 01");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    exchange_tx(&x, "311#04 04 01 00"); /* the silencing goes on */
    exchange_rx(&x, "211#84 01 04 01");
    make_input();
    exchange_tx(&x, "311#04 04 01 01");
}

/* A link request that waits behind a job ends when one of its devices is reset: its channels may be others'
 * before its turn. */
static void test_a_waiting_request_ends_with_its_device(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    exchange_tx(&x, exchange_making[0].tx);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    exchange_rx(&x, "611#01 0200 0200 0400");
    exchange_tx(&x, "311#03 01 00");
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#03 01 00");
    exchange_tx(&x, "312#04 05 01 0200 0200"); /* the job's second try */
    exchange_pass(&x, 100);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LINK_REQUEST));
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
}

/* D-API-10: a link request that cannot be started within 1 s. */
static void test_a_request_does_not_wait_for_ever(void)
{
    x.arb->bus.tables.devices[1].ack_ms = 500;
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    exchange_tx(&x, exchange_making[0].tx); /* never answered: 1.5 s */
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    exchange_step(&x);
    exchange_pass(&x, 999);
    exchange_beacons(&x);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LINK_REQUEST));
    exchange_pass(&x, 1);
    TEST_ASSERT_EQUAL(PDCP_ERR_BUSY, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
}

static void let_weeks_go_by(void)
{
    for (int day = 0; day < 26; day++) {
        for (int hour = 0; hour < 24; hour++) {
            exchange_wait(&x, 3600000u);
            (void)exchange_drain(&x);
        }
    }
}

/* 26 days after the start, more than half the range of the clock: D-BUS-15 and D-BUS-12 still hold. */
static void test_an_old_arbitrator_is_not_young_again(void)
{
    let_weeks_go_by();
    exchange_clear(&x);
    exchange_rx(&x, "042#0A");
    exchange_tx(&x, "342#0B");
    exchange_rx(&x, "100#0A");
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_SILENT));
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_FOREIGN));
}

/* What was reserved, or reset, weeks ago is so no more. */
static void test_old_reservations_do_not_come_back(void)
{
    exchange_rx(&x, "600#01 0700 0700 0700");
    exchange_tx(&x, "300#81 01 0700 0700 0700");
    exchange_pass(&x, 1300);
    exchange_rx(&x, "042#0A");
    (void)exchange_drain(&x);
    let_weeks_go_by();
    exchange_rx(&x, "042#0A");
    exchange_tx(&x, "342#0B");
    exchange_rx(&x, "601#01 0800 0800 0800");
    exchange_tx(&x, "301#81 01 0800 0800 0800");
}

/* D-BUS-37: every unknown id is served on its own, at most once a second, however many there are. */
static void test_every_unknown_id_is_told_once_a_second(void)
{
    char beacon[] = "000#0A";
    exchange_pass(&x, 1200);
    for (int round = 0; round < 10; round++) {
        for (int id = 0x20; id < 0xE0; id++) {
            beacon[1] = "0123456789ABCDEF"[id / 16];
            beacon[2] = "0123456789ABCDEF"[id % 16];
            exchange_rx(&x, beacon);
            (void)exchange_drain(&x);
        }
        exchange_wait(&x, 99);
    }
    TEST_ASSERT_EQUAL(0xE0 - 0x20, x.arb->bus.stats[PDCP_STAT_UNKNOWN_RESET]);
    exchange_wait(&x, 200);
    (void)exchange_drain(&x);
    exchange_rx(&x, "042#0A");
    exchange_tx(&x, "342#0B");
}

/* Update Data Channel during the setup, for what turns out to be an output. */
static void test_an_update_for_an_output_during_its_setup(void)
{
    exchange_bind(&x, "13", "0300 0300 0900");
    exchange_set_up_device(&x, "13", "0300 0300 0900", "01");
    exchange_rx(&x, "213#0F 01");
    exchange_set_up_channel(&x, "13", "FD");
    exchange_tx(&x, "313#8F 00 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_links(&x.arb->bus.tables));
}

/* D-BUS-14: a device whose link is active names another, absent source: it must not go on hearing the old
 * one. */
static void test_an_update_to_an_absent_source_silences_the_input(void)
{
    make_link();
    exchange_update(&x, "83 01 05 01 0300 0300", "83 01 06 01 0900 01");
    exchange_tx(&x, "311#04 04 01 00"); /* by identifier */
    exchange_tx(&x, "312#8F 00 01");
    exchange_rx(&x, "211#84 01 04 01");
    exchange_run(&x, exchange_silencing);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
}

/* D-BUS-19: when its source could not even be read, the device gets no answer and asks again. */
static void test_an_update_that_could_not_be_read_is_not_refused(void)
{
    exchange_rx(&x, "212#0F 01");
    for (int i = 0; i < 3; i++) {
        exchange_tx(&x, "312#03 05 01");
        exchange_pass(&x, 100);
    }
    exchange_silence(&x);
    exchange_rx(&x, "212#0F 01");
    exchange_tx(&x, "312#03 05 01");
}

/* A device that was reset and asks for another id is known to be reset: its second request is granted without
 * a second check. */
static void test_a_reset_device_is_checked_once(void)
{
    exchange_rx(&x, "655#01 0200 0200 0400");
    exchange_check_fails(&x, "11");
    exchange_tx(&x, "355#81 11 0200 0200 0400");
    exchange_rx(&x, "611#01 0200 0200 0400");
    exchange_tx(&x, "311#81 11 0200 0200 0400");
}

/* D-BUS-17: a device that was left is tried again every 5 s, and holds up no link while it is. */
static void test_a_device_that_was_left_is_tried_again(void)
{
    exchange_rx(&x, "613#01 0300 0300 0900");
    exchange_tx(&x, "313#81 13 0300 0300 0900");
    for (int i = 0; i < 5; i++) {
        exchange_tx(&x, "313#03 01 00");
        exchange_rx(&x, "213#83 00 01 00");
        exchange_pass(&x, 250);
    }
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_SETUP_FAILED));
    for (int i = 0; i < 10; i++) {
        exchange_beacons(&x);
        exchange_rx(&x, "013#0A");
        exchange_pass(&x, i < 9 ? 500 : 250);
    }
    exchange_tx(&x, "313#03 01 00");
    TEST_ASSERT_FALSE(pdcp_arb_setup_running(x.arb));
    exchange_rx(&x, "213#83 01 01 00 0300 0300");
    exchange_tx(&x, "313#03 02 00");
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_SETUP_FAILED));
}

/* A number that comes by bulk transfer, in whatever pieces, is one number. */
static void test_a_number_in_pieces(void)
{
    exchange_rx(&x, "613#01 3412 7856 BC9A");
    exchange_tx(&x, "313#81 13 3412 7856 BC9A");
    exchange_tx(&x, "313#03 01 00");
    exchange_rx(&x, "213#83 02 01 00");
    exchange_tx(&x, "313#0C 01 00");
    exchange_rx(&x, "213#8C 01 01 00 0400");
    exchange_rx(&x, "213#0E 00 34");
    exchange_tx(&x, "313#8E 01");
    exchange_rx(&x, "213#0E 01 1278");
    exchange_tx(&x, "313#8E 01");
    exchange_rx(&x, "213#0E 02 56");
    exchange_tx(&x, "313#8E 01");
    exchange_tx(&x, "313#03 02 00"); /* VID and PID match the binding */
}

static void test_a_source_in_pieces(void)
{
    exchange_rx(&x, "212#0F 01");
    exchange_tx(&x, "312#03 05 01");
    exchange_rx(&x, "212#83 02 05 01");
    exchange_tx(&x, "312#0C 05 01");
    exchange_rx(&x, "212#8C 01 05 01 0400");
    exchange_rx(&x, "212#0E 00 020002");
    exchange_tx(&x, "312#8E 01");
    exchange_rx(&x, "212#0E 01 00");
    exchange_tx(&x, "312#8E 01");
    exchange_tx(&x, "312#03 06 01");
    exchange_rx(&x, "212#83 01 06 01 0400 01");
    make_input();
    exchange_tx(&x, "311#04 04 01 01");
}

/* 2410h: the link is to be taken away. Whatever happens before that has its turn, it is. */
static void expect_no_link(void)
{
    TEST_ASSERT_EQUAL(PDCP_LINK_NONE, exchange_input_entry(&x)->link);
    TEST_ASSERT_TRUE(pdcp_arb_links_settled(x.arb));
}

static void test_a_removal_outlasts_a_link_that_fails(void)
{
    make_link();
    exchange_add_third_output(&x);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(
        PDCP_OK, pdcp_arb_connect(x.arb, pdcp_tables_channel(&x.arb->bus.tables, 2, 1), exchange_input(&x)));
    exchange_tx(&x, "312#04 04 01 00");
    TEST_ASSERT_TRUE(pdcp_arb_disconnect(x.arb, exchange_input(&x)));
    exchange_rx(&x, "212#84 00 04 01"); /* refused: the link that worked would be made anew */
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01");
    exchange_run(&x, exchange_removing);
    expect_no_link();
}

static void test_a_removal_outlasts_an_absent_source(void)
{
    make_link();
    exchange_rx(&x, "212#0F 01");
    exchange_tx(&x, "312#03 05 01");
    exchange_rx(&x, "212#83 01 05 01 0300 0300");
    exchange_tx(&x, "312#03 06 01");
    TEST_ASSERT_TRUE(pdcp_arb_disconnect(x.arb, exchange_input(&x)));
    exchange_rx(&x, "212#83 01 06 01 0900 01"); /* to be silenced */
    exchange_tx(&x, "311#04 04 01 00");         /* by identifier */
    exchange_tx(&x, "312#8F 00 01");
    exchange_rx(&x, "211#84 01 04 01");
    exchange_run(&x, exchange_removing);
    expect_no_link();
}

static void test_a_removal_outlasts_the_source(void)
{
    make_link();
    exchange_rx(&x, "212#0F 01");
    exchange_tx(&x, "312#03 05 01");
    TEST_ASSERT_TRUE(pdcp_arb_disconnect(x.arb, exchange_input(&x)));
    exchange_rx(&x, "611#01 0200 0200 0400"); /* the source's device was reset */
    exchange_tx(&x, "311#03 01 00");
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#03 01 00");
    exchange_tx(&x, "312#03 05 01"); /* once more */
    exchange_pass(&x, 99);
    exchange_rx(&x, "212#83 01 05 01 0200 0200");
    exchange_tx(&x, "312#03 06 01");
    exchange_pass(&x, 1); /* it is lost: the input would be silenced */
    (void)exchange_drain(&x);
    exchange_rx(&x, "212#83 01 06 01 0400 01");
    exchange_tx(&x, "312#8F 00 01");
    exchange_pairs(&x, exchange_removing);
    expect_no_link();
}

static void test_a_removal_outlasts_an_update(void)
{
    make_link();
    exchange_rx(&x, "212#0F 01");
    exchange_tx(&x, "312#03 05 01");
    TEST_ASSERT_TRUE(pdcp_arb_disconnect(x.arb, exchange_input(&x)));
    exchange_rx(&x, "212#0F 01"); /* it asks again */
    exchange_rx(&x, "212#83 01 05 01 0200 0200");
    exchange_tx(&x, "312#03 06 01");
    exchange_rx(&x, "212#83 01 06 01 0400 01");
    exchange_tx(&x, "312#8F 01 01");
    exchange_tx(&x, "312#04 04 01 00");
    exchange_rx(&x, "212#84 01 04 01");
    exchange_pairs(&x, &exchange_removing[1]);
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01");
    exchange_silence(&x);
    expect_no_link();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_input_vanishes_at_the_last_step);
    RUN_TEST(test_an_output_in_doubt_is_written_again);
    RUN_TEST(test_a_waiting_request_ends_with_its_device);
    RUN_TEST(test_a_request_does_not_wait_for_ever);
    RUN_TEST(test_an_old_arbitrator_is_not_young_again);
    RUN_TEST(test_old_reservations_do_not_come_back);
    RUN_TEST(test_every_unknown_id_is_told_once_a_second);
    RUN_TEST(test_an_update_for_an_output_during_its_setup);
    RUN_TEST(test_an_update_to_an_absent_source_silences_the_input);
    RUN_TEST(test_an_update_that_could_not_be_read_is_not_refused);
    RUN_TEST(test_a_reset_device_is_checked_once);
    RUN_TEST(test_a_device_that_was_left_is_tried_again);
    RUN_TEST(test_a_number_in_pieces);
    RUN_TEST(test_a_source_in_pieces);
    RUN_TEST(test_a_removal_outlasts_a_link_that_fails);
    RUN_TEST(test_a_removal_outlasts_an_absent_source);
    RUN_TEST(test_a_removal_outlasts_the_source);
    RUN_TEST(test_a_removal_outlasts_an_update);
    return UNITY_END();
}
