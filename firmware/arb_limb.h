/* The limb that configures itself: joins the profile layer (profile_run.h), the stored configurations
 * (arb_config.h) and the stored flags (arb_flags.h) with the arbitrator, and carries out the host's profile
 * actions (host-api.md 3, profile-layer.md 4). */
#ifndef ARB_LIMB_H
#define ARB_LIMB_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_config.h"
#include "arb_error.h"
#include "arb_flags.h"
#include "pdcp_arb.h"
#include "profile_run.h"

enum {
    ARB_LIMB_AUTO_SAVE_MS = 5000 /* after the last change (profile-layer.md 4) */
};

/* 2407h */
typedef enum {
    ARB_ACTION_NONE = 0,
    ARB_ACTION_SAVE = 1, /* argument: configuration, 0 = the active one (D-PRO-16) */
    ARB_ACTION_LOAD = 2,
    ARB_ACTION_ERASE = 3,
    ARB_ACTION_AUTOCONFIGURE = 4,
    ARB_ACTION_CLEAR = 5,
    ARB_ACTION_ENFORCE = 6,
    ARB_ACTION_REPLACE = 7,
    ARB_ACTION_ADOPT = 8
} arb_action_t;

/* Small state stands first, as in profile_run_t. */
typedef struct {
    uint8_t in_force; /* flags: as stored, or as the command line says instead */
    uint8_t active;   /* configuration, 0: none */
    uint8_t stage;    /* arb_limb.c: what is under way */
    uint8_t number;   /* configuration that is being read, saved, loaded or erased */
    int8_t status;    /* of the job of arb_config that has ended: arb_config_status_t */
    bool ended;       /* the outcome is there: */
    uint8_t error;    /* ARB_ERR_... (arb_error.h) */
    uint16_t result;
    bool told;           /* the host knows of all changes of active and stored configurations */
    bool unsaved;        /* the configuration was changed, for auto-save */
    uint32_t save_ms;    /* auto-save: when it is due */
    uint8_t best;        /* start-up: the best configuration so far (D-PRO-4) */
    uint16_t best_score; /* its score, 256 for a link with both ends, 1 for one with one end, */
    uint16_t score;      /* and that of the one that is being read. Load: how many links it has */
    arb_flags_t flags;
    arb_config_t config;
    profile_run_t run;
} arb_limb_t;

/* Reads what is stored, which may block for as long as the memory needs. flags_on and flags_off override the
 * stored flags. tables: the arbitrator's; they must outlive limb. */
void arb_limb_init(arb_limb_t *limb, const pdcp_tables_t *tables, arb_nvm_t *nvm, uint8_t flags_on,
                   uint8_t flags_off, uint32_t now_ms);

/* Takes an event of the arbitrator. All of them must be handed in. */
void arb_limb_on_event(arb_limb_t *limb, const pdcp_arb_t *arb, uint32_t now_ms, const pdcp_event_t *event);

/* Does what is due. True: the arbitrator was given something to do. */
bool arb_limb_step(arb_limb_t *limb, pdcp_arb_t *arb, arb_nvm_t *nvm, uint32_t now_ms);

/* The time of the next call at the latest. */
uint32_t arb_limb_next_ms(const arb_limb_t *limb, const pdcp_arb_t *arb, uint32_t now_ms);

/* Is a plan or an action under way? 2307h, 2407h and 2410h wait for its end (D-API-6). */
bool arb_limb_is_busy(const arb_limb_t *limb);

/* Are there devices, but the start-up has not begun? No action of the host may come before it. */
bool arb_limb_is_starting(const arb_limb_t *limb);

/* Begins an action for the host; nothing may be under way. ARB_OK: arb_limb_take_outcome tells the outcome.
 * Otherwise nothing was begun. ARB_ERR_NUMBER: there is no such configuration. ARB_ERR_VALUE: there is no
 * such action. ARB_ERR_BUSY: try again. */
uint8_t arb_limb_act(arb_limb_t *limb, uint8_t action, uint8_t argument);

/* The host's error code for a status of arb_config (D-API-4). */
uint8_t arb_limb_error(arb_config_status_t status);

/* True, once: the action has ended. error: ARB_OK or an error. result: as in 2408h. */
bool arb_limb_take_outcome(arb_limb_t *limb, uint8_t *error, uint16_t *result);

/* Sets and stores the flags, bits 0 to 3 (2404h). */
void arb_limb_set_flags(arb_limb_t *limb, uint32_t now_ms, uint8_t flags);

/* The flags as they are in force, bits 0 to 3. */
static inline uint8_t arb_limb_flags(const arb_limb_t *limb)
{
    return limb->in_force;
}

/* Profile state of 2401h. */
static inline uint8_t arb_limb_state(const arb_limb_t *limb)
{
    return (uint8_t)profile_run_status(&limb->run);
}

/* True, once: the active or the stored configurations have changed (event 4). */
bool arb_limb_take_change(arb_limb_t *limb);

/* Notes that the host has written the stored configurations (240Dh). */
void arb_limb_on_written(arb_limb_t *limb, pdcp_arb_t *arb);

#endif
