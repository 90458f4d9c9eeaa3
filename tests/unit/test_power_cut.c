/* Power cuts at every byte of every kind of write, bit rot, wear, capacity, and a long random life, of what
 * is stored: configurations, identities, flags (profile-layer.md 5, D-BUS-6). Whole contents are compared:
 * the old or the new ones, never a mix. */
#include <stdio.h>
#include <string.h>

#include "arb_config.h"
#include "arb_crc.h"
#include "arb_flags.h"
#include "arb_store.h"
#include "sim_nvm.h"
#include "unity.h"

static sim_nvm_t memory;
static arb_port_t port;
static arb_nvm_t nvm;
static arb_config_t config;
static uint32_t now_ms;
static uint16_t saved_type; /* of the links of the configuration that is saved */
static const arb_config_user_t user;

static void power_on(void)
{
    sim_nvm_power_on(&memory);
    arb_nvm_init(&nvm, &port);
    arb_config_init(&config, &nvm, &user, &saved_type, now_ms);
}

void setUp(void)
{
    sim_nvm_init(&memory);
    sim_nvm_port(&memory, &port);
    now_ms = 0xFFFFFF00u;
    power_on();
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL(0, memory.misuses);
}

/* Strings and jobs -------------------------------------------------------------------------------------- */

typedef struct {
    uint16_t len;
    uint8_t bytes[ARB_CONFIG_STRING_MAX];
} string_t;

static arb_config_status_t outcome;

static arb_config_status_t run(arb_config_status_t started)
{
    if (started < 0) {
        return started;
    }
    for (int steps = 0; arb_config_busy(&config); steps++) {
        TEST_ASSERT_LESS_THAN(5000, steps);
        now_ms = arb_config_next_ms(&config, now_ms);
        outcome = arb_config_step(&config, &nvm, now_ms);
    }
    return outcome;
}

static void get_link(void *ctx, uint8_t k, profile_link_t *link)
{
    const uint16_t *type = ctx;
    memset(link, 0, sizeof *link);
    link->input = (profile_end_t){
        .owner = {.vid = 2, .pid = 3, .sn = 6}, .type = (uint16_t)(*type + k), .profile = 0x1110, .index = k};
    link->output = (profile_end_t){
        .owner = {.vid = 2, .pid = 2, .sn = *type}, .type = 0x5000, .profile = 0x2120, .index = 1};
}

static const arb_config_user_t user = {.link = get_link};

static arb_config_status_t save(uint8_t number, uint8_t count, uint16_t type)
{
    saved_type = type;
    return run(arb_config_save(&config, &number, count));
}

static arb_config_status_t erase(uint8_t number)
{
    return run(arb_config_erase(&config, number));
}

static arb_config_status_t write_raw(const string_t *string, uint16_t size)
{
    arb_config_status_t status = ARB_CONFIG_OK;
    for (uint16_t at = 0; at < string->len && status == ARB_CONFIG_OK; at = (uint16_t)(at + size)) {
        const uint16_t left = (uint16_t)(string->len - at);
        status = run(
            arb_config_write_raw(&config, at, string->len, &string->bytes[at], left < size ? left : size));
    }
    return status;
}

static void get_string(string_t *string)
{
    memset(string, 0, sizeof *string);
    string->len = arb_config_length(&config);
    for (uint16_t at = 0; at < string->len;) {
        uint8_t n = 128;
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, arb_config_read_raw(&config, &nvm, at, &string->bytes[at], &n));
        at = (uint16_t)(at + n);
    }
}

static bool is_equal(const string_t *a, const string_t *b)
{
    return a->len == b->len && memcmp(a->bytes, b->bytes, a->len) == 0;
}

