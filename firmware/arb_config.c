#include "arb_config.h"

#include <stddef.h>
#include <string.h>

#include "arb_crc.h"
#include "pdcp_time.h"

#define CONFIG_NOWHERE 0xFFFFu /* an offset that no string has */

/* A smaller memory has no room for a string at all: a negative array size does not compile. */
typedef char arb_config_has_room[ARB_CONFIG_STRING_PAGES > 0 ? 1 : -1];

enum { CONFIG_MEMBERS = 8 }; /* bytes of a header before its CRC */

typedef enum { KIND_READ, KIND_SAVE, KIND_ERASE, KIND_RAW } kind_t;

typedef enum {
    PHASE_IDLE,
    PHASE_READ,    /* the stored string goes to the sink */
    PHASE_SCAN,    /* save, erase: where in the stored string what stands, and what it becomes */
    PHASE_COMPARE, /* a piece of the host's: is it what is stored? */
    PHASE_WRITE,   /* the new string, page by page */
    PHASE_CHECK,   /* the new string is read back */
    PHASE_HEADER,
    PHASE_ADOPT /* the header is read back */
} phase_t;

/* What a memory without a good copy reads as. */
static const uint8_t empty_string[PROFILE_TLV_FRAME_BYTES] = {
    PROFILE_TLV_CONFIGURATIONS, 0, 0, PROFILE_TLV_END, 0, 0};

static uint16_t at_most(uint16_t a, uint16_t b)
{
    return a < b ? a : b;
}

/* Areas ------------------------------------------------------------------------------------------------- */

static uint16_t header_address(uint8_t area)
{
    return (uint16_t)(ARB_NVM_CONFIG_AT + (uint16_t)(area * (uint16_t)ARB_CONFIG_AREA));
}

static uint16_t string_address(uint8_t area)
{
    return (uint16_t)(header_address(area) + ARB_PORT_NVM_PAGE);
}

/* The area that does not hold the newest good copy. */
static uint8_t next_area(const arb_config_t *config)
{
    return config->area == 0 ? 1 : 0;
}

/* crc: the register behind the string. */
static void put_header(uint8_t header[ARB_CONFIG_HEADER], uint16_t sequence, uint16_t length, uint32_t crc)
{
    header[0] = 'P';
    header[1] = 'C';
    header[2] = ARB_CONFIG_VERSION;
    header[3] = 0;
    pdcp_put_u16(&header[4], sequence);
    pdcp_put_u16(&header[6], length);
    const uint32_t sum = ~arb_crc32(crc, header, CONFIG_MEMBERS);
    pdcp_put_u16(&header[CONFIG_MEMBERS], (uint16_t)(sum & 0xFFFFu));
    pdcp_put_u16(&header[CONFIG_MEMBERS + 2], (uint16_t)(sum >> 16));
}

/* The stored string, or the empty one. */
static bool read_stored(const arb_config_t *config, const arb_nvm_t *nvm, uint16_t at, uint8_t *bytes,
                        uint16_t len)
{
    if (config->area == (uint8_t)ARB_CONFIG_AREAS) {
        memcpy(bytes, &empty_string[at], len);
        return true;
    }
    const uint16_t address = (uint16_t)(string_address(config->area) + at);
    return nvm->port->nvm_read(nvm->port->ctx, address, bytes, len);
}

typedef enum { AREA_EMPTY, AREA_DAMAGED, AREA_GOOD } area_state_t;

