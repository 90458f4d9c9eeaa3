/* The codec against the tables of [PDCP 2.2, 3.1, 3.2]: every byte below was written from the source, none by
 * the encoder. */
#include <string.h>

#include "pdcp_bytes.h"
#include "pdcp_codec.h"
#include "unity.h"

void setUp(void) {}

void tearDown(void) {}

typedef struct {
    const char *name;
    uint16_t id;
    uint8_t dlc;
    uint8_t data[8];
    pdcp_msg_t msg;
    bool receive_only; /* a size that only [PDCP 3.1] has (D-BUS-3) */
} golden_t;

#define VID 0x1234
#define PID 0x5678
#define SN 0x9ABC
#define IDENTITY                                                                                             \
    {                                                                                                        \
        VID, PID, SN                                                                                         \
    }

/* Little-endian words (D-BUS-1). Device id 17 = 11h; P, M, N as in [PDCP figure 2.3]. */
static const golden_t golden[] = {
    {"01 bind request, P=3 M=0",
     0x611,
     7,
     {0x01, 0x34, 0x12, 0x78, 0x56, 0xBC, 0x9A},
     {.code = 0x01, .identity = IDENTITY},
     false},
    {"81 bind answer, P=1 M=1",
     0x311,
     8,
     {0x81, 0x11, 0x34, 0x12, 0x78, 0x56, 0xBC, 0x9A},
     {.code = 0x81, .node_id = 0x11, .identity = IDENTITY},
     false},
    {"81 refused",
     0x311,
     8,
     {0x81, 0x00, 0x34, 0x12, 0x78, 0x56, 0xBC, 0x9A},
     {.code = 0x81, .node_id = 0, .identity = IDENTITY},
     false},
    {"03 get parameter", 0x311, 3, {0x03, 0x09, 0x02}, {.code = 0x03, .param = 9, .channel = 2}, false},
    {"83 success, 4 bytes",
     0x211,
     8,
     {0x83, 0x01, 0x01, 0x02, 0x00, 0x53, 0x10, 0x11},
     {.code = 0x83, .result = 1, .param = 1, .channel = 2, .len = 4, .value = {0x00, 0x53, 0x10, 0x11}},
     false},
    {"83 failure, no value",
     0x211,
     4,
     {0x83, 0x00, 0x0B, 0x02},
     {.code = 0x83, .result = 0, .param = 11, .channel = 2},
     false},
    {"83 use bulk", 0x211, 4, {0x83, 0x02, 0x07, 0x00}, {.code = 0x83, .result = 2, .param = 7}, false},
    {"04 set parameter, 1 byte",
     0x311,
     4,
     {0x04, 0x04, 0x01, 0x01},
     {.code = 0x04, .param = 4, .channel = 1, .len = 1, .value = {1}},
     false},
    {"04 set parameter, 4 bytes",
     0x311,
     7,
     {0x04, 0x05, 0x02, 0xFF, 0xFF, 0xFF, 0xFF},
     {.code = 0x04, .param = 5, .channel = 2, .len = 4, .value = {0xFF, 0xFF, 0xFF, 0xFF}},
     false},
    {"84 success with value",
     0x211,
     5,
     {0x84, 0x01, 0x04, 0x01, 0x01},
     {.code = 0x84, .result = 1, .param = 4, .channel = 1, .len = 1, .value = {1}},
     false},
    {"84 without a value is accepted",
     0x211,
     4,
     {0x84, 0x01, 0x04, 0x01},
     {.code = 0x84, .result = 1, .param = 4, .channel = 1},
     false},
    {"08 suspend for 1000 ms", 0x311, 3, {0x08, 0xE8, 0x03}, {.code = 0x08, .word = 1000}, false},
    {"88", 0x211, 4, {0x88, 0x01, 0xE8, 0x03}, {.code = 0x88, .result = 1, .word = 1000}, false},
    {"88 as [PDCP 3.1] sizes it", 0x211, 1, {0x88}, {.code = 0x88, .result = 1}, true},
    {"09 release all", 0x300, 1, {0x09}, {.code = 0x09}, false},
    {"89", 0x211, 2, {0x89, 0x00}, {.code = 0x89, .result = 0}, false},
    {"89 as [PDCP 3.1] sizes it", 0x211, 1, {0x89}, {.code = 0x89, .result = 1}, true},
    {"0A device beacon, P=0 M=0", 0x011, 1, {0x0A}, {.code = 0x0A}, false},
    {"0A arbitrator beacon, P=0 M=1 N=0", 0x100, 1, {0x0A}, {.code = 0x0A}, false},
    {"0B reset", 0x311, 1, {0x0B}, {.code = 0x0B}, false},
    {"8B", 0x211, 2, {0x8B, 0x01}, {.code = 0x8B, .result = 1}, false},
    {"8B as [PDCP 3.1] sizes it", 0x211, 1, {0x8B}, {.code = 0x8B, .result = 1}, true},
    {"0C configure get bulk", 0x311, 3, {0x0C, 0x07, 0x00}, {.code = 0x0C, .param = 7}, false},
    {"0C as [PDCP 3.1] sizes it", 0x311, 5, {0x0C, 0x07, 0x00, 0x55, 0x55}, {.code = 0x0C, .param = 7}, true},
    {"8C, 300 bytes",
     0x211,
     6,
     {0x8C, 0x01, 0x07, 0x00, 0x2C, 0x01},
     {.code = 0x8C, .result = 1, .param = 7, .word = 300},
     false},
    {"0D configure set bulk",
     0x311,
     5,
     {0x0D, 0x07, 0x00, 0x2C, 0x01},
     {.code = 0x0D, .param = 7, .word = 300},
     false},
    {"8D",
     0x211,
     6,
     {0x8D, 0x00, 0x07, 0x03, 0x2C, 0x01},
     {.code = 0x8D, .result = 0, .param = 7, .channel = 3, .word = 300},
     false},
    {"0E packet of 6 bytes",
     0x211,
     8,
     {0x0E, 0xFF, 1, 2, 3, 4, 5, 6},
     {.code = 0x0E, .packet_id = 0xFF, .len = 6, .value = {1, 2, 3, 4, 5, 6}},
     false},
    {"0E packet of 1 byte", 0x311, 3, {0x0E, 0x00, 7}, {.code = 0x0E, .len = 1, .value = {7}}, false},
    {"8E", 0x311, 2, {0x8E, 0x01}, {.code = 0x8E, .result = 1}, false},
    {"0F update data channel", 0x211, 2, {0x0F, 0x02}, {.code = 0x0F, .channel = 2}, false},
    {"8F", 0x311, 3, {0x8F, 0x01, 0x02}, {.code = 0x8F, .result = 1, .channel = 2}, false},
    {"02 deprecated", 0x311, 2, {0x02, 0x01}, {.code = 0x02, .len = 1, .value = {1}}, false},
    {"82 deprecated",
     0x211,
     6,
     {0x82, 1, 2, 3, 4, 5},
     {.code = 0x82, .len = 5, .value = {1, 2, 3, 4, 5}},
     false},
    {"05 deprecated", 0x211, 4, {0x05, 1, 2, 3}, {.code = 0x05, .len = 3, .value = {1, 2, 3}}, false},
    {"85 deprecated", 0x311, 4, {0x85, 1, 2, 3}, {.code = 0x85, .len = 3, .value = {1, 2, 3}}, false},
    {"06 deprecated",
     0x211,
     8,
     {0x06, 1, 2, 3, 4, 5, 6, 7},
     {.code = 0x06, .len = 7, .value = {1, 2, 3, 4, 5, 6, 7}},
     false},
    {"86 deprecated", 0x311, 1, {0x86}, {.code = 0x86}, false},
    {"07 deprecated", 0x311, 2, {0x07, 0x20}, {.code = 0x07, .len = 1, .value = {0x20}}, false},
    {"87 deprecated", 0x211, 1, {0x87}, {.code = 0x87}, false},
};

