/* The numbers and tables of the C code against docs/spec/protocol.toml, which tools/gen_protocol.py turns
 * into protocol_table.h. Tables that are private are asked: which frames the codec takes, which codes are
 * dropped for their direction, which sizes the host API accepts, where a counter stands in its group. */
#include <stdio.h>
#include <string.h>

#include "arb_call.h"
#include "arb_hostext.h"
#include "arb_version.h"
#include "hostlink.h"
#include "pdcp_codec.h"
#include "pdcp_device.h"
#include "pdcp_device_param.h"
#include "profile_tlv.h"
#include "profile_tree.h"
#include "profile_type.h"
#include "protocol_table.h"
#include "unity.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

typedef struct {
    uint8_t code;
    unsigned dlc;  /* sizes of [PDCP 3.2], bit n: n bytes */
    unsigned also; /* sizes that are accepted, too */
    bool from_device;
    bool from_arbitrator;
    bool to_all;
    bool deprecated;
} function_t;

typedef struct {
    const char *name;
    uint8_t code;
    uint8_t at;
    uint8_t size; /* 0: all that is left */
} field_t;

typedef enum { OF_DEVICE, OF_INPUT, OF_OUTPUT } of_t;

typedef struct {
    of_t of;
    uint8_t number;
    uint8_t size; /* 0: any */
    bool written;
    bool mandatory;
} parameter_t;

typedef struct {
    uint16_t id;
    uint16_t least;
    uint16_t most;
    uint16_t answer_least;
    uint16_t answer_most;
} message_t;

/* Numbers at compile time: a wrong one is an array of negative size. */
#define SAME(constant, number) typedef char constant##_as_in_the_table[(long)(constant) == (number) ? 1 : -1];
PROTOCOL_NUMBERS(SAME)

#define FUNCTION(code, dlc, also, device, arbitrator, to_all, deprecated)                                    \
    {code, dlc, also, device, arbitrator, to_all, deprecated},
static const function_t functions[] = {PROTOCOL_FUNCTIONS(FUNCTION)};

#define FIELD(code, name, at, size) {name, code, at, size},
static const field_t fields[] = {PROTOCOL_FIELDS(FIELD)};

#define PARAMETER(of, number, size, written, mandatory) {(of_t)(of), number, size, written, mandatory},
static const parameter_t parameters[] = {PROTOCOL_PARAMETERS(PARAMETER)};

#define UNCONNECTED(number, at, byte) {number, at, byte},
static const uint8_t unconnected[][3] = {PROTOCOL_UNCONNECTED(UNCONNECTED)};

#define MESSAGE(id, least, most, answer_least, answer_most) {id, least, most, answer_least, answer_most},
static const message_t messages[] = {PROTOCOL_MESSAGES(MESSAGE)};

#define EVENT(kind, least, most) {kind, least, most},
static const struct {
    uint8_t kind;
    uint16_t least;
    uint16_t most;
} events[] = {PROTOCOL_EVENTS(EVENT)};

#define COUNTER(group, place, name) {group, place, name},
static const struct {
    uint8_t group;
    uint8_t place;
    const char *name;
} counters[] = {PROTOCOL_COUNTERS(COUNTER)};

static exchange_t x;
static arb_app_t app;
static pdcp_device_t dev;

void setUp(void)
{
    hostlink_start(&x, &app, false);
}

void tearDown(void) {}

static const char *say(const char *what, unsigned number)
{
    static char text[80];
    (void)snprintf(text, sizeof text, "%s %02Xh", what, number);
    return text;
}

/* NULL: there is no such code. */
static const function_t *function_of(unsigned code)
{
    for (size_t i = 0; i < COUNT(functions); i++) {
        if (functions[i].code == code) {
            return &functions[i];
        }
    }
    return NULL;
}

static uint8_t longest(const function_t *function)
{
    uint8_t dlc = 8;
    while ((function->dlc >> dlc & 1u) == 0) {
        dlc--;
    }
    return dlc;
}

