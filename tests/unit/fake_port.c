#include "fake_port.h"

#include <string.h>

#include "unity.h"

static bool can_send(void *ctx, const can_frame_t *frame)
{
    const fake_port_t *fake = ctx;
    return fake->take_frame != NULL && fake->take_frame(frame);
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    fake_port_t *fake = ctx;
    if (fake->out == NULL) {
        return size;
    }
    const size_t count = size < fake->room ? size : fake->room;
    TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(fake->out_max, fake->out_len + count,
                                      "the host has not looked for too long");
    memcpy(&fake->out[fake->out_len], bytes, count);
    fake->out_len += count;
    fake->room -= count;
    return count;
}

/* The byte at this address; NULL: no region has it. */
static uint8_t *byte_at(const fake_port_t *fake, uint16_t address)
{
    for (uint8_t i = 0; i < fake->region_count; i++) {
        const fake_region_t *region = &fake->regions[i];
        if (address >= region->address && address - region->address < region->size) {
            return &region->bytes[address - region->address];
        }
    }
    return NULL;
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    fake_port_t *fake = ctx;
    TEST_ASSERT_EQUAL_MESSAGE(0, fake->polls_left, "read while a page is being written");
    fake->read_most = size > fake->read_most ? size : fake->read_most;
    for (uint16_t i = 0; i < size; i++) {
        const uint8_t *byte = byte_at(fake, (uint16_t)(address + i));
        bytes[i] = byte != NULL ? *byte : 0xFF;
    }
    return true;
}

/* How many bytes of a write reach the memory. */
static uint16_t arriving(fake_port_t *fake, uint16_t address, uint16_t size)
{
    if (fake->good_writes == 0) {
        fake->status = -1;
    }
    fake->good_writes -= fake->good_writes >= 0 ? 1 : 0;
    if (fake->status != 0 || fake->lost_page == (int32_t)address) {
        return 0;
    }
    if (fake->whole_writes != 0) {
        fake->whole_writes -= fake->whole_writes > 0 ? 1 : 0;
        return size;
    }
    const uint16_t cut = fake->cut_bytes < size ? fake->cut_bytes : size;
    fake->cut_bytes = 0;
    return cut;
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    fake_port_t *fake = ctx;
    TEST_ASSERT_EQUAL_MESSAGE(0, fake->polls_left, "written while a page is being written");
    TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(ARB_PORT_NVM_PAGE, address % ARB_PORT_NVM_PAGE + size,
                                      "crosses a page");
    if (fake->refuses) {
        return false;
    }
    fake->writes++;
    fake->polls_left = fake->write_polls;
    fake->status = fake->fails ? -1 : 0;
    const uint16_t len = arriving(fake, address, size);
    if (fake->regions == NULL) {
        return true;
    }
    uint8_t *place = byte_at(fake, address);
    TEST_ASSERT_TRUE_MESSAGE(place != NULL &&
                                 byte_at(fake, (uint16_t)(address + size - 1u)) == &place[size - 1],
                             "this memory is too small for the test");
    memcpy(place, bytes, len);
    if (fake->bad_byte >= (int32_t)address && fake->bad_byte < (int32_t)address + size) {
        *byte_at(fake, (uint16_t)fake->bad_byte) &= 0xFEu;
    }
    return true;
}

static int8_t nvm_status(void *ctx)
{
    fake_port_t *fake = ctx;
    if (fake->polls_left > 0) {
        fake->polls_left--;
        return 1;
    }
    if (fake->fails) {
        return -1;
    }
    return fake->status;
}

void fake_port_init(fake_port_t *fake, const fake_region_t *regions, uint8_t region_count)
{
    memset(fake, 0, sizeof *fake);
    fake->port = (arb_port_t){.ctx = fake,
                              .can_send = can_send,
                              .host_write = host_write,
                              .nvm_read = nvm_read,
                              .nvm_write = nvm_write,
                              .nvm_status = nvm_status};
    fake->room = SIZE_MAX;
    fake->regions = regions;
    fake->region_count = region_count;
    for (uint8_t i = 0; i < region_count; i++) {
        memset(regions[i].bytes, 0xFF, regions[i].size);
    }
    fake_port_power_on(fake);
}

void fake_port_power_on(fake_port_t *fake)
{
    fake->refuses = false;
    fake->fails = false;
    fake->good_writes = -1;
    fake->whole_writes = -1;
    fake->cut_bytes = 0;
    fake->lost_page = -1;
    fake->bad_byte = -1;
    fake->polls_left = 0;
    fake->status = 0;
}
