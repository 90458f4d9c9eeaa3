/* The socketcand server over real loopback sockets: its protocol, and who may join. What stands in quotes is
 * the protocol as socketcand's documentation and python-can's client (can/interfaces/socketcand) have it. */
#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "served.h"
#include "unity.h"

void setUp(void)
{
    served_start();
}

void tearDown(void)
{
    served_stop();
}

static void test_socketcand_server_handshake_answers_one_by_one(void)
{
    int fd = served_open_client();

    served_connect_client(fd);
    served_expect(fd, "< hi >");
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(served.server).connections);
    TEST_ASSERT_GREATER_THAN(0, served.changes);
    served_expect_nothing_more(fd);
    served_say(fd, "< open any-name_0 >");
    served_expect(fd, "< ok >");
    served_expect_nothing_more(fd);
    served_say(fd, "< rawmode >");
    served_expect(fd, "< ok >");
    served_expect_nothing_more(fd);
    close(fd);
}

static void test_socketcand_server_send_reaches_the_bus(void)
{
    static const can_frame_t expected[] = {
        {.id = 0x123, .dlc = 3, .data = {0x01, 0x22, 0x33}},
        {.id = 0x7FF, .dlc = 8, .data = {0xDE, 0xAD, 0xBE, 0xEF, 0x00, 0x01, 0x0A, 0xFF}},
        {.id = 0x005, .dlc = 0},
        {.id = 0x000, .kind = CAN_FRAME_EXTENDED, .dlc = 1, .data = {0x7F}},
    };
    int fd = served_join();
    int before = served.changes;

    served_say(fd, "< send 123 3 1 22 33 >");
    served_expect_nothing_more(fd);
    TEST_ASSERT_EQUAL_INT(before + 1, served.changes);
    served_advance_bus(0);
    served_advance_bus(200);
    served_say(fd, "< send 7FF 8 de AD be EF 0 01 a ff >");
    served_expect_nothing_more(fd);
    served_advance_bus(0);
    served_advance_bus(200);
    served_say(fd, "< send 005 0  >"); /* python-can leaves two spaces where no data are */
    served_expect_nothing_more(fd);
    served_advance_bus(0);
    served_advance_bus(200);
    served_say(fd, "< send 00000123 1 7f >");
    served_expect_nothing_more(fd);
    served_advance_bus(0);
    served_advance_bus(200);
    TEST_ASSERT_EQUAL_INT(4, served.heard_count);
    TEST_ASSERT_EQUAL_MEMORY(expected, served.heard, sizeof expected);
    close(fd);
}

static void test_socketcand_server_frame_has_bus_time_and_three_digits(void)
{
    static const can_frame_t frame_123 = {.id = 0x123, .dlc = 3, .data = {0x01, 0x22, 0x33}};
    static const can_frame_t frame_005 = {.id = 0x005};
    static const can_frame_t frame_7ff = {
        .id = 0x7FF, .dlc = 8, .data = {0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F, 0x10, 0x20}};
    static const can_frame_t extended = {.kind = CAN_FRAME_EXTENDED, .dlc = 1, .data = {0x01}};
    int fd = served_join();

    served.bus_us = 23424242 - 70; /* the frame takes 70 bits */
    served_send_from_node(&frame_123);
    served_expect(fd, "< frame 123 23.424242 012233 >");
    served.bus_us = 24000000 - 47;
    served_send_from_node(&frame_005);
    served_expect(fd, "< frame 005 24.000000  >");
    served.bus_us = UINT64_C(5000000000000007) - 117;
    served_send_from_node(&frame_7ff);
    served_expect(fd, "< frame 7FF 5000000000.000007 0A0B0C0D0E0F1020 >");
    served.bus_us = UINT64_C(6000000000000000) - 80;
    served_send_from_node(&extended);
    served_expect(fd, "< frame 00000000 6000000000.000000 01 >");
    served_expect_nothing_more(fd);
    close(fd);
}

