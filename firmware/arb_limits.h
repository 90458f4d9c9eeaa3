/* Capacities and budgets of the application around the bus (pdcp_limits.h) and the profile layer
 * (profile_limits.h). A target may define its own values of those with an #ifndef (-DARB_NVM_PAGES=47). */
#ifndef ARB_LIMITS_H
#define ARB_LIMITS_H

#include "pdcp_limits.h"

/* Bytes that arb_app_t may take on a target with 16-bit int and pointers; arb_app.c asserts it. */
#define ARB_RAM_BUDGET 12032

/* Different pages that the memory can keep, of the 512 that are addressed. A log in program flash keeps
 * fewer. Identities and flags get theirs first, the longest configuration string follows from what is left
 * (arb_config.h): so such a memory is never too full for a write (D-MCU-6). */
#ifndef ARB_NVM_PAGES
#define ARB_NVM_PAGES 512
#endif

/* Longest payloads of the host API: a set request is dev, channel index, parameter id and the value; an
 * answer is a value. */
#define ARB_HOST_REQUEST_MAX (8 + PDCP_PARAMETER_MAX)
#define ARB_HOST_ANSWER_MAX PDCP_PARAMETER_MAX

/* Requests of the host that wait for their turn; a further one is answered as busy (D-API-3). */
#define ARB_HELD_MAX 4

/* Payloads of these requests together: the longest one and three short ones. A request that does not fit is
 * answered like a fifth one (D-API-9). */
#define ARB_HELD_BYTES (ARB_HOST_REQUEST_MAX + 3 * 24)

/* Answers out of order that wait behind the one being sent: three of the longest kind, 8 + 8 + 2 bytes. */
#define ARB_URGENT_BYTES 54

/* Bytes of events that wait for the host, 9 to 17 events; CAN frames only fill the first bytes. */
#define ARB_EVENT_QUEUE 192
#define ARB_EVENT_FRAMES 64

#endif
