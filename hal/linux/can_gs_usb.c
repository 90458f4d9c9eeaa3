/* A USB CAN adapter that speaks gs_usb, driven from user space through libusb: no CAN is needed in the
 * kernel.
 *
 * Everything is asynchronous and lives in the caller's loop: libusb's descriptors are watched there, and a
 * watched descriptor that is ready lets libusb work through what is done, without waiting. libusb does not
 * permit closing a device from within its callbacks: they only note what happened (failure, news), and
 * settle() acts on it.
 *
 * An adapter that was pulled out is looked for twice a second, each time in a new libusb context: only that
 * sees new devices on a machine without udev, such as a container. */
#include "can_gs_usb.h"

#include <errno.h>
#include <libusb.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>

#include "gs_usb_codec.h"
#include "gs_usb_device.h"
#include "linux_can_backend.h"
#include "oneshot.h"

#define BITRATE_BPS 1000000u
#define RECEIVES 24  /* transfers that wait for a frame */
#define SENDS_MAX 10 /* frames on the way to the bus: adapters have room for few, shared with reception */
#define RING 1024
#define PACKET_MAX 1024
#define CHANNELS_MAX 256
#define CONTROL_TIMEOUT_MS 1000u
#define RETRY_US 500000u
#define OPEN_LIMIT_US 2000000u
#define OPEN_STEP_US 20000
#define CANCEL_STEP_US 10000
#define REQUEST_OUT                                                                                          \
    ((uint8_t)LIBUSB_ENDPOINT_OUT | (uint8_t)LIBUSB_REQUEST_TYPE_VENDOR | (uint8_t)LIBUSB_RECIPIENT_INTERFACE)
#define REQUEST_IN                                                                                           \
    ((uint8_t)LIBUSB_ENDPOINT_IN | (uint8_t)LIBUSB_REQUEST_TYPE_VENDOR | (uint8_t)LIBUSB_RECIPIENT_INTERFACE)

/* The requests of a start, one after the other; a restart begins in the middle. */
typedef enum {
    STEP_HOST_FORMAT,
    STEP_DEVICE_CONFIG,
    STEP_BT_CONST,
    STEP_RESET,
    STEP_BITTIMING,
    STEP_START,
    STEP_GET_STATE,
    STEP_DONE,
    STEP_RECOVER, /* stands alone */
} step_t;

/* optional: some firmware refuses it, which does no harm. */
static const struct {
    uint8_t direction;
    uint8_t request;
    uint8_t size;
    bool for_device; /* wValue is 1 instead of the channel */
    bool optional;
} requests[] = {
    [STEP_HOST_FORMAT] = {REQUEST_OUT, GS_USB_CODEC_HOST_FORMAT, GS_USB_CODEC_HOST_FORMAT_SIZE, true, true},
    [STEP_DEVICE_CONFIG] = {REQUEST_IN, GS_USB_CODEC_DEVICE_CONFIG, GS_USB_CODEC_DEVICE_CONFIG_SIZE, true,
                            false},
    [STEP_BT_CONST] = {REQUEST_IN, GS_USB_CODEC_BT_CONST, GS_USB_CODEC_BT_CONST_SIZE, false, false},
    [STEP_RESET] = {REQUEST_OUT, GS_USB_CODEC_MODE, GS_USB_CODEC_MODE_SIZE, false, true},
    [STEP_BITTIMING] = {REQUEST_OUT, GS_USB_CODEC_BITTIMING, GS_USB_CODEC_BITTIMING_SIZE, false, false},
    [STEP_START] = {REQUEST_OUT, GS_USB_CODEC_MODE, GS_USB_CODEC_MODE_SIZE, false, false},
    [STEP_GET_STATE] = {REQUEST_IN, GS_USB_CODEC_GET_STATE, GS_USB_CODEC_GET_STATE_SIZE, false, true},
    [STEP_DONE] = {0},
    [STEP_RECOVER] = {REQUEST_OUT, GS_USB_CODEC_BUS_OFF_RECOVERY, GS_USB_CODEC_BUS_OFF_RECOVERY_SIZE, false,
                      true},
};

