/* Conversations with many devices, by their node ids in numbers, on top of exchange.h. Every device is
 * 0002:0002:serial, every output is a 5000h with profile 2120h. */
#ifndef TALK_H
#define TALK_H

#include "exchange.h"

extern exchange_t talk;
extern uint8_t talk_bytes[16]; /* for values of the host's requests */

/* For setUp: a fresh arbitrator. */
void talk_reset(void);

/* --- frames: data in hexadecimal, id is the device's --- */

/* A frame from the device comes in; the next frame that leaves goes to the device; the one after the
 * other. */
void talk_from(unsigned id, const char *data);
void talk_to(unsigned id, const char *data);
void talk_answered(unsigned id, const char *request, const char *answer);

/* The device is asked for a parameter. value NULL: it does not support it. */
void talk_read(unsigned id, unsigned param, unsigned channel, const char *value);

/* A parameter is written, and answered with this response code, with success, or with failure. */
void talk_written(unsigned id, unsigned param, unsigned channel, const char *value, const char *result);
void talk_wrote(unsigned id, unsigned param, unsigned channel, const char *value);
void talk_refused(unsigned id, unsigned param, unsigned channel, const char *value);

/* --- devices --- */

/* A device asks to bind with id; it asked for `asked` and is told id; it beacons. */
void talk_asks_for(unsigned id, unsigned serial);
void talk_is_told(unsigned asked, unsigned id, unsigned serial);
void talk_beacon(unsigned id);

/* Parts of a setup: the device itself; the directions of its channels, one letter each, i or o; an output,
 * which gets out_id; an input. */
void talk_set_up_device(unsigned id, unsigned serial, unsigned channels);
void talk_set_up_directions(unsigned id, const char *channels);
void talk_set_up_output(unsigned id, unsigned channel, unsigned out_id);
void talk_set_up_input(unsigned id, unsigned channel);

/* A whole setup. The first output gets out_id, the next one the id below it. */
void talk_set_up(unsigned id, unsigned serial, const char *channels, unsigned out_id);

/* A device asks and is bound; is bound, set up, and beacons. */
void talk_bind(unsigned id, unsigned serial);
void talk_add(unsigned id, unsigned serial, const char *channels, unsigned out_id);

/* The host resets a device, which answers and is lost at once. */
void talk_lose(uint8_t place, unsigned id);

/* --- channels and links --- */

/* A channel's number and entry, by place and channel index. */
uint8_t talk_number(uint8_t place, uint8_t index);
const pdcp_channel_t *talk_channel(uint8_t place, uint8_t index);

/* The host asks for the link of channel 1 of one place to channel 1 of another. */
void talk_ask_link(uint8_t out_node, uint8_t in_node);

/* Input 1 is told its source, output 1 of device 0002:0002:serial; is told all that makes a link. */
void talk_name_source(unsigned id, unsigned serial);
void talk_link_input(unsigned id, unsigned serial, unsigned out_device, unsigned out_id);

/* Device 11h, serial 4, with an output FEh, and device 12h, serial 6, with an input; and their link. */
void talk_add_two(void);
void talk_add_two_linked(void);

/* Device id sends Update Data Channel for input 1 and answers 5 and 6 with these values. */
void talk_update(unsigned id, const char *vid_pid, const char *sn_index);

#endif
