/* The host of an application on a bench (exchange.h): messages are sent and expected as text in hexadecimal,
 * whole, with their checksums, or built from their payload. */
#ifndef HOSTLINK_H
#define HOSTLINK_H

#include "exchange.h"

/* A fresh application with this host, at now_ms 0xFFFFFF00. Its memory is empty; it makes no links by
 * itself. */
void hostlink_start(exchange_t *x, arb_app_t *app, bool strict);

/* The line takes so many more bytes, and then none; from the start: without end. */
void hostlink_room(size_t bytes);
size_t hostlink_room_left(void);

/* False: every write to the memory fails. */
void hostlink_memory_works(bool works);

/* The host sends bytes, then a step. */
void hostlink_bytes(exchange_t *x, const uint8_t *bytes, size_t len);
void hostlink_send(exchange_t *x, const char *text);

/* The host sends a message with right checksums, then a step. */
void hostlink_ask(exchange_t *x, uint16_t id, uint8_t reference, const uint8_t *payload, uint16_t len);

/* The oldest message that the host has not looked at yet is this one. */
void hostlink_expect(const char *text);
void hostlink_answer(uint16_t id, uint8_t reference, const uint8_t *payload, uint16_t len);

/* The same with reference 1, for the exchange that was started; the answer is an error. */
void hostlink_request(uint16_t id, const uint8_t *payload, uint16_t len);
void hostlink_reply(uint16_t id, const uint8_t *payload, uint16_t len);
void hostlink_error(uint16_t id, uint8_t error);

/* Takes the oldest whole message: its id, and *len bytes of payload; 0: there is none. payload is valid until
 * the next call. */
uint16_t hostlink_take(const uint8_t **payload, uint16_t *len);

/* Bytes that the host has not looked at yet. */
size_t hostlink_waiting(void);

/* The host has nothing more to look at. */
void hostlink_silence(void);

/* A payload and its length. */
#define BYTES(...) (const uint8_t[]){__VA_ARGS__}, (uint16_t)sizeof((const uint8_t[]){__VA_ARGS__})

/* What payloads name the devices of exchange.h by, and one that is not there. */
#define DEV_OUT 2, 0, 2, 0, 4, 0 /* 0002:0002:0004, id 11h, output 1 */
#define DEV_IN 2, 0, 2, 0, 6, 0  /* 0002:0002:0006, id 12h, input 1 */
#define DEV_NONE 9, 0, 9, 0, 9, 0

#endif
