/* The deadline heap and the transmit queue, each against the plainest thing that does the same. */
#include <string.h>

#include "pdcp_timers.h"
#include "pdcp_txq.h"
#include "unity.h"

#ifdef __AVR__ /* simulated, and slow */
enum { TIMER_ROUNDS = 1000, FRAME_ROUNDS = 5000 };
#else
enum { TIMER_ROUNDS = 200000, FRAME_ROUNDS = 100000 };
#endif

void setUp(void) {}

void tearDown(void) {}

static uint32_t random_state = 1;

static uint32_t any(uint32_t below)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) % below;
}

/* Against an array that is searched from end to end, across the wrap of the clock. */
static void test_timers_fire_in_order_of_their_deadlines(void)
{
    static pdcp_timers_t timers;
    static bool set[PDCP_TIMERS_MAX];
    static uint32_t deadline[PDCP_TIMERS_MAX];
    uint32_t now_ms = 0xFFFF0000u;
    memset(&timers, 0, sizeof timers);
    memset(set, 0, sizeof set);
    for (uint32_t round = 0; round < TIMER_ROUNDS; round++) {
        const uint8_t timer = (uint8_t)any(PDCP_TIMERS_MAX);
        const uint32_t what = any(8);
        if (what < 4) {
            deadline[timer] = now_ms + any(1000);
            set[timer] = true;
            pdcp_timers_set(&timers, timer, deadline[timer]);
        } else if (what == 4) {
            set[timer] = false;
            pdcp_timers_cancel(&timers, timer);
        } else {
            now_ms += any(3);
        }
        uint32_t next_ms = now_ms + 0x3FFFFFFFu;
        for (int i = 0; i < PDCP_TIMERS_MAX; i++) {
            TEST_ASSERT_EQUAL(set[i], pdcp_timers_is_set(&timers, (uint8_t)i));
            if (set[i] && (int32_t)(deadline[i] - next_ms) < 0) {
                next_ms = deadline[i];
            }
        }
        TEST_ASSERT_EQUAL_HEX32(next_ms, pdcp_timers_next_ms(&timers, now_ms));
        uint8_t due;
        const bool taken = pdcp_timers_take_due(&timers, now_ms, &due);
        TEST_ASSERT_EQUAL((int32_t)(next_ms - now_ms) <= 0, taken);
        if (taken) {
            TEST_ASSERT_TRUE(set[due]);
            TEST_ASSERT_EQUAL_HEX32(next_ms, deadline[due]);
            set[due] = false;
        }
    }
}

/* By identifier; the oldest first among equals. */
static void test_frames_leave_in_order_of_arbitration(void)
{
    static pdcp_txq_t txq;
    static can_frame_t model[PDCP_TX_MAX];
    unsigned count = 0;
    uint8_t serial = 0;
    pdcp_txq_init(&txq);
    for (uint32_t round = 0; round < FRAME_ROUNDS; round++) {
        if (any(2) == 0) {
            const can_frame_t frame = {.id = (uint16_t)any(5), .dlc = 1, .data = {serial++}};
            unsigned last = 0; /* leaves last: the highest identifier, the youngest among equals */
            for (unsigned i = 1; i < count; i++) {
                last = model[i].id >= model[last].id ? i : last;
            }
            if (count < PDCP_TX_MAX) {
                TEST_ASSERT_EQUAL(PDCP_TXQ_TAKEN, pdcp_txq_put(&txq, &frame));
                model[count++] = frame;
            } else if (frame.id >= model[last].id) {
                TEST_ASSERT_EQUAL(PDCP_TXQ_FULL, pdcp_txq_put(&txq, &frame));
            } else {
                TEST_ASSERT_EQUAL(PDCP_TXQ_PUSHED_OUT, pdcp_txq_put(&txq, &frame));
                memmove(&model[last], &model[last + 1], (count - last - 1) * sizeof model[0]);
                model[count - 1] = frame;
            }
        } else if (count != 0) {
            unsigned first = 0;
            for (unsigned i = 1; i < count; i++) {
                first = model[i].id < model[first].id ? i : first;
            }
            TEST_ASSERT_EQUAL_MEMORY(&model[first], pdcp_txq_peek(&txq), sizeof model[0]);
            pdcp_txq_pop(&txq);
            memmove(&model[first], &model[first + 1], (count - first - 1) * sizeof model[0]);
            count--;
        } else {
            TEST_ASSERT_NULL(pdcp_txq_peek(&txq));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_timers_fire_in_order_of_their_deadlines);
    RUN_TEST(test_frames_leave_in_order_of_arbitration);
    return UNITY_END();
}
