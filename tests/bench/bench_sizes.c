/* Sizes of what the arbitrator keeps in memory, to be read from the symbols of the object; never linked. */
#include "arb_app.h"

#define BENCH_SIZE(name, type)                                                                               \
    extern char size_##name[sizeof(type)];                                                                   \
    char size_##name[sizeof(type)]

BENCH_SIZE(app, arb_app_t);
BENCH_SIZE(arb, pdcp_arb_t);
BENCH_SIZE(tables, pdcp_tables_t);
BENCH_SIZE(timers, pdcp_timers_t);
BENCH_SIZE(txq, pdcp_txq_t);
BENCH_SIZE(bind, pdcp_bind_t);
BENCH_SIZE(link, pdcp_link_t);
BENCH_SIZE(hostapi, arb_hostapi_t);
BENCH_SIZE(store, arb_store_t);
