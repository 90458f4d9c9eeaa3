#include "arb_nvm.h"

#include "pdcp_assert.h"
#include "pdcp_time.h"

int8_t arb_nvm_poll(arb_nvm_t *nvm, arb_nvm_user_t user, uint32_t *due_ms, uint32_t now_ms)
{
    int8_t status = 1;
    if (!pdcp_time_before(now_ms, *due_ms)) {
        *due_ms = now_ms + ARB_NVM_POLL_MS;
        if (arb_nvm_take(nvm, user)) {
            status = nvm->port->nvm_status(nvm->port->ctx);
        }
    }
    return status;
}

void arb_nvm_give(arb_nvm_t *nvm, arb_nvm_user_t user)
{
    if (nvm->owner == (uint8_t)user) {
        nvm->owner = ARB_NVM_NOBODY;
    }
}

bool arb_nvm_read(const arb_nvm_t *nvm, uint16_t address, uint8_t *bytes, uint16_t size)
{
    return nvm->port->nvm_read(nvm->port->ctx, address, bytes, size);
}

bool arb_nvm_write(const arb_nvm_t *nvm, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    pdcp_assert(size != 0 && address / ARB_PORT_NVM_PAGE == (address + size - 1u) / ARB_PORT_NVM_PAGE,
                "arb_port.h: a write stays within a page");
    pdcp_assert(nvm->owner != ARB_NVM_NOBODY, "arb_nvm.h: whoever writes owns the memory");
    return nvm->port->nvm_write(nvm->port->ctx, address, bytes, size);
}
