#include "ledbar.h"

#include <stdbool.h>
#include <stddef.h>

#include "i2c1.h"

enum {
    EXPANDER = 0x20,
    IODIRA = 0x00, /* register addresses; each is followed by the one of port B */
    OLATA = 0x14,
    REFRESH_MS = 1000,
    REGISTER_BYTES = 3
};

static uint8_t ledbar_lit;
static uint8_t ledbar_shown = LEDBAR_LEDS + 1;
static bool ledbar_levels_due;
static uint32_t ledbar_refreshed_ms;
static uint8_t ledbar_bytes[REGISTER_BYTES];

void ledbar_set(uint8_t lit)
{
    ledbar_lit = lit < LEDBAR_LEDS ? lit : LEDBAR_LEDS;
}

static bool send(uint8_t address, uint16_t value)
{
    ledbar_bytes[0] = address;
    ledbar_bytes[1] = (uint8_t)value;
    ledbar_bytes[2] = (uint8_t)(value >> 8);
    return i2c1_start(EXPANDER, ledbar_bytes, REGISTER_BYTES, NULL, 0);
}

/* Directions first, then levels; the module's latches keep all LEDs off in between. */
void ledbar_step(uint32_t now_ms)
{
    const uint16_t leds = (1u << LEDBAR_LEDS) - 1u;
    if (i2c1_status() == I2C1_BUSY) {
        return;
    }
    if (ledbar_shown > LEDBAR_LEDS || now_ms - ledbar_refreshed_ms >= REFRESH_MS) {
        if (send(IODIRA, (uint16_t)~leds)) {
            ledbar_refreshed_ms = now_ms;
            ledbar_shown = 0;
            ledbar_levels_due = true;
        }
    } else if (ledbar_levels_due || ledbar_shown != ledbar_lit) {
        if (send(OLATA, (uint16_t) ~((1u << ledbar_lit) - 1u))) {
            ledbar_shown = ledbar_lit;
            ledbar_levels_due = false;
        }
    }
}
