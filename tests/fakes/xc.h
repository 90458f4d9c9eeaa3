/* The part's header on the PC: the registers that the drivers use, at their addresses, with the names and bit
 * places of the data sheets' register tables (DS70291, DS70616).
 *
 * Every access goes through fake_register(), which lets the hardware model (fake.h) see what was written
 * before it hands out the next register: flags that only zeros clear, FIFOs behind one address, unlock
 * sequences. */
#ifndef FAKE_XC_H
#define FAKE_XC_H

#include <stdint.h>

/* Attributes of the vendor's compiler, and what stands for them here. */
#define interrupt __used__
#define no_auto_psv __used__
#define persistent section("fake_kept")
#define space(kind) section("fake_" #kind)
#if defined(__dsPIC33FJ64MC802__)
#define PART_RESERVED(at) __attribute__((unused))
#endif

volatile uint16_t *fake_register(uint16_t at);

#define FAKE_WORD(at) (*fake_register(at))
#define FAKE_BITS(type, at) (*(volatile type *)(volatile void *)fake_register(at))

/* Names that the two parts place differently. */
#if defined(__dsPIC33FJ64MC802__)
#define FAKE_AT(fj, ep) (fj)
#else
#define FAKE_AT(fj, ep) (ep)
#endif

/* --- processor --- */

typedef struct {
    uint16_t C : 1, Z : 1, OV : 1, N : 1, RA : 1, IPL : 3, DC : 1, : 7;
} SRBITS;
#define SRbits FAKE_BITS(SRBITS, 0x0042)
#define TBLPAG FAKE_WORD(FAKE_AT(0x0032, 0x0054))

#define SET_AND_SAVE_CPU_IPL(saved, ipl)                                                                     \
    do {                                                                                                     \
        (saved) = SRbits.IPL;                                                                                \
        SRbits.IPL = (ipl)&7u;                                                                               \
    } while (0)
#define RESTORE_CPU_IPL(saved) (SRbits.IPL = (saved)&7u)

void fake_nop(void);
void fake_clear_watchdog(void);
void fake_idle(void);
void fake_reset(void);
#define Nop() fake_nop()
#define ClrWdt() fake_clear_watchdog()
#define Idle() fake_idle()
#define PART_RESET() fake_reset()

void fake_disi(uint16_t cycles);
void fake_write_nvm(void);
void fake_write_oscconh(uint8_t value);
void fake_write_oscconl(uint8_t value);
uint16_t fake_table_read(uint16_t at, int high);
void fake_table_write(uint16_t at, int high, uint16_t value);
#define __builtin_disi(cycles) fake_disi(cycles)
#define __builtin_write_NVM() fake_write_nvm()
#define __builtin_write_OSCCONH(value) fake_write_oscconh(value)
#define __builtin_write_OSCCONL(value) fake_write_oscconl(value)
#define __builtin_tblrdl(at) fake_table_read((at), 0)
#define __builtin_tblrdh(at) fake_table_read((at), 1)
#define __builtin_tblwtl(at, value) fake_table_write((at), 0, (value))
#define __builtin_tblwth(at, value) fake_table_write((at), 1, (value))
#define __builtin_dmaoffset(buffer) ((uint16_t)(uintptr_t)(buffer))

/* --- interrupts --- */

#define INTCON1 FAKE_WORD(FAKE_AT(0x0080, 0x08C0))

typedef struct {
    uint16_t INT0EP : 1, : 13, DISI : 1, GIE : 1;
} INTCON2BITS;
#define INTCON2bits FAKE_BITS(INTCON2BITS, FAKE_AT(0x0082, 0x08C2))