static void expect_string(const string_t *wanted)
{
    static string_t there;
    get_string(&there);
    TEST_ASSERT_EQUAL(wanted->len, there.len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(wanted->bytes, there.bytes, wanted->len);
}

static void put_entry(string_t *string, uint8_t code, uint16_t value)
{
    TEST_ASSERT_LESS_OR_EQUAL(sizeof string->bytes, string->len + 3u);
    profile_tlv_put(&string->bytes[string->len], code, value);
    string->len = (uint16_t)(string->len + 3);
}

static void put_configuration(string_t *string, uint8_t number, uint8_t count, uint16_t type)
{
    put_entry(string, PROFILE_TLV_CONFIGURATION, number);
    put_entry(string, PROFILE_TLV_LINKS, count);
    for (uint8_t k = 0; k < count; k++) {
        profile_link_t link;
        get_link(&type, k, &link);
        for (uint8_t i = 0; i < (uint8_t)PROFILE_TLV_LINK_ENTRIES; i++) {
            uint8_t entry[3];
            profile_tlv_put_link_entry(entry, (uint8_t)(k + 1), &link, i);
            put_entry(string, entry[0], (uint16_t)(entry[1] | entry[2] << 8));
        }
    }
}

/* Power cuts -------------------------------------------------------------------------------------------- */

typedef void (*action_t)(void);

/* Cuts the power at every stride-th byte of what change writes. */
static void cut_everywhere(action_t prepare, action_t change, uint32_t stride)
{
    static sim_nvm_t image;
    static string_t before;
    static string_t after;
    static string_t there;
    uint32_t old_count = 0;
    uint32_t new_count = 0;
    setUp();
    prepare();
    power_on();
    get_string(&before);
    image = memory;
    change();
    const uint32_t bytes = memory.bytes_written - image.bytes_written;
    get_string(&after);
    TEST_ASSERT_FALSE(is_equal(&before, &after));
    for (uint32_t at = 0; at < bytes; at += stride) {
        for (int cut = 0; cut < SIM_NVM_CUTS; cut++) {
            memory = image;
            power_on();
            memory.cut_after = at;
            memory.cut = (sim_nvm_cut_t)cut;
            change();
            power_on();
            get_string(&there);
            const bool is_old = is_equal(&before, &there);
            TEST_ASSERT_TRUE_MESSAGE(is_old || is_equal(&after, &there), "neither the old nor the new set");
            /* The header comes last: before it nothing has changed. */
            TEST_ASSERT_TRUE(is_old || at + ARB_CONFIG_HEADER >= bytes);
            TEST_ASSERT_LESS_OR_EQUAL(1, config.counters[ARB_CONFIG_DAMAGED]);
            old_count += is_old ? 1u : 0u;
            new_count += is_old ? 0u : 1u;
            /* The next save works. */
            TEST_ASSERT_EQUAL(ARB_CONFIG_OK, save(200, 1, 0x7777));
            power_on();
            TEST_ASSERT_EQUAL(0, config.counters[ARB_CONFIG_DAMAGED]);
            TEST_ASSERT_TRUE(arb_config_has(&config, 200));
        }
    }
    TEST_ASSERT_GREATER_THAN(0, old_count);
    if (stride == 1) {
        TEST_ASSERT_GREATER_THAN(0, new_count); /* the last byte happened to be written */
    }
    printf("%lu bytes written, cut at %lu of them in %d ways: %lu times the old set, %lu times the new one\n",
           (unsigned long)bytes, (unsigned long)((bytes + stride - 1) / stride), SIM_NVM_CUTS,
           (unsigned long)old_count, (unsigned long)new_count);
}

static void prepare_nothing(void) {}

static void prepare_three(void)
{
    (void)save(4, 2, 0x5300);
    (void)save(2, 3, 0x5400);
    (void)save(7, 1, 0x5500);
}

static void save_first(void)
{
    (void)save(1, 2, 0x5300);
}

static void save_again(void)
{
    (void)save(2, 4, 0x6400);
}

static void save_more(void)
{
    (void)save(0, 1, 0x6400);
}

static void erase_one(void)
{
    (void)erase(2);
}

static void write_whole(void)
{
    static string_t string;
    string.len = 0;
    put_entry(&string, PROFILE_TLV_CONFIGURATIONS, 2);
    put_configuration(&string, 4, 2, 0x5300);
    put_entry(&string, 99, 0x1234);
    put_configuration(&string, 9, 4, 0x5300);
    put_entry(&string, PROFILE_TLV_END, 0);
    (void)write_raw(&string, 100);
}

static void test_cuts_of_a_save_over_nothing(void)
{
    cut_everywhere(prepare_nothing, save_first, 1);
}

static void test_cuts_of_a_save_over_an_old_one(void)
{
    cut_everywhere(prepare_three, save_again, 1);
}

static void test_cuts_of_a_save_beside_others(void)
{
    cut_everywhere(prepare_three, save_more, 1);
}

static void test_cuts_of_an_erasure(void)
{
    cut_everywhere(prepare_three, erase_one, 1);
}

static void test_cuts_of_a_write_by_the_host(void)
{
    cut_everywhere(prepare_three, write_whole, 1);
}

static void fill(void)
{
    for (uint8_t number = 1; number <= 8; number++) {
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, save(number, 16, (uint16_t)(0x5300 + number)));
    }
}

