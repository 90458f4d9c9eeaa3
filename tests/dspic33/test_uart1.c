/* UART1: rates, rings, errors. */
#include <string.h>
#include <xc.h>

#include "fake.h"
#include "handlers.h"
#include "uart1.h"
#include "unity.h"

static hal_uart_t *uart;

void setUp(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
    uart = uart1_open(UART1_BRG(128000uL));
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

static void receive(uint8_t byte)
{
    fake_uart_receive(byte, false);
    fake_deliver();
}

/* 40 MHz / 4 / 78 = 128205 (+0.16 %), 40 MHz / 4 / 174 = 57471 (-0.22 %). */
static void test_rates_are_within_half_a_percent(void)
{
    TEST_ASSERT_EQUAL_UINT16(77, UART1_BRG(128000uL));
    TEST_ASSERT_EQUAL_UINT16(173, UART1_BRG(57600uL));
    TEST_ASSERT_EQUAL_UINT16(77, fake_peek(0x0228));
    (void)uart1_open(UART1_BRG(57600uL));
    TEST_ASSERT_EQUAL_UINT16(173, fake_peek(0x0228));
}

static void test_mode_is_8n1_with_four_clocks_a_bit(void)
{
    TEST_ASSERT_EQUAL_HEX16(0x8008, fake_peek(0x0220));
    TEST_ASSERT_EQUAL_HEX16(0x8400, fake_peek(0x0222) & 0xFCF0);
    TEST_ASSERT_EQUAL_INT(6, IPC2bits.U1RXIP);
    TEST_ASSERT_EQUAL_INT(3, IPC3bits.U1TXIP);
}

static void test_bytes_come_in_order(void)
{
    uint8_t bytes[8];
    TEST_ASSERT_FALSE(uart1_has_work(uart));
    receive(0xFE);
    receive(0x19);
    TEST_ASSERT_TRUE(uart1_has_work(uart));
    TEST_ASSERT_EQUAL_UINT(1, hal_uart_read(uart, bytes, 1));
    TEST_ASSERT_EQUAL_UINT(1, hal_uart_read(uart, &bytes[1], 7));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\xFE\x19", bytes, 2);
    TEST_ASSERT_FALSE(uart1_has_work(uart));
}

static void test_full_ring_loses_the_newest_and_counts(void)
{
    uint8_t bytes[200];
    for (unsigned i = 0; i < 130; i++) {
        receive((uint8_t)i);
    }
    TEST_ASSERT_EQUAL_UINT16(2, uart1_lost(uart));
    TEST_ASSERT_EQUAL_UINT(128, hal_uart_read(uart, bytes, sizeof bytes));
    TEST_ASSERT_EQUAL_HEX8(0, bytes[0]);
    TEST_ASSERT_EQUAL_HEX8(127, bytes[127]);
}

static void test_byte_with_framing_error_is_dropped(void)
{
    uint8_t bytes[4];
    fake_uart_receive('a', false);
    fake_uart_receive('b', true);
    fake_uart_receive('c', false);
    fake_deliver();
    TEST_ASSERT_EQUAL_UINT(2, hal_uart_read(uart, bytes, 4));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("ac", bytes, 2);
    TEST_ASSERT_EQUAL_UINT16(1, uart1_lost(uart));
}

/* The processor stood still for six bytes: four are in the receiver. */
static void test_overrun_keeps_what_is_there_and_goes_on(void)
{
    uint8_t bytes[8];
    for (int i = 0; i < 6; i++) {
        fake_uart_receive((uint8_t)('a' + i), false);
    }
    fake_deliver();
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x0222) & 0x0002);
    receive('x');
    TEST_ASSERT_EQUAL_UINT(5, hal_uart_read(uart, bytes, 8));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("abcdx", bytes, 5);
    TEST_ASSERT_EQUAL_UINT16(1, uart1_lost(uart));
}

static void test_bytes_go_out_in_order(void)
{
    uint8_t bytes[100];
    for (unsigned i = 0; i < 100; i++) {
        bytes[i] = (uint8_t)(i * 7);
    }
    TEST_ASSERT_EQUAL_UINT(100, hal_uart_write(uart, bytes, 100));
    fake_run_us(9000);
    TEST_ASSERT_EQUAL_UINT(100, fake.uart_sent_count);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(bytes, fake.uart_sent, 100);
    TEST_ASSERT_EQUAL_UINT(1, hal_uart_write(uart, bytes, 1)); /* starts again from nothing */
    fake_run_us(200);
    TEST_ASSERT_EQUAL_UINT(101, fake.uart_sent_count);
}

/* The handler may find nothing to do: it sent the byte before the write that it came with was over. */
static void test_goes_on_after_a_handler_that_found_nothing(void)
{
    TEST_ASSERT_EQUAL_UINT(1, hal_uart_write(uart, (const uint8_t *)"a", 1));
    fake_run_us(1000);
    _U1TXInterrupt();
    TEST_ASSERT_EQUAL_UINT(1, hal_uart_write(uart, (const uint8_t *)"b", 1));
    fake_run_us(1000);
    TEST_ASSERT_EQUAL_UINT(2, fake.uart_sent_count);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("ab", fake.uart_sent, 2);
}

static void test_same_byte_goes_out_as_often_as_written(void)
{
    static const uint8_t bytes[10] = {0};
    TEST_ASSERT_EQUAL_UINT(10, hal_uart_write(uart, bytes, 10));
    fake_run_us(2000);
    TEST_ASSERT_EQUAL_UINT(10, fake.uart_sent_count);
}

/* At 128000 baud 20 ms carry 256 bytes. */
static void test_takes_no_more_than_20_ms_carry(void)
{
    static const uint8_t bytes[300] = {1};
    const size_t taken = hal_uart_write(uart, bytes, sizeof bytes);
    TEST_ASSERT_TRUE(taken >= 128 && taken <= 256);
    TEST_ASSERT_FALSE(uart1_has_work(uart) && hal_uart_write(uart, bytes, 1) == 0);
    fake_run_us(1000);
    TEST_ASSERT_TRUE(uart1_has_work(uart)); /* there is room for what was refused */
    TEST_ASSERT_TRUE(hal_uart_write(uart, bytes, 10) > 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_rates_are_within_half_a_percent);
    RUN_TEST(test_mode_is_8n1_with_four_clocks_a_bit);
    RUN_TEST(test_bytes_come_in_order);
    RUN_TEST(test_full_ring_loses_the_newest_and_counts);
    RUN_TEST(test_byte_with_framing_error_is_dropped);
    RUN_TEST(test_overrun_keeps_what_is_there_and_goes_on);
    RUN_TEST(test_bytes_go_out_in_order);
    RUN_TEST(test_goes_on_after_a_handler_that_found_nothing);
    RUN_TEST(test_same_byte_goes_out_as_often_as_written);
    RUN_TEST(test_takes_no_more_than_20_ms_carry);
    return UNITY_END();
}
