#include "profile_plan.h"

#include <stddef.h>
#include <string.h>

#include "profile_match.h"

/* Where the source of an input comes from, in this order (D-PRO-9). */
typedef enum {
    SOURCE_GIVEN,
    SOURCE_ORIGINAL,    /* the one that the active configuration names */
    SOURCE_REPLACEMENT, /* the most similar to the one that it names, which is missing */
    SOURCE_SIMILAR      /* the most similar to the input itself */
} source_t;

/* What a new link needs, in this order. */
typedef enum { NEED_BY_OUTPUT, NEED_BY_INPUT, DESIRED_BY_OUTPUT, DESIRED_BY_INPUT, NEEDS_END } need_t;

/* One input that is being connected; the stack of them replaces recursion. */
typedef struct {
    uint8_t input;
    uint8_t given;  /* SOURCE_GIVEN: the output */
    uint8_t source; /* source_t: where the next candidate comes from */
    uint8_t last;   /* source_t: the last one that may be asked */
    uint8_t tried;  /* candidate of this source tried last, the one in the plan; PDCP_NONE: none yet */
    uint8_t mark;   /* length of the log before its link was made */
    uint8_t need;   /* need_t: what is seen to */
    uint8_t cursor; /* channel number of the need seen to last, PDCP_NONE: none yet */
    bool choosing;  /* its next candidate is to be tried */
    bool required;  /* by the frame below */
} frame_t;

/* Work space of one plan; lives on the stack while it is made. */
enum { ROUNDS_MAX = 8 };

typedef struct {
    profile_plan_t *plan;
    const profile_scene_t *scene;
    const pdcp_nodes_t *nodes;
    uint8_t out[PROFILE_LINKS_MAX]; /* channel numbers of the entries' ends, PDCP_NONE: missing */
    uint8_t in[PROFILE_LINKS_MAX];
    uint8_t taken[PROFILE_CHANNEL_BYTES]; /* bit per output: it feeds a sole-access input */
    uint8_t gone[PROFILE_CHANNEL_BYTES];  /* bit per input: it does not count as connected */
    uint8_t log[PDCP_CHANNELS_MAX];       /* inputs connected, in order, for undoing */
    uint8_t logged;
    frame_t frames[PROFILE_PLAN_DEPTH];
    uint8_t depth;
    uint8_t needs_last; /* source_t: the last one that may be asked for what a link needs */
    uint32_t steps_end; /* the search under way ends there */
    bool waits;         /* an end of the configuration is awaited */
} work_t;

static bool get_bit(const uint8_t *bits, uint8_t number)
{
    return (bits[number / 8] & (1u << (number % 8))) != 0;
}

static void set_bit(uint8_t *bits, uint8_t number, bool value)
{
    const uint8_t mask = (uint8_t)(1u << (number % 8));
    bits[number / 8] = (uint8_t)(value ? bits[number / 8] | mask : bits[number / 8] & ~mask);
}

static const pdcp_channel_t *channel_of(const work_t *work, uint8_t channel)
{
    return &work->nodes->channels[channel];
}

bool profile_is_awaited(const profile_scene_t *scene, const profile_ref_t *end)
{
    const uint8_t place = profile_links_place(scene->links, scene->nodes, end);
    if (place == PDCP_NONE) {
        return false;
    }
    const pdcp_node_t *node = &scene->nodes->nodes[place];
    const bool coming = node->state == PDCP_NODE_SETUP && !node->setup_again;
    return coming || (node->state == PDCP_NODE_LOST && get_bit(scene->awaited, place));
}

/* --- Links of the plan --- */

/* The sole-access input, other than this one, that an output feeds; PDCP_NONE: none. */
static uint8_t sole_input(const work_t *work, uint8_t output, uint8_t other_than)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (work->plan->want[i] == output && i != other_than && profile_is_sole(channel_of(work, i))) {
            return i;
        }
    }
    return PDCP_NONE;
}

static void link_input(work_t *work, uint8_t input, uint8_t output)
{
    work->plan->want[input] = output;
    if (profile_is_sole(channel_of(work, input))) {
        set_bit(work->taken, output, true);
    }
}

static void unlink_input(work_t *work, uint8_t input)
{
    const uint8_t output = work->plan->want[input];
    work->plan->want[input] = PDCP_NONE;
    if (output != PDCP_NONE) {
        set_bit(work->taken, output, sole_input(work, output, input) != PDCP_NONE);
    }
}

