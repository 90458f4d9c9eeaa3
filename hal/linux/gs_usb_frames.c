#include "gs_usb_frames.h"

/* --- from the adapter --- */

static void push(gs_usb_frames_t *frames, const gs_usb_codec_frame_t *frame)
{
    if (frames->ring_count == GS_USB_FRAMES_RING) {
        frames->adapter->base.health.rx_overruns++;
        return;
    }
    size_t place = (frames->ring_first + frames->ring_count) % GS_USB_FRAMES_RING;
    gs_usb_codec_to_can_frame(frame, &frames->ring[place]);
    frames->ring_count++;
    frames->adapter->news = true;
}

/* There is room to send; the user is told if a frame was refused. */
static void note_room(gs_usb_frames_t *frames)
{
    frames->adapter->news = frames->adapter->news || frames->refused;
}

static void take_echo(gs_usb_frames_t *frames, uint32_t tag)
{
    for (size_t i = 0; i < GS_USB_FRAMES_SENDS; i++) {
        if (frames->sends[i].awaited && frames->sends[i].tag == tag) {
            frames->sends[i].awaited = false;
            note_room(frames);
            return;
        }
    }
}

static void take_transfer(gs_usb_frames_t *frames, const uint8_t *bytes, int size)
{
    gs_usb_adapter_t *adapter = frames->adapter;
    gs_usb_codec_frame_t frame;
    if (size == 0) {
        return;
    }
    if (!gs_usb_codec_decode_frame(bytes, (size_t)size, &frame)) {
        adapter->base.health.rx_overruns++;
        return;
    }
    if (frame.channel != adapter->channel || !adapter->running) {
        return;
    }
    if (frame.echo_tag != GS_USB_CODEC_NO_ECHO) {
        take_echo(frames, frame.echo_tag);
        return;
    }
    hal_can_state_t before = adapter->base.health.state;
    gs_usb_codec_note(&frame, &adapter->base.health);
    push(frames, &frame);
    adapter->news = adapter->news || adapter->base.health.state != before;
}

static void on_received(struct libusb_transfer *transfer);

static void submit_receive(gs_usb_frames_receive_t *receive)
{
    gs_usb_adapter_t *adapter = receive->frames->adapter;
    /* One packet and no more: a packet that is filled up to its size then ends the transfer as a short one
     * does. */
    libusb_fill_bulk_transfer(receive->transfer, adapter->device, adapter->description.in, receive->bytes,
                              adapter->description.packet_size, on_received, receive, 0);
    int failure = libusb_submit_transfer(receive->transfer);
    receive->busy = failure == 0;
    if (failure != 0) {
        gs_usb_adapter_fail_usb(adapter, failure);
    }
}

static void on_received(struct libusb_transfer *transfer)
{
    gs_usb_frames_receive_t *receive = transfer->user_data;
    receive->busy = false;
    if (transfer->status != LIBUSB_TRANSFER_COMPLETED) {
        gs_usb_adapter_fail_unplugged(receive->frames->adapter);
        return;
    }
    take_transfer(receive->frames, receive->bytes, transfer->actual_length);
    if (receive->frames->adapter->failure == NULL) {
        submit_receive(receive);
    }
}

void gs_usb_frames_begin_receiving(gs_usb_frames_t *frames)
{
    for (size_t i = 0; i < GS_USB_FRAMES_RECEIVES; i++) {
        if (!frames->receives[i].busy) {
            submit_receive(&frames->receives[i]);
        }
    }
}

size_t gs_usb_frames_receive(gs_usb_frames_t *frames, can_frame_t *out, size_t max)
{
    size_t n = 0;
    for (; n < max && frames->ring_count > 0; n++) {
        out[n] = frames->ring[frames->ring_first];
        frames->ring_first = (frames->ring_first + 1) % GS_USB_FRAMES_RING;
        frames->ring_count--;
    }
    return n;
}

/* --- to the adapter --- */

static void on_sent(struct libusb_transfer *transfer)
{
    gs_usb_frames_send_t *send = transfer->user_data;
    send->busy = false;
    if (transfer->status != LIBUSB_TRANSFER_COMPLETED) {
        gs_usb_adapter_fail_unplugged(send->frames->adapter);
    } else if (!send->awaited) {
        note_room(send->frames);
    }
}

