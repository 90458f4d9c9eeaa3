/* A host that asks whatever can be asked, and knows what it may be answered (host-api.md, D-API-2 to
 * D-API-6). */
#include <stdio.h>
#include <string.h>

#include "arb_hostcodec.h"
#include "life.h"
#include "pdcp_bytes.h"
#include "unity.h"

enum {
    ANSWER_MS = 3000, /* D-API-3 */
    TABLES_MS = 60,   /* what is answered from the tables */
    SLACK_MS = 30,    /* a step of the world, and what the line holds */
    LINE_BYTES = 12,  /* a millisecond, 128000 baud */
    LINE_ROOM = 256,
    HELD_MAX = 4,     /* D-API-3 */
    HELD_BYTES = 592, /* D-API-9 */
    REQUEST_BYTES = 540,
    PATIENT = 2 /* requests under way, beyond which it most often waits */
};

void life_host_init(life_host_t *host, uint32_t seed)
{
    memset(host, 0, sizeof *host);
    host->random.state = seed * 2654435761u | 1u;
    host->is_open = true;
    host->reads = true;
    host->garbage_end = UINT32_MAX;
    host->babbled_ms = 0u - HELD_MAX * (uint32_t)ANSWER_MS;
}

static uint32_t chance(life_host_t *host, uint32_t below)
{
    return life_random(&host->random, below);
}

/* --- What is asked --- */

/* A device of the limb, most often one that is plugged in; now and then one that nobody has. */
static const pdcp_device_desc_t *put_device(life_host_t *host, const limb_t *limb, uint8_t bytes[6])
{
    const limb_part_t *part = NULL;
    for (int tries = 0; tries < 3 && (part == NULL || part->node == NULL); tries++) {
        part = &limb->parts[chance(host, (uint32_t)limb->count)];
    }
    const pdcp_device_desc_t *desc = &part->ini->desc;
    pdcp_bytes_put_identity(bytes, &desc->identity);
    if (life_chance(&host->random, 4)) {
        bytes[4] ^= 0x80;
    }
    return desc;
}

/* A channel of a device, most often one with the direction. */
static void put_channel(life_host_t *host, const limb_t *limb, uint8_t bytes[7], uint8_t direction)
{
    for (int tries = 0; tries < 6; tries++) {
        const pdcp_device_desc_t *desc = put_device(host, limb, bytes);
        bytes[6] = (uint8_t)(1 + chance(host, (uint32_t)desc->channel_count + 1u));
        if (bytes[6] <= desc->channel_count && desc->channels[bytes[6] - 1].direction == direction) {
            return;
        }
    }
}

static uint16_t ask_number(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    (void)limb;
    payload[0] = (uint8_t)chance(host, 12);
    return 1;
}

static uint16_t ask_nothing(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    (void)host;
    (void)limb;
    (void)payload;
    return 0;
}

static uint16_t ask_get(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    const pdcp_device_desc_t *desc = put_device(host, limb, payload);
    payload[6] = (uint8_t)chance(host, (uint32_t)desc->channel_count + 2u);
    payload[7] = (uint8_t)(1 + chance(host, 14));
    if (life_chance(&host->random, 20)) {
        payload[6] = 0;
        payload[7] = 241; /* a long one */
    }
    return 8;
}

/* What a host may write without harm: the device's own times, a long value, the source of an input, and what
 * is refused. */
static uint16_t ask_set(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    static const struct {
        uint8_t param;
        uint16_t low;
        uint16_t high;
    } words[] = {{10, 100, 1500}, {11, 20, 500}, {12, 100, 3000}, {7, 0, 1000}, {8, 0, 300}, {9, 0, 9}};
    const pdcp_device_desc_t *desc = put_device(host, limb, payload);
    if (life_chance(&host->random, 30)) {
        const uint16_t len = (uint16_t)(1 + chance(host, PDCP_PARAMETER_MAX));
        payload[6] = 0;
        payload[7] = 241;
        memset(&payload[8], 0x55, len);
        return (uint16_t)(8 + len);
    }
    if (life_chance(&host->random, 30)) {
        payload[6] = (uint8_t)(1 + chance(host, (uint32_t)desc->channel_count + 1u));
        payload[7] = (uint8_t)(5 + chance(host, 4));
        pdcp_bytes_put_u16(&payload[8], (uint16_t)(2 + chance(host, 3)));
        pdcp_bytes_put_u16(&payload[10], (uint16_t)(1 + chance(host, 3)));
        return 12;
    }
    const unsigned k = chance(host, sizeof words / sizeof words[0]);
    payload[6] = 0;
    payload[7] = words[k].param;
    pdcp_bytes_put_u16(&payload[8], (uint16_t)(words[k].low + chance(host, words[k].high - words[k].low)));
    return 10;
}

