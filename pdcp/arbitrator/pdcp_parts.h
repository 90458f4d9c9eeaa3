/* State of the arbitrator's parts. Each struct belongs to one part, and only that part's file writes it.
 *
 * The structs stand here, below the parts, because pdcp_bus.h holds one of each and pdcp_tables.h a request
 * for each device. So no header includes that of a part above it. The header of each part says what its state
 * is for. Others write it only as this table says:
 *
 *   struct            its part       besides
 *   pdcp_request_t    pdcp_request
 *   pdcp_bind_t       pdcp_bind      the application fills in what is remembered, pdcp_bind_remember_stored
 *   pdcp_link_t       pdcp_link      pdcp_arb writes planned, stored and due; pdcp_ends due and changed;
 *                                    pdcp_job sets changed, pdcp_audit clears it
 *   pdcp_job_t        pdcp_job       pdcp_link says when it is for the host
 *   pdcp_audit_t      pdcp_audit
 *   pdcp_suspend_t    pdcp_suspend   pdcp_arb clears it when the bus is
 * forgotten */
#ifndef PDCP_PARTS_H
#define PDCP_PARTS_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bits.h"
#include "pdcp_identity.h"
#include "pdcp_limits.h"
#include "pdcp_spec.h"

/* How something ended. */
typedef enum {
    PDCP_OK = 0,
    PDCP_ERR_NO_ANSWER = -1, /* no answer in all tries, or the device was lost */
    PDCP_ERR_REFUSED = -2,   /* answered with failure */
    PDCP_ERR_BULK = -3,    /* transfer failed PDCP_BULK_RESTARTS times, or the value is longer than allowed */
    PDCP_ERR_BUSY = -4,    /* not now: try again later */
    PDCP_ERR_UNKNOWN = -5, /* no such device or channel, or wrong direction */
    PDCP_ERR_OWN = -6,     /* an output never feeds an input of its own device (D-API-6) */
    PDCP_ERR_SOLE = -7,    /* another input wants the output for itself, as this one does (D-API-13) */
    PDCP_ERR_DIFFERS = -8  /* the device does not keep what is written to it (D-BUS-40) */
} pdcp_status_t;

/* --- Requests (pdcp_request.h): one for each device, in pdcp_device_entry_t --- */

/* Which part asks a device. */
typedef enum {
    PDCP_CLIENT_NONE = 0,
    PDCP_CLIENT_SETUP,
    PDCP_CLIENT_LINK,
    PDCP_CLIENT_HOST,
    PDCP_CLIENT_RAW, /* the host, with a frame that is sent as it is */
    PDCP_CLIENT_RESET,
    PDCP_CLIENT_BIND, /* the check whether a bound identity is still there */
    PDCP_CLIENT_AUDIT /* the audit's questions, and the Release after a foreign Suspend */
} pdcp_client_t;

typedef enum {
    PDCP_REQUEST_IDLE = 0,
    PDCP_REQUEST_ANSWER,   /* sent, waiting for its answer */
    PDCP_REQUEST_GET_SIZE, /* 0C sent, waiting for 8C */
    PDCP_REQUEST_GET_DATA, /* waiting for the device's next 0E */
    PDCP_REQUEST_SET_SIZE, /* 0D sent, waiting for 8D */
    PDCP_REQUEST_SET_DATA, /* 0E sent, waiting for 8E */
    PDCP_REQUEST_SET_ECHO, /* 8E came, but 0E was sent more than once: waiting for its other answers
                              (D-BUS-39) */
    PDCP_REQUEST_RAW,      /* a frame of the host sent, waiting for its answer */
    PDCP_REQUEST_STATES
} pdcp_request_state_t;

/* Belongs to one device's place in the table. */
typedef struct {
    const uint8_t *bytes; /* value to be set, or data of a raw request; NULL: there is none */
    uint16_t size;        /* of the whole value: to be set, or as 8C says; 08: the time in ms; raw: the DLC */
    uint16_t max_size;    /* longest value that may be got */
    uint16_t offset;      /* bytes transferred so far */
    uint8_t state;        /* pdcp_request_state_t */
    uint8_t client;       /* pdcp_client_t */
    uint8_t code;         /* function code of the request */
    uint8_t param;
    uint8_t channel;
    uint8_t tries_left; /* PDCP_REQUEST_SET_ECHO: answers that may still come */
    uint8_t restarts_left;
    uint8_t packet_id; /* next bulk packet */
    uint8_t value[PDCP_VALUE_MAX];
    bool got_bulk; /* idle, after a bulk get: the last packet may come once more */
} pdcp_request_t;

/* --- Node ids (pdcp_bind.h) --- */

