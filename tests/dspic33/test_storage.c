/* Identities, flags and configurations in program flash: what fits, what happens when no more does, and that
 * the memory never gets too full for what it keeps. The real layers over the flash registers. */
#include <string.h>
#include <xc.h>

#include "arb_config.h"
#include "arb_flags.h"
#include "arb_store.h"
#include "fake.h"
#include "nvm.h"
#include "part.h"
#include "unity.h"

PART_ASSERT(storage_keeps_to_the_pages_of_the_flash, ARB_NVM_PAGES <= NVM_FLASH_PAGES);

enum {
    LINKS = 3,
    STEPS_MAX = 20000,
    CONFIGURATION = PROFILE_TLV_CONFIGURATION_BYTES + LINKS * PROFILE_TLV_LINK_BYTES
};
enum { FIT = (ARB_CONFIG_STRING_MAX - PROFILE_TLV_FRAME_BYTES) / CONFIGURATION };

static hal_nvm_t *memory;
static arb_nvm_t nvm;
static arb_config_t config;
static arb_flags_t flags;
static arb_store_t store;
static pdcp_bind_t bind;
static uint32_t now_ms;
static uint16_t saved_kind; /* of the links of the configuration that is saved */
static const arb_config_user_t user;
static arb_config_status_t outcome;

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    return hal_nvm_read(memory, address, bytes, size);
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    return hal_nvm_write(memory, address, bytes, size);
}

static int8_t nvm_status(void *ctx)
{
    (void)ctx;
    return (int8_t)hal_nvm_status(memory);
}

static const arb_port_t port = {.nvm_read = nvm_read, .nvm_write = nvm_write, .nvm_status = nvm_status};

static void power_on(bool keep)
{
    fake.flash_cut_after = FAKE_NEVER;
    fake_power_on(keep);
    fake_enable_interrupts();
    memory = nvm_open();
    memset(&bind, 0, sizeof bind);
    arb_nvm_init(&nvm, &port);
    arb_store_load(&store, &nvm, &bind);
    arb_flags_load(&flags, &nvm);
    arb_config_init(&config, &nvm, &user, &saved_kind, now_ms);
}

void setUp(void)
{
    power_on(false);
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

/* Until nobody has anything to do. */
static void settle(void)
{
    for (int steps = 0; arb_config_busy(&config) || store.changed || flags.flags != flags.stored; steps++) {
        TEST_ASSERT_LESS_THAN(STEPS_MAX, steps);
        now_ms++;
        (void)arb_config_step(&config, &nvm, now_ms);
        arb_store_step(&store, &bind, now_ms);
        arb_flags_step(&flags, &nvm, now_ms);
    }
}

/* All links of a configuration are of one kind. */
static void get_link(void *ctx, uint8_t k, profile_link_t *link)
{
    const uint16_t *kind = ctx;
    memset(link, 0, sizeof *link);
    link->input = (profile_end_t){.owner = {2, 2, 6}, .type = *kind, .profile = 0x1110, .index = k};
    link->output = (profile_end_t){.owner = {2, 2, 4}, .type = 0x5000, .profile = 0x2120, .index = 1};
}

/* Steps only the configurations: the others may be cut off with them. */
static arb_config_status_t run(arb_config_status_t started)
{
    TEST_ASSERT_EQUAL_INT(ARB_CONFIG_OK, started);
    for (int steps = 0; arb_config_busy(&config); steps++) {
        TEST_ASSERT_LESS_THAN(STEPS_MAX, steps);
        now_ms++;
        outcome = arb_config_step(&config, &nvm, now_ms);
    }
    return outcome;
}

static const arb_config_user_t user = {.link = get_link};

static arb_config_status_t save(uint8_t number, uint8_t count, uint16_t kind)
{
    saved_kind = kind;
    return run(arb_config_save(&config, &number, count));
}

static arb_config_status_t erase(uint8_t number)
{
    return run(arb_config_erase(&config, number));
}

typedef struct {
    uint16_t len;
    uint8_t bytes[ARB_CONFIG_STRING_MAX];
} string_t;

static string_t get_string(void)
{
    string_t string = {.len = arb_config_length(&config)};
    for (uint16_t at = 0; at < string.len;) {
        uint8_t n = ARB_CONFIG_READ_MAX;
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, arb_config_read_raw(&config, &nvm, at, &string.bytes[at], &n));
        at = (uint16_t)(at + n);
    }
    return string;
}

static bool is_equal(const string_t *a, const string_t *b)
{
    return a->len == b->len && memcmp(a->bytes, b->bytes, a->len) == 0;
}

static void expect_string(const string_t *wanted)
{
    const string_t there = get_string();
    TEST_ASSERT_EQUAL_UINT16(wanted->len, there.len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(wanted->bytes, there.bytes, wanted->len);
}

/* As many identities as are kept, each with another node id than in another round. */
static void store_identities(uint8_t round)
{
    bind.remembered_count = 0;
    for (uint8_t i = 0; i < PDCP_IDENTITIES_MAX; i++) {
        const pdcp_remembered_t entry = {.identity = {1, (uint16_t)(i + 1), round},
                                         .node_id = (uint8_t)(PDCP_NODE_MIN + i)};
        TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&bind, &entry));
    }
    arb_store_touch(&store, now_ms);
    arb_flags_set(&flags, round & ARB_FLAGS_STORED, now_ms);
    settle();
}

