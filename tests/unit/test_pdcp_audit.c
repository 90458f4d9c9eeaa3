/* Audit (D-BUS-40): what is asked and when, what is done about a difference. Hand-written frames; the logs
 * audit_*.log in tests/vectors show whole conversations. */
#include "exchange.h"
#include "pdcp_audit.h"
#include "unity.h"

static exchange_t x;

/* Device 0002:0002:0004 id 11h, output 1 with id FEh; device 0002:0002:0006 id 12h, input 1. */
void setUp(void)
{
    exchange_start_limb(&x);
}

void tearDown(void) {}

static void begin(bool planned)
{
    exchange_make_link(&x);
    if (planned) {
        pdcp_arb_plan_links(x.arb, false);
    }
    pdcp_arb_audit(x.arb, x.now_ms);
}

/* The next question, 60 ms after the one before. */
static void ask(const char *question, const char *answer)
{
    exchange_pass(&x, 59);
    exchange_silence(&x);
    exchange_pass(&x, 1);
    exchange_tx(&x, question);
    exchange_rx(&x, answer);
}

static const exchange_pair_t writing[] = {
    {"312#04 05 01 0200 0200", "212#84 01 05 01"}, {"312#04 06 01 0400 01", "212#84 01 06 01"},
    {"312#04 08 01 0050 2021", "212#84 01 08 01"}, {"312#04 07 01 11 FE", "212#84 01 07 01"},
    {"312#04 04 01 01", "212#84 01 04 01"},        {"311#04 05 01 FE", "211#84 01 05 01"},
    {"311#04 04 01 01", "211#84 01 04 01"},        {NULL, NULL},
};

/* The answer to this question differed: counted, told, repaired. */
static void expect_repair(uint8_t channel, uint8_t param)
{
    exchange_run(&x, writing);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_AUDIT));
    TEST_ASSERT_EQUAL(channel, exchange_last(&x, PDCP_EVENT_AUDIT)->channel);
    TEST_ASSERT_EQUAL(param, exchange_last(&x, PDCP_EVENT_AUDIT)->status);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LINK)); /* it was active, and still is */
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link);
    exchange_clear(&x);
}

/* With the profile layer, an arbitrator that comes later reads back what inputs name as their source. */
static void test_a_turn_with_the_profile_layer(void)
{
    begin(true);
    for (int turn = 0; turn < 3; turn++) {
        ask("311#03 04 01", "211#83 01 04 01 01");
        ask("312#03 04 01", "212#83 01 04 01 01");
        ask("311#03 05 01", "211#83 01 05 01 FE");
        ask("312#03 07 01", "212#83 01 07 01 11 FE");
        ask("312#03 05 01", "212#83 01 05 01 0200 0200");
        ask("312#03 06 01", "212#83 01 06 01 0400 01");
    }
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_AUDIT));
    TEST_ASSERT_EQUAL(0, x.arb->bus.stats[PDCP_STAT_AUDIT]);
}

/* Each parameter may be what differs. A value may be longer than its field. */
static void test_each_parameter_is_compared(void)
{
    begin(true);
    ask("311#03 04 01", "211#83 01 04 01 00");
    expect_repair(exchange_output(&x), 4);
    ask("312#03 04 01", "212#83 01 04 01 00");
    expect_repair(exchange_input(&x), 4);
    ask("311#03 05 01", "211#83 01 05 01 FD");
    expect_repair(exchange_output(&x), 5);
    setUp();
    begin(true);
    ask("311#03 04 01", "211#83 01 04 01 01 00");
    ask("312#03 04 01", "212#83 01 04 01 FF");
    ask("311#03 05 01", "211#83 01 05 01 FE 00");
    ask("312#03 07 01", "212#83 01 07 01 11 FD");
    expect_repair(exchange_input(&x), 7);
    ask("312#03 05 01", "212#83 01 05 01 0200 0300");
    expect_repair(exchange_input(&x), 5);
    ask("312#03 06 01", "212#83 01 06 01 0400 02");
    expect_repair(exchange_input(&x), 6);
    TEST_ASSERT_EQUAL(3, x.arb->bus.stats[PDCP_STAT_AUDIT]);
}

