/* ADC1: one conversion of 10 bits at a time, started by software. */
#ifndef ADC1_H
#define ADC1_H

#include <stdint.h>

/* The pins are made analog by board_start. */
void adc1_open(void);

/* Converts a channel: 0 to 1023, 2 us of sampling and 1 us of conversion. Returns 512 when the converter does
 * not end within 20 us: a joystick's middle. */
uint16_t adc1_read(uint8_t channel);

#endif
