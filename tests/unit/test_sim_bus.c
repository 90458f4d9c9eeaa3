/* The simulated bus: bit times, arbitration, queues, and the independence of deliveries from the calls.
 *
 * Expected lengths are those of can-utils (canframelen.c, exact mode, less the three bits of interframe space
 * that it counts along), the lengths of remote frames those of a count by hand from the bit sequence. */
#include <string.h>

#include "sim_bus.h"
#include "unity.h"

#define LOG_MAX 16384

typedef struct {
    uint64_t time_us;
    int port;
    can_frame_t frame;
} delivery_t;

typedef struct {
    int count;
    delivery_t entries[LOG_MAX];
} log_t;

typedef struct {
    int number;
    log_t *log;
    sim_bus_t *bus;
    can_frame_t reply; /* sent from within the receive callback when replies > 0 */
    int replies;
} listener_t;

static sim_bus_t bus;
static log_t heard;
static listener_t listeners[SIM_BUS_PORTS_MAX];

static void on_frame(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    listener_t *listener = ctx;

    TEST_ASSERT_LESS_THAN(LOG_MAX, listener->log->count);
    delivery_t *entry = &listener->log->entries[listener->log->count++];

    memset(entry, 0, sizeof *entry);
    entry->time_us = time_us;
    entry->port = listener->number;
    entry->frame = *frame;
    if (listener->replies > 0) {
        listener->replies--;
        TEST_ASSERT_TRUE(sim_bus_send(listener->bus, listener->number, &listener->reply));
    }
}

static int attach(void)
{
    int port = sim_bus_attach(&bus, NULL, NULL);

    if (port >= 0) {
        listeners[port] = (listener_t){.number = port, .log = &heard, .bus = &bus};
        bus.ports[port].receive = on_frame;
        bus.ports[port].ctx = &listeners[port];
    }
    return port;
}

void setUp(void)
{
    sim_bus_init(&bus);
    heard.count = 0;
}

void tearDown(void) {}

/* Frames of known length: 47 bits without data at 7FFh, 55 at 100h with 0Ah, 56 at 001h with 0Ah. */
static const can_frame_t frame_7ff = {.id = 0x7FF};
static const can_frame_t frame_100 = {.id = 0x100, .dlc = 1, .data = {0x0A}};
static const can_frame_t frame_001 = {.id = 0x001, .dlc = 1, .data = {0x0A}};

static void assert_delivery(int index, uint64_t time_us, int port, uint16_t id)
{
    TEST_ASSERT_LESS_THAN(heard.count, index);
    TEST_ASSERT_EQUAL_UINT64(time_us, heard.entries[index].time_us);
    TEST_ASSERT_EQUAL_INT(port, heard.entries[index].port);
    TEST_ASSERT_EQUAL_HEX16(id, heard.entries[index].frame.id);
}

static void test_sim_bus_frame_bits_are_exact(void)
{
    static const struct {
        can_frame_t frame;
        unsigned bits;
    } known[] = {
        {{.id = 0x2AA, .dlc = 8, .data = {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55}}, 108}, /* none */
        {{.id = 0x555, .dlc = 8, .data = {0xAA, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA}}, 109},
        {{.id = 0x000, .dlc = 0}, 50},
        {{.id = 0x000, .dlc = 8}, 124},
        {{.id = 0x7FF, .dlc = 8, .data = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}}, 123},
        {{.id = 0x07C, .dlc = 8, .data = {0x20, 0xFF, 0x87, 0x87, 0x84, 0x1E, 0x1E, 0x04}}, 129},
        {{.id = 0x7FE, .dlc = 8, .data = {0x3C, 0x3C, 0x3F, 0xE1, 0x3E, 0x00, 0xF0, 0xF0}}, 128},
        {{.id = 0x123, .dlc = 2, .data = {0x22, 0x33}}, 62},
        {{.id = 0x7C1, .dlc = 0}, 48},
        {{.id = 0x7FF, .dlc = 0}, 47},
        {{.id = 0x100, .dlc = 1, .data = {0x0A}}, 55},
        {{.id = 0x001, .dlc = 1, .data = {0x0A}}, 56},
        {{.kind = CAN_FRAME_EXTENDED, .dlc = 0}, 71},
        {{.kind = CAN_FRAME_EXTENDED, .dlc = 8}, 147},
        {{.kind = CAN_FRAME_REMOTE, .dlc = 0}, 47},              /* 44 and 3 stuff bits */
        {{.kind = CAN_FRAME_REMOTE, .id = 0x123, .dlc = 8}, 45}, /* no data, one stuff bit */
        {{.kind = CAN_FRAME_ERROR}, 20},
        {{.kind = CAN_FRAME_FD, .id = 0x7FF}, 47},
    };

    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        TEST_ASSERT_EQUAL_UINT_MESSAGE(known[i].bits, sim_bus_frame_bits(&known[i].frame),
                                       "entry of known[]");
    }
}

