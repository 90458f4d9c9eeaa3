/* The board on which a plan is made: what is planned so far, and where each part of the planner stands.
 *
 * The planner works in small units (profile_plan.h), and all that it knows between two of them stands here.
 * Members of a part (search, connect, settle, originals, repair, plan) belong to the file of that name; the
 * others are shared. A channel number PDCP_NONE stands for no channel. The functions below read the scene and
 * change only the board. */
#ifndef PROFILE_BOARD_H
#define PROFILE_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_tables.h"
#include "profile_links.h"
#include "profile_scene.h"

/* Limits of a plan --------------------------------------------------------------------------------------- */

enum {
    PROFILE_PLAN_DEPTH = 64, /* length of the longest chain of required inputs; longer ones fail (D-PRO-17) */
    PROFILE_PLAN_SHARE = 8   /* a link and all that it requires may use one eighth of the steps that are left,
                                so that later links get theirs */
};

/* Channels that one plan may look at (D-PRO-17). Links that would take more are not made. */
#define PROFILE_PLAN_STEPS 200000uL

/* What common work takes off `left`; one is about 100 cycles of a dsPIC33 (D-PRO-23). */
enum {
    PROFILE_EFFORT_FIND = 8, /* to find an entry or the channel of an end */
    PROFILE_EFFORT_SCAN = 24 /* to look for something among all entries or channels */
};

/* Types -------------------------------------------------------------------------------------------------- */

/* What a plan does next. Each call of a phase does one unit of its work and returns the phase that follows,
 * which may be the same.
 *
 * LOOK finds the links that work, AWAITED the ends that are awaited. Rounds follow. Their parts are ENFORCE,
 * ORIGINALS, REPAIR, SETTLE and AUTO, of which profile_plan.c leaves out those that are not planned.
 * ROUND_END begins another round until nothing changes. WRITE_DOWN writes to the configuration.
 *
 * ORIGINALS looks for a link that can come back. ORIGINALS_TAKE takes away what it replaces, ORIGINALS_LINK
 * links it, and ORIGINALS_JUDGE undoes both if that cost too much.
 *
 * REPAIR finds out how good a replacement each broken entry could get. REPAIR_CHOOSE takes the best of them.
 * If its input is missing, REPAIR_INPUT tries one that could stand in, and REPAIR_LINK sees whether it was
 * linked. REPAIR_NAME finds inputs that stand in without being known to. */
typedef enum {
    PROFILE_PHASE_LOOK, /* all zero is a plan that begins */
    PROFILE_PHASE_AWAITED,
    PROFILE_PHASE_ENFORCE,
    PROFILE_PHASE_ORIGINALS,
    PROFILE_PHASE_ORIGINALS_TAKE,
    PROFILE_PHASE_ORIGINALS_LINK,
    PROFILE_PHASE_ORIGINALS_JUDGE,
    PROFILE_PHASE_REPAIR,
    PROFILE_PHASE_REPAIR_CHOOSE,
    PROFILE_PHASE_REPAIR_INPUT,
    PROFILE_PHASE_REPAIR_LINK,
    PROFILE_PHASE_REPAIR_NAME,
    PROFILE_PHASE_SETTLE,
    PROFILE_PHASE_AUTO,
    PROFILE_PHASE_ROUND_END,
    PROFILE_PHASE_WRITE_DOWN,
    PROFILE_PHASE_DONE,
    PROFILE_PHASE_NEXT_PART /* only returned: this part of the round is over, the next one begins */
} profile_phase_t;

/* What a link needs, in the order in which it is connected: required inputs first. */
typedef enum {
    PROFILE_REQUIRED_BY_OUTPUT, /* inputs of the source's device that its output requires */
    PROFILE_REQUIRED_BY_INPUT,  /* inputs of the input's own device */
    PROFILE_DESIRED_BY_OUTPUT,
    PROFILE_DESIRED_BY_INPUT,
    PROFILE_NEEDS_END
} profile_need_t;

/* One input that is being connected. */
typedef struct {
    uint8_t input;
    uint8_t source; /* profile_source_t: where its next candidate comes from */
    uint8_t tried;  /* candidate of this source tried last, which the plan has now; PDCP_NONE: none yet */
    uint8_t mark;   /* its place in the log, once it is linked */
    uint8_t need;   /* profile_need_t being connected; PROFILE_NEEDS_END: a candidate must be chosen */
    uint8_t cursor; /* channel number of the need connected last, PDCP_NONE: none yet */
} profile_frame_t;

