/* Ends of links: what the tables say of an input or output, and what is still to be done with it.
 *
 * A channel's todo holds the notes; pdcp_link starts them one at a time, pdcp_job carries them out. Both and
 * the audit stand above this file. A channel is named by its number; PDCP_NONE stands for no channel and is
 * allowed wherever a function here says so. */
#ifndef PDCP_ENDS_H
#define PDCP_ENDS_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bus.h"

/* What only silences a channel. */
#define PDCP_ENDS_SILENCES ((unsigned)PDCP_TODO_SILENCE | (unsigned)PDCP_TODO_AGAIN)

/* The channel with this number; PDCP_NONE gives NULL. */
pdcp_channel_t *pdcp_ends_channel(pdcp_bus_t *bus, uint8_t number);

/* Place of the device that a channel belongs to; PDCP_NONE gives PDCP_NONE. */
uint8_t pdcp_ends_place(const pdcp_bus_t *bus, uint8_t number);

/* Is the channel's device set up? Not that of PDCP_NONE. */
bool pdcp_ends_is_ready(pdcp_bus_t *bus, uint8_t number);

/* The output that an input names as its source, if another device has it and is set up; else PDCP_NONE. An
 * unconnected input names none. */
uint8_t pdcp_ends_source(const pdcp_bus_t *bus, const pdcp_channel_t *input);

/* An input that an active link feeds from this output; PDCP_NONE: there is none. */
uint8_t pdcp_ends_listener(const pdcp_bus_t *bus, uint8_t output);

/* Notes what is to be done, which marks the links as due and changed. A silence that is needed is never
 * forgotten: what was noted before stays, until its own job begins, its device is lost, or a job is noted
 * that silences the input as well, whatever comes of it. Making a link begins with the input off, and
 * silences it again when it fails or cannot start. Taking one away silences the input, and leaves nothing to
 * be made. */
void pdcp_ends_note(pdcp_bus_t *bus, uint8_t number, pdcp_todo_t todo);

/* Takes notes (a set of pdcp_todo_t) back: they were carried out, or something else does it. */
void pdcp_ends_drop(pdcp_channel_t *channel, unsigned todo);

/* Notes that an output is to be disabled, if no active link needs it any more. PDCP_NONE: nothing. */
void pdcp_ends_release(pdcp_bus_t *bus, uint8_t output);

/* Notes that a channel that is still enabled is told not to be, until it answers or its device is lost
 * (D-BUS-22). PDCP_NONE: nothing. */
void pdcp_ends_silence_again(pdcp_bus_t *bus, uint8_t number);

/* A channel has answered that its transfer is not enabled any more. */
void pdcp_ends_on_disabled(pdcp_bus_t *bus, pdcp_channel_t *channel);

/* Answers Update Data Channel of a device for its channel index. */
void pdcp_ends_answer_update(pdcp_bus_t *bus, uint8_t place, uint8_t index, bool connected);

#endif
