/* What happens seldom (pdcp-bus.md 3 to 9): tables that are full, things that fall together, devices that
 * answer oddly; with hand-written frames. Every device here is 0002:0002:serial, every output is a 5000h with
 * profile 2120h. */
#include <stdio.h>
#include <string.h>

#include "exchange.h"
#include "pdcp_link.h"
#include "unity.h"

static exchange_t x;
static uint8_t bytes[16];

void setUp(void)
{
    exchange_start(&x, 0xFFFFFF00u);
    memset(bytes, 0, sizeof bytes);
}

void tearDown(void) {}

/* --- frames --- */

/* From the device and to it. */
static void from(unsigned id, const char *data)
{
    char text[48];
    (void)snprintf(text, sizeof text, "2%02X#%s", id, data);
    exchange_rx(&x, text);
}

static void to(unsigned id, const char *data)
{
    char text[48];
    (void)snprintf(text, sizeof text, "3%02X#%s", id, data);
    exchange_tx(&x, text);
}

static void answered(unsigned id, const char *request, const char *answer)
{
    to(id, request);
    from(id, answer);
}

/* A parameter is read; value NULL: the device does not support it. */
static void read(unsigned id, unsigned param, unsigned channel, const char *value)
{
    char request[16];
    char answer[40];
    (void)snprintf(request, sizeof request, "03 %02X %02X", param, channel);
    (void)snprintf(answer, sizeof answer, "83 %s %02X %02X %s", value != NULL ? "01" : "00", param, channel,
                   value != NULL ? value : "");
    answered(id, request, answer);
}

static void written(unsigned id, unsigned param, unsigned channel, const char *value, const char *result)
{
    char request[40];
    char answer[16];
    (void)snprintf(request, sizeof request, "04 %02X %02X %s", param, channel, value);
    (void)snprintf(answer, sizeof answer, "84 %s %02X %02X", result, param, channel);
    answered(id, request, answer);
}

static void wrote(unsigned id, unsigned param, unsigned channel, const char *value)
{
    written(id, param, channel, value, "01");
}

static void refused(unsigned id, unsigned param, unsigned channel, const char *value)
{
    written(id, param, channel, value, "00");
}

/* --- devices --- */

static void asks_for(unsigned id, unsigned serial)
{
    char text[40];
    (void)snprintf(text, sizeof text, "6%02X#01 0200 0200 %02X00", id, serial);
    exchange_rx(&x, text);
}

static void is_told(unsigned asked, unsigned id, unsigned serial)
{
    char text[40];
    (void)snprintf(text, sizeof text, "81 %02X 0200 0200 %02X00", id, serial);
    to(asked, text);
}

static void beacon(unsigned id)
{
    char text[16];
    (void)snprintf(text, sizeof text, "0%02X#0A", id);
    exchange_rx(&x, text);
}

static void set_up_device(unsigned id, unsigned serial, unsigned channels)
{
    char value[8];
    read(id, 1, 0, "0200 0200");
    (void)snprintf(value, sizeof value, "%02X00", serial);
    read(id, 2, 0, value);
    read(id, 6, 0, NULL);
    read(id, 11, 0, NULL);
    read(id, 10, 0, NULL);
    (void)snprintf(value, sizeof value, "%02X", channels);
    read(id, 9, 0, value);
}

/* channels: one letter each, i or o. */
static void set_up_directions(unsigned id, const char *channels)
{
    for (unsigned i = 0; channels[i] != '\0'; i++) {
        wrote(id, 4, i + 1, "00");
    }
    for (unsigned i = 0; channels[i] != '\0'; i++) {
        read(id, 3, i + 1, channels[i] == 'i' ? "01" : "02");
    }
}

static void set_up_output(unsigned id, unsigned channel, unsigned out_id)
{
    char value[8];
    read(id, 1, channel, "0050 2021");
    read(id, 9, channel, NULL);
    read(id, 10, channel, NULL);
    (void)snprintf(value, sizeof value, "%02X", out_id);
    wrote(id, 5, channel, value);
}

static void set_up_input(unsigned id, unsigned channel)
{
    read(id, 1, channel, "0053 1011");
    read(id, 5, channel, NULL);
    read(id, 6, channel, NULL);
    read(id, 8, channel, NULL);
    read(id, 9, channel, NULL);
    read(id, 10, channel, NULL);
    read(id, 11, channel, NULL);
}

/* All of a setup; the first output gets out_id, the next one below it. */
static void set_up(unsigned id, unsigned serial, const char *channels, unsigned out_id)
{
    set_up_device(id, serial, (unsigned)strlen(channels));
    set_up_directions(id, channels);
    for (unsigned i = 0; channels[i] != '\0'; i++) {
        if (channels[i] == 'i') {
            set_up_input(id, i + 1);
        } else {
            set_up_output(id, i + 1, out_id--);
        }
    }
}

static void bind(unsigned id, unsigned serial)
{
    asks_for(id, serial);
    is_told(id, id, serial);
}

static void add(unsigned id, unsigned serial, const char *channels, unsigned out_id)
{
    bind(id, serial);
    set_up(id, serial, channels, out_id);
    beacon(id);
}

/* A device that answers Reset Device is lost at once. */
static void lose(uint8_t place, unsigned id)
{
    TEST_ASSERT_TRUE(pdcp_arb_reset(x.arb, x.now_ms, place));
    answered(id, "0B", "8B 01");
    TEST_ASSERT_EQUAL(PDCP_PLACE_LOST, x.arb->bus.tables.devices[place].state);
}