static uint16_t ask_link(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    put_channel(host, limb, &payload[0], PDCP_OUTPUT);
    put_channel(host, limb, &payload[7], PDCP_INPUT);
    return 14;
}

static uint16_t ask_passthrough(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    static const uint8_t frames[][9] = {{3, 0x03, 1, 0},
                                        {3, 0x03, 9, 0},
                                        {5, 0x04, 10, 0, 0xF4, 0x01},
                                        {3, 0x08, 0xE8, 0x03},
                                        {3, 0x08, 0, 0},
                                        {1, 0x09},
                                        {1, 0x0B},
                                        {1, 0x55},
                                        {7, 0x01, 2, 0, 2, 0, 4, 0},
                                        {4, 0x04, 8, 0, 0x11},
                                        {0, 0x09},
                                        {9, 0x09},
                                        {6, 0x04, 7, 1, 0x11, 9},
                                        {2, 0x0F, 1},
                                        {1, 0x84}};
    const uint8_t *frame = frames[chance(host, sizeof frames / sizeof frames[0])];
    (void)put_device(host, limb, payload);
    if (life_chance(&host->random, 20)) {
        memset(payload, 0, 6);
    }
    memset(&payload[6], 0, 9);
    memcpy(&payload[6], frame, 9);
    return 15;
}

static uint16_t ask_reset(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    payload[0] = (uint8_t)(life_chance(&host->random, 20) ? 0 : 1 + chance(host, (uint32_t)limb->count + 1u));
    return 1;
}

static uint16_t ask_flags(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    (void)limb;
    payload[0] = (uint8_t)(life_chance(&host->random, 50) ? 3 : chance(host, 40));
    return 1;
}

static uint16_t ask_action(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    (void)limb;
    payload[0] = (uint8_t)chance(host, 10);
    payload[1] = (uint8_t)(life_chance(&host->random, 40) ? 0 : chance(host, 4));
    return 2;
}

static uint16_t ask_read(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    (void)limb;
    pdcp_bytes_put_u16(payload, (uint16_t)chance(host, 1200));
    payload[2] = (uint8_t)chance(host, 132);
    return 3;
}

static uint16_t ask_remove(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    put_channel(host, limb, payload, PDCP_INPUT);
    return 7;
}

static uint16_t ask_statistics(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    (void)limb;
    payload[0] = (uint8_t)chance(host, 4);
    return 1;
}

static uint16_t ask_stream(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    (void)limb;
    const bool is_wide = life_chance(&host->random, 50);
    uint16_t mask = (uint16_t)(life_chance(&host->random, 30) ? 0 : chance(host, 66));
    if (is_wide && life_chance(&host->random, 80)) {
        mask |= 0x100;
    }
    pdcp_bytes_put_u16(payload, mask);
    return is_wide ? 2 : 1;
}

/* --- A string of configurations, in pieces --- */

static void put_entry(life_host_t *host, uint8_t code, uint16_t value)
{
    host->string[host->string_len] = code;
    pdcp_bytes_put_u16(&host->string[host->string_len + 1], value);
    host->string_len = (uint16_t)(host->string_len + 3);
}

static void put_end(life_host_t *host, const limb_t *limb, uint8_t direction)
{
    uint8_t bytes[7];
    put_channel(host, limb, bytes, direction);
    const pdcp_identity_t owner = pdcp_bytes_get_identity(bytes);
    put_entry(host, direction == PDCP_INPUT ? 5 : 6, 0);
    put_entry(host, 7, (uint16_t)(life_chance(&host->random, 50) ? 0x5200 : 0x5000));
    put_entry(host, 8, (uint16_t)((1 + chance(host, 2)) << 12 | (1 + chance(host, 2)) << 8));
    put_entry(host, 9, bytes[6]);
    if (life_chance(&host->random, 20)) {
        put_entry(host, 77, 7); /* of a later version */
    }
    put_entry(host, 10, owner.vid);
    put_entry(host, 11, owner.pid);
    put_entry(host, 12, owner.sn);
}

