#include "linux_uart_backend.h"

#include <stdio.h>

void linux_uart_backend_init(hal_uart_t *uart, const linux_uart_backend_t *backend,
                             const linux_uart_request_t *request)
{
    uart->backend = backend;
    uart->loop = request->loop;
    uart->ready = request->ready;
    uart->ctx = request->ctx;
}

void linux_uart_backend_refuse(const linux_uart_request_t *request, const char *reason)
{
    snprintf(request->error, request->error_size, "%s: %s", request->port, reason);
}
