/* The profile layer at work (profile-layer.md 4): when to plan, and how a plan becomes bus traffic.
 *
 * It waits for the start-up, then plans whenever a device is lost or has been set up, or a link that worked
 * does not any more. A step makes one slice of a plan; when the tables have changed before it is done, it is
 * begun anew (D-PRO-23). Of a plan that is done it carries out one link after the other. A link that cannot
 * be made is banned and the plan is made anew, without what the failed one has made (D-PRO-5); while links
 * fail, those that require what is not connected rest (D-PRO-9). What it knows of stored configurations its
 * owner tells it (arb_limb.h).
 */
#ifndef PROFILE_RUN_H
#define PROFILE_RUN_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_arb.h"
#include "profile_links.h"
#include "profile_plan.h"

enum {
    PROFILE_QUIET_MS = 500,   /* start-up waits until nothing has been bound or set up for so long */
    PROFILE_ARRIVAL_MS = 500, /* the plan for a new device waits so long for others that are being set up */
    PROFILE_RESET_MS = 3000,  /* a device that the host has reset is not lost so soon (profile-layer.md 4) */
    PROFILE_TRIES_MAX = 3,    /* of a link whose device does not answer, before the next candidate is tried */
    PROFILE_RETRY_MS = 5000   /* links that could not be made are tried again */
};

typedef enum {
    PROFILE_WAITING = 0,     /* for the start-up */
    PROFILE_CONFIGURING = 1, /* a plan is being carried out */
    PROFILE_RUNNING = 2
} profile_state_t;

/* How a plan is being made; not 0: the next step goes on without delay (D-PRO-23). */
typedef enum {
    PROFILE_NOT_MAKING = 0,
    PROFILE_MAKING,   /* slice by slice */
    PROFILE_JUST_MADE /* carried out from the next step on */
} profile_making_t;

/* Small state stands first: on the smallest part, a field that lies farther than 511 bytes from the beginning
 * costs twice the instructions. */
typedef struct {
    profile_scene_t scene; /* made: inputs linked by the plan under way; awaited: devices that
                              the host has reset */
    uint8_t dropping[PROFILE_CHANNEL_BYTES]; /* inputs whose links this layer is taking away */
    uint8_t tries;                           /* of the link that is being made, those before this one */
    uint8_t state;                           /* profile_state_t */
    uint8_t what;                            /* profile_plan_what_t of the plan under way, 0: none is */
    uint8_t due;                             /* of the plan to be made next, 0: none is */
    uint8_t making;                          /* profile_making_t */
    bool stale;                              /* and what it is made from has changed */
    bool wishing;                            /* a link has been asked for, */
    profile_pair_t wish;                     /* this one */
    bool urgent;         /* the plan that is due does not wait for devices being set up; never without due */
    uint8_t at_start;    /* what may be planned at the start-up, */
    uint8_t at_events;   /* and when devices come or go: profile_plan_what_t, by the flags of 2404h */
    bool frozen;         /* the configuration must not change; profile_run_take_up when it may again */
    bool changed;        /* the configuration has changed; the owner resets it */
    uint16_t moves;      /* links made or taken away by this plan */
    uint32_t stirred_ms; /* when a setup ended last */
    uint32_t arrival_ms; /* the plan that is due waits so long at most, unless it is urgent */
    uint32_t awaited_ms; /* until when reset devices are awaited; means something while awaited has bits */
    uint32_t retry_ms;   /* means something while links are banned */
    profile_board_t plan;
    profile_links_t links; /* the active configuration */
} profile_run_t;

/* run is all zero before. nodes: the arbitrator's tables; they must outlive run. */
void profile_run_init(profile_run_t *run, const pdcp_nodes_t *nodes, uint32_t now_ms);

/* An event of the arbitrator; hand all of them in. */
void profile_run_on_event(profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms,
                          const pdcp_event_t *event);

/* Is a device set up (D-PRO-18), and the start-up still to come? */
bool profile_run_is_starting(const profile_run_t *run);

/* May the start-up begin: is a device set up, no link half made, and has there been quiet for
 * PROFILE_QUIET_MS? */
bool profile_run_is_quiet(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms);

/* Empties the active configuration for one that is to be loaded; keep_host leaves links that the host has
 * made. Then profile_run_load_link for each of its links: one whose input has a link already is left out, and
 * false means that there was no room. */
void profile_run_load_begin(profile_run_t *run, bool keep_host);
bool profile_run_load_link(profile_run_t *run, const profile_link_t *link);

/* Begins the start-up. stored: a stored configuration has been loaded. Otherwise the configuration is read
 * back from the sources that the devices name. */
void profile_run_start(profile_run_t *run, pdcp_arb_t *arb, bool stored);

/* Begins a plan, profile_plan_what_t bits. anew: from nothing but the links that the host has made, others
 * that are not in the configuration go; else from the links that work. */
void profile_run_begin(profile_run_t *run, uint8_t what, bool anew);

/* Makes what stands in for missing ends the configuration. Returns how many links have changed. */
uint8_t profile_run_adopt(profile_run_t *run);

/* Makes links that work without being in the active configuration part of it, unless it is frozen. False: one
 * is left out, for want of room. */
bool profile_run_take_up(profile_run_t *run);

/* Does what is due. True: the arbitrator was given something to do. */
bool profile_run_step(profile_run_t *run, pdcp_arb_t *arb, uint32_t now_ms);

/* The time of the next call at the latest; now_ms + PDCP_TIME_FAR_MS when nothing depends on time. */
uint32_t profile_run_next_ms(const profile_run_t *run, const pdcp_arb_t *arb, uint32_t now_ms);

/* Is a plan due or being carried out? */
bool profile_run_is_busy(const profile_run_t *run);

#endif
