/* A lock beside a path: whoever holds PATH.lock owns PATH (D-LIN-4). The kernel releases it when its holder
 * ends, even in a crash, so a left-over path is recognised. Private to hal/linux. */
#ifndef PATH_LOCK_H
#define PATH_LOCK_H

#include <stdbool.h>

typedef struct {
    int fd;     /* -1: not held */
    char *path; /* of the lock */
} path_lock_t;

/* Takes the lock beside path; makes its file if need be. False: errno says why, EWOULDBLOCK: somebody holds
 * it. */
bool path_lock_take(path_lock_t *lock, const char *path);

/* Removes the file and gives the lock up, if it is held. */
void path_lock_give(path_lock_t *lock);

#endif
