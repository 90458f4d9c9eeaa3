#include "flash.h"

#include "part.h"

bool flash_erase(uint32_t address)
{
    return part_flash_erase(address);
}

bool flash_program(uint32_t address, uint32_t first, uint32_t second)
{
    return part_flash_pair(address, first, second);
}

uint32_t flash_read(uint32_t address)
{
    TBLPAG = (uint16_t)(address >> 16);
    const uint16_t low = __builtin_tblrdl((uint16_t)address);
    return (uint32_t)(__builtin_tblrdh((uint16_t)address) & 0xFFu) << 16 | low;
}