static void put_configuration(life_host_t *host, const limb_t *limb, uint16_t number)
{
    const unsigned links = chance(host, 6);
    put_entry(host, 2, number);
    put_entry(host, 3, (uint16_t)links);
    for (unsigned k = 1; k <= links; k++) {
        const bool swapped = life_chance(&host->random, 30);
        put_entry(host, 4, (uint16_t)k);
        put_end(host, limb, swapped ? PDCP_OUTPUT : PDCP_INPUT);
        put_end(host, limb, swapped ? PDCP_INPUT : PDCP_OUTPUT);
    }
}

/* A fault that a reader must find; at an entry's first byte. */
static void spoil(life_host_t *host)
{
    switch (chance(host, 3)) {
    case 0:
        host->string_len = (uint16_t)(host->string_len - 3); /* no end */
        break;
    case 1:
        host->string[1]++; /* one configuration too few */
        break;
    default:
        host->string_len = (uint16_t)(host->string_len - 3);
        put_entry(host, 2, 1); /* twice, or not counted */
        put_entry(host, 15, 0);
        break;
    }
}

static void make_string(life_host_t *host, const limb_t *limb)
{
    const unsigned count = chance(host, 5);
    host->string_len = 0;
    host->string_at = 0;
    put_entry(host, 1, (uint16_t)count);
    for (unsigned number = 1; number <= count; number++) {
        put_configuration(host, limb, (uint16_t)number);
    }
    put_entry(host, 15, 0);
    if (life_chance(&host->random, 25)) {
        spoil(host);
    }
    host->string_good = life_memory_is_good(host->string, host->string_len);
}

static bool is_writing(const life_host_t *host)
{
    for (int i = 0; i < host->open_count; i++) {
        if (host->open[i].id == ARB_MSG_WRITE_CONFIGS) {
            return true;
        }
    }
    return false;
}

/* The next piece, or with an offset that cannot be. */
static uint16_t ask_write(life_host_t *host, const limb_t *limb, uint8_t *payload)
{
    if (host->string_at >= host->string_len) {
        if (is_writing(host) || host->stale) {
            return ask_read(host, limb, payload); /* a size that cannot be */
        }
        make_string(host, limb);
    }
    uint16_t len = (uint16_t)(host->string_len - host->string_at);
    const uint16_t most = (uint16_t)(1 + chance(host, 400));
    len = len < most ? len : most;
    const uint16_t offset = host->string_at;
    const bool astray = life_chance(&host->random, 5);
    pdcp_bytes_put_u16(&payload[0], (uint16_t)(offset + (astray ? 7 : 0)));
    pdcp_bytes_put_u16(&payload[2], host->string_len);
    memcpy(&payload[4], &host->string[offset], len);
    host->string_at = astray ? 0 : (uint16_t)(offset + len);
    return (uint16_t)(4 + len);
}

/* --- Requests --- */

typedef uint16_t (*asker_t)(life_host_t *host, const limb_t *limb, uint8_t *payload);

static const struct {
    uint16_t id;
    uint8_t weight;
    asker_t ask;
} askers[] = {
    {ARB_MSG_SYSTEM_INFO, 4, ask_nothing},
    {ARB_MSG_DEVICE_INFO, 4, ask_number},
    {ARB_MSG_INPUT_INFO, 4, ask_number},
    {ARB_MSG_OUTPUT_INFO, 4, ask_number},
    {ARB_MSG_LINK_INFO, 4, ask_number},
    {ARB_MSG_GET_PARAMETER, 8, ask_get},
    {ARB_MSG_SET_PARAMETER, 8, ask_set},
    {ARB_MSG_CONFIGURE_LINK, 16, ask_link},
    {ARB_MSG_PASSTHROUGH, 6, ask_passthrough},
    {ARB_MSG_RESET, 3, ask_reset},
    {ARB_MSG_ARBITRATOR_INFO, 3, ask_nothing},
    {ARB_MSG_SET_FLAGS, 3, ask_flags},
    {ARB_MSG_ACTION, 16, ask_action},
    {ARB_MSG_READ_CONFIGS, 6, ask_read},
    {ARB_MSG_WRITE_CONFIGS, 12, ask_write},
    {ARB_MSG_REMOVE_LINK, 8, ask_remove},
    {ARB_MSG_STATISTICS, 3, ask_statistics},
    {ARB_MSG_EVENT_STREAM, 3, ask_stream},
    {0x2419, 1, ask_nothing},
    {0x2500, 1, ask_number},
};

