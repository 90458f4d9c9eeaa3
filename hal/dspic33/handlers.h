/* The interrupt handlers. The vendor's linker scripts find them by these names and put them into the vector
 * table.
 *
 * Each comment gives the longest run time, entry and exit included: cycles counted by a simulator of the EP
 * part with -O1, and the time at 40 MIPS. The FJ part needs fewer cycles: it reads a register in one, not
 * two. */
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