static void save_one_of_eight(void)
{
    (void)save(3, 16, 0x1234);
}

static void test_cuts_of_a_save_in_a_full_memory(void)
{
    cut_everywhere(fill, save_one_of_eight, 397);
}

/* Bit rot ----------------------------------------------------------------------------------------------- */

static void flip_and_check(uint32_t address, uint8_t bit, const string_t *wanted)
{
    static sim_nvm_t image;
    image = memory;
    memory.bytes[address] ^= (uint8_t)(1u << bit);
    power_on();
    TEST_ASSERT_EQUAL(1, config.counters[ARB_CONFIG_DAMAGED]);
    expect_string(wanted);
    /* The next save goes where the damage is. */
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, save(200, 1, 0x7777));
    power_on();
    TEST_ASSERT_EQUAL(0, config.counters[ARB_CONFIG_DAMAGED]);
    TEST_ASSERT_TRUE(arb_config_has(&config, 200));
    memory = image;
}

static void test_one_rotten_bit_anywhere_and_the_other_area_is_used(void)
{
    static string_t strings[2];
    (void)save(1, 2, 0x5300);
    get_string(&strings[0]);
    (void)save(2, 1, 0x5300);
    get_string(&strings[1]);
    TEST_ASSERT_EQUAL(1, config.newest.area);
    for (unsigned area = 0; area < 2; area++) {
        const uint32_t address = 2048u + 8192u * area;
        for (unsigned bit = 0; bit < 12 * 8; bit++) {
            flip_and_check(address + bit / 8, bit % 8, &strings[1 - area]);
        }
        for (unsigned bit = 0; bit < strings[area].len * 8u; bit++) {
            flip_and_check(address + 64 + bit / 8, bit % 8, &strings[1 - area]);
        }
    }
}

static void test_both_areas_rotten(void)
{
    static const string_t empty = {6, {1, 0, 0, 15, 0, 0}};
    (void)save(1, 2, 0x5300);
    (void)save(2, 1, 0x5300);
    memory.bytes[2048 + 64 + 5] ^= 0x10;
    memory.bytes[10240 + 4] ^= 0x01;
    power_on();
    TEST_ASSERT_EQUAL(2, config.counters[ARB_CONFIG_DAMAGED]);
    TEST_ASSERT_EQUAL(0, config.stored);
    expect_string(&empty);
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, save(5, 1, 0x5300));
    power_on();
    TEST_ASSERT_TRUE(arb_config_has(&config, 5));
}