/* --- channels and links --- */

static uint8_t number(uint8_t place, uint8_t index)
{
    return pdcp_tables_channel(&x.arb->bus.tables, place, index);
}

static const pdcp_channel_t *channel(uint8_t place, uint8_t index)
{
    return &x.arb->bus.tables.channels[number(place, index)];
}

static void ask_link(uint8_t out_node, uint8_t in_node)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, number(out_node, 1), number(in_node, 1)));
}

/* What names the source, output 1 of device 0002:0002:serial, to input 1. */
static void name_source(unsigned id, unsigned serial)
{
    char value[16];
    wrote(id, 5, 1, "0200 0200");
    (void)snprintf(value, sizeof value, "%02X00 01", serial);
    wrote(id, 6, 1, value);
    wrote(id, 8, 1, "0050 2021");
}

/* All that an input is told when it is linked. */
static void link_input(unsigned id, unsigned serial, unsigned out_device, unsigned out_id)
{
    char value[16];
    name_source(id, serial);
    (void)snprintf(value, sizeof value, "%02X %02X", out_device, out_id);
    wrote(id, 7, 1, value);
    wrote(id, 4, 1, "01");
}

/* Device 11h, serial 4, with an output FEh, and device 12h, serial 6, with an input. */
static void add_two(void)
{
    add(0x11, 4, "o", 0xFE);
    add(0x12, 6, "i", 0);
    exchange_clear(&x);
}

static void add_two_linked(void)
{
    add_two();
    ask_link(0, 1);
    link_input(0x12, 4, 0x11, 0xFE);
    wrote(0x11, 4, 1, "01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(1, 1)->link);
    exchange_clear(&x);
}

/* Update Data Channel for input 1, whose source is then read. */
static void update(unsigned id, const char *vid_pid, const char *sn_index)
{
    from(id, "0F 01");
    read(id, 5, 1, vid_pid);
    read(id, 6, 1, sn_index);
}

/* --- node ids --- */

static void in_use(unsigned first, unsigned last)
{
    for (unsigned id = first; id <= last; id++) {
        if (x.arb->bus.tables.owner[id] == 0) {
            x.arb->bus.tables.owner[id] = 0x80u | 40u;
        }
    }
}

static void remember(uint16_t serial, uint8_t id)
{
    const pdcp_remembered_t entry = {.identity = {2, 2, serial}, .node_id = id};
    TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&x.arb->bus.bind, &entry));
}

static void test_stored_identities_beyond_the_table_are_left_out(void)
{
    const pdcp_remembered_t more = {.identity = {2, 2, 100}, .node_id = 100};
    for (uint8_t i = 1; i <= PDCP_IDENTITIES_MAX; i++) {
        remember(i, i);
    }
    TEST_ASSERT_FALSE(pdcp_bind_remember_stored(&x.arb->bus.bind, &more));
    asks_for(0x63, PDCP_IDENTITIES_MAX); /* the last one that fitted */
    is_told(0x63, PDCP_IDENTITIES_MAX, PDCP_IDENTITIES_MAX);
}

/* D-BUS-6: the old id, while that id is free. It is not: another one, remembered from then on. */
static void test_an_identity_whose_id_is_in_use_gets_another(void)
{
    remember(5, 0x20);
    in_use(0x20, 0x20);
    asks_for(0x20, 5);
    is_told(0x20, 1, 5);
    exchange_silence(&x);
    asks_for(1, 5);
    is_told(1, 1, 5);
    TEST_ASSERT_EQUAL(0x20, x.arb->bus.bind.remembered[0].node_id); /* until it is set up (D-BUS-43) */
    set_up(1, 5, "o", 0xFE);
    TEST_ASSERT_EQUAL(1, x.arb->bus.bind.remembered_count);
    TEST_ASSERT_EQUAL(1, x.arb->bus.bind.remembered[0].node_id);
}

static void test_a_remembered_id_in_use_is_given_to_nobody(void)
{
    remember(5, 0x20);
    in_use(PDCP_NODE_MIN, PDCP_NODE_MAX);
    asks_for(0x30, 6);
    is_told(0x30, 0, 6);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_REFUSED));
}

/* D-BUS-6: more suggestions at a time than can be kept: the one that would end first makes room. */
static void test_the_suggestion_that_ends_first_makes_room(void)
{
    for (unsigned i = 1; i <= PDCP_RESERVED_MAX; i++) {
        asks_for(0, i);
        is_told(0, i, i);
        exchange_wait(&x, 1);
    }
    asks_for(0, 1); /* again: its suggestion holds for another second */
    is_told(0, 1, 1);
    exchange_wait(&x, 1);
    asks_for(0, 0x40);
    is_told(0, PDCP_RESERVED_MAX + 1, 0x40);
    asks_for(2, 0x41); /* free again */
    is_told(2, 2, 0x41);
    asks_for(1, 0x42); /* still kept */
    is_told(1, PDCP_RESERVED_MAX + 2, 0x42);
}

