/* Links (pdcp-bus.md 7 and 8): one output feeds many inputs, an input has one source.
 *
 * The tables say how things should be (link, feed, todo); this file writes them to the devices, one job at a
 * time: make a link, remove one, silence an input whose source is lost or an output that nobody listens to,
 * resolve an Update Data Channel, write again what a device should have already. A link that cannot be made
 * is undone, in reverse. Its status is active only when its last write is answered. */
#ifndef PDCP_LINK_H
#define PDCP_LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_request.h"
#include "pdcp_spec.h"

struct pdcp_bus;
struct pdcp_channel;

typedef struct {
    bool planned;    /* the profile layer decides which links are made: none comes by itself */
    bool stored;     /* and from a stored configuration: Update Data Channel changes no table */
    bool due;        /* some channel has something to do */
    bool closed;     /* the arbitrator has just started: no output is enabled (D-BUS-36) */
    bool active;     /* a job is under way */
    bool undoing;    /* steps run backwards */
    bool once;       /* the device that failed is tried once only */
    bool for_host;   /* the host waits for the outcome */
    bool for_device; /* the input's device waits for the answer to its Update Data Channel */
    bool differs;    /* what it names as its source is not what the tables say */
    uint8_t at;      /* place of the device whose answer the job waits for; PDCP_NONE: of none, the job goes
                        on when the device it is about has no other request under way */
    uint8_t kind;    /* pdcp_todo_t of the job; PDCP_TODO_AGAIN: whatever comes interrupts it */
    uint8_t step;    /* pdcp_link.c */
    uint8_t input;   /* channel number; PDCP_NONE: gone, or the job has none */
    uint8_t output;  /* channel number; PDCP_NONE: gone, or the job has none */
    bool output_was_on; /* before the job */
    int8_t status;      /* outcome so far, pdcp_status_t */
    /* The link that the host or the planner has asked for; wish_input PDCP_NONE: none. */
    uint8_t wish_input;
    uint8_t wish_output;
    bool wish_sole; /* not if another input keeps it from the output */
    /* The input's source before the job, to be restored when it fails. */
    uint8_t old_index;
    uint8_t old_link;
    uint8_t old_feed;
    pdcp_identity_t old_source;
    uint16_t old_type;
    uint16_t old_profile;
} pdcp_link_t;

/* Nothing is under way; planned stays as it is. */
void pdcp_link_init(struct pdcp_bus *bus);

/* Is there neither a job nor anything to do, but to silence again what does not answer? */
bool pdcp_link_is_settled(const struct pdcp_bus *bus);

/* Is a link being made, or to be made as soon as something else is done? */
bool pdcp_link_is_making(const struct pdcp_bus *bus);

/* Lets an active link rest: both ends disabled, source remembered (D-PRO-9). status: why, for
 * PDCP_EVENT_LINK. */
void pdcp_link_rest(struct pdcp_bus *bus, uint8_t input, pdcp_status_t status);

/* An input that an active link feeds from this output; PDCP_NONE: there is none. */
uint8_t pdcp_link_listener(const struct pdcp_bus *bus, uint8_t output);

/* A channel without an active link was found enabled: it is told not to be, until it answers (D-BUS-22). */
void pdcp_link_silence(struct pdcp_bus *bus, uint8_t channel);

/* Asks for exactly this link. PDCP_OK: the outcome comes as PDCP_EVENT_WISH. PDCP_ERR_BUSY: another wish is
 * under way. sole: if sole access forbids it when its turn comes, it ends with PDCP_ERR_SOLE. */
pdcp_status_t pdcp_link_wish(struct pdcp_bus *bus, uint8_t output, uint8_t input, bool sole);

/* A wish that has not been started ends with status. Nothing happens when there is none. */
void pdcp_link_forget_wish(struct pdcp_bus *bus, pdcp_status_t status);

/* The host waits no longer: its wish ends with PDCP_ERR_NO_ANSWER, and a link half made is undone. Returns
 * the place of the device whose request was broken off, PDCP_NONE: of none. */
uint8_t pdcp_link_give_up_wish(struct pdcp_bus *bus);

/* Is a wish of the host under way? */
bool pdcp_link_wish_waits(const struct pdcp_bus *bus);

/* Takes the link of an input away. */
void pdcp_link_remove(struct pdcp_bus *bus, uint8_t input);

/* Writes what the tables say to an input: the source of its link, or that it has none, which the tables then
 * say (D-BUS-38); of an active link all that it is made of, to both ends. Nothing is disabled first. */
void pdcp_link_write(struct pdcp_bus *bus, uint8_t input);

/* A device sent Update Data Channel for its channel index. */
void pdcp_link_on_update(struct pdcp_bus *bus, uint8_t node, uint8_t index);

/* A device is set up (PDCP_NONE: the pause after a link that was not answered is over): inactive links whose
 * ends are both there are made. */
void pdcp_link_on_ready(struct pdcp_bus *bus, uint8_t node);

/* A device is gone or was reset: its links become inactive, what it fed is silenced (D-BUS-14). Its request
 * must be cancelled already; a job that was waiting for it goes on without it. */
void pdcp_link_on_lost(struct pdcp_bus *bus, uint8_t node);

/* A reply to a request of PDCP_CLIENT_LINK. */
void pdcp_link_on_reply(struct pdcp_bus *bus, const pdcp_reply_t *reply);

/* A channel has answered that its transfer is not enabled any more. */
void pdcp_link_is_disabled(struct pdcp_bus *bus, struct pdcp_channel *channel);

/* The first time after the start is over: outputs may be enabled. */
void pdcp_link_open(struct pdcp_bus *bus);

/* Starts what can be started. Costs nothing when there is nothing to do. */
void pdcp_link_step(struct pdcp_bus *bus);

#endif