static void test_an_unknown_format_is_not_used(void)
{
    (void)save(1, 2, 0x5300);
    memory.bytes[2048 + 2] = 2;
    power_on();
    TEST_ASSERT_EQUAL(1, config.counters[ARB_CONFIG_DAMAGED]);
    TEST_ASSERT_EQUAL(0, config.stored);
}

/* A right CRC-32 over a string that the reader rejects: a program with other rules has written it. */
static void test_a_bad_string_under_a_good_crc_is_not_used(void)
{
    for (uint8_t count = 0; count < 2; count++) {
        uint8_t *area = &memory.bytes[2048];
        const uint8_t header[] = {'P', 'C', 1, 0, 9, 0, 6, 0};
        const uint8_t string[] = {1, count, 0, 15, 0, 0};
        memcpy(area, header, sizeof header);
        memcpy(&area[64], string, sizeof string);
        const uint32_t crc =
            ~arb_crc32(arb_crc32(ARB_CRC32_INIT, string, sizeof string), header, sizeof header);
        for (uint8_t i = 0; i < 4; i++) {
            area[8 + i] = (uint8_t)(crc >> (8 * i));
        }
        power_on();
        TEST_ASSERT_EQUAL(count, config.counters[ARB_CONFIG_DAMAGED]);
        TEST_ASSERT_EQUAL(count == 0 ? 9 : 0, config.newest.sequence);
    }
}

static void test_a_memory_that_cannot_be_read_counts_as_empty(void)
{
    (void)save(1, 2, 0x5300);
    memory.reads_fail = true;
    arb_config_init(&config, &nvm, &user, &saved_type, now_ms);
    TEST_ASSERT_EQUAL(0, config.stored);
    TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE, save(2, 1, 0x5300));
}

/* Capacity and wear ------------------------------------------------------------------------------------- */

static void test_eight_configurations_of_sixteen_links_fit(void)
{
    static string_t wanted;
    fill();
    wanted.len = 0;
    put_entry(&wanted, PROFILE_TLV_CONFIGURATIONS, 8);
    for (uint8_t number = 1; number <= 8; number++) {
        put_configuration(&wanted, number, 16, (uint16_t)(0x5300 + number));
    }
    put_entry(&wanted, PROFILE_TLV_END, 0);
    TEST_ASSERT_EQUAL(7350, wanted.len);
    power_on();
    expect_string(&wanted);
    TEST_ASSERT_EQUAL(8, config.stored);
}

/* A string of len bytes: a configuration without links and entries that nobody knows. */
static void make_long(string_t *string, uint16_t len)
{
    string->len = 0;
    put_entry(string, PROFILE_TLV_CONFIGURATIONS, 1);
    put_entry(string, PROFILE_TLV_CONFIGURATION, 1);
    while (string->len + 3 < len) {
        put_entry(string, 77, string->len);
    }
    put_entry(string, PROFILE_TLV_END, 0);
    TEST_ASSERT_EQUAL(len, string->len);
}

static void test_more_than_an_area_holds_changes_nothing(void)
{
    static string_t string;
    static string_t there;
    /* A configuration with one link takes 63 bytes: it fills the area to the last byte. */
    make_long(&string, ARB_CONFIG_STRING_MAX - 63);
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, write_raw(&string, 128));
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, save(2, 1, 0x5300));
    TEST_ASSERT_EQUAL(ARB_CONFIG_STRING_MAX, arb_config_length(&config));
    get_string(&there);
    power_on();
    expect_string(&there);
    /* With one entry more it does not fit. */
    make_long(&string, ARB_CONFIG_STRING_MAX - 60);
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, write_raw(&string, 128));
    const uint32_t writes = memory.writes;
    TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE, save(2, 1, 0x5300));
    TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE, save(1, 255, 0x5300));
    TEST_ASSERT_EQUAL(2, config.counters[ARB_CONFIG_FAILURES]);
    TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE,
                      arb_config_write_raw(&config, 0, ARB_CONFIG_STRING_MAX + 1, string.bytes, 100));
    TEST_ASSERT_EQUAL(writes, memory.writes);
    expect_string(&string);
    power_on();
    expect_string(&string);
    /* As much as an area holds comes from the host, too. */
    make_long(&string, ARB_CONFIG_STRING_MAX);
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, write_raw(&string, 512));
    power_on();
    expect_string(&string);
}

