/* hal_sys.h on Linux. Two daemons on one machine are two arbitrators: the machine's own number would not tell
 * them apart. */
#include "hal_sys.h"

#include <sys/random.h>

uint32_t hal_sys_serial(void)
{
    uint32_t serial = 0;
    (void)getrandom(&serial, sizeof serial, 0);
    return serial;
}
