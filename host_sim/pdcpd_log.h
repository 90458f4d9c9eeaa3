/* The log of pdcpd on standard error, for the person who runs it.
 *
 * It never blocks (line_writer.h). It writes up to PDCPD_LOG_RATE lines a second of each kind of event,
 * counts the others, and reports the count when the second is over. Each line begins with the time, unless a
 * journal adds it. */
#ifndef PDCPD_LOG_H
#define PDCPD_LOG_H

#include "line_writer.h"
#include "pdcp_arb.h"
#include "pdcpd_options.h"

enum {
    PDCPD_LOG_RATE = 20,
    PDCPD_LOG_KIND_OTHER =
        PDCP_EVENT_REQUEST, /* lines that tell of no event; kinds of events have lower numbers */
    PDCPD_LOG_KIND_HOST,
    PDCPD_LOG_KINDS,
    PDCPD_LOG_TEXT = 200
};

/* Lines of one kind in the second under way. */
typedef struct {
    uint64_t since_us;
    unsigned said;
    unsigned left_out;
    char last[PDCPD_LOG_TEXT]; /* the line left out last */
} pdcpd_log_kind_t;

typedef struct {
    line_writer_t *out; /* NULL: the log is closed, nothing is said */
    pdcpd_level_t level;
    bool has_time; /* lines begin with the time */
    pdcpd_log_kind_t kinds[PDCPD_LOG_KINDS];
} pdcpd_log_t;

/* Opens the log on standard error. False: errno says why. */
bool pdcpd_log_open(pdcpd_log_t *log, pdcpd_level_t level);

/* Waits a moment for the last lines. */
void pdcpd_log_close(pdcpd_log_t *log);

/* Says a line if the level is high enough. */
void pdcpd_log_say(pdcpd_log_t *log, uint64_t now_us, pdcpd_level_t level, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Says what an event of the arbitrator means. */
void pdcpd_log_event(pdcpd_log_t *log, uint64_t now_us, const pdcp_tables_t *tables,
                     const pdcp_event_t *event);

/* Says what the host has changed or tried to change, and nothing of what it only read. As host_served of
 * arb_port.h. */
void pdcpd_log_served(pdcpd_log_t *log, uint64_t now_us, uint16_t message, const uint8_t *payload,
                      uint16_t len, uint8_t error);

/* Tells of lines that were left out. Returns the time of the next call at the latest, UINT64_MAX: none. */
uint64_t pdcpd_log_step(pdcpd_log_t *log, uint64_t now_us);

#endif
