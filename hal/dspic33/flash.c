#include "flash.h"

#include "part.h"

bool flash_erase(uint16_t at)
{
    return part_flash_erase(at);
}

bool flash_program(uint16_t at, uint16_t first, uint16_t second, uint16_t upper)
{
    return part_flash_pair(at, first, second, upper);
}

uint16_t flash_read(uint16_t at)
{
    TBLPAG = PART_FLASH_STORE_AT >> 16;
    return __builtin_tblrdl(at);
}

uint16_t flash_read_upper(uint16_t at)
{
    TBLPAG = PART_FLASH_STORE_AT >> 16;
    const uint16_t second = __builtin_tblrdh((uint16_t)(at + 2u));
    return (uint16_t)(second << 8 | (__builtin_tblrdh(at) & 0xFFu));
}
