/* Registers, interrupts, time, clock, reset, ADC. */
#include <stdlib.h>
#include <string.h>
#include <xc.h>

#include "fake_parts.h"

fake_t fake;
fake_space_t fake_space __attribute__((aligned(65536)));

static uint16_t last_at;
static uint16_t last_value;
static uint16_t disi_left;
static bool unlocked; /* OSCCON is being written by its own sequence */
static unsigned switch_left;
static uint32_t tick_left_us;
static int level;      /* of the handler that runs */
static bool accessing; /* fake.on_access runs */

/* Handlers that a test does not link are not there. */
void _T1Interrupt(void) __attribute__((weak));
void _U1RXInterrupt(void) __attribute__((weak));
void _U1TXInterrupt(void) __attribute__((weak));
void _MI2C1Interrupt(void) __attribute__((weak));
void _C1Interrupt(void) __attribute__((weak));

typedef struct {
    uint16_t flags, enables, bit;
    uint16_t level_at, level_shift;
    void (*run)(void);
} source_t;

static const source_t sources[] = {{AT_IFS0, AT_IEC0, 3, AT_IPC0, 12, _T1Interrupt},
                                   {AT_IFS0, AT_IEC0, 11, AT_IPC2, 12, _U1RXInterrupt},
                                   {AT_IFS0, AT_IEC0, 12, AT_IPC3, 0, _U1TXInterrupt},
                                   {AT_IFS1, AT_IEC1, 1, AT_IPC4, 4, _MI2C1Interrupt},
                                   {AT_IFS2, AT_IEC2, 3, AT_IPC8, 12, _C1Interrupt}};

void fake_raise(uint16_t flag_at, uint16_t bit)
{
    *fake_at(flag_at) = (uint16_t)(*fake_at(flag_at) | 1u << bit);
}

bool fake_undisturbed(void)
{
#if defined(__dsPIC33EP512MU810__)
    if ((*fake_at(AT_INTCON2) & 0x8000) != 0) {
        return false;
    }
#endif
    return disi_left >= 5;
}

static bool all_off(void)
{
#if defined(__dsPIC33EP512MU810__)
    return (*fake_at(AT_INTCON2) & 0x8000) == 0 || disi_left != 0;
#else
    return disi_left != 0;
#endif
}

static bool is_pending(const source_t *source)
{
    return (*fake_at(source->flags) & *fake_at(source->enables) & 1u << source->bit) != 0;
}

static void settle(void);

/* Runs what is due, the most urgent first; a handler is interrupted by more urgent ones alone. */
void fake_deliver(void)
{
    settle();
    for (;;) {
        const int processor = *fake_at(AT_SR) >> 5 & 7;
        int best = processor > level ? processor : level;
        const source_t *due = NULL;
        for (size_t i = 0; i < sizeof sources / sizeof sources[0] && !all_off(); i++) {
            const int own = *fake_at(sources[i].level_at) >> sources[i].level_shift & 7;
            if (is_pending(&sources[i]) && own > best) {
                best = own;
                due = &sources[i];
            }
        }
        if (due == NULL) {
            return;
        }
        const int before = level;
        level = best;
        due->run();
        settle();
        level = before;
    }
}

static bool is_pin_select(uint16_t at)
{
#if defined(__dsPIC33FJ64MC802__)
    return at >= 0x0680 && at < 0x06E0;
#else
    return at >= 0x0680 && at < 0x0700;
#endif
}

static void pins_changed(uint16_t at, uint16_t before, uint16_t after)
{
    const uint16_t clock_at = PART_AT(0x02C8, 0x0E30);
    const uint16_t clock_bit = PART_AT(8, 10);
    if (at == clock_at && ((before ^ after) & 1u << clock_bit) != 0) {
        fake_i2c_clock_pin((after & 1u << clock_bit) != 0);
    }
    if (is_pin_select(at) && (*fake_at(0x0742) & 0x40) != 0) {
        fake.misuses++;
        *fake_at(at) = before;
    }
}

static void adc_changed(uint16_t at, uint16_t after)
{
    if (at == 0x0320 && (after & 0x8002) == 0x8002 && !fake.adc_dead) {
        *fake_at(0x0300) = fake.adc[*fake_at(0x0328) & 31u];
        *fake_at(0x0320) = (uint16_t)((after & ~2u) | 1u);
    }
}

static void changed(uint16_t at, uint16_t before, uint16_t after)
{
    if (at == 0x0742 && !unlocked) {
        fake.misuses++;
        *fake_at(at) = before;
    }
    if (at == 0x0104 && (after & 0x8000) != 0) {
        tick_left_us = (uint32_t)((*fake_at(0x0102) + 1u) * 8u / 40u);
    }
    fake_can_changed(at, before, after);
    fake_i2c_changed(at, before, after);
    fake_uart_changed(at, after);
    pins_changed(at, before, after);
    adc_changed(at, after);
}

