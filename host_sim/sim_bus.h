/* A CAN bus in memory: arbitration by identifier and bit time, as a real one has them.
 *
 * Passive: time goes in, deliveries come out. So the same bus runs on the real clock (pdcpd) and on a virtual
 * one (tests). At 1 Mbit/s one bit is one microsecond: all times here are
 * microseconds, 64 bits wide, on the caller's clock.
 *
 * Every port is one controller. It holds a queue of frames and offers the one with the lowest identifier,
 * oldest first among equals, as a controller with transmit buffers by priority does. When the bus is idle,
 * the lowest offered identifier of all ports wins (port number decides between equals, D-SIM-1), occupies the
 * bus for its own length with its own stuff bits plus three bits of interframe space, and is then delivered
 * to every other attached port. With equal identifiers a base data frame goes before a remote frame, and that
 * before an extended frame, as their bits after the identifier have it.
 *
 * When a frame starts. The bus is idle when the last sim_bus_step found nothing under way and nothing
 * waiting. Frames offered to an idle bus start at the now_us of the next sim_bus_step, or at idle_from_us if
 * that is later. Frames offered while it is not idle, in a receive callback too, compete for the instant at
 * which the bus becomes free, however late sim_bus_step is called. A caller that offers a frame at a chosen
 * time therefore calls sim_bus_step for that time both before and after sim_bus_send: then deliveries do not
 * depend on how often it is called in between. */
#ifndef SIM_BUS_H
#define SIM_BUS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_frame.h"

#define SIM_BUS_PORTS_MAX 96
#define SIM_BUS_QUEUE_MAX 16
#define SIM_BUS_NEVER UINT64_MAX
#define SIM_BUS_INTERFRAME_BITS 3u

/* A frame has arrived at this port. time_us: the end of its last bit. frame is valid during the call. Runs
 * inside sim_bus_step; may call sim_bus_send for any port, which then competes for the bus from the end of
 * the interframe space on, but must not attach, detach or step. */
typedef void (*sim_bus_receive_t)(void *ctx, uint64_t time_us, const can_frame_t *frame);

typedef struct {
    bool attached;
    bool joining; /* attached while a frame was on the wire: does not hear that one */
    bool cut;     /* its plug is loose: hears and sends nothing, keeps its queue */
    uint8_t queued;
    can_frame_t queue[SIM_BUS_QUEUE_MAX]; /* sorted: what leaves first stands first */
    sim_bus_receive_t receive;
    void *ctx;
} sim_bus_port_t;

/* A fault of the line: true means that nobody receives this frame (its sender believes that it was sent). */
typedef bool (*sim_bus_fault_t)(void *ctx, const can_frame_t *frame);

/* To be read by everybody, written by sim_bus.c alone (but for the fault). About 22 KB. */
typedef struct {
    sim_bus_port_t ports[SIM_BUS_PORTS_MAX];
    int ports_end; /* no port from here on has ever been attached */
    can_frame_t on_wire;
    int sender;            /* port of the frame on the wire; -1: none is */
    int delivering;        /* port of the frame that is being delivered, inside callbacks; otherwise -1 */
    bool idle;             /* the last step found nothing under way and nothing waiting */
    uint32_t waiting;      /* frames in all queues */
    uint64_t frame_end_us; /* end of the last bit of the frame on the wire */
    uint64_t idle_from_us; /* end of the last interframe space */
    sim_bus_fault_t fault; /* NULL: a perfect line; set by whoever owns the bus */
    void *fault_ctx;
    uint64_t frames;  /* delivered since the start */
    uint64_t busy_us; /* bus time of the delivered frames, interframe space included */
} sim_bus_t;

void sim_bus_init(sim_bus_t *bus);

/* Attaches a port and returns its number, or -1 when all are taken. The lowest free number is given. receive
 * may be NULL for a port that only sends; ctx must live until sim_bus_detach. A frame that is on the wire
 * just now is not delivered to the new port. */
int sim_bus_attach(sim_bus_t *bus, sim_bus_receive_t receive, void *ctx);

/* Removes a port. Its waiting frames are forgotten; the one on the wire is still delivered to the others.
 * Does nothing when the port is not attached. */
void sim_bus_detach(sim_bus_t *bus, int port);

/* Cuts a port's line, or mends it. A port that is cut hears nothing and takes no part in arbitration; its
 * queue fills and is sent when the line is mended, as a controller sends what nobody acknowledged. Its frame
 * that is on the wire just now still arrives. Does nothing when the port is not attached. */
void sim_bus_cut(sim_bus_t *bus, int port, bool cut);

/* Copies a frame into the port's queue. False: the queue is full or the port is not attached. Frames that are
 * not of the kind CAN_FRAME_BASE travel as well, each with its own bit time. */
bool sim_bus_send(sim_bus_t *bus, int port, const can_frame_t *frame);

/* Carries the bus on to now_us: delivers what has ended by then and starts what can start. Returns the time
 * at which it wants to be called again, later than now_us; SIM_BUS_NEVER when nothing is under way or
 * waiting. A now_us below that of an earlier call changes nothing. */
uint64_t sim_bus_step(sim_bus_t *bus, uint64_t now_us);

/* Bits that this frame takes on the wire, from start of frame to end of frame with its own stuff bits,
 * without the three bits of interframe space. ISO 11898-1; base data frame of 8 bytes: 108 to 132 bits.
 * Exact for base and extended data frames and for base remote frames; an extended frame counts with its id as
 * the low bits of the identifier. No PDCP device sends the other kinds: an error frame counts with its
 * longest form of 20 bits, a CAN FD frame as a base data frame. A dlc above 8 counts as 8. */
unsigned sim_bus_frame_bits(const can_frame_t *frame);

#endif
