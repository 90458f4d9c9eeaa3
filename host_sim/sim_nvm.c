#include "sim_nvm.h"

#include <string.h>

void sim_nvm_init(sim_nvm_t *nvm)
{
    memset(nvm, 0, sizeof *nvm);
    memset(nvm->bytes, 0xFF, sizeof nvm->bytes);
    sim_nvm_power_on(nvm);
}

void sim_nvm_power_on(sim_nvm_t *nvm)
{
    nvm->cut_after = SIM_NVM_NEVER;
    nvm->fail_after = SIM_NVM_NEVER;
    nvm->bad_address = SIM_NVM_NEVER;
    nvm->busy_polls = 0;
    nvm->reads_fail = false;
    nvm->off = false;
    nvm->failed = false;
    nvm->polls_left = 0;
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    sim_nvm_t *nvm = ctx;
    if (nvm->polls_left != 0 || (uint32_t)address + size > SIM_NVM_SIZE) {
        nvm->misuses++;
        return false;
    }
    if (nvm->reads_fail) {
        return false;
    }
    memcpy(bytes, &nvm->bytes[address], size);
    return true;
}

static void cut_byte(sim_nvm_t *nvm, uint8_t *byte, uint8_t written)
{
    switch (nvm->cut) {
    case SIM_NVM_CUT_NEW:
        *byte = written;
        break;
    case SIM_NVM_CUT_00:
        *byte = 0x00;
        break;
    case SIM_NVM_CUT_FF:
        *byte = 0xFF;
        break;
    case SIM_NVM_CUT_INVERTED:
        *byte = (uint8_t)~written;
        break;
    default:
        break;
    }
}

static void write_byte(sim_nvm_t *nvm, uint16_t address, uint8_t byte)
{
    if (nvm->cut_after == 0) {
        cut_byte(nvm, &nvm->bytes[address], byte);
        nvm->off = true;
        return;
    }
    if (nvm->cut_after != SIM_NVM_NEVER) {
        nvm->cut_after--;
    }
    if (address != nvm->bad_address) {
        nvm->bytes[address] = byte;
    }
    nvm->bytes_written++;
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    sim_nvm_t *nvm = ctx;
    const bool in_page = size != 0 && address % ARB_PORT_NVM_PAGE + size <= ARB_PORT_NVM_PAGE;
    if (nvm->polls_left != 0 || !in_page || (uint32_t)address + size > SIM_NVM_SIZE) {
        nvm->misuses++;
        return false;
    }
    nvm->polls_left = nvm->busy_polls;
    nvm->failed = nvm->fail_after == 0;
    if (nvm->fail_after != SIM_NVM_NEVER && nvm->fail_after != 0) {
        nvm->fail_after--;
    }
    if (nvm->failed || nvm->off) {
        return true;
    }
    nvm->writes++;
    nvm->page_writes[address / ARB_PORT_NVM_PAGE]++;
    for (uint16_t i = 0; i < size && !nvm->off; i++) {
        write_byte(nvm, (uint16_t)(address + i), bytes[i]);
    }
    return true;
}

static int8_t nvm_status(void *ctx)
{
    sim_nvm_t *nvm = ctx;
    if (nvm->polls_left != 0) {
        nvm->polls_left--;
        return 1;
    }
    return nvm->failed ? -1 : 0;
}

void sim_nvm_port(sim_nvm_t *nvm, arb_port_t *port)
{
    port->ctx = nvm;
    port->nvm_read = nvm_read;
    port->nvm_write = nvm_write;
    port->nvm_status = nvm_status;
}
