/* The master end of a pseudo-terminal.
 *
 * Nobody says when a host opens its end; that it has closed it shows as EPOLLHUP for as long as no host is
 * there. The descriptor is watched edge-triggered, so that this lasting state does not wake the loop again
 * and again. */
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include "linux_uart_backend.h"
#include "path_lock.h"

#define PATH_BYTES 64 /* /dev/pts/N */
#define WATCH_BYTES (EPOLLIN | EPOLLET)
#define WATCH_ROOM (EPOLLIN | EPOLLOUT | EPOLLET)

typedef struct {
    hal_uart_t uart;
    int fd;
    bool drained;       /* nothing left to read since the last EPOLLIN */
    bool awaiting_room; /* EPOLLOUT is watched */
    bool used;          /* bytes were exchanged since the host's end was made fresh */
    char path[PATH_BYTES];
    char *link;       /* NULL: none */
    path_lock_t lock; /* beside the link */
} pty_t;

/* Makes the host's end as a new host expects it: raw, and without bytes that the last one left unread. Not
 * when the new host is there already: it has its own settings, and the bytes may be its answers. The end must
 * be open for that, for a moment. */
static bool make_fresh(pty_t *pty)
{
    int host_end = ioctl(pty->fd, TIOCGPTPEER, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (host_end < 0) {
        return false;
    }
    struct termios settings;
    bool ok = tcflush(host_end, TCIFLUSH) == 0 && tcgetattr(host_end, &settings) == 0;
    if (ok) {
        cfmakeraw(&settings);
        ok = tcsetattr(host_end, TCSANOW, &settings) == 0;
    }
    int reason = errno;
    close(host_end);
    errno = reason;
    pty->used = false;
    return ok;
}

static bool host_is_gone(const pty_t *pty)
{
    struct pollfd watched = {.fd = pty->fd, .events = POLLOUT};
    return poll(&watched, 1, 0) > 0 && (watched.revents & POLLHUP) != 0;
}

static void on_event(void *ctx, uint32_t events)
{
    pty_t *pty = ctx;
    if ((events & EPOLLIN) != 0) {
        pty->drained = false;
        pty->used = true;
    }
    if ((events & EPOLLOUT) != 0 && pty->awaiting_room) {
        pty->awaiting_room = false;
        loop_modify(pty->uart.loop, pty->fd, WATCH_BYTES);
    }
    pty->uart.ready(pty->uart.ctx);
    /* Closing the host's end once more is reported too; used keeps that from going round. */
    if ((events & EPOLLHUP) != 0 && pty->used && pty->drained) {
        pty->uart.host_left = true;
        if (host_is_gone(pty)) {
            make_fresh(pty);
        }
    }
}

static size_t pty_read(hal_uart_t *uart, uint8_t *bytes, size_t size)
{
    pty_t *pty = (pty_t *)uart;
    if (pty->drained || size == 0) {
        return 0;
    }
    ssize_t n = read(pty->fd, bytes, size);
    if (n > 0) {
        return (size_t)n;
    }
    pty->drained = true; /* EAGAIN, or EIO when the host has gone */
    return 0;
}

static size_t pty_write(hal_uart_t *uart, const uint8_t *bytes, size_t size)
{
    pty_t *pty = (pty_t *)uart;
    if (size == 0 || host_is_gone(pty)) {
        return size;
    }
    ssize_t n = write(pty->fd, bytes, size);
    size_t taken = n > 0 ? (size_t)n : 0;
    pty->used = pty->used || taken > 0;
    if (taken < size && !pty->awaiting_room) {
        pty->awaiting_room = true;
        loop_modify(uart->loop, pty->fd, WATCH_ROOM);
    }
    return taken;
}

static const char *pty_path(const hal_uart_t *uart)
{
    return ((const pty_t *)uart)->path;
}

/* May a link that stands here already be removed? had_lock: a lock stood beside it, which nobody holds any
 * more, so whoever made it has crashed. Without a lock it is another program's, unless it leads nowhere. */
static bool is_left_over(const char *path, bool had_lock)
{
    struct stat status;
    if (lstat(path, &status) != 0 || !S_ISLNK(status.st_mode)) {
        return false;
    }
    return had_lock || (stat(path, &status) != 0 && errno == ENOENT);
}

/* Becomes the owner of the link's place. */
static bool take_place(pty_t *pty, const char *link)
{
    char lock[PATH_MAX];
    struct stat status;
    (void)snprintf(lock, sizeof lock, "%s.lock", link);
    const bool had_lock = lstat(lock, &status) == 0;
    if (!path_lock_take(&pty->lock, link)) {
        return false;
    }
    return !is_left_over(link, had_lock) || unlink(link) == 0;
}

static bool make_link(pty_t *pty, const char *link)
{
    if (symlink(pty->path, link) != 0) {
        return false;
    }
    pty->link = strdup(link);
    return pty->link != NULL;
}

/* Only when the link is still ours: another program may have put its own in the place. */
static void remove_link(const pty_t *pty)
{
    char target[PATH_BYTES];
    ssize_t n = readlink(pty->link, target, sizeof target);
    if (n == (ssize_t)strlen(pty->path) && memcmp(target, pty->path, (size_t)n) == 0) {
        unlink(pty->link);
    }
}

/* False: errno says why. */
static bool open_pty(pty_t *pty)
{
    pty->fd = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
    if (pty->fd < 0 || grantpt(pty->fd) != 0 || unlockpt(pty->fd) != 0) {
        return false;
    }
    int reason = ptsname_r(pty->fd, pty->path, sizeof pty->path);
    if (reason != 0) {
        errno = reason;
        return false;
    }
    return make_fresh(pty);
}

/* A stale link goes before the terminal is made (D-LIN-4): the new one may get the number that the link
 * names. */
static bool open_all(pty_t *pty, const char *link)
{
    if (link != NULL && !take_place(pty, link)) {
        return false;
    }
    return open_pty(pty) && (link == NULL || make_link(pty, link)) &&
           loop_add(pty->uart.loop, pty->fd, WATCH_BYTES, on_event, pty);
}

static void pty_close(hal_uart_t *uart)
{
    pty_t *pty = (pty_t *)uart;
    if (pty->link != NULL) {
        remove_link(pty);
    }
    path_lock_give(&pty->lock);
    if (pty->fd >= 0) {
        loop_remove(uart->loop, pty->fd);
        close(pty->fd);
    }
    free(pty->link);
    free(pty);
}

static const char *reason_of(const char *link)
{
    struct stat status;
    if (errno == EWOULDBLOCK) {
        return "is in use by another program";
    }
    if (errno != EEXIST || lstat(link, &status) != 0) {
        return strerror(errno);
    }
    return S_ISLNK(status.st_mode) ? "is in use: it leads to a terminal that exists"
                                   : "exists and is not a symbolic link";
}

static hal_uart_t *pty_open(const linux_uart_request_t *request)
{
    pty_t *pty = calloc(1, sizeof *pty);
    if (pty == NULL) {
        linux_uart_backend_refuse(request, strerror(errno));
        return NULL;
    }
    linux_uart_backend_init(&pty->uart, &linux_uart_pty_backend, request);
    pty->fd = -1;
    pty->lock.fd = -1;
    if (!open_all(pty, request->address)) {
        linux_uart_backend_refuse(request, reason_of(request->address));
        pty_close(&pty->uart);
        return NULL;
    }
    return &pty->uart;
}

const linux_uart_backend_t linux_uart_pty_backend = {
    .kind = "pty",
    .needs_address = false,
    .open = pty_open,
    .close = pty_close,
    .read = pty_read,
    .write = pty_write,
    .path = pty_path,
};
