/* Opens a CAN bus on Linux. hal_can.h says what an open one can do.
 *
 * BUS is one of
 *
 *   socketcan:IFACE             an interface of the kernel, such as socketcan:can0 or socketcan:vcan0
 *   socketcand:HOST:PORT/NAME   a socketcand server, raw mode, such as socketcand:127.0.0.1:28600/sim
 *   gs_usb[:SERIAL][/CHANNEL]   a USB adapter without a driver of the kernel: the first one or the one with
 *                               this serial number; its first channel is 0. Absent without libusb
 *
 * If a bus goes away later (interface down or gone, connection lost, adapter unplugged), do not reopen it.
 * Its state becomes HAL_CAN_DOWN, nothing is received, and hal_can_send returns false until the bus is
 * back. */
#ifndef LINUX_CAN_H
#define LINUX_CAN_H

#include <stddef.h>

#include "hal_can.h"
#include "loop.h"

/* What BUS may be in this program, for messages. */
#if LINUX_CAN_HAS_GS_USB
#define LINUX_CAN_CHOICES "socketcan:INTERFACE, socketcand:HOST:PORT/NAME, gs_usb[:SERIAL][/CHANNEL]"
#else
#define LINUX_CAN_CHOICES "socketcan:INTERFACE, socketcand:HOST:PORT/NAME"
#endif

/* Called from the loop when frames may be waiting (take them until hal_can_receive gives fewer than asked
 * for: it then has none until the next call, and answers 0 without asking the kernel), when there is room to
 * send again after a refusal, or when the health has changed. May call every function of hal_can.h. */
typedef void (*linux_can_ready_t)(void *ctx);

/* Can BUS be right? If so, and it cannot be opened, something outside is missing now. */
bool linux_can_is_bus(const char *bus);

/* Opens BUS. An interface must be there but may be down; the first connection to a server is waited for, and
 * so is the start of an adapter, which must be plugged in, 2 s at the most. Accepted frames of hal_can_send
 * wait in the kernel, a few at a time. What a server sends that is no frame, or reports as not sent, is
 * counted in rx_overruns and tx_failed of hal_can_health. NULL: error[] holds one line that names the bus and
 * the reason, without a line feed. The caller owns the result and closes it before the loop. */
hal_can_t *linux_can_open(loop_t *loop, const char *bus, linux_can_ready_t ready, void *ctx, char *error,
                          size_t error_size);
void linux_can_close(hal_can_t *can);

#endif
