/* Keeps the stored configurations (profile-layer.md 5) over a power cycle.
 *
 * The string of profile_tlv.h stands in two areas of the memory that are written in turn: a write never
 * touches the newest good copy, and the header is written last, so that power may fail at any byte and either
 * the old or the new string is there afterwards. One area, from its first byte:
 *
 *   byte   0   1   2       3   4    5    6       7       8 .. 11   64 ..
 *          'P' 'C' version 0   seq  seq  length  length  CRC-32    string
 *
 * seq counts writes, length is that of the string, all LSB first; the CRC-32 is that of the string followed
 * by bytes 0 to 7. A memory that holds nothing good reads as a string without configurations (1 0, 15 0), so
 * that whatever is read can be written back (D-API-15).
 *
 * There is one job at a time. A function below starts it, and arb_config_step carries it on in small steps:
 * one page written, or ARB_CONFIG_READ_MAX bytes read. The last step tells how it ended. What is already
 * stored is not written. What is written is read back and checked before its header makes it the newest copy
 * (D-PRO-21). */
#ifndef ARB_CONFIG_H
#define ARB_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

#include "arb_area.h"
#include "arb_limits.h"
#include "arb_splice.h"
#include "arb_store.h"
#include "pdcp_time.h"
#include "profile_tlv.h"

/* Pages that a string may take in a small memory: its share of what the others leave, without the
 * header's. */
#define ARB_CONFIG_STRING_PAGES                                                                              \
    ((ARB_NVM_PAGES - ARB_AREAS * (int)(ARB_STORE_AREA / ARB_PORT_NVM_PAGE) - ARB_AREAS) / ARB_AREAS - 1)

enum {
    ARB_CONFIG_HEADER = 12,
    ARB_CONFIG_AREA = 8192, /* bytes of an area */
    /* Longest string: 8 configurations of 16 links take 7350. */
    ARB_CONFIG_STRING_MAX =
        ARB_CONFIG_STRING_PAGES < 120 ? ARB_CONFIG_STRING_PAGES * (int)ARB_PORT_NVM_PAGE : 7680,
    ARB_CONFIG_READ_MAX = 32, /* bytes read at a time: 0.8 ms at a 24LC256 */
    ARB_CONFIG_RAW_MAX = 128, /* bytes that the host may read at a time */
    ARB_CONFIG_PACE_MS = 1,   /* between two reads: the bus goes on */
    ARB_CONFIG_POLLS_MAX = 50 /* a job that waits longer for the memory, 250 ms, has failed */
};

/* Outcome of a start, a job or a step; 0 or more is good. */
typedef enum {
    ARB_CONFIG_OK = 0,           /* a start: it is under way; a job: done */
    ARB_CONFIG_UNCHANGED = 1,    /* a job: done, nothing had to be written */
    ARB_CONFIG_RUNNING = 2,      /* a step: no job has ended */
    ARB_CONFIG_ERR_BUSY = -1,    /* a start: a job is under way; try again later */
    ARB_CONFIG_ERR_STORAGE = -2, /* too long for an area, or the memory has failed: nothing has changed */
    ARB_CONFIG_ERR_VALUE = -3,   /* a piece out of order, or a string that profile_tlv.h rejects */
    ARB_CONFIG_ERR_NUMBER = -4   /* no such configuration */
} arb_config_status_t;

/* The owner of the links. */
typedef struct {
    /* Gives a link of the configuration to be saved. Called several times for each link, in any order. Links
     * must not change until the job is over. */
    arb_splice_link_t link;
    profile_tlv_on_link_t on_link; /* takes the links that are read */
} arb_config_user_t;

/* Counters since the start, in the order of the host's statistics group 2. */
typedef enum {
    ARB_CONFIG_PAGES,           /* pages written, those of a write that failed later as well */
    ARB_CONFIG_WRITES,          /* strings stored: saves, erasures, writes by the host */
    ARB_CONFIG_COUNT_UNCHANGED, /* the same, but nothing had to be written */
    ARB_CONFIG_FAILURES,        /* jobs that ended with ARB_CONFIG_ERR_STORAGE */
    ARB_CONFIG_DAMAGED, /* areas that were neither empty nor good at the start: bit rot or a cut write */
    ARB_CONFIG_COUNTERS
} arb_config_counter_t;

