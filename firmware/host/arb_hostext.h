/* The extension group 24xxh (host-api.md 3, D-API-5): what the source's messages cannot ask for.
 *
 * Counters of 2413h, each 32 bits, LSB first, since the start, wrapping. New ones are added at the end of a
 * group.
 *
 * Group 0, bus: in the order of pdcp_stats.h.
 *
 * Group 1, host link: bytes received, bytes sent, requests received, bytes skipped between messages, headers
 * with an impossible size, messages with a wrong CRC8, with a wrong CRC16, messages given up in the middle,
 * requests answered with 07h because four were held, with 2200h, events sent, events dropped for want of
 * room, of kind 1 to 9 (of 7 and 8, which are kept for later, none).
 *
 * Group 2, storage: writes of the identities that failed, copies of them that were damaged at the start, the
 * same two of the flags; of the configurations, in the order of arb_config_counter_t.
 *
 * Group 3, drivers (D-API-18): in the order of arb_port_counter_t. */
#ifndef ARB_HOSTEXT_H
#define ARB_HOSTEXT_H

enum { ARB_STATS_BUS = 0, ARB_STATS_HOST = 1, ARB_STATS_STORAGE = 2, ARB_STATS_DRIVERS = 3 };

#endif
