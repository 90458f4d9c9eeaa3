/* What a user does to a limb that configures itself (profile-layer.md 4): parts are pulled, put back, added,
 * refuse or are reset; a second arbitrator; any of it in any order. The real device role and application in
 * virtual time. */
#include <stdio.h>
#include <string.h>

#include "swap.h"
#include "unity.h"

enum { SEEDS = 3 };

static limb_t limb;

void setUp(void)
{
    swap_begin(&limb);
}

void tearDown(void)
{
    limb_end(&limb);
}

/* --- Pulled and put back --- */

/* Originals come back and replace what stood in for them (D-PRO-6). */
static void swap_controller(uint32_t away_ms)
{
    swap_run(&limb);
    limb_power_on(&limb, SWAP_SPARE);
    limb_run_ms(&limb, 1000);
    limb_expect(&limb, SWAP_LINKS);
    limb_want(&limb, SWAP_LINKS_SPARE);
    limb_power_off(&limb, D2);
    limb_await(&limb, 2500);
    TEST_ASSERT_TRUE(limb.linked.time_us - limb.lost.time_us <
                     100000 + limb.linked.busy_us - limb.lost.busy_us);
    limb_expect_flow(&limb);
    limb_run_ms(&limb, away_ms);
    limb_expect(&limb, SWAP_LINKS_SPARE);
    limb_want(&limb, SWAP_LINKS);
    limb_power_on(&limb, D2);
    limb_await(&limb, 2500);
    limb_expect_flow(&limb);
    limb_run_ms(&limb, 20000);
    limb_expect(&limb, SWAP_LINKS);
}

static void test_the_controller_is_back_within_10_s(void)
{
    swap_controller(3000);
}

static void test_the_controller_is_back_after_its_ids_were_given_up(void)
{
    swap_controller(15000);
}

/* Before it is missed: nothing stands in. */
static void test_the_controller_is_reset_by_itself(void)
{
    swap_run(&limb);
    limb_power_on(&limb, SWAP_SPARE);
    limb_run_ms(&limb, 1000);
    limb_power_off(&limb, D2);
    limb_power_on(&limb, D2);
    limb_want(&limb, SWAP_LINKS);
    for (int ms = 0; ms < 1000; ms++) {
        limb_run_ms(&limb, 1);
        TEST_ASSERT_NULL(strchr(limb.wanted, '4'));
        char text[LIMB_TEXT];
        limb_links(&limb, text);
        TEST_ASSERT_NULL_MESSAGE(strstr(text, "4."), text);
    }
    limb_expect(&limb, SWAP_LINKS);
    limb_expect_flow(&limb);
}

static void test_a_spare_part_takes_nothing(void)
{
    swap_run(&limb);
    const uint32_t changes = limb.events[PDCP_EVENT_LINK];
    limb_power_on(&limb, SWAP_SPARE);
    limb_run_ms(&limb, 3000);
    limb_expect(&limb, SWAP_LINKS);
    TEST_ASSERT_EQUAL(changes, limb.events[PDCP_EVENT_LINK]);
}

/* Also one that start-up would have preferred, by its serial number. */
static void test_a_better_part_that_comes_later_takes_nothing(void)
{
    const int better = limb_add(&limb, 1, SWAP_CONTROLLER);
    swap_run(&limb);
    limb_power_on(&limb, better);
    limb_run_ms(&limb, 3000);
    limb_expect(&limb, SWAP_LINKS);
}

/* D-PRO-9, both ends are disabled; the hand goes to its safe value. */
static void test_links_rest_while_a_required_input_is_lost(void)
{
    swap_run(&limb);
    limb_power_off(&limb, D1);
    limb_want(&limb, "");
    limb_await(&limb, 2500);
    TEST_ASSERT_TRUE(limb.parts[D3].safe[1] && limb.parts[D3].safe[2]);
    for (uint8_t number = 1; number <= 3; number++) { /* the host sees them as inactive */
        TEST_ASSERT_EQUAL_HEX16(0x220E, limb_ask(&limb, 0x220D, &number, 1));
        TEST_ASSERT_EQUAL(PDCP_LINK_INACTIVE, limb.answer[8 + 14]);
    }
    limb_want(&limb, SWAP_LINKS);
    limb_power_on(&limb, D1);
    limb_await(&limb, 2500);
    limb_expect_flow(&limb);
}

