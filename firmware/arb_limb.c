#include "arb_limb.h"

#include <stddef.h>
#include <string.h>

#include "pdcp_time.h"

/* What is under way. */
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

static void apply_flags(arb_limb_t *limb)
{
    const uint8_t flags = arb_limb_flags(limb);
    limb->run.autoconfigure = (flags & ARB_FLAG_AUTOCONFIGURE) != 0;
    limb->run.hot_swap = (flags & ARB_FLAG_HOT_SWAP) != 0;
}

void arb_limb_init(arb_limb_t *limb, arb_nvm_t *nvm, uint8_t flags_on, uint8_t flags_off, uint32_t now_ms)
{
    memset(limb, 0, sizeof *limb);
    limb->flags_on = flags_on;
    limb->flags_off = flags_off;
    limb->told = true;
    profile_run_init(&limb->run, now_ms);
    arb_flags_load(&limb->flags, nvm);
    arb_config_init(&limb->config, nvm);
    apply_flags(limb);
}

uint8_t arb_limb_flags(const arb_limb_t *limb)
{
    const uint8_t flags = arb_flags_get(&limb->flags);
    return (uint8_t)((flags | limb->flags_on) & ~limb->flags_off & ARB_FLAGS_STORED);
}

void arb_limb_set_flags(arb_limb_t *limb, uint32_t now_ms, uint8_t flags)
{
    limb->flags_on = 0; /* the host's word is the last one */
    limb->flags_off = 0;
    arb_flags_set(&limb->flags, flags, now_ms);
    apply_flags(limb);
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
    limb->run.stored = false;
    pdcp_arb_plan_links(arb, false);
}

void arb_limb_on_written(arb_limb_t *limb, pdcp_arb_t *arb)
{
    limb->told = false;
    if (limb->active != 0 && !arb_config_has(&limb->config, limb->active)) {
        forget_active(limb, arb);
    }
}

static void end(arb_limb_t *limb, uint8_t error, uint16_t result)
{
    limb->stage = STAGE_IDLE;
    if (limb->for_host) {
        limb->ended = true;
        limb->error = error;
        limb->result = result;
    }
    limb->for_host = false;
}

static uint8_t error_of(arb_config_status_t status)
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

/* --- Start-up: which stored configuration (D-PRO-4) --- */

static bool is_present(const pdcp_nodes_t *nodes, const profile_end_t *end, uint8_t transfer)
{
    const uint8_t place = pdcp_nodes_find(nodes, &end->owner);
    if (place == PDCP_NONE || nodes->nodes[place].state != PDCP_NODE_READY) {
        return false;
    }
    const uint8_t channel = pdcp_nodes_channel(nodes, place, end->index);
    return channel != PDCP_NONE && nodes->channels[channel].transfer == transfer;
}

/* Is the configuration just read better than the best one so far? */
static void compare(arb_limb_t *limb)
{
    const bool matches = limb->both != 0 || limb->one != 0;
    const bool first = limb->best == 0;
    const bool better =
        limb->both > limb->best_both ||
        (limb->both == limb->best_both &&
         (limb->one > limb->best_one || (limb->one == limb->best_one && limb->number < limb->best)));
    if (limb->number != 0 && matches && (first || better)) {
        limb->best = limb->number;
        limb->best_both = limb->both;
        limb->best_one = limb->one;
    }
}

static void score_configuration(void *ctx, uint8_t number)
{
    arb_limb_t *limb = ctx;
    compare(limb);
    limb->number = number;
    limb->both = 0;
    limb->one = 0;
}

static void score_link(void *ctx, uint8_t number, const profile_link_t *link)
{
    arb_limb_t *limb = ctx;
    const bool output = is_present(&limb->arb->bus.nodes, &link->output, PDCP_OUTPUT);
    const bool input = is_present(&limb->arb->bus.nodes, &link->input, PDCP_INPUT);
    (void)number;
    if (output && input) {
        limb->both++;
    } else if (output || input) {
        limb->one++;
    }
}

static const profile_tlv_sink_t score_sink = {.on_configuration = score_configuration, .on_link = score_link};

static void load_link(void *ctx, uint8_t number, const profile_link_t *link)
{
    arb_limb_t *limb = ctx;
    if (number == limb->number && !profile_run_load_link(&limb->run, link)) {
        limb->overflow = true;
    }
}

