#include "arb_flags.h"

#include <string.h>

#include "arb_crc.h"
#include "pdcp_codec.h"
#include "pdcp_time.h"

enum { FLAGS_NOT_WRITING = 0xFF };

/* The longest record is a page. */
enum { FLAGS_LENGTH_MAX = (int)ARB_PORT_NVM_PAGE - ARB_FLAGS_HEADER - ARB_FLAGS_CRC };

static uint16_t page_address(uint8_t page)
{
    return (uint16_t)(ARB_NVM_FLAGS_AT + (uint16_t)(page * ARB_PORT_NVM_PAGE));
}

static uint8_t next_page(const arb_flags_t *flags)
{
    return flags->page == 0 ? 1 : 0;
}

typedef enum { PAGE_EMPTY, PAGE_DAMAGED, PAGE_GOOD } page_state_t;

static page_state_t check_page(const arb_nvm_t *nvm, uint8_t page, uint8_t record[ARB_PORT_NVM_PAGE])
{
    if (!nvm->port->nvm_read(nvm->port->ctx, page_address(page), record, ARB_PORT_NVM_PAGE) ||
        (record[0] == 0xFF && record[1] == 0xFF)) {
        return PAGE_EMPTY;
    }
    const uint8_t length = record[3];
    if (record[0] != 'P' || record[1] != 'F' || record[2] != ARB_FLAGS_VERSION || length < ARB_FLAGS_LENGTH ||
        length > FLAGS_LENGTH_MAX) {
        return PAGE_DAMAGED;
    }
    const uint32_t crc =
        arb_crc32(ARB_CRC32_INIT, record, (uint16_t)(ARB_FLAGS_HEADER + length + ARB_FLAGS_CRC));
    return crc == ARB_CRC32_RESIDUE ? PAGE_GOOD : PAGE_DAMAGED;
}

void arb_flags_load(arb_flags_t *flags, arb_nvm_t *nvm)
{
    memset(flags, 0, sizeof *flags);
    flags->page = ARB_FLAGS_PAGES;
    flags->stored = ARB_FLAGS_FACTORY;
    flags->writing = FLAGS_NOT_WRITING;
    for (uint8_t page = 0; page < (uint8_t)ARB_FLAGS_PAGES; page++) {
        uint8_t record[ARB_PORT_NVM_PAGE];
        const page_state_t state = check_page(nvm, page, record);
        if (state == PAGE_DAMAGED) {
            flags->damaged++;
        }
        if (state != PAGE_GOOD) {
            continue;
        }
        const uint16_t sequence = pdcp_value_u16(record, ARB_FLAGS_HEADER, 4);
        if (flags->page == (uint8_t)ARB_FLAGS_PAGES || (int16_t)(uint16_t)(sequence - flags->sequence) > 0) {
            flags->page = page;
            flags->sequence = sequence;
            flags->stored = record[ARB_FLAGS_HEADER] & ARB_FLAGS_STORED;
        }
    }
    flags->flags = flags->stored;
}

static bool is_idle(const arb_flags_t *flags)
{
    return flags->writing == FLAGS_NOT_WRITING && flags->flags == flags->stored;
}

void arb_flags_set(arb_flags_t *flags, uint8_t value, uint32_t now_ms)
{
    if (is_idle(flags)) {
        flags->due_ms = now_ms;
    }
    flags->flags = value & ARB_FLAGS_STORED;
}

static bool write_record(arb_flags_t *flags, const arb_nvm_t *nvm)
{
    uint8_t record[ARB_FLAGS_HEADER + ARB_FLAGS_LENGTH + ARB_FLAGS_CRC] = {'P', 'F', ARB_FLAGS_VERSION,
                                                                           ARB_FLAGS_LENGTH};
    const uint16_t length = ARB_FLAGS_HEADER + ARB_FLAGS_LENGTH;
    pdcp_put_u16(&record[4], (uint16_t)(flags->sequence + 1));
    record[ARB_FLAGS_HEADER] = flags->flags;
    const uint32_t crc = ~arb_crc32(ARB_CRC32_INIT, record, length);
    pdcp_put_u16(&record[length], (uint16_t)(crc & 0xFFFFu));
    pdcp_put_u16(&record[length + 2], (uint16_t)(crc >> 16));
    return nvm->port->nvm_write(nvm->port->ctx, page_address(next_page(flags)), record, sizeof record);
}

static void retry_later(arb_flags_t *flags, arb_nvm_t *nvm, uint32_t now_ms)
{
    flags->writing = FLAGS_NOT_WRITING;
    flags->failures = (uint8_t)(flags->failures + (flags->failures != 0xFF ? 1 : 0));
    flags->due_ms = now_ms + ARB_FLAGS_RETRY_MS;
    arb_nvm_give(nvm, ARB_NVM_FLAGS);
}

/* The page under way is in the memory. */
static void end_write(arb_flags_t *flags)
{
    flags->sequence++;
    flags->page = next_page(flags);
    flags->stored = flags->writing;
    flags->writing = FLAGS_NOT_WRITING;
}

void arb_flags_step(arb_flags_t *flags, arb_nvm_t *nvm, uint32_t now_ms)
{
    if (is_idle(flags) || pdcp_time_before(now_ms, flags->due_ms)) {
        return;
    }
    flags->due_ms = now_ms + ARB_NVM_POLL_MS;
    if (!arb_nvm_take(nvm, ARB_NVM_FLAGS)) {
        return;
    }
    const int8_t status = nvm->port->nvm_status(nvm->port->ctx);
    if (status > 0) {
        return;
    }
    if (flags->writing != FLAGS_NOT_WRITING) {
        if (status < 0) {
            retry_later(flags, nvm, now_ms);
            return;
        }
        end_write(flags);
    }
    if (is_idle(flags)) {
        arb_nvm_give(nvm, ARB_NVM_FLAGS);
    } else if (write_record(flags, nvm)) {
        flags->writing = flags->flags;
    } else {
        retry_later(flags, nvm, now_ms);
    }
}

uint32_t arb_flags_next_ms(const arb_flags_t *flags, uint32_t now_ms)
{
    return is_idle(flags) ? now_ms + PDCP_TIME_FAR_MS : flags->due_ms;
}
