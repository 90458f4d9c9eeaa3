/* The socketcand server over real loopback sockets; the bus runs on a clock of the test. What stands in
 * quotes is the protocol as socketcand's documentation and python-can's client (can/interfaces/socketcand)
 * have it. */
#define _POSIX_C_SOURCE 200809L
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "loop.h"
#include "sim_bus.h"
#include "socketcand_server.h"
#include "unity.h"

#define PATIENCE_MS 3000
#define LOG_MAX 4096

static loop_t *loop;
static sim_bus_t bus;
static socketcand_server_t *server;
static uint64_t bus_us;
static int changes;
static int node; /* a port of the bus without a socket: logs what it hears */
static can_frame_t heard[LOG_MAX];
static int heard_count;

static void on_changed(void *ctx)
{
    TEST_ASSERT_EQUAL_PTR(&bus, ctx);
    changes++;
}

static void on_node_frame(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    (void)ctx;
    (void)time_us;
    if (heard_count < LOG_MAX) {
        heard[heard_count] = *frame;
    }
    heard_count++;
}

static void open_server(uint16_t port)
{
    char error[128] = "";

    server = socketcand_server_open(loop, &bus, port, on_changed, &bus, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(server, error);
}

void setUp(void)
{
    loop = loop_create();
    TEST_ASSERT_NOT_NULL(loop);
    sim_bus_init(&bus);
    bus_us = 1000;
    changes = 0;
    heard_count = 0;
    node = sim_bus_attach(&bus, on_node_frame, NULL);
    open_server(0);
}

void tearDown(void)
{
    socketcand_server_close(server);
    server = NULL;
    loop_destroy(loop);
}

/* One round of the loop; waits for a millisecond at most. */
static void run_loop(void)
{
    loop_set_deadline_us(loop, loop_refresh_now_us(loop) + 1000);
    TEST_ASSERT_TRUE(loop_run_once(loop));
}

static void advance_bus(uint64_t us)
{
    bus_us += us;
    do {
        sim_bus_step(&bus, bus_us);
    } while (socketcand_server_poll(server));
}

/* Puts a frame on the bus from the node and carries the bus on to its end. */
static void send_from_node(const can_frame_t *frame)
{
    TEST_ASSERT_TRUE(sim_bus_send(&bus, node, frame));
    advance_bus(0);
    advance_bus(200);
}

/* Nothing keeps the loop awake: a handler that is called without end would show here. */
static void assert_loop_sleeps(void)
{
    uint64_t end_us = loop_refresh_now_us(loop) + 20000;
    int rounds = 0;

    for (; loop_refresh_now_us(loop) < end_us && rounds < 1000; rounds++) {
        loop_set_deadline_us(loop, end_us);
        TEST_ASSERT_TRUE(loop_run_once(loop));
    }
    TEST_ASSERT_LESS_THAN(10, rounds);
}

static int open_client(void)
{
    int fd = socket(AF_INET, SOCK_STREAM, 0);

    TEST_ASSERT_GREATER_OR_EQUAL(0, fd);
    return fd;
}

static void connect_client(int fd)
{
    struct sockaddr_in address = {.sin_family = AF_INET,
                                  .sin_port = htons(socketcand_server_port(server)),
                                  .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};

    TEST_ASSERT_EQUAL_INT(0, connect(fd, (const struct sockaddr *)&address, sizeof address));
}

static void say(int fd, const char *text)
{
    TEST_ASSERT_EQUAL_INT((int)strlen(text), (int)send(fd, text, strlen(text), MSG_NOSIGNAL));
}

/* The next bytes from the server are these. */
static void expect(int fd, const char *text)
{
    char got[1024] = "";
    size_t wanted = strlen(text);
    size_t length = 0;

    TEST_ASSERT_LESS_THAN(sizeof got, wanted);
    for (int i = 0; i < PATIENCE_MS && length < wanted; i++) {
        ssize_t n = recv(fd, &got[length], wanted - length, MSG_DONTWAIT);

        if (n > 0) {
            length += (size_t)n;
        } else if (n == 0) {
            break;
        } else {
            run_loop();
        }
    }
    TEST_ASSERT_EQUAL_STRING(text, got);
}

static void expect_end(int fd)
{
    char byte;

    for (int i = 0; i < PATIENCE_MS; i++) {
        ssize_t n = recv(fd, &byte, 1, MSG_DONTWAIT);

        TEST_ASSERT_LESS_THAN(1, n);
        if (n == 0 || errno == ECONNRESET) {
            return;
        }
        run_loop();
    }
    TEST_FAIL_MESSAGE("the connection is still open");
}

/* Everything that was said before has been read, and nothing else is on its way to this client. */
static void expect_nothing_more(int fd)
{
    say(fd, "< echo >");
    expect(fd, "< echo >");
}

static void handshake(int fd)
{
    expect(fd, "< hi >");
    say(fd, "< open can0 >");
    expect(fd, "< ok >");
    say(fd, "< rawmode >");
    expect(fd, "< ok >");
}

/* A client in raw mode whose frames are not held back any more. */
static int join(void)
{
    int fd = open_client();

    connect_client(fd);
    handshake(fd);
    expect_nothing_more(fd);
    return fd;
}

static void test_socketcand_server_handshake_answers_one_by_one(void)
{
    int fd = open_client();

    connect_client(fd);
    expect(fd, "< hi >");
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(server).connections);
    TEST_ASSERT_GREATER_THAN(0, changes);
    expect_nothing_more(fd);
    say(fd, "< open any-name_0 >");
    expect(fd, "< ok >");
    expect_nothing_more(fd);
    say(fd, "< rawmode >");
    expect(fd, "< ok >");
    expect_nothing_more(fd);
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
    int fd = join();
    int before = changes;

    say(fd, "< send 123 3 1 22 33 >");
    expect_nothing_more(fd);
    TEST_ASSERT_EQUAL_INT(before + 1, changes);
    advance_bus(0);
    advance_bus(200);
    say(fd, "< send 7FF 8 de AD be EF 0 01 a ff >");
    expect_nothing_more(fd);
    advance_bus(0);
    advance_bus(200);
    say(fd, "< send 005 0  >"); /* python-can leaves two spaces where no data are */
    expect_nothing_more(fd);
    advance_bus(0);
    advance_bus(200);
    say(fd, "< send 00000123 1 7f >");
    expect_nothing_more(fd);
    advance_bus(0);
    advance_bus(200);
    TEST_ASSERT_EQUAL_INT(4, heard_count);
    TEST_ASSERT_EQUAL_MEMORY(expected, heard, sizeof expected);
    close(fd);
}

