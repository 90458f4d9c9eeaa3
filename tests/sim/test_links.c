/* What random lives have shown of links (test_life.c), each with as little as it takes. The number is the
 * seed of the life, whose last check ends each case, too. */
#include "life.h"
#include "unity.h"

enum { CALM_MS = 40000, NOBODY = -1 }; /* calm as in a life: whatever is tried again after a while has been */

static limb_t limb;
static int port;  /* to speak for a part */
static int mute;  /* the part whose answers do not arrive; NOBODY: all do */
static int faint; /* the same for beacons */

static uint8_t id_of(int part)
{
    return pdcp_device_node_id(sim_node_device(limb.parts[part].node));
}

static bool loses(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    return (mute != NOBODY && frame->id == pdcp_can_id(PDCP_PRIORITY_NORMAL, false, id_of(mute)) &&
            (frame->data[0] & PDCP_ANSWER) != 0) ||
           (faint != NOBODY && frame->id == pdcp_can_id(PDCP_PRIORITY_HIGH, false, id_of(faint)));
}

void setUp(void)
{
    limb_begin(&limb, 1, 0xFFFFFFFFu - 700u);
    port = sim_bus_attach(&limb.world.bus, NULL, NULL);
    mute = NOBODY;
    faint = NOBODY;
    limb.world.bus.fault = loses;
}

void tearDown(void)
{
    limb_end(&limb);
}

/* The parts have linked themselves like this. */
static void begin_case(int parts, const char *links)
{
    limb_want(&limb, links);
    limb_plug(&limb, 0, parts - 1);
    limb_await(&limb, 2000);
}

/* The tables have these links; devices may be about to be told. */
static void expect_listed(const char *links)
{
    char text[LIMB_TEXT];
    limb_links(&limb, text);
    TEST_ASSERT_EQUAL_STRING(links, text);
}

static void calm_down(void)
{
    limb_run_ms(&limb, CALM_MS);
    life_check_calm(&limb);
}

static void send(const can_frame_t *frame)
{
    TEST_ASSERT_TRUE(sim_bus_send(&limb.world.bus, port, frame));
    limb_run_ms(&limb, 1);
}

/* A device asks for the source of its input (Update Data Channel). */
static void ask_for_source(int part, uint8_t input)
{
    const can_frame_t frame = {.id = pdcp_can_id(PDCP_PRIORITY_NORMAL, false, id_of(part)),
                               .dlc = 2,
                               .data = {PDCP_UPDATE_CHANNEL, input}};
    send(&frame);
}

/* A device gives its input 1 another source by itself: the output 1 of a device with this VID and PID. */
static void name_source(int part, uint8_t vid, uint8_t pid)
{
    const can_frame_t frame = {.id = pdcp_can_id(PDCP_PRIORITY_NORMAL, true, id_of(part)),
                               .dlc = 7,
                               .data = {PDCP_SET_PARAMETER, PDCP_IN_SOURCE_VID_PID, 1, vid, 0, pid, 0}};
    send(&frame);
}

/* The input 2.1 has lost its link to part 1, whose input stands in for it and is required by now. It is
 * back. */
static void make_stand_in(const char *stand_in)
{
    (void)limb_add(&limb, 1, stand_in);
    (void)limb_add(&limb, 2, "in 5200 2110");
    (void)limb_add(&limb, 3, "out 5000 2120");
    (void)limb_add(&limb, 4, "in 5000 2120; out 5000 2110, required = 1");
    (void)limb_add(&limb, 5, "in 5100 2110");
    begin_case(5, "3.1>4.1 4.2>5.1");
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
}

/* Life 21601: an original that cannot come back, since what stands in for it is required. The host's link for
 * it is refused, for both want the output for themselves (D-API-13). */
static void test_a_stand_in_that_stays_keeps_its_sole_access(void)
{
    make_stand_in("in 5200 2110; out 5000 2130, required = 1");
    const uint16_t answer = limb_link(&limb, 4, 2, 2, 1);
    const uint8_t error = limb.answer[8];
    calm_down();
    TEST_ASSERT_EQUAL_HEX16(0x2309, answer);
    TEST_ASSERT_EQUAL_HEX8(0x08, error);
}

