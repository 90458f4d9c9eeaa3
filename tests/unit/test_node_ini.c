/* Device descriptions: what is read from good ones, and the one line that bad ones get. */
#define _POSIX_C_SOURCE 200809L /* mkdtemp, strdup */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "node_ini.h"
#include "unity.h"

static char folder[64];
static char path[128];
static char error[512];
static node_ini_t *ini;

static void write_file(const char *name, const char *text)
{
    char full[128];
    (void)snprintf(full, sizeof full, "%s/%s", folder, name);
    FILE *file = fopen(full, "w");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_TRUE(fputs(text, file) >= 0);
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static void load(const char *text)
{
    write_file("n.ini", text);
    node_ini_free(ini);
    error[0] = '\0';
    ini = node_ini_load(path, error, sizeof error);
}

static void check_bad(unsigned line, const char *text, const char *where_and_what)
{
    char want[256];
    load(text);
    (void)snprintf(want, sizeof want, "%s%s", path, where_and_what);
    UNITY_TEST_ASSERT(ini == NULL, line, "was accepted");
    UNITY_TEST_ASSERT_EQUAL_STRING(want, error, line, "message");
    UNITY_TEST_ASSERT(strchr(error, '\n') == NULL, line, "more than one line");
}

#define BAD(text, message) check_bad(__LINE__, (text), (message))
#define DEVICE "[device]\nvid=2\npid=2\nserial=4\n" /* 4 lines */
#define OUT1 "[channel 1]\ndirection=output\ntype=0x5000\n"
#define IN1 "[channel 1]\ndirection=input\ntype=0x5000\n"

void setUp(void)
{
    (void)snprintf(folder, sizeof folder, "/tmp/test_node_ini.XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    (void)snprintf(path, sizeof path, "%s/n.ini", folder);
    ini = NULL;
}

void tearDown(void)
{
    static const char *const names[] = {"n.ini", "s.csv"};
    node_ini_free(ini);
    for (unsigned i = 0; i < 2; i++) {
        char full[128];
        (void)snprintf(full, sizeof full, "%s/%s", folder, names[i]);
        (void)unlink(full);
    }
    TEST_ASSERT_EQUAL_INT(0, rmdir(folder));
}

static void test_smallest_device(void)
{
    load(DEVICE);
    TEST_ASSERT_NOT_NULL_MESSAGE(ini, error);
    TEST_ASSERT_EQUAL_HEX16(2, ini->desc.identity.vid);
    TEST_ASSERT_EQUAL_HEX16(4, ini->desc.identity.sn);
    TEST_ASSERT_EQUAL_UINT8(0, ini->desc.channel_count);
    TEST_ASSERT_EQUAL_UINT16(0, ini->desc.descriptor.len);
    TEST_ASSERT_NULL(ini->state_path);
}

static void test_everything_of_a_device(void)
{
    char want[128];
    load(
        "; a comment\n[device]\nvid = 0x1234\npid = 65535 ; another\nserial = 010\nean13 = 4006381333931\n"
        "firmware = 0x0102\nhardware = 3\ntype = 5\nprofile = 0x2120\ndescriptor = Hand, left = good\n"
        "beacon_ms = 250\nack_ms = 50\nbind_timeout_ms = 2000\nnode_id = 17\nstate = kept.txt\n");
    TEST_ASSERT_NOT_NULL_MESSAGE(ini, error);
    const pdcp_device_desc_t *desc = &ini->desc;
    TEST_ASSERT_EQUAL_HEX16(0x1234, desc->identity.vid);
    TEST_ASSERT_EQUAL_HEX16(0xFFFF, desc->identity.pid);
    TEST_ASSERT_EQUAL_HEX16(10, desc->identity.sn);        /* no octal numbers */
    TEST_ASSERT_EQUAL_HEX32(0xCEEFADABu, desc->ean13_low); /* 4006381333931 = 3A4CEEFADABh */
    TEST_ASSERT_EQUAL_HEX32(0x3A4, desc->ean13_high);
    TEST_ASSERT_EQUAL_HEX16(0x0102, desc->firmware);
    TEST_ASSERT_EQUAL_HEX16(3, desc->hardware);
    TEST_ASSERT_EQUAL_HEX16(5, desc->type);
    TEST_ASSERT_EQUAL_HEX16(0x2120, desc->profile);
    TEST_ASSERT_EQUAL_UINT16(17, desc->descriptor.len);
    TEST_ASSERT_EQUAL_MEMORY("Hand, left = good", desc->descriptor.bytes, 17);
    TEST_ASSERT_EQUAL_UINT16(250, desc->beacon_ms);
    TEST_ASSERT_EQUAL_UINT16(50, desc->ack_ms);
    TEST_ASSERT_EQUAL_UINT16(2000, desc->bind_ms);
    TEST_ASSERT_EQUAL_UINT8(17, ini->first_node_id);
    (void)snprintf(want, sizeof want, "%s/kept.txt", folder);
    TEST_ASSERT_EQUAL_STRING(want, ini->state_path);
}

static void test_channels(void)
{
    load(DEVICE
         "[channel 2]\ndirection = input\ntype = 8bit unsigned, position sole terminal\nprofile = 0x1110\n"
         "terminal_profile = 0x1220\nsafe = 128\ndescriptor = wrist\nrequired = 1\n"
         "[channel 1]\ndirection = input\ntype = 0x7200\n"
         "[channel 3]\ndirection = output\ntype = 16bit signed velocity x1e-3\nrequired = 1 2\ndesired = 2\n"
         "signal = sine -100 100 2000\nrate_ms = 20\n");
    TEST_ASSERT_NOT_NULL_MESSAGE(ini, error);
    const pdcp_device_channel_desc_t *channels = ini->desc.channels;
    TEST_ASSERT_EQUAL_UINT8(3, ini->desc.channel_count);
    TEST_ASSERT_EQUAL_UINT8(PDCP_INPUT, channels[0].direction);
    TEST_ASSERT_FALSE(channels[0].terminal);
    TEST_ASSERT_EQUAL_HEX16(0x5300, channels[1].type);
    TEST_ASSERT_TRUE(channels[1].terminal);
    TEST_ASSERT_EQUAL_HEX16(0x1220, channels[1].terminal_profile);
    TEST_ASSERT_EQUAL_INT32(128, channels[1].safe);
    TEST_ASSERT_EQUAL_UINT16(5, channels[1].descriptor.len);
    TEST_ASSERT_EQUAL_UINT16(1, channels[1].required.len);
    TEST_ASSERT_EQUAL_HEX8(0x40, *(const uint8_t *)channels[1].required.bytes); /* channel 1 (D-BUS-8) */
    TEST_ASSERT_EQUAL_UINT8(PDCP_OUTPUT, channels[2].direction);
    TEST_ASSERT_EQUAL_HEX16(0xC440, channels[2].type);
    TEST_ASSERT_EQUAL_HEX8(0x60, *(const uint8_t *)channels[2].required.bytes);
    TEST_ASSERT_EQUAL_HEX8(0x20, *(const uint8_t *)channels[2].desired.bytes);
    TEST_ASSERT_EQUAL_INT(NODE_SIGNAL_SINE, ini->signals[2].kind);
    TEST_ASSERT_EQUAL_INT32(-100, ini->signals[2].min);
    TEST_ASSERT_EQUAL_INT32(100, ini->signals[2].max);
    TEST_ASSERT_EQUAL_UINT32(2000, ini->signals[2].period_ms);
    TEST_ASSERT_EQUAL_UINT32(20, ini->signals[2].rate_ms);
}

static void test_required_channel_8_takes_a_second_byte(void)
{
    char text[1024] = DEVICE;
    size_t used = strlen(text);
    for (unsigned i = 1; i <= 9; i++) {
        used += (size_t)snprintf(&text[used], sizeof text - used, "[channel %u]\ndirection=%s\ntype=0x5000\n",
                                 i, i < 9 ? "input" : "output\nrequired=8");
    }
    load(text);
    TEST_ASSERT_NOT_NULL_MESSAGE(ini, error);
    TEST_ASSERT_EQUAL_UINT16(2, ini->desc.channels[8].required.len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\0\x80", ini->desc.channels[8].required.bytes, 2);
}

static void test_signals(void)
{
    write_file("s.csv", "# a replay\n0,1\n\n100, 2\n250,3\n");
    load(DEVICE IN1
         "[channel 2]\ndirection=output\ntype=0x5000\nsignal=constant 9\n"
         "[channel 3]\ndirection=output\ntype=0x5000\nsignal=csv s.csv\n"
         "[channel 4]\ndirection=output\ntype=0x5000\nsignal=copy 1\n"
         "[channel 5]\ndirection=output\ntype=0x5000\nsignal=copy 1\nrate_ms=10\n"
         "[channel 6]\ndirection=output\ntype=0x5000\n");
    TEST_ASSERT_NOT_NULL_MESSAGE(ini, error);
    TEST_ASSERT_EQUAL_INT(NODE_SIGNAL_CONSTANT, ini->signals[1].kind);
    TEST_ASSERT_EQUAL_INT32(9, ini->signals[1].min);
    TEST_ASSERT_EQUAL_UINT32(100, ini->signals[1].rate_ms);
    TEST_ASSERT_EQUAL_UINT32(3, (uint32_t)ini->signals[2].point_count);
    TEST_ASSERT_EQUAL_UINT32(250, ini->signals[2].points[2].time_ms);
    TEST_ASSERT_EQUAL_INT32(3, ini->signals[2].points[2].value);
    TEST_ASSERT_EQUAL_UINT32(400, ini->signals[2].period_ms);
    TEST_ASSERT_EQUAL_INT(NODE_SIGNAL_COPY, ini->signals[3].kind);
    TEST_ASSERT_EQUAL_UINT8(1, ini->signals[3].source);
    TEST_ASSERT_EQUAL_UINT32(0, ini->signals[3].rate_ms);
    TEST_ASSERT_EQUAL_UINT32(10, ini->signals[4].rate_ms);
    TEST_ASSERT_EQUAL_INT(NODE_SIGNAL_NONE, ini->signals[5].kind);
}

static void test_parameters(void)
{
    load(DEVICE IN1 "[parameter 0x50 1]\nvalue = gain\ncapacity = 512\n[parameter 7 0]\ncapacity = 40\n");
    TEST_ASSERT_NOT_NULL_MESSAGE(ini, error);
    TEST_ASSERT_EQUAL_UINT8(2, ini->desc.extra_count);
    const pdcp_device_extra_t *extra = &ini->desc.extras[0];
    TEST_ASSERT_EQUAL_HEX8(0x50, extra->param);
    TEST_ASSERT_EQUAL_UINT8(1, extra->channel);
    TEST_ASSERT_TRUE(extra->writable);
    TEST_ASSERT_EQUAL_UINT16(512, extra->capacity);
    TEST_ASSERT_EQUAL_UINT16(4, *extra->len);
    TEST_ASSERT_EQUAL_MEMORY("gain", extra->bytes, 4);
    TEST_ASSERT_EQUAL_UINT16(512, ini->desc.bulk_capacity);
    load(DEVICE "[parameter 0x50 0]\nvalue = fixed\n");
    TEST_ASSERT_NOT_NULL_MESSAGE(ini, error);
    TEST_ASSERT_FALSE(ini->desc.extras[0].writable);
}

static void test_files_that_cannot_be_read(void)
{
    ini = node_ini_load("/nonexistent/x.ini", error, sizeof error);
    TEST_ASSERT_NULL(ini);
    TEST_ASSERT_EQUAL_STRING("/nonexistent/x.ini: No such file or directory", error);
    ini = node_ini_load(folder, error, sizeof error);
    TEST_ASSERT_NULL(ini);
    TEST_ASSERT_NOT_NULL(strstr(error, "Is a directory"));
}

static void test_bad_sections_and_keys(void)
{
    BAD("", ":1: [device] is missing");
    BAD("vid=2\n", ":1: vid stands before the first section");
    BAD("[devise]\n", ":1: unknown section [devise]");
    BAD("[device\n", ":1: a section ends with ]");
    BAD(DEVICE "[device]\n", ":5: [device] is there twice");
    BAD(DEVICE "colour=red\n", ":5: unknown key 'colour'");
    BAD(DEVICE "direction=input\n", ":5: unknown key 'direction'");
    BAD(DEVICE "vid=3\n", ":5: vid is there twice");
    BAD(DEVICE "what is this\n", ":5: is neither a section nor key = value");
    BAD("[device]\nvid=2\npid=2\n", ":1: [device]: needs vid, pid and serial");
    BAD(DEVICE IN1 IN1, ":8: [channel 1] is there twice");
    BAD(DEVICE IN1 "[channel 3]\ndirection=input\ntype=0x5000\n", ":8: [channel 2] is missing");
    BAD(DEVICE "[channel 0]\n", ":5: [channel 0]: the index is a number from 1 to 32");
    BAD(DEVICE "[channel x]\n", ":5: [channel x]: the index is a number from 1 to 32");
    BAD(DEVICE "[channel 33]\n", ":5: [channel 33]: the index is a number from 1 to 32");
    BAD(DEVICE "[channel 1]\ntype=0x5000\n", ":5: [channel 1]: needs direction");
    BAD(DEVICE "[channel 1]\ndirection=input\n", ":5: [channel 1]: needs type");
    BAD(DEVICE "[parameter 5]\n", ":5: [parameter ID CHANNEL]: both are numbers from 0 to 255");
    BAD(DEVICE "[parameter 5 1]\n", ":5: [parameter 5 1]: there is no such channel");
}

static void test_bad_values(void)
{
    char text[400];
    BAD("[device]\nvid=two\n", ":2: vid: 'two' is not a number");
    BAD("[device]\nvid=0x10000\n", ":2: vid: 0x10000 is not in the range 0 to 65535");
    BAD("[device]\nvid=-1\n", ":2: vid: -1 is not in the range 0 to 65535");
    BAD("[device]\nvid=12a\n", ":2: vid: '12a' is not a number");
    BAD("[device]\nvid=\n", ":2: vid: '' is not a number");
    BAD(DEVICE "node_id=255\n", ":5: node_id: 255 is not in the range 1 to 254");
    BAD(DEVICE "beacon_ms=49\n", ":5: beacon_ms: 49 is not in the range 50 to 10000");
    BAD(DEVICE "ean13=12345678901234\n", ":5: ean13: '12345678901234' is not a number of up to 13 digits");
    BAD(DEVICE "state=\n", ":5: state: no file is named");
    BAD(DEVICE "[channel 1]\ndirection=both\n", ":6: direction: 'both' is neither input nor output");
    BAD(DEVICE "[channel 1]\ntype=8bit\n",
        ":6: type: needs a size (such as 8bit) and a data type (such as unsigned)");
    BAD(DEVICE "[channel 1]\ntype=8bit unsigned fast\n", ":6: type: unknown word 'fast'");
    BAD(DEVICE "[channel 1]\ntype=8bit 16bit signed\n",
        ":6: type: '16bit' contradicts or repeats a word before it");
    BAD(DEVICE "[channel 1]\ntype=8bit float\n", ":6: type: a float has 16 bits");
    BAD(DEVICE "[channel 1]\ntype=0xE000\n", ":6: type: float channels cannot be simulated");
    BAD(DEVICE IN1 "required=2\n", ":8: required: 2 is not an input of this device");
    BAD(DEVICE OUT1 "desired=1\n", ":8: desired: 1 is not an input of this device");
    BAD(DEVICE IN1 "safe=3\n", ":5: [channel 1]: only a terminal input has a safe value");
    BAD(DEVICE "[channel 1]\ndirection=input\ntype=0x5300\nsafe=256\n",
        ":5: [channel 1]: the safe value does not fit the type");
    BAD(DEVICE OUT1 "terminal_profile=1\n",
        ":5: [channel 1]: safe, terminal_profile and the type's terminal are for inputs");
    (void)snprintf(text, sizeof text, "[device]\ndescriptor=%0250d\n", 0);
    BAD(text, ":2: the line is longer than 198 characters");
}

static void test_bad_signals(void)
{
    BAD(DEVICE IN1 "signal=constant 1\n", ":5: [channel 1]: an input has no signal and no rate_ms");
    BAD(DEVICE OUT1 "signal=noise\n", ":8: signal: is constant, sine, square, csv or copy");
    BAD(DEVICE OUT1 "signal=constant\n", ":8: signal: is written constant VALUE");
    BAD(DEVICE OUT1 "signal=constant 1 2\n", ":8: signal: is written constant VALUE");
    BAD(DEVICE OUT1 "signal=constant 256\n", ":8: signal: 256 does not fit the channel's type");
    BAD(DEVICE OUT1 "signal=sine 9 1 1000\n", ":8: signal: 9 is more than 1");
    BAD(DEVICE OUT1 "signal=sine 1 9 0\n", ":8: signal: the period is a number from 2 to 3600000 ms");
    BAD(DEVICE OUT1 "signal=copy 1\n", ":8: signal: 1 is not an input of this device");
    BAD(DEVICE OUT1 "rate_ms=0\n", ":8: rate_ms: 0 is not in the range 1 to 60000");
}

static void test_bad_replays(void)
{
    char want[256];
    static const char *const texts[][2] = {
        {"", ": no values"},
        {"5,1\n", ":1: times begin with 0 and rise, to one day at most"},
        {"0,1\n0,2\n", ":2: times begin with 0 and rise, to one day at most"},
        {"0,1\n10\n", ":2: not of the form time_ms,value"},
        {"0,300\n", ":1: 300 does not fit the channel's type"},
    };
    for (unsigned i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        write_file("s.csv", texts[i][0]);
        (void)snprintf(want, sizeof want, ":8: signal: %s/s.csv%s", folder, texts[i][1]);
        BAD(DEVICE OUT1 "signal=csv s.csv\n", want);
    }
    (void)snprintf(want, sizeof want, ":8: signal: %s/none.csv: No such file or directory", folder);
    BAD(DEVICE OUT1 "signal=csv none.csv\n", want);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_smallest_device);
    RUN_TEST(test_everything_of_a_device);
    RUN_TEST(test_channels);
    RUN_TEST(test_required_channel_8_takes_a_second_byte);
    RUN_TEST(test_signals);
    RUN_TEST(test_parameters);
    RUN_TEST(test_files_that_cannot_be_read);
    RUN_TEST(test_bad_sections_and_keys);
    RUN_TEST(test_bad_values);
    RUN_TEST(test_bad_signals);
    RUN_TEST(test_bad_replays);
    return UNITY_END();
}
