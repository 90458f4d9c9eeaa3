/* Two arbitrators, commands to devices, a bus that fails (pdcp-bus.md 9): D-BUS-15, D-BUS-22, D-BUS-23,
 * D-BUS-26, D-BUS-42, with hand-written frames. The serial number of the arbitrator under test is 256: its
 * standby ends 1856 ms after the last foreign beacon. */
#include "exchange.h"
#include "unity.h"

static exchange_t x;

void setUp(void)
{
    exchange_start(&x, 0xFFFFFC00u);
}

void tearDown(void) {}

static uint32_t stat_of(pdcp_stat_t stat)
{
    return x.arb->bus.stats[stat];
}

/* D-BUS-42: without devices of its own, at any age. */
static void test_an_arbitrator_without_devices_goes_on_standby(void)
{
    exchange_pass(&x, 5000);
    exchange_meet_server(&x);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_SILENT));
    exchange_rx(&x, "611#01 0200 0200 0400"); /* nobody is granted anything */
    exchange_rx(&x, "042#0A");
    exchange_silence(&x);
    for (int i = 0; i < 10; i++) {
        exchange_wait(&x, 500); /* no own beacons either */
        exchange_silence(&x);
        exchange_rx(&x, "100#0A");
    }
    TEST_ASSERT_EQUAL(2, stat_of(PDCP_STAT_DROP_SILENT));
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_get(x.arb, 0, 0, 1, NULL, 0));
}

/* D-BUS-49: of requests that are held together two are granted at once, the others one by one. */
static void test_held_requests_are_granted_a_few_at_a_time(void)
{
    for (uint16_t i = 1; i <= 5; i++) {
        can_frame_t frame = exchange_frame("600#01 0900 0900 0000");
        frame.id = (uint16_t)(frame.id + i);
        frame.data[5] = (uint8_t)i;
        (void)pdcp_arb_on_frame(x.arb, x.now_ms, &frame);
    }
    static const uint8_t granted[] = {0, 2, 2, 3, 3, 4, 4, 5};
    exchange_wait(&x, PDCP_HOLD_MS - 1);
    for (unsigned i = 0; i < sizeof granted; i++) {
        TEST_ASSERT_EQUAL(granted[i], stat_of(PDCP_STAT_BIND_GRANTED));
        exchange_wait(&x, i % 2 == 0 ? 1 : PDCP_HOLD_PACE_MS - 1);
        (void)exchange_drain(&x);
    }
}

/* D-BUS-42: one whose beacons have not left for 1600 ms, because it was hung or off the bus, sends nothing
 * for 600 ms. It goes on if nobody else serves by then (D-BUS-51). */
static void test_a_hung_arbitrator_listens_first(void)
{
    exchange_add_output(&x, "FE");
    exchange_wait(&x, 1600 - PDCP_HOLD_MS); /* nothing leaves in a wait */
    exchange_tx(&x, "100#0A");
    exchange_drain(&x);
    exchange_wait(&x, 1601);
    exchange_silence(&x);
    TEST_ASSERT_TRUE(pdcp_arb_broadcast(x.arb, PDCP_RELEASE, 0));
    exchange_wait(&x, 599);
    exchange_silence(&x);
    exchange_wait(&x, 1);
    exchange_tx(&x, "100#0A");
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_SILENT));
}

/* Somebody has taken over meanwhile. */
static void test_a_hung_arbitrator_gives_way_to_one_that_serves(void)
{
    exchange_add_output(&x, "FE");
    exchange_wait(&x, 1601);
    exchange_rx(&x, "100#0A");
    exchange_rx(&x, "311#03 09 00");
    exchange_rx(&x, "211#83 01 09 00 01");
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_SILENT));
    exchange_wait(&x, 600);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_SILENT));
    exchange_silence(&x);
}

/* The same, and the one that serves asks no more than who is there. */
static void test_a_question_for_an_identity_is_no_service(void)
{
    exchange_add_output(&x, "FE");
    exchange_wait(&x, 1601);
    exchange_rx(&x, "100#0A");
    exchange_rx(&x, "311#03 01 00");
    exchange_rx(&x, "211#83 01 01 00 0200 0200");
    exchange_wait(&x, 600);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_SILENT));
}

/* D-BUS-35: silence of the other for 1600 ms and the spread by serial number: it takes over, and keeps quiet
 * towards unknown devices for 1200 ms. */
static void test_the_standby_takes_over(void)
{
    exchange_meet_server(&x);
    exchange_wait(&x, 1855);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_STARTED));
    exchange_wait(&x, 1);
    exchange_tx(&x, "100#0A");
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_STARTED));
    exchange_rx(&x, "042#0A");
    exchange_silence(&x);
    exchange_pass(&x, 1200);
    exchange_rx(&x, "042#0A");
    exchange_tx(&x, "342#0B");
    exchange_add_input(&x);
}

