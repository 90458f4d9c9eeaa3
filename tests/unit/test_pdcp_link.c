/* Links (pdcp-bus.md 7, 8, 9): D-BUS-7, -10, -14, -19, -20, with hand-written frames. */
#include "exchange.h"
#include "pdcp_ends.h"
#include "unity.h"

static exchange_t x;

/* Device 0002:0002:0004 id 11h, output 1 with id FEh; device 0002:0002:0006 id 12h, input 1. */
void setUp(void)
{
    exchange_start_limb(&x);
}

void tearDown(void) {}

static void make_link(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    exchange_run(&x, exchange_making);
}

/* The first steps of making the link. */
static void make_steps(int count)
{
    for (int i = 0; i < count; i++) {
        exchange_tx(&x, exchange_making[i].tx);
        exchange_rx(&x, exchange_making[i].rx);
    }
}

static void test_a_link_is_made_in_order(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    for (const exchange_pair_t *pair = exchange_making; pair->tx != NULL; pair++) {
        TEST_ASSERT_NOT_EQUAL(PDCP_LINK_ACTIVE,
                              exchange_input_entry(&x)->link); /* 2 only when the last write is answered */
        exchange_tx(&x, pair->tx);
        exchange_silence(&x);
        exchange_rx(&x, pair->rx);
    }
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_links(&x.arb->bus.tables));
}

/* D-API-6: repeated, it succeeds without traffic. */
static void test_the_same_link_again_costs_nothing(void)
{
    make_link();
    exchange_clear(&x);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LINK_REQUEST));
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
}

static void test_what_cannot_be_a_link(void)
{
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(x.arb, exchange_input(&x), exchange_output(&x)));
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(x.arb, PDCP_NONE, exchange_input(&x)));
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(x.arb, exchange_output(&x), 100)); /* a free entry */
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    TEST_ASSERT_EQUAL(PDCP_ERR_BUSY, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
}

/* D-BUS-21: what undoes a link that failed at a step: the steps before it and the step itself, in reverse
 * (the refused write may have been carried out). */
static const exchange_pair_t undoing[] = {
    {"312#04 05 01 FFFF FFFF", "212#84 01 05 01 FFFF FFFF"},
    {"312#04 06 01 FFFF FF", "212#84 01 06 01 FFFF FF"},
    {"312#04 08 01 0000 0000", "212#84 01 08 01 0000 0000"},
    {"312#04 07 01 00 00", "212#84 01 07 01 00 00"},
    {"312#04 04 01 00", "212#84 01 04 01 00"},
    {"311#04 04 01 00", "211#84 01 04 01 00"},
};

static const char *const refusals[] = {
    "212#84 00 05 01", "212#84 00 06 01", "212#84 00 08 01",
    "212#84 00 07 01", "212#84 00 04 01", "211#84 00 04 01",
};

static void fail_at(int step)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    make_steps(step);
    exchange_tx(&x, exchange_making[step].tx);
    exchange_rx(&x, refusals[step]);
    for (int i = step; i >= 0; i--) {
        exchange_tx(&x, undoing[i].tx);
        TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LINK_REQUEST));
        exchange_rx(&x, undoing[i].rx);
    }
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
    TEST_ASSERT_EQUAL(PDCP_LINK_NONE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(PDCP_NO_SOURCE_INDEX, exchange_input_entry(&x)->source.index);
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_links(&x.arb->bus.tables));
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_LINK_FAILED]);
    exchange_make_link(&x); /* with all steps again */
}

static void test_refused_vid_and_pid_is_undone(void)
{
    fail_at(0);
}

static void test_refused_serial_is_undone(void)
{
    fail_at(1);
}

static void test_refused_node_ids_are_undone(void)
{
    fail_at(3);
}

static void test_refused_input_is_undone(void)
{
    fail_at(4);
}

static void test_refused_output_is_undone(void)
{
    fail_at(5);
}

/* D-BUS-20: a device without the profile layer refuses parameter 8, and is linked all the same. */
static void test_an_input_without_parameter_8_is_linked(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    for (int i = 0; exchange_making[i].tx != NULL; i++) {
        exchange_tx(&x, exchange_making[i].tx);
        exchange_rx(&x, i == 2 ? refusals[i] : exchange_making[i].rx);
    }
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
}