static bool is_banned(const work_t *work, uint8_t output, uint8_t input)
{
    for (uint8_t i = 0; i < work->scene->banned_count; i++) {
        if (work->scene->banned[i].output == output && work->scene->banned[i].input == input) {
            return true;
        }
    }
    return false;
}

/* May this output feed this input? Both are set up and unbanned, of different devices, and sole access is
 * respected [PROFILE listing 4.4]. */
static bool may_link(const work_t *work, uint8_t output, uint8_t input)
{
    return profile_is_ready(work->nodes, output, PDCP_OUTPUT) &&
           profile_is_ready(work->nodes, input, PDCP_INPUT) &&
           channel_of(work, output)->node != channel_of(work, input)->node &&
           !is_banned(work, output, input) &&
           !(get_bit(work->taken, output) && profile_is_sole(channel_of(work, input)));
}

/* --- Candidates --- */

/* What candidates are compared with. */
typedef struct {
    uint16_t type;
    uint16_t profile;
} model_t;

static uint8_t score_of(const work_t *work, uint8_t channel, const model_t *model)
{
    return profile_similarity(channel_of(work, channel)->type, channel_of(work, channel)->profile,
                              model->type, model->profile);
}

/* May this input take the place of a missing one? It must be nobody's. */
static bool is_spare(const work_t *work, uint8_t input)
{
    if (work->plan->want[input] != PDCP_NONE) {
        return false;
    }
    const uint8_t entry = profile_links_of(work->scene->links, work->nodes, input);
    return entry == PDCP_NONE || (work->out[entry] == PDCP_NONE && !work->waits);
}

/* May a channel with this direction be linked to the partner at the other end? */
static bool is_candidate(const work_t *work, uint8_t channel, uint8_t transfer, uint8_t partner)
{
    if (transfer == PDCP_OUTPUT) {
        return may_link(work, channel, partner);
    }
    return may_link(work, partner, channel) && is_spare(work, channel);
}

static void begin_search(work_t *work)
{
    const uint32_t left = (uint32_t)PROFILE_PLAN_STEPS - work->plan->steps;
    work->steps_end = work->plan->steps + left / PROFILE_PLAN_SHARE;
}

static bool may_search(const work_t *work)
{
    return work->plan->steps + PDCP_CHANNELS_MAX <= work->steps_end;
}

/* The channel that comes next behind `tried` in the order of likeness to the model, among those that may be
 * linked to the partner. PDCP_NONE: there are no more. */
static uint8_t next_candidate(work_t *work, const model_t *model, uint8_t transfer, uint8_t partner,
                              uint8_t tried)
{
    uint8_t best = PDCP_NONE;
    uint8_t best_score = PROFILE_CANDIDATE_MIN;
    const uint8_t tried_score = tried != PDCP_NONE ? score_of(work, tried, model) : UINT8_MAX;
    if (!may_search(work)) {
        return PDCP_NONE;
    }
    for (uint8_t c = 0; c < PDCP_CHANNELS_MAX; c++) {
        work->plan->steps++;
        if (!is_candidate(work, c, transfer, partner)) {
            continue;
        }
        const uint8_t score = score_of(work, c, model);
        const bool behind =
            score < tried_score || (score == tried_score && profile_is_before(work->nodes, tried, c));
        const bool better =
            score > best_score ||
            (score == best_score && (best == PDCP_NONE || profile_is_before(work->nodes, c, best)));
        if (behind && better) {
            best = c;
            best_score = score;
        }
    }
    return best;
}

static uint8_t next_of_source(work_t *work, const frame_t *frame, uint8_t entry)
{
    const uint8_t original = entry != PDCP_NONE ? work->out[entry] : PDCP_NONE;
    model_t model = {channel_of(work, frame->input)->type, channel_of(work, frame->input)->profile};
    if (frame->source == SOURCE_GIVEN || frame->source == SOURCE_ORIGINAL) {
        const uint8_t output = frame->source == SOURCE_GIVEN ? frame->given : original;
        const bool is_new = frame->tried == PDCP_NONE;
        return is_new && may_link(work, output, frame->input) ? output : PDCP_NONE;
    }
    if (frame->source == SOURCE_REPLACEMENT) {
        if (entry == PDCP_NONE || original != PDCP_NONE) {
            return PDCP_NONE;
        }
        const profile_ref_t *missing = &work->scene->links->entries[entry].output;
        model.type = missing->type;
        model.profile = missing->profile;
    }
    return next_candidate(work, &model, PDCP_OUTPUT, frame->input, frame->tried);
}

