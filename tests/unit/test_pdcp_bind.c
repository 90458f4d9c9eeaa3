/* Binding (pdcp-bus.md 3): D-BUS-2, D-BUS-5, D-BUS-6, with hand-written frames. */
#include <stdio.h>
#include <string.h>

#include "exchange.h"
#include "unity.h"

static exchange_t x;

void setUp(void)
{
    exchange_start(&x, 0xFFFFF000u); /* the clock wraps four seconds later */
}

void tearDown(void) {}

static uint32_t stat_of(pdcp_stat_t stat)
{
    return x.arb->bus.stats[stat];
}

/* [PDCP 3.2.1]: equal ids, the device is bound. The answer goes to the id asked for, normal priority. */
static void test_a_free_id_is_granted(void)
{
    exchange_rx(&x, "620#01 3412 7856 BC9A");
    exchange_tx(&x, "320#81 20 3412 7856 BC9A");
    exchange_tx(&x, "320#03 01 00"); /* its setup may start at once */
}

/* D-BUS-6: it is not counted before its first beacon. */
static void test_a_device_counts_from_its_first_beacon(void)
{
    exchange_rx(&x, "620#01 3412 7856 BC9A");
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_devices(&x.arb->bus.tables));
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_BOUND));
    exchange_rx(&x, "020#0A");
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_devices(&x.arb->bus.tables));
    exchange_rx(&x, "020#0A");
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_BOUND));
}

static void test_a_taken_id_leads_to_a_suggestion(void)
{
    exchange_rx(&x, "601#01 0100 0100 0100");
    exchange_tx(&x, "301#81 01 0100 0100 0100");
    (void)exchange_drain(&x);
    exchange_rx(&x, "601#01 0200 0200 0200");
    exchange_tx(&x, "301#81 02 0200 0200 0200"); /* the lowest free one */
    exchange_silence(&x);
    exchange_rx(&x, "602#01 0200 0200 0200");
    exchange_tx(&x, "302#81 02 0200 0200 0200");
}

/* D-BUS-2, D-BUS-6: 0 and 255 are never granted. D-BUS-24: suggestions from 1 upwards. */
static void test_0_and_255_get_a_suggestion(void)
{
    exchange_rx(&x, "600#01 0100 0100 0100");
    exchange_tx(&x, "300#81 01 0100 0100 0100");
    exchange_silence(&x);
    exchange_rx(&x, "6FF#01 0200 0200 0200");
    exchange_tx(&x, "3FF#81 02 0200 0200 0200");
    exchange_silence(&x);
}

/* D-BUS-6: a suggested id is reserved for the bind timeout, 1000 ms, then free again. */
static void test_a_suggested_id_is_reserved(void)
{
    exchange_rx(&x, "600#01 0100 0100 0100");
    exchange_tx(&x, "300#81 01 0100 0100 0100");
    exchange_rx(&x, "601#01 0200 0200 0200"); /* an unknown device asks for it */
    exchange_tx(&x, "301#81 02 0200 0200 0200");
    exchange_pass(&x, 989); /* and three requests are held for 5 ms (D-BUS-42) */
    exchange_rx(&x, "601#01 0300 0300 0300");
    exchange_tx(&x, "301#81 03 0300 0300 0300"); /* both are still reserved */
    exchange_rx(&x, "601#01 0300 0300 0300");
    exchange_tx(&x, "301#81 01 0300 0300 0300");
}

static void test_asking_again_gets_the_same_suggestion(void)
{
    exchange_rx(&x, "600#01 0100 0100 0100");
    exchange_tx(&x, "300#81 01 0100 0100 0100");
    exchange_rx(&x, "600#01 0200 0200 0200");
    exchange_tx(&x, "300#81 02 0200 0200 0200");
    exchange_rx(&x, "600#01 0100 0100 0100");
    exchange_tx(&x, "300#81 01 0100 0100 0100");
    TEST_ASSERT_EQUAL(3, stat_of(PDCP_STAT_BIND_SUGGESTED));
}

