/* What the headers demand is checked (pdcp_assert.h): each of these breaks one demand, and the check names
 * its header and clause. */
#include "pdcp_assert.h"

#include <setjmp.h>
#include <stddef.h>
#include <string.h>

#include "pdcp_codec.h"
#include "pdcp_link.h"
#include "pdcp_request.h"
#include "pdcp_setup.h"
#include "pdcp_tables.h"
#include "unity.h"

static jmp_buf broken;
static const char *where;
static const char *what;
static pdcp_bus_t bus;

/* Takes the place of the one that aborts. */
void pdcp_assert_failed(const char *file, int line, const char *clause)
{
    (void)line;
    where = file;
    what = clause;
    longjmp(broken, 1);
}

static void on_event(void *ctx, uint32_t now_ms, const pdcp_event_t *event)
{
    (void)ctx;
    (void)now_ms;
    (void)event;
}

void setUp(void)
{
    static const pdcp_identity_t identity = {.vid = 2, .pid = 2, .sn = 4};
    memset(&bus, 0, sizeof bus);
    bus.on_event = on_event;
    pdcp_tables_init(&bus.tables);
    pdcp_tables_add(&bus.tables, 0, &identity, 0x11);
    where = NULL;
    what = NULL;
}

void tearDown(void) {}

static void expect_broken(const char *file, const char *clause)
{
    TEST_ASSERT_NOT_NULL_MESSAGE(what, "nothing was checked");
    TEST_ASSERT_EQUAL_STRING(clause, what);
    TEST_ASSERT_NOT_NULL(strstr(where, file));
}

static void test_a_second_request_to_a_place(void)
{
    pdcp_request_command(&bus, 0, PDCP_CLIENT_HOST, PDCP_RELEASE, 0);
    if (setjmp(broken) == 0) {
        pdcp_request_command(&bus, 0, PDCP_CLIENT_HOST, PDCP_RELEASE, 0);
    }
    expect_broken("pdcp_request.c", "pdcp_request.h: the place is idle");
}

static void test_a_setup_with_a_request_under_way(void)
{
    pdcp_request_command(&bus, 0, PDCP_CLIENT_HOST, PDCP_RELEASE, 0);
    if (setjmp(broken) == 0) {
        pdcp_setup_start(&bus, 0);
    }
    expect_broken("pdcp_setup.c", "pdcp_setup.h: no request is under way");
}

static void test_a_loss_with_a_request_under_way(void)
{
    pdcp_request_command(&bus, 0, PDCP_CLIENT_HOST, PDCP_RELEASE, 0);
    if (setjmp(broken) == 0) {
        pdcp_link_on_lost(&bus, 0);
    }
    expect_broken("pdcp_link.c", "pdcp_link.h: the request is cancelled");
}

static void test_a_node_id_that_has_an_owner(void)
{
    static const pdcp_identity_t other = {.vid = 2, .pid = 2, .sn = 5};
    if (setjmp(broken) == 0) {
        pdcp_tables_add(&bus.tables, 1, &other, 0x11);
    }
    expect_broken("pdcp_tables.c", "pdcp_tables.h: the node id is free");
}

static void test_a_place_that_is_none(void)
{
    if (setjmp(broken) == 0) {
        (void)pdcp_bus_device(&bus, PDCP_NONE);
    }
    expect_broken("pdcp_bus.c", "pdcp_bus.h: the place is a device's");
}

static void test_a_message_with_an_unknown_code(void)
{
    static const pdcp_msg_t msg = {.code = 0x50};
    can_frame_t frame;
    if (setjmp(broken) == 0) {
        pdcp_codec_encode(0x311, &msg, &frame);
    }
    expect_broken("pdcp_codec.c", "pdcp_codec.h: the code is known");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_second_request_to_a_place);
    RUN_TEST(test_a_setup_with_a_request_under_way);
    RUN_TEST(test_a_loss_with_a_request_under_way);
    RUN_TEST(test_a_node_id_that_has_an_owner);
    RUN_TEST(test_a_place_that_is_none);
    RUN_TEST(test_a_message_with_an_unknown_code);
    return UNITY_END();
}
