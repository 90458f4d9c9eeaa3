/* Numbers of the protocol, each with its source. [PDCP] is the bus protocol, [PROFILE] the thesis on the
 * profile layer, D-BUS-n a decision of docs/spec. */
#ifndef PDCP_SPEC_H
#define PDCP_SPEC_H

/* Message priority: bits 10 and 9 of the identifier [PDCP 2.2.1]. Common practice: high for data and beacons,
 * normal for everything else [PROFILE 2.2]. */
enum { PDCP_PRIORITY_HIGH = 0, PDCP_PRIORITY_NORMAL = 1, PDCP_PRIORITY_LOW = 2, PDCP_PRIORITY_BINDING = 3 };

/* Node ids [PDCP 2.2.3]; 255 is never given out (D-BUS-2). */
enum { PDCP_NODE_BROADCAST = 0, PDCP_NODE_MIN = 1, PDCP_NODE_MAX = 254, PDCP_NODE_REFUSED = 0 };

/* Function codes [PDCP 3.1]. An answer's code is its request's code plus 80h. */
enum {
    PDCP_BIND_DEVICE = 0x01,
    PDCP_GET_DEVICE_INFO = 0x02, /* deprecated, as are 05 to 07 (D-BUS-4) */
    PDCP_GET_PARAMETER = 0x03,
    PDCP_SET_PARAMETER = 0x04,
    PDCP_IND_GET_PARAMETER = 0x05,
    PDCP_IND_SET_PARAMETER = 0x06,
    PDCP_SET_NODE_ID = 0x07,
    PDCP_SUSPEND = 0x08,
    PDCP_RELEASE = 0x09,
    PDCP_BEACON = 0x0A,
    PDCP_RESET = 0x0B,
    PDCP_BULK_GET = 0x0C,
    PDCP_BULK_SET = 0x0D,
    PDCP_BULK_DATA = 0x0E,
    PDCP_UPDATE_CHANNEL = 0x0F,
    PDCP_ANSWER = 0x80 /* added to a request's code */
};

/* Response codes [PDCP 3.2.2]. */
enum { PDCP_FAILURE = 0, PDCP_SUCCESS = 1, PDCP_USE_BULK = 2 };

/* Device parameters, channel index 0 [PROFILE table 2.8]. */
enum {
    PDCP_DEV_VID_PID = 1,
    PDCP_DEV_SERIAL = 2,
    PDCP_DEV_EAN13L = 3,
    PDCP_DEV_EAN13H = 4,
    PDCP_DEV_VERSIONS = 5,
    PDCP_DEV_TYPE_PROFILE = 6,
    PDCP_DEV_DESCRIPTOR = 7,
    PDCP_DEV_NODE_ID = 8,
    PDCP_DEV_CHANNELS = 9,
    PDCP_DEV_BEACON_INTERVAL = 10,
    PDCP_DEV_ACK_TIME = 11,
    PDCP_DEV_BIND_TIMEOUT = 12
};

/* Channel parameters, channel index 1 to n [PROFILE tables 2.9 and 2.10, 4.2.4]. */
enum {
    PDCP_CH_TYPE_PROFILE = 1,
    PDCP_CH_DESCRIPTOR = 2,
    PDCP_CH_TRANSFER_TYPE = 3,
    PDCP_CH_ENABLED = 4,
    PDCP_OUT_NODE_ID = 5,
    PDCP_IN_SOURCE_VID_PID = 5,
    PDCP_IN_SOURCE_SERIAL = 6, /* serial number, channel index */
    PDCP_IN_SOURCE_NODES = 7,  /* device id, output channel id */
    PDCP_IN_SOURCE_TYPE = 8,   /* type, profile */
    PDCP_CH_REQUIRED = 9,
    PDCP_CH_DESIRED = 10,
    PDCP_IN_TERMINAL_PROFILE = 11
};

/* Transfer type, parameter 3 of a channel. */
enum { PDCP_INPUT = 1, PDCP_OUTPUT = 2 };

/* Sole access, a bit of an input's type: no other such input may share its source [PROFILE listing 4.9]. The
 * bus needs this bit too; the others are the profile layer's. */
#define PDCP_TYPE_SOLE 0x0200u

/* Source of an unconnected input (D-BUS-7). */
enum { PDCP_NO_SOURCE_INDEX = 0xFF };
#define PDCP_NO_SOURCE_WORD 0xFFFFu

/* Packets of a bulk transfer [PDCP 3.2.10], ids wrap (D-BUS-9). */
enum { PDCP_BULK_PACKET_MAX = 6, PDCP_VALUE_MAX = 4, PDCP_BULK_RESTARTS = 3 };

