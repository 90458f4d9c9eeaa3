/* Types of the device role: the description that the application fills, the state, and its readers. The
 * functions are in pdcp_device.h.
 *
 * Descriptions are constant and belong to the caller. A pdcp_device_t is the caller's memory; from
 * pdcp_device_init on, only the device role writes to it. */
#ifndef PDCP_DEVICE_TYPES_H
#define PDCP_DEVICE_TYPES_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_device_limits.h"
#include "pdcp_identity.h"
#include "pdcp_spec.h"
#include "pdcp_txq.h"

/* Bytes in flash or elsewhere. They belong to the caller and outlive the device. */
typedef struct {
    const void *bytes; /* may be NULL when len is 0 */
    uint16_t len;
} pdcp_device_bytes_t;

/* One channel; its index is its place in the array plus 1. */
typedef struct {
    uint8_t direction; /* PDCP_INPUT or PDCP_OUTPUT */
    bool terminal; /* inputs: goes to its safe value when the arbitrator is gone or the link is taken away */
    uint16_t type; /* parameter 1 (profile-layer.md 2) */
    uint16_t profile;
    uint16_t terminal_profile;      /* inputs, parameter 11 */
    int32_t safe;                   /* terminal inputs; for the application, the protocol does not send it */
    pdcp_device_bytes_t descriptor; /* UTF-8 without a terminator */
    pdcp_device_bytes_t required;   /* bit strings of up to 32 bytes, first bit = channel index 0 (D-BUS-8) */
    pdcp_device_bytes_t desired;
} pdcp_device_channel_desc_t;

/* A parameter of the application, such as a gain, a threshold or a name. It is looked up before those of the
 * specification and may replace one, such as the descriptor by a writable one. */
typedef struct {
    uint8_t param;
    uint8_t channel; /* 0: the device */
    bool writable;
    uint16_t capacity; /* longest value that bytes can take */
    uint8_t *bytes;    /* the value; the caller's, in RAM when writable */
    uint16_t *len;     /* its present length */
} pdcp_device_extra_t;

/* What the device is. Constant; it and all that it points to (bulk and the extras' values aside) may sit in
 * flash. */
typedef struct {
    pdcp_identity_t identity;
    uint32_t ean13_low; /* EAN-13 as one number: its lower and upper 32 bits */
    uint32_t ean13_high;
    uint16_t firmware;
    uint16_t hardware;
    uint16_t type;
    uint16_t profile;
    uint16_t beacon_ms; /* 0: 500; otherwise 50 to 10000 (D-BUS-13) */
    uint16_t ack_ms;    /* 0: 100; otherwise 20 to 500 (D-BUS-13) */
    uint16_t bind_ms;   /* bind request timeout; 0: 1000 */
    pdcp_device_bytes_t descriptor;
    const pdcp_device_channel_desc_t *channels;
    uint8_t channel_count; /* 0 to PDCP_DEVICE_CHANNELS_MAX */
    const pdcp_device_extra_t *extras;
    uint8_t extra_count;
    uint8_t
        *bulk; /* where a value written by bulk transfer is gathered; the caller's RAM, NULL: no bulk set */
    uint16_t bulk_capacity; /* a larger value is refused at configure time */
} pdcp_device_desc_t;

/* Where an input gets its data from: parameters 5, 6 and 8. Unconnected: FFFFh three times, FFh, 0, 0
 * (D-BUS-7). */
typedef struct {
    pdcp_identity_t identity;
    uint8_t channel;
    uint16_t type;
    uint16_t profile;
} pdcp_device_source_t;

/* False: the input is unconnected (D-BUS-7). */
static inline bool pdcp_device_source_connected(const pdcp_device_source_t *source)
{
    return source->identity.vid != PDCP_NO_SOURCE_WORD || source->identity.pid != PDCP_NO_SOURCE_WORD ||
           source->identity.sn != PDCP_NO_SOURCE_WORD || source->channel != PDCP_NO_SOURCE_INDEX;
}

