/* Links that devices ask for by Update Data Channel (pdcp-bus.md 7); with hand-written frames. */
#include "talk.h"
#include "unity.h"

void setUp(void)
{
    talk_reset();
}

void tearDown(void) {}

static void test_a_source_in_its_setup_is_not_there_yet(void)
{
    talk_add(0x12, 6, "i", 0);
    talk_bind(0x11, 4);
    talk_to(0x11, "03 01 00");
    talk_update(0x12, "0200 0200", "0400 01");
    talk_to(0x12, "8F 00 01");
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, talk_channel(0, 1)->link);
    exchange_silence(&talk);
    exchange_pass(&talk, 100); /* the setup's question once more */
    talk_set_up(0x11, 4, "o", 0xFE);
    talk_link_input(0x12, 4, 0x11, 0xFE);
    talk_wrote(0x11, 4, 1, "01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(0, 1)->link);
}

/* Its own output (D-API-6), an output and an input that are none, and channel index 0, which is the
 * device. */
static void test_sources_that_cannot_be(void)
{
    talk_add_two();
    talk_add(0x13, 9, "io", 0xFD);
    talk_update(0x13, "0200 0200", "0900 02");
    talk_to(0x13, "8F 00 01");
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, talk_channel(2, 1)->link);
    talk_update(0x13, "0200 0200", "0400 02");
    talk_to(0x13, "8F 00 01");
    talk_update(0x13, "0200 0200", "0600 01");
    talk_to(0x13, "8F 00 01");
    talk_update(0x13, "0200 0200", "0400 00");
    talk_to(0x13, "8F 00 01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_NONE, talk_channel(2, 1)->link);
}

/* The device of a remembered link is back and asks while it is being set up: it is linked once, when it is
 * ready, and answered. */
static void test_an_update_during_the_setup_waits_for_its_end(void)
{
    talk_add_two_linked();
    talk_lose(1, 0x12);
    talk_wrote(0x11, 4, 1, "00");
    talk_bind(0x12, 6);
    talk_set_up_device(0x12, 6, 1);
    talk_set_up_directions(0x12, "i");
    talk_to(0x12, "03 01 01");
    talk_from(0x12, "0F 01");
    exchange_silence(&talk);
    talk_from(0x12, "83 01 01 01 0053 1011");
    for (unsigned param = 5; param <= 11; param++) {
        if (param != 7) {
            talk_read(0x12, param, 1, NULL);
        }
    }
    talk_read(0x12, 5, 1, "0200 0200");
    talk_read(0x12, 6, 1, "0400 01");
    talk_link_input(0x12, 4, 0x11, 0xFE);
    talk_wrote(0x11, 4, 1, "01");
    talk_to(0x12, "8F 01 01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(1, 1)->link);
}

/* It was reset in the middle of what it had asked for: it is bound again and gets no answer. */
static void test_a_device_reset_during_its_update_is_not_answered(void)
{
    talk_add_two();
    talk_from(0x12, "0F 01");
    talk_to(0x12, "03 05 01");
    talk_asks_for(0x12, 6);
    for (int i = 0; i < 2; i++) {
        exchange_pass(&talk, 100);
        talk_to(0x12, "03 05 01");
    }
    exchange_pass(&talk, 100);
    talk_is_told(0x12, 0x12, 6);
    talk_to(0x12, "03 01 00");
    exchange_silence(&talk);
}

/* D-BUS-19: a device may have changed its mind: it names a source that is not there. D-BUS-22: what it heard
 * so far it must not go on hearing. */
static void test_an_update_that_names_another_source_ends_the_link(void)
{
    talk_add_two_linked();
    talk_update(0x12, "0200 0200", "0900 01");
    talk_wrote(0x11, 4, 1, "00"); /* nobody listens any more */
    talk_to(0x12, "8F 00 01");
    talk_wrote(0x12, 4, 1, "00");
    talk_wrote(0x12, 7, 1, "00 00");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, talk_channel(1, 1)->link);
    TEST_ASSERT_FALSE(talk_channel(0, 1)->enabled);
}

/* D-BUS-26: a link that was refused waits for the next change, which is none of others'. */
static void test_a_refused_link_waits(void)
{
    talk_add_two();
    talk_update(0x12, "0200 0200", "0400 01");
    talk_refused(0x12, 5, 1, "0200 0200");
    talk_wrote(0x12, 5, 1, "0200 0200");
    talk_to(0x12, "8F 00 01");
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, talk_channel(1, 1)->link);
    talk_add(0x13, 9, "o", 0xFD);
    exchange_silence(&talk);
    talk_ask_link(2, 1); /* the host wants another source; the first one's output was never enabled */
    talk_link_input(0x12, 9, 0x13, 0xFD);
    talk_wrote(0x13, 4, 1, "01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(1, 1)->link);
    TEST_ASSERT_EQUAL(9, talk_channel(1, 1)->source.identity.sn);
}

