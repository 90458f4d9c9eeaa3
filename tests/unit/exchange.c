#include "exchange.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pdcp_time.h"
#include "unity.h"

static void on_event(void *ctx, uint32_t now_ms, const pdcp_event_t *event)
{
    exchange_t *x = ctx;
    (void)now_ms;
    TEST_ASSERT_LESS_THAN_MESSAGE(EXCHANGE_EVENTS, x->event_count, "too many events");
    x->events[x->event_count++] = *event;
}

can_frame_t exchange_frame(const char *text)
{
    can_frame_t frame;
    char *at;
    memset(&frame, 0, sizeof frame);
    frame.id = (uint16_t)strtoul(text, &at, 16);
    TEST_ASSERT_EQUAL_MESSAGE('#', *at, text);
    at++;
    while (*at != '\0') {
        if (*at == ' ') {
            at++;
            continue;
        }
        const char byte[3] = {at[0], at[1], '\0'};
        TEST_ASSERT_LESS_THAN_MESSAGE(8, frame.dlc, text);
        frame.data[frame.dlc++] = (uint8_t)strtoul(byte, NULL, 16);
        at += 2;
    }
    return frame;
}

static void to_text(const can_frame_t *frame, char *text, size_t size)
{
    int used = snprintf(text, size, "%03X#", frame->id);
    for (uint8_t i = 0; i < frame->dlc; i++) {
        used += snprintf(&text[used], size - (size_t)used, "%02X", frame->data[i]);
    }
}

static void pass_first_time(exchange_t *x)
{
    exchange_tx(x, "100#0A");
    exchange_wait(x, PDCP_CLOSED_MS);
    exchange_tx(x, "100#0A");
    exchange_silence(x);
}

void exchange_start(exchange_t *x, uint32_t now_ms)
{
    /* Not in exchange_t: the RAM of a small machine does not hold it beside an application. */
    static pdcp_arb_t alone;
    memset(x, 0, sizeof *x);
    x->now_ms = now_ms - PDCP_CLOSED_MS;
    x->arb = &alone;
    pdcp_arb_init(x->arb, x->now_ms, EXCHANGE_SERIAL, EXCHANGE_SEED, on_event, x);
    pass_first_time(x);
}

void exchange_start_app(exchange_t *x, arb_app_t *app, const arb_port_t *port, const arb_settings_t *settings,
                        uint32_t now_ms)
{
    memset(x, 0, sizeof *x);
    x->now_ms = now_ms - PDCP_CLOSED_MS;
    x->app = app;
    x->arb = &app->arb;
    arb_app_init(app, port, settings, x->now_ms);
    arb_app_observe(app, on_event, x);
    app->arb.bus.audit.on = false;
    pdcp_timers_cancel(&app->arb.bus.timers, PDCP_TIMER_AUDIT);
    pass_first_time(x);
}

void exchange_step(exchange_t *x)
{
    if (x->app != NULL) {
        do {
            (void)arb_app_step(x->app, x->now_ms);
        } while (profile_run_is_planning(&x->app->limb.run) ||
                 x->app->limb.run.state == PROFILE_RUN_PLANNED); /* a plan takes several steps */
    } else {
        (void)pdcp_arb_step(x->arb, x->now_ms);
    }
}

/* Is a bind request held? */
static bool is_held(const exchange_t *x)
{
    for (int i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (x->arb->bus.tables.devices[i].state == PDCP_PLACE_ASKED) {
            return true;
        }
    }
    return false;
}

void exchange_rx(exchange_t *x, const char *text)
{
    const can_frame_t frame = exchange_frame(text);
    if (x->app != NULL) {
        arb_app_on_frame(x->app, x->now_ms, &frame);
    } else {
        (void)pdcp_arb_on_frame(x->arb, x->now_ms, &frame);
    }
    exchange_step(x);
    if (pdcp_id_priority(frame.id) == PDCP_PRIORITY_BINDING && is_held(x)) {
        exchange_pass(x, PDCP_HOLD_MS);
    }
}

void exchange_tx(exchange_t *x, const char *text)
{
    char want[40];
    char have[40] = "nothing";
    const can_frame_t frame = exchange_frame(text);
    to_text(&frame, want, sizeof want);
    exchange_step(x);
    const can_frame_t *sent = pdcp_arb_tx_peek(x->arb);
    if (sent != NULL) {
        to_text(sent, have, sizeof have);
        pdcp_arb_tx_pop(x->arb);
    }
    TEST_ASSERT_EQUAL_STRING(want, have);
}

void exchange_silence(exchange_t *x)
{
    char have[40] = "nothing";
    exchange_step(x);
    const can_frame_t *sent = pdcp_arb_tx_peek(x->arb);
    if (sent != NULL) {
        to_text(sent, have, sizeof have);
    }
    TEST_ASSERT_EQUAL_STRING("nothing", have);
}

