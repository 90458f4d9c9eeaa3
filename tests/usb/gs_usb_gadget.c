/* An emulated CAN adapter that speaks gs_usb: a USB device in user space (FunctionFS), whose CAN side is an
 * interface of the kernel. What it does is written from the wire facts of the protocol and of the candleLight
 * firmware, apart from hal/linux; the kernel's own gs_usb driver is the proof that it is right
 * (tests/usb/on_usb.py).
 *
 *     gs_usb_gadget FFS_FOLDER CAN_INTERFACE CONTROL_SOCKET [fd] [pad] [old]
 *
 * fd: CAN FD firmware with a clock of 80 MHz; pad: fills every packet; old: no state request, no time
 * stamps, and only a reset brings it back from bus-off. Prints "ready" when the device may be plugged in.
 * Commands come as datagrams at CONTROL_SOCKET, each is answered with the counters as a JSON object:
 *
 *     report | bus-off | bus-off-after ECHOES | errors TX RX | overflow
 *
 * bus-off-after: when so many frames of the host have gone out since the start, whenever that
 * is. */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <linux/aio_abi.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/usb/functionfs.h>
#include <net/if.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

enum {
    PACKET = 32, /* of a full-speed bulk endpoint, as the classic firmware has it */
    PACKET_FD = 64,
    FRAME = 20,
    STAMP = 4,
    POOL = 64, /* frames under way, both directions together */
    READS = 16,
    WRITES = 32,
    RESTART_MS = 100,
    RECEIVE_BUFFER = 32 * 1024 * 1024
};

enum { HOST_FORMAT, BITTIMING, MODE, BT_CONST = 4, DEVICE_CONFIG, TIMESTAMP, IDENTIFY, DATA_BITTIMING = 10 };
enum { BT_CONST_EXT = 11, GET_STATE = 14, BUS_OFF_RECOVERY = 32 };
enum { ACTIVE, WARNING, PASSIVE, BUS_OFF, STOPPED };

#define FEATURE_TIMESTAMP (1u << 4)
#define FEATURE_IDENTIFY (1u << 5)
#define FEATURE_PAD (1u << 7)
#define FEATURE_FD (1u << 8)
#define FEATURE_BT_CONST_EXT (1u << 10)
#define FEATURE_STATE (1u << 13)
#define FEATURE_RECOVERY (1u << 18)
#define FLAG_OVERFLOW 1u
#define NOT_AN_ECHO UINT32_MAX

typedef struct {
    uint32_t word[10]; /* features, clock, tseg1 min max, tseg2 min max, sjw max, brp min max step */
} constants_t;

typedef struct {
    struct iocb control;
    uint8_t bytes[PACKET_FD];
    bool busy;
    bool echo; /* of a frame that the host still counts as under way */
} transfer_t;

typedef struct {
    uint8_t bytes[FRAME];
    uint32_t stamp_us;
} frame_t;

typedef struct {
    frame_t frames[POOL + 4]; /* error frames come on top */
    unsigned first, count;
} queue_t;

/* What the tests ask for. */
typedef struct {
    unsigned from_host, to_host, echoes, in_flight_max, lost, bad_frames, bad_requests, unformatted, starts,
        restarts, plugged;
} counters_t;

typedef struct {
    int ep0, in, out, can, control, event;
    aio_context_t aio;
    constants_t constants, data_constants;
    bool pad, restarts, plugged, formatted, timed, overflow;
    uint32_t timing[5];
    uint32_t flags;
    unsigned state, tx_errors, rx_errors;
    uint64_t restart_at_ms;               /* 0: not by itself */
    unsigned bus_off_at;                  /* echoes; 0: never */
    transfer_t transfers[READS + WRITES]; /* reads first */
    queue_t from_host, to_host;
    unsigned under_way; /* frames of the host whose echo it has not got yet */
    counters_t counters;
} adapter_t;

/* --- small things --- */

static void fail(const char *what)
{
    (void)fprintf(stderr, "gs_usb_gadget: %s: %s\n", what, strerror(errno));
    exit(1);
}

