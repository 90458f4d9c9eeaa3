/* A simulated bus with the socketcand server, which clients join over real loopback sockets. The bus runs on
 * a clock of the test. A client is the descriptor of its socket; the test closes it. */
#ifndef SERVED_H
#define SERVED_H

#include "loop.h"
#include "sim_bus.h"
#include "socketcand_server.h"

enum {
    SERVED_PATIENCE_MS = 3000, /* rounds of the loop before something has failed */
    SERVED_LOG_MAX = 4096
};

typedef struct {
    loop_t *loop;
    sim_bus_t bus;
    socketcand_server_t *server;
    uint64_t bus_us; /* the bus's clock */
    int changes;     /* how often the server said that the bus has changed */
    int node;        /* a port of the bus without a socket: logs what it hears */
    can_frame_t heard[SERVED_LOG_MAX];
    int heard_count;
} served_t;

extern served_t served;

/* For setUp: a bus with a server at any port; for tearDown. */
void served_start(void);
void served_stop(void);

/* Another server, at this port. */
void served_open(uint16_t port);

/* One round of the loop; waits for a millisecond at most. */
void served_run_loop(void);

void served_advance_bus(uint64_t us);

/* Puts a frame on the bus from the node and carries the bus on to its end. */
void served_send_from_node(const can_frame_t *frame);

/* Nothing keeps the loop awake: a handler that is called without end would show here. */
void served_expect_sleep(void);

/* A socket, and its connection to the server. */
int served_open_client(void);
void served_connect_client(int fd);

/* The client says this; the next bytes from the server are these; the server closes the connection. */
void served_say(int fd, const char *text);
void served_expect(int fd, const char *text);
void served_expect_end(int fd);

/* Everything that was said before has been read, and nothing else is on its way to this client. */
void served_expect_nothing_more(int fd);

/* A connected client goes into raw mode. */
void served_shake_hands(int fd);

/* A client in raw mode whose frames are not held back any more. */
int served_join(void);

#endif
