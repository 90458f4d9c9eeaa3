/* Everything that can come, in every state: all identifiers, function codes and lengths against devices in
 * every state, the request machine over all (state, event) pairs, a link job with every outcome at every
 * step. */
#include <stdio.h>
#include <string.h>

#include "exchange.h"
#include "pdcp_device.h"
#include "pdcp_request.h"
#include "unity.h"

#ifdef __AVR__
enum { ID_STEP = 37, CODE_STEP = 5 }; /* a sample: the PC sees all */
#else
enum { ID_STEP = 1, CODE_STEP = 1 };
#endif

static exchange_t x;
static uint32_t before;

void setUp(void)
{
    exchange_start(&x, 0xFFFFF800u);
}

void tearDown(void) {}

static uint32_t stat_of(pdcp_stat_t stat)
{
    return x.arb->bus.stats[stat];
}

/* What a received frame is counted as; exactly one of these for each. */
static uint32_t classified(void)
{
    static const pdcp_stat_t classes[] = {
        PDCP_STAT_DROP_EXTENDED,  PDCP_STAT_DROP_REMOTE,     PDCP_STAT_DROP_ERROR,
        PDCP_STAT_DROP_FD,        PDCP_STAT_DROP_UNUSED_ID,  PDCP_STAT_DROP_ARBITRATOR,
        PDCP_STAT_FOREIGN_BEACON, PDCP_STAT_DROP_UNKNOWN_ID, PDCP_STAT_DROP_BAD_DLC,
        PDCP_STAT_DROP_BAD_CODE,  PDCP_STAT_DROP_DIRECTION,  PDCP_STAT_DROP_DEPRECATED,
        PDCP_STAT_DROP_LATE,      PDCP_STAT_DROP_BINDING,    PDCP_STAT_CHANNEL_DATA,
        PDCP_STAT_TAKEN,          PDCP_STAT_DROP_SILENT};
    uint32_t sum = 0;
    for (unsigned i = 0; i < sizeof classes / sizeof classes[0]; i++) {
        sum += stat_of(classes[i]);
    }
    return sum;
}

/* Sum over all tables but for the times of the last frames: these are all that a frame may change unasked. */
static uint32_t tables(void)
{
    const uint16_t *words = (const uint16_t *)&x.arb->bus.tables; /* it begins with one */
    uint32_t sum = 0;
    for (unsigned i = 0; i < PDCP_DEVICES_MAX; i++) {
        x.arb->bus.tables.devices[i].heard_ms = 0;
    }
    for (unsigned i = 0; i < sizeof x.arb->bus.tables / sizeof words[0]; i++) {
        sum += words[i] * (2u * i + 1u); /* a word that changes changes the sum */
    }
    return sum;
}

/* Frames that ask for something: a bind request, an Update Data Channel, a beacon of a lost device. */
static bool asks(uint16_t id, uint8_t code, uint8_t dlc)
{
    const bool binding = (id >> 9) == 3 && (id & 0x100u) == 0;
    const bool lost_beacon = (id & 0x1FFu) == 0x13 && (id >> 9) != 3 && code == 0x0A && dlc == 1;
    return (binding && code == 0x01 && dlc == 7) || lost_beacon;
}

static void offer(uint16_t id, uint8_t code, uint8_t dlc)
{
    const can_frame_t frame = {.id = id, .dlc = dlc, .data = {dlc > 0 ? code : 0}};
    const uint32_t rx = stat_of(PDCP_STAT_RX);
    const uint32_t sum = classified();
    (void)pdcp_arb_on_frame(x.arb, x.now_ms, &frame);
    TEST_ASSERT_EQUAL_UINT32(rx + 1, stat_of(PDCP_STAT_RX));
    TEST_ASSERT_EQUAL_UINT32(sum + 1, classified());
    x.arb->bus.txq.count = 0; /* a failure answer, a Reset for an unknown device */
}

/* Devices: 11h and 12h ready and linked, 13h lost and kept, 14h in its setup, 15h failed, FEh an output, all
 * others nobody. */
