/* Clock, reset causes, traps, watchdog, idle, serial number, pins. */
#include <setjmp.h>
#include <xc.h>

#include "board.h"
#include "clock.h"
#include "fake.h"
#include "handlers.h"
#include "sys.h"
#include "unity.h"

#if defined(__dsPIC33FJ64MC802__)
enum { INTCON1_AT = 0x0080 };
#else
enum { INTCON1_AT = 0x08C0 };
#endif

void setUp(void)
{
    fake_power_on(false);
    sys_start();
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

/* 8 MHz / 2 * 40 / 2 = 80 MHz, 40 MIPS. */
static void test_clock_runs_on_the_crystal_at_40_mips(void)
{
    TEST_ASSERT_TRUE(clock_start());
    TEST_ASSERT_EQUAL_HEX16(0x0000, fake_peek(0x0744)); /* PLLPRE = PLLPOST = 0: divide by 2 each */
    TEST_ASSERT_EQUAL_HEX16(38, fake_peek(0x0746));     /* PLLDIV: times 40 */
    TEST_ASSERT_EQUAL_HEX16(0x3300,
                            fake_peek(0x0742) & 0x7700); /* primary oscillator with PLL, asked for and had */
}

static void test_tick_counts_milliseconds(void)
{
    TEST_ASSERT_TRUE(clock_start());
    TEST_ASSERT_EQUAL_HEX16(4999, fake_peek(0x0102)); /* 40 MHz / 8 / 5000 = 1 kHz */
    TEST_ASSERT_EQUAL_HEX16(0x8010, fake_peek(0x0104));
    const uint32_t before_ms = hal_clock_ms();
    fake_run_us(250000);
    TEST_ASSERT_EQUAL_UINT32(before_ms + 250, hal_clock_ms());
}

static void test_crystal_that_does_not_start_is_noticed(void)
{
    fake.crystal = false;
    TEST_ASSERT_FALSE(clock_start());
}

/* D-MCU-4: 0200h is the flag of the pin select registers. */
static void test_cause_of_the_reset(void)
{
    static const uint16_t flags[] = {0x0003, 0x0002, 0x0080, 0x0010, 0x4000, 0x0200, 0x0040, 0x8000};
    static const sys_reset_t causes[] = {SYS_RESET_POWER_ON, SYS_RESET_BROWN_OUT, SYS_RESET_PIN,
                                         SYS_RESET_WATCHDOG, SYS_RESET_ILLEGAL,   SYS_RESET_ILLEGAL,
                                         SYS_RESET_SOFTWARE, SYS_RESET_TRAP};
    for (int i = 0; i < 8; i++) {
        fake_poke(0x0740, flags[i]);
        sys_start();
        TEST_ASSERT_EQUAL_INT(causes[i], sys_reset_cause());
        TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x0740)); /* cleared for the next time */
        TEST_ASSERT_NULL(sys_fault());
    }
}

#if defined(__dsPIC33EP512MU810__)
static void test_interrupts_are_let_through(void)
{
    TEST_ASSERT_EQUAL_HEX16(0x8000, fake_peek(0x08C2) & 0x8000);
}
#endif

static void restart_by_a_trap(void)
{
    jmp_buf reset;
    fake.on_reset = &reset;
    if (setjmp(reset) == 0) {
        _DefaultInterrupt();
        TEST_FAIL_MESSAGE("came back");
    }
    fake.on_reset = NULL;
    fake_poke(0x0740, 0x0040); /* RESET instruction */
    sys_start();
}

/* INTCON1: oscillator, stack, address, arithmetic, DMA; an interrupt that nobody handles. */
static void test_every_trap_is_written_down_and_restarts(void) /* D-MCU-7 */
{
    static const uint16_t flags[] = {0x0002, 0x0004, 0x0008, 0x0010, 0x0020, 0x0000};
    for (uint16_t i = 0; i < sizeof flags / sizeof flags[0]; i++) {
        fake_poke(INTCON1_AT, flags[i]);
        restart_by_a_trap();
        const sys_fault_t *fault = sys_fault();
        TEST_ASSERT_NOT_NULL(fault);
        TEST_ASSERT_EQUAL_INT(SYS_RESET_TRAP, sys_reset_cause());
        TEST_ASSERT_EQUAL_INT(SYS_FAULT_HANDLER, fault->kind);
        TEST_ASSERT_EQUAL_HEX16(flags[i], fault->flags);
        TEST_ASSERT_EQUAL_UINT16(i + 1, fault->count);
    }
    /* A reset by pin has nothing to do with it. */
    fake_poke(0x0740, 0x0080);
    sys_start();
    TEST_ASSERT_NULL(sys_fault());
    TEST_ASSERT_EQUAL_INT(SYS_RESET_PIN, sys_reset_cause());
}

