/* dsPIC33EP512MU810 plug-in module (MA330025-1) on an Explorer 16 with the CAN/LIN PICtail Plus board. The
 * Explorer 16 has an 8 MHz crystal.
 *
 *   pin  port  use                                pin  port  use
 *   87   RF0   CAN RXD (RP96)                     70   RD10  SCL, 2.2 k to 3.3 V: EEPROM
 *   88   RF1   CAN TXD (RP97)                     69   RD9   SDA, 2.2 k to 3.3 V
 *   49   RF4   UART RXD (RP100), the board's      17   RA0   LED D3 of the board
 *   50   RF5   UART TXD (RP101) RS-232 socket     21   RB4   joystick X (node), 20 RB5 joystick Y (node)
 *                                                 83   RD6   switch S3 of the board */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>

#include "part.h"

#define BOARD_CRYSTAL_HZ 8000000uL
#define BOARD_FCY 40000000uL

#define BOARD_SCL_LAT LATDbits.LATD10
#define BOARD_SCL_TRIS TRISDbits.TRISD10
#define BOARD_SDA_LAT LATDbits.LATD9
#define BOARD_SDA_TRIS TRISDbits.TRISD9
#define BOARD_SDA_PORT PORTDbits.RD9

/* Analog channels of the joystick. */
#define BOARD_JOYSTICK_X 4
#define BOARD_JOYSTICK_Y 5

/* Pins as above. First of all drivers. */
void board_start(void);

void board_led(bool on);

/* The joystick's button is held down. */
bool board_button(void);

#endif
