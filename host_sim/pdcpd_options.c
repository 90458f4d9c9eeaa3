#include "pdcpd_options.h"

#include <argp.h>
#include <errno.h>
#include <ini.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arb_version.h"
#include "complaint.h"
#include "linux_can.h"
#include "pdcpd_list.h"

enum { KEY_NO_AUTOCONFIG = 256, KEY_STRICT_CRC, KEY_CONFIG, KEY_LIST, KEY_VERSION };

static const struct argp_option table[] = {
    {"can", 'c', "BUS", 0, "Bus: sim, sim:TCPPORT, " LINUX_CAN_CHOICES, 0},
    {"host", 'H', "PORT", 0, "Host: pty, pty:LINKPATH, serial:DEVICE[@BAUD] (128000)", 0},
    {"nvm", 'n', "FILE", 0, "File that keeps what outlives a power cycle; without it nothing is kept", 0},
    {"node", 'd', "FILE", 0, "Put a simulated device into this process (with sim only; repeatable)", 0},
    {"no-autoconfig", KEY_NO_AUTOCONFIG, NULL, 0, "Make no links unasked", 0},
    {"strict-crc", KEY_STRICT_CRC, NULL, 0, "Refuse host messages with wrong checksums", 0},
    {"log", 'l', "LEVEL", 0, "error, warning (default), info or debug; written to standard error", 0},
    {"config", KEY_CONFIG, "FILE", 0, "INI file, section [pdcpd], keys named like these options", 0},
    {"list", KEY_LIST, NULL, 0, "Print what this machine has for --can and --host, and end", -1},
    {"version", KEY_VERSION, NULL, 0, "Print the version and end", -1},
    {0},
};

static void replace(char **text, const char *value)
{
    char *copy = strdup(value);
    if (copy == NULL) {
        abort();
    }
    free(*text);
    *text = copy;
}

static bool parse_level(const char *text, pdcpd_level_t *level)
{
    static const char *const names[] = {"error", "warning", "info", "debug"};
    for (unsigned i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strcmp(text, names[i]) == 0) {
            *level = (pdcpd_level_t)i;
            return true;
        }
    }
    return false;
}

static bool add_node(pdcpd_options_t *options, const char *file)
{
    if (options->node_count == PDCPD_NODES_MAX) {
        return false;
    }
    replace(&options->nodes[options->node_count++], file);
    return true;
}

/* Where the text of an option is kept. NULL: it is not kept as a text. */
static char **text_of(pdcpd_options_t *options, int key)
{
    switch (key) {
    case 'c':
        return &options->can;
    case 'H':
        return &options->host;
    case 'n':
        return &options->nvm;
    case KEY_CONFIG:
        return &options->config;
    default:
        return NULL;
    }
}

/* What an option without an argument sets. NULL: it sets nothing. */
static bool *flag_of(pdcpd_options_t *options, int key)
{
    switch (key) {
    case KEY_NO_AUTOCONFIG:
        return &options->no_autoconfig;
    case KEY_STRICT_CRC:
        return &options->strict_crc;
    default:
        return NULL;
    }
}

