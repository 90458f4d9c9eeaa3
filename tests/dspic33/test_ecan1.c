/* ECAN1 and its DMA channels: set-up, both directions, errors. Expected values are those of the data sheets'
 * register tables. */
#include <xc.h>

#include "ecan1.h"
#include "fake.h"
#include "part.h"
#include "unity.h"

#if defined(__dsPIC33FJ64MC802__)
enum { DMA0 = 0x0380, DMA1 = 0x038C, PAD = 8, CNT = 10, CANCKS = 1, IEC2_AT = 0x0098, IFS2_AT = 0x0088 };
#else
enum { DMA0 = 0x0B00, DMA1 = 0x0B10, PAD = 12, CNT = 14, CANCKS = 0, IEC2_AT = 0x0824, IFS2_AT = 0x0804 };
#endif

enum { TB = 0x0001, RB = 0x0002, RBOV = 0x0004, FIFO = 0x0008, ERR = 0x0020, WAK = 0x0040, IVR = 0x0080 };
enum { EWARN = 0x0100, RXWAR = 0x0200, TXWAR = 0x0400, RXBP = 0x0800, TXBP = 0x1000, TXBO = 0x2000 };

static hal_can_t *can;

void setUp(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
    can = ecan1_open();
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
}

static void enter_normal_mode(void)
{
    for (int i = 0; i < 10; i++) {
        (void)hal_can_health(can);
    }
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x0400) & 0x00E0);
}

static can_frame_t make(uint16_t id, uint8_t first)
{
    return (can_frame_t){.id = id, .dlc = 8, .data = {first, 2, 3, 4, 5, 6, 7, 8}};
}

static void expect_frame(const can_frame_t *expected, const can_frame_t *actual)
{
    TEST_ASSERT_EQUAL_HEX16(expected->id, actual->id);
    TEST_ASSERT_EQUAL_HEX8(expected->kind, actual->kind);
    TEST_ASSERT_EQUAL_UINT8(expected->dlc, actual->dlc);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected->data, actual->data, 8);
}

/* 40 MHz / 2 / 1 = 20 quanta of 50 ns: 1 + propagation 7 + segment 1 of 7 + segment 2 of 5, jump 4. */
static void test_bit_timing_is_1_mbit_sampled_at_75_percent(void)
{
    TEST_ASSERT_EQUAL_HEX16(0x00C0, fake_peek(0x0410)); /* SJW = 4 - 1, BRP = 0 */
    TEST_ASSERT_EQUAL_HEX16(0x04B6,
                            fake_peek(0x0412)); /* SEG2PH = 4, SEG2PHTS, one sample, SEG1PH = 6, PRSEG = 6 */
    TEST_ASSERT_EQUAL_HEX16(CANCKS << 11, fake_peek(0x0400) & 0x0800);
}

static void test_dma_moves_eight_words_to_where_the_controller_says(void)
{
    TEST_ASSERT_EQUAL_HEX16(0x8020, fake_peek(DMA0));
    TEST_ASSERT_EQUAL_HEX16(0x0022, fake_peek(DMA0 + 2));
    TEST_ASSERT_EQUAL_HEX16(0x0440, fake_peek(DMA0 + PAD));
    TEST_ASSERT_EQUAL_HEX16(7, fake_peek(DMA0 + CNT));
    TEST_ASSERT_EQUAL_HEX16(0xA020, fake_peek(DMA1));
    TEST_ASSERT_EQUAL_HEX16(0x0046, fake_peek(DMA1 + 2));
    TEST_ASSERT_EQUAL_HEX16(0x0442, fake_peek(DMA1 + PAD));
    TEST_ASSERT_EQUAL_HEX16(7, fake_peek(DMA1 + CNT));
    /* One memory of 32 buffers of 16 bytes, aligned to all of it. */
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(DMA0 + 4) & 511);
    TEST_ASSERT_EQUAL_HEX16(fake_peek(DMA0 + 4), fake_peek(DMA1 + 4));
#if defined(__dsPIC33EP512MU810__)
    TEST_ASSERT_EQUAL_HEX16(0x0020, fake_peek(0x0058)); /* DMA before the processor */
