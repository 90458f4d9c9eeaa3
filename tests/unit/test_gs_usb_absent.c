/* A program that was built without libusb: USB adapters are no choice, and asking for one tells why. */
#include <string.h>

#include "can_gs_usb.h"
#include "linux_can.h"
#include "unity.h"

static char error[256];

void setUp(void) {}

void tearDown(void) {}

static void on_ready(void *ctx)
{
    (void)ctx;
}

static void check_refused(const char *bus, const char *reason)
{
    loop_t *loop = loop_create();
    TEST_ASSERT_NULL(linux_can_open(loop, bus, on_ready, NULL, error, sizeof error));
    TEST_ASSERT_EQUAL_STRING(reason, error);
    loop_destroy(loop);
}

static void test_asking_for_an_adapter_tells_why_not(void)
{
    check_refused("gs_usb", "gs_usb: this program was built without USB adapters: libusb-1.0 was not there");
    check_refused("gs_usb:12AB/1",
                  "gs_usb:12AB/1: this program was built without USB adapters: libusb-1.0 was not there");
}

static void test_adapters_are_no_choice(void)
{
    check_refused("gs_usb2",
                  "gs_usb2: not a CAN bus; expected one of socketcan:INTERFACE, "
                  "socketcand:HOST:PORT/NAME");
}

static void on_found(void *ctx, const char *name, const char *description)
{
    (void)name;
    (void)description;
    *(int *)ctx += 1;
}

static void test_none_is_listed(void)
{
    int count = 0;
    can_gs_usb_list(on_found, &count);
    TEST_ASSERT_EQUAL_INT(0, count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_asking_for_an_adapter_tells_why_not);
    RUN_TEST(test_adapters_are_no_choice);
    RUN_TEST(test_none_is_listed);
    return UNITY_END();
}
