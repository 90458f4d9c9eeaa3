/* The host's requests to devices: whose turn it is, what fits, bulk transfers (pdcp-bus.md 5, D-API-10); with
 * hand-written frames. */
#include <stdio.h>

#include "talk.h"
#include "unity.h"

void setUp(void)
{
    talk_reset();
}

void tearDown(void) {}

/* pdcp-bus.md 5: one request at a time to one device; the host's comes before the setup's next. */
static void test_the_host_waits_for_the_request_under_way(void)
{
    talk_bind(0x11, 4);
    talk_to(0x11, "03 01 00");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(talk.arb, 0, 0, 8, talk_bytes, sizeof talk_bytes));
    exchange_silence(&talk);
    talk_bind(0x12, 6); /* another device is none of its business */
    talk_to(0x12, "03 01 00");
    talk_from(0x11, "83 01 01 00 0200 0200");
    talk_read(0x11, 8, 0, "11");
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&talk, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL_HEX8(0x11, talk_bytes[0]);
    talk_to(0x11, "03 02 00");
    exchange_silence(&talk);
}

/* D-API-10: a device that takes 500 ms for each of three tries does not keep the host waiting for longer than
 * 1000. */
static void test_the_host_does_not_wait_for_long(void)
{
    talk_add_two();
    talk_bytes[0] = 0xF4;
    talk_bytes[1] = 0x01;
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_set(talk.arb, 1, 0, 11, talk_bytes, 2));
    talk_wrote(0x12, 11, 0, "F401");
    exchange_clear(&talk);
    talk_from(0x12, "0F 01");
    talk_to(0x12, "03 05 01");
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(talk.arb, 1, 0, 8, talk_bytes, sizeof talk_bytes));
    exchange_silence(&talk);
    exchange_pass(&talk, 500);
    talk_to(0x12, "03 05 01");
    exchange_pass(&talk, 499);
    TEST_ASSERT_EQUAL(0, exchange_count(&talk, PDCP_EVENT_REQUEST));
    exchange_pass(&talk, 1);
    TEST_ASSERT_EQUAL(PDCP_ERR_BUSY, exchange_last(&talk, PDCP_EVENT_REQUEST)->status);
    talk_to(0x12, "03 05 01");
    talk_from(0x12, "83 01 05 01 FFFF FFFF");
    talk_read(0x12, 6, 1, "FFFF FF");
    talk_to(0x12, "8F 00 01");
    exchange_silence(&talk); /* and is not asked after all */
}

/* D-BUS-6: the identity asks again before the host's request has left: who it is comes first. */
static void test_the_host_waits_for_a_check_of_identity(void)
{
    talk_add_two();
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(talk.arb, 0, 0, 8, talk_bytes, sizeof talk_bytes));
    talk_asks_for(0x20, 4);
    talk_to(0x11, "03 01 00");
    exchange_silence(&talk);
    talk_from(0x11, "83 01 01 00 0200 0200");
    talk_to(0x11, "03 08 00");
    talk_is_told(0x20, 0, 4);
    exchange_silence(&talk);
}

static void test_the_host_asks_one_thing_at_a_time(void)
{
    talk_add_two();
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(talk.arb, 0, 0, 8, talk_bytes, sizeof talk_bytes));
    TEST_ASSERT_EQUAL(PDCP_ERR_BUSY, pdcp_arb_get(talk.arb, 1, 0, 8, talk_bytes, sizeof talk_bytes));
    talk_to(0x11, "03 08 00");
    exchange_silence(&talk);
    talk_lose(1, 0x12); /* of somebody else: the host goes on waiting */
    TEST_ASSERT_EQUAL(0, exchange_count(&talk, PDCP_EVENT_REQUEST));
    TEST_ASSERT_EQUAL(PDCP_ERR_UNKNOWN, pdcp_arb_get(talk.arb, 1, 0, 8, talk_bytes, sizeof talk_bytes));
    talk_from(0x11, "83 01 08 00 11");
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&talk, PDCP_EVENT_REQUEST)->status);
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_REQUEST));
}

/* pdcp-bus.md 4: a value may be longer than its field, here than the room for it. */
static void test_a_value_stays_within_its_room(void)
{
    talk_add_two();
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(talk.arb, 0, 0, 8, talk_bytes, 1));
    talk_read(0x11, 8, 0, "11223344");
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_REQUEST));
    TEST_ASSERT_LESS_OR_EQUAL(1, exchange_last(&talk, PDCP_EVENT_REQUEST)->len);
    TEST_ASSERT_EACH_EQUAL_HEX8(0, &talk_bytes[1], sizeof talk_bytes - 1);
}

