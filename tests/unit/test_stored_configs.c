/* Bit rot, capacity, wear, and a long random life with power cuts, of stored configurations (profile-layer.md
 * 5). Whole contents are compared. */
#include <stdio.h>
#include <string.h>

#include "arb_crc.h"
#include "stored.h"
#include "unity.h"

void setUp(void)
{
    stored_start();
}

void tearDown(void)
{
    stored_stop();
}

/* --- Bit rot --- */

static void flip_and_check(uint32_t address, uint8_t bit, const stored_string_t *wanted)
{
    static sim_nvm_t image;
    image = stored.memory;
    stored.memory.bytes[address] ^= (uint8_t)(1u << bit);
    stored_power_on();
    TEST_ASSERT_EQUAL(1, stored.config.counters[ARB_CONFIG_DAMAGED]);
    stored_expect_string(wanted);
    /* The next save goes where the damage is. */
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_save(200, 1, 0x7777));
    stored_power_on();
    TEST_ASSERT_EQUAL(0, stored.config.counters[ARB_CONFIG_DAMAGED]);
    TEST_ASSERT_TRUE(arb_config_has(&stored.config, 200));
    stored.memory = image;
}

static void test_one_rotten_bit_anywhere_and_the_other_area_is_used(void)
{
    static stored_string_t strings[2];
    (void)stored_save(1, 2, 0x5300);
    stored_get_string(&strings[0]);
    (void)stored_save(2, 1, 0x5300);
    stored_get_string(&strings[1]);
    TEST_ASSERT_EQUAL(1, stored.config.newest.area);
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
    static const stored_string_t empty = {6, {1, 0, 0, 15, 0, 0}};
    (void)stored_save(1, 2, 0x5300);
    (void)stored_save(2, 1, 0x5300);
    stored.memory.bytes[2048 + 64 + 5] ^= 0x10;
    stored.memory.bytes[10240 + 4] ^= 0x01;
    stored_power_on();
    TEST_ASSERT_EQUAL(2, stored.config.counters[ARB_CONFIG_DAMAGED]);
    TEST_ASSERT_EQUAL(0, stored.config.stored);
    stored_expect_string(&empty);
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_save(5, 1, 0x5300));
    stored_power_on();
    TEST_ASSERT_TRUE(arb_config_has(&stored.config, 5));
}

static void test_an_unknown_format_is_not_used(void)
{
    (void)stored_save(1, 2, 0x5300);
    stored.memory.bytes[2048 + 2] = 2;
    stored_power_on();
    TEST_ASSERT_EQUAL(1, stored.config.counters[ARB_CONFIG_DAMAGED]);
    TEST_ASSERT_EQUAL(0, stored.config.stored);
}

/* A right CRC-32 over a string that the reader rejects: a program with other rules has written it. */
static void test_a_bad_string_under_a_good_crc_is_not_used(void)
{
    for (uint8_t count = 0; count < 2; count++) {
        uint8_t *area = &stored.memory.bytes[2048];
        const uint8_t header[] = {'P', 'C', 1, 0, 9, 0, 6, 0};
        const uint8_t string[] = {1, count, 0, 15, 0, 0};
        memcpy(area, header, sizeof header);
        memcpy(&area[64], string, sizeof string);
        const uint32_t crc =
            ~arb_crc32(arb_crc32(ARB_CRC32_INIT, string, sizeof string), header, sizeof header);
        for (uint8_t i = 0; i < 4; i++) {
            area[8 + i] = (uint8_t)(crc >> (8 * i));
        }
        stored_power_on();
        TEST_ASSERT_EQUAL(count, stored.config.counters[ARB_CONFIG_DAMAGED]);
        TEST_ASSERT_EQUAL(count == 0 ? 9 : 0, stored.config.newest.sequence);
    }
}

static void test_a_memory_that_cannot_be_read_counts_as_empty(void)
{
    (void)stored_save(1, 2, 0x5300);
    stored.memory.reads_fail = true;
    stored_load();
    TEST_ASSERT_EQUAL(0, stored.config.stored);
    TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE, stored_save(2, 1, 0x5300));
}

/* --- Capacity and wear --- */

static void test_eight_configurations_of_sixteen_links_fit(void)
{
    static stored_string_t wanted;
    stored_fill();
    wanted.len = 0;
    stored_put_entry(&wanted, PROFILE_TLV_CONFIGURATIONS, 8);
    for (uint8_t number = 1; number <= 8; number++) {
        stored_put_configuration(&wanted, number, 16, (uint16_t)(0x5300 + number));
    }
    stored_put_entry(&wanted, PROFILE_TLV_END, 0);
    TEST_ASSERT_EQUAL(7350, wanted.len);
    stored_power_on();
    stored_expect_string(&wanted);
    TEST_ASSERT_EQUAL(8, stored.config.stored);
}

