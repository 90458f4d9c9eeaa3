/* dsPIC33FJ64MC802: 64 KB flash (22016 instructions of 24 bits), 16 KB RAM of which the DMA controller
 * reaches the last 2 KB, 40 MIPS (DS70291). */
#ifndef PART_FJ64MC802_H
#define PART_FJ64MC802_H

#include <stdbool.h>

/* Highest instruction rate, and the limits of the PLL: its input, its oscillator. */
#define PART_FCY_MAX 40000000uL
#define PART_PLL_IN_MIN 800000uL
#define PART_PLL_IN_MAX 8000000uL
#define PART_PLL_VCO_MIN 100000000uL
#define PART_PLL_VCO_MAX 200000000uL

/* ECAN is clocked with the instruction rate: CANCKS = 1 here. */
#define PART_CAN_CANCKS 1

/* Frames in the receive ring, a power of two: the 12 KB application leaves no room for more. */
#define PART_CAN_RX_PLACES 32

/* DMA: buffers in DMA RAM, addressed by their offset in it. */
#define PART_DMA_MEMORY(alignment) __attribute__((space(dma), aligned(alignment)))
#define PART_DMA0_START(buffer) (DMA0STA = __builtin_dmaoffset(buffer))
#define PART_DMA1_START(buffer) (DMA1STA = __builtin_dmaoffset(buffer))
#define PART_DMA_PREPARE() (DMACS0 = 0)

/* SCL period = (BRG + 1) / FCY + 100 ns. */
#define PART_I2C_BRG(fcy, scl) ((uint16_t)((fcy) / (scl) - (fcy) / 10000000uL - 1u))

/* There is no switch for all interrupts. */
static inline void part_enable_interrupts(void) {}

/* Program flash: a page of 512 instructions is erased at once (20 ms at least, the processor stands still), a
 * word is programmed alone (45 us). Addresses count by two. */
#define PART_FLASH_PAGE 0x400uL
#define PART_FLASH_ERASE_US 26200u
#define PART_FLASH_PAIR_US 100u
/* The last pages: two areas for storage behind 48 KB of code, and the serial number's page. */
#define PART_FLASH_STORE_AT 0x8000uL
#define PART_FLASH_STORE_PAGES 5u /* of one area */
#define PART_SERIAL_AT 0xA800uL

static inline bool part_flash_run(void)
{
    __builtin_disi(6); /* nothing may come between the two keys and the start */
    __builtin_write_NVM();
    while (NVMCONbits.WR) {
    }
    const bool good = !NVMCONbits.WRERR;
    NVMCON = 0;
    return good;
}

static inline bool part_flash_erase(uint32_t address)
{
    NVMCON = 0x4042;
    TBLPAG = (uint16_t)(address >> 16);
    __builtin_tblwtl((uint16_t)address, 0xFFFF); /* any write tells the page */
    return part_flash_run();
}

static inline bool part_flash_word(uint32_t address, uint32_t word)
{
    NVMCON = 0x4003;
    TBLPAG = (uint16_t)(address >> 16);
    __builtin_tblwtl((uint16_t)address, (uint16_t)word);
    __builtin_tblwth((uint16_t)address, (uint16_t)(word >> 16));
    return part_flash_run();
}

/* Two instructions, the first at a multiple of 4. */
static inline bool part_flash_pair(uint32_t address, uint32_t first, uint32_t second)
{
    return part_flash_word(address, first) && part_flash_word(address + 2, second);
}

#endif
