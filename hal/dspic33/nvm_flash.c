/* hal_nvm.h in two areas of program flash.
 *
 * An area is a log: each write appends the whole page of HAL_NVM_PAGE bytes as it is to be, and the newest
 * entry of a page counts. When the log is full the newest entries of all pages are copied to the other area,
 * which is erased first and becomes valid with its header, written last; then the write goes on there. So
 * power may fail at any instruction. A page that already is as it is to be is not written.
 *
 * One entry is a slot of 32 instructions: their lower 16 bits are the 64 bytes, the upper 8 bits of
 *
 *   0, 1     the page's number, LSB first: 0 to 511
 *            or HEADER: the area's header, whose first two bytes are its sequence number, from 1
 *   30, 31   CRC-16 over the 64 bytes as words (polynomial 1021h, initial value the number inverted)
 *   others   0
 *
 * It is programmed from the first to the last, so a cut one has a wrong CRC and is passed over. The area with
 * the greater sequence number counts, the first one when neither has a header: so it is in erased flash. The
 * flash is worn out long before the number wraps.
 *
 * An area holds SLOTS - 1 entries, so that many pages can be in use: a write to one more fails, a write to
 * one of them still works, with a move each time. A page once written is never given up: who uses the memory
 * has to keep to NVM_FLASH_PAGES different ones. Whoever joins it to the memory (firmware/dspic33) makes sure
 * of that. */
#include <string.h>

#include "flash.h"
#include "nvm.h"
#include "part.h"

/* In addresses, two for an instruction. */
#define AREA_SIZE (PART_FLASH_STORE_PAGES * PART_FLASH_PAGE)
#define SLOT_SIZE NVM_FLASH_SLOT
#define SLOTS ((uint16_t)(AREA_SIZE / SLOT_SIZE))

enum {
    WORDS = HAL_NVM_PAGE / 2,
    HEADER = 0x7A7A,
    PAGES = HAL_NVM_SIZE / HAL_NVM_PAGE,
    COPIES_MAX = 32 /* slots looked at in one call of hal_nvm_status */
};

PART_ASSERT(nvm_flash_areas_are_pages, PART_FLASH_STORE_AT % PART_FLASH_PAGE == 0);
PART_ASSERT(nvm_flash_areas_in_front_of_the_serial_number,
            PART_FLASH_STORE_AT + 2u * AREA_SIZE <= PART_SERIAL_AT);
PART_ASSERT(nvm_flash_areas_reached_with_16_bits,
            PART_FLASH_STORE_AT >> 16 == (PART_FLASH_STORE_AT + 2u * AREA_SIZE - 1u) >> 16);

/* The linker is to keep code and constants out of both areas. An element is one instruction. */
static const uint16_t nvm_flash_first[AREA_SIZE / 2] PART_RESERVED(PART_FLASH_STORE_AT);
static const uint16_t nvm_flash_second[AREA_SIZE / 2] PART_RESERVED(PART_FLASH_STORE_AT + AREA_SIZE);

/* Slots are counted through both areas: the second one begins with SLOTS. */
struct hal_nvm {
    hal_nvm_status_t status;
    uint16_t area;     /* first slot of the area that counts: 0 or SLOTS */
    uint16_t sequence; /* of that area */
    uint16_t next;     /* first free slot of that area; area + SLOTS: none is */
    bool erasing;      /* while busy: the other area is being erased, else copied to */
    uint16_t from;     /* copied so far: down to this slot, newest first, */
    uint16_t to;       /* up to the first free slot of the other area; or erased so far */
    uint16_t page;     /* what is to be written */
    uint16_t words[WORDS];
};

static struct hal_nvm nvm;

static uint16_t slot_at(uint16_t slot)
{
    return (uint16_t)(PART_FLASH_STORE_AT + slot * SLOT_SIZE);
}

static uint16_t slot_crc(uint16_t number, const uint16_t words[WORDS])
{
    uint16_t crc = (uint16_t)~number;
    for (uint8_t i = 0; i < WORDS; i++) {
        crc ^= words[i];
        for (uint8_t bit = 0; bit < 16; bit++) {
            crc = (uint16_t)((crc & 0x8000u) != 0 ? crc << 1 ^ 0x1021 : crc << 1);
        }
    }
    return crc;
}

static bool write_slot(uint16_t slot, uint16_t number, const uint16_t words[WORDS])
{
    const uint16_t crc = slot_crc(number, words);
    uint16_t at = slot_at(slot);
    for (uint8_t i = 0; i < WORDS; i += 2) {
        const uint16_t upper = i == 0 ? number : i == WORDS - 2 ? crc : 0;
        if (!flash_program(at, words[i], words[i + 1], upper)) {
            return false;
        }
        at += 4;
    }
    return true;
}

/* False: it is no entry of that number, words[] is undefined. */
static bool read_slot(uint16_t slot, uint16_t number, uint16_t words[WORDS])
{
    uint16_t at = slot_at(slot);
    if (flash_read_upper(at) != number) {
        return false;
    }
    for (uint8_t i = 0; i < WORDS; i++) {
        words[i] = flash_read(at);
        at += 2;
    }
    return flash_read_upper((uint16_t)(at - 4u)) == slot_crc(number, words);
}

static bool is_free(uint16_t slot)
{
    uint16_t bits = 0xFFFF;
    for (uint16_t at = slot_at(slot); at != slot_at((uint16_t)(slot + 1u)); at += 4) {
        bits &= flash_read(at) & flash_read((uint16_t)(at + 2u)) & flash_read_upper(at);
    }
    return bits == 0xFFFF;
}