static void test_watchdog_is_kicked_only_while_the_clock_runs(void)
{
    sys_kick(1000);
    TEST_ASSERT_EQUAL_UINT(1, fake.watchdog_kicks);
    sys_kick(1000);
    sys_kick(1000);
    TEST_ASSERT_EQUAL_UINT(1, fake.watchdog_kicks);
    sys_kick(1001);
    TEST_ASSERT_EQUAL_UINT(2, fake.watchdog_kicks);
}

static bool answer;

static bool has_work(void *ctx)
{
    TEST_ASSERT_EQUAL_PTR(&answer, ctx);
    TEST_ASSERT_EQUAL_INT(7, SRbits.IPL); /* no handler comes between this and the idle state */
    return answer;
}

static void test_idle_ends_with_the_tick_and_is_left_out_when_there_is_work(void)
{
    TEST_ASSERT_TRUE(clock_start());
    answer = true;
    sys_idle(has_work, &answer);
    TEST_ASSERT_EQUAL_UINT(0, fake.idles);
    answer = false;
    const uint32_t before_ms = hal_clock_ms();
    sys_idle(has_work, &answer);
    TEST_ASSERT_EQUAL_UINT(1, fake.idles);
    TEST_ASSERT_EQUAL_INT(0, SRbits.IPL);
    TEST_ASSERT_EQUAL_UINT32(before_ms + 1, hal_clock_ms());
}

static void test_serial_number_is_the_programmed_one(void)
{
    fake_flash_set(PART_SERIAL_AT, 0xFF5678);
    fake_flash_set(PART_SERIAL_AT + 2, 0xFF1234);
    TEST_ASSERT_EQUAL_HEX32(0x12345678, hal_sys_serial());
}

static void test_serial_number_without_one_is_another_each_time(void)
{
    const uint32_t first = hal_sys_serial();
    const uint32_t second = hal_sys_serial();
    TEST_ASSERT_TRUE(first != second);
    TEST_ASSERT_TRUE(second != hal_sys_serial());
}

static void test_pins_are_selected_and_locked_again(void)
{
    fake_poke(0x0742, 0x0040); /* locked */
    board_start();
    TEST_ASSERT_EQUAL_HEX16(0x0040, fake_peek(0x0742) & 0x0040);
#if defined(__dsPIC33FJ64MC802__)
    TEST_ASSERT_EQUAL_HEX16(0x000B, fake_peek(0x06B4) & 0x001F); /* C1RX: RP11 */
    TEST_ASSERT_EQUAL_HEX16(0x000F, fake_peek(0x06A4) & 0x001F); /* U1RX: RP15 */
    TEST_ASSERT_EQUAL_HEX16(0x0010, fake_peek(0x06CA) & 0x001F); /* RP10: C1TX */
    TEST_ASSERT_EQUAL_HEX16(0x0003, fake_peek(0x06CE) & 0x001F); /* RP14: U1TX */
    TEST_ASSERT_EQUAL_HEX16(0xFFCF, fake_peek(0x032C));          /* AN4, AN5 analog */
    fake_poke(0x02CA, 0x0080);
#else
    TEST_ASSERT_EQUAL_HEX16(0x0060, fake_peek(0x06D4) & 0x007F); /* C1RX: RP96 */
    TEST_ASSERT_EQUAL_HEX16(0x0064, fake_peek(0x06C4) & 0x007F); /* U1RX: RP100 */
    TEST_ASSERT_EQUAL_HEX16(0x0E00, fake_peek(0x068E) & 0x3F00); /* RP97: C1TX */
    TEST_ASSERT_EQUAL_HEX16(0x0100, fake_peek(0x0692) & 0x3F00); /* RP101: U1TX */
    TEST_ASSERT_EQUAL_HEX16(0x0030, fake_peek(0x0E1E));          /* AN4, AN5 analog */
    fake_poke(0x0E32, 0x0040);
#endif
    TEST_ASSERT_FALSE(board_button());
#if defined(__dsPIC33FJ64MC802__)
    fake_poke(0x02CA, 0);
#else
    fake_poke(0x0E32, 0);
#endif
    TEST_ASSERT_TRUE(board_button());
    board_led(true);
    TEST_ASSERT_EQUAL_INT(1, LATAbits.LATA0);
    board_led(false);
    TEST_ASSERT_EQUAL_INT(0, LATAbits.LATA0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_clock_runs_on_the_crystal_at_40_mips);
    RUN_TEST(test_tick_counts_milliseconds);
    RUN_TEST(test_crystal_that_does_not_start_is_noticed);
    RUN_TEST(test_cause_of_the_reset);
#if defined(__dsPIC33EP512MU810__)
    RUN_TEST(test_interrupts_are_let_through);
#endif
    RUN_TEST(test_every_trap_is_written_down_and_restarts);
    RUN_TEST(test_watchdog_is_kicked_only_while_the_clock_runs);
    RUN_TEST(test_idle_ends_with_the_tick_and_is_left_out_when_there_is_work);
    RUN_TEST(test_serial_number_is_the_programmed_one);
    RUN_TEST(test_serial_number_without_one_is_another_each_time);
    RUN_TEST(test_pins_are_selected_and_locked_again);
    return UNITY_END();
}
