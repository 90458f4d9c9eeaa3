/* Channel type: how one value of a channel looks on the wire (profile-layer.md 2) [PROFILE listing 4.9].
 *
 * Bit 0 is the most significant bit of the word (D-PRO-1): 5300h is 8 bits, unsigned, position, sole access,
 * terminal. */
#ifndef PROFILE_TYPE_H
#define PROFILE_TYPE_H

#include <stdbool.h>
#include <stdint.h>

#include "pdcp_spec.h"

/* The numbers are those on the wire. */
typedef enum {
    PROFILE_SIZE_4 = 0,
    PROFILE_SIZE_8 = 1,
    PROFILE_SIZE_12 = 2,
    PROFILE_SIZE_16 = 3
} profile_size_t;

typedef enum {
    PROFILE_SIGNED = 0, /* two's complement */
    PROFILE_UNSIGNED = 1,
    PROFILE_FLOAT = 2, /* IEEE 754 binary16, 16 bits only (D-PRO-2) */
    PROFILE_BOOLEAN = 3
} profile_data_t;

typedef enum {
    PROFILE_POSITION = 0,
    PROFILE_VELOCITY = 1,
    PROFILE_ACCELERATION = 2,
    PROFILE_OTHER = 3
} profile_control_t;

typedef struct {
    uint8_t size;      /* profile_size_t */
    uint8_t data;      /* profile_data_t */
    uint8_t control;   /* profile_control_t */
    uint8_t prescaler; /* 0 to 7: x1, 10^-6, 10^-3, 10^-1, 10, 10^2, 10^3, 10^6 (D-PRO-8) */
    bool sole_access;  /* inputs */
    bool terminal;     /* inputs */
} profile_type_t;

/* The fields of a type word that channels are compared by, and the flags. */
#define PROFILE_TYPE_SIZE 0xC000u
#define PROFILE_TYPE_DATA 0x3000u
#define PROFILE_TYPE_CONTROL 0x0C00u
#define PROFILE_TYPE_SOLE PDCP_TYPE_SOLE
#define PROFILE_TYPE_TERMINAL 0x0100u

/* Decodes a type word. Unused bits are ignored. False: a float that does not have 16 bits (D-PRO-2); type is
 * filled all the same. */
bool profile_type_decode(uint16_t word, profile_type_t *type);

/* Encodes a type; unused bits are 0. Members that are too large are cut to their fields. */
uint16_t profile_type_encode(const profile_type_t *type);

/* Bytes of one value: 1 for 4 and 8 bits, 2 for 12 and 16. */
uint8_t profile_type_bytes(const profile_type_t *type);

/* Gets the smallest and the largest value; of a boolean 0 and 1. False: a float, and nothing is written. */
bool profile_type_range(const profile_type_t *type, int32_t *min, int32_t *max);

/* Writes one value, least significant byte first, unused upper bits 0. value is clamped to the range; a
 * boolean is true (1) for any value but 0. Returns the bytes written, 1 or 2; 0: float, nothing written. */
uint8_t profile_type_put(const profile_type_t *type, int32_t value, uint8_t bytes[2]);

/* Reads one value from len bytes. Missing bytes are 0, extra ones and unused upper bits are ignored; a
 * boolean is 0 or 1. False: float. */
bool profile_type_get(const profile_type_t *type, const uint8_t *bytes, uint8_t len, int32_t *value);

#endif