/* D-BUS-24: outputs count downwards from 254; D-BUS-6: which is kept here for a device that was told it. */
static void test_an_output_does_not_get_a_reserved_id(void)
{
    bind(0x11, 4);
    to(0x11, "03 01 00");
    in_use(PDCP_NODE_MIN, 0xFD);
    asks_for(0x20, 5);
    is_told(0x20, 0xFE, 5);
    x.arb->bus.tables.owner[0xFD] = 0;
    exchange_pass(&x, 100); /* the setup's question once more */
    set_up(0x11, 4, "o", 0xFD);
    asks_for(0xFE, 5);
    is_told(0xFE, 0xFE, 5);
}

/* D-BUS-6: the id of an absent identity, when no other one is left. */
static void test_an_output_gets_a_remembered_id_last(void)
{
    remember(5, 0x20);
    in_use(0x12, 0x1F);
    in_use(0x21, PDCP_NODE_MAX);
    in_use(PDCP_NODE_MIN, 0x10);
    add(0x11, 4, "o", 0x20);
    TEST_ASSERT_EQUAL(PDCP_PLACE_READY, x.arb->bus.tables.devices[0].state);
}

static void test_without_a_node_id_for_its_output_a_setup_fails(void)
{
    bind(0x11, 4);
    in_use(PDCP_NODE_MIN, PDCP_NODE_MAX);
    set_up_device(0x11, 4, 1);
    set_up_directions(0x11, "o");
    read(0x11, 1, 1, "0050 2021");
    read(0x11, 9, 1, NULL);
    read(0x11, 10, 1, NULL);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_PLACE_FAILED, x.arb->bus.tables.devices[0].state);
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_NO_ROOM]);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_SETUP_FAILED));
}

/* --- setup --- */

/* 40 inputs: two strings of 5 bytes for each of 40 channels are more than is kept (D-BUS-17). */
static void test_more_required_channels_than_there_is_room_for(void)
{
    char channels[41];
    memset(channels, 'i', 40);
    channels[40] = '\0';
    TEST_ASSERT_LESS_THAN(400, PDCP_NEEDS_BYTES);
    bind(0x11, 4);
    set_up_device(0x11, 4, 40);
    set_up_directions(0x11, channels);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_PLACE_FAILED, x.arb->bus.tables.devices[0].state);
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_NO_ROOM]);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_SETUP_FAILED));
    add(0x12, 6, "o", 0xFE); /* others are set up all the same */
}

static void refuses_five_times(void)
{
    for (int i = 0; i < 5; i++) {
        answered(0x11, "03 01 00", "83 00 01 00");
        exchange_silence(&x);
        TEST_ASSERT_EQUAL(i < 4 ? PDCP_PLACE_SETUP : PDCP_PLACE_FAILED, x.arb->bus.tables.devices[0].state);
        if (i < 4) {
            exchange_pass(&x, 250);
        }
    }
}

/* D-BUS-17: it fails again: not reported again, and tried again all the same. */
static void test_a_setup_that_keeps_failing_is_reported_once(void)
{
    bind(0x11, 4);
    for (int round = 0; round < 3; round++) {
        refuses_five_times();
        TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_SETUP_FAILED));
        TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_SETUP_FAILED]);
        for (int i = 0; i < 5; i++) {
            beacon(0x11);
            exchange_silence(&x);
            exchange_pass(&x, 1000);
        }
    }
    set_up(0x11, 4, "o", 0xFE);
    TEST_ASSERT_EQUAL(PDCP_PLACE_READY, x.arb->bus.tables.devices[0].state);
}

/* pdcp-bus.md 4: a value may be longer than its field; here type and profile in two packets. */
static void test_a_long_number_comes_by_bulk(void)
{
    bind(0x11, 4);
    read(0x11, 1, 0, "0200 0200");
    read(0x11, 2, 0, "0400");
    answered(0x11, "03 06 00", "83 02 06 00");
    answered(0x11, "0C 06 00", "8C 01 06 00 0800");
    from(0x11, "0E 00 3412 7856 AAAA");
    answered(0x11, "8E 01", "0E 01 BBBB");
    to(0x11, "8E 01");
    to(0x11, "03 0B 00");
    TEST_ASSERT_EQUAL_HEX16(0x1234, x.arb->bus.tables.devices[0].type);
    TEST_ASSERT_EQUAL_HEX16(0x5678, x.arb->bus.tables.devices[0].profile);
}

/* D-BUS-6, D-BUS-23: the identity asks again in the middle of a transfer; its end is the answer that shows
 * that the bound device is there. */
static void test_a_transfer_answers_for_its_device(void)
{
    bind(0x11, 4);
    set_up_device(0x11, 4, 1);
    set_up_directions(0x11, "o");
    read(0x11, 1, 1, "0050 2021");
    answered(0x11, "03 09 01", "83 02 09 01");
    answered(0x11, "0C 09 01", "8C 01 09 01 0800");
    asks_for(0x20, 4);
    exchange_silence(&x);
    from(0x11, "0E 00 000000000000");
    to(0x11, "8E 01");
    is_told(0x20, 0, 4);
    from(0x11, "0E 01 0000");
    to(0x11, "8E 01");
    to(0x11, "03 0A 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_BIND_DUPLICATE]);
    TEST_ASSERT_EQUAL(PDCP_PLACE_SETUP, x.arb->bus.tables.devices[0].state);
}

/* --- requests of the host --- */

/* pdcp-bus.md 5: one request at a time to one device; the host's comes before the setup's next. */
static void test_the_host_waits_for_the_request_under_way(void)
{
    bind(0x11, 4);
    to(0x11, "03 01 00");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 0, 0, 8, bytes, sizeof bytes));
    exchange_silence(&x);
    bind(0x12, 6); /* another device is none of its business */
    to(0x12, "03 01 00");
    from(0x11, "83 01 01 00 0200 0200");
    read(0x11, 8, 0, "11");
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL_HEX8(0x11, bytes[0]);
    to(0x11, "03 02 00");
    exchange_silence(&x);
}