/* A frame with this code, all other bytes different from each other and from 0. */
static can_frame_t frame_of(uint16_t id, uint8_t code, uint8_t dlc)
{
    can_frame_t frame = {.id = id, .dlc = dlc, .data = {code, 0x21, 0x32, 0x43, 0x54, 0x65, 0x76, 0x87}};
    return frame;
}

/* --- the bus --- */

static void test_the_codec_takes_the_sizes_of_the_table(void)
{
    pdcp_msg_t msg;
    for (unsigned code = 0; code <= 0xFF; code++) {
        const function_t *function = function_of(code);
        for (uint8_t dlc = 1; dlc <= 8; dlc++) {
            const can_frame_t frame = frame_of(0x211, (uint8_t)code, dlc);
            pdcp_decode_t expected = PDCP_DECODE_UNKNOWN_CODE;
            if (function != NULL) {
                const bool fits = ((function->dlc | function->also) >> dlc & 1u) != 0;
                expected = fits ? PDCP_DECODE_OK : PDCP_DECODE_BAD_DLC;
            }
            TEST_ASSERT_EQUAL_MESSAGE(expected, pdcp_codec_decode(&frame, &msg), say("code", code));
        }
    }
}

/* What was decoded with a size of [PDCP 3.2] is encoded with it. */
static void test_the_codec_sends_the_sizes_of_the_table(void)
{
    for (size_t i = 0; i < COUNT(functions); i++) {
        for (uint8_t dlc = 1; dlc <= 8; dlc++) {
            const can_frame_t frame = frame_of(0x211, functions[i].code, dlc);
            can_frame_t sent;
            pdcp_msg_t msg;
            if ((functions[i].dlc >> dlc & 1u) != 0) {
                TEST_ASSERT_EQUAL(PDCP_DECODE_OK, pdcp_codec_decode(&frame, &msg));
                pdcp_codec_encode(0x211, &msg, &sent);
                TEST_ASSERT_EQUAL_MESSAGE(dlc, sent.dlc, say("code", functions[i].code));
                TEST_ASSERT_EQUAL_HEX8_ARRAY(frame.data, sent.data, dlc);
            }
        }
    }
}

/* A field of a message as a number; of a value its first byte. */
static uint16_t member(const pdcp_msg_t *msg, const char *name)
{
    const struct {
        const char *name;
        uint16_t number;
    } members[] = {{"vid", msg->identity.vid}, {"pid", msg->identity.pid}, {"sn", msg->identity.sn},
                   {"node", msg->node_id},     {"parameter", msg->param},  {"channel", msg->channel},
                   {"response", msg->result},  {"packet", msg->packet_id}, {"time", msg->word},
                   {"size", msg->word},        {"value", msg->value[0]},   {"data", msg->value[0]},
                   {"rest", msg->value[0]}};
    for (size_t i = 0; i < COUNT(members); i++) {
        if (strcmp(members[i].name, name) == 0) {
            return members[i].number;
        }
    }
    TEST_FAIL_MESSAGE(name);
    return 0;
}

static void test_the_codec_knows_where_the_fields_stand(void)
{
    for (size_t i = 0; i < COUNT(fields); i++) {
        const field_t *field = &fields[i];
        const can_frame_t frame = frame_of(0x211, field->code, longest(function_of(field->code)));
        pdcp_msg_t msg;
        TEST_ASSERT_EQUAL(PDCP_DECODE_OK, pdcp_codec_decode(&frame, &msg));
        uint16_t expected = frame.data[field->at];
        if (field->size == 2) {
            expected = (uint16_t)(expected | frame.data[field->at + 1] << 8);
        } else if (field->size == 0) {
            TEST_ASSERT_EQUAL_MESSAGE(frame.dlc - field->at, msg.len, say(field->name, field->code));
        }
        TEST_ASSERT_EQUAL_HEX16_MESSAGE(expected, member(&msg, field->name), say(field->name, field->code));
    }
}