/* D-BUS-6: the same identity gets the id it had before, though it asks for another, also long after. */
static void test_an_identity_keeps_its_id(void)
{
    exchange_add_output(&x, "FE"); /* remembered when it is set up (D-BUS-43) */
    exchange_pass(&x, 12000);      /* lost, and forgotten */
    (void)exchange_drain(&x);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LOST));
    exchange_rx(&x, "630#01 0200 0200 0400");
    exchange_tx(&x, "330#81 11 0200 0200 0400");
    exchange_rx(&x, "611#01 0200 0200 0400");
    exchange_tx(&x, "311#81 11 0200 0200 0400");
}

/* D-BUS-6: an id remembered for an absent identity goes to another only when no unremembered one is left. */
static void test_a_remembered_id_is_given_away_last(void)
{
    const pdcp_remembered_t entry = {.identity = {1, 1, 1}, .node_id = 0x20};
    TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&x.arb->bus.bind, &entry));
    exchange_rx(&x, "620#01 3412 7856 BC9A");
    exchange_tx(&x, "320#81 01 3412 7856 BC9A");
    for (unsigned id = PDCP_NODE_MIN; id <= PDCP_NODE_MAX; id++) {
        if (id != 0x20) {
            x.arb->bus.tables.owner[id] = 0x80u | 40u; /* as if all others were in use */
        }
    }
    exchange_pass(&x, 1000);
    exchange_rx(&x, "620#01 3412 7856 BC9A");
    exchange_tx(&x, "320#81 20 3412 7856 BC9A");
}

static void test_stored_identities_that_cannot_be_are_left_out(void)
{
    pdcp_bind_t *bind = &x.arb->bus.bind;
    const pdcp_remembered_t good = {.identity = {1, 1, 1}, .node_id = 7};
    const pdcp_remembered_t same_id = {.identity = {1, 1, 2}, .node_id = 7};
    const pdcp_remembered_t same_identity = {.identity = {1, 1, 1}, .node_id = 8};
    const pdcp_remembered_t zero = {.identity = {1, 1, 3}, .node_id = 0};
    const pdcp_remembered_t last = {.identity = {1, 1, 3}, .node_id = 255};
    TEST_ASSERT_TRUE(pdcp_bind_remember_stored(bind, &good));
    TEST_ASSERT_FALSE(pdcp_bind_remember_stored(bind, &same_id));
    TEST_ASSERT_FALSE(pdcp_bind_remember_stored(bind, &same_identity));
    TEST_ASSERT_FALSE(pdcp_bind_remember_stored(bind, &zero));
    TEST_ASSERT_FALSE(pdcp_bind_remember_stored(bind, &last));
    TEST_ASSERT_EQUAL(1, bind->remembered_count);
}

/* D-BUS-6: the least recently used identity makes room. */
static void test_the_oldest_identity_is_forgotten_first(void)
{
    for (unsigned i = 0; i < PDCP_IDENTITIES_MAX; i++) {
        const pdcp_remembered_t entry = {.identity = {1, 1, (uint16_t)(i + 1)}, .node_id = (uint8_t)(i + 1)};
        TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&x.arb->bus.bind, &entry));
    }
    for (unsigned i = 0; i < PDCP_IDENTITIES_MAX; i++) {
        x.arb->bus.bind.remembered[i].node_id = (uint8_t)(i + 0x80); /* none that is asked for below */
    }
    exchange_add_output(&x, "FE");
    TEST_ASSERT_EQUAL(PDCP_IDENTITIES_MAX, x.arb->bus.bind.remembered_count);
    TEST_ASSERT_EQUAL(0x11, x.arb->bus.bind.remembered[0].node_id);
    TEST_ASSERT_EQUAL(0x80 + PDCP_IDENTITIES_MAX - 2,
                      x.arb->bus.bind.remembered[PDCP_IDENTITIES_MAX - 1].node_id);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_IDENTITIES));
}

/* As many devices as there are places bind, with the ids from first on. */
static void fill_the_bus(unsigned first)
{
    for (unsigned i = 0; i < PDCP_DEVICES_MAX; i++) {
        char request[40];
        (void)snprintf(request, sizeof request, "6%02X#01 0100 0100 %02X00", first + i, i + 1);
        exchange_rx(&x, request);
        (void)exchange_drain(&x);
    }
}