/* A DLC of 9 to 15 on the wire means eight bytes: never a read beyond data[]. */
static void test_sim_bus_frame_bits_take_eight_bytes_at_most(void)
{
    can_frame_t frame = {.id = 0x2AA, .dlc = 8, .data = {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55}};

    frame.dlc = 15;
    TEST_ASSERT_EQUAL_UINT(108, sim_bus_frame_bits(&frame));
}

static void test_sim_bus_idle_bus_wants_no_call(void)
{
    attach();
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 0));
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 1000000));
    TEST_ASSERT_EQUAL_INT(0, heard.count);
}

static void test_sim_bus_frame_starts_with_the_step_and_arrives_at_its_end(void)
{
    int a = attach();
    int b = attach();
    int c = attach();

    TEST_ASSERT_TRUE(sim_bus_send(&bus, b, &frame_100));
    TEST_ASSERT_EQUAL_UINT64(1055, sim_bus_step(&bus, 1000));
    TEST_ASSERT_EQUAL_UINT64(1055, sim_bus_step(&bus, 1054));
    TEST_ASSERT_EQUAL_INT(0, heard.count);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 1055));
    TEST_ASSERT_EQUAL_INT(2, heard.count); /* not to its sender */
    assert_delivery(0, 1055, a, 0x100);
    assert_delivery(1, 1055, c, 0x100);
    TEST_ASSERT_EQUAL_MEMORY(&frame_100, &heard.entries[0].frame, sizeof frame_100);
    TEST_ASSERT_EQUAL_UINT64(1, bus.frames);
    TEST_ASSERT_EQUAL_UINT64(58, bus.busy_us);
}

static void test_sim_bus_lowest_identifier_wins(void)
{
    int a = attach();
    int b = attach();
    int c = attach();
    int ear = attach();

    listeners[ear].number = 50;
    bus.ports[a].receive = NULL;
    bus.ports[b].receive = NULL;
    bus.ports[c].receive = NULL;
    sim_bus_send(&bus, a, &frame_7ff);
    sim_bus_send(&bus, b, &frame_001);
    sim_bus_send(&bus, c, &frame_100);
    TEST_ASSERT_EQUAL_UINT64(56, sim_bus_step(&bus, 0));
    TEST_ASSERT_EQUAL_UINT64(59, sim_bus_step(&bus, 56)); /* three bits of interframe space */
    TEST_ASSERT_EQUAL_UINT64(59 + 55, sim_bus_step(&bus, 59));
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 1000));
    TEST_ASSERT_EQUAL_INT(3, heard.count);
    assert_delivery(0, 56, 50, 0x001);
    assert_delivery(1, 59 + 55, 50, 0x100);
    assert_delivery(2, 59 + 58 + 47, 50, 0x7FF);
}

static void test_sim_bus_queue_sends_lowest_identifier_then_oldest_first(void)
{
    static const can_frame_t offered[] = {
        {.id = 0x300, .dlc = 1, .data = {1}}, {.id = 0x200, .dlc = 1, .data = {2}},
        {.id = 0x300, .dlc = 1, .data = {3}}, {.id = 0x100, .dlc = 1, .data = {4}},
        {.id = 0x200, .dlc = 1, .data = {5}},
    };
    static const uint8_t expected[] = {4, 2, 5, 1, 3};
    int a = attach();

    attach();
    for (size_t i = 0; i < 5; i++) {
        TEST_ASSERT_TRUE(sim_bus_send(&bus, a, &offered[i]));
    }
    sim_bus_step(&bus, 0);
    sim_bus_step(&bus, 10000);
    TEST_ASSERT_EQUAL_INT(5, heard.count);
    for (int i = 0; i < 5; i++) {
        TEST_ASSERT_EQUAL_UINT8(expected[i], heard.entries[i].frame.data[0]);
    }
}