/* All but the bind request, which comes with priority 3. */
static void test_the_arbitrator_takes_what_devices_send(void)
{
    for (size_t i = 0; i < COUNT(functions); i++) {
        const function_t *function = &functions[i];
        if (function->code == PDCP_BIND_DEVICE) {
            continue;
        }
        hostlink_start(&x, &app, false);
        exchange_add_output(&x, "FE");
        const uint32_t *stats = x.arb->bus.stats;
        const uint32_t directions = stats[PDCP_STAT_DROP_DIRECTION];
        const uint32_t deprecated = stats[PDCP_STAT_DROP_DEPRECATED];
        const can_frame_t frame = frame_of(0x011, function->code, longest(function));
        pdcp_arb_on_frame(x.arb, x.now_ms, &frame);
        TEST_ASSERT_EQUAL_MESSAGE(function->deprecated, stats[PDCP_STAT_DROP_DEPRECATED] - deprecated,
                                  say("code", function->code));
        TEST_ASSERT_EQUAL_MESSAGE(!function->deprecated && !function->from_device,
                                  stats[PDCP_STAT_DROP_DIRECTION] - directions, say("code", function->code));
    }
}

static const pdcp_device_channel_desc_t channels[] = {{.direction = PDCP_INPUT}, {.direction = PDCP_OUTPUT}};
static const pdcp_device_desc_t desc = {.identity = {2, 3, 4}, .channels = channels, .channel_count = 2};
static const pdcp_device_port_t port = {.ctx = NULL};

/* A new device gets the id that it asks for. Returns the identifier of frames to it. */
static uint16_t bind_device(void)
{
    can_frame_t asked;
    TEST_ASSERT_TRUE(pdcp_device_init(&dev, &desc, &port, NULL, 1, 0));
    (void)pdcp_device_step(&dev, 0);
    TEST_ASSERT_TRUE(pdcp_device_tx_peek(&dev, &asked));
    const uint8_t id = pdcp_id_node(asked.id);
    const can_frame_t granted = {
        .id = pdcp_can_id(1, true, id), .dlc = 8, .data = {0x81, id, 2, 0, 3, 0, 4, 0}};
    pdcp_device_on_frame(&dev, 0, &granted);
    TEST_ASSERT_EQUAL_HEX8(id, pdcp_device_node_id(&dev));
    return granted.id;
}

static void test_a_device_takes_what_arbitrators_send(void)
{
    for (size_t i = 0; i < 2 * COUNT(functions); i++) {
        const function_t *function = &functions[i / 2];
        const bool to_all = i % 2 != 0;
        const uint16_t id = bind_device();
        const can_frame_t frame = frame_of(to_all ? 0x300 : id, function->code, longest(function));
        pdcp_device_on_frame(&dev, 0, &frame);
        const bool old = function->deprecated && function->from_arbitrator;
        const bool taken = function->from_arbitrator && (function->to_all || !to_all);
        TEST_ASSERT_EQUAL_MESSAGE(old, pdcp_device_stats(&dev)->drop_deprecated, say("code", function->code));
        TEST_ASSERT_EQUAL_MESSAGE(!old && !taken, pdcp_device_stats(&dev)->drop_direction,
                                  say(to_all ? "to all, code" : "code", function->code));
    }
}

static const parameter_t *parameter_of(of_t of, unsigned number)
{
    for (size_t i = 0; i < COUNT(parameters); i++) {
        if (parameters[i].of == of && parameters[i].number == number) {
            return &parameters[i];
        }
    }
    return NULL;
}

