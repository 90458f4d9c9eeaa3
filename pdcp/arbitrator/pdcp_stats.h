/* Counters of the bus. Every dropped frame is counted by its cause, and the host can read all counters.
 *
 * The order is part of the host API (2413h, D-API-5): append, never insert. All are 32-bit and wrap. Every
 * received frame is counted in exactly one of the DROP counters, CHANNEL_DATA, FOREIGN_BEACON or TAKEN. */
#ifndef PDCP_STATS_H
#define PDCP_STATS_H

#include <stdint.h>

typedef enum {
    PDCP_STAT_RX = 0,  /* frames handed to the arbitrator */
    PDCP_STAT_TX,      /* frames handed to the controller */
    PDCP_STAT_TX_FULL, /* frames lost to a full transmit queue, the new or the least urgent one; requests
                          are repeated */
    PDCP_STAT_DROP_EXTENDED,   /* 29-bit identifier */
    PDCP_STAT_DROP_REMOTE,     /* remote frame */
    PDCP_STAT_DROP_ERROR,      /* error report of the controller */
    PDCP_STAT_DROP_FD,         /* CAN FD frame */
    PDCP_STAT_DROP_UNUSED_ID,  /* P=3 M=1 [PDCP figure 2.3] */
    PDCP_STAT_DROP_ARBITRATOR, /* M=1, not sent by this arbitrator, other than a beacon */
    PDCP_STAT_FOREIGN_BEACON,  /* beacon of another arbitrator */
    PDCP_STAT_DROP_UNKNOWN_ID, /* M=0 from an id that is not bound */
    PDCP_STAT_DROP_BAD_DLC,    /* known function code, wrong DLC (D-BUS-5) */
    PDCP_STAT_DROP_BAD_CODE,   /* reserved or device-specific function code, or no data */
    PDCP_STAT_DROP_DIRECTION,  /* function code that a device must not send */
    PDCP_STAT_DROP_DEPRECATED, /* deprecated function code, not answered (D-BUS-4) */
    PDCP_STAT_DROP_LATE,       /* answer that nobody waits for */
    PDCP_STAT_DROP_BINDING,    /* P=3 frame other than a bind request */
    PDCP_STAT_CHANNEL_DATA,    /* frames from output channels, not for the arbitrator */
    PDCP_STAT_BIND_GRANTED,
    PDCP_STAT_BIND_SUGGESTED,
    PDCP_STAT_BIND_REFUSED,   /* no node id or no place left */
    PDCP_STAT_BIND_DUPLICATE, /* a second device with the identity of a bound one */
    PDCP_STAT_REQUESTS,       /* to devices, repetitions not counted */
    PDCP_STAT_REPEATS,
    PDCP_STAT_NO_ANSWER, /* requests that failed without an answer */
    PDCP_STAT_BULK_RESTARTS,
    PDCP_STAT_SETUP_FAILED,  /* devices left bound but unlinked */
    PDCP_STAT_NO_ROOM,       /* channels, needs or held requests that found their table full */
    PDCP_STAT_LOST,          /* devices lost */
    PDCP_STAT_LINK_FAILED,   /* links that could not be made and were undone */
    PDCP_STAT_UNKNOWN_RESET, /* Reset Device sent to an id that is not bound (D-BUS-15) */
    PDCP_STAT_TAKEN,         /* frames that the arbitrator has used */
    PDCP_STAT_DROP_SILENT,   /* everything but foreign beacons while on standby (D-BUS-12) */
    PDCP_STAT_TX_DISCARDED,  /* frames that waited while the bus was off */
    PDCP_STAT_BUS_OFF,       /* times that the controller went off the bus */
    PDCP_STAT_AUDIT,         /* parameters of channels that differed from the tables (D-BUS-40) */
    PDCP_STAT_COUNT
} pdcp_stat_t;

#endif