/* D-SIM-1 */
static void test_sim_bus_equal_identifiers_go_by_port_number(void)
{
    can_frame_t from_a = {.id = 0x100, .dlc = 1, .data = {0xA}};
    can_frame_t from_b = {.id = 0x100, .dlc = 1, .data = {0xB}};
    int a = attach();
    int b = attach();
    int ear = attach();

    TEST_ASSERT_LESS_THAN(b, a);
    sim_bus_send(&bus, b, &from_b);
    sim_bus_send(&bus, a, &from_a);
    sim_bus_step(&bus, 0);
    sim_bus_step(&bus, 1000);
    TEST_ASSERT_EQUAL_INT(4, heard.count);
    TEST_ASSERT_EQUAL_INT(b, heard.entries[0].port);
    TEST_ASSERT_EQUAL_INT(ear, heard.entries[1].port);
    TEST_ASSERT_EQUAL_HEX8(0xA, heard.entries[1].frame.data[0]);
    TEST_ASSERT_EQUAL_HEX8(0xB, heard.entries[3].frame.data[0]);
}

static void test_sim_bus_base_wins_over_remote_over_extended(void)
{
    static const can_frame_t extended = {.kind = CAN_FRAME_EXTENDED};
    static const can_frame_t remote = {.kind = CAN_FRAME_REMOTE};
    static const can_frame_t base = {.kind = CAN_FRAME_BASE};
    int a = attach();

    attach();
    sim_bus_send(&bus, a, &extended);
    sim_bus_send(&bus, a, &remote);
    sim_bus_send(&bus, a, &base);
    sim_bus_step(&bus, 0);
    sim_bus_step(&bus, 1000);
    TEST_ASSERT_EQUAL_INT(3, heard.count);
    TEST_ASSERT_EQUAL_UINT8(CAN_FRAME_BASE, heard.entries[0].frame.kind);
    TEST_ASSERT_EQUAL_UINT8(CAN_FRAME_REMOTE, heard.entries[1].frame.kind);
    TEST_ASSERT_EQUAL_UINT8(CAN_FRAME_EXTENDED, heard.entries[2].frame.kind);
    TEST_ASSERT_EQUAL_UINT64(50 + 3 + 47 + 3 + 71, heard.entries[2].time_us);
}

static void test_sim_bus_offered_while_busy_starts_at_the_end(void)
{
    int a = attach();
    int b = attach();

    sim_bus_send(&bus, a, &frame_7ff);
    TEST_ASSERT_EQUAL_UINT64(147, sim_bus_step(&bus, 100));
    sim_bus_step(&bus, 120);
    sim_bus_send(&bus, b, &frame_100);
    sim_bus_send(&bus, a, &frame_001); /* a lower identifier does not break in */
    TEST_ASSERT_EQUAL_UINT64(147, sim_bus_step(&bus, 120));
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 5000)); /* late by far */
    TEST_ASSERT_EQUAL_INT(3, heard.count);
    assert_delivery(0, 147, b, 0x7FF);
    assert_delivery(1, 150 + 56, b, 0x001);
    assert_delivery(2, 150 + 59 + 55, a, 0x100);
}

static void test_sim_bus_offered_in_interframe_space_waits_for_its_end(void)
{
    int a = attach();

    attach();
    sim_bus_send(&bus, a, &frame_7ff);
    sim_bus_step(&bus, 0);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 47));
    sim_bus_send(&bus, a, &frame_100);
    TEST_ASSERT_EQUAL_UINT64(50, sim_bus_step(&bus, 48));
    TEST_ASSERT_EQUAL_UINT64(50 + 55, sim_bus_step(&bus, 60)); /* late, and yet from 50 on */
}

static void test_sim_bus_full_queue_refuses(void)
{
    int a = attach();

    for (int i = 0; i < SIM_BUS_QUEUE_MAX; i++) {
        TEST_ASSERT_TRUE(sim_bus_send(&bus, a, &frame_100));
    }
    TEST_ASSERT_FALSE(sim_bus_send(&bus, a, &frame_001));
    sim_bus_step(&bus, 0); /* one is on the wire and gives up its place */
    TEST_ASSERT_TRUE(sim_bus_send(&bus, a, &frame_100));
    TEST_ASSERT_FALSE(sim_bus_send(&bus, a, &frame_100));
}

