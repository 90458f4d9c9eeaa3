#include "gs_usb_adapter.h"

#include <stdio.h>

#include "oneshot.h"

void gs_usb_adapter_fail(gs_usb_adapter_t *adapter, const char *reason)
{
    if (adapter->failure == NULL) {
        snprintf(adapter->reason, sizeof adapter->reason, "%s", reason);
        adapter->failure = adapter->reason;
        oneshot_arm_us(adapter->timer, 0);
    }
}

void gs_usb_adapter_fail_usb(gs_usb_adapter_t *adapter, int failure)
{
    gs_usb_adapter_fail(adapter, libusb_strerror(failure));
}

void gs_usb_adapter_fail_unplugged(gs_usb_adapter_t *adapter)
{
    gs_usb_adapter_fail(adapter, "the adapter was pulled out");
}
