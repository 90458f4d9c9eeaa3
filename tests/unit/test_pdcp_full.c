/* Tables and queues that are full, setups that fail, and what then becomes of node ids (pdcp-bus.md 3, 5, 6);
 * with hand-written frames. */
#include <string.h>

#include "talk.h"
#include "unity.h"

void setUp(void)
{
    talk_reset();
}

void tearDown(void) {}

/* --- node ids --- */

static void in_use(unsigned first, unsigned last)
{
    for (unsigned id = first; id <= last; id++) {
        if (talk.arb->bus.tables.owner[id] == 0) {
            talk.arb->bus.tables.owner[id] = 0x80u | 40u;
        }
    }
}

static void remember(uint16_t serial, uint8_t id)
{
    const pdcp_remembered_t entry = {.identity = {2, 2, serial}, .node_id = id};
    TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&talk.arb->bus.bind, &entry));
}

static void test_stored_identities_beyond_the_table_are_left_out(void)
{
    const pdcp_remembered_t more = {.identity = {2, 2, 100}, .node_id = 100};
    for (uint8_t i = 1; i <= PDCP_IDENTITIES_MAX; i++) {
        remember(i, i);
    }
    TEST_ASSERT_FALSE(pdcp_bind_remember_stored(&talk.arb->bus.bind, &more));
    talk_asks_for(0x63, PDCP_IDENTITIES_MAX); /* the last one that fitted */
    talk_is_told(0x63, PDCP_IDENTITIES_MAX, PDCP_IDENTITIES_MAX);
}

/* D-BUS-6: the old id, while that id is free. It is not: another one, remembered from then on. */
static void test_an_identity_whose_id_is_in_use_gets_another(void)
{
    remember(5, 0x20);
    in_use(0x20, 0x20);
    talk_asks_for(0x20, 5);
    talk_is_told(0x20, 1, 5);
    exchange_silence(&talk);
    talk_asks_for(1, 5);
    talk_is_told(1, 1, 5);
    TEST_ASSERT_EQUAL(0x20, talk.arb->bus.bind.remembered[0].node_id); /* until it is set up (D-BUS-43) */
    talk_set_up(1, 5, "o", 0xFE);
    TEST_ASSERT_EQUAL(1, talk.arb->bus.bind.remembered_count);
    TEST_ASSERT_EQUAL(1, talk.arb->bus.bind.remembered[0].node_id);
}

static void test_a_remembered_id_in_use_is_given_to_nobody(void)
{
    remember(5, 0x20);
    in_use(PDCP_NODE_MIN, PDCP_NODE_MAX);
    talk_asks_for(0x30, 6);
    talk_is_told(0x30, 0, 6);
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_REFUSED));
}

/* D-BUS-6: more suggestions at a time than can be kept: the one that would end first makes room. */
static void test_the_suggestion_that_ends_first_makes_room(void)
{
    for (unsigned i = 1; i <= PDCP_RESERVED_MAX; i++) {
        talk_asks_for(0, i);
        talk_is_told(0, i, i);
        exchange_wait(&talk, 1);
    }
    talk_asks_for(0, 1); /* again: its suggestion holds for another second */
    talk_is_told(0, 1, 1);
    exchange_wait(&talk, 1);
    talk_asks_for(0, 0x40);
    talk_is_told(0, PDCP_RESERVED_MAX + 1, 0x40);
    talk_asks_for(2, 0x41); /* free again */
    talk_is_told(2, 2, 0x41);
    talk_asks_for(1, 0x42); /* still kept */
    talk_is_told(1, PDCP_RESERVED_MAX + 2, 0x42);
}

/* D-BUS-24: outputs count downwards from 254; D-BUS-6: which is kept here for a device that was told it. */
static void test_an_output_does_not_get_a_reserved_id(void)
{
    talk_bind(0x11, 4);
    talk_to(0x11, "03 01 00");
    in_use(PDCP_NODE_MIN, 0xFD);
    talk_asks_for(0x20, 5);
    talk_is_told(0x20, 0xFE, 5);
    talk.arb->bus.tables.owner[0xFD] = 0;
    exchange_pass(&talk, 100); /* the setup's question once more */
    talk_set_up(0x11, 4, "o", 0xFD);
    talk_asks_for(0xFE, 5);
    talk_is_told(0xFE, 0xFE, 5);
}