/* Checks an area before anything of it is used. Good: reader has read its string, whose register is *crc. */
static area_state_t check_area(const arb_nvm_t *nvm, uint8_t area, uint8_t header[ARB_CONFIG_HEADER],
                               profile_tlv_t *reader, uint32_t *crc)
{
    const arb_port_t *port = nvm->port;
    if (!port->nvm_read(port->ctx, header_address(area), header, ARB_CONFIG_HEADER) ||
        (header[0] == 0xFF && header[1] == 0xFF)) {
        return AREA_EMPTY;
    }
    const uint16_t length = pdcp_value_u16(header, ARB_CONFIG_HEADER, 6);
    if (header[0] != 'P' || header[1] != 'C' || header[2] != ARB_CONFIG_VERSION ||
        length > ARB_CONFIG_STRING_MAX) {
        return AREA_DAMAGED;
    }
    *crc = ARB_CRC32_INIT;
    profile_tlv_init(reader, NULL, NULL);
    for (uint16_t at = 0; at < length;) {
        uint8_t bytes[ARB_CONFIG_READ_MAX];
        const uint16_t len = at_most((uint16_t)(length - at), sizeof bytes);
        if (!port->nvm_read(port->ctx, (uint16_t)(string_address(area) + at), bytes, len)) {
            return AREA_DAMAGED;
        }
        *crc = arb_crc32(*crc, bytes, len);
        (void)profile_tlv_read(reader, bytes, len);
        at = (uint16_t)(at + len);
    }
    const bool whole = arb_crc32(*crc, header, ARB_CONFIG_HEADER) == ARB_CRC32_RESIDUE;
    return whole && reader->status == PROFILE_TLV_DONE ? AREA_GOOD : AREA_DAMAGED;
}

/* What reader has just read is the newest good copy. */
static void adopt(arb_config_t *config, uint8_t area, uint16_t sequence, uint16_t length, uint32_t crc)
{
    config->area = area;
    config->sequence = sequence;
    config->length = length;
    config->crc = crc;
    memcpy(config->numbers, config->reader.numbers, sizeof config->numbers);
    config->stored = config->reader.configurations_read;
}

void arb_config_init(arb_config_t *config, arb_nvm_t *nvm)
{
    memset(config, 0, sizeof *config);
    config->area = ARB_CONFIG_AREAS;
    config->length = sizeof empty_string;
    config->crc = arb_crc32(ARB_CRC32_INIT, empty_string, sizeof empty_string);
    for (uint8_t area = 0; area < (uint8_t)ARB_CONFIG_AREAS; area++) {
        uint8_t header[ARB_CONFIG_HEADER];
        uint32_t crc;
        const area_state_t state = check_area(nvm, area, header, &config->reader, &crc);
        if (state == AREA_DAMAGED) {
            config->counters[ARB_CONFIG_DAMAGED]++;
        }
        if (state != AREA_GOOD) {
            continue;
        }
        const uint16_t sequence = pdcp_value_u16(header, ARB_CONFIG_HEADER, 4);
        if (config->area == (uint8_t)ARB_CONFIG_AREAS ||
            (int16_t)(uint16_t)(sequence - config->sequence) > 0) {
            adopt(config, area, sequence, pdcp_value_u16(header, ARB_CONFIG_HEADER, 6), crc);
        }
    }
}

/* Jobs -------------------------------------------------------------------------------------------------- */

bool arb_config_busy(const arb_config_t *config)
{
    return config->phase != PHASE_IDLE;
}

static void enter(arb_config_t *config, phase_t phase, uint16_t at)
{
    config->phase = (uint8_t)phase;
    config->at = at;
    config->crc_read = ARB_CRC32_INIT;
}

static void start(arb_config_t *config, kind_t kind, phase_t phase, arb_config_done_t done, void *ctx,
                  uint32_t now_ms)
{
    enter(config, phase, 0);
    config->kind = (uint8_t)kind;
    config->polls = 0;
    config->done = done;
    config->ctx = ctx;
    config->due_ms = now_ms;
}

static void finish(arb_config_t *config, arb_nvm_t *nvm, arb_config_status_t status)
{
    config->phase = PHASE_IDLE;
    config->writing = false;
    arb_nvm_give(nvm, ARB_NVM_CONFIG);
    if (status == ARB_CONFIG_UNCHANGED) {
        config->counters[ARB_CONFIG_COUNT_UNCHANGED]++;
    } else if (status == ARB_CONFIG_ERR_STORAGE) {
        config->counters[ARB_CONFIG_FAILURES]++;
    }
    if (status < 0 && config->kind == KIND_RAW) {
        config->raw_total = 0;
    }
    config->done(config->ctx, status);
}

arb_config_status_t arb_config_read(arb_config_t *config, const profile_tlv_sink_t *sink,
                                    arb_config_done_t done, void *ctx, uint32_t now_ms)
{
    if (arb_config_busy(config)) {
        return ARB_CONFIG_ERR_BUSY;
    }
    profile_tlv_init(&config->reader, sink, ctx);
    start(config, KIND_READ, PHASE_READ, done, ctx, now_ms);
    return ARB_CONFIG_OK;
}

