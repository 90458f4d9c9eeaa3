#include "arb_config.h"

#include <stddef.h>
#include <string.h>

#include "arb_crc.h"
#include "pdcp_bytes.h"
#include "pdcp_time.h"

/* A smaller memory has no room for a string at all: a negative array size does not compile. */
typedef char arb_config_has_room[ARB_CONFIG_STRING_PAGES > 0 ? 1 : -1];

enum { CONFIG_MEMBERS = 8 }; /* bytes of a header before its CRC */

/* Bytes read at a time: whole entries. */
enum { CONFIG_CHUNK = (int)ARB_CONFIG_READ_MAX / PROFILE_TLV_ENTRY_BYTES * PROFILE_TLV_ENTRY_BYTES };

/* Phases of a job. A phase that fails leads to IDLE, and so does a new string that is the stored one.
 *
 *   read                IDLE --> READ --> IDLE
 *   save, erase         IDLE --> SCAN --> NEW --> CHECK --> HEADER --> ADOPT --> IDLE
 *   the host's pieces   IDLE --> NEW --> IDLE, the last one IDLE --> NEW --> CHECK and on as above */
typedef enum {
    PHASE_IDLE = 0, /* see arb_config_busy */
    PHASE_READ,     /* the stored string goes to the user */
    PHASE_SCAN,     /* save, erase: where in the stored string what stands */
    PHASE_NEW,   /* the new string is compared with the stored one as long as it is the same, else written */
    PHASE_CHECK, /* the new string is read back */
    PHASE_HEADER,
    PHASE_ADOPT /* the header is read back */
} phase_t;

/* What a memory without a good copy reads as (D-API-15). */
static const uint8_t empty_string[PROFILE_TLV_FRAME_BYTES] = {
    PROFILE_TLV_CONFIGURATIONS, 0, 0, PROFILE_TLV_END, 0, 0};

static inline uint16_t at_most(uint16_t a, uint16_t b)
{
    return a < b ? a : b;
}

/* Areas ------------------------------------------------------------------------------------------------- */

static uint16_t header_address(uint8_t area)
{
    return area == 0 ? ARB_NVM_CONFIG_AT : ARB_NVM_CONFIG_AT + ARB_CONFIG_AREA;
}

static uint16_t string_address(uint8_t area)
{
    return (uint16_t)(header_address(area) + ARB_PORT_NVM_PAGE);
}

/* Bytes of the string in an area, or of the empty one. */
static bool read_string(const arb_nvm_t *nvm, uint8_t area, uint16_t at, uint8_t *bytes, uint16_t len)
{
    if (area == (uint8_t)ARB_AREAS) {
        memcpy(bytes, &empty_string[at], len);
        return true;
    }
    return arb_nvm_read(nvm, (uint16_t)(string_address(area) + at), bytes, len);
}

/* Begins to read the string of an area. */
static void open_string(arb_config_t *config, uint8_t area, uint16_t length, profile_tlv_on_link_t on_link)
{
    config->from = area;
    config->at = 0;
    config->until = length;
    config->crc_read = ARB_CRC32_INIT;
    profile_tlv_init(&config->reader, on_link, config->ctx);
}

/* Reads on, up to CONFIG_CHUNK bytes. False: the memory has failed. */
static bool read_on(arb_config_t *config, const arb_nvm_t *nvm, uint8_t bytes[CONFIG_CHUNK])
{
    const uint16_t len = at_most(CONFIG_CHUNK, (uint16_t)(config->until - config->at));
    if (!read_string(nvm, config->from, config->at, bytes, len)) {
        return false;
    }
    config->crc_read = arb_crc32(config->crc_read, bytes, len);
    (void)profile_tlv_read(&config->reader, bytes, len);
    config->at = (uint16_t)(config->at + len);
    return true;
}

/* The string was read to its end, the header stands in front of it. Takes it for what is stored if it is good
 * and the newest one. False: it is not good. */
