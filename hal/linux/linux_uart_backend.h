/* The functions that each kind of host port implements. Private to hal/linux. A backend's own struct begins
 * with a struct hal_uart. */
#ifndef LINUX_UART_BACKEND_H
#define LINUX_UART_BACKEND_H

#include <stdbool.h>
#include <stddef.h>

#include "hal_uart.h"
#include "loop.h"

/* Called as a linux_uart_ready_t; linux_uart.h is built upon this header, which does not include it. */
typedef void (*linux_uart_backend_ready_t)(void *ctx);

/* Arguments of linux_uart_open with PORT taken apart. All pointers are valid during open only, but for loop
 * and ctx. */
typedef struct {
    loop_t *loop;
    const char *port;    /* as the user wrote it, for messages */
    const char *address; /* what follows the kind and its colon; NULL: nothing */
    linux_uart_backend_ready_t ready;
    void *ctx;
    char *error;
    size_t error_size;
} linux_uart_request_t;

/* The functions are those of hal_uart.h and linux_uart.h. open returns NULL after
 * linux_uart_backend_refuse. */
typedef struct {
    const char *kind;
    bool needs_address;
    bool (*is_address)(const char *address); /* can it be right? NULL: any can */
    hal_uart_t *(*open)(const linux_uart_request_t *request);
    void (*close)(hal_uart_t *uart);
    size_t (*read)(hal_uart_t *uart, uint8_t *bytes, size_t size);
    size_t (*write)(hal_uart_t *uart, const uint8_t *bytes, size_t size);
    const char *(*path)(const hal_uart_t *uart);
} linux_uart_backend_t;

struct hal_uart {
    const linux_uart_backend_t *backend;
    loop_t *loop;
    linux_uart_backend_ready_t ready;
    void *ctx;
    bool host_left; /* since linux_uart_host_left was asked */
};

extern const linux_uart_backend_t linux_uart_pty_backend;
extern const linux_uart_backend_t linux_uart_serial_backend;

void linux_uart_backend_init(hal_uart_t *uart, const linux_uart_backend_t *backend,
                             const linux_uart_request_t *request);

/* Writes "PORT: reason" to the caller's error[]. */
void linux_uart_backend_refuse(const linux_uart_request_t *request, const char *reason);

#endif
