/* SocketCAN on a virtual interface of the kernel's own; the other end is a plain raw socket. Needs root, the
 * program ip and a kernel with vcan, and is skipped (exit status 77) where they are missing. */
#define _GNU_SOURCE
#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "linux_can.h"
#include "looped.h"
#include "unity.h"

#define IFACE "pdcptest0"
#define BUS "socketcan:" IFACE
#define FRAMES_MAX 8192u
#define EXIT_SKIPPED 77

static const char *lack; /* NULL: everything is there */
static char error[200];
static loop_t *loop;
static hal_can_t *can;
static int peer;
static can_frame_t received[FRAMES_MAX];
static size_t received_n;
static size_t room; /* frames taken by one call of hal_can_receive */
static int ready_calls;
static int refused_by_down; /* refusals of send_numbered with the bus down */
static unsigned sent_n;     /* by send_numbered */
static unsigned to_send;

static void shell(const char *command)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, system(command), command);
}

static bool shell_works(const char *command)
{
    return system(command) == 0;
}

/* Frames with their number as identifier and data, as long as they are taken. */
static void send_numbered(void)
{
    while (sent_n < to_send) {
        can_frame_t frame = {
            .id = (uint16_t)(sent_n & 0x7FF), .dlc = 2, .data = {(uint8_t)(sent_n >> 8), (uint8_t)sent_n}};
        if (!hal_can_send(can, &frame)) {
            refused_by_down += hal_can_health(can).state == HAL_CAN_DOWN ? 1 : 0;
            return;
        }
        sent_n++;
    }
}

static void on_ready(void *ctx)
{
    (void)ctx;
    ready_calls++;
    size_t n;
    do {
        size_t wanted = room < FRAMES_MAX - received_n ? room : FRAMES_MAX - received_n;
        n = hal_can_receive(can, received + received_n, wanted);
        received_n += n;
    } while (n == room);
    send_numbered();
}

/* An ordinary raw socket on the interface that may send FD frames. */
static int open_peer(void)
{
    int fd = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    int on = 1;
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(IFACE)};
    TEST_ASSERT_EQUAL_INT(0, setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on));
    TEST_ASSERT_EQUAL_INT(0, bind(fd, (const struct sockaddr *)&address, sizeof address));
    return fd;
}

void setUp(void)
{
    if (lack != NULL) {
        TEST_IGNORE_MESSAGE(lack);
    }
    shell("ip link add dev " IFACE " type vcan && ip link set " IFACE " up");
    loop = loop_create();
    can = NULL;
    received_n = 0;
    room = 32;
    ready_calls = 0;
    refused_by_down = 0;
    sent_n = 0;
    to_send = 0;
    peer = open_peer();
}

