#include "line_writer.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { CHUNK = 4096 };

struct line_writer {
    int fd;
    const char *before;
    const char *after;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed; /* lines came, lines were written, or the end */
    /* The thread's own. Not on its stack: cancelled, it leaves the stack without a return, and the marks that
     * AddressSanitizer has put around variables stay there. */
    char chunk[CHUNK];
    struct pollfd room;
    /* Shared, under lock: */
    size_t begin; /* of what waits in bytes, a ring */
    size_t used;
    uint64_t lost;
    uint64_t lost_untold; /* of these, lines that no line has told of */
    bool ends;
    bool broken;
    char bytes[LINE_WRITER_BYTES];
};

/* --- the thread, which alone waits for the reader (D-LIN-6) --- */

static uint64_t lines_in(const char *bytes, size_t size)
{
    uint64_t lines = 0;
    for (size_t i = 0; i < size; i++) {
        lines += bytes[i] == '\n' ? 1u : 0u;
    }
    return lines;
}

/* Writes the chunk. False: errno says why not. */
static bool write_all(line_writer_t *writer, size_t size)
{
    const char *bytes = writer->chunk;
    while (size != 0) {
        const ssize_t n = write(writer->fd, bytes, size);
        if (n > 0) {
            bytes += n;
            size -= (size_t)n;
        } else if (n < 0 && errno == EAGAIN) { /* somebody has made the descriptor non-blocking */
            (void)poll(&writer->room, 1, -1);
        } else if (n < 0 && errno != EINTR) {
            return false;
        }
    }
    return true;
}

/* Takes a chunk out of the ring. Returns its size. */
static size_t take(line_writer_t *writer)
{
    const size_t straight = LINE_WRITER_BYTES - writer->begin;
    size_t size = writer->used < CHUNK ? writer->used : CHUNK;
    size = size < straight ? size : straight;
    memcpy(writer->chunk, &writer->bytes[writer->begin], size);
    writer->begin = (writer->begin + size) % LINE_WRITER_BYTES;
    writer->used -= size;
    return size;
}

/* A full disk may have room later, a reader that has gone does not come back. */
static void note_failure(line_writer_t *writer, int reason, uint64_t lines)
{
    writer->lost += lines;
    writer->lost_untold += lines;
    if (reason != ENOSPC && reason != EDQUOT && reason != EFBIG) {
        writer->broken = true;
        writer->used = 0;
    }
}

/* May be cancelled only while it writes, without the lock. */
static void *write_lines(void *ctx)
{
    line_writer_t *writer = ctx;
    (void)pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, NULL);
    (void)pthread_mutex_lock(&writer->lock);
    while (!writer->ends || writer->used != 0) {
        if (writer->used == 0) {
            (void)pthread_cond_wait(&writer->changed, &writer->lock);
            continue;
        }
        const size_t size = take(writer);
        (void)pthread_mutex_unlock(&writer->lock);
        (void)pthread_setcancelstate(PTHREAD_CANCEL_ENABLE, NULL);
        const bool written = write_all(writer, size);
        const int reason = errno;
        (void)pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, NULL);
        (void)pthread_mutex_lock(&writer->lock);
        if (!written) {
            note_failure(writer, reason, lines_in(writer->chunk, size));
        }
        (void)pthread_cond_broadcast(&writer->changed);
    }
    (void)pthread_mutex_unlock(&writer->lock);
    return NULL;
}

/* --- the caller --- */

static bool start(line_writer_t *writer)
{
    pthread_condattr_t attributes;
    sigset_t all;
    sigset_t before;
    (void)pthread_condattr_init(&attributes);
    (void)pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    (void)pthread_cond_init(&writer->changed, &attributes);
    (void)pthread_condattr_destroy(&attributes);
    (void)pthread_mutex_init(&writer->lock, NULL);
    (void)sigfillset(&all); /* signals are for the caller's thread */
    (void)pthread_sigmask(SIG_SETMASK, &all, &before);
    const int reason = pthread_create(&writer->thread, NULL, write_lines, writer);
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
    errno = reason;
    return reason == 0;
}