static const profile_tlv_sink_t load_sink = {.on_link = load_link};

static void count_link(void *ctx, uint8_t number, const profile_link_t *link)
{
    arb_limb_t *limb = ctx;
    (void)link;
    if (number == limb->number && limb->both < UINT8_MAX) {
        limb->both++;
    }
}

static const profile_tlv_sink_t count_sink = {.on_link = count_link};

/* A job of arb_config has ended: what comes next begins with the next step. */
static void on_done(void *ctx, arb_config_status_t status)
{
    arb_limb_t *limb = ctx;
    limb->done = true;
    limb->status = (int8_t)status;
}

static bool read_all(arb_limb_t *limb, stage_t stage, const profile_tlv_sink_t *sink, uint32_t now_ms)
{
    if (arb_config_read(&limb->config, sink, on_done, limb, now_ms) != ARB_CONFIG_OK) {
        return false;
    }
    limb->stage = (uint8_t)stage;
    limb->done = false;
    return true;
}

static void start(arb_limb_t *limb, pdcp_arb_t *arb, uint8_t number)
{
    limb->stage = STAGE_IDLE;
    set_active(limb, number);
    profile_run_start(&limb->run, arb, number != 0);
    (void)profile_run_take_change(&limb->run); /* what was loaded or read back is not a change to be saved */
}

/* The bus is quiet: the start-up begins. */
static void begin_start(arb_limb_t *limb, pdcp_arb_t *arb, uint32_t now_ms)
{
    limb->best = 0;
    limb->number = 0;
    limb->both = 0;
    limb->one = 0;
    if (limb->config.stored == 0) {
        start(limb, arb, 0);
    } else {
        (void)read_all(limb, STAGE_SCORE, &score_sink,
                       now_ms); /* refused while busy: again with the next step */
    }
}

/* All are scored. */
static void end_score(arb_limb_t *limb, pdcp_arb_t *arb, uint32_t now_ms)
{
    compare(limb);
    profile_run_load_begin(&limb->run, true);
    limb->number = limb->best;
    if (limb->status != ARB_CONFIG_OK || limb->best == 0 ||
        !read_all(limb, STAGE_START, &load_sink, now_ms)) {
        start(limb, arb, 0);
    }
}

/* The best one is loaded. */
static void end_start(arb_limb_t *limb, pdcp_arb_t *arb)
{
    if (limb->status != ARB_CONFIG_OK) {
        profile_run_load_begin(&limb->run, true);
        limb->number = 0;
    }
    start(limb, arb, limb->number);
}

/* --- Actions --- */

static void get_link(void *ctx, uint8_t k, profile_link_t *link)
{
    const arb_limb_t *limb = ctx;
    profile_links_get(&limb->run.links, k, link);
}

static uint8_t begin_save(arb_limb_t *limb, const pdcp_arb_t *arb, uint32_t now_ms, uint8_t argument)
{
    if (!profile_run_is_complete(&limb->run, arb)) {
        return ARB_ERR_STORAGE;
    }
    limb->number = argument != 0 ? argument : limb->active;
    const arb_config_status_t status =
        arb_config_save(&limb->config, &limb->number, limb->run.links.count, get_link, on_done, limb, now_ms);
    if (status != ARB_CONFIG_OK) {
        return error_of(status);
    }
    limb->stage = STAGE_SAVE;
    limb->done = false;
    profile_run_freeze(&limb->run, arb, true);
    return ARB_OK;
}

static void end_save(arb_limb_t *limb, pdcp_arb_t *arb)
{
    profile_run_freeze(&limb->run, arb, false);
    if (limb->status < 0) {
        end(limb, error_of((arb_config_status_t)limb->status), 0);
        return;
    }
    limb->unsaved = false;
    limb->run.stored = true;
    pdcp_arb_plan_links(arb, true);
    set_active(limb, limb->number);
    end(limb, ARB_OK, 0);
}

static uint8_t begin_load(arb_limb_t *limb, uint32_t now_ms, uint8_t argument)
{
    const uint8_t number = argument != 0 ? argument : limb->active;
    if (number == 0 || !arb_config_has(&limb->config, number)) {
        return ARB_ERR_NUMBER;
    }
    limb->number = number;
    limb->both = 0;
    return read_all(limb, STAGE_CHECK, &count_sink, now_ms) ? ARB_OK : ARB_ERR_BUSY;
}