/* Another sensor takes the place of the lost one for the required input. */
static void test_a_required_input_gets_a_replacement(void)
{
    const int sensor = limb_add(&limb, 9, "out 5000 2130, signal = sine 0 255 2000, rate_ms = 20");
    swap_run(&limb);
    limb_power_on(&limb, sensor);
    limb_run_ms(&limb, 1000);
    limb_want(&limb, "5.1>2.2 2.3>3.1 2.5>3.2");
    limb_power_off(&limb, D1);
    limb_await(&limb, 2500);
    limb_expect_flow(&limb);
}

/* The same parts give the same links, in whatever order they come within one start-up. */
static void join(const int order[5], uint32_t step_ms, char text[LIMB_TEXT])
{
    for (int i = 0; i < 5; i++) {
        limb_power_on(&limb, order[i]);
        limb_run_ms(&limb, step_ms);
    }
    limb_run_ms(&limb, 1500);
    limb_links(&limb, text);
    limb_expect(&limb, text);
}

static void test_the_order_of_arrival_does_not_matter(void)
{
    int tried = 0;
    char text[LIMB_TEXT];
    for (int number = 0; number < 3125; number++) { /* of five digits, those that are all different */
        const int order[5] = {number % 5, number / 5 % 5, number / 25 % 5, number / 125 % 5, number / 625};
        unsigned seen = 0;
        for (int i = 0; i < 5; i++) {
            seen |= 1u << order[i];
        }
        if (seen != 0x1Fu) {
            continue;
        }
        limb_end(&limb);
        setUp();
        limb.seed = (uint32_t)number;
        (void)limb_add(&limb, 3, SWAP_SENSOR);
        join(order, tried % 3 == 0 ? 0 : 37u * (unsigned)(tried % 3), text);
        TEST_ASSERT_EQUAL_STRING("5.1>2.2 2.3>3.1 2.5>3.2", text);
        tried++;
    }
    TEST_ASSERT_EQUAL(120, tried);
}

/* --- A part that refuses --- */

/* D-PRO-14: Parameter 5 of input 2 cannot be written: what was made for this link is undone, the next
 * candidate is tried. */
static void test_a_refused_link_leads_to_the_next_candidate(void)
{
    const int bad = limb_add_with(&limb, 2, SWAP_CONTROLLER, "[parameter 5 2]\n");
    limb_power_on(&limb, bad); /* it would be the first choice */
    limb_power_on(&limb, SWAP_SPARE);
    limb_power_on(&limb, D1);
    limb_power_on(&limb, D3);
    limb_want(&limb, SWAP_LINKS_SPARE);
    limb_await(&limb, 3000);
    limb_expect_flow(&limb);
    limb_run_ms(&limb, 15000); /* and later tries do no harm */
    limb_expect(&limb, SWAP_LINKS_SPARE);
    for (uint8_t i = 1; i <= 2; i++) {
        TEST_ASSERT_FALSE(
            pdcp_device_source_connected(pdcp_device_source(sim_node_device(limb.parts[bad].node), i)));
    }
}

static void test_a_refused_link_without_another_candidate_leaves_nothing(void)
{
    const int bad = limb_add_with(&limb, 2, SWAP_CONTROLLER, "[parameter 5 1]\n[parameter 5 2]\n");
    limb_power_on(&limb, bad);
    limb_power_on(&limb, D1);
    limb_power_on(&limb, D3);
    limb_run_ms(&limb, 12000);
    limb_expect(&limb, "");
    TEST_ASSERT_FALSE(
        pdcp_device_source_connected(pdcp_device_source(sim_node_device(limb.parts[D3].node), 1)));
}

/* --- The host's links and resets --- */

