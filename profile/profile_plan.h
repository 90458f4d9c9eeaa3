/* The planner (profile-layer.md 4): which output every input is to hear, decided on tables alone (D-PRO-5).
 *
 * It starts from the links that work, and never takes one away but for the original that it stands in for, or
 * because an input that it requires is not connected. Its result does not depend on where devices and
 * channels stand in the tables. Nothing is sent here: profile_run.h carries the plan out, and plans anew
 * without a pair that could not be linked.
 *
 * A plan is made in slices, so that the bus is served in between: profile_plan_begin, then profile_plan_step
 * until it is done. The tables must not change meanwhile; when they do, the plan is begun anew (D-PRO-23).
 * How long the slices are makes no difference to the plan. */
#ifndef PROFILE_PLAN_H
#define PROFILE_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_nodes.h"
#include "profile_links.h"
#include "profile_scene.h"

/* What is to be planned, in this order. */
typedef enum {
    PROFILE_PLAN_ORIGINALS = 1, /* the links of the active configuration whose ends are there (D-PRO-6) */
    PROFILE_PLAN_REPLACE = 2,   /* replacements for missing ends [PROFILE listing 4.6] */
    PROFILE_PLAN_AUTO = 4,      /* unconnected terminal channels [PROFILE listing 4.7] */
    PROFILE_PLAN_ALL = 7,
    PROFILE_PLAN_SETTLE =
        8, /* nothing new: links that miss a required input rest, as they do in every plan */
    PROFILE_PLAN_ENFORCE = 16 /* nothing else: of the sole-access inputs of one output only the one with the
                                 lowest profile keeps it, the others' entries are removed; links that then
                                 miss a required input are not wanted any more */
} profile_plan_what_t;

enum {
    PROFILE_PLAN_DEPTH = 64, /* a chain of required inputs is followed so far; deeper ones fail (D-PRO-17) */
    PROFILE_PLAN_SHARE = 8,  /* the search for one link with all that it requires may take one part in so many
                                of the steps that are left: those behind it get theirs */
    PROFILE_PLAN_SLICE = 150, /* effort of a slice: half a millisecond of a dsPIC33 at 40 MIPS (D-PRO-23) */
    PROFILE_PLAN_UNIT = 300   /* what cannot be cut takes no more: a slice may be longer by so much */
};

/* Channels looked at in one plan (D-PRO-17). What is not found within is not found. */
#define PROFILE_PLAN_STEPS 200000uL

/* One input that is being connected. */
typedef struct {
    uint8_t input;
    uint8_t source; /* where its next candidate comes from */
    uint8_t tried;  /* candidate of this source tried last, the one in the plan; PDCP_NONE: none yet */
    uint8_t mark;   /* where in the log it stands, or will */
    uint8_t need;   /* what is seen to, or that its next candidate is to be tried */
    uint8_t cursor; /* channel number of the need seen to last, PDCP_NONE: none yet */
} profile_frame_t;

/* All but want, steps and left is the planner's own. */
typedef struct {
    const profile_scene_t *scene; /* of the call under way; nodes and links are its */
    const pdcp_nodes_t *nodes;
    profile_links_t *links;
    uint32_t steps;       /* channels compared */
    uint32_t base;        /* hash of the links that worked when the plan was begun, */
    uint32_t before;      /* and of want at the beginning of the round */
    int16_t left;         /* effort that this slice has left; one is about 100 cycles of a dsPIC33 */
    uint16_t search_left; /* steps of the search under way */
    uint8_t what;
    uint8_t phase;
    uint8_t rounds;   /* that are over */
    uint8_t at;       /* entry or input that the phase is at */
    uint8_t pass;     /* over the originals */
    uint8_t input_at; /* that find_next is at */
    uint8_t input;    /* the phase's, and its output */
    uint8_t output;
    uint8_t source;     /* what an original replaces: the source that its input had, */
    uint8_t rival;      /* and another input of its output */
    bool costs;         /* it replaces something */
    bool named;         /* this round has found stand-ins */
    bool waits;         /* an end of the configuration is awaited */
    bool changed;       /* by this pass over the inputs */
    bool spoilt;        /* the original at hand lacks something, or another one lost what it has */
    bool finding;       /* links that lack something are being marked, and count as gone */
    bool connecting;    /* an input is being connected: */
    uint8_t needs_last; /* the last kind of source that may be asked for what its link needs */
    uint8_t depth;      /* frames below the top */
    uint8_t logged;
    uint8_t search_at; /* channel that a search is at, 0: it begins */
    uint8_t best;      /* the best one so far */
    profile_frame_t top;
    uint8_t ready[PROFILE_PLACE_BYTES];   /* bit per place: the device was set up when the plan was begun */
    uint8_t taken[PROFILE_CHANNEL_BYTES]; /* bit per output: it feeds a sole-access input */
    uint8_t open[PROFILE_CHANNEL_BYTES];  /* bit per place in the log: it is a frame below the top */
    union {
        struct {
            uint8_t gone[PROFILE_CHANNEL_BYTES];    /* bit per input: its link lacks something */
            uint8_t lacking[PROFILE_CHANNEL_BYTES]; /* the same before the original came back */
        } bits;
        uint8_t keys[PROFILE_LINKS_MAX]; /* of the entries to be repaired, 0: none */
    } of;
    uint8_t below[PROFILE_PLAN_DEPTH / 2]; /* 4 bits per frame below the top: source and need */
    uint8_t stand_in[PROFILE_LINKS_MAX];   /* of the entries, as planned so far */
    uint8_t want[PDCP_CHANNELS_MAX];       /* of inputs: channel number of the source, PDCP_NONE: none */
    uint8_t log[PDCP_CHANNELS_MAX];        /* inputs connected, in order, for undoing */
} profile_plan_t;

/* Begins a plan; one that was under way is forgotten. what: profile_plan_what_t bits. */
void profile_plan_begin(profile_plan_t *plan, const profile_scene_t *scene, uint8_t what);

/* Makes a slice of the plan, which takes this effort, PROFILE_PLAN_SLICE, or up to PROFILE_PLAN_UNIT more.
 * True: the plan is done. */
bool profile_plan_step(profile_plan_t *plan, const profile_scene_t *scene, int16_t effort);

/* Has a device come or gone since the plan was begun, or this was asked? Then the plan is to be begun anew.
 */
bool profile_plan_is_stale(profile_plan_t *plan, const profile_scene_t *scene);

/* Do other links work than those that the plan was begun with? */
bool profile_plan_links_differ(const profile_plan_t *plan, const profile_scene_t *scene);

#endif
