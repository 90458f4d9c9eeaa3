#include "arb_store.h"

#include <string.h>

#include "arb_crc.h"
#include "pdcp_codec.h"
#include "pdcp_time.h"

/* A larger table needs another layout: a negative array size does not compile. */
typedef char arb_store_fits_its_place[ARB_STORE_AREAS * ARB_STORE_AREA <= ARB_NVM_FLAGS_AT ? 1 : -1];

static uint16_t area_address(uint8_t area)
{
    return (uint16_t)(area * ARB_STORE_AREA);
}

static uint16_t body_length(uint8_t count)
{
    return (uint16_t)(ARB_STORE_HEADER + ARB_STORE_ENTRY * (uint16_t)count);
}

/* Byte at of the copy that the table makes; at is below body_length. */
static uint8_t body_byte(const pdcp_bind_t *bind, uint16_t sequence, uint16_t at)
{
    if (at < ARB_STORE_HEADER) {
        const uint8_t header[ARB_STORE_HEADER] = {'P',
                                                  'I',
                                                  ARB_STORE_VERSION,
                                                  bind->remembered_count,
                                                  (uint8_t)(sequence & 0xFFu),
                                                  (uint8_t)(sequence >> 8)};
        return header[at];
    }
    const uint16_t entry = (uint16_t)((at - ARB_STORE_HEADER) / ARB_STORE_ENTRY);
    const pdcp_remembered_t *remembered = &bind->remembered[entry];
    uint8_t bytes[ARB_STORE_ENTRY];
    pdcp_put_u16(&bytes[0], remembered->identity.vid);
    pdcp_put_u16(&bytes[2], remembered->identity.pid);
    pdcp_put_u16(&bytes[4], remembered->identity.sn);
    bytes[6] = remembered->node_id;
    return bytes[(at - ARB_STORE_HEADER) % ARB_STORE_ENTRY];
}

static uint32_t body_crc(const pdcp_bind_t *bind, uint16_t sequence)
{
    uint32_t crc = ARB_CRC32_INIT;
    for (uint16_t at = 0; at < body_length(bind->remembered_count); at++) {
        const uint8_t byte = body_byte(bind, sequence, at);
        crc = arb_crc32(crc, &byte, 1);
    }
    return ~crc;
}

typedef enum { AREA_EMPTY, AREA_DAMAGED, AREA_GOOD } area_state_t;

/* Checks an area before anything of it is used. */
static area_state_t check_area(const arb_port_t *port, uint8_t area, uint8_t header[ARB_STORE_HEADER])
{
    if (!port->nvm_read(port->ctx, area_address(area), header, ARB_STORE_HEADER) ||
        (header[0] == 0xFF && header[1] == 0xFF)) {
        return AREA_EMPTY;
    }
    if (header[0] != 'P' || header[1] != 'I' || header[2] != ARB_STORE_VERSION ||
        header[3] > PDCP_IDENTITIES_MAX) {
        return AREA_DAMAGED;
    }
    uint32_t crc = ARB_CRC32_INIT;
    const uint16_t end = (uint16_t)(body_length(header[3]) + ARB_STORE_CRC);
    for (uint16_t at = 0; at < end; at++) {
        uint8_t byte;
        if (!port->nvm_read(port->ctx, (uint16_t)(area_address(area) + at), &byte, 1)) {
            return AREA_DAMAGED;
        }
        crc = arb_crc32(crc, &byte, 1);
    }
    return crc == ARB_CRC32_RESIDUE ? AREA_GOOD : AREA_DAMAGED;
}

static void load_entries(const arb_port_t *port, uint8_t area, uint8_t count, pdcp_bind_t *bind)
{
    for (uint8_t i = 0; i < count; i++) {
        uint8_t bytes[ARB_STORE_ENTRY];
        const uint16_t address = (uint16_t)(area_address(area) + body_length(i));
        if (!port->nvm_read(port->ctx, address, bytes, ARB_STORE_ENTRY)) {
            return;
        }
        const pdcp_remembered_t entry = {.identity = {.vid = pdcp_value_u16(bytes, ARB_STORE_ENTRY, 0),
                                                      .pid = pdcp_value_u16(bytes, ARB_STORE_ENTRY, 2),
                                                      .sn = pdcp_value_u16(bytes, ARB_STORE_ENTRY, 4)},
                                         .node_id = bytes[6]};
        (void)pdcp_bind_remember_stored(bind, &entry);
    }
}

