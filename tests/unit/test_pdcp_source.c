/* D-BUS-38: an input names in its parameters 5, 6 and 8 what the tables say, whoever decided, so that an
 * arbitrator that replaces this one reads back what is. Hand-written frames. */
#include "exchange.h"
#include "unity.h"

static exchange_t x;

/* Device 0002:0002:0004 id 11h, output 1 with id FEh; device 0002:0002:0006 id 12h, input 1. */
void setUp(void)
{
    exchange_start_limb(&x);
}

void tearDown(void) {}

/* The source is lost: the link is inactive, the input silenced; 5, 6 and 8 stay. */
static void lose_source(void)
{
    exchange_lose_output(&x);
    exchange_run(&x, exchange_silencing);
    exchange_clear(&x);
}

/* The link is written again: 5, 6, 8, 7 and enabled to the input, then node id and enabled to the output.
 * Nothing is disabled first. */
static const exchange_pair_t writing[] = {
    {"312#04 05 01 0200 0200", "212#84 01 05 01"}, {"312#04 06 01 0400 01", "212#84 01 06 01"},
    {"312#04 08 01 0050 2021", "212#84 01 08 01"}, {"312#04 07 01 11 FE", "212#84 01 07 01"},
    {"312#04 04 01 01", "212#84 01 04 01"},        {"311#04 05 01 FE", "211#84 01 05 01"},
    {"311#04 04 01 01", "211#84 01 04 01"},        {NULL, NULL},
};

/* While a stored configuration decides, the device sends Update Data Channel, and names these. */
static void update(const char *vid_pid, const char *serial)
{
    pdcp_arb_plan_links(x.arb, true);
    exchange_update(&x, vid_pid, serial);
}

static void expect_table(pdcp_link_status_t link, uint16_t sn, uint8_t index)
{
    TEST_ASSERT_EQUAL(link, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL_HEX16(sn, exchange_input_entry(&x)->source.identity.sn);
    TEST_ASSERT_EQUAL_HEX8(index, exchange_input_entry(&x)->source.index);
    TEST_ASSERT_EQUAL(PDCP_TODO_NONE, exchange_input_entry(&x)->todo);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LINK)); /* no link has changed */
}

/* The stored configuration decides, and the answer says whether the channel is connected now (pdcp-bus.md
 * 7). */
static void test_a_device_that_names_another_source_is_told_its_own(void)
{
    exchange_make_link(&x);
    update("83 01 05 01 0900 0900", "83 01 06 01 0400 01");
    exchange_pairs(&x, writing);
    exchange_tx(&x, "312#8F 01 01");
    exchange_silence(&x);
    expect_table(PDCP_LINK_ACTIVE, 4, 1);
}

static void test_another_channel_of_its_source_is_another_source(void)
{
    exchange_make_link(&x);
    update("83 01 05 01 0200 0200", "83 01 06 01 0400 02");
    exchange_pairs(&x, writing);
    exchange_tx(&x, "312#8F 01 01");
    exchange_silence(&x);
    expect_table(PDCP_LINK_ACTIVE, 4, 1);
}

static void test_a_device_that_names_its_source_is_told_nothing(void)
{
    exchange_make_link(&x);
    update("83 01 05 01 0200 0200", "83 01 06 01 0400 01");
    exchange_tx(&x, "312#8F 01 01");
    exchange_silence(&x);
    expect_table(PDCP_LINK_ACTIVE, 4, 1);
}

/* Of a link that is not active no more is written than its source. */
static void test_an_inactive_link_is_named_and_not_made(void)
{
    static const exchange_pair_t naming[] = {
        {"312#04 05 01 0200 0200", "212#84 01 05 01"},
        {"312#04 06 01 0400 01", "212#84 01 06 01"},
        {"312#04 08 01 0050 2021", "212#84 01 08 01"},
        {"312#8F 00 01", NULL},
        {NULL, NULL},
    };
    exchange_make_link(&x);
    lose_source();
    update("83 01 05 01 0900 0900", "83 01 06 01 0700 01");
    exchange_run(&x, naming);
    expect_table(PDCP_LINK_INACTIVE, 4, 1);
    TEST_ASSERT_FALSE(exchange_input_entry(&x)->enabled);
}

static const exchange_pair_t unnaming[] = {
    {"312#04 05 01 FFFF FFFF", "212#84 01 05 01"},
    {"312#04 06 01 FFFF FF", "212#84 01 06 01"},
    {"312#04 08 01 0000 0000", "212#84 01 08 01"},
    {NULL, NULL},
};

