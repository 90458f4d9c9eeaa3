/* Tables of the bus: the devices, their channels, and the owner of each node id.
 *
 * A device has a place (0 to PDCP_DEVICES_MAX - 1) from its binding until it is forgotten. Its channels form
 * a list in one pool, ordered by channel index. PDCP_NONE stands for no place and no channel. Looking up a
 * node id costs one read. Plain data: nothing here knows frames or time. */
#ifndef PDCP_TABLES_H
#define PDCP_TABLES_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_identity.h"
#include "pdcp_parts.h"
#include "pdcp_spec.h"

#define PDCP_NONE 0xFFu

/* States of a place, and what leads from one to the next:
 *
 *   FREE     a bind request is granted ................... SETUP
 *            a bind request is held (D-BUS-42) ........... ASKED
 *   ASKED    it is granted ............................... SETUP
 *            another arbitrator answers it ............... FREE
 *   SETUP    all is read and written ..................... READY
 *            a step fails for the fifth time ............. FAILED
 *            an unknown identity is not heard (D-BUS-43) . FREE
 *   FAILED   5 s are over ................................ SETUP
 *   LOST     it binds again, or beacons on its id ........ SETUP
 *            10 s are over ............................... FREE
 *   SETUP, READY, FAILED
 *            silent for three beacons, or reset .......... LOST
 *            its identity binds again .................... SETUP */
typedef enum {
    PDCP_PLACE_FREE = 0,
    PDCP_PLACE_SETUP,  /* bound, being read and written */
    PDCP_PLACE_READY,  /* set up: its channels count */
    PDCP_PLACE_FAILED, /* bound, but its setup failed: no channels, no links */
    PDCP_PLACE_LOST,   /* silent for too long: ids and links are kept for it */
    PDCP_PLACE_ASKED   /* its bind request is held (D-BUS-42): neither node id nor channels yet */
} pdcp_place_state_t;

typedef struct {
    pdcp_identity_t identity;
    uint16_t type;
    uint16_t profile;
    uint16_t beacon_ms;   /* its beacon interval */
    uint16_t ack_ms;      /* its acknowledgement time */
    uint32_t heard_ms;    /* last frame from it */
    uint16_t needs_at;    /* its block in the pool of needs */
    uint8_t needs_stride; /* bytes of one set: (inputs + 7) / 8; 0: it has no block */
    uint8_t place;        /* its own number in the table */
    uint8_t state;        /* pdcp_place_state_t */
    uint8_t node_id;
    uint8_t channel_count;
    uint8_t first_channel; /* number in the pool, PDCP_NONE: has none */
    bool beaconed;         /* counts for the host (D-BUS-6) */
    bool taken_back;       /* it beaconed while lost; its identity has not been read yet (D-BUS-15) */
    bool reset_asked;      /* Reset Device is to be sent, or is under way */
    bool asked_again;      /* its identity asked to bind while it is bound (D-BUS-6) */
    uint8_t asked_id;      /* with this id; also of a request that is held */
    bool setup_again;      /* its setup failed before: the next failure is not told (D-BUS-17) */
    uint8_t setup_pass;    /* pdcp_setup.c */
    uint8_t setup_step;
    uint8_t setup_channel;
    uint8_t setup_attempts;
    pdcp_request_t request;
} pdcp_device_entry_t;

typedef enum {
    PDCP_LINK_NONE = 0,
    PDCP_LINK_INACTIVE = 1, /* one end missing, or not yet written (D-BUS-10) */
    PDCP_LINK_ACTIVE = 2    /* its last write is answered */
} pdcp_link_status_t;

/* What still has to be written to a channel: a set of these bits. pdcp_link.c carries it out, the lowest bit
 * first. */
typedef enum {
    PDCP_TODO_NONE = 0,
    PDCP_TODO_SILENCE = 1, /* input: its source is lost, not enabled, no node ids (D-BUS-14); output: not
                              enabled, nobody listens */
    PDCP_TODO_REMOVE = 2,  /* input: back to unconnected */
    PDCP_TODO_CONNECT = 4, /* input: make the link to the source that it has */
    PDCP_TODO_UPDATE = 8,  /* input: its device has sent Update Data Channel */
    PDCP_TODO_WRITE = 16,  /* input: write what the tables say: its source, of an active link all of it */
    PDCP_TODO_AGAIN = 32   /* silence it once more: the last try was not answered; all else comes first */
} pdcp_todo_t;