/* What was written through the pointer that was handed out last takes effect. */
static void settle(void)
{
    const uint16_t at = last_at;
    const uint16_t before = last_value;
    last_at = 0;
    if (at != 0 && *fake_at(at) != before) {
        changed(at, before, *fake_at(at));
    }
}

static void step_oscillator(void)
{
    if (switch_left != 0 && --switch_left == 0) {
        volatile uint16_t *osccon = fake_at(0x0742);
        *osccon = (uint16_t)((*osccon & 0x07C0u) | (*osccon >> 8 & 7u) << 12 | 0x20u);
    }
}

volatile uint16_t *fake_register(uint16_t at)
{
    settle();
    if (fake.on_access != NULL && !accessing) {
        accessing = true;
        fake.on_access();
        accessing = false;
    }
    step_oscillator();
    if (disi_left != 0) {
        disi_left--;
    }
    fake_deliver();
    fake_can_access(at);
    fake_uart_access(at);
    fake_i2c_access(at);
    last_at = at;
    last_value = *fake_at(at);
    return fake_at(at);
}

uint16_t fake_peek(uint16_t at)
{
    settle();
    return *fake_at(at);
}

void fake_poke(uint16_t at, uint16_t value)
{
    settle();
    *fake_at(at) = value;
}

/* --- builtins --- */

void fake_disi(uint16_t cycles)
{
    settle();
    disi_left = cycles;
}

void fake_write_oscconh(uint8_t value)
{
    settle();
    *fake_at(0x0742) = (uint16_t)((*fake_at(0x0742) & 0xF8FFu) | (value & 7u) << 8);
}

void fake_write_oscconl(uint8_t value)
{
    settle();
    *fake_at(0x0742) = (uint16_t)((*fake_at(0x0742) & 0xFF20u) | (value & 0xDFu));
    if ((value & 1u) != 0 && (fake.crystal || (*fake_at(0x0742) >> 8 & 7u) != 3)) {
        switch_left = 100;
    }
}

void fake_nop(void)
{
    settle();
}

void fake_clear_watchdog(void)
{
    fake.watchdog_kicks++;
}

void fake_reset(void)
{
    settle();
    if (fake.on_reset == NULL) {
        abort();
    }
    level = 0;
    disi_left = 0;
    longjmp(*fake.on_reset, 1);
}

/* --- time --- */

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static uint32_t next_us(void)
{
    uint32_t next = (*fake_at(0x0104) & 0x8000) != 0 ? tick_left_us : 1000u;
    next = least(next, fake_uart_next_us());
    return least(next, fake_i2c_next_us());
}

static void pass_us(uint32_t us)
{
    fake.now_us += us;
    *fake_at(0x0100) = (uint16_t)(fake.now_us * 5u);
    fake_uart_pass_us(us);
    fake_i2c_pass_us(us);
    if ((*fake_at(0x0104) & 0x8000) != 0) {
        tick_left_us -= us;
        if (tick_left_us == 0) {
            tick_left_us = (uint32_t)((*fake_at(0x0102) + 1u) * 8u / 40u);
            fake_raise(AT_IFS0, 3);
        }
    }
}

void fake_run_us(uint32_t us)
{
    fake_deliver();
    while (us != 0) {
        const uint32_t part = least(us, next_us());
        pass_us(part);
        us -= part;
        fake_deliver();
    }
}

/* Until an enabled interrupt is pending, its handler may run or not. */
void fake_idle(void)
{
    settle();
    fake.idles++;
    if (fake.on_idle != NULL) {
        fake.on_idle();
    }
    for (unsigned i = 0; i < 1000; i++) {
        for (size_t s = 0; s < sizeof sources / sizeof sources[0]; s++) {
            if (is_pending(&sources[s])) {
                fake_deliver();
                return;
            }
        }
        pass_us(next_us());
    }
    abort(); /* nothing would ever wake the part */
}

void fake_enable_interrupts(void)
{
#if defined(__dsPIC33EP512MU810__)
    fake_poke(AT_INTCON2, 0x8000);
#endif
}

void fake_power_on(bool keep_memory)
{
    if (!keep_memory) {
        memset(&fake, 0, sizeof fake);
        memset(fake.eeprom, 0xFF, sizeof fake.eeprom);
        fake.eeprom_present = true;
        fake.eeprom_write_us = 5000;
        fake.crystal = true;
        fake.can_mode_delay = 3;
        fake.flash_cut_after = FAKE_NEVER;
    }
    memset(&fake_space, 0, sizeof fake_space);
    last_at = 0;
    disi_left = 0;
    switch_left = 0;
    level = 0;
    accessing = false;
    *fake_at(0x0740) = 0x0003; /* RCON: POR, BOR */
    *fake_at(0x0742) = 0x0000; /* internal oscillator */
    *fake_at(0x0744) = 0x3040;
    *fake_at(0x0746) = 0x0030;
    fake_can_power_on();
    fake_i2c_power_on();
    fake_uart_power_on();
    fake_flash_power_on(keep_memory);
}
