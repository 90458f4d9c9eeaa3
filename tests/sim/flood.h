/* What floods and forged frames do to a limb, measured in virtual time: docs/floods.md.
 *
 * The limb is acceptance system 2 with all three links at 10 ms, saved, with the whole application as its
 * arbitrator. An attacker has a port of his own on the simulated bus. Nothing here reads the arbitrator's
 * tables: what it believes is asked as a host would ask it, what is true is seen on the bus and in the
 * devices. So the same file measures an old version of the arbitrator (tools/flood --at). */
#ifndef FLOOD_H
#define FLOOD_H

#include "limb.h"

enum {
    FLOOD_SENSOR,     /* output 1 */
    FLOOD_CONTROLLER, /* input 2 to outputs 3 and 5 */
    FLOOD_HAND,       /* terminal inputs 1 and 2 */
    FLOOD_KNOWN,      /* was bound and away for long; comes back while the attack lasts */
    FLOOD_NEW,        /* was never there; comes while the attack lasts */
    FLOOD_SPARE,      /* another sensor, for scripts */
    FLOOD_PARTS
};

enum {
    FLOOD_LINKS = 3,
    FLOOD_WINDOW_MS = 10000, /* how long an attack lasts, unless it says otherwise */
    FLOOD_WATCH_MS = 60000,  /* for how long the limb is watched afterwards */
    FLOOD_NEVER = -1
};

typedef struct flood flood_t;

/* Times in ms; FLOOD_NEVER: it did not happen while the limb was watched. */
typedef struct {
    int32_t gap_ms[FLOOD_LINKS]; /* longest time without a value of its source, while the attack lasted */
    int32_t foreign;   /* values that an input took from another part than the source that it names */
    int32_t forged;    /* values that an input took from the attacker */
    int32_t stale_ms;  /* longest time in which an input of the hand stood at an old value, not a safe one */
    int32_t whole_ms;  /* from the last frame until the limb is whole for good; 0: it never was not */
    int32_t untrue_ms; /* longest time in which a link was listed as active and nothing came */
    int32_t pages;     /* written to the memory in 100 s, at the pace of the attack */
    int32_t refusals;  /* bind requests that were answered with id 0 */
    int32_t known_ms;  /* from its power-on until it was bound */
    int32_t new_ms;    /* likewise */
} flood_result_t;

/* What may be measured at most; a limit of FLOOD_NEVER allows everything, FLOOD_NEVER itself included. */
typedef struct {
    int32_t gap_ms; /* of the worst link */
    int32_t foreign;
    int32_t forged;
    int32_t whole_ms;
    int32_t untrue_ms;
    int32_t pages;
    int32_t known_ms;
    int32_t new_ms;
} flood_limits_t;

typedef struct {
    const char *name;
    const char *what;
    bool (*make)(flood_t *flood, can_frame_t *frame); /* the next frame; false: none now. NULL: no frames */
    uint32_t interval_us;                             /* between two frames; 0: as many as the bus takes */
    uint32_t count;                              /* of frames in all; 0: as many as come in duration_ms */
    uint32_t duration_ms;                        /* 0: FLOOD_WINDOW_MS */
    uint32_t first_ms;                           /* of the first frame */
    bool at_power_up;                            /* arbitrator and parts are switched on when it begins */
    bool alone;                                  /* FLOOD_KNOWN and FLOOD_NEW do not come */
    void (*script)(flood_t *flood, uint32_t ms); /* called every millisecond of the attack; may be NULL */
    flood_limits_t limits;                       /* what must hold */
    const char *awaits; /* what has to be built before it holds; NULL: it holds now */
} flood_row_t;

struct flood {
    limb_t limb;
    const flood_row_t *row;
    flood_result_t result;
    uint32_t random; /* state, not 0 */
    uint32_t turn;   /* frames made so far */
    /* The attacker. */
    int port;
    uint64_t next_us;
    uint64_t begin_us;
    uint64_t last_us; /* of the last frame, or of what a script did last */
    /* The frame on the wire, as seen while it was there. */
    uint64_t wire_end_us;
    int wire_port;
    /* Values. */
    uint64_t right_us[FLOOD_LINKS]; /* the last from its source */
    bool counting;
    uint32_t taken[FLOOD_PARTS];        /* frames that at least one input took */
    uint32_t taken_before[FLOOD_PARTS]; /* by the device's own count */
    /* The host. */
    bool listed[FLOOD_LINKS]; /* as active, by the last answer */
    uint64_t listed_us[FLOOD_LINKS];
    uint64_t unwhole_us; /* when the limb was seen not to be whole last */
    bool whole;
    bool loose; /* the sensor's plug: its power is on, its port is not on the bus */
};

/* All of them, in the order of the table. */
extern const flood_row_t flood_rows[];
extern const int flood_row_count;

void flood_measure(flood_t *flood, const flood_row_t *row);

/* What is worse than its limit, as text; "": nothing. */
void flood_judge(const flood_row_t *row, const flood_result_t *result, char *text, size_t size);

/* --- For rows --- */

uint32_t flood_random(flood_t *flood, uint32_t below);

/* Node id of a part, and of one of its outputs, as they are now. */
uint8_t flood_node_id(const flood_t *flood, int part);
uint8_t flood_output_id(const flood_t *flood, int part, uint8_t index);

/* Pulls the sensor's plug halfway: it goes on running, and neither hears nor is heard. */
void flood_loosen(flood_t *flood);
void flood_fasten(flood_t *flood);

/* What a script did counts as the last frame of the attack. */
void flood_note_act(flood_t *flood);

#endif