/* D-PRO-6: the same without sole access. The host gets its link, and what stood in goes when nothing requires
 * it any more. */
static void test_a_stand_in_goes_after_the_host_has_made_the_original(void)
{
    make_stand_in("in 5000 2110; out 5000 2130, required = 1");
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(&limb, 4, 2, 2, 1));
    limb_power_on(&limb, 2);
    calm_down();
    limb_expect(&limb, "4.2>2.1 3.1>4.1 4.2>5.1");
}

/* Life 39003: a source of a stored configuration is lost. While one of its inputs does not answer, the device
 * of the other one asks for it: that one is silenced all the same (D-BUS-14). */
static void test_an_input_that_is_asked_for_is_silenced(void)
{
    (void)limb_add(&limb, 1, "in 5100 2110");
    (void)limb_add(&limb, 2, "in 5000 1110; in 5100 2110");
    (void)limb_add(&limb, 3, "out 5000 2110");
    limb_power_on(&limb, 0); /* stands first in the tables */
    limb_run_ms(&limb, 100);
    limb_want(&limb, "3.1>1.1 3.1>2.2");
    limb_plug(&limb, 1, 2);
    limb_await(&limb, 2000);
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    mute = 0;
    limb_power_off(&limb, 2);
    limb_want(&limb, "");
    while (limb.lost.time_us == 0) {
        limb_run_ms(&limb, 1);
    }
    ask_for_source(1, 2);
    limb_run_ms(&limb, 1000);
    mute = NOBODY;
    calm_down();
}

/* A hand, a controller whose output requires its input, and two sensors. */
static void add_limb(void)
{
    (void)limb_add(&limb, 1, "in 5300 1110");
    (void)limb_add(&limb, 2, "in 5000 2110; out 5000 1110, required = 1");
    (void)limb_add(&limb, 3, "out 5000 2110");
    (void)limb_add(&limb, 4, "out 5000 2120");
}

/* They have linked themselves. */
static void begin_limb(void)
{
    add_limb();
    begin_case(4, "2.2>1.1 3.1>2.1");
}

/* Life 38148: a device that beacons does not answer when its input is to get another source, nor when it is
 * to get its old one back. What requires the input rests, and comes back with it (D-PRO-9). */
static void test_what_requires_a_link_that_cannot_be_restored_rests(void)
{
    begin_limb();
    mute = 1;
    const uint16_t answer = limb_link(&limb, 4, 1, 2, 1);
    limb_run_ms(&limb, 2000);
    char while_mute[LIMB_TEXT];
    limb_links(&limb, while_mute);
    mute = NOBODY;
    calm_down();
    limb_expect(&limb, "2.2>1.1 3.1>2.1");
    TEST_ASSERT_EQUAL_HEX16(0x2309, answer);
    TEST_ASSERT_EQUAL_STRING("", while_mute);
}

/* Life 44331: the same in a loop, where everything requires itself. */
static void test_a_loop_with_a_link_that_cannot_be_restored_rests(void)
{
    (void)limb_add(&limb, 1, "in 5000 1220; out 5000 2120, required = 1");
    (void)limb_add(&limb, 2, "in 5100 1220");
    (void)limb_add(&limb, 3, "in 5000 2120; out 5000 1220, required = 1");
    (void)limb_add(&limb, 4, "out 5000 1210");
    begin_case(4, "3.2>1.1 3.2>2.1 1.2>3.1");
    mute = 0;
    const uint16_t answer = limb_link(&limb, 4, 1, 1, 1);
    limb_run_ms(&limb, 2000);
    mute = NOBODY;
    calm_down();
    limb_expect(&limb, "3.2>1.1 3.2>2.1 1.2>3.1");
    TEST_ASSERT_EQUAL_HEX16(0x2309, answer);
}

/* An input is without a source because its device has said so. */
static void test_what_requires_an_input_that_gives_up_its_source(void)
{
    begin_limb();
    name_source(1, 9, 9); /* nobody */
    ask_for_source(1, 1);
    limb_run_ms(&limb, 100);
    expect_listed("2.2>1.1 3.1>2.1"); /* the configuration decides */
    name_source(1, 0xFF, 0xFF);       /* unconnected */
    ask_for_source(1, 1);
    calm_down();
    limb_expect(&limb, "2.2>1.1 3.1>2.1");
}

