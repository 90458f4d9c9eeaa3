/* The five acceptance systems (profile-layer.md 6) in virtual time: their parts, what is configured
 * beforehand, and the links that the table expects. */
#ifndef SYSTEMS_H
#define SYSTEMS_H

#include "limb.h"

typedef struct {
    const char *name;
    const char *files[3];   /* descriptions of D1, D2, D3 */
    const char *configured; /* the links before */
    const char *expected;   /* the links in the end */
    int replaced;           /* the part that is replaced, and */
    int replacement;        /* by which; -1: none is */
} systems_t;

/* Number 1 to 5. */
const systems_t *systems_get(int number);

/* A limb with these parts, none plugged in; they keep their parameters over power-off. */
void systems_begin(limb_t *limb, int number, uint32_t seed);

/* Systems 1, 3 and 4: all but the replacement are plugged in, what is to be configured is linked, by the host
 * or by itself, and saved through the host. */
void systems_configure(limb_t *limb, int number);

/* Everything is switched off and on again, with the memory kept; what is to be replaced stays off, and its
 * replacement is plugged in. */
void systems_restart(limb_t *limb, int number);

/* Values arrive on all links; what leaves D1 of systems 2, 3 and 5 arrives at both inputs of D3. */
void systems_expect_flow(limb_t *limb, int number);

/* Since limb_want: how long it took from a moment (limb.lost, limb.ready) until the links were there, and
 * what of that was bus time. Prints it, and fails if it was more than 100 ms, quiet_ms, and the bus time. */
void systems_report(const limb_t *limb, int number, const char *what, const char *since,
                    const limb_moment_t *from, uint32_t quiet_ms);

#endif
