/* The event stream to the host: messages about what happens on the bus (2416h and 2419h, host-api.md 3). Only
 * a host that has asked for it gets it.
 *
 * Events wait in a queue. One that finds no room is dropped and counted by its kind. CAN frames may take only
 * a part of the queue, so that the other kinds find room at full bus load. Answers go first: arb_hostapi.c
 * takes a message from here only when no answer waits. So an answer waits for the rest of one message at
 * most, 30 bytes. */
#ifndef ARB_HOSTEVENTS_H
#define ARB_HOSTEVENTS_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_hostcodec.h"
#include "arb_limits.h"
#include "pdcp_arb.h"

typedef enum {
    ARB_EVENT_BOUND = 1,     /* dev, node8 */
    ARB_EVENT_LOST = 2,      /* dev, node8 */
    ARB_EVENT_LINK = 3,      /* output chan, input chan, status8 (0: gone) */
    ARB_EVENT_CONFIG = 4,    /* active8, stored8 */
    ARB_EVENT_FRAME = 5,     /* id16, DLC8, DLC bytes of data; of both directions */
    ARB_EVENT_BUS_STATE = 6, /* state8 (arb_bus_state_t), transmit errors8, receive errors8 */
    ARB_EVENT_AUDIT = 9,     /* chan, parameter8: the device did not have what the tables say (D-BUS-40) */
    ARB_EVENT_KINDS = 9      /* 7 and 8 are kept for later ones (D-API-19, D-API-20) */
} arb_event_kind_t;

typedef enum { ARB_BUS_ACTIVE = 0, ARB_BUS_PASSIVE = 1, ARB_BUS_OFF = 2, ARB_BUS_SILENT = 3 } arb_bus_state_t;

enum {
    ARB_EVENT_HEAD = 5, /* kind8, time32 */
    ARB_EVENT_DATA_MAX = ARB_LINK_BYTES
};

typedef struct {
    uint16_t mask;     /* bit k: kind k + 1 is wanted; 0: the stream is off */
    uint8_t tx_errors; /* of the controller, as told last */
    uint8_t rx_errors;
    uint8_t used;                           /* bytes of queue */
    arb_out_t out;                          /* message */
    uint32_t counters[1 + ARB_EVENT_KINDS]; /* 0: events sent; k: of kind k dropped for want of room */
    uint8_t message[ARB_HOST_HEADER + ARB_EVENT_HEAD + ARB_EVENT_DATA_MAX + ARB_HOST_CRC];
    uint8_t queue[ARB_EVENT_QUEUE]; /* events that wait, the oldest first */
} arb_hostevents_t;

/* Bits of the kinds that there are: 1 to 6, and 9. */
#define ARB_EVENT_MASK 0x013Fu

static inline bool arb_hostevents_wants(const arb_hostevents_t *events, arb_event_kind_t kind)
{
    return (events->mask & (1u << (kind - 1))) != 0;
}

/* Sets the wanted kinds. Waiting events of other kinds are dropped. */
void arb_hostevents_set_mask(arb_hostevents_t *events, uint16_t mask);

/* Ends the stream: the host is gone, and the next one has not asked for anything (D-API-14). */
void arb_hostevents_end(arb_hostevents_t *events);

/* Takes an event of the arbitrator. Ignored if it has no kind, or one that is not wanted. */
void arb_hostevents_on_event(arb_hostevents_t *events, const pdcp_arb_t *arb, uint32_t now_ms,
                             const pdcp_event_t *event);

/* Takes a frame on the bus, received or sent. Only base frames are events (D-API-14). */
void arb_hostevents_on_frame(arb_hostevents_t *events, uint32_t now_ms, const can_frame_t *frame);

/* Notes that the active configuration or the number of stored ones has changed. */
void arb_hostevents_on_config(arb_hostevents_t *events, uint32_t now_ms, uint8_t active, uint8_t stored);

/* Makes the oldest event the message to be sent, if there is none. True: message[] holds one, and out says
 * how much of it is left. */
bool arb_hostevents_next(arb_hostevents_t *events);

/* Is there something to send? */
static inline bool arb_hostevents_wait(const arb_hostevents_t *events)
{
    return events->out.len != 0 || events->used != 0;
}

#endif
