/* hal_sys.h on Linux. Two daemons on one machine are two arbitrators: the machine's own number would not tell
 * them apart. */
#include "hal_sys.h"

#include <sys/random.h>

uint32_t hal_sys_random(void)
{
    uint32_t number = 0;
    (void)getrandom(&number, sizeof number, 0);
    return number;
}

uint32_t hal_sys_serial(void)
{
    return hal_sys_random();
}