#endif
}

static void test_fifo_filters_buffers_and_interrupts(void)
{
    TEST_ASSERT_EQUAL_HEX16(0xC008, fake_peek(0x0406)); /* 32 buffers, FIFO from 8 */
    TEST_ASSERT_EQUAL_HEX16(0x0001, fake_peek(0x0414)); /* filter 0 */
    TEST_ASSERT_EQUAL_HEX16(0x000F, fake_peek(0x1420)); /* into the FIFO */
    TEST_ASSERT_EQUAL_HEX16(0x0000,
                            fake_peek(0x1430)); /* mask 0 compares nothing, not even base or extended */
    TEST_ASSERT_EQUAL_HEX16(0x0000, fake_peek(0x1432));
    TEST_ASSERT_EQUAL_HEX16(0x0083, fake_peek(0x0430)); /* transmit, priorities 3 to 0 */
    TEST_ASSERT_EQUAL_HEX16(0x0082, fake_peek(0x0432));
    TEST_ASSERT_EQUAL_HEX16(0x0081, fake_peek(0x0434));
    TEST_ASSERT_EQUAL_HEX16(0x0080, fake_peek(0x0436));
    TEST_ASSERT_EQUAL_HEX16(TB | RB | RBOV | ERR | IVR, fake_peek(0x040C));
    TEST_ASSERT_EQUAL_HEX16(0x0008, fake_peek(IEC2_AT) & 0x0008);
    TEST_ASSERT_EQUAL_INT(5, IPC8bits.C1IP);
}

static void test_mode_that_is_not_entered_is_waited_for_in_bounds(void)
{
    fake_power_on(false);
    fake_enable_interrupts();
    fake_poke(0x0400, 0); /* normal mode, after a reset that left the controller alone */
    fake.can_mode_delay = FAKE_NEVER;
    can = ecan1_open();
    can_frame_t frame = make(0x101, 1);
    TEST_ASSERT_EQUAL_INT(HAL_CAN_DOWN, hal_can_health(can).state);
    TEST_ASSERT_FALSE(hal_can_send(can, &frame));
    TEST_ASSERT_FALSE(ecan1_has_work(can));
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(IEC2_AT) & 0x0008);
}

static void test_frame_comes_in_through_dma_and_ring(void)
{
    enter_normal_mode();
    const can_frame_t sent = make(0x5A3, 0x11);
    can_frame_t frames[2];
    TEST_ASSERT_FALSE(ecan1_has_work(can));
    TEST_ASSERT_TRUE(fake_can_receive(&sent));
    fake_deliver();
    TEST_ASSERT_TRUE(ecan1_has_work(can));
    TEST_ASSERT_EQUAL_UINT(1, hal_can_receive(can, frames, 2));
    expect_frame(&sent, &frames[0]);
    TEST_ASSERT_EQUAL_UINT(0, hal_can_receive(can, frames, 2));
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x0420) | fake_peek(0x0422));
}

/* As the controller writes them: DLC 9 means 8 bytes. */
static void test_other_kinds_of_frames_come_with_id_0(void)
{
    static const uint16_t words[][8] = {
        {0x0105, 0x0ABC, 0xFC04, 0, 0, 0, 0, 0}, /* extended: IDE */
        {0x0107, 0x0ABC, 0xFE00, 0, 0, 0, 0, 0}, /* extended remote: IDE, SRR, RTR */
        {0x0106, 0x0000, 0x0003, 0, 0, 0, 0, 0}, /* remote: SRR */
        {0x0104, 0x0000, 0x0009, 0x0201, 0, 0, 0x0807, 0}};
    static const uint8_t kinds[] = {CAN_FRAME_EXTENDED, CAN_FRAME_REMOTE, CAN_FRAME_REMOTE, CAN_FRAME_BASE};
    static const uint8_t lengths[] = {4, 0, 3, 8};
    enter_normal_mode();
    for (int i = 0; i < 4; i++) {
        can_frame_t frame;
        TEST_ASSERT_TRUE(fake_can_receive_words(words[i]));
        fake_deliver();
        TEST_ASSERT_EQUAL_UINT(1, hal_can_receive(can, &frame, 1));
        TEST_ASSERT_EQUAL_HEX8(kinds[i], frame.kind);
        TEST_ASSERT_EQUAL_UINT8(lengths[i], frame.dlc);
        TEST_ASSERT_EQUAL_HEX16(i == 3 ? 0x041 : 0, frame.id);
    }
}

