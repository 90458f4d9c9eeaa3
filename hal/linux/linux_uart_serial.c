/* A serial line to the host: a UART of the machine or a USB adapter.
 *
 * The adapter may be pulled out: its line then hangs up, and the path is tried again until it is there once
 * more. What is written is kept to what the line carries within 20 ms, by the clock: drivers and adapters
 * have buffers of their own, and an answer behind a full one would come too late. */
#include <asm/termbits.h> /* termios2, which the C library does not have; excludes termios.h */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "linux_uart_backend.h"
#include "oneshot.h"

enum { BAUD_DEFAULT = 128000, BAUD_MIN = 1200, BAUD_MAX = 4000000, BITS_OF_BYTE = 10 };

#define AHEAD_US 20000u  /* of line time that may wait in buffers behind hal_uart_write */
#define REFILL_US 10000u /* after a refusal */
#define RETRY_US 500000u /* between two looks whether the adapter is back */

typedef struct {
    hal_uart_t uart;
    int fd;    /* -1: the adapter is gone */
    int timer; /* room again, or the next look for the adapter */
    unsigned baud;
    bool drained;          /* nothing left to read since the last EPOLLIN */
    uint64_t line_busy_us; /* when the line has carried all that was written */
    char path[];
} serial_t;

/* Raw 8N1 at this rate, which need not be one of the standard ones. False: errno says why; 0: the driver has
 * taken another rate. */
static bool configure(int fd, unsigned baud)
{
    struct termios2 settings;
    if (ioctl(fd, TCGETS2, &settings) != 0) {
        return false;
    }
    settings.c_iflag = IGNBRK;
    settings.c_oflag = 0;
    settings.c_lflag = 0;
    settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
    settings.c_cc[VMIN] = 1;
    settings.c_cc[VTIME] = 0;
    settings.c_ispeed = baud;
    settings.c_ospeed = baud;
    if (ioctl(fd, TCSETS2, &settings) != 0 || ioctl(fd, TCGETS2, &settings) != 0) {
        return false;
    }
    unsigned off = settings.c_ospeed > baud ? settings.c_ospeed - baud : baud - settings.c_ospeed;
    errno = 0;
    return off <= baud / 50; /* 2 %: more does not carry ten bits */
}

/* Returns the descriptor, or -1 after *reason was set. */
static int open_line(const char *path, unsigned baud, const char **reason)
{
    struct stat status;
    int fd = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) {
        *reason = errno == ENOENT  ? "no such device"
                  : errno == EBUSY ? "is in use by another program"
                                   : strerror(errno);
        return -1;
    }
    if (fstat(fd, &status) != 0 || !S_ISCHR(status.st_mode) || !isatty(fd)) {
        *reason = "not a serial line";
    } else if (flock(fd, LOCK_EX | LOCK_NB) != 0 || ioctl(fd, TIOCEXCL) != 0) {
        *reason = errno == EWOULDBLOCK ? "is in use by another program" : strerror(errno);
    } else if (!configure(fd, baud)) {
        *reason = errno == 0 ? "the line cannot have this baud rate" : strerror(errno);
    } else {
        (void)ioctl(fd, TCFLSH, TCIOFLUSH);
        return fd;
    }
    close(fd);
    return -1;
}

static void close_line(serial_t *serial)
{
    loop_remove(serial->uart.loop, serial->fd);
    (void)ioctl(serial->fd, TIOCNXCL); /* a line that another still has open would stay exclusive */
    close(serial->fd);
    serial->fd = -1;
}

/* The adapter was pulled out. */
static void lose_line(serial_t *serial)
{
    close_line(serial);
    serial->uart.host_left = true;
    oneshot_arm_us(serial->timer, RETRY_US);
}

static void on_event(void *ctx, uint32_t events)
{
    serial_t *serial = ctx;
    if ((events & EPOLLIN) != 0) {
        serial->drained = false;
    }
    serial->uart.ready(serial->uart.ctx);
    if (serial->fd >= 0 && (events & (EPOLLHUP | EPOLLERR)) != 0) {
        lose_line(serial);
    }
}

static bool watch_line(serial_t *serial)
{
    serial->drained = false;
    return loop_add(serial->uart.loop, serial->fd, EPOLLIN | EPOLLET, on_event, serial);
}

static void on_timer(void *ctx, uint32_t events)
{
    serial_t *serial = ctx;
    const char *reason;
    (void)events;
    if (serial->fd < 0) {
        serial->fd = open_line(serial->path, serial->baud, &reason);
        if (serial->fd >= 0 && !watch_line(serial)) {
            close(serial->fd);
            serial->fd = -1;
        }
        if (serial->fd < 0) {
            oneshot_arm_us(serial->timer, RETRY_US);
            return;
        }
    }
    serial->uart.ready(serial->uart.ctx);
}

