/* The arbitrator on a dsPIC33: joins the drivers to the application, one turn of the main loop after the
 * other. Drivers' handlers fill rings; everything else happens here. */
#include <stdbool.h>
#include <string.h>

#include "arb_app.h"
#include "arb_limits.h"
#include "board.h"
#include "clock.h"
#include "ecan1.h"
#include "nvm.h"
#include "part.h"
#include "pdcp_time.h"
#include "sys.h"
#include "uart1.h"

#ifndef FIRMWARE_BAUD
#define FIRMWARE_BAUD 128000uL
#endif

/* An image with storage in flash is built for fewer pages than can be addressed; the flash keeps so many. */
PART_ASSERT(firmware_keeps_to_the_pages_of_the_flash,
            ARB_NVM_PAGES == HAL_NVM_SIZE / HAL_NVM_PAGE || ARB_NVM_PAGES <= NVM_FLASH_PAGES);

enum { FRAMES = 8, HOST_BYTES = 32, BLINK_MS = 128 };

/* The application last: what stands behind its 11 KB takes longer to reach. */
typedef struct {
    arb_port_t port;
    hal_can_t *can;
    hal_uart_t *uart;
    hal_nvm_t *nvm;
    uint32_t next_ms;
    uint16_t host_count; /* bytes that the application has not taken yet */
    uint8_t host_bytes[HOST_BYTES];
    arb_app_t app;
} firmware_t;

static firmware_t firmware;

static bool can_send(void *ctx, const can_frame_t *frame)
{
    return hal_can_send(((firmware_t *)ctx)->can, frame);
}

static void can_restart(void *ctx)
{
    hal_can_restart(((firmware_t *)ctx)->can);
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    return hal_uart_write(((firmware_t *)ctx)->uart, bytes, size);
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    return hal_nvm_read(((firmware_t *)ctx)->nvm, address, bytes, size);
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    return hal_nvm_write(((firmware_t *)ctx)->nvm, address, bytes, size);
}

static int8_t nvm_status(void *ctx)
{
    return (int8_t)hal_nvm_status(((firmware_t *)ctx)->nvm);
}

static uint32_t counter(void *ctx, arb_port_counter_t which)
{
    const firmware_t *self = ctx;
    const hal_can_health_t health = hal_can_health(self->can);
    return which == ARB_PORT_FRAMES_LOST     ? health.rx_overruns
           : which == ARB_PORT_FRAMES_UNSENT ? health.tx_failed
                                             : uart1_lost(self->uart);
}

/* One batch: what is left waits for the next turn, which follows at once. */
static void take_frames(firmware_t *self, uint32_t now_ms)
{
    can_frame_t frames[FRAMES];
    const can_frame_t *end = &frames[hal_can_receive(self->can, frames, FRAMES)];
    for (const can_frame_t *frame = frames; frame != end; frame++) {
        arb_app_on_frame(&self->app, now_ms, frame);
    }
    const hal_can_health_t health = hal_can_health(self->can);
    arb_app_on_errors(&self->app, health.tx_errors, health.rx_errors);
    arb_app_on_state(&self->app, now_ms, (pdcp_bus_state_t)health.state);
}

static void take_bytes(firmware_t *self, uint32_t now_ms)
{
    uint8_t *free = &self->host_bytes[self->host_count];
    self->host_count += (uint16_t)hal_uart_read(self->uart, free, HOST_BYTES - self->host_count);
    if (self->host_count != 0) {
        const uint16_t taken = arb_app_on_bytes(&self->app, now_ms, self->host_bytes, self->host_count);
        self->host_count -= taken;
        memmove(self->host_bytes, &self->host_bytes[taken], self->host_count);
    }
}

static bool has_work(void *ctx)
{
    const firmware_t *self = ctx;
    return ecan1_has_work(self->can) || uart1_has_work(self->uart) ||
           !pdcp_time_before(hal_clock_ms(), self->next_ms);
}

static void start(firmware_t *self)
{
    sys_start();
    board_start();
    if (!clock_start()) {
        sys_fail(SYS_FAULT_CRYSTAL);
    }
    self->nvm = nvm_open();
    self->uart = uart1_open(UART1_BRG(FIRMWARE_BAUD));
    self->port = (arb_port_t){.ctx = self,
                              .can_send = can_send,
                              .can_restart = can_restart,
                              .host_write = host_write,
                              .nvm_read = nvm_read,
                              .nvm_write = nvm_write,
                              .nvm_status = nvm_status,
                              .counter = counter};
    const arb_settings_t settings = {.serial = hal_sys_serial(), .seed = hal_sys_random()};
    arb_app_init(&self->app, &self->port, &settings, hal_clock_ms());
    /* Last (D-MCU-2): that reads the EEPROM, and frames that came meanwhile would be old or lost. Now they
     * are repeated. */
    self->can = ecan1_open();
}

/* Lit; blinks when a fault or the watchdog has restarted the program. */
static void show_state(uint32_t now_ms)
{
    const bool lit = ((uint16_t)now_ms & BLINK_MS) != 0;
    board_led(lit || sys_reset_cause() > SYS_RESET_ILLEGAL);
}

int main(void)
{
    firmware_t *self = &firmware;
    start(self);
    for (;;) {
        const uint32_t now_ms = hal_clock_ms();
        sys_kick(now_ms);
        show_state(now_ms);
        take_frames(self, now_ms);
        take_bytes(self, now_ms);
        self->next_ms = arb_app_step(&self->app, now_ms);
        sys_idle(has_work, self);
    }
}
