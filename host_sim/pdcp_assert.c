/* What a failed pdcp_assert does in a program on a PC that defines nothing else. */
#include <stdio.h>
#include <stdlib.h>

#include "pdcp_assert.h"

void pdcp_assert_failed(const char *file, int line, const char *clause)
{
    (void)fprintf(stderr, "%s:%d: broken: %s\n", file, line, clause);
    abort();
}