static void test_sim_bus_refuses_ports_that_are_not_attached(void)
{
    TEST_ASSERT_FALSE(sim_bus_send(&bus, 0, &frame_100));
    TEST_ASSERT_FALSE(sim_bus_send(&bus, -1, &frame_100));
    TEST_ASSERT_FALSE(sim_bus_send(&bus, SIM_BUS_PORTS_MAX, &frame_100));
    sim_bus_detach(&bus, 0);
    sim_bus_detach(&bus, -1);
    sim_bus_detach(&bus, SIM_BUS_PORTS_MAX);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 0));
}

static void test_sim_bus_detach_forgets_the_queue_but_not_the_wire(void)
{
    int a = attach();
    int b = attach();

    sim_bus_send(&bus, a, &frame_100);
    sim_bus_send(&bus, a, &frame_7ff);
    sim_bus_step(&bus, 0);
    sim_bus_detach(&bus, a);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 1000));
    TEST_ASSERT_EQUAL_INT(1, heard.count);
    assert_delivery(0, 55, b, 0x100);
}

static void test_sim_bus_new_port_does_not_hear_the_frame_on_the_wire(void)
{
    int a = attach();
    int b = attach();

    sim_bus_send(&bus, a, &frame_7ff);
    sim_bus_step(&bus, 0);
    sim_bus_detach(&bus, a);
    TEST_ASSERT_EQUAL_INT(a, attach()); /* the lowest free number, which is that of the sender */
    int c = attach();

    sim_bus_step(&bus, 100);
    sim_bus_send(&bus, b, &frame_100);
    sim_bus_step(&bus, 100);
    sim_bus_step(&bus, 200);
    TEST_ASSERT_EQUAL_INT(3, heard.count);
    assert_delivery(0, 47, b, 0x7FF);
    assert_delivery(1, 155, a, 0x100);
    assert_delivery(2, 155, c, 0x100);
}

/* The only frame that waited for the interframe space is taken back: the bus is idle from then on. */
static void test_sim_bus_detach_in_interframe_space_leaves_an_idle_bus(void)
{
    int a = attach();
    int b = attach();

    sim_bus_send(&bus, a, &frame_100);
    sim_bus_step(&bus, 0);
    sim_bus_send(&bus, b, &frame_100);
    TEST_ASSERT_EQUAL_UINT64(58, sim_bus_step(&bus, 55));
    sim_bus_detach(&bus, b);
    sim_bus_send(&bus, a, &frame_100);
    TEST_ASSERT_EQUAL_UINT64(9055, sim_bus_step(&bus, 9000));
}

/* Its frames wait for the line, and it misses what is sent meanwhile. */
static void test_sim_bus_cut_port_neither_hears_nor_sends(void)
{
    int a = attach();
    int b = attach();
    int c = attach();

    sim_bus_send(&bus, a, &frame_001);
    sim_bus_cut(&bus, a, true);
    sim_bus_send(&bus, a, &frame_7ff);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 0));
    sim_bus_send(&bus, b, &frame_100);
    TEST_ASSERT_EQUAL_UINT64(55, sim_bus_step(&bus, 0));
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 55));
    sim_bus_step(&bus, 1000);
    sim_bus_cut(&bus, a, false);
    sim_bus_step(&bus, 1000);
    sim_bus_step(&bus, 2000);
    TEST_ASSERT_EQUAL_INT(5, heard.count);
    assert_delivery(0, 55, c, 0x100);
    assert_delivery(1, 1056, b, 0x001);
    assert_delivery(3, 1106, b, 0x7FF);
}

/* Half a frame is none. */
static void test_sim_bus_mended_port_does_not_hear_the_frame_on_the_wire(void)
{
    int a = attach();
    int b = attach();

    sim_bus_cut(&bus, b, true);
    sim_bus_send(&bus, a, &frame_100);
    sim_bus_step(&bus, 0);
    sim_bus_cut(&bus, b, false);
    sim_bus_step(&bus, 100);
    TEST_ASSERT_EQUAL_INT(0, heard.count);
    sim_bus_cut(&bus, a, true);
    sim_bus_detach(&bus, a);
    TEST_ASSERT_EQUAL_INT(a, attach());
    sim_bus_send(&bus, a, &frame_100);
    sim_bus_step(&bus, 200);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, 300));
    TEST_ASSERT_EQUAL_INT(1, heard.count);
}

