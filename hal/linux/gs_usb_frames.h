/* Moves frames to and from a gs_usb adapter by bulk transfers. Private to hal/linux.
 *
 * A tag identifies each frame sent; the adapter echoes it once the frame has left. The owner embeds
 * gs_usb_frames_t, zeroed, and sets adapter. Transfers exist while an adapter is plugged in. */
#ifndef GS_USB_FRAMES_H
#define GS_USB_FRAMES_H

#include <stddef.h>

#include "gs_usb_adapter.h"

#define GS_USB_FRAMES_RECEIVES 24 /* transfers that wait for a frame */
#define GS_USB_FRAMES_SENDS                                                                                  \
    10 /* frames on the way to the bus: adapters have few places, shared with reception */
#define GS_USB_FRAMES_RING 1024
#define GS_USB_FRAMES_PACKET_MAX 1024

typedef struct gs_usb_frames gs_usb_frames_t;

typedef struct {
    gs_usb_frames_t *frames;
    struct libusb_transfer *transfer;
    bool busy;
    uint8_t bytes[GS_USB_FRAMES_PACKET_MAX];
} gs_usb_frames_receive_t;

/* A frame is free again when the adapter has both taken it and said that it went to the bus. */
typedef struct {
    gs_usb_frames_t *frames;
    struct libusb_transfer *transfer;
    bool busy;    /* the transfer is under way */
    bool awaited; /* the echo has not come */
    uint32_t tag;
    uint8_t bytes[GS_USB_CODEC_FRAME_SIZE];
} gs_usb_frames_send_t;

struct gs_usb_frames {
    gs_usb_adapter_t *adapter;
    bool refused; /* a frame was refused for want of room; the owner clears it when it tells the user */
    gs_usb_frames_receive_t receives[GS_USB_FRAMES_RECEIVES];
    gs_usb_frames_send_t sends[GS_USB_FRAMES_SENDS];
    uint32_t next_tag;
    can_frame_t ring[GS_USB_FRAMES_RING]; /* received, not taken yet; kept when the adapter is pulled out */
    size_t ring_first;
    size_t ring_count;
};

/* Whether packets of this size, which the adapter sends, can be received. */
bool gs_usb_frames_fit(uint16_t packet_size);

/* A transfer keeps its device, and that its context, until it is freed: there are new ones for each plugging.
 * False: out of memory; gs_usb_frames_free frees the others. */
bool gs_usb_frames_allocate(gs_usb_frames_t *frames);
void gs_usb_frames_free(gs_usb_frames_t *frames);

/* Asks libusb to give up all transfers; they are taken back when none is busy any more. */
void gs_usb_frames_cancel(gs_usb_frames_t *frames);
bool gs_usb_frames_are_busy(const gs_usb_frames_t *frames);

/* Waits for frames with every transfer that does not yet. */
void gs_usb_frames_begin_receiving(gs_usb_frames_t *frames);

/* As hal_can_send and hal_can_receive. */
bool gs_usb_frames_send(gs_usb_frames_t *frames, const can_frame_t *frame);
size_t gs_usb_frames_receive(gs_usb_frames_t *frames, can_frame_t *out, size_t max);

/* Counts as failed what the adapter has taken and not sent: a reset throws it away. unplugged: also what it
 * has not taken. */
void gs_usb_frames_forget_sends(gs_usb_frames_t *frames, bool unplugged);

#endif
