/* Lets other processes join the simulated bus: a TCP server on 127.0.0.1 that speaks the socketcand protocol,
 * raw mode. Each connection is one port of the bus.
 *
 * On the wire, as python-can's client has it; socketcand_text.h describes the elements of frames:
 *
 *   server                           client
 *   < hi >                           < open NAME >        any bus name is accepted
 *   < ok >                           < rawmode >
 *   < ok >                           < send 123 3 1 22 33 >
 *   < frame 123 23.424242 012233 >
 *   < echo >                         < echo >             at any time
 *   < error TEXT >                                        answers a malformed element
 *
 * The time of a frame is the bus time at its end. The bus does not keep the identifier of an extended frame:
 * it comes out as 00000000. A frame is not echoed to the connection that sent it. A malformed element is
 * counted; the connection stays. Remote, error and CAN FD frames of the bus have no element here and are
 * counted in frames_unsupported.
 *
 * No frame of a client is lost: while the queue of its port is full the server does not read from the
 * connection, and a connection that the client has closed keeps its port until its frames are on the wire.
 *
 * Clients such as python-can's expect the answer to rawmode alone in one read. Frames for a connection are
 * therefore held back for SOCKETCAND_HOLD_MS after it, or until the client's next element (D-SIM-2). */
#ifndef SOCKETCAND_SERVER_H
#define SOCKETCAND_SERVER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "loop.h"
#include "sim_bus.h"

#define SOCKETCAND_HOLD_MS 50
#define SOCKETCAND_ELEMENT_MAX 256  /* characters from "<" to ">", both included */
#define SOCKETCAND_OUTPUT_MAX 65536 /* bytes kept for one client that reads too slowly */

typedef struct socketcand_server socketcand_server_t;

/* Called inside loop_run_once, when a connection has put frames on the bus or has come or gone: sim_bus_step
 * and socketcand_server_poll are due and may be called at once. Must not close the server. */
typedef void (*socketcand_changed_t)(void *ctx);

typedef struct {
    uint32_t connections;        /* open now */
    uint32_t bad_elements;       /* malformed, since the start */
    uint32_t frames_dropped;     /* frames and answers not delivered to a client that reads too slowly */
    uint32_t frames_unsupported; /* frames of a kind that the protocol cannot carry, once for each client */
} socketcand_stats_t;

/* Listens on 127.0.0.1:port (0: any free one). NULL: error[] holds one line with port and reason. changed may
 * be NULL. The caller owns the result and closes it before loop and bus. */
socketcand_server_t *socketcand_server_open(loop_t *loop, sim_bus_t *bus, uint16_t port,
                                            socketcand_changed_t changed, void *ctx, char *error,
                                            size_t error_size);

/* Closes every connection; what waits in their queues is forgotten. NULL does nothing. */
void socketcand_server_close(socketcand_server_t *server);

/* Writes to the clients what has arrived, and takes up the reading that a full queue had stopped. To be
 * called after each sim_bus_step and not inside it. True: it has put frames on the bus, sim_bus_step is due
 * again. Does not call changed. Costs next to nothing when nothing is pending. In use:
 *
 *   do {
 *       deadline_us = sim_bus_step(bus, now_us);
 *   } while (socketcand_server_poll(server)); */
bool socketcand_server_poll(socketcand_server_t *server);

uint16_t socketcand_server_port(const socketcand_server_t *server);
socketcand_stats_t socketcand_server_stats(const socketcand_server_t *server);

#endif
