/* In a file of its own, as exchange_making.c is. */
#include <stddef.h>

#include "exchange.h"

const exchange_pair_t exchange_silencing[] = {
    {"312#04 04 01 00", "212#84 01 04 01 00"},
    {"312#04 07 01 00 00", "212#84 01 07 01 00 00"},
    {NULL, NULL},
};

const exchange_pair_t exchange_removing[] = {
    {"312#04 04 01 00", "212#84 01 04 01 00"},
    {"312#04 07 01 00 00", "212#84 01 07 01 00 00"},
    {"312#04 08 01 0000 0000", "212#84 01 08 01 0000 0000"},
    {"312#04 06 01 FFFF FF", "212#84 01 06 01 FFFF FF"},
    {"312#04 05 01 FFFF FFFF", "212#84 01 05 01 FFFF FFFF"},
    {NULL, NULL},
};
