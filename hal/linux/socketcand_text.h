/* The text of the socketcand protocol, for its client and its server. Pure: no I/O. Private to the two ends.
 *
 * Everything on the wire is an element, "< word word ... >". In raw mode these carry frames:
 *
 *   < send ID DLC BYTE... >    client to server; a byte has one or two digits
 *   < frame ID TIME DATA >     server to client; TIME is SECONDS.MICROSECONDS, a byte of DATA has two digits
 *   < error ID TIME >          server to client; the bus controller reports an error
 *   < error TEXT >             server to client; the server refuses an element
 *
 * ID, BYTE and DATA are hexadecimal. An ID of up to three digits is a base one, a longer one is extended; the
 * identifier of an extended frame is not kept, as everywhere in this project. */
#ifndef SOCKETCAND_TEXT_H
#define SOCKETCAND_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_frame.h"

#define SOCKETCAND_TEXT_MAX 255        /* characters between "<" and ">" that a splitter can keep */
#define SOCKETCAND_TEXT_FRAME_BYTES 64 /* room for any element that carries a frame, its zero included */

/* A part of an element; no zero ends it, and it is valid as long as what it points into. */
typedef struct {
    const char *text;
    size_t length;
} socketcand_text_t;

/* --- elements --- */

/* What a character has led to. */
typedef enum {
    SOCKETCAND_TEXT_MORE,     /* nothing yet */
    SOCKETCAND_TEXT_STRAY,    /* text stands between elements; told once up to the next "<" */
    SOCKETCAND_TEXT_TOO_LONG, /* the element exceeds longest; told once, its end follows as ELEMENT */
    SOCKETCAND_TEXT_ELEMENT   /* the element is complete */
} socketcand_text_event_t;

/* Cuts a stream of characters into elements. The owner sets the first two members and zeroes the rest. */
typedef struct {
    size_t longest; /* characters between "<" and ">" that are kept, up to SOCKETCAND_TEXT_MAX */
    bool restarts;  /* a "<" inside begins a new element, so that a mangled one spoils no other; otherwise it
                       is a character of the element like any */
    bool inside;    /* "<" has come, ">" has not */
    bool cut;       /* the element was longer: text is its beginning */
    bool stray;     /* STRAY has been told */
    size_t length;
    char text[SOCKETCAND_TEXT_MAX]; /* what stands between "<" and ">"; valid up to the next character */
} socketcand_text_splitter_t;

socketcand_text_event_t socketcand_text_take(socketcand_text_splitter_t *splitter, char c);

/* The text of the element that the splitter holds. */
socketcand_text_t socketcand_text_element(const socketcand_text_splitter_t *splitter);

/* --- words --- */

/* White space is a blank, a tab, a carriage return or a line feed. */
bool socketcand_text_is_space(char c);

/* Takes the next word off *rest. False: none is left, *word is empty. */
bool socketcand_text_next(socketcand_text_t *rest, socketcand_text_t *word);

/* Splits text into at most max words and returns their number. */
size_t socketcand_text_split(socketcand_text_t text, socketcand_text_t *words, size_t max);

bool socketcand_text_is(socketcand_text_t word, const char *expected);

/* --- frames --- */

/* Reads what follows the word "frame". More than eight bytes make a CAN FD frame of the first eight. False:
 * it is malformed, *frame is undefined. */
bool socketcand_text_parse_frame(socketcand_text_t rest, can_frame_t *frame);

/* Reads what follows the word "error". True: a bus controller reports an error; false: the server refuses. */
bool socketcand_text_parse_error(socketcand_text_t rest);

/* Reads the words that follow "send"; there are two at least. Returns what is wrong with them, or NULL. */
const char *socketcand_text_parse_send(const socketcand_text_t *words, size_t count, can_frame_t *frame);

/* Both write an element of at most SOCKETCAND_TEXT_FRAME_BYTES and return its length. Without data the
 * "frame" element has two blanks at its end: python-can counts on both. */
size_t socketcand_text_format_frame(char *line, size_t size, uint64_t time_us, const can_frame_t *frame);
size_t socketcand_text_format_send(char *line, size_t size, const can_frame_t *frame);

#endif