static uint64_t now_us(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

static uint32_t get32(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static void put32(uint8_t *bytes, uint32_t value)
{
    for (unsigned i = 0; i < 4; i++) {
        bytes[i] = (uint8_t)(value >> 8 * i);
    }
}

static void push(queue_t *queue, const frame_t *frame)
{
    queue->frames[(queue->first + queue->count++) % (sizeof queue->frames / sizeof queue->frames[0])] =
        *frame;
}

static frame_t pop(queue_t *queue)
{
    const frame_t frame = queue->frames[queue->first];
    queue->first = (queue->first + 1) % (sizeof queue->frames / sizeof queue->frames[0]);
    queue->count--;
    return frame;
}

/* --- the two bulk endpoints --- */

static unsigned packet_size(const adapter_t *adapter)
{
    return (adapter->constants.word[0] & FEATURE_FD) != 0 ? PACKET_FD : PACKET;
}

/* Transfers to be handed over in one call. */
typedef struct {
    struct iocb *list[READS + WRITES];
    long count;
} batch_t;

static void add(adapter_t *adapter, batch_t *batch, transfer_t *transfer, int fd, uint16_t opcode,
                unsigned size)
{
    memset(&transfer->control, 0, sizeof transfer->control);
    transfer->control.aio_data = (uint64_t)(transfer - adapter->transfers);
    transfer->control.aio_lio_opcode = opcode;
    transfer->control.aio_fildes = (uint32_t)fd;
    transfer->control.aio_buf = (uint64_t)(uintptr_t)transfer->bytes;
    transfer->control.aio_nbytes = size;
    transfer->control.aio_flags = IOCB_FLAG_RESFD;
    transfer->control.aio_resfd = (uint32_t)adapter->event;
    transfer->busy = true;
    batch->list[batch->count++] = &transfer->control;
}

/* What the kernel does not take, because the device was unplugged, is as good as never sent. */
static long submit(adapter_t *adapter, batch_t *batch)
{
    const long taken = batch->count > 0 ? syscall(SYS_io_submit, adapter->aio, batch->count, batch->list) : 0;
    for (long i = taken > 0 ? taken : 0; i < batch->count; i++) {
        adapter->transfers[batch->list[i]->aio_data].busy = false;
    }
    return taken > 0 ? taken : 0;
}

/* Frames and reads under way: every read that is queued may bring a frame. */
static unsigned pool_used(const adapter_t *adapter)
{
    unsigned used = adapter->from_host.count + adapter->to_host.count;
    for (unsigned i = 0; i < READS; i++) {
        used += adapter->transfers[i].busy ? 1u : 0u;
    }
    return used;
}

static void read_more(adapter_t *adapter)
{
    batch_t batch = {.count = 0};
    for (unsigned i = 0; i < READS && adapter->plugged && pool_used(adapter) < POOL; i++) {
        if (!adapter->transfers[i].busy) {
            add(adapter, &batch, &adapter->transfers[i], adapter->out, IOCB_CMD_PREAD, packet_size(adapter));
        }
    }
    (void)submit(adapter, &batch);
}

/* Fills a packet; returns its size. */
static unsigned write_packet(const adapter_t *adapter, const frame_t *frame, uint8_t bytes[PACKET_FD])
{
    memset(bytes, 0, PACKET_FD);
    memcpy(bytes, frame->bytes, FRAME);
    const bool stamped = (adapter->flags & FEATURE_TIMESTAMP) != 0;
    if (stamped) {
        put32(bytes + FRAME, frame->stamp_us);
    }
    if (adapter->pad || (adapter->flags & FEATURE_PAD) != 0) {
        return packet_size(adapter);
    }
    return stamped ? FRAME + STAMP : FRAME;
}

static void write_more(adapter_t *adapter)
{
    batch_t batch = {.count = 0};
    for (unsigned i = 0; i < WRITES && adapter->plugged && adapter->to_host.count > 0; i++) {
        transfer_t *transfer = &adapter->transfers[READS + i];
        if (!transfer->busy) {
            const frame_t frame = pop(&adapter->to_host);
            const unsigned size = write_packet(adapter, &frame, transfer->bytes);
            transfer->echo = get32(frame.bytes) != NOT_AN_ECHO;
            add(adapter, &batch, transfer, adapter->in, IOCB_CMD_PWRITE, size);
        }
    }
    adapter->counters.to_host += (unsigned)submit(adapter, &batch);
}

/* --- CAN --- */

static void tell_host(adapter_t *adapter, frame_t *frame)
{
    frame->stamp_us = (uint32_t)now_us();
    if (adapter->overflow) {
        frame->bytes[10] |= FLAG_OVERFLOW;
        adapter->overflow = false;
    }
    push(&adapter->to_host, frame);
}

static void tell_error(adapter_t *adapter, uint32_t classes, uint8_t controller)
{
    frame_t frame = {{0}, 0};
    if (adapter->to_host.count >= POOL) {
        return;
    }
    put32(frame.bytes, NOT_AN_ECHO);
    put32(frame.bytes + 4, CAN_ERR_FLAG | classes);
    frame.bytes[8] = CAN_ERR_DLC;
    frame.bytes[13] = controller;
    frame.bytes[18] = (uint8_t)adapter->tx_errors;
    frame.bytes[19] = (uint8_t)adapter->rx_errors;
    tell_host(adapter, &frame);
}

static void go_bus_off(adapter_t *adapter)
{
    adapter->state = BUS_OFF;
    adapter->tx_errors = 255;
    tell_error(adapter, CAN_ERR_BUSOFF, 0);
    if (adapter->restarts && (adapter->flags & FEATURE_RECOVERY) == 0) {
        adapter->restart_at_ms = now_us() / 1000u + RESTART_MS;
    }
}

static void restart(adapter_t *adapter)
{
    adapter->state = ACTIVE;
    adapter->tx_errors = 0;
    adapter->rx_errors = 0;
    adapter->restart_at_ms = 0;
    adapter->counters.restarts++;
    tell_error(adapter, CAN_ERR_RESTARTED, 0);
}

static void set_errors(adapter_t *adapter, unsigned tx, unsigned rx)
{
    const unsigned highest = tx > rx ? tx : rx;
    uint8_t controller = CAN_ERR_CRTL_ACTIVE;
    adapter->tx_errors = tx;
    adapter->rx_errors = rx;
    adapter->state = highest < 96 ? ACTIVE : highest < 128 ? WARNING : PASSIVE;
    if (adapter->state == WARNING) {
        controller = tx >= rx ? CAN_ERR_CRTL_TX_WARNING : CAN_ERR_CRTL_RX_WARNING;
    } else if (adapter->state == PASSIVE) {
        controller = tx >= rx ? CAN_ERR_CRTL_TX_PASSIVE : CAN_ERR_CRTL_RX_PASSIVE;
    }
    tell_error(adapter, CAN_ERR_CRTL | CAN_ERR_CNT, controller);
}

/* Frames of the host onto the bus; each goes back as its echo. */
static void send_more(adapter_t *adapter)
{
    while (adapter->from_host.count > 0 && adapter->state < BUS_OFF) {
        struct can_frame out = {0};
        frame_t *frame = &adapter->from_host.frames[adapter->from_host.first];
        out.can_id = get32(frame->bytes + 4);
        out.can_dlc = frame->bytes[8];
        memcpy(out.data, frame->bytes + 12, sizeof out.data);
        if (write(adapter->can, &out, sizeof out) != (ssize_t)sizeof out) {
            return;
        }
        frame_t echo = pop(&adapter->from_host);
        tell_host(adapter, &echo);
        adapter->counters.echoes++;
        if (adapter->counters.echoes == adapter->bus_off_at) {
            go_bus_off(adapter);
        }
    }
}

/* A frame stays in the interface's queue while the pool is full: a bus is no faster than an adapter, but vcan
 * is. */
static void receive_more(adapter_t *adapter)
{
    struct can_frame in;
    while ((adapter->state >= BUS_OFF || pool_used(adapter) < POOL) &&
           read(adapter->can, &in, sizeof in) == (ssize_t)sizeof in) {
        if (adapter->state >= BUS_OFF) {
            continue;
        }
        frame_t frame = {{0}, 0};
        put32(frame.bytes, NOT_AN_ECHO);
        put32(frame.bytes + 4, in.can_id);
        frame.bytes[8] = in.can_dlc;
        memcpy(frame.bytes + 12, in.data, sizeof in.data);
        tell_host(adapter, &frame);
    }
}

static void take_from_host(adapter_t *adapter, const uint8_t *bytes, int64_t size)
{
    frame_t frame;
    if (size < FRAME || bytes[8] > 8 || bytes[9] != 0 || get32(bytes) == NOT_AN_ECHO) {
        adapter->counters.bad_frames++;
        return;
    }
    adapter->counters.from_host++;
    if (adapter->state == STOPPED) {
        adapter->counters.lost++;
        return;
    }
    memcpy(frame.bytes, bytes, FRAME);
    push(&adapter->from_host, &frame);
    adapter->under_way++;
    if (adapter->under_way > adapter->counters.in_flight_max) {
        adapter->counters.in_flight_max = adapter->under_way;
    }
}

/* --- control requests --- */

static void stop_channel(adapter_t *adapter)
{
    adapter->counters.lost += adapter->from_host.count;
    adapter->from_host.count = 0;
    adapter->to_host.count = 0;
    adapter->under_way = 0;
    for (unsigned i = READS; i < READS + WRITES; i++) {
        adapter->transfers[i].echo = false;
    }
    adapter->state = STOPPED;
    adapter->flags = 0;
    adapter->timed = false;
    adapter->restart_at_ms = 0;
}

static void set_mode(adapter_t *adapter, const uint8_t *bytes)
{
    const uint32_t flags = get32(bytes + 4);
    if (get32(bytes) == 0) {
        stop_channel(adapter);
    } else if (!adapter->timed || (flags & ~adapter->constants.word[0]) != 0) {
        adapter->counters.bad_requests++;
    } else {
        struct can_frame old;
        while (adapter->state == STOPPED && read(adapter->can, &old, sizeof old) > 0) {
        }
        adapter->flags = flags;
        adapter->state = ACTIVE;
        adapter->tx_errors = 0;
        adapter->rx_errors = 0;
        adapter->restart_at_ms = 0;
        adapter->counters.starts++;
    }
}

static void set_timing(adapter_t *adapter, const uint8_t *bytes)
{
    const uint32_t *limit = adapter->constants.word;
    for (unsigned i = 0; i < 5; i++) {
        adapter->timing[i] = get32(bytes + 4 * i);
    }
    const uint32_t tseg1 = adapter->timing[0] + adapter->timing[1];
    const uint32_t tseg2 = adapter->timing[2];
    const uint32_t sjw = adapter->timing[3];
    const uint32_t brp = adapter->timing[4];
    adapter->timed = tseg1 >= limit[2] && tseg1 <= limit[3] && tseg2 >= limit[4] && tseg2 <= limit[5] &&
                     sjw >= 1 && sjw <= limit[6] && brp >= limit[7] && brp <= limit[8];
    adapter->counters.bad_requests += adapter->timed ? 0u : 1u;
}

/* The size of a request that the host sends, -1 when there is none such. */
static int size_to_take(unsigned request)
{
    switch (request) {
    case HOST_FORMAT:
    case IDENTIFY:
        return 4;
    case BITTIMING:
    case DATA_BITTIMING:
        return 20;
    case MODE:
        return 8;
    case BUS_OFF_RECOVERY:
        return 0;
    default:
        return -1;
    }
}

static void take_request(adapter_t *adapter, unsigned request, const uint8_t *bytes)
{
    if (request == HOST_FORMAT) {
        adapter->formatted = get32(bytes) == 0x0000beef;
        adapter->counters.bad_requests += adapter->formatted ? 0u : 1u;
    } else if (request == BITTIMING) {
        set_timing(adapter, bytes);
    } else if (request == MODE) {
        set_mode(adapter, bytes);
    } else if (request == BUS_OFF_RECOVERY) {
        if ((adapter->flags & FEATURE_RECOVERY) != 0 && adapter->state == BUS_OFF) {
            restart(adapter);
        } else {
            adapter->counters.bad_requests++;
        }
    }
}

/* Writes what the host asked for; returns its size, -1 when there is no such request. */
static int answer_request(const adapter_t *adapter, unsigned request, uint8_t *bytes)
{
    unsigned words = 0;
    if (request == BT_CONST || (request == BT_CONST_EXT && (adapter->constants.word[0] & FEATURE_FD) != 0)) {
        for (; words < 10; words++) {
            put32(bytes + 4 * words, adapter->constants.word[words]);
        }
        for (unsigned i = 2; request == BT_CONST_EXT && i < 10; i++, words++) {
            put32(bytes + 4 * words, adapter->data_constants.word[i]);
        }
    } else if (request == DEVICE_CONFIG) {
        put32(bytes, 0);
        put32(bytes + 4, 2);
        put32(bytes + 8, 1);
        words = 3;
    } else if (request == TIMESTAMP) {
        put32(bytes, (uint32_t)now_us());
        words = 1;
    } else if (request == GET_STATE && (adapter->constants.word[0] & FEATURE_STATE) != 0) {
        put32(bytes, adapter->state);
        put32(bytes + 4, adapter->rx_errors);
        put32(bytes + 8, adapter->tx_errors);
        words = 3;
    }
    return words > 0 ? (int)(4 * words) : -1;
}

/* A read of an answer, or a write of a request, in the wrong direction stalls the endpoint. */
static void on_setup(adapter_t *adapter, const struct usb_ctrlrequest *setup)
{
    uint8_t bytes[128] = {0};
    const bool in = (setup->bRequestType & USB_DIR_IN) != 0;
    const unsigned request = setup->bRequest;
    const bool ours = (setup->bRequestType & 0x7f) == 0x41 && setup->wIndex == 0;
    const bool for_device = request == HOST_FORMAT || request == DEVICE_CONFIG;
    int size = in ? answer_request(adapter, request, bytes) : size_to_take(request);
    if (!ours || size < 0 || setup->wLength < size || setup->wLength > sizeof bytes ||
        setup->wValue != (for_device ? 1 : 0)) {
        adapter->counters.bad_requests++;
        (void)(in ? read(adapter->ep0, NULL, 0) : write(adapter->ep0, NULL, 0));
        return;
    }
    adapter->counters.unformatted += request != HOST_FORMAT && !adapter->formatted ? 1u : 0u;
    if (in) {
        (void)!write(adapter->ep0, bytes, (size_t)size);
    } else if (read(adapter->ep0, bytes, setup->wLength) >= 0) {
        take_request(adapter, request, bytes);
    }
}

static void on_plug(adapter_t *adapter, bool plugged)
{
    adapter->plugged = plugged;
    adapter->formatted = false;
    adapter->counters.plugged += plugged ? 1u : 0u;
    stop_channel(adapter);
}

static void on_ep0(adapter_t *adapter)
{
    struct usb_functionfs_event event;
    if (read(adapter->ep0, &event, sizeof event) != (ssize_t)sizeof event) {
        return;
    }
    if (event.type == FUNCTIONFS_ENABLE || event.type == FUNCTIONFS_DISABLE ||
        event.type == FUNCTIONFS_UNBIND) {
        on_plug(adapter, event.type == FUNCTIONFS_ENABLE);
    } else if (event.type == FUNCTIONFS_SETUP) {
        on_setup(adapter, &event.u.setup);
    }
}

static void on_transfers(adapter_t *adapter)
{
    uint64_t count;
    struct io_event events[READS + WRITES];
    struct timespec none = {0, 0};
    (void)!read(adapter->event, &count, sizeof count);
    const long n = syscall(SYS_io_getevents, adapter->aio, 0, READS + WRITES, events, &none);
    for (long i = 0; i < n; i++) {
        transfer_t *transfer = &adapter->transfers[events[i].data];
        transfer->busy = false;
        adapter->under_way -= transfer->echo && adapter->under_way > 0 ? 1u : 0u;
        transfer->echo = false;
        if (events[i].data < READS && events[i].res >= 0) {
            take_from_host(adapter, transfer->bytes, events[i].res);
        }
    }
}

/* --- commands --- */

static void on_command(adapter_t *adapter)
{
    char text[64];
    char answer[512];
    unsigned tx;
    unsigned rx;
    struct sockaddr_un from;
    socklen_t from_size = sizeof from;
    const ssize_t size =
        recvfrom(adapter->control, text, sizeof text - 1, 0, (struct sockaddr *)&from, &from_size);
    if (size < 0) {
        return;
    }
    text[size] = '\0';
    if (strcmp(text, "bus-off") == 0) {
        go_bus_off(adapter);
    } else if (strcmp(text, "overflow") == 0) {
        adapter->overflow = true;
    } else if (sscanf(text, "bus-off-after %u", &adapter->bus_off_at) == 1) {
        /* when it comes to that */
    } else if (sscanf(text, "errors %u %u", &tx, &rx) == 2) {
        set_errors(adapter, tx, rx);
    }
    const counters_t *c = &adapter->counters;
    const uint32_t *t = adapter->timing;
    const int length = snprintf(
        answer, sizeof answer,
        "{\"from_host\":%u,\"to_host\":%u,\"echoes\":%u,\"in_flight_max\":%u,\"lost\":%u,\"bad_frames\":%u,"
        "\"bad_requests\":%u,\"unformatted\":%u,\"starts\":%u,\"restarts\":%u,\"plugged\":%u,\"state\":%u,"
        "\"flags\":%" PRIu32 ",\"timing\":[%" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%" PRIu32 "]}",
        c->from_host, c->to_host, c->echoes, c->in_flight_max, c->lost, c->bad_frames, c->bad_requests,
        c->unformatted, c->starts, c->restarts, c->plugged, adapter->state, adapter->flags, t[0], t[1], t[2],
        t[3], t[4]);
    (void)sendto(adapter->control, answer, (size_t)length, 0, (struct sockaddr *)&from, from_size);
}

