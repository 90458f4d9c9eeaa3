/* One limb on tables (systems.h) and what is planned for it. Parts and links are texts, devices are named by
 * number. */
#ifndef PLAN_H
#define PLAN_H

#include "systems.h"

extern systems_t plan_limb;

/* A plan of everything wants exactly these links. It is carried out, and another one changes nothing. */
void plan_expect(const char *links);

/* What happens to a device. */
void plan_lose(uint8_t name);
void plan_back(uint8_t name);
void plan_forget(uint8_t name);

/* The parts are there and are configured like this; nothing is linked yet. */
void plan_set_up(const char *parts, const char *configuration);

/* The same, and the links work. */
void plan_run(const char *parts, const char *configuration);

/* The links that autoconfiguration makes of these parts, from nothing. */
void plan_expect_of(const char *parts, const char *links);

/* How many links are planned. */
uint8_t plan_count_links(void);

#endif
