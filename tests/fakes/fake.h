/* What a test does to the fake hardware behind xc.h, and sees of it.
 *
 * Time stands still but in fake_run_us and Idle(). A handler runs as on the part: at the next register access
 * after its flag is set, if it is enabled and its level is above the processor's. What no program may do (a
 * register that is locked, one that is changed in the wrong mode, a flash word programmed twice) is counted
 * in fake.misuses and otherwise ignored. */
#ifndef FAKE_H
#define FAKE_H

#include <setjmp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_frame.h"

enum { FAKE_EEPROM_SIZE = 32768, FAKE_UART_SENT_MAX = 4096, FAKE_NEVER = -1 };

typedef struct {
    unsigned misuses;
    uint64_t now_us;
    unsigned watchdog_kicks;
    unsigned idles;
    jmp_buf *on_reset;       /* where PART_RESET goes; NULL: nowhere, which fails the test */
    void (*on_idle)(void);   /* called in Idle(), before time passes */
    void (*on_access)(void); /* called before each register access, but not inside itself */
    /* Oscillator: false: the crystal does not start. */
    bool crystal;
    /* CAN */
    int can_mode_delay; /* accesses until a mode is entered; FAKE_NEVER */
    bool can_misplaces; /* the FJ part's erratum: the frame lands in the wrong buffer */
    /* I2C */
    bool eeprom_present;
    unsigned eeprom_write_us;
    bool i2c_hangs;           /* no operation ends */
    bool i2c_collides;        /* the next operation ends in a collision */
    unsigned sda_held_clocks; /* a device holds the data line for so many clocks */
    unsigned i2c_stops;
    uint8_t eeprom[FAKE_EEPROM_SIZE];
    uint8_t expander[32]; /* registers of the MCP23017 at 20h */
    unsigned expander_writes;
    /* ADC: values by channel */
    uint16_t adc[32];
    bool adc_dead;
    /* Flash: operations that are still carried out before the power fails; FAKE_NEVER. */
    int flash_cut_after;
    bool flash_fails; /* the next operation reports an error */
    unsigned flash_erases;
    unsigned flash_programs;
    /* UART */
    size_t uart_sent_count;
    uint8_t uart_sent[FAKE_UART_SENT_MAX];
} fake_t;

extern fake_t fake;

/* Power on: everything as after a power-on reset; the contents of EEPROM and flash stay if keep_memory. */
void fake_power_on(bool keep_memory);

/* What sys_start does on the EP part, for tests of drivers alone. */
void fake_enable_interrupts(void);

/* Lets time pass: hardware works, handlers run. */
void fake_run_us(uint32_t us);

/* A register's value without the effects of an access, and a change of it by the hardware. */
uint16_t fake_peek(uint16_t at);
void fake_poke(uint16_t at, uint16_t value);

/* Handlers that are due run now. */
void fake_deliver(void);

/* A frame from the bus. False: the controller is not on the bus. fake_can_receive_words: the buffer's words
 * as they are. */
bool fake_can_receive(const can_frame_t *frame);
bool fake_can_receive_words(const uint16_t words[8]);

/* The bus takes the most urgent frame of the controller. False: there is none, or it is not on the bus. */
bool fake_can_transmit(can_frame_t *frame);

/* Sets the controller's error status (bits 8 to 13 of C1INTF), counters, and event flags (bits 0 to 7). */
void fake_can_error(uint16_t status, uint8_t tx_errors, uint8_t rx_errors, uint16_t events);

/* A byte comes in on the serial line. */
void fake_uart_receive(uint8_t byte, bool framing_error);

uint32_t fake_flash_word(uint32_t at);
void fake_flash_set(uint32_t at, uint32_t word);

#endif
