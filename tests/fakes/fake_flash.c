/* Program flash: table reads and writes, erase and program with their unlock sequence. */
#include <xc.h>

#include "fake_parts.h"

enum { WORDS = 0x56000 / 2, PAGE_WORDS = PART_AT(512, 1024) };

static uint32_t words[WORDS];
#if defined(__dsPIC33FJ64MC802__)
static uint32_t latched_at;
static uint32_t latch;
#else
static uint32_t latches[2];
#endif

uint32_t fake_flash_word(uint32_t at)
{
    return words[at / 2];
}

void fake_flash_set(uint32_t at, uint32_t word)
{
    words[at / 2] = word;
}

static uint32_t table_at(uint16_t at)
{
    return (uint32_t)fake_peek(AT_TBLPAG) << 16 | at;
}

uint16_t fake_table_read(uint16_t at, int high)
{
    const uint32_t full = table_at(at);
    if (full / 2 >= WORDS) {
        fake.misuses++;
        return 0;
    }
    return (uint16_t)(high ? words[full / 2] >> 16 : words[full / 2]);
}

static uint32_t with_half(uint32_t word, int high, uint16_t value)
{
    return high ? (word & 0xFFFFu) | (uint32_t)(value & 0xFFu) << 16 : (word & 0xFF0000u) | value;
}

static void erase(uint32_t at)
{
    fake.flash_erases++;
    for (uint32_t i = at / 2 / PAGE_WORDS * PAGE_WORDS, n = 0; n < PAGE_WORDS; n++) {
        words[i + n] = 0xFFFFFF;
    }
}

static void program(uint32_t at, uint32_t word)
{
    if (words[at / 2] != 0xFFFFFF) {
        fake.misuses++; /* not erased */
    }
    words[at / 2] &= word;
}

/* Counts an operation; false: the power has failed before it. */
static bool powered(void)
{
    if (fake.flash_cut_after > 0) {
        fake.flash_cut_after--;
        return true;
    }
    return fake.flash_cut_after == FAKE_NEVER;
}

#if defined(__dsPIC33FJ64MC802__)

void fake_table_write(uint16_t at, int high, uint16_t value)
{
    latched_at = table_at(at);
    latch = with_half(latch, high, value);
}

static void operate(uint16_t control)
{
    switch (control) {
    case 0x4042:
        erase(latched_at);
        break;
    case 0x4003:
        fake.flash_programs++;
        program(latched_at, latch);
        break;
    default:
        fake.misuses++;
        break;
    }
}

#else

void fake_table_write(uint16_t at, int high, uint16_t value)
{
    if (fake_peek(AT_TBLPAG) != 0xFA || at > 2) {
        fake.misuses++;
        return;
    }
    latches[at / 2] = with_half(latches[at / 2], high, value);
}

static void operate(uint16_t control)
{
    const uint32_t target = (uint32_t)fake_peek(0x072C) << 16 | fake_peek(0x072A);
    switch (control) {
    case 0x4003:
        erase(target);
        break;
    case 0x4001:
        fake.flash_programs++;
        if (target % 4 != 0) {
            fake.misuses++;
            break;
        }
        program(target, latches[0]);
        program(target + 2, latches[1]);
        break;
    default:
        fake.misuses++;
        break;
    }
}

#endif

void fake_write_nvm(void)
{
    const uint16_t control = fake_peek(AT_NVMCON);
    if (!fake_undisturbed()) {
        fake.misuses++;
        return;
    }
    if (fake.flash_fails) {
        fake.flash_fails = false;
        fake_poke(AT_NVMCON, control | 0x2000);
        return;
    }
    if (powered()) {
        operate(control);
    }
}

void fake_flash_power_on(bool keep_memory)
{
    for (uint32_t i = 0; i < WORDS && !keep_memory; i++) {
        words[i] = 0xFFFFFF;
    }
}