/* Pages of the string and one for the header; none when nothing has changed. */
static void test_writes_of_a_save(void)
{
    for (uint8_t count = 0; count <= 16; count++) {
        setUp();
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, save(1, count, 0x5300));
        const uint32_t length = 12u + 57u * count;
        TEST_ASSERT_EQUAL((length + 63) / 64 + 1, memory.writes);
        TEST_ASSERT_EQUAL(length + 12, memory.bytes_written);
        TEST_ASSERT_EQUAL(memory.writes, config.counters[ARB_CONFIG_PAGES]);
        TEST_ASSERT_EQUAL(ARB_CONFIG_UNCHANGED, save(1, count, 0x5300));
        power_on();
        TEST_ASSERT_EQUAL(ARB_CONFIG_UNCHANGED, save(1, count, 0x5300));
        TEST_ASSERT_EQUAL((length + 63) / 64 + 1, memory.writes);
    }
}

/* The areas take turns, also when the number of writes wraps. */
static void test_wear_is_even(void)
{
    config.newest.sequence = 0xFF00;
    for (uint16_t i = 0; i < 1000; i++) {
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, save(1, 3, (uint16_t)(0x5300 + i)));
        power_on();
        TEST_ASSERT_EQUAL_HEX16((0xFF00u + 1 + i) & 0xFFFFu, config.newest.sequence);
    }
    for (unsigned page = 0; page < 4; page++) {
        TEST_ASSERT_EQUAL(500, memory.page_writes[2048 / 64 + page]);
        TEST_ASSERT_EQUAL(500, memory.page_writes[10240 / 64 + page]);
    }
    for (unsigned page = 4; page < 128; page++) {
        TEST_ASSERT_EQUAL(0, memory.page_writes[2048 / 64 + page]);
        TEST_ASSERT_EQUAL(0, memory.page_writes[10240 / 64 + page]);
    }
}

/* Identities and flags ---------------------------------------------------------------------------------- */

static arb_store_t store;
static pdcp_bind_t bind;
static arb_flags_t flags;

static void load_store(void)
{
    memset(&bind, 0, sizeof bind);
    arb_store_load(&store, &nvm, &bind);
}

static void remember(uint16_t sn, uint8_t node_id)
{
    const pdcp_remembered_t entry = {.identity = {.vid = 2, .pid = 3, .sn = sn}, .node_id = node_id};
    TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&bind, &entry));
}

static void write_store(void)
{
    arb_store_touch(&store, now_ms);
    for (int i = 0; i < 200; i++) {
        now_ms = arb_store_next_ms(&store, now_ms);
        arb_store_step(&store, &bind, now_ms);
        if (!store.changed) {
            break;
        }
    }
    TEST_ASSERT_FALSE(store.changed);
    TEST_ASSERT_EQUAL(ARB_NVM_NOBODY, nvm.owner);
}

/* The table as text, for comparing. */
static void describe(char *text, size_t size)
{
    size_t at = 0;
    text[0] = '\0';
    for (uint8_t i = 0; i < bind.remembered_count; i++) {
        const pdcp_remembered_t *entry = &bind.remembered[i];
        at += (size_t)snprintf(&text[at], size - at, "%u:%u:%u=%u ", entry->identity.vid, entry->identity.pid,
                               entry->identity.sn, entry->node_id);
    }
}

