/* Stands in for can_gs_usb.c in a program that was built without libusb. */
#include "can_gs_usb.h"
#include "linux_can_backend.h"

static hal_can_t *can_gs_usb_open(const linux_can_request_t *request)
{
    linux_can_backend_refuse(request,
                             "this program was built without USB adapters: libusb-1.0 was not there");
    return NULL;
}

const linux_can_backend_t can_gs_usb_backend = {
    .kind = "gs_usb", .address_optional = true, .open = can_gs_usb_open};

void can_gs_usb_list(can_gs_usb_found_t found, void *ctx)
{
    (void)found;
    (void)ctx;
}
