/* The EEPROM as memory: the contract, acknowledge polling, errors. */
#include <string.h>
#include <xc.h>

#include "clock.h"
#include "fake.h"
#include "i2c1.h"
#include "nvm.h"
#include "nvm_contract.h"
#include "unity.h"

static hal_nvm_t *start(bool keep)
{
    fake_power_on(keep);
    fake_enable_interrupts();
    TEST_ASSERT_TRUE(clock_start());
    i2c1_open();
    return nvm_open();
}

hal_nvm_t *nvm_contract_open(void)
{
    return start(false);
}

hal_nvm_t *nvm_contract_reopen(hal_nvm_t *nvm)
{
    (void)nvm;
    return start(true);
}

void nvm_contract_wait(void)
{
    fake_run_us(5000);
}

void setUp(void)
{
    (void)start(false);
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

static void test_write_never_waits(void)
{
    hal_nvm_t *nvm = start(false);
    uint8_t page[HAL_NVM_PAGE];
    memset(page, 0x42, sizeof page);
    const uint64_t before_us = fake.now_us;
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 0, page, sizeof page));
    TEST_ASSERT_EQUAL_INT(HAL_NVM_BUSY, hal_nvm_status(nvm));
    TEST_ASSERT_FALSE(hal_nvm_write(nvm, 64, page, sizeof page));
    TEST_ASSERT_EQUAL_UINT64(before_us, fake.now_us);
    TEST_ASSERT_EQUAL_UINT(0, fake.idles);
}

static void test_busy_until_the_device_acknowledges_again(void)
{
    hal_nvm_t *nvm = start(false);
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 0x1234, (const uint8_t *)"x", 1));
    unsigned ms = 0;
    while (hal_nvm_status(nvm) == HAL_NVM_BUSY && ms < 100) {
        fake_run_us(1000);
        ms++;
    }
    TEST_ASSERT_EQUAL_INT(HAL_NVM_IDLE, hal_nvm_status(nvm));
    TEST_ASSERT_TRUE(ms >= 5 && ms <= 8);
    TEST_ASSERT_EQUAL_HEX8('x', fake.eeprom[0x1234]);
}

static void test_missing_device_fails_read_and_write(void)
{
    hal_nvm_t *nvm = start(false);
    uint8_t byte;
    fake.eeprom_present = false;
    TEST_ASSERT_FALSE(hal_nvm_read(nvm, 0, &byte, 1));
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 0, &byte, 1));
    fake_run_us(1000);
    TEST_ASSERT_EQUAL_INT(HAL_NVM_FAILED, hal_nvm_status(nvm));
    fake.eeprom_present = true;
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 0, (const uint8_t *)"y", 1));
    TEST_ASSERT_EQUAL_INT(HAL_NVM_BUSY, hal_nvm_status(nvm));
}

static void test_device_that_never_ends_its_write_fails(void)
{
    hal_nvm_t *nvm = start(false);
    fake.eeprom_write_us = 1000000;
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 0, (const uint8_t *)"x", 1));
    unsigned ms = 0;
    while (hal_nvm_status(nvm) == HAL_NVM_BUSY && ms < 100) {
        fake_run_us(1000);
        ms++;
    }
    TEST_ASSERT_EQUAL_INT(HAL_NVM_FAILED, hal_nvm_status(nvm));
    TEST_ASSERT_TRUE(ms >= 20 && ms <= 25);
}

static void test_hung_bus_fails_and_recovers(void)
{
    hal_nvm_t *nvm = start(false);
    uint8_t byte;
    fake.i2c_hangs = true;
    TEST_ASSERT_FALSE(hal_nvm_read(nvm, 0, &byte, 1));
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 0, (const uint8_t *)"x", 1));
    fake_run_us(40000);
    TEST_ASSERT_EQUAL_INT(HAL_NVM_FAILED, hal_nvm_status(nvm));
    fake.i2c_hangs = false;
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, 0, &byte, 1));
}

/* D-MCU-3: The processor alone was reset in the middle of a write: the EEPROM does not answer before it has
 * ended. */
static void test_read_after_a_reset_waits_for_the_write_before_it(void)
{
    hal_nvm_t *nvm = start(false);
    uint8_t byte = 0;
    fake.eeprom_write_us = 15000;
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 7, (const uint8_t *)"w", 1));
    fake_run_us(1000);
    i2c1_open();
    nvm = nvm_open();
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, 7, &byte, 1));
    TEST_ASSERT_EQUAL_HEX8('w', byte);
}

/* It is waited for once, not with each of the many reads of a start. */
static void test_missing_device_delays_the_start_by_20_ms_only(void)
{
    hal_nvm_t *nvm = start(false);
    uint8_t byte;
    fake.eeprom_present = false;
    const uint64_t before_us = fake.now_us;
    for (int i = 0; i < 10; i++) {
        TEST_ASSERT_FALSE(hal_nvm_read(nvm, 0, &byte, 1));
    }
    TEST_ASSERT_UINT64_WITHIN(3000, 22000, fake.now_us - before_us);
}

static void test_read_waits_for_a_write(void)
{
    hal_nvm_t *nvm = start(false);
    uint8_t byte = 0;
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 7, (const uint8_t *)"z", 1));
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, 7, &byte, 1));
    TEST_ASSERT_EQUAL_HEX8('z', byte);
}

int main(void)
{
    UNITY_BEGIN();
    nvm_contract_run();
    RUN_TEST(test_write_never_waits);
    RUN_TEST(test_busy_until_the_device_acknowledges_again);
    RUN_TEST(test_missing_device_fails_read_and_write);
    RUN_TEST(test_device_that_never_ends_its_write_fails);
    RUN_TEST(test_hung_bus_fails_and_recovers);
    RUN_TEST(test_read_waits_for_a_write);
    RUN_TEST(test_read_after_a_reset_waits_for_the_write_before_it);
    RUN_TEST(test_missing_device_delays_the_start_by_20_ms_only);
    return UNITY_END();
}
