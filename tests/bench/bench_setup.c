/* Bus time that it takes to bind and set up so many devices: bench_setup DEVICES prints one figure a line. */
#include <stdio.h>
#include <stdlib.h>

#include "bench_bus.h"

#define LIMIT_US 60000000u

int main(int argc, char **argv)
{
    static bench_bus_t bench;
    const long devices = argc == 2 ? strtol(argv[1], NULL, 10) : 0;
    if (devices < 1 || devices > BENCH_DEVICES || !bench_bus_start(&bench, (uint8_t)devices)) {
        (void)fprintf(stderr, "usage: bench_setup DEVICES (1 to %d)\n", BENCH_DEVICES);
        return 2;
    }
    while (!bench_bus_ready(&bench)) {
        bench_bus_advance(&bench);
        if (bench.now_us > LIMIT_US) {
            (void)fprintf(stderr, "bench_setup: the devices are not set up after %u s\n",
                          LIMIT_US / 1000000u);
            return 1;
        }
    }
    const bench_log_t *log = &bench.log;
    printf("frames %u\n", (unsigned)log->frames);
    printf("bind_frames %u\n", (unsigned)log->bind_frames);
    printf("beacons %u\n", (unsigned)log->beacons);
    printf("repeats %u\n", (unsigned)bench.app.arb.bus.stats[PDCP_STAT_REPEATS]);
    printf("own_us %llu\n", (unsigned long long)log->own_us);
    printf("bind_bus_us %llu\n", (unsigned long long)log->bind_bus_us);
    printf("bind_elapsed_us %llu\n", (unsigned long long)(log->bind_last_us - log->first_us));
    printf("hold_us %llu\n", (unsigned long long)log->hold_us);
    printf("elapsed_us %llu\n", (unsigned long long)(log->last_us - log->first_us));
    return 0;
}
