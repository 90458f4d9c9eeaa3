/* What random lives have shown of links (test_life.c), each with as little as it takes. The number is the
 * seed of the life, whose last check ends each case, too. */
#include "life.h"
#include "unity.h"

enum { CALM_MS = 40000 }; /* as in a life: whatever is tried again after a while has been */

static limb_t limb;

void setUp(void)
{
    limb_begin(&limb, 1, 0xFFFFFFFFu - 700u);
}

void tearDown(void)
{
    limb_end(&limb);
}

static void calm_down(void)
{
    limb_run_ms(&limb, CALM_MS);
    life_check_calm(&limb);
}

/* Life 21601: an original that cannot come back, since what stands in for it is required. The host's link for
 * it is refused, for both want the output for themselves (D-API-13). */
static void test_a_stand_in_that_stays_keeps_its_sole_access(void)
{
    (void)limb_add(&limb, 1, "in 5200 2110; out 5000 2130, required = 1");
    (void)limb_add(&limb, 2, "in 5200 2110");
    (void)limb_add(&limb, 3, "out 5000 2120");
    (void)limb_add(&limb, 4, "in 5000 2120; out 5000 2110, required = 1");
    (void)limb_add(&limb, 5, "in 5100 2110");
    limb_want(&limb, "3.1>4.1 4.2>5.1");
    limb_plug(&limb, 0, 4);
    limb_await(&limb, 2000);
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(&limb, 4, 2, 2, 1));
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    limb_power_off(&limb, 1);
    limb_want(&limb, "4.2>1.1 3.1>4.1 4.2>5.1");
    limb_await(&limb, 3000);
    limb_power_off(&limb, 2); /* now the stand-in is part of what feeds its own source */
    limb_want(&limb, "4.2>1.1 1.2>4.1 4.2>5.1");
    limb_await(&limb, 3000);
    limb_power_on(&limb, 1);
    limb_run_ms(&limb, 1000);
    limb_expect(&limb, "4.2>1.1 1.2>4.1 4.2>5.1");
    const uint16_t answer = limb_link(&limb, 4, 2, 2, 1);
    const uint8_t error = limb.answer[8];
    calm_down();
    TEST_ASSERT_EQUAL_HEX16(0x2309, answer);
    TEST_ASSERT_EQUAL_HEX8(0x08, error);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_stand_in_that_stays_keeps_its_sole_access);
    return UNITY_END();
}
