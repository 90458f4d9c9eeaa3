#include "adc1.h"

#include "board.h"
#include "part.h"

enum {
    CLOCK_CYCLES = 4, /* of one conversion clock: 100 ns at 40 MIPS, 76 ns at least */
    SAMPLE_CLOCKS = 20,
    WAIT_ROUNDS = 160,
    MIDDLE = 512
};

PART_ASSERT(adc1_clock_slow_enough, CLOCK_CYCLES * 1000u / (BOARD_FCY / 1000000u) >= 76u);

void adc1_open(void)
{
    AD1CON1 = 0;
    AD1CON2 = 0; /* AVDD and AVSS, one channel */
    AD1CON3 = (uint16_t)(SAMPLE_CLOCKS << 8 | (CLOCK_CYCLES - 1));
    AD1CON1 = 0x80E0; /* on; sampling ends by the clocks above and the conversion follows */
}

uint16_t adc1_read(uint8_t channel)
{
    AD1CHS0 = channel;
    AD1CON1bits.DONE = 0;
    AD1CON1bits.SAMP = 1;
    for (uint8_t i = 0; i < WAIT_ROUNDS; i++) {
        if (AD1CON1bits.DONE) {
            return ADC1BUF0;
        }
    }
    return MIDDLE;
}
