/* The active configuration: order, one entry an input, devices kept once, what happens when it is full. */
#include "profile_channel.h"
#include "profile_links.h"
#include "systems.h"
#include "unity.h"

#include <string.h>

static systems_t s;

void setUp(void)
{
    systems_init(&s);
}

void tearDown(void) {}

static profile_end_t make_end(uint16_t sn, uint8_t index, uint16_t profile)
{
    const profile_end_t end = {.owner = {.vid = 2, .pid = 3, .sn = sn},
                               .owner_type = 0x0A0B,
                               .owner_profile = (uint16_t)(0x4000u + sn),
                               .type = (uint16_t)(0x5000u + sn),
                               .profile = profile,
                               .index = index};
    return end;
}

/* A link to an input with profile 1000h. */
static profile_link_t make_link(uint16_t from, uint8_t output, uint16_t to, uint8_t input)
{
    const profile_link_t link = {.output = make_end(from, output, 0x2110),
                                 .input = make_end(to, input, 0x1000)};
    return link;
}

static bool put(uint16_t from, uint8_t output, uint16_t to, uint8_t input)
{
    const profile_link_t link = make_link(from, output, to, input);
    return profile_links_put(&s.links, &link, false);
}

static void check_end(const profile_end_t *expected, const profile_end_t *end)
{
    TEST_ASSERT_EQUAL_UINT16(expected->owner.vid, end->owner.vid);
    TEST_ASSERT_EQUAL_UINT16(expected->owner.pid, end->owner.pid);
    TEST_ASSERT_EQUAL_UINT16(expected->owner.sn, end->owner.sn);
    TEST_ASSERT_EQUAL_HEX16(expected->owner_type, end->owner_type);
    TEST_ASSERT_EQUAL_HEX16(expected->owner_profile, end->owner_profile);
    TEST_ASSERT_EQUAL_HEX16(expected->type, end->type);
    TEST_ASSERT_EQUAL_HEX16(expected->profile, end->profile);
    TEST_ASSERT_EQUAL_UINT8(expected->index, end->index);
}

static void check_entry(uint8_t entry, uint16_t from, uint8_t output, uint16_t to, uint8_t input)
{
    const profile_link_t expected = make_link(from, output, to, input);
    profile_link_t link;
    TEST_ASSERT_LESS_THAN(s.links.count, entry);
    profile_links_get(&s.links, entry, &link);
    check_end(&expected.output, &link.output);
    check_end(&expected.input, &link.input);
}

static void test_a_link_comes_out_as_it_went_in(void)
{
    TEST_ASSERT_TRUE(put(4, 1, 5, 2));
    TEST_ASSERT_EQUAL_UINT8(1, s.links.count);
    check_entry(0, 4, 1, 5, 2);
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE, s.links.entries[0].stand_in);
    TEST_ASSERT_FALSE(s.links.entries[0].by_host);
}

static void test_entries_are_in_the_order_of_their_inputs(void)
{
    profile_link_t urgent = make_link(4, 1, 9, 9);
    TEST_ASSERT_TRUE(put(4, 1, 6, 1));
    TEST_ASSERT_TRUE(put(4, 2, 5, 3));
    TEST_ASSERT_TRUE(put(7, 1, 5, 2));
    urgent.input.profile = 0x0FFF;
    TEST_ASSERT_TRUE(profile_links_put(&s.links, &urgent, true));
    TEST_ASSERT_EQUAL_UINT8(4, s.links.count);
    TEST_ASSERT_TRUE(s.links.entries[0].by_host);
    check_entry(1, 7, 1, 5, 2);
    check_entry(2, 4, 2, 5, 3);
    check_entry(3, 4, 1, 6, 1);
}

static void test_an_input_has_one_entry(void)
{
    TEST_ASSERT_TRUE(put(4, 1, 5, 2));
    TEST_ASSERT_TRUE(put(6, 1, 7, 2));
    TEST_ASSERT_TRUE(put(8, 3, 5, 2));
    TEST_ASSERT_EQUAL_UINT8(2, s.links.count);
    check_entry(0, 8, 3, 5, 2);
    check_entry(1, 6, 1, 7, 2);
}

static void test_an_entry_is_removed(void)
{
    TEST_ASSERT_TRUE(put(4, 1, 5, 1));
    TEST_ASSERT_TRUE(put(4, 1, 5, 2));
    TEST_ASSERT_TRUE(put(4, 1, 5, 3));
    profile_links_remove(&s.links, 1);
    TEST_ASSERT_EQUAL_UINT8(2, s.links.count);
    check_entry(0, 4, 1, 5, 1);
    check_entry(1, 4, 1, 5, 3);
    profile_links_remove(&s.links, 1);
    profile_links_remove(&s.links, 0);
    TEST_ASSERT_EQUAL_UINT8(0, s.links.count);
}