#define GOLDEN_COUNT (sizeof golden / sizeof golden[0])

static can_frame_t frame_of(const golden_t *g)
{
    can_frame_t frame = {.id = g->id, .kind = CAN_FRAME_BASE, .dlc = g->dlc};
    memcpy(frame.data, g->data, sizeof frame.data);
    return frame;
}

static void test_every_message_decodes(void)
{
    for (unsigned i = 0; i < GOLDEN_COUNT; i++) {
        const can_frame_t frame = frame_of(&golden[i]);
        pdcp_msg_t msg;
        TEST_ASSERT_EQUAL_MESSAGE(PDCP_DECODE_OK, pdcp_codec_decode(&frame, &msg), golden[i].name);
        const pdcp_msg_t *want = &golden[i].msg;
        TEST_ASSERT_EQUAL_HEX8_MESSAGE(want->code, msg.code, golden[i].name);
        TEST_ASSERT_EQUAL_MESSAGE(want->result, msg.result, golden[i].name);
        TEST_ASSERT_EQUAL_MESSAGE(want->param, msg.param, golden[i].name);
        TEST_ASSERT_EQUAL_MESSAGE(want->channel, msg.channel, golden[i].name);
        TEST_ASSERT_EQUAL_MESSAGE(want->node_id, msg.node_id, golden[i].name);
        TEST_ASSERT_EQUAL_MESSAGE(want->packet_id, msg.packet_id, golden[i].name);
        TEST_ASSERT_EQUAL_HEX16_MESSAGE(want->word, msg.word, golden[i].name);
        TEST_ASSERT_TRUE_MESSAGE(pdcp_identity_equal(&want->identity, &msg.identity), golden[i].name);
        TEST_ASSERT_EQUAL_MESSAGE(want->len, msg.len, golden[i].name);
        TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(want->value, msg.value, sizeof msg.value, golden[i].name);
    }
}