typedef struct {
    uint16_t INT0IF : 1, IC1IF : 1, OC1IF : 1, T1IF : 1, DMA0IF : 1, IC2IF : 1, OC2IF : 1, T2IF : 1, T3IF : 1,
        SPI1EIF : 1, SPI1IF : 1, U1RXIF : 1, U1TXIF : 1, AD1IF : 1, DMA1IF : 1, : 1;
} IFS0BITS;
typedef struct {
    uint16_t SI2C1IF : 1, MI2C1IF : 1, : 14;
} IFS1BITS;
typedef struct {
    uint16_t SPI2EIF : 1, SPI2IF : 1, C1RXIF : 1, C1IF : 1, DMA3IF : 1, : 11;
} IFS2BITS;
typedef struct {
    uint16_t INT0IE : 1, IC1IE : 1, OC1IE : 1, T1IE : 1, DMA0IE : 1, IC2IE : 1, OC2IE : 1, T2IE : 1, T3IE : 1,
        SPI1EIE : 1, SPI1IE : 1, U1RXIE : 1, U1TXIE : 1, AD1IE : 1, DMA1IE : 1, : 1;
} IEC0BITS;
typedef struct {
    uint16_t SI2C1IE : 1, MI2C1IE : 1, : 14;
} IEC1BITS;
typedef struct {
    uint16_t SPI2EIE : 1, SPI2IE : 1, C1RXIE : 1, C1IE : 1, DMA3IE : 1, : 11;
} IEC2BITS;
typedef struct {
    uint16_t INT0IP : 3, : 1, IC1IP : 3, : 1, OC1IP : 3, : 1, T1IP : 3, : 1;
} IPC0BITS;
typedef struct {
    uint16_t T3IP : 3, : 1, SPI1EIP : 3, : 1, SPI1IP : 3, : 1, U1RXIP : 3, : 1;
} IPC2BITS;
typedef struct {
    uint16_t U1TXIP : 3, : 1, AD1IP : 3, : 1, DMA1IP : 3, : 5;
} IPC3BITS;
typedef struct {
    uint16_t SI2C1IP : 3, : 1, MI2C1IP : 3, : 9;
} IPC4BITS;
typedef struct {
    uint16_t SPI2EIP : 3, : 1, SPI2IP : 3, : 1, C1RXIP : 3, : 1, C1IP : 3, : 1;
} IPC8BITS;
#define IFS0bits FAKE_BITS(IFS0BITS, FAKE_AT(0x0084, 0x0800))
#define IFS1bits FAKE_BITS(IFS1BITS, FAKE_AT(0x0086, 0x0802))
#define IFS2bits FAKE_BITS(IFS2BITS, FAKE_AT(0x0088, 0x0804))
#define IEC0bits FAKE_BITS(IEC0BITS, FAKE_AT(0x0094, 0x0820))
#define IEC1bits FAKE_BITS(IEC1BITS, FAKE_AT(0x0096, 0x0822))
#define IEC2bits FAKE_BITS(IEC2BITS, FAKE_AT(0x0098, 0x0824))
#define IPC0bits FAKE_BITS(IPC0BITS, FAKE_AT(0x00A4, 0x0840))
#define IPC2bits FAKE_BITS(IPC2BITS, FAKE_AT(0x00A8, 0x0844))
#define IPC3bits FAKE_BITS(IPC3BITS, FAKE_AT(0x00AA, 0x0846))
#define IPC4bits FAKE_BITS(IPC4BITS, FAKE_AT(0x00AC, 0x0848))
#define IPC8bits FAKE_BITS(IPC8BITS, FAKE_AT(0x00B4, 0x0850))

/* --- clock, reset, timer 1 --- */

typedef struct {
    uint16_t OSWEN : 1, LPOSCEN : 1, : 1, CF : 1, : 1, LOCK : 1, IOLOCK : 1, CLKLOCK : 1, NOSC : 3, : 1,
        COSC : 3, : 1;
} OSCCONBITS;
#define RCON FAKE_WORD(0x0740)
#define OSCCON FAKE_WORD(0x0742)
#define OSCCONbits FAKE_BITS(OSCCONBITS, 0x0742)
#define CLKDIV FAKE_WORD(0x0744)
#define PLLFBD FAKE_WORD(0x0746)
#define TMR1 FAKE_WORD(0x0100)
#define PR1 FAKE_WORD(0x0102)
#define T1CON FAKE_WORD(0x0104)