/* D-BUS-21: a device falls silent in the middle: the failed write is undone with one try, not three. */
static void test_silence_in_the_middle_ends_the_link(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    make_steps(1);
    for (int i = 0; i < 3; i++) {
        exchange_tx(&x, exchange_making[1].tx);
        exchange_pass(&x, 100);
    }
    exchange_tx(&x, undoing[1].tx);
    exchange_pass(&x, 100);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
}

static void test_a_lost_answer_is_repeated_and_the_link_made(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    exchange_tx(&x, exchange_making[0].tx);
    exchange_pass(&x, 100);
    exchange_run(&x, exchange_making);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
}

/* Removing: input off, source back to unconnected; the output off when its last link goes. */
static void test_a_link_is_removed(void)
{
    make_link();
    TEST_ASSERT_FALSE(pdcp_arb_disconnect(x.arb, exchange_output(&x)));
    TEST_ASSERT_FALSE(pdcp_arb_disconnect(x.arb, PDCP_NONE));
    TEST_ASSERT_TRUE(pdcp_arb_disconnect(x.arb, exchange_input(&x)));
    exchange_pairs(&x, exchange_removing);
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_NONE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_links(&x.arb->bus.tables));
}

/* D-BUS-14: the source is lost: inactive at once, transfer enabled 0, node ids 0 0; 5, 6 and 8 stay. */
static void test_a_lost_source_is_silenced(void)
{
    make_link();
    exchange_lose_output(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
    exchange_run(&x, exchange_silencing);
    TEST_ASSERT_EQUAL(4, exchange_input_entry(&x)->source.identity.sn);
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_links(&x.arb->bus.tables)); /* inactive links count */
}

/* An input that does not answer goes on being told, until it does. */
static void test_silencing_is_repeated_until_it_is_answered(void)
{
    make_link();
    exchange_lose_output(&x);
    for (int i = 0; i < 6; i++) {
        exchange_tx(&x, "312#04 04 01 00");
        exchange_silence(&x);
        exchange_pass(&x, 100);
    }
    exchange_rx(&x, "212#84 01 04 01 00");
    exchange_tx(&x, "312#04 04 01 00"); /* the seventh was on its way */
    exchange_rx(&x, "212#84 01 04 01 00");
    exchange_tx(&x, "312#04 07 01 00 00");
    exchange_rx(&x, "212#84 01 07 01 00 00");
    exchange_silence(&x);
    TEST_ASSERT_FALSE(exchange_input_entry(&x)->enabled);
}

/* The input's device is lost: its output has nobody to listen and is disabled. */
static void test_a_lost_input_disables_its_output(void)
{
    make_link();
    exchange_lose_input(&x);
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01 00");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
}

/* A lost device that comes back binds again and gets its old id and links. */
static void test_a_returning_source_gets_its_links_back(void)
{
    make_link();
    exchange_lose_output(&x);
    exchange_pairs(&x, exchange_silencing);
    exchange_bind(&x, "11", "0200 0200 0400");
    exchange_set_up_device(&x, "11", "0200 0200 0400", "01");
    exchange_set_up_channel(&x, "11", "FE");
    exchange_run(&x, exchange_making); /* and at once its link */
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
}

/* D-BUS-14: the source is away for longer than its ids are kept; an unknown device that gets them is not
 * heard, and the link is remembered by identity. */
static void test_a_link_outlives_the_ids_of_its_source(void)
{
    static const exchange_pair_t making_again[] = {
        {"312#04 05 01 0200 0200", "212#84 01 05 01"},
        {"312#04 06 01 0400 01", "212#84 01 06 01"},
        {"312#04 08 01 0050 2021", "212#84 01 08 01"},
        {"312#04 07 01 11 FD", "212#84 01 07 01"},
        {"312#04 04 01 01", "212#84 01 04 01"},
        {"311#04 04 01 01", "211#84 01 04 01"},
        {NULL, NULL},
    };
    make_link();
    for (int i = 0; i < 24; i++) {
        exchange_pass(&x, 500);
        exchange_rx(&x, "012#0A");
        if (i == 2) {
            exchange_run(&x, exchange_silencing);
        }
        exchange_silence(&x);
    }
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(PDCP_NONE, exchange_input_entry(&x)->source.channel);
    exchange_add_output(&x, "FD"); /* a freed id is given out last (D-BUS-36) */
    exchange_run(&x, making_again);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
}