/* Times in ms. */
enum {
    PDCP_BIND_TIMEOUT_MS = 1000,    /* how long a suggested id is reserved (D-BUS-6) */
    PDCP_ACK_MS = 100,              /* acknowledgement time when the device names none */
    PDCP_ACK_MIN_MS = 20,           /* D-BUS-13 */
    PDCP_ACK_MAX_MS = 500,          /* D-BUS-13 */
    PDCP_TRIES = 3,                 /* a request and two repetitions */
    PDCP_CHECK_TRIES = 2,           /* of the question whether a bound identity is still there (D-BUS-41) */
    PDCP_BEACON_MS = 500,           /* both ways (D-BUS-11, D-BUS-13) */
    PDCP_BEACON_MIN_MS = 50,        /* D-BUS-13 */
    PDCP_BEACON_MAX_MS = 10000,     /* D-BUS-13 */
    PDCP_BEACONS_MISSED = 3,        /* intervals of silence until a device is lost */
    PDCP_LOST_KEPT_MS = 10000,      /* ids of a lost device are kept for it */
    PDCP_DEVICE_BIND_MAX_MS = 8000, /* device role: longest pause between requests (D-BUS-16) */
    PDCP_DEVICE_SILENCE_MS = 3000,  /* device role: arbitrator gone (D-BUS-16) */
    PDCP_SETUP_PAUSE_MS = 250,      /* between two attempts to set a device up (D-BUS-17) */
    PDCP_SETUP_ATTEMPTS = 5,        /* D-BUS-17 */
    PDCP_SETUP_AGAIN_MS = 5000,     /* until a failed setup is tried once more (D-BUS-17) */
    PDCP_HOST_WAIT_MS = 1000,       /* longest wait of the host's request for its turn (D-API-10) */
    PDCP_LINK_PAUSE_MS = 500,       /* until an unanswered link is tried again (D-BUS-26) */
    PDCP_STANDBY_MS = 1600,         /* on standby without a foreign beacon: take over, plus the spread */
    PDCP_STANDBY_SPREAD_MS = 500,   /* by serial number (D-BUS-35) */
    PDCP_FOREIGN_MS = 2000,         /* how long a frame of another arbitrator counts (D-BUS-42) */
    PDCP_HOLD_MS = 5,               /* without devices of its own: bind requests are held, plus the spread */
    PDCP_HOLD_SPREAD_MS = 32,       /* by serial number (D-BUS-42) */
    PDCP_HOLD_SETUPS = 2,           /* held requests that are granted at once; */
    PDCP_HOLD_PACE_MS = 7,          /* the others follow one by one, about one setup apart */
    PDCP_HOLD_FOREIGN_MS = 600,     /* minimum hold after a foreign beacon (D-BUS-42) */
    PDCP_YIELD_MS = 3000,        /* with devices of its own: goes on standby for another, plus the spread */
    PDCP_YIELD_SPREAD_MS = 2000, /* by serial number (D-BUS-42) */
    PDCP_HUNG_MS = 1600,         /* age of its last beacon that makes it listen first (D-BUS-42) */
    PDCP_LISTEN_MS = 600,        /* how long it then listens */
    PDCP_UNBOUND_WAIT_MS = 250,  /* on standby: time for the answer to a bind request (D-BUS-42) */
    PDCP_UNBOUND_MAX = 3,        /* unanswered requests in a row, */
    PDCP_UNBOUND_MS = 1000,      /* over at least this time, show that the other does not serve */
    PDCP_RECOVERY_MS = 100,      /* first pause before leaving bus-off, doubling */
    PDCP_RECOVERY_MAX_MS = 5000,
    PDCP_YOUNG_MS = 1200,   /* after the start: no Reset to unknown devices (D-BUS-15) */
    PDCP_CLOSED_MS = 500,   /* after the start: no output is enabled (D-BUS-36) */
    PDCP_SHUT_MS = 11000,   /* after the start, if an unknown id is heard: no output id (D-BUS-36) */
    PDCP_FADING_MS = 100,   /* a disabled output may still send what it queued (D-BUS-36) */
    PDCP_CROWD_MS = 600,    /* after the start: unknown identities may take all places (D-BUS-43) */
    PDCP_GHOST_MS = 300,    /* after its grant: an unknown identity not heard is forgotten (D-BUS-43) */
    PDCP_AGE_MAX_MS = 20000 /* more than any time counted from the start */
};

#endif
