/* The devices of a limb, for tests of whole images. */
#ifndef LIMB_H
#define LIMB_H

#include "pdcp_device.h"

enum { LIMB_JOYSTICK, LIMB_CONTROLLER, LIMB_HAND, LIMB_DEVICES };

/* Test system 2 of [PROFILE 6.2.2]: 1.1 -> 2.2, 2.3 -> 3.1, 2.5 -> 3.2. */
static const uint8_t limb_requires_1 = 0x40;
static const uint8_t limb_requires_2 = 0x20;
static const pdcp_device_channel_desc_t limb_joystick[] = {
    {.direction = PDCP_OUTPUT, .type = 0x5000, .profile = 0x2120}};
static const pdcp_device_channel_desc_t limb_controller[] = {
    {.direction = PDCP_INPUT, .type = 0x7200, .profile = 0x2200},
    {.direction = PDCP_INPUT, .type = 0x5200, .profile = 0x2110},
    {.direction = PDCP_OUTPUT, .type = 0x5000, .profile = 0x1100, .required = {&limb_requires_2, 1}},
    {.direction = PDCP_OUTPUT, .type = 0x5000, .profile = 0x1210, .required = {&limb_requires_1, 1}},
    {.direction = PDCP_OUTPUT, .type = 0x7000, .profile = 0x1220, .required = {&limb_requires_2, 1}}};
static const pdcp_device_channel_desc_t limb_hand[] = {{.direction = PDCP_INPUT,
                                                        .terminal = true,
                                                        .type = 0x5300,
                                                        .profile = 0x1110,
                                                        .terminal_profile = 0x1110},
                                                       {.direction = PDCP_INPUT,
                                                        .terminal = true,
                                                        .type = 0x7300,
                                                        .profile = 0x1220,
                                                        .terminal_profile = 0x1220}};
static const pdcp_device_desc_t limb_device_1 = {
    .identity = {2, 2, 4}, .channels = limb_joystick, .channel_count = 1};
static const pdcp_device_desc_t limb_device_2 = {
    .identity = {2, 2, 5}, .channels = limb_controller, .channel_count = 5};
static const pdcp_device_desc_t limb_device_3 = {
    .identity = {2, 2, 6}, .channels = limb_hand, .channel_count = 2};
static const pdcp_device_desc_t *const limb_devices[LIMB_DEVICES] = {&limb_device_1, &limb_device_2,
                                                                     &limb_device_3};

#endif