typedef struct can_gs_usb can_gs_usb_t;

typedef struct {
    can_gs_usb_t *can;
    struct libusb_transfer *transfer;
    bool busy;
    uint8_t bytes[PACKET_MAX];
} receive_t;

/* A frame is free again when the adapter has both taken it and said that it went to the bus. */
typedef struct {
    can_gs_usb_t *can;
    struct libusb_transfer *transfer;
    bool busy;    /* the transfer is under way */
    bool awaited; /* the echo has not come */
    uint32_t tag;
    uint8_t bytes[GS_USB_CODEC_FRAME_SIZE];
} send_t;

struct can_gs_usb {
    hal_can_t base;
    char serial[GS_USB_DEVICE_SERIAL_SIZE]; /* empty: any adapter */
    uint8_t channel;
    int timer;
    libusb_context *usb; /* NULL: no adapter is there */
    libusb_device_handle *device;
    gs_usb_device_t description;
    gs_usb_codec_constants_t constants;
    step_t step;         /* STEP_DONE: no request is under way */
    bool running;        /* the channel was started */
    bool news;           /* the user is to be told: frames, a new state, room to send */
    bool refused;        /* a frame was refused for want of room */
    const char *failure; /* the adapter is lost; not told to the user yet */
    char reason[192];    /* text for failure */
    struct libusb_transfer *control;
    bool control_busy;
    uint8_t control_bytes[LIBUSB_CONTROL_SETUP_SIZE + GS_USB_CODEC_BT_CONST_SIZE];
    receive_t receives[RECEIVES];
    send_t sends[SENDS_MAX];
    uint32_t next_tag;
    can_frame_t ring[RING];
    size_t ring_first;
    size_t ring_count;
};

static void fail(can_gs_usb_t *can, const char *reason)
{
    if (can->failure == NULL) {
        snprintf(can->reason, sizeof can->reason, "%s", reason);
        can->failure = can->reason;
        oneshot_arm_us(can->timer, 0);
    }
}

/* --- frames from the adapter --- */

static void set_state(can_gs_usb_t *can, hal_can_state_t state)
{
    can->base.health.state = state;
    can->news = true;
}

static void push(can_gs_usb_t *can, const gs_usb_codec_frame_t *frame)
{
    if (can->ring_count == RING) {
        can->base.health.rx_overruns++;
        return;
    }
    gs_usb_codec_to_can_frame(frame, &can->ring[(can->ring_first + can->ring_count) % RING]);
    can->ring_count++;
    can->news = true;
}

static void take_echo(can_gs_usb_t *can, uint32_t tag)
{
    for (size_t i = 0; i < SENDS_MAX; i++) {
        if (can->sends[i].awaited && can->sends[i].tag == tag) {
            can->sends[i].awaited = false;
            can->news = can->news || can->refused;
            return;
        }
    }
}

static void take_transfer(can_gs_usb_t *can, const uint8_t *bytes, int size)
{
    gs_usb_codec_frame_t frame;
    if (size == 0) {
        return;
    }
    if (!gs_usb_codec_decode_frame(bytes, (size_t)size, &frame)) {
        can->base.health.rx_overruns++;
        return;
    }
    if (frame.channel != can->channel || !can->running) {
        return;
    }
    hal_can_state_t before = can->base.health.state;
    if (frame.echo_tag != GS_USB_CODEC_NO_ECHO) {
        take_echo(can, frame.echo_tag);
        return;
    }
    gs_usb_codec_note(&frame, &can->base.health);
    push(can, &frame);
    can->news = can->news || can->base.health.state != before;
}

static void on_received(struct libusb_transfer *transfer);

static void submit_receive(can_gs_usb_t *can, receive_t *receive)
{
    /* One packet and no more: a packet that is filled up to its size then ends the transfer as a short one
     * does. */
    libusb_fill_bulk_transfer(receive->transfer, can->device, can->description.in, receive->bytes,
                              can->description.packet_size, on_received, receive, 0);
    int failure = libusb_submit_transfer(receive->transfer);
    receive->busy = failure == 0;
    if (failure != 0) {
        fail(can, libusb_strerror(failure));
    }
}

