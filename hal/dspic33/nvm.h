/* The storage of hal_nvm.h on this target: one of two files is linked.
 *
 * nvm_eeprom.c: a 24LC256 at I2C address 50h. A page is sent in 1.7 ms and written in 5 ms while everything
 * goes on. nvm_flash.c: the part's own program flash, for boards without an EEPROM. The processor stands
 * still while it is written, 52 to 100 us at a time, and for 20 to 26 ms each time that a flash page is
 * erased: frames and bytes are lost then. It is for benches, not for a limb that moves. It keeps fewer
 * different pages than HAL_NVM_SIZE has, see there. */
#ifndef NVM_H
#define NVM_H

#include "hal_nvm.h"
#include "part.h"

/* Different pages that nvm_flash.c keeps: an area has a place for each, and one for its header. */
#define NVM_FLASH_PAGES (PART_FLASH_STORE_PAGES * PART_FLASH_PAGE / NVM_FLASH_SLOT - 1u)
#define NVM_FLASH_SLOT 64u /* addresses that a page takes there, two for an instruction */

/* The only one there is; never NULL. Opens the I2C bus if it stands there. clock_start comes first. */
hal_nvm_t *nvm_open(void);

#endif