/* Small state stands first: a field far from the beginning costs more code on small parts. */
typedef struct {
    uint8_t phase;  /* profile_phase_t */
    uint8_t at;     /* entry or input that the phase is at; 0 again when it has seen all */
    uint8_t input;  /* input of the link that the phase is at */
    uint8_t output; /* output of that link */
    bool waits;     /* an end of the configuration is awaited */
    bool changed;   /* this pass over the inputs has changed something */
    uint8_t logged; /* inputs in the log */
    struct {
        bool running;        /* an input is being connected; the phase waits */
        uint8_t last_source; /* profile_source_t: the last one that may be asked for what a link needs */
        uint8_t depth;       /* frames below the top */
        profile_frame_t top; /* the input that is at hand */
    } connect;
    struct {
        uint16_t left; /* steps that the searches for the link at hand may take */
        uint8_t at;    /* channel that a search is at, 0: it begins */
        uint8_t best;  /* the best channel so far, PDCP_NONE: none yet */
    } search;
    struct {
        bool marking; /* links that lack something are being marked, and count as gone; the phase waits */
        bool spoilt;  /* the original at hand lacks something, or another one lost what it has */
        uint8_t at;   /* input that the marking is at */
    } settle;
    struct {
        uint8_t pass;   /* 0: all but terminal ones, 1: terminal ones */
        bool costs;     /* the original at hand replaces something */
        uint8_t source; /* output that its input heard before */
        uint8_t rival;  /* input that had its output before */
    } originals;
    struct {
        bool named; /* this round has found stand-ins that were not known as such */
    } repair;
    struct {
        uint32_t base;                      /* hash of the links that worked when the plan was begun */
        uint32_t before;                    /* hash of `want` when the round was begun */
        uint8_t what;                       /* profile_plan_what_t */
        uint8_t part;                       /* the part of the round that comes next */
        uint8_t rounds;                     /* number of rounds that are over */
        uint8_t ready[PROFILE_PLACE_BYTES]; /* bit per place: the device was set up when the plan was begun */
    } plan;
    int16_t left;   /* effort that this slice has left */
    uint32_t steps; /* channels compared in this plan */

    const profile_scene_t *scene; /* of the call under way */
    const pdcp_tables_t *tables;  /* the scene's */
    profile_links_t *links;       /* the scene's */

    uint8_t taken[PROFILE_CHANNEL_BYTES]; /* bit per output: it feeds a sole-access input */
    union {
        struct {
            uint8_t gone[PROFILE_CHANNEL_BYTES];    /* bit per input: its link lacks something */
            uint8_t lacking[PROFILE_CHANNEL_BYTES]; /* the same before the original came back */
        } marks;                                    /* in use while originals come back, and by ENFORCE */
        uint8_t repair_keys[PROFILE_LINKS_MAX];     /* of entries: how good their repair is, 0: none */
    } scratch;                                      /* one of the two is in use at a time */
    struct {
        uint8_t open[PROFILE_CHANNEL_BYTES];           /* bit per place in the log: a frame stands there */
        uint8_t packed_frames[PROFILE_PLAN_DEPTH / 2]; /* two in a byte */
    } below;                                           /* connect's frames below the top */

    uint8_t stand_in[PROFILE_LINKS_MAX]; /* of entries: the input that stands in, as planned so far */
    uint8_t want[PDCP_CHANNELS_MAX];     /* of inputs: the output that they shall hear, as planned so far */
    uint8_t log[PDCP_CHANNELS_MAX];      /* inputs connected, in order, for undoing */
} profile_board_t;

/* The scene ---------------------------------------------------------------------------------------------- */

static inline const pdcp_channel_t *profile_board_channel(const profile_board_t *board, uint8_t channel)
{
    return &board->tables->channels[channel];
}

static inline profile_entry_t *profile_board_entry(const profile_board_t *board, uint8_t number)
{
    return &board->links->entries[number];
}

/* The entry of an input; PDCP_NONE: it has none. */
uint8_t profile_board_entry_of(profile_board_t *board, uint8_t input);

/* Channel number of the output that an entry names; PDCP_NONE: it is missing. */
uint8_t profile_board_output_of(profile_board_t *board, uint8_t entry);

/* Looks up both ends of the entry that the phase is at: sets input and output. */
void profile_board_look_at_ends(profile_board_t *board);

/* The plan ----------------------------------------------------------------------------------------------- */

/* Does the plan give this input the output that an entry names? */
bool profile_board_hears_output_of(const profile_board_t *board, uint8_t input, uint8_t entry);

/* Another sole-access input that has the output, if this one is a sole-access input as well. PDCP_NONE: there
 * is none. */
uint8_t profile_board_rival_of(profile_board_t *board, uint8_t input, uint8_t output);

/* Gives an input another source, or takes its source away (PDCP_NONE). The input may be PDCP_NONE. */
void profile_board_set_source(profile_board_t *board, uint8_t input, uint8_t output);

/* May this output feed this input? They are of different devices and unbanned, and sole access is respected
 * [PROFILE listing 4.4]. Both must be set up. */
bool profile_board_may_link(const profile_board_t *board, uint8_t output, uint8_t input);

/* Does an input have a source, and is its link not marked as gone? */
bool profile_board_is_connected(const profile_board_t *board, uint8_t input);

/* The next unconnected input that the link of an input needs (profile_need_t), behind the last one
 * (PDCP_NONE: the first one); PDCP_NONE: there are no more. */
uint8_t profile_board_next_need(profile_board_t *board, uint8_t input, uint8_t need, uint8_t last);

/* Makes a link that can be undone. profile_board_undo_to undoes all links made since `logged` was mark. */
void profile_board_link(profile_board_t *board, uint8_t input, uint8_t output);
void profile_board_undo_to(profile_board_t *board, uint8_t mark);

/* Does this input stand in for a missing one? */
bool profile_board_stands_in(profile_board_t *board, uint8_t input);

/* Forgets stand-ins that no longer hear the output of their entry. */
void profile_board_forget_stand_ins(profile_board_t *board);

/* Phases ------------------------------------------------------------------------------------------------- */

/* Moves `at` to the next one of count entries or inputs, from the last one back to 0. */
void profile_board_go_to_next(profile_board_t *board, uint8_t count);

#endif
