/* Lists the USB CAN adapters that speak gs_usb and are plugged in. linux_can_open opens one. */
#ifndef CAN_GS_USB_H
#define CAN_GS_USB_H

/* name: what linux_can_open takes, description: one line for people. Valid during the call only. */
typedef void (*can_gs_usb_found_t)(void *ctx, const char *name, const char *description);

/* Calls found for each adapter that is plugged in, whether this user may open it or not. Where the program
 * was built without libusb: for none. */
void can_gs_usb_list(can_gs_usb_found_t found, void *ctx);

#endif