/* The memory can be read, and there is room: now the links go into the table. */
static void end_check(arb_limb_t *limb, uint32_t now_ms)
{
    const bool fits = limb->status == ARB_CONFIG_OK && limb->both <= PROFILE_LINKS_MAX;
    if (!fits || !read_all(limb, STAGE_LOAD, &load_sink, now_ms)) {
        end(limb, ARB_ERR_STORAGE, 0);
        return;
    }
    limb->overflow = false;
    profile_run_load_begin(&limb->run, false);
}

static void plan(arb_limb_t *limb, pdcp_arb_t *arb, profile_purpose_t purpose, uint8_t what)
{
    limb->stage = STAGE_PLAN;
    limb->overflow = false;
    profile_run_begin(&limb->run, arb, purpose, what);
}

static void end_load(arb_limb_t *limb, pdcp_arb_t *arb)
{
    if (limb->status != ARB_CONFIG_OK) { /* it could be read a moment ago */
        end(limb, ARB_ERR_STORAGE, 0);
        return;
    }
    const bool overflow = limb->overflow;
    set_active(limb, limb->number);
    plan(limb, arb, PROFILE_FOR_LOAD, PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_REPLACE);
    (void)profile_run_take_change(&limb->run);
    limb->unsaved = false;
    limb->overflow = overflow; /* the rest is left out */
}

static uint8_t begin_erase(arb_limb_t *limb, uint32_t now_ms, uint8_t argument)
{
    limb->number = argument != 0 ? argument : limb->active;
    if (limb->number == 0) {
        return ARB_ERR_NUMBER;
    }
    const arb_config_status_t status = arb_config_erase(&limb->config, limb->number, on_done, limb, now_ms);
    if (status != ARB_CONFIG_OK) {
        return error_of(status);
    }
    limb->stage = STAGE_ERASE;
    limb->done = false;
    return ARB_OK;
}

static void end_erase(arb_limb_t *limb, pdcp_arb_t *arb)
{
    if (limb->status >= 0) {
        limb->told = false;
        if (limb->active == limb->number) {
            forget_active(limb, arb);
        }
    }
    end(limb, error_of((arb_config_status_t)limb->status), 0);
}

/* Before the start-up, with no device there, nothing is to be planned, and the start-up is still to come. */
static void plan_for_host(arb_limb_t *limb, pdcp_arb_t *arb, profile_purpose_t purpose, uint8_t what)
{
    if (limb->run.state != PROFILE_WAITING) {
        plan(limb, arb, purpose, what);
        return;
    }
    if (purpose == PROFILE_FOR_CLEAR) {
        profile_run_load_begin(&limb->run, false);
    }
    end(limb, ARB_OK, 0);
}

bool arb_limb_is_starting(const arb_limb_t *limb, const pdcp_arb_t *arb)
{
    return profile_run_is_starting(&limb->run, arb);
}

uint8_t arb_limb_act(arb_limb_t *limb, pdcp_arb_t *arb, uint32_t now_ms, uint8_t action, uint8_t argument)
{
    uint8_t error = ARB_OK;
    limb->for_host = true;
    limb->ended = false;
    switch ((arb_action_t)action) {
    case ARB_ACTION_SAVE:
        error = begin_save(limb, arb, now_ms, argument);
        break;
    case ARB_ACTION_LOAD:
        error = begin_load(limb, now_ms, argument);
        break;
    case ARB_ACTION_ERASE:
        error = begin_erase(limb, now_ms, argument);
        break;
    case ARB_ACTION_AUTOCONFIGURE:
        plan_for_host(limb, arb, PROFILE_FOR_EVENT, PROFILE_PLAN_AUTO);
        break;
    case ARB_ACTION_CLEAR:
        plan_for_host(limb, arb, PROFILE_FOR_CLEAR, 0);
        break;
    case ARB_ACTION_ENFORCE:
        plan_for_host(limb, arb, PROFILE_FOR_ENFORCE, 0);
        break;
    case ARB_ACTION_REPLACE:
        plan_for_host(limb, arb, PROFILE_FOR_EVENT, PROFILE_PLAN_ORIGINALS | PROFILE_PLAN_REPLACE);
        break;
    case ARB_ACTION_ADOPT:
        end(limb, ARB_OK, profile_run_adopt(&limb->run, arb));
        break;
    default:
        error = ARB_ERR_VALUE;
        break;
    }
    limb->for_host = limb->for_host && error == ARB_OK;
    return error;
}

