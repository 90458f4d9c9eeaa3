/* hal_nvm.h in two areas of program flash.
 *
 * An area is a log: each write appends the whole page of HAL_NVM_PAGE bytes as it is to be, and the newest
 * entry of a page counts. When the log is full the newest entries of all pages are copied to the other area,
 * which is erased first and becomes valid with its header, written last; then the write goes on there. So
 * power may fail at any instruction.
 *
 * One entry is a slot of 32 instructions: their lower 16 bits are the 64 bytes, the upper 8 bits of
 *
 *   0, 1     the page's number, LSB first: 0 to 511
 *            or HEADER: the area's header, whose first two bytes are its sequence number
 *   30, 31   CRC-16 (polynomial 1021h, initial FFFFh) over the 64 bytes and the number
 *   others   0
 *
 * It is programmed from the first to the last, so a cut one has a wrong CRC and is passed over.
 *
 * An area holds SLOTS - 1 entries: a memory with that many pages in use is full, and a write to one more
 * fails. */
#include <string.h>

#include "flash.h"
#include "nvm.h"
#include "part.h"

/* In addresses, two for an instruction. */
#define AREA_SIZE (PART_FLASH_STORE_PAGES * PART_FLASH_PAGE)
#define SLOT_SIZE 64uL
#define SLOTS ((uint16_t)(AREA_SIZE / SLOT_SIZE))

enum {
    PAIRS = 16, /* of instructions, in a slot */
    HEADER = 0x7A7A,
    PAGES = HAL_NVM_SIZE / HAL_NVM_PAGE,
    COPIES_MAX = 32, /* slots looked at in one call of hal_nvm_status */
    NOWHERE = 0xFFFF
};

PART_ASSERT(nvm_flash_areas_in_flash,
            PART_FLASH_STORE_AT % PART_FLASH_PAGE == 0 && AREA_SIZE / SLOT_SIZE > 64u);

/* The linker is to keep code and constants out of both areas. An element is one instruction. */
static const uint16_t nvm_flash_first[AREA_SIZE / 2]
    __attribute__((space(prog), address(PART_FLASH_STORE_AT), noload, unused));
static const uint16_t nvm_flash_second[AREA_SIZE / 2]
    __attribute__((space(prog), address(PART_FLASH_STORE_AT + AREA_SIZE), noload, unused));

typedef enum { IDLE, ERASING, COPYING, FAILED } nvm_state_t;

struct hal_nvm {
    uint8_t state;      /* nvm_state_t */
    uint8_t area;       /* 0 or 1 */
    bool valid;         /* that area has a header */
    uint16_t sequence;  /* of that area */
    uint16_t next;      /* first free slot of that area; SLOTS: none is */
    uint8_t erased;     /* while erasing: pages of the other area */
    uint16_t copy_slot; /* while copying: one more than the slot that is looked at next, newest first, */
    uint16_t copy_next; /* and the first free slot of the other area */
    uint16_t page;      /* what is to be written */
    uint8_t bytes[HAL_NVM_PAGE];
};

static struct hal_nvm nvm;

static uint32_t slot_at(uint8_t area, uint16_t slot)
{
    return (uint32_t)(PART_FLASH_STORE_AT + area * AREA_SIZE + slot * SLOT_SIZE);
}

static uint16_t add_to_crc(uint16_t crc, uint8_t byte)
{
    crc = (uint16_t)(crc ^ (uint16_t)byte << 8);
    for (uint8_t i = 0; i < 8; i++) {
        crc = (uint16_t)((crc & 0x8000u) != 0 ? crc << 1 ^ 0x1021 : crc << 1);
    }
    return crc;
}

static uint16_t slot_crc(uint16_t number, const uint8_t *bytes)
{
    uint16_t crc = 0xFFFF;
    for (uint8_t i = 0; i < HAL_NVM_PAGE; i++) {
        crc = add_to_crc(crc, bytes[i]);
    }
    return add_to_crc(add_to_crc(crc, (uint8_t)number), (uint8_t)(number >> 8));
}

static uint32_t instruction(uint8_t place, uint16_t number, uint16_t crc, const uint8_t *bytes)
{
    const uint8_t upper = place == 0    ? (uint8_t)number
                          : place == 1  ? (uint8_t)(number >> 8)
                          : place == 30 ? (uint8_t)crc
                          : place == 31 ? (uint8_t)(crc >> 8)
                                        : 0;
    return (uint32_t)upper << 16 | (uint16_t)bytes[2 * place + 1] << 8 | bytes[2 * place];
}

