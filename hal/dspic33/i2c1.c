#include "i2c1.h"

#include <stddef.h>

#include "board.h"
#include "hal_clock.h"
#include "handlers.h"
#include "part.h"

enum {
    HANGS_MS = 30, /* 70 bytes at 200 kHz take 3.2 ms */
    STAT_BCL = 0x0400,
    FREE_CLOCKS = 9, /* as many as a device needs to end its byte */
    HALF_CLOCK_US = 5,
    CYCLES_OF_ROUND = 4 /* at least, of the wait below */
};

/* What was asked of the module last. */
typedef enum {
    IDLE,
    STARTED, /* or started again, to read */
    SENT,
    SENT_TO_READ, /* the address */
    RECEIVED,
    ACKNOWLEDGED,
    STOPPED,
    COLLIDED /* the module has let the bus go; a device may still drive it */
} i2c1_state_t;

/* Words: the compiler reaches a byte less easily. */
typedef struct {
    volatile uint16_t state;       /* i2c1_state_t */
    volatile i2c1_status_t result; /* of the last transfer; holds when it is over */
    uint16_t device;
    uint16_t out_left;
    uint16_t in_left;
    const uint8_t *out;
    uint8_t *in;
    uint32_t started_ms;
} i2c1_t;

static i2c1_t i2c1;

static void wait_half_clock(void)
{
    for (uint16_t i = 0; i < BOARD_FCY / 1000000u * HALF_CLOCK_US / CYCLES_OF_ROUND; i++) {
        Nop();
    }
}

/* With the module off the pins are ours, driven low or let go. Clocks until the data line is free, then a
 * stop. */
static void free_bus(void)
{
    BOARD_SCL_LAT = 0;
    BOARD_SDA_LAT = 0;
    BOARD_SDA_TRIS = 1;
    for (uint8_t i = 0; i < FREE_CLOCKS && !BOARD_SDA_PORT; i++) {
        BOARD_SCL_TRIS = 0;
        wait_half_clock();
        BOARD_SCL_TRIS = 1;
        wait_half_clock();
    }
    BOARD_SCL_TRIS = 0;
    wait_half_clock();
    BOARD_SDA_TRIS = 0;
    wait_half_clock();
    BOARD_SCL_TRIS = 1;
    wait_half_clock();
    BOARD_SDA_TRIS = 1;
    wait_half_clock();
}

static void recover(void)
{
    IEC1bits.MI2C1IE = 0;
    I2C1CON = 0;
    free_bus();
    I2C1BRG = PART_I2C_BRG(BOARD_FCY, 400000uL);
    I2C1STAT = 0; /* erratum: the collision bit is cleared by whole words only */
    IPC4bits.MI2C1IP = PART_LEVEL_I2C;
    IFS1bits.MI2C1IF = 0;
    I2C1CON = 0x9000; /* on, clock not held, slew rate limited as for 400 kHz */
    IEC1bits.MI2C1IE = 1;
}

void i2c1_open(void)
{
    i2c1.state = IDLE;
    i2c1.result = I2C1_DONE;
    recover();
}

bool i2c1_start(uint8_t device, const uint8_t *out, uint8_t out_size, uint8_t *in, uint8_t in_size)
{
    if (i2c1.state != IDLE) {
        return false;
    }
    i2c1.device = device;
    i2c1.out = out;
    i2c1.out_left = out_size;
    i2c1.in = in;
    i2c1.in_left = in_size;
    i2c1.started_ms = hal_clock_ms();
    i2c1.state = STARTED;
    I2C1CONbits.SEN = 1;
    return true;
}

i2c1_status_t i2c1_status(void)
{
    if (i2c1.state == IDLE) {
        return i2c1.result;
    }
    if (i2c1.state != COLLIDED && hal_clock_ms() - i2c1.started_ms <= HANGS_MS) {
        return I2C1_BUSY;
    }
    recover();
    i2c1.state = IDLE;
    i2c1.result = I2C1_FAILED;
    return I2C1_FAILED;
}

/* --- the handler's steps; each returns what it asked the module for --- */

PART_INLINE i2c1_state_t stop(i2c1_status_t result)
{
    i2c1.result = result;
    I2C1CONbits.PEN = 1;
    return STOPPED;
}

static i2c1_state_t send_address(void)
{
    const uint16_t address = (uint16_t)(i2c1.device << 1);
    if (i2c1.out_left == 0 && i2c1.in_left != 0) {
        I2C1TRN = address | 1u;
        return SENT_TO_READ;
    }
    I2C1TRN = address;
    return SENT;
}

static i2c1_state_t send_next(void)
{
    if (i2c1.out_left != 0) {
        i2c1.out_left--;
        I2C1TRN = *i2c1.out++;
        return SENT;
    }
    if (i2c1.in_left != 0) {
        I2C1CONbits.RSEN = 1;
        return STARTED;
    }
    return stop(I2C1_DONE);
}

static i2c1_state_t receive_next(void)
{
    if (i2c1.in_left == 0) {
        return stop(I2C1_DONE);
    }
    I2C1CONbits.RCEN = 1;
    return RECEIVED;
}

/* The last byte is not acknowledged: the device lets go. */
static i2c1_state_t take_byte(void)
{
    *i2c1.in++ = (uint8_t)I2C1RCV;
    i2c1.in_left--;
    I2C1CONbits.ACKDT = 0;
    if (i2c1.in_left == 0) {
        I2C1CONbits.ACKDT = 1;
    }
    I2C1CONbits.ACKEN = 1;
    return ACKNOWLEDGED;
}

/* What follows the step that was done. An acknowledgement is looked at here and now: it may be gone after a
 * stop (erratum). */
static i2c1_state_t next_step(i2c1_state_t state)
{
    if (state == STARTED) {
        return send_address();
    }
    if (state == RECEIVED) {
        return take_byte();
    }
    if ((state == SENT || state == SENT_TO_READ) && I2C1STATbits.ACKSTAT) {
        return stop(I2C1_NO_ANSWER);
    }
    if (state == SENT) {
        return send_next();
    }
    return state == SENT_TO_READ || state == ACKNOWLEDGED ? receive_next() : IDLE;
}

/* At most 138 cycles, 3.5 us. */
void PART_HANDLER _MI2C1Interrupt(void)
{
    IFS1bits.MI2C1IF = 0;
    if ((I2C1STAT & STAT_BCL) != 0) {
        I2C1STAT = 0;
        i2c1.state = COLLIDED;
    } else if (i2c1.state != COLLIDED) { /* only i2c1_status ends that */
        i2c1.state = next_step((i2c1_state_t)i2c1.state);
    }
}