static void receive_many(uint16_t count)
{
    for (uint16_t i = 0; i < count; i++) {
        const can_frame_t frame = make(i, (uint8_t)i);
        TEST_ASSERT_TRUE(fake_can_receive(&frame));
        fake_deliver();
    }
}

/* Takes all frames in batches, as the main loop does; they are those with the identifiers 0 to count - 1. */
static void expect_many(uint16_t count)
{
    can_frame_t frames[8];
    uint16_t next = 0;
    while (ecan1_has_work(can)) {
        const size_t n = hal_can_receive(can, frames, 8);
        fake_deliver();
        for (size_t i = 0; i < n; i++) {
            TEST_ASSERT_EQUAL_HEX16(next, frames[i].id);
            TEST_ASSERT_EQUAL_HEX8(next, frames[i].data[0]);
            next++;
        }
    }
    TEST_ASSERT_EQUAL_UINT16(count, next);
}

/* D-MCU-1, D-MCU-5: the ring, 32 frames on the smaller part and 128 on the larger one, then the FIFO with its
 * 24 buffers; each frame beyond is counted. */
static void test_ring_and_fifo_hold_frames_and_count_what_they_lose(void)
{
    const uint16_t held = PART_CAN_RX_PLACES + 24;
    TEST_ASSERT_TRUE(PART_CAN_RX_PLACES >= 32);
    enter_normal_mode();
    receive_many(PART_CAN_RX_PLACES);
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x0420) | fake_peek(0x0422)); /* all in the ring */
    expect_many(PART_CAN_RX_PLACES);
    receive_many(held);
    TEST_ASSERT_EQUAL_UINT32(0, hal_can_health(can).rx_overruns);
    expect_many(held);
    receive_many((uint16_t)(held + 3));
    TEST_ASSERT_EQUAL_UINT32(3, hal_can_health(can).rx_overruns);
    expect_many(held);
    TEST_ASSERT_EQUAL_UINT32(3, hal_can_health(can).rx_overruns);
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x0420) | fake_peek(0x0422));
}

static void test_fifo_keeps_24_frames_while_the_handler_is_off(void)
{
    unsigned int saved;
    enter_normal_mode();
    SET_AND_SAVE_CPU_IPL(saved, 7);
    for (uint16_t i = 0; i < 27; i++) {
        const can_frame_t frame = make(i, (uint8_t)i);
        TEST_ASSERT_TRUE(fake_can_receive(&frame));
    }
    RESTORE_CPU_IPL(saved);
    fake_deliver();
    expect_many(24);
    /* Three frames met the same full buffer, which shows once. */
    TEST_ASSERT_EQUAL_UINT32(1, hal_can_health(can).rx_overruns);
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x0428) | fake_peek(0x042A));
    receive_many(1);
    expect_many(1);
}

static void test_fifo_is_drained_when_its_pointer_is_off(void)
{
    enter_normal_mode();
    unsigned int saved;
    SET_AND_SAVE_CPU_IPL(saved, 7);
    const can_frame_t frame = make(0x055, 1);
    TEST_ASSERT_TRUE(fake_can_receive(&frame));
    fake_poke(0x0408, (fake_peek(0x0408) & 0xFF00) | 20);
    RESTORE_CPU_IPL(saved);
    fake_deliver();
    can_frame_t received;
    TEST_ASSERT_EQUAL_UINT(1, hal_can_receive(can, &received, 1));
    TEST_ASSERT_EQUAL_HEX16(0x055, received.id);
}

