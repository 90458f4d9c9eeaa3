#include "arb_hostrx.h"

#include <string.h>

#include "pdcp_time.h"

void arb_hostrx_init(arb_hostrx_t *rx)
{
    memset(rx, 0, sizeof *rx);
}

static void drop(arb_hostrx_t *rx, uint16_t count)
{
    rx->len = (uint16_t)(rx->len - count);
    memmove(rx->bytes, &rx->bytes[count], rx->len);
}

/* Gives the first count bytes up and goes to the next place where a message may begin. */
static void hunt(arb_hostrx_t *rx, uint16_t count)
{
    while (count < rx->len) {
        const bool sync1 = rx->bytes[count] == ARB_HOST_SYNC1;
        const bool last = count + 1u == rx->len;
        if (sync1 && (last || rx->bytes[count + 1u] == ARB_HOST_SYNC2)) {
            break;
        }
        count++;
    }
    rx->garbage += count;
    drop(rx, count);
}

static void drop_taken(arb_hostrx_t *rx)
{
    if (rx->taken != 0) {
        drop(rx, rx->taken);
        rx->taken = 0;
        hunt(rx, 0);
    }
}

void arb_hostrx_put(arb_hostrx_t *rx, uint32_t now_ms, uint8_t byte)
{
    drop_taken(rx);
    rx->bytes[rx->len++] = byte;
    rx->last_ms = now_ms;
    rx->overdue = false;
    if (rx->len <= 2) {
        hunt(rx, 0);
    }
}

void arb_hostrx_clear(arb_hostrx_t *rx)
{
    drop_taken(rx);
    rx->garbage += rx->len;
    rx->len = 0;
}

static bool crc8_matches(const arb_hostrx_t *rx, const arb_host_header_t *header)
{
    return header->crc8 == arb_host_crc8(rx->bytes);
}

/* Are the checksums of the message at the front right? */
static bool checksums_match(const arb_hostrx_t *rx, const arb_host_header_t *header)
{
    const uint16_t payload = (uint16_t)(header->size - ARB_HOST_CRC);
    return crc8_matches(rx, header) &&
           (header->size == 0 || arb_host_get_u16(&rx->bytes[ARB_HOST_HEADER + payload]) ==
                                     arb_host_crc16(&rx->bytes[ARB_HOST_HEADER], payload));
}

typedef enum { INSIDE_NOTHING, INSIDE_HEADER, INSIDE_DOUBTFUL } inside_t;

/* Does another message begin inside the one at the front, of total bytes: a header with a right checksum,
 * whose end may stand behind total? Doubtful: there is the beginning of one, and it is not all here yet. */
static inside_t look_inside(const arb_hostrx_t *rx, uint16_t total)
{
    for (uint16_t at = 1; at < total; at++) {
        const uint8_t *bytes = &rx->bytes[at];
        const uint16_t left = (uint16_t)(rx->len - at);
        if (bytes[0] != ARB_HOST_SYNC1 || (left > 1 && bytes[1] != ARB_HOST_SYNC2)) {
            continue;
        }
        if (left < ARB_HOST_HEADER) {
            return INSIDE_DOUBTFUL;
        }
        if (bytes[5] == arb_host_crc8(bytes)) {
            return INSIDE_HEADER;
        }
    }
    return INSIDE_NOTHING;
}

static bool size_is_possible(uint16_t size)
{
    return size == 0 || (size > ARB_HOST_CRC && size <= ARB_HOST_REQUEST_MAX + ARB_HOST_CRC);
}

/* A header whose size cannot be. True: it is a set request with too long a value, which gets an answer
 * (D-API-7). */
static bool give_up_size(arb_hostrx_t *rx, const arb_host_header_t *header, arb_hostrx_request_t *request)
{
    const bool too_long = header->id == ARB_MSG_SET_PARAMETER && header->size > ARB_HOST_CRC &&
                          header->crc8 == arb_host_crc8(rx->bytes);
    rx->bad_sizes++;
    hunt(rx, 1);
    request->too_long = too_long;
    request->crc_ok = true;
    return too_long;
}

static bool front_is_complete(const arb_hostrx_t *rx)
{
    arb_host_header_t header;
    if (rx->len < ARB_HOST_HEADER) {
        return false;
    }
    arb_host_decode_header(rx->bytes, &header);
    return size_is_possible(header.size) && rx->len - ARB_HOST_HEADER >= header.size;
}

void arb_hostrx_on_time(arb_hostrx_t *rx, uint32_t now_ms)
{
    drop_taken(rx);
    if (rx->len == 0 || !pdcp_time_reached(now_ms, rx->last_ms + ARB_HOSTRX_TIMEOUT_MS)) {
        return;
    }
    rx->overdue = true;
    if (!front_is_complete(rx)) {
        rx->given_up++;
        hunt(rx, 1);
    }
}

bool arb_hostrx_next(arb_hostrx_t *rx, arb_hostrx_request_t *request)
{
    drop_taken(rx);
    while (rx->len >= ARB_HOST_HEADER) {
        arb_host_header_t header;
        arb_host_decode_header(rx->bytes, &header);
        memset(request, 0, sizeof *request);
        request->id = header.id;
        request->reference = header.reference;
        if (!size_is_possible(header.size)) {
            if (give_up_size(rx, &header, request)) {
                return true;
            }
            continue;
        }
        const uint16_t total = (uint16_t)(ARB_HOST_HEADER + header.size);
        if (rx->len < total) {
            return false;
        }
        request->crc_ok = checksums_match(rx, &header);
        if (!request->crc_ok) {
            const inside_t inside = look_inside(rx, total);
            if (inside == INSIDE_DOUBTFUL && !rx->overdue) {
                return false;
            }
            (*(crc8_matches(rx, &header) ? &rx->bad_crc16s : &rx->bad_crc8s))++;
            if (inside == INSIDE_HEADER) {
                hunt(rx, 1);
                continue;
            }
        }
        request->payload = &rx->bytes[ARB_HOST_HEADER];
        request->len = header.size != 0 ? (uint16_t)(header.size - ARB_HOST_CRC) : 0;
        rx->taken = total;
        return true;
    }
    return false;
}
