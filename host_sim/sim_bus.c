#include "sim_bus.h"

#include <string.h>

#define CRC15_POLYNOMIAL 0x4599u
#define CRC15_MASK 0x7FFFu
#define STUFF_RUN 5u /* after five equal bits one of the other level follows */

/* CRC delimiter, ACK slot, ACK delimiter and seven bits of end of frame: never stuffed. */
#define TAIL_BITS 10u

/* Six bits of error flag, up to six more of the others' flags, eight of delimiter. */
#define ERROR_FRAME_BITS 20u

/* The bits of a frame in the order of the wire, counted instead of kept. */
typedef struct {
    uint16_t crc;
    unsigned bits; /* stuff bits included */
    unsigned level;
    unsigned run; /* equal bits at the end, the last stuff bit included */
} bit_count_t;

static void put_bits(bit_count_t *count, uint32_t value, unsigned width)
{
    for (unsigned left = width; left > 0; left--) {
        unsigned bit = (unsigned)(value >> (left - 1)) & 1u;
        unsigned carry = ((unsigned)count->crc >> 14) ^ bit;

        count->crc = (uint16_t)(((unsigned)count->crc << 1) & CRC15_MASK);
        if (carry != 0) {
            count->crc ^= CRC15_POLYNOMIAL;
        }
        count->run = bit == count->level ? count->run + 1 : 1;
        count->level = bit;
        count->bits++;
        if (count->run == STUFF_RUN) {
            count->level = 1u - bit;
            count->run = 1;
            count->bits++;
        }
    }
}

unsigned sim_bus_frame_bits(const can_frame_t *frame)
{
    bit_count_t count = {.crc = 0, .bits = 0, .level = 1, .run = 0};
    uint32_t id = frame->id & CAN_FRAME_ID_MAX;
    unsigned dlc = frame->dlc <= CAN_FRAME_DATA_MAX ? frame->dlc : CAN_FRAME_DATA_MAX;
    bool remote = frame->kind == CAN_FRAME_REMOTE;

    if (frame->kind == CAN_FRAME_ERROR) {
        return ERROR_FRAME_BITS;
    }
    put_bits(&count, 0, 1); /* start of frame */
    if (frame->kind == CAN_FRAME_EXTENDED) {
        put_bits(&count, 0, 11); /* upper eleven of 29 bits */
        put_bits(&count, 3, 2);  /* SRR and IDE, recessive */
        put_bits(&count, id, 18);
        put_bits(&count, 0, 3); /* RTR, r1, r0 */
    } else {
        put_bits(&count, id, 11);
        put_bits(&count, remote ? 4 : 0, 3); /* RTR, IDE, r0 */
    }
    put_bits(&count, dlc, 4);
    for (unsigned i = 0; i < dlc && !remote; i++) {
        put_bits(&count, frame->data[i], 8);
    }
    put_bits(&count, count.crc, 15);
    return count.bits + TAIL_BITS;
}

/* What arbitration compares, lowest wins: the identifier, then the order of kinds that the RTR, SRR and IDE
 * bits after it give. */
static unsigned rank(const can_frame_t *frame)
{
    static const uint8_t kind_rank[] = {
        [CAN_FRAME_BASE] = 0,     [CAN_FRAME_FD] = 1,    [CAN_FRAME_REMOTE] = 2,
        [CAN_FRAME_EXTENDED] = 3, [CAN_FRAME_ERROR] = 0,
    };
    unsigned kind = frame->kind < sizeof kind_rank ? frame->kind : (unsigned)CAN_FRAME_BASE;

    return ((unsigned)frame->id & CAN_FRAME_ID_MAX) * 4u + kind_rank[kind];
}

void sim_bus_init(sim_bus_t *bus)
{
    memset(bus, 0, sizeof *bus);
    bus->sender = -1;
    bus->delivering = -1;
    bus->idle = true;
}

int sim_bus_attach(sim_bus_t *bus, sim_bus_receive_t receive, void *ctx)
{
    for (int i = 0; i < SIM_BUS_PORTS_MAX; i++) {
        sim_bus_port_t *port = &bus->ports[i];

        if (!port->attached) {
            port->attached = true;
            port->joining = bus->sender >= 0;
            port->cut = false;
            port->queued = 0;
            port->receive = receive;
            port->ctx = ctx;
            bus->ports_end = i < bus->ports_end ? bus->ports_end : i + 1;
            return i;
        }
    }
    return -1;
}

