/* Command line and configuration file of pdcpd. */
#ifndef PDCPD_OPTIONS_H
#define PDCPD_OPTIONS_H

#include <stdbool.h>

#define PDCPD_NODES_MAX 64
#define PDCPD_EXIT_USAGE 2
#define PDCPD_EXIT_MISSING 3 /* something outside is missing now: a service manager may try again */

typedef enum { PDCPD_LOG_ERROR, PDCPD_LOG_WARNING, PDCPD_LOG_INFO, PDCPD_LOG_DEBUG } pdcpd_level_t;

typedef struct {
    char *can;    /* BUS; every string is the options' own */
    char *host;   /* PORT */
    char *nvm;    /* file; NULL: memory only */
    char *config; /* file; NULL: none */
    char *nodes[PDCPD_NODES_MAX];
    unsigned node_count;
    bool no_autoconfig;
    bool strict_crc;
    pdcpd_level_t log;
} pdcpd_options_t;

/* Reads the command line, then the configuration file that it names; the command line wins. On anything
 * wrong: one line on standard error, exit with PDCPD_EXIT_USAGE. */
void pdcpd_options_parse(pdcpd_options_t *options, int argc, char **argv);

void pdcpd_options_free(pdcpd_options_t *options);

#endif
