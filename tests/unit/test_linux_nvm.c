/* Non-volatile memory in a file: what is on the disk is looked at with plain file functions. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "linux_nvm.h"
#include "nvm_contract.h"
#include "unity.h"

static char folder[] = "/tmp/test_linux_nvm.XXXXXX";
static char path[64];
static char error[200];
static hal_nvm_t *contracted; /* the memory of the contract's tests */

void setUp(void)
{
    memset(folder + strlen(folder) - 6, 'X', 6);
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/nvm", folder);
    error[0] = '\0';
}

void tearDown(void)
{
    if (contracted != NULL) {
        linux_nvm_close(contracted);
        contracted = NULL;
    }
    unlink(path);
    rmdir(folder);
}

static hal_nvm_t *open_good(const char *where)
{
    hal_nvm_t *nvm = linux_nvm_open(where, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(nvm, error);
    return nvm;
}

/* How the write under way ends. */
static hal_nvm_status_t outcome(hal_nvm_t *nvm)
{
    while (hal_nvm_status(nvm) == HAL_NVM_BUSY) {
        nvm_contract_wait();
    }
    return hal_nvm_status(nvm);
}

static void write_good(hal_nvm_t *nvm, uint16_t address, const char *text)
{
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, address, (const uint8_t *)text, (uint16_t)strlen(text)));
    TEST_ASSERT_EQUAL_INT(HAL_NVM_IDLE, outcome(nvm));
}

static void expect_file(size_t address, const char *text)
{
    uint8_t bytes[HAL_NVM_SIZE + 1];
    uint8_t expected[HAL_NVM_SIZE];
    memset(expected, 0xFF, sizeof expected);
    for (size_t i = 0; text[i] != '\0'; i++) {
        expected[address + i] = (uint8_t)text[i];
    }
    int fd = open(path, O_RDONLY);
    TEST_ASSERT_EQUAL_INT(HAL_NVM_SIZE, read(fd, bytes, sizeof bytes));
    close(fd);
    TEST_ASSERT_EQUAL_MEMORY(expected, bytes, HAL_NVM_SIZE);
}

static void make_file(size_t size)
{
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    TEST_ASSERT_EQUAL_INT(0, ftruncate(fd, (off_t)size));
    close(fd);
}

static void test_new_file_is_private_and_holds_ffh(void)
{
    hal_nvm_t *nvm = open_good(path);
    struct stat status;
    TEST_ASSERT_EQUAL_INT(0, stat(path, &status));
    TEST_ASSERT_EQUAL_HEX32(0600, status.st_mode & 07777);
    expect_file(0, "");
    TEST_ASSERT_EQUAL_INT(HAL_NVM_IDLE, hal_nvm_status(nvm));
    linux_nvm_close(nvm);
}

static void test_written_bytes_are_in_the_file_and_survive_reopening(void)
{
    hal_nvm_t *nvm = open_good(path);
    write_good(nvm, 64, "first");
    write_good(nvm, 64, "later");
    expect_file(64, "later");
    linux_nvm_close(nvm);
    nvm = open_good(path);
    uint8_t bytes[6];
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, 64, bytes, sizeof bytes));
    TEST_ASSERT_EQUAL_MEMORY("later\xFF", bytes, sizeof bytes);
    linux_nvm_close(nvm);
}

static void test_file_is_locked_while_open(void)
{
    char expected[200];
    hal_nvm_t *nvm = open_good(path);
    TEST_ASSERT_NULL(linux_nvm_open(path, error, sizeof error));
    snprintf(expected, sizeof expected, "%s: in use by another program", path);
    TEST_ASSERT_EQUAL_STRING(expected, error);
    linux_nvm_close(nvm);
    linux_nvm_close(open_good(path));
}

static void test_file_of_another_size_is_refused_and_left_alone(void)
{
    const size_t sizes[] = {1, HAL_NVM_SIZE - 1, HAL_NVM_SIZE + 1};
    for (size_t i = 0; i < 3; i++) {
        make_file(sizes[i]);
        char expected[200];
        TEST_ASSERT_NULL(linux_nvm_open(path, error, sizeof error));
        snprintf(expected, sizeof expected, "%s: has %zu bytes, expected 32768", path, sizes[i]);
        TEST_ASSERT_EQUAL_STRING(expected, error);
        struct stat status;
        TEST_ASSERT_EQUAL_INT(0, stat(path, &status));
        TEST_ASSERT_EQUAL_INT64(sizes[i], status.st_size);
    }
}

