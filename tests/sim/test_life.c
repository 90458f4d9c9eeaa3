/* Random lives of a whole limb: devices come, go, are reset, refuse and fall silent, the line and the memory
 * fail, another arbitrator appears, the power goes, and a host asks whatever can be asked. Then all is calm,
 * and everything must be in order.
 *
 * test_life [--with=NAME,...] [FIRST [COUNT]] lives the lives with the seeds from FIRST on; LIFE_COUNT in the
 * environment is another way to live more of them. --with switches on more that happens and is looked for. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "life_run.h"
#include "pdcp_assert.h"
#include "unity.h"

enum {
    LIVES = 250,
    STORM_MS = 30000,
    CALM_MS = 66000, /* what is tried again after a while has been, and an audit's minute is over */
    WATCH_MS = 2500,
    PARTS_MAX = LIFE_ALL_MAX - LIFE_CLONES,
    LONG_VALUE = 241, /* [parameter] of each part with a long value */
    TEXT = 2000
};

life_t life;

static uint32_t first_seed = 1;
static uint32_t digest_of_lives = 2166136261u; /* of all frames and bytes: the same code lives the same */
static uint32_t seeds = LIVES;

void setUp(void) {}

void tearDown(void) {}

uint32_t life_below(uint32_t below)
{
    return life_random(&life.random, below);
}

/* --- Parts --- */

static struct {
    char channels[TEXT];
    char more[TEXT];
} clones[LIFE_CLONES];

static int put_channel(char *text, size_t size, int index, bool is_output, bool is_controller,
                       unsigned inputs)
{
    static const unsigned set_points[] = {0x1100, 0x1110, 0x1200, 0x1210, 0x1220};
    static const unsigned signals[] = {0x2100, 0x2110, 0x2120, 0x2200, 0x2210};
    static const unsigned types[] = {0x5000, 0x5000, 0x5200, 0x5400, 0x7000, 0xD200};
    const bool is_set_point = is_output == is_controller;
    const unsigned profile = is_set_point ? set_points[life_below(5)] : signals[life_below(5)];
    unsigned type = types[life_below(6)];
    if (is_output) {
        type &= 0xFC00;
    } else if (is_set_point || life_below(8) == 0) {
        type |= 0x0100;
    }
    int used = snprintf(text, size, "%s%s %04X %04X", index == 1 ? "" : "; ", is_output ? "out" : "in", type,
                        profile);
    if (inputs != 0 && life_below(100) < (is_output ? 60 : 12)) {
        used += snprintf(&text[used], size - (size_t)used, ", required = %u", 1 + life_below(inputs));
    }
    if (inputs != 0 && life_below(100) < 15) {
        used += snprintf(&text[used], size - (size_t)used, ", desired = %u", 1 + life_below(inputs));
    }
    if (is_output) {
        used += snprintf(&text[used], size - (size_t)used, ", signal = constant 1, rate_ms = %u",
                         100 + life_below(400));
    } else if ((type & 0x0100) != 0 && life_below(2) == 0) {
        used +=
            snprintf(&text[used], size - (size_t)used, ", terminal_profile = %u", set_points[life_below(5)]);
    }
    return used;
}

/* A sensor, a controller or a hand: inputs first, so that they can be required. */
static void add_part(int number)
{
    char channels[TEXT] = "";
    char more[TEXT];
    int used = 0;
    const unsigned kind = life_below(3);
    const unsigned inputs = kind == 0 ? life_below(2) : 1 + life_below(3);
    const unsigned outputs = kind == 2 ? life_below(2) : 1 + life_below(3);
    for (unsigned i = 1; i <= inputs + outputs; i++) {
        used += put_channel(&channels[used], sizeof channels - (size_t)used, (int)i, i > inputs, kind == 1,
                            inputs);
    }
    (void)snprintf(more, sizeof more,
                   "beacon_ms = %u\nack_ms = %u\n[parameter %d 0]\nvalue = x\n[parameter %d 0]\n"
                   "value = a value that is longer than four bytes\ncapacity = 600\n%s",
                   100 + life_below(900), 20 + life_below(200), LIFE_REFUSED, LONG_VALUE,
                   life_below(8) == 0 ? "[parameter 8 1]\nvalue = x\n" : "");
    (void)limb_add_with(&life.limb, (uint16_t)(number + 1), channels, more);
    if (life_is_on(LIFE_CLONES_COME) && number < LIFE_CLONES) {
        (void)snprintf(clones[number].channels, sizeof clones[number].channels, "%s", channels);
        (void)snprintf(clones[number].more, sizeof clones[number].more, "%s", more);
    }
}

