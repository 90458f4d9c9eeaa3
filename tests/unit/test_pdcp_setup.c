/* Setup of a bound device (pdcp-bus.md 6) and the requests it is made of (5): D-BUS-3, -5, -8, -13, -17, with
 * hand-written frames. */
#include <stdio.h>

#include "exchange.h"
#include "unity.h"

static exchange_t x;

void setUp(void)
{
    exchange_start(&x, 0xFFFFFE00u);
}

void tearDown(void) {}

static uint32_t stat_of(pdcp_stat_t stat)
{
    return x.arb->bus.stats[stat];
}

static const pdcp_device_entry_t *node(void)
{
    return &x.arb->bus.tables.devices[0];
}

static void bind_device(void)
{
    exchange_bind(&x, "11", "0200 0200 0500");
}

/* It has been asked how many channels it has. */
static void up_to_channels(const char *count)
{
    bind_device();
    exchange_set_up_device(&x, "11", "0200 0200 0500", count);
}

/* D-BUS-27. A controller with two inputs and an output, every parameter supported: the whole exchange in its
 * order. D-BUS-24: the first output gets id FEh. */
static void test_everything_is_read_and_written_in_order(void)
{
    static const exchange_pair_t pairs[] = {
        {"311#03 01 00", "211#83 01 01 00 0200 0200"}, {"311#03 02 00", "211#83 01 02 00 0500"},
        {"311#03 06 00", "211#83 01 06 00 3412 7856"}, {"311#03 0B 00", "211#83 01 0B 00 3200"},
        {"311#03 0A 00", "211#83 01 0A 00 C800"},      {"311#03 09 00", "211#83 01 09 00 03"},
        {"311#04 04 01 00", "211#84 01 04 01 00"},     {"311#04 04 02 00", "211#84 01 04 02"},
        {"311#04 04 03 00", "211#84 00 04 03 00"}, /* not supported: goes on */
        {"311#03 03 01", "211#83 01 03 01 01"},        {"311#03 03 02", "211#83 01 03 02 01"},
        {"311#03 03 03", "211#83 01 03 03 02"},        {"311#03 01 01", "211#83 01 01 01 0072 0022"},
        {"311#03 05 01", "211#83 01 05 01 0100 0300"}, {"311#03 06 01", "211#83 01 06 01 0700 02"},
        {"311#03 08 01", "211#83 01 08 01 0050 2021"}, {"311#03 09 01", "211#83 01 09 01 20"},
        {"311#03 0A 01", "211#83 01 0A 01 00"},        {"311#03 0B 01", "211#83 01 0B 01 1011"},
        {"311#03 01 02", "211#83 01 01 02 0052 1021"}, {"311#03 05 02", "211#83 00 05 02"},
        {"311#03 06 02", "211#83 00 06 02"},           {"311#03 08 02", "211#83 00 08 02"},
        {"311#03 09 02", "211#83 00 09 02"},           {"311#03 0A 02", "211#83 01 0A 02 40 00 00 00"},
        {"311#03 0B 02", "211#83 00 0B 02"},           {"311#03 01 03", "211#83 01 01 03 0050 0011"},
        {"311#03 09 03", "211#83 01 09 03 60"},        {"311#03 0A 03", "211#83 01 0A 03 7F"},
        {"311#04 05 03 FE", "211#84 01 05 03 FE"},     {NULL, NULL},
    };
    bind_device();
    exchange_run(&x, pairs);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_READY));
    TEST_ASSERT_EQUAL_HEX16(0x1234, node()->type);
    TEST_ASSERT_EQUAL_HEX16(0x5678, node()->profile);
    TEST_ASSERT_EQUAL(50, node()->ack_ms);
    TEST_ASSERT_EQUAL(200, node()->beacon_ms);

    const pdcp_tables_t *tables = &x.arb->bus.tables;
    const uint8_t first = pdcp_tables_channel(tables, 0, 1);
    const uint8_t second = pdcp_tables_channel(tables, 0, 2);
    const uint8_t third = pdcp_tables_channel(tables, 0, 3);
    TEST_ASSERT_EQUAL_HEX16(0x7200, tables->channels[first].type);
    TEST_ASSERT_EQUAL_HEX16(0x2200, tables->channels[first].profile);
    TEST_ASSERT_EQUAL(PDCP_INPUT, tables->channels[first].transfer);
    TEST_ASSERT_EQUAL(1, tables->channels[first].source.identity.vid);
    TEST_ASSERT_EQUAL(3, tables->channels[first].source.identity.pid);
    TEST_ASSERT_EQUAL(7, tables->channels[first].source.identity.sn);
    TEST_ASSERT_EQUAL(2, tables->channels[first].source.index);
    TEST_ASSERT_EQUAL_HEX16(0x5000, tables->channels[first].source.type);
    TEST_ASSERT_EQUAL_HEX16(0x2120, tables->channels[first].source.profile);
    TEST_ASSERT_EQUAL_HEX16(0x1110, tables->channels[first].terminal_profile);
    TEST_ASSERT_EQUAL(PDCP_NO_SOURCE_INDEX, tables->channels[second].source.index); /* D-BUS-7 */
    TEST_ASSERT_EQUAL(PDCP_OUTPUT, tables->channels[third].transfer);
    TEST_ASSERT_EQUAL(0xFE, tables->channels[third].node_id);

    /* D-BUS-8: bit 7 of the first byte is channel index 0; D-BUS-13: only bits of inputs that exist are
     * kept. */
    TEST_ASSERT_TRUE(pdcp_tables_needs(tables, first, false, 2));
    TEST_ASSERT_FALSE(pdcp_tables_needs(tables, first, false, 1));
    TEST_ASSERT_FALSE(pdcp_tables_needs(tables, first, true, 2));
    TEST_ASSERT_TRUE(pdcp_tables_needs(tables, second, true, 1));
    TEST_ASSERT_FALSE(pdcp_tables_needs(tables, second, false, 1));
    TEST_ASSERT_TRUE(pdcp_tables_needs(tables, third, false, 1));
    TEST_ASSERT_TRUE(pdcp_tables_needs(tables, third, false, 2));
    TEST_ASSERT_TRUE(pdcp_tables_needs(tables, third, true, 1));
    TEST_ASSERT_FALSE(pdcp_tables_needs(tables, third, true, 3)); /* an output */
    TEST_ASSERT_FALSE(pdcp_tables_needs(tables, third, true, 7)); /* does not exist */
}

