#include "life.h"

static uint32_t chance(life_forger_t *forger, uint32_t below)
{
    return life_random(forger->random, below);
}

static void send(life_forger_t *forger, uint16_t id, const uint8_t *data, uint8_t len)
{
    can_frame_t frame = {.id = id, .dlc = len};
    for (uint8_t i = 0; i < len; i++) {
        frame.data[i] = data[i];
    }
    (void)sim_bus_send(&forger->limb->world.bus, forger->port, &frame);
}

static const pdcp_device_t *device_of(const life_forger_t *forger, int part)
{
    return sim_node_device(forger->limb->parts[part].node);
}

/* A request to a part, as only its arbitrator may send it. */
static void request(life_forger_t *forger, int part, const uint8_t *data, uint8_t len)
{
    const uint8_t id = pdcp_device_node_id(device_of(forger, part));
    send(forger, pdcp_can_id(PDCP_PRIORITY_NORMAL, true, id), data, len);
}

/* A part that is plugged in, and one of its channels. False: this time there is none. */
static bool pick(life_forger_t *forger, int *part, uint8_t *channel)
{
    *part = (int)chance(forger, (uint32_t)forger->limb->count);
    const limb_part_t *each = &forger->limb->parts[*part];
    const uint8_t count = each->ini->desc.channel_count;
    *channel = count != 0 ? (uint8_t)(1 + chance(forger, count)) : 0;
    return each->node != NULL && count != 0;
}

void life_forge_flag(life_forger_t *forger)
{
    int part;
    uint8_t channel;
    if (pick(forger, &part, &channel)) {
        const uint8_t data[] = {PDCP_SET_PARAMETER, PDCP_CH_ENABLED, channel, 0};
        request(forger, part, data, sizeof data);
    }
}

/* An input is to hear some channel of another part. */
void life_forge_source(life_forger_t *forger, uint32_t now_ms)
{
    int part;
    int other;
    uint8_t input;
    uint8_t output;
    if (pick(forger, &part, &input) && pick(forger, &other, &output) && part != other &&
        forger->limb->parts[part].ini->desc.channels[input - 1].direction == PDCP_INPUT) {
        const pdcp_device_t *source = device_of(forger, other);
        const uint8_t data[] = {PDCP_SET_PARAMETER, PDCP_IN_SOURCE_NODES, input, pdcp_device_node_id(source),
                                pdcp_device_channel(source, output)->node_id};
        forger->watch->forged_ms[part][input] = now_ms + LIFE_AUDIT_MS;
        request(forger, part, data, sizeof data);
    }
}

void life_forge_suspend(life_forger_t *forger)
{
    static const uint8_t data[] = {PDCP_SUSPEND, 0, 0}; /* until it is released */
    int part;
    uint8_t channel;
    if (pick(forger, &part, &channel)) {
        request(forger, part, data, sizeof data);
    }
}

void life_forge_reset(life_forger_t *forger)
{
    static const uint8_t data[] = {PDCP_RESET};
    int part;
    uint8_t channel;
    if (pick(forger, &part, &channel)) {
        request(forger, part, data, sizeof data);
    }
}

/* Does a part have this id, or does one of its outputs, or does an input listen to it? */
static bool is_in_use(const life_forger_t *forger, uint8_t id)
{
    for (int part = 0; part < forger->limb->count; part++) {
        const limb_part_t *each = &forger->limb->parts[part];
        for (uint8_t i = 1; each->node != NULL && i <= each->ini->desc.channel_count; i++) {
            const pdcp_device_channel_t *channel = pdcp_device_channel(device_of(forger, part), i);
            if (channel->node_id == id || channel->source_channel == id) {
                return true;
            }
        }
        if (each->node != NULL && pdcp_device_node_id(device_of(forger, part)) == id) {
            return true;
        }
    }
    return false;
}

void life_forge_unknown(life_forger_t *forger)
{
    static const uint8_t data[] = {PDCP_BEACON};
    const uint8_t id = (uint8_t)(PDCP_NODE_MIN + chance(forger, PDCP_NODE_MAX));
    if (!is_in_use(forger, id)) {
        send(forger, pdcp_can_id(PDCP_PRIORITY_HIGH, false, id), data, sizeof data);
    }
}

void life_forge_arbitrator(life_forger_t *forger)
{
    static const uint8_t data[] = {PDCP_BEACON};
    send(forger, pdcp_can_id(PDCP_PRIORITY_HIGH, true, PDCP_NODE_BROADCAST), data, sizeof data);
}