static void test_a_full_bus_refuses_with_id_0(void)
{
    fill_the_bus(1);
    exchange_rx(&x, "6C0#01 0900 0900 0900");
    exchange_tx(&x, "3C0#81 00 0900 0900 0900");
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_BIND_REFUSED));
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_REFUSED));
}

/* D-BUS-6: a suggested id stays reserved for its device, also when that is refused meanwhile. */
static void test_a_refused_device_keeps_its_reservation(void)
{
    exchange_rx(&x, "600#01 0900 0900 0900");
    exchange_tx(&x, "300#81 01 0900 0900 0900");
    fill_the_bus(2);
    exchange_rx(&x, "6C0#01 0900 0900 0900");
    exchange_tx(&x, "3C0#81 00 0900 0900 0900");
    pdcp_tables_remove(&x.arb->bus.tables, 31); /* it had 0x21 */
    exchange_rx(&x, "601#01 0200 0200 0200");
    exchange_tx(&x, "301#81 21 0200 0200 0200");
}

/* An identity asks for the id and, bound, is heard. */
static void bind_and_beacon(unsigned id)
{
    char text[40];
    (void)snprintf(text, sizeof text, "6%02X#01 0700 0700 %02X00", id, id);
    exchange_rx(&x, text);
    (void)snprintf(text, sizeof text, "0%02X#0A", id);
    exchange_rx(&x, text);
    (void)exchange_drain(&x);
}

/* D-BUS-43: identities that are not known hold at most three quarters of the places; who is remembered still
 * finds one. */
static void test_places_are_kept_for_known_identities(void)
{
    const pdcp_remembered_t known = {.identity = {1, 1, 1}, .node_id = 0x70};
    TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&x.arb->bus.bind, &known));
    exchange_pass(&x, 100); /* 600 ms after the start */
    for (unsigned id = 1; id <= PDCP_UNKNOWN_PLACES; id++) {
        bind_and_beacon(id);
    }
    exchange_rx(&x, "660#01 0900 0900 0900");
    exchange_tx(&x, "360#81 00 0900 0900 0900");
    exchange_rx(&x, "670#01 0100 0100 0100");
    exchange_tx(&x, "370#81 70 0100 0100 0100");
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_BIND_REFUSED));
}

/* D-BUS-43: a limb that powers up for the first time takes all places. */
static void test_all_places_are_free_at_the_start(void)
{
    for (unsigned id = 1; id <= PDCP_DEVICES_MAX; id++) {
        bind_and_beacon(id);
    }
    TEST_ASSERT_EQUAL(PDCP_DEVICES_MAX, pdcp_tables_count_devices(&x.arb->bus.tables));
}

static bool knows_one(void *ctx, const pdcp_identity_t *identity)
{
    (void)ctx;
    return identity->vid == 1 && identity->pid == 1 && identity->sn == 1;
}

/* D-BUS-43: so does a part of a stored configuration. */
static void test_places_are_kept_for_stored_identities(void)
{
    pdcp_arb_know(x.arb, knows_one);
    exchange_pass(&x, 100);
    for (unsigned id = 1; id <= PDCP_UNKNOWN_PLACES; id++) {
        bind_and_beacon(id);
    }
    exchange_rx(&x, "670#01 0100 0100 0100");
    exchange_tx(&x, "370#81 70 0100 0100 0100");
}

/* D-BUS-43: an unknown identity that is not heard for 300 ms after its grant is forgotten at once; a known
 * one is waited for as ever. */
