#include "board.h"

/* Function numbers of the pin select, and pins by their RP number, which is their number in port B. */
enum { SELECT_U1TX = 3, SELECT_C1TX = 16, RP_CAN_RX = 11, RP_UART_RX = 15 };

enum { OSCCON_IOLOCK = 0x40, ANALOG_PINS = 1 << BOARD_JOYSTICK_X | 1 << BOARD_JOYSTICK_Y };

void board_start(void)
{
    AD1PCFGL = (uint16_t)~ANALOG_PINS; /* 1: digital */
    LATBbits.LATB10 = 1;               /* recessive until the controller has the pin */
    TRISBbits.TRISB10 = 0;
    LATBbits.LATB14 = 1;
    TRISBbits.TRISB14 = 0;
    TRISAbits.TRISA0 = 0;
    CNPU2bits.CN23PUE = 1; /* pull-up for the button, RB7 */
    __builtin_write_OSCCONL((uint8_t)(OSCCON & (uint16_t)~OSCCON_IOLOCK));
    RPINR26bits.C1RXR = RP_CAN_RX;
    RPINR18bits.U1RXR = RP_UART_RX;
    RPOR5bits.RP10R = SELECT_C1TX;
    RPOR7bits.RP14R = SELECT_U1TX;
    __builtin_write_OSCCONL((uint8_t)(OSCCON | OSCCON_IOLOCK));
}

void board_led(bool on)
{
    LATAbits.LATA0 = on;
}

bool board_button(void)
{
    return !PORTBbits.RB7;
}