/* Parts with the identities of others. */
static void add_clones(void)
{
    for (int i = 0; life_is_on(LIFE_CLONES_COME) && i < LIFE_CLONES; i++) {
        (void)limb_add_with(&life.limb, (uint16_t)(i + 1), clones[i].channels, clones[i].more);
    }
}

/* --- The world around the arbitrator --- */

bool life_is_during(uint32_t until)
{
    return life.ms < until;
}

static bool is_muted(const can_frame_t *frame)
{
    const uint8_t id = (uint8_t)(frame->id & 0xFFu);
    for (int i = 0; i < life.limb.count; i++) {
        if (life_is_during(life.mute_until[i]) && life.limb.parts[i].node != NULL &&
            pdcp_device_node_id(sim_node_device(life.limb.parts[i].node)) == id) {
            return frame->dlc >= 2 && (frame->id & 0x100u) == 0 && (frame->data[0] & 0x80u) != 0;
        }
    }
    return false;
}

static bool line_loses(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    if (life_is_during(life.black_until) ||
        (life_is_during(life.bad_until) && life_below(100) < life.loss_percent) || is_muted(frame) ||
        (life.lose_in != 0 && --life.lose_in == 0)) {
        return true;
    }
    life_watch_frame(&life.watch, frame);
    return false;
}

/* FNV-1a. */
static void digest(uint32_t value, unsigned bytes)
{
    for (; bytes > 0; bytes--) {
        digest_of_lives = (digest_of_lives ^ (value & 0xFFu)) * 16777619u;
        value >>= 8;
    }
}

static void on_frame(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    (void)ctx;
    life.frames++;
    digest((uint32_t)time_us, 4);
    digest(frame->id, 2);
    for (uint8_t i = 0; i < frame->dlc; i++) {
        digest(frame->data[i], 1);
    }
    if (life.watching && !life_check_is_calm_frame(&life.limb, frame)) {
        life.strange_frames++;
        (void)printf("seed %u: a frame in the calm: %03X#%02X%02X%02X%02X, %u bytes\n", (unsigned)life.seed,
                     frame->id, frame->data[0], frame->data[1], frame->data[2], frame->data[3], frame->dlc);
    }
}

static bool has_no_power(void)
{
    return life.limb.nvm.off;
}

static bool can_send(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    return has_no_power() || (!life.is_off && sim_world_send(&life.limb.world, frame));
}

static void can_restart(void *ctx)
{
    (void)ctx;
    life.is_off = false;
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    (void)ctx;
    const size_t taken = has_no_power() ? size : life_host_write(&life.host, bytes, size);
    for (size_t i = 0; i < taken; i++) {
        digest(bytes[i], 1);
    }
    return taken;
}

/* The memory works while it is read at the start: what cannot be read counts as empty. */
static void start_arbitrator(void)
{
    sim_nvm_power_on(&life.limb.nvm);
    life.worn_until = 0;
    life_memory_start(&life.memory);
    life.limb.settings.seed = life.seed * 2654435761u + life.ms; /* another one at each start (D-BUS-36) */
    limb_start_arbitrator(&life.limb);
    life.limb.port.can_send = can_send;
    life.limb.port.can_restart = can_restart;
    life.limb.port.host_write = host_write;
    arb_app_observe(&life.limb.app, NULL, NULL);
    memset(&life.counters, 0, sizeof life.counters);
    life.is_off = false;
    life_watch_rough(&life.watch, -1, life.ms);
    TEST_ASSERT_EQUAL_MESSAGE(life_memory_count(&life.memory), life.limb.app.limb.config.stored,
                              "configurations after the start");
}

void life_stop_arbitrator(uint32_t for_ms)
{
    if (life.limb.world.app != NULL) {
        limb_stop_arbitrator(&life.limb);
        life_host_forget(&life.host);
        life.off_until = life.ms + for_ms;
    }
}

/* --- A life --- */

/* The controller goes off the bus when the line is dead, and on again when it is restarted on a good one. */
static void tell_state(void)
{
    arb_app_t *app = &life.limb.app;
    if (life_is_during(life.black_until) && !life.is_off) {
        life.is_off = true;
        arb_app_on_state(app, sim_world_ms(&life.limb.world), PDCP_BUS_PASSIVE);
        arb_app_on_state(app, sim_world_ms(&life.limb.world), PDCP_BUS_OFF);
        sim_world_touch_app(&life.limb.world);
    } else if (!life.is_off && app->arb.recovery.state != PDCP_BUS_ACTIVE) {
        arb_app_on_state(app, sim_world_ms(&life.limb.world), PDCP_BUS_ACTIVE);
        sim_world_touch_app(&life.limb.world);
    }
}