static void test_an_unknown_identity_that_is_not_there_is_forgotten(void)
{
    const pdcp_remembered_t known = {.identity = {1, 1, 1}, .node_id = 0x70};
    TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&x.arb->bus.bind, &known));
    exchange_rx(&x, "670#01 0100 0100 0100");
    exchange_tx(&x, "370#81 70 0100 0100 0100");
    exchange_rx(&x, "620#01 3412 7856 BC9A");
    (void)exchange_drain(&x);
    exchange_pass(&x, 299);
    TEST_ASSERT_NOT_EQUAL(0, x.arb->bus.tables.owner[0x20]);
    exchange_pass(&x, 1);
    (void)exchange_drain(&x);
    TEST_ASSERT_EQUAL(0, x.arb->bus.tables.owner[0x20]);
    TEST_ASSERT_NOT_EQUAL(0, x.arb->bus.tables.owner[0x70]);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LOST));
    exchange_silence(&x);
}

/* D-BUS-43: it is remembered when its setup has ended, not when it asks. */
static void test_an_identity_is_remembered_when_it_is_set_up(void)
{
    exchange_rx(&x, "620#01 3412 7856 BC9A");
    exchange_rx(&x, "020#0A");
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_IDENTITIES));
    (void)exchange_drain(&x);
    exchange_add_output(&x, "FE");
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_IDENTITIES));
}

static void test_without_a_node_id_it_is_refused(void)
{
    memset(&x.arb->bus.tables.owner[1], 0x80 | 40, 254);
    exchange_rx(&x, "6C0#01 0900 0900 0900");
    exchange_tx(&x, "3C0#81 00 0900 0900 0900");
}

/* D-BUS-6: the bound device is asked once for parameter 1; an answer means that the asking one is another. */
static void test_a_second_device_with_the_same_identity_is_refused(void)
{
    exchange_add_output(&x, "FE");
    exchange_rx(&x, "620#01 0200 0200 0400");
    exchange_tx(&x, "311#03 01 00");
    exchange_silence(&x); /* not answered yet */
    exchange_rx(&x, "211#83 01 01 00 0200 0200");
    exchange_tx(&x, "320#81 00 0200 0200 0400");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_BIND_DUPLICATE));
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_DUPLICATE));
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LOST));
}

/* D-BUS-6, D-BUS-41: two tries without an answer mean that it was reset: granted again and set up afresh. */
static void test_a_device_that_was_reset_is_granted_again(void)
{
    exchange_add_output(&x, "FE");
    exchange_clear(&x);
    exchange_rx(&x, "611#01 0200 0200 0400");
    exchange_tx(&x, "311#03 01 00");
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#03 01 00");
    exchange_pass(&x, 99);
    exchange_silence(&x);
    exchange_pass(&x, 1);
    exchange_tx(&x, "311#81 11 0200 0200 0400");
    exchange_tx(&x, "311#03 01 00");
    TEST_ASSERT_EQUAL(
        1, exchange_count(&x, PDCP_EVENT_LOST)); /* the host sees it go, and come with its beacon */
    exchange_rx(&x, "011#0A");
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_BOUND));
}

static void test_a_device_that_was_reset_and_asks_for_another_id_gets_its_own_suggested(void)
{
    exchange_add_output(&x, "FE");
    exchange_rx(&x, "699#01 0200 0200 0400");
    exchange_check_fails(&x, "11");
    exchange_tx(&x, "399#81 11 0200 0200 0400");
}

/* D-BUS-41: any frame of priority 0 to 2 from the bound id shows that its owner is alive; one of its output
 * does not. */
static void test_any_frame_from_its_id_answers_for_a_device(void)
{
    static const char *const frames[] = {"011#0A", "211#0F 01", "411#55", "211#84 01 04 01"};
    exchange_add_output(&x, "FE");
    for (unsigned i = 0; i < sizeof frames / sizeof frames[0]; i++) {
        exchange_rx(&x, "620#01 0200 0200 0400");
        exchange_tx(&x, "311#03 01 00");
        exchange_rx(&x, "0FE#11 22");
        exchange_silence(&x);
        exchange_rx(&x, frames[i]);
        if (frames[i][4] == '0' && frames[i][5] == 'F') {
            exchange_tx(&x, "311#8F 00 01"); /* by identifier */
        }
        exchange_tx(&x, "320#81 00 0200 0200 0400");
        exchange_silence(&x);
    }
    TEST_ASSERT_EQUAL(4, stat_of(PDCP_STAT_BIND_DUPLICATE));
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LOST));
}

