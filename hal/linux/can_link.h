/* The kernel's view of a CAN interface: present, up, state of the controller, and news of any change. Uses
 * rtnetlink. Private to hal/linux. */
#ifndef CAN_LINK_H
#define CAN_LINK_H

#include <stdbool.h>

#include "hal_can.h"

typedef struct {
    int index;
    bool up;
    bool is_can;
} can_link_t;

/* Returns a socket that becomes readable when any interface of the machine has changed, or -1 (errno says
 * why). */
int can_link_open(void);

/* Throws the news away: only that there was some matters. */
void can_link_drain(int link_fd);

/* False: there is no interface of this name. */
bool can_link_find(int link_fd, const char *name, can_link_t *link);

/* State and error counters of the controller. Without a controller, as with vcan: error-active, no errors.
 * The other members of *health are left alone. */
void can_link_health(int index, hal_can_health_t *health);

/* Asks the driver to restart the controller after bus-off. The kernel refuses, without harm, when it is not
 * bus-off or this process may not do it (CAP_NET_ADMIN). */
void can_link_restart(int link_fd, int index);

#endif
