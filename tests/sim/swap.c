#include "swap.h"

#include "unity.h"

void swap_begin(limb_t *limb)
{
    limb_begin(limb, 1, 0xFFFFFFFFu - 2000u);
    limb->keeps = true;
    (void)limb_add(limb, 4, SWAP_SENSOR);
    (void)limb_add(limb, 5, SWAP_CONTROLLER);
    (void)limb_add(limb, 6, SWAP_HAND);
    (void)limb_add(limb, 7, SWAP_CONTROLLER);
}

void swap_run(limb_t *limb)
{
    limb_plug(limb, D1, D3);
    limb_want(limb, SWAP_LINKS);
    limb_await(limb, 2000);
}

void swap_restart(limb_t *limb, int first, int last)
{
    limb_stop_arbitrator(limb);
    for (int i = 0; i < limb->count; i++) {
        if (limb->parts[i].node != NULL) {
            limb_power_off(limb, i);
        }
    }
    limb_run_ms(limb, 1000);
    limb->settings.no_autoconfig = true;
    limb_start_arbitrator(limb);
    limb_plug(limb, first, last);
}

void swap_set_flags(limb_t *limb, uint8_t flags)
{
    TEST_ASSERT_EQUAL_HEX16(0x2405, limb_ask(limb, 0x2404, &flags, 1));
}
