/* The string of stored configurations, reader and writer, against [PROFILE table 4.1, figure 4.10] and
 * profile-layer.md 5 (D-PRO-7). */
#include <string.h>

#include "profile_tlv.h"
#include "unity.h"

enum { LINKS = 16 };

/* What a reader has told. */
typedef struct {
    int links;
    uint8_t owners[LINKS]; /* configuration of each link */
    profile_link_t link[LINKS];
} told_t;

static told_t told;
static profile_tlv_t reader;

static void on_link(void *ctx, uint8_t number, const profile_link_t *link)
{
    told_t *t = ctx;
    if (t->links < LINKS) {
        t->owners[t->links] = number;
        t->link[t->links] = *link;
    }
    t->links++;
}

/* Configurations read so far. */
static int configurations(void)
{
    int count = 0;
    for (unsigned number = 0; number <= 255; number++) {
        count += profile_tlv_has(reader.numbers, (uint8_t)number) ? 1 : 0;
    }
    return count;
}

void setUp(void) {}

void tearDown(void) {}

static profile_tlv_status_t read_all(const uint8_t *bytes, size_t len)
{
    memset(&told, 0, sizeof told);
    profile_tlv_init(&reader, on_link, &told);
    return profile_tlv_read(&reader, bytes, (uint16_t)len);
}

/* The bytes of [PROFILE figure 4.10], values LSB first (D-PRO-7). */
static const uint8_t figure[] = {
    1,  2,  0,                                                                 /* two configurations */
    2,  1,  0, 3,  2,  0,                                                      /* 1: two links */
    4,  1,  0,                                                                 /* link 1 */
    5,  0,  0, 7,  10, 0, 8,  20, 0, 9,  1,  0, 10, 30, 0, 11, 40, 0,          /* its input */
    12, 50, 0, 13, 60, 0, 14, 70, 0, 6,  0,  0, 7,  10, 0, 8,  20, 0, 9, 1, 0, /* its output */
    10, 30, 0, 11, 40, 0, 12, 50, 0, 13, 60, 0, 14, 70, 0, 4,  2,  0,          /* link 2 */
    5,  0,  0, 6,  0,  0, 2,  2,  0,                                           /* configuration 2 */
    3,  1,  0, 4,  1,  0, 15, 0,  0};

static const profile_end_t figure_end = {.owner = {.vid = 30, .pid = 40, .sn = 50},
                                         .owner_type = 60,
                                         .owner_profile = 70,
                                         .type = 10,
                                         .profile = 20,
                                         .index = 1};

static void check_end(const profile_end_t *wanted, const profile_end_t *end)
{
    TEST_ASSERT_EQUAL_HEX16(wanted->owner.vid, end->owner.vid);
    TEST_ASSERT_EQUAL_HEX16(wanted->owner.pid, end->owner.pid);
    TEST_ASSERT_EQUAL_HEX16(wanted->owner.sn, end->owner.sn);
    TEST_ASSERT_EQUAL_HEX16(wanted->owner_type, end->owner_type);
    TEST_ASSERT_EQUAL_HEX16(wanted->owner_profile, end->owner_profile);
    TEST_ASSERT_EQUAL_HEX16(wanted->type, end->type);
    TEST_ASSERT_EQUAL_HEX16(wanted->profile, end->profile);
    TEST_ASSERT_EQUAL_UINT8(wanted->index, end->index);
}

static void check_figure(void)
{
    static const profile_end_t nothing;
    TEST_ASSERT_EQUAL(2, configurations());
    TEST_ASSERT_EQUAL(3, told.links);
    TEST_ASSERT_EQUAL(1, told.owners[0]);
    TEST_ASSERT_EQUAL(1, told.owners[1]);
    TEST_ASSERT_EQUAL(2, told.owners[2]);
    check_end(&figure_end, &told.link[0].input);
    check_end(&figure_end, &told.link[0].output);
    for (int i = 1; i < 3; i++) { /* missing values are 0 */
        check_end(&nothing, &told.link[i].input);
        check_end(&nothing, &told.link[i].output);
    }
    TEST_ASSERT_TRUE(profile_tlv_has(reader.numbers, 1));
    TEST_ASSERT_TRUE(profile_tlv_has(reader.numbers, 2));
    TEST_ASSERT_FALSE(profile_tlv_has(reader.numbers, 0));
    TEST_ASSERT_FALSE(profile_tlv_has(reader.numbers, 3));
}