static void test_frame_that_dma_put_elsewhere_counts_as_lost(void)
{
    enter_normal_mode();
    receive_many(24); /* each buffer has held a frame: what it held does not count again */
    expect_many(24);
    fake.can_misplaces = true;
    const can_frame_t frame = make(0x055, 1);
    TEST_ASSERT_TRUE(fake_can_receive(&frame));
    fake_deliver();
    can_frame_t received;
    TEST_ASSERT_EQUAL_UINT(0, hal_can_receive(can, &received, 1));
    TEST_ASSERT_EQUAL_UINT32(1, hal_can_health(can).rx_overruns);
}

static void test_flags_of_frames_that_come_meanwhile_are_not_cleared(void)
{
    enter_normal_mode();
    const can_frame_t frame = make(0x055, 1);
    TEST_ASSERT_TRUE(fake_can_receive(&frame));
    fake_poke(0x0420, fake_peek(0x0420) | 0x0003); /* not the FIFO's */
    fake_deliver();
    TEST_ASSERT_EQUAL_HEX16(0x0003, fake_peek(0x0420));
}

/* This target has no filters: everything is accepted. */
static void test_filters_accept_everything(void)
{
    static const hal_can_filter_t filter = {0x100, 0x7FF};
    enter_normal_mode();
    hal_can_set_filters(can, &filter, 1);
    const can_frame_t frame = make(0x123, 0);
    can_frame_t received;
    TEST_ASSERT_TRUE(fake_can_receive(&frame));
    fake_deliver();
    TEST_ASSERT_EQUAL_UINT(1, hal_can_receive(can, &received, 1));
}

static void test_frame_goes_out_through_dma(void)
{
    const can_frame_t frame = make(0x2A5, 0x77);
    can_frame_t sent;
    enter_normal_mode();
    TEST_ASSERT_TRUE(hal_can_send(can, &frame));
    TEST_ASSERT_TRUE(fake_can_transmit(&sent));
    expect_frame(&frame, &sent);
    TEST_ASSERT_FALSE(fake_can_transmit(&sent));
}

static void test_urgent_frame_overtakes_all_that_wait(void)
{
    static const uint16_t ids[] = {0x601, 0x401, 0x402, 0x201, 0x001};
    static const uint16_t order[] = {0x001, 0x201, 0x401, 0x402, 0x601};
    enter_normal_mode();
    for (int i = 0; i < 5; i++) {
        const can_frame_t frame = make(ids[i], 0);
        TEST_ASSERT_TRUE(hal_can_send(can, &frame));
    }
    for (int i = 0; i < 5; i++) {
        can_frame_t sent;
        TEST_ASSERT_TRUE(fake_can_transmit(&sent));
        TEST_ASSERT_EQUAL_HEX16(order[i], sent.id);
    }
}

static void test_frames_of_one_priority_keep_their_order(void)
{
    enter_normal_mode();
    uint16_t next = 0x300;
    for (uint16_t id = 0x300; id < 0x30C; id++) {
        const can_frame_t frame = make((uint16_t)(0x60C - id), (uint8_t)id);
        can_frame_t sent;
        while (!hal_can_send(can, &frame)) {
            TEST_ASSERT_TRUE(fake_can_transmit(&sent));
            TEST_ASSERT_EQUAL_HEX16(0x60C - next++, sent.id);
        }
    }
    can_frame_t sent;
    while (fake_can_transmit(&sent)) {
        TEST_ASSERT_EQUAL_HEX16(0x60C - next++, sent.id);
    }
    TEST_ASSERT_EQUAL_HEX16(0x30C, next);
}

static void test_room_is_work_only_after_a_refusal(void)
{
    can_frame_t sent;
    enter_normal_mode();
    for (int i = 0; i < 4; i++) {
        const can_frame_t frame = make(0x001, (uint8_t)i);
        TEST_ASSERT_TRUE(hal_can_send(can, &frame));
    }
    const can_frame_t fifth = make(0x001, 4);
    const can_frame_t other = make(0x201, 5);
    TEST_ASSERT_TRUE(hal_can_send(can, &other)); /* another priority has room */
    TEST_ASSERT_FALSE(ecan1_has_work(can));
    TEST_ASSERT_FALSE(hal_can_send(can, &fifth));
    TEST_ASSERT_FALSE(ecan1_has_work(can));
    TEST_ASSERT_TRUE(fake_can_transmit(&sent));
    TEST_ASSERT_TRUE(ecan1_has_work(can));
    TEST_ASSERT_TRUE(hal_can_send(can, &fifth));
    TEST_ASSERT_FALSE(ecan1_has_work(can));
}