static void test_cuts_of_an_identity_update(void)
{
    static sim_nvm_t image;
    char before[512];
    char after[512];
    char there[512];
    char later[512];
    load_store();
    for (uint16_t sn = 1; sn <= 10; sn++) {
        remember(sn, (uint8_t)sn);
    }
    write_store();
    describe(before, sizeof before);
    image = memory;
    remember(77, 99);
    describe(after, sizeof after);
    write_store();
    const uint32_t bytes = memory.bytes_written - image.bytes_written;
    TEST_ASSERT_EQUAL(6 + 7 * 11 + 4, bytes);
    for (uint32_t at = 0; at < bytes; at++) {
        for (int cut = 0; cut < SIM_NVM_CUTS; cut++) {
            memory = image;
            power_on();
            load_store();
            describe(there, sizeof there);
            TEST_ASSERT_EQUAL_STRING(before, there);
            remember(77, 99);
            memory.cut_after = at;
            memory.cut = (sim_nvm_cut_t)cut;
            write_store();
            power_on();
            load_store();
            describe(there, sizeof there);
            TEST_ASSERT_TRUE(strcmp(before, there) == 0 || strcmp(after, there) == 0);
            TEST_ASSERT_TRUE(strcmp(before, there) == 0 || at == bytes - 1);
            remember(78, 100);
            describe(there, sizeof there);
            write_store();
            power_on();
            load_store();
            describe(later, sizeof later);
            TEST_ASSERT_EQUAL_STRING(there, later);
            TEST_ASSERT_EQUAL(0, store.damaged);
        }
    }
}

static void write_flags(uint8_t value)
{
    arb_flags_set(&flags, value, now_ms);
    for (int i = 0; i < 20; i++) {
        now_ms += 5;
        arb_flags_step(&flags, &nvm, now_ms);
    }
}

static void test_cuts_of_the_flags(void)
{
    for (uint32_t at = 0; at < 11; at++) {
        for (int cut = 0; cut < SIM_NVM_CUTS; cut++) {
            setUp();
            arb_flags_load(&flags, &nvm);
            write_flags(0x0A);
            write_flags(0x05);
            memory.cut_after = at;
            memory.cut = (sim_nvm_cut_t)cut;
            write_flags(0x09);
            power_on();
            arb_flags_load(&flags, &nvm);
            const uint8_t there = arb_flags_get(&flags);
            TEST_ASSERT_TRUE(there == 0x05 || (there == 0x09 && at == 10));
            write_flags(0x06);
            arb_flags_load(&flags, &nvm);
            TEST_ASSERT_EQUAL_HEX8(0x06, arb_flags_get(&flags));
        }
    }
}

/* All three at once on a memory whose pages take long: everybody's data is right, nobody takes another one's
 * failure for its own, and nobody touches the memory while a page is under way (tearDown). */
static void test_three_users_of_one_memory(void)
{
    for (uint32_t failing = 0; failing < 14; failing++) {
        saved_type = 0x5300;
        uint8_t number = 1;
        setUp();
        load_store();
        arb_flags_load(&flags, &nvm);
        memory.busy_polls = 2;
        memory.fail_after = failing;
        remember(5, 5);
        arb_store_touch(&store, now_ms - ARB_STORE_DELAY_MS);
        arb_flags_set(&flags, 0x08, now_ms);
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, arb_config_save(&config, &number, 9));
        outcome = ARB_CONFIG_RUNNING;
        for (int i = 0; i < 3000; i++) {
            memory.fail_after = memory.failed ? SIM_NVM_NEVER : memory.fail_after;
            const arb_config_status_t status = arb_config_step(&config, &nvm, now_ms);
            if (status != ARB_CONFIG_RUNNING) {
                outcome = status;
            }
            arb_store_step(&store, &bind, now_ms);
            arb_flags_step(&flags, &nvm, now_ms);
            now_ms++;
        }
        TEST_ASSERT_EQUAL(ARB_NVM_NOBODY, nvm.owner);
        /* One of them has met the failure; two try again by themselves. */
        const uint32_t failures = store.failures + flags.failures + config.counters[ARB_CONFIG_FAILURES];
        TEST_ASSERT_EQUAL(failing < 12 ? 1 : 0, failures);
        TEST_ASSERT_EQUAL(config.counters[ARB_CONFIG_FAILURES] != 0 ? ARB_CONFIG_ERR_STORAGE : ARB_CONFIG_OK,
                          outcome);
        power_on();
        load_store();
        arb_flags_load(&flags, &nvm);
        TEST_ASSERT_EQUAL(1, bind.remembered_count);
        TEST_ASSERT_EQUAL_HEX8(0x08, arb_flags_get(&flags));
        TEST_ASSERT_EQUAL(outcome == ARB_CONFIG_OK ? 1 : 0, config.stored);
    }
}

