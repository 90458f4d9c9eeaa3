/* Configurations in a memory that can lose its power (sim_nvm.h). Saved links are alike but for their
 * type. */
#ifndef STORED_H
#define STORED_H

#include "arb_config.h"
#include "sim_nvm.h"

typedef struct {
    sim_nvm_t memory;
    arb_port_t port;
    arb_nvm_t nvm;
    arb_config_t config;
    uint32_t now_ms;
    uint16_t saved_type;         /* of the links of the configuration that is saved */
    arb_config_status_t outcome; /* of the last job */
} stored_t;

extern stored_t stored;

/* What a host reads and writes. */
typedef struct {
    uint16_t len;
    uint8_t bytes[ARB_CONFIG_STRING_MAX];
} stored_string_t;

/* For setUp: an empty memory, switched on; for tearDown: nobody has misused it. */
void stored_start(void);
void stored_stop(void);

/* What is stored is read; all faults of the memory go, and it is. */
void stored_load(void);
void stored_power_on(void);

/* Jobs, until they have ended. write_raw: in pieces of this size. */
arb_config_status_t stored_run(arb_config_status_t started);
arb_config_status_t stored_save(uint8_t number, uint8_t count, uint16_t type);
arb_config_status_t stored_erase(uint8_t number);
arb_config_status_t stored_write_raw(const stored_string_t *string, uint16_t size);

/* Eight configurations of sixteen links. */
void stored_fill(void);

/* What is stored as a string; it is this one. */
void stored_get_string(stored_string_t *string);
bool stored_is_equal(const stored_string_t *a, const stored_string_t *b);
void stored_expect_string(const stored_string_t *wanted);

/* Parts of a string are appended. */
void stored_put_entry(stored_string_t *string, uint8_t code, uint16_t value);
void stored_put_configuration(stored_string_t *string, uint8_t number, uint8_t count, uint16_t type);

#endif
