/* Simulated devices in virtual time: signals, copies, what terminal inputs report, and the state file. The
 * clock starts so that the device's milliseconds wrap during the tests. */
#define _POSIX_C_SOURCE 200809L /* mkdtemp, strdup */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "node_state.h"
#include "sim_node.h"
#include "unity.h"

static char folder[64];
static char error[512];
static uint64_t now_us;
static node_ini_t *ini;
static sim_node_t *node;

static sim_node_event_t events[64];
static unsigned event_count;

static void on_event(void *ctx, const sim_node_event_t *event)
{
    TEST_ASSERT_EQUAL_PTR(&events, ctx);
    TEST_ASSERT_TRUE(event_count < 64);
    events[event_count++] = *event;
}

/* Device 2:2:6 with id 16: terminal input 1, boolean input 2, and outputs of every kind. */
static const char device[] =
    "[device]\nvid=2\npid=2\nserial=6\nnode_id=16\nstate=state.txt\n"
    "[channel 1]\ndirection=input\ntype=0x5300\nsafe=7\n"
    "[channel 2]\ndirection=input\ntype=0x7200\n"
    "[channel 3]\ndirection=output\ntype=0x5000\nsignal=sine 0 255 2000\nrate_ms=20\n"
    "[channel 4]\ndirection=output\ntype=0xC000\nsignal=copy 1\n"
    "[channel 5]\ndirection=output\ntype=0x5000\nsignal=copy 2\nrate_ms=30\n";

static const char *in_folder(const char *name)
{
    static char full[128];
    (void)snprintf(full, sizeof full, "%s/%s", folder, name);
    return full;
}

