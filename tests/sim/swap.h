/* The limb of acceptance system 2, D1 to D3, and a second controller, D4. */
#ifndef SWAP_H
#define SWAP_H

#include "limb.h"

/* Their channels. */
#define SWAP_SENSOR "out 5000 2120, signal = sine 0 255 2000, rate_ms = 20"
#define SWAP_CONTROLLER                                                                                      \
    "in 7200 2200; in 5200 2110; out 5000 1100, required = 2, signal = copy 2;"                              \
    "out 5000 1210, required = 1, signal = copy 1; out 7000 1220, required = 2, signal = copy 2"
#define SWAP_HAND "in 5300 1110, terminal_profile = 0x1110; in 7300 1220, terminal_profile = 0x1220"

enum { SWAP_SPARE = 3 }; /* the second controller's number */

/* The links with the first controller, and with the second one. */
#define SWAP_LINKS "1.1>2.2 2.3>3.1 2.5>3.2"
#define SWAP_LINKS_SPARE "4.3>3.1 4.5>3.2 1.1>4.2"

/* For setUp: none of the parts is plugged in. */
void swap_begin(limb_t *limb);

/* D1 to D3 are plugged in and link themselves. */
void swap_run(limb_t *limb);

/* Everything is switched off, and these parts on again; the arbitrator then makes up no links anew. */
void swap_restart(limb_t *limb, int first, int last);

void swap_set_flags(limb_t *limb, uint8_t flags);

#endif
