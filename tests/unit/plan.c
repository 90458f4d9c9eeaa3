#include "plan.h"

systems_t plan_limb;

void plan_expect(const char *links)
{
    systems_expect(&plan_limb, PROFILE_PLAN_ALL, links);
}

void plan_lose(uint8_t name)
{
    systems_lose(&plan_limb, systems_place(&plan_limb, name));
}

void plan_back(uint8_t name)
{
    systems_return(&plan_limb, systems_place(&plan_limb, name));
}

void plan_forget(uint8_t name)
{
    systems_forget(&plan_limb, systems_place(&plan_limb, name));
}

void plan_set_up(const char *parts, const char *configuration)
{
    systems_init(&plan_limb);
    systems_add(&plan_limb, parts);
    systems_configure(&plan_limb, configuration, false);
}

void plan_run(const char *parts, const char *configuration)
{
    plan_set_up(parts, configuration);
    plan_expect(configuration);
}

void plan_expect_of(const char *parts, const char *links)
{
    systems_init(&plan_limb);
    systems_add(&plan_limb, parts);
    plan_expect(links);
}

uint8_t plan_count_links(void)
{
    uint8_t count = 0;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        count = (uint8_t)(count + (plan_limb.plan.want[i] != PDCP_NONE ? 1 : 0));
    }
    return count;
}
