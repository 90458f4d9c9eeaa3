/* Between the files of the fake. */
#ifndef FAKE_PARTS_H
#define FAKE_PARTS_H

#include "fake.h"

/* All registers, at an address whose lower 16 bits are 0, so that a register's address cut to 16 bits is the
 * part's. */
typedef union {
    uint16_t words[0x8000];
    uint8_t bytes[0x10000];
} fake_space_t;

extern fake_space_t fake_space;

static inline volatile uint16_t *fake_at(uint16_t at)
{
    return &fake_space.words[at / 2];
}

/* at was accessed and holds a new value now. */
void fake_can_changed(uint16_t at, uint16_t before, uint16_t after);
void fake_i2c_changed(uint16_t at, uint16_t before, uint16_t after);
void fake_uart_changed(uint16_t at, uint16_t after);

/* Before at is accessed. */
void fake_can_access(uint16_t at);
void fake_uart_access(uint16_t at);
void fake_i2c_access(uint16_t at);

/* Microseconds until the module does something; UINT32_MAX: nothing. Then lets them pass. */
uint32_t fake_uart_next_us(void);
uint32_t fake_i2c_next_us(void);
void fake_uart_pass_us(uint32_t us);
void fake_i2c_pass_us(uint32_t us);

void fake_can_power_on(void);
void fake_i2c_power_on(void);
void fake_uart_power_on(void);
void fake_flash_power_on(bool keep_memory);

/* A clock pulse on the I2C pins while the module is off. */
void fake_i2c_clock_pin(bool high);

/* No interrupt may come now: DISI runs, on the EP part all are off. */
bool fake_undisturbed(void);

void fake_raise(uint16_t flag_at, uint16_t bit);

/* Registers by the part's address. */
#if defined(__dsPIC33FJ64MC802__)
#define PART_AT(fj, ep) (fj)
#else
#define PART_AT(fj, ep) (ep)
#endif
enum {
    AT_SR = 0x0042,
    AT_IFS0 = PART_AT(0x0084, 0x0800),
    AT_IFS1 = PART_AT(0x0086, 0x0802),
    AT_IFS2 = PART_AT(0x0088, 0x0804),
    AT_IEC0 = PART_AT(0x0094, 0x0820),
    AT_IEC1 = PART_AT(0x0096, 0x0822),
    AT_IEC2 = PART_AT(0x0098, 0x0824),
    AT_IPC0 = PART_AT(0x00A4, 0x0840),
    AT_IPC2 = PART_AT(0x00A8, 0x0844),
    AT_IPC3 = PART_AT(0x00AA, 0x0846),
    AT_IPC4 = PART_AT(0x00AC, 0x0848),
    AT_IPC8 = PART_AT(0x00B4, 0x0850),
    AT_INTCON2 = PART_AT(0x0082, 0x08C2),
    AT_TBLPAG = PART_AT(0x0032, 0x0054),
    AT_NVMCON = PART_AT(0x0760, 0x0728)
};

#endif
