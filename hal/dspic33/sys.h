/* Reset, watchdog, handlers off, idle, serial number (hal_sys.h). */
#ifndef SYS_H
#define SYS_H

#include <stdbool.h>
#include <stdint.h>

#include "hal_sys.h"

/* Why the program starts, the gravest first. */
typedef enum {
    SYS_RESET_TRAP = 0,     /* a trap, see sys_fault; or two at once */
    SYS_RESET_WATCHDOG = 1, /* the main loop or the tick hung */
    SYS_RESET_ILLEGAL = 2,  /* illegal instruction, or a pin select register changed by itself (D-MCU-4) */
    SYS_RESET_SOFTWARE = 3,
    SYS_RESET_PIN = 4,
    SYS_RESET_BROWN_OUT = 5,
    SYS_RESET_POWER_ON = 6
} sys_reset_t;

/* What stopped the program before the last restart. */
typedef enum {
    SYS_FAULT_NONE = 0,
    SYS_FAULT_HANDLER = 1, /* a trap, or an interrupt that nobody handles */
    SYS_FAULT_CRYSTAL = 2  /* the crystal did not start */
} sys_fault_kind_t;

/* Stays in RAM over resets, not over power-off. */
typedef struct {
    uint16_t magic; /* else this is what RAM holds after power-on */
    uint16_t kind;  /* sys_fault_kind_t */
    uint16_t flags; /* INTCON1 at that time; which trap: bit 1 oscillator, 2 stack, 3 address, 4 arithmetic,
                       5 DMA; none of them: an interrupt, or a soft or hard trap of the EP part */
    uint16_t count; /* faults since power-on */
} sys_fault_t;

/* First of all: finds out why the program starts, and lets interrupts come, of which each driver enables its
 * own. */
void sys_start(void);

sys_reset_t sys_reset_cause(void);

/* The last fault before this start; NULL: the reset had another cause. */
const sys_fault_t *sys_fault(void);

/* Writes down what happened and restarts. Any context. Does not return. */
void sys_fail(sys_fault_kind_t kind);

/* Keeps the watchdog (2 s) quiet, if the clock has moved on since the last call: a main loop without a tick
 * is no healthy one. Called once in each turn of the main loop, and nowhere else. */
void sys_kick(uint32_t now_ms);

/* Runs no handler from here to sys_unlock, which gets what this returned; nests. A handler that becomes due
 * meanwhile runs afterwards. Clearing an enable bit would not do: a handler that is just becoming due still
 * runs. */
unsigned int sys_lock(void);
void sys_unlock(unsigned int saved);

/* Stops the processor until the next interrupt, the tick at the latest, unless there is work already.
 * has_work is called with all handlers off, so that nothing comes between its answer and the stop. */
void sys_idle(bool (*has_work)(void *ctx), void *ctx);

#endif
