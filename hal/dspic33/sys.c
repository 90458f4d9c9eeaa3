#include "sys.h"

#include <stddef.h>

#include "handlers.h"
#include "part.h"

enum { FAULT_MAGIC = 0x5F0D };

/* RCON */
enum {
    RCON_POR = 0x0001,
    RCON_BOR = 0x0002,
    RCON_WDTO = 0x0010,
    RCON_SWR = 0x0040,
    RCON_EXTR = 0x0080,
    RCON_CM = 0x0200,
    RCON_IOPUWR = 0x4000,
    RCON_TRAPR = 0x8000,
    RCON_SLEEP_IDLE = 0x000C,
    RCON_CAUSES = RCON_POR | RCON_BOR | RCON_WDTO | RCON_SWR | RCON_EXTR | RCON_CM | RCON_IOPUWR | RCON_TRAPR
};

static sys_fault_t sys_last_fault PART_KEPT;
/* After power-on what RAM cells fall to: another pattern in each part. */
static uint16_t sys_noise[16] PART_KEPT;

static sys_reset_t sys_cause;
static uint32_t sys_kicked_ms;

/* Two instructions near the end of flash, written by tools/flash --serial; erased: no number. */
static const uint16_t sys_serial_words[2] PART_RESERVED(PART_SERIAL_AT);

void sys_start(void)
{
    const uint16_t flags = RCON;
    RCON = flags & (uint16_t) ~(RCON_CAUSES | RCON_SLEEP_IDLE);
    part_enable_interrupts();
    if ((flags & RCON_POR) != 0 || sys_last_fault.magic != FAULT_MAGIC) {
        sys_last_fault.magic = FAULT_MAGIC;
        sys_last_fault.count = 0;
        sys_last_fault.kind = SYS_FAULT_NONE;
    }
    if ((flags & RCON_SWR) == 0) { /* what sys_fail wrote down is not why */
        sys_last_fault.kind = SYS_FAULT_NONE;
    }
    if (sys_last_fault.kind != SYS_FAULT_NONE || (flags & RCON_TRAPR) != 0) {
        sys_cause = SYS_RESET_TRAP;
    } else if ((flags & RCON_POR) != 0) {
        sys_cause = SYS_RESET_POWER_ON;
    } else if ((flags & RCON_BOR) != 0) {
        sys_cause = SYS_RESET_BROWN_OUT;
    } else if ((flags & RCON_WDTO) != 0) {
        sys_cause = SYS_RESET_WATCHDOG;
    } else if ((flags & (RCON_IOPUWR | RCON_CM)) != 0) { /* CM: a pin select register (D-MCU-4) */
        sys_cause = SYS_RESET_ILLEGAL;
    } else {
        sys_cause = (flags & RCON_SWR) != 0 ? SYS_RESET_SOFTWARE : SYS_RESET_PIN;
    }
}

sys_reset_t sys_reset_cause(void)
{
    return sys_cause;
}

const sys_fault_t *sys_fault(void)
{
    return sys_last_fault.kind != SYS_FAULT_NONE ? &sys_last_fault : NULL;
}

void sys_fail(sys_fault_kind_t kind)
{
    sys_last_fault.kind = (uint16_t)kind;
    sys_last_fault.flags = INTCON1;
    sys_last_fault.count++;
    PART_RESET();
}

/* Every trap, and every interrupt without a handler of its own, comes here (D-MCU-7). */
void PART_HANDLER _DefaultInterrupt(void)
{
    sys_fail(SYS_FAULT_HANDLER);
}

void sys_kick(uint32_t now_ms)
{
    if (now_ms != sys_kicked_ms) {
        sys_kicked_ms = now_ms;
        ClrWdt();
    }
}

unsigned int sys_lock(void)
{
    unsigned int saved;
    SET_AND_SAVE_CPU_IPL(saved, PART_LEVEL_ALL);
    return saved;
}

void sys_unlock(unsigned int saved)
{
    RESTORE_CPU_IPL(saved);
}

/* An enabled interrupt ends the idle state also while its handler may not run; it runs after sys_unlock. */
void sys_idle(bool (*has_work)(void *ctx), void *ctx)
{
    const unsigned int saved = sys_lock();
    if (!has_work(ctx)) {
        Idle();
    }
    sys_unlock(saved);
}

/* FNV-1a over the words of noise; stirred on each call, so that it never gives the same number twice. */
uint32_t hal_sys_random(void)
{
    uint32_t hash = 2166136261uL;
    sys_noise[0]++;
    sys_noise[1] ^= TMR1;
    for (uint8_t i = 0; i < 16; i++) {
        hash = (hash ^ sys_noise[i]) * 16777619uL;
    }
    sys_noise[2] ^= (uint16_t)hash;
    return hash;
}

uint32_t hal_sys_serial(void)
{
    TBLPAG = (uint16_t)(PART_SERIAL_AT >> 16);
    const uint16_t low = __builtin_tblrdl((uint16_t)PART_SERIAL_AT);
    const uint16_t high = __builtin_tblrdl((uint16_t)PART_SERIAL_AT + 2u);
    const uint32_t serial = (uint32_t)high << 16 | low;
    return serial != 0xFFFFFFFFuL ? serial : hal_sys_random();
}
