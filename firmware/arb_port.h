/* What the arbitrator needs from outside: a CAN controller, a host, and non-volatile memory. The program that
 * owns an arb_app_t fills in one port. Its functions are called from inside arb_app_* only. None blocks
 * except nvm_read. */
#ifndef ARB_PORT_H
#define ARB_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_frame.h"

/* In the order of the host's statistics group 3. */
typedef enum {
    ARB_PORT_FRAMES_LOST,   /* received, but lost before the application took them */
    ARB_PORT_FRAMES_UNSENT, /* taken by can_send, but known not to have left */
    ARB_PORT_BYTES_LOST,    /* from the host, lost before the application took them */
    ARB_PORT_COUNTERS
} arb_port_counter_t;

typedef struct {
    void *ctx; /* passed to every function; belongs to the program and outlives the application */

    /* Sends one frame; it is copied. False: no room now. The application keeps the frame and offers it again
     * in the next arb_app_step, which the program calls as soon as there is room. */
    bool (*can_send)(void *ctx, const can_frame_t *frame);

    /* Restarts the controller after bus-off. NULL: it recovers by itself. */
    void (*can_restart)(void *ctx);

    /* Writes up to size bytes to the host; they are copied. Returns how many were taken; less than size means
     * no room now: the program calls arb_app_step as soon as there is some. */
    size_t (*host_write)(void *ctx, const uint8_t *bytes, size_t size);

    /* Reads size bytes of non-volatile memory: any number from arb_app_init, later 128 at most, and never
     * while a write is under way. Takes as long as the bus to the memory needs (24LC256: 25 us a byte).
     * False: failed; at the start what could not be read counts as empty. */
    bool (*nvm_read)(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size);

    /* Starts to write size bytes, at most ARB_PORT_NVM_PAGE and inside one page. False: busy or failed. */
    bool (*nvm_write)(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size);

    /* The write started last: 0 done, 1 under way, -1 failed. */
    int8_t (*nvm_status)(void *ctx);

    /* What the drivers have counted since the start. NULL: they count nothing. */
    uint32_t (*counter)(void *ctx, arb_port_counter_t counter);

    /* Takes a request of the host that has been answered, for a log: its message, its payload, and ARB_OK or
     * the error (arb_error.h). The payload may be too short if there was an error, and stands there until
     * the function returns. NULL: nobody wants to know. */
    void (*host_served)(void *ctx, uint16_t message, const uint8_t *payload, uint16_t len, uint8_t error);
} arb_port_t;

#define ARB_PORT_NVM_PAGE 64u /* a write never crosses a multiple of this */

#endif