static void test_socketcand_server_frame_has_bus_time_and_three_digits(void)
{
    static const can_frame_t frame_123 = {.id = 0x123, .dlc = 3, .data = {0x01, 0x22, 0x33}};
    static const can_frame_t frame_005 = {.id = 0x005};
    static const can_frame_t frame_7ff = {
        .id = 0x7FF, .dlc = 8, .data = {0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F, 0x10, 0x20}};
    static const can_frame_t extended = {.kind = CAN_FRAME_EXTENDED, .dlc = 1, .data = {0x01}};
    int fd = join();

    bus_us = 23424242 - 70; /* the frame takes 70 bits */
    send_from_node(&frame_123);
    expect(fd, "< frame 123 23.424242 012233 >");
    bus_us = 24000000 - 47;
    send_from_node(&frame_005);
    expect(fd, "< frame 005 24.000000  >");
    bus_us = UINT64_C(5000000000000007) - 117;
    send_from_node(&frame_7ff);
    expect(fd, "< frame 7FF 5000000000.000007 0A0B0C0D0E0F1020 >");
    bus_us = UINT64_C(6000000000000000) - 80;
    send_from_node(&extended);
    expect(fd, "< frame 00000000 6000000000.000000 01 >");
    expect_nothing_more(fd);
    close(fd);
}

