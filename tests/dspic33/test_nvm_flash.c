/* Program flash as memory: the contract, the unlock sequence, what happens when an area is full or the power
 * fails. */
#include <string.h>
#include <xc.h>

#include "fake.h"
#include "flash.h"
#include "nvm.h"
#include "nvm_contract.h"
#include "part.h"
#include "unity.h"

#define SLOTS (PART_FLASH_STORE_PAGES * PART_FLASH_PAGE / 64u)
#define STORE ((uint16_t)PART_FLASH_STORE_AT)

hal_nvm_t *nvm_contract_open(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
    return nvm_open();
}

hal_nvm_t *nvm_contract_reopen(hal_nvm_t *nvm)
{
    (void)nvm;
    fake.flash_cut_after = FAKE_NEVER;
    fake_power_on(true);
    fake_enable_interrupts();
    return nvm_open();
}

void nvm_contract_wait(void) {}

void setUp(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

static hal_nvm_status_t finish(hal_nvm_t *nvm)
{
    for (int polls = 0; polls < 50; polls++) {
        const hal_nvm_status_t status = hal_nvm_status(nvm);
        if (status != HAL_NVM_BUSY) {
            return status;
        }
    }
    return HAL_NVM_BUSY;
}

static void write_byte(hal_nvm_t *nvm, uint16_t at, uint8_t byte)
{
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, at, &byte, 1));
    TEST_ASSERT_EQUAL_INT(HAL_NVM_IDLE, finish(nvm));
}

static uint8_t read_byte(hal_nvm_t *nvm, uint16_t at)
{
    uint8_t byte = 0;
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, at, &byte, 1));
    return byte;
}

static void test_words_are_erased_and_programmed_with_the_unlock_sequence(void)
{
    fake_flash_set(PART_FLASH_STORE_AT + 6, 0x123456);
    fake_flash_set(PART_FLASH_STORE_AT + PART_FLASH_PAGE, 0x654321);
    TEST_ASSERT_TRUE(flash_erase(STORE));
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFF, fake_flash_word(PART_FLASH_STORE_AT + 6));
    TEST_ASSERT_EQUAL_HEX32(0x654321, fake_flash_word(PART_FLASH_STORE_AT + PART_FLASH_PAGE));
    TEST_ASSERT_TRUE(flash_program(STORE + 4, 0xCDEF, 0x2345, 0x01AB));
    TEST_ASSERT_EQUAL_HEX32(0xABCDEF, fake_flash_word(PART_FLASH_STORE_AT + 4));
    TEST_ASSERT_EQUAL_HEX32(0x012345, fake_flash_word(PART_FLASH_STORE_AT + 6));
    TEST_ASSERT_EQUAL_HEX32(0xFFFFFF, fake_flash_word(PART_FLASH_STORE_AT + 8));
    TEST_ASSERT_EQUAL_HEX16(0xCDEF, flash_read(STORE + 4));
    TEST_ASSERT_EQUAL_HEX16(0x2345, flash_read(STORE + 6));
    TEST_ASSERT_EQUAL_HEX16(0x01AB, flash_read_upper(STORE + 4));
}

static void test_writes_are_locked_again_and_interrupts_on(void)
{
    TEST_ASSERT_TRUE(flash_program(STORE, 1, 2, 0));
    TEST_ASSERT_EQUAL_HEX16(0, NVMCON);
#if defined(__dsPIC33EP512MU810__)
    TEST_ASSERT_EQUAL_INT(1, INTCON2bits.GIE);
#endif
}

static void test_error_of_the_part_is_reported(void)
{
    fake.flash_fails = true;
    TEST_ASSERT_FALSE(flash_erase(STORE));
    fake.flash_fails = true;
    TEST_ASSERT_FALSE(flash_program(STORE, 1, 2, 0));
    hal_nvm_t *nvm = nvm_open();
    write_byte(nvm, 5, 55);
    fake.flash_fails = true;
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 5, (const uint8_t *)"x", 1));
    TEST_ASSERT_EQUAL_INT(HAL_NVM_FAILED, finish(nvm));
    TEST_ASSERT_EQUAL_HEX8(55, read_byte(nvm, 5));
    write_byte(nvm, 5, 66);
    TEST_ASSERT_EQUAL_HEX8(66, read_byte(nvm, 5));
}

static void test_full_area_moves_on_and_keeps_everything(void)
{
    hal_nvm_t *nvm = nvm_open();
    for (uint16_t page = 0; page < 20; page++) {
        write_byte(nvm, (uint16_t)(page * 64), (uint8_t)page);
    }
    for (uint16_t i = 0; i < 5 * SLOTS; i++) {
        write_byte(nvm, 64 * 20, (uint8_t)i);
        TEST_ASSERT_EQUAL_HEX8(i & 0xFF, read_byte(nvm, 64 * 20));
    }
    nvm = nvm_contract_reopen(nvm);
    for (uint16_t page = 0; page < 20; page++) {
        TEST_ASSERT_EQUAL_HEX8(page, read_byte(nvm, (uint16_t)(page * 64)));
    }
    TEST_ASSERT_EQUAL_HEX8((5 * SLOTS - 1) & 0xFF, read_byte(nvm, 64 * 20));
    TEST_ASSERT_TRUE(fake.flash_erases >= 5 * PART_FLASH_STORE_PAGES);
}

/* When the area is left, each of these pages has many entries in it: the newest goes along. */
static void test_move_takes_the_newest_entry_of_each_page(void)
{
    hal_nvm_t *nvm = nvm_open();
    uint8_t newest[5] = {0};
    for (uint16_t i = 0; i < 3 * SLOTS; i++) {
        newest[i % 5] = (uint8_t)(i + 1);
        write_byte(nvm, (uint16_t)(i % 5 * 64), newest[i % 5]);
        for (uint16_t page = 0; page < 5 && page <= i; page++) {
            TEST_ASSERT_EQUAL_HEX8(newest[page], read_byte(nvm, (uint16_t)(page * 64)));
        }
    }
}