static void mend_plugs(void)
{
    for (int i = 0; i < life.limb.count; i++) {
        if (life.loose_until[i] != 0 && !life_is_during(life.loose_until[i])) {
            life_mend_plug(i);
        }
    }
}

/* What began some time ago may end now. */
static void carry_on(void)
{
    const can_frame_t beacon = {.id = 0x100, .dlc = 1, .data = {PDCP_BEACON}};
    life_end_refusals();
    mend_plugs();
    life.host.reads = !life_is_during(life.deaf_until);
    if (!life_is_during(life.gone_until)) {
        life_host_open(&life.host);
    }
    if (life_is_during(life.foreign_until) && life.ms % 500 == 7) {
        (void)sim_bus_send(&life.limb.world.bus, life.foreign_port, &beacon);
    }
    if (life.worn_until == life.ms) {
        life.limb.nvm.busy_polls = 0;
        life.limb.nvm.reads_fail = false;
        life.limb.nvm.fail_after = SIM_NVM_NEVER;
    }
    if (life.limb.world.app == NULL && !life_is_during(life.off_until)) {
        start_arbitrator();
    }
}

static void pass_ms(void)
{
    carry_on();
    if (life.limb.world.app != NULL) {
        tell_state();
    }
    if (life.is_off) {
        life_watch_rough(&life.watch, -1, life.ms);
    }
    limb_run_ms(&life.limb, 1);
    life.ms++;
    life_watch_ms(&life.watch, life.ms);
    if (life.limb.world.app == NULL) {
        life_host_step(&life.host, &life.limb, life.ms);
        return;
    }
    if (life.limb.nvm.off) {
        life_stop_arbitrator(life_below(3000));
        return;
    }
    life_host_step(&life.host, &life.limb, life.ms);
    life_check_counters(&life.counters, &life.limb.app, sim_world_ms(&life.limb.world));
    life_check_silences(&life.limb);
}

/* Takes the place of the one that aborts only: a demand of a header that a life breaks can be tried again. */
void pdcp_assert_failed(const char *file, int line, const char *clause)
{
    (void)printf("%s:%d: broken: %s: the life with seed %u, at %u ms\n", file, line, clause,
                 (unsigned)life.seed, (unsigned)life.ms);
    (void)fflush(stdout);
    abort();
}

static void begin_life(uint32_t seed)
{
    memset(&life, 0, sizeof life);
    life.seed = seed;
    life.random.state = seed * 747796405u | 1u;
    life_host_init(&life.host, seed);
    limb_begin(&life.limb, seed, 0xFFFFFFFFu - life_below(STORM_MS));
    limb_stop_arbitrator(&life.limb);
    sim_nvm_init(&life.limb.nvm);
    life_memory_init(&life.memory, &life.limb, &life.host);
    life.limb.keeps = life_below(2) == 0;
    life.limb.settings.no_autoconfig = life_below(5) == 0;
    life.limb.world.bus.fault = line_loses;
    life.foreign_port = sim_bus_attach(&life.limb.world.bus, on_frame, NULL);
    const int parts = 2 + (int)life_below(PARTS_MAX - 1);
    life.forger = (life_forger_t){&life.limb, &life.random, &life.watch, life.foreign_port};
    life.parts = parts;
    for (int i = 0; i < parts; i++) {
        add_part(i);
    }
    add_clones();
    life_watch_init(&life.watch, &life.limb);
    life.watch.values = life_is_on(LIFE_VALUES);
    life.watch.flags = life_is_on(LIFE_FLAGS);
    life.watch.twins = life_is_on(LIFE_TWINS);
    start_arbitrator();
}

static void storm(void)
{
    const uint32_t pause_ms = 20 + life_below(400);
    for (int i = 0; i < life.parts; i++) {
        if (life_below(3) != 0) {
            limb_power_on(&life.limb, i);
        }
    }
    while (life.ms < STORM_MS) {
        if (life_below(pause_ms) == 0) {
            life_event();
        }
        if (life_is_during(life.busy_until) && life_below(20) == 0) {
            life_host_ask(&life.host, &life.limb);
        }
        pass_ms();
    }
}