static void test_error_passive_either_way(void)
{
    enter_normal_mode();
    fake_can_error(RXBP | EWARN | RXWAR, 0, 130, ERR);
    hal_can_health_t health = hal_can_health(can);
    TEST_ASSERT_EQUAL_INT(HAL_CAN_PASSIVE, health.state);
    TEST_ASSERT_EQUAL_UINT8(130, health.rx_errors);
    TEST_ASSERT_EQUAL_UINT8(0, health.tx_errors);
    fake_can_error(TXBP | EWARN | TXWAR, 200, 0, ERR);
    health = hal_can_health(can);
    TEST_ASSERT_EQUAL_INT(HAL_CAN_PASSIVE, health.state);
    TEST_ASSERT_EQUAL_UINT8(200, health.tx_errors);
    fake_can_error(EWARN | TXWAR, 100, 0, ERR);
    TEST_ASSERT_EQUAL_INT(HAL_CAN_ACTIVE, hal_can_health(can).state);
    TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x040A) & 0x00FF);
}

static void test_bus_off_drops_what_waits_and_stays_off_until_the_restart(void)
{
    can_frame_t sent;
    enter_normal_mode();
    for (unsigned i = 0; i < 4; i++) { /* one of each priority */
        const can_frame_t frame = make((uint16_t)(i << 9 | 1u), (uint8_t)i);
        TEST_ASSERT_TRUE(hal_can_send(can, &frame));
    }
    fake_can_error(TXBO | TXBP | EWARN | TXWAR, 255, 0, ERR);
    hal_can_health_t health = hal_can_health(can);
    TEST_ASSERT_EQUAL_INT(HAL_CAN_BUS_OFF, health.state);
    TEST_ASSERT_EQUAL_UINT32(4, health.tx_failed);
    TEST_ASSERT_EQUAL_HEX16(0x0100, fake_peek(0x0400) & 0x0700); /* disabled, counters kept */
    for (uint16_t at = 0x0430; at <= 0x0436; at += 2) {
        TEST_ASSERT_EQUAL_HEX16(0, fake_peek(at) & 0x0808);
    }
    const can_frame_t late = make(0x001, 9);
    TEST_ASSERT_FALSE(hal_can_send(can, &late));
    TEST_ASSERT_FALSE(ecan1_has_work(can));
    hal_can_restart(can);
    TEST_ASSERT_EQUAL_HEX16(0x0000, fake_peek(0x0400) & 0x0700);
    TEST_ASSERT_EQUAL_INT(HAL_CAN_BUS_OFF, hal_can_health(can).state); /* until 128 x 11 bits have passed */
    enter_normal_mode();
    fake_can_error(0, 0, 0, 0);
    TEST_ASSERT_EQUAL_INT(HAL_CAN_ACTIVE, hal_can_health(can).state);
    TEST_ASSERT_TRUE(hal_can_send(can, &late));
    TEST_ASSERT_TRUE(fake_can_transmit(&sent));
    TEST_ASSERT_EQUAL_HEX8(9, sent.data[0]);
    TEST_ASSERT_FALSE(fake_can_transmit(&sent));
}

static void test_restart_without_bus_off_does_nothing(void)
{
    enter_normal_mode();
    const uint16_t before = fake_peek(0x0400);
    hal_can_restart(can);
    TEST_ASSERT_EQUAL_HEX16(before, fake_peek(0x0400));
}

static void test_invalid_messages_come_as_error_frames(void)
{
    enter_normal_mode();
    fake_can_error(0, 0, 1, IVR);
    fake_can_error(0, 0, 2, IVR);
    TEST_ASSERT_TRUE(ecan1_has_work(can));
    can_frame_t frames[4];
    TEST_ASSERT_EQUAL_UINT(2, hal_can_receive(can, frames, 4));
    TEST_ASSERT_EQUAL_HEX8(CAN_FRAME_ERROR, frames[0].kind);
    TEST_ASSERT_EQUAL_HEX16(0, frames[0].id);
    TEST_ASSERT_FALSE(ecan1_has_work(can));
}