line_writer_t *line_writer_open(int fd, const char *before, const char *after)
{
    line_writer_t *writer = calloc(1, sizeof *writer);
    if (writer == NULL) {
        return NULL;
    }
    writer->fd = fd;
    writer->room = (struct pollfd){.fd = fd, .events = POLLOUT};
    writer->before = before;
    writer->after = after;
    if (!start(writer)) {
        free(writer);
        return NULL;
    }
    return writer;
}

static struct timespec in_ms(unsigned ms)
{
    struct timespec at;
    (void)clock_gettime(CLOCK_MONOTONIC, &at);
    const long ns = at.tv_nsec + (long)(ms % 1000u) * 1000000;
    at.tv_sec += (time_t)(ms / 1000u) + ns / 1000000000;
    at.tv_nsec = ns % 1000000000;
    return at;
}

/* The thread has taken the last chunk before it is written: it is waited for as well, by its end. */
static bool ends_in_time(line_writer_t *writer, unsigned patience_ms)
{
    const struct timespec until = in_ms(patience_ms);
    return pthread_clockjoin_np(writer->thread, NULL, CLOCK_MONOTONIC, &until) == 0;
}

void line_writer_close(line_writer_t *writer, unsigned patience_ms)
{
    if (writer == NULL) {
        return;
    }
    (void)pthread_mutex_lock(&writer->lock);
    writer->ends = true;
    (void)pthread_cond_broadcast(&writer->changed);
    (void)pthread_mutex_unlock(&writer->lock);
    if (!ends_in_time(writer, patience_ms)) {
        (void)pthread_cancel(writer->thread);
        (void)pthread_join(writer->thread, NULL);
    }
    (void)pthread_cond_destroy(&writer->changed);
    (void)pthread_mutex_destroy(&writer->lock);
    free(writer);
}

static void append(line_writer_t *writer, const char *bytes, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        writer->bytes[(writer->begin + writer->used) % LINE_WRITER_BYTES] = bytes[i];
        writer->used++;
    }
}

/* Appends a line, behind the one that tells of those lost before it. False: there is no room for both. */
static bool append_line(line_writer_t *writer, const char *line, size_t size)
{
    char told[LINE_WRITER_LINE_MAX];
    size_t told_size = 0;
    if (writer->lost_untold != 0) {
        const int n = snprintf(told, sizeof told, "%s%" PRIu64 "%s\n", writer->before, writer->lost_untold,
                               writer->after);
        told_size = n > 0 && (size_t)n < sizeof told ? (size_t)n : 0;
    }
    if (told_size + size > LINE_WRITER_BYTES - writer->used) {
        return false;
    }
    append(writer, told, told_size);
    append(writer, line, size);
    writer->lost_untold = 0;
    return true;
}

void line_writer_put(line_writer_t *writer, const char *format, ...)
{
    char line[LINE_WRITER_LINE_MAX];
    va_list arguments;
    va_start(arguments, format);
    int n = vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    if (n < 0) {
        return;
    }
    n = n < (int)sizeof line - 1 ? n : (int)sizeof line - 1;
    line[n] = '\n';
    (void)pthread_mutex_lock(&writer->lock);
    if (writer->broken || !append_line(writer, line, (size_t)n + 1u)) {
        writer->lost++;
        writer->lost_untold++;
    }
    (void)pthread_cond_broadcast(&writer->changed);
    (void)pthread_mutex_unlock(&writer->lock);
}

uint64_t line_writer_lost(line_writer_t *writer)
{
    (void)pthread_mutex_lock(&writer->lock);
    const uint64_t lost = writer->lost;
    (void)pthread_mutex_unlock(&writer->lock);
    return lost;
}

bool line_writer_is_broken(line_writer_t *writer)
{
    (void)pthread_mutex_lock(&writer->lock);
    const bool broken = writer->broken;
    (void)pthread_mutex_unlock(&writer->lock);
    return broken;
}