/* The next output to try for the input of a frame; PDCP_NONE: none is left. */
static uint8_t next_source(work_t *work, frame_t *frame)
{
    const uint8_t entry = profile_links_of(work->scene->links, work->nodes, frame->input);
    if (entry != PDCP_NONE && profile_is_awaited(work->scene, &work->scene->links->entries[entry].output)) {
        return PDCP_NONE; /* its source will be back in a moment */
    }
    for (; frame->source <= frame->last; frame->source++) {
        frame->tried = next_of_source(work, frame, entry);
        if (frame->tried != PDCP_NONE) {
            return frame->tried;
        }
    }
    return PDCP_NONE;
}

/* --- Intelligently connect [PROFILE listing 4.5] --- */

static void push(work_t *work, uint8_t input, source_t first, source_t last)
{
    frame_t *frame = &work->frames[work->depth++];
    memset(frame, 0, sizeof *frame);
    frame->input = input;
    frame->given = PDCP_NONE;
    frame->source = (uint8_t)first;
    frame->last = (uint8_t)last;
    frame->tried = PDCP_NONE;
    frame->choosing = true;
}

static void undo_to(work_t *work, uint8_t mark)
{
    while (work->logged > mark) {
        unlink_input(work, work->log[--work->logged]);
    }
}

static bool is_connected(const work_t *work, uint8_t input)
{
    return work->plan->want[input] != PDCP_NONE && !get_bit(work->gone, input);
}

/* The next unconnected input that the link of a frame requires or desires, required ones first; PDCP_NONE:
 * there are no more. */
static uint8_t next_need(const work_t *work, frame_t *frame)
{
    for (; frame->need < NEEDS_END; frame->need++, frame->cursor = PDCP_NONE) {
        const bool by_output = frame->need == NEED_BY_OUTPUT || frame->need == DESIRED_BY_OUTPUT;
        const uint8_t by = by_output ? frame->tried : frame->input;
        const pdcp_node_t *owner = &work->nodes->nodes[channel_of(work, by)->node];
        if (owner->needs_stride == 0) {
            continue;
        }
        uint8_t c = frame->cursor != PDCP_NONE ? channel_of(work, frame->cursor)->next : owner->first_channel;
        for (; c != PDCP_NONE; c = channel_of(work, c)->next) {
            if (!is_connected(work, c) && pdcp_nodes_needs(work->nodes, by, frame->need >= DESIRED_BY_OUTPUT,
                                                           channel_of(work, c)->index)) {
                frame->cursor = c;
                return c;
            }
        }
    }
    return PDCP_NONE;
}

/* The link of a frame does not hold: all that was made for it is undone, its next candidate is due. */
static void reject(work_t *work, frame_t *frame)
{
    undo_to(work, frame->mark);
    frame->choosing = true;
}

/* Gives the input of a frame its next candidate. False: there is none. */
static bool choose(work_t *work, frame_t *frame)
{
    const uint8_t output = next_source(work, frame);
    if (output == PDCP_NONE) {
        return false;
    }
    frame->choosing = false;
    frame->mark = work->logged;
    frame->need = NEED_BY_OUTPUT;
    frame->cursor = PDCP_NONE;
    link_input(work, frame->input, output);
    work->log[work->logged++] = frame->input;
    return true;
}

/* Goes on with the top frame of the stack. */
static void advance(work_t *work)
{
    frame_t *frame = &work->frames[work->depth - 1];
    if (frame->choosing && !choose(work, frame)) {
        work->depth--;
        if (frame->required && work->depth != 0) {
            reject(work, &work->frames[work->depth - 1]);
        }
        return;
    }
    const uint8_t need = next_need(work, frame);
    const bool required = frame->need < DESIRED_BY_OUTPUT;
    if (need == PDCP_NONE) {
        work->depth--; /* the link holds */
    } else if (work->depth < PROFILE_PLAN_DEPTH) {
        push(work, need, SOURCE_ORIGINAL, (source_t)work->needs_last);
        work->frames[work->depth - 1].required = required;
    } else if (required) {
        reject(work, frame); /* too deep */
    }
}