static unsigned random_asker(life_host_t *host)
{
    unsigned sum = 0;
    for (unsigned k = 0; k < sizeof askers / sizeof askers[0]; k++) {
        sum += askers[k].weight;
    }
    unsigned left = chance(host, sum);
    unsigned k = 0;
    while (left >= askers[k].weight) {
        left -= askers[k++].weight;
    }
    return k;
}

static void put_bytes(life_host_t *host, const uint8_t *bytes, uint32_t len)
{
    TEST_ASSERT_LESS_OR_EQUAL(LIFE_BYTES_MAX, host->out_len + len);
    memcpy(&host->out[host->out_len], bytes, len);
    host->out_len += len;
    host->put_bytes += len;
}

static uint8_t next_reference(life_host_t *host)
{
    host->reference = (uint8_t)(host->reference % 255u + 1u);
    return host->reference;
}

/* A request of 230Fh's kind is told from its size alone what it lacks; others fail with 01h. */
static bool make_size_wrong(life_host_t *host, uint16_t id, uint8_t *payload, uint16_t *len)
{
    if (id == 0x2419 || id == 0x2500 || !life_chance(&host->random, 3)) {
        return false;
    }
    if (id == ARB_MSG_SET_PARAMETER || id == ARB_MSG_WRITE_CONFIGS) {
        *len = 4; /* these have no upper limit that is near */
    } else {
        const uint16_t more = id == ARB_MSG_EVENT_STREAM ? 2 : 1; /* a mask of two bytes is one, too */
        memset(&payload[*len], 0, more);
        *len = (uint16_t)(*len + more);
    }
    return true;
}

void life_host_ask(life_host_t *host, const limb_t *limb)
{
    uint8_t bytes[REQUEST_BYTES];
    uint8_t *payload = &bytes[ARB_HOST_HEADER];
    const bool patient = host->open_count >= PATIENT && !life_chance(&host->random, 10);
    if (!host->is_open || patient || host->open_count == LIFE_OPEN_MAX ||
        host->out_len > LIFE_BYTES_MAX / 2) {
        return;
    }
    const unsigned k = random_asker(host);
    life_request_t *request = &host->open[host->open_count];
    memset(request, 0, sizeof *request);
    request->id = askers[k].id;
    request->len = askers[k].ask(host, limb, payload);
    request->last_piece = request->id == ARB_MSG_WRITE_CONFIGS && host->string_at == host->string_len;
    request->wrong_size = make_size_wrong(host, request->id, payload, &request->len);
    if (request->id == ARB_MSG_WRITE_CONFIGS && (request->wrong_size || request->len <= 4)) {
        request->wrong_size = true;
        request->last_piece = false;
        host->string_at = 0;
    }
    request->mask = request->len == 2 ? pdcp_bytes_get_u16(payload) : payload[0];
    request->reference = next_reference(host);
    request->may_be_lost = host->garbage_end == host->put_bytes;
    const uint16_t total = arb_hostcodec_finish(bytes, request->id, request->reference, request->len);
    put_bytes(host, bytes, total);
    request->end_byte = host->put_bytes;
    host->open_count++;
    host->asked++;
}