static bool note_sender(void *ctx, const can_frame_t *frame)
{
    (void)frame;
    *(int *)ctx = bus.delivering;
    return false;
}

static void test_sim_bus_tells_whose_frame_it_delivers(void)
{
    int sender = -1;
    (void)attach();
    int b = attach();

    bus.fault = note_sender;
    bus.fault_ctx = &sender;
    sim_bus_send(&bus, b, &frame_100);
    sim_bus_step(&bus, 0);
    sim_bus_step(&bus, 100);
    TEST_ASSERT_EQUAL_INT(b, sender);
    TEST_ASSERT_EQUAL_INT(-1, bus.delivering);
}

static void test_sim_bus_all_ports_taken(void)
{
    for (int i = 0; i < SIM_BUS_PORTS_MAX; i++) {
        TEST_ASSERT_EQUAL_INT(i, attach());
    }
    TEST_ASSERT_EQUAL_INT(-1, attach());
    sim_bus_detach(&bus, 7);
    TEST_ASSERT_EQUAL_INT(7, attach());
    sim_bus_send(&bus, SIM_BUS_PORTS_MAX - 1, &frame_100);
    sim_bus_step(&bus, 0);
    sim_bus_step(&bus, 55);
    TEST_ASSERT_EQUAL_INT(SIM_BUS_PORTS_MAX - 1, heard.count);
}

static void test_sim_bus_reply_from_the_callback_competes_from_the_end(void)
{
    int a = attach();
    int b = attach();

    listeners[b].reply = frame_001;
    listeners[b].replies = 1;
    sim_bus_send(&bus, a, &frame_100);
    sim_bus_send(&bus, a, &frame_7ff); /* has waited longer, but loses */
    sim_bus_step(&bus, 0);
    sim_bus_step(&bus, 4000);
    TEST_ASSERT_EQUAL_INT(3, heard.count);
    assert_delivery(0, 55, b, 0x100);
    assert_delivery(1, 58 + 56, a, 0x001);
    assert_delivery(2, 58 + 59 + 47, b, 0x7FF);
}

static void test_sim_bus_reply_on_a_quiet_bus_starts_after_the_interframe_space(void)
{
    int a = attach();
    int b = attach();

    listeners[b].reply = frame_001;
    listeners[b].replies = 1;
    sim_bus_send(&bus, a, &frame_100);
    sim_bus_step(&bus, 0);
    TEST_ASSERT_EQUAL_UINT64(58 + 56, sim_bus_step(&bus, 70));
}

/* ---- Deliveries do not depend on how often sim_bus_step is called ---- */

#define RANDOM_OFFERS 2000
#define RANDOM_PORTS 6

static log_t often;
static log_t late;

static uint32_t next_random(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

/* Port 2 answers some frames from within its callback, so that the answers depend on the order of events. */
static void on_frame_answering(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    listener_t *listener = ctx;

    on_frame(ctx, time_us, frame);
    if (listener->number == 2 && (frame->id & 7u) == 3u) {
        can_frame_t answer = {.id = (uint16_t)(frame->id ^ 0x123u), .dlc = 2};

        answer.data[0] = (uint8_t)time_us;
        answer.data[1] = frame->data[0];
        (void)sim_bus_send(listener->bus, listener->number, &answer); /* full: lost in both runs alike */
    }
}

static can_frame_t random_frame(uint32_t *state)
{
    can_frame_t frame = {.id = (uint16_t)(next_random(state) & CAN_FRAME_ID_MAX)};

    frame.dlc = (uint8_t)(next_random(state) % 9u);
    for (int i = 0; i < frame.dlc; i++) {
        frame.data[i] = (uint8_t)next_random(state);
    }
    return frame;
}

/* step_us 0: only at the times of the offers; else every step_us microseconds in between as well. */
static void run_random(log_t *log, uint64_t step_us)
{
    uint32_t state = 20210707;
    uint64_t now_us = 1000;

    log->count = 0;
    sim_bus_init(&bus);
    for (int i = 0; i < RANDOM_PORTS; i++) {
        listeners[i] = (listener_t){.number = i, .log = log, .bus = &bus};
        TEST_ASSERT_EQUAL_INT(i, sim_bus_attach(&bus, on_frame_answering, &listeners[i]));
    }
    for (int i = 0; i < RANDOM_OFFERS; i++) {
        can_frame_t frame = random_frame(&state);
        int port = (int)(next_random(&state) % RANDOM_PORTS);
        uint64_t next_us = now_us + next_random(&state) % 260u; /* near full load, with pauses */

        (void)sim_bus_send(&bus, port, &frame);
        sim_bus_step(&bus, now_us);
        for (uint64_t t = now_us + step_us; step_us > 0 && t < next_us; t += step_us) {
            uint64_t again_us = sim_bus_step(&bus, t);
            TEST_ASSERT_TRUE(again_us > t);
        }
        sim_bus_step(&bus, next_us);
        now_us = next_us;
    }
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, now_us + 1000000));
}

