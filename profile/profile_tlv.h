/* Stored configurations as a byte string (profile-layer.md 5) [PROFILE 4.5]. It consists of entries of 3
 * bytes: a code and a 16-bit value, least significant byte first (D-PRO-7). In the order of [PROFILE figure
 * 4.10]:
 *
 *   1 count                                       number of configurations
 *   2 number, 3 count                             a configuration, how many links it has
 *     4 index                                     a link
 *       5 0, 7 8 9 10 11 12 13 14                 its input: type, profile, channel index, owner's VID, PID,
 *                                                 serial number, type, profile
 *       6 0, 7 8 9 10 11 12 13 14                 its output
 *   15 0                                          end */
#ifndef PROFILE_TLV_H
#define PROFILE_TLV_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_bits.h"
#include "profile_config.h"

/* Codes [PROFILE table 4.1]. */
enum {
    PROFILE_TLV_CONFIGURATIONS = 1,
    PROFILE_TLV_CONFIGURATION = 2,
    PROFILE_TLV_LINKS = 3,
    PROFILE_TLV_LINK = 4,
    PROFILE_TLV_INPUT = 5,
    PROFILE_TLV_OUTPUT = 6,
    PROFILE_TLV_TYPE = 7,
    PROFILE_TLV_PROFILE = 8,
    PROFILE_TLV_INDEX = 9,
    PROFILE_TLV_VID = 10,
    PROFILE_TLV_PID = 11,
    PROFILE_TLV_SN = 12,
    PROFILE_TLV_OWNER_TYPE = 13,
    PROFILE_TLV_OWNER_PROFILE = 14,
    PROFILE_TLV_END = 15
};

enum {
    PROFILE_TLV_ENTRY_BYTES = 3,
    PROFILE_TLV_LINK_ENTRIES = 19,
    PROFILE_TLV_LINK_BYTES = 57,         /* what a link takes */
    PROFILE_TLV_CONFIGURATION_BYTES = 6, /* what a configuration takes besides its links */
    PROFILE_TLV_FRAME_BYTES = 6,         /* what the string takes besides its configurations */
    PROFILE_TLV_SET_BYTES = 32,          /* a bit for each number from 0 to 255 */
    PROFILE_TLV_NAMES_BYTES = 16         /* a bit for each hash of an identity (D-BUS-53) */
};

/* Reader ------------------------------------------------------------------------------------------------- */

/* Takes a complete link of configuration `number`. The string may still turn out to be bad. The link belongs
 * to the reader and is valid during the call. Must not call the reader. */
typedef void (*profile_tlv_on_link_t)(void *ctx, uint8_t number, const profile_link_t *link);

typedef enum {
    PROFILE_TLV_MORE = 0,       /* good so far; a string that stops here has no end and is bad */
    PROFILE_TLV_DONE = 1,       /* the end was read and the string is good; whatever follows is ignored */
    PROFILE_TLV_ERR_COUNT = -1, /* a count that does not match */
    PROFILE_TLV_ERR_TWICE = -2, /* an index, a count, a link's input or output given twice */
    PROFILE_TLV_ERR_RANGE = -3, /* configuration 0, or an index above 255 */
    PROFILE_TLV_ERR_PLACE = -4  /* an entry in a wrong place, such as a link outside a configuration */
} profile_tlv_status_t;

/* Reads a string of any length, byte by byte (D-PRO-20). Skips unknown codes, takes missing values as 0, and
 * accepts input and output of a link in either order. Users read numbers and names only. */
typedef struct {
    profile_tlv_on_link_t on_link; /* NULL: nobody is told */
    void *ctx;
    profile_link_t link;                    /* the one being read */
    uint8_t numbers[PROFILE_TLV_SET_BYTES]; /* the configurations so far, bit n: configuration n */
    uint8_t names[PROFILE_TLV_NAMES_BYTES]; /* the devices that its links name so far (profile_tlv_names) */
    uint8_t links[PROFILE_TLV_SET_BYTES];   /* the same for the links of this one */
    uint16_t configurations_told;           /* by code 1 */
    uint16_t links_missing;                 /* told by code 3 but not read; modulo 65536 */
    uint8_t configurations_read;
    uint8_t number; /* of this configuration, 0: none yet */
    uint8_t state;  /* what has been declared */
    uint8_t end;    /* of the link, that values belong to; 0: none */
    uint8_t have;   /* bytes in entry */
    uint8_t entry[PROFILE_TLV_ENTRY_BYTES];
    int8_t status; /* profile_tlv_status_t */
} profile_tlv_t;

/* on_link: NULL, nobody is told. */
void profile_tlv_init(profile_tlv_t *reader, profile_tlv_on_link_t on_link, void *ctx);

/* Takes the next bytes, which are ignored after an error or the end. Returns the status so far. */
profile_tlv_status_t profile_tlv_read(profile_tlv_t *reader, const uint8_t *bytes, uint16_t len);

/* Is a number in the set? */
static inline bool profile_tlv_has(const uint8_t set[PROFILE_TLV_SET_BYTES], uint8_t number)
{
    return pdcp_bit(set, number);
}

/* Does a link name this device? This may be true of a device that no link names: of one in eight when sixteen
 * are named. */
bool profile_tlv_names(const uint8_t names[PROFILE_TLV_NAMES_BYTES], const pdcp_identity_t *identity);

/* Writer ------------------------------------------------------------------------------------------------- */

void profile_tlv_put(uint8_t bytes[PROFILE_TLV_ENTRY_BYTES], uint8_t code, uint16_t value);

/* Entry k, 0 to PROFILE_TLV_LINK_ENTRIES - 1, of a link with this index (from 1 in each configuration). */
void profile_tlv_put_link_entry(uint8_t bytes[PROFILE_TLV_ENTRY_BYTES], uint8_t index,
                                const profile_link_t *link, uint8_t k);

#endif