/* An input without a link names none. */
static void test_an_input_without_a_link(void)
{
    static const exchange_pair_t unnaming[] = {
        {"312#04 05 01 FFFF FFFF", "212#84 01 05 01"},
        {"312#04 06 01 FFFF FF", "212#84 01 06 01"},
        {"312#04 08 01 0000 0000", "212#84 01 08 01"},
        {NULL, NULL},
    };
    pdcp_arb_plan_links(x.arb, false);
    pdcp_arb_audit(x.arb, x.now_ms);
    ask("312#03 06 01", "212#83 01 06 01 FFFF FF");
    ask("312#03 06 01", "212#83 01 06 01 0400 00"); /* channel index 0 names none */
    ask("312#03 06 01", "212#83 01 06 01 0400 01");
    exchange_run(&x, unnaming);
    TEST_ASSERT_EQUAL(6, exchange_last(&x, PDCP_EVENT_AUDIT)->status);
    TEST_ASSERT_EQUAL(PDCP_LINK_NONE, exchange_input_entry(&x)->link);
}

/* One that named a source when it was set up is left to the profile layer until that has decided. */
static void test_an_input_whose_source_is_not_decided(void)
{
    x.arb->bus.tables.channels[exchange_input(&x)].source.index = 1;
    pdcp_arb_plan_links(x.arb, false);
    pdcp_arb_audit(x.arb, x.now_ms);
    exchange_pass(&x, 239);
    exchange_silence(&x);
    exchange_pass(&x, 1);
    exchange_tx(&x, "311#03 04 01"); /* the fourth question, for a channel without a link */
}

/* An input that refuses to be disabled without its link is asked later, and told again. */
static void test_an_input_that_refused_to_be_disabled(void)
{
    static const exchange_pair_t refusing[] = {
        {"312#04 04 01 00", "212#84 00 04 01"},
        {"312#04 07 01 0000", "212#84 01 07 01"},
        {"312#04 08 01 0000 0000", "212#84 01 08 01"},
        {"312#04 06 01 FFFF FF", "212#84 01 06 01"},
        {"312#04 05 01 FFFF FFFF", "212#84 01 05 01"},
        {"311#04 04 01 00", "211#84 01 04 01"},
        {NULL, NULL},
    };
    static const exchange_pair_t silencing[] = {
        {"312#04 04 01 00", "212#84 01 04 01"},
        {"312#04 07 01 0000", "212#84 01 07 01"},
        {NULL, NULL},
    };
    exchange_make_link(&x);
    TEST_ASSERT_TRUE(pdcp_arb_disconnect(x.arb, exchange_input(&x)));
    exchange_run(&x, refusing);
    TEST_ASSERT_TRUE(exchange_input_entry(&x)->enabled);
    pdcp_arb_audit(x.arb, x.now_ms);
    exchange_pass(&x, 180);
    exchange_silence(&x);
    ask("311#03 04 01", "211#83 01 04 01 00");
    exchange_pass(&x, 180);
    exchange_silence(&x);
    ask("312#03 04 01", "212#83 01 04 01 01");
    exchange_run(&x, silencing);
    TEST_ASSERT_FALSE(exchange_input_entry(&x)->enabled);
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_AUDIT]);
}

/* D-BUS-60: a host may read an output without a link: what it has enabled stays enabled. */
static void test_an_output_that_the_host_has_enabled(void)
{
    x.arb->bus.tables.channels[exchange_output(&x)].enabled = true;
    pdcp_arb_audit(x.arb, x.now_ms);
    exchange_pass(&x, 180);
    ask("311#03 04 01", "211#83 01 04 01 01");
    exchange_silence(&x);
    TEST_ASSERT_TRUE(x.arb->bus.tables.channels[exchange_output(&x)].enabled);
    TEST_ASSERT_EQUAL(0, x.arb->bus.stats[PDCP_STAT_AUDIT]);
}

/* It may have become silent on its own: then the tables learn it. */
static void test_an_input_that_was_disabled_by_itself(void)
{
    x.arb->bus.tables.channels[exchange_input(&x)].enabled = true;
    pdcp_arb_audit(x.arb, x.now_ms);
    exchange_pass(&x, 180);
    ask("311#03 04 01", "211#83 01 04 01 00");
    exchange_pass(&x, 180);
    ask("312#03 04 01", "212#83 01 04 01 00");
    exchange_silence(&x);
    TEST_ASSERT_FALSE(exchange_input_entry(&x)->enabled);
    TEST_ASSERT_EQUAL(0, x.arb->bus.stats[PDCP_STAT_AUDIT]);
}

/* D-BUS-38: what an input names is repaired three times within a minute, then it is told once more, and
 * nothing of it is done until the minute is over. */
