/* Bar of ten LEDs on the I2C bus. An MCP23017 at address 20h drives them, from port A bit 0 to port B bit 1;
 * low is on. */
#ifndef LEDBAR_H
#define LEDBAR_H

#include <stdint.h>

enum { LEDBAR_LEDS = 10 };

/* How many LEDs are to be lit, from the first: 0 to LEDBAR_LEDS. Shown by ledbar_step. */
void ledbar_set(uint8_t lit);

/* Sends to the bar what has changed, and everything anew once a second, so that a bar that was plugged in
 * late or lost its power shows the right thing. Gives way to other traffic on the bus. */
void ledbar_step(uint32_t now_ms);

#endif