/* D-API-10: a device that takes 500 ms for each of three tries does not keep the host waiting for longer than
 * 1000. */
static void test_the_host_does_not_wait_for_long(void)
{
    add_two();
    bytes[0] = 0xF4;
    bytes[1] = 0x01;
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_set(x.arb, 1, 0, 11, bytes, 2));
    wrote(0x12, 11, 0, "F401");
    exchange_clear(&x);
    from(0x12, "0F 01");
    to(0x12, "03 05 01");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 1, 0, 8, bytes, sizeof bytes));
    exchange_silence(&x);
    exchange_pass(&x, 500);
    to(0x12, "03 05 01");
    exchange_pass(&x, 499);
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_REQUEST));
    exchange_pass(&x, 1);
    TEST_ASSERT_EQUAL(PDCP_ERR_BUSY, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
    to(0x12, "03 05 01");
    from(0x12, "83 01 05 01 FFFF FFFF");
    read(0x12, 6, 1, "FFFF FF");
    to(0x12, "8F 00 01");
    exchange_silence(&x); /* and is not asked after all */
}

/* D-BUS-6: the identity asks again before the host's request has left: who it is comes first. */
static void test_the_host_waits_for_a_check_of_identity(void)
{
    add_two();
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 0, 0, 8, bytes, sizeof bytes));
    asks_for(0x20, 4);
    to(0x11, "03 01 00");
    exchange_silence(&x);
    from(0x11, "83 01 01 00 0200 0200");
    to(0x11, "03 08 00");
    is_told(0x20, 0, 4);
    exchange_silence(&x);
}

static void test_the_host_asks_one_thing_at_a_time(void)
{
    add_two();
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 0, 0, 8, bytes, sizeof bytes));
    TEST_ASSERT_EQUAL(PDCP_ERR_BUSY, pdcp_arb_get(x.arb, 1, 0, 8, bytes, sizeof bytes));
    to(0x11, "03 08 00");
    exchange_silence(&x);
    lose(1, 0x12); /* of somebody else: the host goes on waiting */
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_REQUEST));
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_get(x.arb, 1, 0, 8, bytes, sizeof bytes));
    from(0x11, "83 01 08 00 11");
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_REQUEST));
}

/* pdcp-bus.md 4: a value may be longer than its field, here than the room for it. */
static void test_a_value_stays_within_its_room(void)
{
    add_two();
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 0, 0, 8, bytes, 1));
    read(0x11, 8, 0, "11223344");
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_REQUEST));
    TEST_ASSERT_LESS_OR_EQUAL(1, exchange_last(&x, PDCP_EVENT_REQUEST)->len);
    TEST_ASSERT_EACH_EQUAL_HEX8(0, &bytes[1], sizeof bytes - 1);
}

/* D-BUS-25: what the device refuses does not count, nor what is a channel's parameter 10. */
static void test_only_an_accepted_interval_of_the_device_counts(void)
{
    add_two();
    bytes[0] = 0x64;
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_set(x.arb, 0, 0, 10, bytes, 2));
    refused(0x11, 10, 0, "6400");
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL(500, x.arb->bus.tables.devices[0].beacon_ms);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_set(x.arb, 0, 1, 10, bytes, 2));
    wrote(0x11, 10, 1, "6400");
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL(500, x.arb->bus.tables.devices[0].beacon_ms);
}

/* pdcp-bus.md 2: response code 2 to 04 as well: use bulk transfer, however short the value. */
static void test_a_short_value_is_set_by_bulk_if_the_device_wants_so(void)
{
    add_two();
    bytes[0] = 0xE8;
    bytes[1] = 0x03;
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_set(x.arb, 0, 0, 12, bytes, 2));
    answered(0x11, "04 0C 00 E803", "84 02 0C 00");
    answered(0x11, "0D 0C 00 0200", "8D 01 0C 00 0200");
    answered(0x11, "0E 00 E803", "8E 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_REQUEST)->status);
}

static void get_by_bulk(const char *size)
{
    char answer[32];
    (void)snprintf(answer, sizeof answer, "8C 01 07 00 %s", size);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(x.arb, 0, 0, 7, bytes, sizeof bytes));
    answered(0x11, "03 07 00", "83 02 07 00");
    answered(0x11, "0C 07 00", answer);
}

/* D-BUS-9: a repeated packet is acknowledged again, the last one as well. */
static void test_the_last_packet_is_acknowledged_again(void)
{
    add_two();
    from(0x11, "0E 00 41"); /* nobody has asked for anything */
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_DROP_LATE]);
    get_by_bulk("0800");
    from(0x11, "0E 00 414243444546");
    answered(0x11, "8E 01", "0E 01 4748");
    answered(0x11, "8E 01", "0E 01 4748");
    to(0x11, "8E 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_REQUEST));
    TEST_ASSERT_EQUAL(8, exchange_last(&x, PDCP_EVENT_REQUEST)->len);
    TEST_ASSERT_EQUAL_MEMORY("ABCDEFGH", bytes, 8);
    from(0x11, "0E 02 49"); /* behind the end */
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(2, x.arb->bus.stats[PDCP_STAT_DROP_LATE]);
}