static void test_a_source_that_is_not_kept(void)
{
    begin(true);
    for (int turn = 0; turn < 6; turn++) {
        ask("311#03 04 01", "211#83 01 04 01 01");
        ask("312#03 04 01", "212#83 01 04 01 01");
        ask("311#03 05 01", "211#83 01 05 01 FE");
        ask("312#03 07 01", "212#83 01 07 01 11 FE");
        ask("312#03 05 01", "212#83 01 05 01 0900 0900");
        if (turn < 3) {
            expect_repair(exchange_input(&x), 5);
        } else {
            TEST_ASSERT_EQUAL(turn == 3 ? 1 : 0, exchange_count(&x, PDCP_EVENT_AUDIT));
            exchange_clear(&x);
        }
        exchange_silence(&x);
        ask("312#03 06 01", "212#83 01 06 01 0400 01");
    }
    TEST_ASSERT_EQUAL(6, x.arb->bus.stats[PDCP_STAT_AUDIT]);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, exchange_input_entry(&x)->link); /* data flows all the same */
    for (int i = 0; i < 600; i++) { /* the minute passes, without answers */
        exchange_pass(&x, 100);
        exchange_beacons(&x);
        (void)exchange_drain(&x);
    }
    exchange_clear(&x);
    while (exchange_count(&x, PDCP_EVENT_AUDIT) == 0) {
        exchange_pass(&x, 10);
        exchange_beacons(&x);
        (void)exchange_drain(&x);
        exchange_rx(&x, "212#83 01 05 01 0900 0900");
    }
    exchange_tx(&x, "312#04 05 01 0200 0200");
}

/* The minute begins with the first difference: the fourth one, 60 s later, is the first of another minute. */
static void test_three_repairs_in_more_than_a_minute(void)
{
    begin(false);
    for (int i = 0; i < 4; i++) {
        while (exchange_count(&x, PDCP_EVENT_AUDIT) == 0) {
            exchange_pass(&x, 10);
            exchange_rx(&x, "012#0A");
            exchange_rx(&x, "011#0A");
            (void)exchange_drain(&x);
            exchange_rx(&x, "212#83 01 04 01 00");
        }
        expect_repair(exchange_input(&x), 4);
        for (int wait = 0; wait < 198; wait++) { /* 19.8 s */
            exchange_pass(&x, 100);
            exchange_beacons(&x);
            (void)exchange_drain(&x);
        }
        exchange_clear(&x);
    }
    TEST_ASSERT_EQUAL(4, x.arb->bus.stats[PDCP_STAT_AUDIT]);
}

/* Device 0003:0003:0009 as id 13h: one input, index 1, linked to the same output. */
static void link_second_input(void)
{
    static const exchange_pair_t linking[] = {
        {"313#04 05 01 0200 0200", "213#84 01 05 01"}, {"313#04 06 01 0400 01", "213#84 01 06 01"},
        {"313#04 08 01 0050 2021", "213#84 01 08 01"}, {"313#04 07 01 11 FE", "213#84 01 07 01"},
        {"313#04 04 01 01", "213#84 01 04 01"},        {NULL, NULL},
    };
    exchange_add_third_input(&x);
    exchange_silence(&x);
    exchange_rx(&x, "013#0A");
    TEST_ASSERT_EQUAL(
        PDCP_OK, pdcp_arb_connect(x.arb, exchange_output(&x), pdcp_tables_channel(&x.arb->bus.tables, 2, 1)));
    exchange_run(&x, linking);
    exchange_clear(&x);
}

/* An output that cannot be kept takes all its links with it. */
static void test_an_output_that_is_not_kept(void)
{
    static const exchange_pair_t silencing[] = {
        {"311#04 04 01 00", "211#84 01 04 01"},   {"312#04 04 01 00", "212#84 01 04 01"},
        {"312#04 07 01 0000", "212#84 01 07 01"}, {"313#04 04 01 00", "213#84 01 04 01"},
        {"313#04 07 01 0000", "213#84 01 07 01"}, {NULL, NULL},
    };
    exchange_make_link(&x);
    link_second_input();
    pdcp_arb_audit(x.arb, x.now_ms);
    for (int turn = 0; turn < 4; turn++) {
        ask("311#03 04 01", "211#83 01 04 01 00");
        if (turn < 3) {
            exchange_run(&x, writing);
            ask("312#03 04 01", "212#83 01 04 01 01");
            ask("313#03 04 01", "213#83 01 04 01 01");
            ask("311#03 05 01", "211#83 01 05 01 FE");
            ask("312#03 07 01", "212#83 01 07 01 11 FE");
            ask("313#03 07 01", "213#83 01 07 01 11 FE");
        }
    }
    TEST_ASSERT_EQUAL(4, exchange_count(&x, PDCP_EVENT_AUDIT));
    TEST_ASSERT_EQUAL(2, exchange_count(&x, PDCP_EVENT_LINK));
    TEST_ASSERT_EQUAL(PDCP_ERR_DIFFERS, exchange_last(&x, PDCP_EVENT_LINK)->status);
    exchange_run(&x, silencing);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, exchange_input_entry(&x)->link);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE,
                      x.arb->bus.tables.channels[pdcp_tables_channel(&x.arb->bus.tables, 2, 1)].link);
}