static uint8_t page_byte(uint16_t page)
{
    return (uint8_t)(page % 250u); /* FFh would change nothing */
}

static void test_page_more_than_an_area_holds_fails_and_changes_nothing(void)
{
    hal_nvm_t *nvm = nvm_open();
    const uint16_t pages = SLOTS - 1 < 512 ? (uint16_t)(SLOTS - 1) : 512;
    for (uint16_t page = 0; page < pages; page++) {
        write_byte(nvm, (uint16_t)(page * 64), page_byte(page));
    }
    if (pages < 512) {
        TEST_ASSERT_TRUE(hal_nvm_write(nvm, (uint16_t)(pages * 64), (const uint8_t *)"x", 1));
        TEST_ASSERT_EQUAL_INT(HAL_NVM_FAILED, finish(nvm));
        TEST_ASSERT_EQUAL_HEX8(0xFF, read_byte(nvm, (uint16_t)(pages * 64)));
    }
    for (uint16_t page = 0; page < pages; page++) {
        TEST_ASSERT_EQUAL_HEX8(page_byte(page), read_byte(nvm, (uint16_t)(page * 64)));
    }
    write_byte(nvm, 0, 77); /* a page that is there can still be written */
    TEST_ASSERT_EQUAL_HEX8(77, read_byte(nvm, 0));
}

static uint8_t other_byte(uint16_t page)
{
    return (uint8_t)(page * 5 + 1);
}

/* A memory one write before its area is full. */
static hal_nvm_t *make_nearly_full(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
    hal_nvm_t *nvm = nvm_open();
    for (uint16_t page = 1; page < 20; page++) {
        write_byte(nvm, (uint16_t)(page * 64), other_byte(page));
    }
    for (uint16_t left = SLOTS - 1 - 19; left > 0; left--) {
        write_byte(nvm, 0, left % 2 != 0 ? 10 : 9);
    }
    return nvm;
}

/* The power fails at every operation of a write and of a move to the other area, which follows it: the byte
 * is the old or the new one, all others are kept, and writing goes on. */
static void test_power_may_fail_at_any_operation(void)
{
    bool moved = false;
    for (int cut = 0; !moved; cut += cut < 50 ? 1 : 13) {
        hal_nvm_t *nvm = make_nearly_full();
        const unsigned erases = fake.flash_erases;
        fake.flash_cut_after = cut;
        TEST_ASSERT_TRUE(hal_nvm_write(nvm, 0, (const uint8_t *)"\x0B", 1));
        const bool first_done = finish(nvm) == HAL_NVM_IDLE && fake.flash_cut_after > 0;
        (void)hal_nvm_write(nvm, 0, (const uint8_t *)"\x0C", 1);
        (void)finish(nvm);
        moved = fake.flash_cut_after > 0 && fake.flash_erases >= erases + PART_FLASH_STORE_PAGES;
        nvm = nvm_contract_reopen(nvm);
        const uint8_t byte = read_byte(nvm, 0);
        TEST_ASSERT_TRUE(byte == 10 || byte == 11 || byte == 12);
        TEST_ASSERT_TRUE(!first_done || byte != 10);
        TEST_ASSERT_TRUE(!moved || byte == 12);
        for (uint16_t page = 1; page < 20; page++) {
            TEST_ASSERT_EQUAL_HEX8(other_byte(page), read_byte(nvm, (uint16_t)(page * 64)));
        }
        write_byte(nvm, 0, 99);
        nvm = nvm_contract_reopen(nvm);
        TEST_ASSERT_EQUAL_HEX8(99, read_byte(nvm, 0));
    }
}

static void test_page_that_is_as_it_is_to_be_is_not_written(void)
{
    hal_nvm_t *nvm = nvm_open();
    write_byte(nvm, 70, 1);
    const unsigned programs = fake.flash_programs;
    write_byte(nvm, 70, 1);
    write_byte(nvm, 71, 0xFF);
    TEST_ASSERT_EQUAL_UINT(programs, fake.flash_programs);
    write_byte(nvm, 70, 0xFF);
    TEST_ASSERT_TRUE(fake.flash_programs > programs);
    TEST_ASSERT_EQUAL_HEX8(0xFF, read_byte(nvm, 70));
}

static void test_area_fits_the_polls_of_a_job(void)
{
    hal_nvm_t *nvm = make_nearly_full();
    write_byte(nvm, 0, 1);
    unsigned polls = 1;
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 0, (const uint8_t *)"\x0D", 1));
    while (hal_nvm_status(nvm) == HAL_NVM_BUSY) {
        polls++;
    }
    TEST_ASSERT_TRUE(polls < 50); /* ARB_CONFIG_POLLS_MAX */
}

int main(void)
{
    UNITY_BEGIN();
    nvm_contract_run();
    RUN_TEST(test_words_are_erased_and_programmed_with_the_unlock_sequence);
    RUN_TEST(test_writes_are_locked_again_and_interrupts_on);
    RUN_TEST(test_error_of_the_part_is_reported);
    RUN_TEST(test_full_area_moves_on_and_keeps_everything);
    RUN_TEST(test_move_takes_the_newest_entry_of_each_page);
    RUN_TEST(test_page_more_than_an_area_holds_fails_and_changes_nothing);
    RUN_TEST(test_power_may_fail_at_any_operation);
    RUN_TEST(test_page_that_is_as_it_is_to_be_is_not_written);
    RUN_TEST(test_area_fits_the_polls_of_a_job);
    return UNITY_END();
}
