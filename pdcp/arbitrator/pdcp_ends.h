/* Ends of links: what the tables say of an input or output, and what still has to be done with it.
 *
 * A channel's todo holds the notes. pdcp_link starts them one at a time, pdcp_job carries them out; both
 * stand above this file, and so does the audit. A channel is given by its number. PDCP_NONE stands for no
 * channel, where a function allows it. */
#ifndef PDCP_ENDS_H
#define PDCP_ENDS_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bus.h"

/* Notes that only silence a channel. */
#define PDCP_ENDS_SILENCES ((unsigned)PDCP_TODO_SILENCE | (unsigned)PDCP_TODO_AGAIN)

/* The channel with this number. PDCP_NONE gives NULL. */
pdcp_channel_t *pdcp_ends_channel(pdcp_bus_t *bus, uint8_t number);

/* Place of a channel's device. PDCP_NONE gives PDCP_NONE. */
uint8_t pdcp_ends_place(const pdcp_bus_t *bus, uint8_t number);

/* Is the channel's device set up? False for PDCP_NONE. */
bool pdcp_ends_is_ready(pdcp_bus_t *bus, uint8_t number);

/* The output that an input names as its source, if it belongs to another device that is set up. PDCP_NONE: it
 * does not, or the input is unconnected. */
uint8_t pdcp_ends_source(const pdcp_bus_t *bus, const pdcp_channel_t *input);

/* An input that hears this output by an active link. PDCP_NONE: there is none. */
uint8_t pdcp_ends_listener(const pdcp_bus_t *bus, uint8_t output);

/* Notes what has to be done, and marks the links as due and changed. A silence is never forgotten: its note
 * stays until its own job begins, its device is lost, or a job is noted that silences the input as well.
 * Making a link does: it begins with the input off, and silences the input again if it fails or cannot start.
 * Removing a link silences the input too, and drops the note to make one. */
void pdcp_ends_note(pdcp_bus_t *bus, uint8_t number, pdcp_todo_t todo);

/* Drops notes (a set of pdcp_todo_t): they were carried out, or something else does it. */
void pdcp_ends_drop(pdcp_channel_t *channel, unsigned todo);

/* Notes that an output must be disabled, unless an active link still needs it. PDCP_NONE: does nothing. */
void pdcp_ends_release(pdcp_bus_t *bus, uint8_t output);

/* Notes that a channel must be disabled if it still is enabled. It is told until it answers or its device is
 * lost (D-BUS-22). PDCP_NONE: does nothing. */
void pdcp_ends_silence_again(pdcp_bus_t *bus, uint8_t number);

/* Notes that a channel has answered a write of transfer enabled 0. */
void pdcp_ends_on_disabled(pdcp_bus_t *bus, pdcp_channel_t *channel);

/* Answers Update Data Channel of a device for its channel index. */
void pdcp_ends_answer_update(pdcp_bus_t *bus, uint8_t place, uint8_t index, bool connected);

#endif
