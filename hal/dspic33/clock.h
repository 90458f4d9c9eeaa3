/* Oscillator and millisecond tick (hal_clock.h). Runs on the crystal: the internal RC oscillator is off by up
 * to 2 %, and with the bit timing of ecan1.c each node of the bus may be off by 0.98 % at the most: the
 * smaller of 4 / (20 * 20), for the jump of 4 quanta, and 5 / (2 * (13 * 20 - 5)), for segment 2. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdbool.h>

#include "hal_clock.h"

/* Switches from the internal oscillator, with which the part starts, to the crystal with PLL, and starts the
 * tick. False: the crystal does not run or the PLL does not lock within 20 ms; everything runs on, at an
 * eleventh of the speed and without a tick. */
bool clock_start(void);

#endif