static void fill_bus(void)
{
    exchange_add_both(&x);
    pdcp_channel_t *input = &x.arb->bus.tables.channels[pdcp_tables_channel(&x.arb->bus.tables, 1, 1)];
    input->link = PDCP_LINK_ACTIVE;
    input->source.channel = pdcp_tables_channel(&x.arb->bus.tables, 0, 1);
    input->enabled = true;
    x.arb->bus.tables.channels[input->source.channel].enabled =
        true; /* else an unknown device would take its id (D-BUS-36) */
    exchange_rx(&x, "613#01 0300 0300 0300");
    exchange_rx(&x, "013#0A");
    exchange_rx(&x, "614#01 0400 0400 0400");
    exchange_rx(&x, "014#0A");
    exchange_rx(&x, "615#01 0500 0500 0500");
    exchange_rx(&x, "015#0A");
    (void)exchange_drain(&x);
    pdcp_request_cancel(&x.arb->bus, 2);
    x.arb->bus.tables.devices[2].state = PDCP_PLACE_LOST;
    x.arb->bus.tables.devices[2].beaconed = false;
    pdcp_request_cancel(&x.arb->bus, 4);
    x.arb->bus.tables.devices[4].state = PDCP_PLACE_FAILED;
    x.now_ms += 1200;
}

/* 2048 identifiers x 256 first bytes x 9 lengths: each is counted under exactly one cause, and none changes
 * the tables unasked. */
static void test_every_frame_is_classified_and_changes_nothing(void)
{
    fill_bus();
    for (uint16_t id = 0; id <= CAN_FRAME_ID_MAX; id = (uint16_t)(id + ID_STEP)) {
        for (uint16_t code = 0; code < 256; code = (uint16_t)(code + CODE_STEP)) {
            before = tables();
            for (uint8_t dlc = 0; dlc <= 8; dlc++) {
                if (!asks(id, (uint8_t)code, dlc)) {
                    offer(id, (uint8_t)code, dlc);
                }
            }
            /* 0F of what is no input is answered; of the input 1 it would be a link request: its channel here
             * is 0 */
            TEST_ASSERT_EQUAL_HEX32(before, tables());
        }
    }
}

/* The same while the arbitrator is on standby: nothing but beacons of the other is even looked at. */
static void test_on_standby_every_frame_is_classified(void)
{
    exchange_meet_server(&x);
    before = tables();
    for (uint16_t id = 0; id <= CAN_FRAME_ID_MAX; id = (uint16_t)(id + ID_STEP)) {
        for (uint16_t code = 0; code < 16; code++) {
            for (uint8_t dlc = 0; dlc <= 8; dlc++) {
                offer(id, (uint8_t)code, dlc);
            }
        }
    }
    TEST_ASSERT_EQUAL_HEX32(before, tables());
    TEST_ASSERT_TRUE(pdcp_arb_is_on_standby(x.arb));
}

/* Brings device 11h's place into a state of its request, asked by the host. */
static uint8_t long_value[16];
static const uint8_t raw[8] = {PDCP_GET_PARAMETER, 7, 0};

static void enter_state(pdcp_request_state_t state)
{
    pdcp_bus_t *bus = &x.arb->bus;
    exchange_start(&x, 0xFFFFFF00u);
    exchange_add_output(&x, "FE");
    switch (state) {
    case PDCP_REQUEST_ANSWER:
        pdcp_request_get(bus, 0, PDCP_CLIENT_NONE, 0, 7, 16);
        break;
    case PDCP_REQUEST_GET_SIZE:
    case PDCP_REQUEST_GET_DATA:
        pdcp_request_get(bus, 0, PDCP_CLIENT_NONE, 0, 7, 16);
        exchange_rx(&x, "211#83 02 07 00");
        if (state == PDCP_REQUEST_GET_DATA) {
            exchange_rx(&x, "211#8C 01 07 00 0A00");
        }
        break;
    case PDCP_REQUEST_SET_SIZE:
    case PDCP_REQUEST_SET_DATA:
    case PDCP_REQUEST_SET_ECHO:
        pdcp_request_set(bus, 0, PDCP_CLIENT_NONE, 0, 7, long_value, 10);
        if (state != PDCP_REQUEST_SET_SIZE) {
            exchange_rx(&x, "211#8D 01 07 00 0A00");
        }
        if (state == PDCP_REQUEST_SET_ECHO) {
            exchange_wait(&x, 100); /* the packet is sent once more */
            exchange_rx(&x, "211#8E 01");
        }
        break;
    case PDCP_REQUEST_RAW:
        pdcp_request_start(bus, 0, PDCP_CLIENT_RAW, raw[0], raw[2], raw[1], raw, 3);
        break;
    default:
        break;
    }
    (void)exchange_drain(&x);
    TEST_ASSERT_EQUAL(state, bus->tables.devices[0].request.state);
}