/* D-BUS-42: with devices of its own it stays and reports, once. */
static void test_the_first_arbitrator_stays(void)
{
    exchange_add_output(&x, "FE");
    exchange_rx(&x, "100#0A");
    exchange_pass(&x, 500);
    exchange_rx(&x, "100#0A");
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_SILENT));
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_FOREIGN));
    exchange_add_input(&x);
    exchange_pass(&x, 2000);
    exchange_rx(&x, "100#0A"); /* it had gone and is back */
    TEST_ASSERT_EQUAL(2, exchange_count(&x, PDCP_EVENT_FOREIGN));
}

/* The host has its answer also when the arbitrator falls silent. */
static void test_going_silent_ends_what_the_host_waits_for(void)
{
    uint8_t bytes[8];
    exchange_add_both(&x);
    exchange_meet_rival(&x);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 0, 0, 8, bytes, sizeof bytes));
    exchange_tx(&x, "311#03 08 00");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, pdcp_tables_channel(&x.arb->bus.tables, 0, 1),
                                                pdcp_tables_channel(&x.arb->bus.tables, 1, 1)));
    exchange_tx(&x, "312#04 05 01 0200 0200");
    exchange_rx(&x, "100#0A");
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_devices(&x.arb->bus.tables));
    exchange_silence(&x);
}

/* [PDCP 3.2.4]: time in ms, 0 until released. */
static void test_a_device_is_suspended_and_released(void)
{
    exchange_add_output(&x, "FE");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_command(x.arb, 0, PDCP_SUSPEND, 1000));
    exchange_tx(&x, "311#08 E803");
    exchange_rx(&x, "211#88 01 E803");
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_command(x.arb, 0, PDCP_RELEASE, 0));
    exchange_tx(&x, "311#09");
    exchange_rx(&x, "211#89"); /* short answer: success (D-BUS-18) */
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_command(x.arb, 0, PDCP_SUSPEND, 0));
    exchange_tx(&x, "311#08 0000");
    exchange_rx(&x, "211#89 01"); /* not the answer */
    exchange_rx(&x, "211#88 00 0000");
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL(3, exchange_count(&x, PDCP_EVENT_REQUEST));
}

static void test_all_are_suspended_and_released(void)
{
    TEST_ASSERT_TRUE(pdcp_arb_broadcast(x.arb, PDCP_SUSPEND, 0));
    exchange_tx(&x, "300#08 0000");
    TEST_ASSERT_TRUE(pdcp_arb_broadcast(x.arb, PDCP_RELEASE, 0));
    exchange_tx(&x, "300#09");
    exchange_silence(&x);
}

/* Several devices are reset in parallel; each waits for 8B and is then lost until it binds again. */
static void test_devices_are_reset_side_by_side(void)
{
    exchange_add_both(&x);
    exchange_clear(&x);
    TEST_ASSERT_TRUE(pdcp_arb_reset(x.arb, x.now_ms, 0));
    TEST_ASSERT_TRUE(pdcp_arb_reset(x.arb, x.now_ms, 1));
    TEST_ASSERT_FALSE(pdcp_arb_reset(x.arb, x.now_ms, 2));
    TEST_ASSERT_FALSE(pdcp_arb_reset(x.arb, x.now_ms, 200));
    exchange_tx(&x, "311#0B");
    exchange_tx(&x, "312#0B");
    exchange_rx(&x, "212#8B 01");
    TEST_ASSERT_EQUAL(1, exchange_last(&x, PDCP_EVENT_RESET)->place);
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_RESET)->status);
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_devices(&x.arb->bus.tables));
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#0B");
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#0B");
    exchange_pass(&x, 100);
    TEST_ASSERT_EQUAL(0, exchange_last(&x, PDCP_EVENT_RESET)->place);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_RESET)->status);
    TEST_ASSERT_EQUAL(2, exchange_count(&x, PDCP_EVENT_RESET));
    TEST_ASSERT_EQUAL(1,
                      pdcp_tables_count_devices(&x.arb->bus.tables)); /* it still beacons for all we know */
    exchange_rx(&x, "612#01 0200 0200 0600");
    exchange_tx(&x, "312#81 12 0200 0200 0600");
}

static void test_a_reset_that_is_refused(void)
{
    exchange_add_output(&x, "FE");
    TEST_ASSERT_TRUE(pdcp_arb_reset(x.arb, x.now_ms, 0));
    exchange_tx(&x, "311#0B");
    exchange_rx(&x, "211#8B 00");
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&x, PDCP_EVENT_RESET)->status);
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_devices(&x.arb->bus.tables));
}