static void on_received(struct libusb_transfer *transfer)
{
    receive_t *receive = transfer->user_data;
    can_gs_usb_t *can = receive->can;
    receive->busy = false;
    if (transfer->status != LIBUSB_TRANSFER_COMPLETED) {
        fail(can, "the adapter was pulled out");
        return;
    }
    take_transfer(can, receive->bytes, transfer->actual_length);
    if (can->failure == NULL) {
        submit_receive(can, receive);
    }
}

/* --- frames to the adapter --- */

static void on_sent(struct libusb_transfer *transfer)
{
    send_t *send = transfer->user_data;
    can_gs_usb_t *can = send->can;
    send->busy = false;
    if (transfer->status != LIBUSB_TRANSFER_COMPLETED) {
        fail(can, "the adapter was pulled out");
    } else if (!send->awaited) {
        can->news = can->news || can->refused;
    }
}

static send_t *find_free_send(can_gs_usb_t *can)
{
    for (size_t i = 0; i < SENDS_MAX; i++) {
        if (!can->sends[i].busy && !can->sends[i].awaited) {
            return &can->sends[i];
        }
    }
    return NULL;
}

static bool can_gs_usb_send(hal_can_t *base, const can_frame_t *frame)
{
    can_gs_usb_t *can = (can_gs_usb_t *)base;
    bool usable = can->running && can->failure == NULL &&
                  (base->health.state == HAL_CAN_ACTIVE || base->health.state == HAL_CAN_PASSIVE);
    send_t *send = usable ? find_free_send(can) : NULL;
    if (send == NULL) {
        can->refused = true;
        return false;
    }
    send->tag = can->next_tag;
    can->next_tag = (can->next_tag + 1u) & (UINT32_MAX >> 1); /* never the tag of a received frame */
    gs_usb_codec_encode_frame(frame, send->tag, can->channel, send->bytes);
    libusb_fill_bulk_transfer(send->transfer, can->device, can->description.out, send->bytes,
                              GS_USB_CODEC_FRAME_SIZE, on_sent, send, 0);
    int failure = libusb_submit_transfer(send->transfer);
    if (failure != 0) {
        can->refused = true;
        fail(can, libusb_strerror(failure));
        return false;
    }
    send->busy = true;
    send->awaited = true;
    return true;
}

/* What the adapter has taken, and not sent yet, is thrown away by it at a reset. */
static void forget_sends(can_gs_usb_t *can, bool unplugged)
{
    for (size_t i = 0; i < SENDS_MAX; i++) {
        send_t *send = &can->sends[i];
        if (send->awaited && (unplugged || !send->busy)) {
            send->awaited = false;
            can->base.health.tx_failed++;
        }
    }
}

/* --- requests --- */

static void on_control(struct libusb_transfer *transfer);

static void encode_request(const can_gs_usb_t *can, step_t step, const gs_usb_codec_timing_t *timing,
                           uint8_t *bytes)
{
    uint32_t wanted = can->constants.features & GS_USB_CODEC_FEATURE_BUS_OFF_RECOVERY;
    memset(bytes, 0, requests[step].size);
    if (step == STEP_HOST_FORMAT) {
        gs_usb_codec_encode_host_format(bytes);
    } else if (step == STEP_BITTIMING) {
        gs_usb_codec_encode_timing(timing, bytes);
    } else if (step == STEP_RESET || step == STEP_START) {
        gs_usb_codec_encode_mode(step == STEP_START, step == STEP_START ? wanted : 0, bytes);
    }
}