/* --- What is due --- */

void arb_limb_on_event(arb_limb_t *limb, const pdcp_arb_t *arb, uint32_t now_ms, const pdcp_event_t *event)
{
    if (event->kind == PDCP_EVENT_SILENT) { /* on standby there is no limb */
        set_active(limb, 0);
        if (limb->stage == STAGE_PLAN) { /* what the memory is doing goes on */
            end(limb, ARB_ERR_NOT_READY, 0);
        }
    }
    profile_run_on_event(&limb->run, arb, now_ms, event);
}

/* A job of arb_config has ended. */
static void next_stage(arb_limb_t *limb, pdcp_arb_t *arb, uint32_t now_ms)
{
    limb->done = false;
    switch ((stage_t)limb->stage) {
    case STAGE_SCORE:
        end_score(limb, arb, now_ms);
        break;
    case STAGE_START:
        end_start(limb, arb);
        break;
    case STAGE_CHECK:
        end_check(limb, now_ms);
        break;
    case STAGE_LOAD:
        end_load(limb, arb);
        break;
    case STAGE_SAVE:
        end_save(limb, arb);
        break;
    case STAGE_ERASE:
        end_erase(limb, arb);
        break;
    default:
        break;
    }
}

/* Is there something to be saved, and nothing in the way? Before the start-up and on standby there is no
 * limb. */
static bool may_auto_save(const arb_limb_t *limb)
{
    return limb->unsaved && limb->stage == STAGE_IDLE && limb->run.state == PROFILE_RUNNING &&
           !profile_run_is_busy(&limb->run) && (arb_limb_flags(limb) & ARB_FLAG_AUTO_SAVE) != 0;
}

static void auto_save(arb_limb_t *limb, const pdcp_arb_t *arb, uint32_t now_ms)
{
    if (profile_run_take_change(&limb->run)) {
        limb->unsaved = true;
        limb->changed_ms = now_ms;
    }
    if (may_auto_save(limb) && pdcp_time_reached(now_ms, limb->changed_ms + ARB_LIMB_AUTO_SAVE_MS)) {
        limb->changed_ms = now_ms; /* if it fails, again after the same time */
        (void)begin_save(limb, arb, now_ms, 0);
    }
}

bool arb_limb_step(arb_limb_t *limb, pdcp_arb_t *arb, arb_nvm_t *nvm, uint32_t now_ms)
{
    limb->arb = arb;
    arb_config_step(&limb->config, nvm, now_ms);
    arb_flags_step(&limb->flags, nvm, now_ms);
    if (limb->done) {
        next_stage(limb, arb, now_ms);
    }
    if (limb->stage == STAGE_IDLE && profile_run_is_quiet(&limb->run, arb, now_ms)) {
        begin_start(limb, arb, now_ms);
    }
    const bool handed = profile_run_step(&limb->run, arb, now_ms);
    if (limb->stage == STAGE_PLAN && !limb->run.planning) {
        end(limb, limb->overflow ? ARB_ERR_STORAGE : ARB_OK, limb->run.moves);
    }
    auto_save(limb, arb, now_ms);
    return handed;
}

static uint32_t earlier(uint32_t a_ms, uint32_t b_ms)
{
    return pdcp_time_before(b_ms, a_ms) ? b_ms : a_ms;
}

uint32_t arb_limb_next_ms(const arb_limb_t *limb, const pdcp_arb_t *arb, uint32_t now_ms)
{
    uint32_t next_ms = profile_run_next_ms(&limb->run, arb, now_ms);
    next_ms = earlier(next_ms, arb_config_next_ms(&limb->config, now_ms));
    next_ms = earlier(next_ms, arb_flags_next_ms(&limb->flags, now_ms));
    if (may_auto_save(limb)) {
        next_ms = earlier(next_ms, limb->changed_ms + ARB_LIMB_AUTO_SAVE_MS);
    }
    return next_ms;
}
