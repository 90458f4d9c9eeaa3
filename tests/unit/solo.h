/* A device of the device role alone on a bus: frames are handed in and expected as data in hexadecimal, with
 * spaces wherever they help. The clock starts shortly before it wraps, so that every test but the shortest
 * ones crosses 2^32. Device 0002:0003:0004h, with id 10h once bound. */
#ifndef SOLO_H
#define SOLO_H

#include "pdcp_device.h"

/* Identifiers (P << 9 | M << 8 | N). */
enum {
    SOLO_ID = 0x10,
    SOLO_BIND = 0x600 | SOLO_ID,   /* P=3 M=0 */
    SOLO_TO = 0x300 | SOLO_ID,     /* P=1 M=1 */
    SOLO_FROM = 0x200 | SOLO_ID,   /* P=1 M=0 */
    SOLO_BEACON = 0x000 | SOLO_ID, /* P=0 M=0 */
    SOLO_TO_ALL = 0x300,
    SOLO_ARB_BEACON = 0x100
};

/* What the application was told. */
typedef struct {
    unsigned inputs;
    unsigned safes;
    unsigned stores;
    unsigned resets;
    unsigned written;
    uint8_t channel;
    uint8_t len;
    uint8_t data[8];
    pdcp_device_record_t record;
} solo_seen_t;

extern uint32_t solo_now;
extern pdcp_device_t solo_dev;
extern solo_seen_t solo_seen;

/* Inputs 1 and 2, of which 2 is terminal, and output 3. Extras: 50h of channel 3 (writable), 51h of the
 * device. */
extern const pdcp_device_desc_t solo_desc;
extern const pdcp_device_port_t solo_port;
extern char solo_long_text[1601]; /* the descriptor, 1600 bytes */
extern uint8_t solo_gain[16];     /* extra 50h */
extern uint16_t solo_gain_len;
extern uint8_t solo_bulk_bytes[12];

/* For setUp: nothing was seen yet, and the device is switched off. */
void solo_reset(void);

can_frame_t solo_frame(unsigned id, const char *hex);

/* Does what is due; returns the next deadline. */
uint32_t solo_step(void);

/* Hands a frame in, then steps. */
void solo_rx(unsigned id, const char *hex);

/* The next frame that leaves must be this one. No frame leaves. */
void solo_check_tx(unsigned line, unsigned id, const char *hex);
void solo_check_quiet(unsigned line);
#define SOLO_TX(id, hex) solo_check_tx(__LINE__, (id), (hex))
#define SOLO_QUIET() solo_check_quiet(__LINE__)
#define SOLO_ANSWERED(request, answer)                                                                       \
    do {                                                                                                     \
        solo_rx(SOLO_TO, (request));                                                                         \
        SOLO_TX(SOLO_FROM, (answer));                                                                        \
        SOLO_QUIET();                                                                                        \
    } while (0)

/* Moves the time on, then steps. */
void solo_advance(uint32_t ms);

/* Time passes; the arbitrator is heard, beacons are thrown away, anything else fails the test. */
void solo_pass(uint32_t ms);

/* Powers the device on; record may be NULL. */
void solo_boot(const pdcp_device_record_t *record);

/* A record without sources. */
pdcp_device_record_t solo_blank_record(uint8_t node_id);

/* Powered on, bound to id 10h, first beacon taken. */
void solo_bind_with(const pdcp_device_record_t *record);
void solo_bind_blank(void);

/* Input 1 listens to 21h, input 2 to 22h, output 3 sends as 23h. */
void solo_link_all(void);

#endif
