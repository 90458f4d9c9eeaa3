#include "arb_app.h"

#include <stddef.h>
#include <string.h>

#include "arb_limits.h"
#include "pdcp_time.h"

/* On a target with 16-bit pointers the whole application has to fit its budget: a negative array size does
 * not compile. */
typedef char arb_app_fits_its_budget[sizeof(void *) > 2 || sizeof(arb_app_t) <= ARB_RAM_BUDGET ? 1 : -1];

static void on_event(void *ctx, uint32_t now_ms, const pdcp_event_t *event)
{
    arb_app_t *app = ctx;
    if (event->kind == PDCP_EVENT_IDENTITIES) {
        arb_store_touch(&app->store, now_ms);
    }
    arb_limb_on_event(&app->limb, &app->arb, now_ms, event);
    arb_hostapi_on_event(&app->api, &app->arb, now_ms, event);
    if (app->observer != NULL) {
        app->observer(app->observer_ctx, now_ms, event);
    }
}

/* Parts of a stored configuration keep their places when unknown devices crowd in (D-BUS-43). Now and then an
 * unknown device is taken for one (D-BUS-53). */
static bool knows(void *ctx, const pdcp_identity_t *identity)
{
    const arb_app_t *app = ctx;
    return arb_config_names(&app->limb.config, identity);
}

void arb_app_init(arb_app_t *app, const arb_port_t *port, const arb_settings_t *settings, uint32_t now_ms)
{
    memset(app, 0, sizeof *app);
    app->port = port;
    app->work = true;
    pdcp_arb_init(&app->arb, now_ms, settings->serial, settings->seed, on_event, app);
    pdcp_arb_know(&app->arb, knows);
    arb_nvm_init(&app->nvm, port);
    arb_store_load(&app->store, &app->nvm, &app->arb.bus.bind);
    arb_limb_init(&app->limb, &app->arb.bus.tables, &app->nvm, settings->strict_crc ? ARB_FLAG_STRICT_CRC : 0,
                  settings->no_autoconfig ? ARB_FLAG_AUTOCONFIGURE : 0, now_ms);
    app->api.strict = (arb_limb_flags(&app->limb) & ARB_FLAG_STRICT_CRC) != 0;
    pdcp_arb_plan_links(&app->arb, false);
    pdcp_arb_audit(&app->arb, now_ms);
}

void arb_app_observe(arb_app_t *app, arb_observer_t observer, void *ctx)
{
    app->observer = observer;
    app->observer_ctx = ctx;
}

void arb_app_on_frame(arb_app_t *app, uint32_t now_ms, const can_frame_t *frame)
{
    if (pdcp_arb_on_frame(&app->arb, now_ms, frame)) {
        app->work = true;
    }
    if (arb_hostapi_wants_frames(&app->api)) {
        arb_hostapi_on_frame(&app->api, app->port, now_ms, frame);
        app->work = true;
    }
}

void arb_app_on_state(arb_app_t *app, uint32_t now_ms, pdcp_bus_state_t state)
{
    if (state != (pdcp_bus_state_t)app->arb.recovery.state) {
        pdcp_arb_on_state(&app->arb, now_ms, state);
        app->work = true;
    }
}

void arb_app_on_errors(arb_app_t *app, uint8_t transmit, uint8_t receive)
{
    app->api.events.tx_errors = transmit;
    app->api.events.rx_errors = receive;
}

void arb_app_on_host_gone(arb_app_t *app)
{
    arb_hostapi_on_host_gone(&app->api);
}

uint16_t arb_app_on_bytes(arb_app_t *app, uint32_t now_ms, const uint8_t *bytes, uint16_t len)
{
    app->work = true;
    return arb_hostapi_on_bytes(&app->api, now_ms, bytes, len);
}

static void send_frames(arb_app_t *app, uint32_t now_ms)
{
    const can_frame_t *frame = pdcp_arb_tx_peek(&app->arb);
    while (frame != NULL && app->port->can_send(app->port->ctx, frame)) {
        if (arb_hostapi_wants_frames(&app->api)) {
            arb_hostapi_on_frame(&app->api, app->port, now_ms, frame);
        }
        pdcp_arb_tx_pop(&app->arb);
        frame = pdcp_arb_tx_peek(&app->arb);
    }
}

uint32_t arb_app_step(arb_app_t *app, uint32_t now_ms)
{
    if (!app->work && pdcp_time_before(now_ms, app->next_ms)) {
        return app->next_ms;
    }
    const arb_hostenv_t env = {
        .port = app->port, .arb = &app->arb, .limb = &app->limb, .nvm = &app->nvm, .store = &app->store};
    uint32_t next_ms;
    bool again;
    do {
        next_ms = pdcp_arb_step(&app->arb, now_ms);
        again = arb_limb_step(&app->limb, &app->arb, &app->nvm, now_ms);
        if (arb_hostapi_step(&app->api, &env, now_ms)) {
            again = true;
        }
    } while (again);
    if (pdcp_arb_take_restart(&app->arb) && app->port->can_restart != NULL) {
        app->port->can_restart(app->port->ctx);
    }
    send_frames(app, now_ms);
    arb_store_step(&app->store, &app->arb.bus.bind, now_ms);
    next_ms = pdcp_time_earlier(next_ms, arb_limb_next_ms(&app->limb, &app->arb, now_ms));
    next_ms = pdcp_time_earlier(next_ms, arb_hostapi_next_ms(&app->api, now_ms));
    app->next_ms = pdcp_time_earlier(next_ms, arb_store_next_ms(&app->store, now_ms));
    app->work = pdcp_arb_tx_peek(&app->arb) != NULL || arb_hostapi_has_output(&app->api);
    return app->next_ms;
}