/* D-BUS-9: a wrong packet is answered with failure and the transfer starts again from its configure frame.
 * FFh is no repetition before the first packet; and no packet is longer than what is left. */
static void test_wrong_packets_restart_the_transfer(void)
{
    add_two();
    get_by_bulk("0200");
    from(0x11, "0E FF 4142");
    to(0x11, "8E 00");
    answered(0x11, "0C 07 00", "8C 01 07 00 0200");
    from(0x11, "0E 00 414243");
    to(0x11, "8E 00");
    answered(0x11, "0C 07 00", "8C 01 07 00 0200");
    from(0x11, "0E 00 4142");
    to(0x11, "8E 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(2, exchange_last(&x, PDCP_EVENT_REQUEST)->len);
    TEST_ASSERT_EQUAL_MEMORY("AB", bytes, 3);
}

/* --- a full queue, and standby --- */

/* With what is more urgent than anything that the arbitrator says to a device. */
static void fill_queue(void)
{
    const can_frame_t filler = exchange_frame("1FF#00");
    while (pdcp_txq_put(&x.arb->bus.txq, &filler) == PDCP_TXQ_TAKEN) {
    }
}

static void test_a_reset_that_finds_no_room_is_not_counted_as_sent(void)
{
    exchange_pass(&x, 1200);
    fill_queue();
    beacon(0x42);
    TEST_ASSERT_EQUAL(0, x.arb->bus.stats[PDCP_STAT_UNKNOWN_RESET]);
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_TX_FULL]);
    (void)exchange_drain(&x);
    exchange_pass(&x, 1000);
    beacon(0x42);
    to(0x42, "0B");
    TEST_ASSERT_EQUAL(1, x.arb->bus.stats[PDCP_STAT_UNKNOWN_RESET]);
}

static void test_what_is_for_all_needs_room_and_an_arbitrator_that_speaks(void)
{
    fill_queue();
    TEST_ASSERT_FALSE(pdcp_arb_broadcast(x.arb, PDCP_SUSPEND, 0));
    (void)exchange_drain(&x);
    exchange_meet_server(&x);
    TEST_ASSERT_FALSE(pdcp_arb_broadcast(x.arb, PDCP_SUSPEND, 0));
    exchange_silence(&x);
}

/* D-BUS-42: a link that a device has asked for is nothing that the host waits for. */
static void test_going_silent_ends_a_devices_link_without_a_word(void)
{
    add_two();
    exchange_meet_rival(&x);
    from(0x12, "0F 01");
    to(0x12, "03 05 01");
    exchange_rx(&x, "100#0A");
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_SILENT));
    TEST_ASSERT_EQUAL(0, exchange_count(&x, PDCP_EVENT_LINK_REQUEST));
    exchange_silence(&x);
}

static void test_going_silent_ends_a_request_that_has_not_begun(void)
{
    add_two();
    exchange_meet_rival(&x);
    from(0x12, "0F 01");
    to(0x12, "03 05 01");
    ask_link(0, 1);
    exchange_rx(&x, "100#0A");
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
    exchange_silence(&x);
}

/* --- links that the host asks for --- */

static void test_what_else_cannot_be_a_link(void)
{
    add_two();
    add(0x13, 9, "oi", 0xFD);
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(x.arb, number(0, 1), PDCP_NONE));
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(x.arb, number(0, 1), 100)); /* a free entry */
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(x.arb, number(0, 1), number(2, 1)));
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_connect(x.arb, 100, number(1, 1)));
    TEST_ASSERT_EQUAL(PDCP_ERR_OWN, pdcp_arb_connect(x.arb, number(2, 1), number(2, 2))); /* D-API-6 */
    exchange_silence(&x);
}

static void remove_link(uint8_t place, unsigned id)
{
    pdcp_link_remove(&x.arb->bus, number(place, 1));
    wrote(id, 4, 1, "00");
    wrote(id, 7, 1, "00 00");
    wrote(id, 8, 1, "0000 0000");
    wrote(id, 6, 1, "FFFF FF");
    wrote(id, 5, 1, "FFFF FFFF");
}

/* pdcp-bus.md 8: the output's transfer enabled 1 with its first link, 0 when its last link goes. */
static void test_an_output_goes_on_while_somebody_listens(void)
{
    add_two_linked();
    add(0x13, 9, "i", 0);
    ask_link(0, 2);
    link_input(0x13, 4, 0x11, 0xFE);
    exchange_silence(&x); /* enabled already */
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(2, 1)->link);
    remove_link(1, 0x12);
    exchange_silence(&x);
    TEST_ASSERT_TRUE(channel(0, 1)->enabled);
    remove_link(2, 0x13);
    wrote(0x11, 4, 1, "00");
    exchange_silence(&x);
    TEST_ASSERT_FALSE(channel(0, 1)->enabled);
}

/* pdcp-bus.md 8: undone in reverse; a device that refuses that too does not stop the rest. */
static void test_an_undo_that_is_refused_goes_on(void)
{
    add_two();
    ask_link(0, 1);
    wrote(0x12, 5, 1, "0200 0200");
    refused(0x12, 6, 1, "0400 01");
    refused(0x12, 6, 1, "FFFF FF");
    wrote(0x12, 5, 1, "FFFF FFFF");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
}

