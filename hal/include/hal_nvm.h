/* Contract: non-volatile memory of at least HAL_NVM_SIZE bytes, addressed from 0.
 *
 * A power failure may cut a write at any byte. Then the bytes before the cut are stored, the byte at the cut
 * is undefined, and bytes outside the written range keep their values. Writes reach the memory in the order
 * in which they were started. Call all functions from the main loop. */
#ifndef HAL_NVM_H
#define HAL_NVM_H

#include <stdbool.h>
#include <stdint.h>

#define HAL_NVM_SIZE 32768u /* a 24LC256 */
#define HAL_NVM_PAGE 64u    /* a write must not cross a multiple of this */

typedef struct hal_nvm hal_nvm_t;

typedef enum {
    HAL_NVM_IDLE = 0,   /* the last write is in the memory, or none was started */
    HAL_NVM_BUSY = 1,   /* a write is under way */
    HAL_NVM_FAILED = -1 /* the last write failed; a new one may be started */
} hal_nvm_status_t;

/* Reads size bytes at address into bytes[]. Bytes never written read as FFh. May take as long as the bus to
 * the memory needs (24LC256 at 400 kHz: 25 us a byte): read at start-up, not while a limb moves. False:
 * range or hardware error, bytes[] is undefined. */
bool hal_nvm_read(hal_nvm_t *nvm, uint16_t address, uint8_t *bytes, uint16_t size);

/* Starts to write size bytes, 1 to HAL_NVM_PAGE, inside one page; they are copied. False: busy, bad range,
 * or hardware error; nothing is written. */
bool hal_nvm_write(hal_nvm_t *nvm, uint16_t address, const uint8_t *bytes, uint16_t size);

/* How the write that was started last is doing. Polled; never blocks. */
hal_nvm_status_t hal_nvm_status(hal_nvm_t *nvm);

#endif
