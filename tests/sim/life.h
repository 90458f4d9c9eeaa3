/* Random lives of a whole limb in virtual time, for test_life.c: what its parts share. One seed is one
 * life. */
#ifndef LIFE_H
#define LIFE_H

#include "limb.h"

/* --- Chance --- */

typedef struct {
    uint32_t state; /* not 0 */
} life_random_t;

static inline uint32_t life_random(life_random_t *random, uint32_t below)
{
    random->state ^= random->state << 13;
    random->state ^= random->state >> 17;
    random->state ^= random->state << 5;
    return (random->state >> 8) % below;
}

static inline bool life_chance(life_random_t *random, uint32_t percent)
{
    return life_random(random, 100) < percent;
}

/* --- What is looked for and what happens, one by one (life_switches.c) --- */

enum {
    LIFE_VALUES,
    LIFE_FLAGS,
    LIFE_TWINS,
    LIFE_CLONES_COME,
    LIFE_LOOSE_PLUGS,
    LIFE_LOST_FRAMES,
    LIFE_RESTARTS,
    LIFE_FORGED_FLAGS, /* and what follows: somebody else's frames */
    LIFE_FORGED_SOURCES,
    LIFE_FORGED_SUSPENDS,
    LIFE_FORGED_RESETS,
    LIFE_UNKNOWN_BEACONS,
    LIFE_FOREIGN_BEACONS,
    LIFE_SWITCHES
};

/* Switches on what is listed, NAME,NAME, and the rest off: "held" is all that lives hold with, "all" is all.
 * With nothing on, a life is what it was before there were switches, seed by seed. */
void life_switch_on(const char *list);
bool life_is_on(int number);

/* --- The host: asks at random, and checks what it is answered (life_host.c) --- */

enum { LIFE_OPEN_MAX = 16, LIFE_STRING_MAX = 8192, LIFE_PIECE_MAX = 512, LIFE_BYTES_MAX = 16384 };

/* A request without an answer. */
typedef struct {
    uint16_t id;
    uint16_t len; /* of the payload */
    uint8_t reference;
    uint16_t mask;     /* 2416h */
    bool wrong_size;   /* must fail with 01h */
    bool last_piece;   /* 240Dh: with it the string is complete */
    bool may_be_lost;  /* stands right behind garbage, which may have taken its first bytes as its own end */
    uint32_t end_byte; /* of all that was ever sent: it is out when so many are taken */
} life_request_t;

typedef struct {
    life_random_t random;
    uint8_t out[LIFE_BYTES_MAX]; /* not taken by the arbitrator yet */
    uint32_t out_len;
    uint32_t put_bytes;   /* ever */
    uint32_t garbage_end; /* what put_bytes was behind the last garbage */
    uint32_t taken_bytes;
    uint8_t in[LIFE_BYTES_MAX]; /* not understood yet */
    uint32_t in_len;
    life_request_t open[LIFE_OPEN_MAX];
    int open_count;
    uint32_t front_byte; /* end of the first of them, */
    uint32_t front_ms;   /* and since when it is due */
    uint32_t babbled_ms;
    uint32_t room; /* bytes that the line takes now */
    bool reads;
    bool is_open;
    bool stale;    /* what comes may belong to the host before */
    uint16_t mask; /* event stream, confirmed */
    uint8_t reference;
    /* The string of configurations that is being written in pieces. */
    uint8_t string[LIFE_STRING_MAX];
    uint16_t string_len;
    uint16_t string_at;
    bool string_good;
    uint8_t before[LIFE_STRING_MAX]; /* that of the host before */
    uint16_t before_len;
    /* What came of it all. */
    uint32_t asked;
    uint32_t answered;
    uint32_t failed;
    uint32_t events;
    uint32_t longest_ms;
} life_host_t;

void life_host_init(life_host_t *host, uint32_t seed);

/* The port's host_write. */
size_t life_host_write(life_host_t *host, const uint8_t *bytes, size_t size);

/* One random request: valid, of any message, now and then with a wrong size. */
void life_host_ask(life_host_t *host, const limb_t *limb);

/* Something that is no request: bytes without a header, or the beginning of a request. */
void life_host_babble(life_host_t *host, const limb_t *limb, uint32_t now_ms);

void life_host_close(life_host_t *host, limb_t *limb);
void life_host_open(life_host_t *host);

/* The arbitrator has lost its power, and with it whatever it was asked. */
void life_host_forget(life_host_t *host);

/* Every millisecond: hands bytes over, understands what has come, and is strict about it. */
void life_host_step(life_host_t *host, limb_t *limb, uint32_t now_ms);

/* --- The memory: what is stored is always good, and what somebody has written (life_memory.c) --- */

typedef struct {
    arb_port_t port; /* of the simulated memory */
    sim_nvm_t *nvm;
    const life_host_t *host;
    uint8_t string[LIFE_STRING_MAX]; /* the newest good copy, found without the arbitrator's code */
    uint16_t len;                    /* 0: there is none */
    uint32_t changes;
    bool unsure; /* reads have failed: what was written and could not be read back is not there for the
                    arbitrator */
} life_memory_t;

/* Puts itself between the limb and its memory. */
void life_memory_init(life_memory_t *memory, limb_t *limb, const life_host_t *host);