void life_host_babble(life_host_t *host, const limb_t *limb, uint32_t now_ms)
{
    uint8_t bytes[REQUEST_BYTES];
    if (!host->is_open || host->out_len > LIFE_BYTES_MAX / 2) {
        return;
    }
    host->babbled_ms = now_ms;
    if (life_chance(&host->random, 50)) {
        const uint32_t len = 1 + chance(host, 300);
        for (uint32_t i = 0; i < len; i++) {
            bytes[i] = (uint8_t)chance(host, 254); /* without FEh there is no header */
        }
        if (life_chance(&host->random, 30)) {
            bytes[len - 1] = ARB_HOST_SYNC1;
        }
        put_bytes(host, bytes, len);
        host->garbage_end = host->put_bytes;
        return;
    }
    /* Without checksums it may be completed by what follows, and is then carried out: nothing that matters is
     * asked. */
    const bool is_long = life_chance(&host->random, 50);
    const uint16_t len = (uint16_t)(is_long ? 8 + 1 + chance(host, PDCP_PARAMETER_MAX) : 8);
    memset(&bytes[ARB_HOST_HEADER], 0x33, len);
    (void)put_device(host, limb, &bytes[ARB_HOST_HEADER]);
    bytes[ARB_HOST_HEADER + 6] = 0;
    bytes[ARB_HOST_HEADER + 7] = 241;
    const uint16_t total =
        arb_hostcodec_finish(bytes, is_long ? ARB_MSG_SET_PARAMETER : ARB_MSG_GET_PARAMETER, 0, len);
    const uint32_t least = is_long ? ARB_HOST_HEADER + 8 : 1;
    put_bytes(host, bytes, least + chance(host, total - least));
    host->garbage_end = host->put_bytes;
}

/* --- Opening and closing --- */

void life_host_forget(life_host_t *host)
{
    host->out_len = 0;
    host->taken_bytes = host->put_bytes;
    host->open_count = 0;
    host->in_len = 0;
    host->string_at = host->string_len;
    host->stale = false;
    host->mask = 0;
}

void life_host_close(life_host_t *host, limb_t *limb)
{
    if (host->is_open) {
        host->is_open = false;
        if (is_writing(host)) {
            memcpy(host->before, host->string, host->string_len);
            host->before_len = host->string_len;
        }
        life_host_forget(host);
        host->stale = true;
        arb_app_on_host_gone(&limb->app);
    }
}

void life_host_open(life_host_t *host)
{
    host->is_open = true;
}

size_t life_host_write(life_host_t *host, const uint8_t *bytes, size_t size)
{
    if (!host->is_open) {
        return size; /* nobody hears it */
    }
    const size_t taken = size < host->room ? size : host->room;
    TEST_ASSERT_LESS_OR_EQUAL(LIFE_BYTES_MAX, host->in_len + taken);
    memcpy(&host->in[host->in_len], bytes, taken);
    host->in_len += (uint32_t)taken;
    host->room -= (uint32_t)taken;
    return taken;
}

/* --- What comes back --- */

static void fail(const life_request_t *request, uint16_t id, const char *why)
{
    char text[120];
    (void)snprintf(text, sizeof text, "request %04X, reference %u, answer %04X: %s", request->id,
                   request->reference, id, why);
    TEST_FAIL_MESSAGE(text);
}

static bool is_known(uint16_t id)
{
    for (unsigned k = 0; k < sizeof askers / sizeof askers[0]; k++) {
        if (askers[k].id == id) {
            return id != 0x2419 && id != 0x2500;
        }
    }
    return false;
}

static bool is_answer_to(const life_request_t *request, uint16_t id, uint8_t reference)
{
    const bool fits =
        is_known(request->id) ? id == request->id + 1 || id == request->id + 2 : id == ARB_MSG_UNKNOWN_ID;
    return request->reference == reference && fits;
}

/* Without checksums garbage may have been taken for requests, which are answered, too. */
static bool has_babbled(const life_host_t *host, uint32_t now_ms)
{
    return now_ms - host->babbled_ms < HELD_MAX * (uint32_t)ANSWER_MS;
}

/* A fifth request, or one too many bytes, is answered with 07h before the others (D-API-3, D-API-9); some may
 * be those of the host before, or were made of garbage. */
static bool may_overtake(const life_host_t *host, int k, const uint8_t *payload, uint16_t len,
                         uint32_t now_ms)
{
    const bool unsure = host->stale || has_babbled(host, now_ms);
    uint32_t held = 0;
    for (int i = 0; i <= k; i++) {
        held += host->open[i].len;
    }
    const bool busy = host->open[k].id == ARB_MSG_RESET ? len == 8 : (len == 0 || payload[0] == ARB_ERR_BUSY);
    return busy && (unsure || k >= HELD_MAX || held > HELD_BYTES);
}

static void check_failure(const life_request_t *request, uint16_t id, const uint8_t *payload, uint16_t len)
{
    if (request->id == ARB_MSG_RESET) {
        if (len != 8) {
            fail(request, id, "not eight bytes");
        }
        return;
    }
    if (len != 1 || payload[0] == 0 || payload[0] > ARB_ERR_VALUE) {
        fail(request, id, "not an error code");
    }
    if (request->wrong_size != (payload[0] == ARB_ERR_SIZE) && payload[0] != ARB_ERR_BUSY &&
        request->id != ARB_MSG_PASSTHROUGH) {
        fail(request, id, "01h is for wrong sizes");
    }
}