/* pdcp-bus.md 6: only 1 and 9 of the device and 1 and 3 of a channel are mandatory; D-BUS-13: defaults. */
static void test_unsupported_parameters_get_defaults(void)
{
    static const exchange_pair_t pairs[] = {
        {"311#03 01 00", "211#83 01 01 00 0200 0200"},
        {"311#03 02 00", "211#83 00 02 00"},
        {"311#03 06 00", "211#83 00 06 00"},
        {"311#03 0B 00", "211#83 00 0B 00"},
        {"311#03 0A 00", "211#83 00 0A 00"},
        {"311#03 09 00", "211#83 01 09 00 00"},
        {NULL, NULL},
    };
    bind_device();
    exchange_run(&x, pairs);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_READY));
    TEST_ASSERT_EQUAL(100, node()->ack_ms);
    TEST_ASSERT_EQUAL(500, node()->beacon_ms);
}

static void up_to_times(const char *ack, const char *beacon)
{
    const exchange_pair_t pairs[] = {{"311#03 01 00", "211#83 01 01 00 0200 0200"},
                                     {"311#03 02 00", "211#83 01 02 00 0500"},
                                     {"311#03 06 00", "211#83 00 06 00"},
                                     {"311#03 0B 00", ack},
                                     {"311#03 0A 00", beacon},
                                     {"311#03 09 00", "211#83 01 09 00 00"},
                                     {NULL, NULL}};
    bind_device();
    exchange_run(&x, pairs);
}

/* D-BUS-13 */
static void test_times_are_clamped_from_below(void)
{
    up_to_times("211#83 01 0B 00 13 00", "211#83 01 0A 00 31 00");
    TEST_ASSERT_EQUAL(20, node()->ack_ms);
    TEST_ASSERT_EQUAL(50, node()->beacon_ms);
}

static void test_times_are_clamped_from_above(void)
{
    up_to_times("211#83 01 0B 00 F501", "211#83 01 0A 00 1127");
    TEST_ASSERT_EQUAL(500, node()->ack_ms);
    TEST_ASSERT_EQUAL(10000, node()->beacon_ms);
}