static void test_entries_are_found_by_owner_and_index(void)
{
    const profile_link_t link = make_link(4, 1, 5, 2);
    pdcp_identity_t other = link.input.owner;
    TEST_ASSERT_TRUE(put(4, 1, 5, 1));
    TEST_ASSERT_TRUE(put(4, 1, 5, 2));
    TEST_ASSERT_EQUAL_UINT8(1, profile_links_find(&s.links, &link.input.owner, 2));
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE, profile_links_find(&s.links, &link.input.owner, 3));
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE, profile_links_find(&s.links, &link.output.owner, 1));
    other.vid++;
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE, profile_links_find(&s.links, &other, 2));
}

/* One output feeds as many inputs of one device as there is room for. */
static void test_a_full_configuration_takes_no_more(void)
{
    for (uint8_t i = 1; i <= PROFILE_LINKS_MAX; i++) {
        TEST_ASSERT_TRUE(put(4, 1, 5, i));
    }
    TEST_ASSERT_FALSE(put(4, 1, 5, PROFILE_LINKS_MAX + 1));
    TEST_ASSERT_EQUAL_UINT8(PROFILE_LINKS_MAX, s.links.count);
    check_entry(PROFILE_LINKS_MAX - 1, 4, 1, 5, PROFILE_LINKS_MAX);
    TEST_ASSERT_TRUE(put(4, 2, 5, 7)); /* in place of an older one */
    check_entry(6, 4, 2, 5, 7);
}

/* Devices are counted once, and only while an entry names them. */
static void test_too_many_devices_change_nothing(void)
{
    for (uint8_t i = 0; i < PROFILE_PARTS_MAX / 2; i++) {
        TEST_ASSERT_TRUE(put((uint16_t)(100 + i), 1, (uint16_t)(200 + i), 1));
    }
    TEST_ASSERT_FALSE(put(300, 1, 200, 2));
    TEST_ASSERT_FALSE(put(300, 1, 301, 2));
    TEST_ASSERT_TRUE(put(100, 1, 200, 2));
    TEST_ASSERT_TRUE(put(300, 1, 205, 1)); /* device 105 is named no more */
    check_entry(6, 300, 1, 205, 1);
    s.links.entries[7].by_host = true;
    TEST_ASSERT_FALSE(put(301, 1, 200, 1)); /* 100 stays, for input 2 */
    check_entry(0, 100, 1, 200, 1);
    check_entry(1, 100, 1, 200, 2);
    TEST_ASSERT_TRUE(s.links.entries[7].by_host);
}

static void test_what_is_put_back_for_want_of_room_is_as_it_was(void)
{
    const profile_link_t link = make_link(300, 1, 200, 1);
    for (uint8_t i = 0; i < PROFILE_PARTS_MAX / 2; i++) {
        TEST_ASSERT_TRUE(put((uint16_t)(100 + i), 1, (uint16_t)(200 + i), 1));
    }
    TEST_ASSERT_TRUE(put(100, 1, 200, 2));
    s.links.entries[0].by_host = true;
    s.links.entries[0].stand_in = 17;
    TEST_ASSERT_FALSE(profile_links_put(&s.links, &link, false));
    check_entry(0, 100, 1, 200, 1);
    TEST_ASSERT_TRUE(s.links.entries[0].by_host);
    TEST_ASSERT_EQUAL_UINT8(17, s.links.entries[0].stand_in);
}

/* A device's own type and profile are those that were told last. */
static void test_a_device_is_told_anew(void)
{
    profile_link_t link = make_link(4, 1, 5, 1);
    TEST_ASSERT_TRUE(profile_links_put(&s.links, &link, false));
    link.input.index = 2;
    link.output.owner_type = 0x1234;
    TEST_ASSERT_TRUE(profile_links_put(&s.links, &link, false));
    profile_links_get(&s.links, 0, &link);
    TEST_ASSERT_EQUAL_HEX16(0x1234, link.output.owner_type);
}

static bool is_claimed(uint8_t output, uint16_t to, uint8_t input, uint16_t input_type)
{
    profile_link_t link = make_link(4, output, to, input);
    link.input.type = input_type;
    return profile_links_is_claimed(&s.links, &link);
}

static void test_an_output_is_claimed_by_one_sole_access_input(void)
{
    profile_link_t link = make_link(4, 1, 5, 1);
    link.input.type = 0x5200;
    TEST_ASSERT_TRUE(profile_links_put(&s.links, &link, false));
    TEST_ASSERT_TRUE(is_claimed(1, 5, 2, 0x5200));
    TEST_ASSERT_FALSE(is_claimed(1, 5, 2, 0x5000));
    TEST_ASSERT_FALSE(is_claimed(1, 5, 1, 0x5200)); /* the one that it has */
    TEST_ASSERT_FALSE(is_claimed(2, 5, 2, 0x5200));
    profile_links_remove(&s.links, 0);
    link.input.type = 0x5100;
    TEST_ASSERT_TRUE(profile_links_put(&s.links, &link, false));
    TEST_ASSERT_FALSE(is_claimed(1, 5, 2, 0x5200));
}

