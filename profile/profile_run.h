/* The profile layer at work: its state, and which plan is due (profile-layer.md 4).
 *
 * It waits for the start-up (profile_start.h). Then it plans whenever a device is lost or set up, or a link
 * stops working. profile_events.h takes what happens on the bus. profile_step.h makes the plan that is due
 * and lets profile_carry.h carry it out. profile_active.h keeps the active configuration. Of stored
 * configurations the layer knows only what its owner tells it.
 *
 * A link that cannot be made is banned, and the plan is made again without it and without what was made for
 * it (D-PRO-5). If the tables change before a plan is made, it is begun again (D-PRO-23).
 *
 *            start-up
 *   WAITING ----------> TO_PLAN ---> PLANNING ---> PLANNED ---> CARRYING_OUT ---> LINKING
 *                        ^   ^ tables |                            |     ^          |
 *               plan due |   +--------+           nothing left     |     +----------+
 *                        |    changed                              |     made or failed
 *                       IDLE <-------------------------------------+
 *
 * From each state but WAITING and LINKING a plan that is due leads to TO_PLAN. A plan that the owner begins
 * while a link is being made waits for that link in LINKING_LAST, then goes to TO_PLAN. When the arbitrator
 * starts again or goes on standby, each state leads to WAITING. */
#ifndef PROFILE_RUN_H
#define PROFILE_RUN_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_tables.h"
#include "profile_links.h"
#include "profile_plan.h"

enum {
    PROFILE_QUIET_MS = 500,   /* quiet time before the start-up: nothing binds or is set up */
    PROFILE_ARRIVAL_MS = 500, /* longest wait of a plan for devices that are being set up */
    PROFILE_RESET_MS = 3000,  /* how long a reset device may be away (profile-layer.md 4.5) */
    PROFILE_TRIES_MAX = 3,    /* tries of a link whose device does not answer, before the next candidate */
    PROFILE_RETRY_MS = 5000   /* until links that could not be made are tried again */
};

/* Profile state of 2401h. */
typedef enum {
    PROFILE_WAITING = 0,     /* for the start-up */
    PROFILE_CONFIGURING = 1, /* a plan is being made or carried out */
    PROFILE_RUNNING = 2
} profile_state_t;

/* States, as drawn above. */
typedef enum {
    PROFILE_RUN_WAITING = 0,  /* for the start-up */
    PROFILE_RUN_IDLE,         /* the limb runs; no plan is under way */
    PROFILE_RUN_TO_PLAN,      /* the next step begins the plan */
    PROFILE_RUN_PLANNING,     /* each step makes a slice of the plan */
    PROFILE_RUN_PLANNED,      /* the next step begins to carry the plan out */
    PROFILE_RUN_CARRYING_OUT, /* links are taken away, and the next link is chosen */
    PROFILE_RUN_LINKING,      /* the arbitrator makes the link `request` */
    PROFILE_RUN_LINKING_LAST  /* the same, and a new plan follows */
} profile_run_state_t;

/* How long a plan that is due may wait (D-PRO-12). */
typedef enum {
    PROFILE_AFTER_SETUPS, /* until no device is being set up, PROFILE_ARRIVAL_MS at most */
    PROFILE_AT_ONCE
} profile_urgency_t;

/* Small state stands first: on the smallest part, a field that lies farther than 511 bytes from the beginning
 * costs twice the instructions. */
typedef struct {
    profile_scene_t scene; /* made: inputs linked by the plan under way; awaited: devices that were reset */
    uint8_t dropping[PROFILE_CHANNEL_BYTES]; /* bit per input: this layer is taking its link away */
    uint8_t tries;                           /* number of times that the link being made was tried before */
    uint8_t state;                           /* profile_run_state_t */
    uint8_t what;                            /* profile_plan_what_t of the plan under way, 0: none is */
    uint8_t due;                             /* profile_plan_what_t of the plan to be made next, 0: none is */
    uint8_t urgency;                         /* profile_urgency_t of that plan; 0 if none is due */
    profile_pair_t request;                  /* LINKING: the link that is being made */
    uint8_t at_start;    /* profile_plan_what_t allowed at the start-up, by the flags of 2404h */
    uint8_t at_events;   /* profile_plan_what_t allowed when devices come or go, by the flags of 2404h */
    bool frozen;         /* the configuration must not change; profile_active_take_up when it may again */
    bool changed;        /* the configuration has changed; the owner resets it */
    uint16_t moves;      /* links made or taken away by this plan */
    uint32_t stirred_ms; /* when a setup ended last */
    uint32_t arrival_ms; /* until when the plan that is due waits at most, with PROFILE_AFTER_SETUPS */
    uint32_t awaited_ms; /* until when reset devices are awaited; valid while awaited has bits */
    uint32_t retry_ms;   /* when banned links are tried again; valid while there are some */
    profile_board_t plan;
    profile_links_t links; /* the active configuration */
} profile_run_t;

/* tables: the arbitrator's; they must outlive run. */
void profile_run_init(profile_run_t *run, const pdcp_tables_t *tables, uint32_t now_ms);

/* What the host is told of the state. */
static inline profile_state_t profile_run_status(const profile_run_t *run)
{
    if (run->state == PROFILE_RUN_WAITING) {
        return PROFILE_WAITING;
    }
    return run->state == PROFILE_RUN_IDLE ? PROFILE_RUNNING : PROFILE_CONFIGURING;
}

/* Is a plan due or under way? */
bool profile_run_is_busy(const profile_run_t *run);

/* Begins a plan (profile_plan_what_t bits). It starts from the links that work or, with `anew`, only from
 * those that the host has made: then others that are not in the configuration go. */
void profile_run_begin(profile_run_t *run, uint8_t what, bool anew);

/* For the other files of the layer ----------------------------------------------------------------------- */

/* Goes to a state. IDLE ends the plan. */
void profile_run_enter(profile_run_t *run, profile_run_state_t state);

/* Is a plan being made from tables and configuration as they are now? */
bool profile_run_is_planning(const profile_run_t *run);

/* Is the arbitrator making a link for the plan? */
bool profile_run_is_linking(const profile_run_t *run);

/* The configuration has changed: a plan that is being made is begun again. */
void profile_run_note_change(profile_run_t *run);

/* Makes a plan due, for this and for what is due already. The greater urgency counts. Does nothing before
 * the start-up. */
void profile_run_make_due(profile_run_t *run, uint8_t what, profile_urgency_t urgency);

/* Makes due what events may plan, and lifts all bans: devices have come or gone, or a wait is over. */
void profile_run_stir(profile_run_t *run, uint32_t now_ms, profile_urgency_t urgency);

/* Begins the plan that is due, which also covers what the plan under way is for. */
void profile_run_begin_due(profile_run_t *run);

#endif
