/* The 64 KB of the part's own program flash in which the storage stands (PART_FLASH_STORE_AT), as
 * instructions of 24 bits. Addresses are their lower 16 bits and count by two; flash_erase and flash_program
 * stop the processor for as long as they take (part.h). Main loop only. */
#ifndef FLASH_H
#define FLASH_H

#include <stdbool.h>
#include <stdint.h>

/* Erases the page that begins at this address: all bits become 1. False: the part reports an error. */
bool flash_erase(uint16_t at);

/* Programs two erased instructions, the first at a multiple of 4: their lower 16 bits, and the upper 8 bits
 * of both, the first one's in the lower half. */
bool flash_program(uint16_t at, uint16_t first, uint16_t second, uint16_t upper);

/* The lower 16 bits of an instruction, and the upper 8 bits of two as flash_program takes them. */
uint16_t flash_read(uint16_t at);
uint16_t flash_read_upper(uint16_t at);

#endif
