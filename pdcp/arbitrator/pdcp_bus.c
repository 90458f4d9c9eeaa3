#include "pdcp_bus.h"

#include "pdcp_assert.h"

pdcp_device_entry_t *pdcp_bus_device(pdcp_bus_t *bus, uint8_t place)
{
    pdcp_assert(place < PDCP_DEVICES_MAX, "pdcp_bus.h: the place is a device's");
    return &bus->tables.devices[place];
}

uint32_t pdcp_bus_age_ms(const pdcp_bus_t *bus)
{
    const uint32_t age_ms = bus->now_ms - bus->started_ms;
    return age_ms < PDCP_AGE_MAX_MS ? age_ms : PDCP_AGE_MAX_MS;
}

void pdcp_bus_wake(pdcp_bus_t *bus, uint8_t timer, uint16_t in_ms)
{
    pdcp_timers_set(&bus->timers, timer, bus->now_ms + in_ms);
}

bool pdcp_bus_send_frame(pdcp_bus_t *bus, const can_frame_t *frame)
{
    const pdcp_txq_put_t put = pdcp_txq_put(&bus->txq, frame);
    if (put != PDCP_TXQ_TAKEN) {
        pdcp_bus_count(bus, PDCP_STAT_TX_FULL);
    }
    return put != PDCP_TXQ_FULL;
}

bool pdcp_bus_send(pdcp_bus_t *bus, uint8_t priority, uint8_t node_id, const pdcp_msg_t *msg)
{
    can_frame_t frame;
    pdcp_codec_encode(pdcp_can_id(priority, true, node_id), msg, &frame);
    return pdcp_bus_send_frame(bus, &frame);
}

bool pdcp_bus_send_word(pdcp_bus_t *bus, uint8_t priority, uint8_t node_id, uint8_t code, uint16_t word)
{
    const pdcp_msg_t msg = {.code = code, .word = word};
    return pdcp_bus_send(bus, priority, node_id, &msg);
}

static void tell(const pdcp_bus_t *bus, pdcp_event_kind_t kind, uint8_t place, uint8_t channel,
                 pdcp_status_t status)
{
    const pdcp_event_t event = {.kind = kind, .place = place, .channel = channel, .status = (int8_t)status};
    bus->on_event(bus->event_ctx, bus->now_ms, &event);
}

void pdcp_bus_tell(const pdcp_bus_t *bus, pdcp_event_kind_t kind, uint8_t place, pdcp_status_t status)
{
    tell(bus, kind, place, PDCP_NONE, status);
}

void pdcp_bus_tell_link(const pdcp_bus_t *bus, pdcp_event_kind_t kind, uint8_t input, pdcp_status_t status)
{
    tell(bus, kind, PDCP_NONE, input, status);
}

void pdcp_bus_count(pdcp_bus_t *bus, pdcp_stat_t stat)
{
    bus->stats[stat]++;
}

void pdcp_bus_tell_device(pdcp_bus_t *bus, pdcp_event_kind_t kind, uint8_t place)
{
    pdcp_bus_tell(bus, kind, place, PDCP_OK);
}
