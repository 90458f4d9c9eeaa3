/* An arbitrator on a bench: frames are handed in and expected as text in candump's form, ID#DATA in
 * hexadecimal, with spaces wherever they help. Time stands still unless a test moves it. */
#ifndef EXCHANGE_H
#define EXCHANGE_H

#include "arb_app.h"

enum {
    EXCHANGE_EVENTS = 48,
    EXCHANGE_SERIAL = 256, /* the arbitrator's: no spread but of the standby, which ends after 1856 ms */
    EXCHANGE_SEED = 253    /* the first output gets id FEh, the next ones count downwards (D-BUS-36) */
};

typedef struct {
    pdcp_arb_t *arb; /* the one that stands alone, of which a program has one, or the one of app */
    arb_app_t *app;  /* NULL: the arbitrator stands alone */
    uint32_t now_ms;
    pdcp_event_t events[EXCHANGE_EVENTS]; /* since they were cleared */
    int event_count;
} exchange_t;

/* An arbitrator that was started PDCP_CLOSED_MS before now_ms, so that outputs may be enabled (D-BUS-36). Its
 * beacons have left already. */
void exchange_start(exchange_t *x, uint32_t now_ms);

/* The same with a whole application, whose port's can_send must refuse: its frames are taken from its queue.
 * Neither asks by itself whether devices still have what they should (D-BUS-40): that would disturb tests of
 * other things; pdcp_arb_audit begins it. */
void exchange_start_app(exchange_t *x, arb_app_t *app, const arb_port_t *port, const arb_settings_t *settings,
                        uint32_t now_ms);

/* Does what is due. */
void exchange_step(exchange_t *x);

can_frame_t exchange_frame(const char *text);

/* A frame from the bus, then a step. While the arbitrator has no device of its own it holds bind requests
 * (D-BUS-42): then time moves on by PDCP_HOLD_MS. */
void exchange_rx(exchange_t *x, const char *text);

/* The next frame that leaves must be this one. */
void exchange_tx(exchange_t *x, const char *text);

/* No frame leaves. */
void exchange_silence(exchange_t *x);

/* Another arbitrator shows that it serves (D-BUS-42): an arbitrator without devices of its own goes on
 * standby. */
void exchange_meet_server(exchange_t *x);

/* Another arbitrator is heard for so long that this one, which has the devices below, goes on standby with
 * its next beacon (D-BUS-42). */
void exchange_meet_rival(exchange_t *x);

/* Takes and forgets whatever leaves; returns how many frames. */
int exchange_drain(exchange_t *x);

/* Moves the time on in one go and steps. */
void exchange_wait(exchange_t *x, uint32_t ms);

/* Moves the time on millisecond by millisecond; the arbitrator's beacons are taken out. */
void exchange_pass(exchange_t *x, uint32_t ms);

/* How often an event of this kind has come since exchange_clear. */
int exchange_count(const exchange_t *x, pdcp_event_kind_t kind);
const pdcp_event_t *exchange_last(const exchange_t *x, pdcp_event_kind_t kind);
void exchange_clear(exchange_t *x);

/* A table of text pairs, what leaves and what comes back, ended by NULL. An answer of NULL: none comes. */
typedef struct {
    const char *tx;
    const char *rx;
} exchange_pair_t;
void exchange_pairs(exchange_t *x, const exchange_pair_t *pairs);

/* The same, and nothing leaves behind them. */
void exchange_run(exchange_t *x, const exchange_pair_t *pairs);

/* The same with one device: what it is asked and what it answers, without the identifiers. "03 01 00" to "11"
 * is 311#03 01 00; the answer comes as 211#. */
void exchange_ask(exchange_t *x, const char *node_id, const char *tx, const char *rx);
void exchange_ask_all(exchange_t *x, const char *node_id, const exchange_pair_t *pairs);

/* Binds and sets up device 0002:0002:0004 as id 11h: one output, index 1, type 5000h, profile 2120h, gets
 * node id FEh if that is free (out_id). And device 0002:0002:0006 as id 12h: one input, index 1, type 5300h,
 * profile 1110h, unconnected. Both have beaconed. */
void exchange_add_output(exchange_t *x, const char *out_id);
void exchange_add_input(exchange_t *x);

/* Both, the output with node id FEh. */
void exchange_add_both(exchange_t *x);

/* Device 0002:0002:0007 as id 13h, with the same input. */
void exchange_add_second_input(exchange_t *x);

/* Binds and sets up the device of that input, which answers 5, 6 and 8 with these, "83 00 05 01"; no
 * beacon. */
void exchange_set_up_input(exchange_t *x, const char *vid_pid, const char *serial, const char *type);

/* Starts with both devices, the output with node id FEh, shortly before the time runs over. */
void exchange_start_limb(exchange_t *x);

/* The link of that output to that input being made (pdcp-bus.md 8): 5, 6, 8, 7 and enabled to the input, then
 * enabled to the output. */
extern const exchange_pair_t exchange_making[];

/* That input being told to be silent; and to forget its source as well. The output is not in it. */
extern const exchange_pair_t exchange_silencing[];
extern const exchange_pair_t exchange_removing[];

/* That input asks for the link to the source that it names: Update Data Channel, and what it answers when it
 * is asked for 5 and 6, "83 01 05 01 0200 0200". */
void exchange_update(exchange_t *x, const char *vid_pid, const char *serial);

/* The device of that output, or that input, is lost; the other one beacons. */
void exchange_lose_output(exchange_t *x);
void exchange_lose_input(exchange_t *x);

/* A device is bound. identity: its VID, PID and serial number, "0300 0300 0900". */
void exchange_bind(exchange_t *x, const char *node_id, const char *identity);

/* The setup of a device that answers only what it must (pdcp-bus.md 6): what it is asked itself, the last its
 * number of channels, and then what it is asked about one output or one input, index 1. */
void exchange_set_up_device(exchange_t *x, const char *node_id, const char *identity, const char *channels);
void exchange_set_up_channel(exchange_t *x, const char *node_id, const char *out_id); /* NULL: an input */

/* Binds and sets up such a device: 0003:0003:0009 as id 13h, with one output, which gets node id FDh, or with
 * one input. No beacon. */
void exchange_add_third_output(exchange_t *x);
void exchange_add_third_input(exchange_t *x);

/* Channel numbers of that output and that input, and the input's entry. */
uint8_t exchange_output(const exchange_t *x);
uint8_t exchange_input(const exchange_t *x);
const pdcp_channel_t *exchange_input_entry(const exchange_t *x);

/* Makes that link, without a host. */
void exchange_make_link(exchange_t *x);

/* The device with this node id (two hexadecimal digits) is asked who it is, in vain: the check of its
 * identity (D-BUS-41). */
void exchange_check_fails(exchange_t *x, const char *node_id);

/* The beacon of these devices, so that they stay alive. */
void exchange_beacons(exchange_t *x);

#endif
