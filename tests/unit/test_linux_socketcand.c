/* The socketcand client against a server made of literal bytes. The handshake is spoken by a thread, because
 * opening waits for it; after that the test itself holds the server's end. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "linux_can.h"
#include "looped.h"
#include "unity.h"

#define FRAMES_MAX 4096u

/* What the server says, and what it must hear before that (NULL: the end). */
typedef struct {
    const char *say;
    const char *hear;
} line_t;

static const line_t handshake[] = {
    {"< hi >", "< open sim >"}, {"< ok >", "< rawmode >"}, {"< ok >", NULL}, {NULL, NULL}};

static char error[400];
static char bus[100];
static loop_t *loop;
static hal_can_t *can;
static int listener;
static int server; /* the server's end of the connection */
static const line_t *script;
static bool hangs_up;      /* the thread closes the connection at the end */
static char mismatch[200]; /* what the thread heard instead; empty: all was well */
static pthread_t thread;
static can_frame_t received[FRAMES_MAX];
static size_t received_n;
static size_t room;
static int ready_calls;

static void on_ready(void *ctx)
{
    (void)ctx;
    ready_calls++;
    received_n += hal_can_receive(can, received + received_n, room);
}

static void listen_at(uint16_t port)
{
    struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    int on = 1;
    listener = socket(AF_INET, SOCK_STREAM, 0);
    setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    TEST_ASSERT_EQUAL_INT(0, bind(listener, (const struct sockaddr *)&address, sizeof address));
    TEST_ASSERT_EQUAL_INT(0, listen(listener, 4));
}

static uint16_t listener_port(void)
{
    struct sockaddr_in address = {.sin_port = 0};
    socklen_t size = sizeof address;
    TEST_ASSERT_EQUAL_INT(0, getsockname(listener, (struct sockaddr *)&address, &size));
    return ntohs(address.sin_port);
}

void setUp(void)
{
    listen_at(0);
    snprintf(bus, sizeof bus, "socketcand:127.0.0.1:%u/sim", listener_port());
    loop = loop_create();
    can = NULL;
    server = -1;
    hangs_up = false;
    received_n = 0;
    room = FRAMES_MAX;
    ready_calls = 0;
}

void tearDown(void)
{
    linux_can_close(can);
    loop_destroy(loop);
    if (listener >= 0) {
        close(listener);
    }
    if (server >= 0) {
        close(server);
    }
}

/* Reads until text has come, or something else. */
static bool hear(int fd, const char *text)
{
    char bytes[200] = "";
    size_t n = 0;
    while (n < strlen(text)) {
        struct pollfd watched = {.fd = fd, .events = POLLIN};
        ssize_t step = poll(&watched, 1, 3000) > 0 ? recv(fd, bytes + n, strlen(text) - n, 0) : 0;
        if (step <= 0) {
            break;
        }
        n += (size_t)step;
    }
    if (strcmp(bytes, text) == 0) {
        return true;
    }
    memcpy(mismatch, bytes, sizeof mismatch);
    return false;
}

static void *speak(void *unused)
{
    (void)unused;
    struct pollfd watched = {.fd = listener, .events = POLLIN};
    server = poll(&watched, 1, 3000) > 0 ? accept(listener, NULL, NULL) : -1;
    for (const line_t *line = script; server >= 0 && line->say != NULL; line++) {
        send(server, line->say, strlen(line->say), MSG_NOSIGNAL);
        if (line->hear != NULL && !hear(server, line->hear)) {
            break;
        }
    }
    if (hangs_up && server >= 0) {
        close(server);
        server = -1;
    }
    return NULL;
}

static void start_speaking(const line_t *lines)
{
    script = lines;
    mismatch[0] = '\0';
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, speak, NULL));
}

static void finish_speaking(void)
{
    pthread_join(thread, NULL);
    TEST_ASSERT_EQUAL_STRING("", mismatch);
}

static void try_open(const line_t *lines)
{
    start_speaking(lines);
    can = linux_can_open(loop, bus, on_ready, NULL, error, sizeof error);
    finish_speaking();
}

static void open_can(void)
{
    try_open(handshake);
    TEST_ASSERT_NOT_NULL_MESSAGE(can, error);
}

static void server_sends(const char *text)
{
    TEST_ASSERT_EQUAL_INT(strlen(text), send(server, text, strlen(text), MSG_NOSIGNAL));
}