static size_t serial_read(hal_uart_t *uart, uint8_t *bytes, size_t size)
{
    serial_t *serial = (serial_t *)uart;
    if (serial->fd < 0 || serial->drained || size == 0) {
        return 0;
    }
    ssize_t n = read(serial->fd, bytes, size);
    if (n > 0) {
        return (size_t)n;
    }
    serial->drained = true; /* EAGAIN; when the adapter is gone the loop says so */
    return 0;
}

static size_t serial_write(hal_uart_t *uart, const uint8_t *bytes, size_t size)
{
    serial_t *serial = (serial_t *)uart;
    if (serial->fd < 0) {
        return size;
    }
    uint64_t now_us = loop_now_us(uart->loop);
    uint64_t busy_us = serial->line_busy_us > now_us ? serial->line_busy_us - now_us : 0;
    uint64_t room = busy_us < AHEAD_US ? (AHEAD_US - busy_us) * serial->baud / BITS_OF_BYTE / 1000000u : 0;
    size_t count = size < room ? size : (size_t)room;
    ssize_t n = count > 0 ? write(serial->fd, bytes, count) : 0;
    size_t taken = n > 0 ? (size_t)n : 0;
    serial->line_busy_us = now_us + busy_us + taken * BITS_OF_BYTE * 1000000u / serial->baud;
    if (taken < size) {
        oneshot_arm_us(serial->timer, REFILL_US);
    }
    return taken;
}

static const char *serial_path(const hal_uart_t *uart)
{
    return ((const serial_t *)uart)->path;
}

static void serial_close(hal_uart_t *uart)
{
    serial_t *serial = (serial_t *)uart;
    oneshot_close(uart->loop, serial->timer);
    if (serial->fd >= 0) {
        close_line(serial);
    }
    free(serial);
}

/* Takes DEVICE[@BAUD] apart. False: what stands behind the @ is no rate. */
static bool parse(const char *address, size_t *path_length, unsigned *baud)
{
    const char *at = strrchr(address, '@');
    *path_length = at != NULL ? (size_t)(at - address) : strlen(address);
    *baud = BAUD_DEFAULT;
    if (at == NULL) {
        return true;
    }
    char *end;
    unsigned long rate = strtoul(at + 1, &end, 10);
    *baud = (unsigned)rate;
    return at[1] >= '0' && at[1] <= '9' && *end == '\0' && rate >= BAUD_MIN && rate <= BAUD_MAX;
}

static bool is_address(const char *address)
{
    size_t path_length;
    unsigned baud;
    return parse(address, &path_length, &baud);
}

static serial_t *create(const linux_uart_request_t *request, size_t path_length, unsigned baud)
{
    serial_t *serial = calloc(1, sizeof *serial + path_length + 1);
    if (serial == NULL) {
        return NULL;
    }
    linux_uart_backend_init(&serial->uart, &linux_uart_serial_backend, request);
    memcpy(serial->path, request->address, path_length);
    serial->baud = baud;
    serial->fd = -1;
    serial->timer = oneshot_open(request->loop, on_timer, serial);
    return serial;
}

static hal_uart_t *serial_open(const linux_uart_request_t *request)
{
    size_t path_length;
    unsigned baud;
    const char *reason = NULL;
    if (!parse(request->address, &path_length, &baud)) {
        char text[80];
        (void)snprintf(text, sizeof text, "the baud rate is not a number from %d to %d", BAUD_MIN, BAUD_MAX);
        linux_uart_backend_refuse(request, text);
        return NULL;
    }
    serial_t *serial = create(request, path_length, baud);
    if (serial == NULL || serial->timer < 0) {
        reason = strerror(errno);
    } else {
        serial->fd = open_line(serial->path, baud, &reason);
        if (serial->fd >= 0 && !watch_line(serial)) {
            reason = strerror(errno);
        }
    }
    if (reason != NULL) {
        linux_uart_backend_refuse(request, reason);
        if (serial != NULL) {
            serial_close(&serial->uart);
        }
        return NULL;
    }
    return &serial->uart;
}

const linux_uart_backend_t linux_uart_serial_backend = {
    .kind = "serial",
    .needs_address = true,
    .is_address = is_address,
    .open = serial_open,
    .close = serial_close,
    .read = serial_read,
    .write = serial_write,
    .path = serial_path,
};