/* Connects an input and all that its link requires, and of what it desires as much as can be. Loops end: an
 * input that is being connected counts as connected. False: nothing has changed. given: for SOURCE_GIVEN. */
static bool connect_input(work_t *work, uint8_t input, uint8_t given, source_t first, source_t last)
{
    work->depth = 0;
    work->logged = 0;
    begin_search(work);
    push(work, input, first, last);
    work->frames[0].given = given;
    while (work->depth != 0) {
        advance(work);
    }
    return work->plan->want[input] != PDCP_NONE;
}

/* --- What links require --- */

static bool is_left_alone(const work_t *work, uint8_t input)
{
    const uint8_t entry = profile_links_of(work->scene->links, work->nodes, input);
    return entry != PDCP_NONE && work->scene->links->entries[entry].by_host &&
           work->out[entry] == work->plan->want[input];
}

static bool lacks_need(const work_t *work, uint8_t input)
{
    frame_t frame = {.input = input, .tried = work->plan->want[input], .cursor = PDCP_NONE};
    return next_need(work, &frame) != PDCP_NONE && frame.need < DESIRED_BY_OUTPUT;
}

/* Marks as gone the links that lack something they require, and those that require one of these. */
static void find_gone(work_t *work)
{
    bool changed = true;
    while (changed) {
        changed = false;
        for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
            if (is_connected(work, i) && lacks_need(work, i) && !is_left_alone(work, i)) {
                set_bit(work->gone, i, true);
                changed = true;
            }
        }
    }
}

/* --- Originals [PROFILE listing 4.3], D-PRO-6 --- */

/* Does this input stand in for a missing one? */
static bool stands_in(const work_t *work, uint8_t input)
{
    for (uint8_t e = 0; e < work->scene->links->count; e++) {
        if (work->scene->links->entries[e].stand_in == input) {
            return true;
        }
    }
    return false;
}

/* Does the source of this input only stand in: for the one that the configuration names, or the input itself
 * for another? */
static bool is_standing_in(const work_t *work, uint8_t input)
{
    const profile_links_t *links = work->scene->links;
    const uint8_t own = profile_links_of(links, work->nodes, input);
    if (own != PDCP_NONE) {
        return work->out[own] != work->plan->want[input];
    }
    return stands_in(work, input);
}

/* Inputs that do not stand in any more. */
static void forget_stand_ins(const work_t *work)
{
    for (uint8_t e = 0; e < work->scene->links->count; e++) {
        profile_entry_t *entry = &work->scene->links->entries[e];
        if (entry->stand_in != PDCP_NONE &&
            (work->out[e] == PDCP_NONE || work->plan->want[entry->stand_in] != work->out[e])) {
            entry->stand_in = PDCP_NONE;
        }
    }
}

/* What an original has to replace before it can come back; PDCP_NONE: nothing. */
typedef struct {
    uint8_t input;
    uint8_t output;
} replaced_t;

static replaced_t take_away(work_t *work, uint8_t input)
{
    const replaced_t replaced = {input, input != PDCP_NONE ? work->plan->want[input] : PDCP_NONE};
    if (replaced.output != PDCP_NONE) {
        unlink_input(work, input);
    }
    return replaced;
}

static void give_back(work_t *work, const replaced_t *replaced)
{
    if (replaced->output != PDCP_NONE) {
        link_input(work, replaced->input, replaced->output);
    }
}

/* What a terminal one needs is searched for; another one must find it connected, or in other originals. What
 * the host has made needs nothing (D-PRO-9). */
static bool link_original(work_t *work, uint8_t number)
{
    const uint8_t input = work->in[number];
    const uint8_t output = work->out[number];
    work->needs_last = profile_is_terminal(channel_of(work, input)) ? SOURCE_SIMILAR : SOURCE_ORIGINAL;
    bool linked = connect_input(work, input, output, SOURCE_GIVEN, SOURCE_GIVEN);
    work->needs_last = SOURCE_SIMILAR;
    if (!linked && work->scene->links->entries[number].by_host && may_link(work, output, input)) {
        link_input(work, input, output);
        work->log[work->logged++] = input;
        linked = true;
    }
    return linked;
}

static bool is_original(const work_t *work, uint8_t input)
{
    const uint8_t own = profile_links_of(work->scene->links, work->nodes, input);
    return own != PDCP_NONE && work->plan->want[input] != PDCP_NONE &&
           work->out[own] == work->plan->want[input];
}

