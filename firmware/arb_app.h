/* The arbitrator as an application: owns all state, joins the bus (pdcp/), the host API and what is stored.
 *
 * Passive: the program hands in frames, bytes and the time, then calls arb_app_step, which sends through the
 * port and says when it wants to be called again. The program calls it also when the controller or the host
 * has room again after a refusal. One thread; any number of applications. */
#ifndef ARB_APP_H
#define ARB_APP_H

#include "arb_hostapi.h"
#include "arb_limb.h"
#include "arb_nvm.h"
#include "arb_port.h"
#include "arb_store.h"
#include "pdcp_arb.h"

typedef struct {
    uint32_t serial; /* of this arbitrator: tells two on one bus apart (D-BUS-12) */
    uint32_t seed;   /* differs from start to start: where the ids of outputs begin (D-BUS-36) */
    /* The command line's word, which overrides the stored flags of 2404h without being stored. */
    bool strict_crc;    /* refuse host messages with wrong checksums (D-API-1) */
    bool no_autoconfig; /* terminal channels are not linked by themselves */
} arb_settings_t;

/* Told of everything that happens on the bus, for a log or a display. Must not call back into the application
 * but to read its tables. */
typedef void (*arb_observer_t)(void *ctx, uint32_t now_ms, const pdcp_event_t *event);

typedef struct {
    uint32_t next_ms;        /* what arb_app_step returned last */
    arb_observer_t observer; /* NULL: nobody */
    void *observer_ctx;
    const arb_port_t *port;
    bool work; /* something was handed in, or frames or bytes wait for room */
    arb_nvm_t nvm;
    arb_store_t store;
    arb_limb_t limb;
    arb_hostapi_t api;
    pdcp_arb_t arb;
} arb_app_t;

/* Reads what is stored and starts. port must outlive the application. */
void arb_app_init(arb_app_t *app, const arb_port_t *port, const arb_settings_t *settings, uint32_t now_ms);

/* Sets who is told of events; NULL: nobody. */
void arb_app_observe(arb_app_t *app, arb_observer_t observer, void *ctx);

/* A frame from the bus, of any kind, not sent by this application. Then call arb_app_step; several frames may
 * be handed in before one step. */
void arb_app_on_frame(arb_app_t *app, uint32_t now_ms, const can_frame_t *frame);

/* The controller's state, whenever it may have changed; telling the same state again is harmless. */
void arb_app_on_state(arb_app_t *app, uint32_t now_ms, pdcp_bus_state_t state);

/* The controller's error counters, for the host; to be told before the state. */
void arb_app_on_errors(arb_app_t *app, uint8_t transmit, uint8_t receive);

/* The host has closed its end, where that can be seen: the next one gets no events unless it asks for
 * them. */
void arb_app_on_host_gone(arb_app_t *app);

/* Bytes from the host. Returns how many were taken; the rest is offered again after the next step. */
uint16_t arb_app_on_bytes(arb_app_t *app, uint32_t now_ms, const uint8_t *bytes, uint16_t len);

/* Does everything that is due; costs next to nothing when there is nothing to do. Returns the absolute time
 * of the next call at the latest. */
uint32_t arb_app_step(arb_app_t *app, uint32_t now_ms);

#endif
