/* What is known of another arbitrator on the bus (D-BUS-42): whether it is heard, whether it serves, and, on
 * standby, whether it lives. Decides nothing: pdcp_role.c acts on it. */
#ifndef PDCP_STANDBY_H
#define PDCP_STANDBY_H

#include <stdbool.h>
#include <stdint.h>

#include "can_frame.h"

enum { PDCP_STANDBY_BEACONS = 3 }; /* beacons within PDCP_FOREIGN_MS that show that it serves */

/* All 0: no other arbitrator has been heard. */
typedef struct {
    uint32_t beacon_ms[PDCP_STANDBY_BEACONS]; /* of its last beacons, newest first */
    uint32_t since_ms;    /* when it was first heard, without a pause of PDCP_FOREIGN_MS since */
    uint32_t answered_ms; /* when a device answered a frame of it */
    uint32_t unbound_ms;  /* on standby: when the first of the `unbound` requests came */
    uint8_t beacons;      /* how many of beacon_ms are known */
    bool answered;        /* answered_ms means something */
    bool doubted;         /* it let bind requests go unanswered: its beacons alone prove nothing (D-BUS-50) */
    uint8_t asked_id;     /* node id of its last request that is not answered yet, 0: none; */
    uint8_t asked_code;   /* its function code, */
    bool asked_identity;  /* and whether it reads parameter 1 or 2, which is no service */
    uint8_t unbound;      /* on standby: bind requests in a row that got no answer */
} pdcp_standby_t;

/* Takes a beacon of another arbitrator. True: it is the first one for a while. */
bool pdcp_standby_on_beacon(pdcp_standby_t *standby, uint32_t now_ms);

/* Takes any other frame of an arbitrator (mode 1). */
void pdcp_standby_on_request(pdcp_standby_t *standby, const can_frame_t *frame);

/* Takes a frame of a device from the id that was asked last (asked_id). True: it answers that request. */
bool pdcp_standby_on_answer(pdcp_standby_t *standby, uint32_t now_ms, const can_frame_t *frame);

/* Forgets what is too old to matter. Call at least every few days. */
void pdcp_standby_on_time(pdcp_standby_t *standby, uint32_t now_ms);

/* Has another arbitrator been heard lately? */
bool pdcp_standby_is_heard(const pdcp_standby_t *standby, uint32_t now_ms);

/* Has a device answered another arbitrator that is heard lately? */
bool pdcp_standby_is_answered(const pdcp_standby_t *standby, uint32_t now_ms);

/* Does another arbitrator serve? */
bool pdcp_standby_serves(const pdcp_standby_t *standby, uint32_t now_ms);

/* On standby: notes that a bind request, or a frame of the other arbitrator, was answered. */
void pdcp_standby_on_sign_of_life(pdcp_standby_t *standby);

/* On standby: notes that the bind request of asked_ms was not answered in time. True: the other one does not
 * serve any more. */
bool pdcp_standby_on_unbound(pdcp_standby_t *standby, uint32_t now_ms, uint32_t asked_ms);

#endif