static void expect_identities(uint8_t round)
{
    TEST_ASSERT_EQUAL_UINT8(PDCP_IDENTITIES_MAX, bind.remembered_count);
    for (uint8_t i = 0; i < PDCP_IDENTITIES_MAX; i++) {
        TEST_ASSERT_EQUAL_UINT16(i + 1, bind.remembered[i].identity.pid);
        TEST_ASSERT_EQUAL_UINT16(round, bind.remembered[i].identity.sn);
    }
    TEST_ASSERT_EQUAL_HEX8(round & ARB_FLAGS_STORED, arb_flags_get(&flags));
}

/* Configurations of 3 links until no more fits. */
static void fill(void)
{
    for (uint8_t number = 1; number <= FIT; number++) {
        TEST_ASSERT_EQUAL_INT(ARB_CONFIG_OK, save(number, LINKS, number));
    }
}

/* docs/hardware.md says so: areas of 2 and of 5 pages on the smaller part. */
static void test_what_fits_is_what_the_guide_says(void)
{
    const bool small = PART_FLASH_STORE_PAGES == 2;
    TEST_ASSERT_EQUAL_HEX32(small ? 0x9800 : 0x8000, PART_FLASH_STORE_AT);
    TEST_ASSERT_EQUAL_INT(small ? 576 : 2112, ARB_CONFIG_STRING_MAX);
    TEST_ASSERT_EQUAL_INT(small ? 3 : 11, FIT);
    const uint8_t most = small ? 9 : 36; /* links of one configuration */
    TEST_ASSERT_EQUAL_INT(ARB_CONFIG_OK, save(1, most, 1));
    TEST_ASSERT_EQUAL_INT(ARB_CONFIG_ERR_STORAGE, save(1, (uint8_t)(most + 1), 2));
}

/* D-MCU-6: all at their largest, each in both of its copies, over and over again. */
static void test_memory_never_gets_too_full(void)
{
    fill();
    for (uint8_t round = 1; round <= 10; round++) {
        store_identities(round);
        for (uint8_t number = 1; number <= FIT; number++) {
            TEST_ASSERT_EQUAL_INT(ARB_CONFIG_OK, save(number, LINKS, (uint16_t)(round << 8 | number)));
        }
        const string_t before = get_string();
        power_on(true);
        expect_identities(round);
        expect_string(&before);
    }
    TEST_ASSERT_EQUAL_UINT32(0, store.failures);
    TEST_ASSERT_EQUAL_UINT8(0, flags.failures);
    TEST_ASSERT_EQUAL_UINT32(0, config.counters[ARB_CONFIG_DAMAGED]);
}

static void test_configuration_too_many_is_refused_and_erasing_one_makes_room(void)
{
    store_identities(1);
    store_identities(2);
    fill();
    const string_t before = get_string();
    TEST_ASSERT_EQUAL_INT(ARB_CONFIG_ERR_STORAGE, save(FIT + 1, LINKS, 99));
    TEST_ASSERT_EQUAL_UINT32(1, config.counters[ARB_CONFIG_FAILURES]);
    expect_string(&before);
    store_identities(3); /* it goes on */
    power_on(true);
    expect_string(&before);
    expect_identities(3);
    TEST_ASSERT_FALSE(arb_config_has(&config, FIT + 1));
    TEST_ASSERT_EQUAL_INT(ARB_CONFIG_OK, erase(1));
    TEST_ASSERT_EQUAL_INT(ARB_CONFIG_OK, save(FIT + 1, LINKS, 99));
    power_on(true);
    TEST_ASSERT_FALSE(arb_config_has(&config, 1));
    TEST_ASSERT_TRUE(arb_config_has(&config, FIT + 1));
    TEST_ASSERT_EQUAL_UINT16(before.len, arb_config_length(&config));
    expect_identities(3);
}

/* The host's string of the same length: refused before a piece of it is taken. */
static void test_string_too_long_is_refused(void)
{
    static const uint8_t piece[ARB_PORT_NVM_PAGE] = {PROFILE_TLV_CONFIGURATIONS};
    TEST_ASSERT_EQUAL_INT(ARB_CONFIG_ERR_STORAGE,
                          arb_config_write_raw(&config, 0, ARB_CONFIG_STRING_MAX + 1, piece, sizeof piece));
}

static void store_all(void)
{
    power_on(false);
    store_identities(1);
    store_identities(2);
    fill();
}

/* Writes into a full log: most move it to the other area. */
static void test_power_may_fail_while_a_full_memory_is_written(void)
{
    bool whole = false;
    store_all();
    TEST_ASSERT_EQUAL_INT(ARB_CONFIG_OK, save(1, LINKS, 77));
    const string_t after = get_string();
    for (int cut = 0; !whole; cut += 61) {
        store_all();
        const string_t before = get_string();
        fake.flash_cut_after = cut;
        (void)save(1, LINKS, 77);
        whole = fake.flash_cut_after > 0;
        power_on(true);
        expect_identities(2);
        const string_t there = get_string();
        TEST_ASSERT_TRUE(is_equal(&there, &after) || (!whole && is_equal(&there, &before)));
        TEST_ASSERT_EQUAL_INT(ARB_CONFIG_OK, save(FIT, LINKS, 88));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_fits_is_what_the_guide_says);
    RUN_TEST(test_memory_never_gets_too_full);
    RUN_TEST(test_configuration_too_many_is_refused_and_erasing_one_makes_room);
    RUN_TEST(test_string_too_long_is_refused);
    RUN_TEST(test_power_may_fail_while_a_full_memory_is_written);
    return UNITY_END();
}