static void test_the_figure_of_the_source_is_read(void)
{
    TEST_ASSERT_EQUAL(PROFILE_TLV_DONE, read_all(figure, sizeof figure));
    check_figure();
}

static void test_it_may_come_in_any_pieces(void)
{
    for (size_t size = 1; size <= 7; size++) {
        memset(&told, 0, sizeof told);
        profile_tlv_init(&reader, on_link, &told);
        profile_tlv_status_t status = PROFILE_TLV_MORE;
        for (size_t at = 0; at < sizeof figure; at += size) {
            TEST_ASSERT_EQUAL(PROFILE_TLV_MORE, status);
            const size_t left = sizeof figure - at;
            status = profile_tlv_read(&reader, &figure[at], (uint16_t)(left < size ? left : size));
        }
        TEST_ASSERT_EQUAL(PROFILE_TLV_DONE, status);
        check_figure();
    }
}

static void test_a_link_is_told_when_it_is_complete(void)
{
    const uint8_t bytes[] = {2, 9, 0, 3, 1, 0, 4, 1, 0, 5, 0, 0, 7, 0x34, 0x12, 15, 0, 0};
    memset(&told, 0, sizeof told);
    profile_tlv_init(&reader, on_link, &told);
    (void)profile_tlv_read(&reader, bytes, 3);
    TEST_ASSERT_EQUAL(1, configurations());
    (void)profile_tlv_read(&reader, &bytes[3], 12);
    TEST_ASSERT_EQUAL(0, told.links);
    (void)profile_tlv_read(&reader, &bytes[15], 3);
    TEST_ASSERT_EQUAL(1, told.links);
    TEST_ASSERT_EQUAL(9, told.owners[0]);
    TEST_ASSERT_EQUAL_HEX16(0x1234, told.link[0].input.type);
}

/* Every code of table 4.1, each value with two different bytes, the output first. */
static void test_every_value_has_its_code_and_the_order_of_the_ends_is_free(void)
{
    static const uint8_t bytes[] = {
        1,  1, 0, 2,  0xFE, 0, 3, 1,   0, 4, 1,    0,    6, 0,    0,    14, 1, 2, 13, 3, 4, 12, 5, 6,
        11, 7, 8, 10, 9,    8, 9, 200, 0, 8, 0x10, 0x21, 7, 0x01, 0x53, 5,  0, 0, 9,  4, 0, 15, 0, 0,
    };
    static const profile_link_t wanted = {.output = {.owner = {.vid = 0x0809, .pid = 0x0807, .sn = 0x0605},
                                                     .owner_type = 0x0403,
                                                     .owner_profile = 0x0201,
                                                     .type = 0x5301,
                                                     .profile = 0x2110,
                                                     .index = 200},
                                          .input = {.index = 4}};
    TEST_ASSERT_EQUAL(PROFILE_TLV_DONE, read_all(bytes, sizeof bytes));
    TEST_ASSERT_EQUAL(1, told.links);
    TEST_ASSERT_EQUAL(254, told.owners[0]);
    check_end(&wanted.output, &told.link[0].output);
    check_end(&wanted.input, &told.link[0].input);
}

static void test_unknown_codes_are_skipped_wherever_they_stand(void)
{
    static const uint8_t unknown[] = {0, 16, 17, 100, 255};
    for (size_t i = 0; i < sizeof unknown; i++) {
        for (size_t at = 0; at < sizeof figure; at += 3) {
            const uint8_t entry[] = {unknown[i], 15, 2};
            memset(&told, 0, sizeof told);
            profile_tlv_init(&reader, on_link, &told);
            (void)profile_tlv_read(&reader, figure, (uint16_t)at);
            (void)profile_tlv_read(&reader, entry, sizeof entry);
            TEST_ASSERT_EQUAL(PROFILE_TLV_DONE,
                              profile_tlv_read(&reader, &figure[at], (uint16_t)(sizeof figure - at)));
            check_figure();
        }
    }
}

