/* Reads the memory with code of its own: header, checksum and string as arb_config.h and profile-layer.md 5
 * describe them. */
#include <string.h>

#include "life.h"
#include "unity.h"

enum { AREAS_AT = 2048, AREA_BYTES = 8192, STRING_AT = 64, STRING_LONGEST = 7680, ENTRY = 3, NUMBERS = 256 };

/* Where the configurations stand in a string. */
typedef struct {
    uint16_t from[NUMBERS]; /* by number; 0: it has none */
    uint16_t to[NUMBERS];
    int count;
} table_t;

static uint16_t word_at(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | bytes[1] << 8);
}

static uint32_t crc32(uint32_t crc, const uint8_t *bytes, unsigned len)
{
    for (unsigned i = 0; i < len; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ ((crc & 1u) != 0 ? 0xEDB88320u : 0);
        }
    }
    return crc;
}

/* How many links a configuration holds that begins here, and where it ends. -1: an index is given twice. */
static int read_links(const uint8_t *string, uint16_t len, uint16_t *at, uint16_t *told)
{
    bool seen[NUMBERS] = {false};
    int links = 0;
    *told = 0;
    for (; *at + ENTRY <= len && string[*at] != 2 && string[*at] != 15; *at = (uint16_t)(*at + ENTRY)) {
        const uint16_t value = word_at(&string[*at + 1]);
        if (string[*at] == 3) {
            *told = value;
        } else if (string[*at] == 4) {
            if (value >= NUMBERS || seen[value]) {
                return -1;
            }
            seen[value] = true;
            links++;
        }
    }
    return links;
}

static bool read_table(const uint8_t *string, uint16_t len, table_t *table)
{
    uint16_t told = 0;
    uint16_t at = 0;
    memset(table, 0, sizeof *table);
    while (at + ENTRY <= len && string[at] != 15) {
        const uint8_t code = string[at];
        const uint16_t value = word_at(&string[at + 1]);
        const uint16_t from = at;
        at = (uint16_t)(at + ENTRY);
        if (code == 1) {
            told = value;
        } else if (code == 2) {
            uint16_t links_told;
            if (value == 0 || value >= NUMBERS || table->to[value] != 0 ||
                read_links(string, len, &at, &links_told) != links_told) {
                return false;
            }
            table->from[value] = from;
            table->to[value] = at;
            table->count++;
        }
    }
    return at + ENTRY <= len && table->count == told;
}

bool life_memory_is_good(const uint8_t *string, uint16_t len)
{
    table_t table;
    return read_table(string, len, &table);
}

int life_memory_count(const life_memory_t *memory)
{
    table_t table;
    return memory->len != 0 && read_table(memory->string, memory->len, &table) ? table.count : 0;
}

/* The string of an area; 0: it has none that is good. */
static uint16_t read_area(const sim_nvm_t *nvm, int area, uint16_t *sequence)
{
    const uint8_t *at = &nvm->bytes[AREAS_AT + area * AREA_BYTES];
    const uint16_t len = word_at(&at[6]);
    *sequence = word_at(&at[4]);
    if (at[0] != 'P' || at[1] != 'C' || at[2] != 1 || len > STRING_LONGEST) {
        return 0;
    }
    const uint32_t crc = ~crc32(crc32(0xFFFFFFFFu, &at[STRING_AT], len), at, 8);
    const uint32_t stored = word_at(&at[8]) | (uint32_t)word_at(&at[10]) << 16;
    return crc == stored ? len : 0;
}

static uint16_t find_newest(const sim_nvm_t *nvm, const uint8_t **string)
{
    uint16_t sequences[2];
    const uint16_t lens[2] = {read_area(nvm, 0, &sequences[0]), read_area(nvm, 1, &sequences[1])};
    const bool second =
        lens[1] != 0 && (lens[0] == 0 || (int16_t)(uint16_t)(sequences[1] - sequences[0]) > 0);
    *string = &nvm->bytes[AREAS_AT + (second ? AREA_BYTES : 0) + STRING_AT];
    return lens[second ? 1 : 0];
}

/* In how many configurations do two strings differ? */
static int differences(const uint8_t *a, uint16_t a_len, const uint8_t *b, uint16_t b_len)
{
    static table_t before;
    static table_t after;
    int count = 0;
    (void)read_table(a, a_len, &before);
    (void)read_table(b, b_len, &after);
    for (int i = 0; i < NUMBERS; i++) {
        const int a_size = before.to[i] - before.from[i];
        const int b_size = after.to[i] - after.from[i];
        count += a_size != b_size || memcmp(&a[before.from[i]], &b[after.from[i]], (size_t)a_size) != 0;
    }
    return count;
}

/* A header was written: what is the newest copy now? The host's string as it was sent, or the one before with
 * another, a new or without one configuration. */
static void look(life_memory_t *memory)
{
    const uint8_t *string;
    const uint16_t len = find_newest(memory->nvm, &string);
    if (len == memory->len && memcmp(string, memory->string, len) == 0) {
        return;
    }
    const life_host_t *host = memory->host;
    TEST_ASSERT_TRUE_MESSAGE(len != 0 || memory->unsure, "the stored configurations are gone");
    TEST_ASSERT_TRUE_MESSAGE(len == 0 || life_memory_is_good(string, len), "a bad string is stored");
    const bool is_hosts = (len == host->string_len && memcmp(string, host->string, len) == 0) ||
                          (len == host->before_len && memcmp(string, host->before, len) == 0);
    TEST_ASSERT_TRUE_MESSAGE(is_hosts || memory->unsure ||
                                 differences(memory->string, memory->len, string, len) <= 1,
                             "what is stored nobody has written");
    memcpy(memory->string, string, len);
    memory->len = len;
    memory->changes++;
}

void life_memory_start(life_memory_t *memory)
{
    memory->unsure = false;
    look(memory);
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    life_memory_t *memory = ctx;
    return memory->port.nvm_read(memory->port.ctx, address, bytes, size);
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    life_memory_t *memory = ctx;
    const bool taken = memory->port.nvm_write(memory->port.ctx, address, bytes, size);
    if (address >= AREAS_AT) {
        look(memory);
    }
    return taken;
}

static int8_t nvm_status(void *ctx)
{
    life_memory_t *memory = ctx;
    return memory->port.nvm_status(memory->port.ctx);
}

void life_memory_init(life_memory_t *memory, limb_t *limb, const life_host_t *host)
{
    memset(memory, 0, sizeof *memory);
    memory->nvm = &limb->nvm;
    memory->host = host;
    sim_nvm_port(&limb->nvm, &memory->port);
    limb->memory.ctx = memory;
    limb->memory.nvm_read = nvm_read;
    limb->memory.nvm_write = nvm_write;
    limb->memory.nvm_status = nvm_status;
}
