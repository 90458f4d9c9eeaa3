/* Links that the host asks for, among other jobs and losses (pdcp-bus.md 8); with hand-written frames. */
#include <stdio.h>

#include "pdcp_link.h"
#include "talk.h"
#include "unity.h"

void setUp(void)
{
    talk_reset();
}

void tearDown(void) {}

static void test_what_else_cannot_be_a_link(void)
{
    talk_add_two();
    talk_add(0x13, 9, "oi", 0xFD);
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(talk.arb, talk_number(0, 1), PDCP_NONE));
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN,
                      pdcp_arb_connect(talk.arb, talk_number(0, 1), 100)); /* a free entry */
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(talk.arb, talk_number(0, 1), talk_number(2, 1)));
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(talk.arb, 100, talk_number(1, 1)));
    TEST_ASSERT_EQUAL(PDCP_ERR_OWN,
                      pdcp_arb_connect(talk.arb, talk_number(2, 1), talk_number(2, 2))); /* D-API-6 */
    exchange_silence(&talk);
}

static void remove_link(uint8_t place, unsigned id)
{
    pdcp_link_remove(&talk.arb->bus, talk_number(place, 1));
    talk_wrote(id, 4, 1, "00");
    talk_wrote(id, 7, 1, "00 00");
    talk_wrote(id, 8, 1, "0000 0000");
    talk_wrote(id, 6, 1, "FFFF FF");
    talk_wrote(id, 5, 1, "FFFF FFFF");
}

/* pdcp-bus.md 8: the output's transfer enabled 1 with its first link, 0 when its last link goes. */
static void test_an_output_goes_on_while_somebody_listens(void)
{
    talk_add_two_linked();
    talk_add(0x13, 9, "i", 0);
    talk_ask_link(0, 2);
    talk_link_input(0x13, 4, 0x11, 0xFE);
    exchange_silence(&talk); /* enabled already */
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(2, 1)->link);
    remove_link(1, 0x12);
    exchange_silence(&talk);
    TEST_ASSERT_TRUE(talk_channel(0, 1)->enabled);
    remove_link(2, 0x13);
    talk_wrote(0x11, 4, 1, "00");
    exchange_silence(&talk);
    TEST_ASSERT_FALSE(talk_channel(0, 1)->enabled);
}

/* pdcp-bus.md 8: undone in reverse; a device that refuses that too does not stop the rest. */
static void test_an_undo_that_is_refused_goes_on(void)
{
    talk_add_two();
    talk_ask_link(0, 1);
    talk_wrote(0x12, 5, 1, "0200 0200");
    talk_refused(0x12, 6, 1, "0400 01");
    talk_refused(0x12, 6, 1, "FFFF FF");
    talk_wrote(0x12, 5, 1, "FFFF FFFF");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&talk, PDCP_EVENT_LINK_REQUEST)->status);
}

/* A second listener that refuses is none of the first one's business. */
static void test_a_refused_second_listener_leaves_the_first(void)
{
    talk_add_two_linked();
    talk_add(0x13, 9, "i", 0);
    talk_ask_link(0, 2);
    talk_refused(0x13, 5, 1, "0200 0200");
    talk_wrote(0x13, 5, 1, "FFFF FFFF");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&talk, PDCP_EVENT_LINK_REQUEST)->status);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(1, 1)->link);
    TEST_ASSERT_TRUE(talk_channel(0, 1)->enabled);
}

