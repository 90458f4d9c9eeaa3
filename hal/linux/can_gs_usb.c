/* A USB CAN adapter that speaks gs_usb, driven from user space through libusb: no CAN is needed in the
 * kernel.
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

#include "gs_usb_adapter.h"
#include "gs_usb_device.h"
#include "gs_usb_frames.h"
#include "gs_usb_requests.h"
#include "linux_can_backend.h"
#include "oneshot.h"

#define CHANNELS_MAX 256
#define RETRY_US 500000u
#define OPEN_LIMIT_US 2000000u
#define OPEN_STEP_US 20000
#define CANCEL_STEP_US 10000

typedef struct {
    gs_usb_adapter_t adapter; /* begins with the hal_can_t */
    gs_usb_frames_t frames;
    gs_usb_requests_t requests;
} can_gs_usb_t;

/* --- plugging --- */

/* Cancels all transfers and takes them back: the kernel has given each up when its cancelling returns. */
static void cancel_all(can_gs_usb_t *can)
{
    gs_usb_requests_cancel(&can->requests);
    gs_usb_frames_cancel(&can->frames);
    while (can->requests.busy || gs_usb_frames_are_busy(&can->frames)) {
        struct timeval step = {.tv_usec = CANCEL_STEP_US};
        libusb_handle_events_timeout_completed(can->adapter.usb, &step, NULL);
    }
}

static bool allocate_transfers(can_gs_usb_t *can)
{
    bool requests_ok = gs_usb_requests_allocate(&can->requests);
    bool frames_ok = gs_usb_frames_allocate(&can->frames);
    return requests_ok && frames_ok;
}

/* Gives the device back to the kernel's driver and forgets it. Not to be called from a callback of libusb. */
static void detach(can_gs_usb_t *can)
{
    gs_usb_adapter_t *adapter = &can->adapter;
    if (adapter->device != NULL) {
        cancel_all(can);
        gs_usb_requests_free(&can->requests);
        gs_usb_frames_free(&can->frames);
        libusb_release_interface(adapter->device, GS_USB_DEVICE_INTERFACE);
        libusb_close(adapter->device);
        adapter->device = NULL;
    }
    if (adapter->usb != NULL) {
        libusb_exit(adapter->usb);
        adapter->usb = NULL;
    }
    gs_usb_frames_forget_sends(&can->frames, true);
    adapter->running = false;
    can->requests.step = GS_USB_REQUESTS_DONE;
    adapter->failure = NULL;
    adapter->base.health.state = HAL_CAN_DOWN;
}

/* Tells the user what is new, and does what a callback could not. */
static void settle(can_gs_usb_t *can)
{
    gs_usb_adapter_t *adapter = &can->adapter;
    if (adapter->failure != NULL) {
        adapter->news = adapter->news || adapter->running;
        detach(can);
        oneshot_arm_us(adapter->timer, RETRY_US);
    }
    if (adapter->news) {
        adapter->news = false;
        can->frames.refused = false;
        adapter->base.ready(adapter->base.ctx);
    }
}