static void expect_frame(size_t i, can_frame_kind_t kind, uint16_t id, uint8_t dlc, const char *data)
{
    TEST_ASSERT_EQUAL_INT(kind, received[i].kind);
    TEST_ASSERT_EQUAL_HEX16(id, received[i].id);
    TEST_ASSERT_EQUAL_UINT8(dlc, received[i].dlc);
    for (size_t k = 0; k < dlc; k++) {
        TEST_ASSERT_EQUAL_HEX8((uint8_t)data[k], received[i].data[k]);
    }
}

static void expect_good_frame_after(const char *garbage)
{
    size_t before = received_n;
    server_sends(garbage);
    server_sends("< frame 0AB 1.5 C0 >");
    looped_until(loop, &received_n, before + 1);
    expect_frame(before, CAN_FRAME_BASE, 0x0AB, 1, "\xC0");
}

static void test_handshake_leads_to_an_active_bus(void)
{
    open_can();
    TEST_ASSERT_EQUAL_INT(HAL_CAN_ACTIVE, hal_can_health(can).state);
}

static void test_handshake_in_pieces_with_line_feeds_works(void)
{
    const line_t lines[] = {{"<", NULL},
                            {" h", NULL},
                            {"i >\n", "< open sim >"},
                            {"<ok>\r\n", "< rawmode >"},
                            {"  < ok > < frame 1FF 0.0 >", NULL},
                            {NULL, NULL}};
    try_open(lines);
    TEST_ASSERT_NOT_NULL_MESSAGE(can, error);
    looped_until(loop, &received_n, 1); /* what follows the handshake in the same packet is not lost */
    expect_frame(0, CAN_FRAME_BASE, 0x1FF, 0, "");
}

static void test_frames_of_the_server_arrive(void)
{
    open_can();
    server_sends(
        "< frame 123 23.424242 012233 >"
        "< frame 7FF 1700000000.000001 >"
        "< frame 000 0.0 0011223344556677 >\n"
        "<frame 1ab 1 ff>"
        "< frame 12 1.0 01 02 0A >");
    looped_until(loop, &received_n, 5);
    expect_frame(0, CAN_FRAME_BASE, 0x123, 3, "\x01\x22\x33");
    expect_frame(1, CAN_FRAME_BASE, 0x7FF, 0, "");
    expect_frame(2, CAN_FRAME_BASE, 0x000, 8, "\x00\x11\x22\x33\x44\x55\x66\x77");
    expect_frame(3, CAN_FRAME_BASE, 0x1AB, 1, "\xFF");
    expect_frame(4, CAN_FRAME_BASE, 0x012, 3, "\x01\x02\x0A");
}

static void test_other_kinds_are_reported_as_such(void)
{
    open_can();
    server_sends(
        "< frame 00000123 1.0 42 >"
        "< frame 123 1.0 000102030405060708090A0B >"
        "< error 004 23.424242 >");
    looped_until(loop, &received_n, 3);
    expect_frame(0, CAN_FRAME_EXTENDED, 0, 1, "\x42");
    expect_frame(1, CAN_FRAME_FD, 0, 8, "\x00\x01\x02\x03\x04\x05\x06\x07");
    expect_frame(2, CAN_FRAME_ERROR, 0, 0, "");
    TEST_ASSERT_EQUAL_UINT32(0, hal_can_health(can).tx_failed);
}

static void test_frame_in_single_bytes_arrives(void)
{
    const char text[] = "< frame 123 23.424242 012233 >";
    open_can();
    for (size_t i = 0; i < strlen(text); i++) {
        TEST_ASSERT_EQUAL_UINT(0, received_n);
        TEST_ASSERT_EQUAL_INT(1, send(server, text + i, 1, 0));
        looped_settle(loop, 2000);
    }
    looped_until(loop, &received_n, 1);
    expect_frame(0, CAN_FRAME_BASE, 0x123, 3, "\x01\x22\x33");
}