/* D-BUS-15: the id is kept for a lost device, but another one beacons with it: it is told to reset, at most
 * once a second. */
static void test_an_unknown_device_with_a_kept_id_is_told_to_reset(void)
{
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 1500);
    exchange_rx(&x, "011#0A");
    exchange_tx(&x, "311#03 01 00");
    exchange_rx(&x, "211#83 01 01 00 0900 0900");
    exchange_tx(&x, "311#0B");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_devices(&x.arb->bus.tables));
    exchange_pass(&x, 500);
    exchange_rx(&x, "011#0A");
    exchange_tx(&x, "311#03 01 00");
    exchange_rx(&x, "211#83 01 01 00 0200 0200");
    exchange_tx(&x, "311#03 02 00");
    exchange_rx(&x, "211#83 01 02 00 0900");
    exchange_silence(&x);
    exchange_rx(&x, "611#01 0200 0200 0400"); /* the right one comes back */
    exchange_tx(&x, "311#81 11 0200 0200 0400");
}

/* D-BUS-26: a remembered link whose making was not answered is tried again after 500 ms. */
static void test_a_link_that_was_not_answered_is_tried_again(void)
{
    exchange_add_both(&x);
    exchange_update(&x, "83 01 05 01 0200 0200", "83 01 06 01 0400 01");
    for (int i = 0; i < 3; i++) {
        exchange_tx(&x, "312#04 05 01 0200 0200");
        exchange_pass(&x, 100);
    }
    exchange_tx(&x, "312#04 05 01 0200 0200"); /* undone, with one try: its source as it named it */
    exchange_pass(&x, 100);
    exchange_tx(&x, "312#8F 00 01");
    exchange_pass(&x, 499);
    exchange_silence(&x);
    exchange_pass(&x, 1);
    exchange_run(&x, exchange_making);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE,
                      x.arb->bus.tables.channels[pdcp_tables_channel(&x.arb->bus.tables, 1, 1)].link);
}

/* Bus-off: restarted after 100 ms, doubling to 5 s; what waited is discarded and counted. */
static void test_bus_off_is_left_with_a_growing_pause(void)
{
    static const uint16_t pauses_ms[] = {100, 200, 400, 800, 1600, 3200, 5000, 5000};
    for (unsigned i = 0; i < sizeof pauses_ms / sizeof pauses_ms[0]; i++) {
        (void)exchange_drain(&x);
        exchange_wait(&x, 500);
        pdcp_arb_on_state(x.arb, x.now_ms, PDCP_BUS_OFF);
        TEST_ASSERT_EQUAL(i + 1, stat_of(PDCP_STAT_BUS_OFF));
        pdcp_arb_on_state(x.arb, x.now_ms, PDCP_BUS_OFF); /* told again: nothing */
        exchange_wait(&x, (uint32_t)pauses_ms[i] - 1u);
        TEST_ASSERT_FALSE(pdcp_arb_take_restart(x.arb));
        exchange_wait(&x, 1);
        TEST_ASSERT_TRUE(pdcp_arb_take_restart(x.arb));
        TEST_ASSERT_FALSE(pdcp_arb_take_restart(x.arb));
        pdcp_arb_on_state(x.arb, x.now_ms, PDCP_BUS_ACTIVE);
        x.now_ms -= 500; /* the next one comes before the bus has been well for as long as the pause */
    }
    TEST_ASSERT_GREATER_THAN(0, stat_of(PDCP_STAT_TX_DISCARDED));
    TEST_ASSERT_EQUAL(2 * (int)(sizeof pauses_ms / sizeof pauses_ms[0]),
                      exchange_count(&x, PDCP_EVENT_STATE));
}

static void test_a_bus_that_was_well_for_long_starts_from_100_ms(void)
{
    for (int i = 0; i < 3; i++) {
        pdcp_arb_on_state(x.arb, x.now_ms, PDCP_BUS_OFF);
        exchange_wait(&x, 99);
        TEST_ASSERT_FALSE(pdcp_arb_take_restart(x.arb));
        exchange_wait(&x, 1);
        TEST_ASSERT_TRUE(pdcp_arb_take_restart(x.arb));
        pdcp_arb_on_state(x.arb, x.now_ms, PDCP_BUS_PASSIVE);
        pdcp_arb_on_state(x.arb, x.now_ms, PDCP_BUS_ACTIVE);
        exchange_wait(&x, 1000);
    }
    TEST_ASSERT_EQUAL(PDCP_BUS_ACTIVE, exchange_last(&x, PDCP_EVENT_STATE)->status);
}

