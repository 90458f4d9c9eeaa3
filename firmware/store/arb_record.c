#include "arb_record.h"

#include "arb_crc.h"
#include "pdcp_bytes.h"

static uint16_t area_address(const arb_record_t *record, uint8_t area)
{
    return (uint16_t)(record->address + (area == 0 ? 0 : record->size));
}

/* Reads an area whose header is good so far. False: it is not good. */
static bool is_whole(const arb_record_t *record, const arb_nvm_t *nvm, uint16_t address, uint8_t count)
{
    uint16_t left = arb_record_length(record, count);
    uint32_t crc = ARB_CRC32_INIT;
    uint8_t byte;
    if (left > record->size) {
        return false;
    }
    for (; left > 0; left--) {
        if (!arb_nvm_read(nvm, address, &byte, 1)) {
            return false;
        }
        crc = arb_crc32(crc, &byte, 1);
        address++;
    }
    return crc == ARB_CRC32_RESIDUE;
}

void arb_record_load(const arb_record_t *record, const arb_nvm_t *nvm, arb_area_t *newest, uint8_t *damaged,
                     void *table)
{
    uint8_t bytes[ARB_RECORD_ENTRY_MAX];
    uint8_t count = 0;
    newest->area = ARB_AREAS;
    for (uint8_t area = 0; area < (uint8_t)ARB_AREAS; area++) {
        const uint16_t address = area_address(record, area);
        const arb_area_state_t state = arb_area_open(nvm, address, record->letter, bytes, ARB_AREA_HEADER);
        if (state == ARB_AREA_GOOD && is_whole(record, nvm, address, bytes[3])) {
            if (arb_area_offer(newest, area, bytes)) {
                count = bytes[3];
            }
        } else if (state != ARB_AREA_EMPTY) {
            (*damaged)++;
        }
    }
    uint16_t address = (uint16_t)(area_address(record, newest->area) + ARB_AREA_HEADER);
    for (uint8_t k = 0; k < count && arb_nvm_read(nvm, address, bytes, record->entry); k++) {
        record->take(table, k, bytes);
        address = (uint16_t)(address + record->entry);
    }
}

/* A page of a record on its way to the memory. */
typedef struct {
    uint16_t from; /* the byte of the record that the page begins with */
    uint16_t at;   /* bytes of the record so far, in front of the page, in it and behind it */
    uint32_t crc;  /* of these bytes */
    uint8_t bytes[ARB_PORT_NVM_PAGE];
} page_t;

/* The next bytes of the record; the page keeps what falls into it. */
static void append(page_t *page, const uint8_t *bytes, uint8_t len)
{
    page->crc = arb_crc32(page->crc, bytes, len);
    for (uint8_t i = 0; i < len; i++) {
        if (page->at >= page->from && page->at - page->from < (uint16_t)ARB_PORT_NVM_PAGE) {
            page->bytes[page->at - page->from] = bytes[i];
        }
        page->at++;
    }
}

/* Goes through the whole record. Returns the CRC of what stands in front of its own. */
static uint32_t fill_page(const arb_record_t *record, const arb_area_t *newest, uint8_t count,
                          const void *table, page_t *page)
{
    uint8_t bytes[ARB_RECORD_ENTRY_MAX];
    page->at = 0;
    page->crc = ARB_CRC32_INIT;
    arb_area_put_header(newest, record->letter, count, bytes);
    append(page, bytes, ARB_AREA_HEADER);
    for (uint8_t k = 0; k < count; k++) {
        record->put(table, k, bytes);
        append(page, bytes, record->entry);
    }
    const uint32_t crc = page->crc;
    pdcp_bytes_put_u32(bytes, ~crc);
    append(page, bytes, ARB_AREA_CRC);
    return crc;
}

bool arb_record_write(const arb_record_t *record, const arb_nvm_t *nvm, const arb_area_t *newest,
                      uint8_t count, const void *table, arb_record_copy_t *copy)
{
    page_t page;
    page.from = copy->written;
    const uint32_t crc = fill_page(record, newest, count, table, &page);
    const bool is_changed = copy->written != 0 && copy->crc != crc;
    copy->crc = crc;
    if (is_changed) {
        copy->written = 0;
        return true;
    }
    const uint16_t left = (uint16_t)(page.at - page.from);
    const uint16_t len = left < ARB_PORT_NVM_PAGE ? left : ARB_PORT_NVM_PAGE;
    const uint16_t address = (uint16_t)(area_address(record, arb_area_next(newest)) + copy->written);
    copy->written = (uint16_t)(copy->written + len);
    return arb_nvm_write(nvm, address, page.bytes, len);
}

void arb_record_written(arb_area_t *newest)
{
    newest->sequence++;
    newest->area = arb_area_next(newest);
}
