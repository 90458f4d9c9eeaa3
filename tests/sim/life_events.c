#include "life_run.h"

enum {
    LOST_MS = 3000,   /* between two frames that are lost one by one */
    STANDBY_MS = 3000 /* an arbitrator is silent so long after another's beacon, at most (D-BUS-12) */
};

void life_mend_plug(int part)
{
    life.loose_until[part] = 0;
    life.watch.cut[part] = false;
    limb_cut(&life.limb, part, false);
}

static void plug_or_pull(void)
{
    const int part = (int)life_below((uint32_t)life.parts);
    const bool again = life_below(3) == 0;
    if (life.limb.parts[part].node == NULL) {
        if (life_below(4) == 0) {
            limb_blank(&life.limb, part);
        }
        limb_power_on(&life.limb, part);
        return;
    }
    life_mend_plug(part);
    limb_power_off(&life.limb, part);
    if (again) {
        limb_power_on(&life.limb, part); /* it has forgotten that it was bound */
    }
}

static void mute(void)
{
    const uint32_t until_ms = life.ms + 50 + life_below(3000);
    const int part = (int)life_below((uint32_t)life.limb.count);
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
    const int part = (int)life_below((uint32_t)life.limb.count);
    pdcp_device_extra_t *extra = &ini_of(part)->extras[0];
    const sim_node_t *node = life.limb.parts[part].node;
    if (life_is_during(life.refuse_until[part]) || ini_of(part)->desc.channel_count == 0) {
        return;
    }
    const uint8_t channel = (uint8_t)(1 + life_below(ini_of(part)->desc.channel_count));
    const uint8_t param = (uint8_t)(PDCP_CH_ENABLED + life_below(4));
    if (param == PDCP_CH_ENABLED &&
        (node == NULL || pdcp_device_channel(sim_node_device(node), channel)->enabled)) {
        return;
    }
    extra->param = param;
    extra->channel = channel;
    life.refuse_until[part] = life.ms + 100 + life_below(6000);
    life_watch_rough(&life.watch, part, life.refuse_until[part]);
}

void life_end_refusals(void)
{
    for (int i = 0; i < life.limb.count; i++) {
        if (life.refuse_until[i] == life.ms) {
            ini_of(i)->extras[0].param = LIFE_REFUSED;
            ini_of(i)->extras[0].channel = 0;
        }
    }
}

static void spoil_line(void)
{
    life.bad_until = life.ms + 100 + life_below(4000);
    life.loss_percent = 2 + life_below(40);
    life_watch_rough(&life.watch, -1, life.bad_until);
}

static void black_out(void)
{
    life.black_until = life.ms + 20 + life_below(2500);
    life_watch_rough(&life.watch, -1, life.black_until);
}

static void wear_memory(void)
{
    sim_nvm_t *nvm = &life.limb.nvm;
    life.worn_until = life.ms + 100 + life_below(3000);
    if (life_below(3) == 0) {
        nvm->busy_polls = (uint8_t)life_below(40);
    } else if (life_below(3) == 0) {
        nvm->reads_fail = true;
        life.memory.unsure = true;
    } else {
        nvm->fail_after = life_below(20);
    }
}

static void cut_power(void)
{
    if (life_below(2) == 0) {
        life_stop_arbitrator(life_below(3) == 0 ? 0 : life_below(5000));
        return;
    }
    life.limb.nvm.cut_after = life_below(1500); /* at some byte that will be written */
    life.limb.nvm.cut = (sim_nvm_cut_t)life_below(SIM_NVM_CUTS);
}

static void ask(void)
{
    if (life_below(3) == 0) {
        life.busy_until = life.ms + life_below(2000);
    }
    for (uint32_t left = 1 + life_below(life_below(4) == 0 ? 8 : 2); left != 0; left--) {
        life_host_ask(&life.host, &life.limb);
    }
}

static void babble(void)
{
    life_host_babble(&life.host, &life.limb, life.ms);
}

static void turn_deaf(void)
{
    life.deaf_until = life.ms + life_below(4000);
}

static void close_host(void)
{
    life.gone_until = life.ms + 1 + life_below(2000);
    life_host_close(&life.host, &life.limb);
}

static void meet_another(void)
{
    life.foreign_until = life.ms + 100 + life_below(4000);
    life_watch_rough(&life.watch, -1, life.foreign_until + STANDBY_MS);
}

/* --- Events that are switched on --- */

bool life_is_plugged(int part)
{
    return life.limb.parts[part].node != NULL;
}

/* One frame is lost, and none for some time before and behind it: all that matters is repeated, and a limb
 * must not notice. */
static void lose_one(void)
{
    if (life_is_on(LIFE_LOST_FRAMES) && life.ms >= life.lose_again_ms) {
        life.lose_in = 1 + life_below(10);
        life.lose_again_ms = life.ms + LOST_MS;
    }
}

static void plug_or_pull_clone(void)
{
    const int clone = life.parts + (int)life_below(LIFE_CLONES);
    if (life_is_plugged(clone)) {
        life_mend_plug(clone);
        limb_power_off(&life.limb, clone);
    } else {
        limb_power_on(&life.limb, clone);
        lose_one();
    }
}

/* Its power stays on; often for so long that it is given up. */
static void loosen_plug(void)
{
    const int part = (int)life_below((uint32_t)life.limb.count);
    if (life_is_plugged(part) && !life_is_during(life.loose_until[part])) {
        life.loose_until[part] =
            life.ms + (life_below(2) == 0 ? 20 + life_below(3000) : 10000 + life_below(8000));
        life.watch.cut[part] = true;
        limb_cut(&life.limb, part, true);
        life_watch_rough(&life.watch, part, life.loose_until[part]);
    }
}

static void restart(void)
{
    life_stop_arbitrator(0);
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

void life_event(void)
{
    unsigned sum = 0;
    for (unsigned k = 0; k < sizeof events / sizeof events[0]; k++) {
        sum += weight_of(k);
    }
    unsigned left = life_below(sum);
    unsigned k = 0;
    while (left >= weight_of(k)) {
        left -= weight_of(k++);
    }
    events[k].happens();
}

void life_forge_at_last(void)
{
    for (unsigned k = 0; k < sizeof events / sizeof events[0]; k++) {
        if (events[k].number >= LIFE_FORGED_FLAGS && events[k].number < LIFE_SWITCHES &&
            life_is_on(events[k].number)) {
            events[k].happens();
        }
    }
}
