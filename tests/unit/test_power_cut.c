/* Power cuts at every byte of every kind of write of what is stored: configurations, identities, flags
 * (profile-layer.md 5, D-BUS-6). Whole contents are compared: the old or the new ones, never a mix. */
#include <stdio.h>
#include <string.h>

#include "arb_flags.h"
#include "arb_store.h"
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

/* --- Power cuts --- */

typedef void (*action_t)(void);

/* Cuts the power at every stride-th byte of what change writes. */
static void cut_everywhere(action_t prepare, action_t change, uint32_t stride)
{
    static sim_nvm_t image;
    static stored_string_t before;
    static stored_string_t after;
    static stored_string_t there;
    uint32_t old_count = 0;
    uint32_t new_count = 0;
    stored_start();
    prepare();
    stored_power_on();
    stored_get_string(&before);
    image = stored.memory;
    change();
    const uint32_t bytes = stored.memory.bytes_written - image.bytes_written;
    stored_get_string(&after);
    TEST_ASSERT_FALSE(stored_is_equal(&before, &after));
    for (uint32_t at = 0; at < bytes; at += stride) {
        for (int cut = 0; cut < SIM_NVM_CUTS; cut++) {
            stored.memory = image;
            stored_power_on();
            stored.memory.cut_after = at;
            stored.memory.cut = (sim_nvm_cut_t)cut;
            change();
            stored_power_on();
            stored_get_string(&there);
            const bool is_old = stored_is_equal(&before, &there);
            TEST_ASSERT_TRUE_MESSAGE(is_old || stored_is_equal(&after, &there),
                                     "neither the old nor the new set");
            /* The header comes last: before it nothing has changed. */
            TEST_ASSERT_TRUE(is_old || at + ARB_CONFIG_HEADER >= bytes);
            TEST_ASSERT_LESS_OR_EQUAL(1, stored.config.counters[ARB_CONFIG_DAMAGED]);
            old_count += is_old ? 1u : 0u;
            new_count += is_old ? 0u : 1u;
            /* The next save works. */
            TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_save(200, 1, 0x7777));
            stored_power_on();
            TEST_ASSERT_EQUAL(0, stored.config.counters[ARB_CONFIG_DAMAGED]);
            TEST_ASSERT_TRUE(arb_config_has(&stored.config, 200));
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
    (void)stored_save(4, 2, 0x5300);
    (void)stored_save(2, 3, 0x5400);
    (void)stored_save(7, 1, 0x5500);
}

static void save_first(void)
{
    (void)stored_save(1, 2, 0x5300);
}

static void save_again(void)
{
    (void)stored_save(2, 4, 0x6400);
}

static void save_more(void)
{
    (void)stored_save(0, 1, 0x6400);
}

static void erase_one(void)
{
    (void)stored_erase(2);
}

static void write_whole(void)
{
    static stored_string_t string;
    string.len = 0;
    stored_put_entry(&string, PROFILE_TLV_CONFIGURATIONS, 2);
    stored_put_configuration(&string, 4, 2, 0x5300);
    stored_put_entry(&string, 99, 0x1234);
    stored_put_configuration(&string, 9, 4, 0x5300);
    stored_put_entry(&string, PROFILE_TLV_END, 0);
    (void)stored_write_raw(&string, 100);
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

static void save_one_of_eight(void)
{
    (void)stored_save(3, 16, 0x1234);
}

static void test_cuts_of_a_save_in_a_full_memory(void)
{
    cut_everywhere(stored_fill, save_one_of_eight, 397);
}

/* --- Identities and flags --- */

static arb_store_t store;
static pdcp_bind_t bind;
static arb_flags_t flags;

static void load_store(void)
{
    memset(&bind, 0, sizeof bind);
    arb_store_load(&store, &stored.nvm, &bind);
}

static void remember(uint16_t sn, uint8_t node_id)
{
    const pdcp_remembered_t entry = {.identity = {.vid = 2, .pid = 3, .sn = sn}, .node_id = node_id};
    TEST_ASSERT_TRUE(pdcp_bind_remember_stored(&bind, &entry));
}

static void write_store(void)
{
    arb_store_touch(&store, stored.now_ms);
    for (int i = 0; i < 200; i++) {
        stored.now_ms = arb_store_next_ms(&store, stored.now_ms);
        arb_store_step(&store, &bind, stored.now_ms);
        if (!store.changed) {
            break;
        }
    }
    TEST_ASSERT_FALSE(store.changed);
    TEST_ASSERT_EQUAL(ARB_NVM_NOBODY, stored.nvm.owner);
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
    image = stored.memory;
    remember(77, 99);
    describe(after, sizeof after);
    write_store();
    const uint32_t bytes = stored.memory.bytes_written - image.bytes_written;
    TEST_ASSERT_EQUAL(6 + 7 * 11 + 4, bytes);
    for (uint32_t at = 0; at < bytes; at++) {
        for (int cut = 0; cut < SIM_NVM_CUTS; cut++) {
            stored.memory = image;
            stored_power_on();
            load_store();
            describe(there, sizeof there);
            TEST_ASSERT_EQUAL_STRING(before, there);
            remember(77, 99);
            stored.memory.cut_after = at;
            stored.memory.cut = (sim_nvm_cut_t)cut;
            write_store();
            stored_power_on();
            load_store();
            describe(there, sizeof there);
            TEST_ASSERT_TRUE(strcmp(before, there) == 0 || strcmp(after, there) == 0);
            TEST_ASSERT_TRUE(strcmp(before, there) == 0 || at == bytes - 1);
            remember(78, 100);
            describe(there, sizeof there);
            write_store();
            stored_power_on();
            load_store();
            describe(later, sizeof later);
            TEST_ASSERT_EQUAL_STRING(there, later);
            TEST_ASSERT_EQUAL(0, store.damaged);
        }
    }
}

static void write_flags(uint8_t value)
{
    arb_flags_set(&flags, value, stored.now_ms);
    for (int i = 0; i < 20; i++) {
        stored.now_ms += 5;
        arb_flags_step(&flags, &stored.nvm, stored.now_ms);
    }
}

static void test_cuts_of_the_flags(void)
{
    for (uint32_t at = 0; at < 11; at++) {
        for (int cut = 0; cut < SIM_NVM_CUTS; cut++) {
            stored_start();
            arb_flags_load(&flags, &stored.nvm);
            write_flags(0x0A);
            write_flags(0x05);
            stored.memory.cut_after = at;
            stored.memory.cut = (sim_nvm_cut_t)cut;
            write_flags(0x09);
            stored_power_on();
            arb_flags_load(&flags, &stored.nvm);
            const uint8_t there = arb_flags_get(&flags);
            TEST_ASSERT_TRUE(there == 0x05 || (there == 0x09 && at == 10));
            write_flags(0x06);
            arb_flags_load(&flags, &stored.nvm);
            TEST_ASSERT_EQUAL_HEX8(0x06, arb_flags_get(&flags));
        }
    }
}

/* All three at once on a memory whose pages take long: everybody's data is right, nobody takes another one's
 * failure for its own, and nobody touches the memory while a page is under way (tearDown). */
static void test_three_users_of_one_memory(void)
{
    for (uint32_t failing = 0; failing < 14; failing++) {
        stored.saved_type = 0x5300;
        uint8_t number = 1;
        stored_start();
        load_store();
        arb_flags_load(&flags, &stored.nvm);
        stored.memory.busy_polls = 2;
        stored.memory.fail_after = failing;
        remember(5, 5);
        arb_store_touch(&store, stored.now_ms - ARB_STORE_DELAY_MS);
        arb_flags_set(&flags, 0x08, stored.now_ms);
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, arb_config_save(&stored.config, &number, 9));
        stored.outcome = ARB_CONFIG_RUNNING;
        for (int i = 0; i < 3000; i++) {
            stored.memory.fail_after = stored.memory.failed ? SIM_NVM_NEVER : stored.memory.fail_after;
            const arb_config_status_t status = arb_config_step(&stored.config, &stored.nvm, stored.now_ms);
            if (status != ARB_CONFIG_RUNNING) {
                stored.outcome = status;
            }
            arb_store_step(&store, &bind, stored.now_ms);
            arb_flags_step(&flags, &stored.nvm, stored.now_ms);
            stored.now_ms++;
        }
        TEST_ASSERT_EQUAL(ARB_NVM_NOBODY, stored.nvm.owner);
        /* One of them has met the failure; two try again by themselves. */
        const uint32_t failures =
            store.failures + flags.failures + stored.config.counters[ARB_CONFIG_FAILURES];
        TEST_ASSERT_EQUAL(failing < 12 ? 1 : 0, failures);
        TEST_ASSERT_EQUAL(stored.config.counters[ARB_CONFIG_FAILURES] != 0 ? ARB_CONFIG_ERR_STORAGE
                                                                           : ARB_CONFIG_OK,
                          stored.outcome);
        stored_power_on();
        load_store();
        arb_flags_load(&flags, &stored.nvm);
        TEST_ASSERT_EQUAL(1, bind.remembered_count);
        TEST_ASSERT_EQUAL_HEX8(0x08, arb_flags_get(&flags));
        TEST_ASSERT_EQUAL(stored.outcome == ARB_CONFIG_OK ? 1 : 0, stored.config.stored);
    }
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
    RUN_TEST(test_cuts_of_an_identity_update);
    RUN_TEST(test_cuts_of_the_flags);
    RUN_TEST(test_three_users_of_one_memory);
    return UNITY_END();
}
