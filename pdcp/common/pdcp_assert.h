/* Checks at run time what a header says must hold.
 *
 * A failed check is a fault of the program, never of what comes from outside: bad frames, bytes and files are
 * counted or refused, not asserted. Programs on a PC are built with PDCP_ASSERTIONS and stop at the first
 * failed check: host_sim/pdcp_assert.c aborts, a random life names its seed first. On a microcontroller a
 * check is nothing: the flash of the smaller part is for the limb. */
#ifndef PDCP_ASSERT_H
#define PDCP_ASSERT_H

#ifdef PDCP_ASSERTIONS
/* Does not return. The program defines it, or gets the one of host_sim/pdcp_assert.c. file: where the check
 * stands; clause: the header and what it says. */
void pdcp_assert_failed(const char *file, int line, const char *clause);

#define pdcp_assert(condition, clause)                                                                       \
    ((condition) ? (void)0 : pdcp_assert_failed(__FILE__, __LINE__, clause))
#else
#define pdcp_assert(condition, clause) ((void)0)
#endif

#endif
