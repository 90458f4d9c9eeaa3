#include "arb_limb.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_assert.h"
#include "pdcp_time.h"
#include "profile_active.h"
#include "profile_channel.h"
#include "profile_events.h"
#include "profile_start.h"
#include "profile_step.h"

#define SCORE_BOTH 256u /* of a link that is there with both ends; with one end: 1 */

/* What is under way. A job of arb_config that ends leads from one stage to the next:
 *
 *   start-up   IDLE --> SCORE --> START --> IDLE
 *   load       IDLE --> CHECK --> LOAD --> PLAN --> IDLE
 *   others     IDLE --> SAVE, ERASE or PLAN --> IDLE
 *
 * A stage that fails leads to IDLE. */
typedef enum {
    STAGE_IDLE,
    STAGE_SCORE, /* start-up: all stored configurations are read, the best one wins */
    STAGE_START, /* start-up: the best one is read */
    STAGE_CHECK, /* load: the stored configurations are read once, so that what follows will do */
    STAGE_LOAD,  /* load: it is read */
    STAGE_SAVE,
    STAGE_ERASE,
    STAGE_PLAN /* a plan for the host is carried out */
} stage_t;

static void on_link(void *ctx, uint8_t number, const profile_link_t *link);
static void get_link(void *ctx, uint8_t k, profile_link_t *link);

static const arb_config_user_t user = {.link = get_link, .on_link = on_link};

static void apply_flags(arb_limb_t *limb, uint8_t flags)
{
    limb->in_force = flags & ARB_FLAGS_STORED;
    limb->run.at_start = PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_REPLACE;
    if ((flags & ARB_FLAG_AUTOCONFIGURE) != 0) {
        limb->run.at_start = PROFILE_PLAN_ALL;
    }
    limb->run.at_events = (flags & ARB_FLAG_HOT_SWAP) != 0 ? limb->run.at_start : PROFILE_PLAN_ORIGINALS;
}

void arb_limb_init(arb_limb_t *limb, const pdcp_tables_t *tables, arb_nvm_t *nvm, uint8_t flags_on,
                   uint8_t flags_off, uint32_t now_ms)
{
    memset(limb, 0, sizeof *limb);
    limb->told = true;
    profile_run_init(&limb->run, tables, now_ms);
    arb_flags_load(&limb->flags, nvm);
    arb_config_init(&limb->config, nvm, &user, limb, now_ms);
    apply_flags(limb, (uint8_t)((arb_flags_get(&limb->flags) | flags_on) & ~flags_off));
}

void arb_limb_set_flags(arb_limb_t *limb, uint32_t now_ms, uint8_t flags)
{
    arb_flags_set(&limb->flags, flags, now_ms);
    apply_flags(limb, flags);
}

bool arb_limb_is_busy(const arb_limb_t *limb)
{
    return limb->stage != STAGE_IDLE || profile_run_is_busy(&limb->run);
}

bool arb_limb_take_outcome(arb_limb_t *limb, uint8_t *error, uint16_t *result)
{
    if (!limb->ended) {
        return false;
    }
    limb->ended = false;
    *error = limb->error;
    *result = limb->result;
    return true;
}

bool arb_limb_take_change(arb_limb_t *limb)
{
    const bool changed = !limb->told;
    limb->told = true;
    return changed;
}

static void set_active(arb_limb_t *limb, uint8_t number)
{
    limb->active = number;
    limb->told = false;
}

/* The active configuration is not stored any more: what the devices name counts again. */
static void forget_active(arb_limb_t *limb, pdcp_arb_t *arb)
{
    set_active(limb, 0);
    pdcp_arb_plan_links(arb, false);
}

void arb_limb_on_written(arb_limb_t *limb, pdcp_arb_t *arb)
{
    limb->told = false;
    if (limb->active != 0 && !arb_config_has(&limb->config, limb->active)) {
        forget_active(limb, arb);
    }
}

static void enter(arb_limb_t *limb, stage_t stage)
{
    limb->stage = (uint8_t)stage;
}

/* The host's action has ended. */
static stage_t end_action(arb_limb_t *limb, uint8_t error)
{
    limb->ended = true;
    limb->error = error;
    return STAGE_IDLE;
}

