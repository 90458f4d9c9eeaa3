/* Random lives of a whole limb: devices come, go, are reset, refuse and fall silent, the line and the memory
 * fail, another arbitrator appears, the power goes, and a host asks whatever can be asked. Then all is calm,
 * and everything must be in order.
 *
 * test_life [--with=NAME,...] [FIRST [COUNT]] lives the lives with the seeds from FIRST on; LIFE_COUNT in the
 * environment is another way to live more of them. --with switches on more that happens and is looked for. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "life.h"
#include "pdcp_assert.h"
#include "pdcp_time.h"
#include "unity.h"

enum {
    LIVES = 250,
    STORM_MS = 30000,
    CALM_MS = 66000, /* what is tried again after a while has been, and an audit's minute is over */
    WATCH_MS = 2500,
    PARTS_MAX = 8,
    CLONES = 2, /* of the first parts */
    ALL_MAX = PARTS_MAX + CLONES,
    CHANNELS_MAX = 6,
    REFUSED = 240, /* [parameter] of each part that stands for what it refuses */
    LONG_VALUE = 241,
    RECOVERY_MS =
        3200,       /* longest pause after a black-out until the controller is on again (PDCP_RECOVERY_MS) */
    LOST_MS = 3000, /* between two frames that are lost one by one */
    STANDBY_MS = 3000, /* an arbitrator is silent so long after another's beacon, at most (D-BUS-12) */
    TEXT = 2000
};

typedef struct {
    limb_t limb; /* the first: the port's ctx */
    life_host_t host;
    life_memory_t memory;
    life_counters_t counters;
    life_watch_t watch;
    life_forger_t forger;
    life_random_t random;
    uint32_t seed;
    uint32_t ms;         /* of this life */
    uint32_t busy_until; /* of the host: it asks a lot */
    /* Until when it lasts; below ms: it does not. */
    uint32_t off_until;     /* the arbitrator has no power */
    uint32_t black_until;   /* nothing passes the line, and its controller is off the bus */
    uint32_t bad_until;     /* frames are lost */
    uint32_t foreign_until; /* another arbitrator beacons */
    uint32_t deaf_until;    /* the host does not read */
    uint32_t gone_until;    /* the host has closed */
    uint32_t worn_until;    /* the memory fails or is slow */
    uint32_t mute_until[ALL_MAX];
    uint32_t refuse_until[ALL_MAX];
    uint32_t loose_until[ALL_MAX];
    int parts; /* those after them are clones */
    uint32_t loss_percent;
    uint32_t lose_in;       /* frames, until one is lost; 0: none will be */
    uint32_t lose_again_ms; /* not before */
    int foreign_port;
    bool is_off; /* the bus, for the arbitrator's controller */
    bool watching;
    uint32_t strange_frames;
    uint64_t frames;
} life_t;

static life_t life;

static uint32_t first_seed = 1;
static uint32_t digest_of_lives = 2166136261u; /* of all frames and bytes: the same code lives the same */
static uint32_t seeds = LIVES;

void setUp(void) {}

void tearDown(void) {}

static uint32_t chance(uint32_t below)
{
    return life_random(&life.random, below);
}

/* --- Parts --- */

static struct {
    char channels[TEXT];
    char more[TEXT];
} clones[CLONES];

