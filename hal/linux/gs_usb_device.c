#include "gs_usb_device.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define CLASS_VENDOR 0xFFu
#define PORTS_MAX 7 /* hubs below each other, as USB permits */
#define PACKET_MASK 0x7FFu
#define RULE "SUBSYSTEM==\"usb\", ATTR{idVendor}==\"%04x\", ATTR{idProduct}==\"%04x\", TAG+=\"uaccess\""

static const struct {
    uint16_t vid;
    uint16_t pid;
} known_pairs[] = {
    {0x1d50, 0x606f}, /* candleLight, CANable, USB2CAN */
    {0x1209, 0x2323}, /* candleLight */
    {0x1cd2, 0x606f}, /* CES CANext FD */
    {0x16d0, 0x10b8}, /* ABE CANdebugger FD */
    {0x16d0, 0x0f30}, /* Xylanta SAINT3 */
    {0x1209, 0xca01}, /* CANnectivity */
};

/* --- what a device says of itself --- */

/* An attribute of the device in sysfs: it can be read without rights and without a transfer. */
static void read_attribute(libusb_device *device, const char *name, char *text, size_t size)
{
    char path[96];
    uint8_t ports[PORTS_MAX];
    int n = libusb_get_port_numbers(device, ports, PORTS_MAX);
    text[0] = '\0';
    if (n <= 0) {
        return;
    }
    int length = snprintf(path, sizeof path, "/sys/bus/usb/devices/%u", libusb_get_bus_number(device));
    for (int i = 0; i < n; i++) {
        length += snprintf(path + length, sizeof path - (size_t)length, "%c%u", i == 0 ? '-' : '.', ports[i]);
    }
    snprintf(path + length, sizeof path - (size_t)length, "/%s", name);
    FILE *file = fopen(path, "re");
    if (file == NULL) {
        return;
    }
    if (fgets(text, (int)size, file) == NULL || strchr(text, '\n') == NULL) {
        text[0] = '\0';
    }
    text[strcspn(text, "\n")] = '\0';
    fclose(file);
}

static bool is_known(uint16_t vid, uint16_t pid)
{
    for (size_t i = 0; i < sizeof known_pairs / sizeof known_pairs[0]; i++) {
        if (known_pairs[i].vid == vid && known_pairs[i].pid == pid) {
            return true;
        }
    }
    return false;
}

static bool is_bulk(const struct libusb_endpoint_descriptor *endpoint)
{
    return (endpoint->bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) == LIBUSB_TRANSFER_TYPE_BULK;
}

/* The first bulk endpoint each way. False: one is missing. */
static bool read_endpoints(const struct libusb_interface_descriptor *interface, gs_usb_device_t *description)
{
    for (unsigned i = 0; i < interface->bNumEndpoints; i++) {
        const struct libusb_endpoint_descriptor *endpoint = &interface->endpoint[i];
        if (!is_bulk(endpoint)) {
            continue;
        }
        if ((endpoint->bEndpointAddress & LIBUSB_ENDPOINT_IN) == 0 && description->out == 0) {
            description->out = endpoint->bEndpointAddress;
        } else if ((endpoint->bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0 && description->in == 0) {
            description->in = endpoint->bEndpointAddress;
            description->packet_size = endpoint->wMaxPacketSize & PACKET_MASK;
        }
    }
    return description->in != 0 && description->out != 0;
}

static bool read_interface(const struct libusb_config_descriptor *config, gs_usb_device_t *description)
{
    if (config->bNumInterfaces <= GS_USB_DEVICE_INTERFACE ||
        config->interface[GS_USB_DEVICE_INTERFACE].num_altsetting < 1) {
        return false;
    }
    const struct libusb_interface_descriptor *interface =
        &config->interface[GS_USB_DEVICE_INTERFACE].altsetting[0];
    bool vendor_class = interface->bInterfaceClass == CLASS_VENDOR &&
                        interface->bInterfaceSubClass == CLASS_VENDOR &&
                        interface->bInterfaceProtocol == CLASS_VENDOR;
    return (description->known || vendor_class) && read_endpoints(interface, description);
}

bool gs_usb_device_describe(libusb_device *device, gs_usb_device_t *description)
{
    struct libusb_device_descriptor about;
    struct libusb_config_descriptor *config;
    *description = (gs_usb_device_t){0};
    if (libusb_get_device_descriptor(device, &about) != 0 ||
        libusb_get_active_config_descriptor(device, &config) != 0) {
        return false;
    }
    description->vid = about.idVendor;
    description->pid = about.idProduct;
    description->known = is_known(about.idVendor, about.idProduct);
    bool fits = read_interface(config, description);
    libusb_free_config_descriptor(config);
    if (!fits) {
        return false;
    }
    snprintf(description->node, sizeof description->node, "/dev/bus/usb/%03u/%03u",
             libusb_get_bus_number(device), libusb_get_device_address(device));
    read_attribute(device, "serial", description->serial, sizeof description->serial);
    read_attribute(device, "product", description->product, sizeof description->product);
    return true;
}

bool gs_usb_device_is_permitted(const gs_usb_device_t *description)
{
    return access(description->node, R_OK | W_OK) == 0;
}

/* --- opening --- */

/* Without a serial number only what is known by vendor and product (D-LIN-1). */
static bool is_wanted(const gs_usb_device_t *description, const char *serial)
{
    return serial[0] == '\0' ? description->known : strcmp(description->serial, serial) == 0;
}

static void explain(int failure, const gs_usb_device_t *description, char *error, size_t size)
{
    if (failure == LIBUSB_ERROR_ACCESS) {
        snprintf(error, size, "no right to open %s; this udev rule gives it: " RULE, description->node,
                 description->vid, description->pid);
    } else if (failure == LIBUSB_ERROR_BUSY) {
        snprintf(error, size, "the adapter is in use by another program");
    } else {
        snprintf(error, size, "the adapter cannot be opened: %s", libusb_strerror(failure));
    }
}

/* Opens one device. NULL: error[] says why. */
static libusb_device_handle *open_device(libusb_device *device, const gs_usb_device_t *description,
                                         char *error, size_t size)
{
    libusb_device_handle *handle = NULL;
    int failure = libusb_open(device, &handle);
    if (failure == 0) {
        libusb_set_auto_detach_kernel_driver(handle, 1); /* refused on systems that have nothing to detach */
        failure = libusb_claim_interface(handle, GS_USB_DEVICE_INTERFACE);
    }
    if (failure == 0) {
        return handle;
    }
    explain(failure, description, error, size);
    if (handle != NULL) {
        libusb_close(handle);
    }
    return NULL;
}

libusb_device_handle *gs_usb_device_open(libusb_context *usb, const char *serial,
                                         gs_usb_device_t *description, char *error, size_t error_size)
{
    libusb_device **devices;
    libusb_device_handle *handle = NULL;
    ssize_t n = libusb_get_device_list(usb, &devices);
    bool found = false;
    snprintf(error, error_size, "no such adapter is plugged in");
    for (ssize_t i = 0; i < n && !found; i++) {
        found = gs_usb_device_describe(devices[i], description) && is_wanted(description, serial);
        if (found) {
            handle = open_device(devices[i], description, error, error_size);
        }
    }
    if (n >= 0) {
        libusb_free_device_list(devices, 1);
    }
    return handle;
}