/* A source that is lost before it has beaconed was never there for the host, who is not told. */
static void test_what_requires_a_source_that_never_beaconed(void)
{
    add_limb();
    limb_plug(&limb, 0, 1);
    limb_run_ms(&limb, 100);
    limb_want(&limb, "2.2>1.1 3.1>2.1");
    limb_power_on(&limb, 2);
    faint = 2;
    limb_await(&limb, 2000);
    faint = NOBODY;
    limb_power_off(&limb, 2);
    calm_down();
    limb_expect(&limb, "");
}

/* The source of a required input is lost, and its device does not take another one. While all that could
 * replace it is tried, what requires the input rests. */
static void test_what_requires_an_input_rests_while_replacements_fail(void)
{
    begin_limb();
    mute = 1;
    limb_power_off(&limb, 2);
    limb_want(&limb, "");
    while (limb.lost.time_us == 0) {
        limb_run_ms(&limb, 1);
    }
    limb_run_ms(&limb, 800); /* the input is silenced, and 4.1 tried once */
    expect_listed("");
    mute = NOBODY;
    calm_down();
    limb_expect(&limb, "2.2>1.1 4.1>2.1");
}

/* An action of the host, which comes first, does not insist on a link that was lost while it waited, and
 * whose device does not answer. */
static void test_a_link_that_cannot_be_made_holds_up_no_action(void)
{
    static const uint8_t enforce[] = {ARB_ACTION_ENFORCE, 0};
    begin_limb();
    mute = 1;
    ask_for_source(1, 1);
    TEST_ASSERT_EQUAL_HEX16(0x2408, limb_ask(&limb, 0x2407, enforce, sizeof enforce));
    limb_run_ms(&limb, 10);
    expect_listed("");
    mute = NOBODY;
    calm_down();
    limb_expect(&limb, "2.2>1.1 3.1>2.1");
}

/* D-PRO-23, D-PRO-27: a link that is made again while a plan waits for that is not taken away by the plan,
 * which was made without it. */
static void test_a_link_made_again_outlives_the_plan_that_waited(void)
{
    static const uint8_t flags = ARB_FLAGS_FACTORY & ~ARB_FLAG_HOT_SWAP;
    (void)limb_add(&limb, 1, "in 5100 2110");
    (void)limb_add(&limb, 2, "out 5000 2110");
    (void)limb_add(&limb, 3, "out 5000 2120; out 5000 2130");
    (void)limb_add(&limb, 4, "out 5000 1110");
    begin_case(3, "2.1>1.1");
    (void)limb_act(&limb, ARB_ACTION_SAVE, 0);
    limb_power_off(&limb, 1);
    limb_want(&limb, "3.1>1.1");
    limb_await(&limb, 2000);
    TEST_ASSERT_EQUAL_HEX16(0x2405, limb_ask(&limb, 0x2404, &flags, 1));
    mute = 0;
    TEST_ASSERT_EQUAL_HEX16(0x2309, limb_link(&limb, 3, 2, 1, 1));
    limb_power_on(&limb, 3);
    limb_run_ms(&limb, 50);
    mute = NOBODY;
    limb_run_ms(&limb, 500);
    limb_expect(&limb, "3.1>1.1");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_link_made_again_outlives_the_plan_that_waited);
    RUN_TEST(test_what_requires_a_link_that_cannot_be_restored_rests);
    RUN_TEST(test_a_loop_with_a_link_that_cannot_be_restored_rests);
    RUN_TEST(test_what_requires_an_input_that_gives_up_its_source);
    RUN_TEST(test_what_requires_a_source_that_never_beaconed);
    RUN_TEST(test_what_requires_an_input_rests_while_replacements_fail);
    RUN_TEST(test_a_link_that_cannot_be_made_holds_up_no_action);
    RUN_TEST(test_a_stand_in_that_stays_keeps_its_sole_access);
    RUN_TEST(test_a_stand_in_goes_after_the_host_has_made_the_original);
    RUN_TEST(test_an_input_that_is_asked_for_is_silenced);
    return UNITY_END();
}
