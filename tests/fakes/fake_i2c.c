/* I2C 1 as master, with an EEPROM 24LC256 at 50h and an expander MCP23017 at 20h on the bus. */
#include <xc.h>

#include "fake_parts.h"

enum { OPERATION_US = 3, BYTE_US = 25, NOT_WRITTEN = 0x8000, EEPROM = 0x50, EXPANDER = 0x20 };

typedef enum { NOTHING, START, RESTART, STOP, SEND, RECEIVE, ACKNOWLEDGE } operation_t;

static operation_t operation;
static uint32_t left_us;
static uint8_t sent_byte;
static int device; /* that was addressed; -1: none */
static bool reading;
static bool acknowledged;    /* the last byte that was read: the device goes on driving the bus */
static unsigned byte_number; /* since the address */
static uint16_t pointer;     /* of the EEPROM, or register number of the expander */
static uint16_t page_start;
static bool page_pending;
static uint8_t page[64];
static bool page_written[64];
static uint32_t busy_us;

void fake_i2c_access(uint16_t at)
{
    if (at == 0x0202) {
        *fake_at(at) = NOT_WRITTEN;
    }
}

static void begin(operation_t what, uint32_t us)
{
    if (operation != NOTHING || (*fake_at(0x0206) & 0x8000) == 0) {
        fake.misuses++;
        return;
    }
    operation = what;
    left_us = us;
}

void fake_i2c_changed(uint16_t at, uint16_t before, uint16_t after)
{
    const uint16_t set = (uint16_t)(after & ~before);
    if (at == 0x0202 && after != NOT_WRITTEN) {
        sent_byte = (uint8_t)after;
        begin(SEND, BYTE_US);
    }
    if (at != 0x0206) {
        return;
    }
    if ((after & 0x8000) == 0) {
        operation = NOTHING;
        return;
    }
    if ((set & 0x0001) != 0) {
        begin(START, OPERATION_US);
    }
    if ((set & 0x0002) != 0) {
        begin(RESTART, OPERATION_US);
    }
    if ((set & 0x0004) != 0) {
        begin(STOP, OPERATION_US);
    }
    if ((set & 0x0008) != 0) {
        begin(RECEIVE, BYTE_US);
    }
    if ((set & 0x0010) != 0) {
        begin(ACKNOWLEDGE, OPERATION_US);
    }
}

static bool take_address(uint8_t byte)
{
    const int called = byte >> 1;
    reading = (byte & 1u) != 0;
    acknowledged = false;
    byte_number = 0;
    if (called == EEPROM && fake.eeprom_present && busy_us == 0) {
        device = EEPROM;
    } else {
        device = called == EXPANDER ? EXPANDER : -1;
    }
    return device >= 0;
}

static void take_data(uint8_t byte)
{
    if (device == EXPANDER) {
        if (byte_number == 1) {
            pointer = byte;
        } else {
            fake.expander[pointer++ & 31u] = byte;
            fake.expander_writes++;
        }
        return;
    }
    if (byte_number <= 2) {
        pointer = (uint16_t)(((unsigned)pointer << 8 | byte) & 0x7FFFu);
        page_start = pointer & 0x7FC0u;
        return;
    }
    page[pointer & 63u] = byte; /* wraps within the page, as the part does */
    page_written[pointer & 63u] = true;
    page_pending = true;
    pointer = (uint16_t)(page_start | ((pointer + 1u) & 63u));
}

static void stop(void)
{
    fake.i2c_stops++;
    if (acknowledged) {
        fake.misuses++;
    }
    acknowledged = false;
    device = -1;
    if (!page_pending) {
        return;
    }
    page_pending = false;
    for (uint16_t i = 0; i < 64; i++) {
        if (page_written[i]) {
            fake.eeprom[page_start + i] = page[i];
            page_written[i] = false;
        }
    }
    busy_us = fake.eeprom_write_us;
}

static void set_status(uint16_t bit, bool on)
{
    *fake_at(0x0208) = (uint16_t)(on ? *fake_at(0x0208) | bit : *fake_at(0x0208) & ~bit);
}

static void finish_operation(operation_t what)
{
    static const uint16_t control_bits[] = {0, 0x0001, 0x0002, 0x0004, 0, 0x0008, 0x0010};
    *fake_at(0x0206) &= (uint16_t)~control_bits[what];
    switch (what) {
    case START:
    case RESTART:
        device = -2; /* the next byte is an address */
        set_status(0x8000, false);
        break;
    case SEND:
        if (device == -2) {
            set_status(0x8000, !take_address(sent_byte));
        } else {
            byte_number++;
            set_status(0x8000, device < 0 || reading);
            if (device >= 0 && !reading) {
                take_data(sent_byte);
            }
        }
        break;
    case RECEIVE:
        *fake_at(0x0200) = device == EEPROM ? fake.eeprom[pointer] : 0xFF;
        pointer = (uint16_t)((pointer + 1u) & 0x7FFFu);
        break;
    case ACKNOWLEDGE:
        acknowledged = (*fake_at(0x0206) & 0x0020) == 0;
        break;
    case STOP:
        stop();
        set_status(0x8000, false); /* erratum: the acknowledgement is gone */
        break;
    default:
        break;
    }
    fake_raise(AT_IFS1, 1);
}

uint32_t fake_i2c_next_us(void)
{
    return operation != NOTHING && !fake.i2c_hangs ? left_us : UINT32_MAX;
}

void fake_i2c_pass_us(uint32_t us)
{
    busy_us = busy_us > us ? busy_us - us : 0;
    if (operation == NOTHING || fake.i2c_hangs) {
        return;
    }
    left_us -= us;
    if (left_us != 0) {
        return;
    }
    const operation_t what = operation;
    operation = NOTHING;
    if (fake.i2c_collides || (what == START && fake.sda_held_clocks != 0)) {
        fake.i2c_collides = false;
        *fake_at(0x0206) &= 0xFFE0u;
        set_status(0x0400, true);
        fake_raise(AT_IFS1, 1);
        return;
    }
    finish_operation(what);
}

void fake_i2c_clock_pin(bool high)
{
    if (high && fake.sda_held_clocks != 0) {
        fake.sda_held_clocks--;
    }
    const uint16_t port_at = PART_AT(0x02CA, 0x0E32);
    const uint16_t bit = (uint16_t)(1u << PART_AT(9, 9));
    *fake_at(port_at) =
        (uint16_t)(fake.sda_held_clocks == 0 ? *fake_at(port_at) | bit : *fake_at(port_at) & ~bit);
}

void fake_i2c_power_on(void)
{
    operation = NOTHING;
    busy_us = 0;
    page_pending = false;
    device = -1;
    fake_i2c_clock_pin(false);
}
