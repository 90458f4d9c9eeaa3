/* Describes in words what a request of the host changes, for the log. */
#ifndef PDCPD_ORDER_H
#define PDCPD_ORDER_H

#include <stdbool.h>
#include <stdint.h>

enum { PDCPD_ORDER_TEXT = 128 };

/* Writes one line without its end, such as "links 2:2:4.1 -> 2:2:5.2". False: the request changes nothing, is
 * not known or is too short. */
bool pdcpd_order_text(char text[PDCPD_ORDER_TEXT], uint16_t message, const uint8_t *payload, uint16_t len);

#endif