typedef struct {
    pdcp_identity_t identity;
    uint8_t node_id;
} pdcp_remembered_t;

typedef struct {
    pdcp_identity_t identity;
    uint8_t node_id; /* 0: this entry is free */
    uint32_t until_ms;
} pdcp_reserved_t;

typedef struct {
    uint8_t output_id; /* where the search for the next id of an output begins */
    bool shut;         /* somebody lives on from before the start: no ids for outputs until PDCP_SHUT_MS */
    uint8_t remembered_count;
    pdcp_remembered_t remembered[PDCP_IDENTITIES_MAX];
    pdcp_reserved_t reserved[PDCP_RESERVED_MAX];
} pdcp_bind_t;

/* --- Links (pdcp_link.h, pdcp_job.h) --- */

/* The source of an input: the output that its parameters 5, 6 and 8 name (D-BUS-7). Its size is even, so that
 * no channel has a gap. */
typedef struct {
    pdcp_identity_t identity; /* of the output's device */
    uint16_t type;
    uint16_t profile;
    uint8_t index;   /* channel index; PDCP_NO_SOURCE_INDEX: the input is unconnected */
    uint8_t channel; /* channel number; PDCP_NONE: the output is not on the bus */
} pdcp_source_t;

/* The job under way, or the last one: what it was about stays readable until the next one begins. */
typedef struct {
    bool active;     /* a job is under way */
    bool undoing;    /* steps run backwards */
    bool once;       /* the device that failed is tried once only */
    bool for_host;   /* the host waits for the outcome */
    bool for_device; /* the input's device waits for the answer to its Update Data Channel */
    bool differs;    /* what it names as its source is not what the tables say */
    uint8_t at;      /* place of the device whose answer the job waits for; PDCP_NONE: of none, the job goes
                        on when the device it is about has no other request under way */
    uint8_t kind;    /* pdcp_todo_t; PDCP_TODO_AGAIN: whatever comes interrupts it */
    uint8_t step;    /* pdcp_step_t */
    uint8_t input;   /* channel number; PDCP_NONE: gone, or the job has none */
    uint8_t output;  /* channel number; PDCP_NONE: gone, or the job has none */
    bool output_was_on; /* before the job */
    int8_t status;      /* outcome so far, pdcp_status_t */
    uint8_t old_link;   /* the input's link before the job, pdcp_link_status_t */
    pdcp_source_t old;  /* the input's source before the job, to be restored when it fails */
} pdcp_job_t;

typedef struct {
    bool planned; /* the profile layer decides which links are made: none comes by itself */
    bool stored;  /* and from a stored configuration: Update Data Channel changes no table */
    bool closed;  /* the arbitrator has just started: no output is enabled (D-BUS-36) */
    bool due;     /* some channel has something to do */
    bool changed; /* a link changes, or is about to: whoever wants to know sets this to false before */
    /* The link that the host or the planner has asked for; requested_input PDCP_NONE: none. */
    uint8_t requested_input;
    uint8_t requested_output;
    bool requested_sole; /* not if another input keeps it from the output */
    pdcp_job_t job;
} pdcp_link_t;

/* --- Audit (pdcp_audit.h) --- */

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
    uint8_t asked;       /* channel number of the question under way; PDCP_NONE: none, or it was compared */
    uint8_t asked_kind;  /* pdcp_audit_kind_t of the question */
    uint8_t asked_place; /* of the device that was asked last */
    uint8_t first;       /* place of the device that goes first, or did last */
    uint16_t window;     /* what is left of the minute under way, in PDCP_AUDIT_MS; 0: none is */
    uint16_t at[PDCP_AUDIT_WALKS]; /* where each walk is: kind * PDCP_CHANNELS_MAX + channel number */
    pdcp_audit_found_t found[PDCP_AUDIT_FOUND_MAX];
    uint8_t hurried[PDCP_BIT_BYTES(PDCP_DEVICES_MAX)];                    /* set of places: to go first */
    uint8_t refused[PDCP_AUDIT_KINDS][PDCP_BIT_BYTES(PDCP_CHANNELS_MAX)]; /* sets of channels, by kind */
} pdcp_audit_t;

/* --- Suspended devices (pdcp_suspend.h) --- */

/* All 0: nobody is suspended. */
typedef struct {
    uint8_t left[PDCP_DEVICES_MAX]; /* by place, suspended by the host: beacons of the arbitrator until that
                                       is over, up to 133, or PDCP_SUSPENDED_FOR_GOOD; 0: not suspended, or
                                       nobody is there */
    uint8_t release[PDCP_BIT_BYTES(
        PDCP_DEVICES_MAX)]; /* set of places: to be told Release, if bound and left is 0 */
} pdcp_suspend_t;

#endif
