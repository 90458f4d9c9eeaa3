/* Identity of a device. */
#ifndef PDCP_IDENTITY_H
#define PDCP_IDENTITY_H

#include <stdbool.h>
#include <stdint.h>

/* VID, PID and serial number [PDCP 3.2.1]. */
typedef struct {
    uint16_t vid;
    uint16_t pid;
    uint16_t sn;
} pdcp_identity_t;

bool pdcp_identity_equal(const pdcp_identity_t *a, const pdcp_identity_t *b);

#endif