static error_t on_option(int key, char *text, struct argp_state *state)
{
    pdcpd_options_t *options = state->input;
    char **kept = text_of(options, key);
    bool *flag = flag_of(options, key);
    if (kept != NULL) {
        replace(kept, text);
        return 0;
    }
    if (flag != NULL) {
        *flag = true;
        return 0;
    }
    switch (key) {
    case ARGP_KEY_INIT:
        state->err_stream = NULL; /* one line, getopt's, and no hint behind it */
        return 0;
    case 'd':
        if (!add_node(options, text)) {
            argp_failure(NULL, PDCPD_EXIT_USAGE, 0, "--node: more than %d devices", PDCPD_NODES_MAX);
        }
        return 0;
    case KEY_LIST:
        pdcpd_list(stdout);
        exit(EXIT_SUCCESS);
    case KEY_VERSION:
        (void)printf("pdcpd %d.%d.%d\n", ARB_VERSION_MAJOR, ARB_VERSION_MINOR, ARB_VERSION_PATCH);
        exit(EXIT_SUCCESS);
    case 'l':
        if (!parse_level(text, &options->log)) {
            argp_failure(NULL, PDCPD_EXIT_USAGE, 0, "--log: '%s' is not one of error, warning, info, debug",
                         text);
        }
        return 0;
    case ARGP_KEY_ARG:
        argp_failure(NULL, PDCPD_EXIT_USAGE, 0, "unexpected argument '%s'; --help tells more", text);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* The file's options, and what is wrong with the first bad one. */
typedef struct {
    pdcpd_options_t options;
    char error[256];
} file_t;

static bool parse_flag(const char *text, bool *flag)
{
    *flag = strcmp(text, "yes") == 0;
    return *flag || strcmp(text, "no") == 0;
}

static bool set_key(pdcpd_options_t *options, const char *name, const char *value)
{
    if (strcmp(name, "can") == 0) {
        replace(&options->can, value);
    } else if (strcmp(name, "host") == 0) {
        replace(&options->host, value);
    } else if (strcmp(name, "nvm") == 0) {
        replace(&options->nvm, value);
    } else if (strcmp(name, "node") == 0) {
        return add_node(options, value);
    } else if (strcmp(name, "no-autoconfig") == 0) {
        return parse_flag(value, &options->no_autoconfig);
    } else if (strcmp(name, "strict-crc") == 0) {
        return parse_flag(value, &options->strict_crc);
    } else if (strcmp(name, "log") == 0) {
        return parse_level(value, &options->log);
    } else {
        return false;
    }
    return true;
}

static int on_key(void *ctx, const char *section, const char *name, const char *value)
{
    file_t *file = ctx;
    if (strcmp(section, "pdcpd") != 0) {
        (void)snprintf(file->error, sizeof file->error, "section [%s] is not [pdcpd]", section);
        return 0;
    }
    if (!set_key(&file->options, name, value)) {
        (void)snprintf(file->error, sizeof file->error,
                       "'%s = %s': pdcpd has no such option, or not with this value", name, value);
        return 0;
    }
    return 1;
}

static void take(char **mine, char **other)
{
    if (*mine == NULL) {
        *mine = *other;
        *other = NULL;
    }
}

static void read_file(pdcpd_options_t *options, bool log_given)
{
    file_t file;
    memset(&file, 0, sizeof file);
    file.options.log = options->log;
    const int line = ini_parse(options->config, on_key, &file);
    if (line != 0) {
        char text[COMPLAINT_TEXT];
        if (line < 0) {
            (void)snprintf(text, sizeof text, "%s: cannot be read", options->config);
        } else {
            (void)snprintf(text, sizeof text, "%s:%d: %s", options->config, line,
                           file.error[0] != '\0' ? file.error : "not a line of the form key = value");
        }
        complaint_say("pdcpd", text);
        exit(PDCPD_EXIT_USAGE);
    }
    take(&options->can, &file.options.can);
    take(&options->host, &file.options.host);
    take(&options->nvm, &file.options.nvm);
    for (unsigned i = 0; i < file.options.node_count; i++) {
        if (!add_node(options, file.options.nodes[i])) {
            (void)fprintf(stderr, "pdcpd: %s: more than %d devices\n", options->config, PDCPD_NODES_MAX);
            exit(PDCPD_EXIT_USAGE);
        }
    }
    options->no_autoconfig = options->no_autoconfig || file.options.no_autoconfig;
    options->strict_crc = options->strict_crc || file.options.strict_crc;
    if (!log_given) {
        options->log = file.options.log;
    }
    pdcpd_options_free(&file.options);
}

static bool is_sim(const char *bus)
{
    return strcmp(bus, "sim") == 0 || strncmp(bus, "sim:", 4) == 0;
}

static void check(const pdcpd_options_t *options)
{
    const char *missing = options->can == NULL ? "--can BUS" : options->host == NULL ? "--host PORT" : NULL;
    if (missing != NULL) {
        (void)fprintf(stderr, "pdcpd: %s is missing; --help tells more\n", missing);
        exit(PDCPD_EXIT_USAGE);
    }
    if (!is_sim(options->can) && strncmp(options->can, "socketcan:", 10) != 0 &&
        strncmp(options->can, "socketcand:", 11) != 0 && strncmp(options->can, "gs_usb", 6) != 0) {
        (void)fprintf(stderr,
                      "pdcpd: %s: not a bus; expected one of sim, sim:TCPPORT, " LINUX_CAN_CHOICES "\n",
                      options->can);
        exit(PDCPD_EXIT_USAGE);
    }
    if (options->node_count != 0 && !is_sim(options->can)) {
        (void)fprintf(stderr, "pdcpd: --node goes with --can sim only, not with %s\n", options->can);
        exit(PDCPD_EXIT_USAGE);
    }
}

void pdcpd_options_parse(pdcpd_options_t *options, int argc, char **argv)
{
    static const struct argp parser = {
        .options = table,
        .parser = on_option,
        .doc = "Bus arbitrator for the Prosthetic Device Communication Protocol. Runs until SIGTERM.",
    };
    memset(options, 0, sizeof *options);
    argv[0] = program_invocation_short_name; /* what is wrong with an option is told without a path */
    const pdcpd_level_t not_given = (pdcpd_level_t)(PDCPD_LOG_DEBUG + 1);
    options->log = not_given;
    if (argp_parse(&parser, argc, argv, 0, NULL, options) != 0) {
        exit(PDCPD_EXIT_USAGE);
    }
    const bool log_given = options->log != not_given;
    if (!log_given) {
        options->log = PDCPD_LOG_WARNING;
    }
    if (options->config != NULL) {
        read_file(options, log_given);
    }
    check(options);
}

void pdcpd_options_free(pdcpd_options_t *options)
{
    free(options->can);
    free(options->host);
    free(options->nvm);
    free(options->config);
    for (unsigned i = 0; i < options->node_count; i++) {
        free(options->nodes[i]);
    }
}