/* What may follow in which state: next state, or that the request ends (IDLE). Rows: events below. */
#define IDLE PDCP_REQUEST_IDLE
#define ANSW PDCP_REQUEST_ANSWER
#define GSIZ PDCP_REQUEST_GET_SIZE
#define GDAT PDCP_REQUEST_GET_DATA
#define SSIZ PDCP_REQUEST_SET_SIZE
#define SDAT PDCP_REQUEST_SET_DATA
#define ECHO PDCP_REQUEST_SET_ECHO
#define RAW PDCP_REQUEST_RAW

static const struct {
    const char *event; /* a frame; NULL: the deadline of the last try */
    uint8_t next[PDCP_REQUEST_STATES];
} machine[] = {
    /*                              idle  answer gsize gdata ssize sdata echo raw */
    {"211#83 01 07 00 01020304", {IDLE, IDLE, GSIZ, GDAT, SSIZ, SDAT, ECHO, IDLE}},
    {"211#83 00 07 00", {IDLE, IDLE, GSIZ, GDAT, SSIZ, SDAT, ECHO, IDLE}},
    {"211#83 02 07 00", {IDLE, GSIZ, GSIZ, GDAT, SSIZ, SDAT, ECHO, IDLE}},
    {"211#83 01 08 00", {IDLE, ANSW, GSIZ, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#84 01 07 00", {IDLE, ANSW, GSIZ, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#84 02 07 00", {IDLE, ANSW, GSIZ, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#88 01 0000", {IDLE, ANSW, GSIZ, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#89 01", {IDLE, ANSW, GSIZ, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#8B 01", {IDLE, ANSW, GSIZ, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#8C 01 07 00 0A00", {IDLE, ANSW, GDAT, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#8C 01 07 00 0000", {IDLE, ANSW, IDLE, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#8C 01 07 00 1100", {IDLE, ANSW, IDLE, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#8C 00 07 00 0A00", {IDLE, ANSW, IDLE, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#8D 01 07 00 0A00", {IDLE, ANSW, GSIZ, GDAT, SDAT, SDAT, ECHO, RAW}},
    {"211#8D 00 07 00 0A00", {IDLE, ANSW, GSIZ, GDAT, IDLE, SDAT, ECHO, RAW}},
    {"211#0E 00 010203040506", {IDLE, ANSW, GSIZ, GDAT, SSIZ, SDAT, ECHO, RAW}},
    {"211#0E 05 010203040506", {IDLE, ANSW, GSIZ, GSIZ, SSIZ, SDAT, ECHO, RAW}},
    {"211#8E 01", {IDLE, ANSW, GSIZ, GDAT, SSIZ, SDAT, SDAT, RAW}},
    {"211#8E 00", {IDLE, ANSW, GSIZ, GDAT, SSIZ, SSIZ, SSIZ, RAW}},
    {NULL, {IDLE, IDLE, IDLE, GSIZ, IDLE, IDLE, SDAT, IDLE}},
};

static void test_the_request_machine_over_all_states_and_events(void)
{
    for (uint8_t state = 0; state < (uint8_t)PDCP_REQUEST_STATES; state++) {
        for (unsigned e = 0; e < sizeof machine / sizeof machine[0]; e++) {
            char name[60];
            (void)snprintf(name, sizeof name, "state %u, event %s", state,
                           machine[e].event != NULL ? machine[e].event : "deadline");
            enter_state((pdcp_request_state_t)state);
            const pdcp_request_t *request = &x.arb->bus.tables.devices[0].request;
            if (machine[e].event != NULL) {
                exchange_rx(&x, machine[e].event);
            } else {
                for (int i = 0; i < 3; i++) {
                    exchange_wait(&x, 100);
                }
            }
            TEST_ASSERT_EQUAL_MESSAGE(machine[e].next[state], request->state, name);
            TEST_ASSERT_EQUAL_MESSAGE(request->state != PDCP_REQUEST_IDLE,
                                      pdcp_timers_is_set(&x.arb->bus.timers, PDCP_TIMER_REQUEST), name);
        }
    }
}

typedef enum {
    FAIL_REFUSED,
    FAIL_SILENT,
    FAIL_INPUT_RESET,
    FAIL_OUTPUT_RESET,
    FAIL_INPUT_GONE,
    FAIL_OUTPUT_GONE,
    FAILS
} fail_t;

/* The two devices of a link job: they live and answer, until at write number failing something happens. */
typedef struct {
    int failing;
    fail_t fail;
    int writes;
    bool alive[2]; /* 11h, 12h */
    bool silent;
} devices_t;

/* Returns whether this write is refused. */
static bool fail_now(devices_t *devices)
{
    if (devices->writes++ != devices->failing) {
        return false;
    }
    switch (devices->fail) {
    case FAIL_SILENT:
        devices->silent = true;
        return false;
    case FAIL_INPUT_RESET:
        exchange_rx(&x, "612#01 0200 0200 0600");
        devices->alive[1] = false;
        return false;
    case FAIL_OUTPUT_RESET:
        exchange_rx(&x, "611#01 0200 0200 0400");
        devices->alive[0] = false;
        return false;
    case FAIL_INPUT_GONE:
        devices->alive[1] = false;
        return false;
    case FAIL_OUTPUT_GONE:
        devices->alive[0] = false;
        return false;
    default:
        return true;
    }
}

static void answer_write(devices_t *devices, const can_frame_t *frame)
{
    const uint8_t device = (uint8_t)(frame->id & 0xFFu);
    if ((device != 0x11 && device != 0x12) || frame->data[0] != 0x04) {
        return;
    }
    const bool refused = fail_now(devices);
    if (devices->silent || !devices->alive[device - 0x11]) {
        return;
    }
    can_frame_t answer = {.id = (uint16_t)(0x200u | device), .dlc = 4};
    answer.data[0] = 0x84;
    answer.data[1] = refused ? 0 : 1;
    answer.data[2] = frame->data[1];
    answer.data[3] = frame->data[2];
    (void)pdcp_arb_on_frame(x.arb, x.now_ms, &answer);
}

static void live(const devices_t *devices)
{
    exchange_wait(&x, 1);
    if (x.now_ms % 400 == 0 && devices->alive[0]) {
        exchange_rx(&x, "011#0A");
    }
    if (x.now_ms % 400 == 0 && devices->alive[1]) {
        exchange_rx(&x, "012#0A");
    }
}

static void serve_devices(devices_t *devices, uint32_t ms)
{
    const uint32_t end_ms = x.now_ms + ms;
    while (x.now_ms != end_ms) {
        exchange_step(&x);
        const can_frame_t *sent = pdcp_arb_tx_peek(x.arb);
        if (sent == NULL) {
            live(devices);
            continue;
        }
        const can_frame_t frame = *sent;
        pdcp_arb_tx_pop(x.arb);
        answer_write(devices, &frame);
    }
}

static void expect_outcome(const devices_t *devices, uint8_t output, uint8_t input, const char *name)
{
    const pdcp_channel_t *channels = x.arb->bus.tables.channels;
    const int8_t status = exchange_last(&x, PDCP_EVENT_LINK_REQUEST)->status;
    TEST_ASSERT_EQUAL_MESSAGE(1, exchange_count(&x, PDCP_EVENT_LINK_REQUEST), name);
    if (status != PDCP_OK) {
        TEST_ASSERT_NOT_EQUAL_MESSAGE(PDCP_LINK_ACTIVE, channels[input].link, name);
    } else {
        TEST_ASSERT_TRUE_MESSAGE(devices->fail != FAIL_SILENT, name);
    }
    if (devices->fail == FAIL_REFUSED) {
        const bool made = channels[input].link == PDCP_LINK_ACTIVE;
        TEST_ASSERT_EQUAL_MESSAGE(devices->failing == 2, made, name); /* D-BUS-20 */
        TEST_ASSERT_EQUAL_MESSAGE(made, channels[input].enabled, name);
        TEST_ASSERT_EQUAL_MESSAGE(made, channels[output].enabled, name);
        TEST_ASSERT_TRUE_MESSAGE(pdcp_arb_links_settled(x.arb), name);
    }
}

/* Every outcome at every step of making a link: the host has exactly one answer, within 3 s, the job ends,
 * and the link is either active or nothing of it is left enabled at a living device. */
static void test_a_link_job_with_every_outcome_at_every_step(void)
{
    for (int failing = 0; failing < 6; failing++) {
        for (int fail = 0; fail < FAILS; fail++) {
            char name[40];
            (void)snprintf(name, sizeof name, "step %d, outcome %d", failing, fail);
            exchange_start(&x, 0xFFFFFE00u);
            exchange_add_output(&x, "FE");
            exchange_add_input(&x);
            exchange_clear(&x);
            const uint8_t output = pdcp_tables_channel(&x.arb->bus.tables, 0, 1);
            const uint8_t input = pdcp_tables_channel(&x.arb->bus.tables, 1, 1);
            TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x.arb, output, input));
            devices_t devices = {.failing = failing, .fail = (fail_t)fail, .alive = {true, true}};
            serve_devices(&devices, 2900);
            expect_outcome(&devices, output, input, name);
        }
    }
}