/* pdcp-bus.md 7: the source that 5 and 6 name is bound: linked, and answered success when that is done. */
static void test_update_data_channel_links(void)
{
    exchange_update(&x, "83 01 05 01 0200 0200", "83 01 06 01 0400 01");
    exchange_pairs(&x, exchange_making);
    exchange_tx(&x, "312#8F 01 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
}

/* Asked again for a link that is there: success without writing. */
static void test_update_data_channel_of_an_active_link(void)
{
    make_link();
    exchange_update(&x, "83 01 05 01 0200 0200", "83 01 06 01 0400 01");
    exchange_tx(&x, "312#8F 01 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
}

/* Not present: remembered as inactive, answered failure, realised when the source appears. */
static void test_update_data_channel_waits_for_its_source(void)
{
    exchange_update(&x, "83 01 05 01 0300 0300", "83 01 06 01 0900 01");
    exchange_tx(&x, "312#8F 00 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_links(&x.arb->bus.tables));

    static const exchange_pair_t making[] = {
        {"312#04 05 01 0300 0300", "212#84 01 05 01 0300 0300"},
        {"312#04 06 01 0900 01", "212#84 01 06 01 0900 01"},
        {"312#04 08 01 0050 2021", "212#84 01 08 01 0050 2021"},
        {"312#04 07 01 13 FD", "212#84 01 07 01 13 FD"},
        {"312#04 04 01 01", "212#84 01 04 01 01"},
        {"313#04 04 01 01", "213#84 01 04 01 01"},
        {NULL, NULL},
    };
    exchange_add_third_output(&x);
    exchange_run(&x, making);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
}

static void test_update_data_channel_of_what_is_no_input(void)
{
    exchange_rx(&x, "211#0F 01"); /* an output */
    exchange_tx(&x, "311#8F 00 01");
    exchange_rx(&x, "212#0F 02"); /* does not exist */
    exchange_tx(&x, "312#8F 00 02");
    exchange_update(&x, "83 01 05 01 FFFF FFFF", "83 01 06 01 FFFF FF"); /* unconnected */
    exchange_tx(&x, "312#8F 00 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_NONE, exchange_input_entry(&x)->link);
}

/* 2307h replaces the input's source: the old output is disabled when nobody else listens to it. */
static void test_a_source_is_replaced(void)
{
    static const exchange_pair_t replacing[] = {
        {"312#04 04 01 00", "212#84 01 04 01 00"},
        {"312#04 05 01 0300 0300", "212#84 01 05 01 0300 0300"},
        {"312#04 06 01 0900 01", "212#84 01 06 01 0900 01"},
        {"312#04 08 01 0050 2021", "212#84 01 08 01 0050 2021"},
        {"312#04 07 01 13 FD", "212#84 01 07 01 13 FD"},
        {"312#04 04 01 01", "212#84 01 04 01 01"},
        {"313#04 04 01 01", "213#84 01 04 01 01"},
        {"311#04 04 01 00", "211#84 01 04 01 00"},
        {NULL, NULL},
    };
    make_link();
    exchange_add_third_output(&x);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(
        PDCP_OK, pdcp_arb_connect(x.arb, pdcp_tables_channel(&x.arb->bus.tables, 2, 1), exchange_input(&x)));
    exchange_run(&x, replacing);
    TEST_ASSERT_EQUAL(9, exchange_input_entry(&x)->source.identity.sn);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_links(&x.arb->bus.tables));
}

/* The source is lost in the middle of making a link. */
static void test_a_source_lost_in_the_middle_is_undone(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    make_steps(5);
    exchange_tx(&x, exchange_making[5].tx);
    exchange_rx(&x, "611#01 0200 0200 0400"); /* it was reset: any try unanswered shows it */
    exchange_pass(&x, 100);
    (void)exchange_drain(&x);
    exchange_pass(&x, 100);
    (void)exchange_drain(&x);
    exchange_pass(&x, 100); /* the third try of the enabling write has failed */
    exchange_tx(&x, "311#81 11 0200 0200 0400");
    exchange_tx(&x, "311#03 01 00");
    exchange_tx(&x, undoing[4].tx);
    exchange_rx(&x, undoing[4].rx);
    exchange_tx(&x, undoing[3].tx);
}

/* The host's request to a device and a link job share its one place. */
static void test_a_link_waits_for_the_hosts_request(void)
{
    uint8_t bytes[8];
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 1, 0, 8, bytes, sizeof bytes));
    exchange_tx(&x, "312#03 08 00");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    exchange_silence(&x);
    exchange_rx(&x, "212#83 01 08 00 12");
    TEST_ASSERT_EQUAL(1, exchange_last(&x, PDCP_EVENT_REQUEST)->len);
    TEST_ASSERT_EQUAL_HEX8(0x12, bytes[0]);
    exchange_run(&x, exchange_making);
}

/* Device 0003:0003:0009 as id 13h: one input, index 1, linked to the same output, which is on already. */
static void link_second_input(void)
{
    static const exchange_pair_t linking[] = {
        {"313#04 05 01 0200 0200", "213#84 01 05 01 0200 0200"},
        {"313#04 06 01 0400 01", "213#84 01 06 01 0400 01"},
        {"313#04 08 01 0050 2021", "213#84 01 08 01 0050 2021"},
        {"313#04 07 01 11 FE", "213#84 01 07 01 11 FE"},
        {"313#04 04 01 01", "213#84 01 04 01 01"},
        {NULL, NULL},
    };
    exchange_add_third_input(&x);
    exchange_silence(&x);
    exchange_rx(&x, "013#0A");
    TEST_ASSERT_EQUAL(
        PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), pdcp_tables_channel(&x.arb->bus.tables, 2, 1)));
    exchange_run(&x, linking);
}

