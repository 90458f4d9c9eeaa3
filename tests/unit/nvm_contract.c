#include "nvm_contract.h"

#include <string.h>

#include "unity.h"

static hal_nvm_status_t finish(hal_nvm_t *nvm)
{
    hal_nvm_status_t status = hal_nvm_status(nvm);
    for (int polls = 0; status == HAL_NVM_BUSY && polls < 1000; polls++) {
        nvm_contract_wait();
        status = hal_nvm_status(nvm);
    }
    return status;
}

static void write_good(hal_nvm_t *nvm, uint16_t address, const char *text)
{
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, address, (const uint8_t *)text, (uint16_t)strlen(text)));
    TEST_ASSERT_EQUAL_INT(HAL_NVM_IDLE, finish(nvm));
}

static void expect(hal_nvm_t *nvm, uint16_t address, const char *text)
{
    uint8_t bytes[HAL_NVM_PAGE * 2];
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, address, bytes, (uint16_t)strlen(text)));
    TEST_ASSERT_EQUAL_MEMORY(text, bytes, strlen(text));
}

static void test_new_memory_reads_ffh_and_is_idle(void)
{
    hal_nvm_t *nvm = nvm_contract_open();
    uint8_t bytes[100];
    TEST_ASSERT_EQUAL_INT(HAL_NVM_IDLE, hal_nvm_status(nvm));
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, 0, bytes, sizeof bytes));
    TEST_ASSERT_EACH_EQUAL_HEX8(0xFF, bytes, sizeof bytes);
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, HAL_NVM_SIZE - sizeof bytes, bytes, sizeof bytes));
    TEST_ASSERT_EACH_EQUAL_HEX8(0xFF, bytes, sizeof bytes);
    (void)nvm_contract_reopen(nvm);
}

static void test_what_is_written_is_read_and_survives_a_restart(void)
{
    hal_nvm_t *nvm = nvm_contract_open();
    write_good(nvm, 64, "first");
    write_good(nvm, 64, "later");
    expect(nvm, 64, "later\xFF");
    nvm = nvm_contract_reopen(nvm);
    expect(nvm, 63, "\xFFlater\xFF");
    (void)nvm_contract_reopen(nvm);
}

static void test_bytes_outside_a_write_keep_their_values(void)
{
    hal_nvm_t *nvm = nvm_contract_open();
    write_good(nvm, 128, "abcdefgh");
    write_good(nvm, 192, "next page");
    write_good(nvm, 130, "XY");
    expect(nvm, 127,
           "\xFF"
           "abXYefgh\xFF");
    expect(nvm, 192, "next page");
    (void)nvm_contract_reopen(nvm);
}

static void test_a_read_goes_over_pages(void)
{
    hal_nvm_t *nvm = nvm_contract_open();
    write_good(nvm, 60, "1234");
    write_good(nvm, 64, "5678");
    expect(nvm, 58,
           "\xFF\xFF"
           "12345678\xFF\xFF");
    (void)nvm_contract_reopen(nvm);
}

static void test_a_whole_page_and_the_last_one_can_be_written(void)
{
    hal_nvm_t *nvm = nvm_contract_open();
    uint8_t page[HAL_NVM_PAGE];
    uint8_t read[HAL_NVM_PAGE];
    for (uint8_t i = 0; i < HAL_NVM_PAGE; i++) {
        page[i] = (uint8_t)(i * 3 + 1);
    }
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, HAL_NVM_SIZE - HAL_NVM_PAGE, page, HAL_NVM_PAGE));
    TEST_ASSERT_EQUAL_INT(HAL_NVM_IDLE, finish(nvm));
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, HAL_NVM_SIZE - HAL_NVM_PAGE, read, HAL_NVM_PAGE));
    TEST_ASSERT_EQUAL_MEMORY(page, read, HAL_NVM_PAGE);
    (void)nvm_contract_reopen(nvm);
}

static void test_writes_outside_a_page_or_the_memory_are_refused(void)
{
    hal_nvm_t *nvm = nvm_contract_open();
    const uint8_t bytes[HAL_NVM_PAGE + 1] = {0};
    TEST_ASSERT_FALSE(hal_nvm_write(nvm, 0, bytes, 0));
    TEST_ASSERT_FALSE(hal_nvm_write(nvm, 0, bytes, HAL_NVM_PAGE + 1));
    TEST_ASSERT_FALSE(hal_nvm_write(nvm, 1, bytes, HAL_NVM_PAGE));
    TEST_ASSERT_FALSE(hal_nvm_write(nvm, 63, bytes, 2));
    TEST_ASSERT_FALSE(hal_nvm_write(nvm, HAL_NVM_SIZE, bytes, 1));
    expect(nvm, 0, "\xFF\xFF");
    expect(nvm, 63, "\xFF\xFF");
    (void)nvm_contract_reopen(nvm);
}

static void test_reads_outside_the_memory_are_refused(void)
{
    hal_nvm_t *nvm = nvm_contract_open();
    uint8_t bytes[2];
    TEST_ASSERT_FALSE(hal_nvm_read(nvm, HAL_NVM_SIZE - 1, bytes, 2));
    TEST_ASSERT_FALSE(hal_nvm_read(nvm, 0xFFFF, bytes, 2));
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, HAL_NVM_SIZE - 2, bytes, 2));
    (void)nvm_contract_reopen(nvm);
}

static void test_the_bytes_are_copied(void)
{
    hal_nvm_t *nvm = nvm_contract_open();
    char text[] = "mine";
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 256, (const uint8_t *)text, 4));
    memset(text, 0, sizeof text);
    TEST_ASSERT_EQUAL_INT(HAL_NVM_IDLE, finish(nvm));
    expect(nvm, 256, "mine");
    (void)nvm_contract_reopen(nvm);
}

void nvm_contract_run(void)
{
    RUN_TEST(test_new_memory_reads_ffh_and_is_idle);
    RUN_TEST(test_what_is_written_is_read_and_survives_a_restart);
    RUN_TEST(test_bytes_outside_a_write_keep_their_values);
    RUN_TEST(test_a_read_goes_over_pages);
    RUN_TEST(test_a_whole_page_and_the_last_one_can_be_written);
    RUN_TEST(test_writes_outside_a_page_or_the_memory_are_refused);
    RUN_TEST(test_reads_outside_the_memory_are_refused);
    RUN_TEST(test_the_bytes_are_copied);
}