/* D-BUS-41: a host's frame that no device need answer shows nothing; the identity is asked all the same. */
static void test_silence_to_a_hosts_frame_is_no_check(void)
{
    static uint8_t frame[8] = {0x55};
    exchange_add_output(&x, "FE");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_passthrough(x.arb, 0, frame, 1));
    exchange_tx(&x, "311#55");
    exchange_rx(&x, "620#01 0200 0200 0400");
    for (int tries = 1; tries < PDCP_TRIES; tries++) {
        exchange_pass(&x, PDCP_ACK_MS);
        exchange_tx(&x, "311#55");
    }
    exchange_pass(&x, PDCP_ACK_MS);
    exchange_tx(&x, "311#03 01 00");
    exchange_rx(&x, "211#83 01 01 00 0200 0200");
    exchange_tx(&x, "320#81 00 0200 0200 0400");
}

/* The grant was lost on the way: the device asks again while the arbitrator tries to set it up. */
static void test_a_lost_grant_is_repeated(void)
{
    exchange_rx(&x, "611#01 0200 0200 0400");
    exchange_tx(&x, "311#81 11 0200 0200 0400");
    (void)exchange_drain(&x);
    exchange_pass(&x, 250);
    (void)exchange_drain(&x);
    exchange_rx(&x, "611#01 0200 0200 0400");
    exchange_pass(&x, 50); /* the third try of the setup's request has failed */
    exchange_tx(&x, "311#81 11 0200 0200 0400");
}

static void test_what_is_no_bind_request_is_counted(void)
{
    exchange_rx(&x, "611#01 0200 0200 04");      /* 6 bytes */
    exchange_rx(&x, "611#01 0200 0200 0400 00"); /* 8 bytes */
    TEST_ASSERT_EQUAL(2, stat_of(PDCP_STAT_DROP_BAD_DLC));
    exchange_rx(&x, "611#0A");
    exchange_rx(&x, "611#");
    TEST_ASSERT_EQUAL(2, stat_of(PDCP_STAT_DROP_BINDING));
    exchange_rx(&x, "711#01 0200 0200 0400"); /* P=3 M=1 [PDCP figure 2.3] */
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_DROP_UNUSED_ID));
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_devices(&x.arb->bus.tables));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_free_id_is_granted);
    RUN_TEST(test_a_device_counts_from_its_first_beacon);
    RUN_TEST(test_a_taken_id_leads_to_a_suggestion);
    RUN_TEST(test_0_and_255_get_a_suggestion);
    RUN_TEST(test_a_suggested_id_is_reserved);
    RUN_TEST(test_asking_again_gets_the_same_suggestion);
    RUN_TEST(test_an_identity_keeps_its_id);
    RUN_TEST(test_a_remembered_id_is_given_away_last);
    RUN_TEST(test_stored_identities_that_cannot_be_are_left_out);
    RUN_TEST(test_the_oldest_identity_is_forgotten_first);
    RUN_TEST(test_a_full_bus_refuses_with_id_0);
    RUN_TEST(test_a_refused_device_keeps_its_reservation);
    RUN_TEST(test_places_are_kept_for_known_identities);
    RUN_TEST(test_places_are_kept_for_stored_identities);
    RUN_TEST(test_all_places_are_free_at_the_start);
    RUN_TEST(test_an_unknown_identity_that_is_not_there_is_forgotten);
    RUN_TEST(test_an_identity_is_remembered_when_it_is_set_up);
    RUN_TEST(test_without_a_node_id_it_is_refused);
    RUN_TEST(test_a_second_device_with_the_same_identity_is_refused);
    RUN_TEST(test_a_device_that_was_reset_is_granted_again);
    RUN_TEST(test_a_device_that_was_reset_and_asks_for_another_id_gets_its_own_suggested);
    RUN_TEST(test_any_frame_from_its_id_answers_for_a_device);
    RUN_TEST(test_silence_to_a_hosts_frame_is_no_check);
    RUN_TEST(test_a_lost_grant_is_repeated);
    RUN_TEST(test_what_is_no_bind_request_is_counted);
    return UNITY_END();
}
