/* A listening TCP socket on 127.0.0.1. It does not block: the owner watches fd and accepts when fd is
 * readable. */
#ifndef TCP_LISTENER_H
#define TCP_LISTENER_H

#include <stdbool.h>
#include <stdint.h>

/* TCP_LISTENER_CLOSED before it is opened. */
typedef struct {
    int fd;       /* -1: not open */
    int spare_fd; /* given up for a moment to refuse a client when descriptors have run out */
} tcp_listener_t;

#define TCP_LISTENER_CLOSED ((tcp_listener_t){.fd = -1, .spare_fd = -1})

/* Listens on 127.0.0.1:port, 0 for any free one. False: errno says why; tcp_listener_close frees the rest. */
bool tcp_listener_open(tcp_listener_t *listener, uint16_t port);

/* Closes what is open; the owner has stopped watching fd. */
void tcp_listener_close(tcp_listener_t *listener);

/* Returns the socket of the next client that waits, which the caller closes, or -1 when none waits. Clients
 * for whom no descriptor is left are turned away. */
int tcp_listener_accept(tcp_listener_t *listener);

uint16_t tcp_listener_port(const tcp_listener_t *listener);

#endif