/* Its channels are known from before, but it was reset and is being set up again. */
static void test_no_link_with_a_device_in_its_setup(void)
{
    talk_add_two();
    talk_add(0x13, 9, "i", 0);
    talk_asks_for(0x12, 6);
    exchange_check_fails(&talk, "12");
    talk_is_told(0x12, 0x12, 6);
    talk_to(0x12, "03 01 00");
    talk_ask_link(0, 1);
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&talk, PDCP_EVENT_LINK_REQUEST)->status);
    talk_asks_for(0x11, 4);
    talk_to(0x11, "03 01 00");
    exchange_pass(&talk, 99);
    talk_from(0x12, "83 01 01 00 0200 0200");
    talk_to(0x12, "03 02 00");
    exchange_pass(&talk, 1);
    talk_to(0x11, "03 01 00");
    exchange_pass(&talk, 98);
    talk_from(0x12, "83 01 02 00 0600");
    talk_to(0x12, "03 06 00");
    exchange_pass(&talk, 2);
    talk_is_told(0x11, 0x11, 4);
    talk_to(0x11, "03 01 00");
    talk_ask_link(0, 2);
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&talk, PDCP_EVENT_LINK_REQUEST)->status);
    TEST_ASSERT_EQUAL(2, exchange_count(&talk, PDCP_EVENT_LINK_REQUEST));
    TEST_ASSERT_EQUAL(0, talk.arb->bus.stats[PDCP_STAT_LINK_FAILED]); /* not even begun */
}

/* Every write is answered with success until no more come; what devices 11h and 12h were told last about
 * input and output 1 of theirs. */
static void agree(uint8_t *output_enabled, uint8_t *input_enabled)
{
    const can_frame_t *frame;
    exchange_step(&talk);
    while ((frame = pdcp_arb_tx_peek(talk.arb)) != NULL) {
        char answer[16];
        const unsigned id = frame->id & 0xFFu;
        TEST_ASSERT_EQUAL_HEX8(0x04, frame->data[0]);
        if (frame->data[1] == 4) {
            *(id == 0x11 ? output_enabled : input_enabled) = frame->data[3];
        }
        (void)snprintf(answer, sizeof answer, "84 01 %02X %02X", frame->data[1], frame->data[2]);
        pdcp_arb_tx_pop(talk.arb);
        talk_from(id, answer);
    }
}

/* The link request has failed: device 12h is to hear 11h again, in the end. */
static void old_link_comes_back(void)
{
    uint8_t output_enabled = 1;
    uint8_t input_enabled = 0;
    agree(&output_enabled, &input_enabled);
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&talk, PDCP_EVENT_LINK_REQUEST)->status);
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_LINK_REQUEST));
    TEST_ASSERT_EQUAL(1, output_enabled);
    TEST_ASSERT_EQUAL(1, input_enabled);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(1, 1)->link);
    TEST_ASSERT_EQUAL(4, talk_channel(1, 1)->source.identity.sn);
    TEST_ASSERT_FALSE(talk_channel(2, 1)->enabled);
}

/* A new source is refused: the old one is named again, and the link made anew. */
static void test_a_source_that_could_not_be_replaced_comes_back(void)
{
    talk_add_two_linked();
    talk_add(0x13, 9, "o", 0xFD);
    talk_ask_link(2, 1);
    talk_wrote(0x12, 4, 1, "00");
    talk_wrote(0x12, 5, 1, "0200 0200");
    talk_refused(0x12, 6, 1, "0900 01");
    talk_wrote(0x12, 6, 1, "0400 01");
    talk_wrote(0x12, 5, 1, "0200 0200");
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, talk_channel(1, 1)->link);
    old_link_comes_back();
}

/* The same when the input does not let itself be disabled: nothing is to be undone. */
static void test_an_input_that_stays_enabled_keeps_its_source(void)
{
    talk_add_two_linked();
    talk_add(0x13, 9, "o", 0xFD);
    talk_ask_link(2, 1);
    talk_refused(0x12, 4, 1, "00");
    old_link_comes_back();
}