/* What the host is told (D-API-4). */
uint8_t arb_limb_error(arb_config_status_t status)
{
    switch (status) {
    case ARB_CONFIG_OK:
    case ARB_CONFIG_UNCHANGED:
        return ARB_OK;
    case ARB_CONFIG_ERR_BUSY:
        return ARB_ERR_BUSY;
    case ARB_CONFIG_ERR_NUMBER:
        return ARB_ERR_NUMBER;
    case ARB_CONFIG_ERR_VALUE:
        return ARB_ERR_VALUE;
    default:
        return ARB_ERR_STORAGE;
    }
}

/* Begins a stage of an action, whose job of arb_config was started with this status. */
static uint8_t begin(arb_limb_t *limb, stage_t stage, arb_config_status_t status)
{
    if (status == ARB_CONFIG_OK) {
        enter(limb, stage);
    }
    return arb_limb_error(status);
}

/* --- Reading what is stored --- */

static bool is_present(const pdcp_tables_t *tables, const profile_end_t *end, uint8_t transfer)
{
    const uint8_t place = pdcp_tables_find(tables, &end->owner);
    return place != PDCP_NONE &&
           profile_channel_is_ready(tables, pdcp_tables_channel(tables, place, end->index), transfer);
}

/* Is the configuration just read better than the best one so far (D-PRO-4)? One without a link that has an
 * end here never is. */
static void compare(arb_limb_t *limb)
{
    if (limb->score > limb->best_score || (limb->score == limb->best_score && limb->number < limb->best)) {
        limb->best = limb->number;
        limb->best_score = limb->score;
    }
}

static void score_link(arb_limb_t *limb, uint8_t number, const profile_link_t *link)
{
    const bool output = is_present(limb->run.scene.tables, &link->output, PDCP_OUTPUT);
    const bool input = is_present(limb->run.scene.tables, &link->input, PDCP_INPUT);
    if (number != limb->number) {
        compare(limb);
        limb->number = number;
        limb->score = 0;
    }
    if (output && input) {
        limb->score = (uint16_t)(limb->score + SCORE_BOTH);
    } else if (output || input) {
        limb->score++;
    }
}

static void on_link(void *ctx, uint8_t number, const profile_link_t *link)
{
    arb_limb_t *limb = ctx;
    if (limb->stage == STAGE_SCORE) {
        score_link(limb, number, link);
    } else if (number != limb->number) {
        return;
    } else if (limb->stage == STAGE_CHECK) {
        limb->score++;
    } else if (!profile_active_load_link(&limb->run, link)) {
        limb->error = ARB_ERR_STORAGE; /* of the load; the link is left out */
    }
}

/* --- Start-up: which stored configuration (D-PRO-4) --- */

static stage_t start(arb_limb_t *limb, pdcp_arb_t *arb, uint8_t number)
{
    set_active(limb, number);
    profile_start_begin(&limb->run, arb, number != 0);
    limb->run.changed = false; /* what was loaded or read back is not a change to be saved */
    return STAGE_IDLE;
}

/* The bus is quiet: the start-up begins. */
static stage_t begin_start(arb_limb_t *limb, pdcp_arb_t *arb)
{
    limb->best = 0;
    limb->best_score = 0;
    limb->number = 0;
    limb->score = 0;
    if (limb->config.stored == 0) {
        return start(limb, arb, 0);
    }
    return arb_config_read(&limb->config) == ARB_CONFIG_OK
               ? STAGE_SCORE
               : STAGE_IDLE; /* refused while busy: again with the next step */
}

/* All are scored. */
static stage_t end_score(arb_limb_t *limb, pdcp_arb_t *arb)
{
    compare(limb);
    profile_active_load_begin(&limb->run, true);
    limb->number = limb->best;
    if (limb->status != ARB_CONFIG_OK || limb->best == 0 || arb_config_read(&limb->config) != ARB_CONFIG_OK) {
        return start(limb, arb, 0);
    }
    return STAGE_START;
}

/* The best one is loaded. */
static stage_t end_start(arb_limb_t *limb, pdcp_arb_t *arb)
{
    if (limb->status != ARB_CONFIG_OK) {
        profile_active_load_begin(&limb->run, true);
        limb->number = 0;
    }
    return start(limb, arb, limb->number);
}

/* --- Actions --- */

static void get_link(void *ctx, uint8_t k, profile_link_t *link)
{
    const arb_limb_t *limb = ctx;
    profile_links_get(&limb->run.links, k, link);
}