static void test_garbage_spoils_no_other_element(void)
{
    char too_long[2000] = "< frame 123 1.0 ";
    memset(too_long + strlen(too_long), '0', 1500);
    open_can();
    expect_good_frame_after(" noise \n > > \t");
    expect_good_frame_after("< frame 123 1.0 01");
    expect_good_frame_after("<><  ><<<");
    expect_good_frame_after("< ok >< hi >< echo >< unknown words here >");
    expect_good_frame_after(too_long);
    TEST_ASSERT_EQUAL_UINT32(0, hal_can_health(can).rx_overruns);
    server_sends(too_long);
    expect_good_frame_after(">");
    TEST_ASSERT_EQUAL_UINT32(1, hal_can_health(can).rx_overruns);
    TEST_ASSERT_EQUAL_UINT(6, received_n);
    TEST_ASSERT_EQUAL_INT(HAL_CAN_ACTIVE, hal_can_health(can).state);
}

static void test_malformed_frames_are_counted_and_not_delivered(void)
{
    const char *const malformed[] = {"< frame >",
                                     "< frame 123 >",
                                     "< frame XYZ 1.0 01 >",
                                     "< frame 123 1.0 0 >",
                                     "< frame 123 1.0 0g >",
                                     "< frame 800 1.0 00 >",
                                     "< frame 123456789 1.0 00 >"};
    const size_t n = sizeof malformed / sizeof malformed[0];
    open_can();
    for (size_t i = 0; i < n; i++) {
        expect_good_frame_after(malformed[i]);
        TEST_ASSERT_EQUAL_UINT32(i + 1, hal_can_health(can).rx_overruns);
    }
}

static void test_refusal_by_the_server_is_counted(void)
{
    open_can();
    expect_good_frame_after("< error could not send >");
    TEST_ASSERT_EQUAL_UINT32(1, hal_can_health(can).tx_failed);
}

static void expect_at_server(const char *text)
{
    mismatch[0] = '\0';
    hear(server, text);
    TEST_ASSERT_EQUAL_STRING("", mismatch);
}

static void send_good(uint16_t id, uint8_t dlc, const char *data)
{
    can_frame_t frame = {.id = id, .dlc = dlc};
    memcpy(frame.data, data, dlc);
    TEST_ASSERT_TRUE(hal_can_send(can, &frame));
}

static void test_sent_frames_are_elements_of_the_protocol(void)
{
    open_can();
    send_good(0x123, 3, "\x01\x22\x33");
    expect_at_server("< send 123 3 1 22 33 >");
    send_good(0x00A, 0, "");
    expect_at_server("< send 00A 0 >");
    send_good(0x7FF, 8, "\x00\x10\xFF\x80\x0F\xAA\x01\x00");
    expect_at_server("< send 7FF 8 0 10 FF 80 F AA 1 0 >");
}

static void test_small_rooms_get_everything_without_new_bytes(void)
{
    open_can();
    char text[50 * 40] = "";
    for (int i = 0; i < 50; i++) {
        snprintf(text + strlen(text), 40, "< frame 123 1.%02d %02X >", i, (unsigned)i);
    }
    room = 7;
    looped_settle(loop, 20000);
    uint64_t start_us = loop_now_us(loop);
    server_sends(text);
    looped_until(loop, &received_n, 50);
    TEST_ASSERT_LESS_THAN_UINT64(500000, loop_now_us(loop) - start_us); /* by no other timer */
    for (size_t i = 0; i < 50; i++) {
        const char data[1] = {(char)i};
        expect_frame(i, CAN_FRAME_BASE, 0x123, 1, data);
    }
    looped_settle(loop, 20000);
    int calls = ready_calls;
    looped_settle(loop, 50000);
    TEST_ASSERT_EQUAL_INT(calls, ready_calls);
}

/* Reads what the client has sent, and checks that it is the frames first_number onwards, whole and in
 * order. */
static unsigned read_numbered(char *rest, size_t rest_size, unsigned number)
{
    static char bytes[1 << 16];
    size_t n = strlen(rest);
    memcpy(bytes, rest, n);
    ssize_t step = recv(server, bytes + n, sizeof bytes - 1 - n, MSG_DONTWAIT);
    n += step > 0 ? (size_t)step : 0;
    bytes[n] = '\0';
    char *at = bytes;
    for (;;) {
        char expected[60];
        snprintf(expected, sizeof expected, "< send %03X 2 %X %X >", number & 0x7FF, number >> 8 & 0xFF,
                 number & 0xFF);
        if (strncmp(at, expected, strlen(expected)) != 0) {
            break;
        }
        at += strlen(expected);
        number++;
    }
    TEST_ASSERT_LESS_THAN_UINT(rest_size, strlen(at));
    snprintf(rest, rest_size, "%s", at);
    return number;
}