/* Both ends are gone; the input is back first. */
static void test_an_input_waits_for_its_source(void)
{
    talk_add_two_linked();
    talk_lose(0, 0x11);
    talk_wrote(0x12, 4, 1, "00");
    talk_wrote(0x12, 7, 1, "00 00");
    talk_lose(1, 0x12);
    talk_add(0x12, 6, "i", 0);
    talk_add(0x13, 9, "o", 0xFD); /* an unknown device to it */
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, talk_channel(1, 1)->link);
    talk_add(0x11, 4, "o", 0xFE);
    talk_link_input(0x12, 4, 0x11, 0xFE);
    talk_wrote(0x11, 4, 1, "01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(1, 1)->link);
}

/* What was the source is an input when its device comes back: not linked, and the output's node id is
 * free. */
static void test_a_source_that_comes_back_as_an_input(void)
{
    talk_add_two_linked();
    talk_lose(0, 0x11);
    talk_wrote(0x12, 4, 1, "00");
    talk_wrote(0x12, 7, 1, "00 00");
    talk_bind(0x11, 4);
    talk_set_up(0x11, 4, "i", 0);
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, talk_channel(1, 1)->link);
    TEST_ASSERT_EQUAL(PDCP_INPUT, talk_channel(0, 1)->transfer);
    talk_add(0x13, 9, "o", 0xFD); /* a freed id is given out last (D-BUS-36) */
    exchange_silence(&talk);
}

/* A source with two listeners comes back and goes again while they are linked: the one under way is undone,
 * the other is left alone, and both are linked in the end. */
static void test_a_source_that_comes_and_goes(void)
{
    talk_add_two_linked();
    talk_add(0x13, 9, "i", 0);
    talk_ask_link(0, 2);
    talk_link_input(0x13, 4, 0x11, 0xFE);
    talk_lose(0, 0x11);
    for (unsigned id = 0x12; id <= 0x13; id++) {
        talk_wrote(id, 4, 1, "00");
        talk_wrote(id, 7, 1, "00 00");
    }
    talk_add(0x11, 4, "o", 0xFE);
    talk_wrote(0x12, 5, 1, "0200 0200");
    talk_to(0x12, "04 06 01 0400 01");
    talk_lose(0, 0x11);
    talk_from(0x12, "84 01 06 01");
    talk_wrote(0x12, 8, 1, "0050 2021");
    talk_wrote(0x12, 7, 1, "00 00");
    talk_wrote(0x12, 8, 1, "0050 2021");
    talk_wrote(0x12, 6, 1, "0400 01");
    talk_wrote(0x12, 5, 1, "0200 0200");
    exchange_silence(&talk);
    talk_add(0x11, 4, "o", 0xFE);
    talk_link_input(0x12, 4, 0x11, 0xFE);
    talk_wrote(0x11, 4, 1, "01");
    talk_link_input(0x13, 4, 0x11, 0xFE);
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(1, 1)->link);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(2, 1)->link);
}

/* A link waits for its input's device, whose setup then fails: it is made when that device binds again
 * (D-BUS-17). */
static void test_a_link_outlives_a_failed_setup(void)
{
    talk_add_two_linked();
    talk_lose(1, 0x12);
    talk_wrote(0x11, 4, 1, "00");
    talk_bind(0x12, 6);
    talk_to(0x12, "03 01 00");
    talk_lose(0, 0x11);
    talk_add(0x11, 4, "o", 0xFE);
    exchange_silence(&talk);
    for (int i = 0; i < 4; i++) {
        talk_from(0x12, "83 00 01 00");
        exchange_silence(&talk);
        exchange_pass(&talk, 250);
        talk_to(0x12, "03 01 00");
    }
    talk_from(0x12, "83 00 01 00");
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_SETUP_FAILED));
    talk_add(0x13, 9, "o", 0xFD);
    exchange_silence(&talk);
    talk_beacon(0x11);
    talk_asks_for(0x12, 6);
    exchange_check_fails(&talk, "12");
    talk_is_told(0x12, 0x12, 6);
    talk_set_up(0x12, 6, "i", 0);
    talk_link_input(0x12, 4, 0x11, 0xFE);
    talk_wrote(0x11, 4, 1, "01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(1, 1)->link);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_source_in_its_setup_is_not_there_yet);
    RUN_TEST(test_sources_that_cannot_be);
    RUN_TEST(test_an_update_during_the_setup_waits_for_its_end);
    RUN_TEST(test_a_device_reset_during_its_update_is_not_answered);
    RUN_TEST(test_an_update_that_names_another_source_ends_the_link);
    RUN_TEST(test_a_refused_link_waits);
    RUN_TEST(test_an_input_waits_for_its_source);
    RUN_TEST(test_a_source_that_comes_back_as_an_input);
    RUN_TEST(test_a_source_that_comes_and_goes);
    RUN_TEST(test_a_link_outlives_a_failed_setup);
    return UNITY_END();
}