/* A string of len bytes: a configuration without links and entries that nobody knows. */
static void make_long(stored_string_t *string, uint16_t len)
{
    string->len = 0;
    stored_put_entry(string, PROFILE_TLV_CONFIGURATIONS, 1);
    stored_put_entry(string, PROFILE_TLV_CONFIGURATION, 1);
    while (string->len + 3 < len) {
        stored_put_entry(string, 77, string->len);
    }
    stored_put_entry(string, PROFILE_TLV_END, 0);
    TEST_ASSERT_EQUAL(len, string->len);
}

static void test_more_than_an_area_holds_changes_nothing(void)
{
    static stored_string_t string;
    static stored_string_t there;
    /* A configuration with one link takes 63 bytes: it fills the area to the last byte. */
    make_long(&string, ARB_CONFIG_STRING_MAX - 63);
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_write_raw(&string, 128));
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_save(2, 1, 0x5300));
    TEST_ASSERT_EQUAL(ARB_CONFIG_STRING_MAX, arb_config_length(&stored.config));
    stored_get_string(&there);
    stored_power_on();
    stored_expect_string(&there);
    /* With one entry more it does not fit. */
    make_long(&string, ARB_CONFIG_STRING_MAX - 60);
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_write_raw(&string, 128));
    const uint32_t writes = stored.memory.writes;
    TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE, stored_save(2, 1, 0x5300));
    TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE, stored_save(1, 255, 0x5300));
    TEST_ASSERT_EQUAL(2, stored.config.counters[ARB_CONFIG_FAILURES]);
    TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE,
                      arb_config_write_raw(&stored.config, 0, ARB_CONFIG_STRING_MAX + 1, string.bytes, 100));
    TEST_ASSERT_EQUAL(writes, stored.memory.writes);
    stored_expect_string(&string);
    stored_power_on();
    stored_expect_string(&string);
    /* As much as an area holds comes from the host, too. */
    make_long(&string, ARB_CONFIG_STRING_MAX);
    TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_write_raw(&string, 512));
    stored_power_on();
    stored_expect_string(&string);
}

/* Pages of the string and one for the header; none when nothing has changed. */
static void test_writes_of_a_save(void)
{
    for (uint8_t count = 0; count <= 16; count++) {
        stored_start();
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_save(1, count, 0x5300));
        const uint32_t length = 12u + 57u * count;
        TEST_ASSERT_EQUAL((length + 63) / 64 + 1, stored.memory.writes);
        TEST_ASSERT_EQUAL(length + 12, stored.memory.bytes_written);
        TEST_ASSERT_EQUAL(stored.memory.writes, stored.config.counters[ARB_CONFIG_PAGES]);
        TEST_ASSERT_EQUAL(ARB_CONFIG_UNCHANGED, stored_save(1, count, 0x5300));
        stored_power_on();
        TEST_ASSERT_EQUAL(ARB_CONFIG_UNCHANGED, stored_save(1, count, 0x5300));
        TEST_ASSERT_EQUAL((length + 63) / 64 + 1, stored.memory.writes);
    }
}

/* The areas take turns, also when the number of writes wraps. */
static void test_wear_is_even(void)
{
    stored.config.newest.sequence = 0xFF00;
    for (uint16_t i = 0; i < 1000; i++) {
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_save(1, 3, (uint16_t)(0x5300 + i)));
        stored_power_on();
        TEST_ASSERT_EQUAL_HEX16((0xFF00u + 1 + i) & 0xFFFFu, stored.config.newest.sequence);
    }
    for (unsigned page = 0; page < 4; page++) {
        TEST_ASSERT_EQUAL(500, stored.memory.page_writes[2048 / 64 + page]);
        TEST_ASSERT_EQUAL(500, stored.memory.page_writes[10240 / 64 + page]);
    }
    for (unsigned page = 4; page < 128; page++) {
        TEST_ASSERT_EQUAL(0, stored.memory.page_writes[2048 / 64 + page]);
        TEST_ASSERT_EQUAL(0, stored.memory.page_writes[10240 / 64 + page]);
    }
}

/* --- A long random life --- */

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