static void test_every_message_encodes(void)
{
    for (unsigned i = 0; i < GOLDEN_COUNT; i++) {
        if (golden[i].receive_only) {
            continue;
        }
        can_frame_t frame;
        pdcp_codec_encode(golden[i].id, &golden[i].msg, &frame);
        TEST_ASSERT_EQUAL_HEX16_MESSAGE(golden[i].id, frame.id, golden[i].name);
        TEST_ASSERT_EQUAL_MESSAGE(CAN_FRAME_BASE, frame.kind, golden[i].name);
        TEST_ASSERT_EQUAL_MESSAGE(golden[i].dlc, frame.dlc, golden[i].name);
        TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(golden[i].data, frame.data, 8, golden[i].name);
    }
}

/* [PDCP 3.2], with the sizes of [PDCP 3.1] beside where they differ: bit n is DLC n. */
static uint16_t accepted_dlcs(unsigned code)
{
    switch (code) {
    case 0x01:
        return 1u << 7;
    case 0x02:
    case 0x07:
    case 0x0F:
    case 0x8E:
        return 1u << 2;
    case 0x03:
    case 0x08:
        return 1u << 3;
    case 0x04:
        return 1u << 4 | 1u << 5 | 1u << 6 | 1u << 7;
    case 0x05:
        return 1u << 4;
    case 0x06:
        return 1u << 5 | 1u << 6 | 1u << 7 | 1u << 8;
    case 0x09:
    case 0x0A:
    case 0x0B:
    case 0x86:
    case 0x87:
        return 1u << 1;
    case 0x0C:
        return 1u << 3 | 1u << 5;
    case 0x0D:
        return 1u << 5;
    case 0x0E:
        return 1u << 3 | 1u << 4 | 1u << 5 | 1u << 6 | 1u << 7 | 1u << 8;
    case 0x81:
        return 1u << 8;
    case 0x82:
        return 1u << 2 | 1u << 3 | 1u << 4 | 1u << 5 | 1u << 6;
    case 0x83:
    case 0x84:
        return 1u << 4 | 1u << 5 | 1u << 6 | 1u << 7 | 1u << 8;
    case 0x85:
        return 1u << 4 | 1u << 5 | 1u << 6 | 1u << 7;
    case 0x88:
        return 1u << 1 | 1u << 4;
    case 0x89:
    case 0x8B:
        return 1u << 1 | 1u << 2;
    case 0x8C:
    case 0x8D:
        return 1u << 6;
    case 0x8F:
        return 1u << 3;
    default:
        return 0;
    }
}