static void test_ends_are_looked_up_in_the_tables(void)
{
    systems_add(&s, "D1 out 1 5000 2110; D2 in 1 5000 2110, out 2 5000 2110");
    systems_configure(&s, "1.1>2.1", false);
    const profile_entry_t *entry = &s.links.entries[0];
    TEST_ASSERT_EQUAL_UINT8(systems_place(&s, 1), profile_links_place(&s.links, &s.tables, &entry->output));
    TEST_ASSERT_EQUAL_UINT8(systems_channel(&s, "1.1"),
                            profile_links_channel(&s.links, &s.tables, &entry->output, PDCP_OUTPUT));
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE,
                            profile_links_channel(&s.links, &s.tables, &entry->output, PDCP_INPUT));
    TEST_ASSERT_EQUAL_UINT8(0, profile_links_of(&s.links, &s.tables, systems_channel(&s, "2.1")));
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE, profile_links_of(&s.links, &s.tables, systems_channel(&s, "2.2")));
}

static void test_an_end_is_missing_when_its_device_is_not_set_up(void)
{
    systems_add(&s, "D1 out 1 5000 2110; D2 in 1 5000 2110");
    systems_configure(&s, "1.1>2.1", false);
    const profile_entry_t *entry = &s.links.entries[0];
    systems_lose(&s, systems_place(&s, 1));
    TEST_ASSERT_NOT_EQUAL(PDCP_NONE, profile_links_place(&s.links, &s.tables, &entry->output));
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE,
                            profile_links_channel(&s.links, &s.tables, &entry->output, PDCP_OUTPUT));
    systems_forget(&s, systems_place(&s, 1));
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE, profile_links_place(&s.links, &s.tables, &entry->output));
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE,
                            profile_links_channel(&s.links, &s.tables, &entry->output, PDCP_OUTPUT));
    systems_add(&s, "D1 in 1 5000 2110"); /* it has become an input */
    TEST_ASSERT_EQUAL_UINT8(PDCP_NONE,
                            profile_links_channel(&s.links, &s.tables, &entry->output, PDCP_OUTPUT));
}

static void test_a_channel_as_an_end(void)
{
    profile_end_t end;
    systems_add(&s, "D1 2:3:4 out 1 5000 2110, out 2 7000 2120");
    s.tables.devices[systems_place(&s, 1)].type = 0x0A0B;
    s.tables.devices[systems_place(&s, 1)].profile = 0x4004;
    profile_channel_end(&s.tables, systems_channel(&s, "1.2"), &end);
    const profile_end_t expected = {{2, 3, 4}, 0x0A0B, 0x4004, 0x7000, 0x2120, 2};
    check_end(&expected, &end);
}

static void test_the_source_that_an_input_names(void)
{
    profile_end_t end;
    systems_add(&s, "D1 2:3:4 out 1 5000 2110; D2 in 1 5000 2110, in 2 5000 2110, in 3 5000 2110");
    s.tables.devices[systems_place(&s, 1)].type = 0x0A0B;
    systems_link(&s, "1.1>2.1");
    TEST_ASSERT_TRUE(profile_channel_named_source(&s.tables, systems_channel(&s, "2.1"), &end));
    const profile_end_t here = {{2, 3, 4}, 0x0A0B, 0, 0x5000, 0x2110, 1};
    check_end(&here, &end);
    systems_forget(&s, systems_place(&s, 1));
    TEST_ASSERT_TRUE(profile_channel_named_source(&s.tables, systems_channel(&s, "2.1"), &end));
    const profile_end_t gone = {{2, 3, 4}, 0, 0, 0x5000, 0x2110, 1};
    check_end(&gone, &end);
    TEST_ASSERT_FALSE(
        profile_channel_named_source(&s.tables, systems_channel(&s, "2.2"), &end)); /* index FFh (D-BUS-7) */
    s.tables.channels[systems_channel(&s, "2.3")].source.index = 0;
    TEST_ASSERT_FALSE(profile_channel_named_source(&s.tables, systems_channel(&s, "2.3"), &end));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_link_comes_out_as_it_went_in);
    RUN_TEST(test_entries_are_in_the_order_of_their_inputs);
    RUN_TEST(test_an_input_has_one_entry);
    RUN_TEST(test_an_entry_is_removed);
    RUN_TEST(test_entries_are_found_by_owner_and_index);
    RUN_TEST(test_a_full_configuration_takes_no_more);
    RUN_TEST(test_too_many_devices_change_nothing);
    RUN_TEST(test_what_is_put_back_for_want_of_room_is_as_it_was);
    RUN_TEST(test_a_device_is_told_anew);
    RUN_TEST(test_an_output_is_claimed_by_one_sole_access_input);
    RUN_TEST(test_ends_are_looked_up_in_the_tables);
    RUN_TEST(test_an_end_is_missing_when_its_device_is_not_set_up);
    RUN_TEST(test_a_channel_as_an_end);
    RUN_TEST(test_the_source_that_an_input_names);
    return UNITY_END();
}