typedef struct {
    uint16_t type;
    uint16_t profile;
    uint8_t place;    /* place of the owner; PDCP_NONE: this entry of the pool is free */
    uint8_t index;    /* channel index, 1 to n */
    uint8_t next;     /* the owner's next channel, PDCP_NONE: the last */
    uint8_t transfer; /* PDCP_INPUT, PDCP_OUTPUT, 0: not known yet */
    uint8_t node_id;  /* outputs: their own; inputs: the output's that parameter 7 may name; 0 = none */
    bool enabled;     /* transfer may be enabled: 1 was written, and no 0 has been answered since */
    uint8_t todo;     /* a set of pdcp_todo_t */
    /* Inputs only: */
    uint8_t link; /* pdcp_link_status_t */
    pdcp_source_t source;
    uint16_t terminal_profile;
} pdcp_channel_t;

typedef struct {
    uint16_t needs_used;
    pdcp_channel_t channels[PDCP_CHANNELS_MAX];
    pdcp_device_entry_t devices[PDCP_DEVICES_MAX];
    uint8_t
        owner[256]; /* node id: 0 free; place + 1: the device's own; 80h + place + 1: of one of its outputs */
    uint8_t needs[PDCP_NEEDS_BYTES];
} pdcp_tables_t;

void pdcp_tables_init(pdcp_tables_t *tables);

/* Place of the device with this identity, in any state but FREE. PDCP_NONE: there is none. */
uint8_t pdcp_tables_find(const pdcp_tables_t *tables, const pdcp_identity_t *identity);

/* A free place. PDCP_NONE: there is none. */
uint8_t pdcp_tables_free_place(const pdcp_tables_t *tables);

/* Puts a device with this node id into a place. Both must be free. */
void pdcp_tables_add(pdcp_tables_t *tables, uint8_t place, const pdcp_identity_t *identity, uint8_t node_id);

/* Puts a device whose bind request is held into a place, which must be free. */
void pdcp_tables_hold(pdcp_tables_t *tables, uint8_t place, const pdcp_identity_t *identity);

/* Is there a bound device at this place, and not lost? place: any number. */
bool pdcp_tables_is_bound(const pdcp_tables_t *tables, uint8_t place);

/* Number of places in this state. */
uint8_t pdcp_tables_count_state(const pdcp_tables_t *tables, pdcp_place_state_t state);

/* Forgets a device: its place, node ids, channels and needs. Inputs that it fed keep the name of their
 * source, but hear nothing. */
void pdcp_tables_remove(pdcp_tables_t *tables, uint8_t place);

/* Gives a device exactly count channels, indices 1 to count, and keeps those that it has. False: the pool is
 * too small, and nothing has changed. */
bool pdcp_tables_set_channels(pdcp_tables_t *tables, uint8_t place, uint8_t count);

/* Channel number of a device's channel index; PDCP_NONE: it has no such channel. */
uint8_t pdcp_tables_channel(const pdcp_tables_t *tables, uint8_t place, uint8_t index);

/* Makes an input unconnected (D-BUS-7). */
void pdcp_tables_clear_source(pdcp_channel_t *input);

/* Takes parameter 5, 6 or 8 of an input, as two numbers of 16 bits: a part of its source's name. */
void pdcp_tables_take_source(pdcp_channel_t *input, uint8_t param, uint16_t low, uint16_t high);

/* Does this channel index name a source? An unconnected input has FFh (D-BUS-7). */
static inline bool pdcp_tables_is_named(uint8_t index)
{
    return index != PDCP_NO_SOURCE_INDEX && index != 0;
}

/* Does such a parameter say what the tables say? */
bool pdcp_tables_is_source(const pdcp_channel_t *input, uint8_t param, uint16_t low, uint16_t high);

/* Makes room for the needs of a device's channels, all bits 0, once their directions are known. False: there
 * is no room, and the device has no needs. */
bool pdcp_tables_make_needs(pdcp_tables_t *tables, uint8_t place);