static bool adopt(arb_config_t *config, const uint8_t header[ARB_CONFIG_HEADER])
{
    if (arb_crc32(config->crc_read, header, ARB_CONFIG_HEADER) != ARB_CRC32_RESIDUE ||
        config->reader.status != PROFILE_TLV_DONE) {
        return false;
    }
    if (arb_area_offer(&config->newest, config->from, header)) {
        config->length = config->until;
        config->crc = config->crc_read;
        memcpy(config->numbers, config->reader.numbers, sizeof config->numbers);
        memcpy(config->names, config->reader.names, sizeof config->names);
        config->stored = config->reader.configurations_read;
    }
    return true;
}

/* Reads an area whose header is good so far. False: it is not good. */
static bool read_area(arb_config_t *config, const arb_nvm_t *nvm, uint8_t area,
                      const uint8_t header[ARB_CONFIG_HEADER])
{
    uint8_t bytes[CONFIG_CHUNK];
    open_string(config, area, pdcp_bytes_get_u16(&header[6]), NULL);
    if (config->until > ARB_CONFIG_STRING_MAX) {
        return false;
    }
    while (config->at < config->until) {
        if (!read_on(config, nvm, bytes)) {
            return false;
        }
    }
    return adopt(config, header);
}

static void count(arb_config_t *config, arb_config_counter_t counter)
{
    config->counters[counter]++;
}

void arb_config_init(arb_config_t *config, arb_nvm_t *nvm, const arb_config_user_t *user, void *ctx,
                     uint32_t now_ms)
{
    memset(config, 0, sizeof *config);
    config->user = user;
    config->ctx = ctx;
    config->due_ms = now_ms;
    config->newest.area = ARB_AREAS;
    config->length = sizeof empty_string;
    config->crc = arb_crc32(ARB_CRC32_INIT, empty_string, sizeof empty_string);
    for (uint8_t area = 0; area < (uint8_t)ARB_AREAS; area++) {
        uint8_t header[ARB_CONFIG_HEADER];
        const arb_area_state_t state = arb_area_open(nvm, header_address(area), 'C', header, sizeof header);
        if (state != ARB_AREA_EMPTY && (state == ARB_AREA_DAMAGED || !read_area(config, nvm, area, header))) {
            count(config, ARB_CONFIG_DAMAGED);
        }
    }
}

/* Jobs -------------------------------------------------------------------------------------------------- */

static void enter(arb_config_t *config, phase_t phase)
{
    config->phase = (uint8_t)phase;
}

/* With no job under way due_ms is the time of the last step. */
static void start(arb_config_t *config, phase_t phase)
{
    enter(config, phase);
    config->polls = 0;
}

/* The job ends with this status. */
static phase_t end(arb_config_t *config, arb_config_status_t status)
{
    config->status = (int8_t)status;
    return PHASE_IDLE;
}

/* The job has ended. */
static arb_config_status_t finish(arb_config_t *config, arb_nvm_t *nvm)
{
    const arb_config_status_t status = (arb_config_status_t)config->status;
    arb_nvm_give(nvm, ARB_NVM_CONFIG);
    if (status == ARB_CONFIG_UNCHANGED) {
        count(config, ARB_CONFIG_COUNT_UNCHANGED);
    } else if (status == ARB_CONFIG_ERR_STORAGE) {
        count(config, ARB_CONFIG_FAILURES);
    }
    if (config->splice.piece != NULL) {
        config->raw_status = (int8_t)status;
    }
    return status;
}

arb_config_status_t arb_config_read(arb_config_t *config)
{
    if (arb_config_busy(config)) {
        return ARB_CONFIG_ERR_BUSY;
    }
    config->splice.piece = NULL;
    start(config, PHASE_READ);
    open_string(config, config->newest.area, config->length, config->user->on_link);
    return ARB_CONFIG_OK;
}