/* A hand with one input, for the device role. */
static const pdcp_device_channel_desc_t one_input[] = {
    {.direction = PDCP_INPUT, .terminal = true, .type = 0x5300, .profile = 0x1110}};
static const pdcp_device_desc_t hand = {.identity = {2, 2, 6}, .channels = one_input, .channel_count = 1};
static const pdcp_device_port_t no_port = {.ctx = NULL};

static void device_in_state(pdcp_device_t *device, pdcp_device_state_t state)
{
    const can_frame_t granted = {.id = 0x312, .dlc = 8, .data = {0x81, 0x12, 2, 0, 2, 0, 6, 0}};
    const pdcp_device_record_t record = {.node_id = 0x12};
    TEST_ASSERT_TRUE(pdcp_device_init(device, &hand, &no_port, &record, 1, 0));
    (void)pdcp_device_step(device, 0);
    if (state != PDCP_DEVICE_ASKING) {
        pdcp_device_on_frame(device, 0, &granted);
    }
    if (state == PDCP_DEVICE_ALONE) {
        (void)pdcp_device_step(device, 3000);
    }
    TEST_ASSERT_EQUAL(state, pdcp_device_state(device));
}

/* Frames that lead a device into another state: its grant, its reset, and, when it is alone, anything from an
 * arbitrator. */