static void start_change(arb_config_t *config, kind_t kind, arb_config_done_t done, void *ctx,
                         uint32_t now_ms)
{
    config->raw_total = 0;
    config->same = true;
    config->count_at = CONFIG_NOWHERE;
    config->cut_from = CONFIG_NOWHERE;
    config->cut_to = CONFIG_NOWHERE;
    config->end_at = CONFIG_NOWHERE;
    start(config, kind, PHASE_SCAN, done, ctx, now_ms);
}

arb_config_status_t arb_config_save(arb_config_t *config, uint8_t *number, uint8_t count,
                                    arb_config_link_t link, arb_config_done_t done, void *ctx,
                                    uint32_t now_ms)
{
    if (arb_config_busy(config)) {
        return ARB_CONFIG_ERR_BUSY;
    }
    if (*number == 0 && config->stored == 0xFF) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    if (*number == 0) {
        do {
            (*number)++;
        } while (arb_config_has(config, *number));
    }
    config->number = *number;
    config->count = count;
    config->link = link;
    start_change(config, KIND_SAVE, done, ctx, now_ms);
    return ARB_CONFIG_OK;
}

arb_config_status_t arb_config_erase(arb_config_t *config, uint8_t number, arb_config_done_t done, void *ctx,
                                     uint32_t now_ms)
{
    if (arb_config_busy(config)) {
        return ARB_CONFIG_ERR_BUSY;
    }
    if (!arb_config_has(config, number)) {
        return ARB_CONFIG_ERR_NUMBER;
    }
    config->number = number;
    start_change(config, KIND_ERASE, done, ctx, now_ms);
    return ARB_CONFIG_OK;
}

arb_config_status_t arb_config_write_raw(arb_config_t *config, uint16_t offset, uint16_t total,
                                         const uint8_t *bytes, uint16_t len, arb_config_done_t done,
                                         void *ctx, uint32_t now_ms)
{
    if (arb_config_busy(config)) {
        return ARB_CONFIG_ERR_BUSY;
    }
    if (len == 0 || len > total || offset > total - len) {
        return ARB_CONFIG_ERR_VALUE;
    }
    if (offset != 0 && (total != config->raw_total || offset != config->raw_at)) {
        return ARB_CONFIG_ERR_VALUE;
    }
    if (total > ARB_CONFIG_STRING_MAX) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    if (offset == 0) {
        config->raw_total = total;
        config->raw_at = 0;
        config->raw_same = total == config->length;
        config->crc_new = ARB_CRC32_INIT;
    }
    config->piece = bytes;
    config->piece_len = len;
    config->length_new = total;
    config->crc_new = arb_crc32(config->crc_new, bytes, len);
    start(config, KIND_RAW, PHASE_WRITE, done, ctx, now_ms);
    config->at = offset;
    if (config->raw_same) {
        enter(config, PHASE_COMPARE, 0);
    }
    return ARB_CONFIG_OK;
}

arb_config_status_t arb_config_read_raw(const arb_config_t *config, const arb_nvm_t *nvm, uint16_t offset,
                                        uint8_t *bytes, uint8_t *len)
{
    if (arb_config_busy(config) || nvm->owner != ARB_NVM_NOBODY ||
        nvm->port->nvm_status(nvm->port->ctx) > 0) {
        return ARB_CONFIG_ERR_BUSY;
    }
    if (offset > config->length) {
        return ARB_CONFIG_ERR_VALUE;
    }
    *len = (uint8_t)at_most(at_most(*len, ARB_CONFIG_READ_MAX), (uint16_t)(config->length - offset));
    return read_stored(config, nvm, offset, bytes, *len) ? ARB_CONFIG_OK : ARB_CONFIG_ERR_STORAGE;
}

/* The new string ---------------------------------------------------------------------------------------- */

static uint16_t configuration_length(const arb_config_t *config)
{
    return config->kind == KIND_ERASE ? 0
                                      : (uint16_t)(PROFILE_TLV_CONFIGURATION_BYTES +
                                                   (uint16_t)PROFILE_TLV_LINK_BYTES * config->count);
}