/* A second listener that refuses is none of the first one's business. */
static void test_a_refused_second_listener_leaves_the_first(void)
{
    add_two_linked();
    add(0x13, 9, "i", 0);
    ask_link(0, 2);
    refused(0x13, 5, 1, "0200 0200");
    wrote(0x13, 5, 1, "FFFF FFFF");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(1, 1)->link);
    TEST_ASSERT_TRUE(channel(0, 1)->enabled);
}

/* Its channels are known from before, but it was reset and is being set up again. */
static void test_no_link_with_a_device_in_its_setup(void)
{
    add_two();
    add(0x13, 9, "i", 0);
    asks_for(0x12, 6);
    exchange_check_fails(&x, "12");
    is_told(0x12, 0x12, 6);
    to(0x12, "03 01 00");
    ask_link(0, 1);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
    asks_for(0x11, 4);
    to(0x11, "03 01 00");
    exchange_pass(&x, 99);
    from(0x12, "83 01 01 00 0200 0200");
    to(0x12, "03 02 00");
    exchange_pass(&x, 1);
    to(0x11, "03 01 00");
    exchange_pass(&x, 98);
    from(0x12, "83 01 02 00 0600");
    to(0x12, "03 06 00");
    exchange_pass(&x, 2);
    is_told(0x11, 0x11, 4);
    to(0x11, "03 01 00");
    ask_link(0, 2);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
    TEST_ASSERT_EQUAL(2, exchange_count(&x, PDCP_EVENT_LINK_REQUEST));
    TEST_ASSERT_EQUAL(0, x.arb->bus.stats[PDCP_STAT_LINK_FAILED]); /* not even begun */
}

/* Every write is answered with success until no more come; what devices 11h and 12h were told last about
 * input and output 1 of theirs. */
static void agree(uint8_t *output_enabled, uint8_t *input_enabled)
{
    const can_frame_t *frame;
    exchange_step(&x);
    while ((frame = pdcp_arb_tx_peek(x.arb)) != NULL) {
        char answer[16];
        const unsigned id = frame->id & 0xFFu;
        TEST_ASSERT_EQUAL_HEX8(0x04, frame->data[0]);
        if (frame->data[1] == 4) {
            *(id == 0x11 ? output_enabled : input_enabled) = frame->data[3];
        }
        (void)snprintf(answer, sizeof answer, "84 01 %02X %02X", frame->data[1], frame->data[2]);
        pdcp_arb_tx_pop(x.arb);
        from(id, answer);
    }
}

/* The link request has failed: device 12h is to hear 11h again, in the end. */
static void old_link_comes_back(void)
{
    uint8_t output_enabled = 1;
    uint8_t input_enabled = 0;
    agree(&output_enabled, &input_enabled);
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LINK_REQUEST));
    TEST_ASSERT_EQUAL(1, output_enabled);
    TEST_ASSERT_EQUAL(1, input_enabled);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(1, 1)->link);
    TEST_ASSERT_EQUAL(4, channel(1, 1)->source.identity.sn);
    TEST_ASSERT_FALSE(channel(2, 1)->enabled);
}

/* A new source is refused: the old one is named again, and the link made anew. */
static void test_a_source_that_could_not_be_replaced_comes_back(void)
{
    add_two_linked();
    add(0x13, 9, "o", 0xFD);
    ask_link(2, 1);
    wrote(0x12, 4, 1, "00");
    wrote(0x12, 5, 1, "0200 0200");
    refused(0x12, 6, 1, "0900 01");
    wrote(0x12, 6, 1, "0400 01");
    wrote(0x12, 5, 1, "0200 0200");
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, channel(1, 1)->link);
    old_link_comes_back();
}

/* The same when the input does not let itself be disabled: nothing is to be undone. */
static void test_an_input_that_stays_enabled_keeps_its_source(void)
{
    add_two_linked();
    add(0x13, 9, "o", 0xFD);
    ask_link(2, 1);
    refused(0x12, 4, 1, "00");
    old_link_comes_back();
}