/* Replaces the configuration number by block bytes. */
static void start_change(arb_config_t *config, uint8_t number, uint8_t links, uint16_t block)
{
    config->raw_at = 0;
    config->stored_new = config->stored;
    if (block != 0) {
        config->stored_new++;
    }
    arb_splice_replace(&config->splice, number, links, block);
    start(config, PHASE_SCAN);
    open_string(config, config->newest.area, config->length, NULL);
}

arb_config_status_t arb_config_save(arb_config_t *config, uint8_t *number, uint8_t count)
{
    if (arb_config_busy(config)) {
        return ARB_CONFIG_ERR_BUSY;
    }
    if (*number == 0) {
        if (config->stored == 0xFF) {
            return ARB_CONFIG_ERR_STORAGE;
        }
        do {
            (*number)++;
        } while (arb_config_has(config, *number));
    }
    start_change(config, *number, count, arb_splice_block(count));
    return ARB_CONFIG_OK;
}

arb_config_status_t arb_config_erase(arb_config_t *config, uint8_t number)
{
    if (arb_config_busy(config)) {
        return ARB_CONFIG_ERR_BUSY;
    }
    if (!arb_config_has(config, number)) {
        return ARB_CONFIG_ERR_NUMBER;
    }
    start_change(config, number, 0, 0);
    return ARB_CONFIG_OK;
}

/* A piece out of order is refused, and leaves what is in (D-API-15). */
arb_config_status_t arb_config_write_raw(arb_config_t *config, uint16_t offset, uint16_t total,
                                         const uint8_t *bytes, uint16_t len)
{
    if (arb_config_busy(config)) {
        return ARB_CONFIG_ERR_BUSY;
    }
    if (len == 0 || len > total || offset > total - len) {
        return ARB_CONFIG_ERR_VALUE;
    }
    if (offset != 0 && (total != config->length_new || offset != config->raw_at)) {
        return ARB_CONFIG_ERR_VALUE;
    }
    if (total > ARB_CONFIG_STRING_MAX) {
        return ARB_CONFIG_ERR_STORAGE;
    }
    if (offset == 0) {
        config->length_new = total;
        config->same = total == config->length;
    }
    arb_splice_insert(&config->splice, offset, bytes, len);
    start(config, PHASE_NEW);
    config->raw_status = ARB_CONFIG_RUNNING;
    config->raw_at = 0; /* until the piece is in */
    config->at = offset;
    config->until = (uint16_t)(offset + len);
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
    return read_string(nvm, config->newest.area, offset, bytes, *len) ? ARB_CONFIG_OK
                                                                      : ARB_CONFIG_ERR_STORAGE;
}

/* The new string ---------------------------------------------------------------------------------------- */

/* Writes bytes of the new string from at on, len at most. Returns how many; 0: the memory has failed. */
static uint16_t put_run(const arb_config_t *config, const arb_nvm_t *nvm, uint16_t at, uint8_t *bytes,
                        uint16_t len)
{
    if (!arb_splice_is_kept(&config->splice, &at, &len)) {
        return arb_splice_put(&config->splice, config->user->link, config->ctx, at, bytes, len);
    }
    return read_string(nvm, config->newest.area, at, bytes, len) ? len : 0;
}

/* len bytes of the new string, from config->at. False: the memory has failed. */
static bool put_new(const arb_config_t *config, const arb_nvm_t *nvm, uint8_t *bytes, uint16_t len)
{
    uint16_t run;
    for (uint16_t i = 0; i < len; i = (uint16_t)(i + run)) {
        run = put_run(config, nvm, (uint16_t)(config->at + i), &bytes[i], (uint16_t)(len - i));
        if (run == 0) {
            return false;
        }
    }
    return true;
}

/* Phases ------------------------------------------------------------------------------------------------ */

/* Each does one step and returns the phase that follows. */
typedef phase_t (*phase_step_t)(arb_config_t *config, const arb_nvm_t *nvm);

