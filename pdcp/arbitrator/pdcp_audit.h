/* Audit (D-BUS-40): do the devices still have what the tables say?
 *
 * A frame of somebody else, or a device that forgets, may stop all data while the tables call a link active.
 * So while nothing else is to be done, one parameter of one channel is read every PDCP_AUDIT_MS, in turn: of
 * outputs that feed a link transfer enabled (4) and node id (5), of inputs with an active link transfer
 * enabled and their source's node ids (7), of inputs what they name as their source (5, 6), where the profile
 * layer plans the links: a later arbitrator reads that back. Each fourth question is for transfer enabled of
 * a channel without a link.
 *
 * What differs is counted, told (PDCP_EVENT_AUDIT) and repaired: a link is written again (pdcp_link_write), a
 * channel without one is silenced. After three repairs of one link within a minute it becomes inactive when
 * it differs again; what an input names as its source is then only told. Silence and refusal are no
 * differences. */
#ifndef PDCP_AUDIT_H
#define PDCP_AUDIT_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bits.h"
#include "pdcp_limits.h"
#include "pdcp_request.h"
#include "pdcp_spec.h"

struct pdcp_bus;

enum {
    PDCP_AUDIT_MS = 60,    /* between two questions */
    PDCP_AUDIT_REPAIRS = 3 /* of one link within a minute */
};

/* What may be asked of a channel, what data depend on first. */
typedef enum {
    PDCP_AUDIT_ENABLED, /* 4 */
    PDCP_AUDIT_NODES,   /* an input's 7, an output's 5 */
    PDCP_AUDIT_SOURCE,  /* an input's 5 */
    PDCP_AUDIT_SERIAL,  /* an input's 6 */
    PDCP_AUDIT_KINDS
} pdcp_audit_kind_t;

/* The walks over all channels: one kind of question for every channel, then the next kind. */
typedef enum {
    PDCP_AUDIT_TURN,  /* all that is linked */
    PDCP_AUDIT_HURRY, /* the device that goes first: its channels without a link, too */
    PDCP_AUDIT_SPARE, /* channels without a link */
    PDCP_AUDIT_WALKS
} pdcp_audit_walk_t;

/* Differences found in the minute under way. */
typedef struct {
    uint8_t channel; /* number; an output's are counted with the first input that it feeds */
    bool source;     /* of an input's 5 and 6; else of 4, 7 and an output's 5 */
    uint8_t times;   /* 0: this entry is free, and so are those behind it */
} pdcp_audit_found_t;

typedef struct {
    bool on;             /* it was begun */
    bool asleep;         /* no device is ready: the timer does not run */
    uint8_t count;       /* of questions */
    uint8_t asked;       /* channel number of the question under way; PDCP_NONE: its answer is not compared */
    uint8_t asked_kind;  /* pdcp_audit_kind_t of the question */
    uint8_t asked_place; /* of the device that was asked last */
    uint8_t first;       /* place of the device that goes first, or did last */
    uint16_t window;     /* what is left of the minute under way, in PDCP_AUDIT_MS; 0: none is */
    uint16_t at[PDCP_AUDIT_WALKS]; /* where each walk is: kind * PDCP_CHANNELS_MAX + channel number */
    pdcp_audit_found_t found[PDCP_AUDIT_FOUND_MAX];
    uint8_t hurried[PDCP_BIT_BYTES(PDCP_DEVICES_MAX)];                    /* set of places: to go first */
    uint8_t refused[PDCP_AUDIT_KINDS][PDCP_BIT_BYTES(PDCP_CHANNELS_MAX)]; /* sets of channels, by kind */
} pdcp_audit_t;

/* Nothing is known of the bus. What was begun goes on. */
void pdcp_audit_init(struct pdcp_bus *bus);

/* Begins to ask. */
void pdcp_audit_begin(struct pdcp_bus *bus);

/* A device is set up: it is asked again what it has refused. */
void pdcp_audit_on_ready(struct pdcp_bus *bus, uint8_t node);

/* Somebody else has spoken to the device with this node id in the name of an arbitrator: it goes first. */
void pdcp_audit_on_foreign(struct pdcp_bus *bus, uint8_t node_id);

/* A link changes, or is about to: the answer to the question under way is not compared. */
void pdcp_audit_on_change(struct pdcp_bus *bus);

/* PDCP_TIMER_AUDIT is due; calm: nothing else is to be done, so a question may be asked. */
void pdcp_audit_on_deadline(struct pdcp_bus *bus, bool calm);

/* A reply to a question. Silence is no evidence (D-BUS-59). */
void pdcp_audit_on_reply(struct pdcp_bus *bus, const pdcp_reply_t *reply);

#endif