static void test_an_output_lost_before_its_turn_ends_the_request(void)
{
    add_two();
    add(0x13, 9, "o", 0xFD);
    from(0x12, "0F 01");
    to(0x12, "03 05 01");
    ask_link(2, 1);
    lose(2, 0x13);
    from(0x12, "83 01 05 01 FFFF FFFF");
    read(0x12, 6, 1, "FFFF FF");
    to(0x12, "8F 00 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
}

static void test_an_input_lost_before_its_turn_ends_the_request(void)
{
    add_two();
    add(0x13, 9, "i", 0);
    from(0x12, "0F 01");
    to(0x12, "03 05 01");
    ask_link(0, 2);
    lose(2, 0x13);
    TEST_ASSERT_EQUAL(PDCP_ERR_NO_ANSWER, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
    from(0x12, "83 01 05 01 FFFF FFFF");
    read(0x12, 6, 1, "FFFF FF");
    to(0x12, "8F 00 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(1, exchange_count(&x, PDCP_EVENT_LINK_REQUEST));
}

/* D-BUS-14: at once; what the host asks for comes behind it. */
static void test_silencing_comes_before_a_request(void)
{
    add_two_linked();
    add(0x13, 9, "i", 0);
    add(0x14, 10, "o", 0xFD);
    from(0x13, "0F 01");
    to(0x13, "03 05 01");
    ask_link(3, 2);
    lose(0, 0x11);
    from(0x13, "83 01 05 01 FFFF FFFF");
    answered(0x13, "03 06 01", "83 01 06 01 FFFF FF");
    to(0x12, "04 04 01 00");
    to(0x13, "8F 00 01");
    from(0x12, "84 01 04 01");
    wrote(0x12, 7, 1, "00 00");
    link_input(0x13, 10, 0x14, 0xFD);
    wrote(0x14, 4, 1, "01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(2, 1)->link);
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status);
}

/* The same before what a device has asked for. */
static void test_silencing_comes_before_an_update(void)
{
    add_two();
    add(0x13, 9, "i", 0);
    ask_link(0, 2);
    link_input(0x13, 4, 0x11, 0xFE);
    wrote(0x11, 4, 1, "01");
    add(0x14, 10, "i", 0);
    from(0x14, "0F 01");
    to(0x14, "03 05 01");
    from(0x12, "0F 01");
    lose(0, 0x11);
    from(0x14, "83 01 05 01 FFFF FFFF");
    answered(0x14, "03 06 01", "83 01 06 01 FFFF FF");
    to(0x13, "04 04 01 00");
    to(0x14, "8F 00 01");
    exchange_silence(&x);
    from(0x13, "84 01 04 01");
    wrote(0x13, 7, 1, "00 00");
    read(0x12, 5, 1, "FFFF FFFF");
    read(0x12, 6, 1, "FFFF FF");
    to(0x12, "8F 00 01");
    exchange_silence(&x);
}

/* --- links that devices ask for (pdcp-bus.md 7) --- */

static void test_a_source_in_its_setup_is_not_there_yet(void)
{
    add(0x12, 6, "i", 0);
    bind(0x11, 4);
    to(0x11, "03 01 00");
    update(0x12, "0200 0200", "0400 01");
    to(0x12, "8F 00 01");
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, channel(0, 1)->link);
    exchange_silence(&x);
    exchange_pass(&x, 100); /* the setup's question once more */
    set_up(0x11, 4, "o", 0xFE);
    link_input(0x12, 4, 0x11, 0xFE);
    wrote(0x11, 4, 1, "01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(0, 1)->link);
}

/* Its own output (D-API-6), an output and an input that are none, and channel index 0, which is the
 * device. */
static void test_sources_that_cannot_be(void)
{
    add_two();
    add(0x13, 9, "io", 0xFD);
    update(0x13, "0200 0200", "0900 02");
    to(0x13, "8F 00 01");
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, channel(2, 1)->link);
    update(0x13, "0200 0200", "0400 02");
    to(0x13, "8F 00 01");
    update(0x13, "0200 0200", "0600 01");
    to(0x13, "8F 00 01");
    update(0x13, "0200 0200", "0400 00");
    to(0x13, "8F 00 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_NONE, channel(2, 1)->link);
}

/* The device of a remembered link is back and asks while it is being set up: it is linked once, when it is
 * ready, and answered. */
static void test_an_update_during_the_setup_waits_for_its_end(void)
{
    add_two_linked();
    lose(1, 0x12);
    wrote(0x11, 4, 1, "00");
    bind(0x12, 6);
    set_up_device(0x12, 6, 1);
    set_up_directions(0x12, "i");
    to(0x12, "03 01 01");
    from(0x12, "0F 01");
    exchange_silence(&x);
    from(0x12, "83 01 01 01 0053 1011");
    for (unsigned param = 5; param <= 11; param++) {
        if (param != 7) {
            read(0x12, param, 1, NULL);
        }
    }
    read(0x12, 5, 1, "0200 0200");
    read(0x12, 6, 1, "0400 01");
    link_input(0x12, 4, 0x11, 0xFE);
    wrote(0x11, 4, 1, "01");
    to(0x12, "8F 01 01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(1, 1)->link);
}

/* It was reset in the middle of what it had asked for: it is bound again and gets no answer. */
static void test_a_device_reset_during_its_update_is_not_answered(void)
{
    add_two();
    from(0x12, "0F 01");
    to(0x12, "03 05 01");
    asks_for(0x12, 6);
    for (int i = 0; i < 2; i++) {
        exchange_pass(&x, 100);
        to(0x12, "03 05 01");
    }
    exchange_pass(&x, 100);
    is_told(0x12, 0x12, 6);
    to(0x12, "03 01 00");
    exchange_silence(&x);
}

/* D-BUS-19: a device may have changed its mind: it names a source that is not there. D-BUS-22: what it heard
 * so far it must not go on hearing. */
static void test_an_update_that_names_another_source_ends_the_link(void)
{
    add_two_linked();
    update(0x12, "0200 0200", "0900 01");
    wrote(0x11, 4, 1, "00"); /* nobody listens any more */
    to(0x12, "8F 00 01");
    wrote(0x12, 4, 1, "00");
    wrote(0x12, 7, 1, "00 00");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, channel(1, 1)->link);
    TEST_ASSERT_FALSE(channel(0, 1)->enabled);
}

/* D-BUS-26: a link that was refused waits for the next change, which is none of others'. */
static void test_a_refused_link_waits(void)
{
    add_two();
    update(0x12, "0200 0200", "0400 01");
    refused(0x12, 5, 1, "0200 0200");
    wrote(0x12, 5, 1, "0200 0200");
    to(0x12, "8F 00 01");
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, channel(1, 1)->link);
    add(0x13, 9, "o", 0xFD);
    exchange_silence(&x);
    ask_link(2, 1); /* the host wants another source; the first one's output was never enabled */
    link_input(0x12, 9, 0x13, 0xFD);
    wrote(0x13, 4, 1, "01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(1, 1)->link);
    TEST_ASSERT_EQUAL(9, channel(1, 1)->source.identity.sn);
}

/* Both ends are gone; the input is back first. */
static void test_an_input_waits_for_its_source(void)
{
    add_two_linked();
    lose(0, 0x11);
    wrote(0x12, 4, 1, "00");
    wrote(0x12, 7, 1, "00 00");
    lose(1, 0x12);
    add(0x12, 6, "i", 0);
    add(0x13, 9, "o", 0xFD); /* an unknown device to it */
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, channel(1, 1)->link);
    add(0x11, 4, "o", 0xFE);
    link_input(0x12, 4, 0x11, 0xFE);
    wrote(0x11, 4, 1, "01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(1, 1)->link);
}

/* What was the source is an input when its device comes back: not linked, and the output's node id is
 * free. */
static void test_a_source_that_comes_back_as_an_input(void)
{
    add_two_linked();
    lose(0, 0x11);
    wrote(0x12, 4, 1, "00");
    wrote(0x12, 7, 1, "00 00");
    bind(0x11, 4);
    set_up(0x11, 4, "i", 0);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, channel(1, 1)->link);
    TEST_ASSERT_EQUAL(PDCP_INPUT, channel(0, 1)->transfer);
    add(0x13, 9, "o", 0xFD); /* a freed id is given out last (D-BUS-36) */
    exchange_silence(&x);
}

/* A source with two listeners comes back and goes again while they are linked: the one under way is undone,
 * the other is left alone, and both are linked in the end. */
static void test_a_source_that_comes_and_goes(void)
{
    add_two_linked();
    add(0x13, 9, "i", 0);
    ask_link(0, 2);
    link_input(0x13, 4, 0x11, 0xFE);
    lose(0, 0x11);
    for (unsigned id = 0x12; id <= 0x13; id++) {
        wrote(id, 4, 1, "00");
        wrote(id, 7, 1, "00 00");
    }
    add(0x11, 4, "o", 0xFE);
    wrote(0x12, 5, 1, "0200 0200");
    to(0x12, "04 06 01 0400 01");
    lose(0, 0x11);
    from(0x12, "84 01 06 01");
    wrote(0x12, 8, 1, "0050 2021");
    wrote(0x12, 7, 1, "00 00");
    wrote(0x12, 8, 1, "0050 2021");
    wrote(0x12, 6, 1, "0400 01");
    wrote(0x12, 5, 1, "0200 0200");
    exchange_silence(&x);
    add(0x11, 4, "o", 0xFE);
    link_input(0x12, 4, 0x11, 0xFE);
    wrote(0x11, 4, 1, "01");
    link_input(0x13, 4, 0x11, 0xFE);
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(1, 1)->link);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(2, 1)->link);
}