static void test_every_code_with_every_dlc_is_classified(void)
{
    for (unsigned code = 0; code < 256; code++) {
        for (uint8_t dlc = 0; dlc <= 8; dlc++) {
            const can_frame_t frame = {.id = 0x211, .dlc = dlc, .data = {(uint8_t)code}};
            pdcp_msg_t msg;
            pdcp_decode_t want = PDCP_DECODE_BAD_DLC;
            if (dlc == 0 || accepted_dlcs(code) == 0) {
                want = PDCP_DECODE_UNKNOWN_CODE;
            } else if ((accepted_dlcs(code) & (1u << dlc)) != 0) {
                want = PDCP_DECODE_OK;
            }
            TEST_ASSERT_EQUAL(want, pdcp_codec_decode(&frame, &msg));
        }
    }
}

static void test_a_dlc_above_8_is_refused(void)
{
    for (unsigned dlc = 9; dlc < 256; dlc++) {
        const can_frame_t frame = {.id = 0x211, .dlc = (uint8_t)dlc, .data = {0x83}};
        pdcp_msg_t msg;
        TEST_ASSERT_EQUAL(PDCP_DECODE_BAD_DLC, pdcp_codec_decode(&frame, &msg));
    }
}

/* [PDCP figure 2.3]: priority, mode, node id. */
static void test_identifier_fields(void)
{
    TEST_ASSERT_EQUAL_HEX16(0x611, pdcp_can_id(PDCP_PRIORITY_BINDING, false, 0x11));
    TEST_ASSERT_EQUAL_HEX16(0x100, pdcp_can_id(PDCP_PRIORITY_HIGH, true, PDCP_NODE_BROADCAST));
    TEST_ASSERT_EQUAL_HEX16(0x3FE, pdcp_can_id(PDCP_PRIORITY_NORMAL, true, 254));
    TEST_ASSERT_EQUAL_HEX16(0x4FE, pdcp_can_id(PDCP_PRIORITY_LOW, false, 254));
    for (uint16_t id = 0; id <= CAN_FRAME_ID_MAX; id++) {
        TEST_ASSERT_EQUAL_HEX16(
            id, pdcp_can_id(pdcp_id_priority(id), pdcp_id_from_arbitrator(id), pdcp_id_node(id)));
    }
}

/* pdcp-bus.md 4: missing bytes are 0, extra ones are ignored. */
static void test_values_shorter_and_longer_than_their_field(void)
{
    const uint8_t value[] = {0x34, 0x12, 0x78};
    TEST_ASSERT_EQUAL_HEX16(0x1234, pdcp_bytes_value_u16(value, 3, 0));
    TEST_ASSERT_EQUAL_HEX16(0x0078, pdcp_bytes_value_u16(value, 3, 2));
    TEST_ASSERT_EQUAL_HEX16(0x0034, pdcp_bytes_value_u16(value, 1, 0));
    TEST_ASSERT_EQUAL_HEX16(0, pdcp_bytes_value_u16(value, 0, 0));
    TEST_ASSERT_EQUAL_HEX8(0, pdcp_bytes_value_u8(value, 3, 3));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_message_decodes);
    RUN_TEST(test_every_message_encodes);
    RUN_TEST(test_every_code_with_every_dlc_is_classified);
    RUN_TEST(test_a_dlc_above_8_is_refused);
    RUN_TEST(test_identifier_fields);
    RUN_TEST(test_values_shorter_and_longer_than_their_field);
    return UNITY_END();
}
