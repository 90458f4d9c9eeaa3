/* A device of a bench on a dsPIC33: NODE_ROLE says which. With an arbitrator on a fourth board the three are
 * a limb, the second test system of [PROFILE 6.2.2]; the joystick has two outputs more than there.
 *
 *   1  joystick    out 1  the stick's X axis, 2120h
 *                  out 2  its Y axis, 2A64h
 *                  out 3  its button, 2A20h
 *   2  controller  in 1   2200h
 *                  in 2   2110h
 *                  out 3  1100h, a copy of in 2, which it requires
 *                  out 4  1210h, of in 1
 *                  out 5  1220h, of in 2
 *   3  LED bar     in 1   terminal, 1110h: the bar of ten LEDs
 *                  in 2   terminal, 1220h: the board's LED */
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "adc1.h"
#include "arb_crc.h"
#include "board.h"
#include "clock.h"
#include "ecan1.h"
#include "i2c1.h"
#include "ledbar.h"
#include "nvm.h"
#include "pdcp_device.h"
#include "pdcp_time.h"
#include "profile_tree.h"
#include "profile_type.h"
#include "sys.h"

#ifndef NODE_ROLE
#error "NODE_ROLE: 1 joystick, 2 controller, 3 LED bar"
#endif

enum {
    JOYSTICK = 1,
    CONTROLLER = 2,
    LED_BAR = 3,
    FRAMES = 8,
    SEND_MS = 20,
    /* Channel types (profile-layer.md 2): 8 bits, unsigned or boolean, position. */
    OUT_8 = 0x5000,
    OUT_BOOLEAN = 0x7000,
    IN_8 = 0x5200,
    IN_BOOLEAN = 0x7200,
    TERMINAL_8 = 0x5300,
    TERMINAL_BOOLEAN = 0x7300,
    /* Profiles of the test system that are not in the reference tree: odd components are a vendor's own. */
    TEST_STICK_X = 0x2120,
    TEST_MUSCLE = 0x2110,
    TEST_WRIST = 0x1100,
    TEST_FINGER = 0x1210,
    TEST_BAR = 0x1110
};

#define TEXT(text)                                                                                           \
    {                                                                                                        \
        (text), sizeof(text) - 1                                                                             \
    }

#if NODE_ROLE == 1
#define NODE_TEXT "joystick"
static const pdcp_device_channel_desc_t node_channels[] = {
    {.direction = PDCP_OUTPUT, .type = OUT_8, .profile = TEST_STICK_X, .descriptor = TEXT("stick X")},
    {.direction = PDCP_OUTPUT,
     .type = OUT_8,
     .profile = PROFILE_CONTROL_JOYSTICK_Y,
     .descriptor = TEXT("stick Y")},
    {.direction = PDCP_OUTPUT,
     .type = OUT_BOOLEAN,
     .profile = PROFILE_CONTROL_BUTTON,
     .descriptor = TEXT("button")}};
#elif NODE_ROLE == 2
#define NODE_TEXT "controller"
static const uint8_t node_requires_1 = 0x40; /* bit strings, first bit = channel 0 (D-BUS-8) */
static const uint8_t node_requires_2 = 0x20;
static const pdcp_device_channel_desc_t node_channels[] = {
    {.direction = PDCP_INPUT, .type = IN_BOOLEAN, .profile = PROFILE_EMG, .descriptor = TEXT("switch")},
    {.direction = PDCP_INPUT, .type = IN_8, .profile = TEST_MUSCLE, .descriptor = TEXT("muscle")},
    {.direction = PDCP_OUTPUT,
     .type = OUT_8,
     .profile = TEST_WRIST,
     .descriptor = TEXT("wrist"),
     .required = {&node_requires_2, 1}},
    {.direction = PDCP_OUTPUT,
     .type = OUT_8,
     .profile = TEST_FINGER,
     .descriptor = TEXT("finger"),
     .required = {&node_requires_1, 1}},
    {.direction = PDCP_OUTPUT,
     .type = OUT_BOOLEAN,
     .profile = PROFILE_GRIP_POWER,
     .descriptor = TEXT("grip"),
     .required = {&node_requires_2, 1}}};
