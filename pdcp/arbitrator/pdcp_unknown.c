#include "pdcp_unknown.h"

#include <string.h>

enum {
    TICKS = 255, /* ticks are numbered 1 to 255; 0 stands for none */
    SWEEP_EVERY = 10
};

void pdcp_unknown_init(pdcp_unknown_t *unknown, uint32_t now_ms)
{
    memset(unknown, 0, sizeof *unknown);
    unknown->tick_ms = now_ms;
    unknown->tick = 1;
    unknown->swept = 1;
}

static uint8_t tick_behind(uint8_t tick, uint8_t ticks)
{
    return (uint8_t)((tick - 1u + ticks) % TICKS + 1u);
}

/* Ticks that have passed since this one. The tick of a Reset is rounded up: the next one has not come yet. */
static uint8_t ticks_since(const pdcp_unknown_t *unknown, uint8_t tick)
{
    const uint8_t now = unknown->tick;
    if (tick == tick_behind(now, 1)) {
        return 0;
    }
    return (uint8_t)(now >= tick ? now - tick : now + TICKS - tick);
}

/* Notes the tick of a frame, or of a Reset. */
static void set_tick(pdcp_unknown_t *unknown, uint8_t id, uint8_t tick, bool told)
{
    unknown->heard[id] = tick;
    pdcp_bit_set(unknown->told, id, told);
    pdcp_bit_set(unknown->answered, id, false);
}

/* Forgets what is too old to matter, before its tick comes round again. */
static void sweep(pdcp_unknown_t *unknown)
{
    unknown->swept = unknown->tick;
    for (unsigned id = 0; id < PDCP_UNKNOWN_IDS; id++) {
        const uint8_t tick = unknown->heard[id];
        if (tick != 0 && ticks_since(unknown, tick) >= PDCP_UNKNOWN_QUIET) {
            set_tick(unknown, (uint8_t)id, 0, false);
        }
    }
}

void pdcp_unknown_on_time(pdcp_unknown_t *unknown, uint32_t now_ms)
{
    const uint32_t passed_ms = now_ms - unknown->tick_ms;
    if (passed_ms < PDCP_UNKNOWN_TICK_MS) { /* most often, and a division is dear */
        return;
    }
    const uint32_t ticks = passed_ms / PDCP_UNKNOWN_TICK_MS;
    if (ticks >= PDCP_UNKNOWN_QUIET) {
        pdcp_unknown_init(unknown, now_ms);
        return;
    }
    unknown->tick_ms += ticks * PDCP_UNKNOWN_TICK_MS;
    unknown->tick = tick_behind(unknown->tick, (uint8_t)ticks);
    if (ticks_since(unknown, unknown->swept) >= SWEEP_EVERY) {
        sweep(unknown);
    }
}

/* Was it told to reset less than a second ago? */
static bool is_told(const pdcp_unknown_t *unknown, uint8_t id)
{
    return pdcp_bit(unknown->told, id) && ticks_since(unknown, unknown->heard[id]) < PDCP_UNKNOWN_RESET_PAUSE;
}

void pdcp_unknown_note(pdcp_unknown_t *unknown, uint32_t now_ms, uint8_t id)
{
    pdcp_unknown_on_time(unknown, now_ms);
    if (is_told(unknown, id)) { /* the time of the Reset stays, for its pause */
        pdcp_bit_set(unknown->answered, id, false);
    } else {
        set_tick(unknown, id, unknown->tick, false);
    }
}

void pdcp_unknown_note_answer(pdcp_unknown_t *unknown, uint32_t now_ms, uint8_t id)
{
    pdcp_unknown_note(unknown, now_ms, id);
    pdcp_bit_set(unknown->answered, id, is_told(unknown, id));
}

/* The time of the Reset is rounded up to a whole tick (D-BUS-47). */
bool pdcp_unknown_tell(pdcp_unknown_t *unknown, uint32_t now_ms, uint8_t id)
{
    pdcp_unknown_on_time(unknown, now_ms);
    if (is_told(unknown, id)) {
        return false;
    }
    const bool is_whole = now_ms == unknown->tick_ms;
    set_tick(unknown, id, is_whole ? unknown->tick : tick_behind(unknown->tick, 1), true);
    return true;
}

uint8_t pdcp_unknown_silence(const pdcp_unknown_t *unknown, uint8_t id)
{
    const uint8_t tick = unknown->heard[id];
    if (tick == 0 || pdcp_bit(unknown->answered, id)) {
        return PDCP_UNKNOWN_QUIET;
    }
    const uint8_t ticks = ticks_since(unknown, tick);
    return ticks < PDCP_UNKNOWN_QUIET ? ticks : (uint8_t)PDCP_UNKNOWN_QUIET;
}

bool pdcp_unknown_any(const pdcp_unknown_t *unknown)
{
    for (unsigned id = 0; id < PDCP_UNKNOWN_IDS; id++) {
        if (pdcp_unknown_silence(unknown, (uint8_t)id) < PDCP_UNKNOWN_QUIET) {
            return true;
        }
    }
    return false;
}