/* The newest good entry of a page among the slots from area to next - 1. False: there is none, words[] is
 * FFFFh. */
static bool find_page(uint16_t area, uint16_t next, uint16_t page, uint16_t words[WORDS])
{
    while (next != area) {
        next--;
        if (read_slot(next, page, words)) {
            return true;
        }
    }
    memset(words, 0xFF, HAL_NVM_PAGE);
    return false;
}

/* 0: the area has no header. */
static uint16_t read_sequence(uint16_t area)
{
    uint16_t words[WORDS];
    return read_slot(area, HEADER, words) ? words[0] : 0;
}

hal_nvm_t *nvm_open(void)
{
    const uint16_t first = read_sequence(0);
    const uint16_t second = read_sequence(SLOTS);
    nvm.status = HAL_NVM_IDLE;
    nvm.area = second > first ? SLOTS : 0;
    nvm.sequence = second > first ? second : first;
    nvm.next = (uint16_t)(nvm.area + SLOTS);
    while (nvm.next != nvm.area + 1u && is_free((uint16_t)(nvm.next - 1u))) {
        nvm.next--;
    }
    return &nvm;
}

bool hal_nvm_read(hal_nvm_t *self, uint16_t address, uint8_t *bytes, uint16_t size)
{
    uint16_t words[WORDS];
    if (address > HAL_NVM_SIZE || size > HAL_NVM_SIZE - address) {
        return false;
    }
    while (hal_nvm_status(self) == HAL_NVM_BUSY) {
    }
    while (size != 0) {
        const uint16_t offset = address % HAL_NVM_PAGE;
        const uint16_t rest = HAL_NVM_PAGE - offset;
        const uint16_t part = size < rest ? size : rest;
        (void)find_page(self->area, self->next, address / HAL_NVM_PAGE, words);
        memcpy(bytes, (const uint8_t *)words + offset, part);
        address += part;
        bytes += part;
        size -= part;
    }
    return true;
}

bool hal_nvm_write(hal_nvm_t *self, uint16_t address, const uint8_t *bytes, uint16_t size)
{
    const uint16_t offset = address % HAL_NVM_PAGE;
    /* a size of 0 becomes more than any */
    if ((uint16_t)(size - 1u) >= HAL_NVM_PAGE - offset || address >= HAL_NVM_SIZE ||
        hal_nvm_status(self) == HAL_NVM_BUSY) {
        return false;
    }
    uint8_t *place = (uint8_t *)self->words + offset;
    self->page = address / HAL_NVM_PAGE;
    (void)find_page(self->area, self->next, self->page, self->words);
    self->status = HAL_NVM_IDLE;
    if (memcmp(place, bytes, size) == 0) {
        return true;
    }
    memcpy(place, bytes, size);
    if (self->next == self->area + SLOTS) {
        self->status = HAL_NVM_BUSY;
        self->erasing = true;
        self->to = SLOTS - self->area;
    } else if (!write_slot(self->next++, self->page, self->words)) {
        self->status = HAL_NVM_FAILED; /* the slot is not used again */
    }
    return true;
}

static hal_nvm_status_t erase_next(hal_nvm_t *self)
{
    const uint16_t other = SLOTS - self->area;
    if (!flash_erase(slot_at(self->to))) {
        return HAL_NVM_FAILED;
    }
    self->to += PART_FLASH_PAGE / SLOT_SIZE;
    if (self->to == other + SLOTS) {
        self->erasing = false;
        self->from = self->next;
        self->to = (uint16_t)(other + 1u);
    }
    return HAL_NVM_BUSY;
}

/* An entry for the other area. False: that is full, or the part reports an error. */
static bool append(hal_nvm_t *self, uint16_t page, const uint16_t words[WORDS])
{
    return self->to != SLOTS - self->area + SLOTS && write_slot(self->to++, page, words);
}

/* All that is to be kept stands in the other area: what is to be written follows, then the header makes it
 * count. */
static hal_nvm_status_t switch_area(hal_nvm_t *self)
{
    const uint16_t header[WORDS] = {(uint16_t)(self->sequence + 1u)};
    const uint16_t other = SLOTS - self->area;
    if (!append(self, self->page, self->words) || !write_slot(other, HEADER, header)) {
        return HAL_NVM_FAILED;
    }
    self->area = other;
    self->next = self->to;
    self->sequence++;
    return HAL_NVM_IDLE;
}

/* Copies an entry if it is the newest good one of its page: no other stands in the other area yet, which a
 * table would tell faster and cost RAM. */
static hal_nvm_status_t copy_some(hal_nvm_t *self)
{
    uint16_t words[WORDS];
    for (uint8_t copies = 0; self->from != self->area; copies++) {
        if (copies == COPIES_MAX) {
            return HAL_NVM_BUSY;
        }
        self->from--;
        const uint16_t page = flash_read_upper(slot_at(self->from));
        if (page < PAGES && page != self->page &&
            !find_page((uint16_t)(SLOTS - self->area), self->to, page, words) &&
            read_slot(self->from, page, words) && !append(self, page, words)) {
            return HAL_NVM_FAILED;
        }
    }
    return switch_area(self);
}

/* Does one flash page, or up to COPIES_MAX slots, of what is to be done. */
hal_nvm_status_t hal_nvm_status(hal_nvm_t *self)
{
    if (self->status == HAL_NVM_BUSY) {
        self->status = self->erasing ? erase_next(self) : copy_some(self);
    }
    return self->status;
}
