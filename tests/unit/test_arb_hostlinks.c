/* Links by the host (2307h to 2309h): which it may make, and which error it is told (D-API-4, D-API-6,
 * D-API-13). */
#include "hostlink.h"
#include "unity.h"

static exchange_t x;
static arb_app_t app;

void setUp(void)
{
    hostlink_start(&x, &app, false);
}

void tearDown(void) {}

static pdcp_channel_t *channel(uint8_t place)
{
    pdcp_tables_t *tables = &x.arb->bus.tables;
    return &tables->channels[pdcp_tables_channel(tables, place, 1)];
}

/* D-API-4, 08h: an output feeds no more than one input that wants it for itself (5300h has the bit). */
static void test_sole_access(void)
{
    exchange_add_both(&x);
    exchange_add_second_input(&x);
    channel(1)->link = PDCP_LINK_INACTIVE; /* remembered: it comes back */
    channel(1)->source.identity = x.arb->bus.tables.devices[0].identity;
    channel(1)->source.index = 1;
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, 2, 0, 2, 0, 7, 0, 1));
    hostlink_error(0x2309, 0x08);
    exchange_silence(&x);
    channel(2)->type = 0x0051; /* the second one would share it */
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, 2, 0, 2, 0, 7, 0, 1));
    exchange_tx(&x, "313#04 05 01 0200 0200");
    hostlink_silence();
}

/* The input of this device has a link to the output. */
static void remember_link(uint8_t place, uint8_t status)
{
    channel(place)->link = status;
    channel(place)->source.channel = pdcp_tables_channel(&x.arb->bus.tables, 0, 1);
    channel(place)->source.identity = x.arb->bus.tables.devices[0].identity;
    channel(place)->source.index = 1;
}

/* D-API-13: an input that has the link already, inactive, does not get it while another one works. One that
 * works may be asked for again, and of two that rest one may be made. */
static void test_sole_access_of_a_link_that_rests(void)
{
    exchange_add_both(&x);
    exchange_add_second_input(&x);
    remember_link(1, PDCP_LINK_INACTIVE);
    remember_link(2, PDCP_LINK_ACTIVE);
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    hostlink_error(0x2309, 0x08);
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, 2, 0, 2, 0, 7, 0, 1));
    hostlink_reply(0x2308, BYTES(2));
    exchange_silence(&x);
    remember_link(2, PDCP_LINK_INACTIVE);
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    exchange_tx(&x, "312#04 05 01 0200 0200");
    hostlink_silence();
}

/* D-API-13: what counts is how things are when the link is made: the other input's device asks for the output
 * first (Update Data Channel), and gets it while the host's link waits. */
static void test_sole_access_of_a_link_that_waits(void)
{
    static const exchange_pair_t asked_for[] = {
        {"313#03 06 01", "213#83 01 06 01 0400 01"},
        {"313#04 05 01 0200 0200", "213#84 01 05 01 0200 0200"},
        {"313#04 06 01 0400 01", "213#84 01 06 01 0400 01"},
        {"313#04 08 01 0050 2021", "213#84 01 08 01 0050 2021"},
        {"313#04 07 01 11 FE", "213#84 01 07 01 11 FE"},
        {"313#04 04 01 01", "213#84 01 04 01 01"},
        {"311#04 04 01 01", "211#84 01 04 01 01"},
        {"313#8F 01 01", NULL},
        {NULL, NULL},
    };
    exchange_add_both(&x);
    exchange_add_second_input(&x);
    exchange_rx(&x, "213#0F 01");
    exchange_tx(&x, "313#03 05 01");
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    hostlink_silence();
    exchange_rx(&x, "213#83 01 05 01 0200 0200");
    exchange_run(&x, asked_for);
    hostlink_error(0x2309, 0x08);
}

/* D-API-4, 09h: all node ids are given out, so that the device could not be set up. */
static void test_an_output_without_a_node_id(void)
{
    exchange_add_both(&x);
    x.arb->bus.tables.devices[0].state = PDCP_PLACE_FAILED;
    channel(0)->node_id = 0;
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    hostlink_error(0x2309, 0x09);
    hostlink_request(0x2307, BYTES(DEV_OUT, 2, DEV_IN, 1));
    hostlink_error(0x2309, 0x04);
}

/* D-API-6: an output never feeds an input of its own device: 0Fh. */
static void test_an_output_for_its_own_device(void)
{
    exchange_add_both(&x);
    exchange_add_second_input(&x);
    channel(2)->link = PDCP_LINK_INACTIVE; /* another input has it for itself: that comes second */
    channel(2)->source.identity = x.arb->bus.tables.devices[0].identity;
    channel(2)->source.index = 1;
    channel(1)->place = 0;
    channel(0)->next = pdcp_tables_channel(&x.arb->bus.tables, 1, 1);
    channel(1)->index = 2;
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, DEV_OUT, 2));
    hostlink_error(0x2309, 0x0F);
}

/* A request whose waiting is over, behind an answer that the host does not take: nothing to be done at once,
 * again and again. */
static void test_a_host_that_does_not_read_costs_no_time(void)
{
    exchange_add_both(&x);
    exchange_rx(&x, "613#01 0200 0200 0700"); /* its setup is waited for */
    hostlink_room(0);
    hostlink_request(0x2307, BYTES(DEV_OUT, 1, DEV_IN, 1));
    for (int i = 0; i < 4; i++) {
        hostlink_request(0x2201, NULL, 0); /* the last one is the fifth */
    }
    TEST_ASSERT_TRUE(app.api.turn.waiting);
    TEST_ASSERT_EQUAL(1, app.api.counters[ARB_HOSTAPI_BUSY]);
    exchange_wait(&x, 2100);
    (void)exchange_drain(&x);
    TEST_ASSERT_GREATER_THAN_INT32(0, (int32_t)(arb_app_step(&app, x.now_ms) - x.now_ms));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sole_access);
    RUN_TEST(test_sole_access_of_a_link_that_rests);
    RUN_TEST(test_sole_access_of_a_link_that_waits);
    RUN_TEST(test_an_output_without_a_node_id);
    RUN_TEST(test_an_output_for_its_own_device);
    RUN_TEST(test_a_host_that_does_not_read_costs_no_time);
    return UNITY_END();
}