typedef struct {
    uint32_t counters[ARB_CONFIG_COUNTERS];
    /* What is stored. */
    uint8_t numbers[PROFILE_TLV_SET_BYTES]; /* of the configurations, a bit for each (profile_tlv_has) */
    uint8_t names[PROFILE_TLV_NAMES_BYTES]; /* the devices in them (profile_tlv_names) */
    uint8_t stored;                         /* how many there are */
    arb_area_t newest;
    uint16_t length;
    uint32_t crc; /* register behind the string */
    /* The job. */
    uint8_t phase;      /* of the job, private to arb_config.c; 0: there is none */
    int8_t status;      /* how it ends, arb_config_status_t */
    bool writing;       /* a page is under way */
    uint8_t polls;      /* of a memory that is not ready */
    uint8_t stored_new; /* save, erase: how many configurations there will be */
    uint8_t from;       /* the area that is read */
    bool same;          /* the new string is the stored one so far: none of it was written yet */
    uint16_t at;        /* where in the string that is read, compared or written, */
    uint16_t until;     /* and where this ends */
    uint16_t length_new;
    arb_splice_t splice; /* how the new string comes of the stored one; a piece: the host's job */
    uint32_t crc_new;    /* registers: of the new string, */
    uint32_t crc_read;   /* of what was read */
    uint32_t due_ms;
    const arb_config_user_t *user;
    void *ctx;
    int8_t raw_status; /* how the host's last piece ended; ARB_CONFIG_RUNNING: it is under way */
    uint16_t raw_at;   /* bytes that are in of the host's write, which outlasts the job of a piece */
    profile_tlv_t reader;
} arb_config_t;

/* Checks both areas and chooses the newest good one. Blocks for as long as the memory needs to be read
 * (24LC256: 0.4 s when both areas are full). user, whose functions get ctx, must outlive config. */
void arb_config_init(arb_config_t *config, arb_nvm_t *nvm, const arb_config_user_t *user, void *ctx,
                     uint32_t now_ms);

/* Does what is due: writes one page at most, or reads ARB_CONFIG_READ_MAX bytes. Returns the outcome of a
 * job, once for every start that returned ARB_CONFIG_OK; then the next one may be started. Otherwise returns
 * ARB_CONFIG_RUNNING. */
arb_config_status_t arb_config_step(arb_config_t *config, arb_nvm_t *nvm, uint32_t now_ms);

/* Is a job under way? */
static inline bool arb_config_busy(const arb_config_t *config)
{
    return config->phase != 0;
}

/* The time of the next call at the latest; now_ms + PDCP_TIME_FAR_MS when there is nothing to do. */
static inline uint32_t arb_config_next_ms(const arb_config_t *config, uint32_t now_ms)
{
    return arb_config_busy(config) ? config->due_ms : now_ms + PDCP_TIME_FAR_MS;
}

/* Is this configuration stored? */
static inline bool arb_config_has(const arb_config_t *config, uint8_t number)
{
    return profile_tlv_has(config->numbers, number);
}

/* Is this device part of a stored configuration? May be true of one that is not (profile_tlv_names). */
static inline bool arb_config_names(const arb_config_t *config, const pdcp_identity_t *identity)
{
    return profile_tlv_names(config->names, identity);
}

/* A job begins with the first step after its start. */

/* Hands the links of all stored configurations to the user's on_link, in the order in which they stand. After
 * any end but ARB_CONFIG_OK (ERR_STORAGE: the memory has failed or the copy is damaged) what was handed over
 * must not be used. */
arb_config_status_t arb_config_read(arb_config_t *config);

/* Stores count links as configuration *number; 0 takes the lowest free number and puts it there. A
 * configuration of that number is replaced where it stands, with all that is in it; all others stay entry by
 * entry as they are. Abandons a host's write that is not complete. */
arb_config_status_t arb_config_save(arb_config_t *config, uint8_t *number, uint8_t count);

/* Removes a configuration. Abandons a host's write that is not complete. */
arb_config_status_t arb_config_erase(arb_config_t *config, uint8_t number);

/* Length of the stored string. */
static inline uint16_t arb_config_length(const arb_config_t *config)
{
    return config->length;
}

/* Reads up to *len bytes, at most ARB_CONFIG_READ_MAX, of the stored string at offset, at once; *len becomes
 * how many there are. ERR_BUSY while a job is under way or the memory is another one's; ERR_VALUE: offset is
 * beyond the length. */
arb_config_status_t arb_config_read_raw(const arb_config_t *config, const arb_nvm_t *nvm, uint16_t offset,
                                        uint8_t *bytes, uint8_t *len);

/* Takes the next piece of a string of total bytes that replaces the stored one. Offset 0 begins, anew if need
 * be; any other must follow the piece before, with the same total: else ERR_VALUE, and what is in stays in.
 * The last piece stores the whole string, if profile_tlv.h accepts it; else nothing has changed. Each piece
 * is a job; bytes must last until its end, which config->raw_status tells too. Pieces that end at a multiple
 * of ARB_PORT_NVM_PAGE wear the memory least. */
arb_config_status_t arb_config_write_raw(arb_config_t *config, uint16_t offset, uint16_t total,
                                         const uint8_t *bytes, uint16_t len);

#endif