#else
#define NODE_TEXT "LED bar"
static const pdcp_device_channel_desc_t node_channels[] = {{.direction = PDCP_INPUT,
                                                            .terminal = true,
                                                            .type = TERMINAL_8,
                                                            .profile = TEST_BAR,
                                                            .terminal_profile = TEST_BAR,
                                                            .descriptor = TEXT("bar")},
                                                           {.direction = PDCP_INPUT,
                                                            .terminal = true,
                                                            .type = TERMINAL_BOOLEAN,
                                                            .profile = PROFILE_GRIP_POWER,
                                                            .terminal_profile = PROFILE_GRIP_POWER,
                                                            .descriptor = TEXT("LED")}};
#endif

enum { CHANNELS = sizeof node_channels / sizeof node_channels[0] };

/* Serial numbers 4 to 6, as in the test systems. */
static const pdcp_device_desc_t node_desc = {.identity = {.vid = 2, .pid = 2, .sn = 3 + NODE_ROLE},
                                             .firmware = 0x0001,
                                             .hardware = 0x0001,
                                             .descriptor = TEXT(NODE_TEXT),
                                             .channels = node_channels,
                                             .channel_count = CHANNELS};

/* The device's record as it is stored: in two places in turn, 256 bytes apart, so that power may fail at any
 * time. */
typedef struct {
    uint16_t magic;
    uint16_t sequence;
    pdcp_device_record_t record;
    uint32_t crc; /* over all before */
} node_image_t;

enum { IMAGE_MAGIC = 0x4E50, IMAGE_PLACE = 256, IMAGE_DELAY_MS = 500 };

PART_ASSERT(node_image_fits, sizeof(node_image_t) <= IMAGE_PLACE);

typedef struct {
    pdcp_device_t device;
    pdcp_device_port_t port;
    hal_can_t *can;
    hal_nvm_t *nvm;
    uint32_t next_ms;
    uint32_t sent_ms;
    int32_t values[CHANNELS]; /* what inputs received, the newest */
    node_image_t image;
    uint8_t image_place;
    uint16_t image_at; /* how much of it is written; sizeof image: all */
    bool image_due;
    uint32_t image_due_ms;
} node_t;

static node_t node;

/* --- memory --- */

static uint32_t image_crc(const node_image_t *image)
{
    return ~arb_crc32(ARB_CRC32_INIT, (const uint8_t *)image, offsetof(node_image_t, crc));
}

static bool load_image(node_t *self, uint8_t place, node_image_t *image)
{
    return hal_nvm_read(self->nvm, (uint16_t)(place * IMAGE_PLACE), (uint8_t *)image, sizeof *image) &&
           image->magic == IMAGE_MAGIC && image->crc == image_crc(image);
}

/* True: image holds the newest good record. */
static bool load_record(node_t *self)
{
    node_image_t other;
    const bool first = load_image(self, 0, &self->image);
    const bool second = load_image(self, 1, &other);
    self->image_at = sizeof self->image;
    if (second && (!first || (int16_t)(other.sequence - self->image.sequence) > 0)) {
        self->image = other;
        self->image_place = 1;
    }
    if (!first && !second) {
        memset(&self->image, 0, sizeof self->image);
    }
    return first || second;
}

static void on_store(void *ctx, const pdcp_device_record_t *record)
{
    node_t *self = ctx;
    self->image.record = *record;
    self->image_due = true;
    self->image_due_ms = hal_clock_ms() + IMAGE_DELAY_MS;
}

/* Begins anew when the record changes while it is written: then the place that is written is not good yet. */
static void save_record(node_t *self, uint32_t now_ms)
{
    if (hal_nvm_status(self->nvm) == HAL_NVM_BUSY) {
        return;
    }
    if (self->image_due && !pdcp_time_before(now_ms, self->image_due_ms)) {
        self->image_due = false;
        if (self->image_at == sizeof self->image) {
            self->image_place ^= 1u;
            self->image.sequence++;
        }
        self->image.magic = IMAGE_MAGIC;
        self->image.crc = image_crc(&self->image);
        self->image_at = 0;
    }
    const uint16_t left = (uint16_t)(sizeof self->image - self->image_at);
    const uint16_t part = left < HAL_NVM_PAGE ? left : HAL_NVM_PAGE;
    if (part != 0 && !self->image_due &&
        hal_nvm_write(self->nvm, (uint16_t)(self->image_place * IMAGE_PLACE + self->image_at),
                      (const uint8_t *)&self->image + self->image_at, part)) {
        self->image_at = (uint16_t)(self->image_at + part);
    }
}

/* --- channels --- */

