/* The smallest complete program around the arbitrator, to be linked for a microcontroller and weighed, not
 * run: a real port whose functions reach registers, and the main loop. BENCH_DEVICE: a device of the device
 * role beside it.
 *
 * bench_registers stands for the controllers of a chip; the linker gives it an address. */
#include <stddef.h>

#include "arb_app.h"
#ifdef BENCH_DEVICE
#include "pdcp_device.h"
#endif

int main(void);

extern volatile struct {
    uint16_t can_id;
    uint8_t can_dlc;
    uint8_t can_data[CAN_FRAME_DATA_MAX];
    uint8_t can_full;
    uint8_t can_waiting;
    uint8_t uart_data;
    uint8_t uart_full;
    uint8_t uart_waiting;
    uint16_t nvm_address;
    uint8_t nvm_data;
    uint8_t nvm_busy;
    uint32_t clock_ms;
} bench_registers;

static arb_app_t app;

static bool can_send(void *ctx, const can_frame_t *frame)
{
    (void)ctx;
    if (bench_registers.can_full != 0) {
        return false;
    }
    bench_registers.can_id = frame->id;
    for (uint8_t i = 0; i < CAN_FRAME_DATA_MAX; i++) {
        bench_registers.can_data[i] = frame->data[i];
    }
    bench_registers.can_dlc = frame->dlc;
    return true;
}

static bool can_receive(can_frame_t *frame)
{
    if (bench_registers.can_waiting == 0) {
        return false;
    }
    frame->id = bench_registers.can_id;
    frame->kind = CAN_FRAME_BASE;
    frame->dlc = bench_registers.can_dlc;
    for (uint8_t i = 0; i < CAN_FRAME_DATA_MAX; i++) {
        frame->data[i] = bench_registers.can_data[i];
    }
    return true;
}

static size_t host_write(void *ctx, const uint8_t *bytes, size_t size)
{
    size_t done = 0;
    (void)ctx;
    while (done < size && bench_registers.uart_full == 0) {
        bench_registers.uart_data = bytes[done++];
    }
    return done;
}

static bool nvm_read(void *ctx, uint16_t address, uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    for (uint16_t i = 0; i < size; i++) {
        bench_registers.nvm_address = (uint16_t)(address + i);
        bytes[i] = bench_registers.nvm_data;
    }
    return true;
}

static bool nvm_write(void *ctx, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    (void)ctx;
    if (bench_registers.nvm_busy != 0) {
        return false;
    }
    for (uint16_t i = 0; i < size; i++) {
        bench_registers.nvm_address = (uint16_t)(address + i);
        bench_registers.nvm_data = bytes[i];
    }
    return true;
}

static int8_t nvm_status(void *ctx)
{
    (void)ctx;
    return bench_registers.nvm_busy != 0 ? 1 : 0;
}

#ifdef BENCH_DEVICE
static pdcp_device_t device;

static void show_input(void *ctx, uint8_t channel, const uint8_t *data, uint8_t len)
{
    (void)ctx;
    if (len != 0) {
        bench_registers.nvm_address = channel;
        bench_registers.nvm_data = data[0];
    }
}

static void start_device(uint32_t now_ms)
{
    static const pdcp_device_channel_desc_t channels[] = {{.direction = PDCP_INPUT, .terminal = true},
                                                          {.direction = PDCP_OUTPUT}};
    static const pdcp_device_desc_t desc = {.identity = {2, 2, 1}, .channels = channels, .channel_count = 2};
    static const pdcp_device_port_t port = {.input = show_input};
    (void)pdcp_device_init(&device, &desc, &port, NULL, now_ms, now_ms);
}

static void run_device(uint32_t now_ms, const can_frame_t *received)
{
    can_frame_t frame;
    if (received != NULL) {
        pdcp_device_on_frame(&device, now_ms, received);
    }
    (void)pdcp_device_send(&device, now_ms, 2, (const uint8_t *)"\0", 1);
    (void)pdcp_device_step(&device, now_ms);
    while (pdcp_device_tx_peek(&device, &frame) && can_send(NULL, &frame)) {
        pdcp_device_tx_pop(&device);
    }
}
#endif

int main(void)
{
    static const arb_port_t port = {.can_send = can_send,
                                    .host_write = host_write,
                                    .nvm_read = nvm_read,
                                    .nvm_write = nvm_write,
                                    .nvm_status = nvm_status};
    static const arb_settings_t settings = {.serial = 1};
    arb_app_init(&app, &port, &settings, bench_registers.clock_ms);
#ifdef BENCH_DEVICE
    start_device(bench_registers.clock_ms);
#endif
    for (;;) {
        const uint32_t now_ms = bench_registers.clock_ms;
        can_frame_t frame;
        const bool received = can_receive(&frame);
        if (received) {
            arb_app_on_frame(&app, now_ms, &frame);
        }
        if (bench_registers.uart_waiting != 0) {
            const uint8_t byte = bench_registers.uart_data;
            (void)arb_app_on_bytes(&app, now_ms, &byte, 1);
        }
        (void)arb_app_step(&app, now_ms);
#ifdef BENCH_DEVICE
        run_device(now_ms, received ? &frame : NULL);
#endif
    }
}
