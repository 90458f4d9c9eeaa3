#include "gs_usb_requests.h"

#include <stdio.h>
#include <string.h>

#include "oneshot.h"

#define BITRATE_BPS 1000000u
#define TIMEOUT_MS 1000u
#define REQUEST_OUT                                                                                          \
    ((uint8_t)LIBUSB_ENDPOINT_OUT | (uint8_t)LIBUSB_REQUEST_TYPE_VENDOR | (uint8_t)LIBUSB_RECIPIENT_INTERFACE)
#define REQUEST_IN                                                                                           \
    ((uint8_t)LIBUSB_ENDPOINT_IN | (uint8_t)LIBUSB_REQUEST_TYPE_VENDOR | (uint8_t)LIBUSB_RECIPIENT_INTERFACE)

/* optional: some firmware refuses it, which does no harm. */
static const struct {
    uint8_t direction;
    uint8_t request;
    uint8_t size;
    bool for_device; /* wValue is 1 instead of the channel */
    bool optional;
} rows[] = {
    [GS_USB_REQUESTS_HOST_FORMAT] = {REQUEST_OUT, GS_USB_CODEC_HOST_FORMAT, GS_USB_CODEC_HOST_FORMAT_SIZE,
                                     true, true},
    [GS_USB_REQUESTS_DEVICE_CONFIG] = {REQUEST_IN, GS_USB_CODEC_DEVICE_CONFIG,
                                       GS_USB_CODEC_DEVICE_CONFIG_SIZE, true, false},
    [GS_USB_REQUESTS_BT_CONST] = {REQUEST_IN, GS_USB_CODEC_BT_CONST, GS_USB_CODEC_BT_CONST_SIZE, false,
                                  false},
    [GS_USB_REQUESTS_RESET] = {REQUEST_OUT, GS_USB_CODEC_MODE, GS_USB_CODEC_MODE_SIZE, false, true},
    [GS_USB_REQUESTS_BITTIMING] = {REQUEST_OUT, GS_USB_CODEC_BITTIMING, GS_USB_CODEC_BITTIMING_SIZE, false,
                                   false},
    [GS_USB_REQUESTS_START] = {REQUEST_OUT, GS_USB_CODEC_MODE, GS_USB_CODEC_MODE_SIZE, false, false},
    [GS_USB_REQUESTS_GET_STATE] = {REQUEST_IN, GS_USB_CODEC_GET_STATE, GS_USB_CODEC_GET_STATE_SIZE, false,
                                   true},
    [GS_USB_REQUESTS_DONE] = {0},
    [GS_USB_REQUESTS_RECOVER] = {REQUEST_OUT, GS_USB_CODEC_BUS_OFF_RECOVERY,
                                 GS_USB_CODEC_BUS_OFF_RECOVERY_SIZE, false, true},
};

/* --- asking --- */

static void on_answer(struct libusb_transfer *transfer);

static bool has_feature(const gs_usb_adapter_t *adapter, uint32_t feature)
{
    return (adapter->constants.features & feature) != 0;
}

static void encode(const gs_usb_adapter_t *adapter, gs_usb_requests_step_t step,
                   const gs_usb_codec_timing_t *timing, uint8_t *bytes)
{
    uint32_t wanted = adapter->constants.features & GS_USB_CODEC_FEATURE_BUS_OFF_RECOVERY;
    memset(bytes, 0, rows[step].size);
    if (step == GS_USB_REQUESTS_HOST_FORMAT) {
        gs_usb_codec_encode_host_format(bytes);
    } else if (step == GS_USB_REQUESTS_BITTIMING) {
        gs_usb_codec_encode_timing(timing, bytes);
    } else if (step == GS_USB_REQUESTS_RESET) {
        gs_usb_codec_encode_mode(false, 0, bytes);
    } else if (step == GS_USB_REQUESTS_START) {
        gs_usb_codec_encode_mode(true, wanted, bytes);
    }
}

/* False: the adapter has failed. */
static bool compute_timing(gs_usb_adapter_t *adapter, gs_usb_codec_timing_t *timing)
{
    char reason[80];
    if (gs_usb_codec_compute_timing(&adapter->constants, BITRATE_BPS, timing)) {
        return true;
    }
    snprintf(reason, sizeof reason, "the adapter's clock of %u Hz cannot make 1 Mbit/s",
             (unsigned)adapter->constants.clock_hz);
    gs_usb_adapter_fail(adapter, reason);
    return false;
}

/* Sends one request; its answer leads to the next. */
static void ask(gs_usb_requests_t *requests, gs_usb_requests_step_t step)
{
    gs_usb_adapter_t *adapter = requests->adapter;
    gs_usb_codec_timing_t timing = {0};
    if (step == GS_USB_REQUESTS_BITTIMING && !compute_timing(adapter, &timing)) {
        return;
    }
    if (step == GS_USB_REQUESTS_START) {
        gs_usb_frames_begin_receiving(requests->frames);
    }
    requests->step = step;
    libusb_fill_control_setup(requests->bytes, rows[step].direction, rows[step].request,
                              rows[step].for_device ? 1 : adapter->channel, GS_USB_DEVICE_INTERFACE,
                              rows[step].size);
    encode(adapter, step, &timing, requests->bytes + LIBUSB_CONTROL_SETUP_SIZE);
    libusb_fill_control_transfer(requests->transfer, adapter->device, requests->bytes, on_answer, requests,
                                 TIMEOUT_MS);
    int failure = libusb_submit_transfer(requests->transfer);
    requests->busy = failure == 0;
    if (failure != 0) {
        gs_usb_adapter_fail_usb(adapter, failure);
    } else if (!libusb_pollfds_handle_timeouts(adapter->usb)) {
        oneshot_arm_us(adapter->timer, (TIMEOUT_MS + 1u) * 1000u);
    }
}