static uint8_t begin_save(arb_limb_t *limb)
{
    if (!profile_active_take_up(&limb->run)) {
        return ARB_ERR_STORAGE;
    }
    const arb_config_status_t status = arb_config_save(&limb->config, &limb->number, limb->run.links.count);
    if (status == ARB_CONFIG_OK) {
        limb->run.frozen = true;
    }
    return begin(limb, STAGE_SAVE, status);
}

static stage_t end_save(arb_limb_t *limb, pdcp_arb_t *arb)
{
    limb->run.frozen = false;
    (void)profile_active_take_up(&limb->run);
    if (limb->status >= 0) {
        limb->unsaved = false;
        pdcp_arb_plan_links(arb, true);
        set_active(limb, limb->number);
    }
    return end_action(limb, arb_limb_error((arb_config_status_t)limb->status));
}

static uint8_t begin_load(arb_limb_t *limb)
{
    limb->score = 0;
    if (!arb_config_has(&limb->config, limb->number)) {
        return ARB_ERR_NUMBER;
    }
    return begin(limb, STAGE_CHECK, arb_config_read(&limb->config));
}

/* If the memory can be read, and there is room (D-PRO-11), the links go into the table now. */
static stage_t end_check(arb_limb_t *limb)
{
    if (limb->status != ARB_CONFIG_OK || limb->score > PROFILE_LINKS_MAX ||
        arb_config_read(&limb->config) != ARB_CONFIG_OK) {
        return end_action(limb, ARB_ERR_STORAGE);
    }
    profile_active_load_begin(&limb->run, false);
    return STAGE_LOAD;
}

static stage_t plan(arb_limb_t *limb, uint8_t what, bool anew)
{
    profile_run_begin(&limb->run, what, anew);
    return STAGE_PLAN;
}

/* Originals and replacements are made, and nothing is autoconfigured (D-PRO-16). */
static stage_t end_load(arb_limb_t *limb, pdcp_arb_t *arb)
{
    if (limb->status != ARB_CONFIG_OK) { /* it could be read a moment ago */
        return end_action(limb, ARB_ERR_STORAGE);
    }
    set_active(limb, limb->number);
    pdcp_arb_plan_links(arb, true);
    const stage_t next = plan(limb, PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_REPLACE, true);
    limb->run.changed = false;
    limb->unsaved = false;
    return next;
}

static uint8_t begin_erase(arb_limb_t *limb)
{
    return begin(limb, STAGE_ERASE, arb_config_erase(&limb->config, limb->number));
}

static stage_t end_erase(arb_limb_t *limb, pdcp_arb_t *arb)
{
    if (limb->status >= 0) {
        limb->told = false;
        if (limb->active == limb->number) {
            forget_active(limb, arb);
        }
    }
    return end_action(limb, arb_limb_error((arb_config_status_t)limb->status));
}

/* Before the start-up, with no device there, nothing is to be planned, and the start-up is still to come.
 * After a clear, no link of the configuration is left, and none counts as working. */
static stage_t plan_for_host(arb_limb_t *limb, uint8_t what, bool clear)
{
    if (clear) {
        profile_active_load_begin(&limb->run, false);
    }
    if (limb->run.state == PROFILE_RUN_WAITING) {
        return end_action(limb, ARB_OK);
    }
    return plan(limb, what, clear);
}

bool arb_limb_is_starting(const arb_limb_t *limb)
{
    return profile_start_is_pending(&limb->run);
}

uint8_t arb_limb_act(arb_limb_t *limb, uint8_t action, uint8_t argument)
{
    uint8_t what = PROFILE_PLAN_ENFORCE;
    pdcp_assert(!arb_limb_is_busy(limb), "arb_limb.h: nothing is under way");
    limb->ended = false;
    limb->error = ARB_OK;
    limb->result = 0;
    limb->number = argument != 0 ? argument : limb->active; /* D-PRO-16 */
    switch ((arb_action_t)action) {
    case ARB_ACTION_SAVE:
        return begin_save(limb);
    case ARB_ACTION_LOAD:
        return begin_load(limb);
    case ARB_ACTION_ERASE:
        return begin_erase(limb);
    case ARB_ACTION_ADOPT:
        limb->result = profile_active_adopt_stand_ins(&limb->run);
        enter(limb, end_action(limb, ARB_OK));
        return ARB_OK;
    case ARB_ACTION_AUTOCONFIGURE:
        what = PROFILE_PLAN_AUTO;
        break;
    case ARB_ACTION_REPLACE:
        what = PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_REPLACE;
        break;
    case ARB_ACTION_CLEAR:
    case ARB_ACTION_ENFORCE:
        break;
    default:
        return ARB_ERR_VALUE;
    }
    enter(limb, plan_for_host(limb, what, action == ARB_ACTION_CLEAR));
    return ARB_OK;
}

