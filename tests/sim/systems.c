#include "systems.h"

#include <stdio.h>
#include <string.h>

#include "unity.h"

#define DEMO LIMB_FILES
#define LINKS_2 "1.1>2.2 2.3>3.1 2.5>3.2"

static const systems_t systems[] = {
    {"system 1",
     {SYSTEMS_FILES "/1-d1.ini", SYSTEMS_FILES "/1-d2.ini", SYSTEMS_FILES "/1-d3.ini"},
     "1.1>2.1",
     "1.1>3.2",
     D2,
     D3},
    {"system 2", {DEMO "/d1.ini", DEMO "/d2.ini", DEMO "/d3.ini"}, "", LINKS_2, -1, -1},
    {"system 3", {DEMO "/d1.ini", DEMO "/d2.ini", DEMO "/d3.ini"}, LINKS_2, LINKS_2, -1, -1},
    {"system 4",
     {SYSTEMS_FILES "/4-d1.ini", SYSTEMS_FILES "/4-d2.ini", SYSTEMS_FILES "/4-d3.ini"},
     "1.1>3.2",
     "2.2>3.2",
     D1,
     D2},
    {"system 5", {DEMO "/d1.ini", DEMO "/d2.ini", DEMO "/d3.ini"}, LINKS_2, LINKS_2, -1, -1},
};

const systems_t *systems_get(int number)
{
    return &systems[number - 1];
}

void systems_begin(limb_t *limb, int number, uint32_t seed)
{
    limb_begin(limb, seed, 0xFFFFFFFFu - 700u);
    limb->keeps = true;
    for (int i = 0; i < LIMB_DEVICES; i++) {
        (void)limb_add_file(limb, systems_get(number)->files[i]);
    }
}

void systems_configure(limb_t *limb, int number)
{
    const systems_t *system = systems_get(number);
    for (int i = 0; i < LIMB_DEVICES; i++) {
        if (i != system->replacement) {
            limb_power_on(limb, i);
        }
    }
    limb_want(limb, system->configured);
    limb_run_ms(limb, 1000);
    if (number == 1) {
        TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(limb, 4, 1, 5, 1));
    } else if (number == 4) {
        TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(limb, 4, 1, 6, 2));
    }
    limb_await(limb, 1000);
    (void)limb_act(limb, ARB_ACTION_SAVE, 0);
    TEST_ASSERT_EQUAL(1, limb->app.limb.active);
    limb_run_ms(limb, 1000); /* the identities are stored, too */
}

void systems_restart(limb_t *limb, int number)
{
    const systems_t *system = systems_get(number);
    limb_stop_arbitrator(limb);
    for (int i = 0; i < LIMB_DEVICES; i++) {
        if (limb->parts[i].node != NULL) {
            limb_power_off(limb, i);
        }
    }
    limb_run_ms(limb, 5000);
    limb_want(limb, system->expected);
    limb_start_arbitrator(limb);
    for (int i = 0; i < LIMB_DEVICES; i++) {
        if (i != system->replaced) {
            limb_power_on(limb, i);
        }
    }
}

/* D3's wrist has what D1 has sent last, and its grip whether that is in the upper half. The copies pass D2 at
 * once. */
static void expect_sine(limb_t *limb)
{
    const limb_part_t *hand = &limb->parts[D3];
    const uint8_t sensor = pdcp_device_channel(sim_node_device(limb->parts[D1].node), 1)->node_id;
    int32_t lowest = 255;
    int32_t highest = 0;
    for (int ms = 0; ms < 2000; ms += 20) {
        limb_run_ms(limb, 20);
        TEST_ASSERT_INT_WITHIN(20, limb->last[sensor], hand->value[1]);
        TEST_ASSERT_TRUE(hand->value[2] == (hand->value[1] >= 128 ? 1 : 0));
        lowest = hand->value[1] < lowest ? hand->value[1] : lowest;
        highest = hand->value[1] > highest ? hand->value[1] : highest;
    }
    TEST_ASSERT_LESS_THAN(5, lowest);
    TEST_ASSERT_GREATER_THAN(250, highest);
}

void systems_expect_flow(limb_t *limb, int number)
{
    limb_expect_flow(limb);
    if (number != 1 && number != 4) {
        expect_sine(limb);
    }
}

void systems_report(const limb_t *limb, int number, const char *what, const char *since,
                    const limb_moment_t *from, uint32_t quiet_ms)
{
    char text[160];
    TEST_ASSERT_TRUE_MESSAGE(from->time_us != 0 && limb->linked.time_us >= from->time_us, since);
    const uint64_t took_us = limb->linked.time_us - from->time_us;
    const uint64_t bus_us = limb->linked.busy_us - from->busy_us;
    const int used =
        snprintf(text, sizeof text, "%s, %s: links restored %.1f ms after %s, bus time %.1f ms",
                 systems_get(number)->name, what, (double)took_us / 1000.0, since, (double)bus_us / 1000.0);
    (void)snprintf(&text[used], sizeof text - (size_t)used,
                   quiet_ms != 0 ? " (%u ms of quiet at the start-up included)" : "", (unsigned)quiet_ms);
    (void)printf("%s\n", text);
    TEST_ASSERT_TRUE_MESSAGE(took_us <= (100 + quiet_ms) * 1000u + bus_us, text);
}