/* Stores a piece of a channel's bit string of required or desired channels: len bytes from byte offset on,
 * which is below PDCP_PARAMETER_MAX. Bit 7 of byte 0 is channel index 0 (D-BUS-8). Bits of channels that are
 * no inputs of the device are dropped (D-BUS-13). */
void pdcp_tables_put_needs(pdcp_tables_t *tables, uint8_t channel, bool desired, uint16_t offset,
                           const uint8_t *bytes, uint16_t len);

/* Does the channel require (or desire) the input of its own device with this index? The device must have room
 * for needs. */
bool pdcp_tables_needs(const pdcp_tables_t *tables, uint8_t channel, bool desired, uint8_t index);

/* Unlinks a channel from all inputs that it feeds: it is gone, or it is not an output any more. */
void pdcp_tables_drop_source(pdcp_tables_t *tables, uint8_t channel);

/* May an input still listen to this node id? It may until it has answered a 0 in parameter 7 or in transfer
 * enabled (D-BUS-36). */
bool pdcp_tables_may_hear(const pdcp_tables_t *tables, uint8_t node_id);

/* Channel number of a device's output with this node id. PDCP_NONE: there is none. */
uint8_t pdcp_tables_output(const pdcp_tables_t *tables, uint8_t place, uint8_t node_id);

/* The input that keeps this one from the output because both want sole access (D-API-13). PDCP_NONE: there is
 * none. Output and input must be of different devices. An inactive link counts, since it comes back, but less
 * than an active one; so does the link that the input itself has to this output. */
uint8_t pdcp_tables_rival(const pdcp_tables_t *tables, uint8_t output, uint8_t input);

/* Gives an output this node id, which must be free, and takes its old one away. 0: only takes it away. */
void pdcp_tables_set_output_id(pdcp_tables_t *tables, pdcp_channel_t *output, uint8_t node_id);

/* Finds the owner of a node id. *place: the owner's place, PDCP_NONE: the id has no owner. True: the id is
 * the device's own. False: it is that of one of its outputs. */
static inline bool pdcp_tables_owner(const pdcp_tables_t *tables, uint8_t node_id, uint8_t *place)
{
    const uint8_t owner = tables->owner[node_id];
    *place = (uint8_t)((owner & 0x7Fu) - 1u);
    return (owner & 0x80u) == 0;
}

/* What the host sees: a device from its first beacon until it is lost, its channels once it is set up
 * (D-API-6). A link is named by its input's channel number. */
enum {
    PDCP_COUNTS_LINK = 0,
    PDCP_COUNTS_INPUT = PDCP_INPUT,
    PDCP_COUNTS_OUTPUT = PDCP_OUTPUT,
    PDCP_COUNTS_DEVICE
};

/* The number-th (from 1) of what the host sees, PDCP_NONE: there are fewer; and how many there are. Ordered
 * by place, then by channel index. */
uint8_t pdcp_tables_nth(const pdcp_tables_t *tables, uint8_t kind, uint8_t number);
uint8_t pdcp_tables_count(const pdcp_tables_t *tables, uint8_t kind);

static inline uint8_t pdcp_tables_nth_device(const pdcp_tables_t *tables, uint8_t number)
{
    return pdcp_tables_nth(tables, PDCP_COUNTS_DEVICE, number);
}

static inline uint8_t pdcp_tables_nth_channel(const pdcp_tables_t *tables, uint8_t transfer, uint8_t number)
{
    return pdcp_tables_nth(tables, transfer, number);
}

static inline uint8_t pdcp_tables_nth_link(const pdcp_tables_t *tables, uint8_t number)
{
    return pdcp_tables_nth(tables, PDCP_COUNTS_LINK, number);
}

static inline uint8_t pdcp_tables_count_devices(const pdcp_tables_t *tables)
{
    return pdcp_tables_count(tables, PDCP_COUNTS_DEVICE);
}

static inline uint8_t pdcp_tables_count_channels(const pdcp_tables_t *tables, uint8_t transfer)
{
    return pdcp_tables_count(tables, transfer);
}

static inline uint8_t pdcp_tables_count_links(const pdcp_tables_t *tables)
{
    return pdcp_tables_count(tables, PDCP_COUNTS_LINK);
}

#endif
