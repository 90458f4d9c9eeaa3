/* An adapter that speaks gs_usb, as the parts of its driver share it. Private to hal/linux.
 *
 *   can_gs_usb        plugging, the loop, the contract of hal_can.h
 *   gs_usb_requests   control transfers: configures and starts the channel
 *   gs_usb_frames     bulk transfers: frames to and from the channel
 *   gs_usb_device     finds and opens the USB device
 *   gs_usb_codec      bytes on the wire
 *
 * Everything is asynchronous and lives in the caller's loop: libusb's descriptors are watched there, and a
 * watched descriptor that is ready lets libusb work through what is done, without waiting. libusb does not
 * permit closing a device from within its callbacks: they only note what happened (failure, news), and
 * can_gs_usb acts on it. */
#ifndef GS_USB_ADAPTER_H
#define GS_USB_ADAPTER_H

#include <libusb.h>
#include <stdbool.h>
#include <stdint.h>

#include "gs_usb_codec.h"
#include "gs_usb_device.h"
#include "linux_can_backend.h"

typedef struct {
    hal_can_t base;
    char serial[GS_USB_DEVICE_SERIAL_SIZE]; /* empty: any adapter */
    uint8_t channel;
    int timer;
    libusb_context *usb; /* NULL: no adapter is there */
    libusb_device_handle *device;
    gs_usb_device_t description;
    gs_usb_codec_constants_t constants;
    bool running;        /* the channel was started */
    bool news;           /* the user is to be told: frames, a new state, room to send */
    const char *failure; /* the adapter is lost; not told to the user yet */
    char reason[192];    /* text for failure */
} gs_usb_adapter_t;

/* Notes that the adapter is lost; only the first reason counts. The timer then lets can_gs_usb act on it. */
void gs_usb_adapter_fail(gs_usb_adapter_t *adapter, const char *reason);

/* Notes that a transfer could not be submitted; failure is libusb's. */
void gs_usb_adapter_fail_usb(gs_usb_adapter_t *adapter, int failure);

/* Notes that a transfer ended with the adapter. */
void gs_usb_adapter_fail_unplugged(gs_usb_adapter_t *adapter);

#endif
