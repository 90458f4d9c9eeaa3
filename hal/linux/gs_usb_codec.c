#include "gs_usb_codec.h"

#include <linux/can.h>
#include <string.h>

#include "linux_can_frame.h"

#define FORMAT_LITTLE_ENDIAN 0x0000beefu
#define FLAG_OVERFLOW 0x01u
#define FLAG_FD 0x02u

enum { STATE_ACTIVE, STATE_WARNING, STATE_PASSIVE, STATE_BUS_OFF };

#define WORD 4u
#define QUANTA_MIN 4u
#define DEVIATION_MAX_PPM 2000u

static uint32_t get_word(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static void put_word(uint8_t *bytes, uint32_t value)
{
    for (unsigned i = 0; i < WORD; i++) {
        bytes[i] = (uint8_t)(value >> 8 * i);
    }
}

/* --- requests --- */

void gs_usb_codec_encode_host_format(uint8_t bytes[GS_USB_CODEC_HOST_FORMAT_SIZE])
{
    put_word(bytes, FORMAT_LITTLE_ENDIAN);
}

void gs_usb_codec_encode_timing(const gs_usb_codec_timing_t *timing,
                                uint8_t bytes[GS_USB_CODEC_BITTIMING_SIZE])
{
    put_word(bytes, timing->prop);
    put_word(bytes + WORD, timing->phase1);
    put_word(bytes + 2 * WORD, timing->phase2);
    put_word(bytes + 3 * WORD, timing->sjw);
    put_word(bytes + 4 * WORD, timing->brp);
}

void gs_usb_codec_encode_mode(bool start, uint32_t flags, uint8_t bytes[GS_USB_CODEC_MODE_SIZE])
{
    put_word(bytes, start ? 1u : 0u);
    put_word(bytes + WORD, flags);
}

bool gs_usb_codec_decode_constants(const uint8_t *bytes, size_t size, gs_usb_codec_constants_t *constants)
{
    if (size < GS_USB_CODEC_BT_CONST_SIZE) {
        return false;
    }
    *constants = (gs_usb_codec_constants_t){.features = get_word(bytes),
                                            .clock_hz = get_word(bytes + WORD),
                                            .tseg1_min = get_word(bytes + 2 * WORD),
                                            .tseg1_max = get_word(bytes + 3 * WORD),
                                            .tseg2_min = get_word(bytes + 4 * WORD),
                                            .tseg2_max = get_word(bytes + 5 * WORD),
                                            .sjw_max = get_word(bytes + 6 * WORD),
                                            .brp_min = get_word(bytes + 7 * WORD),
                                            .brp_max = get_word(bytes + 8 * WORD),
                                            .brp_step = get_word(bytes + 9 * WORD)};
    return true;
}

unsigned gs_usb_codec_decode_channels(const uint8_t *bytes, size_t size)
{
    return size < GS_USB_CODEC_DEVICE_CONFIG_SIZE ? 0u : bytes[3] + 1u;
}

static uint8_t counter(uint32_t errors)
{
    return (uint8_t)(errors > UINT8_MAX ? UINT8_MAX : errors);
}

bool gs_usb_codec_decode_state(const uint8_t *bytes, size_t size, hal_can_health_t *health)
{
    if (size < GS_USB_CODEC_GET_STATE_SIZE) {
        return false;
    }
    switch (get_word(bytes)) {
    case STATE_ACTIVE:
    case STATE_WARNING:
        health->state = HAL_CAN_ACTIVE;
        break;
    case STATE_PASSIVE:
        health->state = HAL_CAN_PASSIVE;
        break;
    case STATE_BUS_OFF:
        health->state = HAL_CAN_BUS_OFF;
        break;
    default:
        health->state = HAL_CAN_DOWN;
        break;
    }
    health->rx_errors = counter(get_word(bytes + WORD));
    health->tx_errors = counter(get_word(bytes + 2 * WORD));
    return true;
}

/* --- frames --- */

void gs_usb_codec_encode_frame(const can_frame_t *frame, uint32_t echo_tag, uint8_t channel,
                               uint8_t bytes[GS_USB_CODEC_FRAME_SIZE])
{
    uint8_t dlc = frame->dlc > CAN_FRAME_DATA_MAX ? (uint8_t)CAN_FRAME_DATA_MAX : frame->dlc;
    memset(bytes, 0, GS_USB_CODEC_FRAME_SIZE);
    put_word(bytes, echo_tag);
    put_word(bytes + 4, frame->id & CAN_SFF_MASK);
    bytes[8] = dlc;
    bytes[9] = channel;
    memcpy(bytes + 12, frame->data, dlc);
}

bool gs_usb_codec_decode_frame(const uint8_t *bytes, size_t size, gs_usb_codec_frame_t *frame)
{
    if (size < GS_USB_CODEC_FRAME_SIZE) {
        return false;
    }
    *frame = (gs_usb_codec_frame_t){.echo_tag = get_word(bytes),
                                    .can_id = get_word(bytes + 4),
                                    .dlc = bytes[8],
                                    .channel = bytes[9],
                                    .overflow = (bytes[10] & FLAG_OVERFLOW) != 0,
                                    .fd = (bytes[10] & FLAG_FD) != 0};
    memcpy(frame->data, bytes + 12, sizeof frame->data);
    return true;
}

void gs_usb_codec_to_can_frame(const gs_usb_codec_frame_t *in, can_frame_t *out)
{
    linux_can_frame_decode(in->can_id, in->fd, in->dlc, in->data, out);
}

void gs_usb_codec_note(const gs_usb_codec_frame_t *frame, hal_can_health_t *health)
{
    health->rx_overruns += frame->overflow ? 1u : 0u;
    if ((frame->can_id & CAN_ERR_FLAG) != 0) {
        linux_can_frame_note_error(frame->can_id, frame->data, health);
    } else if (health->state == HAL_CAN_BUS_OFF) {
        health->state = HAL_CAN_ACTIVE; /* who receives has recovered, also where no error frame says so */
        health->tx_errors = 0;
        health->rx_errors = 0;
    }
}

/* --- bit timing (D-LIN-2) --- */

/* One setting, and how good it is: smaller is better, the bit rate first. */
typedef struct {
    gs_usb_codec_timing_t timing;
    uint32_t deviation_ppm;
    uint32_t early; /* eighths of a quantum that the sample point lies before 87.5 % */
    uint32_t quanta;
} candidate_t;

static uint32_t at_least(uint32_t value, uint32_t limit)
{
    return value > limit ? value : limit;
}

/* Segments for a bit of so many quanta. False: the limits have none with a good sample point. */
static bool split_bit(const gs_usb_codec_constants_t *limits, uint32_t quanta, candidate_t *candidate)
{
    uint32_t tseg2 = at_least((quanta + 7) / 8, limits->tseg2_min);
    if (quanta - 1 > limits->tseg1_max) {
        tseg2 = at_least(tseg2, quanta - 1 - limits->tseg1_max);
    }
    if (tseg2 > limits->tseg2_max || tseg2 > quanta / 4 || quanta - 1 - tseg2 < limits->tseg1_min) {
        return false;
    }
    uint32_t sjw = tseg2 / 2 < limits->sjw_max ? tseg2 / 2 : limits->sjw_max;
    candidate->timing.prop = 1;
    candidate->timing.phase1 = quanta - 2 - tseg2;
    candidate->timing.phase2 = tseg2;
    candidate->timing.sjw = at_least(sjw, 1);
    candidate->early = 8 * tseg2 - quanta;
    candidate->quanta = quanta;
    return true;
}

static bool try_prescaler(const gs_usb_codec_constants_t *limits, uint32_t bitrate_bps, uint32_t brp,
                          candidate_t *candidate)
{
    uint64_t step_hz = (uint64_t)brp * bitrate_bps;
    uint64_t quanta = (limits->clock_hz + step_hz / 2) / step_hz;
    if (quanta < QUANTA_MIN) {
        return false;
    }
    uint64_t wanted_hz = quanta * step_hz;
    uint64_t off_hz =
        wanted_hz > limits->clock_hz ? wanted_hz - limits->clock_hz : limits->clock_hz - wanted_hz;
    candidate->timing.brp = brp;
    candidate->deviation_ppm = (uint32_t)(off_hz * 1000000u / wanted_hz);
    return candidate->deviation_ppm <= DEVIATION_MAX_PPM && split_bit(limits, (uint32_t)quanta, candidate);
}

static bool is_better(const candidate_t *candidate, const candidate_t *best)
{
    if (candidate->deviation_ppm != best->deviation_ppm) {
        return candidate->deviation_ppm < best->deviation_ppm;
    }
    return (uint64_t)candidate->early * best->quanta < (uint64_t)best->early * candidate->quanta;
}

bool gs_usb_codec_compute_timing(const gs_usb_codec_constants_t *limits, uint32_t bitrate_bps,
                                 gs_usb_codec_timing_t *timing)
{
    bool found = false;
    candidate_t best = {.deviation_ppm = UINT32_MAX};
    uint32_t step = at_least(limits->brp_step, 1);
    uint64_t highest = (uint64_t)limits->clock_hz * 2 / bitrate_bps / QUANTA_MIN + 1;
    for (uint64_t brp = at_least(limits->brp_min, 1); brp <= limits->brp_max && brp <= highest; brp += step) {
        candidate_t candidate = {0};
        if (try_prescaler(limits, bitrate_bps, (uint32_t)brp, &candidate) &&
            (!found || is_better(&candidate, &best))) {
            best = candidate;
            found = true;
        }
    }
    *timing = best.timing;
    return found;
}