/* Entry k of the configuration that is saved. */
static void put_configuration_entry(const arb_config_t *config, uint16_t k,
                                    uint8_t entry[PROFILE_TLV_ENTRY_BYTES])
{
    const uint16_t heads = PROFILE_TLV_CONFIGURATION_BYTES / PROFILE_TLV_ENTRY_BYTES;
    if (k == 0) {
        profile_tlv_put(entry, PROFILE_TLV_CONFIGURATION, config->number);
    } else if (k < heads) {
        profile_tlv_put(entry, PROFILE_TLV_LINKS, config->count);
    } else {
        const uint8_t link_k = (uint8_t)((k - heads) / PROFILE_TLV_LINK_ENTRIES);
        profile_link_t link;
        config->link(config->ctx, link_k, &link);
        profile_tlv_put_link_entry(entry, (uint8_t)(link_k + 1), &link,
                                   (uint8_t)((k - heads) % PROFILE_TLV_LINK_ENTRIES));
    }
}

/* How many configurations the new string has. */
static uint8_t new_count(const arb_config_t *config)
{
    if (config->kind == KIND_ERASE) {
        return (uint8_t)(config->stored - 1);
    }
    return (uint8_t)(arb_config_has(config, config->number) ? config->stored : config->stored + 1);
}

/* Bytes of the stored string, with the new number of configurations in it. */
static bool put_stored(const arb_config_t *config, const arb_nvm_t *nvm, uint16_t at, uint8_t *bytes,
                       uint16_t len)
{
    if (!read_stored(config, nvm, at, bytes, len)) {
        return false;
    }
    const uint8_t value[2] = {new_count(config), 0};
    for (uint8_t i = 0; i < 2; i++) {
        const uint16_t value_at = (uint16_t)(config->count_at + 1 + i);
        if (config->count_at != CONFIG_NOWHERE && value_at >= at && value_at - at < len) {
            bytes[value_at - at] = value[i];
        }
    }
    return true;
}

/* Bytes at to at + run of the string that a save or an erasure makes: the stored string without what is cut
 * out of it, with the new configuration in that place. Returns run, 1 to len; 0: the memory has failed. */
static uint16_t put_changed(const arb_config_t *config, const arb_nvm_t *nvm, uint16_t at, uint8_t *bytes,
                            uint16_t len)
{
    const uint16_t configuration = configuration_length(config);
    uint8_t entry[PROFILE_TLV_ENTRY_BYTES];
    uint16_t run;
    uint16_t from = config->cut_from;
    if (config->count_at == CONFIG_NOWHERE) { /* what had no configurations may not have said so */
        from = (uint16_t)(from + PROFILE_TLV_ENTRY_BYTES);
    }
    const uint16_t added = (uint16_t)(from - config->cut_from);
    const uint16_t behind = (uint16_t)(from + configuration);
    const uint16_t end = (uint16_t)(behind + config->end_at - config->cut_to);
    if (at >= added && at < from) {
        run = at_most(len, (uint16_t)(from - at));
        return put_stored(config, nvm, (uint16_t)(at - added), bytes, run) ? run : 0;
    }
    if (at >= behind && at < end) {
        run = at_most(len, (uint16_t)(end - at));
        return put_stored(config, nvm, (uint16_t)(config->cut_to + at - behind), bytes, run) ? run : 0;
    }
    if (at < added) {
        profile_tlv_put(entry, PROFILE_TLV_CONFIGURATIONS, new_count(config));
    } else if (at < behind) {
        put_configuration_entry(config, (uint16_t)((at - from) / PROFILE_TLV_ENTRY_BYTES), entry);
    } else {
        profile_tlv_put(entry, PROFILE_TLV_END, 0);
    }
    /* Everything in front is whole entries. */
    const uint16_t skip = at % PROFILE_TLV_ENTRY_BYTES;
    run = at_most(len, (uint16_t)(PROFILE_TLV_ENTRY_BYTES - skip));
    memcpy(bytes, &entry[skip], run);
    return run;
}

/* The same of the string that the host writes: what came before this piece is either written already or equal
 * to what is stored. */
