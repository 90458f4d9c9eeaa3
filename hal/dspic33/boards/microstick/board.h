/* Microstick for dsPIC33F with a dsPIC33FJ64MC802 (28 pins). An 8 MHz crystal goes between pins 9 and 10,
 * with 22 pF each to ground: the board has none, and the internal oscillator is too inaccurate for CAN.
 *
 *   pin  port  use                                pin  port  use
 *    2   RA0   LED of the board                    17  RB8   SCL, 2.2 k to 3.3 V: EEPROM, LED bar
 *    6   RB2   joystick X (node)                   18  RB9   SDA, 2.2 k to 3.3 V
 *    7   RB3   joystick Y (node)                   21  RB10  CAN TXD, to the transceiver
 *    9   RA2   crystal                             22  RB11  CAN RXD, from it (5 V tolerant)
 *   10   RA3   crystal                             25  RB14  UART TXD, to the host
 *   16   RB7   joystick button to ground (node)    26  RB15  UART RXD, from the host, 3.3 V */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>

#include "part.h"

#define BOARD_CRYSTAL_HZ 8000000uL
#define BOARD_FCY 40000000uL

#define BOARD_SCL_LAT LATBbits.LATB8
#define BOARD_SCL_TRIS TRISBbits.TRISB8
#define BOARD_SDA_LAT LATBbits.LATB9
#define BOARD_SDA_TRIS TRISBbits.TRISB9
#define BOARD_SDA_PORT PORTBbits.RB9

/* Analog channels of the joystick. */
#define BOARD_JOYSTICK_X 4
#define BOARD_JOYSTICK_Y 5

/* Pins as above. First of all drivers. */
void board_start(void);

void board_led(bool on);

/* The joystick's button is held down. */
bool board_button(void);

#endif