/* --- ECAN 1 --- */

typedef struct {
    uint16_t WIN : 1, : 2, CANCAP : 1, : 1, OPMODE : 3, REQOP : 3, CANCKS : 1, ABAT : 1, CSIDL : 1, : 2;
} C1CTRL1BITS;
typedef struct {
    uint16_t FNRB : 6, : 2, FBP : 6, : 2;
} C1FIFOBITS;
#define C1CTRL1 FAKE_WORD(0x0400)
#define C1CTRL1bits FAKE_BITS(C1CTRL1BITS, 0x0400)
#define C1FCTRL FAKE_WORD(0x0406)
#define C1FIFObits FAKE_BITS(C1FIFOBITS, 0x0408)
#define C1INTF FAKE_WORD(0x040A)
#define C1INTE FAKE_WORD(0x040C)
#define C1EC FAKE_WORD(0x040E)
#define C1CFG1 FAKE_WORD(0x0410)
#define C1CFG2 FAKE_WORD(0x0412)
#define C1FEN1 FAKE_WORD(0x0414)
#define C1FMSKSEL1 FAKE_WORD(0x0418)
/* C1CTRL1 WIN = 0 */
#define C1RXFUL1 FAKE_WORD(0x0420)
#define C1RXFUL2 FAKE_WORD(0x0422)
#define C1RXOVF1 FAKE_WORD(0x0428)
#define C1RXOVF2 FAKE_WORD(0x042A)
#define C1TR01CON FAKE_WORD(0x0430)
#define C1TR23CON FAKE_WORD(0x0432)
#define C1TR45CON FAKE_WORD(0x0434)
#define C1TR67CON FAKE_WORD(0x0436)
#define C1RXD FAKE_WORD(0x0440)
#define C1TXD FAKE_WORD(0x0442)
/* C1CTRL1 WIN = 1, at the same addresses: kept 1000h higher */
#define C1BUFPNT1 FAKE_WORD(0x1420)
#define C1RXM0SID FAKE_WORD(0x1430)
#define C1RXM0EID FAKE_WORD(0x1432)
#define C1RXF0SID FAKE_WORD(0x1440)
#define C1RXF0EID FAKE_WORD(0x1442)

/* --- DMA --- */

typedef struct {
    uint16_t MODE : 2, : 2, AMODE : 2, : 5, NULLW : 1, HALF : 1, DIR : 1, SIZE : 1, CHEN : 1;
} DMA0CONBITS;
typedef DMA0CONBITS DMA1CONBITS;
#define DMA0CON FAKE_WORD(FAKE_AT(0x0380, 0x0B00))
#define DMA0CONbits FAKE_BITS(DMA0CONBITS, FAKE_AT(0x0380, 0x0B00))
#define DMA0REQ FAKE_WORD(FAKE_AT(0x0382, 0x0B02))
#define DMA0PAD FAKE_WORD(FAKE_AT(0x0388, 0x0B0C))
#define DMA0CNT FAKE_WORD(FAKE_AT(0x038A, 0x0B0E))
#define DMA1CON FAKE_WORD(FAKE_AT(0x038C, 0x0B10))
#define DMA1CONbits FAKE_BITS(DMA1CONBITS, FAKE_AT(0x038C, 0x0B10))
#define DMA1REQ FAKE_WORD(FAKE_AT(0x038E, 0x0B12))
#define DMA1PAD FAKE_WORD(FAKE_AT(0x0394, 0x0B1C))
#define DMA1CNT FAKE_WORD(FAKE_AT(0x0396, 0x0B1E))
#if defined(__dsPIC33FJ64MC802__)
#define DMA0STA FAKE_WORD(0x0384)
#define DMA1STA FAKE_WORD(0x0390)
#define DMACS0 FAKE_WORD(0x03E0)
#else
#define DMA0STAL FAKE_WORD(0x0B04)
#define DMA0STAH FAKE_WORD(0x0B06)
#define DMA1STAL FAKE_WORD(0x0B14)
#define DMA1STAH FAKE_WORD(0x0B16)
#define MSTRPR FAKE_WORD(0x0058)
#define DMAPWC FAKE_WORD(0x0BF0)
#define DMARQC FAKE_WORD(0x0BF2)
#endif

