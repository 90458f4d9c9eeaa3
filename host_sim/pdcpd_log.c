#include "pdcpd_log.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "arb_error.h"
#include "pdcpd_order.h"

enum { SECOND_US = 1000000, PATIENCE_MS = 500 };

/* Does standard error lead to the journal, which knows the time? It says so by
 * JOURNAL_STREAM=DEVICE:INODE. */
static bool is_journal(void)
{
    struct stat status;
    unsigned long long device;
    unsigned long long inode;
    const char *stream = getenv("JOURNAL_STREAM");
    return stream != NULL && sscanf(stream, "%llu:%llu", &device, &inode) == 2 &&
           fstat(STDERR_FILENO, &status) == 0 && status.st_dev == device && status.st_ino == inode;
}

bool pdcpd_log_open(pdcpd_log_t *log, pdcpd_level_t level)
{
    memset(log, 0, sizeof *log);
    log->level = level;
    log->has_time = !is_journal();
    log->out = line_writer_open(STDERR_FILENO, "pdcpd: ", " lines are missing here: nobody read them");
    return log->out != NULL;
}

void pdcpd_log_close(pdcpd_log_t *log)
{
    line_writer_close(log->out, PATIENCE_MS);
    log->out = NULL;
}

/* --- Lines --- */

static void put(const pdcpd_log_t *log, const char *text)
{
    struct timespec now;
    struct tm local;
    char date[32];
    if (!log->has_time || clock_gettime(CLOCK_REALTIME, &now) != 0 ||
        localtime_r(&now.tv_sec, &local) == NULL ||
        strftime(date, sizeof date, "%Y-%m-%d %H:%M:%S", &local) == 0) {
        line_writer_put(log->out, "pdcpd: %s", text);
        return;
    }
    line_writer_put(log->out, "%s.%03ld pdcpd: %s", date, now.tv_nsec / 1000000, text);
}

/* Tells what was left out in the second that is over (D-LIN-7). */
static void end_second(pdcpd_log_t *log, pdcpd_log_kind_t *kind)
{
    char text[2 * PDCPD_LOG_TEXT];
    if (kind->left_out == 1) {
        put(log, kind->last);
    } else if (kind->left_out != 0) {
        (void)snprintf(text, sizeof text, "%u lines like this were left out: %s", kind->left_out, kind->last);
        put(log, text);
    }
    kind->said = 0;
    kind->left_out = 0;
}

static void say(pdcpd_log_t *log, uint64_t now_us, pdcpd_level_t level, unsigned number, const char *format,
                va_list arguments)
{
    char text[PDCPD_LOG_TEXT];
    if (log->out == NULL || level > log->level) {
        return;
    }
    pdcpd_log_kind_t *kind = &log->kinds[number];
    if (now_us - kind->since_us >= SECOND_US) {
        end_second(log, kind);
        kind->since_us = now_us;
    }
    (void)vsnprintf(text, sizeof text, format, arguments);
    if (kind->said == PDCPD_LOG_RATE) {
        kind->left_out++;
        memcpy(kind->last, text, sizeof text);
        return;
    }
    kind->said++;
    put(log, text);
}

void pdcpd_log_say(pdcpd_log_t *log, uint64_t now_us, pdcpd_level_t level, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(log, now_us, level, PDCPD_LOG_KIND_OTHER, format, arguments);
    va_end(arguments);
}

uint64_t pdcpd_log_step(pdcpd_log_t *log, uint64_t now_us)
{
    uint64_t next_us = UINT64_MAX;
    for (unsigned i = 0; i < PDCPD_LOG_KINDS; i++) {
        pdcpd_log_kind_t *kind = &log->kinds[i];
        if (kind->left_out == 0) {
            continue;
        }
        if (now_us - kind->since_us >= SECOND_US) {
            end_second(log, kind);
        } else if (kind->since_us + SECOND_US < next_us) {
            next_us = kind->since_us + SECOND_US;
        }
    }
    return next_us;
}

/* --- The host --- */