/* A link by 2307h is left alone, even where an input that it requires has no source. */
static void test_a_link_of_the_host_survives(void)
{
    swap_run(&limb);
    TEST_ASSERT_EQUAL_HEX16(0x2308, limb_link(&limb, 5, 4, 6, 2));
    limb_run_ms(&limb, 500);
    limb_expect(&limb, "1.1>2.2 2.3>3.1 2.4>3.2");
    limb_want(&limb, "2.4>3.2");
    limb_power_off(&limb, D1);
    limb_await(&limb, 2500);
    limb_power_on(&limb, SWAP_SPARE);
    limb_run_ms(&limb, 1000);
    limb_expect(&limb, "2.4>3.2");
    limb_want(&limb, "1.1>2.2 2.3>3.1 2.4>3.2");
    limb_power_on(&limb, D1);
    limb_await(&limb, 2500);
    limb_power_off(&limb, D2); /* its original comes back, too */
    limb_run_ms(&limb, 3000);
    limb_want(&limb, "1.1>2.2 2.3>3.1 2.4>3.2");
    limb_power_on(&limb, D2);
    limb_await(&limb, 2500);
}

/* The number of a part in the order of the host's tables. */
static uint8_t number_of(int part)
{
    for (uint8_t number = 1; number <= 8; number++) {
        TEST_ASSERT_EQUAL_HEX16(0x2205, limb_ask(&limb, 0x2204, &number, 1));
        if (limb.answer[8 + 4] == limb.parts[part].ini->desc.identity.sn) {
            return number;
        }
    }
    TEST_FAIL_MESSAGE("the part is not in the host's tables");
    return 0;
}

/* D-PRO-6: for 3 s a device that the host has reset is not lost. */
static void test_a_reset_by_the_host_is_no_loss(void)
{
    swap_run(&limb);
    limb_power_on(&limb, SWAP_SPARE);
    limb_run_ms(&limb, 1000);
    const uint8_t number = number_of(D2);
    limb_want(&limb, SWAP_LINKS);
    TEST_ASSERT_EQUAL_HEX16(0x230E, limb_ask(&limb, 0x230D, &number, 1));
    limb_links(&limb, limb.wanted);
    TEST_ASSERT_NULL(strstr(limb.wanted, "4."));
    limb_want(&limb, SWAP_LINKS);
    limb_await(&limb, 1000);
    limb_expect_flow(&limb);
}

static void test_a_device_that_stays_away_after_a_reset_is_replaced_after_3_s(void)
{
    swap_run(&limb);
    limb_power_on(&limb, SWAP_SPARE);
    limb_run_ms(&limb, 1000);
    const uint8_t number = number_of(D2);
    limb_want(&limb, SWAP_LINKS_SPARE);
    TEST_ASSERT_EQUAL_HEX16(0x230E, limb_ask(&limb, 0x230D, &number, 1));
    limb_power_off(&limb, D2);
    limb_run_ms(&limb, 2900);
    limb_expect(&limb, "");
    limb_await(&limb, 300);
    limb_expect_flow(&limb);
}

/* --- Two arbitrators --- */

static arb_app_t second;
static arb_port_t second_port;
static sim_nvm_t second_nvm;
static int second_bus_port;

static bool second_send(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    return sim_bus_send(&limb.world.bus, second_bus_port, frame);
}

static size_t second_write(void *ctx, const uint8_t *bytes, size_t size)
{
    (void)ctx;
    (void)bytes;
    return size;
}

static void second_receives(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    (void)ctx;
    (void)time_us;
    arb_app_on_frame(&second, sim_world_ms(&limb.world), frame);
}

static void plug_second(void)
{
    const arb_settings_t settings = {.serial = 7, .no_autoconfig = true};
    sim_nvm_init(&second_nvm);
    sim_nvm_port(&second_nvm, &second_port);
    second_port.can_send = second_send;
    second_port.host_write = second_write;
    arb_app_init(&second, &second_port, &settings, sim_world_ms(&limb.world));
    second_bus_port = sim_bus_attach(&limb.world.bus, second_receives, NULL);
    TEST_ASSERT_GREATER_OR_EQUAL(0, second_bus_port);
}

static void run_both(uint32_t ms)
{
    for (uint32_t i = 0; i < ms; i++) {
        limb_run_ms(&limb, 1);
        (void)arb_app_step(&second, sim_world_ms(&limb.world));
    }
}

static int links_of_second(void)
{
    int count = 0;
    for (int i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = &second.arb.bus.tables.channels[i];
        count += channel->place != PDCP_NONE && channel->link == PDCP_LINK_ACTIVE ? 1 : 0;
    }
    return count;
}

/* The second one keeps its hands off, takes the limb over as it is when the first one is gone, and so
 * back. */
