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

typedef enum {
    IDLE,
    STARTED,
    SENT,
    RESTARTED,
    SENT_AGAIN,
    RECEIVED,
    ACKNOWLEDGED,
    STOPPED,
    COLLIDED /* the module has let the bus go; a device may still drive it */
} i2c1_state_t;

typedef struct {
    volatile uint8_t state; /* i2c1_state_t: what was asked of the module last */
    volatile int8_t result; /* i2c1_status_t */
    int8_t outcome;         /* becomes the result after the stop */
    uint8_t device;
    uint8_t out_left;
    uint8_t in_left;
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
    i2c1.result = I2C1_BUSY;
    i2c1.state = STARTED;
    I2C1CONbits.SEN = 1;
    return true;
}

i2c1_status_t i2c1_status(void)
{
    if (i2c1.state == COLLIDED || (i2c1.result == I2C1_BUSY && hal_clock_ms() - i2c1.started_ms > HANGS_MS)) {
        recover();
        i2c1.state = IDLE;
        i2c1.result = I2C1_FAILED;
    }
    return (i2c1_status_t)i2c1.result;
}

/* --- the handler's steps; each returns what it asked the module for --- */

static i2c1_state_t stop(i2c1_status_t outcome)
{
    i2c1.outcome = (int8_t)outcome;
    I2C1CONbits.PEN = 1;
    return STOPPED;
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
        return RESTARTED;
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

static i2c1_state_t take_byte(void)
{
    *i2c1.in++ = (uint8_t)I2C1RCV;
    i2c1.in_left--;
    I2C1CONbits.ACKDT = i2c1.in_left == 0; /* the last byte is not acknowledged: the device lets go */
    I2C1CONbits.ACKEN = 1;
    return ACKNOWLEDGED;
}

static i2c1_state_t send_address(i2c1_state_t next, uint8_t read)
{
    I2C1TRN = (uint16_t)(i2c1.device << 1 | read);
    return next;
}

/* What follows the step that was done. An acknowledgement is looked at here and now: it may be gone after a
 * stop (erratum). */
static i2c1_state_t next_step(void)
{
    switch ((i2c1_state_t)i2c1.state) {
    case STARTED:
        return send_address(i2c1.out_left == 0 && i2c1.in_left != 0 ? SENT_AGAIN : SENT,
                            i2c1.out_left == 0 && i2c1.in_left != 0);
    case SENT:
        return I2C1STATbits.ACKSTAT ? stop(I2C1_NO_ANSWER) : send_next();
    case RESTARTED:
        return send_address(SENT_AGAIN, 1);
    case SENT_AGAIN:
        return I2C1STATbits.ACKSTAT ? stop(I2C1_NO_ANSWER) : receive_next();
    case RECEIVED:
        return take_byte();
    case ACKNOWLEDGED:
        return receive_next();
    case STOPPED:
        i2c1.result = i2c1.outcome;
        return IDLE;
    default:
        return IDLE;
    }
}

/* At most 138 cycles, 3.5 us. */
void PART_HANDLER _MI2C1Interrupt(void)
{
    IFS1bits.MI2C1IF = 0;
    if ((I2C1STAT & STAT_BCL) != 0) {
        I2C1STAT = 0;
        i2c1.state = COLLIDED;
    } else {
        i2c1.state = (uint8_t)next_step();
    }
}