static void say_host(pdcpd_log_t *log, uint64_t now_us, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void say_host(pdcpd_log_t *log, uint64_t now_us, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(log, now_us, PDCPD_LOG_INFO, PDCPD_LOG_KIND_HOST, format, arguments);
    va_end(arguments);
}

void pdcpd_log_served(pdcpd_log_t *log, uint64_t now_us, uint16_t message, const uint8_t *payload,
                      uint16_t len, uint8_t error)
{
    char order[PDCPD_ORDER_TEXT];
    if (!pdcpd_order_text(order, message, payload, len)) {
        return;
    }
    if (error == ARB_OK) {
        say_host(log, now_us, "the host: %s", order);
    } else {
        say_host(log, now_us, "the host: %s: refused with error %02Xh", order, error);
    }
}

/* --- Events --- */

static void say_event(pdcpd_log_t *log, uint64_t now_us, pdcpd_level_t level, pdcp_event_kind_t kind,
                      const char *format, ...) __attribute__((format(printf, 5, 6)));

static void say_event(pdcpd_log_t *log, uint64_t now_us, pdcpd_level_t level, pdcp_event_kind_t kind,
                      const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(log, now_us, level, (unsigned)kind, format, arguments);
    va_end(arguments);
}

static const char *bus_state_name(int8_t state)
{
    static const char *const names[] = {"active", "error-passive", "bus-off", "down"};
    return names[state];
}

static void say_link(pdcpd_log_t *log, uint64_t now_us, const pdcp_tables_t *tables,
                     const pdcp_event_t *event)
{
    const pdcp_channel_t *input = &tables->channels[event->channel];
    const pdcp_identity_t *to = &tables->devices[input->place].identity;
    const pdcp_identity_t *from = &input->source.identity;
    const char *outcome = event->status == PDCP_OK ? "" : ", could not be made";
    if (input->link == PDCP_LINK_NONE) {
        say_event(log, now_us, PDCPD_LOG_INFO, event->kind, "%u:%u:%u.%u is unlinked%s", to->vid, to->pid,
                  to->sn, input->index, outcome);
        return;
    }
    say_event(log, now_us, PDCPD_LOG_INFO, event->kind, "%u:%u:%u.%u -> %u:%u:%u.%u is %s%s", from->vid,
              from->pid, from->sn, input->source.index, to->vid, to->pid, to->sn, input->index,
              input->link == PDCP_LINK_ACTIVE ? "active" : "inactive", outcome);
}

static void say_audit(pdcpd_log_t *log, uint64_t now_us, const pdcp_tables_t *tables,
                      const pdcp_event_t *event)
{
    const pdcp_channel_t *channel = &tables->channels[event->channel];
    const pdcp_identity_t *owner = &tables->devices[channel->place].identity;
    say_event(log, now_us, PDCPD_LOG_WARNING, event->kind, "%u:%u:%u.%u had a wrong parameter %u", owner->vid,
              owner->pid, owner->sn, channel->index, (unsigned)event->status);
}

/* What is said of an event that needs no more than its device. */
static const struct {
    pdcpd_level_t level;
    bool names_device; /* the text follows the device's name */
    const char *text;  /* NULL: nothing is said */
} sayings[] = {
    [PDCP_EVENT_BOUND] = {PDCPD_LOG_INFO, true, " is there"},
    [PDCP_EVENT_READY] = {PDCPD_LOG_INFO, true, " is set up"},
    [PDCP_EVENT_SETUP_FAILED] = {PDCPD_LOG_WARNING, true, " could not be set up: bound but unlinked"},
    [PDCP_EVENT_LOST] = {PDCPD_LOG_WARNING, true, " is gone"},
    [PDCP_EVENT_REFUSED] = {PDCPD_LOG_WARNING, false, "a device was refused: no node id or no place is left"},
    [PDCP_EVENT_DUPLICATE] = {PDCPD_LOG_WARNING, true, " exists twice: the second device was refused"},
    [PDCP_EVENT_FOREIGN] = {PDCPD_LOG_WARNING, false,
                            "another arbitrator is on the bus; this one was there first and stays"},
    [PDCP_EVENT_SILENT] = {PDCPD_LOG_WARNING, false,
                           "another arbitrator was there first: on standby, silent"},
    [PDCP_EVENT_STARTED] = {PDCPD_LOG_WARNING, false, "the other arbitrator is gone: takes over"},
};

static void say_device(pdcpd_log_t *log, uint64_t now_us, const pdcp_tables_t *tables,
                       const pdcp_event_t *event)
{
    const size_t kind = (size_t)event->kind;
    char name[40] = "a device";
    if (kind >= sizeof sayings / sizeof sayings[0] || sayings[kind].text == NULL) {
        return;
    }
    if (event->place != PDCP_NONE) {
        const pdcp_device_entry_t *device = &tables->devices[event->place];
        (void)snprintf(name, sizeof name, "%u:%u:%u (id %u)", device->identity.vid, device->identity.pid,
                       device->identity.sn, device->node_id);
    }
    say_event(log, now_us, sayings[kind].level, event->kind, "%s%s", sayings[kind].names_device ? name : "",
              sayings[kind].text);
}

void pdcpd_log_event(pdcpd_log_t *log, uint64_t now_us, const pdcp_tables_t *tables,
                     const pdcp_event_t *event)
{
    switch (event->kind) {
    case PDCP_EVENT_STATE:
        say_event(log, now_us, PDCPD_LOG_WARNING, event->kind, "bus state: %s",
                  bus_state_name(event->status));
        break;
    case PDCP_EVENT_LINK:
        say_link(log, now_us, tables, event);
        break;
    case PDCP_EVENT_AUDIT:
        say_audit(log, now_us, tables, event);
        break;
    default:
        say_device(log, now_us, tables, event);
        break;
    }
}