/* Has the link of this input all that it requires, and has no original lost that which it had? lacking:
 * inputs whose links were lacking something before. */
static bool is_worth_it(work_t *work, uint8_t input, const uint8_t *lacking)
{
    find_gone(work);
    bool good = !get_bit(work->gone, input);
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        good = good && !(get_bit(work->gone, i) && !get_bit(lacking, i) && is_original(work, i));
    }
    memset(work->gone, 0, sizeof work->gone);
    return good;
}

/* Makes a link of the configuration whose ends are both there; what stood in for them goes. */
static void bring_back(work_t *work, uint8_t number)
{
    profile_entry_t *entry = &work->scene->links->entries[number];
    const uint8_t input = work->in[number];
    const uint8_t output = work->out[number];
    uint8_t lacking[PROFILE_CHANNEL_BYTES];
    forget_stand_ins(work);
    const uint8_t other =
        profile_is_sole(channel_of(work, input)) ? sole_input(work, output, input) : PDCP_NONE;
    const bool takes = other != PDCP_NONE && other != entry->stand_in && is_standing_in(work, other);
    const bool costs = work->plan->want[input] != PDCP_NONE || entry->stand_in != PDCP_NONE || takes;
    if (costs) {
        find_gone(work);
        memcpy(lacking, work->gone, sizeof lacking);
        memset(work->gone, 0, sizeof work->gone);
    }
    const replaced_t source = take_away(work, input);
    const replaced_t stand_in = take_away(work, entry->stand_in);
    const replaced_t rival = take_away(work, takes ? other : PDCP_NONE);
    const bool linked = link_original(work, number);
    if (linked && (!costs || is_worth_it(work, input, lacking))) {
        entry->stand_in = PDCP_NONE;
        return;
    }
    undo_to(work, 0);
    give_back(work, &rival);
    give_back(work, &stand_in);
    give_back(work, &source);
}

static void bring_back_all(work_t *work)
{
    const profile_links_t *links = work->scene->links;
    for (uint8_t pass = 0; pass < 2; pass++) { /* terminal ones last */
        for (uint8_t e = 0; e < links->count; e++) {
            if (work->in[e] != PDCP_NONE && work->out[e] != PDCP_NONE &&
                profile_is_terminal(channel_of(work, work->in[e])) == (pass == 1) &&
                (work->plan->want[work->in[e]] != work->out[e] || links->entries[e].stand_in != PDCP_NONE)) {
                bring_back(work, e);
            }
        }
    }
}

/* --- Replacements [PROFILE listing 4.6] --- */

static uint8_t replacement_of(work_t *work, uint8_t number, uint8_t tried)
{
    const profile_entry_t *entry = &work->scene->links->entries[number];
    const bool for_output = work->out[number] == PDCP_NONE;
    const profile_ref_t *missing = for_output ? &entry->output : &entry->input;
    const uint8_t partner = for_output ? work->in[number] : work->out[number];
    const model_t model = {missing->type, missing->profile};
    return next_candidate(work, &model, for_output ? PDCP_OUTPUT : PDCP_INPUT, partner, tried);
}

/* Has this link exactly one end, and nothing that stands in for the other? */
static bool is_broken(const work_t *work, uint8_t number)
{
    const profile_entry_t *entry = &work->scene->links->entries[number];
    if (work->in[number] != PDCP_NONE) {
        return work->out[number] == PDCP_NONE && work->plan->want[work->in[number]] == PDCP_NONE &&
               !profile_is_awaited(work->scene, &entry->output);
    }
    return work->out[number] != PDCP_NONE && entry->stand_in == PDCP_NONE &&
           !profile_is_awaited(work->scene, &entry->input);
}

/* How alike the two ends would be with the best replacement, plus 1; 0: there is none. */
static uint8_t repair_key(work_t *work, uint8_t number)
{
    begin_search(work);
    const uint8_t found = is_broken(work, number) ? replacement_of(work, number, PDCP_NONE) : PDCP_NONE;
    if (found == PDCP_NONE) {
        return 0;
    }
    const pdcp_channel_t *end =
        channel_of(work, work->in[number] != PDCP_NONE ? work->in[number] : work->out[number]);
    const model_t model = {end->type, end->profile};
    return (uint8_t)(score_of(work, found, &model) + 1u);
}