/* The arbitrator starts, with a memory that can be read. */
void life_memory_start(life_memory_t *memory);

/* How many configurations the newest good copy holds. */
int life_memory_count(const life_memory_t *memory);

/* Is this a string that a reader must take, by profile-layer.md 5? */
bool life_memory_is_good(const uint8_t *string, uint16_t len);

/* --- What must be true at any time (life_watch.c) --- */

/* An audit's turn (D-BUS-40): what tables and devices do not agree about is mended within it. */
enum { LIFE_AUDIT_MS = 40000 };

enum { LIFE_PARTS_MAX = 12, LIFE_CHANNELS_MAX = 8, LIFE_RECENT = 4 };

/* A source that an input had. */
typedef struct {
    uint16_t key; /* part and channel */
    uint32_t until_ms;
} life_source_t;

typedef struct {
    /* What is looked for. */
    bool values; /* an input takes values of a part that is not, and was not just now, its source */
    bool flags;  /* transfer enabled differs between tables and device for longer than LIFE_AUDIT_MS */
    bool twins;  /* two devices, or enabled outputs, have one id */
    /* The rest is its own. */
    const limb_t *limb;
    uint32_t now_ms; /* of the life */
    uint32_t taken;  /* values judged */
    uint32_t all_rough_ms;
    uint32_t rough_ms[LIFE_PARTS_MAX];
    bool cut[LIFE_PARTS_MAX];                                  /* set by the life: its plug is loose */
    bool suspended[LIFE_PARTS_MAX];                            /* by the host */
    bool ready[LIFE_PARTS_MAX];                                /* in the tables */
    uint32_t forged_ms[LIFE_PARTS_MAX][LIFE_CHANNELS_MAX + 1]; /* set by the life: somebody has forged its
                                                                  source, which excuses it until then */
    uint16_t named[LIFE_PARTS_MAX][LIFE_CHANNELS_MAX + 1];     /* sources in the tables */
    life_source_t recent[LIFE_PARTS_MAX][LIFE_CHANNELS_MAX + 1][LIFE_RECENT];
    uint32_t differs_ms[LIFE_PARTS_MAX][LIFE_CHANNELS_MAX + 1]; /* since when a flag does */
    uint32_t twins_ms[256];                                     /* since when an id is two parts' */
    uint32_t twins_seen_ms[256];
    uint32_t requests[LIFE_PARTS_MAX]; /* to bind, that a part has sent */
    uint32_t bound_ms[LIFE_PARTS_MAX]; /* since when it is bound */
    bool twins_pass[256];              /* nobody could have known */
    bool met[LIFE_PARTS_MAX];          /* a part has had its id together with its clone */
} life_watch_t;

/* The limb has all its parts. From now on the watch is told of the values that they take. */
void life_watch_init(life_watch_t *watch, limb_t *limb);

/* A frame is about to be delivered. */
void life_watch_frame(life_watch_t *watch, const can_frame_t *frame);

/* Every millisecond. */
void life_watch_ms(life_watch_t *watch, uint32_t now_ms);

/* Until then a part (-1: all of them) may not hear or not answer: what it is to be told takes longer. */
void life_watch_rough(life_watch_t *watch, int part, uint32_t until_ms);

/* All that ends now. */
void life_watch_calm_down(life_watch_t *watch, uint32_t now_ms);

/* When all has been calm: nobody is suspended but by the host. */
void life_watch_calm(const life_watch_t *watch);

/* --- Frames of somebody else, most of them in the arbitrator's name (life_forge.c) --- */

typedef struct {
    limb_t *limb;
    life_random_t *random;
    life_watch_t *watch; /* is told what it must not expect */
    int port;            /* of the bus */
} life_forger_t;

/* Each to a random part, if it is plugged in. */
void life_forge_flag(life_forger_t *forger);                    /* transfer enabled = 0 */
void life_forge_source(life_forger_t *forger, uint32_t now_ms); /* parameter 7 */
void life_forge_suspend(life_forger_t *forger);
void life_forge_reset(life_forger_t *forger);

/* Beacons: of a device that nobody knows, and of another arbitrator. */
void life_forge_unknown(life_forger_t *forger);
void life_forge_arbitrator(life_forger_t *forger);

/* --- Invariants (life_check.c) --- */

typedef struct {
    uint32_t bus[PDCP_STAT_COUNT];
    uint32_t others[16];
    uint32_t spins; /* milliseconds in a row in which the arbitrator wanted to be called at once */
} life_counters_t;

/* After each millisecond: counters never go down, the arbitrator does not run in circles. */
void life_check_counters(life_counters_t *counters, const arb_app_t *app, uint32_t now_ms);

/* After each millisecond: no channel goes on hearing or sending without a link, unless something is pending
 * or under way that ends it (D-BUS-14, D-BUS-22). */
void life_check_silences(const limb_t *limb);

/* When all has been calm: tables and devices agree, and nothing is under way. */
void life_check_calm(const limb_t *limb);

/* Is this a frame that a calm bus carries: a beacon, data of an output that is linked, or a question of the
 * audit and its answer? */
bool life_check_is_calm_frame(const limb_t *limb, const can_frame_t *frame);

#endif