/* Sends one request; its answer leads to the next. */
static void request(can_gs_usb_t *can, step_t step)
{
    gs_usb_codec_timing_t timing = {0};
    char reason[80];
    if (step == STEP_BITTIMING && !gs_usb_codec_compute_timing(&can->constants, BITRATE_BPS, &timing)) {
        snprintf(reason, sizeof reason, "the adapter's clock of %u Hz cannot make 1 Mbit/s",
                 (unsigned)can->constants.clock_hz);
        fail(can, reason);
        return;
    }
    for (size_t i = 0; step == STEP_START && i < RECEIVES; i++) {
        if (!can->receives[i].busy) {
            submit_receive(can, &can->receives[i]);
        }
    }
    can->step = step;
    libusb_fill_control_setup(can->control_bytes, requests[step].direction, requests[step].request,
                              requests[step].for_device ? 1 : can->channel, GS_USB_DEVICE_INTERFACE,
                              requests[step].size);
    encode_request(can, step, &timing, can->control_bytes + LIBUSB_CONTROL_SETUP_SIZE);
    libusb_fill_control_transfer(can->control, can->device, can->control_bytes, on_control, can,
                                 CONTROL_TIMEOUT_MS);
    int failure = libusb_submit_transfer(can->control);
    can->control_busy = failure == 0;
    if (failure != 0) {
        fail(can, libusb_strerror(failure));
    } else if (!libusb_pollfds_handle_timeouts(can->usb)) {
        oneshot_arm_us(can->timer, (CONTROL_TIMEOUT_MS + 1u) * 1000u);
    }
}

static void finish_start(can_gs_usb_t *can)
{
    can->step = STEP_DONE;
    if (can->base.health.state == HAL_CAN_DOWN) {
        fail(can, "the adapter has not started its channel");
    }
    can->news = true;
}

/* The channel runs: its state is not known better than this until the adapter tells it. */
static void begin_running(can_gs_usb_t *can)
{
    can->running = true;
    can->base.health.tx_errors = 0;
    can->base.health.rx_errors = 0;
    set_state(can, HAL_CAN_ACTIVE);
    if ((can->constants.features & GS_USB_CODEC_FEATURE_STATE) != 0) {
        request(can, STEP_GET_STATE);
    } else {
        finish_start(can);
    }
}

static void take_device_config(can_gs_usb_t *can, const uint8_t *bytes, size_t size)
{
    unsigned channels = gs_usb_codec_decode_channels(bytes, size);
    char reason[80];
    if (can->channel < channels) {
        request(can, STEP_BT_CONST);
        return;
    }
    snprintf(reason, sizeof reason, "the adapter has no channel %u: it has %u, counted from 0", can->channel,
             channels);
    fail(can, reason);
}

/* What an answer leads to. size: of what came, for requests that ask. */
static void advance(can_gs_usb_t *can, const uint8_t *bytes, size_t size)
{
    switch (can->step) {
    case STEP_HOST_FORMAT:
        request(can, STEP_DEVICE_CONFIG);
        break;
    case STEP_DEVICE_CONFIG:
        take_device_config(can, bytes, size);
        break;
    case STEP_BT_CONST:
        if (gs_usb_codec_decode_constants(bytes, size, &can->constants)) {
            request(can, STEP_RESET);
        } else {
            fail(can, "the adapter does not tell its bit timing");
        }
        break;
    case STEP_RESET:
        forget_sends(can, false);
        request(can, STEP_BITTIMING);
        break;
    case STEP_BITTIMING:
        request(can, STEP_START);
        break;
    case STEP_START:
        begin_running(can);
        break;
    case STEP_GET_STATE:
        (void)gs_usb_codec_decode_state(bytes, size, &can->base.health);
        finish_start(can);
        break;
    case STEP_RECOVER:
    case STEP_DONE:
        can->step = STEP_DONE;
        break;
    }
}

static void on_control(struct libusb_transfer *transfer)
{
    can_gs_usb_t *can = transfer->user_data;
    char reason[80];
    can->control_busy = false;
    if (can->failure != NULL) {
        return;
    }
    bool stalled = transfer->status == LIBUSB_TRANSFER_STALL;
    if (transfer->status == LIBUSB_TRANSFER_COMPLETED || (stalled && requests[can->step].optional)) {
        size_t size = stalled ? 0 : (size_t)transfer->actual_length;
        advance(can, can->control_bytes + LIBUSB_CONTROL_SETUP_SIZE, size);
        return;
    }
    snprintf(reason, sizeof reason, "the adapter %s request %u of gs_usb",
             stalled ? "refuses" : "does not answer", requests[can->step].request);
    fail(can, transfer->status == LIBUSB_TRANSFER_NO_DEVICE ? "the adapter was pulled out" : reason);
}

