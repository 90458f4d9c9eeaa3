/* Finds and opens a USB device that speaks gs_usb. Private to hal/linux.
 *
 * Known pairs of vendor and product id are gs_usb adapters. Another device is taken if the user names it by
 * its serial number and its interface 0 has class FFh/FFh/FFh and a bulk endpoint in each direction. */
#ifndef GS_USB_DEVICE_H
#define GS_USB_DEVICE_H

#include <libusb.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define GS_USB_DEVICE_SERIAL_SIZE 64
#define GS_USB_DEVICE_INTERFACE 0

typedef struct {
    char serial[GS_USB_DEVICE_SERIAL_SIZE]; /* empty: it has none, or one that does not fit */
    char product[64];
    char node[32]; /* its file in /dev */
    uint16_t vid;
    uint16_t pid;
    uint16_t packet_size; /* of the endpoint towards the host */
    uint8_t in;           /* addresses of the bulk endpoints */
    uint8_t out;
    bool known; /* by vendor and product */
} gs_usb_device_t;

/* False: the device cannot be a gs_usb adapter. Opens nothing, so that it needs no rights. */
bool gs_usb_device_describe(libusb_device *device, gs_usb_device_t *description);

/* Whether this process has the rights to open it. */
bool gs_usb_device_is_permitted(const gs_usb_device_t *description);

/* Opens the adapter with this serial number, or the first one when serial is empty, and takes its interface
 * from the kernel's driver; libusb_close after libusb_release_interface gives it back. NULL: error[] holds
 * why in one line. */
libusb_device_handle *gs_usb_device_open(libusb_context *usb, const char *serial,
                                         gs_usb_device_t *description, char *error, size_t error_size);

#endif
