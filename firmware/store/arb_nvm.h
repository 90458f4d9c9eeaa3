/* One memory, several users: identities, flags, configurations. Whoever writes, or reads while a limb moves,
 * owns the memory until it is through, so that nobody takes another one's write for its own.
 *
 *   address      what                                                    by
 *   0            identities, two areas                                   arb_store.h
 *   1024         flags, two pages                                        arb_flags.h
 *   2048, 10240  configurations, two areas of 8 KB                       arb_config.h
 *   18432        free */
#ifndef ARB_NVM_H
#define ARB_NVM_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_port.h"

enum {
    ARB_NVM_FLAGS_AT = 1024,
    ARB_NVM_CONFIG_AT = 2048,
    ARB_NVM_POLL_MS = 5 /* a page of an EEPROM takes so long */
};

typedef enum { ARB_NVM_NOBODY = 0, ARB_NVM_STORE = 1, ARB_NVM_FLAGS = 2, ARB_NVM_CONFIG = 3 } arb_nvm_user_t;

typedef struct {
    const arb_port_t *port;
    uint8_t owner; /* arb_nvm_user_t */
} arb_nvm_t;

static inline void arb_nvm_init(arb_nvm_t *nvm, const arb_port_t *port)
{
    nvm->port = port;
    nvm->owner = ARB_NVM_NOBODY;
}

/* Makes the memory the user's, if it is not another one's. True: it is the user's now. A write of the owner
 * before may still be under way; how it ends concerns nobody. */
static inline bool arb_nvm_take(arb_nvm_t *nvm, arb_nvm_user_t user)
{
    if (nvm->owner != ARB_NVM_NOBODY && nvm->owner != (uint8_t)user) {
        return false;
    }
    nvm->owner = (uint8_t)user;
    return true;
}

/* When *due_ms has come, takes the memory for the user and tells how it stands: above 0 it is another one's
 * or a write is under way, 0 it is ready, below 0 it is, too, but the write before has failed. Above 0 also
 * before that time, which is put off to the next poll otherwise. */
int8_t arb_nvm_poll(arb_nvm_t *nvm, arb_nvm_user_t user, uint32_t *due_ms, uint32_t now_ms);

/* The user does not need it any longer. Does nothing if it is not the user's. */
void arb_nvm_give(arb_nvm_t *nvm, arb_nvm_user_t user);

/* nvm_read and nvm_write of the port. */
bool arb_nvm_read(const arb_nvm_t *nvm, uint16_t address, uint8_t *bytes, uint16_t size);
bool arb_nvm_write(const arb_nvm_t *nvm, uint16_t address, const uint8_t *bytes, uint16_t size);

#endif
