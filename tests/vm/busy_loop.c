/* Carries out a known number of instructions, then waits for a signal: shows how much processor time of the
 * virtual machine one instruction is. */
#include <stdint.h>
#include <stdlib.h>
#include <unistd.h>

int main(int argc, char **argv)
{
    /* Two instructions a round. */
    uint64_t rounds = argc > 1 ? strtoull(argv[1], NULL, 10) : 0;
    if (rounds > 0) {
        __asm__ volatile("1: decq %0\n\tjnz 1b" : "+r"(rounds) : : "cc");
    }
    (void)pause();
    return EXIT_SUCCESS;
}
