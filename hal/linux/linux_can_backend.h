/* The functions that each kind of CAN bus implements. Private to hal/linux. A backend's own struct begins
 * with a struct hal_can. */
#ifndef LINUX_CAN_BACKEND_H
#define LINUX_CAN_BACKEND_H

#include <stdbool.h>
#include <stddef.h>

#include "hal_can.h"
#include "loop.h"

/* Called as a linux_can_ready_t; linux_can.h is built upon this header, which does not include it. */
typedef void (*linux_can_backend_ready_t)(void *ctx);

/* Arguments of linux_can_open with BUS taken apart. All pointers are valid during open only, but for loop and
 * ctx. */
typedef struct {
    loop_t *loop;
    const char *bus;     /* as the user wrote it, for messages */
    const char *address; /* what follows the kind and its colon, or the kind alone */
    linux_can_backend_ready_t ready;
    void *ctx;
    char *error;
    size_t error_size;
} linux_can_request_t;

/* The functions are those of hal_can.h. open returns NULL after linux_can_backend_refuse. The backend keeps
 * health up to date and calls ready when it has changed. */
typedef struct {
    const char *kind;
    bool address_optional; /* BUS may be the kind alone, or the kind and a slash with more */
    bool (*is_address)(const char *address); /* can it be right? NULL: any can */
    hal_can_t *(*open)(const linux_can_request_t *request);
    void (*close)(hal_can_t *can);
    bool (*send)(hal_can_t *can, const can_frame_t *frame);
    size_t (*receive)(hal_can_t *can, can_frame_t *frames, size_t max);
    void (*restart)(hal_can_t *can);
    void (*set_filters)(hal_can_t *can, const hal_can_filter_t *filters, size_t n);
} linux_can_backend_t;

struct hal_can {
    const linux_can_backend_t *backend;
    loop_t *loop;
    linux_can_backend_ready_t ready;
    void *ctx;
    hal_can_health_t health;
};

extern const linux_can_backend_t can_socketcan_backend;
extern const linux_can_backend_t can_socketcand_backend;
extern const linux_can_backend_t can_gs_usb_backend;

/* Sets the fields of *can; the state is HAL_CAN_DOWN. */
void linux_can_backend_init(hal_can_t *can, const linux_can_backend_t *backend,
                            const linux_can_request_t *request);

/* Writes "BUS: reason" to the caller's error[]. */
void linux_can_backend_refuse(const linux_can_request_t *request, const char *reason);

#endif
