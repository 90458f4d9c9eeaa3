/* One memory with several users: identities, flags, configurations. Whoever writes, or reads while a limb
 * moves, owns the memory until it is done, so that nobody takes another user's write for its own.
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
    ARB_NVM_POLL_MS = 5 /* time that an EEPROM needs for a page */
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

/* Takes the memory for a user. True: the user owns it now. False: it belongs to another. A write of the
 * previous owner may still be under way; its outcome does not matter any more. */
static inline bool arb_nvm_take(arb_nvm_t *nvm, arb_nvm_user_t user)
{
    if (nvm->owner != ARB_NVM_NOBODY && nvm->owner != (uint8_t)user) {
        return false;
    }
    nvm->owner = (uint8_t)user;
    return true;
}

/* Takes the memory for the user from *due_ms on, and returns its state. Above 0: it belongs to another, a
 * write is under way, or *due_ms has not come. 0: it is ready. Below 0: it is ready, and the last write has
 * failed. At or after *due_ms that becomes the time of the next poll. */
int8_t arb_nvm_poll(arb_nvm_t *nvm, arb_nvm_user_t user, uint32_t *due_ms, uint32_t now_ms);

/* Gives the memory back. Does nothing if it is not the user's. */
void arb_nvm_give(arb_nvm_t *nvm, arb_nvm_user_t user);

/* nvm_read and nvm_write of the port. */
bool arb_nvm_read(const arb_nvm_t *nvm, uint16_t address, uint8_t *bytes, uint16_t size);
bool arb_nvm_write(const arb_nvm_t *nvm, uint16_t address, const uint8_t *bytes, uint16_t size);

#endif
