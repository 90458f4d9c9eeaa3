#include "pdcp_standby.h"

#include <string.h>

#include "pdcp_codec.h"
#include "pdcp_spec.h"

static bool is_recent(uint32_t now_ms, uint32_t then_ms)
{
    return now_ms - then_ms < PDCP_FOREIGN_MS;
}

bool pdcp_standby_is_heard(const pdcp_standby_t *standby, uint32_t now_ms)
{
    return standby->beacons != 0 && is_recent(now_ms, standby->beacon_ms[0]);
}

void pdcp_standby_on_time(pdcp_standby_t *standby, uint32_t now_ms)
{
    if (!pdcp_standby_is_heard(standby, now_ms)) {
        standby->beacons = 0;
        standby->doubted = false;
    }
    if (!is_recent(now_ms, standby->answered_ms)) {
        standby->answered = false;
    }
}

bool pdcp_standby_on_beacon(pdcp_standby_t *standby, uint32_t now_ms)
{
    pdcp_standby_on_time(standby, now_ms);
    const bool is_first = standby->beacons == 0;
    if (is_first) {
        standby->since_ms = now_ms;
    }
    memmove(&standby->beacon_ms[1], &standby->beacon_ms[0],
            sizeof standby->beacon_ms - sizeof standby->beacon_ms[0]);
    standby->beacon_ms[0] = now_ms;
    if (standby->beacons < PDCP_STANDBY_BEACONS) {
        standby->beacons++;
    }
    return is_first;
}

void pdcp_standby_on_request(pdcp_standby_t *standby, const can_frame_t *frame)
{
    pdcp_msg_t msg;
    if (pdcp_codec_decode(frame, &msg) != PDCP_DECODE_OK || (msg.code & PDCP_ANSWER) != 0) {
        return;
    }
    standby->asked_id = pdcp_id_node(frame->id);
    standby->asked_code = msg.code;
    standby->asked_identity =
        msg.code == PDCP_GET_PARAMETER && msg.channel == 0 && msg.param <= PDCP_DEV_SERIAL;
}

bool pdcp_standby_on_answer(pdcp_standby_t *standby, uint32_t now_ms, const can_frame_t *frame)
{
    if (!pdcp_codec_has_code(frame, standby->asked_code | (unsigned)PDCP_ANSWER)) {
        return false;
    }
    standby->asked_id = 0;
    if (!standby->asked_identity) {
        standby->answered = true;
        standby->answered_ms = now_ms;
        standby->doubted = false;
    }
    return true;
}

bool pdcp_standby_is_answered(const pdcp_standby_t *standby, uint32_t now_ms)
{
    return pdcp_standby_is_heard(standby, now_ms) && standby->answered &&
           is_recent(now_ms, standby->answered_ms);
}

bool pdcp_standby_serves(const pdcp_standby_t *standby, uint32_t now_ms)
{
    return pdcp_standby_is_answered(standby, now_ms) ||
           (standby->beacons == PDCP_STANDBY_BEACONS && !standby->doubted &&
            is_recent(now_ms, standby->beacon_ms[PDCP_STANDBY_BEACONS - 1]));
}

void pdcp_standby_on_sign_of_life(pdcp_standby_t *standby)
{
    standby->unbound = 0;
}

bool pdcp_standby_on_unbound(pdcp_standby_t *standby, uint32_t now_ms, uint32_t asked_ms)
{
    if (standby->unbound == 0) {
        standby->unbound_ms = asked_ms;
    }
    if (standby->unbound < PDCP_UNBOUND_MAX) {
        standby->unbound++;
    }
    if (standby->unbound < PDCP_UNBOUND_MAX || asked_ms - standby->unbound_ms < PDCP_UNBOUND_MS) {
        return false;
    }
    standby->unbound = 0;
    standby->doubted = pdcp_standby_is_heard(standby, now_ms);
    return true;
}