/* Both inputs have lost their source; the first of them is being silenced. */
static void lose_source_of_both(void)
{
    make_link();
    link_second_input();
    exchange_pass(&x, 1000);
    exchange_rx(&x, "012#0A");
    exchange_rx(&x, "013#0A");
    exchange_pass(&x, 500);
    exchange_tx(&x, "312#04 04 01 00");
    exchange_silence(&x);
}

/* An Update Data Channel that comes while its input still is to be silenced does not take the place of that,
 * least of all when links are stored, and it changes nothing (profile-layer.md 4). */
static void test_update_data_channel_does_not_keep_an_input_from_being_silenced(void)
{
    static const exchange_pair_t silencing[] = {
        {"312#04 07 01 00 00", "212#84 01 07 01 00 00"},
        {"313#04 04 01 00", "213#84 01 04 01 00"},
        {"313#04 07 01 00 00", "213#84 01 07 01 00 00"},
        {"313#03 05 01", "213#83 01 05 01 0200 0200"}, /* D-BUS-38: does it name what it should? */
        {"313#03 06 01", "213#83 01 06 01 0400 01"},
        {"313#8F 00 01", NULL},
        {NULL, NULL},
    };
    lose_source_of_both();
    pdcp_arb_plan_links(x.arb, true);
    exchange_rx(&x, "213#0F 01");
    exchange_silence(&x);
    exchange_rx(&x, "212#84 01 04 01 00");
    exchange_run(&x, silencing);
    TEST_ASSERT_FALSE(x.arb->bus.tables.channels[pdcp_tables_channel(&x.arb->bus.tables, 2, 1)].enabled);
}

/* D-BUS-22: nor does it when the input does not answer: what breaks off the repetition is served, and then it
 * is told again. */