static void test_empty_file_is_filled(void)
{
    make_file(0);
    linux_nvm_close(open_good(path));
    expect_file(0, "");
}

static void test_missing_folder_and_folder_are_refused_by_name(void)
{
    char missing[80];
    char expected[200];
    snprintf(missing, sizeof missing, "%s/none/nvm", folder);
    TEST_ASSERT_NULL(linux_nvm_open(missing, error, sizeof error));
    snprintf(expected, sizeof expected, "%s: No such file or directory", missing);
    TEST_ASSERT_EQUAL_STRING(expected, error);
    TEST_ASSERT_NULL(linux_nvm_open(folder, error, sizeof error));
    snprintf(expected, sizeof expected, "%s: Is a directory", folder);
    TEST_ASSERT_EQUAL_STRING(expected, error);
}

static void test_device_that_takes_no_writes_is_refused(void)
{
    TEST_ASSERT_NULL(linux_nvm_open("/dev/full", error, sizeof error));
    TEST_ASSERT_EQUAL_STRING("/dev/full: not a regular file", error);
}

static void test_file_cut_short_meanwhile_fails_to_read(void)
{
    hal_nvm_t *nvm = open_good(path);
    TEST_ASSERT_EQUAL_INT(0, truncate(path, 100));
    uint8_t byte;
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, 99, &byte, 1));
    TEST_ASSERT_FALSE(hal_nvm_read(nvm, 100, &byte, 1));
    linux_nvm_close(nvm);
}

/* Files of this process may not become longer than this: the nearest thing to a full disk. */
static void limit_file_size(rlim_t size)
{
    struct rlimit limit;
    signal(SIGXFSZ, SIG_IGN);
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &limit));
    limit.rlim_cur = size;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &limit));
}

static void test_failed_write_is_reported_and_the_next_one_may_succeed(void)
{
    hal_nvm_t *nvm = open_good(path);
    limit_file_size(1024);
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 2048, (const uint8_t *)"x", 1));
    hal_nvm_status_t status = outcome(nvm);
    limit_file_size(RLIM_INFINITY);
    TEST_ASSERT_EQUAL_INT(HAL_NVM_FAILED, status);
    expect_file(0, "");
    write_good(nvm, 2048, "y");
    expect_file(2048, "y");
    linux_nvm_close(nvm);
}

static void test_file_that_cannot_be_filled_is_left_empty(void)
{
    limit_file_size(1024);
    hal_nvm_t *nvm = linux_nvm_open(path, error, sizeof error);
    limit_file_size(RLIM_INFINITY);
    TEST_ASSERT_NULL(nvm);
    linux_nvm_close(open_good(path));
}

static void test_memory_without_a_file_starts_empty_each_time(void)
{
    uint8_t bytes[3];
    for (int i = 0; i < 2; i++) {
        hal_nvm_t *nvm = open_good(NULL);
        TEST_ASSERT_TRUE(hal_nvm_read(nvm, 0, bytes, 3));
        TEST_ASSERT_EQUAL_MEMORY("\xFF\xFF\xFF", bytes, 3);
        write_good(nvm, 0, "ab");
        TEST_ASSERT_TRUE(hal_nvm_read(nvm, 0, bytes, 3));
        TEST_ASSERT_EQUAL_MEMORY("ab\xFF", bytes, 3);
        linux_nvm_close(nvm);
    }
}

/* A disk that is slow: it writes when the test lets it. The linker puts this in front of the real one. */
static sem_t disk;
static bool disk_is_held;
static pthread_t caller; /* the thread of the tests */

/* NOLINTBEGIN(bugprone-reserved-identifier): the linker's names */
int __real_fdatasync(int fd);
int __wrap_fdatasync(int fd);

int __wrap_fdatasync(int fd)
{
    if (disk_is_held) {
        TEST_ASSERT_FALSE_MESSAGE(pthread_equal(pthread_self(), caller), "the caller waits for the disk");
        while (sem_wait(&disk) != 0) {
        }
    }
    return __real_fdatasync(fd);
}
/* NOLINTEND(bugprone-reserved-identifier) */

