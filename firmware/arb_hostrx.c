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
    if (rx->len <= 2) {
        hunt(rx, 0);
    }
}

void arb_hostrx_on_time(arb_hostrx_t *rx, uint32_t now_ms)
{
    drop_taken(rx);
    if (rx->len != 0 && pdcp_time_reached(now_ms, rx->last_ms + ARB_HOSTRX_TIMEOUT_MS)) {
        rx->given_up++;
        hunt(rx, 1);
    }
}

/* Are the checksums of the message at the front right? */
static bool checksums_match(const arb_hostrx_t *rx, const arb_host_header_t *header)
{
    if (header->crc8 != arb_host_crc8(rx->bytes)) {
        return false;
    }
    const uint16_t payload = (uint16_t)(header->size - ARB_HOST_CRC);
    return header->size == 0 || arb_host_get_u16(&rx->bytes[ARB_HOST_HEADER + payload]) ==
                                    arb_host_crc16(&rx->bytes[ARB_HOST_HEADER], payload);
}

/* Does the message at the front, of total bytes, have a header with a right checksum inside? The rest of that
 * one may still be on its way. */
static bool holds_header(const arb_hostrx_t *rx, uint16_t total)
{
    for (uint16_t at = 1; at + ARB_HOST_HEADER <= total; at++) {
        const uint8_t *bytes = &rx->bytes[at];
        if (bytes[0] == ARB_HOST_SYNC1 && bytes[1] == ARB_HOST_SYNC2 && bytes[5] == arb_host_crc8(bytes)) {
            return true;
        }
    }
    return false;
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
            rx->bad_crcs++;
            if (holds_header(rx, total)) {
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