static void test_a_device_has_the_parameters_of_the_table(void)
{
    static const char *const names[] = {"device", "input", "output"};
    (void)bind_device();
    for (uint8_t channel = 0; channel <= 2; channel++) {
        for (unsigned number = 0; number <= 0xFF; number++) {
            const parameter_t *parameter = parameter_of((of_t)channel, number);
            const char *text = say(names[channel], number);
            pdcp_device_value_t value;
            const bool found = pdcp_device_param_get(&dev, (uint8_t)number, channel, &value);
            TEST_ASSERT_EQUAL_MESSAGE(parameter != NULL, found, text);
            if (parameter != NULL && parameter->size != 0) {
                TEST_ASSERT_EQUAL_MESSAGE(parameter->size, value.len, text);
            }
            TEST_ASSERT_EQUAL_MESSAGE(parameter != NULL && parameter->written,
                                      pdcp_device_param_capacity(&dev, (uint8_t)number, channel) != 0, text);
        }
    }
}

static void test_an_input_without_a_source_says_so(void)
{
    (void)bind_device();
    for (size_t i = 0; i < COUNT(unconnected); i++) {
        pdcp_device_value_t value;
        TEST_ASSERT_TRUE(pdcp_device_param_get(&dev, unconnected[i][0], 1, &value));
        TEST_ASSERT_LESS_THAN(value.len, unconnected[i][1]);
        TEST_ASSERT_EQUAL_HEX8_MESSAGE(unconnected[i][2], value.bytes[unconnected[i][1]],
                                       say("parameter", unconnected[i][0]));
    }
}

/* What a device 0002:0003:0004 with an input 1 and an output 2 has in a parameter: its first byte. */
static uint8_t value_of(uint8_t channel, uint8_t param)
{
    if (channel == 0) {
        return param == PDCP_DEV_SERIAL ? 4 : 2; /* 2: its VID, and how many channels it has */
    }
    return param == PDCP_CH_TRANSFER_TYPE ? channel : 0;
}

/* The answer of this device, which refuses one parameter of what stands at channel. */
static void answer(const can_frame_t *request, const parameter_t *refused)
{
    const uint8_t code = request->data[0];
    const uint8_t param = request->data[1];
    const uint8_t channel = request->data[2];
    const bool success = refused->of != (of_t)channel || refused->number != param;
    can_frame_t frame = {.id = 0x211, .dlc = 8};
    const uint8_t third = channel == 0 && param == PDCP_DEV_VID_PID ? 3 : 0;
    const uint8_t data[8] = {code | PDCP_ANSWER,       success, param, channel,
                             value_of(channel, param), 0,       third, 0};
    memcpy(frame.data, data, sizeof data);
    if (code == PDCP_SET_PARAMETER) {
        memcpy(&frame.data[4], &request->data[3], 4);
        frame.dlc = (uint8_t)(request->dlc + 1);
    }
    frame.dlc = success ? frame.dlc : 4;
    arb_app_on_frame(&app, x.now_ms, &frame);
}

/* At once, without a second attempt. */
static bool is_set_up_without(const parameter_t *refused)
{
    const can_frame_t asks = {.id = 0x611, .dlc = 7, .data = {PDCP_BIND_DEVICE, 2, 0, 3, 0, 4, 0}};
    hostlink_start(&x, &app, false);
    arb_app_on_frame(&app, x.now_ms, &asks);
    for (int ms = 0; ms < 50; ms++) {
        const can_frame_t *sent;
        exchange_wait(&x, 1);
        while ((sent = pdcp_arb_tx_peek(x.arb)) != NULL) {
            const can_frame_t frame = *sent;
            pdcp_arb_tx_pop(x.arb);
            if (frame.id == 0x311 && frame.data[0] != (PDCP_BIND_DEVICE | PDCP_ANSWER)) {
                answer(&frame, refused);
            }
        }
    }
    return x.arb->bus.tables.devices[0].state == PDCP_PLACE_READY;
}