static void test_socketcand_server_no_echo_to_the_sender(void)
{
    int sender = served_join();
    int other = served_join();
    int opened = served_open_client(); /* not in raw mode: hears nothing */

    served_connect_client(opened);
    served_expect(opened, "< hi >");
    served_say(opened, "< open can0 >");
    served_expect(opened, "< ok >");
    served_say(sender, "< send 010 1 ab >");
    served_expect_nothing_more(sender);
    served.bus_us = 2000000 - 55;
    served_advance_bus(0);
    served_advance_bus(55);
    served_expect(other, "< frame 010 2.000000 AB >");
    served_expect_nothing_more(other);
    served_expect_nothing_more(sender);
    served_expect_nothing_more(opened);
    close(sender);
    close(other);
    close(opened);
}

static void test_socketcand_server_takes_split_elements(void)
{
    static const char text[] = "< open x >< rawmode >< send 123 3 1 22 33 >< echo >";
    int fd = served_open_client();

    served_connect_client(fd);
    served_expect(fd, "< hi >");
    for (size_t i = 0; i + 1 < sizeof text; i++) {
        char one[2] = {text[i], '\0'};

        served_say(fd, one);
        served_run_loop();
    }
    served_expect(fd, "< ok >< ok >< echo >");
    served_advance_bus(0);
    served_advance_bus(200);
    TEST_ASSERT_EQUAL_INT(1, served.heard_count);
    TEST_ASSERT_EQUAL_UINT32(0, socketcand_server_stats(served.server).bad_elements);
    close(fd);
}

static void test_socketcand_server_takes_glued_elements(void)
{
    int fd = served_open_client();

    served_connect_client(fd);
    served_expect(fd, "< hi >");
    served_say(fd, "< open x >\n<rawmode>\r\n< send 001 1 1 >< send  002\t1 2 > <send 3 1 3><");
    served_say(fd, " echo >");
    served_expect(fd, "< ok >< ok >< echo >");
    served_advance_bus(0);
    served_advance_bus(500);
    TEST_ASSERT_EQUAL_INT(3, served.heard_count);
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_EQUAL_HEX16(i + 1, served.heard[i].id);
        TEST_ASSERT_EQUAL_HEX8(i + 1, served.heard[i].data[0]);
    }
    close(fd);
}

static void test_socketcand_server_order_of_the_handshake(void)
{
    int fd = served_open_client();

    served_connect_client(fd);
    served_expect(fd, "< hi >");
    served_say(fd, "< send 123 1 1 >");
    served_expect(fd, "< error send before rawmode >");
    served_say(fd, "< rawmode >");
    served_expect(fd, "< error rawmode before open >");
    served_say(fd, "< open >");
    served_expect(fd, "< error open: wrong number of words >");
    served_say(fd, "< open can0 >");
    served_expect(fd, "< ok >");
    served_say(fd, "< open can0 >");
    served_expect(fd, "< error open: already open >");
    served_say(fd, "< send 123 1 1 >");
    served_expect(fd, "< error send before rawmode >");
    served_say(fd, "< rawmode >< rawmode >");
    served_expect(fd, "< ok >< ok >");
    TEST_ASSERT_EQUAL_UINT32(5, socketcand_server_stats(served.server).bad_elements);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&served.bus, served.bus_us));
    close(fd);
}

