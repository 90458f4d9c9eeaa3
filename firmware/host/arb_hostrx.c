#include "arb_hostrx.h"

#include <string.h>

#include "pdcp_bytes.h"
#include "pdcp_time.h"

static void count(arb_hostrx_t *rx, arb_hostrx_counter_t counter)
{
    rx->counters[counter]++;
}

/* Bytes like FE 19, or FE as the last one, are where a message may begin. Returns the next such place from at
 * on; rx->len: there is none. */
static uint16_t next_sync(const arb_hostrx_t *rx, uint16_t at)
{
    for (; at < rx->len; at++) {
        const uint8_t *bytes = &rx->bytes[at];
        if (bytes[0] == ARB_HOST_SYNC1 && (at + 1u == rx->len || bytes[1] == ARB_HOST_SYNC2)) {
            break;
        }
    }
    return at;
}

/* Drops what was taken, and goes on to the next place, at from or behind it, where a message may begin
 * (D-API-2). */
static void hunt(arb_hostrx_t *rx, uint16_t from)
{
    const uint16_t at = next_sync(rx, from);
    if (at != 0) {
        rx->counters[ARB_HOSTRX_GARBAGE] += (uint16_t)(at - rx->taken);
        rx->len = (uint16_t)(rx->len - at);
        memmove(rx->bytes, &rx->bytes[at], rx->len);
        rx->taken = 0;
    }
}

void arb_hostrx_put(arb_hostrx_t *rx, uint32_t now_ms, uint8_t byte)
{
    rx->bytes[rx->len++] = byte;
    rx->last_ms = now_ms;
    rx->overdue = false;
}

void arb_hostrx_clear(arb_hostrx_t *rx)
{
    hunt(rx, rx->len);
}

static bool crc8_matches(const uint8_t *header)
{
    return header[5] == arb_hostcodec_crc8(header);
}

/* Bytes of the message at the front, as its header says. */
static uint16_t front_total(const arb_hostrx_t *rx)
{
    return (uint16_t)(ARB_HOST_HEADER + pdcp_bytes_get_u16(&rx->bytes[6]));
}

void arb_hostrx_on_time(arb_hostrx_t *rx, uint32_t now_ms)
{
    rx->overdue = pdcp_time_reached(now_ms, rx->last_ms + ARB_HOSTRX_TIMEOUT_MS);
}

/* What stands at the front? */
typedef enum {
    FRONT_OPEN, /* the next bytes have to tell */
    FRONT_MESSAGE,
    FRONT_TOO_LONG, /* a header whose size cannot be, of a set request that gets an answer (D-API-7) */
    FRONT_NOTHING
} front_t;

/* The message at the front, of total bytes, has a wrong checksum. Nothing: another message begins inside, a
 * header with a right checksum, whose end may stand behind total. Open: the beginning of one, and it is not
 * all here yet (D-API-8). */
static front_t look_inside(const arb_hostrx_t *rx, uint16_t total)
{
    for (uint16_t at = next_sync(rx, 1); at < total; at = next_sync(rx, (uint16_t)(at + 1u))) {
        if (rx->len - at < ARB_HOST_HEADER) {
            return rx->overdue ? FRONT_MESSAGE : FRONT_OPEN;
        }
        if (crc8_matches(&rx->bytes[at])) {
            return FRONT_NOTHING;
        }
    }
    return FRONT_MESSAGE;
}

static bool crc16_matches(const uint8_t *payload, uint16_t len)
{
    return len == 0 || pdcp_bytes_get_u16(&payload[len]) == arb_hostcodec_crc16(payload, len);
}

/* All of the message at the front is here. */
static front_t check(arb_hostrx_t *rx, arb_hostrx_request_t *request)
{
    const bool crc8_ok = crc8_matches(rx->bytes);
    if (crc8_ok && crc16_matches(&rx->bytes[ARB_HOST_HEADER], request->len)) {
        return FRONT_MESSAGE;
    }
    const front_t front = look_inside(rx, front_total(rx));
    if (front != FRONT_OPEN) {
        count(rx, crc8_ok ? ARB_HOSTRX_BAD_CRC16S : ARB_HOSTRX_BAD_CRC8S);
    }
    request->error = ARB_ERR_CRC;
    return front;
}

/* Fills in the request as far as it is here. */
static front_t look_at_front(arb_hostrx_t *rx, arb_hostrx_request_t *request)
{
    const uint8_t *bytes = rx->bytes;
    if (rx->len < ARB_HOST_HEADER) {
        return FRONT_OPEN;
    }
    const uint16_t size = pdcp_bytes_get_u16(&bytes[6]);
    request->id = pdcp_bytes_get_u16(&bytes[2]);
    request->reference = bytes[4];
    request->len = 0;
    request->error = ARB_OK;
    if (size != 0 && (size <= ARB_HOST_CRC || size > ARB_HOST_REQUEST_MAX + ARB_HOST_CRC)) {
        count(rx, ARB_HOSTRX_BAD_SIZES);
        request->error = ARB_ERR_SIZE;
        return request->id == ARB_MSG_SET_PARAMETER && size > ARB_HOST_CRC && crc8_matches(bytes)
                   ? FRONT_TOO_LONG
                   : FRONT_NOTHING;
    }
    if (size != 0) {
        request->len = (uint16_t)(size - ARB_HOST_CRC);
    }
    return rx->len < ARB_HOST_HEADER + size ? FRONT_OPEN : check(rx, request);
}

/* A header that is wrong, or whose message is overdue, is dropped, and the hunt goes on behind its first byte
 * (D-API-2). */
bool arb_hostrx_next(arb_hostrx_t *rx, arb_hostrx_request_t *request)
{
    hunt(rx, rx->taken);
    while (rx->len != 0) {
        const front_t front = look_at_front(rx, request);
        if (front == FRONT_MESSAGE) {
            rx->taken = front_total(rx);
            return true;
        }
        if (front == FRONT_OPEN) {
            if (!rx->overdue) {
                return false;
            }
            count(rx, ARB_HOSTRX_GIVEN_UP);
        }
        hunt(rx, 1);
        if (front == FRONT_TOO_LONG) {
            return true;
        }
    }
    return false;
}
