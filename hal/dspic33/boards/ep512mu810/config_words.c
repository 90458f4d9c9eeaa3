/* Configuration words of the dsPIC33EP512MU810. Starts on the internal oscillator, clock.c switches to the
 * crystal; the watchdog always runs: 128 x 512 / 32.768 kHz = 2 s. */
#include <xc.h>

#pragma config FNOSC = FRC, IESO = OFF
#pragma config POSCMD = XT, OSCIOFNC = OFF, IOL1WAY = OFF, FCKSM = CSECME
#pragma config FWDTEN = ON, WINDIS = OFF, WDTPRE = PR128, WDTPOST = PS512, PLLKEN = ON
#pragma config FPWRT = PWR64, BOREN = ON, ALTI2C1 = OFF
#pragma config ICS = PGD1, RSTPRI = PF, JTAGEN = OFF