/* An answer is compared only if neither the entry nor a job has changed since the question. */
static void test_an_answer_that_was_overtaken(void)
{
    begin(false);
    exchange_pass(&x, 60);
    exchange_tx(&x, "311#03 04 01");
    exchange_rx(&x, "212#0F 01"); /* Update Data Channel: a job */
    exchange_tx(&x, "312#03 05 01");
    exchange_rx(&x, "212#83 01 05 01 0200 0200");
    exchange_tx(&x, "312#03 06 01");
    exchange_rx(&x, "212#83 01 06 01 0400 01");
    exchange_tx(&x, "312#8F 01 01");
    exchange_rx(&x, "211#83 01 04 01 00"); /* asked before it */
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_AUDIT));
    ask("312#03 04 01", "212#83 01 04 01 01");
}

/* The link is taken away after the question. */
static void test_an_answer_about_a_link_that_is_gone(void)
{
    begin(false);
    ask("311#03 04 01", "211#83 01 04 01 01");
    exchange_pass(&x, 60);
    exchange_tx(&x, "312#03 04 01");
    TEST_ASSERT_TRUE(pdcp_arb_disconnect(x.arb, exchange_input(&x)));
    exchange_silence(&x);
    exchange_rx(&x, "212#83 01 04 01 00");
    exchange_pairs(&x, exchange_removing);
    exchange_tx(&x, "311#04 04 01 00");
    exchange_rx(&x, "211#84 01 04 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_AUDIT));
}

/* While a device is set up, a link is made or a link request waits, nothing is asked. */
static void test_everything_else_comes_first(void)
{
    begin(false);
    exchange_bind(&x, "13", "0300 0300 0900");
    exchange_tx(&x, "313#03 01 00");
    exchange_pass(&x, 90);
    exchange_silence(&x);
    exchange_rx(&x, "213#83 01 01 00 0300 0300");
    exchange_ask(&x, "13", "03 02 00", "83 01 02 00 0900");
    exchange_ask(&x, "13", "03 06 00", "83 00 06 00");
    exchange_ask(&x, "13", "03 0B 00", "83 00 0B 00");
    exchange_ask(&x, "13", "03 0A 00", "83 00 0A 00");
    exchange_ask(&x, "13", "03 09 00", "83 01 09 00 00"); /* no channels: it is set up */
    exchange_pass(&x, 30);
    exchange_tx(&x, "311#03 04 01");
    exchange_rx(&x, "211#83 01 04 01 01");
    exchange_rx(&x, "212#0F 01");
    exchange_tx(&x, "312#03 05 01");
    exchange_pass(&x, 90); /* a job waits for its device */
    exchange_silence(&x);
}

/* A device whose place is taken is passed over, and so is one that is not set up. */
static void test_a_busy_device_holds_up_nobody(void)
{
    uint8_t bytes[8];
    begin(false);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 0, 0, 7, bytes, sizeof bytes));
    exchange_tx(&x, "311#03 07 00");
    ask("312#03 04 01", "212#83 01 04 01 01");
    exchange_rx(&x, "211#83 01 07 00 41");
    ask("311#03 05 01", "211#83 01 05 01 FE");
    ask("312#03 07 01", "212#83 01 07 01 11 FE");
    ask("311#03 04 01", "211#83 01 04 01 01");
}

