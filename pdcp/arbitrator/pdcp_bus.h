/* What the parts of the arbitrator share: tables, deadlines, transmit queue, counters and events. Only files
 * of pdcp/arbitrator use this. */
#ifndef PDCP_BUS_H
#define PDCP_BUS_H

#include "pdcp_codec.h"
#include "pdcp_parts.h"
#include "pdcp_stats.h"
#include "pdcp_tables.h"
#include "pdcp_timers.h"
#include "pdcp_txq.h"
#include "pdcp_unknown.h"

typedef enum {
    PDCP_EVENT_BOUND,        /* place: first beacon of a device, it counts from now on */
    PDCP_EVENT_READY,        /* place: its setup has ended well */
    PDCP_EVENT_SETUP_FAILED, /* place: it stays bound but unlinked */
    PDCP_EVENT_LOST,         /* place: silent for three beacon intervals */
    PDCP_EVENT_REFUSED,      /* a device was refused: no node id or no place left */
    PDCP_EVENT_DUPLICATE,    /* place: a second device claims its identity and was refused */
    PDCP_EVENT_IDENTITIES,   /* the table of remembered identities has changed */
    PDCP_EVENT_LINK, /* channel (an input): its link has changed; status: PDCP_OK or why it was not made */
    PDCP_EVENT_LINK_REQUEST, /* channel: the link that the host asked for is made, or status says why not */
    PDCP_EVENT_RESET,        /* place: the requested reset has ended with status */
    PDCP_EVENT_FOREIGN,      /* another arbitrator is heard; this one stays (D-BUS-12) */
    PDCP_EVENT_SILENT,       /* this arbitrator is on standby now and has forgotten all devices (D-BUS-12) */
    PDCP_EVENT_STARTED,      /* this arbitrator has taken over and starts afresh */
    PDCP_EVENT_STATE,        /* status: the new state of the bus (pdcp_bus_state_t) */
    PDCP_EVENT_AUDIT,  /* channel: a parameter differs from the tables; status holds its id (D-BUS-40) */
    PDCP_EVENT_REQUEST /* place: the host's request has ended with status; len bytes of value */
} pdcp_event_kind_t;

typedef struct {
    pdcp_event_kind_t kind;
    uint8_t place;
    uint8_t channel;
    int8_t status; /* pdcp_status_t */
    uint16_t len;
} pdcp_event_t;

/* Takes an event. Called from inside the arbitrator's functions, in the order in which things happen. It may
 * read the arbitrator's tables and call nothing else of it. The event is valid during the call. */
typedef void (*pdcp_event_fn)(void *ctx, uint32_t now_ms, const pdcp_event_t *event);

/* Is this identity part of a stored limb? Same context as pdcp_event_fn. NULL: no identity is. */
typedef bool (*pdcp_knows_fn)(void *ctx, const pdcp_identity_t *identity);

/* Small state stands first here and in the structs around it: on the smallest part, a field that lies farther
 * than 511 bytes from the beginning costs twice the instructions. */
typedef struct {
    uint32_t now_ms;      /* time of the present call */
    uint32_t started_ms;  /* slides along behind: see pdcp_bus_age_ms */
    uint32_t silenced_ms; /* when an output answered last that it is not enabled any more */
    pdcp_event_fn on_event;
    pdcp_knows_fn knows;
    void *event_ctx;
    pdcp_link_t link;
    pdcp_audit_t audit;
    pdcp_tables_t tables;
    pdcp_timers_t timers;
    pdcp_txq_t txq;
    uint32_t stats[PDCP_STAT_COUNT];
    pdcp_bind_t bind;
    pdcp_suspend_t suspend;
    pdcp_unknown_t unknown;
} pdcp_bus_t;

/* The device at this place, which must be below PDCP_DEVICES_MAX. */
pdcp_device_entry_t *pdcp_bus_device(pdcp_bus_t *bus, uint8_t place);

/* Time since the start, PDCP_AGE_MAX_MS at most. */
uint32_t pdcp_bus_age_ms(const pdcp_bus_t *bus);

/* Sets timer so that it fires in_ms from now. */
void pdcp_bus_wake(pdcp_bus_t *bus, uint8_t timer, uint16_t in_ms);

void pdcp_bus_count(pdcp_bus_t *bus, pdcp_stat_t stat);

/* Queues a frame, or a message from the arbitrator. False: the queue is full, which is counted. */
bool pdcp_bus_send_frame(pdcp_bus_t *bus, const can_frame_t *frame);
bool pdcp_bus_send(pdcp_bus_t *bus, uint8_t priority, uint8_t node_id, const pdcp_msg_t *msg);

/* Queues a message that consists of a code and a word. */
bool pdcp_bus_send_word(pdcp_bus_t *bus, uint8_t priority, uint8_t node_id, uint8_t code, uint16_t word);

/* Tells an event of a device (PDCP_NONE: of none), or of an input and its link. */
void pdcp_bus_tell(const pdcp_bus_t *bus, pdcp_event_kind_t kind, uint8_t place, pdcp_status_t status);
void pdcp_bus_tell_link(const pdcp_bus_t *bus, pdcp_event_kind_t kind, uint8_t input, pdcp_status_t status);

/* Tells an event of a device, with status PDCP_OK. */
void pdcp_bus_tell_device(pdcp_bus_t *bus, pdcp_event_kind_t kind, uint8_t place);

#endif