static void test_socketcand_server_malformed_elements_are_named_and_counted(void)
{
    static const struct {
        const char *said;
        const char *answer;
    } wrong[] = {
        {"< send 800 1 1 >", "< error identifier over 7FF with three digits >"},
        {"< send FFF 1 1 >", "< error identifier over 7FF with three digits >"},
        {"< send 20000000 1 1 >", "< error identifier over 1FFFFFFF >"},
        {"< send 12G 1 1 >", "< error identifier is not one to eight hexadecimal digits >"},
        {"< send 000000123 1 1 >", "< error identifier is not one to eight hexadecimal digits >"},
        {"< send -12 1 1 >", "< error identifier is not one to eight hexadecimal digits >"},
        {"< send 123 9 1 2 3 4 5 6 7 8 >", "< error DLC is not 0 to 8 >"},
        {"< send 123 F >", "< error DLC is not 0 to 8 >"},
        {"< send 123 x 1 >", "< error DLC is not 0 to 8 >"},
        {"< send 123 01 1 >", "< error DLC is not 0 to 8 >"},
        {"< send 123 2 1 >", "< error DLC and number of data bytes differ >"},
        {"< send 123 1 1 2 >", "< error DLC and number of data bytes differ >"},
        {"< send 123 0 1 >", "< error DLC and number of data bytes differ >"},
        {"< send 123 1 123 >", "< error data byte is not one or two hexadecimal digits >"},
        {"< send 123 1 0x >", "< error data byte is not one or two hexadecimal digits >"},
        {"< send 123 8 1 2 3 4 5 6 7 8 9 >", "< error send: wrong number of words >"},
        {"< send 123 8 1 2 3 4 5 6 7 8 9 10 11 12 13 >", "< error send: wrong number of words >"},
        {"< send 123 >", "< error send: wrong number of words >"},
        {"< echo 1 >", "< error echo: wrong number of words >"},
        {"< bcmmode >", "< error unknown command >"},
        {"< SEND 123 1 1 >", "< error unknown command >"},
        {"< sen 123 1 1 >", "< error unknown command >"},
        {"< >", "< error unknown command >"},
        {"<>", "< error unknown command >"},
        {"<< echo >", "< error unknown command >"},
        {"noise ", "< error text between elements >"},
    };
    int fd = served_join();

    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        served_say(fd, wrong[i].said);
        served_expect(fd, wrong[i].answer);
        TEST_ASSERT_EQUAL_UINT32(i + 1, socketcand_server_stats(served.server).bad_elements);
        served_expect_nothing_more(fd);
    }
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(served.server).connections);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&served.bus, served.bus_us));
    close(fd);
}

static void test_socketcand_server_element_without_end_is_one_error(void)
{
    char letters[1001];
    int fd = served_join();

    memset(letters, 'a', sizeof letters);
    letters[sizeof letters - 1] = '\0';
    served_say(fd, "< send ");
    for (int i = 0; i < 10; i++) {
        served_say(fd, letters);
        served_run_loop();
    }
    served_expect(fd, "< error element too long >");
    served_say(fd, " >");
    served_expect_nothing_more(fd);
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(served.server).bad_elements);
    close(fd);
}

static void test_socketcand_server_longest_element(void)
{
    char text[SOCKETCAND_ELEMENT_MAX + 2] = "< open ";
    int fd = served_open_client();

    served_connect_client(fd);
    served_expect(fd, "< hi >");
    memset(&text[7], 'n', SOCKETCAND_ELEMENT_MAX - 8 + 1);
    text[SOCKETCAND_ELEMENT_MAX] = '>';
    served_say(fd, text); /* one too many */
    served_expect(fd, "< error element too long >");
    text[SOCKETCAND_ELEMENT_MAX - 1] = '>';
    text[SOCKETCAND_ELEMENT_MAX] = '\0';
    served_say(fd, text);
    served_expect(fd, "< ok >");
    close(fd);
}

static void test_socketcand_server_unsupported_kinds_are_counted(void)
{
    static const can_frame_t remote = {.kind = CAN_FRAME_REMOTE};
    static const can_frame_t error = {.kind = CAN_FRAME_ERROR};
    static const can_frame_t fd_frame = {.kind = CAN_FRAME_FD};
    int fd = served_join();

    served_send_from_node(&remote);
    served_send_from_node(&error);
    served_send_from_node(&fd_frame);
    TEST_ASSERT_EQUAL_UINT32(3, socketcand_server_stats(served.server).frames_unsupported);
    served_expect_nothing_more(fd);
    close(fd);
}

static void test_socketcand_server_unfinished_element_at_the_end_is_counted(void)
{
    int fd = served_join();

    served_say(fd, "< send 123 1");
    close(fd);
    for (int i = 0; i < SERVED_PATIENCE_MS && socketcand_server_stats(served.server).connections > 0; i++) {
        served_run_loop();
    }
    TEST_ASSERT_EQUAL_UINT32(0, socketcand_server_stats(served.server).connections);
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(served.server).bad_elements);
    TEST_ASSERT_FALSE(served.bus.ports[served.node + 1].attached);
}

