/* A simulated device: the device role, a description and its signals. Passive, on the caller's clock in
 * microseconds, so that it runs in pdcp-node, in pdcpd and in virtual time alike.
 *
 * What a terminal input receives, and when it goes to its safe value, is handed to a function;
 * sim_node_format writes it as one JSON object a line. Writable parameters are kept in the description's
 * state file, if it names one. */
#ifndef SIM_NODE_H
#define SIM_NODE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_frame.h"
#include "node_ini.h"
#include "pdcp_device.h"

typedef struct sim_node sim_node_t;

/* What happened at a terminal input. Valid during the call. */
typedef struct {
    uint64_t time_us;
    pdcp_identity_t identity; /* of the device */
    uint8_t channel;
    bool safe;      /* it went to its safe value; nothing was received */
    uint8_t len;    /* bytes in raw */
    uint8_t raw[8]; /* as received */
    bool has_value; /* false: the source's type is float */
    int32_t value;  /* in the source's own units, by parameter 8; safe: the safe value in the channel's own */
} sim_node_event_t;

typedef void (*sim_node_event_fn_t)(void *ctx, const sim_node_event_t *event);

/* An input, terminal or not, has taken a value. */
typedef void (*sim_node_taken_fn_t)(void *ctx, uint8_t channel);

/* Switches a device on. ini must outlive it; on_event may be NULL and must not call functions of this header.
 * NULL: error[] holds one line that names the state file and the reason. The caller owns the result. */
sim_node_t *sim_node_open(const node_ini_t *ini, uint32_t seed, uint64_t now_us, sim_node_event_fn_t on_event,
                          void *ctx, char *error, size_t error_size);

/* Sets who is told of every value that an input takes, before it is passed on; NULL: nobody. */
void sim_node_on_taken(sim_node_t *node, sim_node_taken_fn_t on_taken, void *ctx);

/* Keeps what is to be kept and frees the device. */
void sim_node_close(sim_node_t *node);

/* A frame of the bus, not one of its own. */
void sim_node_on_frame(sim_node_t *node, uint64_t now_us, const can_frame_t *frame);

/* Does what is due. Returns the time at which it wants to be called again; call it after frames, too. */
uint64_t sim_node_step(sim_node_t *node, uint64_t now_us);

/* The frame that is to leave next. False: there is none. As pdcp_device_tx_peek and pdcp_device_tx_pop. */
bool sim_node_tx_peek(const sim_node_t *node, can_frame_t *frame);
void sim_node_tx_pop(sim_node_t *node);

const pdcp_device_t *sim_node_device(const sim_node_t *node);

/* The state file could not be written, so often. */
uint32_t sim_node_store_errors(const sim_node_t *node);

/* Longest line of an event, with its terminator. */
#define SIM_NODE_LINE 128

/* Writes an event as one line, without its end:
 *   {"t_ms":1234,"device":"0002:0002:0006","channel":1,"raw":"f4","value":244}
 *   {"t_ms":1234,"device":"0002:0002:0006","channel":1,"safe":true,"value":0}
 * value is null when it is not known. */
void sim_node_format(char line[SIM_NODE_LINE], const sim_node_event_t *event);

#endif