static void test_a_string_without_an_end_is_never_done(void)
{
    for (size_t len = 0; len < sizeof figure; len++) {
        TEST_ASSERT_EQUAL(PROFILE_TLV_MORE, read_all(figure, len));
    }
}

static void test_what_follows_the_end_is_ignored(void)
{
    const uint8_t bytes[] = {1, 0, 0, 15, 0, 0, 2, 1, 0, 4, 1, 0, 2, 1, 0};
    for (size_t len = 6; len <= sizeof bytes; len++) {
        TEST_ASSERT_EQUAL(PROFILE_TLV_DONE, read_all(bytes, len));
        TEST_ASSERT_EQUAL(0, configurations());
    }
}

#define CHECK(wanted, ...)                                                                                   \
    do {                                                                                                     \
        static const uint8_t bytes[] = {__VA_ARGS__};                                                        \
        TEST_ASSERT_EQUAL(wanted, read_all(bytes, sizeof bytes));                                            \
    } while (0)

static void test_counts_must_match(void)
{
    CHECK(PROFILE_TLV_DONE, 15, 0, 0); /* none and not said so: a missing value is 0 */
    CHECK(PROFILE_TLV_DONE, 1, 1, 0, 2, 1, 0, 3, 0, 0, 15, 0, 0);
    CHECK(PROFILE_TLV_DONE, 1, 1, 0, 2, 1, 0, 15, 0, 0);
    CHECK(PROFILE_TLV_DONE, 1, 1, 0, 2, 1, 0, 4, 1, 0, 3, 1, 0, 15, 0, 0);
    CHECK(PROFILE_TLV_ERR_COUNT, 1, 1, 0, 15, 0, 0);
    CHECK(PROFILE_TLV_ERR_COUNT, 1, 0, 0, 2, 1, 0, 3, 0, 0, 15, 0, 0);
    CHECK(PROFILE_TLV_ERR_COUNT, 2, 1, 0, 3, 0, 0, 15, 0, 0);
    CHECK(PROFILE_TLV_ERR_COUNT, 1, 1, 1, 2, 1, 0, 3, 0, 0, 15, 0, 0); /* 257 */
    CHECK(PROFILE_TLV_ERR_COUNT, 1, 1, 0, 2, 1, 0, 3, 1, 0, 15, 0, 0);
    CHECK(PROFILE_TLV_ERR_COUNT, 1, 1, 0, 2, 1, 0, 3, 1, 1, 4, 1, 0, 15, 0, 0);
    CHECK(PROFILE_TLV_ERR_COUNT, 1, 1, 0, 2, 1, 0, 4, 1, 0, 15, 0, 0);
    CHECK(PROFILE_TLV_ERR_COUNT, 1, 2, 0, 2, 1, 0, 3, 0, 0, 4, 1, 0, 2, 2, 0);
    /* One configuration's count is not the next one's. */
    CHECK(PROFILE_TLV_ERR_COUNT, 1, 2, 0, 2, 1, 0, 3, 1, 0, 4, 1, 0, 2, 2, 0, 4, 1, 0, 15, 0, 0);
}

/* D-PRO-20. */
static void test_nothing_is_given_twice(void)
{
    CHECK(PROFILE_TLV_ERR_TWICE, 1, 2, 0, 2, 7, 0, 2, 7, 0);
    CHECK(PROFILE_TLV_ERR_TWICE, 1, 1, 0, 2, 7, 0, 3, 2, 0, 4, 5, 0, 4, 5, 0);
    CHECK(PROFILE_TLV_ERR_TWICE, 1, 0, 0, 1, 0, 0);
    CHECK(PROFILE_TLV_ERR_TWICE, 1, 1, 0, 2, 1, 0, 3, 0, 0, 3, 0, 0);
    CHECK(PROFILE_TLV_ERR_TWICE, 1, 1, 0, 2, 1, 0, 3, 1, 0, 4, 1, 0, 5, 0, 0, 6, 0, 0, 5, 0, 0);
    CHECK(PROFILE_TLV_ERR_TWICE, 1, 1, 0, 2, 1, 0, 3, 1, 0, 4, 1, 0, 6, 0, 0, 6, 0, 0);
    /* The same link number in two configurations is right. */
    CHECK(PROFILE_TLV_DONE, 1, 2, 0, 2, 7, 0, 3, 1, 0, 4, 5, 0, 2, 8, 0, 3, 1, 0, 4, 5, 0, 15, 0, 0);
}

