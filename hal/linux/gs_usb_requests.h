/* Requests to an adapter that speaks gs_usb: control transfers, one at a time, that configure and start its
 * channel at 1 Mbit/s. Private to hal/linux.
 *
 *   HOST_FORMAT -> DEVICE_CONFIG -> BT_CONST -> RESET -> BITTIMING -> START -> GET_STATE -> DONE
 *                                               ^ a restart after bus-off begins here, or is RECOVER alone
 *
 * The owner embeds gs_usb_requests_t, zeroed, and sets adapter, frames and step. */
#ifndef GS_USB_REQUESTS_H
#define GS_USB_REQUESTS_H

#include "gs_usb_adapter.h"
#include "gs_usb_frames.h"

/* The requests of a start, one after the other; a restart begins in the middle. */
typedef enum {
    GS_USB_REQUESTS_HOST_FORMAT,
    GS_USB_REQUESTS_DEVICE_CONFIG,
    GS_USB_REQUESTS_BT_CONST,
    GS_USB_REQUESTS_RESET,
    GS_USB_REQUESTS_BITTIMING,
    GS_USB_REQUESTS_START,
    GS_USB_REQUESTS_GET_STATE, /* left out where the adapter does not have it */
    GS_USB_REQUESTS_DONE,
    GS_USB_REQUESTS_RECOVER /* stands alone */
} gs_usb_requests_step_t;

typedef struct {
    gs_usb_adapter_t *adapter;
    gs_usb_frames_t *frames;
    gs_usb_requests_step_t step; /* GS_USB_REQUESTS_DONE: no request is under way */
    struct libusb_transfer *transfer;
    bool busy;
    uint8_t bytes[LIBUSB_CONTROL_SETUP_SIZE + GS_USB_CODEC_BT_CONST_SIZE];
} gs_usb_requests_t;

/* As those of gs_usb_frames. */
bool gs_usb_requests_allocate(gs_usb_requests_t *requests);
void gs_usb_requests_free(gs_usb_requests_t *requests);
void gs_usb_requests_cancel(gs_usb_requests_t *requests);

/* Starts the channel of an adapter that was opened. It runs when adapter->running is set and step is DONE;
 * otherwise the adapter fails. */
void gs_usb_requests_start(gs_usb_requests_t *requests);

/* Lets the channel go on after bus-off. Does nothing unless it is bus-off and no request is under way. */
void gs_usb_requests_restart(gs_usb_requests_t *requests);

#endif