/* --- What is due --- */

void arb_limb_on_event(arb_limb_t *limb, const pdcp_arb_t *arb, uint32_t now_ms, const pdcp_event_t *event)
{
    if (event->kind == PDCP_EVENT_SILENT) { /* on standby there is no limb */
        set_active(limb, 0);
        if (limb->stage == STAGE_PLAN) { /* what the memory is doing goes on */
            enter(limb, end_action(limb, ARB_ERR_NOT_READY));
        }
    }
    profile_events_take(&limb->run, arb, now_ms, event);
}

/* A job of arb_config has ended; at another stage it was the host's. */
static stage_t next_stage(arb_limb_t *limb, pdcp_arb_t *arb)
{
    switch ((stage_t)limb->stage) {
    case STAGE_SCORE:
        return end_score(limb, arb);
    case STAGE_START:
        return end_start(limb, arb);
    case STAGE_CHECK:
        return end_check(limb);
    case STAGE_LOAD:
        return end_load(limb, arb);
    case STAGE_SAVE:
        return end_save(limb, arb);
    case STAGE_ERASE:
        return end_erase(limb, arb);
    default:
        return (stage_t)limb->stage;
    }
}

/* Is there something to be saved, and nothing in the way? Before the start-up and on standby there is no
 * limb. */
static bool may_auto_save(const arb_limb_t *limb)
{
    return limb->unsaved && limb->stage == STAGE_IDLE && limb->run.state == PROFILE_RUN_IDLE &&
           limb->run.due == 0 && (arb_limb_flags(limb) & ARB_FLAG_AUTO_SAVE) != 0;
}

static void auto_save(arb_limb_t *limb, uint32_t now_ms)
{
    if (limb->run.changed) {
        limb->run.changed = false;
        limb->unsaved = true;
        limb->save_ms = now_ms + ARB_LIMB_AUTO_SAVE_MS;
    }
    if (may_auto_save(limb) && pdcp_time_reached(now_ms, limb->save_ms)) {
        limb->save_ms = now_ms + ARB_LIMB_AUTO_SAVE_MS; /* if it fails, again after the same time */
        limb->number = limb->active;
        (void)begin_save(limb);
    }
}

bool arb_limb_step(arb_limb_t *limb, pdcp_arb_t *arb, arb_nvm_t *nvm, uint32_t now_ms)
{
    limb->status = (int8_t)arb_config_step(&limb->config, nvm, now_ms);
    arb_flags_step(&limb->flags, nvm, now_ms);
    if (limb->status != ARB_CONFIG_RUNNING) {
        enter(limb, next_stage(limb, arb));
    }
    if (limb->stage == STAGE_IDLE && profile_start_may_begin(&limb->run, arb, now_ms)) {
        enter(limb, begin_start(limb, arb));
    }
    const bool handed = profile_step(&limb->run, arb, now_ms);
    if (limb->stage == STAGE_PLAN && profile_run_status(&limb->run) != PROFILE_CONFIGURING) {
        limb->result = limb->run.moves;
        enter(limb, end_action(limb, limb->error));
    }
    auto_save(limb, now_ms);
    return handed;
}

uint32_t arb_limb_next_ms(const arb_limb_t *limb, const pdcp_arb_t *arb, uint32_t now_ms)
{
    uint32_t next_ms = profile_step_next_ms(&limb->run, arb, now_ms);
    next_ms = pdcp_time_earlier(next_ms, arb_config_next_ms(&limb->config, now_ms));
    next_ms = pdcp_time_earlier(next_ms, arb_flags_next_ms(&limb->flags, now_ms));
    if (may_auto_save(limb)) {
        next_ms = pdcp_time_earlier(next_ms, limb->save_ms);
    }
    return next_ms;
}