static void test_numbers_have_one_byte(void)
{
    CHECK(PROFILE_TLV_ERR_RANGE, 1, 1, 0, 2, 0, 0);
    CHECK(PROFILE_TLV_ERR_RANGE, 1, 1, 0, 2, 0, 1);
    CHECK(PROFILE_TLV_ERR_RANGE, 1, 1, 0, 2, 1, 0, 3, 1, 0, 4, 0, 1);
    CHECK(PROFILE_TLV_ERR_RANGE, 1, 1, 0, 2, 1, 0, 3, 1, 0, 4, 1, 0, 5, 0, 0, 9, 0, 1);
    CHECK(PROFILE_TLV_DONE, 1, 1, 0, 2, 255, 0, 3, 2, 0, 4, 255, 0, 5, 0, 0, 9, 255, 0, 4, 0, 0, 15, 0, 0);
    TEST_ASSERT_EQUAL(255, told.link[0].input.index);
}

static void test_entries_stand_in_what_they_belong_to(void)
{
    CHECK(PROFILE_TLV_ERR_PLACE, 4, 1, 0);
    CHECK(PROFILE_TLV_ERR_PLACE, 3, 0, 0);
    CHECK(PROFILE_TLV_ERR_PLACE, 5, 0, 0);
    CHECK(PROFILE_TLV_ERR_PLACE, 7, 0, 0);
    CHECK(PROFILE_TLV_ERR_PLACE, 2, 1, 0, 1, 1, 0);
    CHECK(PROFILE_TLV_ERR_PLACE, 2, 1, 0, 6, 0, 0);
    CHECK(PROFILE_TLV_ERR_PLACE, 2, 1, 0, 3, 1, 0, 4, 1, 0, 14, 0, 0);
    /* A configuration's end is its link's end, and a link's end its channel's. */
    CHECK(PROFILE_TLV_ERR_PLACE, 2, 1, 0, 3, 1, 0, 4, 1, 0, 5, 0, 0, 2, 2, 0, 5, 0, 0);
    CHECK(PROFILE_TLV_ERR_PLACE, 2, 1, 0, 3, 2, 0, 4, 1, 0, 5, 0, 0, 4, 2, 0, 7, 0, 0);
}

static void test_an_error_stays(void)
{
    TEST_ASSERT_EQUAL(PROFILE_TLV_ERR_RANGE, read_all((const uint8_t[]){2, 0, 0}, 3));
    TEST_ASSERT_EQUAL(PROFILE_TLV_ERR_RANGE, profile_tlv_read(&reader, figure, sizeof figure));
    TEST_ASSERT_EQUAL(0, configurations());
}

static void test_nobody_needs_to_be_told(void)
{
    profile_tlv_init(&reader, NULL, NULL);
    TEST_ASSERT_EQUAL(PROFILE_TLV_DONE, profile_tlv_read(&reader, figure, sizeof figure));
}

/* All numbers that there are. */
static void test_the_largest_sets(void)
{
    uint8_t entry[3] = {1, 255, 0};
    memset(&told, 0, sizeof told);
    profile_tlv_init(&reader, on_link, &told);
    (void)profile_tlv_read(&reader, entry, 3);
    for (unsigned number = 1; number <= 255; number++) {
        profile_tlv_put(entry, 2, (uint16_t)number);
        (void)profile_tlv_read(&reader, entry, 3);
    }
    profile_tlv_put(entry, 3, 256);
    (void)profile_tlv_read(&reader, entry, 3);
    for (unsigned index = 0; index <= 255; index++) {
        profile_tlv_put(entry, 4, (uint16_t)index);
        (void)profile_tlv_read(&reader, entry, 3);
    }
    profile_tlv_put(entry, 15, 0);
    TEST_ASSERT_EQUAL(PROFILE_TLV_DONE, profile_tlv_read(&reader, entry, 3));
    TEST_ASSERT_EQUAL(255, configurations());
    TEST_ASSERT_EQUAL(256, told.links);
}