static void test_an_output_lost_before_its_turn_ends_the_request(void)
{
    talk_add_two();
    talk_add(0x13, 9, "o", 0xFD);
    talk_from(0x12, "0F 01");
    talk_to(0x12, "03 05 01");
    talk_ask_link(2, 1);
    talk_lose(2, 0x13);
    talk_from(0x12, "83 01 05 01 FFFF FFFF");
    talk_read(0x12, 6, 1, "FFFF FF");
    talk_to(0x12, "8F 00 01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&talk, PDCP_EVENT_LINK_REQUEST)->status);
}

static void test_an_input_lost_before_its_turn_ends_the_request(void)
{
    talk_add_two();
    talk_add(0x13, 9, "i", 0);
    talk_from(0x12, "0F 01");
    talk_to(0x12, "03 05 01");
    talk_ask_link(0, 2);
    talk_lose(2, 0x13);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&talk, PDCP_EVENT_LINK_REQUEST)->status);
    talk_from(0x12, "83 01 05 01 FFFF FFFF");
    talk_read(0x12, 6, 1, "FFFF FF");
    talk_to(0x12, "8F 00 01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_LINK_REQUEST));
}

/* D-BUS-14: at once; what the host asks for comes behind it. */
static void test_silencing_comes_before_a_request(void)
{
    talk_add_two_linked();
    talk_add(0x13, 9, "i", 0);
    talk_add(0x14, 10, "o", 0xFD);
    talk_from(0x13, "0F 01");
    talk_to(0x13, "03 05 01");
    talk_ask_link(3, 2);
    talk_lose(0, 0x11);
    talk_from(0x13, "83 01 05 01 FFFF FFFF");
    talk_answered(0x13, "03 06 01", "83 01 06 01 FFFF FF");
    talk_to(0x12, "04 04 01 00");
    talk_to(0x13, "8F 00 01");
    talk_from(0x12, "84 01 04 01");
    talk_wrote(0x12, 7, 1, "00 00");
    talk_link_input(0x13, 10, 0x14, 0xFD);
    talk_wrote(0x14, 4, 1, "01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(2, 1)->link);
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&talk, PDCP_EVENT_LINK_REQUEST)->status);
}

/* The same before what a device has asked for. */
static void test_silencing_comes_before_an_update(void)
{
    talk_add_two();
    talk_add(0x13, 9, "i", 0);
    talk_ask_link(0, 2);
    talk_link_input(0x13, 4, 0x11, 0xFE);
    talk_wrote(0x11, 4, 1, "01");
    talk_add(0x14, 10, "i", 0);
    talk_from(0x14, "0F 01");
    talk_to(0x14, "03 05 01");
    talk_from(0x12, "0F 01");
    talk_lose(0, 0x11);
    talk_from(0x14, "83 01 05 01 FFFF FFFF");
    talk_answered(0x14, "03 06 01", "83 01 06 01 FFFF FF");
    talk_to(0x13, "04 04 01 00");
    talk_to(0x14, "8F 00 01");
    exchange_silence(&talk);
    talk_from(0x13, "84 01 04 01");
    talk_wrote(0x13, 7, 1, "00 00");
    talk_read(0x12, 5, 1, "FFFF FFFF");
    talk_read(0x12, 6, 1, "FFFF FF");
    talk_to(0x12, "8F 00 01");
    exchange_silence(&talk);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_else_cannot_be_a_link);
    RUN_TEST(test_an_output_goes_on_while_somebody_listens);
    RUN_TEST(test_an_undo_that_is_refused_goes_on);
    RUN_TEST(test_a_refused_second_listener_leaves_the_first);
    RUN_TEST(test_no_link_with_a_device_in_its_setup);
    RUN_TEST(test_a_source_that_could_not_be_replaced_comes_back);
    RUN_TEST(test_an_input_that_stays_enabled_keeps_its_source);
    RUN_TEST(test_an_output_lost_before_its_turn_ends_the_request);
    RUN_TEST(test_an_input_lost_before_its_turn_ends_the_request);
    RUN_TEST(test_silencing_comes_before_a_request);
    RUN_TEST(test_silencing_comes_before_an_update);
    return UNITY_END();
}
