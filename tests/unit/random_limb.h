/* Random limbs for the planner, on tables (systems.h): parts that match often, needs with loops,
 * configurations with missing ends. The same seed gives the same limb. */
#ifndef RANDOM_LIMB_H
#define RANDOM_LIMB_H

#include "systems.h"

#ifdef __AVR__
enum { RANDOM_DEVICES = 5 };
#else
enum { RANDOM_DEVICES = 12 };
#endif
enum { RANDOM_CHANNELS = 6, RANDOM_LINKS = 7, RANDOM_POOL = RANDOM_DEVICES * RANDOM_CHANNELS };

/* One random limb. Which device is where in the tables is no part of it. */
typedef struct {
    systems_device_t devices[RANDOM_DEVICES];
    uint8_t count;
    uint32_t absent; /* bit per device: not there at first */
    struct {
        uint8_t from, output, to, input;
        bool by_host;
    } links[RANDOM_LINKS];
    uint8_t link_count;
    uint32_t seed;
} random_limb_t;

extern random_limb_t random_limb;
extern systems_t random_tables;
extern uint32_t random_state;
extern uint32_t random_needy;                    /* percentage of the channels that require others */
extern uint8_t random_spec_of[PDCP_DEVICES_MAX]; /* place: device of the limb */

/* A number below this; true in so many percent. */
uint32_t random_below(uint32_t below);
bool random_chance(uint32_t percent);

/* Fails with the limb's seed unless it holds. */
void random_check(bool holds, const char *what);

/* The limb of this seed: at most so many devices with so many channels, and links of so many tries. */
void random_make(uint32_t seed, uint8_t devices, uint8_t channels, uint8_t tries);

/* Place of a device of the limb, PDCP_NONE: it has none. A device comes, or comes back. */
uint8_t random_place(uint8_t device);
void random_come(uint8_t device);

/* The devices come in any order, and get their channels one by one, in turns. */
void random_come_mixed(uint32_t absent);

/* The limb's links are configured, the last one first if backwards. */
void random_configure(bool backwards);

#endif