static void write_file(const char *name, const char *text)
{
    FILE *file = fopen(in_folder(name), "w");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_TRUE(fputs(text, file) >= 0);
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static void read_file(const char *name, char *text, size_t size)
{
    FILE *file = fopen(in_folder(name), "r");
    TEST_ASSERT_NOT_NULL(file);
    text[fread(text, 1, size - 1, file)] = '\0';
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static can_frame_t frame_of(unsigned id, const char *hex)
{
    can_frame_t frame;
    memset(&frame, 0, sizeof frame);
    frame.id = (uint16_t)id;
    for (; *hex != '\0'; hex += 2) {
        const char digits[3] = {hex[0], hex[1], '\0'};
        frame.data[frame.dlc++] = (uint8_t)strtoul(digits, NULL, 16);
    }
    return frame;
}

static void rx(unsigned id, const char *hex)
{
    const can_frame_t frame = frame_of(id, hex);
    sim_node_on_frame(node, now_us, &frame);
    (void)sim_node_step(node, now_us);
}

static void check_tx(unsigned line, unsigned id, const char *hex)
{
    const can_frame_t want = frame_of(id, hex);
    can_frame_t got;
    UNITY_TEST_ASSERT(sim_node_tx_peek(node, &got), line, "nothing was sent");
    sim_node_tx_pop(node);
    UNITY_TEST_ASSERT_EQUAL_HEX16(want.id, got.id, line, "identifier");
    UNITY_TEST_ASSERT_EQUAL_UINT8(want.dlc, got.dlc, line, "DLC");
    UNITY_TEST_ASSERT_EQUAL_HEX8_ARRAY(want.data, got.data, 8, line, "data");
}

static void check_quiet(unsigned line)
{
    can_frame_t got;
    UNITY_TEST_ASSERT(!sim_node_tx_peek(node, &got), line, "something was sent");
}

#define TX(id, hex) check_tx(__LINE__, (id), (hex))
#define QUIET() check_quiet(__LINE__)
#define ANSWERED(request, answer)                                                                            \
    do {                                                                                                     \
        rx(0x310, (request));                                                                                \
        TX(0x210, (answer));                                                                                 \
    } while (0)

static void power_on(void)
{
    write_file("n.ini", device);
    ini = node_ini_load(in_folder("n.ini"), error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(ini, error);
    node = sim_node_open(ini, 1, now_us, on_event, events, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(node, error);
    (void)sim_node_step(node, now_us);
}

static void power_off(void)
{
    sim_node_close(node);
    node_ini_free(ini);
    node = NULL;
    ini = NULL;
}

static void bind_node(void)
{
    power_on();
    TX(0x610, "01020002000600");
    rx(0x310, "8110020002000600");
    TX(0x010, "0A");
    QUIET();
}

/* Input 1 fed by id 21h of the given type and profile. */
static void feed_input_1(const char *type_profile)
{
    char request[17];
    char answer[17];
    (void)snprintf(request, sizeof request, "040801%s", type_profile);
    (void)snprintf(answer, sizeof answer, "84010801%s", type_profile);
    ANSWERED(request, answer);
    ANSWERED("0407012021", "840107012021");
    ANSWERED("04040101", "8401040101");
}

void setUp(void)
{
    (void)snprintf(folder, sizeof folder, "/tmp/test_sim_node.XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    now_us = ((uint64_t)UINT32_MAX - 700) * 1000 + 500;
    event_count = 0;
    node = NULL;
    ini = NULL;
}

void tearDown(void)
{
    static const char *const names[] = {"n.ini", "state.txt", "state.txt.new", "out.txt"};
    power_off();
    for (unsigned i = 0; i < 4; i++) {
        (void)unlink(in_folder(names[i]));
    }
    TEST_ASSERT_EQUAL_INT(0, rmdir(folder));
}

/* --- signals --- */

static void test_signal_values(void)
{
    static node_signal_point_t points[] = {{0, 5}, {100, 6}, {250, 7}};
    const node_signal_t constant = {.kind = NODE_SIGNAL_CONSTANT, .min = -3};
    const node_signal_t sine = {.kind = NODE_SIGNAL_SINE, .min = 0, .max = 200, .period_ms = 1000};
    const node_signal_t square = {.kind = NODE_SIGNAL_SQUARE, .min = 1, .max = 2, .period_ms = 100};
    const node_signal_t csv = {.kind = NODE_SIGNAL_CSV, .points = points, .point_count = 3, .period_ms = 400};
    const node_signal_t single = {.kind = NODE_SIGNAL_CSV, .points = points, .point_count = 1};
    TEST_ASSERT_EQUAL_INT32(-3, node_signal_value(&constant, 99));
    TEST_ASSERT_EQUAL_INT32(100, node_signal_value(&sine, 0));
    TEST_ASSERT_EQUAL_INT32(200, node_signal_value(&sine, 250));
    TEST_ASSERT_EQUAL_INT32(0, node_signal_value(&sine, 750));
    TEST_ASSERT_EQUAL_INT32(171, node_signal_value(&sine, 1125)); /* 100 + 100 sin 45 degrees */
    TEST_ASSERT_EQUAL_INT32(1, node_signal_value(&square, 49));
    TEST_ASSERT_EQUAL_INT32(2, node_signal_value(&square, 50));
    TEST_ASSERT_EQUAL_INT32(1, node_signal_value(&square, 100));
    TEST_ASSERT_EQUAL_INT32(5, node_signal_value(&csv, 99));
    TEST_ASSERT_EQUAL_INT32(6, node_signal_value(&csv, 249));
    TEST_ASSERT_EQUAL_INT32(7, node_signal_value(&csv, 399));
    TEST_ASSERT_EQUAL_INT32(5, node_signal_value(&csv, 400));
    TEST_ASSERT_EQUAL_INT32(5, node_signal_value(&single, 12345));
}

static void check_scale(uint16_t from_word, int32_t value, uint16_t to_word, int32_t want)
{
    profile_type_t from;
    profile_type_t to;
    (void)profile_type_decode(from_word, &from);
    (void)profile_type_decode(to_word, &to);
    TEST_ASSERT_EQUAL_INT32(want, node_signal_scale(value, &from, &to));
}

static void test_full_range_maps_to_full_range(void)
{
    check_scale(0x5000, 0, 0x4000, -128); /* unsigned 8 to signed 8 */
    check_scale(0x5000, 255, 0x4000, 127);
    check_scale(0x4000, -128, 0xD000, 0); /* signed 8 to unsigned 16 */
    check_scale(0x4000, 127, 0xD000, 65535);
    check_scale(0xC000, -32768, 0x0000, -8);
    check_scale(0xC000, 32767, 0x0000, 7);
    check_scale(0x5000, 127, 0x7000, 0); /* to boolean: the nearer end */
    check_scale(0x5000, 128, 0x7000, 1);
    check_scale(0x7000, 1, 0x5000, 255);
    check_scale(0x5000, 85, 0x1000, 5);
}

/* --- outputs --- */

static void test_output_streams_at_its_rate_while_enabled(void)
{
    bind_node();
    const uint64_t start_us = now_us;
    ANSWERED("04050323", "8401050323");
    QUIET();
    now_us += 5000;
    rx(0x310, "04040301");
    TX(0x023, "82"); /* 127.5 + 127.5 sin(5 / 2000 turns) = 129.5, rounded */
    TX(0x210, "8401040301");
    for (unsigned i = 1; i <= 10; i++) {
        const uint64_t due_us = sim_node_step(node, now_us);
        TEST_ASSERT_EQUAL_UINT64(start_us + 5000 + i * 20000, due_us);
        now_us = due_us;
        (void)sim_node_step(node, now_us);
        can_frame_t frame;
        TEST_ASSERT_TRUE(sim_node_tx_peek(node, &frame));
        TEST_ASSERT_EQUAL_HEX16(0x023, frame.id);
        const double angle = (double)(5 + i * 20) / 2000.0 * 2.0 * acos(-1.0);
        TEST_ASSERT_EQUAL_INT32(lround(127.5 + 127.5 * sin(angle)), frame.data[0]);
        sim_node_tx_pop(node);
        QUIET();
    }
    rx(0x310, "04040300");
    TX(0x210, "8401040300");
    now_us += 100000;
    rx(0x100, "0A");
    QUIET();
}

static void test_copy_without_a_rate_follows_its_input(void)
{
    bind_node();
    feed_input_1("00502021"); /* unsigned 8 bits */
    ANSWERED("04050424", "8401050424");
    ANSWERED("04040401", "8401040401");
    QUIET();
    rx(0x021, "FF");
    TX(0x024, "FF7F"); /* own type: signed 16 bits */
    rx(0x021, "00");
    TX(0x024, "0080");
    QUIET();
}

static void test_copy_with_a_rate_waits_for_a_first_value(void)
{
    bind_node();
    ANSWERED("0407022022", "840107022022");
    ANSWERED("04040201", "8401040201");
    ANSWERED("04050525", "8401050525");
    ANSWERED("04040501", "8401040501");
    QUIET();
    rx(0x022, "01"); /* parameter 8 is not written: the input's own type, boolean */
    QUIET();
    now_us += 30000;
    (void)sim_node_step(node, now_us);
    TX(0x025, "FF");
    QUIET();
    now_us += 30000;
    (void)sim_node_step(node, now_us);
    TX(0x025, "FF");
}

/* --- terminal inputs --- */

static void test_terminal_input_reports_what_it_receives(void)
{
    bind_node();
    feed_input_1("00502021");
    rx(0x021, "F4");
    TEST_ASSERT_EQUAL_UINT(1, event_count);
    TEST_ASSERT_EQUAL_UINT64(now_us, events[0].time_us);
    TEST_ASSERT_EQUAL_UINT8(1, events[0].channel);
    TEST_ASSERT_FALSE(events[0].safe);
    TEST_ASSERT_TRUE(events[0].has_value);
    TEST_ASSERT_EQUAL_INT32(244, events[0].value);
}

static void test_value_is_read_by_the_type_of_the_source(void)
{
    bind_node();
    feed_input_1("00C02021"); /* signed 16 bits */
    rx(0x021, "FEFF");
    TEST_ASSERT_EQUAL_INT32(-2, events[0].value);
    TEST_ASSERT_EQUAL_UINT8(2, events[0].len);
    ANSWERED("04080100E02021", "8401080100E02021"); /* float */
    rx(0x021, "003C");
    TEST_ASSERT_FALSE(events[1].has_value);
}

static void test_input_that_is_not_terminal_reports_nothing(void)
{
    bind_node();
    ANSWERED("0407022022", "840107022022");
    ANSWERED("04040201", "8401040201");
    rx(0x022, "01");
    TEST_ASSERT_EQUAL_UINT(0, event_count);
}

static void test_silence_of_the_arbitrator_is_reported_as_safe(void)
{
    bind_node();
    feed_input_1("00502021");
    const uint64_t heard_us = now_us;
    while (event_count == 0 && now_us < heard_us + 10000000) {
        can_frame_t frame;
        now_us = sim_node_step(node, now_us);
        while (sim_node_tx_peek(node, &frame)) {
            sim_node_tx_pop(node);
        }
    }
    TEST_ASSERT_EQUAL_UINT(1, event_count);
    TEST_ASSERT_TRUE(events[0].safe);
    TEST_ASSERT_EQUAL_INT32(7, events[0].value);
    TEST_ASSERT_TRUE(events[0].time_us >= heard_us + 2999000 && events[0].time_us <= heard_us + 3001000);
}

static void expect_line(const sim_node_event_t *event, const char *expected)
{
    char line[SIM_NODE_LINE];
    sim_node_format(line, event);
    TEST_ASSERT_EQUAL_STRING(expected, line);
}

static void test_lines(void)
{
    sim_node_event_t event = {.time_us = 1234567, .identity = {2, 2, 0xAB}, .channel = 1, .len = 2};
    event.raw[0] = 0xF4;
    event.raw[1] = 0x01;
    event.has_value = true;
    event.value = -12;
    expect_line(&event,
                "{\"t_ms\":1234,\"device\":\"2:2:171\",\"channel\":1,\"raw\":\"f401\",\"value\":-12}");
    event.has_value = false;
    expect_line(&event,
                "{\"t_ms\":1234,\"device\":\"2:2:171\",\"channel\":1,\"raw\":\"f401\",\"value\":null}");
    event =
        (sim_node_event_t){.time_us = 5000, .identity = {1, 2, 3}, .channel = 2, .safe = true, .value = 9};
    expect_line(&event, "{\"t_ms\":5,\"device\":\"1:2:3\",\"channel\":2,\"safe\":true,\"value\":9}");
    event = (sim_node_event_t){.time_us = UINT64_MAX,
                               .identity = {65535, 65535, 65535},
                               .channel = 255,
                               .len = 8,
                               .has_value = true,
                               .value = INT32_MIN};
    char line[SIM_NODE_LINE];
    sim_node_format(line, &event); /* the longest one is whole */
    TEST_ASSERT_EQUAL_HEX8('}', line[strlen(line) - 1]);
}

/* --- state file --- */

static void test_state_is_kept_over_power_off(void)
{
    char text[256];
    power_on();
    TX(0x610, "01020002000600");
    rx(0x310, "812A020002000600"); /* another id is suggested and granted */
    TX(0x62A, "01020002000600");
    rx(0x32A, "812A020002000600");
    TX(0x02A, "0A");
    rx(0x32A, "04050102000900");
    rx(0x32A,
       "040601"
       "0B0004");
    rx(0x32A, "04080100502021");
    read_file("state.txt", text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("node_id 42\nsource 1 0002 0009 000B 4 5000 2120\n", text);
    power_off();
    power_on();
    TX(0x62A, "01020002000600");
    rx(0x32A, "812A020002000600");
    TX(0x02A, "0A");
    TX(0x22A, "0F01"); /* and asks for the source that it had */
    rx(0x32A, "030601");
    TX(0x22A, "830106010B0004");
}

static void test_state_that_cannot_be_read_is_an_error(void)
{
    char want[256];
    write_file("n.ini", device);
    write_file("state.txt", "node_id 5\nsource 1 2 3\n");
    ini = node_ini_load(in_folder("n.ini"), error, sizeof error);
    TEST_ASSERT_NULL(sim_node_open(ini, 1, now_us, NULL, NULL, error, sizeof error));
    (void)snprintf(want, sizeof want, "%s/state.txt:2: neither node_id nor source", folder);
    TEST_ASSERT_EQUAL_STRING(want, error);
}

static void test_state_that_cannot_be_written_is_counted(void)
{
    pdcp_device_record_t record;
    node_state_blank(&record);
    TEST_ASSERT_FALSE(node_state_save("/nonexistent/state", &record, 1));
    TEST_ASSERT_TRUE(node_state_load("/nonexistent/state", &record, error, sizeof error));
    bind_node();
    TEST_ASSERT_EQUAL_UINT32(0, sim_node_store_errors(node));
    free(ini->state_path);
    ini->state_path = strdup("/nonexistent/state");
    ANSWERED("04050102000900", "8401050102000900");
    TEST_ASSERT_EQUAL_UINT32(1, sim_node_store_errors(node));
}

static void test_wrong_numbers_in_the_state_are_refused(void)
{
    static const char *const texts[] = {
        "node_id 255\n",
        "node_id x\n",
        "node_id 5 6\n",
        "source 0 2 2 2 1 0 0\n",
        "source 33 2 2 2 1 0 0\n",
        "source 1 10000 2 2 1 0 0\n",
        "source 1 2 2 2 256 0 0\n",
        "hello\n",
    };
    pdcp_device_record_t record;
    for (unsigned i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        write_file("state.txt", texts[i]);
        TEST_ASSERT_FALSE_MESSAGE(node_state_load(in_folder("state.txt"), &record, error, sizeof error),
                                  texts[i]);
    }
    write_file("state.txt", "\nnode_id 254\nsource 32 FFFF 2 2 255 FFFF 0\n");
    TEST_ASSERT_TRUE(node_state_load(in_folder("state.txt"), &record, error, sizeof error));
    TEST_ASSERT_EQUAL_UINT8(254, record.node_id);
    TEST_ASSERT_EQUAL_HEX16(0xFFFF, record.sources[31].type);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_signal_values);
    RUN_TEST(test_full_range_maps_to_full_range);
    RUN_TEST(test_output_streams_at_its_rate_while_enabled);
    RUN_TEST(test_copy_without_a_rate_follows_its_input);
    RUN_TEST(test_copy_with_a_rate_waits_for_a_first_value);
    RUN_TEST(test_terminal_input_reports_what_it_receives);
    RUN_TEST(test_value_is_read_by_the_type_of_the_source);
    RUN_TEST(test_input_that_is_not_terminal_reports_nothing);
    RUN_TEST(test_silence_of_the_arbitrator_is_reported_as_safe);
    RUN_TEST(test_lines);
    RUN_TEST(test_state_is_kept_over_power_off);
    RUN_TEST(test_state_that_cannot_be_read_is_an_error);
    RUN_TEST(test_state_that_cannot_be_written_is_counted);
    RUN_TEST(test_wrong_numbers_in_the_state_are_refused);
    return UNITY_END();
}
