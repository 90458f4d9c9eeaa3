/* Binding and setup of devices with one channel, index 1 (pdcp-bus.md 6). */
#include <stdio.h>

#include "exchange.h"

enum { SERIAL_AT = 10 }; /* of an identity as text */

void exchange_bind(exchange_t *x, const char *node_id, const char *identity)
{
    char text[40];
    (void)snprintf(text, sizeof text, "6%s#01 %s", node_id, identity);
    exchange_rx(x, text);
    (void)snprintf(text, sizeof text, "3%s#81 %s %s", node_id, node_id, identity);
    exchange_tx(x, text);
}

static void set_up_device(exchange_t *x, const char *node_id, const char *identity,
                          const exchange_pair_t *times, const char *channels)
{
    char text[40];
    (void)snprintf(text, sizeof text, "83 01 01 00 %.9s", identity); /* VID and PID */
    exchange_ask(x, node_id, "03 01 00", text);
    (void)snprintf(text, sizeof text, "83 01 02 00 %s", &identity[SERIAL_AT]);
    exchange_ask(x, node_id, "03 02 00", text);
    exchange_ask(x, node_id, "03 06 00", "83 00 06 00");
    exchange_ask_all(x, node_id, times);
    (void)snprintf(text, sizeof text, "83 01 09 00 %s", channels);
    exchange_ask(x, node_id, "03 09 00", text);
}

void exchange_set_up_device(exchange_t *x, const char *node_id, const char *identity, const char *channels)
{
    static const exchange_pair_t no_times[] = {
        {"03 0B 00", "83 00 0B 00"}, {"03 0A 00", "83 00 0A 00"}, {NULL, NULL}};
    set_up_device(x, node_id, identity, no_times, channels);
}

/* Disabled, which the arbitrator makes sure of, and its direction. */
static void set_up_direction(exchange_t *x, const char *node_id, bool output)
{
    exchange_ask(x, node_id, "04 04 01 00", "84 01 04 01 00");
    exchange_ask(x, node_id, "03 03 01", output ? "83 01 03 01 02" : "83 01 03 01 01");
}

static void set_up_output(exchange_t *x, const char *node_id, const char *out_id)
{
    static const exchange_pair_t pairs[] = {
        {"03 01 01", "83 01 01 01 0050 2021"},
        {"03 09 01", "83 00 09 01"},
        {"03 0A 01", "83 00 0A 01"},
        {NULL, NULL},
    };
    char set_id[40];
    char answer[40];
    set_up_direction(x, node_id, true);
    exchange_ask_all(x, node_id, pairs);
    (void)snprintf(set_id, sizeof set_id, "04 05 01 %s", out_id);
    (void)snprintf(answer, sizeof answer, "84 01 05 01 %s", out_id);
    exchange_ask(x, node_id, set_id, answer);
}

static void set_up_input(exchange_t *x, const char *node_id)
{
    static const exchange_pair_t pairs[] = {
        {"03 01 01", "83 01 01 01 0053 1011"}, {"03 05 01", "83 00 05 01"},
        {"03 06 01", "83 00 06 01"},           {"03 08 01", "83 00 08 01"},
        {"03 09 01", "83 00 09 01"},           {"03 0A 01", "83 00 0A 01"},
        {"03 0B 01", "83 00 0B 01"},           {NULL, NULL},
    };
    set_up_direction(x, node_id, false);
    exchange_ask_all(x, node_id, pairs);
}

void exchange_set_up_channel(exchange_t *x, const char *node_id, const char *out_id)
{
    if (out_id != NULL) {
        set_up_output(x, node_id, out_id);
    } else {
        set_up_input(x, node_id);
    }
}

void exchange_add_third_output(exchange_t *x)
{
    exchange_bind(x, "13", "0300 0300 0900");
    exchange_set_up_device(x, "13", "0300 0300 0900", "01");
    set_up_output(x, "13", "FD");
}

void exchange_add_third_input(exchange_t *x)
{
    exchange_bind(x, "13", "0300 0300 0900");
    exchange_set_up_device(x, "13", "0300 0300 0900", "01");
    set_up_input(x, "13");
}

/* With an acknowledge time of 100 ms and a beacon interval of 500 ms. */
static const exchange_pair_t times[] = {
    {"03 0B 00", "83 01 0B 00 6400"}, {"03 0A 00", "83 01 0A 00 F401"}, {NULL, NULL}};

void exchange_add_output(exchange_t *x, const char *out_id)
{
    exchange_bind(x, "11", "0200 0200 0400");
    set_up_device(x, "11", "0200 0200 0400", times, "01");
    set_up_output(x, "11", out_id);
    exchange_rx(x, "011#0A");
}

static void set_up_named_input(exchange_t *x, const char *node_id, const char *identity, const char *vid_pid,
                               const char *serial, const char *type)
{
    const exchange_pair_t pairs[] = {
        {"03 01 01", "83 01 01 01 0053 1011"},
        {"03 05 01", vid_pid},
        {"03 06 01", serial},
        {"03 08 01", type},
        {"03 09 01", "83 00 09 01"},
        {"03 0A 01", "83 00 0A 01"},
        {"03 0B 01", "83 01 0B 01 1011"},
        {NULL, NULL},
    };
    exchange_bind(x, node_id, identity);
    set_up_device(x, node_id, identity, times, "01");
    set_up_direction(x, node_id, false);
    exchange_ask_all(x, node_id, pairs);
}

void exchange_set_up_input(exchange_t *x, const char *vid_pid, const char *serial, const char *type)
{
    set_up_named_input(x, "12", "0200 0200 0600", vid_pid, serial, type);
}

void exchange_add_input(exchange_t *x)
{
    exchange_set_up_input(x, "83 01 05 01 FFFF FFFF", "83 01 06 01 FFFF FF", "83 01 08 01 0000 0000");
    exchange_rx(x, "012#0A");
}

void exchange_add_both(exchange_t *x)
{
    exchange_add_output(x, "FE");
    exchange_add_input(x);
}

void exchange_add_second_input(exchange_t *x)
{
    set_up_named_input(x, "13", "0200 0200 0700", "83 01 05 01 FFFF FFFF", "83 01 06 01 FFFF FF",
                       "83 01 08 01 0000 0000");
    exchange_rx(x, "013#0A");
}
