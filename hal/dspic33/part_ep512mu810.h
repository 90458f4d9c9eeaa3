/* dsPIC33EP512MU810: 512 KB flash (175104 instructions of 24 bits), 52 KB RAM, 60 MIPS up to 125 degrees
 * (DS70616). */
#ifndef PART_EP512MU810_H
#define PART_EP512MU810_H

#include <stdbool.h>

#define PART_FCY_MAX 60000000uL
#define PART_PLL_IN_MIN 800000uL
#define PART_PLL_IN_MAX 8000000uL
#define PART_PLL_VCO_MIN 120000000uL
#define PART_PLL_VCO_MAX 340000000uL

/* ECAN is clocked with the instruction rate: CANCKS = 0 here, the other way round than in the smaller
 * part. */
#define PART_CAN_CANCKS 0

/* Frames in the receive ring, a power of two, 128 at most. */
#define PART_CAN_RX_PLACES 128

/* DMA reaches all of RAM. In the dual-ported RAM at D000h it would never wait for the processor, but that
 * sees it through a page register only: buffers stand below 8000h, and the bus arbiter (MSTRPR) lets DMA go
 * before the processor. The other way round, as after reset, a word of a received frame may be lost
 * (erratum). */
#define PART_DMA_MEMORY(alignment) __attribute__((space(xmemory), aligned(alignment)))
#define PART_DMA0_START(buffer) (DMA0STAL = (uint16_t)(uintptr_t)(buffer), DMA0STAH = 0)
#define PART_DMA1_START(buffer) (DMA1STAL = (uint16_t)(uintptr_t)(buffer), DMA1STAH = 0)
#define PART_DMA_PREPARE() (DMAPWC = 0, DMARQC = 0, MSTRPR = 0x0020)

/* SCL period = (BRG + 2) / FCY + 120 ns; where the module counts half periods, as later manuals of the family
 * have it, the bus runs at half the rate, which all devices on it bear. */
#define PART_I2C_BRG(fcy, scl) ((uint16_t)((fcy) / (scl) - (fcy) / 8333333uL - 2u))

/* The switch for all interrupts, off after a reset. */
static inline void part_enable_interrupts(void)
{
    INTCON2bits.GIE = 1;
}

/* Nothing is kept from the linker: it would spread the program around it, out of the reach of its calls. The
 * program begins at 200h, and its budget ends far below. */
#define PART_RESERVED(at) __attribute__((unused))

/* Program flash: a page of 1024 instructions is erased at once (the processor stands still for up to 23 ms),
 * two instructions are programmed together (52 us). Addresses count by two. */
#define PART_FLASH_PAGE 0x800uL
#define PART_FLASH_STORE_AT 0x40000uL
#ifndef PART_FLASH_STORE_PAGES
#define PART_FLASH_STORE_PAGES 15u /* of one area */
#endif
#define PART_SERIAL_AT 0x54800uL

/* Erratum: while the processor stands still for a flash operation no interrupt may be enabled. */
static inline bool part_flash_run(void)
{
    const uint16_t enabled = INTCON2bits.GIE;
    INTCON2bits.GIE = 0;
    __builtin_disi(6);
    __builtin_write_NVM();
    while (NVMCONbits.WR) {
    }
    const bool good = !NVMCONbits.WRERR;
    NVMCON = 0;
    INTCON2bits.GIE = enabled & 1u;
    return good;
}

static inline bool part_flash_start(uint16_t at, uint16_t operation)
{
    NVMADRU = PART_FLASH_STORE_AT >> 16;
    NVMADR = at;
    NVMCON = operation;
    return part_flash_run();
}

static inline bool part_flash_erase(uint16_t at)
{
    return part_flash_start(at, 0x4003);
}

static inline bool part_flash_pair(uint16_t at, uint16_t first, uint16_t second, uint16_t upper)
{
    TBLPAG = 0xFA; /* the write latches */
    __builtin_tblwtl(0, first);
    __builtin_tblwth(0, upper & 0xFFu);
    __builtin_tblwtl(2, second);
    __builtin_tblwth(2, upper >> 8);
    return part_flash_start(at, 0x4001);
}

#endif