/* D-BUS-25: what the device refuses does not count, nor what is a channel's parameter 10. */
static void test_only_an_accepted_interval_of_the_device_counts(void)
{
    talk_add_two();
    talk_bytes[0] = 0x64;
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_set(talk.arb, 0, 0, 10, talk_bytes, 2));
    talk_refused(0x11, 10, 0, "6400");
    TEST_ASSERT_EQUAL(PDCP_ERR_REFUSED, exchange_last(&talk, PDCP_EVENT_REQUEST)->status);
    exchange_pass(&talk, 300); /* three intervals of 100 ms */
    TEST_ASSERT_EQUAL(0, exchange_count(&talk, PDCP_EVENT_LOST));
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_set(talk.arb, 0, 1, 10, talk_bytes, 2));
    talk_wrote(0x11, 10, 1, "6400");
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&talk, PDCP_EVENT_REQUEST)->status);
    exchange_pass(&talk, 300); /* three intervals of 100 ms */
    TEST_ASSERT_EQUAL(0, exchange_count(&talk, PDCP_EVENT_LOST));
}

/* pdcp-bus.md 2: response code 2 to 04 as well: use bulk transfer, however short the value. */
static void test_a_short_value_is_set_by_bulk_if_the_device_wants_so(void)
{
    talk_add_two();
    talk_bytes[0] = 0xE8;
    talk_bytes[1] = 0x03;
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_set(talk.arb, 0, 0, 12, talk_bytes, 2));
    talk_answered(0x11, "04 0C 00 E803", "84 02 0C 00");
    talk_answered(0x11, "0D 0C 00 0200", "8D 01 0C 00 0200");
    talk_answered(0x11, "0E 00 E803", "8E 01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_OK, exchange_last(&talk, PDCP_EVENT_REQUEST)->status);
}

static void get_by_bulk(const char *size)
{
    char answer[32];
    (void)snprintf(answer, sizeof answer, "8C 01 07 00 %s", size);
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_get(talk.arb, 0, 0, 7, talk_bytes, sizeof talk_bytes));
    talk_answered(0x11, "03 07 00", "83 02 07 00");
    talk_answered(0x11, "0C 07 00", answer);
}

/* D-BUS-9: a repeated packet is acknowledged again, the last one as well. */
static void test_the_last_packet_is_acknowledged_again(void)
{
    talk_add_two();
    talk_from(0x11, "0E 00 41"); /* nobody has asked for anything */
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(1, talk.arb->bus.stats[PDCP_STAT_DROP_LATE]);
    get_by_bulk("0800");
    talk_from(0x11, "0E 00 414243444546");
    talk_answered(0x11, "8E 01", "0E 01 4748");
    talk_answered(0x11, "8E 01", "0E 01 4748");
    talk_to(0x11, "8E 01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(1, exchange_count(&talk, PDCP_EVENT_REQUEST));
    TEST_ASSERT_EQUAL(8, exchange_last(&talk, PDCP_EVENT_REQUEST)->len);
    TEST_ASSERT_EQUAL_MEMORY("ABCDEFGH", talk_bytes, 8);
    talk_from(0x11, "0E 02 49"); /* behind the end */
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(2, talk.arb->bus.stats[PDCP_STAT_DROP_LATE]);
}

/* D-BUS-9: a wrong packet is answered with failure and the transfer starts again from its configure frame.
 * FFh is no repetition before the first packet; and no packet is longer than what is left. */
static void test_wrong_packets_restart_the_transfer(void)
{
    talk_add_two();
    get_by_bulk("0200");
    talk_from(0x11, "0E FF 4142");
    talk_to(0x11, "8E 00");
    talk_answered(0x11, "0C 07 00", "8C 01 07 00 0200");
    talk_from(0x11, "0E 00 414243");
    talk_to(0x11, "8E 00");
    talk_answered(0x11, "0C 07 00", "8C 01 07 00 0200");
    talk_from(0x11, "0E 00 4142");
    talk_to(0x11, "8E 01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(2, exchange_last(&talk, PDCP_EVENT_REQUEST)->len);
    TEST_ASSERT_EQUAL_MEMORY("AB", talk_bytes, 3);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_host_waits_for_the_request_under_way);
    RUN_TEST(test_the_host_does_not_wait_for_long);
    RUN_TEST(test_the_host_waits_for_a_check_of_identity);
    RUN_TEST(test_the_host_asks_one_thing_at_a_time);
    RUN_TEST(test_a_value_stays_within_its_room);
    RUN_TEST(test_only_an_accepted_interval_of_the_device_counts);
    RUN_TEST(test_a_short_value_is_set_by_bulk_if_the_device_wants_so);
    RUN_TEST(test_the_last_packet_is_acknowledged_again);
    RUN_TEST(test_wrong_packets_restart_the_transfer);
    return UNITY_END();
}