static void test_a_setup_needs_the_mandatory_parameters(void)
{
    static const parameter_t nothing = {.of = OF_DEVICE, .number = 0};
    TEST_ASSERT_TRUE(is_set_up_without(&nothing));
    for (size_t i = 0; i < COUNT(parameters); i++) {
        TEST_ASSERT_EQUAL_MESSAGE(parameters[i].mandatory, !is_set_up_without(&parameters[i]),
                                  say("parameter", parameters[i].number));
    }
}

/* --- the host API --- */

/* NULL: there is no such request. */
static const message_t *message_of(unsigned id)
{
    for (size_t i = 0; i < COUNT(messages); i++) {
        if (messages[i].id == id) {
            return &messages[i];
        }
    }
    return NULL;
}

/* Asks with len bytes of this value and waits for the answer. Returns its id. */
static uint16_t answer_to(uint16_t id, uint8_t byte, uint16_t len, const uint8_t **payload,
                          uint16_t *answer_len)
{
    uint8_t request[32];
    TEST_ASSERT_LESS_OR_EQUAL(sizeof request, len);
    memset(request, byte, sizeof request);
    hostlink_ask(&x, id, 1, request, len);
    for (int ms = 0; ms < 4000 && hostlink_waiting() == 0; ms++) {
        exchange_wait(&x, 1);
        (void)exchange_drain(&x);
    }
    return hostlink_take(payload, answer_len);
}

/* What the arguments ask for is not there, but for a reset of all devices, of which there are none: any error
 * but 01h shows that the size was right. */
static bool accepts(uint16_t id, uint16_t len)
{
    const uint8_t *payload = NULL;
    uint16_t answer_len = 0;
    const uint16_t answer = answer_to(id, id == ARB_MSG_RESET ? 0 : 7, len, &payload, &answer_len);
    const message_t *message = message_of(id);
    if (answer == id + 1) {
        TEST_ASSERT_TRUE_MESSAGE(answer_len >= message->answer_least && answer_len <= message->answer_most,
                                 say("answer", answer));
        return true;
    }
    TEST_ASSERT_EQUAL_HEX16(id + 2, answer);
    return id != ARB_MSG_RESET && payload[0] != ARB_ERR_SIZE;
}

static void test_the_host_api_takes_the_sizes_of_the_table(void)
{
    for (size_t i = 0; i < COUNT(messages); i++) {
        hostlink_start(&x, &app, false);
        for (uint16_t len = 0; len <= 24; len++) {
            const bool fits = len >= messages[i].least && len <= messages[i].most;
            TEST_ASSERT_EQUAL_MESSAGE(fits, accepts(messages[i].id, len), say("message", messages[i].id));
        }
    }
}

static void test_the_host_api_has_no_other_messages(void)
{
    for (unsigned id = 0x2100; id < 0x2600; id++) {
        const uint8_t *payload;
        uint16_t len;
        if (message_of(id) == NULL) {
            TEST_ASSERT_EQUAL_HEX16(ARB_MSG_UNKNOWN_ID, answer_to((uint16_t)id, 7, 1, &payload, &len));
            TEST_ASSERT_EQUAL(0, len);
        }
    }
}

/* With a link on the bus, all tables have an entry 1. */
static void test_answers_from_the_tables_have_the_sizes_of_the_table(void)
{
    exchange_add_both(&x);
    hostlink_ask(&x, ARB_MSG_CONFIGURE_LINK, 1, BYTES(2, 0, 2, 0, 4, 0, 1, 2, 0, 2, 0, 6, 0, 1));
    exchange_run(&x, exchange_making);
    hostlink_answer(ARB_MSG_CONFIGURE_LINK + 1, 1, BYTES(PDCP_LINK_ACTIVE));
    for (size_t i = 0; i < COUNT(messages); i++) {
        if (messages[i].id < 0x2300) {
            const uint8_t *payload;
            uint16_t len;
            TEST_ASSERT_EQUAL_HEX16(messages[i].id + 1,
                                    answer_to(messages[i].id, 1, messages[i].least, &payload, &len));
            TEST_ASSERT_EQUAL_MESSAGE(messages[i].answer_least, len, say("message", messages[i].id));
        }
    }
}

