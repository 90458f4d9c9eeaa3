/* What goes over the wire to a USB CAN adapter that speaks gs_usb (candleLight, CANnectivity and others), and
 * the bit timing for it. Pure: no I/O, no state. Private to hal/linux.
 *
 * All numbers are little-endian words of 32 bits where nothing else is said.
 *
 *   BT_CONST        features, clock in Hz, tseg1 min, tseg1 max, tseg2 min, tseg2 max, sjw max, brp min,
 *                   brp max, brp step
 *   BITTIMING       prop, phase1, phase2, sjw, brp
 *   MODE            0 reset, 1 start; flags, which are features to be used
 *   DEVICE_CONFIG   three bytes, channels - 1 (one byte), software version, hardware version
 *   GET_STATE       state, receive errors, transmit errors
 *
 *   host frame, by offset in bytes:
 *    0   echo tag, FFFFFFFFh for a received frame
 *    4   identifier, bit 31 extended, 30 remote, 29 error
 *    8   DLC
 *    9   channel
 *   10   flags
 *   11   reserved
 *   12   eight data bytes; then perhaps a time stamp and padding */
#ifndef GS_USB_CODEC_H
#define GS_USB_CODEC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal_can.h"

enum {
    GS_USB_CODEC_HOST_FORMAT = 0,
    GS_USB_CODEC_BITTIMING = 1,
    GS_USB_CODEC_MODE = 2,
    GS_USB_CODEC_BT_CONST = 4,
    GS_USB_CODEC_DEVICE_CONFIG = 5,
    GS_USB_CODEC_GET_STATE = 14,
    GS_USB_CODEC_BUS_OFF_RECOVERY = 32
};

enum {
    GS_USB_CODEC_HOST_FORMAT_SIZE = 4,
    GS_USB_CODEC_BITTIMING_SIZE = 20,
    GS_USB_CODEC_MODE_SIZE = 8,
    GS_USB_CODEC_BT_CONST_SIZE = 40,
    GS_USB_CODEC_DEVICE_CONFIG_SIZE = 12,
    GS_USB_CODEC_GET_STATE_SIZE = 12,
    GS_USB_CODEC_BUS_OFF_RECOVERY_SIZE = 4,
    GS_USB_CODEC_FRAME_SIZE = 20
};

#define GS_USB_CODEC_FEATURE_STATE (1u << 13)
#define GS_USB_CODEC_FEATURE_BUS_OFF_RECOVERY (1u << 18)
#define GS_USB_CODEC_NO_ECHO UINT32_MAX

typedef struct {
    uint32_t features;
    uint32_t clock_hz;
    uint32_t tseg1_min;
    uint32_t tseg1_max;
    uint32_t tseg2_min;
    uint32_t tseg2_max;
    uint32_t sjw_max;
    uint32_t brp_min;
    uint32_t brp_max;
    uint32_t brp_step;
} gs_usb_codec_constants_t;

/* Time quanta of a bit: 1 + prop + phase1 before the sample point, phase2 behind it; a quantum is brp
 * clocks. */
typedef struct {
    uint32_t prop;
    uint32_t phase1;
    uint32_t phase2;
    uint32_t sjw;
    uint32_t brp;
} gs_usb_codec_timing_t;

/* What comes from an adapter: a received frame, the echo of one that was sent, or an error frame. */
typedef struct {
    uint32_t echo_tag; /* GS_USB_CODEC_NO_ECHO: no echo */
    uint32_t can_id;   /* as struct can_frame has it, flags included */
    uint8_t dlc;
    uint8_t channel;
    uint8_t data[8];
    bool overflow; /* the adapter lost frames before this one */
    bool fd;
} gs_usb_codec_frame_t;

/* Bytes of requests to the adapter. Integers of the adapter are little-endian when it was told so first. */
void gs_usb_codec_encode_host_format(uint8_t bytes[GS_USB_CODEC_HOST_FORMAT_SIZE]);
void gs_usb_codec_encode_timing(const gs_usb_codec_timing_t *timing,
                                uint8_t bytes[GS_USB_CODEC_BITTIMING_SIZE]);
void gs_usb_codec_encode_mode(bool start, uint32_t flags, uint8_t bytes[GS_USB_CODEC_MODE_SIZE]);

/* Answers of the adapter. False, or 0: too short. */
bool gs_usb_codec_decode_constants(const uint8_t *bytes, size_t size, gs_usb_codec_constants_t *constants);
unsigned gs_usb_codec_decode_channels(const uint8_t *bytes, size_t size);

/* Sets state and error counters of *health; an adapter that is stopped or asleep is HAL_CAN_DOWN. */
bool gs_usb_codec_decode_state(const uint8_t *bytes, size_t size, hal_can_health_t *health);

/* A base data frame to be sent. */
void gs_usb_codec_encode_frame(const can_frame_t *frame, uint32_t echo_tag, uint8_t channel,
                               uint8_t bytes[GS_USB_CODEC_FRAME_SIZE]);

/* One transfer from the adapter: what follows the eight data bytes (time stamp, padding) is not looked at.
 * False: too short. */
bool gs_usb_codec_decode_frame(const uint8_t *bytes, size_t size, gs_usb_codec_frame_t *frame);

/* As the protocol core takes it. */
void gs_usb_codec_to_can_frame(const gs_usb_codec_frame_t *in, can_frame_t *out);

/* Brings *health up to date after any frame that is no echo. */
void gs_usb_codec_note(const gs_usb_codec_frame_t *frame, hal_can_health_t *health);

/* The timing for a bit rate: the sample point lies between 75 and 87.5 % of the bit, as late as the limits
 * permit; among equals the shortest quantum wins. The bit rate may be off by 0.2 %, as a clock that is not
 * told exactly makes it; an exact one is preferred. False: none of the limits' settings gives that. */
bool gs_usb_codec_compute_timing(const gs_usb_codec_constants_t *limits, uint32_t bitrate_bps,
                                 gs_usb_codec_timing_t *timing);

#endif
