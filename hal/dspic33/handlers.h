/* The interrupt handlers. Their names are the vendor's: its linker scripts put functions so called into the
 * vector table.
 *
 * How long each takes at most, entry and exit included, stands with it: cycles that a simulator of the EP
 * part counted, compiled with -O1, and their time at 40 MIPS. The smaller part needs fewer: its registers are
 * read in one cycle, not two. */
#ifndef HANDLERS_H
#define HANDLERS_H

#include "part.h"

void PART_HANDLER _C1Interrupt(void);
void PART_HANDLER _T1Interrupt(void);
void PART_HANDLER _U1RXInterrupt(void);
void PART_HANDLER _U1TXInterrupt(void);
void PART_HANDLER _MI2C1Interrupt(void);

/* For every trap and every interrupt without a handler, by the vendor's linker scripts: written down, then
 * the program starts again (D-MCU-7). No application code can go on after one of them. */
void PART_HANDLER _DefaultInterrupt(void);

#endif