/* A link waits for its input's device, whose setup then fails: it is made when that device binds again
 * (D-BUS-17). */
static void test_a_link_outlives_a_failed_setup(void)
{
    add_two_linked();
    lose(1, 0x12);
    wrote(0x11, 4, 1, "00");
    bind(0x12, 6);
    to(0x12, "03 01 00");
    lose(0, 0x11);
    add(0x11, 4, "o", 0xFE);
    exchange_silence(&x);
    for (int i = 0; i < 4; i++) {
        from(0x12, "83 00 01 00");
        exchange_silence(&x);
        exchange_pass(&x, 250);
        to(0x12, "03 01 00");
    }
    from(0x12, "83 00 01 00");
    TEST_ASSERT_EQUAL(PDCP_PLACE_FAILED, x.arb->bus.tables.devices[1].state);
    add(0x13, 9, "o", 0xFD);
    exchange_silence(&x);
    beacon(0x11);
    asks_for(0x12, 6);
    exchange_check_fails(&x, "12");
    is_told(0x12, 0x12, 6);
    set_up(0x12, 6, "i", 0);
    link_input(0x12, 4, 0x11, 0xFE);
    wrote(0x11, 4, 1, "01");
    exchange_silence(&x);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, channel(1, 1)->link);
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
    RUN_TEST(test_the_host_waits_for_the_request_under_way);
    RUN_TEST(test_the_host_does_not_wait_for_long);
    RUN_TEST(test_the_host_waits_for_a_check_of_identity);
    RUN_TEST(test_the_host_asks_one_thing_at_a_time);
    RUN_TEST(test_a_value_stays_within_its_room);
    RUN_TEST(test_only_an_accepted_interval_of_the_device_counts);
    RUN_TEST(test_a_short_value_is_set_by_bulk_if_the_device_wants_so);
    RUN_TEST(test_the_last_packet_is_acknowledged_again);
    RUN_TEST(test_wrong_packets_restart_the_transfer);
    RUN_TEST(test_a_reset_that_finds_no_room_is_not_counted_as_sent);
    RUN_TEST(test_what_is_for_all_needs_room_and_an_arbitrator_that_speaks);
    RUN_TEST(test_going_silent_ends_a_devices_link_without_a_word);
    RUN_TEST(test_going_silent_ends_a_request_that_has_not_begun);
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