/* pdcp-bus.md 5: no answer within the acknowledgement time, 100 ms: repeated, twice. D-BUS-17: five times,
 * 250 ms between them, then the device stays bound but unlinked. */
static void test_a_silent_device_is_tried_and_then_left(void)
{
    bind_device();
    for (int attempt = 0; attempt < 5; attempt++) {
        exchange_tx(&x, "311#03 01 00");
        for (int repeat = 0; repeat < 2; repeat++) {
            exchange_pass(&x, 99);
            exchange_silence(&x);
            exchange_pass(&x, 1);
            exchange_tx(&x, "311#03 01 00");
        }
        exchange_pass(&x, 99);
        exchange_rx(&x, "011#0A"); /* it lives, it only does not answer */
        TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_READY));
        exchange_pass(&x, 1);
        exchange_silence(&x);
        if (attempt < 4) {
            exchange_pass(&x, 249);
            exchange_silence(&x);
            exchange_pass(&x, 1);
        }
    }
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_SETUP_FAILED));
    TEST_ASSERT_EQUAL(5, stat_of(PDCP_STAT_NO_ANSWER));
    TEST_ASSERT_EQUAL(10, stat_of(PDCP_STAT_REPEATS));
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_devices(&x.arb->bus.tables)); /* bound */
}

static void test_a_mandatory_parameter_that_is_refused_ends_the_attempt(void)
{
    bind_device();
    exchange_tx(&x, "311#03 01 00");
    exchange_rx(&x, "211#83 00 01 00");
    exchange_silence(&x);
    exchange_pass(&x, 250);
    exchange_tx(&x, "311#03 01 00");
}

/* Identity read must match the binding (pdcp-bus.md 6). */
static void test_another_identity_than_the_bound_one_fails(void)
{
    bind_device();
    exchange_tx(&x, "311#03 01 00");
    exchange_rx(&x, "211#83 01 01 00 0200 0300");
    exchange_tx(&x, "311#0B"); /* two devices have this id: both bind again (D-BUS-54) */
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_devices(&x.arb->bus.tables));
    exchange_rx(&x, "611#01 0200 0200 0500");
    exchange_tx(&x, "311#81 11 0200 0200 0500");
    exchange_tx(&x, "311#03 01 00");
}

static void test_a_direction_that_does_not_exist_fails(void)
{
    static const exchange_pair_t pairs[] = {
        {"311#04 04 01 00", "211#84 01 04 01 00"},
        {"311#03 03 01", "211#83 01 03 01 03"},
        {NULL, NULL},
    };
    up_to_channels("01");
    exchange_run(&x, pairs);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_READY));
    exchange_pass(&x, 250);
    exchange_tx(&x, "311#03 03 01"); /* the same step again (D-BUS-17) */
    exchange_rx(&x, "211#83 01 03 01 02");
    exchange_tx(&x, "311#03 01 01");
}

/* pdcp-bus.md 5: matched by device, function code, parameter id and channel index; late and unasked answers
 * are counted. */
static void test_only_the_right_answer_counts(void)
{
    bind_device();
    exchange_tx(&x, "311#03 01 00");
    exchange_rx(&x, "211#83 01 02 00 0200 0200"); /* another parameter */
    exchange_rx(&x, "211#83 01 01 01 0200 0200"); /* another channel */
    exchange_rx(&x, "211#84 01 01 00 0200 0200"); /* another function code */
    exchange_rx(&x, "212#83 01 01 00 0200 0200"); /* another device */
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(3, stat_of(PDCP_STAT_DROP_LATE));
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_DROP_UNKNOWN_ID));
    exchange_rx(&x, "211#83 01 01 00 0200 0200");
    exchange_tx(&x, "311#03 02 00");
    exchange_rx(&x, "211#83 01 01 00 0200 0200"); /* a late one */
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(4, stat_of(PDCP_STAT_DROP_LATE));
}