int exchange_drain(exchange_t *x)
{
    int count = 0;
    exchange_step(x);
    while (pdcp_arb_tx_peek(x->arb) != NULL) {
        pdcp_arb_tx_pop(x->arb);
        count++;
    }
    return count;
}

void exchange_wait(exchange_t *x, uint32_t ms)
{
    x->now_ms += ms;
    exchange_step(x);
}

void exchange_pass(exchange_t *x, uint32_t ms)
{
    for (uint32_t i = 0; i < ms; i++) {
        exchange_wait(x, 1);
        const can_frame_t *sent = pdcp_arb_tx_peek(x->arb);
        if (sent != NULL && sent->id == 0x100) {
            pdcp_arb_tx_pop(x->arb);
        }
    }
}

int exchange_count(const exchange_t *x, pdcp_event_kind_t kind)
{
    int count = 0;
    for (int i = 0; i < x->event_count; i++) {
        count += x->events[i].kind == kind ? 1 : 0;
    }
    return count;
}

const pdcp_event_t *exchange_last(const exchange_t *x, pdcp_event_kind_t kind)
{
    for (int i = x->event_count; i-- > 0;) {
        if (x->events[i].kind == kind) {
            return &x->events[i];
        }
    }
    TEST_FAIL_MESSAGE("no such event");
    return NULL;
}

void exchange_clear(exchange_t *x)
{
    x->event_count = 0;
}

void exchange_pairs(exchange_t *x, const exchange_pair_t *pairs)
{
    for (; pairs->tx != NULL; pairs++) {
        exchange_tx(x, pairs->tx);
        if (pairs->rx != NULL) {
            exchange_rx(x, pairs->rx);
        }
    }
}

void exchange_run(exchange_t *x, const exchange_pair_t *pairs)
{
    exchange_pairs(x, pairs);
    exchange_silence(x);
}

void exchange_ask(exchange_t *x, const char *node_id, const char *tx, const char *rx)
{
    char text[40];
    (void)snprintf(text, sizeof text, "3%s#%s", node_id, tx);
    exchange_tx(x, text);
    (void)snprintf(text, sizeof text, "2%s#%s", node_id, rx);
    exchange_rx(x, text);
}

void exchange_ask_all(exchange_t *x, const char *node_id, const exchange_pair_t *pairs)
{
    for (; pairs->tx != NULL; pairs++) {
        exchange_ask(x, node_id, pairs->tx, pairs->rx);
    }
}

void exchange_update(exchange_t *x, const char *vid_pid, const char *serial)
{
    exchange_rx(x, "212#0F 01");
    exchange_ask(x, "12", "03 05 01", vid_pid);
    exchange_ask(x, "12", "03 06 01", serial);
}

static void lose(exchange_t *x, const char *beacon_of_the_other)
{
    exchange_pass(x, 1000);
    exchange_rx(x, beacon_of_the_other);
    exchange_pass(x, 500);
}

void exchange_lose_output(exchange_t *x)
{
    lose(x, "012#0A");
}

void exchange_lose_input(exchange_t *x)
{
    lose(x, "011#0A");
}

uint8_t exchange_output(const exchange_t *x)
{
    return pdcp_tables_channel(&x->arb->bus.tables, 0, 1);
}

uint8_t exchange_input(const exchange_t *x)
{
    return pdcp_tables_channel(&x->arb->bus.tables, 1, 1);
}

const pdcp_channel_t *exchange_input_entry(const exchange_t *x)
{
    return &x->arb->bus.tables.channels[exchange_input(x)];
}

void exchange_start_limb(exchange_t *x)
{
    exchange_start(x, 0xFFFFFF00u);
    exchange_add_both(x);
    exchange_clear(x);
}

void exchange_check_fails(exchange_t *x, const char *node_id)
{
    char question[16];
    (void)snprintf(question, sizeof question, "3%s#03 01 00", node_id);
    for (int tries = 0; tries < PDCP_CHECK_TRIES; tries++) {
        exchange_tx(x, question);
        exchange_pass(x, PDCP_ACK_MS);
    }
}

void exchange_beacons(exchange_t *x)
{
    exchange_rx(x, "011#0A");
    exchange_rx(x, "012#0A");
}

void exchange_meet_server(exchange_t *x)
{
    for (int i = 0; i < PDCP_STANDBY_BEACONS; i++) {
        exchange_rx(x, "100#0A");
    }
}

void exchange_meet_rival(exchange_t *x)
{
    const uint32_t until_ms = x->now_ms + PDCP_YIELD_MS + EXCHANGE_SERIAL;
    while (pdcp_time_before(x->now_ms, until_ms)) {
        exchange_rx(x, "100#0A");
        exchange_rx(x, "345#03 0A 00"); /* a device of its own answers it */
        exchange_rx(x, "245#83 01 0A 00 F401");
        exchange_beacons(x);
        exchange_pass(x, 500);
    }
    TEST_ASSERT_FALSE(pdcp_arb_is_on_standby(x->arb));
}
