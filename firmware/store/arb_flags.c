#include "arb_flags.h"

#include <string.h>

#include "pdcp_time.h"

static void put_setting(const void *table, uint8_t k, uint8_t *entry)
{
    (void)k;
    *entry = ((const arb_flags_t *)table)->flags;
}

static void take_setting(void *table, uint8_t k, const uint8_t *entry)
{
    if (k == 0) { /* a later version has more of them */
        ((arb_flags_t *)table)->flags = *entry & ARB_FLAGS_STORED;
    }
}

/* A page is an area, an entry is a setting. */
static const arb_record_t flags_record = {.address = ARB_NVM_FLAGS_AT,
                                          .size = ARB_PORT_NVM_PAGE,
                                          .letter = 'F',
                                          .entry = 1,
                                          .put = put_setting,
                                          .take = take_setting};

void arb_flags_load(arb_flags_t *flags, arb_nvm_t *nvm)
{
    memset(flags, 0, sizeof *flags);
    flags->flags = ARB_FLAGS_FACTORY;
    arb_record_load(&flags_record, nvm, &flags->newest, &flags->damaged, flags);
    flags->stored = flags->flags;
    flags->writing = flags->flags;
}

static bool is_idle(const arb_flags_t *flags)
{
    return flags->writing == flags->stored && flags->flags == flags->stored;
}

void arb_flags_set(arb_flags_t *flags, uint8_t value, uint32_t now_ms)
{
    if (is_idle(flags)) {
        flags->due_ms = now_ms;
    }
    flags->flags = value & ARB_FLAGS_STORED;
}

/* A record is one page. */
static bool write_record(arb_flags_t *flags, const arb_nvm_t *nvm)
{
    arb_record_copy_t copy = {0, 0};
    flags->writing = flags->flags;
    return arb_record_write(&flags_record, nvm, &flags->newest, ARB_FLAGS_LENGTH, flags, &copy);
}

void arb_flags_step(arb_flags_t *flags, arb_nvm_t *nvm, uint32_t now_ms)
{
    if (is_idle(flags)) {
        arb_nvm_give(nvm, ARB_NVM_FLAGS); /* they may have been set back while it was not ready */
        return;
    }
    const int8_t status = arb_nvm_poll(nvm, ARB_NVM_FLAGS, &flags->due_ms, now_ms);
    if (status > 0) {
        return;
    }
    if (flags->writing != flags->stored && status == 0) { /* the page under way is in the memory */
        arb_record_written(&flags->newest);
        flags->stored = flags->writing;
    }
    if (is_idle(flags)) {
        arb_nvm_give(nvm, ARB_NVM_FLAGS);
    } else if (flags->writing != flags->stored || !write_record(flags, nvm)) { /* it or the next one failed */
        flags->writing = flags->stored;
        if (flags->failures != 0xFF) {
            flags->failures++;
        }
        flags->due_ms = now_ms + ARB_FLAGS_RETRY_MS;
        arb_nvm_give(nvm, ARB_NVM_FLAGS);
    }
}

uint32_t arb_flags_next_ms(const arb_flags_t *flags, uint32_t now_ms)
{
    return is_idle(flags) ? now_ms + PDCP_TIME_FAR_MS : flags->due_ms;
}