static void repair(work_t *work, uint8_t number)
{
    if (work->in[number] != PDCP_NONE) {
        (void)connect_input(work, work->in[number], PDCP_NONE, SOURCE_REPLACEMENT, SOURCE_REPLACEMENT);
        return;
    }
    uint8_t tried = PDCP_NONE;
    begin_search(work);
    while ((tried = replacement_of(work, number, tried)) != PDCP_NONE) {
        if (connect_input(work, tried, work->out[number], SOURCE_GIVEN, SOURCE_GIVEN)) {
            work->scene->links->entries[number].stand_in = tried;
            return;
        }
    }
}

/* The links whose repaired ends are most alike come first. */
static void repair_all(work_t *work)
{
    forget_stand_ins(work);
    const uint8_t count = work->scene->links->count;
    uint8_t keys[PROFILE_LINKS_MAX];
    for (uint8_t e = 0; e < count; e++) {
        keys[e] = repair_key(work, e);
    }
    while (true) {
        uint8_t best = PDCP_NONE;
        for (uint8_t e = 0; e < count; e++) {
            if (keys[e] != 0 && (best == PDCP_NONE || keys[e] > keys[best])) {
                best = e;
            }
        }
        if (best == PDCP_NONE) {
            return;
        }
        keys[best] = 0;
        if (is_broken(work, best)) { /* it may have been connected as a need of another */
            repair(work, best);
        }
    }
}

/* The input, nobody's, that an output feeds and that is most like a missing one; PDCP_NONE: there is none. */
static uint8_t fed_instead(work_t *work, uint8_t output, const model_t *missing)
{
    uint8_t best = PDCP_NONE;
    uint8_t best_score = PROFILE_CANDIDATE_MIN;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (work->plan->want[i] != output || stands_in(work, i) ||
            profile_links_of(work->scene->links, work->nodes, i) != PDCP_NONE) {
            continue;
        }
        const uint8_t score = score_of(work, i, missing);
        if (score > best_score ||
            (score == best_score && (best == PDCP_NONE || profile_is_before(work->nodes, i, best)))) {
            best = i;
            best_score = score;
        }
    }
    return best;
}

/* An output whose input is missing may have been connected as what a replacement requires: it stands in, too,
 * and goes when the original comes back. True: there was such a one. */
static bool name_stand_ins(work_t *work)
{
    bool any = false;
    for (uint8_t e = 0; e < work->scene->links->count; e++) {
        profile_entry_t *entry = &work->scene->links->entries[e];
        if (work->in[e] == PDCP_NONE && work->out[e] != PDCP_NONE && entry->stand_in == PDCP_NONE) {
            const model_t missing = {entry->input.type, entry->input.profile};
            entry->stand_in = fed_instead(work, work->out[e], &missing);
            any = any || entry->stand_in != PDCP_NONE;
        }
    }
    return any;
}

/* --- Autoconfiguration [PROFILE listing 4.7] --- */

static bool is_served_before(const work_t *work, uint8_t a, uint8_t b)
{
    const uint16_t first = profile_priority(channel_of(work, a));
    const uint16_t second = profile_priority(channel_of(work, b));
    return first != second ? first < second : profile_is_before(work->nodes, a, b);
}

/* The terminal channel that is served next behind the last one; PDCP_NONE: there are no more. */
static uint8_t next_terminal(const work_t *work, uint8_t last)
{
    uint8_t best = PDCP_NONE;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (profile_is_ready(work->nodes, i, PDCP_INPUT) && profile_is_terminal(channel_of(work, i)) &&
            (last == PDCP_NONE || is_served_before(work, last, i)) &&
            (best == PDCP_NONE || is_served_before(work, i, best))) {
            best = i;
        }
    }
    return best;
}

static void autoconfigure(work_t *work)
{
    uint8_t input = PDCP_NONE;
    while ((input = next_terminal(work, input)) != PDCP_NONE) {
        const bool configured = profile_links_of(work->scene->links, work->nodes, input) != PDCP_NONE;
        if (work->plan->want[input] == PDCP_NONE && !(configured && work->waits)) {
            (void)connect_input(work, input, PDCP_NONE, SOURCE_SIMILAR, SOURCE_SIMILAR);
        }
    }
}

/* --- The whole --- */

