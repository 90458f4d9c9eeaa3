/* I2C1 as the master of its bus. Every transfer writes some bytes to a device, then reads some from it. The
 * handler does the work; only i2c1_recover waits. */
#ifndef I2C1_H
#define I2C1_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    I2C1_DONE = 0,       /* the last transfer was acknowledged to the end, or there was none yet */
    I2C1_BUSY = 1,       /* one is under way */
    I2C1_NO_ANSWER = -1, /* the device did not acknowledge its address, or a byte */
    I2C1_FAILED = -2     /* the bus hung or another master was on it; it has been recovered */
} i2c1_status_t;

/* Enables the module for 400 kHz; pins are those of board.h. A device that still drives the bus, because the
 * processor was reset in the middle of a transfer, is clocked free. */
void i2c1_open(void);

/* Starts a transfer with the device of this 7-bit address. out and in must last until it is over; in_size 0:
 * nothing is read; both 0: only the address is sent. False: one is under way. */
bool i2c1_start(uint8_t device, const uint8_t *out, uint8_t out_size, uint8_t *in, uint8_t in_size);

/* How the transfer that was started last is doing. After a collision, which is also what the module sees when
 * a device holds the data line, and when a transfer takes longer than 30 ms, the bus is recovered here: nine
 * clocks and a stop, some 110 us. */
i2c1_status_t i2c1_status(void);

#endif
