#include "path_lock.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* Does the path still lead to the file that was locked? Its last holder removes it with the lock in hand. */
static bool is_current(const path_lock_t *lock)
{
    struct stat held;
    struct stat found;
    return fstat(lock->fd, &held) == 0 && lstat(lock->path, &found) == 0 && held.st_ino == found.st_ino &&
           held.st_dev == found.st_dev;
}

/* One try. False: errno says why; 0: the file was removed meanwhile. */
static bool try_to_take(path_lock_t *lock)
{
    lock->fd = open(lock->path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NOCTTY, S_IRUSR | S_IWUSR);
    if (lock->fd < 0) {
        return false;
    }
    int reason = flock(lock->fd, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
    if (reason == 0 && is_current(lock)) {
        return true;
    }
    (void)close(lock->fd);
    lock->fd = -1;
    errno = reason;
    return false;
}

bool path_lock_take(path_lock_t *lock, const char *path)
{
    lock->fd = -1;
    if (asprintf(&lock->path, "%s.lock", path) < 0) {
        lock->path = NULL;
        errno = ENOMEM;
        return false;
    }
    bool taken;
    do {
        taken = try_to_take(lock);
    } while (!taken && errno == 0);
    if (!taken) {
        const int reason = errno;
        free(lock->path);
        lock->path = NULL;
        errno = reason;
    }
    return taken;
}

void path_lock_give(path_lock_t *lock)
{
    if (lock->fd >= 0) {
        (void)unlink(lock->path);
        (void)close(lock->fd);
    }
    free(lock->path);
    lock->fd = -1;
    lock->path = NULL;
}
