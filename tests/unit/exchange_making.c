/* In a file of its own: on a part with 16 KB its texts are linked only where they are used. */
#include <stddef.h>

#include "exchange.h"
#include "unity.h"

const exchange_pair_t exchange_making[] = {
    {"312#04 05 01 0200 0200", "212#84 01 05 01"},
    {"312#04 06 01 0400 01", "212#84 01 06 01"},
    {"312#04 08 01 0050 2021", "212#84 01 08 01"},
    {"312#04 07 01 11 FE", "212#84 01 07 01"},
    {"312#04 04 01 01", "212#84 01 04 01"},
    {"311#04 04 01 01", "211#84 01 04 01"},
    {NULL, NULL},
};

void exchange_make_link(exchange_t *x)
{
    const pdcp_tables_t *tables = &x->arb->bus.tables;
    TEST_ASSERT_EQUAL(PDCP_OK, pdcp_arb_connect(x->arb, pdcp_tables_channel(tables, 0, 1),
                                                pdcp_tables_channel(tables, 1, 1)));
    exchange_run(x, exchange_making);
    exchange_clear(x);
}
