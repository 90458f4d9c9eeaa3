/* Read before every test program: what Unity and the program's main find on an ATmega1284P. */
#ifndef PRELUDE_H
#define PRELUDE_H

#include <stddef.h>

/* A program too large for the RAM is built in AVR16_PARTS parts: part n runs its n-th test, and then each
 * AVR16_PARTS-th. The compiler drops the tests of the other parts, and their tables and texts with them. */
#define RUN_TEST(test)                                                                                       \
    do {                                                                                                     \
        if (__COUNTER__ % AVR16_PARTS == AVR16_PART) {                                                       \
            UnityDefaultTestRun(test, #test, __LINE__);                                                      \
        }                                                                                                    \
    } while (0)

/* UNITY_OUTPUT_CHAR: one character to the serial port. */
void support_put(int character);

/* The program's main; support.c has the one that is called at power-on. */
#define main support_program
int main(void);

#endif
