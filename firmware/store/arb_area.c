#include "arb_area.h"

#include "pdcp_bytes.h"

arb_area_state_t arb_area_open(const arb_nvm_t *nvm, uint16_t address, uint8_t letter, uint8_t *header,
                               uint16_t size)
{
    if (!arb_nvm_read(nvm, address, header, size) || (header[0] == 0xFF && header[1] == 0xFF)) {
        return ARB_AREA_EMPTY;
    }
    return header[0] == 'P' && header[1] == letter && header[2] == ARB_AREA_VERSION ? ARB_AREA_GOOD
                                                                                    : ARB_AREA_DAMAGED;
}

bool arb_area_offer(arb_area_t *newest, uint8_t area, const uint8_t header[ARB_AREA_HEADER])
{
    const uint16_t sequence = pdcp_bytes_get_u16(&header[4]);
    if (newest->area != (uint8_t)ARB_AREAS && (int16_t)(uint16_t)(sequence - newest->sequence) <= 0) {
        return false;
    }
    newest->area = area;
    newest->sequence = sequence;
    return true;
}

void arb_area_put_header(const arb_area_t *newest, uint8_t letter, uint8_t count,
                         uint8_t header[ARB_AREA_HEADER])
{
    header[0] = 'P';
    header[1] = letter;
    header[2] = ARB_AREA_VERSION;
    header[3] = count;
    pdcp_bytes_put_u16(&header[4], (uint16_t)(newest->sequence + 1));
}
