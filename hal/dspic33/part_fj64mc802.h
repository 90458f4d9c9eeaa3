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

/* Instructions of flash that the linker is to leave alone: a constant array of uint16_t, one each. Counted as
 * used, and not programmed. */
#ifndef PART_RESERVED
#define PART_RESERVED(at) __attribute__((space(prog), address(at), noload, used, keep))
#endif

/* Program flash: a page of 512 instructions is erased at once (the processor stands still for up to 26 ms), a
 * word is programmed alone (50 us). Addresses count by two. */
#define PART_FLASH_PAGE 0x400uL
/* The last page holds the serial number, two areas for storage stand right in front of it. */
#define PART_SERIAL_AT 0xA800uL
#ifndef PART_FLASH_STORE_PAGES
#define PART_FLASH_STORE_PAGES 5u /* of one area; firmware: PDCP_STORAGE_PAGES of CMakeLists.txt */
#endif
#define PART_FLASH_STORE_AT (PART_SERIAL_AT - 2u * PART_FLASH_STORE_PAGES * PART_FLASH_PAGE)

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

static inline bool part_flash_erase(uint16_t at)
{
    NVMCON = 0x4042;
    TBLPAG = PART_FLASH_STORE_AT >> 16;
    __builtin_tblwtl(at, 0xFFFF); /* any write tells the page */
    return part_flash_run();
}

static inline bool part_flash_word(uint16_t at, uint16_t low, uint16_t upper)
{
    NVMCON = 0x4003;
    TBLPAG = PART_FLASH_STORE_AT >> 16;
    __builtin_tblwtl(at, low);
    __builtin_tblwth(at, upper);
    return part_flash_run();
}

static inline bool part_flash_pair(uint16_t at, uint16_t first, uint16_t second, uint16_t upper)
{
    return part_flash_word(at, first, upper & 0xFFu) &&
           part_flash_word((uint16_t)(at + 2u), second, upper >> 8);
}

#endif
