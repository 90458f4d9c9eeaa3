#include "tcp_listener.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <stddef.h>
#include <sys/socket.h>
#include <unistd.h>

#define BACKLOG 128

/* Returns the listening socket, or -1: errno says why. */
static int open_socket(uint16_t port)
{
    struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    int on = 1;
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0) {
        return -1;
    }
    if (setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
        bind(fd, (const struct sockaddr *)&address, sizeof address) != 0 || listen(fd, BACKLOG) != 0) {
        int reason = errno;
        close(fd);
        errno = reason;
        return -1;
    }
    return fd;
}

static int open_spare(void)
{
    return open("/dev/null", O_RDONLY | O_CLOEXEC);
}

bool tcp_listener_open(tcp_listener_t *listener, uint16_t port)
{
    listener->fd = open_socket(port);
    if (listener->fd < 0) {
        return false;
    }
    listener->spare_fd = open_spare();
    return listener->spare_fd >= 0;
}

void tcp_listener_close(tcp_listener_t *listener)
{
    if (listener->fd >= 0) {
        close(listener->fd);
    }
    if (listener->spare_fd >= 0) {
        close(listener->spare_fd);
    }
    *listener = TCP_LISTENER_CLOSED;
}

/* Accepts a client with the spare descriptor and closes it: in the backlog it would wake the loop without
 * end. False: that did not help. */
static bool turn_away(tcp_listener_t *listener)
{
    if (listener->spare_fd < 0) {
        return false;
    }
    close(listener->spare_fd);
    int fd = accept4(listener->fd, NULL, NULL, SOCK_CLOEXEC);
    if (fd >= 0) {
        close(fd);
    }
    listener->spare_fd = open_spare();
    return fd >= 0;
}

int tcp_listener_accept(tcp_listener_t *listener)
{
    int fd;
    do {
        fd = accept4(listener->fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
    } while (fd < 0 && (errno == EMFILE || errno == ENFILE) && turn_away(listener));
    return fd;
}

uint16_t tcp_listener_port(const tcp_listener_t *listener)
{
    struct sockaddr_in address = {.sin_port = 0};
    socklen_t size = sizeof address;
    (void)getsockname(listener->fd, (struct sockaddr *)&address, &size);
    return ntohs(address.sin_port);
}