static void test_events(void)
{
    uint16_t mask = 0;
    uint16_t most = 0;
    uint8_t last = 0;
    for (size_t i = 0; i < COUNT(events); i++) {
        const uint16_t data = events[i].most == 0xFFFF ? (uint16_t)(events[i].least + 8) : events[i].most;
        mask = (uint16_t)(mask | 1u << (events[i].kind - 1));
        most = data > most ? data : most;
        last = events[i].kind > last ? events[i].kind : last;
    }
    TEST_ASSERT_EQUAL_HEX16(ARB_EVENT_MASK, mask);
    TEST_ASSERT_EQUAL(ARB_EVENT_DATA_MAX, most);
    TEST_ASSERT_EQUAL(ARB_EVENT_KINDS, last);
}

/* --- counters --- */

/* Where the counters are kept that are bytes, or have no enumerator of their own. */
static bool set_small(const char *name, uint8_t value)
{
    if (strcmp(name, "identities_failed") == 0) {
        app.store.failures = value;
    } else if (strcmp(name, "identities_damaged") == 0) {
        app.store.damaged = value;
    } else if (strcmp(name, "flags_failed") == 0) {
        app.limb.flags.failures = value;
    } else if (strcmp(name, "flags_damaged") == 0) {
        app.limb.flags.damaged = value;
    } else {
        return false;
    }
    return true;
}

/* The counter with this name; NULL: it is a byte, or the driver's. */
static uint32_t *counter_of(uint8_t group, uint8_t place, const char *name)
{
    const struct {
        const char *name;
        uint32_t *counter;
    } all[] = {
        {"bytes_received", &app.api.counters[ARB_HOSTAPI_RECEIVED]},
        {"bytes_sent", &app.api.counters[ARB_HOSTAPI_SENT]},
        {"requests", &app.api.counters[ARB_HOSTAPI_REQUESTS]},
        {"bytes_skipped", &app.api.rx.counters[ARB_HOSTRX_GARBAGE]},
        {"bad_size", &app.api.rx.counters[ARB_HOSTRX_BAD_SIZES]},
        {"bad_crc8", &app.api.rx.counters[ARB_HOSTRX_BAD_CRC8S]},
        {"bad_crc16", &app.api.rx.counters[ARB_HOSTRX_BAD_CRC16S]},
        {"given_up", &app.api.rx.counters[ARB_HOSTRX_GIVEN_UP]},
        {"busy", &app.api.counters[ARB_HOSTAPI_BUSY]},
        {"unknown", &app.api.counters[ARB_HOSTAPI_UNKNOWN]},
        {"events_sent", &app.api.events.counters[0]},
        {"dropped_bound", &app.api.events.counters[ARB_EVENT_BOUND]},
        {"dropped_lost", &app.api.events.counters[ARB_EVENT_LOST]},
        {"dropped_link", &app.api.events.counters[ARB_EVENT_LINK]},
        {"dropped_configuration", &app.api.events.counters[ARB_EVENT_CONFIG]},
        {"dropped_frame", &app.api.events.counters[ARB_EVENT_FRAME]},
        {"dropped_bus_state", &app.api.events.counters[ARB_EVENT_BUS_STATE]},
        {"dropped_7", &app.api.events.counters[7]},
        {"dropped_8", &app.api.events.counters[8]},
        {"dropped_audit", &app.api.events.counters[ARB_EVENT_AUDIT]},
        {"configuration_pages", &app.limb.config.counters[ARB_CONFIG_PAGES]},
        {"configuration_writes", &app.limb.config.counters[ARB_CONFIG_WRITES]},
        {"configuration_unchanged", &app.limb.config.counters[ARB_CONFIG_COUNT_UNCHANGED]},
        {"configuration_failures", &app.limb.config.counters[ARB_CONFIG_FAILURES]},
        {"configuration_damaged", &app.limb.config.counters[ARB_CONFIG_DAMAGED]},
    };
    if (group == ARB_STATS_BUS) { /* the place is the enumerator's number, see PROTOCOL_NUMBERS */
        return &app.arb.bus.stats[place];
    }
    for (size_t i = 0; i < COUNT(all); i++) {
        if (strcmp(all[i].name, name) == 0) {
            return all[i].counter;
        }
    }
    return NULL;
}

