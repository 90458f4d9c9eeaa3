/* The master end of a pseudo-terminal.
 *
 * Nobody says when a host opens its end; that it has closed it shows as EPOLLHUP for as long as no host is
 * there. The descriptor is watched edge-triggered, so that this lasting state does not wake the loop again
 * and again. */
#include "linux_uart.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#define PATH_BYTES 64 /* /dev/pts/N */
#define WATCH_BYTES (EPOLLIN | EPOLLET)
#define WATCH_ROOM (EPOLLIN | EPOLLOUT | EPOLLET)

struct hal_uart {
    loop_t *loop;
    linux_uart_ready_t ready;
    void *ctx;
    int fd;
    bool drained;       /* nothing left to read since the last EPOLLIN */
    bool awaiting_room; /* EPOLLOUT is watched */
    bool used;          /* bytes were exchanged since the host's end was made fresh */
    char path[PATH_BYTES];
    char *link; /* NULL: none */
};

/* Makes the host's end as a new host expects it: without bytes that the last one left unread, and raw, unless
 * the new host is there already and has its own settings. The end must be open for that, for a moment. */
static bool make_fresh(hal_uart_t *uart, bool raw)
{
    int host_end = ioctl(uart->fd, TIOCGPTPEER, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (host_end < 0) {
        return false;
    }
    struct termios settings;
    bool ok = tcflush(host_end, TCIFLUSH) == 0 && tcgetattr(host_end, &settings) == 0;
    if (ok && raw) {
        cfmakeraw(&settings);
        ok = tcsetattr(host_end, TCSANOW, &settings) == 0;
    }
    int reason = errno;
    close(host_end);
    errno = reason;
    uart->used = false;
    return ok;
}

static bool host_is_gone(const hal_uart_t *uart)
{
    struct pollfd watched = {.fd = uart->fd, .events = POLLOUT};
    return poll(&watched, 1, 0) > 0 && (watched.revents & POLLHUP) != 0;
}

static void on_event(void *ctx, uint32_t events)
{
    hal_uart_t *uart = ctx;
    if ((events & EPOLLIN) != 0) {
        uart->drained = false;
        uart->used = true;
    }
    if ((events & EPOLLOUT) != 0 && uart->awaiting_room) {
        uart->awaiting_room = false;
        loop_modify(uart->loop, uart->fd, WATCH_BYTES);
    }
    uart->ready(uart->ctx);
    /* Closing the host's end once more is reported too; used keeps that from going round. */
    if ((events & EPOLLHUP) != 0 && uart->used && uart->drained) {
        make_fresh(uart, host_is_gone(uart));
    }
    if (!uart->drained) {
        loop_modify(uart->loop, uart->fd, uart->awaiting_room ? WATCH_ROOM : WATCH_BYTES);
    }
}

size_t hal_uart_read(hal_uart_t *uart, uint8_t *bytes, size_t size)
{
    if (uart->drained || size == 0) {
        return 0;
    }
    ssize_t n = read(uart->fd, bytes, size);
    if (n > 0) {
        return (size_t)n;
    }
    uart->drained = true; /* EAGAIN, or EIO when the host has gone */
    return 0;
}

size_t hal_uart_write(hal_uart_t *uart, const uint8_t *bytes, size_t size)
{
    if (size == 0 || host_is_gone(uart)) {
        return size;
    }
    ssize_t n = write(uart->fd, bytes, size);
    size_t taken = n > 0 ? (size_t)n : 0;
    uart->used = uart->used || taken > 0;
    if (taken < size && !uart->awaiting_room) {
        uart->awaiting_room = true;
        loop_modify(uart->loop, uart->fd, WATCH_ROOM);
    }
    return taken;
}

const char *linux_uart_path(const hal_uart_t *uart)
{
    return uart->path;
}

static bool is_symlink(const char *path)
{
    struct stat status;
    return lstat(path, &status) == 0 && S_ISLNK(status.st_mode);
}

static bool make_link(hal_uart_t *uart, const char *link)
{
    if (is_symlink(link) && unlink(link) != 0) {
        return false;
    }
    if (symlink(uart->path, link) != 0) {
        return false;
    }
    uart->link = strdup(link);
    return uart->link != NULL;
}

/* Only when the link is still ours: another program may have put its own in the place. */
static void remove_link(const hal_uart_t *uart)
{
    char target[PATH_BYTES];
    ssize_t n = readlink(uart->link, target, sizeof target);
    if (n == (ssize_t)strlen(uart->path) && memcmp(target, uart->path, (size_t)n) == 0) {
        unlink(uart->link);
    }
}

/* False: errno says why. */
static bool open_pty(hal_uart_t *uart)
{
    uart->fd = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
    if (uart->fd < 0 || grantpt(uart->fd) != 0 || unlockpt(uart->fd) != 0) {
        return false;
    }
    int reason = ptsname_r(uart->fd, uart->path, sizeof uart->path);
    if (reason != 0) {
        errno = reason;
        return false;
    }
    return make_fresh(uart, true);
}

static bool open_all(hal_uart_t *uart, const char *link)
{
    return open_pty(uart) && (link == NULL || make_link(uart, link)) &&
           loop_add(uart->loop, uart->fd, WATCH_BYTES, on_event, uart);
}

hal_uart_t *linux_uart_open(loop_t *loop, const char *port, linux_uart_ready_t ready, void *ctx, char *error,
                            size_t error_size)
{
    const char *link = strncmp(port, "pty:", 4) == 0 && port[4] != '\0' ? port + 4 : NULL;
    if (link == NULL && strcmp(port, "pty") != 0) {
        snprintf(error, error_size, "%s: not a host port; expected pty or pty:LINKPATH", port);
        return NULL;
    }
    hal_uart_t *uart = calloc(1, sizeof *uart);
    if (uart == NULL) {
        snprintf(error, error_size, "%s: %s", port, strerror(errno));
        return NULL;
    }
    uart->loop = loop;
    uart->ready = ready;
    uart->ctx = ctx;
    uart->fd = -1;
    if (!open_all(uart, link)) {
        bool occupied = errno == EEXIST;
        snprintf(error, error_size, "%s: %s", port,
                 occupied ? "exists and is not a symbolic link" : strerror(errno));
        linux_uart_close(uart);
        return NULL;
    }
    return uart;
}

void linux_uart_close(hal_uart_t *uart)
{
    if (uart == NULL) {
        return;
    }
    if (uart->link != NULL) {
        remove_link(uart);
    }
    if (uart->fd >= 0) {
        loop_remove(uart->loop, uart->fd);
        close(uart->fd);
    }
    free(uart->link);
    free(uart);
}
