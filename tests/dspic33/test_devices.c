/* What the bench's nodes have on top: the ADC of the joystick and the LED bar. */
#include <string.h>
#include <xc.h>

#include "adc1.h"
#include "clock.h"
#include "fake.h"
#include "i2c1.h"
#include "ledbar.h"
#include "unity.h"

enum { OLATA = 0x14, OLATB = 0x15, IODIRA = 0x00, IODIRB = 0x01 };

static uint32_t now_ms;

void setUp(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
    TEST_ASSERT_TRUE(clock_start());
    i2c1_open();
    now_ms += 5000; /* the bar is set up anew */
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

static void run_ms(unsigned ms)
{
    for (unsigned i = 0; i < ms; i++) {
        ledbar_step(now_ms++);
        fake_run_us(1000);
    }
}

static void test_adc_converts_one_channel(void)
{
    fake.adc[4] = 1023;
    fake.adc[5] = 17;
    adc1_open();
    TEST_ASSERT_EQUAL_HEX16(0x1403, fake_peek(0x0324)); /* 20 clocks of sampling, 4 cycles each: 100 ns */
    TEST_ASSERT_EQUAL_UINT16(1023, adc1_read(4));
    TEST_ASSERT_EQUAL_UINT16(17, adc1_read(5));
}

static void test_adc_that_is_dead_reads_the_middle(void)
{
    fake.adc_dead = true;
    adc1_open();
    TEST_ASSERT_EQUAL_UINT16(512, adc1_read(4));
}

static void test_bar_shows_what_is_set(void)
{
    ledbar_set(0);
    run_ms(10);
    TEST_ASSERT_EQUAL_HEX8(0x00, fake.expander[IODIRA]);
    TEST_ASSERT_EQUAL_HEX8(0xFC, fake.expander[IODIRB]);
    TEST_ASSERT_EQUAL_HEX8(0xFF, fake.expander[OLATA]);
    TEST_ASSERT_EQUAL_HEX8(0xFF, fake.expander[OLATB]);
    ledbar_set(3);
    run_ms(5);
    TEST_ASSERT_EQUAL_HEX8(0xF8, fake.expander[OLATA]);
    ledbar_set(99);
    run_ms(5);
    TEST_ASSERT_EQUAL_HEX8(0x00, fake.expander[OLATA]);
    TEST_ASSERT_EQUAL_HEX8(0xFC, fake.expander[OLATB]);
}

static void test_bar_is_sent_when_it_changes_and_once_a_second(void)
{
    ledbar_set(5);
    run_ms(10);
    const unsigned before = fake.expander_writes;
    run_ms(900);
    TEST_ASSERT_EQUAL_UINT(before, fake.expander_writes);
    memset(fake.expander, 0xFF, sizeof fake.expander); /* its power was off */
    run_ms(110);
    TEST_ASSERT_EQUAL_HEX8(0xE0, fake.expander[OLATA]);
    TEST_ASSERT_EQUAL_HEX8(0x00, fake.expander[IODIRA]);
}

static void test_bar_waits_for_other_traffic(void)
{
    static const uint8_t address[2] = {0};
    uint8_t bytes[64];
    run_ms(10);
    TEST_ASSERT_TRUE(i2c1_start(0x50, address, 2, bytes, 64));
    ledbar_set(7);
    ledbar_step(now_ms);
    TEST_ASSERT_EQUAL_INT(I2C1_BUSY, i2c1_status());
    run_ms(10);
    TEST_ASSERT_EQUAL_HEX8(0x80, fake.expander[OLATA]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_adc_converts_one_channel);
    RUN_TEST(test_adc_that_is_dead_reads_the_middle);
    RUN_TEST(test_bar_shows_what_is_set);
    RUN_TEST(test_bar_is_sent_when_it_changes_and_once_a_second);
    RUN_TEST(test_bar_waits_for_other_traffic);
    return UNITY_END();
}