static bool write_slot(uint32_t at, uint16_t number, const uint8_t *bytes)
{
    const uint16_t crc = slot_crc(number, bytes);
    for (uint8_t pair = 0; pair < PAIRS; pair++) {
        const uint8_t place = (uint8_t)(2 * pair);
        if (!flash_program(at + 4u * pair, instruction(place, number, crc, bytes),
                           instruction((uint8_t)(place + 1), number, crc, bytes))) {
            return false;
        }
    }
    return true;
}

static uint16_t slot_number(uint32_t at)
{
    return (uint16_t)(flash_read(at) >> 16 | flash_read(at + 2) >> 16 << 8);
}

/* False: the CRC is wrong. */
static bool read_slot(uint32_t at, uint16_t number, uint8_t *bytes)
{
    uint32_t word = 0;
    uint16_t crc = 0;
    for (uint8_t place = 0; place < 2 * PAIRS; place++) {
        word = flash_read(at + 2u * place);
        bytes[2 * place] = (uint8_t)word;
        bytes[2 * place + 1] = (uint8_t)(word >> 8);
        crc = (uint16_t)(crc >> 8 | word >> 16 << 8);
    }
    return crc == slot_crc(number, bytes);
}

static bool is_free(uint32_t at)
{
    for (uint8_t place = 0; place < 2 * PAIRS; place++) {
        if (flash_read(at + 2u * place) != FLASH_ERASED) {
            return false;
        }
    }
    return true;
}

/* The newest good entry of a page, in the area that counts. False: there is none, bytes[] is FFh. */
static bool find_page(const hal_nvm_t *self, uint16_t page, uint8_t *bytes)
{
    for (uint16_t slot = self->next; self->valid && slot > 1; slot--) {
        const uint32_t at = slot_at(self->area, (uint16_t)(slot - 1));
        if (slot_number(at) == page && read_slot(at, page, bytes)) {
            return true;
        }
    }
    memset(bytes, 0xFF, HAL_NVM_PAGE);
    return false;
}

static bool read_header(uint8_t area, uint16_t *sequence)
{
    uint8_t bytes[HAL_NVM_PAGE];
    const uint32_t at = slot_at(area, 0);
    if (slot_number(at) != HEADER || !read_slot(at, HEADER, bytes)) {
        return false;
    }
    *sequence = (uint16_t)(bytes[0] | (uint16_t)bytes[1] << 8);
    return true;
}

hal_nvm_t *nvm_open(void)
{
    uint16_t sequences[2] = {0, 0};
    const bool first = read_header(0, &sequences[0]);
    const bool second = read_header(1, &sequences[1]);
    (void)nvm_flash_first;
    (void)nvm_flash_second;
    memset(&nvm, 0, sizeof nvm);
    nvm.valid = first || second;
    nvm.area = second && (!first || (int16_t)(sequences[1] - sequences[0]) > 0) ? 1 : 0;
    nvm.sequence = sequences[nvm.area];
    nvm.next = SLOTS; /* without a header there is no free slot: the first write makes one */
    while (nvm.valid && nvm.next > 1 && is_free(slot_at(nvm.area, (uint16_t)(nvm.next - 1)))) {
        nvm.next--;
    }
    return &nvm;
}

bool hal_nvm_read(hal_nvm_t *self, uint16_t address, uint8_t *bytes, uint16_t size)
{
    uint8_t page[HAL_NVM_PAGE];
    if ((uint32_t)address + size > HAL_NVM_SIZE) {
        return false;
    }
    while (hal_nvm_status(self) == HAL_NVM_BUSY) {
    }
    while (size != 0) {
        const uint8_t offset = (uint8_t)(address % HAL_NVM_PAGE);
        const uint16_t rest = (uint16_t)(HAL_NVM_PAGE - offset);
        const uint16_t part = size < rest ? size : rest;
        (void)find_page(self, (uint16_t)(address / HAL_NVM_PAGE), page);
        memcpy(bytes, &page[offset], part);
        address = (uint16_t)(address + part);
        bytes += part;
        size = (uint16_t)(size - part);
    }
    return true;
}