/* What must outlive power-off [PROFILE 4.3.2], of fixed size. The application decides where it is kept, and
 * how damage is noticed. */
typedef struct {
    uint8_t node_id; /* last id, 0: none yet */
    pdcp_device_source_t
        sources[PDCP_DEVICE_CHANNELS_MAX]; /* by channel index - 1; those of outputs are not used */
} pdcp_device_record_t;

/* Functions that the device calls. Each may be NULL. They run inside pdcp_device_on_frame or
 * pdcp_device_step. They may call pdcp_device_send and the readers below, and nothing else of the device
 * role. */
typedef struct {
    void *ctx;
    /* Channel data for an enabled input. data is valid during the call, len is 0 to 8. */
    void (*input)(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len);
    /* A terminal input must go to its safe value now: the arbitrator is gone, transfer was disabled, or the
     * device was reset. It stays there until data comes. */
    void (*safe)(void *ctx, uint8_t channel);
    /* The record has changed and must be kept. This comes several times in a row while a link is made; an
     * application whose memory wears may wait for the last. record is valid during the call. */
    void (*store)(void *ctx, const pdcp_device_record_t *record);
    /* Reset Device came. The answer is queued and the device is unbound already; an application that restarts
     * its processor lets the queue run empty first. */
    void (*reset)(void *ctx);
    /* An extra was written; its new value stands in its bytes. */
    void (*written)(void *ctx, uint8_t channel, uint8_t param);
} pdcp_device_port_t;

/* States of a device (D-BUS-16).
 *
 *             granted                silent arbitrator, 3 s
 *   ASKING -----------------> BOUND ------------------------> ALONE
 *      ^                       |  ^                             |  |
 *      +-----------------------+  +-----------------------------+  |
 *      |        reset                   an arbitrator is heard     |
 *      +-----------------------------------------------------------+
 *                                reset                              */
typedef enum {
    PDCP_DEVICE_ASKING = 0, /* unbound: asks for a node id */
    PDCP_DEVICE_BOUND = 1,  /* beacons, answers, streams */
    PDCP_DEVICE_ALONE = 2 /* bound, but no arbitrator has been heard for 3 s: keeps its id, beacons, answers;
                             streams nothing */
} pdcp_device_state_t;

/* Counters, all wrap. Frames that are meant for others are not counted as dropped. */
typedef struct {
    uint32_t rx;             /* frames handed in */
    uint32_t tx;             /* frames taken out */
    uint32_t tx_full;        /* frames lost because the queue was full */
    uint32_t data_in;        /* channel data frames given to at least one input */
    uint32_t data_out;       /* channel data frames queued */
    uint32_t bind_requests;  /* sent */
    uint32_t bind_refused;   /* answers with id 0 */
    uint32_t bulk_failed;    /* transfers given up: no acknowledgement, refused, or a wrong packet */
    uint32_t drop_kind;      /* extended, remote, error and CAN FD frames */
    uint32_t drop_unused_id; /* P=3 M=1 [PDCP figure 2.3] */
    uint32_t drop_unbound;   /* from an arbitrator while unbound, other than the answer to the bind request */
    uint32_t drop_bind;      /* bind answers for another identity or id, or with an id that cannot be */
    uint32_t drop_bad_dlc;   /* known function code, wrong DLC (D-BUS-5) */
    uint32_t drop_bad_code;  /* reserved or device-specific function code, or no data */
    uint32_t drop_direction; /* function code that an arbitrator must not send, or not to all */
    uint32_t drop_deprecated; /* deprecated function code, not answered (D-BUS-4) */
    uint32_t drop_late;       /* answer that nobody waits for */
} pdcp_device_stats_t;