/* D-BUS-4, D-BUS-5: ignored, counted by cause, never answered. */
static void test_frames_that_a_device_must_not_send_are_counted(void)
{
    exchange_add_output(&x, "FE");
    exchange_rx(&x, "211#83 01 01");             /* too short */
    exchange_rx(&x, "211#11");                   /* reserved code */
    exchange_rx(&x, "211#50");                   /* device-specific code */
    exchange_rx(&x, "211#");                     /* no code */
    exchange_rx(&x, "211#03 01 00");             /* only an arbitrator asks */
    exchange_rx(&x, "211#81 11 0200 0200 0400"); /* only an arbitrator grants */
    exchange_rx(&x, "211#01 0200 0200 0400");    /* binding has its own priority */
    exchange_rx(&x, "211#05 010203");            /* deprecated */
    exchange_rx(&x, "211#87");                   /* deprecated */
    exchange_rx(&x, "311#0A");                   /* M=1, not ours */
    exchange_rx(&x, "100#0A");                   /* another arbitrator's beacon */
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_DROP_BAD_DLC));
    TEST_ASSERT_EQUAL(3, stat_of(PDCP_STAT_DROP_BAD_CODE));
    TEST_ASSERT_EQUAL(3, stat_of(PDCP_STAT_DROP_DIRECTION));
    TEST_ASSERT_EQUAL(2, stat_of(PDCP_STAT_DROP_DEPRECATED));
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_DROP_ARBITRATOR));
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_FOREIGN_BEACON));
}

static void test_other_kinds_of_frames_are_counted(void)
{
    static const struct {
        can_frame_kind_t kind;
        pdcp_stat_t stat;
    } kinds[] = {{CAN_FRAME_EXTENDED, PDCP_STAT_DROP_EXTENDED},
                 {CAN_FRAME_REMOTE, PDCP_STAT_DROP_REMOTE},
                 {CAN_FRAME_ERROR, PDCP_STAT_DROP_ERROR},
                 {CAN_FRAME_FD, PDCP_STAT_DROP_FD}};
    for (unsigned i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        can_frame_t frame = exchange_frame("611#01 0200 0200 0400");
        frame.kind = (uint8_t)kinds[i].kind;
        TEST_ASSERT_FALSE(pdcp_arb_on_frame(x.arb, x.now_ms, &frame));
        exchange_silence(&x);
        TEST_ASSERT_EQUAL(1, stat_of(kinds[i].stat));
    }
}

/* Devices are set up side by side: one that is slow holds nobody up. */
static void test_a_silent_device_holds_nobody_up(void)
{
    bind_device();
    exchange_tx(&x, "311#03 01 00"); /* never answered */
    exchange_add_input(&x);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_READY));
    TEST_ASSERT_EQUAL(1, exchange_last(&x, PDCP_EVENT_READY)->place);
}

/* Bit strings of more than 4 bytes come by bulk transfer: 83 with code 2, 0C, 8C with the size, packets
 * answered 8E. */
static void test_required_channels_by_bulk(void)
{
    static const exchange_pair_t before[] = {
        {"311#04 04 01 00", "211#84 01 04 01 00"},
        {"311#03 03 01", "211#83 01 03 01 01"},
        {"311#03 01 01", "211#83 01 01 01 0072 0022"},
        {"311#03 05 01", "211#83 00 05 01"},
        {"311#03 06 01", "211#83 00 06 01"},
        {"311#03 08 01", "211#83 00 08 01"},
        {"311#03 09 01", "211#83 02 09 01"},
        {"311#0C 09 01", "211#8C 01 09 01 0800"},
        {NULL, NULL},
    };
    up_to_channels("01");
    exchange_run(&x, before);
    exchange_rx(&x, "211#0E 00 40 0000000000");
    exchange_tx(&x, "311#8E 01");
    exchange_rx(&x, "211#0E 00 40 0000000000"); /* once more, its answer got lost (D-BUS-9) */
    exchange_tx(&x, "311#8E 01");
    exchange_rx(&x, "211#0E 01 0000");
    exchange_tx(&x, "311#8E 01");
    exchange_tx(&x, "311#03 0A 01");
    exchange_rx(&x, "211#83 00 0A 01");
    exchange_tx(&x, "311#03 0B 01");
    exchange_rx(&x, "211#83 00 0B 01");
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_READY));
    TEST_ASSERT_TRUE(pdcp_tables_needs(&x.arb->bus.tables, node()->first_channel, false, 1));
}