static void test_update_data_channel_does_not_end_the_silencing(void)
{
    make_link();
    pdcp_arb_plan_links(x.arb, true);
    exchange_lose_output(&x);
    for (int i = 0; i < 4; i++) { /* three tries, and one of those that anything else breaks off */
        exchange_tx(&x, "312#04 04 01 00");
        exchange_silence(&x);
        exchange_pass(&x, i < 3 ? 100 : 50);
    }
    exchange_update(&x, "83 01 05 01 0200 0200", "83 01 06 01 0400 01"); /* D-BUS-38: what it should? */
    exchange_tx(&x, "312#8F 00 01");
    exchange_run(&x, exchange_silencing);
    TEST_ASSERT_FALSE(exchange_input_entry(&x)->enabled);
}

/* A link that was to be made again, and whose source has gone before its turn: that is told, and the input is
 * silenced. */
static void test_a_link_whose_source_has_gone_is_not_made(void)
{
    pdcp_channel_t *channel = &x.arb->bus.tables.channels[exchange_input(&x)];
    channel->link = PDCP_LINK_INACTIVE;
    channel->enabled = true;
    pdcp_ends_note(&x.arb->bus, exchange_input(&x), PDCP_TODO_CONNECT);
    exchange_step(&x);
    exchange_tx(&x, "312#04 04 01 00");
    TEST_ASSERT_EQUAL(exchange_input(&x), exchange_last(&x, PDCP_EVENT_LINK)->channel);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK)->status);
}

/* A device was slow: the answer to an earlier write of the parameter, given up meanwhile, comes while another
 * value is being written, which may get lost. It must not be taken for the answer to that (D-BUS-55). */
static void test_an_answer_that_tells_of_another_value_is_late(void)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), exchange_input(&x)));
    make_steps(3);
    exchange_tx(&x, "312#04 07 01 11 FE");
    exchange_rx(&x, "212#84 01 07 01 13 FD"); /* another source */
    exchange_silence(&x);
    exchange_rx(&x, "212#84 01 07 01"); /* as older devices answer: no value (D-BUS-3) */
    exchange_tx(&x, "312#04 04 01 01");
    exchange_rx(&x, "212#84 01 04 01 00");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(2, x.arb->bus.stats[PDCP_STAT_DROP_LATE]);
    exchange_pass(&x, 100);
    exchange_tx(&x, "312#04 04 01 01");
    exchange_rx(&x, "212#84 01 04 01 01 00 00 00");
    exchange_tx(&x, "311#04 04 01 01");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_link_is_made_in_order);
    RUN_TEST(test_the_same_link_again_costs_nothing);
    RUN_TEST(test_what_cannot_be_a_link);
    RUN_TEST(test_refused_vid_and_pid_is_undone);
    RUN_TEST(test_refused_serial_is_undone);
    RUN_TEST(test_refused_node_ids_are_undone);
    RUN_TEST(test_refused_input_is_undone);
    RUN_TEST(test_refused_output_is_undone);
    RUN_TEST(test_an_input_without_parameter_8_is_linked);
    RUN_TEST(test_silence_in_the_middle_ends_the_link);
    RUN_TEST(test_a_lost_answer_is_repeated_and_the_link_made);
    RUN_TEST(test_a_link_is_removed);
    RUN_TEST(test_a_lost_source_is_silenced);
    RUN_TEST(test_silencing_is_repeated_until_it_is_answered);
    RUN_TEST(test_a_lost_input_disables_its_output);
    RUN_TEST(test_a_returning_source_gets_its_links_back);
    RUN_TEST(test_a_link_outlives_the_ids_of_its_source);
    RUN_TEST(test_update_data_channel_links);
    RUN_TEST(test_update_data_channel_of_an_active_link);
    RUN_TEST(test_update_data_channel_waits_for_its_source);
    RUN_TEST(test_update_data_channel_of_what_is_no_input);
    RUN_TEST(test_a_source_is_replaced);
    RUN_TEST(test_a_source_lost_in_the_middle_is_undone);
    RUN_TEST(test_a_link_waits_for_the_hosts_request);
    RUN_TEST(test_update_data_channel_does_not_keep_an_input_from_being_silenced);
    RUN_TEST(test_update_data_channel_does_not_end_the_silencing);
    RUN_TEST(test_a_link_whose_source_has_gone_is_not_made);
    RUN_TEST(test_an_answer_that_tells_of_another_value_is_late);
    return UNITY_END();
}
