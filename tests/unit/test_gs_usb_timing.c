/* Bit timing of USB adapters at 1 Mbit/s: the settings of known clocks, worked out by hand, and for every
 * clock that a search through all settings finds the best of. */
#include "gs_usb_codec.h"
#include "unity.h"

#define BITRATE 1000000u

/* What the two CAN peripherals of candleLight's microcontrollers permit. */
static const gs_usb_codec_constants_t bxcan = {.tseg1_min = 1,
                                               .tseg1_max = 16,
                                               .tseg2_min = 1,
                                               .tseg2_max = 8,
                                               .sjw_max = 4,
                                               .brp_min = 1,
                                               .brp_max = 1024,
                                               .brp_step = 1};
static const gs_usb_codec_constants_t fdcan = {.tseg1_min = 1,
                                               .tseg1_max = 256,
                                               .tseg2_min = 1,
                                               .tseg2_max = 128,
                                               .sjw_max = 128,
                                               .brp_min = 1,
                                               .brp_max = 512,
                                               .brp_step = 1};

void setUp(void) {}

void tearDown(void) {}

static bool compute(const gs_usb_codec_constants_t *peripheral, uint32_t clock_hz,
                    gs_usb_codec_timing_t *timing)
{
    gs_usb_codec_constants_t limits = *peripheral;
    limits.clock_hz = clock_hz;
    return gs_usb_codec_compute_timing(&limits, BITRATE, timing);
}

static void check(const gs_usb_codec_constants_t *peripheral, uint32_t clock_hz,
                  gs_usb_codec_timing_t expected)
{
    gs_usb_codec_timing_t timing;
    TEST_ASSERT_TRUE(compute(peripheral, clock_hz, &timing));
    TEST_ASSERT_EQUAL_UINT32(expected.prop, timing.prop);
    TEST_ASSERT_EQUAL_UINT32(expected.phase1, timing.phase1);
    TEST_ASSERT_EQUAL_UINT32(expected.phase2, timing.phase2);
    TEST_ASSERT_EQUAL_UINT32(expected.sjw, timing.sjw);
    TEST_ASSERT_EQUAL_UINT32(expected.brp, timing.brp);
}

/* D-LIN-2. prop, phase1, phase2, sjw, brp. */
static void test_48_mhz(void)
{
    check(&bxcan, 48000000, (gs_usb_codec_timing_t){1, 12, 2, 1, 3}); /* 16 quanta, 87.5 % */
    check(&fdcan, 48000000, (gs_usb_codec_timing_t){1, 40, 6, 3, 1}); /* 48 quanta, 87.5 % */
}

static void test_80_mhz(void)
{
    check(&bxcan, 80000000, (gs_usb_codec_timing_t){1, 12, 2, 1, 5});  /* 16 quanta, 87.5 % */
    check(&fdcan, 80000000, (gs_usb_codec_timing_t){1, 68, 10, 5, 1}); /* 80 quanta, 87.5 % */
}

/* 170 is 2 times 5 times 17: no setting reaches 87.5 %. */
static void test_170_mhz(void)
{
    check(&bxcan, 170000000, (gs_usb_codec_timing_t){1, 12, 3, 1, 10});   /* 17 quanta, 82.4 % */
    check(&fdcan, 170000000, (gs_usb_codec_timing_t){1, 146, 22, 11, 1}); /* 170 quanta, 87.1 % */
}

static void test_slow_and_odd_clocks(void)
{
    check(&bxcan, 8000000, (gs_usb_codec_timing_t){1, 5, 1, 1, 1});   /* 8 quanta, 87.5 % */
    check(&bxcan, 42000000, (gs_usb_codec_timing_t){1, 10, 2, 1, 3}); /* 14 quanta, 85.7 % */
    check(&bxcan, 47999999, (gs_usb_codec_timing_t){1, 12, 2, 1, 3}); /* told with a rounding error */
}