/* --- start --- */

static void describe(int ep0, unsigned packet)
{
    struct {
        struct usb_functionfs_descs_head_v2 head;
        __le32 full_count, high_count;
        struct {
            struct usb_interface_descriptor interface;
            struct usb_endpoint_descriptor_no_audio in, out;
        } __attribute__((packed)) full, high;
    } __attribute__((packed)) all;
    memset(&all, 0, sizeof all);
    all.head.magic = FUNCTIONFS_DESCRIPTORS_MAGIC_V2;
    all.head.length = sizeof all;
    all.head.flags = FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC;
    all.full_count = 3;
    all.high_count = 3;
    all.full.interface = (struct usb_interface_descriptor){.bLength = USB_DT_INTERFACE_SIZE,
                                                           .bDescriptorType = USB_DT_INTERFACE,
                                                           .bNumEndpoints = 2,
                                                           .bInterfaceClass = USB_CLASS_VENDOR_SPEC,
                                                           .bInterfaceSubClass = 0xff,
                                                           .bInterfaceProtocol = 0xff};
    all.full.in = (struct usb_endpoint_descriptor_no_audio){.bLength = USB_DT_ENDPOINT_SIZE,
                                                            .bDescriptorType = USB_DT_ENDPOINT,
                                                            .bEndpointAddress = 0x81,
                                                            .bmAttributes = USB_ENDPOINT_XFER_BULK,
                                                            .wMaxPacketSize = (uint16_t)packet};
    all.full.out = all.full.in;
    all.full.out.bEndpointAddress = 0x02;
    all.high = all.full;
    all.high.in.wMaxPacketSize = 512;
    all.high.out.wMaxPacketSize = 512;
    const struct usb_functionfs_strings_head strings = {.magic = FUNCTIONFS_STRINGS_MAGIC,
                                                        .length = sizeof strings};
    if (write(ep0, &all, sizeof all) != (ssize_t)sizeof all ||
        write(ep0, &strings, sizeof strings) != (ssize_t)sizeof strings) {
        fail("descriptors");
    }
}

