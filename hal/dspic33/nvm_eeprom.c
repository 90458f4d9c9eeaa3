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

struct hal_nvm {
    hal_nvm_status_t status;
    bool sent;        /* while busy: the page, so that the device is asked whether it has written it */
    uint32_t sent_ms; /* when that was, or when the memory was opened */
    uint8_t bytes[ADDRESS_BYTES + HAL_NVM_PAGE];
};

static struct hal_nvm nvm;

hal_nvm_t *nvm_open(void)
{
    i2c1_open();
    nvm.status = HAL_NVM_IDLE;
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

/* Starts a transfer: the address, and the bytes of a page that stand behind it. */
static bool start(hal_nvm_t *self, uint16_t address, uint16_t out_size, uint8_t *in, uint16_t in_size)
{
    self->bytes[0] = (uint8_t)(address >> 8);
    self->bytes[1] = (uint8_t)address;
    return i2c1_start(EEPROM, self->bytes, (uint8_t)(ADDRESS_BYTES + out_size), in, (uint8_t)in_size);
}

/* After a reset of the processor alone the EEPROM may still be writing, and does not answer before it is
 * done (D-MCU-3). */
static bool may_be_writing(const hal_nvm_t *self, i2c1_status_t status)
{
    return status == I2C1_NO_ANSWER && hal_clock_ms() - self->sent_ms <= WRITES_MS;
}

bool hal_nvm_read(hal_nvm_t *self, uint16_t address, uint8_t *bytes, uint16_t size)
{
    if (address > HAL_NVM_SIZE || size > HAL_NVM_SIZE - address) {
        return false;
    }
    while (hal_nvm_status(self) == HAL_NVM_BUSY) {
        Idle();
    }
    while (size != 0) {
        const uint16_t part = size < READ_MAX ? size : READ_MAX;
        if (!start(self, address, 0, bytes, part)) {
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
    /* a size of 0 is more than all here */
    if ((uint16_t)(size - 1u) >= HAL_NVM_PAGE - address % HAL_NVM_PAGE || address >= HAL_NVM_SIZE ||
        hal_nvm_status(self) == HAL_NVM_BUSY) {
        return false;
    }
    memcpy(&self->bytes[ADDRESS_BYTES], bytes, size);
    if (!start(self, address, size, NULL, 0)) {
        return false;
    }
    self->status = HAL_NVM_BUSY;
    self->sent = false;
    return true;
}

/* Acknowledge polling: the device answers to its address when the page is written. Each call looks at the
 * last answer and asks again if there was none. */
hal_nvm_status_t hal_nvm_status(hal_nvm_t *self)
{
    const i2c1_status_t status = i2c1_status();
    if (self->status != HAL_NVM_BUSY || status == I2C1_BUSY) {
        return self->status;
    }
    if (self->sent && status == I2C1_DONE) {
        self->status = HAL_NVM_IDLE;
        return HAL_NVM_IDLE;
    }
    if (status == I2C1_DONE) {
        self->sent = true;
        self->sent_ms = hal_clock_ms();
    } else if (!self->sent || !may_be_writing(self, status)) {
        self->status = HAL_NVM_FAILED;
        return HAL_NVM_FAILED;
    }
    (void)i2c1_start(EEPROM, NULL, 0, NULL, 0);
    return HAL_NVM_BUSY;
}