/* A long random life ------------------------------------------------------------------------------------ */

enum { MODEL_MAX = 6 };

/* What should be stored. */
typedef struct {
    int count;
    struct {
        uint8_t number;
        uint8_t links;
        uint16_t type;
    } items[MODEL_MAX];
} model_t;

static uint32_t chance;

static uint32_t random_below(uint32_t limit)
{
    chance ^= chance << 13;
    chance ^= chance >> 17;
    chance ^= chance << 5;
    return chance % limit;
}

static void make_string(const model_t *model, string_t *string)
{
    string->len = 0;
    put_entry(string, PROFILE_TLV_CONFIGURATIONS, (uint16_t)model->count);
    for (int i = 0; i < model->count; i++) {
        put_configuration(string, model->items[i].number, model->items[i].links, model->items[i].type);
    }
    put_entry(string, PROFILE_TLV_END, 0);
}

static int find(const model_t *model, uint8_t number)
{
    int i = 0;
    while (i < model->count && model->items[i].number != number) {
        i++;
    }
    return i;
}

static void model_save(model_t *model, uint8_t number, uint8_t links, uint16_t type)
{
    const int at = find(model, number);
    model->count += at == model->count ? 1 : 0;
    model->items[at].number = number;
    model->items[at].links = links;
    model->items[at].type = type;
}

static void model_erase(model_t *model, uint8_t number)
{
    const int at = find(model, number);
    model->count--;
    memmove(&model->items[at], &model->items[at + 1], (size_t)(model->count - at) * sizeof model->items[0]);
}

/* One random change, with whatever faults are set. model becomes what should be stored if it succeeds;
 * returns how it ended. */
static arb_config_status_t change_at_random(model_t *model)
{
    static string_t string;
    const uint8_t number = (uint8_t)(1 + random_below(MODEL_MAX));
    const uint8_t links = (uint8_t)random_below(4);
    const uint16_t type = (uint16_t)random_below(2);
    switch (random_below(4)) {
    case 0:
        if (find(model, number) < model->count) {
            model_erase(model, number);
            return erase(number);
        }
        return arb_config_erase(&config, number);
    case 1:
        model->count = 0;
        for (uint32_t i = random_below(4); i > 0; i--) {
            model_save(model, (uint8_t)(1 + random_below(MODEL_MAX)), (uint8_t)random_below(4), type);
        }
        make_string(model, &string);
        return write_raw(&string, (uint16_t)(1 + random_below(200)));
    default:
        model_save(model, number, links, type);
        return save(number, links, type);
    }
}

/* Also a host's write that stops half way, or that is bad. */
static void disturb_at_random(const model_t *model)
{
    static string_t string;
    make_string(model, &string);
    if (random_below(2) == 0) {
        string.bytes[3 * random_below(string.len / 3u) + 1] ^= (uint8_t)(1u << random_below(8));
        string.bytes[string.len - 3] = 0; /* no end */
        TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_VALUE, write_raw(&string, (uint16_t)(1 + random_below(200))));
    } else if (string.len > 6) {
        const uint16_t len = (uint16_t)(1 + random_below(string.len - 1u));
        string.bytes[random_below(len)] ^= 0x10;
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK,
                          run(arb_config_write_raw(&config, 0, string.len, string.bytes, len)));
    }
}