static void test_sim_bus_late_steps_deliver_the_same(void)
{
    run_random(&often, 1);
    run_random(&late, 0);
    TEST_ASSERT_GREATER_THAN(RANDOM_OFFERS * (RANDOM_PORTS - 1), often.count); /* answers came on top */
    TEST_ASSERT_EQUAL_INT(often.count, late.count);
    TEST_ASSERT_EQUAL_MEMORY(often.entries, late.entries, sizeof often.entries[0] * (size_t)often.count);
}

/* The frames of a random run stand one after the other: each has its own bits, with three bits or more
 * between. */
static void test_sim_bus_frames_never_overlap(void)
{
    uint64_t free_from_us = 0;

    run_random(&often, 7);
    for (int i = 0; i < often.count; i += RANDOM_PORTS - 1) {
        const delivery_t *entry = &often.entries[i];
        uint64_t start_us = entry->time_us - sim_bus_frame_bits(&entry->frame);

        TEST_ASSERT_TRUE(start_us >= free_from_us);
        TEST_ASSERT_EQUAL_UINT64(entry->time_us, often.entries[i + RANDOM_PORTS - 2].time_us);
        free_from_us = entry->time_us + 3;
    }
    TEST_ASSERT_EQUAL_UINT64((uint64_t)often.count / (RANDOM_PORTS - 1), bus.frames);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sim_bus_frame_bits_are_exact);
    RUN_TEST(test_sim_bus_frame_bits_take_eight_bytes_at_most);
    RUN_TEST(test_sim_bus_idle_bus_wants_no_call);
    RUN_TEST(test_sim_bus_frame_starts_with_the_step_and_arrives_at_its_end);
    RUN_TEST(test_sim_bus_lowest_identifier_wins);
    RUN_TEST(test_sim_bus_queue_sends_lowest_identifier_then_oldest_first);
    RUN_TEST(test_sim_bus_equal_identifiers_go_by_port_number);
    RUN_TEST(test_sim_bus_base_wins_over_remote_over_extended);
    RUN_TEST(test_sim_bus_offered_while_busy_starts_at_the_end);
    RUN_TEST(test_sim_bus_offered_in_interframe_space_waits_for_its_end);
    RUN_TEST(test_sim_bus_full_queue_refuses);
    RUN_TEST(test_sim_bus_refuses_ports_that_are_not_attached);
    RUN_TEST(test_sim_bus_detach_forgets_the_queue_but_not_the_wire);
    RUN_TEST(test_sim_bus_new_port_does_not_hear_the_frame_on_the_wire);
    RUN_TEST(test_sim_bus_detach_in_interframe_space_leaves_an_idle_bus);
    RUN_TEST(test_sim_bus_cut_port_neither_hears_nor_sends);
    RUN_TEST(test_sim_bus_mended_port_does_not_hear_the_frame_on_the_wire);
    RUN_TEST(test_sim_bus_tells_whose_frame_it_delivers);
    RUN_TEST(test_sim_bus_all_ports_taken);
    RUN_TEST(test_sim_bus_reply_from_the_callback_competes_from_the_end);
    RUN_TEST(test_sim_bus_reply_on_a_quiet_bus_starts_after_the_interframe_space);
    RUN_TEST(test_sim_bus_late_steps_deliver_the_same);
    RUN_TEST(test_sim_bus_frames_never_overlap);
    return UNITY_END();
}