static void test_a_standby_takes_the_limb_over(void)
{
    swap_run(&limb);
    limb_run_ms(&limb, 2000); /* who hears another one in its first 1200 ms falls silent (D-BUS-12) */
    plug_second();
    run_both(3000);
    TEST_ASSERT_TRUE(pdcp_arb_is_on_standby(&second.arb));
    TEST_ASSERT_EQUAL(PROFILE_WAITING, arb_limb_state(&second.limb));
    limb_expect(&limb, SWAP_LINKS);
    limb_stop_arbitrator(&limb);
    run_both(PDCP_SHUT_MS + 5000); /* outputs get no ids before (D-BUS-36) */
    TEST_ASSERT_EQUAL(PROFILE_RUNNING, arb_limb_state(&second.limb));
    TEST_ASSERT_EQUAL(3, links_of_second()); /* read back: it makes up none */
    const int count = limb.parts[D3].received[1];
    run_both(500);
    TEST_ASSERT_GREATER_OR_EQUAL(10, limb.parts[D3].received[1] - count);
    limb_start_arbitrator(&limb);
    run_both(3000);
    TEST_ASSERT_TRUE(pdcp_arb_is_on_standby(&limb.app.arb));
    TEST_ASSERT_EQUAL(PROFILE_WAITING, arb_limb_state(&limb.app.limb));
    TEST_ASSERT_EQUAL(3, links_of_second());
}

/* --- Anything, in any order --- */

/* At rest, is the hand served if it can be, and nothing linked if not? */
static bool is_as_it_should_be(const char *text)
{
    const bool controller = limb.parts[D2].node != NULL || limb.parts[SWAP_SPARE].node != NULL;
    if (limb.parts[D1].node == NULL || !controller) {
        return text[0] == '\0';
    }
    return limb.parts[D3].node == NULL || (strstr(text, "3>3.1") != NULL && strstr(text, "5>3.2") != NULL);
}

/* No two inputs share an output (all want sole access), and no link lacks an input that it requires: both
 * outputs to the hand require input 2 of their device. */
static void expect_lawful(const char *text)
{
    const pdcp_channel_t *channels = limb.app.arb.bus.tables.channels;
    for (int i = 0; i < PDCP_CHANNELS_MAX; i++) {
        for (int k = 0; k < i; k++) {
            TEST_ASSERT_FALSE_MESSAGE(
                channels[i].place != PDCP_NONE && channels[i].link == PDCP_LINK_ACTIVE &&
                    channels[k].place != PDCP_NONE && channels[k].link == PDCP_LINK_ACTIVE &&
                    channels[i].source.channel == channels[k].source.channel,
                text);
        }
    }
    for (int controller = 2; controller <= 4; controller += 2) {
        char wrist[8];
        char source[8];
        (void)snprintf(wrist, sizeof wrist, "%d.3>", controller);
        (void)snprintf(source, sizeof source, ">%d.2", controller);
        TEST_ASSERT_TRUE_MESSAGE(strstr(text, wrist) == NULL || strstr(text, source) != NULL, text);
    }
}

/* Parts come and go at random. Whenever all is at rest, with the originals there, the links are the original
 * ones. */
static void come_and_go(uint32_t parts, uint32_t random)
{
    char text[LIMB_TEXT];
    swap_run(&limb);
    for (int round = 0; round < 2000; round++) {
        random = random * 1664525u + 1013904223u;
        const int part = (int)((random >> 16) % parts);
        if (limb.parts[part].node != NULL) {
            limb_power_off(&limb, part);
        } else {
            limb_power_on(&limb, part);
        }
        if ((random >> 8) % 3u == 0) {
            limb_run_ms(&limb, (random >> 20) % 2000u); /* and the next one before this has been seen to */
            continue;
        }
        limb_run_ms(&limb, 2500 + ((random >> 24) % 8u == 0 ? 12000 : 0));
        limb_links(&limb, text);
        limb_expect(&limb, text);
        expect_lawful(text);
        if (limb.parts[D1].node != NULL && limb.parts[D2].node != NULL && limb.parts[D3].node != NULL) {
            TEST_ASSERT_TRUE_MESSAGE(
                strstr(text, "1.1>2.2") != NULL && strstr(text, "2.3>3.1 2.5>3.2") != NULL, text);
        }
        TEST_ASSERT_TRUE_MESSAGE(parts > 4 || is_as_it_should_be(text), text);
    }
}

