/* In a file of its own: on a part with 16 KB its texts are linked only where they are used. */
#include <stddef.h>

#include "exchange.h"

const exchange_pair_t exchange_making[] = {
    {"312#04 05 01 0200 0200", "212#84 01 05 01"},
    {"312#04 06 01 0400 01", "212#84 01 06 01"},
    {"312#04 08 01 0050 2021", "212#84 01 08 01"},
    {"312#04 07 01 11 FE", "212#84 01 07 01"},
    {"312#04 04 01 01", "212#84 01 04 01"},
    {"311#04 04 01 01", "211#84 01 04 01"},
    {NULL, NULL},
};
