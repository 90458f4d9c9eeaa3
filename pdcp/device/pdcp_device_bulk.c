#include "pdcp_device_bulk.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_device_param.h"
#include "pdcp_device_tx.h"
#include "pdcp_time.h"

static uint8_t packet_len(const pdcp_device_bulk_t *bulk)
{
    const uint16_t left = (uint16_t)(bulk->size - bulk->done);
    return (uint8_t)(left < PDCP_BULK_PACKET_MAX ? left : PDCP_BULK_PACKET_MAX);
}

static void send_packet(pdcp_device_t *dev, uint32_t now_ms)
{
    pdcp_device_bulk_t *bulk = &dev->bulk;
    pdcp_msg_t packet = {.code = PDCP_BULK_DATA, .packet_id = bulk->packet_id, .len = packet_len(bulk)};
    memcpy(packet.value, &bulk->bytes[bulk->done], packet.len);
    pdcp_device_tx_msg(dev, &packet);
    bulk->tries++;
    bulk->deadline_ms = now_ms + dev->ack_ms;
}

static void answer_configure(pdcp_device_t *dev, const pdcp_msg_t *request, uint8_t result, uint16_t size)
{
    pdcp_msg_t answer = *request;
    answer.word = size;
    pdcp_device_tx_answer(dev, &answer, result);
}

void pdcp_device_bulk_on_get(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    pdcp_device_bulk_t *bulk = &dev->bulk;
    pdcp_device_value_t value;
    if (!pdcp_device_param_get(dev, msg->param, msg->channel, &value)) {
        bulk->mode = PDCP_DEVICE_BULK_REFUSED;
        answer_configure(dev, msg, PDCP_FAILURE, 0);
        return;
    }
    memset(bulk, 0, sizeof *bulk);
    bulk->param = msg->param;
    bulk->channel = msg->channel;
    bulk->size = value.len;
    bulk->bytes = value.bytes;
    if (value.bytes == value.small) {
        memcpy(bulk->small, value.small, sizeof bulk->small);
        bulk->bytes = bulk->small;
    }
    answer_configure(dev, msg, PDCP_SUCCESS, bulk->size);
    if (bulk->size != 0) {
        bulk->mode = PDCP_DEVICE_BULK_GET;
        send_packet(dev, now_ms);
    }
}

void pdcp_device_bulk_on_ack(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    pdcp_device_bulk_t *bulk = &dev->bulk;
    if (bulk->mode != PDCP_DEVICE_BULK_GET) {
        dev->stats.drop_late++;
        return;
    }
    if (msg->result != PDCP_SUCCESS) { /* the arbitrator starts again with its configure frame */
        bulk->mode = PDCP_DEVICE_BULK_IDLE;
        dev->stats.bulk_failed++;
        return;
    }
    bulk->done = (uint16_t)(bulk->done + packet_len(bulk));
    bulk->packet_id++; /* from 255 to 0 (D-BUS-9) */
    bulk->tries = 0;
    if (bulk->done == bulk->size) {
        bulk->mode = PDCP_DEVICE_BULK_IDLE;
    } else {
        send_packet(dev, now_ms);
    }
}

uint32_t pdcp_device_bulk_step(pdcp_device_t *dev, uint32_t now_ms)
{
    pdcp_device_bulk_t *bulk = &dev->bulk;
    if (bulk->mode == PDCP_DEVICE_BULK_GET && pdcp_time_reached(now_ms, bulk->deadline_ms)) {
        if (bulk->tries < PDCP_TRIES) {
            send_packet(dev, now_ms);
        } else {
            bulk->mode = PDCP_DEVICE_BULK_IDLE;
            dev->stats.bulk_failed++;
        }
    }
    return bulk->mode == PDCP_DEVICE_BULK_GET ? bulk->deadline_ms : now_ms + PDCP_TIME_FAR_MS;
}

/* Whether a value of this size can be gathered and written. An empty one has no packets and is written at
 * once. */
static bool may_begin_set(pdcp_device_t *dev, const pdcp_msg_t *msg)
{
    if (msg->word == 0) {
        return pdcp_device_param_set(dev, msg->param, msg->channel, NULL, 0);
    }
    return dev->desc->bulk != NULL && msg->word <= dev->desc->bulk_capacity &&
           msg->word <= pdcp_device_param_capacity(dev, msg->param, msg->channel);
}

void pdcp_device_bulk_on_set(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    (void)now_ms;
    pdcp_device_bulk_t *bulk = &dev->bulk;
    const bool good = may_begin_set(dev, msg);
    memset(bulk, 0, sizeof *bulk);
    bulk->mode = PDCP_DEVICE_BULK_REFUSED;
    if (good && msg->word != 0) {
        bulk->mode = PDCP_DEVICE_BULK_SET;
    }
    bulk->param = msg->param;
    bulk->channel = msg->channel;
    bulk->size = msg->word;
    answer_configure(dev, msg, good ? PDCP_SUCCESS : PDCP_FAILURE, msg->word);
}

/* The packet before the expected one: its acknowledgement was lost. */
static bool is_repeated(const pdcp_device_bulk_t *bulk, const pdcp_msg_t *msg)
{
    return (bulk->mode == PDCP_DEVICE_BULK_SET || bulk->mode == PDCP_DEVICE_BULK_STORED) && bulk->done != 0 &&
           msg->packet_id == (uint8_t)(bulk->packet_id - 1u);
}

static bool take_packet(pdcp_device_t *dev, const pdcp_msg_t *msg)
{
    pdcp_device_bulk_t *bulk = &dev->bulk;
    if (bulk->mode != PDCP_DEVICE_BULK_SET || msg->packet_id != bulk->packet_id ||
        msg->len > (uint16_t)(bulk->size - bulk->done)) {
        return false;
    }
    memcpy(&dev->desc->bulk[bulk->done], msg->value, msg->len);
    bulk->done = (uint16_t)(bulk->done + msg->len);
    bulk->packet_id++;
    if (bulk->done < bulk->size) {
        return true;
    }
    bulk->mode = PDCP_DEVICE_BULK_STORED;
    return pdcp_device_param_set(dev, bulk->param, bulk->channel, dev->desc->bulk, bulk->size);
}

void pdcp_device_bulk_on_packet(pdcp_device_t *dev, uint32_t now_ms, const pdcp_msg_t *msg)
{
    (void)now_ms;
    const bool good = is_repeated(&dev->bulk, msg) || take_packet(dev, msg);
    if (!good) {
        if (dev->bulk.mode != PDCP_DEVICE_BULK_REFUSED) {
            dev->stats.bulk_failed++;
        }
        dev->bulk.mode = PDCP_DEVICE_BULK_REFUSED;
    }
    pdcp_device_tx_answer(dev, msg, good ? PDCP_SUCCESS : PDCP_FAILURE);
}
