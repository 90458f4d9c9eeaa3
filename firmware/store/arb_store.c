#include "arb_store.h"

#include <string.h>

#include "pdcp_bytes.h"

/* A larger table needs another layout: a negative array size does not compile. */
typedef char arb_store_fits_its_place[ARB_AREAS * ARB_STORE_AREA <= ARB_NVM_FLAGS_AT ? 1 : -1];

static void put_entry(const void *table, uint8_t k, uint8_t *entry)
{
    const pdcp_remembered_t *remembered = &((const pdcp_bind_t *)table)->remembered[k];
    pdcp_bytes_put_identity(entry, &remembered->identity);
    entry[6] = remembered->node_id;
}

static void take_entry(void *table, uint8_t k, const uint8_t *entry)
{
    (void)k;
    const pdcp_remembered_t remembered = {.identity = pdcp_bytes_get_identity(entry), .node_id = entry[6]};
    (void)pdcp_bind_remember_stored(table, &remembered);
}

static const arb_record_t store_record = {.address = 0,
                                          .size = ARB_STORE_AREA,
                                          .letter = 'I',
                                          .entry = ARB_STORE_ENTRY,
                                          .put = put_entry,
                                          .take = take_entry};

void arb_store_load(arb_store_t *store, arb_nvm_t *nvm, pdcp_bind_t *bind)
{
    memset(store, 0, sizeof *store);
    store->nvm = nvm;
    arb_record_load(&store_record, nvm, &store->newest, &store->damaged, bind);
}

void arb_store_touch(arb_store_t *store, uint32_t now_ms)
{
    store->changed = true;
    store->copy.written = 0; /* a copy under way is out of date: its area is written from the start */
    store->due_ms = now_ms + ARB_STORE_DELAY_MS;
    if (store->pausing && pdcp_time_before(store->due_ms, store->pause_ms)) {
        store->due_ms = store->pause_ms;
    }
    arb_nvm_give(store->nvm, ARB_NVM_STORE);
}

void arb_store_step(arb_store_t *store, const pdcp_bind_t *bind, uint32_t now_ms)
{
    if (store->pausing && pdcp_time_reached(now_ms, store->pause_ms)) {
        store->pausing = false;
    }
    if (!store->changed) {
        return;
    }
    const int8_t status = arb_nvm_poll(store->nvm, ARB_NVM_STORE, &store->due_ms, now_ms);
    if (status > 0) {
        return;
    }
    if (status == 0 && store->copy.written == arb_record_length(&store_record, bind->remembered_count)) {
        arb_record_written(&store->newest);
        store->changed = false;
        store->pausing = true;
        store->pause_ms = now_ms + ARB_STORE_PAUSE_MS;
        arb_nvm_give(store->nvm, ARB_NVM_STORE);
    } else if ((status < 0 && store->copy.written != 0) ||
               !arb_record_write(&store_record, store->nvm, &store->newest, bind->remembered_count, bind,
                                 &store->copy)) {
        store->failures++;
        arb_store_touch(store, now_ms);
    }
}