static void test_flood_of_invalid_messages_stays_countable(void)
{
    enter_normal_mode();
    for (int i = 0; i < 1000; i++) {
        fake_can_error(0, 0, 1, IVR);
    }
    can_frame_t frames[4];
    unsigned count = 0;
    for (size_t n = 4; n == 4; count += (unsigned)n) {
        n = hal_can_receive(can, frames, 4);
    }
    TEST_ASSERT_EQUAL_UINT(255, count);
}

/* The events that are not asked for leave no flag behind when another one comes. */
static void test_every_event_flag_is_cleared(void)
{
    static const uint16_t events[] = {TB, RB, RBOV, FIFO, ERR, WAK, IVR};
    enter_normal_mode();
    for (size_t i = 0; i < sizeof events / sizeof events[0]; i++) {
        fake_can_error(0, 0, 0, (uint16_t)(events[i] | TB));
        TEST_ASSERT_EQUAL_HEX16(0, fake_peek(0x040A) & 0x00FF);
        TEST_ASSERT_EQUAL_HEX16(0, fake_peek(IFS2_AT) & 0x0008);
    }
}

static unsigned accesses_left;

/* A frame meets a full buffer. */
static void overflow_at_access(void)
{
    if (accesses_left-- == 0) {
        fake_poke(0x0428, 0x0100);
        fake_poke(0x040A, fake_peek(0x040A) | RBOV);
        fake_poke(IFS2_AT, fake_peek(IFS2_AT) | 0x0008);
    }
}

static void test_event_that_comes_while_the_handler_runs_is_not_lost(void)
{
    for (unsigned access = 0; access < 30; access++) {
        setUp();
        enter_normal_mode();
        accesses_left = access;
        fake.on_access = overflow_at_access;
        fake_can_error(0, 0, 1, IVR);
        for (int i = 0; i < 30; i++) {
            (void)hal_can_health(can);
        }
        fake.on_access = NULL;
        TEST_ASSERT_EQUAL_UINT32(1, hal_can_health(can).rx_overruns);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bit_timing_is_1_mbit_sampled_at_75_percent);
    RUN_TEST(test_dma_moves_eight_words_to_where_the_controller_says);
    RUN_TEST(test_fifo_filters_buffers_and_interrupts);
    RUN_TEST(test_mode_that_is_not_entered_is_waited_for_in_bounds);
    RUN_TEST(test_frame_comes_in_through_dma_and_ring);
    RUN_TEST(test_other_kinds_of_frames_come_with_id_0);
    RUN_TEST(test_ring_and_fifo_hold_frames_and_count_what_they_lose);
    RUN_TEST(test_fifo_keeps_24_frames_while_the_handler_is_off);
    RUN_TEST(test_fifo_is_drained_when_its_pointer_is_off);
    RUN_TEST(test_frame_that_dma_put_elsewhere_counts_as_lost);
    RUN_TEST(test_flags_of_frames_that_come_meanwhile_are_not_cleared);
    RUN_TEST(test_filters_accept_everything);
    RUN_TEST(test_frame_goes_out_through_dma);
    RUN_TEST(test_urgent_frame_overtakes_all_that_wait);
    RUN_TEST(test_frames_of_one_priority_keep_their_order);
    RUN_TEST(test_room_is_work_only_after_a_refusal);
    RUN_TEST(test_error_passive_either_way);
    RUN_TEST(test_bus_off_drops_what_waits_and_stays_off_until_the_restart);
    RUN_TEST(test_restart_without_bus_off_does_nothing);
    RUN_TEST(test_invalid_messages_come_as_error_frames);
    RUN_TEST(test_flood_of_invalid_messages_stays_countable);
    RUN_TEST(test_every_event_flag_is_cleared);
    RUN_TEST(test_event_that_comes_while_the_handler_runs_is_not_lost);
    return UNITY_END();
}