/* The writer's link is the figure's link 1, 57 bytes. */
static void test_a_link_is_written_as_in_the_figure(void)
{
    const profile_link_t link = {.output = figure_end, .input = figure_end};
    uint8_t bytes[3 * 19];
    for (uint8_t k = 0; k < 19; k++) {
        profile_tlv_put_link_entry(&bytes[3 * k], 1, &link, k);
    }
    TEST_ASSERT_EQUAL(57, PROFILE_TLV_LINK_BYTES);
    TEST_ASSERT_EQUAL(19, PROFILE_TLV_LINK_ENTRIES);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(&figure[9], bytes, 57);
}

static void test_every_value_is_written_to_its_place(void)
{
    static const profile_link_t link = {.output = {.owner = {.vid = 0x0102, .pid = 0x0304, .sn = 0x0506},
                                                   .owner_type = 0x0708,
                                                   .owner_profile = 0x090A,
                                                   .type = 0x0B0C,
                                                   .profile = 0x0D0E,
                                                   .index = 0x0F},
                                        .input = {.owner = {.vid = 0x1112, .pid = 0x1314, .sn = 0x1516},
                                                  .owner_type = 0x1718,
                                                  .owner_profile = 0x191A,
                                                  .type = 0x1B1C,
                                                  .profile = 0x1D1E,
                                                  .index = 0x1F}};
    static const uint8_t wanted[57] = {4,  0xC8, 0,    5,  0,    0,    7,  0x1C, 0x1B, 8,  0x1E, 0x1D,
                                       9,  0x1F, 0,    10, 0x12, 0x11, 11, 0x14, 0x13, 12, 0x16, 0x15,
                                       13, 0x18, 0x17, 14, 0x1A, 0x19, 6,  0,    0,    7,  0x0C, 0x0B,
                                       8,  0x0E, 0x0D, 9,  0x0F, 0,    10, 0x02, 0x01, 11, 0x04, 0x03,
                                       12, 0x06, 0x05, 13, 0x08, 0x07, 14, 0x0A, 0x09};
    uint8_t bytes[57];
    for (uint8_t k = 0; k < 19; k++) {
        profile_tlv_put_link_entry(&bytes[3 * k], 200, &link, k);
    }
    TEST_ASSERT_EQUAL_HEX8_ARRAY(wanted, bytes, 57);
}

static uint32_t chance;

static uint8_t random_byte(void)
{
    chance = (uint32_t)(chance * 1664525uL + 1013904223uL);
    return (uint8_t)(chance >> 24);
}

/* Writes configuration number to bytes[at] on, the links of which begin with link. Returns where it ends. */
static uint16_t write_configuration(uint8_t *bytes, uint16_t at, uint8_t number, int link)
{
    int end = link;
    while (end < told.links && told.owners[end] == number) {
        end++;
    }
    profile_tlv_put(&bytes[at], 2, number);
    profile_tlv_put(&bytes[at + 3], 3, (uint16_t)(end - link));
    at = (uint16_t)(at + 6);
    for (uint8_t index = 1; link < end; link++, index++) {
        for (uint8_t k = 0; k < 19; k++, at = (uint16_t)(at + 3)) {
            profile_tlv_put_link_entry(&bytes[at], index, &told.link[link], k);
        }
    }
    return at;
}

/* Writes what was told back, configurations without links behind the others; returns the length. */
static uint16_t write_told(uint8_t *bytes)
{
    uint16_t at = 3;
    bool written[256] = {false};
    profile_tlv_put(bytes, 1, (uint16_t)configurations());
    for (int link = 0; link < told.links; link++) {
        const uint8_t number = told.owners[link];
        if (!written[number]) {
            at = write_configuration(bytes, at, number, link);
            written[number] = true;
        }
    }
    for (unsigned number = 1; number <= 255; number++) {
        if (profile_tlv_has(reader.numbers, (uint8_t)number) && !written[number]) {
            at = write_configuration(bytes, at, (uint8_t)number, told.links);
        }
    }
    profile_tlv_put(&bytes[at], 15, 0);
    return (uint16_t)(at + 3);
}

