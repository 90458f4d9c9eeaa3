#include <string.h>

#include "board.h"
#include "hal_clock.h"
#include "i2c1.h"
#include "nvm.h"
#include "part.h"

enum {
    EEPROM = 0x50,
    ADDRESS_BYTES = 2,
    WRITES_MS = 20, /* a page takes 5 ms; afterwards the device acknowledges again */
    READ_MAX = 64   /* bytes of one transfer */
};

typedef enum { IDLE, SENDING, WRITING, FAILED } nvm_state_t;

struct hal_nvm {
    uint8_t state;    /* nvm_state_t */
    uint32_t sent_ms; /* when the last page was sent, or the memory was opened */
    uint8_t bytes[ADDRESS_BYTES + HAL_NVM_PAGE];
};

static struct hal_nvm nvm;

hal_nvm_t *nvm_open(void)
{
    nvm.state = IDLE;
    nvm.sent_ms = hal_clock_ms();
    return &nvm;
}

/* Waits in idle mode for the end of a transfer; i2c1_status bounds it. */
static i2c1_status_t wait_for_bus(void)
{
    i2c1_status_t status = i2c1_status();
    while (status == I2C1_BUSY) {
        Idle();
        status = i2c1_status();
    }
    return status;
}

static void set_address(uint8_t *bytes, uint16_t address)
{
    bytes[0] = (uint8_t)(address >> 8);
    bytes[1] = (uint8_t)address;
}

/* After a reset of the processor alone the EEPROM may still be writing, and does not answer before it is
 * done. */
static bool may_be_writing(const hal_nvm_t *self, i2c1_status_t status)
{
    return status == I2C1_NO_ANSWER && hal_clock_ms() - self->sent_ms <= WRITES_MS;
}

bool hal_nvm_read(hal_nvm_t *self, uint16_t address, uint8_t *bytes, uint16_t size)
{
    if ((uint32_t)address + size > HAL_NVM_SIZE) {
        return false;
    }
    while (hal_nvm_status(self) == HAL_NVM_BUSY) {
        Idle();
    }
    while (size != 0) {
        const uint8_t part = size < READ_MAX ? (uint8_t)size : READ_MAX;
        set_address(self->bytes, address);
        if (!i2c1_start(EEPROM, self->bytes, ADDRESS_BYTES, bytes, part)) {
            return false;
        }
        const i2c1_status_t status = wait_for_bus();
        if (may_be_writing(self, status)) {
            continue;
        }
        if (status != I2C1_DONE) {
            return false;
        }
        address = (uint16_t)(address + part);
        bytes += part;
        size = (uint16_t)(size - part);
    }
    return true;
}

bool hal_nvm_write(hal_nvm_t *self, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    const bool in_page = size >= 1 && size <= HAL_NVM_PAGE && address % HAL_NVM_PAGE + size <= HAL_NVM_PAGE;
    if (!in_page || (uint32_t)address + size > HAL_NVM_SIZE || hal_nvm_status(self) == HAL_NVM_BUSY) {
        return false;
    }
    set_address(self->bytes, address);
    memcpy(&self->bytes[ADDRESS_BYTES], bytes, size);
    if (!i2c1_start(EEPROM, self->bytes, (uint8_t)(ADDRESS_BYTES + size), NULL, 0)) {
        return false;
    }
    self->state = SENDING;
    return true;
}

/* Acknowledge polling: the device answers to its address when the page is written. Each call looks at the
 * last answer and asks again if there was none. */
hal_nvm_status_t hal_nvm_status(hal_nvm_t *self)
{
    if (self->state == IDLE || self->state == FAILED) {
        return self->state == IDLE ? HAL_NVM_IDLE : HAL_NVM_FAILED;
    }
    const i2c1_status_t status = i2c1_status();
    if (status == I2C1_BUSY) {
        return HAL_NVM_BUSY;
    }
    if (self->state == SENDING && status == I2C1_DONE) {
        self->state = WRITING;
        self->sent_ms = hal_clock_ms();
    } else if (self->state == WRITING && status == I2C1_DONE) {
        self->state = IDLE;
        return HAL_NVM_IDLE;
    } else if (self->state == SENDING || status != I2C1_NO_ANSWER ||
               hal_clock_ms() - self->sent_ms > WRITES_MS) {
        self->state = FAILED;
        return HAL_NVM_FAILED;
    }
    (void)i2c1_start(EEPROM, NULL, 0, NULL, 0);
    return HAL_NVM_BUSY;
}
