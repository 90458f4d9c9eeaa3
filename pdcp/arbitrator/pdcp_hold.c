#include "pdcp_hold.h"

#include "pdcp_life.h"
#include "pdcp_standby.h"

/* Has it granted an id to a device (D-BUS-42)? One that is lost counts (D-BUS-50). */
bool pdcp_hold_has_own(const pdcp_arb_t *arb)
{
    return pdcp_tables_count_state(&arb->bus.tables, PDCP_PLACE_FREE) +
               pdcp_tables_count_state(&arb->bus.tables, PDCP_PLACE_ASKED) !=
           PDCP_DEVICES_MAX;
}

static uint16_t own_hold_ms(const pdcp_arb_t *arb)
{
    return (uint16_t)(PDCP_HOLD_MS + arb->serial % PDCP_HOLD_SPREAD_MS);
}

/* How much longer the answer to a bind request is held that came now: another arbitrator may be there and
 * answer it (D-BUS-42). */
static uint16_t hold_ms(const pdcp_arb_t *arb)
{
    const uint16_t own_ms = own_hold_ms(arb);
    const uint32_t heard_ms = arb->bus.now_ms - arb->standby.since_ms;
    const bool waits = pdcp_standby_is_heard(&arb->standby, arb->bus.now_ms) && !arb->standby.doubted;
    return waits && heard_ms < PDCP_HOLD_FOREIGN_MS ? (uint16_t)(own_ms + PDCP_HOLD_FOREIGN_MS - heard_ms)
                                                    : own_ms;
}

/* Place of the identity whose request is held; PDCP_NONE: it is not. */
uint8_t pdcp_hold_place(const pdcp_arb_t *arb, const pdcp_identity_t *identity)
{
    const uint8_t place = pdcp_tables_find(&arb->bus.tables, identity);
    return place != PDCP_NONE && arb->bus.tables.devices[place].state == PDCP_PLACE_ASKED
               ? place
               : (uint8_t)PDCP_NONE;
}

void pdcp_hold_drop(pdcp_arb_t *arb, uint8_t place)
{
    pdcp_timers_cancel(&arb->bus.timers, (uint8_t)(PDCP_TIMER_LIFE + place));
    pdcp_tables_remove(&arb->bus.tables, place);
}

static void bind(pdcp_arb_t *arb, const pdcp_identity_t *identity, uint8_t asked)
{
    uint8_t place;
    const pdcp_bind_result_t result = pdcp_bind_on_request(&arb->bus, identity, asked, &place);
    pdcp_life_after_bind(arb, place, result);
    if (place != PDCP_NONE) {
        pdcp_life_serve(arb, place);
    }
}

/* An arbitrator without devices of its own lets another one go first. Without a place the device asks
 * again. */
static void hold(pdcp_arb_t *arb, const pdcp_identity_t *identity, uint8_t asked)
{
    const uint8_t place = pdcp_tables_free_place(&arb->bus.tables);
    if (place == PDCP_NONE) {
        pdcp_bus_count(&arb->bus, PDCP_STAT_NO_ROOM);
        return;
    }
    pdcp_tables_hold(&arb->bus.tables, place, identity);
    pdcp_arb_device(arb, place)->asked_id = asked;
    pdcp_life_set(arb, place, hold_ms(arb));
}

/* Nobody else has answered the request that is held. Of many that came together a few are set up at once, the
 * others follow one by one: they would only wait for each other (D-BUS-49). */
void pdcp_hold_on_deadline(pdcp_arb_t *arb, uint8_t place)
{
    const pdcp_device_entry_t held = *pdcp_arb_device(arb, place);
    arb->held_ms = own_hold_ms(arb);
    pdcp_hold_drop(arb, place);
    bind(arb, &held.identity, held.asked_id);
    if (pdcp_tables_count_state(&arb->bus.tables, PDCP_PLACE_SETUP) < PDCP_HOLD_SETUPS) {
        return;
    }
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++) {
        if (pdcp_arb_device(arb, i)->state == PDCP_PLACE_ASKED) {
            pdcp_life_set(arb, i, PDCP_HOLD_PACE_MS);
        }
    }
}

void pdcp_hold_on_frame(pdcp_arb_t *arb, const can_frame_t *frame)
{
    pdcp_msg_t msg;
    const pdcp_decode_t decoded = pdcp_codec_decode(frame, &msg);
    if (msg.code != PDCP_BIND_DEVICE) {
        pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_BINDING);
        return;
    }
    if (decoded != PDCP_DECODE_OK) {
        pdcp_bus_count(&arb->bus, PDCP_STAT_DROP_BAD_DLC);
        return;
    }
    pdcp_bus_count(&arb->bus, PDCP_STAT_TAKEN);
    arb->asked_ms = arb->bus.now_ms;
    const uint8_t place = pdcp_hold_place(arb, &msg.identity);
    if (place != PDCP_NONE) { /* the newer request replaces the older one */
        pdcp_hold_drop(arb, place);
    }
    if (pdcp_hold_has_own(arb)) {
        bind(arb, &msg.identity, pdcp_id_node(frame->id));
    } else {
        hold(arb, &msg.identity, pdcp_id_node(frame->id));
    }
}