/* One counter is set to 200, and stands at its place alone. */
static void test_a_counter_stands_at_its_place(void)
{
    for (size_t i = 0; i < COUNT(counters); i++) {
        const uint8_t *payload;
        uint16_t len;
        hostlink_start(&x, &app, false);
        uint32_t *counter = counter_of(counters[i].group, counters[i].place, counters[i].name);
        if (counter != NULL) {
            *counter = 200;
        } else if (!set_small(counters[i].name, 200)) {
            TEST_ASSERT_EQUAL_MESSAGE(ARB_STATS_DRIVERS, counters[i].group, counters[i].name);
            continue;
        }
        TEST_ASSERT_EQUAL_HEX16(ARB_MSG_STATISTICS + 1,
                                answer_to(ARB_MSG_STATISTICS, counters[i].group, 1, &payload, &len));
        for (uint16_t at = 1; at < len; at = (uint16_t)(at + 4)) {
            const bool is_it = at == 1 + 4 * counters[i].place;
            TEST_ASSERT_EQUAL_MESSAGE(is_it, payload[at] >= 200, counters[i].name);
        }
    }
}

static void test_groups_have_all_their_counters_and_there_are_no_others(void)
{
    enum { GROUPS = 4 };
    uint8_t counts[GROUPS] = {0};
    for (size_t i = 0; i < COUNT(counters); i++) {
        TEST_ASSERT_LESS_THAN(GROUPS, counters[i].group);
        counts[counters[i].group]++;
    }
    for (int group = 0; group <= GROUPS; group++) {
        const uint8_t *payload;
        uint16_t len;
        const uint16_t answer = answer_to(ARB_MSG_STATISTICS, (uint8_t)group, 1, &payload, &len);
        if (group == GROUPS) {
            TEST_ASSERT_EQUAL_HEX16(ARB_MSG_STATISTICS + 2, answer);
            TEST_ASSERT_EQUAL_HEX8(ARB_ERR_NUMBER, payload[0]);
        } else {
            TEST_ASSERT_EQUAL_HEX16(ARB_MSG_STATISTICS + 1, answer);
            TEST_ASSERT_EQUAL_MESSAGE(1 + 4 * counts[group], len, say("group", (unsigned)group));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_codec_takes_the_sizes_of_the_table);
    RUN_TEST(test_the_codec_sends_the_sizes_of_the_table);
    RUN_TEST(test_the_codec_knows_where_the_fields_stand);
    RUN_TEST(test_the_arbitrator_takes_what_devices_send);
    RUN_TEST(test_a_device_takes_what_arbitrators_send);
    RUN_TEST(test_a_device_has_the_parameters_of_the_table);
    RUN_TEST(test_an_input_without_a_source_says_so);
    RUN_TEST(test_a_setup_needs_the_mandatory_parameters);
    RUN_TEST(test_the_host_api_takes_the_sizes_of_the_table);
    RUN_TEST(test_the_host_api_has_no_other_messages);
    RUN_TEST(test_answers_from_the_tables_have_the_sizes_of_the_table);
    RUN_TEST(test_events);
    RUN_TEST(test_a_counter_stands_at_its_place);
    RUN_TEST(test_groups_have_all_their_counters_and_there_are_no_others);
    return UNITY_END();
}
