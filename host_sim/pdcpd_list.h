/* pdcpd --list: prints the buses and host ports of this machine. */
#ifndef PDCPD_LIST_H
#define PDCPD_LIST_H

#include <stdio.h>

/* One line each: `can` or `host`, what the option of that name takes, and a description. */
void pdcpd_list(FILE *out);

#endif