static void show(const node_t *self)
{
    if (NODE_ROLE == LED_BAR) {
        ledbar_set((uint8_t)((self->values[0] * LEDBAR_LEDS + 127) / 255));
        board_led(self->values[1] != 0);
    }
}

static void on_input(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len)
{
    node_t *self = ctx;
    profile_type_t type;
    (void)profile_type_decode(node_channels[channel - 1].type, &type);
    (void)profile_type_get(&type, data, len, &self->values[channel - 1]);
    show(self);
}

static void on_safe(void *ctx, uint8_t channel)
{
    node_t *self = ctx;
    self->values[channel - 1] = node_channels[channel - 1].safe;
    show(self);
}

static int32_t joystick_value(uint8_t channel)
{
    switch (channel) {
    case 1:
        return adc1_read(BOARD_JOYSTICK_X) >> 2;
    case 2:
        return adc1_read(BOARD_JOYSTICK_Y) >> 2;
    default:
        return board_button();
    }
}

/* The input that an output copies, scaled to its type. */
static int32_t controller_value(const node_t *self, uint8_t channel)
{
    switch (channel) {
    case 3:
        return self->values[1];
    case 4:
        return self->values[0] != 0 ? 255 : 0;
    default:
        return self->values[1] > 127;
    }
}

static int32_t output_value(const node_t *self, uint8_t channel)
{
    return NODE_ROLE == JOYSTICK ? joystick_value(channel) : controller_value(self, channel);
}

static void send_outputs(node_t *self, uint32_t now_ms)
{
    if (now_ms - self->sent_ms < SEND_MS) {
        return;
    }
    self->sent_ms = now_ms;
    for (uint8_t channel = 1; channel <= (uint8_t)CHANNELS; channel++) {
        profile_type_t type;
        uint8_t bytes[2];
        if (node_channels[channel - 1].direction == PDCP_OUTPUT) {
            (void)profile_type_decode(node_channels[channel - 1].type, &type);
            const uint8_t len = profile_type_put(&type, output_value(self, channel), bytes);
            (void)pdcp_device_send(&self->device, now_ms, channel, bytes, len);
        }
    }
}

/* --- main loop --- */

static bool has_work(void *ctx)
{
    const node_t *self = ctx;
    return ecan1_has_work(self->can) || !pdcp_time_before(hal_clock_ms(), self->next_ms);
}

static void turn(node_t *self, uint32_t now_ms)
{
    can_frame_t frames[FRAMES];
    const size_t count = hal_can_receive(self->can, frames, FRAMES);
    for (size_t i = 0; i < count; i++) {
        pdcp_device_on_frame(&self->device, now_ms, &frames[i]);
    }
    /* A device has no back-off of its own to keep: the controller waits for a quiet bus by itself. */
    hal_can_restart(self->can);
    send_outputs(self, now_ms);
    self->next_ms = pdcp_device_step(&self->device, now_ms);
    can_frame_t frame;
    while (pdcp_device_tx_peek(&self->device, &frame) && hal_can_send(self->can, &frame)) {
        pdcp_device_tx_pop(&self->device);
    }
    save_record(self, now_ms);
    /* Memory and bar share a bus: one at a time. */
    if (NODE_ROLE == LED_BAR && hal_nvm_status(self->nvm) != HAL_NVM_BUSY) {
        ledbar_step(now_ms);
    }
}

static void start(node_t *self)
{
    sys_start();
    board_start();
    if (!clock_start()) {
        sys_fail(SYS_FAULT_CRYSTAL);
    }
    i2c1_open();
    self->nvm = nvm_open();
    adc1_open();
    self->port = (pdcp_device_port_t){.ctx = self, .input = on_input, .safe = on_safe, .store = on_store};
    const bool stored = load_record(self);
    if (!pdcp_device_init(&self->device, &node_desc, &self->port, stored ? &self->image.record : NULL,
                          hal_sys_serial(), hal_clock_ms())) {
        sys_fail(SYS_FAULT_HANDLER); /* the tables above are wrong: cannot be */
    }
    show(self);
    self->can = ecan1_open(); /* last: frames that came while the EEPROM was read would be old */
}

int main(void)
{
    node_t *self = &node;
    start(self);
    for (;;) {
        const uint32_t now_ms = hal_clock_ms();
        sys_kick(now_ms);
        turn(self, now_ms);
        sys_idle(has_work, self);
    }
}