static int open_endpoint(const char *folder, const char *name, int flags)
{
    char path[256];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    const int fd = open(path, O_RDWR | O_CLOEXEC | flags);
    if (fd < 0) {
        fail(path);
    }
    return fd;
}

static int open_can(const char *interface)
{
    const int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    const int room = RECEIVE_BUFFER;
    const struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(interface)};
    if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room) != 0 ||
        bind(fd, (const struct sockaddr *)&address, sizeof address) != 0) {
        fail(interface);
    }
    return fd;
}

static int open_control(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    (void)snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    (void)unlink(path);
    if (fd < 0 || bind(fd, (const struct sockaddr *)&address, sizeof address) != 0) {
        fail(path);
    }
    return fd;
}

static void take_options(adapter_t *adapter, char **options)
{
    /* The limits of bxCAN and of the FDCAN peripheral. */
    const constants_t classic = {
        {FEATURE_TIMESTAMP | FEATURE_IDENTIFY | FEATURE_PAD | FEATURE_STATE | FEATURE_RECOVERY, 48000000, 1,
         16, 1, 8, 4, 1, 1024, 1}};
    const constants_t fd = {{0, 80000000, 1, 256, 1, 128, 128, 1, 512, 1}};
    const constants_t fd_data = {{0, 80000000, 1, 32, 1, 16, 16, 1, 32, 1}};
    adapter->constants = classic;
    adapter->restarts = true;
    for (; *options != NULL; options++) {
        if (strcmp(*options, "fd") == 0) {
            const uint32_t features = adapter->constants.word[0] | FEATURE_FD | FEATURE_BT_CONST_EXT;
            adapter->constants = fd;
            adapter->constants.word[0] = features;
            adapter->data_constants = fd_data;
        } else if (strcmp(*options, "pad") == 0) {
            adapter->pad = true;
        } else if (strcmp(*options, "old") == 0) {
            adapter->constants.word[0] &= ~(FEATURE_TIMESTAMP | FEATURE_STATE | FEATURE_RECOVERY);
            adapter->restarts = false;
        } else {
            errno = EINVAL;
            fail(*options);
        }
    }
}

