/* The interrupt handlers. Their names are the vendor's: its linker scripts put functions so called into the
 * vector table.
 *
 * How long each takes at most, entry and exit included, stands with it: cycles that a simulator of the EP
 * part counted, compiled with -O1, and their time at 40 MIPS. The smaller part needs fewer: its registers are
 * read in one cycle, not two. Those of traps end in a reset. */
#ifndef HANDLERS_H
#define HANDLERS_H

#include "part.h"

void PART_HANDLER _C1Interrupt(void);
void PART_HANDLER _T1Interrupt(void);
void PART_HANDLER _U1RXInterrupt(void);
void PART_HANDLER _U1TXInterrupt(void);
void PART_HANDLER _MI2C1Interrupt(void);

/* Traps, and what has no handler. */
void PART_HANDLER _OscillatorFail(void);
void PART_HANDLER _AddressError(void);
void PART_HANDLER _StackError(void);
void PART_HANDLER _MathError(void);
void PART_HANDLER _DMACError(void);
void PART_HANDLER _DefaultInterrupt(void);
#if PART_GENERIC_TRAPS
void PART_HANDLER _HardTrapError(void);
void PART_HANDLER _SoftTrapError(void);
#endif

#endif
