/* Selects the part to build for. The header included here holds all that differs between the parts. The
 * drivers use what the parts share under the register names of the vendor's headers. */
#ifndef PART_H
#define PART_H

#include <xc.h>

#include <stdint.h>

#if defined(__dsPIC33FJ64MC802__)
#include "part_fj64mc802.h"
#elif defined(__dsPIC33EP512MU810__)
#include "part_ep512mu810.h"
#else
#error "no header for this part: add one beside part_fj64mc802.h"
#endif

/* An interrupt handler. None reads constants, which stand in flash, so none needs the window to flash. */
#define PART_HANDLER __attribute__((interrupt, no_auto_psv))

/* A function of a handler: the compiler is to put it there, at -O1 too, where it does no inlining of its
 * own. */
#define PART_INLINE static inline __attribute__((always_inline))

/* RAM that a reset leaves alone. */
#define PART_KEPT __attribute__((persistent))

/* Restarts the program; all of RAM that is PART_KEPT stays. */
#ifndef PART_RESET
#define PART_RESET() __asm__ volatile("reset")
#endif

/* C99 has no static assertion: a negative array size does not compile. */
/* NOLINTNEXTLINE(bugprone-macro-parentheses): a name is declared */
#define PART_ASSERT(name, condition) typedef char name[(condition) ? 1 : -1]

/* The priorities of the handlers, 7 the most urgent. How long the hardware waits before something is lost:
 * the controller for 24 frames, 1.1 ms at the shortest; the UART for 4 bytes, 312 us at 128000 baud; the tick
 * for 1 ms; the others for ever. */
enum {
    PART_LEVEL_CAN = 5,
    PART_LEVEL_UART_RX = 6,
    PART_LEVEL_TICK = 4,
    PART_LEVEL_UART_TX = 3,
    PART_LEVEL_I2C = 2,
    PART_LEVEL_ALL = 7 /* as the processor's own level: no handler runs */
};

#endif
