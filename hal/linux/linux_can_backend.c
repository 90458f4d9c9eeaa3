#include "linux_can_backend.h"

#include <stdio.h>

void linux_can_backend_init(hal_can_t *can, const linux_can_backend_t *backend,
                            const linux_can_request_t *request)
{
    can->backend = backend;
    can->loop = request->loop;
    can->ready = request->ready;
    can->ctx = request->ctx;
    can->health = (hal_can_health_t){.state = HAL_CAN_DOWN};
}

void linux_can_backend_refuse(const linux_can_request_t *request, const char *reason)
{
    snprintf(request->error, request->error_size, "%s: %s", request->bus, reason);
}