static void test_more_channels_than_there_is_room_for(void)
{
    up_to_channels("FE");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_NO_ROOM));
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_READY));
    TEST_ASSERT_EQUAL(0, node()->channel_count);
}

/* Lost after three beacon intervals without any frame; its ids are kept 10 s (pdcp-bus.md 9). */
static void test_a_device_is_lost_and_later_forgotten(void)
{
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 1499);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LOST));
    exchange_pass(&x, 1);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LOST));
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_devices(&x.arb->bus.tables));
    TEST_ASSERT_EQUAL(0, pdcp_tables_count_channels(&x.arb->bus.tables, PDCP_OUTPUT));
    TEST_ASSERT_NOT_EQUAL(0, x.arb->bus.tables.owner[0x11]);
    TEST_ASSERT_NOT_EQUAL(0, x.arb->bus.tables.owner[0xFE]);
    exchange_pass(&x, 9999);
    TEST_ASSERT_NOT_EQUAL(0, x.arb->bus.tables.owner[0x11]);
    exchange_pass(&x, 1);
    TEST_ASSERT_EQUAL(0, x.arb->bus.tables.owner[0x11]);
    TEST_ASSERT_EQUAL(0, x.arb->bus.tables.owner[0xFE]);
}

/* A device with a beacon interval of 100 ms that stops right after its binding: gone after 300 ms, not
 * 1500. */
static void test_a_short_beacon_interval_counts_at_once(void)
{
    up_to_times("211#83 00 0B 00", "211#83 01 0A 00 6400");
    exchange_rx(&x, "011#0A");
    exchange_pass(&x, 299);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LOST));
    exchange_pass(&x, 1);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LOST));
}

/* D-BUS-25: the host makes a device slower; it is not lost for that. */
static void test_a_beacon_interval_written_by_the_host_counts(void)
{
    uint8_t value[] = {0xE8, 0x03};
    exchange_add_output(&x, "FE");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_set(x.arb, 0, 0, 10, value, sizeof value));
    exchange_tx(&x, "311#04 0A 00 E803");
    exchange_rx(&x, "211#84 01 0A 00 E803");
    exchange_pass(&x, 2999);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LOST));
    exchange_pass(&x, 1);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LOST));
}

/* Any frame from it counts as life, channel data as well. */
static void test_channel_data_counts_as_life(void)
{
    exchange_add_both(&x);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, pdcp_tables_channel(&x.arb->bus.tables, 0, 1),
                                                pdcp_tables_channel(&x.arb->bus.tables, 1, 1)));
    exchange_run(&x, exchange_making);
    for (int i = 0; i < 4; i++) {
        exchange_pass(&x, 1000);
        exchange_rx(&x, "0FE#55");
        exchange_rx(&x, "012#0A");
    }
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LOST));
    TEST_ASSERT_EQUAL(4, stat_of(PDCP_STAT_CHANNEL_DATA));
}

/* D-BUS-36: on the id of an output that is not enabled speaks an unknown device, 100 ms after its disabling
 * was answered: that is no life of the owner. */
static void test_data_of_an_output_that_is_silent_is_an_unknown_devices(void)
{
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 99);
    exchange_rx(&x, "0FE#55");
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_CHANNEL_DATA));
    exchange_pass(&x, 1);
    for (int i = 0; i < 4; i++) {
        exchange_rx(&x, "0FE#55");
        exchange_pass(&x, 400);
    }
    TEST_ASSERT_EQUAL(1, stat_of(PDCP_STAT_CHANNEL_DATA));
    TEST_ASSERT_EQUAL(4, stat_of(PDCP_STAT_DROP_UNKNOWN_ID));
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LOST));
}

/* D-BUS-15: a beacon from an id that is not bound gets Reset Device, at most once a second, not in the first
 * 1200 ms. */
