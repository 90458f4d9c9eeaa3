#include "pdcpd_order.h"

#include <stdio.h>

#include "arb_hostcodec.h"
#include "arb_limb.h"
#include "can_frame.h"
#include "pdcp_bytes.h"

enum {
    NAME = 24,      /* 65535:65535:65535.255 */
    HEX_SHOWN = 16, /* bytes of a value; of a longer one the line tells the beginning */
    HEX = 3 * HEX_SHOWN + 1
};

static const char *device(char name[NAME], const uint8_t *bytes)
{
    const pdcp_identity_t identity = pdcp_bytes_get_identity(bytes);
    (void)snprintf(name, NAME, "%u:%u:%u", identity.vid, identity.pid, identity.sn);
    return name;
}

static const char *channel(char name[NAME], const uint8_t *bytes)
{
    const pdcp_identity_t identity = pdcp_bytes_get_identity(bytes);
    (void)snprintf(name, NAME, "%u:%u:%u.%u", identity.vid, identity.pid, identity.sn, bytes[ARB_AT_INDEX]);
    return name;
}

static const char *hex(char digits[HEX], const uint8_t *bytes, unsigned count)
{
    digits[0] = '\0';
    for (unsigned i = 0; i < count && i < HEX_SHOWN; i++) {
        (void)snprintf(&digits[3 * i], HEX - 3 * i, " %02X", bytes[i]);
    }
    return digits;
}

static void set_parameter(char *text, const uint8_t *payload, uint16_t len)
{
    char name[NAME];
    char digits[HEX];
    const unsigned size = len - (unsigned)ARB_AT_VALUE;
    (void)snprintf(text, PDCPD_ORDER_TEXT, "sets parameter %u of %s to%s%s", payload[ARB_AT_PARAM],
                   channel(name, payload), hex(digits, &payload[ARB_AT_VALUE], size),
                   size > HEX_SHOWN ? " ..." : "");
}

static void configure_link(char *text, const uint8_t *payload, uint16_t len)
{
    char output[NAME];
    char input[NAME];
    (void)len;
    (void)snprintf(text, PDCPD_ORDER_TEXT, "links %s -> %s", channel(output, payload),
                   channel(input, &payload[ARB_CHANNEL_BYTES]));
}

static void pass_through(char *text, const uint8_t *payload, uint16_t len)
{
    char name[NAME];
    char digits[HEX];
    const unsigned dlc = payload[ARB_AT_DLC];
    (void)len;
    (void)snprintf(text, PDCPD_ORDER_TEXT, "sends%s to %s",
                   hex(digits, &payload[ARB_AT_DATA], dlc < CAN_FRAME_DATA_MAX ? dlc : CAN_FRAME_DATA_MAX),
                   device(name, payload));
}

static void reset(char *text, const uint8_t *payload, uint16_t len)
{
    (void)len;
    if (payload[0] == 0) {
        (void)snprintf(text, PDCPD_ORDER_TEXT, "resets all devices");
    } else {
        (void)snprintf(text, PDCPD_ORDER_TEXT, "resets device %u of the list", payload[0]);
    }
}

static void set_flags(char *text, const uint8_t *payload, uint16_t len)
{
    (void)len;
    (void)snprintf(text, PDCPD_ORDER_TEXT, "sets the flags to %02Xh", payload[0]);
}

static void act(char *text, const uint8_t *payload, uint16_t len)
{
    static const char *const names[] = {[ARB_ACTION_SAVE] = "saves configuration",
                                        [ARB_ACTION_LOAD] = "loads configuration",
                                        [ARB_ACTION_ERASE] = "erases configuration",
                                        [ARB_ACTION_AUTOCONFIGURE] = "has terminal channels linked",
                                        [ARB_ACTION_CLEAR] = "removes all links",
                                        [ARB_ACTION_ENFORCE] = "enforces sole access",
                                        [ARB_ACTION_REPLACE] = "has stand-ins sought",
                                        [ARB_ACTION_ADOPT] = "adopts stand-ins"};
    const unsigned action = payload[0];
    (void)len;
    if (action == ARB_ACTION_NONE || action >= sizeof names / sizeof names[0]) {
        (void)snprintf(text, PDCPD_ORDER_TEXT, "wants action %u", action);
    } else if (action > ARB_ACTION_ERASE) {
        (void)snprintf(text, PDCPD_ORDER_TEXT, "%s", names[action]);
    } else if (payload[1] == 0) {
        (void)snprintf(text, PDCPD_ORDER_TEXT, "%s 0, the active one", names[action]);
    } else {
        (void)snprintf(text, PDCPD_ORDER_TEXT, "%s %u", names[action], payload[1]);
    }
}

static void write_configs(char *text, const uint8_t *payload, uint16_t len)
{
    const unsigned from = pdcp_bytes_get_u16(&payload[ARB_AT_OFFSET]);
    (void)snprintf(text, PDCPD_ORDER_TEXT, "writes configurations, bytes %u to %u of %u", from,
                   from + len - (unsigned)ARB_AT_PIECE - 1u, pdcp_bytes_get_u16(&payload[ARB_AT_LENGTH]));
}

static void remove_link(char *text, const uint8_t *payload, uint16_t len)
{
    char input[NAME];
    (void)len;
    (void)snprintf(text, PDCPD_ORDER_TEXT, "unlinks %s", channel(input, payload));
}

/* The requests that change something. */
static const struct {
    uint16_t message;
    uint16_t len; /* of the payload, at least */
    void (*write)(char *text, const uint8_t *payload, uint16_t len);
} orders[] = {
    {.message = ARB_MSG_SET_PARAMETER, .len = ARB_AT_VALUE + 1, .write = set_parameter},
    {.message = ARB_MSG_CONFIGURE_LINK, .len = 2 * ARB_CHANNEL_BYTES, .write = configure_link},
    {.message = ARB_MSG_PASSTHROUGH, .len = ARB_AT_DATA + CAN_FRAME_DATA_MAX, .write = pass_through},
    {.message = ARB_MSG_RESET, .len = 1, .write = reset},
    {.message = ARB_MSG_SET_FLAGS, .len = 1, .write = set_flags},
    {.message = ARB_MSG_ACTION, .len = 2, .write = act},
    {.message = ARB_MSG_WRITE_CONFIGS, .len = ARB_AT_PIECE + 1, .write = write_configs},
    {.message = ARB_MSG_REMOVE_LINK, .len = ARB_CHANNEL_BYTES, .write = remove_link},
};

bool pdcpd_order_text(char text[PDCPD_ORDER_TEXT], uint16_t message, const uint8_t *payload, uint16_t len)
{
    for (unsigned i = 0; i < sizeof orders / sizeof orders[0]; i++) {
        if (orders[i].message == message && len >= orders[i].len) {
            orders[i].write(text, payload, len);
            return true;
        }
    }
    return false;
}