static void test_socketcand_server_no_echo_to_the_sender(void)
{
    int sender = join();
    int other = join();
    int opened = open_client(); /* not in raw mode: hears nothing */

    connect_client(opened);
    expect(opened, "< hi >");
    say(opened, "< open can0 >");
    expect(opened, "< ok >");
    say(sender, "< send 010 1 ab >");
    expect_nothing_more(sender);
    bus_us = 2000000 - 55;
    advance_bus(0);
    advance_bus(55);
    expect(other, "< frame 010 2.000000 AB >");
    expect_nothing_more(other);
    expect_nothing_more(sender);
    expect_nothing_more(opened);
    close(sender);
    close(other);
    close(opened);
}

static void test_socketcand_server_takes_split_elements(void)
{
    static const char text[] = "< open x >< rawmode >< send 123 3 1 22 33 >< echo >";
    int fd = open_client();

    connect_client(fd);
    expect(fd, "< hi >");
    for (size_t i = 0; i + 1 < sizeof text; i++) {
        char one[2] = {text[i], '\0'};

        say(fd, one);
        run_loop();
    }
    expect(fd, "< ok >< ok >< echo >");
    advance_bus(0);
    advance_bus(200);
    TEST_ASSERT_EQUAL_INT(1, heard_count);
    TEST_ASSERT_EQUAL_UINT32(0, socketcand_server_stats(server).bad_elements);
    close(fd);
}

static void test_socketcand_server_takes_glued_elements(void)
{
    int fd = open_client();

    connect_client(fd);
    expect(fd, "< hi >");
    say(fd, "< open x >\n<rawmode>\r\n< send 001 1 1 >< send  002\t1 2 > <send 3 1 3><");
    say(fd, " echo >");
    expect(fd, "< ok >< ok >< echo >");
    advance_bus(0);
    advance_bus(500);
    TEST_ASSERT_EQUAL_INT(3, heard_count);
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_EQUAL_HEX16(i + 1, heard[i].id);
        TEST_ASSERT_EQUAL_HEX8(i + 1, heard[i].data[0]);
    }
    close(fd);
}

static void test_socketcand_server_order_of_the_handshake(void)
{
    int fd = open_client();

    connect_client(fd);
    expect(fd, "< hi >");
    say(fd, "< send 123 1 1 >");
    expect(fd, "< error send before rawmode >");
    say(fd, "< rawmode >");
    expect(fd, "< error rawmode before open >");
    say(fd, "< open >");
    expect(fd, "< error open: wrong number of words >");
    say(fd, "< open can0 >");
    expect(fd, "< ok >");
    say(fd, "< open can0 >");
    expect(fd, "< error open: already open >");
    say(fd, "< send 123 1 1 >");
    expect(fd, "< error send before rawmode >");
    say(fd, "< rawmode >< rawmode >");
    expect(fd, "< ok >< ok >");
    TEST_ASSERT_EQUAL_UINT32(5, socketcand_server_stats(server).bad_elements);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, bus_us));
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
    int fd = join();

    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        say(fd, wrong[i].said);
        expect(fd, wrong[i].answer);
        TEST_ASSERT_EQUAL_UINT32(i + 1, socketcand_server_stats(server).bad_elements);
        expect_nothing_more(fd);
    }
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(server).connections);
    TEST_ASSERT_EQUAL_UINT64(SIM_BUS_NEVER, sim_bus_step(&bus, bus_us));
    close(fd);
}

static void test_socketcand_server_element_without_end_is_one_error(void)
{
    char letters[1001];
    int fd = join();

    memset(letters, 'a', sizeof letters);
    letters[sizeof letters - 1] = '\0';
    say(fd, "< send ");
    for (int i = 0; i < 10; i++) {
        say(fd, letters);
        run_loop();
    }
    expect(fd, "< error element too long >");
    say(fd, " >");
    expect_nothing_more(fd);
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(server).bad_elements);
    close(fd);
}