static uint16_t put_raw(const arb_config_t *config, const arb_nvm_t *nvm, uint16_t at, uint8_t *bytes,
                        uint16_t len)
{
    if (at < config->raw_at) {
        const uint16_t run = at_most(len, (uint16_t)(config->raw_at - at));
        return read_stored(config, nvm, at, bytes, run) ? run : 0;
    }
    memcpy(bytes, &config->piece[at - config->raw_at], len);
    return len;
}

static bool put_new(const arb_config_t *config, const arb_nvm_t *nvm, uint8_t *bytes, uint16_t len)
{
    uint16_t run;
    for (uint16_t i = 0; i < len; i = (uint16_t)(i + run)) {
        const uint16_t at = (uint16_t)(config->at + i);
        run = config->kind == KIND_RAW ? put_raw(config, nvm, at, &bytes[i], (uint16_t)(len - i))
                                       : put_changed(config, nvm, at, &bytes[i], (uint16_t)(len - i));
        if (run == 0) {
            return false;
        }
    }
    return true;
}

/* Phases ------------------------------------------------------------------------------------------------ */

/* Each does one step. The job ends with anything but ARB_CONFIG_OK, and when the phase is idle afterwards. */
typedef arb_config_status_t (*phase_step_t)(arb_config_t *config, arb_nvm_t *nvm);

/* Reads the next bytes of the stored string, up to size. Returns how many; 0: the memory has failed. */
static uint16_t read_next(arb_config_t *config, const arb_nvm_t *nvm, uint8_t *bytes, uint16_t size)
{
    const uint16_t len = at_most(size, (uint16_t)(config->length - config->at));
    if (!read_stored(config, nvm, config->at, bytes, len)) {
        return 0;
    }
    config->crc_read = arb_crc32(config->crc_read, bytes, len);
    config->at = (uint16_t)(config->at + len);
    return len;
}

static arb_config_status_t step_read(arb_config_t *config, arb_nvm_t *nvm)
{
    uint8_t bytes[ARB_CONFIG_READ_MAX];
    const uint16_t len = read_next(config, nvm, bytes, sizeof bytes);
    if (len == 0) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    (void)profile_tlv_read(&config->reader, bytes, len);
    if (config->at < config->length) {
        return ARB_CONFIG_OK;
    }
    config->phase = PHASE_IDLE;
    return config->crc_read == config->crc && config->reader.status == PROFILE_TLV_DONE
               ? ARB_CONFIG_OK
               : ARB_CONFIG_ERR_STORAGE;
}

static void scan_entry(arb_config_t *config, uint16_t at, const uint8_t entry[PROFILE_TLV_ENTRY_BYTES])
{
    const uint8_t code = entry[0];
    const uint16_t value = pdcp_value_u16(entry, PROFILE_TLV_ENTRY_BYTES, 1);
    const bool inside = config->cut_from != CONFIG_NOWHERE && config->cut_to == CONFIG_NOWHERE;
    if (inside && (code == PROFILE_TLV_CONFIGURATION || code == PROFILE_TLV_END)) {
        config->cut_to = at;
    }
    if (code == PROFILE_TLV_CONFIGURATIONS) {
        config->count_at = at;
    } else if (code == PROFILE_TLV_CONFIGURATION && value == config->number) {
        config->cut_from = at;
    } else if (code == PROFILE_TLV_END) {
        config->end_at = at;
    }
    if (config->kind == KIND_SAVE && config->cut_from != CONFIG_NOWHERE && config->cut_to == CONFIG_NOWHERE) {
        const uint16_t k = (uint16_t)((at - config->cut_from) / PROFILE_TLV_ENTRY_BYTES);
        uint8_t mine[PROFILE_TLV_ENTRY_BYTES];
        if (config->same && k < configuration_length(config) / PROFILE_TLV_ENTRY_BYTES) {
            put_configuration_entry(config, k, mine);
            config->same = memcmp(mine, entry, sizeof mine) == 0;
        }
    }
}