/* The new string, or a piece of the host's, has been compared or written to its end. */
static phase_t end_part(arb_config_t *config)
{
    if (config->splice.piece != NULL && config->until < config->length_new) {
        config->raw_at = config->until;
        return end(config, ARB_CONFIG_OK);
    }
    if (config->same) {
        return end(config, ARB_CONFIG_UNCHANGED);
    }
    open_string(config, arb_area_next(&config->newest), config->length_new, NULL);
    return PHASE_CHECK;
}

static void begin_write(arb_config_t *config)
{
    config->same = false;
    config->at = 0;
    if (config->splice.piece == NULL) {
        config->until = config->length_new;
    }
}

/* next: the phase that follows once the page is being written. */
static phase_t write_page(arb_config_t *config, const arb_nvm_t *nvm, uint16_t address, const uint8_t *bytes,
                          uint16_t len, phase_t next)
{
    if (!arb_nvm_write(nvm, address, bytes, len)) {
        return end(config, ARB_CONFIG_ERR_STORAGE);
    }
    config->writing = true;
    count(config, ARB_CONFIG_PAGES);
    return next;
}

/* Corrects the number of configurations if it stands in these bytes of the new string. It stands in front of
 * the cut, and with no more than 255 configurations the low byte is all that changes. */
static void put_count(const arb_config_t *config, uint16_t at, uint8_t *bytes, uint16_t len)
{
    const uint16_t low = (uint16_t)(config->splice.count_at + 1);
    if (config->splice.has_count && low >= at && low - at < len) {
        bytes[low - at] = config->stored_new;
    }
}

/* Compares or writes the next bytes of the new string. */
static phase_t step_new(arb_config_t *config, const arb_nvm_t *nvm)
{
    uint8_t fresh[ARB_PORT_NVM_PAGE];
    const uint16_t at = config->at;
    const uint16_t room = config->same ? CONFIG_CHUNK : (uint16_t)(sizeof fresh - at % sizeof fresh);
    const uint16_t len = at_most(room, (uint16_t)(config->until - at));
    if (len == 0) {
        return end_part(config);
    }
    if (!put_new(config, nvm, fresh, len)) {
        return end(config, ARB_CONFIG_ERR_STORAGE);
    }
    config->at = (uint16_t)(at + len);
    if (config->same) {
        uint8_t stored[CONFIG_CHUNK];
        if (!read_string(nvm, config->newest.area, at, stored, len)) {
            return end(config, ARB_CONFIG_ERR_STORAGE);
        }
        if (memcmp(stored, fresh, len) != 0) {
            begin_write(config);
            return PHASE_NEW;
        }
        return config->at < config->until ? PHASE_NEW : end_part(config);
    }
    put_count(config, at, fresh, len);
    config->crc_new = arb_crc32(at == 0 ? ARB_CRC32_INIT : config->crc_new, fresh, len);
    return write_page(config, nvm, (uint16_t)(string_address(arb_area_next(&config->newest)) + at), fresh,
                      len, PHASE_NEW);
}

/* The stored string has been read. */
static phase_t end_scan(arb_config_t *config)
{
    const arb_splice_t *splice = &config->splice;
    if (splice->found == ARB_SPLICE_FOUND) {
        config->stored_new--;
    }
    config->length_new = arb_splice_length(splice);
    if (config->length_new > ARB_CONFIG_STRING_MAX) {
        return end(config, ARB_CONFIG_ERR_STORAGE);
    }
    begin_write(config);
    if (config->length_new == config->length) { /* then a block of another length has another last entry */
        config->same = true;
        config->at = splice->from;
        config->until = (uint16_t)(splice->from + splice->block);
    }
    return PHASE_NEW;
}

/* Reads a string; what comes of it at its end. A new one gets its header only if it reads back as it was
 * written, and nothing is built upon a stored one that is damaged (D-PRO-21). */
