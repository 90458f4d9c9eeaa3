#include "board.h"

/* Function numbers of the pin select, and RP numbers of pins. */
enum { SELECT_U1TX = 1, SELECT_C1TX = 14, RP_CAN_RX = 96, RP_UART_RX = 100 };

enum { OSCCON_IOLOCK = 0x40, ANALOG_PINS = 1 << BOARD_JOYSTICK_X | 1 << BOARD_JOYSTICK_Y };

void board_start(void)
{
    ANSELA = 0; /* 1: analog */
    ANSELB = ANALOG_PINS;
    ANSELD = 0;
    LATFbits.LATF1 = 1; /* recessive until the controller has the pin */
    TRISFbits.TRISF1 = 0;
    LATFbits.LATF5 = 1;
    TRISFbits.TRISF5 = 0;
    TRISAbits.TRISA0 = 0;
    __builtin_write_OSCCONL((uint8_t)(OSCCON & (uint16_t)~OSCCON_IOLOCK));
    RPINR26bits.C1RXR = RP_CAN_RX;
    RPINR18bits.U1RXR = RP_UART_RX;
    RPOR7bits.RP97R = SELECT_C1TX;
    RPOR9bits.RP101R = SELECT_U1TX;
    __builtin_write_OSCCONL((uint8_t)(OSCCON | OSCCON_IOLOCK));
}

void board_led(bool on)
{
    LATAbits.LATA0 = on;
}

bool board_button(void)
{
    return !PORTDbits.RD6;
}