/* --- UART 1, I2C 1, ADC 1 --- */

typedef struct {
    uint16_t URXDA : 1, OERR : 1, FERR : 1, PERR : 1, RIDLE : 1, ADDEN : 1, URXISEL : 2, TRMT : 1, UTXBF : 1,
        UTXEN : 1, UTXBRK : 1, : 1, UTXISEL0 : 1, UTXINV : 1, UTXISEL1 : 1;
} U1STABITS;
#define U1MODE FAKE_WORD(0x0220)
#define U1STA FAKE_WORD(0x0222)
#define U1STAbits FAKE_BITS(U1STABITS, 0x0222)
#define U1TXREG FAKE_WORD(0x0224)
#define U1RXREG FAKE_WORD(0x0226)
#define U1BRG FAKE_WORD(0x0228)

typedef struct {
    uint16_t SEN : 1, RSEN : 1, PEN : 1, RCEN : 1, ACKEN : 1, ACKDT : 1, STREN : 1, GCEN : 1, SMEN : 1,
        DISSLW : 1, A10M : 1, IPMIEN : 1, SCLREL : 1, I2CSIDL : 1, : 1, I2CEN : 1;
} I2C1CONBITS;
typedef struct {
    uint16_t TBF : 1, RBF : 1, R_W : 1, S : 1, P : 1, D_A : 1, I2COV : 1, IWCOL : 1, ADD10 : 1, GCSTAT : 1,
        BCL : 1, : 3, TRSTAT : 1, ACKSTAT : 1;
} I2C1STATBITS;
#define I2C1RCV FAKE_WORD(0x0200)
#define I2C1TRN FAKE_WORD(0x0202)
#define I2C1BRG FAKE_WORD(0x0204)
#define I2C1CON FAKE_WORD(0x0206)
#define I2C1CONbits FAKE_BITS(I2C1CONBITS, 0x0206)
#define I2C1STAT FAKE_WORD(0x0208)
#define I2C1STATbits FAKE_BITS(I2C1STATBITS, 0x0208)

typedef struct {
    uint16_t DONE : 1, SAMP : 1, ASAM : 1, SIMSAM : 1, : 1, SSRC : 3, FORM : 2, AD12B : 1, : 1, ADDMABM : 1,
        ADSIDL : 1, : 1, ADON : 1;
} AD1CON1BITS;
#define ADC1BUF0 FAKE_WORD(0x0300)
#define AD1CON1 FAKE_WORD(0x0320)
#define AD1CON1bits FAKE_BITS(AD1CON1BITS, 0x0320)
#define AD1CON2 FAKE_WORD(0x0322)
#define AD1CON3 FAKE_WORD(0x0324)
#define AD1CHS0 FAKE_WORD(0x0328)

/* --- program flash --- */

typedef struct {
    uint16_t NVMOP : 4, : 2, ERASE : 1, : 6, WRERR : 1, WREN : 1, WR : 1;
} NVMCONBITS;
#define NVMCON FAKE_WORD(FAKE_AT(0x0760, 0x0728))
#define NVMCONbits FAKE_BITS(NVMCONBITS, FAKE_AT(0x0760, 0x0728))
#define NVMADR FAKE_WORD(0x072A)
#define NVMADRU FAKE_WORD(0x072C)

/* --- pins --- */

