#include "linux_can.h"

#include <stdio.h>
#include <string.h>

#include "linux_can_backend.h"

static const linux_can_backend_t *const backends[] = {&can_socketcan_backend, &can_socketcand_backend,
                                                      &can_gs_usb_backend};

#define BACKENDS (sizeof backends / sizeof backends[0])

/* What follows the kind in BUS and its colon; NULL: BUS is of another kind. */
static const char *address_in(const char *bus, const linux_can_backend_t *backend)
{
    size_t length = strlen(backend->kind);
    const char *rest = bus + length;
    if (strncmp(bus, backend->kind, length) != 0) {
        return NULL;
    }
    if (rest[0] == ':') {
        return rest + 1;
    }
    return backend->address_optional && (rest[0] == '\0' || rest[0] == '/') ? rest : NULL;
}

bool linux_can_is_bus(const char *bus)
{
    for (size_t i = 0; i < BACKENDS; i++) {
        const char *address = address_in(bus, backends[i]);
        if (address != NULL) {
            return backends[i]->is_address == NULL || backends[i]->is_address(address);
        }
    }
    return false;
}

hal_can_t *linux_can_open(loop_t *loop, const char *bus, linux_can_ready_t ready, void *ctx, char *error,
                          size_t error_size)
{
    linux_can_request_t request = {
        .loop = loop, .bus = bus, .ready = ready, .ctx = ctx, .error = error, .error_size = error_size};
    for (size_t i = 0; i < BACKENDS; i++) {
        request.address = address_in(bus, backends[i]);
        if (request.address != NULL) {
            return backends[i]->open(&request);
        }
    }
    linux_can_backend_refuse(&request, "not a CAN bus; expected one of " LINUX_CAN_CHOICES);
    return NULL;
}

void linux_can_close(hal_can_t *can)
{
    if (can != NULL) {
        can->backend->close(can);
    }
}

bool hal_can_send(hal_can_t *can, const can_frame_t *frame)
{
    return can->backend->send(can, frame);
}

size_t hal_can_receive(hal_can_t *can, can_frame_t *frames, size_t max)
{
    return can->backend->receive(can, frames, max);
}

hal_can_health_t hal_can_health(const hal_can_t *can)
{
    return can->health;
}

void hal_can_restart(hal_can_t *can)
{
    can->backend->restart(can);
}

void hal_can_set_filters(hal_can_t *can, const hal_can_filter_t *filters, size_t n)
{
    can->backend->set_filters(can, filters, n);
}