static void test_socketcand_server_longest_element(void)
{
    char text[SOCKETCAND_ELEMENT_MAX + 2] = "< open ";
    int fd = open_client();

    connect_client(fd);
    expect(fd, "< hi >");
    memset(&text[7], 'n', SOCKETCAND_ELEMENT_MAX - 8 + 1);
    text[SOCKETCAND_ELEMENT_MAX] = '>';
    say(fd, text); /* one too many */
    expect(fd, "< error element too long >");
    text[SOCKETCAND_ELEMENT_MAX - 1] = '>';
    text[SOCKETCAND_ELEMENT_MAX] = '\0';
    say(fd, text);
    expect(fd, "< ok >");
    close(fd);
}

/* The data count up, so that loss, order and doubling show. */
static void assert_heard_in_order(int count)
{
    TEST_ASSERT_EQUAL_INT(count, heard_count);
    for (int i = 0; i < count; i++) {
        TEST_ASSERT_EQUAL_HEX16(0x100, heard[i].id);
        TEST_ASSERT_EQUAL_HEX8(i & 0xFF, heard[i].data[0]);
        TEST_ASSERT_EQUAL_HEX8(i >> 8, heard[i].data[1]);
    }
}

/* In one write, so that all of it has left the client when it returns. */
static void say_numbered(int fd, int count)
{
    static char text[32 * 1000];
    size_t length = 0;

    for (int i = 0; i < count; i++) {
        length += (size_t)snprintf(&text[length], sizeof text - length, "< send 100 2 %x %02x >",
                                   (unsigned)(i & 0xFF), (unsigned)(i >> 8));
        TEST_ASSERT_LESS_THAN(sizeof text, length);
    }
    say(fd, text);
}

static void test_socketcand_server_full_queue_stops_the_reading(void)
{
    int fd = join();

    say_numbered(fd, 1000);
    for (int i = 0; i < PATIENCE_MS && bus.ports[node + 1].queued < SIM_BUS_QUEUE_MAX; i++) {
        run_loop();
    }
    TEST_ASSERT_EQUAL_UINT8(SIM_BUS_QUEUE_MAX, bus.ports[node + 1].queued);
    assert_loop_sleeps();
    for (int i = 0; i < 4000 && heard_count < 1000; i++) {
        advance_bus(300);
        run_loop();
    }
    assert_heard_in_order(1000);
    expect_nothing_more(fd);
    TEST_ASSERT_EQUAL_UINT32(0, socketcand_server_stats(server).bad_elements);
    close(fd);
}

static void test_socketcand_server_frames_before_the_end_are_sent(void)
{
    int fd = join();

    say_numbered(fd, 100);
    close(fd);
    for (int i = 0; i < 1000 && bus.ports[node + 1].attached; i++) {
        run_loop();
        advance_bus(100);
    }
    advance_bus(200);
    assert_heard_in_order(100);
    TEST_ASSERT_FALSE(bus.ports[node + 1].attached);
    TEST_ASSERT_EQUAL_UINT32(0, socketcand_server_stats(server).connections);
}

/* The client resets the connection while its frames wait: what it had sent goes out, and the loop does not
 * spin on the dead socket. */
static void test_socketcand_server_reset_while_the_queue_is_full(void)
{
    struct linger at_once = {.l_onoff = 1, .l_linger = 0};
    int fd = join();

    say_numbered(fd, 60);
    for (int i = 0; i < PATIENCE_MS && bus.ports[node + 1].queued < SIM_BUS_QUEUE_MAX; i++) {
        run_loop();
    }
    TEST_ASSERT_EQUAL_INT(0, setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once));
    close(fd);
    run_loop();
    assert_loop_sleeps();
    for (int i = 0; i < 1000 && bus.ports[node + 1].attached; i++) {
        advance_bus(100);
    }
    advance_bus(200);
    assert_heard_in_order(60);
    TEST_ASSERT_EQUAL_UINT32(0, socketcand_server_stats(server).connections);
}