/* After bus-off the adapter goes on if it can, and is reset otherwise (D-LIN-3). */
static void can_gs_usb_restart(hal_can_t *base)
{
    can_gs_usb_t *can = (can_gs_usb_t *)base;
    if (!can->running || can->failure != NULL || can->step != STEP_DONE ||
        base->health.state != HAL_CAN_BUS_OFF) {
        return;
    }
    bool recovers = (can->constants.features & GS_USB_CODEC_FEATURE_BUS_OFF_RECOVERY) != 0;
    request(can, recovers ? STEP_RECOVER : STEP_RESET);
}

/* --- plugging --- */

static bool is_busy(const can_gs_usb_t *can)
{
    bool busy = can->control_busy;
    for (size_t i = 0; i < RECEIVES; i++) {
        busy = busy || can->receives[i].busy;
    }
    for (size_t i = 0; i < SENDS_MAX; i++) {
        busy = busy || can->sends[i].busy;
    }
    return busy;
}

/* Cancels all transfers and takes them back: the kernel has given each up when its cancelling returns. */
static void cancel_all(can_gs_usb_t *can)
{
    if (can->control_busy) {
        libusb_cancel_transfer(can->control);
    }
    for (size_t i = 0; i < RECEIVES; i++) {
        if (can->receives[i].busy) {
            libusb_cancel_transfer(can->receives[i].transfer);
        }
    }
    for (size_t i = 0; i < SENDS_MAX; i++) {
        if (can->sends[i].busy) {
            libusb_cancel_transfer(can->sends[i].transfer);
        }
    }
    while (is_busy(can)) {
        struct timeval step = {.tv_usec = CANCEL_STEP_US};
        libusb_handle_events_timeout_completed(can->usb, &step, NULL);
    }
}

/* A transfer keeps its device, and that its context, until it is freed: there are new ones for each plugging.
 */
static bool allocate_transfers(can_gs_usb_t *can)
{
    can->control = libusb_alloc_transfer(0);
    bool ok = can->control != NULL;
    for (size_t i = 0; i < RECEIVES; i++) {
        can->receives[i].can = can;
        can->receives[i].transfer = libusb_alloc_transfer(0);
        ok = ok && can->receives[i].transfer != NULL;
    }
    for (size_t i = 0; i < SENDS_MAX; i++) {
        can->sends[i].can = can;
        can->sends[i].transfer = libusb_alloc_transfer(0);
        ok = ok && can->sends[i].transfer != NULL;
    }
    return ok;
}

static void free_transfers(can_gs_usb_t *can)
{
    libusb_free_transfer(can->control);
    can->control = NULL;
    for (size_t i = 0; i < RECEIVES; i++) {
        libusb_free_transfer(can->receives[i].transfer);
        can->receives[i].transfer = NULL;
    }
    for (size_t i = 0; i < SENDS_MAX; i++) {
        libusb_free_transfer(can->sends[i].transfer);
        can->sends[i].transfer = NULL;
    }
}

/* Gives the device back to the kernel's driver and forgets it. Not to be called from a callback of libusb. */
static void detach(can_gs_usb_t *can)
{
    if (can->device != NULL) {
        cancel_all(can);
        free_transfers(can);
        libusb_release_interface(can->device, GS_USB_DEVICE_INTERFACE);
        libusb_close(can->device);
        can->device = NULL;
    }
    if (can->usb != NULL) {
        libusb_exit(can->usb);
        can->usb = NULL;
    }
    forget_sends(can, true);
    can->running = false;
    can->step = STEP_DONE;
    can->failure = NULL;
    can->base.health.state = HAL_CAN_DOWN;
}

/* Tells the user what is new, and does what a callback could not. */
static void settle(can_gs_usb_t *can)
{
    bool lost = can->failure != NULL;
    if (lost) {
        can->news = can->news || can->running;
        detach(can);
        oneshot_arm_us(can->timer, RETRY_US);
    }
    if (can->news) {
        can->news = false;
        can->refused = false;
        can->base.ready(can->base.ctx);
    }
}