static void test_what_cannot_be(void)
{
    gs_usb_codec_timing_t timing;
    TEST_ASSERT_FALSE(compute(&fdcan, 33333333, &timing)); /* 33 quanta are 1 % off */
    TEST_ASSERT_FALSE(compute(&fdcan, 2000000, &timing));
    TEST_ASSERT_FALSE(compute(&fdcan, 0, &timing));
    gs_usb_codec_constants_t narrow = bxcan;
    narrow.tseg2_min = 5; /* of 16 quanta: before 75 % */
    narrow.tseg1_max = 10;
    TEST_ASSERT_FALSE(compute(&narrow, 48000000, &timing));
    const gs_usb_codec_constants_t nothing = {.clock_hz = 48000000};
    TEST_ASSERT_FALSE(gs_usb_codec_compute_timing(&nothing, BITRATE, &timing));
    const gs_usb_codec_constants_t absurd = {.clock_hz = UINT32_MAX,
                                             .tseg1_max = UINT32_MAX,
                                             .tseg2_max = UINT32_MAX,
                                             .sjw_max = UINT32_MAX,
                                             .brp_max = UINT32_MAX,
                                             .brp_step = UINT32_MAX};
    TEST_ASSERT_TRUE(gs_usb_codec_compute_timing(&absurd, BITRATE, &timing)); /* ends soon */
}

static void test_prescalers_come_in_steps(void)
{
    gs_usb_codec_constants_t even = bxcan;
    gs_usb_codec_timing_t timing;
    even.brp_min = 2;
    even.brp_step = 2;
    TEST_ASSERT_TRUE(compute(&even, 80000000, &timing));
    TEST_ASSERT_EQUAL_UINT32(10, timing.brp); /* 8 quanta, 87.5 %, where 5 would make 16 */
    TEST_ASSERT_EQUAL_UINT32(5, timing.phase1);
    TEST_ASSERT_EQUAL_UINT32(1, timing.phase2);
}

/* The latest sample point up to 87.5 % and from 75 % on that any setting with the exact bit rate has, as
 * quanta behind it in a bit; 0 of 1: there is none. */
typedef struct {
    uint32_t behind;
    uint32_t quanta;
} sample_t;

static sample_t search(const gs_usb_codec_constants_t *limits, uint32_t clock_hz)
{
    sample_t best = {0, 1};
    for (uint32_t brp = limits->brp_min; brp <= limits->brp_max; brp++) {
        if (clock_hz % (brp * BITRATE) != 0 || clock_hz / (brp * BITRATE) < 4) {
            continue;
        }
        const uint32_t quanta = clock_hz / (brp * BITRATE);
        for (uint32_t tseg2 = limits->tseg2_min; tseg2 <= limits->tseg2_max && tseg2 + 1 < quanta; tseg2++) {
            const uint32_t tseg1 = quanta - 1 - tseg2;
            const bool good = tseg1 >= limits->tseg1_min && tseg1 <= limits->tseg1_max &&
                              8 * tseg2 >= quanta && 4 * tseg2 <= quanta;
            if (good && (best.behind == 0 || tseg2 * best.quanta < best.behind * quanta)) {
                best = (sample_t){tseg2, quanta};
            }
        }
    }
    return best;
}

static void check_clock(const gs_usb_codec_constants_t *peripheral, uint32_t clock_hz)
{
    gs_usb_codec_timing_t timing;
    const sample_t best = search(peripheral, clock_hz);
    const bool found = compute(peripheral, clock_hz, &timing);
    TEST_ASSERT_EQUAL(best.behind != 0, found);
    if (!found) {
        return;
    }
    const uint32_t quanta = 1 + timing.prop + timing.phase1 + timing.phase2;
    TEST_ASSERT_EQUAL_UINT32(clock_hz, quanta * timing.brp * BITRATE);
    TEST_ASSERT_EQUAL_UINT32(best.behind * quanta, timing.phase2 * best.quanta);
    TEST_ASSERT_TRUE(timing.prop + timing.phase1 <= peripheral->tseg1_max &&
                     timing.phase2 <= peripheral->tseg2_max);
    TEST_ASSERT_TRUE(timing.sjw >= 1 && timing.sjw <= peripheral->sjw_max);
    TEST_ASSERT_TRUE(timing.sjw <= timing.phase1 && timing.sjw <= timing.phase2);
}

static void test_every_whole_clock(void)
{
    for (uint32_t mhz = 4; mhz <= 240; mhz++) {
        check_clock(&bxcan, mhz * 1000000u);
        check_clock(&fdcan, mhz * 1000000u);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_48_mhz);
    RUN_TEST(test_80_mhz);
    RUN_TEST(test_170_mhz);
    RUN_TEST(test_slow_and_odd_clocks);
    RUN_TEST(test_what_cannot_be);
    RUN_TEST(test_prescalers_come_in_steps);
    RUN_TEST(test_every_whole_clock);
    return UNITY_END();
}