static int put_channel(char *text, size_t size, int index, bool is_output, bool is_controller,
                       unsigned inputs)
{
    static const unsigned set_points[] = {0x1100, 0x1110, 0x1200, 0x1210, 0x1220};
    static const unsigned signals[] = {0x2100, 0x2110, 0x2120, 0x2200, 0x2210};
    static const unsigned types[] = {0x5000, 0x5000, 0x5200, 0x5400, 0x7000, 0xD200};
    const bool is_set_point = is_output == is_controller;
    const unsigned profile = is_set_point ? set_points[chance(5)] : signals[chance(5)];
    unsigned type = types[chance(6)];
    if (is_output) {
        type &= 0xFC00;
    } else if (is_set_point || chance(8) == 0) {
        type |= 0x0100;
    }
    int used = snprintf(text, size, "%s%s %04X %04X", index == 1 ? "" : "; ", is_output ? "out" : "in", type,
                        profile);
    if (inputs != 0 && chance(100) < (is_output ? 60 : 12)) {
        used += snprintf(&text[used], size - (size_t)used, ", required = %u", 1 + chance(inputs));
    }
    if (inputs != 0 && chance(100) < 15) {
        used += snprintf(&text[used], size - (size_t)used, ", desired = %u", 1 + chance(inputs));
    }
    if (is_output) {
        used += snprintf(&text[used], size - (size_t)used, ", signal = constant 1, rate_ms = %u",
                         100 + chance(400));
    } else if ((type & 0x0100) != 0 && chance(2) == 0) {
        used += snprintf(&text[used], size - (size_t)used, ", terminal_profile = %u", set_points[chance(5)]);
    }
    return used;
}

/* A sensor, a controller or a hand: inputs first, so that they can be required. */
static void add_part(int number)
{
    char channels[TEXT] = "";
    char more[TEXT];
    int used = 0;
    const unsigned kind = chance(3);
    const unsigned inputs = kind == 0 ? chance(2) : 1 + chance(3);
    const unsigned outputs = kind == 2 ? chance(2) : 1 + chance(3);
    for (unsigned i = 1; i <= inputs + outputs; i++) {
        used += put_channel(&channels[used], sizeof channels - (size_t)used, (int)i, i > inputs, kind == 1,
                            inputs);
    }
    (void)snprintf(more, sizeof more,
                   "beacon_ms = %u\nack_ms = %u\n[parameter %d 0]\nvalue = x\n[parameter %d 0]\n"
                   "value = a value that is longer than four bytes\ncapacity = 600\n%s",
                   100 + chance(900), 20 + chance(200), REFUSED, LONG_VALUE,
                   chance(8) == 0 ? "[parameter 8 1]\nvalue = x\n" : "");
    (void)limb_add_with(&life.limb, (uint16_t)(number + 1), channels, more);
    if (life_is_on(LIFE_CLONES_COME) && number < CLONES) {
        (void)snprintf(clones[number].channels, sizeof clones[number].channels, "%s", channels);
        (void)snprintf(clones[number].more, sizeof clones[number].more, "%s", more);
    }
}

/* Parts with the identities of others. */
static void add_clones(void)
{
    for (int i = 0; life_is_on(LIFE_CLONES_COME) && i < CLONES; i++) {
        (void)limb_add_with(&life.limb, (uint16_t)(i + 1), clones[i].channels, clones[i].more);
    }
}

/* --- The world around the arbitrator --- */

static bool is_during(uint32_t until)
{
    return life.ms < until;
}

static bool is_muted(const can_frame_t *frame)
{
    const uint8_t id = (uint8_t)(frame->id & 0xFFu);
    for (int i = 0; i < life.limb.count; i++) {
        if (is_during(life.mute_until[i]) && life.limb.parts[i].node != NULL &&
            pdcp_device_node_id(sim_node_device(life.limb.parts[i].node)) == id) {
            return frame->dlc >= 2 && (frame->id & 0x100u) == 0 && (frame->data[0] & 0x80u) != 0;
        }
    }
    return false;
}

