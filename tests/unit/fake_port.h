/* The one fake of everything that an application needs from outside (arb_port.h): controller, host and
 * memory.
 *
 * Hand &fake.port to the application. The test provides the parts of the memory that it needs, since a small
 * machine runs these tests as well; all else reads as FFh. The fake checks what the contract demands of the
 * application: no write across pages, and none while another is under way. */
#ifndef FAKE_PORT_H
#define FAKE_PORT_H

#include "arb_port.h"

/* A part of the memory from this address on. The bytes are the test's. */
typedef struct {
    uint16_t address;
    uint16_t size;
    uint8_t *bytes;
} fake_region_t;

typedef struct {
    arb_port_t port;

    /* Controller: takes a frame, false: has no room. NULL: never has room, the test takes frames from the
     * queue. */
    bool (*take_frame)(const can_frame_t *frame);

    /* Host: bytes that it has not looked at yet. NULL: it takes everything and forgets it. */
    uint8_t *out;
    size_t out_max;
    size_t out_len;
    size_t room; /* bytes that it still takes */

    /* Memory. No regions: what is written is forgotten. */
    const fake_region_t *regions;
    uint8_t region_count;
    uint8_t write_polls;  /* polls until a write is done */
    bool refuses;         /* takes no write */
    bool fails;           /* takes writes; none reaches the memory, and each ends badly */
    int32_t good_writes;  /* before one fails; -1: none fails */
    int32_t whole_writes; /* before the power fails; -1: it does not */
    uint16_t cut_bytes;   /* of the write that the power cuts */
    int32_t lost_page;    /* address of a page whose writes are taken and lost; -1: none */
    int32_t bad_byte;     /* address of a byte whose lowest bit is always 0; -1: none */

    /* What happened. */
    int writes;
    uint16_t read_most; /* bytes that were read in one call */

    /* The write under way. */
    uint16_t polls_left;
    int8_t status;
} fake_port_t;

/* A controller without room, a host that takes everything, an empty memory without faults. regions must
 * outlive fake; their bytes are set to FFh. */
void fake_port_init(fake_port_t *fake, const fake_region_t *regions, uint8_t region_count);

/* The faults go, the memory keeps what it has: as at the next power-on. */
void fake_port_power_on(fake_port_t *fake);

#endif