static void work(can_gs_usb_t *can)
{
    struct timeval none = {0};
    if (can->adapter.usb != NULL) {
        libusb_handle_events_timeout_completed(can->adapter.usb, &none, NULL);
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
    if (!loop_add(can->adapter.base.loop, fd, (uint32_t)events, on_usb, can)) {
        gs_usb_adapter_fail(&can->adapter, strerror(errno));
    }
}

static void on_descriptor_removed(int fd, void *ctx)
{
    can_gs_usb_t *can = ctx;
    loop_remove(can->adapter.base.loop, fd);
}

static bool watch(can_gs_usb_t *can)
{
    const struct libusb_pollfd **list = libusb_get_pollfds(can->adapter.usb);
    if (list == NULL) {
        return false;
    }
    for (size_t i = 0; list[i] != NULL; i++) {
        on_descriptor_added(list[i]->fd, list[i]->events, can);
    }
    libusb_free_pollfds(list);
    libusb_set_pollfd_notifiers(can->adapter.usb, on_descriptor_added, on_descriptor_removed, can);
    return true;
}

/* Looks for the adapter and begins to start it. False: the reason of the adapter says why not. */
static bool attach(can_gs_usb_t *can)
{
    gs_usb_adapter_t *adapter = &can->adapter;
    int failure = libusb_init(&adapter->usb);
    if (failure != 0) {
        adapter->usb = NULL;
        snprintf(adapter->reason, sizeof adapter->reason, "USB cannot be used: %s", libusb_strerror(failure));
        return false;
    }
    if (!watch(can)) {
        snprintf(adapter->reason, sizeof adapter->reason, "USB cannot be watched");
        return false;
    }
    adapter->device = gs_usb_device_open(adapter->usb, adapter->serial, &adapter->description,
                                         adapter->reason, sizeof adapter->reason);
    if (adapter->device == NULL) {
        return false;
    }
    if (!gs_usb_frames_fit(adapter->description.packet_size)) {
        snprintf(adapter->reason, sizeof adapter->reason,
                 "the adapter's packets of %u bytes are not those of gs_usb",
                 adapter->description.packet_size);
        return false;
    }
    if (!allocate_transfers(can)) {
        snprintf(adapter->reason, sizeof adapter->reason, "%s", strerror(ENOMEM));
        return false;
    }
    gs_usb_requests_start(&can->requests);
    return true;
}

static void on_timer(void *ctx, uint32_t events)
{
    can_gs_usb_t *can = ctx;
    (void)events;
    if (can->adapter.usb == NULL && !attach(can)) {
        detach(can);
        oneshot_arm_us(can->adapter.timer, RETRY_US);
        return;
    }
    work(can);
}

/* --- the contract --- */

static bool can_gs_usb_send(hal_can_t *base, const can_frame_t *frame)
{
    can_gs_usb_t *can = (can_gs_usb_t *)base;
    return gs_usb_frames_send(&can->frames, frame);
}

static size_t can_gs_usb_receive(hal_can_t *base, can_frame_t *frames, size_t max)
{
    can_gs_usb_t *can = (can_gs_usb_t *)base;
    return gs_usb_frames_receive(&can->frames, frames, max);
}

static void can_gs_usb_restart(hal_can_t *base)
{
    can_gs_usb_t *can = (can_gs_usb_t *)base;
    gs_usb_requests_restart(&can->requests);
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
    oneshot_close(base->loop, can->adapter.timer);
    free(can);
}

/* SERIAL, SERIAL/N, /N or nothing. */
static bool take_address(can_gs_usb_t *can, const char *bus, const char *address)
{
    const char *slash = strrchr(address, '/');
    size_t length = slash != NULL ? (size_t)(slash - address) : strlen(address);
    bool empty_serial = length == 0 && strchr(bus, ':') != NULL;
    if (length >= sizeof can->adapter.serial || empty_serial) {
        return false;
    }
    memcpy(can->adapter.serial, address, length);
    if (slash == NULL) {
        return true;
    }
    char *end;
    unsigned long channel = strtoul(slash + 1, &end, 10);
    can->adapter.channel = (uint8_t)channel;
    return slash[1] >= '0' && slash[1] <= '9' && *end == '\0' && channel < CHANNELS_MAX;
}

/* The first start is waited for: what is wrong with the arguments is to be told at the start. Returns what
 * went wrong, or NULL. */
static const char *start_now(can_gs_usb_t *can)
{
    uint64_t limit_us = loop_refresh_now_us(can->adapter.base.loop) + OPEN_LIMIT_US;
    if (!attach(can)) {
        return can->adapter.reason;
    }
    while (!can->adapter.running || can->requests.step != GS_USB_REQUESTS_DONE) {
        struct timeval step = {.tv_usec = OPEN_STEP_US};
        libusb_handle_events_timeout_completed(can->adapter.usb, &step, NULL);
        if (can->adapter.failure != NULL) {
            return can->adapter.failure;
        }
        if (loop_refresh_now_us(can->adapter.base.loop) >= limit_us) {
            return "the adapter has not started within 2 s";
        }
    }
    return NULL;
}

static hal_can_t *can_gs_usb_open(const linux_can_request_t *wanted)
{
    can_gs_usb_t *can = calloc(1, sizeof *can);
    if (can == NULL) {
        linux_can_backend_refuse(wanted, strerror(errno));
        return NULL;
    }
    const char *reason = "expected gs_usb, gs_usb:SERIAL, gs_usb/CHANNEL or gs_usb:SERIAL/CHANNEL";
    linux_can_backend_init(&can->adapter.base, &can_gs_usb_backend, wanted);
    can->frames.adapter = &can->adapter;
    can->requests.adapter = &can->adapter;
    can->requests.frames = &can->frames;
    can->requests.step = GS_USB_REQUESTS_DONE;
    can->adapter.timer = oneshot_open(wanted->loop, on_timer, can);
    if (can->adapter.timer < 0) {
        reason = strerror(errno);
    } else if (take_address(can, wanted->bus, wanted->address)) {
        reason = start_now(can);
    }
    if (reason != NULL) {
        linux_can_backend_refuse(wanted, reason);
        can_gs_usb_close(&can->adapter.base);
        return NULL;
    }
    /* When it was pulled out, this adapter is waited for and no other. */
    memcpy(can->adapter.serial, can->adapter.description.serial, sizeof can->adapter.serial);
    oneshot_arm_us(can->adapter.timer, 0); /* what has come meanwhile */
    return &can->adapter.base;
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
