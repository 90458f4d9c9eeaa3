#include "linux_nvm.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* A disk may take half a second for a page, and the limb must not wait for it: a thread writes (D-LIN-5). It
 * shares what stands below lock. */
struct hal_nvm {
    int fd;                      /* -1: in memory */
    uint8_t bytes[HAL_NVM_SIZE]; /* contents when in memory */
    bool has_writer;
    pthread_t writer;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    hal_nvm_status_t status; /* HAL_NVM_BUSY: the writer has a page to write */
    bool ends;               /* the writer ends when it has nothing to write */
    uint16_t address;        /* of the page under way */
    uint16_t size;
    uint8_t page[HAL_NVM_PAGE];
};

static bool write_all(int fd, const uint8_t *bytes, size_t size, off_t at)
{
    ssize_t n;
    do {
        n = pwrite(fd, bytes, size, at);
    } while (n < 0 && errno == EINTR);
    if (n >= 0 && (size_t)n != size) {
        errno = ENOSPC;
    }
    return n == (ssize_t)size && fdatasync(fd) == 0;
}

/* An empty file is one that was made just now, or whose making was cut short: it is filled. */
static bool fill_if_empty(hal_nvm_t *nvm, off_t size)
{
    if (size != 0 || write_all(nvm->fd, nvm->bytes, HAL_NVM_SIZE, 0)) {
        return true;
    }
    int reason = errno;
    if (ftruncate(nvm->fd, 0) != 0) {
        reason = errno;
    }
    errno = reason;
    return false;
}

static bool fail(char *error, size_t error_size, const char *path, const char *reason)
{
    snprintf(error, error_size, "%s: %s", path, reason);
    return false;
}

/* Whoever may write the file decides what the limb does at the next start. */
static const char *fault_of(const struct stat *status)
{
    if (!S_ISREG(status->st_mode)) {
        return "not a regular file";
    }
    if (status->st_uid != geteuid() && status->st_uid != 0) {
        return "belongs to another user";
    }
    return (status->st_mode & (S_IWGRP | S_IWOTH)) != 0 ? "may be written by others" : NULL;
}

static bool open_file(hal_nvm_t *nvm, const char *path, char *error, size_t error_size)
{
    nvm->fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOCTTY | O_NOFOLLOW, S_IRUSR | S_IWUSR);
    if (nvm->fd < 0) {
        return fail(error, error_size, path, errno == ELOOP ? "is a symbolic link" : strerror(errno));
    }
    if (flock(nvm->fd, LOCK_EX | LOCK_NB) != 0) {
        return fail(error, error_size, path,
                    errno == EWOULDBLOCK ? "in use by another program" : strerror(errno));
    }
    struct stat status;
    if (fstat(nvm->fd, &status) != 0) {
        return fail(error, error_size, path, strerror(errno));
    }
    const char *fault = fault_of(&status);
    if (fault != NULL) {
        return fail(error, error_size, path, fault);
    }
    if (!fill_if_empty(nvm, status.st_size)) {
        return fail(error, error_size, path, strerror(errno));
    }
    if (status.st_size != 0 && status.st_size != (off_t)HAL_NVM_SIZE) {
        snprintf(error, error_size, "%s: has %lld bytes, expected %u", path, (long long)status.st_size,
                 HAL_NVM_SIZE);
        return false;
    }
    return true;
}

/* Writes page after page, until it is told to end. */
static void *write_pages(void *ctx)
{
    hal_nvm_t *nvm = ctx;
    pthread_mutex_lock(&nvm->lock);
    while (nvm->status == HAL_NVM_BUSY || !nvm->ends) {
        if (nvm->status != HAL_NVM_BUSY) {
            pthread_cond_wait(&nvm->changed, &nvm->lock);
            continue;
        }
        pthread_mutex_unlock(&nvm->lock);
        const bool done = write_all(nvm->fd, nvm->page, nvm->size, nvm->address);
        pthread_mutex_lock(&nvm->lock);
        nvm->status = done ? HAL_NVM_IDLE : HAL_NVM_FAILED;
    }
    pthread_mutex_unlock(&nvm->lock);
    return NULL;
}

/* Signals are for the loop's thread. */
static bool start_writer(hal_nvm_t *nvm)
{
    sigset_t all;
    sigset_t before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const int reason = pthread_create(&nvm->writer, NULL, write_pages, nvm);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    nvm->has_writer = reason == 0;
    errno = reason;
    return nvm->has_writer;
}

hal_nvm_t *linux_nvm_open(const char *path, char *error, size_t error_size)
{
    hal_nvm_t *nvm = calloc(1, sizeof *nvm);
    if (nvm == NULL) {
        fail(error, error_size, path == NULL ? "memory" : path, strerror(errno));
        return NULL;
    }
    nvm->fd = -1;
    nvm->status = HAL_NVM_IDLE;
    memset(nvm->bytes, 0xFF, sizeof nvm->bytes);
    pthread_mutex_init(&nvm->lock, NULL);
    pthread_cond_init(&nvm->changed, NULL);
    if (path != NULL && (!open_file(nvm, path, error, error_size) ||
                         (!start_writer(nvm) && !fail(error, error_size, path, strerror(errno))))) {
        linux_nvm_close(nvm);
        return NULL;
    }
    return nvm;
}

static void end_writer(hal_nvm_t *nvm)
{
    pthread_mutex_lock(&nvm->lock);
    nvm->ends = true;
    pthread_cond_signal(&nvm->changed);
    pthread_mutex_unlock(&nvm->lock);
    pthread_join(nvm->writer, NULL);
}

void linux_nvm_close(hal_nvm_t *nvm)
{
    if (nvm == NULL) {
        return;
    }
    if (nvm->has_writer) {
        end_writer(nvm);
    }
    if (nvm->fd >= 0) {
        close(nvm->fd);
    }
    pthread_cond_destroy(&nvm->changed);
    pthread_mutex_destroy(&nvm->lock);
    free(nvm);
}

bool hal_nvm_read(hal_nvm_t *nvm, uint16_t address, uint8_t *bytes, uint16_t size)
{
    if ((uint32_t)address + size > HAL_NVM_SIZE) {
        return false;
    }
    if (nvm->fd < 0) {
        memcpy(bytes, &nvm->bytes[address], size);
        return true;
    }
    ssize_t n;
    do {
        n = pread(nvm->fd, bytes, size, address);
    } while (n < 0 && errno == EINTR);
    return n == (ssize_t)size;
}

bool hal_nvm_write(hal_nvm_t *nvm, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    bool in_page = size >= 1 && size <= HAL_NVM_PAGE && address % HAL_NVM_PAGE + size <= HAL_NVM_PAGE;
    if (!in_page || (uint32_t)address + size > HAL_NVM_SIZE) {
        return false;
    }
    if (nvm->fd < 0) {
        memcpy(&nvm->bytes[address], bytes, size);
        return true;
    }
    pthread_mutex_lock(&nvm->lock);
    const bool is_free = nvm->status != HAL_NVM_BUSY;
    if (is_free) {
        nvm->address = address;
        nvm->size = size;
        memcpy(nvm->page, bytes, size);
        nvm->status = HAL_NVM_BUSY;
        pthread_cond_signal(&nvm->changed);
    }
    pthread_mutex_unlock(&nvm->lock);
    return is_free;
}

hal_nvm_status_t hal_nvm_status(hal_nvm_t *nvm)
{
    pthread_mutex_lock(&nvm->lock);
    const hal_nvm_status_t status = nvm->status;
    pthread_mutex_unlock(&nvm->lock);
    return status;
}