static void test_parts_come_and_go(void)
{
    for (uint32_t seed = 1; seed <= SEEDS; seed++) {
        limb_end(&limb);
        setUp();
        come_and_go(4, seed);
    }
}

/* With a second sensor, too. */
static void test_more_parts_come_and_go(void)
{
    for (uint32_t seed = 1; seed <= SEEDS; seed++) {
        limb_end(&limb);
        setUp();
        (void)limb_add(&limb, 9, "out 5000 2130, signal = sine 0 255 2000, rate_ms = 20");
        come_and_go(5, seed);
    }
}

/* --- As many parts as there is room for --- */

/* 16 sensors with four outputs each, 16 hands with four terminal inputs each. */
static void test_32_devices_with_4_channels_each(void)
{
    char text[LIMB_TEXT];
    limb_end(&limb);
    limb_begin(&limb, 2, 0); /* the parts that are plugged in again below bind in their order */
    for (uint16_t i = 0; i < 32; i++) {
        char channels[300] = "";
        int used = 0;
        for (unsigned k = 0; k < 4; k++) {
            used += snprintf(&channels[used], sizeof channels - (size_t)used,
                             i < 16 ? "%sout 5000 1%x%x0, signal = constant 1, rate_ms = 20"
                                    : "%sin 5300 1%x%x0, terminal_profile = 0x1000",
                             k == 0 ? "" : ";", i % 16u, k + 1u);
        }
        limb_power_on(&limb, limb_add(&limb, (uint16_t)(i + 1), channels));
    }
    int used = 0;
    for (int i = 1; i <= 16; i++) {
        for (int k = 1; k <= 4; k++) {
            used += snprintf(&text[used], sizeof text - (size_t)used, "%s%d.%d>%d.%d", used == 0 ? "" : " ",
                             i, k, i + 16, k);
        }
    }
    limb_want(&limb, text);
    limb_await(&limb, 5000);
    (void)printf("64 links of 32 devices: %.1f ms after the last setup, bus time %.1f ms\n",
                 (double)(limb.linked.time_us - limb.ready.time_us) / 1000.0,
                 (double)(limb.linked.busy_us - limb.ready.busy_us) / 1000.0);
    limb_expect_flow(&limb);
    const uint8_t save[] = {ARB_ACTION_SAVE, 0}; /* D-PRO-11: more links than a configuration holds */
    TEST_ASSERT_EQUAL_HEX16(0x2409, limb_ask(&limb, 0x2407, save, sizeof save));
    TEST_ASSERT_EQUAL_HEX8(0x0D, limb.answer[8]);
    TEST_ASSERT_EQUAL(0, limb.app.limb.config.stored);
    limb_want(&limb, text);
    limb_pull(&limb, 0, 3);
    limb_run_ms(&limb, 3000);
    limb_plug(&limb, 0, 3);
    limb_await(&limb, 5000);
    limb_expect_flow(&limb);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_controller_is_back_within_10_s);
    RUN_TEST(test_the_controller_is_back_after_its_ids_were_given_up);
    RUN_TEST(test_the_controller_is_reset_by_itself);
    RUN_TEST(test_a_spare_part_takes_nothing);
    RUN_TEST(test_a_better_part_that_comes_later_takes_nothing);
    RUN_TEST(test_links_rest_while_a_required_input_is_lost);
    RUN_TEST(test_a_required_input_gets_a_replacement);
    RUN_TEST(test_the_order_of_arrival_does_not_matter);
    RUN_TEST(test_a_refused_link_leads_to_the_next_candidate);
    RUN_TEST(test_a_refused_link_without_another_candidate_leaves_nothing);
    RUN_TEST(test_a_link_of_the_host_survives);
    RUN_TEST(test_a_reset_by_the_host_is_no_loss);
    RUN_TEST(test_a_device_that_stays_away_after_a_reset_is_replaced_after_3_s);
    RUN_TEST(test_a_standby_takes_the_limb_over);
    RUN_TEST(test_parts_come_and_go);
    RUN_TEST(test_more_parts_come_and_go);
    RUN_TEST(test_32_devices_with_4_channels_each);
    return UNITY_END();
}