/* The write is what finds the reset first: what the client had sent before is still read. */
static void test_socketcand_server_write_to_a_reset_connection(void)
{
    static const can_frame_t frame = {.id = 0x7FE};
    struct linger at_once = {.l_onoff = 1, .l_linger = 0};
    int fd = join();

    say_numbered(fd, 30);
    TEST_ASSERT_EQUAL_INT(0, setsockopt(fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once));
    close(fd);
    send_from_node(&frame);
    advance_bus(0);
    for (int i = 0; i < 1000 && bus.ports[node + 1].attached; i++) {
        advance_bus(100);
    }
    advance_bus(200);
    assert_heard_in_order(30);
    TEST_ASSERT_EQUAL_UINT32(0, socketcand_server_stats(server).connections);
    TEST_ASSERT_FALSE(bus.ports[node + 1].attached);
    assert_loop_sleeps();
}

/* Reads so many whole elements "< frame 7FE ... >", after which nothing else comes. */
static void expect_frames(int fd, int wanted)
{
    char buffer[8192];
    size_t kept = 0;
    int frames = 0;

    for (int patience = PATIENCE_MS; patience > 0 && frames < wanted;) {
        ssize_t n = recv(fd, &buffer[kept], sizeof buffer - kept - 1, MSG_DONTWAIT);

        if (n <= 0) {
            patience--;
            run_loop();
            continue;
        }
        kept += (size_t)n;
        buffer[kept] = '\0';
        char *at = buffer;

        for (char *end = strchr(at, '>'); end != NULL; end = strchr(at, '>')) {
            TEST_ASSERT_EQUAL_STRING_LEN("< frame 7FE ", at, 12);
            at = end + 1;
            frames++;
        }
        kept -= (size_t)(at - buffer);
        memmove(buffer, at, kept);
    }
    TEST_ASSERT_EQUAL_UINT(0, kept);
    TEST_ASSERT_EQUAL_INT(wanted, frames);
    expect_nothing_more(fd);
}

static void test_socketcand_server_slow_reader_loses_whole_frames_and_they_are_counted(void)
{
    static const can_frame_t frame = {.id = 0x7FE, .dlc = 8};
    int small = 4096;
    int slow = open_client();
    int sent = 0;

    TEST_ASSERT_EQUAL_INT(0, setsockopt(slow, SOL_SOCKET, SO_RCVBUF, &small, sizeof small));
    connect_client(slow);
    handshake(slow);
    expect_nothing_more(slow);
    for (; socketcand_server_stats(server).frames_dropped < 100 && sent < 500000; sent++) {
        send_from_node(&frame);
    }
    TEST_ASSERT_EQUAL_UINT32(100, socketcand_server_stats(server).frames_dropped);
    say(slow, "< send 001 0 >"); /* who does not read can still send */
    for (int i = 0; i < PATIENCE_MS && heard_count == 0; i++) {
        run_loop();
        advance_bus(200);
    }
    TEST_ASSERT_EQUAL_INT(1, heard_count);
    expect_frames(slow, sent - 100);

    /* Awake again, and nothing keeps the loop busy. */
    bus_us = UINT64_C(70000000) * 1000;
    send_from_node(&frame);
    expect_frames(slow, 1);
    assert_loop_sleeps();
    close(slow);
}

/* D-SIM-2: python-can reads the answer to rawmode with one recv and takes nothing else along with it. */
static void test_socketcand_server_holds_frames_after_rawmode(void)
{
    static const can_frame_t frame = {.id = 0x005};
    int fd = open_client();
    char byte;

    connect_client(fd);
    handshake(fd);
    bus_us = 24000000 - 47;
    send_from_node(&frame);
    uint64_t start_us = loop_refresh_now_us(loop);

    while (loop_refresh_now_us(loop) < start_us + 5000) {
        run_loop();
    }
    TEST_ASSERT_EQUAL_INT(-1, (int)recv(fd, &byte, 1, MSG_DONTWAIT));
    close(fd);
}

/* The best of several tries counts: the machine may be busy with other things. */
#define TRIES 10