/* --- answers --- */

static void finish_start(gs_usb_requests_t *requests)
{
    requests->step = GS_USB_REQUESTS_DONE;
    if (requests->adapter->base.health.state == HAL_CAN_DOWN) {
        gs_usb_adapter_fail(requests->adapter, "the adapter has not started its channel");
    }
    requests->adapter->news = true;
}

/* The channel runs: its state is not known better than this until the adapter tells it. */
static void begin_running(gs_usb_requests_t *requests)
{
    gs_usb_adapter_t *adapter = requests->adapter;
    adapter->running = true;
    adapter->base.health.tx_errors = 0;
    adapter->base.health.rx_errors = 0;
    adapter->base.health.state = HAL_CAN_ACTIVE;
    adapter->news = true;
    if (has_feature(adapter, GS_USB_CODEC_FEATURE_STATE)) {
        ask(requests, GS_USB_REQUESTS_GET_STATE);
    } else {
        finish_start(requests);
    }
}

static void take_device_config(gs_usb_requests_t *requests, const uint8_t *bytes, size_t size)
{
    gs_usb_adapter_t *adapter = requests->adapter;
    unsigned channels = gs_usb_codec_decode_channels(bytes, size);
    char reason[80];
    if (adapter->channel < channels) {
        ask(requests, GS_USB_REQUESTS_BT_CONST);
        return;
    }
    snprintf(reason, sizeof reason, "the adapter has no channel %u: it has %u, counted from 0",
             adapter->channel, channels);
    gs_usb_adapter_fail(adapter, reason);
}

/* Does what the answer to the request under way leads to. size: of what came, for requests that ask. */
static void advance(gs_usb_requests_t *requests, const uint8_t *bytes, size_t size)
{
    gs_usb_adapter_t *adapter = requests->adapter;
    switch (requests->step) {
    case GS_USB_REQUESTS_HOST_FORMAT:
        ask(requests, GS_USB_REQUESTS_DEVICE_CONFIG);
        break;
    case GS_USB_REQUESTS_DEVICE_CONFIG:
        take_device_config(requests, bytes, size);
        break;
    case GS_USB_REQUESTS_BT_CONST:
        if (gs_usb_codec_decode_constants(bytes, size, &adapter->constants)) {
            ask(requests, GS_USB_REQUESTS_RESET);
        } else {
            gs_usb_adapter_fail(adapter, "the adapter does not tell its bit timing");
        }
        break;
    case GS_USB_REQUESTS_RESET:
        gs_usb_frames_forget_sends(requests->frames, false);
        ask(requests, GS_USB_REQUESTS_BITTIMING);
        break;
    case GS_USB_REQUESTS_BITTIMING:
        ask(requests, GS_USB_REQUESTS_START);
        break;
    case GS_USB_REQUESTS_START:
        begin_running(requests);
        break;
    case GS_USB_REQUESTS_GET_STATE:
        (void)gs_usb_codec_decode_state(bytes, size, &adapter->base.health);
        finish_start(requests);
        break;
    case GS_USB_REQUESTS_RECOVER:
    case GS_USB_REQUESTS_DONE:
        requests->step = GS_USB_REQUESTS_DONE;
        break;
    }
}

static void on_answer(struct libusb_transfer *transfer)
{
    gs_usb_requests_t *requests = transfer->user_data;
    gs_usb_adapter_t *adapter = requests->adapter;
    char reason[80];
    requests->busy = false;
    if (adapter->failure != NULL) {
        return;
    }
    bool stalled = transfer->status == LIBUSB_TRANSFER_STALL;
    if (transfer->status == LIBUSB_TRANSFER_COMPLETED || (stalled && rows[requests->step].optional)) {
        size_t size = stalled ? 0 : (size_t)transfer->actual_length;
        advance(requests, requests->bytes + LIBUSB_CONTROL_SETUP_SIZE, size);
    } else if (transfer->status == LIBUSB_TRANSFER_NO_DEVICE) {
        gs_usb_adapter_fail_unplugged(adapter);
    } else {
        snprintf(reason, sizeof reason, "the adapter %s request %u of gs_usb",
                 stalled ? "refuses" : "does not answer", rows[requests->step].request);
        gs_usb_adapter_fail(adapter, reason);
    }
}

/* --- for the owner --- */

bool gs_usb_requests_allocate(gs_usb_requests_t *requests)
{
    requests->transfer = libusb_alloc_transfer(0);
    return requests->transfer != NULL;
}

void gs_usb_requests_free(gs_usb_requests_t *requests)
{
    libusb_free_transfer(requests->transfer);
    requests->transfer = NULL;
}

void gs_usb_requests_cancel(gs_usb_requests_t *requests)
{
    if (requests->busy) {
        libusb_cancel_transfer(requests->transfer);
    }
}

void gs_usb_requests_start(gs_usb_requests_t *requests)
{
    ask(requests, GS_USB_REQUESTS_HOST_FORMAT);
}

/* After bus-off the adapter goes on if it can, and is reset otherwise (D-LIN-3). */
void gs_usb_requests_restart(gs_usb_requests_t *requests)
{
    const gs_usb_adapter_t *adapter = requests->adapter;
    if (!adapter->running || adapter->failure != NULL || requests->step != GS_USB_REQUESTS_DONE ||
        adapter->base.health.state != HAL_CAN_BUS_OFF) {
        return;
    }
    bool recovers = has_feature(adapter, GS_USB_CODEC_FEATURE_BUS_OFF_RECOVERY);
    ask(requests, recovers ? GS_USB_REQUESTS_RECOVER : GS_USB_REQUESTS_RESET);
}