/* D-BUS-7: without a link it names none, although the output that it named is there. */
static void test_an_input_without_a_link_names_none(void)
{
    update("83 01 05 01 0200 0200", "83 01 06 01 0400 01");
    exchange_pairs(&x, unnaming);
    exchange_tx(&x, "312#8F 00 01");
    exchange_silence(&x);
    expect_table(PDCP_LINK_NONE, 0xFFFF, 0xFF);
}

/* What a device refuses to tell does not differ. */
static void test_a_device_that_refuses_to_name_its_source_is_answered(void)
{
    exchange_make_link(&x);
    update("83 00 05 01", "83 00 06 01");
    exchange_tx(&x, "312#8F 01 01");
    exchange_silence(&x);
    expect_table(PDCP_LINK_ACTIVE, 4, 1);
}

static void test_half_an_answer_is_enough(void)
{
    exchange_make_link(&x);
    update("83 00 05 01", "83 01 06 01 0900 01");
    exchange_pairs(&x, writing);
    exchange_tx(&x, "312#8F 01 01");
    exchange_silence(&x);
}

/* D-BUS-19: it asks again. */
static void test_a_silent_device_is_not_answered(void)
{
    exchange_make_link(&x);
    pdcp_arb_plan_links(x.arb, true);
    exchange_rx(&x, "212#0F 01");
    for (int i = 0; i < 3; i++) {
        exchange_tx(&x, "312#03 05 01");
        exchange_pass(&x, 100);
    }
    exchange_silence(&x);
    expect_table(PDCP_LINK_ACTIVE, 4, 1);
}

/* Every write may be refused: the others are made all the same. */
static void test_what_is_refused_is_left_out(void)
{
    exchange_make_link(&x);
    update("83 01 05 01 0900 0900", "83 01 06 01 0400 01");
    for (const exchange_pair_t *pair = writing; pair->tx != NULL; pair++) {
        char refusal[16] = "";
        for (int i = 0; i < 15; i++) {
            refusal[i] = pair->rx[i];
        }
        refusal[8] = '0'; /* 84 00 */
        exchange_tx(&x, pair->tx);
        exchange_rx(&x, refusal);
    }
    exchange_tx(&x, "312#8F 01 01");
    exchange_silence(&x);
    expect_table(PDCP_LINK_ACTIVE, 4, 1);
}

/* An input that does not answer is not asked more; its output is written all the same. */
static void test_a_silent_input_does_not_hold_up_its_output(void)
{
    exchange_make_link(&x);
    update("83 01 05 01 0900 0900", "83 01 06 01 0400 01");
    for (int i = 0; i < 3; i++) {
        exchange_tx(&x, "312#04 05 01 0200 0200");
        exchange_pass(&x, 100);
    }
    exchange_tx(&x, "311#04 05 01 FE");
    exchange_rx(&x, "211#84 01 05 01");
    exchange_tx(&x, "311#04 04 01 01");
    exchange_rx(&x, "211#84 01 04 01");
    exchange_tx(&x, "312#8F 01 01");
    exchange_silence(&x);
    expect_table(PDCP_LINK_ACTIVE, 4, 1);
}

/* The source is lost in the middle: it is not waited for, and the input is silenced. */
static void test_a_source_lost_in_the_middle(void)
{
    exchange_make_link(&x);
    exchange_pass(&x, 1000);
    exchange_rx(&x, "012#0A");
    exchange_pass(&x, 499);
    update("83 01 05 01 0900 0900", "83 01 06 01 0400 01");
    for (int i = 0; i < 4; i++) {
        exchange_tx(&x, writing[i].tx);
        if (i < 3) {
            exchange_rx(&x, writing[i].rx);
        }
    }
    exchange_pass(&x, 1);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
    exchange_rx(&x, writing[3].rx);
    exchange_tx(&x, "312#8F 00 01");
    exchange_run(&x, exchange_silencing);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
    TEST_ASSERT_FALSE(exchange_input_entry(&x)->enabled);
}

/* The input's own device is lost in the middle: it answers a Reset. Its output has nobody to listen. */
static void test_an_input_lost_in_the_middle(void)
{
    exchange_make_link(&x);
    update("83 01 05 01 0900 0900", "83 01 06 01 0400 01");
    for (int i = 0; i < 5; i++) {
        exchange_tx(&x, writing[i].tx);
        exchange_rx(&x, writing[i].rx);
    }
    exchange_tx(&x, writing[5].tx);
    TEST_ASSERT_TRUE(pdcp_arb_reset(x.arb, x.now_ms, 1));
    exchange_tx(&x, "312#0B");
    exchange_rx(&x, "212#8B 01");
    exchange_silence(&x);
    exchange_rx(&x, writing[5].rx);
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(4, exchange_input_entry(&x)->source.identity.sn);
}

