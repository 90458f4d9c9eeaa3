#include "linux_nvm.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

struct hal_nvm {
    int fd; /* -1: in memory */
    hal_nvm_status_t status;
    uint8_t bytes[HAL_NVM_SIZE]; /* contents when in memory */
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

static bool open_file(hal_nvm_t *nvm, const char *path, char *error, size_t error_size)
{
    nvm->fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOCTTY, S_IRUSR | S_IWUSR);
    if (nvm->fd < 0) {
        return fail(error, error_size, path, strerror(errno));
    }
    if (flock(nvm->fd, LOCK_EX | LOCK_NB) != 0) {
        return fail(error, error_size, path,
                    errno == EWOULDBLOCK ? "in use by another program" : strerror(errno));
    }
    struct stat status;
    if (fstat(nvm->fd, &status) != 0) {
        return fail(error, error_size, path, strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) {
        return fail(error, error_size, path, "not a regular file");
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

hal_nvm_t *linux_nvm_open(const char *path, char *error, size_t error_size)
{
    hal_nvm_t *nvm = malloc(sizeof *nvm);
    if (nvm == NULL) {
        fail(error, error_size, path == NULL ? "memory" : path, strerror(errno));
        return NULL;
    }
    nvm->fd = -1;
    nvm->status = HAL_NVM_IDLE;
    memset(nvm->bytes, 0xFF, sizeof nvm->bytes);
    if (path != NULL && !open_file(nvm, path, error, error_size)) {
        linux_nvm_close(nvm);
        return NULL;
    }
    return nvm;
}

void linux_nvm_close(hal_nvm_t *nvm)
{
    if (nvm != NULL && nvm->fd >= 0) {
        close(nvm->fd);
    }
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
    nvm->status = HAL_NVM_IDLE;
    if (nvm->fd < 0) {
        memcpy(&nvm->bytes[address], bytes, size);
    } else if (!write_all(nvm->fd, bytes, size, address)) {
        nvm->status = HAL_NVM_FAILED;
    }
    return true;
}

hal_nvm_status_t hal_nvm_status(hal_nvm_t *nvm)
{
    return nvm->status;
}