/* What a channel remembers while the power is on. */
typedef struct {
    bool enabled;
    bool asking;            /* inputs: Update Data Channel is not answered yet */
    bool ask_due;           /* inputs: and is to be sent now */
    uint8_t node_id;        /* outputs: own id, 0 = none */
    uint8_t source_device;  /* inputs, parameter 7: node ids of the source */
    uint8_t source_channel; /* 0 = none: nothing is accepted */
} pdcp_device_channel_t;

typedef enum {
    PDCP_DEVICE_BULK_IDLE = 0,
    PDCP_DEVICE_BULK_GET = 1,    /* we send packets and wait for 8E */
    PDCP_DEVICE_BULK_SET = 2,    /* we wait for packets */
    PDCP_DEVICE_BULK_STORED = 3, /* the last packet was taken and may still be repeated */
    PDCP_DEVICE_BULK_REFUSED = 4 /* a packet was refused: so are all until the next configure frame */
} pdcp_device_bulk_mode_t;

typedef struct {
    uint8_t mode; /* pdcp_device_bulk_mode_t */
    uint8_t param;
    uint8_t channel;
    uint8_t packet_id; /* get: of the packet under way; set: the next expected one */
    uint8_t tries;
    uint16_t size;
    uint16_t done; /* bytes acknowledged or received */
    const uint8_t *bytes;
    uint8_t small[PDCP_VALUE_MAX]; /* a value that stands nowhere else as bytes */
    uint32_t deadline_ms;
} pdcp_device_bulk_t;

/* The device. Read its members through the functions below; only pdcp_device*.c writes them. */
typedef struct {
    const pdcp_device_desc_t *desc;
    const pdcp_device_port_t *port;
    pdcp_device_record_t record;
    pdcp_device_channel_t channels[PDCP_DEVICE_CHANNELS_MAX];
    pdcp_device_stats_t stats;
    pdcp_device_bulk_t bulk;
    pdcp_txq_t txq;
    uint32_t random;
    uint8_t state;   /* pdcp_device_state_t */
    uint8_t node_id; /* bound: own id; asking: the id asked for */
    uint8_t suggestions;
    bool suspended;
    bool suspended_for_good; /* until released */
    uint16_t listen_changes;
    uint16_t beacon_ms; /* parameters 10 to 12 as they are now */
    uint16_t ack_ms;
    uint16_t bind_ms;
    uint32_t bind_pause_ms; /* of the next request without an answer, before the random part */
    uint32_t bind_deadline_ms;
    uint32_t beaconed_ms; /* when the last beacon was due; the next follows beacon_ms later */
    uint32_t update_deadline_ms;
    uint32_t suspend_deadline_ms;
    uint32_t heard_ms; /* last frame from an arbitrator */
} pdcp_device_t;

/* Readers. channel is an index, 1 to the number of channels. */
static inline pdcp_device_state_t pdcp_device_state(const pdcp_device_t *dev)
{
    return (pdcp_device_state_t)dev->state;
}

/* Own node id, 0 while unbound. */
static inline uint8_t pdcp_device_node_id(const pdcp_device_t *dev)
{
    return dev->state != PDCP_DEVICE_ASKING ? dev->node_id : 0;
}

static inline bool pdcp_device_suspended(const pdcp_device_t *dev)
{
    return dev->suspended;
}

static inline const pdcp_device_channel_t *pdcp_device_channel(const pdcp_device_t *dev, uint8_t channel)
{
    return &dev->channels[channel - 1];
}

static inline const pdcp_device_source_t *pdcp_device_source(const pdcp_device_t *dev, uint8_t channel)
{
    return &dev->record.sources[channel - 1];
}

static inline const pdcp_device_stats_t *pdcp_device_stats(const pdcp_device_t *dev)
{
    return &dev->stats;
}

/* Changes whenever the node ids that the device listens to (source_channel of enabled inputs) may have
 * changed, for programs that set acceptance filters. */
static inline uint16_t pdcp_device_listen_changes(const pdcp_device_t *dev)
{
    return dev->listen_changes;
}

#endif