/* The stored string has been read. */
static arb_config_status_t end_scan(arb_config_t *config)
{
    if (config->crc_read != config->crc || config->end_at == CONFIG_NOWHERE) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    if (config->cut_from == CONFIG_NOWHERE) {
        config->cut_from = config->end_at;
        config->cut_to = config->end_at;
    }
    const uint16_t configuration = configuration_length(config);
    uint16_t length = (uint16_t)(config->end_at + PROFILE_TLV_ENTRY_BYTES);
    const bool same =
        config->same && config->cut_to - config->cut_from == configuration && length == config->length;
    if (config->count_at == CONFIG_NOWHERE) {
        length = (uint16_t)(length + PROFILE_TLV_ENTRY_BYTES);
    }
    length = (uint16_t)(length - config->cut_to + config->cut_from + configuration);
    if (same) {
        return ARB_CONFIG_UNCHANGED;
    }
    if (length > ARB_CONFIG_STRING_MAX) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    config->length_new = length;
    config->crc_new = ARB_CRC32_INIT;
    enter(config, PHASE_WRITE, 0);
    return ARB_CONFIG_OK;
}

static arb_config_status_t step_scan(arb_config_t *config, arb_nvm_t *nvm)
{
    uint8_t bytes[ARB_CONFIG_READ_MAX / PROFILE_TLV_ENTRY_BYTES * PROFILE_TLV_ENTRY_BYTES];
    const uint16_t from = config->at;
    const uint16_t len = read_next(config, nvm, bytes, sizeof bytes);
    if (len == 0) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    for (uint16_t i = 0; i + PROFILE_TLV_ENTRY_BYTES <= len && config->end_at == CONFIG_NOWHERE;
         i = (uint16_t)(i + PROFILE_TLV_ENTRY_BYTES)) {
        scan_entry(config, (uint16_t)(from + i), &bytes[i]);
    }
    return config->at < config->length ? ARB_CONFIG_OK : end_scan(config);
}

/* A piece of the host's is in. */
static arb_config_status_t end_piece(arb_config_t *config)
{
    config->raw_at = (uint16_t)(config->raw_at + config->piece_len);
    if (config->raw_at < config->raw_total) {
        config->phase = PHASE_IDLE;
        return ARB_CONFIG_OK;
    }
    config->raw_total = 0;
    if (config->raw_same) {
        return ARB_CONFIG_UNCHANGED;
    }
    profile_tlv_init(&config->reader, NULL, NULL);
    enter(config, PHASE_CHECK, 0);
    return ARB_CONFIG_OK;
}

/* at counts within the piece. */
static arb_config_status_t step_compare(arb_config_t *config, arb_nvm_t *nvm)
{
    uint8_t bytes[ARB_CONFIG_READ_MAX];
    const uint16_t len = at_most((uint16_t)(config->piece_len - config->at), sizeof bytes);
    if (!read_stored(config, nvm, (uint16_t)(config->raw_at + config->at), bytes, len)) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    if (memcmp(bytes, &config->piece[config->at], len) != 0) {
        config->raw_same = false;
        enter(config, PHASE_WRITE, 0);
        return ARB_CONFIG_OK;
    }
    config->at = (uint16_t)(config->at + len);
    return config->at < config->piece_len ? ARB_CONFIG_OK : end_piece(config);
}

static arb_config_status_t write_page(arb_config_t *config, arb_nvm_t *nvm, uint16_t address,
                                      const uint8_t *bytes, uint16_t len)
{
    if (!nvm->port->nvm_write(nvm->port->ctx, address, bytes, len)) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    config->writing = true;
    config->counters[ARB_CONFIG_PAGES]++;
    return ARB_CONFIG_OK;
}

static arb_config_status_t step_write(arb_config_t *config, arb_nvm_t *nvm)
{
    const bool raw = config->kind == KIND_RAW;
    const uint16_t until = raw ? (uint16_t)(config->raw_at + config->piece_len) : config->length_new;
    const uint16_t at = config->at;
    if (at == until && raw) {
        return end_piece(config);
    }
    if (at == until) {
        profile_tlv_init(&config->reader, NULL, NULL);
        enter(config, PHASE_CHECK, 0);
        return ARB_CONFIG_OK;
    }
    uint8_t page[ARB_PORT_NVM_PAGE];
    const uint16_t room = (uint16_t)(sizeof page - at % sizeof page);
    const uint16_t len = at_most(room, (uint16_t)(until - at));
    if (!put_new(config, nvm, page, len)) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    if (!raw) {
        config->crc_new = arb_crc32(config->crc_new, page, len);
    }
    config->at = (uint16_t)(at + len);
    return write_page(config, nvm, (uint16_t)(string_address(next_area(config)) + at), page, len);
}

