/* The part's own program flash, as instructions of 24 bits. Addresses count by two; each call stops the
 * processor for as long as it takes (part.h). Main loop only. */
#ifndef FLASH_H
#define FLASH_H

#include <stdbool.h>
#include <stdint.h>

#define FLASH_ERASED 0xFFFFFFuL

/* Erases the page that begins at address. False: the part reports an error. */
bool flash_erase(uint32_t address);

/* Programs two erased instructions, the first at a multiple of 4. */
bool flash_program(uint32_t address, uint32_t first, uint32_t second);

uint32_t flash_read(uint32_t address);

#endif
