#include "stored.h"

#include <string.h>

#include "unity.h"

stored_t stored;

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

void stored_load(void)
{
    arb_config_init(&stored.config, &stored.nvm, &user, &stored.saved_type, stored.now_ms);
}

void stored_power_on(void)
{
    sim_nvm_power_on(&stored.memory);
    arb_nvm_init(&stored.nvm, &stored.port);
    stored_load();
}

void stored_start(void)
{
    sim_nvm_init(&stored.memory);
    sim_nvm_port(&stored.memory, &stored.port);
    stored.now_ms = 0xFFFFFF00u;
    stored_power_on();
}

void stored_stop(void)
{
    TEST_ASSERT_EQUAL(0, stored.memory.misuses);
}

arb_config_status_t stored_run(arb_config_status_t started)
{
    if (started < 0) {
        return started;
    }
    for (int steps = 0; arb_config_busy(&stored.config); steps++) {
        TEST_ASSERT_LESS_THAN(5000, steps);
        stored.now_ms = arb_config_next_ms(&stored.config, stored.now_ms);
        stored.outcome = arb_config_step(&stored.config, &stored.nvm, stored.now_ms);
    }
    return stored.outcome;
}

arb_config_status_t stored_save(uint8_t number, uint8_t count, uint16_t type)
{
    stored.saved_type = type;
    return stored_run(arb_config_save(&stored.config, &number, count));
}

arb_config_status_t stored_erase(uint8_t number)
{
    return stored_run(arb_config_erase(&stored.config, number));
}

arb_config_status_t stored_write_raw(const stored_string_t *string, uint16_t size)
{
    arb_config_status_t status = ARB_CONFIG_OK;
    for (uint16_t at = 0; at < string->len && status == ARB_CONFIG_OK; at = (uint16_t)(at + size)) {
        const uint16_t left = (uint16_t)(string->len - at);
        status = stored_run(arb_config_write_raw(&stored.config, at, string->len, &string->bytes[at],
                                                 left < size ? left : size));
    }
    return status;
}

void stored_get_string(stored_string_t *string)
{
    memset(string, 0, sizeof *string);
    string->len = arb_config_length(&stored.config);
    for (uint16_t at = 0; at < string->len;) {
        uint8_t n = 128;
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK,
                          arb_config_read_raw(&stored.config, &stored.nvm, at, &string->bytes[at], &n));
        at = (uint16_t)(at + n);
    }
}

bool stored_is_equal(const stored_string_t *a, const stored_string_t *b)
{
    return a->len == b->len && memcmp(a->bytes, b->bytes, a->len) == 0;
}

void stored_expect_string(const stored_string_t *wanted)
{
    static stored_string_t there;
    stored_get_string(&there);
    TEST_ASSERT_EQUAL(wanted->len, there.len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(wanted->bytes, there.bytes, wanted->len);
}

void stored_put_entry(stored_string_t *string, uint8_t code, uint16_t value)
{
    TEST_ASSERT_LESS_OR_EQUAL(sizeof string->bytes, string->len + 3u);
    profile_tlv_put(&string->bytes[string->len], code, value);
    string->len = (uint16_t)(string->len + 3);
}

void stored_put_configuration(stored_string_t *string, uint8_t number, uint8_t count, uint16_t type)
{
    stored_put_entry(string, PROFILE_TLV_CONFIGURATION, number);
    stored_put_entry(string, PROFILE_TLV_LINKS, count);
    for (uint8_t k = 0; k < count; k++) {
        profile_link_t link;
        get_link(&type, k, &link);
        for (uint8_t i = 0; i < (uint8_t)PROFILE_TLV_LINK_ENTRIES; i++) {
            uint8_t entry[3];
            profile_tlv_put_link_entry(entry, (uint8_t)(k + 1), &link, i);
            stored_put_entry(string, entry[0], (uint16_t)(entry[1] | entry[2] << 8));
        }
    }
}

void stored_fill(void)
{
    for (uint8_t number = 1; number <= 8; number++) {
        TEST_ASSERT_EQUAL(ARB_CONFIG_OK, stored_save(number, 16, (uint16_t)(0x5300 + number)));
    }
}