static void work(can_gs_usb_t *can)
{
    struct timeval none = {0};
    if (can->usb != NULL) {
        libusb_handle_events_timeout_completed(can->usb, &none, NULL);
    }
    settle(can);
}

static void on_usb(void *ctx, uint32_t events)
{
    (void)events;
    work(ctx);
}

static void on_descriptor_added(int fd, short events, void *ctx)
{
    can_gs_usb_t *can = ctx;
    /* POLLIN and EPOLLIN, POLLOUT and EPOLLOUT are the same bits. */
    if (!loop_add(can->base.loop, fd, (uint32_t)events, on_usb, can)) {
        fail(can, strerror(errno));
    }
}

static void on_descriptor_removed(int fd, void *ctx)
{
    can_gs_usb_t *can = ctx;
    loop_remove(can->base.loop, fd);
}

static bool watch(can_gs_usb_t *can)
{
    const struct libusb_pollfd **list = libusb_get_pollfds(can->usb);
    if (list == NULL) {
        return false;
    }
    for (size_t i = 0; list[i] != NULL; i++) {
        on_descriptor_added(list[i]->fd, list[i]->events, can);
    }
    libusb_free_pollfds(list);
    libusb_set_pollfd_notifiers(can->usb, on_descriptor_added, on_descriptor_removed, can);
    return true;
}

/* Looks for the adapter and begins to start it. False: can->reason says why not. */
static bool attach(can_gs_usb_t *can)
{
    int failure = libusb_init(&can->usb);
    if (failure != 0) {
        can->usb = NULL;
        snprintf(can->reason, sizeof can->reason, "USB cannot be used: %s", libusb_strerror(failure));
        return false;
    }
    if (!watch(can)) {
        snprintf(can->reason, sizeof can->reason, "USB cannot be watched");
        return false;
    }
    can->device =
        gs_usb_device_open(can->usb, can->serial, &can->description, can->reason, sizeof can->reason);
    if (can->device == NULL) {
        return false;
    }
    if (can->description.packet_size < GS_USB_CODEC_FRAME_SIZE || can->description.packet_size > PACKET_MAX) {
        snprintf(can->reason, sizeof can->reason, "the adapter's packets of %u bytes are not those of gs_usb",
                 can->description.packet_size);
        return false;
    }
    if (!allocate_transfers(can)) {
        snprintf(can->reason, sizeof can->reason, "%s", strerror(ENOMEM));
        return false;
    }
    request(can, STEP_HOST_FORMAT);
    return true;
}

static void on_timer(void *ctx, uint32_t events)
{
    can_gs_usb_t *can = ctx;
    (void)events;
    if (can->usb == NULL && !attach(can)) {
        detach(can);
        oneshot_arm_us(can->timer, RETRY_US);
        return;
    }
    work(can);
}

/* --- opening and closing --- */

static size_t can_gs_usb_receive(hal_can_t *base, can_frame_t *frames, size_t max)
{
    can_gs_usb_t *can = (can_gs_usb_t *)base;
    size_t n = 0;
    for (; n < max && can->ring_count > 0; n++) {
        frames[n] = can->ring[can->ring_first];
        can->ring_first = (can->ring_first + 1) % RING;
        can->ring_count--;
    }
    return n;
}

/* Adapters have few filters, if any, and no common way to set them. */
static void can_gs_usb_set_filters(hal_can_t *base, const hal_can_filter_t *filters, size_t n)
{
    (void)base;
    (void)filters;
    (void)n;
}

static void can_gs_usb_close(hal_can_t *base)
{
    can_gs_usb_t *can = (can_gs_usb_t *)base;
    detach(can);
    oneshot_close(base->loop, can->timer);
    free(can);
}