static void check_success(life_host_t *host, const life_request_t *request, uint16_t id, uint16_t len)
{
    static const struct {
        uint16_t id;
        uint16_t len;
    } lens[] = {{0x2202, 4}, {0x2205, 11}, {0x2208, 11}, {0x220B, 11}, {0x220E, 15}, {0x2305, 0},
                {0x2308, 1}, {0x230B, 15}, {0x230E, 0},  {0x2402, 11}, {0x2405, 0},  {0x2408, 2},
                {0x240E, 0}, {0x2411, 0},  {0x2417, 0},  {0x2200, 0}};
    if (request->wrong_size) {
        fail(request, id, "the size was wrong");
    }
    for (unsigned k = 0; k < sizeof lens / sizeof lens[0]; k++) {
        if (lens[k].id == id && lens[k].len != len) {
            fail(request, id, "a wrong length");
        }
    }
    if (request->last_piece && !host->string_good) {
        fail(request, id, "a bad string was taken");
    }
    if (request->id == ARB_MSG_EVENT_STREAM) {
        host->mask = request->mask;
    }
}

static void take_open(life_host_t *host, int k)
{
    host->open_count--;
    memmove(&host->open[k], &host->open[k + 1], (size_t)(host->open_count - k) * sizeof host->open[0]);
}

/* A truncated message takes the first byte behind it as its own if that makes its checksum right, one time in
 * 256: the request that begins there is never answered. Drops such requests among the first k; returns how
 * many. */
static int take_lost(life_host_t *host, int k)
{
    int lost = 0;
    for (int i = k - 1; i >= 0; i--) {
        if (host->open[i].may_be_lost) {
            if (host->open[i].id == ARB_MSG_WRITE_CONFIGS) {
                host->string_at = host->string_len; /* begins anew */
            }
            take_open(host, i);
            lost++;
        }
    }
    return lost;
}

/* Kinds that are wanted, or may be by a request that is not answered yet. */
static uint16_t wanted_mask(const life_host_t *host)
{
    uint16_t mask = host->mask;
    for (int i = 0; i < host->open_count; i++) {
        mask |= host->open[i].id == ARB_MSG_EVENT_STREAM ? host->open[i].mask : 0;
    }
    return mask;
}

static void on_event(life_host_t *host, uint8_t reference, const uint8_t *payload, uint16_t len)
{
    host->events++;
    TEST_ASSERT_EQUAL_MESSAGE(0, reference, "reference of an event");
    TEST_ASSERT_TRUE_MESSAGE(len >= 5 && payload[0] >= 1 && payload[0] <= 9, "an event of no kind");
    TEST_ASSERT_TRUE_MESSAGE(host->stale || ((unsigned)wanted_mask(host) << 1 & 1u << payload[0]) != 0,
                             "an event that nobody has asked for");
}

static void on_message(life_host_t *host, uint32_t now_ms, uint16_t id, uint8_t reference,
                       const uint8_t *payload, uint16_t len)
{
    if (id == ARB_MSG_EVENT) {
        on_event(host, reference, payload, len);
        return;
    }
    int k = 0;
    while (k < host->open_count && !is_answer_to(&host->open[k], id, reference)) {
        k++;
    }
    if (k == host->open_count) {
        TEST_ASSERT_TRUE_MESSAGE(host->stale || has_babbled(host, now_ms),
                                 "an answer that nobody has asked for");
        return;
    }
    const life_request_t request = host->open[k];
    const bool overtakes = may_overtake(host, k, payload, len, now_ms);
    if (!overtakes) {
        k -= take_lost(host, k);
    }
    if (k != 0 && !overtakes) {
        fail(&request, id, "out of order");
    }
    if (id == request.id + 2) {
        check_failure(&request, id, payload, len);
        host->failed++;
        if (request.id == ARB_MSG_WRITE_CONFIGS) {
            host->string_at = host->string_len; /* begins anew */
        }
    } else {
        check_success(host, &request, id, len);
    }
    take_open(host, k);
    host->answered++;
    if (k == 0) {
        const uint32_t took_ms = now_ms - host->front_ms;
        host->longest_ms = took_ms > host->longest_ms ? took_ms : host->longest_ms;
    }
    host->stale = host->stale && overtakes; /* what was asked before is answered */
}