/* D-BUS-6: the id of an absent identity, when no other one is left. */
static void test_an_output_gets_a_remembered_id_last(void)
{
    remember(5, 0x20);
    in_use(0x12, 0x1F);
    in_use(0x21, PDCP_NODE_MAX);
    in_use(PDCP_NODE_MIN, 0x10);
    talk_add(0x11, 4, "o", 0x20);
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_READY));
}

static void test_without_a_node_id_for_its_output_a_setup_fails(void)
{
    talk_bind(0x11, 4);
    in_use(PDCP_NODE_MIN, PDCP_NODE_MAX);
    talk_set_up_device(0x11, 4, 1);
    talk_set_up_directions(0x11, "o");
    talk_read(0x11, 1, 1, "0050 2021");
    talk_read(0x11, 9, 1, NULL);
    talk_read(0x11, 10, 1, NULL);
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(1, talk.arb->bus.stats[PDCP_STAT_NO_ROOM]);
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_SETUP_FAILED));
}

/* --- setup --- */

/* 40 inputs: two strings of 5 talk_bytes for each of 40 channels are more than is kept (D-BUS-17). */
static void test_more_required_channels_than_there_is_room_for(void)
{
    char channels[41];
    memset(channels, 'i', 40);
    channels[40] = '\0';
    TEST_ASSERT_LESS_THAN(400, PDCP_NEEDS_BYTES);
    talk_bind(0x11, 4);
    talk_set_up_device(0x11, 4, 40);
    talk_set_up_directions(0x11, channels);
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(1, talk.arb->bus.stats[PDCP_STAT_NO_ROOM]);
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_SETUP_FAILED));
    talk_add(0x12, 6, "o", 0xFE); /* others are set up all the same */
}

static void refuses_five_times(void)
{
    for (int i = 0; i < 5; i++) {
        talk_answered(0x11, "03 01 00", "83 00 01 00");
        exchange_silence(&talk);
        if (i < 4) {
            exchange_pass(&talk, 250);
        }
    }
}

/* D-BUS-17: it fails again: not reported again, and tried again all the same. */
static void test_a_setup_that_keeps_failing_is_reported_once(void)
{
    talk_bind(0x11, 4);
    for (int round = 0; round < 3; round++) {
        refuses_five_times();
        TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_SETUP_FAILED));
        TEST_ASSERT_EQUAL(1, talk.arb->bus.stats[PDCP_STAT_SETUP_FAILED]);
        for (int i = 0; i < 5; i++) {
            talk_beacon(0x11);
            exchange_silence(&talk);
            exchange_pass(&talk, 1000);
        }
    }
    TEST_ASSERT_EQUAL(0, exchange_count(&talk, PDCP_EVENT_READY));
    talk_set_up(0x11, 4, "o", 0xFE);
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_READY));
}

/* pdcp-bus.md 4: a value may be longer than its field; here type and profile in two packets. */
static void test_a_long_number_comes_by_bulk(void)
{
    talk_bind(0x11, 4);
    talk_read(0x11, 1, 0, "0200 0200");
    talk_read(0x11, 2, 0, "0400");
    talk_answered(0x11, "03 06 00", "83 02 06 00");
    talk_answered(0x11, "0C 06 00", "8C 01 06 00 0800");
    talk_from(0x11, "0E 00 3412 7856 AAAA");
    talk_answered(0x11, "8E 01", "0E 01 BBBB");
    talk_to(0x11, "8E 01");
    talk_to(0x11, "03 0B 00");
    TEST_ASSERT_EQUAL_HEX16(0x1234, talk.arb->bus.tables.devices[0].type);
    TEST_ASSERT_EQUAL_HEX16(0x5678, talk.arb->bus.tables.devices[0].profile);
}

/* D-BUS-6, D-BUS-23: the identity asks again in the middle of a transfer; its end is the answer that shows
 * that the bound device is there. */