/* The source of the remembered link. */
static const exchange_pair_t naming[] = {
    {"312#04 05 01 0200 0200", "212#84 01 05 01"},
    {"312#04 06 01 0400 01", "212#84 01 06 01"},
    {"312#04 08 01 0050 2021", "212#84 01 08 01"},
    {NULL, NULL},
};

/* A device that was away comes back with another source in mind: that of its remembered link is written, also
 * while the source of that is away. */
static void test_a_setup_that_finds_another_source(void)
{
    exchange_make_link(&x);
    lose_source();
    exchange_pass(&x, 1500);
    exchange_set_up_input(&x, "83 01 05 01 0900 0900", "83 01 06 01 0700 03", "83 01 08 01 0050 2021");
    exchange_run(&x, naming);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(4, exchange_input_entry(&x)->source.identity.sn);
}

/* 8 may be all that is wrong. */
static void test_a_setup_that_finds_another_type(void)
{
    exchange_make_link(&x);
    lose_source();
    exchange_pass(&x, 1500);
    exchange_set_up_input(&x, "83 01 05 01 0200 0200", "83 01 06 01 0400 01", "83 01 08 01 0050 2022");
    exchange_run(&x, naming);
}

static void test_a_setup_that_finds_its_source(void)
{
    exchange_make_link(&x);
    lose_source();
    exchange_pass(&x, 1500);
    exchange_set_up_input(&x, "83 01 05 01 0200 0200", "83 01 06 01 0400 01", "83 01 08 01 0050 2021");
    exchange_silence(&x);
}

/* A device that names no source because it cannot is not told one. */
static void test_a_setup_that_is_refused_a_source(void)
{
    exchange_make_link(&x);
    lose_source();
    exchange_pass(&x, 1500);
    exchange_set_up_input(&x, "83 00 05 01", "83 00 06 01", "83 00 08 01");
    exchange_silence(&x);
}

/* A link that is made afterwards writes the same. */
static void test_a_link_that_is_made_is_not_written_once_more(void)
{
    exchange_make_link(&x);
    exchange_lose_input(&x);
    exchange_tx(&x, "311#04 04 01 00"); /* nobody listens */
    exchange_rx(&x, "211#84 01 04 01");
    exchange_set_up_input(&x, "83 01 05 01 0900 0900", "83 01 06 01 0700 03", "83 01 08 01 0050 2021");
    exchange_run(&x, exchange_making);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
}

/* D-PRO-15: a link of the configuration whose source is missing. */
static void test_a_remembered_link_is_named(void)
{
    static const exchange_pair_t missing[] = {
        {"312#04 05 01 0300 0300", "212#84 01 05 01"},
        {"312#04 06 01 0900 02", "212#84 01 06 01"},
        {"312#04 08 01 0050 2021", "212#84 01 08 01"},
        {NULL, NULL},
    };
    const pdcp_identity_t owner = {3, 3, 9};
    pdcp_arb_plan_links(x.arb, true);
    pdcp_arb_remember(x.arb, x.now_ms, exchange_input(&x), &owner, 2, 0x5000, 0x2120);
    exchange_run(&x, missing);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(9, exchange_input_entry(&x)->source.identity.sn);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_device_that_names_another_source_is_told_its_own);
    RUN_TEST(test_another_channel_of_its_source_is_another_source);
    RUN_TEST(test_a_device_that_names_its_source_is_told_nothing);
    RUN_TEST(test_an_inactive_link_is_named_and_not_made);
    RUN_TEST(test_an_input_without_a_link_names_none);
    RUN_TEST(test_a_device_that_refuses_to_name_its_source_is_answered);
    RUN_TEST(test_half_an_answer_is_enough);
    RUN_TEST(test_a_silent_device_is_not_answered);
    RUN_TEST(test_what_is_refused_is_left_out);
    RUN_TEST(test_a_silent_input_does_not_hold_up_its_output);
    RUN_TEST(test_a_source_lost_in_the_middle);
    RUN_TEST(test_an_input_lost_in_the_middle);
    RUN_TEST(test_a_setup_that_finds_another_source);
    RUN_TEST(test_a_setup_that_finds_another_type);
    RUN_TEST(test_a_setup_that_finds_its_source);
    RUN_TEST(test_a_setup_that_is_refused_a_source);
    RUN_TEST(test_a_link_that_is_made_is_not_written_once_more);
    RUN_TEST(test_a_remembered_link_is_named);
    return UNITY_END();
}