/* The message at the front of what has come. Returns how many bytes it took; 0: it is not complete. */
static uint32_t take_message(life_host_t *host, uint32_t now_ms)
{
    if (host->in[0] != ARB_HOST_SYNC1 || (host->in_len > 1 && host->in[1] != ARB_HOST_SYNC2)) {
        TEST_ASSERT_TRUE_MESSAGE(host->stale, "bytes between two messages");
        return 1;
    }
    if (host->in_len < ARB_HOST_HEADER) {
        return 0;
    }
    const uint16_t size = pdcp_bytes_get_u16(&host->in[6]);
    if (host->in[5] != arb_hostcodec_crc8(host->in)) {
        TEST_ASSERT_TRUE_MESSAGE(host->stale, "CRC8 of an answer");
        return 1;
    }
    if (host->in_len < ARB_HOST_HEADER + (uint32_t)size) {
        return 0;
    }
    const uint16_t len = (uint16_t)(size != 0 ? size - ARB_HOST_CRC : 0);
    const uint8_t *payload = &host->in[ARB_HOST_HEADER];
    if (size != 0) {
        TEST_ASSERT_EQUAL_HEX16_MESSAGE(arb_hostcodec_crc16(payload, len), pdcp_bytes_get_u16(&payload[len]),
                                        "CRC16");
    }
    on_message(host, now_ms, pdcp_bytes_get_u16(&host->in[2]), host->in[4], payload, len);
    return ARB_HOST_HEADER + (uint32_t)size;
}

static void read_answers(life_host_t *host, uint32_t now_ms)
{
    uint32_t used = 1;
    while (host->in_len != 0 && used != 0) {
        used = take_message(host, now_ms);
        host->in_len -= used;
        memmove(host->in, &host->in[used], host->in_len);
    }
}

/* Is it answered from what the arbitrator knows? */
static bool needs_nobody(uint16_t id)
{
    return id < ARB_MSG_GET_PARAMETER || id == ARB_MSG_ARBITRATOR_INFO || id == ARB_MSG_SET_FLAGS ||
           id == ARB_MSG_STATISTICS || id == ARB_MSG_EVENT_STREAM || id == 0x2419 || id == 0x2500;
}

/* The request at the front has its answer in time, counted from when it is the first one, and not while the
 * host does not read, or others may come first. */
static void check_time(life_host_t *host, uint32_t now_ms)
{
    const life_request_t *front = &host->open[0];
    if (host->front_byte != front->end_byte) {
        host->front_byte = front->end_byte;
        host->front_ms = now_ms;
    }
    if (host->open_count == 0 || !host->reads || host->stale || has_babbled(host, now_ms) ||
        (int32_t)(host->taken_bytes - front->end_byte) < 0) {
        host->front_ms = now_ms;
        return;
    }
    const uint32_t limit_ms = needs_nobody(front->id) ? TABLES_MS : ANSWER_MS + SLACK_MS;
    if (now_ms - host->front_ms > limit_ms) {
        fail(front, 0, "no answer in time");
    }
}

void life_host_step(life_host_t *host, limb_t *limb, uint32_t now_ms)
{
    if (limb->world.app == NULL) {
        host->front_ms = now_ms;
        return;
    }
    if (host->out_len != 0) {
        const uint16_t len = (uint16_t)(host->out_len < 64 ? host->out_len : 64);
        const uint16_t taken = arb_app_on_bytes(&limb->app, sim_world_ms(&limb->world), host->out, len);
        sim_world_touch_app(&limb->world);
        host->out_len -= taken;
        memmove(host->out, &host->out[taken], host->out_len);
        host->taken_bytes += taken;
    }
    if (host->reads) {
        host->room = host->room + LINE_BYTES < LINE_ROOM ? host->room + LINE_BYTES : LINE_ROOM;
        if (arb_hostapi_has_output(&limb->app.api)) {
            sim_world_touch_app(&limb->world); /* there is room again */
        }
    } else {
        host->room = 0;
    }
    read_answers(host, now_ms);
    check_time(host, now_ms);
}