/* What is queued while there is no bus is stale when there is one again: a device would do what has been
 * given up since, and its answer would be taken for another's. */
static void test_what_waits_without_a_bus_is_discarded(void) /* D-BUS-28 */
{
    static const pdcp_bus_state_t away[] = {PDCP_BUS_OFF, PDCP_BUS_DOWN};
    for (unsigned i = 0; i < sizeof away / sizeof away[0]; i++) {
        pdcp_arb_on_state(x.arb, x.now_ms, away[i]);
        const uint32_t before = stat_of(PDCP_STAT_TX_DISCARDED);
        exchange_wait(&x, 90);
        TEST_ASSERT_TRUE(pdcp_arb_broadcast(x.arb, PDCP_RELEASE, 0));
        pdcp_arb_on_state(x.arb, x.now_ms, PDCP_BUS_ACTIVE);
        TEST_ASSERT_GREATER_THAN(before, stat_of(PDCP_STAT_TX_DISCARDED));
        exchange_silence(&x);
        exchange_wait(&x, 10000);
        (void)exchange_drain(&x);
    }
    pdcp_arb_on_state(x.arb, x.now_ms, PDCP_BUS_OFF);
    exchange_wait(&x, 99);
    TEST_ASSERT_TRUE(pdcp_arb_broadcast(x.arb, PDCP_RELEASE, 0));
    exchange_wait(&x, 1);
    TEST_ASSERT_TRUE(pdcp_arb_take_restart(x.arb));
    exchange_silence(&x); /* the controller may send at once */
}

/* The end of a standby, where all that is known of the bus is forgotten, is no reason to stay off it. */
static void test_bus_off_is_left_over_the_end_of_a_standby(void)
{
    exchange_meet_server(&x);
    exchange_wait(&x, 1806);
    pdcp_arb_on_state(x.arb, x.now_ms, PDCP_BUS_OFF);
    exchange_wait(&x, 50);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_STARTED));
    TEST_ASSERT_FALSE(pdcp_arb_take_restart(x.arb));
    exchange_wait(&x, 49);
    TEST_ASSERT_FALSE(pdcp_arb_take_restart(x.arb));
    exchange_wait(&x, 1);
    TEST_ASSERT_TRUE(pdcp_arb_take_restart(x.arb));
    exchange_wait(&x, 10000);
    TEST_ASSERT_FALSE(pdcp_arb_take_restart(x.arb));
}

/* A queue full of low priority never keeps a beacon or a link change out, and they leave first; what is
 * pushed out is counted. */
static void test_a_full_queue_delays_nothing_urgent(void)
{
    can_frame_t filler = exchange_frame("5FF#00");
    exchange_add_both(&x);
    while (pdcp_txq_put(&x.arb->bus.txq, &filler) == PDCP_TXQ_TAKEN) {
    }
    exchange_wait(&x, 500);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, pdcp_tables_channel(&x.arb->bus.tables, 0, 1),
                                                pdcp_tables_channel(&x.arb->bus.tables, 1, 1)));
    exchange_tx(&x, "100#0A");
    exchange_tx(&x, "312#04 05 01 0200 0200");
    exchange_tx(&x, "5FF#00");
    TEST_ASSERT_EQUAL(2, stat_of(PDCP_STAT_TX_FULL)); /* each pushed one out */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_arbitrator_without_devices_goes_on_standby);
    RUN_TEST(test_held_requests_are_granted_a_few_at_a_time);
    RUN_TEST(test_a_hung_arbitrator_listens_first);
    RUN_TEST(test_a_hung_arbitrator_gives_way_to_one_that_serves);
    RUN_TEST(test_a_question_for_an_identity_is_no_service);
    RUN_TEST(test_the_standby_takes_over);
    RUN_TEST(test_the_first_arbitrator_stays);
    RUN_TEST(test_going_silent_ends_what_the_host_waits_for);
    RUN_TEST(test_a_device_is_suspended_and_released);
    RUN_TEST(test_all_are_suspended_and_released);
    RUN_TEST(test_devices_are_reset_side_by_side);
    RUN_TEST(test_a_reset_that_is_refused);
    RUN_TEST(test_an_unknown_device_with_a_kept_id_is_told_to_reset);
    RUN_TEST(test_a_link_that_was_not_answered_is_tried_again);
    RUN_TEST(test_bus_off_is_left_with_a_growing_pause);
    RUN_TEST(test_a_bus_that_was_well_for_long_starts_from_100_ms);
    RUN_TEST(test_what_waits_without_a_bus_is_discarded);
    RUN_TEST(test_bus_off_is_left_over_the_end_of_a_standby);
    RUN_TEST(test_a_full_queue_delays_nothing_urgent);
    return UNITY_END();
}