/* D-LIN-5 */
static void test_a_slow_disk_holds_nobody_up(void)
{
    uint8_t byte;
    hal_nvm_t *nvm = open_good(path);
    TEST_ASSERT_EQUAL_INT(0, sem_init(&disk, 0, 0));
    caller = pthread_self();
    disk_is_held = true;
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 64, (const uint8_t *)"slow", 4));
    TEST_ASSERT_EQUAL_INT(HAL_NVM_BUSY, hal_nvm_status(nvm));
    TEST_ASSERT_FALSE(hal_nvm_write(nvm, 128, (const uint8_t *)"no", 2));
    TEST_ASSERT_TRUE(hal_nvm_read(nvm, 0, &byte, 1));
    disk_is_held = false;
    TEST_ASSERT_EQUAL_INT(0, sem_post(&disk));
    TEST_ASSERT_EQUAL_INT(HAL_NVM_IDLE, outcome(nvm));
    expect_file(64, "slow");
    linux_nvm_close(nvm);
    (void)sem_destroy(&disk);
}

static void test_the_end_waits_for_the_write_under_way(void)
{
    hal_nvm_t *nvm = open_good(path);
    TEST_ASSERT_TRUE(hal_nvm_write(nvm, 64, (const uint8_t *)"last", 4));
    linux_nvm_close(nvm);
    expect_file(64, "last");
}

static void expect_refused(const char *reason)
{
    char expected[200];
    TEST_ASSERT_NULL(linux_nvm_open(path, error, sizeof error));
    (void)snprintf(expected, sizeof expected, "%s: %s", path, reason);
    TEST_ASSERT_EQUAL_STRING(expected, error);
}

/* Whoever can put another file in its place, or write to it, decides what the limb does. */
static void test_files_that_others_may_write_are_refused(void)
{
    char target[80];
    (void)snprintf(target, sizeof target, "%s/target", folder);
    TEST_ASSERT_EQUAL_INT(0, symlink(target, path));
    expect_refused("is a symbolic link");
    TEST_ASSERT_EQUAL_INT(-1, access(target, F_OK));
    TEST_ASSERT_EQUAL_INT(0, unlink(path));
    make_file(HAL_NVM_SIZE);
    TEST_ASSERT_EQUAL_INT(0, chmod(path, 0620));
    expect_refused("may be written by others");
    TEST_ASSERT_EQUAL_INT(0, chmod(path, 0602));
    expect_refused("may be written by others");
    TEST_ASSERT_EQUAL_INT(0, chmod(path, 0644));
    linux_nvm_close(open_good(path));
}

static void test_a_file_of_another_user_is_refused(void)
{
    if (geteuid() != 0) {
        TEST_IGNORE_MESSAGE("only root can give a file away");
    }
    make_file(HAL_NVM_SIZE);
    TEST_ASSERT_EQUAL_INT(0, chown(path, 1234, 1234));
    expect_refused("belongs to another user");
}

/* The contract, on a file. */
hal_nvm_t *nvm_contract_open(void)
{
    contracted = open_good(path);
    return contracted;
}

hal_nvm_t *nvm_contract_reopen(hal_nvm_t *nvm)
{
    linux_nvm_close(nvm);
    return nvm_contract_open();
}

void nvm_contract_wait(void)
{
    (void)usleep(10000); /* the disk is another one's; nothing tells when it is done */
}

int main(void)
{
    UNITY_BEGIN();
    nvm_contract_run();
    RUN_TEST(test_new_file_is_private_and_holds_ffh);
    RUN_TEST(test_written_bytes_are_in_the_file_and_survive_reopening);
    RUN_TEST(test_file_is_locked_while_open);
    RUN_TEST(test_file_of_another_size_is_refused_and_left_alone);
    RUN_TEST(test_empty_file_is_filled);
    RUN_TEST(test_missing_folder_and_folder_are_refused_by_name);
    RUN_TEST(test_device_that_takes_no_writes_is_refused);
    RUN_TEST(test_file_cut_short_meanwhile_fails_to_read);
    RUN_TEST(test_failed_write_is_reported_and_the_next_one_may_succeed);
    RUN_TEST(test_file_that_cannot_be_filled_is_left_empty);
    RUN_TEST(test_memory_without_a_file_starts_empty_each_time);
    RUN_TEST(test_a_slow_disk_holds_nobody_up);
    RUN_TEST(test_the_end_waits_for_the_write_under_way);
    RUN_TEST(test_files_that_others_may_write_are_refused);
    RUN_TEST(test_a_file_of_another_user_is_refused);
    return UNITY_END();
}
