/* The arbitrator as an application: owns all state and joins bus, host API and storage.
 *
 * Passive: the program hands in frames, bytes and time, then calls arb_app_step. That sends through the port
 * and says when to call it again. The program also calls it when the controller or the host has room again
 * after a refusal. An application belongs to one thread; a process may hold several. */
#ifndef ARB_APP_H
#define ARB_APP_H

#include "arb_hostapi.h"
#include "arb_limb.h"
#include "arb_nvm.h"
#include "arb_port.h"
#include "arb_store.h"
#include "pdcp_arb.h"

typedef struct {
    uint32_t serial; /* differs between arbitrators on one bus (D-BUS-12) */
    uint32_t seed;   /* differs from start to start; decides where the ids of outputs begin (D-BUS-36) */
    /* From the command line: override the stored flags of 2404h, and are not stored. */
    bool strict_crc;    /* refuse host messages with wrong checksums (D-API-1) */
    bool no_autoconfig; /* terminal channels are not linked by themselves */
} arb_settings_t;

/* Takes every event of the bus, for a log or a display. It may read the application's tables and call nothing
 * else of it. */
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

/* Sets the observer of events; NULL: none. */
void arb_app_observe(arb_app_t *app, arb_observer_t observer, void *ctx);

/* Takes a frame of any kind from the bus, not sent by this application. Then call arb_app_step; several
 * frames may be handed in before one step. */
void arb_app_on_frame(arb_app_t *app, uint32_t now_ms, const can_frame_t *frame);

/* Takes the controller's state. Call whenever it may have changed; the same state again is harmless. */
void arb_app_on_state(arb_app_t *app, uint32_t now_ms, pdcp_bus_state_t state);

/* Takes the controller's error counters, for the host. Call before arb_app_on_state. */
void arb_app_on_errors(arb_app_t *app, uint8_t transmit, uint8_t receive);

/* Ends the event stream: the host has closed its end. The next host gets no events unless it asks for
 * them. */
void arb_app_on_host_gone(arb_app_t *app);

/* Takes bytes from the host. Returns how many were taken; offer the rest again after the next step. */
uint16_t arb_app_on_bytes(arb_app_t *app, uint32_t now_ms, const uint8_t *bytes, uint16_t len);

/* Does everything that is due. Returns the time of the next call at the latest, absolute. */
uint32_t arb_app_step(arb_app_t *app, uint32_t now_ms);

#endif
