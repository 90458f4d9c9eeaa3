/* Capacities of the bus: the size of every table of pdcp/common and pdcp/arbitrator. The other rooms have
 * theirs in pdcp_device_limits.h, profile_limits.h and arb_limits.h.
 *
 * The numbers are those of the smallest part, a dsPIC33FJ64MC802 with 16 KB RAM (pdcp-bus.md 11). A larger
 * part may define its own before this header is read (-DPDCP_DEVICES_MAX=64). */
#ifndef PDCP_LIMITS_H
#define PDCP_LIMITS_H

#ifndef PDCP_DEVICES_MAX
#define PDCP_DEVICES_MAX 32 /* bound at a time; 1 to 64 (the reset bitmap of the host API has 64 bits) */
#endif

/* Places that unknown identities may take. The others are kept for known ones (D-BUS-43). */
#define PDCP_UNKNOWN_PLACES (PDCP_DEVICES_MAX - PDCP_DEVICES_MAX / 4)

#ifndef PDCP_CHANNELS_MAX
#define PDCP_CHANNELS_MAX 128 /* of all devices together; 1 to 254 */
#endif

#ifndef PDCP_IDENTITIES_MAX
#define PDCP_IDENTITIES_MAX 64 /* identities whose node id is remembered over power cycles (D-BUS-6) */
#endif

#ifndef PDCP_TX_MAX
#define PDCP_TX_MAX 16 /* frames waiting for the controller */
#endif

#ifndef PDCP_RESERVED_MAX
#define PDCP_RESERVED_MAX 8 /* suggested ids waiting for their device (D-BUS-6) */
#endif

/* Bytes for required and desired channels: one bit for each input of the owning device, two sets a
 * channel. */
#ifndef PDCP_NEEDS_BYTES
#define PDCP_NEEDS_BYTES 320
#endif

/* Channels whose differences the audit counts at the same time. */
#define PDCP_AUDIT_FOUND_MAX 8

/* Longest parameter value that passes between host and device (D-BUS-13). */
#define PDCP_PARAMETER_MAX 512

#endif