static void test_socketcand_server_hold_ends_with_the_next_element(void)
{
    static const can_frame_t frame = {.id = 0x005};
    uint64_t best_us = UINT64_MAX;

    for (int i = 0; i < TRIES && best_us >= SOCKETCAND_HOLD_MS * 500; i++) {
        int fd = open_client();

        connect_client(fd);
        handshake(fd);
        uint64_t start_us = loop_refresh_now_us(loop);

        bus_us = 24000000 - 47;
        send_from_node(&frame);
        say(fd, "< echo >");
        expect(fd, "< frame 005 24.000000  >< echo >");
        uint64_t took_us = loop_refresh_now_us(loop) - start_us;

        best_us = took_us < best_us ? took_us : best_us;
        close(fd);
    }
    TEST_ASSERT_LESS_THAN_UINT64(SOCKETCAND_HOLD_MS * 500, best_us);
}

/* Two elements in two writes: a client without TCP_NODELAY sends the second when the first is
 * acknowledged. */
static void test_socketcand_server_does_not_delay_acknowledgements(void)
{
    uint64_t best_us = UINT64_MAX;
    int fd = join();

    for (int i = 0; i < TRIES && best_us >= 20000; i++) {
        for (int k = 0; k < 30; k++) {
            expect_nothing_more(fd); /* to and fro: the kernel now counts on an answer to carry it */
        }
        uint64_t start_us = loop_refresh_now_us(loop);

        say(fd, "< send 001 0 >");
        run_loop();
        say(fd, "< send 001 0 >");
        run_loop();
        say(fd, "< send 001 0 >");
        for (int k = 0; k < PATIENCE_MS && bus.waiting < 3; k++) {
            run_loop();
        }
        TEST_ASSERT_EQUAL_UINT32(3, bus.waiting);
        uint64_t took_us = loop_refresh_now_us(loop) - start_us;

        best_us = took_us < best_us ? took_us : best_us;
        advance_bus(0);
        advance_bus(1000);
    }
    TEST_ASSERT_LESS_THAN_UINT64(20000, best_us);
    close(fd);
}

/* While frames are held back nothing is written, and so the limit shows exactly. */
static void test_socketcand_server_keeps_64_kb_for_a_client(void)
{
    static const can_frame_t frame = {.id = 0x7FE, .dlc = 8};
    static const char line[] = "< frame 7FE 5000000000.000007 0000000000000000 >";
    const int kept = 65536 / (int)(sizeof line - 1);
    int fd = open_client();

    connect_client(fd);
    handshake(fd);
    bus_us = UINT64_C(5000000000000000);
    for (int i = 0; i < kept; i++) {
        send_from_node(&frame);
    }
    TEST_ASSERT_EQUAL_UINT32(0, socketcand_server_stats(server).frames_dropped);
    send_from_node(&frame);
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(server).frames_dropped);
    expect_frames(fd, kept);
    close(fd);
}

static void test_socketcand_server_hold_ends_by_itself(void)
{
    static const can_frame_t frame = {.id = 0x005};
    int first = open_client();
    int second = open_client();

    connect_client(first);
    handshake(first);
    uint64_t start_us = loop_refresh_now_us(loop);

    while (loop_refresh_now_us(loop) < start_us + 5000) {
        run_loop();
    }
    connect_client(second); /* its hold ends later than the first one's */
    handshake(second);
    bus_us = 24000000 - 47;
    send_from_node(&frame);
    expect(first, "< frame 005 24.000000  >");
    expect(second, "< frame 005 24.000000  >");
    close(first);
    close(second);
}

static void test_socketcand_server_unsupported_kinds_are_counted(void)
{
    static const can_frame_t remote = {.kind = CAN_FRAME_REMOTE};
    static const can_frame_t error = {.kind = CAN_FRAME_ERROR};
    static const can_frame_t fd_frame = {.kind = CAN_FRAME_FD};
    int fd = join();

    send_from_node(&remote);
    send_from_node(&error);
    send_from_node(&fd_frame);
    TEST_ASSERT_EQUAL_UINT32(3, socketcand_server_stats(server).frames_unsupported);
    expect_nothing_more(fd);
    close(fd);
}