/* What was refused is asked again when the device was set up again. */
static void test_a_refusal_ends_with_the_next_setup(void)
{
    begin(true);
    ask("311#03 04 01", "211#83 00 04 01");
    ask("312#03 04 01", "212#83 00 04 01");
    ask("311#03 05 01", "211#83 00 05 01");
    ask("312#03 07 01", "212#83 00 07 01");
    ask("312#03 05 01", "212#83 00 05 01");
    ask("312#03 06 01", "212#83 00 06 01");
    for (int i = 0; i < 5; i++) {
        exchange_pass(&x, 200);
        exchange_silence(&x);
        exchange_beacons(&x);
    }
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_AUDIT));
    pdcp_audit_on_ready(&x.arb->bus, 0);
    exchange_pass(&x, 60);
    exchange_tx(&x, "311#03 04 01");
}

/* D-BUS-41: an unanswered question of the audit, of one try, is no sign that a device was reset. */
static void test_a_lost_answer_does_not_bind_another_device(void)
{
    begin(false);
    exchange_pass(&x, 60);
    exchange_tx(&x, "311#03 04 01");
    exchange_rx(&x, "611#01 0200 0200 0400"); /* its identity asks again */
    exchange_silence(&x);
    exchange_pass(&x, 100); /* the answer is lost */
    exchange_tx(&x, "311#03 01 00");
    exchange_rx(&x, "211#83 01 01 00 0200 0200");
    exchange_tx(&x, "311#81 00 0200 0200 0400"); /* refused: it is another one */
}

/* Somebody else's frames put a device first, but never keep the others from their turn. */
static void test_a_flood_of_foreign_frames(void)
{
    unsigned first = 0;
    unsigned others = 0;
    begin(false);
    for (int ms = 1; ms <= 60 * 40; ms++) {
        exchange_rx(&x, "312#03 01 00");
        exchange_wait(&x, 1);
        if (ms % 500 == 0) {
            exchange_beacons(&x);
        }
        const can_frame_t *sent = pdcp_arb_tx_peek(x.arb);
        if (sent == NULL) {
            continue;
        }
        first += sent->id == 0x312 ? 1 : 0;
        others += sent->id == 0x311 ? 1 : 0;
        const bool is_enabled = sent->data[1] == 4;
        const bool is_first = sent->id == 0x312;
        pdcp_arb_tx_pop(x.arb);
        if (is_first) {
            exchange_rx(&x, is_enabled ? "212#83 01 04 01 01" : "212#83 01 07 01 11 FE");
        } else {
            exchange_rx(&x, is_enabled ? "211#83 01 04 01 01" : "211#83 01 05 01 FE");
        }
    }
    TEST_ASSERT_EQUAL(40, first + others);
    TEST_ASSERT_GREATER_OR_EQUAL(20, first);
    TEST_ASSERT_GREATER_OR_EQUAL(8, others);
}

/* A device goes first as a whole, its channels without a link too. */
static void test_a_channel_without_a_link_goes_first_too(void)
{
    pdcp_arb_audit(x.arb, x.now_ms);
    exchange_rx(&x, "312#04 04 01 01");
    exchange_pass(&x, 60);
    exchange_tx(&x, "312#03 04 01");
    exchange_rx(&x, "212#83 01 04 01 01");
    exchange_pairs(&x, exchange_silencing);
    TEST_ASSERT_EQUAL(exchange_input(&x), exchange_last(&x, PDCP_EVENT_AUDIT)->channel);
    TEST_ASSERT_EQUAL(4, exchange_last(&x, PDCP_EVENT_AUDIT)->status);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_turn_with_the_profile_layer);
    RUN_TEST(test_each_parameter_is_compared);
    RUN_TEST(test_an_input_without_a_link);
    RUN_TEST(test_an_input_whose_source_is_not_decided);
    RUN_TEST(test_an_input_that_refused_to_be_disabled);
    RUN_TEST(test_an_input_that_was_disabled_by_itself);
    RUN_TEST(test_an_output_that_the_host_has_enabled);
    RUN_TEST(test_a_source_that_is_not_kept);
    RUN_TEST(test_three_repairs_in_more_than_a_minute);
    RUN_TEST(test_an_output_that_is_not_kept);
    RUN_TEST(test_an_answer_that_was_overtaken);
    RUN_TEST(test_an_answer_about_a_link_that_is_gone);
    RUN_TEST(test_everything_else_comes_first);
    RUN_TEST(test_a_busy_device_holds_up_nobody);
    RUN_TEST(test_a_refusal_ends_with_the_next_setup);
    RUN_TEST(test_a_lost_answer_does_not_bind_another_device);
    RUN_TEST(test_a_flood_of_foreign_frames);
    RUN_TEST(test_a_channel_without_a_link_goes_first_too);
    return UNITY_END();
}