void arb_store_load(arb_store_t *store, const arb_port_t *port, pdcp_bind_t *bind)
{
    uint8_t best_count = 0;
    memset(store, 0, sizeof *store);
    store->area = ARB_STORE_AREAS;
    for (uint8_t area = 0; area < (uint8_t)ARB_STORE_AREAS; area++) {
        uint8_t header[ARB_STORE_HEADER];
        const area_state_t state = check_area(port, area, header);
        if (state == AREA_DAMAGED) {
            store->damaged++;
        }
        if (state != AREA_GOOD) {
            continue;
        }
        const uint16_t sequence = pdcp_value_u16(header, ARB_STORE_HEADER, 4);
        if (store->area == ARB_STORE_AREAS || (int16_t)(uint16_t)(sequence - store->sequence) > 0) {
            store->area = area;
            store->sequence = sequence;
            best_count = header[3];
        }
    }
    if (store->area != ARB_STORE_AREAS) {
        load_entries(port, store->area, best_count, bind);
    }
}

void arb_store_share(arb_store_t *store, arb_nvm_t *nvm)
{
    store->nvm = nvm;
}

/* The memory is not written to for now. */
static void stop_writing(arb_store_t *store)
{
    store->writing = false;
    if (store->nvm != NULL) {
        arb_nvm_give(store->nvm, ARB_NVM_STORE);
    }
}

void arb_store_touch(arb_store_t *store, uint32_t now_ms)
{
    store->changed = true;
    stop_writing(store); /* a copy under way is out of date: its area is written from the start */
    store->due_ms = now_ms + ARB_STORE_DELAY_MS;
}

static uint8_t next_area(const arb_store_t *store)
{
    return store->area == 0 ? 1 : 0;
}

/* Hands the next page over. False: the memory does not take it. */
static bool write_page(arb_store_t *store, const arb_port_t *port, const pdcp_bind_t *bind)
{
    const uint16_t sequence = (uint16_t)(store->sequence + 1);
    const uint16_t body = body_length(bind->remembered_count);
    const uint32_t crc = body_crc(bind, sequence);
    uint8_t page[ARB_PORT_NVM_PAGE];
    uint16_t len = 0;
    if (store->written == 0) {
        store->crc = crc;
    } else if (store->crc != crc) { /* the order has changed meanwhile: from the start */
        store->written = 0;
        store->crc = crc;
    }
    while (len < ARB_PORT_NVM_PAGE && store->written + len < body + ARB_STORE_CRC) {
        const uint16_t at = (uint16_t)(store->written + len);
        if (at < body) {
            page[len] = body_byte(bind, sequence, at);
        } else {
            page[len] = (uint8_t)((crc >> (8u * (uint16_t)(at - body))) & 0xFFu);
        }
        len++;
    }
    const uint16_t address = (uint16_t)(area_address(next_area(store)) + store->written);
    if (!port->nvm_write(port->ctx, address, page, len)) {
        return false;
    }
    store->written = (uint16_t)(store->written + len);
    return true;
}

static void retry_later(arb_store_t *store, uint32_t now_ms)
{
    store->failures++;
    stop_writing(store);
    store->due_ms = now_ms + ARB_STORE_DELAY_MS;
}

void arb_store_step(arb_store_t *store, const arb_port_t *port, const pdcp_bind_t *bind, uint32_t now_ms)
{
    if (!store->changed || pdcp_time_before(now_ms, store->due_ms)) {
        return;
    }
    store->due_ms = now_ms + ARB_NVM_POLL_MS;
    if (store->nvm != NULL && !arb_nvm_take(store->nvm, ARB_NVM_STORE)) {
        return;
    }
    const int8_t status = port->nvm_status(port->ctx);
    if (status > 0) {
        return;
    }
    if (!store->writing) {
        store->writing = true;
        store->written = 0;
    } else if (status < 0) {
        retry_later(store, now_ms);
        return;
    }
    if (store->written == body_length(bind->remembered_count) + ARB_STORE_CRC) {
        store->sequence++;
        store->area = next_area(store);
        stop_writing(store);
        store->changed = false;
    } else if (!write_page(store, port, bind)) {
        retry_later(store, now_ms);
    }
}

uint32_t arb_store_next_ms(const arb_store_t *store, uint32_t now_ms)
{
    return store->changed ? store->due_ms : now_ms + PDCP_TIME_FAR_MS;
}
