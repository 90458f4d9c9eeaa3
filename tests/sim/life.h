/* Random lives of a whole limb in virtual time, for test_life.c: what its parts share. One seed is one life.
 */
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

/* --- The host: asks at random, and checks what it is answered (life_host.c) --- */

enum { LIFE_OPEN_MAX = 16, LIFE_STRING_MAX = 8192, LIFE_PIECE_MAX = 512, LIFE_BYTES_MAX = 16384 };

/* A request without an answer. */
typedef struct {
    uint16_t id;
    uint16_t len; /* of the payload */
    uint8_t reference;
    uint8_t mask;      /* 2416h */
    bool wrong_size;   /* must fail with 01h */
    bool last_piece;   /* 240Dh: with it the string is complete */
    uint32_t end_byte; /* of all that was ever sent: it is out when so many are taken */
} life_request_t;

typedef struct {
    life_random_t random;
    uint8_t out[LIFE_BYTES_MAX]; /* not taken by the arbitrator yet */
    uint32_t out_len;
    uint32_t put_bytes; /* ever */
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
    bool stale;   /* what comes may belong to the host before */
    uint8_t mask; /* event stream, confirmed */
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

/* Is this a frame that a calm bus carries: a beacon, or data of an output that is linked? */
bool life_check_is_calm_frame(const limb_t *limb, const can_frame_t *frame);

#endif