static void make_string(const model_t *model, stored_string_t *string)
{
    string->len = 0;
    stored_put_entry(string, PROFILE_TLV_CONFIGURATIONS, (uint16_t)model->count);
    for (int i = 0; i < model->count; i++) {
        stored_put_configuration(string, model->items[i].number, model->items[i].links, model->items[i].type);
    }
    stored_put_entry(string, PROFILE_TLV_END, 0);
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
    static stored_string_t string;
    const uint8_t number = (uint8_t)(1 + random_below(MODEL_MAX));
    const uint8_t links = (uint8_t)random_below(4);
    const uint16_t type = (uint16_t)random_below(2);
    switch (random_below(4)) {
    case 0:
        if (find(model, number) < model->count) {
            model_erase(model, number);
            return stored_erase(number);
        }
        return arb_config_erase(&stored.config, number);
    case 1:
        model->count = 0;
        for (uint32_t i = random_below(4); i > 0; i--) {
            model_save(model, (uint8_t)(1 + random_below(MODEL_MAX)), (uint8_t)random_below(4), type);
        }
        make_string(model, &string);
        return stored_write_raw(&string, (uint16_t)(1 + random_below(200)));
    default:
        model_save(model, number, links, type);
        return stored_save(number, links, type);
    }
}

/* Also a host's write that stops half way, or that is bad. */
static void disturb_at_random(const model_t *model)
{
    static stored_string_t string;
    make_string(model, &string);
    if (random_below(2) == 0) {
        string.bytes[3 * random_below(string.len / 3u) + 1] ^= (uint8_t)(1u << random_below(8));
        string.bytes[string.len - 3] = 0; /* no end */
        TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_VALUE, stored_write_raw(&string, (uint16_t)(1 + random_below(200))));
    } else if (string.len > 6) {
        const uint16_t len = (uint16_t)(1 + random_below(string.len - 1u));
        string.bytes[random_below(len)] ^= 0x10;
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK,
                          stored_run(arb_config_write_raw(&stored.config, 0, string.len, string.bytes, len)));
    }
}

static void set_faults_at_random(void)
{
    stored.memory.busy_polls = (uint8_t)random_below(3);
    stored.memory.cut = (sim_nvm_cut_t)random_below(SIM_NVM_CUTS);
    if (random_below(3) == 0) {
        stored.memory.cut_after = random_below(800);
    } else if (random_below(8) == 0) {
        stored.memory.fail_after = random_below(10);
    }
}

/* One change and what comes of it; model is what is stored. */
static void live_once(model_t *model, uint32_t *cuts)
{
    static stored_string_t before;
    static stored_string_t after;
    static stored_string_t there;
    model_t next = *model;
    if (random_below(6) == 0) {
        disturb_at_random(model);
    }
    set_faults_at_random();
    make_string(model, &before);
    const arb_config_status_t status = change_at_random(&next);
    make_string(&next, &after);
    if (stored.memory.off) {
        (*cuts)++;
        stored_power_on();
        stored_get_string(&there);
        TEST_ASSERT_TRUE(stored_is_equal(&before, &there) || stored_is_equal(&after, &there));
        *model = stored_is_equal(&after, &there) ? next : *model;
        return;
    }
    stored.memory.busy_polls = 0;
    stored.memory.polls_left = 0;
    switch (status) {
    case ARB_CONFIG_OK:
    case ARB_CONFIG_UNCHANGED:
        TEST_ASSERT_EQUAL(status == ARB_CONFIG_UNCHANGED, stored_is_equal(&before, &after));
        *model = next;
        stored_expect_string(&after);
        break;
    case ARB_CONFIG_ERR_NUMBER:
        stored_expect_string(&before);
        break;
    default:
        TEST_ASSERT_EQUAL(ARB_CONFIG_ERR_STORAGE, status);
        TEST_ASSERT_TRUE(stored.memory.failed);
        stored_expect_string(&before);
        break;
    }
    sim_nvm_power_on(&stored.memory);
    if (random_below(3) == 0) {
        stored_power_on();
        stored_expect_string(status >= 0 ? &after : &before);
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
            sim_nvm_init(&stored.memory);
            stored_power_on();
            model.count = 0;
        }
        for (uint32_t i = 1 + random_below(8); i > 0; i--, steps++) {
            live_once(&model, &cuts);
        }
        stored_power_on();
    }
    TEST_ASSERT_GREATER_THAN(1000, cuts);
    printf("%lu changes, %lu of them cut\n", (unsigned long)steps, (unsigned long)cuts);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_one_rotten_bit_anywhere_and_the_other_area_is_used);
    RUN_TEST(test_both_areas_rotten);
    RUN_TEST(test_an_unknown_format_is_not_used);
    RUN_TEST(test_a_bad_string_under_a_good_crc_is_not_used);
    RUN_TEST(test_a_memory_that_cannot_be_read_counts_as_empty);
    RUN_TEST(test_eight_configurations_of_sixteen_links_fit);
    RUN_TEST(test_more_than_an_area_holds_changes_nothing);
    RUN_TEST(test_writes_of_a_save);
    RUN_TEST(test_wear_is_even);
    RUN_TEST(test_a_long_random_life);
    return UNITY_END();
}
