/* Runs a test program on an ATmega1284P: text goes to the serial port, the RAM that was never used is
 * counted, and the sleep without interrupts at the end makes simavr stop. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <stdint.h>
#include <stdio.h>

enum {
    PAINT = 0xA5,
    FREE_MIN = 64 /* bytes; with fewer, the stack may have met the variables */
};

/* From the linker: the first byte behind the variables. Nothing here uses the heap, the stack grows down to
 * this byte. */
extern uint8_t __heap_start;

void support_put(int character);
int support_program(void);
void support_paint(void);

/* Runs right after the stack pointer was set, before there is a stack; falls through to what follows. */
__attribute__((naked, used, section(".init3"))) void support_paint(void)
{
    for (uint8_t *byte = &__heap_start; byte <= (uint8_t *)RAMEND; byte++) {
        *byte = PAINT;
    }
}

void support_put(int character)
{
    loop_until_bit_is_set(UCSR0A, UDRE0);
    UDR0 = (uint8_t)character;
}

static unsigned never_used(void)
{
    const uint8_t *byte = &__heap_start;
    while (*byte == PAINT) {
        byte++;
    }
    return (unsigned)(byte - &__heap_start);
}

static void tell_ram(void)
{
    char text[80];
    const unsigned have = RAMEND + 1u - RAMSTART;
    const unsigned variables = (unsigned)((uintptr_t)&__heap_start - RAMSTART);
    const unsigned free_bytes = never_used();
    (void)snprintf_P(text, sizeof text, PSTR("RAM: %u bytes of %u variables, %u stack, %u never used\n"),
                     have, variables, have - variables - free_bytes, free_bytes);
    for (const char *at = text; *at != '\0'; at++) {
        support_put(*at);
    }
    if (free_bytes < FREE_MIN) {
        for (PGM_P at = PSTR("RAM:FAIL: too little was left, programs.cmake gives it more parts\n");
             pgm_read_byte(at) != 0; at++) {
            support_put(pgm_read_byte(at));
        }
    }
}

int main(void)
{
    UBRR0 = 0; /* as fast as can be */
    UCSR0A = _BV(U2X0);
    UCSR0B = _BV(TXEN0);
    (void)support_program();
    tell_ram();
    cli();
    sleep_enable();
    sleep_cpu();
    return 0;
}