static void test_an_unknown_device_is_told_to_reset(void)
{
    exchange_pass(&x, 1199 - PDCP_CLOSED_MS);
    exchange_rx(&x, "042#0A");
    exchange_silence(&x);
    exchange_pass(&x, 1);
    exchange_rx(&x, "042#0A");
    exchange_tx(&x, "342#0B");
    exchange_rx(&x, "043#0A");
    exchange_tx(&x, "343#0B");
    exchange_pass(&x, 999);
    exchange_rx(&x, "042#0A");
    exchange_silence(&x);
    exchange_pass(&x, 1);
    exchange_rx(&x, "042#0A");
    exchange_tx(&x, "342#0B");
    exchange_rx(&x, "044#0A 00"); /* channel data of somebody, no beacon */
    exchange_rx(&x, "000#0A");    /* no device has these ids */
    exchange_rx(&x, "0FF#0A");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(3, stat_of(PDCP_STAT_UNKNOWN_RESET));
}

/* D-BUS-15: from an id that is kept for a lost device: it is read who it is, and it is set up without a
 * reset. */
static void test_a_lost_device_that_beacons_is_taken_back(void)
{
    exchange_add_output(&x, "FE");
    exchange_pass(&x, 1500);
    exchange_rx(&x, "011#0A");
    exchange_tx(&x, "311#03 01 00");
    exchange_rx(&x, "211#83 01 01 00 0200 0200");
    exchange_tx(&x, "311#03 02 00");
}

/* D-BUS-11 */
static void test_the_arbitrator_beacons_every_500_ms(void)
{
    exchange_wait(&x, 499);
    exchange_silence(&x);
    exchange_wait(&x, 1);
    exchange_tx(&x, "100#0A");
    exchange_wait(&x, 500);
    exchange_tx(&x, "100#0A");
    exchange_silence(&x);
}

/* The deadline that a step returns is never later than what is due. */
static void test_the_next_deadline_is_known(void)
{
    TEST_ASSERT_EQUAL_HEX32(x.now_ms + 500, pdcp_arb_step(x.arb, x.now_ms));
    bind_device();
    exchange_tx(&x, "311#03 01 00");
    TEST_ASSERT_EQUAL_HEX32(x.now_ms + 100, pdcp_arb_step(x.arb, x.now_ms));
}

/* Frames leave by identifier, not by age; a full queue is counted and the request repeated. */
static void test_a_full_transmit_queue_loses_no_request(void)
{
    can_frame_t filler = exchange_frame("5FF#00");
    while (pdcp_txq_put(&x.arb->bus.txq, &filler) == PDCP_TXQ_TAKEN) {
    }
    exchange_rx(&x, "611#01 0200 0200 0500");
    TEST_ASSERT_GREATER_THAN(0, stat_of(PDCP_STAT_TX_FULL));
    (void)exchange_drain(&x);
    exchange_pass(&x, 100);
    exchange_tx(&x, "311#03 01 00");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_everything_is_read_and_written_in_order);
    RUN_TEST(test_unsupported_parameters_get_defaults);
    RUN_TEST(test_times_are_clamped_from_below);
    RUN_TEST(test_times_are_clamped_from_above);
    RUN_TEST(test_a_silent_device_is_tried_and_then_left);
    RUN_TEST(test_a_mandatory_parameter_that_is_refused_ends_the_attempt);
    RUN_TEST(test_another_identity_than_the_bound_one_fails);
    RUN_TEST(test_a_direction_that_does_not_exist_fails);
    RUN_TEST(test_only_the_right_answer_counts);
    RUN_TEST(test_frames_that_a_device_must_not_send_are_counted);
    RUN_TEST(test_other_kinds_of_frames_are_counted);
    RUN_TEST(test_a_silent_device_holds_nobody_up);
    RUN_TEST(test_required_channels_by_bulk);
    RUN_TEST(test_more_channels_than_there_is_room_for);
    RUN_TEST(test_a_device_is_lost_and_later_forgotten);
    RUN_TEST(test_a_short_beacon_interval_counts_at_once);
    RUN_TEST(test_a_beacon_interval_written_by_the_host_counts);
    RUN_TEST(test_channel_data_counts_as_life);
    RUN_TEST(test_data_of_an_output_that_is_silent_is_an_unknown_devices);
    RUN_TEST(test_an_unknown_device_is_told_to_reset);
    RUN_TEST(test_a_lost_device_that_beacons_is_taken_back);
    RUN_TEST(test_the_arbitrator_beacons_every_500_ms);
    RUN_TEST(test_the_next_deadline_is_known);
    RUN_TEST(test_a_full_transmit_queue_loses_no_request);
    return UNITY_END();
}