/* What was accepted is read again from what the writer makes of it. */
static void check_rewritten(void)
{
    static told_t before;
    static uint8_t bytes[6 + LINKS * (6 + 57)];
    uint8_t numbers[PROFILE_TLV_SET_BYTES];
    if (told.links > LINKS || configurations() > LINKS) {
        return;
    }
    before = told;
    memcpy(numbers, reader.numbers, sizeof numbers);
    const uint16_t len = write_told(bytes);
    TEST_ASSERT_EQUAL(PROFILE_TLV_DONE, read_all(bytes, len));
    TEST_ASSERT_EQUAL(before.links, told.links);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(numbers, reader.numbers, sizeof numbers);
    for (int i = 0; i < told.links; i++) {
        TEST_ASSERT_EQUAL(before.owners[i], told.owners[i]);
        check_end(&before.link[i].input, &told.link[i].input);
        check_end(&before.link[i].output, &told.link[i].output);
    }
}

/* Strings of bytes that are likely to mean something, and ones with a few bytes wrong. */
static void test_no_string_harms_and_what_is_accepted_can_be_written(void)
{
    const unsigned rounds = sizeof(void *) == 2 ? 200 : 200000;
    static uint8_t bytes[sizeof figure];
    unsigned accepted = 0;
    chance = 1;
    for (unsigned round = 0; round < rounds; round++) {
        size_t len = sizeof bytes;
        memcpy(bytes, figure, sizeof bytes);
        if (round % 2 == 0) {
            len = random_byte() % sizeof bytes;
            for (size_t i = 0; i < len; i++) {
                const uint8_t byte = random_byte();
                bytes[i] = i % 3 == 0 ? byte % 18 : i % 3 == 1 ? byte % 3 : (uint8_t)(byte > 250);
            }
        } else {
            for (uint8_t i = random_byte() % 4; i > 0; i--) {
                bytes[random_byte() % sizeof bytes] = random_byte();
            }
        }
        if (read_all(bytes, len) == PROFILE_TLV_DONE) {
            accepted++;
            check_rewritten();
        }
    }
    TEST_ASSERT_GREATER_THAN(rounds / 10, accepted);
    TEST_ASSERT_LESS_THAN(rounds, accepted);
}

/* RAM of the reader on the 16-bit target. */
static void test_the_reader_is_small(void)
{
    TEST_ASSERT_LESS_THAN(sizeof(void *) == 2 ? 136 : 176, sizeof(profile_tlv_t));
}

/* D-BUS-53: whom the links name is known, and most others are not taken for one of them. */
static void test_the_devices_that_links_name(void)
{
    static const pdcp_identity_t named = {30, 40, 50};
    int others = 0;
    (void)read_all(figure, sizeof figure);
    TEST_ASSERT_TRUE(profile_tlv_names(reader.names, &named));
    for (uint16_t sn = 1; sn <= 1000; sn++) {
        const pdcp_identity_t other = {31, 40, sn};
        others += profile_tlv_names(reader.names, &other) ? 1 : 0;
    }
    TEST_ASSERT_LESS_THAN(40, others); /* the figure names two, one of them 0:0:0 */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_figure_of_the_source_is_read);
    RUN_TEST(test_it_may_come_in_any_pieces);
    RUN_TEST(test_a_link_is_told_when_it_is_complete);
    RUN_TEST(test_every_value_has_its_code_and_the_order_of_the_ends_is_free);
    RUN_TEST(test_unknown_codes_are_skipped_wherever_they_stand);
    RUN_TEST(test_a_string_without_an_end_is_never_done);
    RUN_TEST(test_what_follows_the_end_is_ignored);
    RUN_TEST(test_counts_must_match);
    RUN_TEST(test_nothing_is_given_twice);
    RUN_TEST(test_numbers_have_one_byte);
    RUN_TEST(test_entries_stand_in_what_they_belong_to);
    RUN_TEST(test_an_error_stays);
    RUN_TEST(test_nobody_needs_to_be_told);
    RUN_TEST(test_the_largest_sets);
    RUN_TEST(test_a_link_is_written_as_in_the_figure);
    RUN_TEST(test_every_value_is_written_to_its_place);
    RUN_TEST(test_no_string_harms_and_what_is_accepted_can_be_written);
    RUN_TEST(test_the_reader_is_small);
    RUN_TEST(test_the_devices_that_links_name);
    return UNITY_END();
}
