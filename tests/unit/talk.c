#include "talk.h"

#include <stdio.h>
#include <string.h>

#include "unity.h"

exchange_t talk;
uint8_t talk_bytes[16];

void talk_reset(void)
{
    exchange_start(&talk, 0xFFFFFF00u);
    memset(talk_bytes, 0, sizeof talk_bytes);
}

void talk_from(unsigned id, const char *data)
{
    char text[48];
    (void)snprintf(text, sizeof text, "2%02X#%s", id, data);
    exchange_rx(&talk, text);
}

void talk_to(unsigned id, const char *data)
{
    char text[48];
    (void)snprintf(text, sizeof text, "3%02X#%s", id, data);
    exchange_tx(&talk, text);
}

void talk_answered(unsigned id, const char *request, const char *answer)
{
    talk_to(id, request);
    talk_from(id, answer);
}

void talk_read(unsigned id, unsigned param, unsigned channel, const char *value)
{
    char request[16];
    char answer[40];
    (void)snprintf(request, sizeof request, "03 %02X %02X", param, channel);
    (void)snprintf(answer, sizeof answer, "83 %s %02X %02X %s", value != NULL ? "01" : "00", param, channel,
                   value != NULL ? value : "");
    talk_answered(id, request, answer);
}

void talk_written(unsigned id, unsigned param, unsigned channel, const char *value, const char *result)
{
    char request[40];
    char answer[16];
    (void)snprintf(request, sizeof request, "04 %02X %02X %s", param, channel, value);
    (void)snprintf(answer, sizeof answer, "84 %s %02X %02X", result, param, channel);
    talk_answered(id, request, answer);
}

void talk_wrote(unsigned id, unsigned param, unsigned channel, const char *value)
{
    talk_written(id, param, channel, value, "01");
}

void talk_refused(unsigned id, unsigned param, unsigned channel, const char *value)
{
    talk_written(id, param, channel, value, "00");
}

void talk_asks_for(unsigned id, unsigned serial)
{
    char text[40];
    (void)snprintf(text, sizeof text, "6%02X#01 0200 0200 %02X00", id, serial);
    exchange_rx(&talk, text);
}

void talk_is_told(unsigned asked, unsigned id, unsigned serial)
{
    char text[40];
    (void)snprintf(text, sizeof text, "81 %02X 0200 0200 %02X00", id, serial);
    talk_to(asked, text);
}

void talk_beacon(unsigned id)
{
    char text[16];
    (void)snprintf(text, sizeof text, "0%02X#0A", id);
    exchange_rx(&talk, text);
}

void talk_set_up_device(unsigned id, unsigned serial, unsigned channels)
{
    char value[8];
    talk_read(id, 1, 0, "0200 0200");
    (void)snprintf(value, sizeof value, "%02X00", serial);
    talk_read(id, 2, 0, value);
    talk_read(id, 6, 0, NULL);
    talk_read(id, 11, 0, NULL);
    talk_read(id, 10, 0, NULL);
    (void)snprintf(value, sizeof value, "%02X", channels);
    talk_read(id, 9, 0, value);
}

void talk_set_up_directions(unsigned id, const char *channels)
{
    for (unsigned i = 0; channels[i] != '\0'; i++) {
        talk_wrote(id, 4, i + 1, "00");
    }
    for (unsigned i = 0; channels[i] != '\0'; i++) {
        talk_read(id, 3, i + 1, channels[i] == 'i' ? "01" : "02");
    }
}

void talk_set_up_output(unsigned id, unsigned channel, unsigned out_id)
{
    char value[8];
    talk_read(id, 1, channel, "0050 2021");
    talk_read(id, 9, channel, NULL);
    talk_read(id, 10, channel, NULL);
    (void)snprintf(value, sizeof value, "%02X", out_id);
    talk_wrote(id, 5, channel, value);
}

void talk_set_up_input(unsigned id, unsigned channel)
{
    talk_read(id, 1, channel, "0053 1011");
    talk_read(id, 5, channel, NULL);
    talk_read(id, 6, channel, NULL);
    talk_read(id, 8, channel, NULL);
    talk_read(id, 9, channel, NULL);
    talk_read(id, 10, channel, NULL);
    talk_read(id, 11, channel, NULL);
}

void talk_set_up(unsigned id, unsigned serial, const char *channels, unsigned out_id)
{
    talk_set_up_device(id, serial, (unsigned)strlen(channels));
    talk_set_up_directions(id, channels);
    for (unsigned i = 0; channels[i] != '\0'; i++) {
        if (channels[i] == 'i') {
            talk_set_up_input(id, i + 1);
        } else {
            talk_set_up_output(id, i + 1, out_id--);
        }
    }
}

void talk_bind(unsigned id, unsigned serial)
{
    talk_asks_for(id, serial);
    talk_is_told(id, id, serial);
}

void talk_add(unsigned id, unsigned serial, const char *channels, unsigned out_id)
{
    talk_bind(id, serial);
    talk_set_up(id, serial, channels, out_id);
    talk_beacon(id);
}

void talk_lose(uint8_t place, unsigned id)
{
    TEST_ASSERT_TRUE(pdcp_arb_reset(talk.arb, talk.now_ms, place));
    talk_answered(id, "0B", "8B 01");
    TEST_ASSERT_EQUAL(PDCP_PLACE_LOST, talk.arb->bus.tables.devices[place].state);
}

uint8_t talk_number(uint8_t place, uint8_t index)
{
    return pdcp_tables_channel(&talk.arb->bus.tables, place, index);
}

const pdcp_channel_t *talk_channel(uint8_t place, uint8_t index)
{
    return &talk.arb->bus.tables.channels[talk_number(place, index)];
}

void talk_ask_link(uint8_t out_node, uint8_t in_node)
{
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(talk.arb, talk_number(out_node, 1), talk_number(in_node, 1)));
}

void talk_name_source(unsigned id, unsigned serial)
{
    char value[16];
    talk_wrote(id, 5, 1, "0200 0200");
    (void)snprintf(value, sizeof value, "%02X00 01", serial);
    talk_wrote(id, 6, 1, value);
    talk_wrote(id, 8, 1, "0050 2021");
}

void talk_link_input(unsigned id, unsigned serial, unsigned out_device, unsigned out_id)
{
    char value[16];
    talk_name_source(id, serial);
    (void)snprintf(value, sizeof value, "%02X %02X", out_device, out_id);
    talk_wrote(id, 7, 1, value);
    talk_wrote(id, 4, 1, "01");
}

void talk_add_two(void)
{
    talk_add(0x11, 4, "o", 0xFE);
    talk_add(0x12, 6, "i", 0);
    exchange_clear(&talk);
}

void talk_add_two_linked(void)
{
    talk_add_two();
    talk_ask_link(0, 1);
    talk_link_input(0x12, 4, 0x11, 0xFE);
    talk_wrote(0x11, 4, 1, "01");
    exchange_silence(&talk);
    TEST_ASSERT_EQUAL(PDCP_LINK_ACTIVE, talk_channel(1, 1)->link);
    exchange_clear(&talk);
}

void talk_update(unsigned id, const char *vid_pid, const char *sn_index)
{
    talk_from(id, "0F 01");
    talk_read(id, 5, 1, vid_pid);
    talk_read(id, 6, 1, sn_index);
}
