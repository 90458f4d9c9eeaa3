#include "linux_uart.h"

#include <stdio.h>
#include <string.h>

#include "linux_uart_backend.h"

static const linux_uart_backend_t *const backends[] = {&linux_uart_pty_backend, &linux_uart_serial_backend};

#define BACKENDS (sizeof backends / sizeof backends[0])

/* Does PORT name this kind, with an address unless there need be none? */
static bool names(const char *port, const linux_uart_backend_t *backend)
{
    size_t length = strlen(backend->kind);
    if (strncmp(port, backend->kind, length) != 0) {
        return false;
    }
    return port[length] == ':' ? port[length + 1] != '\0' : port[length] == '\0' && !backend->needs_address;
}

bool linux_uart_is_port(const char *port)
{
    for (size_t i = 0; i < BACKENDS; i++) {
        if (names(port, backends[i])) {
            const char *colon = strchr(port, ':');
            return colon == NULL || backends[i]->is_address == NULL || backends[i]->is_address(colon + 1);
        }
    }
    return false;
}

hal_uart_t *linux_uart_open(loop_t *loop, const char *port, linux_uart_ready_t ready, void *ctx, char *error,
                            size_t error_size)
{
    linux_uart_request_t request = {
        .loop = loop, .port = port, .ready = ready, .ctx = ctx, .error = error, .error_size = error_size};
    for (size_t i = 0; i < BACKENDS; i++) {
        if (names(port, backends[i])) {
            const char *colon = strchr(port, ':');
            request.address = colon != NULL ? colon + 1 : NULL;
            return backends[i]->open(&request);
        }
    }
    linux_uart_backend_refuse(&request,
                              "not a host port; expected pty, pty:LINKPATH or serial:DEVICE[@BAUD]");
    return NULL;
}

void linux_uart_close(hal_uart_t *uart)
{
    if (uart != NULL) {
        uart->backend->close(uart);
    }
}

const char *linux_uart_path(const hal_uart_t *uart)
{
    return uart->backend->path(uart);
}

bool linux_uart_host_left(hal_uart_t *uart)
{
    bool left = uart->host_left;
    uart->host_left = false;
    return left;
}

size_t hal_uart_read(hal_uart_t *uart, uint8_t *bytes, size_t size)
{
    return uart->backend->read(uart, bytes, size);
}

size_t hal_uart_write(hal_uart_t *uart, const uint8_t *bytes, size_t size)
{
    return uart->backend->write(uart, bytes, size);
}
