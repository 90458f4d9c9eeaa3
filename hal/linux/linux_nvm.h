/* Non-volatile memory in a file of HAL_NVM_SIZE bytes (hal_nvm.h). A thread writes, so a slow disk delays
 * nobody. When hal_nvm_status reports idle, the write is on the disk (fdatasync). */
#ifndef LINUX_NVM_H
#define LINUX_NVM_H

#include <stddef.h>

#include "hal_nvm.h"

/* Opens or creates the file (mode 0600, filled with FFh) and locks it, so that two daemons never share one.
 * Refused: a file of another size, a symbolic link, a file of another user (root's aside) or that others may
 * write. path NULL: memory only, forgotten at the end. NULL result: error[] holds one line that names the
 * file and the reason. The caller owns the result. */
hal_nvm_t *linux_nvm_open(const char *path, char *error, size_t error_size);

/* Waits for the write under way. NULL: does nothing. */
void linux_nvm_close(hal_nvm_t *nvm);

#endif