static bool send_numbered(unsigned number)
{
    can_frame_t frame = {
        .id = (uint16_t)(number & 0x7FF), .dlc = 2, .data = {(uint8_t)(number >> 8), (uint8_t)number}};
    return hal_can_send(can, &frame);
}

static void test_slow_server_delays_but_loses_nothing(void)
{
    int small = 4096;
    setsockopt(listener, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    open_can();
    unsigned sent = 0;
    while (send_numbered(sent)) {
        sent++;
        TEST_ASSERT_LESS_THAN_UINT(1000000, sent);
    }
    int calls = ready_calls;
    TEST_ASSERT_LESS_OR_EQUAL_INT(3, looped_settle(loop, 50000));
    TEST_ASSERT_FALSE(send_numbered(sent));
    char rest[64] = "";
    unsigned heard = 0;
    unsigned goal = sent + 5000;
    uint64_t end_us = loop_refresh_now_us(loop) + LOOPED_LIMIT_US;
    while (heard < goal && loop_now_us(loop) < end_us) {
        heard = read_numbered(rest, sizeof rest, heard);
        loop_set_deadline_us(loop, loop_now_us(loop) + 1000);
        TEST_ASSERT_TRUE(loop_run_once(loop));
        while (sent < goal && send_numbered(sent)) {
            sent++;
        }
    }
    TEST_ASSERT_EQUAL_UINT(goal, heard);
    TEST_ASSERT_EQUAL_STRING("", rest);
    TEST_ASSERT_GREATER_THAN_INT(calls, ready_calls);
    TEST_ASSERT_EQUAL_UINT32(0, hal_can_health(can).tx_failed);
    TEST_ASSERT_LESS_OR_EQUAL_INT(3, looped_settle(loop, 50000)); /* room is no news any more */
}

static void lose_connection(void)
{
    int calls = ready_calls;
    close(server);
    server = -1;
    looped_until_state(loop, can, HAL_CAN_DOWN);
    TEST_ASSERT_GREATER_THAN_INT(calls, ready_calls);
    can_frame_t frame = {.id = 1};
    TEST_ASSERT_FALSE(hal_can_send(can, &frame));
}

static void test_lost_connection_is_made_again(void)
{
    open_can();
    for (int i = 0; i < 2; i++) {
        server_sends("< frame 123 1."); /* the piece does not stay */
        looped_settle(loop, 5000);
        lose_connection();
        start_speaking(handshake);
        looped_until_state(loop, can, HAL_CAN_ACTIVE);
        finish_speaking();
        expect_good_frame_after("0 11 >");
        send_good(0x123, 0, "");
        expect_at_server("< send 123 0 >");
    }
}

/* Connections that the client tries while nobody speaks with it, with their times. */
static size_t count_attempts(uint64_t time_us, uint64_t *times_us, size_t max)
{
    size_t n = 0;
    uint64_t start_us = loop_refresh_now_us(loop);
    while (loop_now_us(loop) < start_us + time_us) {
        loop_set_deadline_us(loop, loop_now_us(loop) + 5000);
        TEST_ASSERT_TRUE(loop_run_once(loop));
        struct pollfd watched = {.fd = listener, .events = POLLIN};
        if (poll(&watched, 1, 0) > 0) {
            close(accept(listener, NULL, NULL));
            TEST_ASSERT_LESS_THAN_UINT(max, n);
            times_us[n++] = loop_now_us(loop) - start_us;
        }
    }
    return n;
}

static void test_attempts_back_off(void)
{
    uint64_t times_us[20] = {0};
    open_can();
    lose_connection();
    /* 100 ms after the loss, then 200, 400, 800: at 100, 300, 700, 1500 ms, and not again before 3100 ms. */
    TEST_ASSERT_EQUAL_UINT(4, count_attempts(2500000, times_us, 20));
    const uint64_t expected_ms[] = {100, 300, 700, 1500};
    for (size_t i = 0; i < 4; i++) {
        TEST_ASSERT_UINT64_WITHIN(150, expected_ms[i] + 75, times_us[i] / 1000);
    }
}

static void test_absent_server_costs_no_processor_time(void)
{
    open_can();
    close(listener);
    lose_connection();
    TEST_ASSERT_LESS_OR_EQUAL_INT(20, looped_settle(loop, 1000000));
    listener = -1;
}

static void test_sending_on_a_lost_connection_is_refused_and_noticed(void)
{
    open_can();
    struct linger hard = {.l_onoff = 1};
    setsockopt(server, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
    close(server); /* resets the connection */
    server = -1;
    can_frame_t frame = {.id = 1};
    bool taken = true;
    for (int i = 0; i < 1000 && taken; i++) {
        taken = hal_can_send(can, &frame);
    }
    TEST_ASSERT_FALSE(taken);
    looped_until_state(loop, can, HAL_CAN_DOWN);
}

static void expect_refused(const char *expected_reason)
{
    char expected[500];
    snprintf(expected, sizeof expected, "%s: %s", bus, expected_reason);
    TEST_ASSERT_NULL(can);
    TEST_ASSERT_EQUAL_STRING(expected, error);
}

static void test_absent_server_at_open_is_an_error(void)
{
    close(listener);
    listener = -1;
    can = linux_can_open(loop, bus, on_ready, NULL, error, sizeof error);
    expect_refused("Connection refused");
}

static void test_server_that_refuses_the_bus_is_quoted(void)
{
    const line_t lines[] = {{"< hi >", "< open sim >"}, {"< error no such\nbus >", NULL}, {NULL, NULL}};
    try_open(lines);
    expect_refused("the server says: no such bus");
}

static void test_server_that_hangs_up_at_open_is_an_error(void)
{
    const line_t lines[] = {{"< hi >", "< open sim >"}, {NULL, NULL}};
    hangs_up = true;
    try_open(lines);
    expect_refused("the server closed the connection");
}

static void test_silent_server_is_given_up_after_two_seconds(void)
{
    uint64_t start_us = loop_refresh_now_us(loop);
    can = linux_can_open(loop, bus, on_ready, NULL, error,
                         sizeof error); /* the kernel accepts, nobody speaks */
    expect_refused("no answer within 2 s");
    TEST_ASSERT_UINT64_WITHIN(500000, 2250000, loop_refresh_now_us(loop) - start_us);
}

static void test_bad_addresses_are_refused_by_name(void)
{
    const char *const addresses[] = {"socketcand:", "socketcand:127.0.0.1:1", "socketcand:127.0.0.1/sim",
                                     "socketcand::1/sim", "socketcand:127.0.0.1:/sim"};
    for (size_t i = 0; i < 5; i++) {
        snprintf(bus, sizeof bus, "%s", addresses[i]);
        can = linux_can_open(loop, bus, on_ready, NULL, error, sizeof error);
        expect_refused("expected socketcand:HOST:PORT/NAME");
    }
    snprintf(bus, sizeof bus, "socketcand:127.0.0.1:1/a b");
    can = linux_can_open(loop, bus, on_ready, NULL, error, sizeof error);
    expect_refused("not a bus name after the slash");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_handshake_leads_to_an_active_bus);
    RUN_TEST(test_handshake_in_pieces_with_line_feeds_works);
    RUN_TEST(test_frames_of_the_server_arrive);
    RUN_TEST(test_other_kinds_are_reported_as_such);
    RUN_TEST(test_frame_in_single_bytes_arrives);
    RUN_TEST(test_garbage_spoils_no_other_element);
    RUN_TEST(test_malformed_frames_are_counted_and_not_delivered);
    RUN_TEST(test_refusal_by_the_server_is_counted);
    RUN_TEST(test_sent_frames_are_elements_of_the_protocol);
    RUN_TEST(test_small_rooms_get_everything_without_new_bytes);
    RUN_TEST(test_slow_server_delays_but_loses_nothing);
    RUN_TEST(test_lost_connection_is_made_again);
    RUN_TEST(test_attempts_back_off);
    RUN_TEST(test_absent_server_costs_no_processor_time);
    RUN_TEST(test_sending_on_a_lost_connection_is_refused_and_noticed);
    RUN_TEST(test_absent_server_at_open_is_an_error);
    RUN_TEST(test_server_that_refuses_the_bus_is_quoted);
    RUN_TEST(test_server_that_hangs_up_at_open_is_an_error);
    RUN_TEST(test_silent_server_is_given_up_after_two_seconds);
    RUN_TEST(test_bad_addresses_are_refused_by_name);
    return UNITY_END();
}