static void test_socketcand_server_answers_before_it_closes(void)
{
    int fd = served_join();

    served_say(fd, "< echo >");
    TEST_ASSERT_EQUAL_INT(0, shutdown(fd, SHUT_WR));
    served_expect(fd, "< echo >");
    served_expect_end(fd);
    close(fd);
}

static void test_socketcand_server_full_bus_refuses_and_closes(void)
{
    int first = served_open_client();
    int second = served_open_client();
    int third = served_open_client();

    for (int i = served.node + 2; i < SIM_BUS_PORTS_MAX; i++) {
        TEST_ASSERT_NOT_EQUAL(-1, sim_bus_attach(&served.bus, NULL, NULL));
    }
    served_connect_client(first);
    served_expect(first, "< hi >");
    served_connect_client(second);
    served_expect(second, "< error bus full >");
    served_expect_end(second);
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(served.server).connections);
    close(first);
    for (int i = 0; i < SERVED_PATIENCE_MS && socketcand_server_stats(served.server).connections > 0; i++) {
        served_run_loop();
    }
    served_connect_client(third); /* the port is free again */
    served_expect(third, "< hi >");
    close(second);
    close(third);
}

static void test_socketcand_server_without_descriptors_turns_away(void)
{
    struct rlimit before;
    struct rlimit low;
    int waiting = served_open_client();
    int later = served_open_client();
    int lowest_free = dup(waiting);

    close(lowest_free);
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_NOFILE, &before));
    low = before;
    low.rlim_cur = (rlim_t)lowest_free;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &low));
    served_connect_client(waiting);
    for (int i = 0; i < 3; i++) {
        served_run_loop();
    }
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &before));
    served_expect_end(waiting);
    served_connect_client(later);
    served_expect(later, "< hi >");
    close(waiting);
    close(later);
}

static void test_socketcand_server_can_listen_again_at_once(void)
{
    uint16_t port = socketcand_server_port(served.server);
    int fd = served_join();

    socketcand_server_close(served.server); /* closes first: its side keeps the address in TIME_WAIT */
    served_expect_end(fd);
    TEST_ASSERT_FALSE(served.bus.ports[served.node + 1].attached);
    served_open(port);
    TEST_ASSERT_EQUAL_UINT16(port, socketcand_server_port(served.server));
    close(fd);
    fd = served_join();
    close(fd);
}

static void test_socketcand_server_port_in_use_is_one_line(void)
{
    char error[128] = "";
    char expected[128];
    uint16_t port = socketcand_server_port(served.server);

    TEST_ASSERT_NULL(socketcand_server_open(served.loop, &served.bus, port, NULL, NULL, error, sizeof error));
    snprintf(expected, sizeof expected, "127.0.0.1:%u: Address already in use", (unsigned)port);
    TEST_ASSERT_EQUAL_STRING(expected, error);
}

static void test_socketcand_server_close_takes_nothing(void)
{
    socketcand_server_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_socketcand_server_handshake_answers_one_by_one);
    RUN_TEST(test_socketcand_server_send_reaches_the_bus);
    RUN_TEST(test_socketcand_server_frame_has_bus_time_and_three_digits);
    RUN_TEST(test_socketcand_server_no_echo_to_the_sender);
    RUN_TEST(test_socketcand_server_takes_split_elements);
    RUN_TEST(test_socketcand_server_takes_glued_elements);
    RUN_TEST(test_socketcand_server_order_of_the_handshake);
    RUN_TEST(test_socketcand_server_malformed_elements_are_named_and_counted);
    RUN_TEST(test_socketcand_server_element_without_end_is_one_error);
    RUN_TEST(test_socketcand_server_longest_element);
    RUN_TEST(test_socketcand_server_unsupported_kinds_are_counted);
    RUN_TEST(test_socketcand_server_unfinished_element_at_the_end_is_counted);
    RUN_TEST(test_socketcand_server_answers_before_it_closes);
    RUN_TEST(test_socketcand_server_full_bus_refuses_and_closes);
    RUN_TEST(test_socketcand_server_without_descriptors_turns_away);
    RUN_TEST(test_socketcand_server_can_listen_again_at_once);
    RUN_TEST(test_socketcand_server_port_in_use_is_one_line);
    RUN_TEST(test_socketcand_server_close_takes_nothing);
    return UNITY_END();
}