static arb_config_status_t step_check(arb_config_t *config, arb_nvm_t *nvm)
{
    uint8_t bytes[ARB_CONFIG_READ_MAX];
    const uint16_t len = at_most((uint16_t)(config->length_new - config->at), sizeof bytes);
    const uint16_t address = (uint16_t)(string_address(next_area(config)) + config->at);
    if (!nvm->port->nvm_read(nvm->port->ctx, address, bytes, len)) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    config->crc_read = arb_crc32(config->crc_read, bytes, len);
    (void)profile_tlv_read(&config->reader, bytes, len);
    config->at = (uint16_t)(config->at + len);
    if (config->at < config->length_new) {
        return ARB_CONFIG_OK;
    }
    if (config->crc_read != config->crc_new) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    config->phase = PHASE_HEADER;
    return config->reader.status == PROFILE_TLV_DONE ? ARB_CONFIG_OK : ARB_CONFIG_ERR_VALUE;
}

static arb_config_status_t step_header(arb_config_t *config, arb_nvm_t *nvm)
{
    uint8_t header[ARB_CONFIG_HEADER];
    put_header(header, (uint16_t)(config->sequence + 1), config->length_new, config->crc_new);
    config->phase = PHASE_ADOPT;
    return write_page(config, nvm, header_address(next_area(config)), header, sizeof header);
}

static arb_config_status_t step_adopt(arb_config_t *config, arb_nvm_t *nvm)
{
    const uint8_t area = next_area(config);
    const uint16_t sequence = (uint16_t)(config->sequence + 1);
    uint8_t header[ARB_CONFIG_HEADER];
    uint8_t there[ARB_CONFIG_HEADER];
    put_header(header, sequence, config->length_new, config->crc_new);
    if (!nvm->port->nvm_read(nvm->port->ctx, header_address(area), there, sizeof there) ||
        memcmp(header, there, sizeof there) != 0) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    adopt(config, area, sequence, config->length_new, config->crc_new);
    config->counters[ARB_CONFIG_WRITES]++;
    config->phase = PHASE_IDLE;
    return ARB_CONFIG_OK;
}

/* Is the memory ready for the next step? *status: not for too long, or the page before has failed. */
static bool memory_ready(arb_config_t *config, arb_nvm_t *nvm, arb_config_status_t *status)
{
    int8_t state = 1;
    if (arb_nvm_take(nvm, ARB_NVM_CONFIG)) {
        state = nvm->port->nvm_status(nvm->port->ctx);
    }
    if (state > 0 && config->polls < ARB_CONFIG_POLLS_MAX) {
        config->polls++;
        return false;
    }
    if (state > 0 || (state < 0 && config->writing)) {
        *status = ARB_CONFIG_ERR_STORAGE;
    }
    config->polls = 0;
    config->writing = false;
    return true;
}

void arb_config_step(arb_config_t *config, arb_nvm_t *nvm, uint32_t now_ms)
{
    static const phase_step_t steps[] = {
        [PHASE_READ] = step_read,   [PHASE_SCAN] = step_scan,   [PHASE_COMPARE] = step_compare,
        [PHASE_WRITE] = step_write, [PHASE_CHECK] = step_check, [PHASE_HEADER] = step_header,
        [PHASE_ADOPT] = step_adopt,
    };
    if (config->phase == PHASE_IDLE || pdcp_time_before(now_ms, config->due_ms)) {
        return;
    }
    arb_config_status_t status = ARB_CONFIG_OK;
    config->due_ms = now_ms + ARB_NVM_POLL_MS;
    if (!memory_ready(config, nvm, &status)) {
        return;
    }
    if (status == ARB_CONFIG_OK) {
        status = steps[config->phase](config, nvm);
    }
    if (status != ARB_CONFIG_OK || config->phase == PHASE_IDLE) {
        finish(config, nvm, status);
    } else if (!config->writing) {
        config->due_ms = now_ms + ARB_CONFIG_PACE_MS;
    }
}

uint32_t arb_config_next_ms(const arb_config_t *config, uint32_t now_ms)
{
    return arb_config_busy(config) ? config->due_ms : now_ms + PDCP_TIME_FAR_MS;
}