static bool is_attached(const sim_bus_t *bus, int port)
{
    return port >= 0 && port < SIM_BUS_PORTS_MAX && bus->ports[port].attached;
}

/* The port's frames compete no longer. */
static void withdraw_frames(sim_bus_t *bus, int port)
{
    bus->waiting -= bus->ports[port].cut ? 0u : bus->ports[port].queued;
    if (bus->waiting == 0 && bus->sender < 0) {
        bus->idle = true; /* the step that waited for the interframe space has nothing left to start */
    }
}

void sim_bus_detach(sim_bus_t *bus, int port)
{
    if (!is_attached(bus, port)) {
        return;
    }
    withdraw_frames(bus, port);
    bus->ports[port].attached = false;
    bus->ports[port].queued = 0;
}

void sim_bus_cut(sim_bus_t *bus, int port, bool cut)
{
    if (!is_attached(bus, port) || bus->ports[port].cut == cut) {
        return;
    }
    if (cut) {
        withdraw_frames(bus, port);
    } else {
        bus->waiting += bus->ports[port].queued;
        bus->ports[port].joining = bus->sender >= 0;
    }
    bus->ports[port].cut = cut;
}

bool sim_bus_send(sim_bus_t *bus, int port, const can_frame_t *frame)
{
    if (!is_attached(bus, port) || bus->ports[port].queued == SIM_BUS_QUEUE_MAX) {
        return false;
    }
    can_frame_t *queue = bus->ports[port].queue;
    unsigned place = bus->ports[port].queued;

    for (; place > 0 && rank(&queue[place - 1]) > rank(frame); place--) {
        queue[place] = queue[place - 1];
    }
    queue[place] = *frame;
    bus->ports[port].queued++;
    bus->waiting += bus->ports[port].cut ? 0u : 1u;
    return true;
}

/* Puts the winner of the arbitration on the wire, of equals that of the lowest port (D-SIM-1). At least one
 * frame is waiting. */
static void start_frame(sim_bus_t *bus)
{
    int winner = -1;
    unsigned lowest = 0;

    for (int i = 0; i < bus->ports_end; i++) {
        if (bus->ports[i].queued > 0 && !bus->ports[i].cut) {
            unsigned offered = rank(&bus->ports[i].queue[0]);

            if (winner < 0 || offered < lowest) {
                winner = i;
                lowest = offered;
            }
        }
    }
    sim_bus_port_t *port = &bus->ports[winner];

    bus->on_wire = port->queue[0];
    port->queued--;
    memmove(&port->queue[0], &port->queue[1], port->queued * sizeof port->queue[0]);
    bus->waiting--;
    bus->sender = winner;
    bus->frame_end_us = bus->idle_from_us + sim_bus_frame_bits(&bus->on_wire);
}

static void deliver_frame(sim_bus_t *bus)
{
    int sender = bus->sender;

    bus->busy_us += bus->frame_end_us - bus->idle_from_us + SIM_BUS_INTERFRAME_BITS;
    bus->idle_from_us = bus->frame_end_us + SIM_BUS_INTERFRAME_BITS;
    bus->frames++;
    bus->sender = -1;
    bus->delivering = sender;
    const bool lost = bus->fault != NULL && bus->fault(bus->fault_ctx, &bus->on_wire);
    for (int i = 0; i < bus->ports_end; i++) {
        sim_bus_port_t *port = &bus->ports[i];

        if (port->attached && !port->joining && !port->cut && !lost && i != sender && port->receive != NULL) {
            port->receive(port->ctx, bus->frame_end_us, &bus->on_wire);
        }
        port->joining = false;
    }
    bus->delivering = -1;
}

uint64_t sim_bus_step(sim_bus_t *bus, uint64_t now_us)
{
    if (bus->idle && bus->waiting > 0) {
        bus->idle = false;
        bus->idle_from_us = bus->idle_from_us > now_us ? bus->idle_from_us : now_us;
    }
    for (;;) {
        if (bus->sender >= 0) {
            if (bus->frame_end_us > now_us) {
                return bus->frame_end_us;
            }
            deliver_frame(bus);
        }
        if (bus->waiting == 0) {
            bus->idle = true;
            return SIM_BUS_NEVER;
        }
        if (bus->idle_from_us > now_us) {
            return bus->idle_from_us;
        }
        start_frame(bus);
    }
}