/* One bit for each pin of a port: NAME0 to NAME15. */
#define FAKE_PORT(NAME)                                                                                      \
    typedef struct {                                                                                         \
        uint16_t NAME##0 : 1, NAME##1 : 1, NAME##2 : 1, NAME##3 : 1, NAME##4 : 1, NAME##5 : 1, NAME##6 : 1,  \
            NAME##7 : 1, NAME##8 : 1, NAME##9 : 1, NAME##10 : 1, NAME##11 : 1, NAME##12 : 1, NAME##13 : 1,   \
            NAME##14 : 1, NAME##15 : 1;                                                                      \
    } NAME##BITS

FAKE_PORT(TRISA);
FAKE_PORT(LATA);
FAKE_PORT(TRISB);
FAKE_PORT(LATB);
FAKE_PORT(RB);
FAKE_PORT(TRISD);
FAKE_PORT(LATD);
FAKE_PORT(RD);
FAKE_PORT(TRISF);
FAKE_PORT(LATF);
#define TRISAbits FAKE_BITS(TRISABITS, FAKE_AT(0x02C0, 0x0E00))
#define LATAbits FAKE_BITS(LATABITS, FAKE_AT(0x02C4, 0x0E04))
#define TRISBbits FAKE_BITS(TRISBBITS, FAKE_AT(0x02C8, 0x0E10))
#define PORTBbits FAKE_BITS(RBBITS, FAKE_AT(0x02CA, 0x0E12))
#define LATBbits FAKE_BITS(LATBBITS, FAKE_AT(0x02CC, 0x0E14))

typedef struct {
    uint16_t U1RXR : 7, : 1, U1CTSR : 7, : 1;
} RPINR18BITS;
typedef struct {
    uint16_t C1RXR : 7, : 1, C2RXR : 7, : 1;
} RPINR26BITS;
#define RPINR18bits FAKE_BITS(RPINR18BITS, FAKE_AT(0x06A4, 0x06C4))
#define RPINR26bits FAKE_BITS(RPINR26BITS, FAKE_AT(0x06B4, 0x06D4))

#if defined(__dsPIC33FJ64MC802__)
typedef struct {
    uint16_t RP10R : 5, : 3, RP11R : 5, : 3;
} RPOR5BITS;
typedef struct {
    uint16_t RP14R : 5, : 3, RP15R : 5, : 3;
} RPOR7BITS;
typedef struct {
    uint16_t CN16PUE : 1, : 4, CN21PUE : 1, CN22PUE : 1, CN23PUE : 1, : 8;
} CNPU2BITS;
#define RPOR5bits FAKE_BITS(RPOR5BITS, 0x06CA)
#define RPOR7bits FAKE_BITS(RPOR7BITS, 0x06CE)
#define CNPU2bits FAKE_BITS(CNPU2BITS, 0x006A)
#define AD1PCFGL FAKE_WORD(0x032C)
#else
typedef struct {
    uint16_t RP96R : 6, : 2, RP97R : 6, : 2;
} RPOR7BITS;
typedef struct {
    uint16_t RP100R : 6, : 2, RP101R : 6, : 2;
} RPOR9BITS;
#define RPOR7bits FAKE_BITS(RPOR7BITS, 0x068E)
#define RPOR9bits FAKE_BITS(RPOR9BITS, 0x0692)
#define ANSELA FAKE_WORD(0x0E0E)
#define ANSELB FAKE_WORD(0x0E1E)
#define ANSELD FAKE_WORD(0x0E3E)
#define TRISDbits FAKE_BITS(TRISDBITS, 0x0E30)
#define PORTDbits FAKE_BITS(RDBITS, 0x0E32)
#define LATDbits FAKE_BITS(LATDBITS, 0x0E34)
#define TRISFbits FAKE_BITS(TRISFBITS, 0x0E50)
#define LATFbits FAKE_BITS(LATFBITS, 0x0E54)
#endif

#endif