static void open_can(void)
{
    can = linux_can_open(loop, BUS, on_ready, NULL, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(can, error);
}

void tearDown(void)
{
    if (lack != NULL) {
        return;
    }
    linux_can_close(can);
    loop_destroy(loop);
    close(peer);
    shell_works("ip link del " IFACE " 2>/dev/null");
}

static void peer_sends(uint32_t id, uint8_t size, const char *data)
{
    struct can_frame frame = {.can_id = id, .can_dlc = size};
    memcpy(frame.data, data, strlen(data) < 8 ? strlen(data) : 8);
    TEST_ASSERT_EQUAL_INT(sizeof frame, send(peer, &frame, sizeof frame, 0));
}

static void peer_sends_fd(uint32_t id, uint8_t size)
{
    struct canfd_frame frame = {.can_id = id, .len = size, .data = "0123456789"};
    TEST_ASSERT_EQUAL_INT(sizeof frame, send(peer, &frame, sizeof frame, 0));
}

static void expect_frame(size_t i, can_frame_kind_t kind, uint16_t id, uint8_t dlc, const char *data)
{
    TEST_ASSERT_EQUAL_INT(kind, received[i].kind);
    TEST_ASSERT_EQUAL_HEX16(id, received[i].id);
    TEST_ASSERT_EQUAL_UINT8(dlc, received[i].dlc);
    TEST_ASSERT_EQUAL_STRING_LEN(data, (const char *)received[i].data, strlen(data));
}

static void expect_at_peer(uint32_t id, uint8_t size, const char *data)
{
    struct can_frame frame;
    struct pollfd watched = {.fd = peer, .events = POLLIN};
    TEST_ASSERT_EQUAL_INT(1, poll(&watched, 1, 2000));
    TEST_ASSERT_EQUAL_INT(sizeof frame, recv(peer, &frame, sizeof frame, MSG_TRUNC));
    TEST_ASSERT_EQUAL_HEX32(id, frame.can_id);
    TEST_ASSERT_EQUAL_UINT8(size, frame.can_dlc);
    TEST_ASSERT_EQUAL_MEMORY(data, frame.data, size);
}

static void expect_silence_at_peer(void)
{
    char bytes[CANFD_MTU];
    TEST_ASSERT_EQUAL_INT(-1, recv(peer, bytes, sizeof bytes, MSG_DONTWAIT));
    TEST_ASSERT_EQUAL_INT(EAGAIN, errno);
}

static void expect_refused(const char *bus, const char *expected)
{
    TEST_ASSERT_NULL(linux_can_open(loop, bus, on_ready, NULL, error, sizeof error));
    TEST_ASSERT_EQUAL_STRING(expected, error);
}

static void test_buses_that_cannot_be_opened_are_refused_by_name(void)
{
    expect_refused("socketcan:nosuch0", "socketcan:nosuch0: no such network interface");
    expect_refused("socketcan:", "socketcan:: no such network interface");
    expect_refused("socketcan:much-too-long-a-name",
                   "socketcan:much-too-long-a-name: no such network interface");
    expect_refused("socketcan:lo", "socketcan:lo: not a CAN interface");
    expect_refused("vcan0", "vcan0: not a CAN bus; expected one of " LINUX_CAN_CHOICES);
}

static void test_frames_pass_in_both_directions_and_own_ones_do_not_return(void)
{
    open_can();
    TEST_ASSERT_EQUAL_INT(HAL_CAN_ACTIVE, hal_can_health(can).state);
    peer_sends(0x123, 3, "abc");
    peer_sends(0x7FF, 0, "");
    peer_sends(0, 8, "12345678");
    looped_until(loop, &received_n, 3);
    expect_frame(0, CAN_FRAME_BASE, 0x123, 3, "abc");
    expect_frame(1, CAN_FRAME_BASE, 0x7FF, 0, "");
    expect_frame(2, CAN_FRAME_BASE, 0, 8, "12345678");
    can_frame_t frame = {.id = 0x456, .dlc = 2, .data = "xy"};
    TEST_ASSERT_TRUE(hal_can_send(can, &frame));
    expect_at_peer(0x456, 2, "xy");
    looped_settle(loop, 20000);
    TEST_ASSERT_EQUAL_UINT(3, received_n);
}

/* One of each kind. */
static void peer_sends_other_kinds(void)
{
    peer_sends(0x123u | CAN_EFF_FLAG, 1, "e");
    peer_sends(0x123u | CAN_RTR_FLAG, 4, "");
    peer_sends(0x1ABCDEFFu | CAN_EFF_FLAG | CAN_RTR_FLAG, 0, "");
    peer_sends_fd(0x123, 5);
    peer_sends_fd(0x1ABCDEFFu | CAN_EFF_FLAG, 64);
    peer_sends(CAN_ERR_FLAG | CAN_ERR_PROT, CAN_ERR_DLC, "");
}

static void expect_other_kinds(size_t at)
{
    expect_frame(at, CAN_FRAME_EXTENDED, 0, 1, "e");
    expect_frame(at + 1, CAN_FRAME_REMOTE, 0, 4, "");
    expect_frame(at + 2, CAN_FRAME_REMOTE, 0, 0, "");
    expect_frame(at + 3, CAN_FRAME_FD, 0, 5, "01234");
    expect_frame(at + 4, CAN_FRAME_FD, 0, 8, "01234567");
    expect_frame(at + 5, CAN_FRAME_ERROR, 0, CAN_ERR_DLC, "");
}

static void test_other_kinds_are_reported_as_such(void)
{
    open_can();
    peer_sends_other_kinds();
    looped_until(loop, &received_n, 6);
    expect_other_kinds(0);
}

static void test_filters_pass_what_matches_and_all_other_kinds(void)
{
    const hal_can_filter_t filters[] = {{.id = 0x100, .mask = 0x700}, {.id = 0x0FF, .mask = 0x7FF}};
    open_can();
    hal_can_set_filters(can, filters, 2);
    peer_sends(0x0FE, 0, "");
    peer_sends(0x0FF, 0, "");
    peer_sends(0x100, 0, "");
    peer_sends(0x1FF, 0, "");
    peer_sends(0x200, 0, "");
    peer_sends(0x500, 0, "");
    peer_sends_other_kinds();
    looped_until(loop, &received_n, 9);
    looped_settle(loop, 20000);
    TEST_ASSERT_EQUAL_UINT(9, received_n);
    expect_frame(0, CAN_FRAME_BASE, 0x0FF, 0, "");
    expect_frame(1, CAN_FRAME_BASE, 0x100, 0, "");
    expect_frame(2, CAN_FRAME_BASE, 0x1FF, 0, "");
    expect_other_kinds(3);
    TEST_ASSERT_EQUAL_UINT32(0, hal_can_health(can).rx_overruns);
}

static void test_no_filters_and_too_many_filters_pass_everything(void)
{
    hal_can_filter_t filters[65];
    for (size_t i = 0; i < 65; i++) {
        filters[i] = (hal_can_filter_t){.id = 0x111, .mask = 0x7FF};
    }
    open_can();
    hal_can_set_filters(can, filters, 64);
    peer_sends(0x222, 0, "");
    peer_sends(0x111, 0, "");
    looped_until(loop, &received_n, 1);
    hal_can_set_filters(can, NULL, 0);
    peer_sends(0x333, 0, "");
    looped_until(loop, &received_n, 2);
    hal_can_set_filters(can, filters, 65);
    peer_sends(0x444, 0, "");
    looped_until(loop, &received_n, 3);
    TEST_ASSERT_EQUAL_HEX16(0x111, received[0].id);
    TEST_ASSERT_EQUAL_HEX16(0x333, received[1].id);
    TEST_ASSERT_EQUAL_HEX16(0x444, received[2].id);
}

static void peer_sends_error(uint32_t class, uint8_t controller, uint8_t tx, uint8_t rx)
{
    struct can_frame frame = {
        .can_id = CAN_ERR_FLAG | class, .can_dlc = CAN_ERR_DLC, .data = {1, controller, 1, 1, 1, 1, tx, rx}};
    size_t before = received_n;
    TEST_ASSERT_EQUAL_INT(sizeof frame, send(peer, &frame, sizeof frame, 0));
    looped_until(loop, &received_n, before + 1);
    TEST_ASSERT_EQUAL_INT(CAN_FRAME_ERROR, received[before].kind);
}

static void expect_health(hal_can_state_t state, uint8_t tx_errors, uint8_t rx_errors)
{
    hal_can_health_t health = hal_can_health(can);
    TEST_ASSERT_EQUAL_INT(state, health.state);
    TEST_ASSERT_EQUAL_UINT8(tx_errors, health.tx_errors);
    TEST_ASSERT_EQUAL_UINT8(rx_errors, health.rx_errors);
}

static void test_error_frames_tell_the_health(void)
{
    open_can();
    expect_health(HAL_CAN_ACTIVE, 0, 0);
    peer_sends_error(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE, 130, 5);
    expect_health(HAL_CAN_PASSIVE, 130, 5);
    peer_sends_error(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING, 100, 6);
    expect_health(HAL_CAN_ACTIVE, 100, 6);
    peer_sends_error(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE, 7, 128);
    expect_health(HAL_CAN_PASSIVE, 7, 128);
    peer_sends_error(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE, 8, 20);
    expect_health(HAL_CAN_ACTIVE, 8, 20);
    peer_sends_error(CAN_ERR_ACK | CAN_ERR_CNT, 0, 9, 21);
    expect_health(HAL_CAN_ACTIVE, 9, 21);
    peer_sends_error(CAN_ERR_BUSOFF, 0, 0, 0);
    expect_health(HAL_CAN_BUS_OFF, 9, 21);
    hal_can_restart(can); /* without a controller the kernel refuses; nothing else happens */
    peer_sends_error(CAN_ERR_RESTARTED, 0, 0, 0);
    expect_health(HAL_CAN_ACTIVE, 0, 0);
}

static void test_error_frames_tell_of_lost_frames(void)
{
    open_can();
    peer_sends_error(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW, 0, 0);
    peer_sends_error(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_OVERFLOW, 0, 0);
    peer_sends_error(CAN_ERR_TX_TIMEOUT, 0, 0, 0);
    TEST_ASSERT_EQUAL_UINT32(1, hal_can_health(can).rx_overruns);
    TEST_ASSERT_EQUAL_UINT32(2, hal_can_health(can).tx_failed);
}

static void peer_sends_numbered(unsigned n)
{
    for (unsigned i = 0; i < n; i++) {
        char number[8];
        snprintf(number, sizeof number, "%04u", i % 10000u);
        peer_sends(i & 0x7FF, 4, number);
    }
}

static void expect_numbered(unsigned n)
{
    for (unsigned i = 0; i < n; i++) {
        char number[8];
        snprintf(number, sizeof number, "%04u", i % 10000u);
        expect_frame(i, CAN_FRAME_BASE, (uint16_t)(i & 0x7FF), 4, number);
    }
}

static void test_batches_come_complete_and_in_order(void)
{
    const size_t rooms[] = {1, 5, 31, 32, 33, 100};
    open_can();
    for (size_t i = 0; i < 6; i++) {
        room = rooms[i];
        received_n = 0;
        peer_sends_numbered(100);
        looped_until(loop, &received_n, 100);
        expect_numbered(100);
    }
}

static void test_burst_is_one_round_and_a_single_frame_one_call(void)
{
    open_can();
    looped_settle(loop, 20000);
    ready_calls = 0;
    peer_sends_numbered(100);
    looped_until(loop, &received_n, 100);
    TEST_ASSERT_LESS_OR_EQUAL_INT(4, ready_calls);
    looped_settle(loop, 20000);
    ready_calls = 0;
    peer_sends(1, 0, "");
    looped_settle(loop, 20000);
    TEST_ASSERT_EQUAL_INT(1, ready_calls);
    TEST_ASSERT_EQUAL_UINT(101, received_n);
}

static void take_two(void *ctx)
{
    (void)ctx;
    ready_calls++;
    received_n += hal_can_receive(can, received + received_n, 2);
}

static void test_caller_that_takes_a_few_at_a_time_is_called_again(void)
{
    can = linux_can_open(loop, BUS, take_two, NULL, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(can, error);
    peer_sends_numbered(9);
    looped_until(loop, &received_n, 9);
    expect_numbered(9);
    looped_settle(loop, 20000);
    int calls = ready_calls;
    looped_settle(loop, 20000);
    TEST_ASSERT_EQUAL_INT(calls, ready_calls);
}

static void test_overrun_of_the_socket_is_counted(void)
{
    open_can();
    peer_sends_numbered(8000);
    looped_settle(loop, 50000);
    uint32_t overruns = hal_can_health(can).rx_overruns;
    TEST_ASSERT_GREATER_THAN_UINT32(0, overruns);
    TEST_ASSERT_EQUAL_UINT32(8000, received_n + overruns);
    peer_sends(1, 0, "");
    looped_settle(loop, 20000);
    TEST_ASSERT_EQUAL_UINT32(overruns, hal_can_health(can).rx_overruns);
}

/* Sends n frames through the queue that is set up and expects each one at the peer, in order. */
static void expect_all_sent(unsigned n)
{
    to_send = n;
    sent_n = 0;
    uint64_t end_us = loop_refresh_now_us(loop) + LOOPED_LIMIT_US;
    loop_set_deadline_us(loop, end_us);
    send_numbered();
    TEST_ASSERT_LESS_THAN_UINT(n, sent_n); /* else this test shows nothing */
    while (sent_n < n && loop_now_us(loop) < end_us) {
        TEST_ASSERT_TRUE(loop_run_once(loop));
    }
    TEST_ASSERT_EQUAL_UINT(n, sent_n);
    for (unsigned i = 0; i < n; i++) {
        const char data[2] = {(char)(i >> 8), (char)i};
        expect_at_peer(i & 0x7FF, 2, data);
    }
    expect_silence_at_peer();
    TEST_ASSERT_EQUAL_INT(0, refused_by_down);
    TEST_ASSERT_EQUAL_UINT32(0, hal_can_health(can).tx_failed);
}

static void test_full_queue_of_the_interface_delays_but_loses_nothing(void)
{
    shell("tc qdisc add dev " IFACE " root netem delay 5ms limit 3");
    open_can();
    expect_all_sent(200);
    /* One try a millisecond at the most, no spinning: 200 frames, three in 5 ms, take 330 ms. */
    TEST_ASSERT_LESS_THAN_INT(1500, ready_calls);
}

static void test_full_socket_buffer_delays_but_loses_nothing(void)
{
    shell("tc qdisc add dev " IFACE " root tbf rate 16kbit burst 200 limit 100000");
    open_can();
    expect_all_sent(100);
    /* The kernel reports room: trying again every millisecond would have taken some 800 calls. */
    TEST_ASSERT_LESS_THAN_INT(100, ready_calls);
}

static void test_send_is_refused_without_a_call_until_there_is_room(void)
{
    shell("tc qdisc add dev " IFACE " root netem delay 100ms limit 1");
    open_can();
    can_frame_t frame = {.id = 1};
    TEST_ASSERT_TRUE(hal_can_send(can, &frame));
    TEST_ASSERT_FALSE(hal_can_send(can, &frame));
    TEST_ASSERT_FALSE(hal_can_send(can, &frame));
    TEST_ASSERT_EQUAL_INT(0, ready_calls);
    looped_settle(loop, 20000);
    TEST_ASSERT_GREATER_THAN_INT(0, ready_calls);
}

static void expect_working(void)
{
    received_n = 0;
    close(peer);
    peer = open_peer();
    peer_sends(0x321, 2, "ok");
    looped_until(loop, &received_n, 1);
    expect_frame(0, CAN_FRAME_BASE, 0x321, 2, "ok");
    can_frame_t frame = {.id = 0x42, .dlc = 1, .data = "z"};
    TEST_ASSERT_TRUE(hal_can_send(can, &frame));
    expect_at_peer(0x42, 1, "z");
}

/* The bus is down, is reported so, refuses frames and costs nothing. */
static void expect_down(void)
{
    int calls = ready_calls;
    looped_until_state(loop, can, HAL_CAN_DOWN);
    looped_settle(loop, 30000);
    TEST_ASSERT_GREATER_THAN_INT(calls, ready_calls);
    calls = ready_calls;
    can_frame_t frame = {.id = 1};
    TEST_ASSERT_FALSE(hal_can_send(can, &frame));
    TEST_ASSERT_EQUAL_UINT(0, hal_can_receive(can, received, 1));
    TEST_ASSERT_LESS_OR_EQUAL_INT(3, looped_settle(loop, 100000));
    TEST_ASSERT_EQUAL_INT(calls, ready_calls);
}

static void test_interface_goes_down_and_up(void)
{
    open_can();
    expect_working();
    shell("ip link set " IFACE " down");
    expect_down();
    int calls = ready_calls;
    shell("ip link set " IFACE " up");
    looped_until_state(loop, can, HAL_CAN_ACTIVE);
    TEST_ASSERT_GREATER_THAN_INT(calls, ready_calls);
    expect_working();
}

static void test_interface_is_deleted_and_made_again(void)
{
    open_can();
    for (int i = 0; i < 2; i++) {
        shell("ip link del " IFACE);
        expect_down();
        shell("ip link add dev " IFACE " type vcan");
        looped_settle(loop, 20000);
        TEST_ASSERT_EQUAL_INT(HAL_CAN_DOWN, hal_can_health(can).state);
        shell("ip link set " IFACE " up");
        looped_until_state(loop, can, HAL_CAN_ACTIVE);
        expect_working();
    }
}

static void test_interface_that_changes_unseen_works_again(void)
{
    const char *const changes[] = {
        "ip link set " IFACE " down && ip link set " IFACE " up",
        "ip link del " IFACE " && ip link add dev " IFACE " type vcan && ip link set " IFACE " up",
        "ip link del " IFACE " && ip link add dev " IFACE " index 777 type vcan && ip link set " IFACE " up",
        "ip link del " IFACE " && ip link add dev " IFACE " index 777 type vcan && ip link set " IFACE " up"};
    open_can();
    for (size_t i = 0; i < 4; i++) {
        shell(changes[i]);
        looped_settle(loop, 50000);
        TEST_ASSERT_EQUAL_INT(HAL_CAN_ACTIVE, hal_can_health(can).state);
        expect_working();
    }
}

static void test_send_that_meets_the_change_first_recovers(void)
{
    const char *const changes[] = {"ip link set " IFACE " down && ip link set " IFACE " up",
                                   "ip link del " IFACE " && ip link add dev " IFACE
                                   " type vcan && ip link set " IFACE " up"};
    can_frame_t frame = {.id = 1};
    open_can();
    for (size_t i = 0; i < 2; i++) {
        shell(changes[i]);
        TEST_ASSERT_FALSE(hal_can_send(can, &frame));
        TEST_ASSERT_EQUAL_INT(HAL_CAN_DOWN, hal_can_health(can).state);
        looped_until_state(loop, can, HAL_CAN_ACTIVE);
        expect_working();
    }
}

static void test_frames_before_the_end_are_still_read(void)
{
    const char *const ends[] = {"ip link set " IFACE " down", "ip link del " IFACE};
    for (size_t i = 0; i < 2; i++) {
        open_can();
        looped_settle(loop, 20000);
        received_n = 0;
        peer_sends_numbered(40);
        shell(ends[i]);
        looped_until_state(loop, can, HAL_CAN_DOWN);
        TEST_ASSERT_EQUAL_UINT(40, received_n);
        expect_numbered(40);
        linux_can_close(can);
        can = NULL;
        if (i == 0) {
            shell("ip link set " IFACE " up");
            close(peer);
            peer = open_peer();
        }
    }
}

static void test_filters_stay_when_the_interface_returns(void)
{
    const hal_can_filter_t filter = {.id = 0x321, .mask = 0x7FF};
    open_can();
    hal_can_set_filters(can, &filter, 1);
    shell("ip link del " IFACE);
    looped_until_state(loop, can, HAL_CAN_DOWN);
    shell("ip link add dev " IFACE " type vcan && ip link set " IFACE " up");
    looped_until_state(loop, can, HAL_CAN_ACTIVE);
    expect_working();
    peer_sends(0x320, 0, "");
    looped_settle(loop, 20000);
    TEST_ASSERT_EQUAL_UINT(1, received_n);
}

static void test_interface_that_is_down_can_be_opened(void)
{
    shell("ip link set " IFACE " down");
    open_can();
    TEST_ASSERT_EQUAL_INT(HAL_CAN_DOWN, hal_can_health(can).state);
    shell("ip link set " IFACE " up");
    looped_until_state(loop, can, HAL_CAN_ACTIVE);
    expect_working();
}

static void test_refused_frame_goes_after_the_interface_returns(void)
{
    shell("tc qdisc add dev " IFACE " root netem delay 5ms limit 1");
    open_can();
    to_send = 50;
    send_numbered();
    shell("ip link set " IFACE " down");
    looped_until_state(loop, can, HAL_CAN_DOWN);
    shell("ip link set " IFACE " up");
    uint64_t end_us = loop_refresh_now_us(loop) + LOOPED_LIMIT_US;
    loop_set_deadline_us(loop, end_us);
    while (sent_n < to_send && loop_now_us(loop) < end_us) {
        TEST_ASSERT_TRUE(loop_run_once(loop));
    }
    TEST_ASSERT_EQUAL_UINT(to_send, sent_n);
}

static void test_idle_bus_costs_no_processor_time(void)
{
    struct rusage before;
    struct rusage after;
    open_can();
    looped_settle(loop, 20000);
    getrusage(RUSAGE_SELF, &before);
    TEST_ASSERT_LESS_OR_EQUAL_INT(2, looped_settle(loop, 100000));
    getrusage(RUSAGE_SELF, &after);
    TEST_ASSERT_LESS_OR_EQUAL_INT(3, after.ru_nvcsw - before.ru_nvcsw);
}

/* What is missing for these tests, or NULL. */
static const char *find_lack(void)
{
    int fd = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    if (fd < 0) {
        return "AF_CAN is missing";
    }
    close(fd);
    shell_works("ip link del " IFACE " 2>/dev/null");
    if (!shell_works("ip link add dev " IFACE " type vcan && ip link del " IFACE)) {
        return "a vcan interface cannot be made";
    }
    return NULL;
}

static int run_all(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_buses_that_cannot_be_opened_are_refused_by_name);
    RUN_TEST(test_frames_pass_in_both_directions_and_own_ones_do_not_return);
    RUN_TEST(test_other_kinds_are_reported_as_such);
    RUN_TEST(test_filters_pass_what_matches_and_all_other_kinds);
    RUN_TEST(test_no_filters_and_too_many_filters_pass_everything);
    RUN_TEST(test_error_frames_tell_the_health);
    RUN_TEST(test_error_frames_tell_of_lost_frames);
    RUN_TEST(test_batches_come_complete_and_in_order);
    RUN_TEST(test_burst_is_one_round_and_a_single_frame_one_call);
    RUN_TEST(test_caller_that_takes_a_few_at_a_time_is_called_again);
    RUN_TEST(test_overrun_of_the_socket_is_counted);
    RUN_TEST(test_full_queue_of_the_interface_delays_but_loses_nothing);
    RUN_TEST(test_full_socket_buffer_delays_but_loses_nothing);
    RUN_TEST(test_send_is_refused_without_a_call_until_there_is_room);
    RUN_TEST(test_interface_goes_down_and_up);
    RUN_TEST(test_interface_is_deleted_and_made_again);
    RUN_TEST(test_interface_that_changes_unseen_works_again);
    RUN_TEST(test_send_that_meets_the_change_first_recovers);
    RUN_TEST(test_frames_before_the_end_are_still_read);
    RUN_TEST(test_filters_stay_when_the_interface_returns);
    RUN_TEST(test_interface_that_is_down_can_be_opened);
    RUN_TEST(test_refused_frame_goes_after_the_interface_returns);
    RUN_TEST(test_idle_bus_costs_no_processor_time);
    return UNITY_END();
}

int main(void)
{
    lack = find_lack();
    int failures = run_all();
    return lack != NULL ? EXIT_SKIPPED : failures;
}