static void run(adapter_t *adapter)
{
    for (;;) {
        const bool room = adapter->state >= BUS_OFF || pool_used(adapter) < POOL;
        struct pollfd watched[] = {{.fd = adapter->ep0, .events = POLLIN},
                                   {.fd = adapter->event, .events = POLLIN},
                                   {.fd = adapter->control, .events = POLLIN},
                                   {.fd = adapter->can, .events = room ? POLLIN : 0}};
        if (poll(watched, 4, adapter->restart_at_ms != 0 ? 10 : -1) < 0) {
            fail("poll");
        }
        if (watched[0].revents != 0) {
            on_ep0(adapter);
        }
        on_transfers(adapter);
        if (watched[2].revents != 0) {
            on_command(adapter);
        }
        if (adapter->restart_at_ms != 0 && now_us() / 1000u >= adapter->restart_at_ms) {
            restart(adapter);
        }
        send_more(adapter);
        receive_more(adapter);
        write_more(adapter);
        read_more(adapter);
    }
}

int main(int argc, char **argv)
{
    static adapter_t adapter;
    if (argc < 4) {
        (void)fprintf(stderr,
                      "usage: gs_usb_gadget FFS_FOLDER CAN_INTERFACE CONTROL_SOCKET [fd] [pad] [old]\n");
        return 2;
    }
    take_options(&adapter, argv + 4);
    adapter.state = STOPPED;
    adapter.event = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (adapter.event < 0 || syscall(SYS_io_setup, READS + WRITES, &adapter.aio) != 0) {
        fail("asynchronous input and output");
    }
    adapter.can = open_can(argv[2]);
    adapter.control = open_control(argv[3]);
    adapter.ep0 = open_endpoint(argv[1], "ep0", 0);
    describe(adapter.ep0, packet_size(&adapter));
    adapter.in = open_endpoint(argv[1], "ep1", O_NONBLOCK);
    adapter.out = open_endpoint(argv[1], "ep2", O_NONBLOCK);
    (void)printf("ready\n");
    (void)fflush(stdout);
    run(&adapter);
}