static void test_a_transfer_answers_for_its_device(void)
{
    talk_bind(0x11, 4);
    talk_set_up_device(0x11, 4, 1);
    talk_set_up_directions(0x11, "o");
    talk_read(0x11, 1, 1, "0050 2021");
    talk_answered(0x11, "03 09 01", "83 02 09 01");
    talk_answered(0x11, "0C 09 01", "8C 01 09 01 0800");
    talk_asks_for(0x20, 4);
    exchange_silence(&talk);
    talk_from(0x11, "0E 00 000000000000");
    talk_to(0x11, "8E 01");
    talk_is_told(0x20, 0, 4);
    talk_from(0x11, "0E 01 0000");
    talk_to(0x11, "8E 01");
    talk_to(0x11, "03 0A 01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(1, talk.arb->bus.stats[PDCP_STAT_BIND_DUPLICATE]);
}

/* --- a full queue, and standby --- */

/* With what is more urgent than anything that the arbitrator says to a device. */
static void fill_queue(void)
{
    const can_frame_t filler = exchange_frame("1FF#00");
    while (pdcp_txq_put(&talk.arb->bus.txq, &filler) == PDCP_TXQ_TAKEN) {
    }
}

static void test_a_reset_that_finds_no_room_is_not_counted_as_sent(void)
{
    exchange_pass(&talk, 1200);
    fill_queue();
    talk_beacon(0x42);
    TEST_ASSERT_EQUAL(0, talk.arb->bus.stats[PDCP_STAT_UNKNOWN_RESET]);
    TEST_ASSERT_EQUAL(1, talk.arb->bus.stats[PDCP_STAT_TX_FULL]);
    (void)exchange_drain(&talk);
    exchange_pass(&talk, 1000);
    talk_beacon(0x42);
    talk_to(0x42, "0B");
    TEST_ASSERT_EQUAL(1, talk.arb->bus.stats[PDCP_STAT_UNKNOWN_RESET]);
}

static void test_what_is_for_all_needs_room_and_an_arbitrator_that_speaks(void)
{
    fill_queue();
    TEST_ASSERT_FALSE(pdcp_arb_broadcast(talk.arb, PDCP_SUSPEND, 0));
    (void)exchange_drain(&talk);
    exchange_meet_server(&talk);
    TEST_ASSERT_FALSE(pdcp_arb_broadcast(talk.arb, PDCP_SUSPEND, 0));
    exchange_silence(&talk);
}

/* D-BUS-42: a link that a device has asked for is nothing that the host waits for. */
static void test_going_silent_ends_a_devices_link_without_a_word(void)
{
    talk_add_two();
    exchange_meet_rival(&talk);
    talk_from(0x12, "0F 01");
    talk_to(0x12, "03 05 01");
    exchange_rx(&talk, "100#0A");
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_SILENT));
    TEST_ASSERT_EQUAL(0, exchange_count(&talk, PDCP_EVENT_LINK_REQUEST));
    exchange_silence(&talk);
}

static void test_going_silent_ends_a_request_that_has_not_begun(void)
{
    talk_add_two();
    exchange_meet_rival(&talk);
    talk_from(0x12, "0F 01");
    talk_to(0x12, "03 05 01");
    talk_ask_link(0, 1);
    exchange_rx(&talk, "100#0A");
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&talk, PDCP_EVENT_LINK_REQUEST)->status);
    exchange_silence(&talk);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_stored_identities_beyond_the_table_are_left_out);
    RUN_TEST(test_an_identity_whose_id_is_in_use_gets_another);
    RUN_TEST(test_a_remembered_id_in_use_is_given_to_nobody);
    RUN_TEST(test_the_suggestion_that_ends_first_makes_room);
    RUN_TEST(test_an_output_does_not_get_a_reserved_id);
    RUN_TEST(test_an_output_gets_a_remembered_id_last);
    RUN_TEST(test_without_a_node_id_for_its_output_a_setup_fails);
    RUN_TEST(test_more_required_channels_than_there_is_room_for);
    RUN_TEST(test_a_setup_that_keeps_failing_is_reported_once);
    RUN_TEST(test_a_long_number_comes_by_bulk);
    RUN_TEST(test_a_transfer_answers_for_its_device);
    RUN_TEST(test_a_reset_that_finds_no_room_is_not_counted_as_sent);
    RUN_TEST(test_what_is_for_all_needs_room_and_an_arbitrator_that_speaks);
    RUN_TEST(test_going_silent_ends_a_devices_link_without_a_word);
    RUN_TEST(test_going_silent_ends_a_request_that_has_not_begun);
    return UNITY_END();
}
