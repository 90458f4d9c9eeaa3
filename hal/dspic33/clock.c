#include "clock.h"

#include "board.h"
#include "handlers.h"
#include "part.h"

/* FCY = crystal / N1 * M / N2 / 2 with N1 = N2 = 2. */
#define PLL_IN (BOARD_CRYSTAL_HZ / 2u)
#define PLL_M (BOARD_FCY * 4u / PLL_IN)
#define TICK_PRESCALER 8u
#define TICK_PERIOD (BOARD_FCY / TICK_PRESCALER / 1000u)

PART_ASSERT(clock_fcy_in_range, BOARD_FCY <= PART_FCY_MAX);
PART_ASSERT(clock_fcy_exact, PLL_IN *PLL_M == BOARD_FCY * 4u);
PART_ASSERT(clock_multiplier_in_range, PLL_M >= 2 && PLL_M <= 513);
PART_ASSERT(clock_pll_input_in_range, PLL_IN >= PART_PLL_IN_MIN && PLL_IN <= PART_PLL_IN_MAX);
PART_ASSERT(clock_vco_in_range, PLL_IN *PLL_M >= PART_PLL_VCO_MIN && PLL_IN * PLL_M <= PART_PLL_VCO_MAX);
PART_ASSERT(clock_tick_exact, TICK_PERIOD *TICK_PRESCALER * 1000u == BOARD_FCY && TICK_PERIOD <= 65536u);

enum {
    COSC_PRIMARY_PLL = 3,
    /* A round of the wait below takes at least 5 cycles, and the internal oscillator gives 3.7 MIPS: 20 ms.
     * The crystal starts within 1024 of its periods, the PLL locks within 3 ms. */
    WAIT_ROUNDS = 15000
};

static volatile uint32_t clock_ms;

static void switch_oscillator(void)
{
    uint16_t rounds = WAIT_ROUNDS;
    CLKDIV = 0; /* N1 = N2 = 2, no doze */
    PLLFBD = (uint16_t)(PLL_M - 2u);
    __builtin_write_OSCCONH(COSC_PRIMARY_PLL);
    __builtin_write_OSCCONL((uint8_t)(OSCCON | 1u)); /* OSWEN */
    while ((OSCCONbits.OSWEN || !OSCCONbits.LOCK) && --rounds != 0) {
    }
}

bool clock_start(void)
{
    switch_oscillator();
    if (OSCCONbits.COSC != COSC_PRIMARY_PLL || !OSCCONbits.LOCK) {
        return false;
    }
    T1CON = 0;
    TMR1 = 0;
    PR1 = (uint16_t)(TICK_PERIOD - 1u);
    IPC0bits.T1IP = PART_LEVEL_TICK;
    IFS0bits.T1IF = 0;
    IEC0bits.T1IE = 1;
    T1CON = 0x8010; /* on, in idle too, prescaler 8 */
    return true;
}

/* 28 cycles, 0.7 us. */
void PART_HANDLER _T1Interrupt(void)
{
    IFS0bits.T1IF = 0;
    clock_ms++;
}

/* Two words: a tick between reading one and the other shows in a second reading. */
uint32_t hal_clock_ms(void)
{
    uint32_t first;
    uint32_t second = clock_ms;
    do {
        first = second;
        second = clock_ms;
    } while (first != second);
    return first;
}