static phase_t step_read(arb_config_t *config, const arb_nvm_t *nvm)
{
    uint8_t bytes[CONFIG_CHUNK];
    const uint16_t at = config->at;
    if (!read_on(config, nvm, bytes)) {
        return end(config, ARB_CONFIG_ERR_STORAGE);
    }
    for (uint16_t i = 0; config->phase == PHASE_SCAN && config->splice.end == 0 &&
                         at + i + PROFILE_TLV_ENTRY_BYTES <= config->at;
         i = (uint16_t)(i + PROFILE_TLV_ENTRY_BYTES)) {
        arb_splice_scan(&config->splice, (uint16_t)(at + i), &bytes[i]);
    }
    if (config->at < config->until) {
        return (phase_t)config->phase;
    }
    if (config->crc_read != (config->phase == PHASE_CHECK ? config->crc_new : config->crc)) {
        return end(config, ARB_CONFIG_ERR_STORAGE);
    }
    if (config->phase == PHASE_SCAN) {
        return end_scan(config);
    }
    if (config->reader.status != PROFILE_TLV_DONE) {
        return end(config, ARB_CONFIG_ERR_VALUE);
    }
    return config->phase == PHASE_CHECK ? PHASE_HEADER : end(config, ARB_CONFIG_OK);
}

static phase_t step_header(arb_config_t *config, const arb_nvm_t *nvm)
{
    uint8_t header[ARB_CONFIG_HEADER];
    arb_area_put_header(&config->newest, 'C', 0, header);
    pdcp_bytes_put_u16(&header[6], config->until);
    pdcp_bytes_put_u32(&header[CONFIG_MEMBERS], ~arb_crc32(config->crc_read, header, CONFIG_MEMBERS));
    return write_page(config, nvm, header_address(config->from), header, sizeof header, PHASE_ADOPT);
}

static phase_t step_adopt(arb_config_t *config, const arb_nvm_t *nvm)
{
    uint8_t header[ARB_CONFIG_HEADER];
    if (!arb_nvm_read(nvm, header_address(config->from), header, sizeof header) || !adopt(config, header) ||
        config->newest.area != config->from) {
        return end(config, ARB_CONFIG_ERR_STORAGE);
    }
    count(config, ARB_CONFIG_WRITES);
    return end(config, ARB_CONFIG_OK);
}

arb_config_status_t arb_config_step(arb_config_t *config, arb_nvm_t *nvm, uint32_t now_ms)
{
    static const phase_step_t steps[] = {
        [PHASE_READ] = step_read,  [PHASE_SCAN] = step_read,     [PHASE_NEW] = step_new,
        [PHASE_CHECK] = step_read, [PHASE_HEADER] = step_header, [PHASE_ADOPT] = step_adopt,
    };
    if (!arb_config_busy(config)) {
        config->due_ms = now_ms;
        return ARB_CONFIG_RUNNING;
    }
    if (pdcp_time_before(now_ms, config->due_ms)) {
        return ARB_CONFIG_RUNNING;
    }
    const int8_t state = arb_nvm_poll(nvm, ARB_NVM_CONFIG, &config->due_ms, now_ms);
    if (state > 0 && config->polls < ARB_CONFIG_POLLS_MAX) {
        config->polls++;
        return ARB_CONFIG_RUNNING;
    }
    const bool failed = state > 0 || (state < 0 && config->writing);
    config->polls = 0;
    config->writing = false;
    const phase_t next = failed ? end(config, ARB_CONFIG_ERR_STORAGE) : steps[config->phase](config, nvm);
    enter(config, next);
    if (next == PHASE_IDLE) {
        config->due_ms = now_ms;
        return finish(config, nvm);
    }
    if (!config->writing) {
        config->due_ms = now_ms + ARB_CONFIG_PACE_MS;
    }
    return ARB_CONFIG_RUNNING;
}
