/* Non-volatile memory in a file of HAL_NVM_SIZE bytes. What can be done with it stands in hal_nvm.h. A write
 * is on the disk (fdatasync) before hal_nvm_status says idle. */
#ifndef LINUX_NVM_H
#define LINUX_NVM_H

#include <stddef.h>

#include "hal_nvm.h"

/* Opens or creates the file (mode 0600, filled with FFh) and locks it, so that two daemons never share one. A
 * file of another size is refused. path NULL: memory only, forgotten at the end. NULL result: error[] holds
 * one line that names the file and the reason. The caller owns the result. */
hal_nvm_t *linux_nvm_open(const char *path, char *error, size_t error_size);
void linux_nvm_close(hal_nvm_t *nvm);

#endif