/* Takes away, until nothing changes, links that require an input which is not connected (D-PRO-9). A loop in
 * which all are connected stays. */
static void settle(work_t *work)
{
    bool changed = true;
    while (changed) {
        changed = false;
        for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
            if (work->plan->want[i] != PDCP_NONE && lacks_need(work, i) && !is_left_alone(work, i)) {
                unlink_input(work, i);
                changed = true;
            }
        }
    }
}

/* Which ends of the configuration are there. */
static void find_ends(work_t *work)
{
    const profile_links_t *links = work->scene->links;
    for (uint8_t e = 0; e < links->count; e++) {
        const profile_entry_t *entry = &links->entries[e];
        work->out[e] = profile_links_channel(links, work->nodes, &entry->output, PDCP_OUTPUT);
        work->in[e] = profile_links_channel(links, work->nodes, &entry->input, PDCP_INPUT);
        work->waits = work->waits || profile_is_awaited(work->scene, &entry->output) ||
                      profile_is_awaited(work->scene, &entry->input);
    }
}

/* The links that work, and which ends of the configuration are there. */
static void look(work_t *work, profile_plan_t *plan, const profile_scene_t *scene)
{
    memset(work, 0, sizeof *work);
    work->needs_last = SOURCE_SIMILAR;
    work->plan = plan;
    work->scene = scene;
    work->nodes = scene->nodes;
    plan->steps = 0;
    memset(plan->want, PDCP_NONE, sizeof plan->want);
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const pdcp_channel_t *channel = &scene->nodes->channels[i];
        if (profile_is_ready(scene->nodes, i, PDCP_INPUT) && channel->link == PDCP_LINK_ACTIVE &&
            profile_is_ready(scene->nodes, channel->feed, PDCP_OUTPUT) && !get_bit(scene->made, i)) {
            link_input(work, i, channel->feed);
        }
    }
    find_ends(work);
    forget_stand_ins(work);
}

/* What a plan takes away may make room for what it has passed over: it goes round until nothing changes. */
void profile_plan_make(profile_plan_t *plan, const profile_scene_t *scene, uint8_t what)
{
    work_t work;
    uint8_t before[PDCP_CHANNELS_MAX];
    uint8_t rounds = ROUNDS_MAX;
    bool named;
    look(&work, plan, scene);
    do {
        named = false;
        memcpy(before, plan->want, sizeof before);
        if ((what & PROFILE_PLAN_ORIGINALS) != 0) {
            bring_back_all(&work);
        }
        if ((what & PROFILE_PLAN_REPLACE) != 0) {
            repair_all(&work);
            named = name_stand_ins(&work);
        }
        settle(&work);
        if ((what & PROFILE_PLAN_AUTO) != 0) {
            autoconfigure(&work);
        }
        rounds--;
    } while (rounds != 0 && (named || memcmp(before, plan->want, sizeof before) != 0));
    forget_stand_ins(&work);
}

/* An input gives up its source, in the configuration too. */
static void drop(work_t *work, uint8_t input)
{
    const uint8_t entry = profile_links_of(work->scene->links, work->nodes, input);
    unlink_input(work, input);
    if (entry != PDCP_NONE) {
        profile_links_remove(work->scene->links, entry);
    }
}

void profile_plan_enforce(profile_plan_t *plan, const profile_scene_t *scene)
{
    work_t work;
    look(&work, plan, scene);
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t output = plan->want[i];
        if (output == PDCP_NONE || !profile_is_sole(&scene->nodes->channels[i])) {
            continue;
        }
        for (uint8_t k = 0; k < PDCP_CHANNELS_MAX; k++) {
            if (plan->want[k] == output && k != i && profile_is_sole(&scene->nodes->channels[k])) {
                drop(&work, profile_is_before(scene->nodes, k, i) ? i : k);
            }
        }
    }
    find_ends(&work);
    settle(&work);
    forget_stand_ins(&work);
}

bool profile_breaks_sole_access(const pdcp_nodes_t *nodes, uint8_t output, uint8_t input)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX && profile_is_sole(&nodes->channels[input]); i++) {
        const pdcp_channel_t *other = &nodes->channels[i];
        if (i != input && profile_is_ready(nodes, i, PDCP_INPUT) && other->link == PDCP_LINK_ACTIVE &&
            other->feed == output && profile_is_sole(other)) {
            return true;
        }
    }
    return false;
}