static void test_socketcand_server_unfinished_element_at_the_end_is_counted(void)
{
    int fd = join();

    say(fd, "< send 123 1");
    close(fd);
    for (int i = 0; i < PATIENCE_MS && socketcand_server_stats(server).connections > 0; i++) {
        run_loop();
    }
    TEST_ASSERT_EQUAL_UINT32(0, socketcand_server_stats(server).connections);
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(server).bad_elements);
    TEST_ASSERT_FALSE(bus.ports[node + 1].attached);
}

static void test_socketcand_server_answers_before_it_closes(void)
{
    int fd = join();

    say(fd, "< echo >");
    TEST_ASSERT_EQUAL_INT(0, shutdown(fd, SHUT_WR));
    expect(fd, "< echo >");
    expect_end(fd);
    close(fd);
}

static void test_socketcand_server_full_bus_refuses_and_closes(void)
{
    int first = open_client();
    int second = open_client();
    int third = open_client();

    for (int i = node + 2; i < SIM_BUS_PORTS_MAX; i++) {
        TEST_ASSERT_NOT_EQUAL(-1, sim_bus_attach(&bus, NULL, NULL));
    }
    connect_client(first);
    expect(first, "< hi >");
    connect_client(second);
    expect(second, "< error bus full >");
    expect_end(second);
    TEST_ASSERT_EQUAL_UINT32(1, socketcand_server_stats(server).connections);
    close(first);
    for (int i = 0; i < PATIENCE_MS && socketcand_server_stats(server).connections > 0; i++) {
        run_loop();
    }
    connect_client(third); /* the port is free again */
    expect(third, "< hi >");
    close(second);
    close(third);
}

static void test_socketcand_server_without_descriptors_turns_away(void)
{
    struct rlimit before;
    struct rlimit low;
    int waiting = open_client();
    int later = open_client();
    int lowest_free = dup(waiting);

    close(lowest_free);
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_NOFILE, &before));
    low = before;
    low.rlim_cur = (rlim_t)lowest_free;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &low));
    connect_client(waiting);
    for (int i = 0; i < 3; i++) {
        run_loop();
    }
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &before));
    expect_end(waiting);
    connect_client(later);
    expect(later, "< hi >");
    close(waiting);
    close(later);
}

static void test_socketcand_server_can_listen_again_at_once(void)
{
    uint16_t port = socketcand_server_port(server);
    int fd = join();

    socketcand_server_close(server); /* closes first: its side keeps the address in TIME_WAIT */
    expect_end(fd);
    TEST_ASSERT_FALSE(bus.ports[node + 1].attached);
    open_server(port);
    TEST_ASSERT_EQUAL_UINT16(port, socketcand_server_port(server));
    close(fd);
    fd = join();
    close(fd);
}

static void test_socketcand_server_port_in_use_is_one_line(void)
{
    char error[128] = "";
    char expected[128];
    uint16_t port = socketcand_server_port(server);

    TEST_ASSERT_NULL(socketcand_server_open(loop, &bus, port, NULL, NULL, error, sizeof error));
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
    RUN_TEST(test_socketcand_server_full_queue_stops_the_reading);
    RUN_TEST(test_socketcand_server_frames_before_the_end_are_sent);
    RUN_TEST(test_socketcand_server_reset_while_the_queue_is_full);
    RUN_TEST(test_socketcand_server_write_to_a_reset_connection);
    RUN_TEST(test_socketcand_server_slow_reader_loses_whole_frames_and_they_are_counted);
    RUN_TEST(test_socketcand_server_holds_frames_after_rawmode);
    RUN_TEST(test_socketcand_server_hold_ends_by_itself);
    RUN_TEST(test_socketcand_server_hold_ends_with_the_next_element);
    RUN_TEST(test_socketcand_server_does_not_delay_acknowledgements);
    RUN_TEST(test_socketcand_server_keeps_64_kb_for_a_client);
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
