/* The life that test_life.c lives, and what happens in it (life_events.c). */
#ifndef LIFE_RUN_H
#define LIFE_RUN_H

#include "life.h"

enum {
    LIFE_CLONES = 2, /* of the first parts */
    LIFE_ALL_MAX = 8 + LIFE_CLONES,
    LIFE_REFUSED = 240 /* [parameter] of each part that stands for what it refuses */
};

typedef struct {
    limb_t limb; /* the first: the port's ctx */
    life_host_t host;
    life_memory_t memory;
    life_counters_t counters;
    life_watch_t watch;
    life_forger_t forger;
    life_random_t random;
    uint32_t seed;
    uint32_t ms;         /* of this life */
    uint32_t busy_until; /* of the host: it asks a lot */
    /* Until when it lasts; below ms: it does not. */
    uint32_t off_until;     /* the arbitrator has no power */
    uint32_t black_until;   /* nothing passes the line, and its controller is off the bus */
    uint32_t bad_until;     /* frames are lost */
    uint32_t foreign_until; /* another arbitrator beacons */
    uint32_t deaf_until;    /* the host does not read */
    uint32_t gone_until;    /* the host has closed */
    uint32_t worn_until;    /* the memory fails or is slow */
    uint32_t mute_until[LIFE_ALL_MAX];
    uint32_t refuse_until[LIFE_ALL_MAX];
    uint32_t loose_until[LIFE_ALL_MAX];
    int parts; /* those after them are clones */
    uint32_t loss_percent;
    uint32_t lose_in;       /* frames, until one is lost; 0: none will be */
    uint32_t lose_again_ms; /* not before */
    int foreign_port;
    bool is_off; /* the bus, for the arbitrator's controller */
    bool watching;
    uint32_t strange_frames;
    uint64_t frames;
} life_t;

extern life_t life;

/* --- test_life.c --- */

/* A number below this, at random. */
uint32_t life_below(uint32_t below);

/* What lasts until then still does. */
bool life_is_during(uint32_t until);

/* The arbitrator has no power for so long. */
void life_stop_arbitrator(uint32_t for_ms);

/* --- life_events.c --- */

/* Something happens, at random. */
void life_event(void);

/* A last word of those who forge: nothing else that happens mends what it does. */
void life_forge_at_last(void);

/* Refusals whose time is over end. */
void life_end_refusals(void);

/* A part has power. The plug of a part has contact again. */
bool life_is_plugged(int part);
void life_mend_plug(int part);

#endif