bool hal_nvm_write(hal_nvm_t *self, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    const uint8_t offset = (uint8_t)(address % HAL_NVM_PAGE);
    const bool in_page = size >= 1 && size <= HAL_NVM_PAGE && offset + size <= (uint16_t)HAL_NVM_PAGE;
    if (!in_page || (uint32_t)address + size > HAL_NVM_SIZE || hal_nvm_status(self) == HAL_NVM_BUSY) {
        return false;
    }
    self->page = (uint16_t)(address / HAL_NVM_PAGE);
    (void)find_page(self, self->page, self->bytes);
    memcpy(&self->bytes[offset], bytes, size);
    if (self->next == SLOTS) {
        self->state = ERASING;
        self->erased = 0;
        return true;
    }
    /* A slot whose programming failed is not used again. */
    const bool good = write_slot(slot_at(self->area, self->next), self->page, self->bytes);
    self->next++;
    self->state = good ? IDLE : FAILED;
    return true;
}

static nvm_state_t erase_next(hal_nvm_t *self)
{
    const uint8_t other = self->area ^ 1u;
    if (!flash_erase((uint32_t)(slot_at(other, 0) + self->erased * PART_FLASH_PAGE))) {
        return FAILED;
    }
    self->erased++;
    self->copy_slot = self->valid ? self->next : 1;
    self->copy_next = 1;
    return self->erased < PART_FLASH_STORE_PAGES ? ERASING : COPYING;
}

/* All that is to be kept stands in the other area: what is to be written follows, then the header makes it
 * count. */
static nvm_state_t switch_area(hal_nvm_t *self)
{
    const uint8_t other = self->area ^ 1u;
    uint8_t header[HAL_NVM_PAGE] = {(uint8_t)(self->sequence + 1u),
                                    (uint8_t)((uint16_t)(self->sequence + 1u) >> 8)};
    if (self->copy_next == SLOTS || !write_slot(slot_at(other, self->copy_next), self->page, self->bytes) ||
        !write_slot(slot_at(other, 0), HEADER, header)) {
        return FAILED;
    }
    self->area = other;
    self->valid = true;
    self->sequence++;
    self->next = (uint16_t)(self->copy_next + 1u);
    return IDLE;
}

/* A newer entry of this page stands in the other area, which was empty before. A table would cost RAM. */
static bool is_copied(const hal_nvm_t *self, uint16_t page)
{
    for (uint16_t slot = 1; slot < self->copy_next; slot++) {
        if (slot_number(slot_at(self->area ^ 1u, slot)) == page) {
            return true;
        }
    }
    return false;
}

/* The page whose newest good entry this slot is; NOWHERE: it is none. */
static uint16_t page_to_copy(const hal_nvm_t *self, uint16_t slot, uint8_t *bytes)
{
    const uint32_t at = slot_at(self->area, slot);
    const uint16_t page = slot_number(at);
    if (page >= PAGES || page == self->page || is_copied(self, page) || !read_slot(at, page, bytes)) {
        return NOWHERE;
    }
    return page;
}

static nvm_state_t copy_some(hal_nvm_t *self)
{
    uint8_t bytes[HAL_NVM_PAGE];
    for (uint8_t copies = 0; self->copy_slot > 1 && copies < COPIES_MAX; copies++) {
        self->copy_slot--;
        const uint16_t page = page_to_copy(self, self->copy_slot, bytes);
        if (page == NOWHERE) {
            continue;
        }
        if (self->copy_next == SLOTS || !write_slot(slot_at(self->area ^ 1u, self->copy_next), page, bytes)) {
            return FAILED;
        }
        self->copy_next++;
    }
    return self->copy_slot > 1 ? COPYING : switch_area(self);
}

/* Does one flash page, or up to COPIES_MAX slots, of what is to be done. */
hal_nvm_status_t hal_nvm_status(hal_nvm_t *self)
{
    if (self->state == ERASING) {
        self->state = (uint8_t)erase_next(self);
    } else if (self->state == COPYING) {
        self->state = (uint8_t)copy_some(self);
    }
    return self->state == IDLE ? HAL_NVM_IDLE : self->state == FAILED ? HAL_NVM_FAILED : HAL_NVM_BUSY;
}