static bool moves(pdcp_device_state_t state, uint16_t id, uint8_t code)
{
    const bool from_arbitrator = (id & 0x100u) != 0 && (id >> 9) != 3;
    return from_arbitrator && (state == PDCP_DEVICE_ALONE || (state == PDCP_DEVICE_BOUND && code == 0x0B));
}

/* The device role in each of its states: no other frame changes its state, its id, or what its input listens
 * to. */
static void test_no_frame_moves_a_device_unasked(void)
{
    static pdcp_device_t device;
    for (int state = PDCP_DEVICE_ASKING; state <= PDCP_DEVICE_ALONE; state++) {
        device_in_state(&device, (pdcp_device_state_t)state);
        const uint8_t node_id = pdcp_device_node_id(&device);
        for (uint16_t id = 0; id <= CAN_FRAME_ID_MAX; id = (uint16_t)(id + ID_STEP)) {
            for (uint16_t code = 0; code < 256; code = (uint16_t)(code + CODE_STEP)) {
                for (uint8_t dlc = 0; dlc <= 8; dlc++) {
                    const can_frame_t frame = {.id = id, .dlc = dlc, .data = {dlc > 0 ? (uint8_t)code : 0}};
                    if (!moves((pdcp_device_state_t)state, id, (uint8_t)code)) {
                        pdcp_device_on_frame(&device, 3000, &frame);
                        device.txq.count = 0;
                    }
                }
            }
            TEST_ASSERT_EQUAL(state, pdcp_device_state(&device));
            TEST_ASSERT_EQUAL_HEX8(node_id, pdcp_device_node_id(&device));
            TEST_ASSERT_FALSE(pdcp_device_channel(&device, 1)->enabled);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_frame_is_classified_and_changes_nothing);
    RUN_TEST(test_on_standby_every_frame_is_classified);
    RUN_TEST(test_the_request_machine_over_all_states_and_events);
    RUN_TEST(test_a_link_job_with_every_outcome_at_every_step);
    RUN_TEST(test_no_frame_moves_a_device_unasked);
    return UNITY_END();
}
