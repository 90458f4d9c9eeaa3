/* Oscillator and millisecond tick (hal_clock.h). Runs on the crystal: the internal RC oscillator is off by up
 * to 2 %, and two nodes of a CAN bus at 1 Mbit/s may differ by 1 % at the most from each other. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdbool.h>

#include "hal_clock.h"

/* Switches from the internal oscillator, with which the part starts, to the crystal with PLL, and starts the
 * tick. False: the crystal does not run or the PLL does not lock within 20 ms; everything runs on, at an
 * eleventh of the speed and without a tick. */
bool clock_start(void);

#endif