/* Nothing fails any more. */
static void end_storm(void)
{
    life_forge_at_last();
    uint32_t *const lasts[] = {&life.off_until,  &life.black_until, &life.bad_until,  &life.foreign_until,
                               &life.deaf_until, &life.gone_until,  &life.busy_until, &life.worn_until};
    for (unsigned i = 0; i < sizeof lasts / sizeof lasts[0]; i++) {
        *lasts[i] = life_is_during(*lasts[i]) ? life.ms : *lasts[i];
    }
    for (int i = 0; i < LIFE_ALL_MAX; i++) {
        life.mute_until[i] = 0;
        life.loose_until[i] = life.loose_until[i] != 0 ? life.ms : 0;
        life.refuse_until[i] = life_is_during(life.refuse_until[i]) ? life.ms : life.refuse_until[i];
    }
    for (int i = life.parts; i < life.limb.count; i++) {
        if (life_is_plugged(i)) {
            life_mend_plug(i);
            limb_power_off(&life.limb, i);
        }
    }
    life_watch_calm_down(&life.watch, life.ms);
    life.limb.nvm.cut_after = SIM_NVM_NEVER;
}

static void run_ms(uint32_t ms)
{
    for (uint32_t i = 0; i < ms; i++) {
        pass_ms();
    }
}

static void calm_down(void)
{
    end_storm();
    run_ms(CALM_MS);
    TEST_ASSERT_EQUAL_MESSAGE(0, life.host.open_count, "requests without an answer");
    life.watching = true;
    run_ms(WATCH_MS);
    life.watching = false;
    TEST_ASSERT_EQUAL_MESSAGE(0, life.strange_frames, "frames on a calm bus");
    TEST_ASSERT_EQUAL_MESSAGE(0, life.limb.nvm.misuses, "misuses of the memory");
    life_check_calm(&life.limb);
    life_watch_calm(&life.watch);
}

static void test_lives(void)
{
    uint64_t asked = 0;
    uint64_t failed = 0;
    uint64_t changes = 0;
    uint64_t frames = 0;
    uint64_t events_told = 0;
    uint64_t taken = 0;
    uint32_t longest_ms = 0;
    for (uint32_t seed = first_seed; seed < first_seed + seeds; seed++) {
        begin_life(seed);
        storm();
        calm_down();
        asked += life.host.asked;
        failed += life.host.failed;
        changes += life.memory.changes;
        frames += life.frames;
        events_told += life.host.events;
        taken += life.watch.taken;
        longest_ms = life.host.longest_ms > longest_ms ? life.host.longest_ms : longest_ms;
        limb_end(&life.limb);
    }
    (void)printf(
        "%u lives of %u s: %llu frames, %llu requests, %llu of them refused, the slowest answered after %u "
        "ms, "
        "%llu events, configurations stored %llu times, digest %08X\n",
        (unsigned)seeds, (STORM_MS + CALM_MS + WATCH_MS) / 1000, (unsigned long long)frames,
        (unsigned long long)asked, (unsigned long long)failed, (unsigned)longest_ms,
        (unsigned long long)events_told, (unsigned long long)changes, (unsigned)digest_of_lives);
    if (life_is_on(LIFE_VALUES)) {
        (void)printf("%llu values, each of them of the input's source\n", (unsigned long long)taken);
    }
}

/* The same with all that holds. */
static void test_lives_with_more(void)
{
    life_switch_on("held");
    test_lives();
}

/* --- What lives have shown --- */

/* Among many thousands these showed what no test had: a plan that waits for a link makes the application
 * spin; what was queued while the bus was off is done when it is back. */
static void test_lives_that_found_something(void)
{
    static const uint32_t found[] = {2361, 13314};
    for (unsigned i = 0; i < sizeof found / sizeof found[0]; i++) {
        begin_life(found[i]);
        storm();
        calm_down();
        limb_end(&life.limb);
    }
}

int main(int argc, char **argv)
{
    const char *count = getenv("LIFE_COUNT");
    const bool chosen = argc > 1 && strncmp(argv[1], "--with=", 7) == 0;
    if (chosen) {
        life_switch_on(argv[1] + 7);
        argc--;
        argv++;
    }
    first_seed = argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 0) : 1;
    seeds = argc > 2 ? (uint32_t)strtoul(argv[2], NULL, 0) : (argc > 1 ? 1 : LIVES);
    seeds = count != NULL ? (uint32_t)strtoul(count, NULL, 0) : seeds;
    UNITY_BEGIN();
    if (argc == 1 && !chosen) {
        RUN_TEST(test_lives_that_found_something);
    }
    RUN_TEST(test_lives);
    if (argc == 1 && !chosen) {
        RUN_TEST(test_lives_with_more);
    }
    if (Unity.TestFailures != 0) {
        (void)printf("the life with seed %u, at %u ms\n", (unsigned)life.seed, (unsigned)life.ms);
    }
    return UNITY_END();
}
