#define _POSIX_C_SOURCE 200809L
#include "served.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>

#include "unity.h"

served_t served;

static void on_changed(void *ctx)
{
    TEST_ASSERT_EQUAL_PTR(&served.bus, ctx);
    served.changes++;
}

static void on_node_frame(void *ctx, uint64_t time_us, const can_frame_t *frame)
{
    (void)ctx;
    (void)time_us;
    if (served.heard_count < SERVED_LOG_MAX) {
        served.heard[served.heard_count] = *frame;
    }
    served.heard_count++;
}

void served_open(uint16_t port)
{
    char error[128] = "";

    served.server =
        socketcand_server_open(served.loop, &served.bus, port, on_changed, &served.bus, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(served.server, error);
}

void served_start(void)
{
    served.loop = loop_create();
    TEST_ASSERT_NOT_NULL(served.loop);
    sim_bus_init(&served.bus);
    served.bus_us = 1000;
    served.changes = 0;
    served.heard_count = 0;
    served.node = sim_bus_attach(&served.bus, on_node_frame, NULL);
    served_open(0);
}

void served_stop(void)
{
    socketcand_server_close(served.server);
    served.server = NULL;
    loop_destroy(served.loop);
}

void served_run_loop(void)
{
    loop_set_deadline_us(served.loop, loop_refresh_now_us(served.loop) + 1000);
    TEST_ASSERT_TRUE(loop_run_once(served.loop));
}

void served_advance_bus(uint64_t us)
{
    served.bus_us += us;
    do {
        sim_bus_step(&served.bus, served.bus_us);
    } while (socketcand_server_poll(served.server));
}

void served_send_from_node(const can_frame_t *frame)
{
    TEST_ASSERT_TRUE(sim_bus_send(&served.bus, served.node, frame));
    served_advance_bus(0);
    served_advance_bus(200);
}

void served_expect_sleep(void)
{
    uint64_t end_us = loop_refresh_now_us(served.loop) + 20000;
    int rounds = 0;

    for (; loop_refresh_now_us(served.loop) < end_us && rounds < 1000; rounds++) {
        loop_set_deadline_us(served.loop, end_us);
        TEST_ASSERT_TRUE(loop_run_once(served.loop));
    }
    TEST_ASSERT_LESS_THAN(10, rounds);
}

int served_open_client(void)
{
    int fd = socket(AF_INET, SOCK_STREAM, 0);

    TEST_ASSERT_GREATER_OR_EQUAL(0, fd);
    return fd;
}

void served_connect_client(int fd)
{
    struct sockaddr_in address = {.sin_family = AF_INET,
                                  .sin_port = htons(socketcand_server_port(served.server)),
                                  .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};

    TEST_ASSERT_EQUAL_INT(0, connect(fd, (const struct sockaddr *)&address, sizeof address));
}

void served_say(int fd, const char *text)
{
    TEST_ASSERT_EQUAL_INT((int)strlen(text), (int)send(fd, text, strlen(text), MSG_NOSIGNAL));
}

void served_expect(int fd, const char *text)
{
    char got[1024] = "";
    size_t wanted = strlen(text);
    size_t length = 0;

    TEST_ASSERT_LESS_THAN(sizeof got, wanted);
    for (int i = 0; i < SERVED_PATIENCE_MS && length < wanted; i++) {
        ssize_t n = recv(fd, &got[length], wanted - length, MSG_DONTWAIT);

        if (n > 0) {
            length += (size_t)n;
        } else if (n == 0) {
            break;
        } else {
            served_run_loop();
        }
    }
    TEST_ASSERT_EQUAL_STRING(text, got);
}

void served_expect_end(int fd)
{
    char byte;

    for (int i = 0; i < SERVED_PATIENCE_MS; i++) {
        ssize_t n = recv(fd, &byte, 1, MSG_DONTWAIT);

        TEST_ASSERT_LESS_THAN(1, n);
        if (n == 0 || errno == ECONNRESET) {
            return;
        }
        served_run_loop();
    }
    TEST_FAIL_MESSAGE("the connection is still open");
}

void served_expect_nothing_more(int fd)
{
    served_say(fd, "< echo >");
    served_expect(fd, "< echo >");
}

void served_shake_hands(int fd)
{
    served_expect(fd, "< hi >");
    served_say(fd, "< open can0 >");
    served_expect(fd, "< ok >");
    served_say(fd, "< rawmode >");
    served_expect(fd, "< ok >");
}

int served_join(void)
{
    int fd = served_open_client();

    served_connect_client(fd);
    served_shake_hands(fd);
    served_expect_nothing_more(fd);
    return fd;
}
