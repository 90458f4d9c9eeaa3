/* Non-volatile memory in RAM whose power can be cut at any byte of a write (the contract of hal_nvm.h), with
 * writes that fail, pages that take long, and a count of writes for each page. */
#ifndef SIM_NVM_H
#define SIM_NVM_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_port.h"

enum { SIM_NVM_SIZE = 32768, SIM_NVM_PAGES = SIM_NVM_SIZE / ARB_PORT_NVM_PAGE };

#define SIM_NVM_NEVER 0xFFFFFFFFuL

/* What the byte at the cut becomes. */
typedef enum {
    SIM_NVM_CUT_OLD, /* as it was: the cut is between two bytes */
    SIM_NVM_CUT_NEW, /* written */
    SIM_NVM_CUT_00,
    SIM_NVM_CUT_FF,
    SIM_NVM_CUT_INVERTED, /* the complement of the new one */
    SIM_NVM_CUTS
} sim_nvm_cut_t;

typedef struct {
    uint8_t bytes[SIM_NVM_SIZE];
    /* Faults, set by the test. */
    uint32_t cut_after;   /* bytes that are still written before the power fails; SIM_NVM_NEVER */
    sim_nvm_cut_t cut;    /* the byte behind them */
    uint32_t fail_after;  /* writes that still succeed before one fails; SIM_NVM_NEVER */
    uint32_t bad_address; /* a byte that keeps the value it has, unnoticed; SIM_NVM_NEVER */
    uint8_t busy_polls;   /* for how many polls a page is under way */
    bool reads_fail;
    /* What has happened. */
    bool off; /* the power has failed: nothing is written any more, though it looks like it */
    bool failed;
    uint8_t polls_left;
    uint32_t writes;
    uint32_t bytes_written;
    uint32_t
        misuses; /* writes across a page or beyond the end, anything but a poll while a page is under way */
    uint32_t page_writes[SIM_NVM_PAGES];
} sim_nvm_t;

/* A new memory, all FFh, without faults. */
void sim_nvm_init(sim_nvm_t *nvm);

/* The power comes back: contents and counters stay, faults are gone. */
void sim_nvm_power_on(sim_nvm_t *nvm);

/* Fills in the port's memory functions and ctx, which becomes nvm. */
void sim_nvm_port(sim_nvm_t *nvm, arb_port_t *port);

#endif