/* SERIAL, SERIAL/N, /N or nothing. */
static bool take_address(can_gs_usb_t *can, const char *bus, const char *address)
{
    const char *slash = strrchr(address, '/');
    size_t length = slash != NULL ? (size_t)(slash - address) : strlen(address);
    bool empty_serial = length == 0 && strchr(bus, ':') != NULL;
    if (length >= sizeof can->serial || empty_serial) {
        return false;
    }
    memcpy(can->serial, address, length);
    if (slash == NULL) {
        return true;
    }
    char *end;
    unsigned long channel = strtoul(slash + 1, &end, 10);
    can->channel = (uint8_t)channel;
    return slash[1] >= '0' && slash[1] <= '9' && *end == '\0' && channel < CHANNELS_MAX;
}

/* The first start is waited for: what is wrong with the arguments is to be told at the start. Returns what
 * went wrong, or NULL. */
static const char *start_now(can_gs_usb_t *can)
{
    uint64_t limit_us = loop_refresh_now_us(can->base.loop) + OPEN_LIMIT_US;
    if (!attach(can)) {
        return can->reason;
    }
    while (!can->running || can->step != STEP_DONE) {
        struct timeval step = {.tv_usec = OPEN_STEP_US};
        libusb_handle_events_timeout_completed(can->usb, &step, NULL);
        if (can->failure != NULL) {
            return can->failure;
        }
        if (loop_refresh_now_us(can->base.loop) >= limit_us) {
            return "the adapter has not started within 2 s";
        }
    }
    return NULL;
}

static hal_can_t *can_gs_usb_open(const linux_can_request_t *wanted)
{
    can_gs_usb_t *can = calloc(1, sizeof *can);
    if (can == NULL) {
        linux_can_refuse(wanted, strerror(errno));
        return NULL;
    }
    const char *reason = "expected gs_usb, gs_usb:SERIAL, gs_usb/CHANNEL or gs_usb:SERIAL/CHANNEL";
    linux_can_init(&can->base, &can_gs_usb_backend, wanted);
    can->step = STEP_DONE;
    can->timer = oneshot_open(wanted->loop, on_timer, can);
    if (can->timer < 0) {
        reason = strerror(errno);
    } else if (take_address(can, wanted->bus, wanted->address)) {
        reason = start_now(can);
    }
    if (reason != NULL) {
        linux_can_refuse(wanted, reason);
        can_gs_usb_close(&can->base);
        return NULL;
    }
    /* When it was pulled out, this adapter is waited for and no other. */
    memcpy(can->serial, can->description.serial, sizeof can->serial);
    oneshot_arm_us(can->timer, 0); /* what has come meanwhile */
    return &can->base;
}

const linux_can_backend_t can_gs_usb_backend = {.kind = "gs_usb",
                                                .address_optional = true,
                                                .open = can_gs_usb_open,
                                                .close = can_gs_usb_close,
                                                .send = can_gs_usb_send,
                                                .receive = can_gs_usb_receive,
                                                .restart = can_gs_usb_restart,
                                                .set_filters = can_gs_usb_set_filters};

/* --- what is plugged in --- */

static void tell(const gs_usb_device_t *device, can_gs_usb_found_t found, void *ctx)
{
    char name[GS_USB_DEVICE_SERIAL_SIZE + 8];
    char text[192];
    snprintf(name, sizeof name, "gs_usb%s%s", device->serial[0] != '\0' ? ":" : "", device->serial);
    snprintf(text, sizeof text, "USB %04x:%04x %s%s", device->vid, device->pid, device->product,
             gs_usb_device_is_permitted(device) ? "" : " (no right to open it)");
    found(ctx, name, text);
}

void can_gs_usb_list(can_gs_usb_found_t found, void *ctx)
{
    libusb_context *usb;
    libusb_device **devices;
    if (libusb_init(&usb) != 0) {
        return;
    }
    ssize_t n = libusb_get_device_list(usb, &devices);
    for (ssize_t i = 0; i < n; i++) {
        gs_usb_device_t device;
        if (gs_usb_device_describe(devices[i], &device) && device.known) {
            tell(&device, found, ctx);
        }
    }
    if (n >= 0) {
        libusb_free_device_list(devices, 1);
    }
    libusb_exit(usb);
}