static bool line_loses(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    if (is_during(life.black_until) || (is_during(life.bad_until) && chance(100) < life.loss_percent) ||
        is_muted(frame) || (life.lose_in != 0 && --life.lose_in == 0)) {
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

static void stop_arbitrator(uint32_t for_ms)
{
    if (life.limb.world.app != NULL) {
        limb_stop_arbitrator(&life.limb);
        life_host_forget(&life.host);
        life.off_until = life.ms + for_ms;
    }
}

/* --- Events --- */

/* The plug of a part has contact again. */
static void mend_plug(int part)
{
    life.loose_until[part] = 0;
    life.watch.cut[part] = false;
    limb_cut(&life.limb, part, false);
}

static void plug_or_pull(void)
{
    const int part = (int)chance((uint32_t)life.parts);
    const bool again = chance(3) == 0;
    if (life.limb.parts[part].node == NULL) {
        if (chance(4) == 0) {
            limb_blank(&life.limb, part);
        }
        limb_power_on(&life.limb, part);
        return;
    }
    mend_plug(part);
    limb_power_off(&life.limb, part);
    if (again) {
        limb_power_on(&life.limb, part); /* it has forgotten that it was bound */
    }
}

static void mute(void)
{
    const uint32_t until_ms = life.ms + 50 + chance(3000);
    const int part = (int)chance((uint32_t)life.limb.count);
    life.mute_until[part] = until_ms;
    life_watch_rough(&life.watch, part, life.mute_until[part]);
}

static node_ini_t *ini_of(int part)
{
    return life.limb.parts[part].ini;
}

/* A part refuses one parameter of one channel for a while. Transfer enabled only while it is not, or it could
 * not be told to be silent. */
static void refuse(void)
{
    const int part = (int)chance((uint32_t)life.limb.count);
    pdcp_device_extra_t *extra = &ini_of(part)->extras[0];
    const sim_node_t *node = life.limb.parts[part].node;
    if (is_during(life.refuse_until[part]) || ini_of(part)->desc.channel_count == 0) {
        return;
    }
    const uint8_t channel = (uint8_t)(1 + chance(ini_of(part)->desc.channel_count));
    const uint8_t param = (uint8_t)(PDCP_CH_ENABLED + chance(4));
    if (param == PDCP_CH_ENABLED &&
        (node == NULL || pdcp_device_channel(sim_node_device(node), channel)->enabled)) {
        return;
    }
    extra->param = param;
    extra->channel = channel;
    life.refuse_until[part] = life.ms + 100 + chance(6000);
    life_watch_rough(&life.watch, part, life.refuse_until[part]);
}

static void end_refusals(void)
{
    for (int i = 0; i < life.limb.count; i++) {
        if (life.refuse_until[i] == life.ms) {
            ini_of(i)->extras[0].param = REFUSED;
            ini_of(i)->extras[0].channel = 0;
        }
    }
}

static void spoil_line(void)
{
    life.bad_until = life.ms + 100 + chance(4000);
    life.loss_percent = 2 + chance(40);
    life_watch_rough(&life.watch, -1, life.bad_until);
}

static void black_out(void)
{
    life.black_until = life.ms + 20 + chance(2500);
    life_watch_rough(&life.watch, -1, life.black_until);
}

static void wear_memory(void)
{
    sim_nvm_t *nvm = &life.limb.nvm;
    life.worn_until = life.ms + 100 + chance(3000);
    if (chance(3) == 0) {
        nvm->busy_polls = (uint8_t)chance(40);
    } else if (chance(3) == 0) {
        nvm->reads_fail = true;
        life.memory.unsure = true;
    } else {
        nvm->fail_after = chance(20);
    }
}

static void cut_power(void)
{
    if (chance(2) == 0) {
        stop_arbitrator(chance(3) == 0 ? 0 : chance(5000));
        return;
    }
    life.limb.nvm.cut_after = chance(1500); /* at some byte that will be written */
    life.limb.nvm.cut = (sim_nvm_cut_t)chance(SIM_NVM_CUTS);
}

static void ask(void)
{
    if (chance(3) == 0) {
        life.busy_until = life.ms + chance(2000);
    }
    for (uint32_t left = 1 + chance(chance(4) == 0 ? 8 : 2); left != 0; left--) {
        life_host_ask(&life.host, &life.limb);
    }
}

static void babble(void)
{
    life_host_babble(&life.host, &life.limb, life.ms);
}

static void turn_deaf(void)
{
    life.deaf_until = life.ms + chance(4000);
}

static void close_host(void)
{
    life.gone_until = life.ms + 1 + chance(2000);
    life_host_close(&life.host, &life.limb);
}

static void meet_another(void)
{
    life.foreign_until = life.ms + 100 + chance(4000);
    life_watch_rough(&life.watch, -1, life.foreign_until + STANDBY_MS);
}

/* --- Events that are switched on --- */

static bool is_plugged(int part)
{
    return life.limb.parts[part].node != NULL;
}

/* One frame is lost, and none for some time before and behind it: all that matters is repeated, and a limb
 * must not notice. */
static void lose_one(void)
{
    if (life_is_on(LIFE_LOST_FRAMES) && life.ms >= life.lose_again_ms) {
        life.lose_in = 1 + chance(10);
        life.lose_again_ms = life.ms + LOST_MS;
    }
}

static void plug_or_pull_clone(void)
{
    const int clone = life.parts + (int)chance(CLONES);
    if (is_plugged(clone)) {
        mend_plug(clone);
        limb_power_off(&life.limb, clone);
    } else {
        limb_power_on(&life.limb, clone);
        lose_one();
    }
}

/* Its power stays on; often for so long that it is given up. */
static void loosen_plug(void)
{
    const int part = (int)chance((uint32_t)life.limb.count);
    if (is_plugged(part) && !is_during(life.loose_until[part])) {
        life.loose_until[part] = life.ms + (chance(2) == 0 ? 20 + chance(3000) : 10000 + chance(8000));
        life.watch.cut[part] = true;
        limb_cut(&life.limb, part, true);
        life_watch_rough(&life.watch, part, life.loose_until[part]);
    }
}

static void restart(void)
{
    stop_arbitrator(0);
}

static void forge_flag(void)
{
    life_forge_flag(&life.forger);
}

static void forge_source(void)
{
    life_forge_source(&life.forger, life.ms);
}

static void forge_suspend(void)
{
    life_forge_suspend(&life.forger);
}

static void forge_reset(void)
{
    life_forge_reset(&life.forger);
}

static void beacon_of_unknown(void)
{
    life_forge_unknown(&life.forger);
}

static void beacon_of_another(void)
{
    life_forge_arbitrator(&life.forger);
    life_watch_rough(&life.watch, -1, life.ms + STANDBY_MS);
}

static const struct {
    void (*happens)(void);
    int number; /* of its switch; LIFE_SWITCHES: it always happens */
    uint8_t weight;
} events[] = {{ask, LIFE_SWITCHES, 30},
              {plug_or_pull, LIFE_SWITCHES, 12},
              {mute, LIFE_SWITCHES, 6},
              {refuse, LIFE_SWITCHES, 6},
              {spoil_line, LIFE_SWITCHES, 3},
              {black_out, LIFE_SWITCHES, 2},
              {wear_memory, LIFE_SWITCHES, 4},
              {cut_power, LIFE_SWITCHES, 2},
              {babble, LIFE_SWITCHES, 4},
              {turn_deaf, LIFE_SWITCHES, 2},
              {close_host, LIFE_SWITCHES, 2},
              {meet_another, LIFE_SWITCHES, 1},
              {plug_or_pull_clone, LIFE_CLONES_COME, 8},
              {loosen_plug, LIFE_LOOSE_PLUGS, 8},
              {lose_one, LIFE_LOST_FRAMES, 8},
              {restart, LIFE_RESTARTS, 3},
              {forge_flag, LIFE_FORGED_FLAGS, 4},
              {forge_source, LIFE_FORGED_SOURCES, 6},
              {forge_suspend, LIFE_FORGED_SUSPENDS, 3},
              {forge_reset, LIFE_FORGED_RESETS, 3},
              {beacon_of_unknown, LIFE_UNKNOWN_BEACONS, 2},
              {beacon_of_another, LIFE_FOREIGN_BEACONS, 1}};

static uint8_t weight_of(unsigned k)
{
    return events[k].number == LIFE_SWITCHES || life_is_on(events[k].number) ? events[k].weight : 0;
}

static void happen(void)
{
    unsigned sum = 0;
    for (unsigned k = 0; k < sizeof events / sizeof events[0]; k++) {
        sum += weight_of(k);
    }
    unsigned left = chance(sum);
    unsigned k = 0;
    while (left >= weight_of(k)) {
        left -= weight_of(k++);
    }
    events[k].happens();
}

/* --- A life --- */

/* The controller goes off the bus when the line is dead, and on again when it is restarted on a good one. */
static void tell_state(void)
{
    arb_app_t *app = &life.limb.app;
    if (is_during(life.black_until) && !life.is_off) {
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
        if (life.loose_until[i] != 0 && !is_during(life.loose_until[i])) {
            mend_plug(i);
        }
    }
}

/* What began some time ago may end now. */
static void carry_on(void)
{
    const can_frame_t beacon = {.id = 0x100, .dlc = 1, .data = {PDCP_BEACON}};
    end_refusals();
    mend_plugs();
    life.host.reads = !is_during(life.deaf_until);
    if (!is_during(life.gone_until)) {
        life_host_open(&life.host);
    }
    if (is_during(life.foreign_until) && life.ms % 500 == 7) {
        (void)sim_bus_send(&life.limb.world.bus, life.foreign_port, &beacon);
    }
    if (life.worn_until == life.ms) {
        life.limb.nvm.busy_polls = 0;
        life.limb.nvm.reads_fail = false;
        life.limb.nvm.fail_after = SIM_NVM_NEVER;
    }
    if (life.limb.world.app == NULL && !is_during(life.off_until)) {
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
        stop_arbitrator(chance(3000));
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
    limb_begin(&life.limb, seed, 0xFFFFFFFFu - chance(STORM_MS));
    limb_stop_arbitrator(&life.limb);
    sim_nvm_init(&life.limb.nvm);
    life_memory_init(&life.memory, &life.limb, &life.host);
    life.limb.keeps = chance(2) == 0;
    life.limb.settings.no_autoconfig = chance(5) == 0;
    life.limb.world.bus.fault = line_loses;
    life.foreign_port = sim_bus_attach(&life.limb.world.bus, on_frame, NULL);
    const int parts = 2 + (int)chance(PARTS_MAX - 1);
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
    const uint32_t pause_ms = 20 + chance(400);
    for (int i = 0; i < life.parts; i++) {
        if (chance(3) != 0) {
            limb_power_on(&life.limb, i);
        }
    }
    while (life.ms < STORM_MS) {
        if (chance(pause_ms) == 0) {
            happen();
        }
        if (is_during(life.busy_until) && chance(20) == 0) {
            life_host_ask(&life.host, &life.limb);
        }
        pass_ms();
    }
}

/* A last word of those who forge: nothing else that happens mends what it does. */
static void forge_at_last(void)
{
    for (unsigned k = 0; k < sizeof events / sizeof events[0]; k++) {
        if (events[k].number >= LIFE_FORGED_FLAGS && events[k].number < LIFE_SWITCHES &&
            life_is_on(events[k].number)) {
            events[k].happens();
        }
    }
}

/* Nothing fails any more. */
static void end_storm(void)
{
    forge_at_last();
    uint32_t *const lasts[] = {&life.off_until,  &life.black_until, &life.bad_until,  &life.foreign_until,
                               &life.deaf_until, &life.gone_until,  &life.busy_until, &life.worn_until};
    for (unsigned i = 0; i < sizeof lasts / sizeof lasts[0]; i++) {
        *lasts[i] = is_during(*lasts[i]) ? life.ms : *lasts[i];
    }
    for (int i = 0; i < ALL_MAX; i++) {
        life.mute_until[i] = 0;
        life.loose_until[i] = life.loose_until[i] != 0 ? life.ms : 0;
        life.refuse_until[i] = is_during(life.refuse_until[i]) ? life.ms : life.refuse_until[i];
    }
    for (int i = life.parts; i < life.limb.count; i++) {
        if (is_plugged(i)) {
            mend_plug(i);
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

/* A sensor, a controller whose output requires its input, and a motor have linked themselves. */
static limb_t *begin_case(void)
{
    static limb_t limb;
    limb_begin(&limb, 1, 0xFFFFFFFFu - 700u);
    (void)limb_add(&limb, 1, "out 5000 2110");
    (void)limb_add(&limb, 2, "in 5200 2110; out 5000 1110, required = 1, signal = copy 1");
    (void)limb_add(&limb, 3, "in 5300 1110");
    limb_want(&limb, "1.1>2.1 2.2>3.1");
    limb_plug(&limb, 0, 2);
    limb_await(&limb, 2000);
    return &limb;
}

/* The host takes away the link of a required input: what requires it rests, and comes back with it (D-PRO-9,
 * D-PRO-25), in a stored configuration, too. */
static void expect_that_it_is_missed(bool stored)
{
    limb_t *limb = begin_case();
    static const uint8_t input[] = {2, 0, 2, 0, 2, 0, 1};
    if (stored) {
        (void)limb_act(limb, ARB_ACTION_SAVE, 0);
    }
    TEST_ASSERT_EQUAL_HEX16(0x2411, limb_ask(limb, 0x2410, input, sizeof input));
    limb_run_ms(limb, 100);
    limb_expect(limb, "");
    TEST_ASSERT_EQUAL(1, pdcp_tables_count_links(&limb->app.arb.bus.tables));
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(limb, 1, 1, 2, 1));
    limb_run_ms(limb, 100);
    limb_expect(limb, "1.1>2.1 2.2>3.1");
    limb_end(limb);
}

static void test_a_removed_link_is_missed(void)
{
    expect_that_it_is_missed(false);
    expect_that_it_is_missed(true);
}

static bool lose_all(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    (void)frame;
    return true;
}

/* A device is lost while what the host has asked for waits for the links: the plan does not insist on a link
 * that cannot be made any more. */
static void test_a_device_goes_while_sole_access_is_enforced(void)
{
    limb_t *limb = begin_case();
    pdcp_arb_t *arb = &limb->app.arb;
    const uint8_t place = pdcp_tables_find(&arb->bus.tables, &limb->parts[1].ini->desc.identity);
    limb_power_off(limb, 2);
    limb_run_ms(limb, 1000);
    while (limb->lost.time_us == 0 &&
           !pdcp_time_reached(sim_world_ms(&limb->world), arb->bus.tables.devices[2].heard_ms + 1400)) {
        limb_run_ms(limb, 1);
    }
    limb->world.bus.fault = lose_all;
    TEST_ASSERT_TRUE(
        pdcp_arb_disconnect(arb, pdcp_tables_channel(&arb->bus.tables, place, 1))); /* unanswered: 300 ms */
    profile_run_begin(&limb->app.limb.run, PROFILE_PLAN_ENFORCE, false);
    sim_world_touch_app(&limb->world);
    limb_run_ms(limb, 400);
    TEST_ASSERT_TRUE(limb->lost.time_us != 0);
    limb->world.bus.fault = NULL;
    limb_run_ms(limb, 6000);
    TEST_ASSERT_FALSE(arb_limb_is_busy(&limb->app.limb));
    limb_expect(limb, "");
    limb_end(limb);
}

/* Answers of part 3 are lost, its beacons are not. */
static bool mute_third(void *ctx, const can_frame_t *frame)
{
    const limb_t *limb = ctx;
    return frame->dlc > 1 &&
           frame->id == pdcp_can_id(PDCP_PRIORITY_NORMAL, false,
                                    pdcp_device_node_id(sim_node_device(limb->parts[2].node)));
}

/* A device that beacons and does not answer is told to be silent again and again (D-BUS-22); that must not
 * keep the others from being linked. */
static void test_a_mute_device_holds_up_nobody(void)
{
    limb_t *limb = begin_case();
    limb->world.bus.fault_ctx = limb;
    limb->world.bus.fault = mute_third;
    limb_power_off(limb, 1);
    limb_run_ms(limb, 4000);
    limb_want(limb, "1.1>2.1");
    limb_power_on(limb, 1);
    limb_run_ms(limb, 3000);
    TEST_ASSERT_TRUE_MESSAGE(limb->linked.time_us != 0 && limb->linked.time_us - limb->ready.time_us < 120000,
                             "the others wait for it");
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(limb, 1, 1, 2, 1));
    limb->world.bus.fault = NULL;
    limb_want(limb, "1.1>2.1 2.2>3.1");
    limb_await(limb, 7000);
    limb_end(limb);
}

/* An action of the host before the start-up does not take its place: what is stored is loaded all the
 * same. */
static void test_an_action_does_not_forestall_the_start_up(void)
{
    static const arb_action_t actions[] = {ARB_ACTION_AUTOCONFIGURE, ARB_ACTION_CLEAR, ARB_ACTION_ENFORCE,
                                           ARB_ACTION_REPLACE};
    limb_t *limb = begin_case();
    (void)limb_act(limb, ARB_ACTION_SAVE, 0);
    limb_stop_arbitrator(limb);
    limb_pull(limb, 0, 2);
    limb_start_arbitrator(limb);
    for (unsigned i = 0; i < sizeof actions / sizeof actions[0]; i++) {
        TEST_ASSERT_EQUAL(0, limb_act(limb, actions[i], 0)); /* no devices */
    }
    limb_want(limb, "1.1>2.1 2.2>3.1");
    limb->ready.time_us = 0;
    limb_plug(limb, 0, 2);
    while (limb->ready.time_us == 0) {
        limb_run_ms(limb, 1);
    }
    (void)limb_act(limb, ARB_ACTION_ENFORCE, 0); /* waits for it */
    TEST_ASSERT_EQUAL(PROFILE_RUNNING, arb_limb_state(&limb->app.limb));
    limb_await(limb, 1000);
    TEST_ASSERT_EQUAL(1, limb->app.limb.active);
    limb_end(limb);
}

/* What was to be saved is forgotten with the limb when another arbitrator takes over. */
static void test_nothing_is_saved_on_standby(void)
{
    limb_t *limb = begin_case();
    const can_frame_t beacon = {.id = 0x100, .dlc = 1, .data = {PDCP_BEACON}};
    const uint8_t flags = ARB_FLAGS_FACTORY | ARB_FLAG_AUTO_SAVE;
    const int port = sim_bus_attach(&limb->world.bus, NULL, NULL);
    limb_stop_arbitrator(limb);
    limb_run_ms(limb, 100);
    limb_start_arbitrator(limb);
    TEST_ASSERT_EQUAL_HEX16(0x2405, limb_ask(limb, 0x2404, &flags, 1));
    limb->ready.time_us = 0;
    limb_pull(limb, 0, 2);
    limb_plug(limb, 0, 2);
    while (limb->events[PDCP_EVENT_READY] < 6) {
        limb_run_ms(limb, 1);
    }
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(limb, 1, 1, 2, 1)); /* a change that is to be saved */
    for (int i = 0; i < 16; i++) { /* it serves: a device answers it (D-BUS-42) */
        const uint8_t id = pdcp_device_node_id(sim_node_device(limb->parts[0].node));
        const can_frame_t question = {.id = (uint16_t)(0x300u + id), .dlc = 3, .data = {0x03, 0x0A, 0x00}};
        TEST_ASSERT_TRUE(sim_bus_send(&limb->world.bus, port, &beacon));
        TEST_ASSERT_TRUE(sim_bus_send(&limb->world.bus, port, &question));
        limb_run_ms(limb, 500);
    }
    TEST_ASSERT_EQUAL(1, limb->events[PDCP_EVENT_SILENT]);
    TEST_ASSERT_EQUAL(0, limb->app.limb.config.stored);
    limb_end(limb);
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
        RUN_TEST(test_a_removed_link_is_missed);
        RUN_TEST(test_a_mute_device_holds_up_nobody);
        RUN_TEST(test_an_action_does_not_forestall_the_start_up);
        RUN_TEST(test_nothing_is_saved_on_standby);
        RUN_TEST(test_a_device_goes_while_sole_access_is_enforced);
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