static gs_usb_frames_send_t *find_free_send(gs_usb_frames_t *frames)
{
    for (size_t i = 0; i < GS_USB_FRAMES_SENDS; i++) {
        if (!frames->sends[i].busy && !frames->sends[i].awaited) {
            return &frames->sends[i];
        }
    }
    return NULL;
}

static bool can_send(const gs_usb_adapter_t *adapter)
{
    hal_can_state_t state = adapter->base.health.state;
    return adapter->running && adapter->failure == NULL &&
           (state == HAL_CAN_ACTIVE || state == HAL_CAN_PASSIVE);
}

bool gs_usb_frames_send(gs_usb_frames_t *frames, const can_frame_t *frame)
{
    gs_usb_adapter_t *adapter = frames->adapter;
    gs_usb_frames_send_t *send = can_send(adapter) ? find_free_send(frames) : NULL;
    if (send == NULL) {
        frames->refused = true;
        return false;
    }
    send->tag = frames->next_tag;
    frames->next_tag = (frames->next_tag + 1u) & (UINT32_MAX >> 1); /* never the tag of a received frame */
    gs_usb_codec_encode_frame(frame, send->tag, adapter->channel, send->bytes);
    libusb_fill_bulk_transfer(send->transfer, adapter->device, adapter->description.out, send->bytes,
                              GS_USB_CODEC_FRAME_SIZE, on_sent, send, 0);
    int failure = libusb_submit_transfer(send->transfer);
    if (failure != 0) {
        frames->refused = true;
        gs_usb_adapter_fail_usb(adapter, failure);
        return false;
    }
    send->busy = true;
    send->awaited = true;
    return true;
}

void gs_usb_frames_forget_sends(gs_usb_frames_t *frames, bool unplugged)
{
    for (size_t i = 0; i < GS_USB_FRAMES_SENDS; i++) {
        gs_usb_frames_send_t *send = &frames->sends[i];
        if (send->awaited && (unplugged || !send->busy)) {
            send->awaited = false;
            frames->adapter->base.health.tx_failed++;
        }
    }
}

/* --- the transfers --- */

bool gs_usb_frames_fit(uint16_t packet_size)
{
    return packet_size >= GS_USB_CODEC_FRAME_SIZE && packet_size <= GS_USB_FRAMES_PACKET_MAX;
}

bool gs_usb_frames_allocate(gs_usb_frames_t *frames)
{
    bool ok = true;
    for (size_t i = 0; i < GS_USB_FRAMES_RECEIVES; i++) {
        frames->receives[i].frames = frames;
        frames->receives[i].transfer = libusb_alloc_transfer(0);
        ok = ok && frames->receives[i].transfer != NULL;
    }
    for (size_t i = 0; i < GS_USB_FRAMES_SENDS; i++) {
        frames->sends[i].frames = frames;
        frames->sends[i].transfer = libusb_alloc_transfer(0);
        ok = ok && frames->sends[i].transfer != NULL;
    }
    return ok;
}

void gs_usb_frames_free(gs_usb_frames_t *frames)
{
    for (size_t i = 0; i < GS_USB_FRAMES_RECEIVES; i++) {
        libusb_free_transfer(frames->receives[i].transfer);
        frames->receives[i].transfer = NULL;
    }
    for (size_t i = 0; i < GS_USB_FRAMES_SENDS; i++) {
        libusb_free_transfer(frames->sends[i].transfer);
        frames->sends[i].transfer = NULL;
    }
}

void gs_usb_frames_cancel(gs_usb_frames_t *frames)
{
    for (size_t i = 0; i < GS_USB_FRAMES_RECEIVES; i++) {
        if (frames->receives[i].busy) {
            libusb_cancel_transfer(frames->receives[i].transfer);
        }
    }
    for (size_t i = 0; i < GS_USB_FRAMES_SENDS; i++) {
        if (frames->sends[i].busy) {
            libusb_cancel_transfer(frames->sends[i].transfer);
        }
    }
}

bool gs_usb_frames_are_busy(const gs_usb_frames_t *frames)
{
    bool busy = false;
    for (size_t i = 0; i < GS_USB_FRAMES_RECEIVES; i++) {
        busy = busy || frames->receives[i].busy;
    }
    for (size_t i = 0; i < GS_USB_FRAMES_SENDS; i++) {
        busy = busy || frames->sends[i].busy;
    }
    return busy;
}
