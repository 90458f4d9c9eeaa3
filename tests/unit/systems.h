/* Limbs on tables: devices and links from a readable text, for the tests of the planner.
 *
 * A text of devices: "D1 2:2:4 out 1 5000 2120; D2 in 1 7200 2200, in 2 5200 2110, out 3 5000 1100 req 2".
 * D1 is the name that texts of links use; then VID:PID:SN in decimal (2:2:1 when left out); then channels
 * separated by commas: direction, index, type and profile in hexadecimal, and what may follow: `req 1 2`
 * and `des 1 2` (required and desired channels), `for 1110` (terminal profile). Indices go from 1 upwards.
 *
 * A text of links: "1.1>2.2 2.3>3.1", output D1.1 to input D2.2 and so on, in the order of the inputs. */
#ifndef SYSTEMS_H
#define SYSTEMS_H

#include "pdcp_tables.h"
#include "profile_links.h"
#include "profile_plan.h"

enum { SYSTEMS_NAMES = 16, SYSTEMS_CHANNELS = 32, SYSTEMS_TEXT = 128 };

typedef struct {
    uint8_t transfer; /* PDCP_INPUT, PDCP_OUTPUT */
    uint16_t type;
    uint16_t profile;
    uint16_t terminal_profile;
    uint32_t required; /* bit n: channel index n */
    uint32_t desired;
} systems_channel_t;

typedef struct {
    pdcp_identity_t identity;
    uint8_t name;
    uint8_t count;
    systems_channel_t channels[SYSTEMS_CHANNELS]; /* index 1 first */
} systems_device_t;

/* All that a plan is made from, and the plan. */
typedef struct {
    pdcp_tables_t tables;
    profile_links_t links;
    profile_board_t plan;
    uint8_t made[PROFILE_CHANNEL_BYTES];
    uint8_t awaited[PROFILE_PLACE_BYTES];
    profile_pair_t banned[PROFILE_BANNED_MAX];
    uint8_t banned_count;
    int16_t beyond;                       /* effort by which a slice was longer than it should be, at most */
    int16_t slice;                        /* effort of a slice of the planner; 0: a plan is made in one go */
    pdcp_identity_t named[SYSTEMS_NAMES]; /* of D0, D1, ... */
} systems_t;

/* No devices, no links. */
void systems_init(systems_t *s);

/* Reads the device at *text, which is moved behind it. False: there are no more. */
bool systems_read(const char **text, systems_device_t *device);

/* A device takes a place, without channels. Returns the place. */
uint8_t systems_bind(systems_t *s, const systems_device_t *device);

/* Its channels appear and it is set up. They may have been made before by pdcp_tables_set_channels. */
void systems_set_up(systems_t *s, uint8_t place, const systems_device_t *device);

/* The devices of a text are bound and set up. */
void systems_add(systems_t *s, const char *devices);

/* Place of the device with this name; it must be bound. */
uint8_t systems_place(const systems_t *s, uint8_t name);

/* Number of the channel that a text names ("2.1"); its device must be bound. */
uint8_t systems_channel(const systems_t *s, const char *text);

/* What happens to a device: it is lost, comes back, is forgotten. */
void systems_lose(systems_t *s, uint8_t place);
void systems_return(systems_t *s, uint8_t place);
void systems_forget(systems_t *s, uint8_t place);

/* Links of the active configuration; their devices must be bound, they may be lost. */
void systems_configure(systems_t *s, const char *links, bool by_host);

/* Links that work, whatever the configuration says. */
void systems_link(systems_t *s, const char *links);
void systems_connect(systems_t *s, uint8_t output, uint8_t input);

/* No pair is banned, none made, nobody awaited. */
profile_scene_t systems_scene(systems_t *s);

/* Makes a plan, and carries it out: the tables say what it wants, and links that are in no entry are put into
 * the configuration. */
void systems_plan(systems_t *s, uint8_t what);
void systems_execute(systems_t *s);

/* What is planned, as a text of links. */
void systems_planned(const systems_t *s, char text[SYSTEMS_TEXT]);

/* Makes a plan, which must want exactly these links, and carries it out; another plan changes nothing. */
void systems_expect(systems_t *s, uint8_t what, const char *links);

/* The five acceptance systems (profile-layer.md 6), number 1 to 5, types as in [PROFILE] appendix D. */
const char *systems_acceptance(uint8_t number);

#endif
