#include "looped.h"

#include "unity.h"

int looped_settle(loop_t *loop, uint64_t time_us)
{
    int rounds = 0;
    const uint64_t end_us = loop_refresh_now_us(loop) + time_us;
    loop_set_deadline_us(loop, end_us);
    while (loop_now_us(loop) < end_us) {
        TEST_ASSERT_TRUE(loop_run_once(loop));
        rounds++;
    }
    return rounds;
}

void looped_until(loop_t *loop, const size_t *count, size_t wanted)
{
    const uint64_t end_us = loop_refresh_now_us(loop) + LOOPED_LIMIT_US;
    loop_set_deadline_us(loop, end_us);
    while (*count < wanted && loop_now_us(loop) < end_us) {
        TEST_ASSERT_TRUE(loop_run_once(loop));
    }
    TEST_ASSERT_EQUAL_UINT(wanted, *count);
}

void looped_until_state(loop_t *loop, hal_can_t *can, hal_can_state_t state)
{
    const uint64_t end_us = loop_refresh_now_us(loop) + LOOPED_LIMIT_US;
    loop_set_deadline_us(loop, end_us);
    while (hal_can_health(can).state != state && loop_now_us(loop) < end_us) {
        TEST_ASSERT_TRUE(loop_run_once(loop));
    }
    TEST_ASSERT_EQUAL_INT(state, hal_can_health(can).state);
}
