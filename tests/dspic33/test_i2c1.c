/* I2C1 as master: transfers, errors, recovery. The devices on the bus are those of the fake. */
#include <string.h>
#include <xc.h>

#include "clock.h"
#include "fake.h"
#include "handlers.h"
#include "i2c1.h"
#include "unity.h"

enum { EEPROM = 0x50, EXPANDER = 0x20, NOBODY = 0x33 };

#if defined(__dsPIC33FJ64MC802__)
enum { PART_AT_PORT = 0x02CA };
#else
enum { PART_AT_PORT = 0x0E32 };
#endif

void setUp(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
    TEST_ASSERT_TRUE(clock_start());
    i2c1_open();
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

static i2c1_status_t finish(void)
{
    for (int i = 0; i < 100 && i2c1_status() == I2C1_BUSY; i++) {
        fake_run_us(1000);
    }
    return i2c1_status();
}

static void test_clock_is_400_khz(void)
{
#if defined(__dsPIC33FJ64MC802__)
    TEST_ASSERT_EQUAL_HEX16(95, fake_peek(0x0204)); /* 40 MHz / 400 kHz - 40 MHz / 10 MHz - 1 */
#else
    TEST_ASSERT_EQUAL_HEX16(94, fake_peek(0x0204)); /* 40 MHz / 400 kHz - 40 MHz * 120 ns - 2 */
#endif
    TEST_ASSERT_EQUAL_HEX16(0x9000, fake_peek(0x0206));
}

static void test_bytes_out(void)
{
    static const uint8_t bytes[] = {0x14, 0xAA, 0x55};
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, bytes, 3, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_BUSY, i2c1_status());
    TEST_ASSERT_FALSE(i2c1_start(EXPANDER, bytes, 3, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_DONE, finish());
    TEST_ASSERT_EQUAL_HEX8(0xAA, fake.expander[0x14]);
    TEST_ASSERT_EQUAL_HEX8(0x55, fake.expander[0x15]);
    TEST_ASSERT_EQUAL_UINT(1, fake.i2c_stops);
}

static void test_bytes_out_then_in(void)
{
    static const uint8_t address[] = {0x01, 0x00};
    uint8_t bytes[4];
    memcpy(&fake.eeprom[0x100], "data", 4);
    TEST_ASSERT_TRUE(i2c1_start(EEPROM, address, 2, bytes, 4));
    TEST_ASSERT_EQUAL_INT(I2C1_DONE, finish());
    TEST_ASSERT_EQUAL_MEMORY("data", bytes, 4);
    TEST_ASSERT_EQUAL_UINT(1, fake.i2c_stops);
    /* Without an address it goes on where it was. */
    fake.eeprom[0x104] = '!';
    TEST_ASSERT_TRUE(i2c1_start(EEPROM, NULL, 0, bytes, 1));
    TEST_ASSERT_EQUAL_INT(I2C1_DONE, finish());
    TEST_ASSERT_EQUAL_HEX8('!', bytes[0]);
}

static void test_nobody_answers(void)
{
    static const uint8_t byte = 0;
    uint8_t in;
    TEST_ASSERT_TRUE(i2c1_start(NOBODY, &byte, 1, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_NO_ANSWER, finish());
    TEST_ASSERT_TRUE(i2c1_start(NOBODY, NULL, 0, &in, 1));
    TEST_ASSERT_EQUAL_INT(I2C1_NO_ANSWER, finish());
    TEST_ASSERT_EQUAL_UINT(2, fake.i2c_stops);
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_DONE, finish());
}

static void test_collision_ends_the_transfer(void)
{
    fake.i2c_collides = true;
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_FAILED, finish());
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x0208) & 0x0400); /* cleared by a whole word */
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_DONE, finish());
}

/* The result of the transfer before is not that of the one that has collided. */
static void test_handler_that_runs_after_a_collision_does_not_end_it(void)
{
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_DONE, finish());
    fake.i2c_collides = true;
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    fake_run_us(100);
    _MI2C1Interrupt();
    TEST_ASSERT_EQUAL_INT(I2C1_FAILED, finish());
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_DONE, finish());
}

static void test_bus_that_hangs_is_recovered_after_30_ms(void)
{
    fake.i2c_hangs = true;
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    fake_run_us(30000);
    TEST_ASSERT_EQUAL_INT(I2C1_BUSY, i2c1_status());
    fake.sda_held_clocks = 5;
    fake_poke(PART_AT_PORT, 0);
    fake_run_us(2000);
    TEST_ASSERT_EQUAL_INT(I2C1_FAILED, i2c1_status());
    TEST_ASSERT_EQUAL_UINT(0, fake.sda_held_clocks);
    fake.i2c_hangs = false;
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_DONE, finish());
}

/* The module sees a collision at once when it is to send a start while the data line is low. */
static void test_device_that_drives_the_bus_in_between_is_clocked_free(void)
{
    fake.sda_held_clocks = 7;
    fake_poke(PART_AT_PORT, 0);
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    fake_run_us(100);
    TEST_ASSERT_EQUAL_INT(I2C1_FAILED, i2c1_status()); /* long before it has hung */
    TEST_ASSERT_EQUAL_UINT(0, fake.sda_held_clocks);
    TEST_ASSERT_TRUE(i2c1_start(EXPANDER, NULL, 0, NULL, 0));
    TEST_ASSERT_EQUAL_INT(I2C1_DONE, finish());
}

static void test_device_that_drives_the_bus_at_the_start_is_clocked_free(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
    fake.sda_held_clocks = 9;
    fake_poke(PART_AT_PORT, 0);
    i2c1_open();
    TEST_ASSERT_EQUAL_UINT(0, fake.sda_held_clocks);
    TEST_ASSERT_EQUAL_HEX16(0x9000, fake_peek(0x0206));
}

/* A short to ground: no more than nine clocks and a stop. */
static void test_shorted_bus_does_not_stop_the_program(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
    fake.sda_held_clocks = 1000;
    fake_poke(PART_AT_PORT, 0);
    i2c1_open();
    TEST_ASSERT_EQUAL_UINT(990, fake.sda_held_clocks);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_clock_is_400_khz);
    RUN_TEST(test_bytes_out);
    RUN_TEST(test_bytes_out_then_in);
    RUN_TEST(test_nobody_answers);
    RUN_TEST(test_collision_ends_the_transfer);
    RUN_TEST(test_handler_that_runs_after_a_collision_does_not_end_it);
    RUN_TEST(test_bus_that_hangs_is_recovered_after_30_ms);
    RUN_TEST(test_device_that_drives_the_bus_in_between_is_clocked_free);
    RUN_TEST(test_device_that_drives_the_bus_at_the_start_is_clocked_free);
    RUN_TEST(test_shorted_bus_does_not_stop_the_program);
    return UNITY_END();
}