static void set_faults_at_random(void)
{
    memory.busy_polls = (uint8_t)random_below(3);
    memory.cut = (sim_nvm_cut_t)random_below(SIM_NVM_CUTS);
    if (random_below(3) == 0) {
        memory.cut_after = random_below(800);
    } else if (random_below(8) == 0) {
        memory.fail_after = random_below(10);
    }
}

/* One change and what comes of it; model is what is stored. */
static void live_once(model_t *model, uint32_t *cuts)
{
    static string_t before;
    static string_t after;
    static string_t there;
    model_t next = *model;
    if (random_below(6) == 0) {
        disturb_at_random(model);
    }
    set_faults_at_random();
    make_string(model, &before);
    const arb_config_status_t status = change_at_random(&next);
    make_string(&next, &after);
    if (memory.off) {
        (*cuts)++;
        power_on();
        get_string(&there);
        TEST_ASSERT_TRUE(is_equal(&before, &there) || is_equal(&after, &there));
        *model = is_equal(&after, &there) ? next : *model;
        return;
    }
    memory.busy_polls = 0;
    memory.polls_left = 0;
    switch (status) {
    case ARB_CONFIG_OK:
    case ARB_CONFIG_UNCHANGED:
        TEST_ASSERT_EQUAL(status == ARB_CONFIG_UNCHANGED, is_equal(&before, &after));
        *model = next;
        expect_string(&after);
        break;
    case ARB_CONFIG_ERR_NUMBER:
        expect_string(&before);
        break;
    default:
        TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE, status);
        TEST_ASSERT_TRUE(memory.failed);
        expect_string(&before);
        break;
    }
    sim_nvm_power_on(&memory);
    if (random_below(3) == 0) {
        power_on();
        expect_string(status >= 0 ? &after : &before);
    }
}

static void test_a_long_random_life(void)
{
    model_t model = {0};
    uint32_t cuts = 0;
    uint32_t steps = 0;
    chance = 20090401;
    for (int sequence = 0; sequence < 10000; sequence++) {
        if (random_below(50) == 0) { /* a new memory */
            sim_nvm_init(&memory);
            power_on();
            model.count = 0;
        }
        for (uint32_t i = 1 + random_below(8); i > 0; i--, steps++) {
            live_once(&model, &cuts);
        }
        power_on();
    }
    TEST_ASSERT_GREATER_THAN(1000, cuts);
    printf("%lu changes, %lu of them cut\n", (unsigned long)steps, (unsigned long)cuts);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_cuts_of_a_save_over_nothing);
    RUN_TEST(test_cuts_of_a_save_over_an_old_one);
    RUN_TEST(test_cuts_of_a_save_beside_others);
    RUN_TEST(test_cuts_of_an_erasure);
    RUN_TEST(test_cuts_of_a_write_by_the_host);
    RUN_TEST(test_cuts_of_a_save_in_a_full_memory);
    RUN_TEST(test_one_rotten_bit_anywhere_and_the_other_area_is_used);
    RUN_TEST(test_both_areas_rotten);
    RUN_TEST(test_an_unknown_format_is_not_used);
    RUN_TEST(test_a_bad_string_under_a_good_crc_is_not_used);
    RUN_TEST(test_a_memory_that_cannot_be_read_counts_as_empty);
    RUN_TEST(test_eight_configurations_of_sixteen_links_fit);
    RUN_TEST(test_more_than_an_area_holds_changes_nothing);
    RUN_TEST(test_writes_of_a_save);
    RUN_TEST(test_wear_is_even);
    RUN_TEST(test_cuts_of_an_identity_update);
    RUN_TEST(test_cuts_of_the_flags);
    RUN_TEST(test_three_users_of_one_memory);
    RUN_TEST(test_a_long_random_life);
    return UNITY_END();
}
