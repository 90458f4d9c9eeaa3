#include "pdcp_device_bind.h"

#include "pdcp_device_tx.h"
#include "pdcp_time.h"

enum { SUGGESTIONS_MAX = 8 }; /* in a row; then the retry timer decides, so that no quarrel fills the bus */

void pdcp_device_bind_seed(pdcp_device_t *dev, uint32_t seed)
{
    const pdcp_identity_t *identity = &dev->desc->identity;
    uint32_t x = seed ^ 0x9E3779B9uL;
    x = (x ^ identity->vid) * 0x85EBCA6BuL;
    x = (x ^ (x >> 15) ^ identity->pid) * 0xC2B2AE35uL;
    x = (x ^ (x >> 13) ^ identity->sn) * 0x85EBCA6BuL;
    x ^= x >> 16;
    dev->random = x != 0 ? x : 1;
}

/* xorshift, never 0. */
static uint32_t next_random(pdcp_device_t *dev)
{
    uint32_t x = dev->random;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    dev->random = x;
    return x;
}

static void ask_for(pdcp_device_t *dev, uint32_t now_ms, uint8_t id)
{
    const pdcp_msg_t request = {.code = PDCP_BIND_DEVICE, .identity = dev->desc->identity};
    can_frame_t frame;
    dev->node_id = id;
    pdcp_codec_encode(pdcp_can_id(PDCP_PRIORITY_BINDING, false, id), &request, &frame);
    if (pdcp_device_tx_frame(dev, &frame)) {
        dev->stats.bind_requests++;
    }
    dev->bind_deadline_ms = now_ms + dev->bind_pause_ms + next_random(dev) % (dev->bind_pause_ms / 4 + 1);
}

/* Asks for the last id, or for a random one, with longer and longer pauses (D-BUS-16). */
static void ask_again(pdcp_device_t *dev, uint32_t now_ms)
{
    const uint8_t random_id = (uint8_t)(PDCP_NODE_MIN + next_random(dev) % PDCP_NODE_MAX);
    const uint32_t longest_ms =
        dev->bind_ms > PDCP_DEVICE_BIND_MAX_MS ? dev->bind_ms : PDCP_DEVICE_BIND_MAX_MS;
    dev->suggestions = 0;
    ask_for(dev, now_ms, dev->record.node_id != 0 ? dev->record.node_id : random_id);
    dev->bind_pause_ms = dev->bind_pause_ms * 2 < longest_ms ? dev->bind_pause_ms * 2 : longest_ms;
}

void pdcp_device_bind_start(pdcp_device_t *dev, uint32_t now_ms)
{
    dev->node_id = 0; /* no id has been asked for yet */
    dev->bind_pause_ms = dev->bind_ms;
    dev->bind_deadline_ms = now_ms;
}

uint32_t pdcp_device_bind_step(pdcp_device_t *dev, uint32_t now_ms)
{
    if (pdcp_time_reached(now_ms, dev->bind_deadline_ms)) {
        if (dev->node_id != 0) {
            pdcp_txq_init(&dev->txq); /* a request that still waits asks for an id that is no longer wanted */
        }
        ask_again(dev, now_ms);
    }
    return dev->bind_deadline_ms;
}

/* The answer is ours only if identity and requested id are (D-BUS-6). */
bool pdcp_device_bind_on_answer(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    if (!pdcp_identity_equal(&msg->identity, &dev->desc->identity)) {
        dev->stats.drop_bind++;
        return false;
    }
    if (msg->node_id == dev->node_id) {
        return true;
    }
    if (msg->node_id == PDCP_NODE_REFUSED) {
        /* No answer is awaited any more: a grant would be for a twin with this identity (D-BUS-56). */
        dev->node_id = 0;
        dev->stats.bind_refused++;
    } else if (!pdcp_device_bind_is_id(msg->node_id) || dev->suggestions >= SUGGESTIONS_MAX) {
        dev->stats.drop_bind++;
    } else {
        dev->suggestions++;
        dev->bind_pause_ms = dev->bind_ms;
        pdcp_txq_init(&dev->txq);
        ask_for(dev, now_ms, msg->node_id);
    }
    return false;
}
