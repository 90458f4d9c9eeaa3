#include "profile_plan.h"

#include <stddef.h>
#include <string.h>

#include "profile_match.h"

/* Where the source of an input comes from, in this order (D-PRO-9). */
typedef enum {
    SOURCE_GIVEN,       /* the phase's output */
    SOURCE_ORIGINAL,    /* the one that the active configuration names */
    SOURCE_REPLACEMENT, /* the most similar to the one that it names, which is missing */
    SOURCE_SIMILAR      /* the most similar to the input itself */
} source_t;

/* What a new link needs, in this order; with no more needs it holds. Before, its output is chosen. */
typedef enum {
    NEED_BY_OUTPUT,
    NEED_BY_INPUT,
    DESIRED_BY_OUTPUT,
    DESIRED_BY_INPUT,
    NEEDS_END,
    CHOOSING = NEEDS_END
} need_t;

/* Where a plan is at. Each phase does one unit of its work at a time. */
typedef enum {
    PHASE_LOOK,    /* which links work */
    PHASE_AWAITED, /* which ends are awaited */
    PHASE_ROUND,   /* a round consists of these: */
    PHASE_ENFORCE,
    PHASE_ORIGINAL,
    PHASE_REPAIR,
    PHASE_SETTLE,
    PHASE_AUTO,
    PHASE_ROUND_END,
    PHASE_ORIGINAL_TAKE,  /* what an original replaces goes, */
    PHASE_ORIGINAL_LINK,  /* it is linked, */
    PHASE_ORIGINAL_JUDGE, /* and was that worth it? */
    PHASE_REPAIR_CHOOSE,  /* the next entry is repaired: */
    PHASE_REPAIR_INPUT,   /* an input stands in, */
    PHASE_REPAIR_LINK,    /* and is linked */
    PHASE_NAME,
    PHASE_FINISH,
    PHASE_DONE
} phase_t;

enum {
    ROUNDS_MAX = 8,
    ALWAYS = 0x80,  /* beside profile_plan_what_t: in every plan */
    NOT_YET = 0xFE, /* no channel has this number: the slice is over, the same is to be asked again */
    /* Efforts. */
    EFFORT_FIND = 8, /* to find an entry or the channel of an end */
    EFFORT_SCAN = 24 /* to look for something among all entries or channels */
};

static const pdcp_channel_t *channel_of(const profile_plan_t *plan, uint8_t channel)
{
    return &plan->nodes->channels[channel];
}

static profile_entry_t *entry_at(const profile_plan_t *plan, uint8_t number)
{
    return &plan->links->entries[number];
}

static bool is_ready(const profile_plan_t *plan, uint8_t channel, uint8_t transfer)
{
    return profile_is_ready(plan->nodes, channel, transfer);
}

/* --- Ends of the configuration --- */

/* The entry of an input, PDCP_NONE: it is nobody's. */
static uint8_t entry_of(profile_plan_t *plan, uint8_t input)
{
    plan->left -= EFFORT_FIND;
    return profile_links_of(plan->links, plan->nodes, input);
}

/* Channel number of the output that an entry names, PDCP_NONE: missing. */
static uint8_t output_of(profile_plan_t *plan, uint8_t entry)
{
    plan->left -= EFFORT_FIND;
    return profile_links_channel(plan->links, plan->nodes, &entry_at(plan, entry)->output, PDCP_OUTPUT);
}

/* Notes both ends of the entry that the phase is at. */
static void look_at_ends(profile_plan_t *plan)
{
    plan->left -= EFFORT_FIND;
    plan->input =
        profile_links_channel(plan->links, plan->nodes, &entry_at(plan, plan->at)->input, PDCP_INPUT);
    plan->output = output_of(plan, plan->at);
}

/* Is this input linked to the output that an entry names? */
static bool hears_output_of(const profile_plan_t *plan, uint8_t input, uint8_t entry)
{
    const uint8_t output = plan->want[input];
    if (output == PDCP_NONE) {
        return false;
    }
    return profile_links_name(plan->links, plan->nodes, &entry_at(plan, entry)->output, output);
}

/* --- Links of the plan --- */

/* Another input that wants the output for itself and has it, if this one wants it for itself; PDCP_NONE:
 * there is none. */
static uint8_t rival_of(profile_plan_t *plan, uint8_t input, uint8_t output)
{
    if (output == PDCP_NONE || !profile_is_sole(channel_of(plan, input))) {
        return PDCP_NONE;
    }
    plan->left -= EFFORT_SCAN;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (plan->want[i] == output && i != input && profile_is_sole(channel_of(plan, i))) {
            return i;
        }
    }
    return PDCP_NONE;
}

/* Gives an input another source, PDCP_NONE: none. The input PDCP_NONE stands for none. */
static void set_source(profile_plan_t *plan, uint8_t input, uint8_t output)
{
    if (input == PDCP_NONE) {
        return;
    }
    const uint8_t old = plan->want[input];
    plan->want[input] = output;
    if (!profile_is_sole(channel_of(plan, input))) {
        return;
    }
    if (old != PDCP_NONE && rival_of(plan, input, old) == PDCP_NONE) {
        pdcp_set_bit(plan->taken, old, false);
    }
    if (output != PDCP_NONE) {
        pdcp_set_bit(plan->taken, output, true);
    }
}

/* May this output feed this input? They are of different devices and unbanned, and sole access is respected
 * [PROFILE listing 4.4]. Both are set up. */
static bool may_link(const profile_plan_t *plan, uint8_t output, uint8_t input)
{
    const pdcp_channel_t *to = channel_of(plan, input);
    if (profile_scene_is_banned(plan->scene, output, input) ||
        (profile_is_sole(to) && pdcp_bit(plan->taken, output))) {
        return false;
    }
    return channel_of(plan, output)->node != to->node;
}

/* --- Searches --- */

/* May this input take the place of a missing one? It must be nobody's. */
static bool is_spare(profile_plan_t *plan, uint8_t input)
{
    if (plan->want[input] != PDCP_NONE) {
        return false;
    }
    const uint8_t entry = entry_of(plan, input);
    return entry == PDCP_NONE || (!plan->waits && output_of(plan, entry) == PDCP_NONE);
}

/* May a channel be linked to the partner, or is it terminal if there is none? */
static bool is_candidate(profile_plan_t *plan, uint8_t partner, uint8_t channel)
{
    if (partner != PDCP_NONE && channel_of(plan, partner)->transfer == PDCP_INPUT) {
        return is_ready(plan, channel, PDCP_OUTPUT) && may_link(plan, channel, partner);
    }
    if (!is_ready(plan, channel, PDCP_INPUT)) {
        return false;
    }
    if (partner == PDCP_NONE) {
        return profile_is_terminal(channel_of(plan, channel));
    }
    return is_spare(plan, channel) && may_link(plan, partner, channel);
}

/* Channels are searched in the order of their likeness to an end, terminal ones (NULL) in that in which they
 * are served: the highest score first. */
static uint16_t score_of(const profile_plan_t *plan, const profile_ref_t *like, uint8_t channel)
{
    const pdcp_channel_t *entry = channel_of(plan, channel);
    return like != NULL ? profile_similarity(entry->type, entry->profile, like->type, like->profile)
                        : (uint16_t)~profile_priority(entry);
}

static bool comes_before(const profile_plan_t *plan, const profile_ref_t *like, uint8_t a, uint8_t b)
{
    const uint16_t first = score_of(plan, like, a);
    const uint16_t second = score_of(plan, like, b);
    return first != second ? first > second : profile_is_before(plan->nodes, a, b);
}

/* Notes the channel if it is the best one so far. */
static void compare(profile_plan_t *plan, const profile_ref_t *like, uint8_t channel)
{
    if (plan->best != PDCP_NONE) {
        if (!comes_before(plan, like, channel, plan->best)) {
            return;
        }
    } else if (like != NULL && score_of(plan, like, channel) < PROFILE_CANDIDATE_MIN) {
        return;
    }
    plan->best = channel;
}

/* The steps of the searches that follow. */
static void begin_search(profile_plan_t *plan)
{
    plan->search_left = (uint16_t)((PROFILE_PLAN_STEPS - plan->steps) / PROFILE_PLAN_SHARE);
}

/* Of the channels that may be linked to the partner, the one that comes next behind `tried` in their likeness
 * to an end; without a partner (PDCP_NONE, NULL) the next terminal one. tried: PDCP_NONE for the first one.
 * PDCP_NONE: there are no more. The search goes on at search_at, where it begins if that is 0. It looks at
 * one channel at least, however short the slice. */
static uint8_t search(profile_plan_t *plan, uint8_t partner, const profile_ref_t *like, uint8_t tried)
{
    if (plan->search_at == 0) {
        plan->best = PDCP_NONE;
        if (partner != PDCP_NONE) {
            if (plan->search_left < PDCP_CHANNELS_MAX) {
                return PDCP_NONE;
            }
            plan->search_left = (uint16_t)(plan->search_left - PDCP_CHANNELS_MAX);
            plan->steps += PDCP_CHANNELS_MAX;
        }
    }
    do {
        const uint8_t c = plan->search_at;
        if (is_candidate(plan, partner, c)) {
            plan->left -= 4;
            if (tried == PDCP_NONE || comes_before(plan, like, tried, c)) {
                compare(plan, like, c);
            }
        }
        plan->left--;
        plan->search_at = (uint8_t)(c + 1u);
        if (plan->search_at == PDCP_CHANNELS_MAX) {
            plan->search_at = 0;
            return plan->best;
        }
    } while (plan->left > 0);
    return NOT_YET;
}

/* The next candidate of the kind of source that the top frame is at; PDCP_NONE: there are no more. */
static uint8_t next_source(profile_plan_t *plan)
{
    const profile_frame_t *top = &plan->top;
    const uint8_t entry = entry_of(plan, top->input);
    if (entry != PDCP_NONE && profile_scene_is_awaited(plan->scene, &entry_at(plan, entry)->output)) {
        return PDCP_NONE; /* its source will be back in a moment */
    }
    if (top->source == SOURCE_SIMILAR) {
        profile_ref_t like;
        like.type = channel_of(plan, top->input)->type;
        like.profile = channel_of(plan, top->input)->profile;
        return search(plan, top->input, &like, top->tried);
    }
    uint8_t output = plan->output;
    if (top->source != SOURCE_GIVEN) {
        if (entry == PDCP_NONE) {
            return PDCP_NONE;
        }
        output = output_of(plan, entry);
    }
    if (top->source == SOURCE_REPLACEMENT) {
        return output != PDCP_NONE ? PDCP_NONE
                                   : search(plan, top->input, &entry_at(plan, entry)->output, top->tried);
    }
    if (top->tried == PDCP_NONE && output != PDCP_NONE && may_link(plan, output, top->input)) {
        return output;
    }
    return PDCP_NONE;
}

/* --- Intelligently connect [PROFILE listing 4.5] --- */

/* An input is to be connected, on top of the others; the stack of frames replaces recursion. */
static void push(profile_plan_t *plan, uint8_t input, source_t first)
{
    plan->top.input = input;
    plan->top.source = (uint8_t)first;
    plan->top.tried = PDCP_NONE;
    plan->top.mark = plan->logged;
    plan->top.need = CHOOSING;
}

/* Where the bits of a frame stand in its byte. */
static unsigned below_shift(const profile_plan_t *plan)
{
    return plan->depth % 2u * 4u;
}

/* Of a frame below the top, only what cannot be found elsewhere is kept. */
static void descend(profile_plan_t *plan, uint8_t need)
{
    profile_frame_t *top = &plan->top;
    const unsigned shift = below_shift(plan);
    uint8_t *below = &plan->below[plan->depth / 2];
    *below = (uint8_t)((*below & ~(0xFu << shift)) | (unsigned)(top->source << 2 | top->need) << shift);
    plan->depth++;
    pdcp_set_bit(plan->open, top->mark, true);
    push(plan, need, SOURCE_ORIGINAL);
}

/* The top frame is done: back to the one below; below the last one the phase goes on. */
static void ascend(profile_plan_t *plan)
{
    profile_frame_t *top = &plan->top;
    if (plan->depth == 0) {
        plan->connecting = false;
        return;
    }
    plan->depth--;
    const unsigned kept = (unsigned)plan->below[plan->depth / 2] >> below_shift(plan);
    do {
        top->mark--;
    } while (!pdcp_bit(plan->open, top->mark));
    pdcp_set_bit(plan->open, top->mark, false);
    top->cursor = top->input;
    top->input = plan->log[top->mark];
    top->tried = plan->want[top->input];
    top->source = (uint8_t)(kept >> 2 & 3u);
    top->need = kept & 3u;
}

static void undo_to(profile_plan_t *plan, uint8_t mark)
{
    while (plan->logged > mark) {
        set_source(plan, plan->log[--plan->logged], PDCP_NONE);
    }
}

static bool is_connected(const profile_plan_t *plan, uint8_t input)
{
    return plan->want[input] != PDCP_NONE && !(plan->finding && pdcp_bit(plan->of.bits.gone, input));
}

/* The next unconnected input, behind the last one (PDCP_NONE: the first one), that the link of an input
 * needs; PDCP_NONE: there are no more. */
static uint8_t next_need(profile_plan_t *plan, uint8_t input, uint8_t need, uint8_t last)
{
    const uint8_t by = need % 2 == NEED_BY_OUTPUT ? plan->want[input] : input;
    const pdcp_node_t *owner = &plan->nodes->nodes[channel_of(plan, by)->node];
    if (owner->needs_stride == 0) {
        return PDCP_NONE;
    }
    uint8_t c = last != PDCP_NONE ? channel_of(plan, last)->next : owner->first_channel;
    while (c != PDCP_NONE) {
        const pdcp_channel_t *channel = channel_of(plan, c);
        plan->left--;
        if (!is_connected(plan, c) &&
            pdcp_nodes_needs(plan->nodes, by, need >= DESIRED_BY_OUTPUT, channel->index)) {
            break;
        }
        c = channel->next;
    }
    return c;
}

/* The link of the top frame does not hold: all that was made for it is undone, its next candidate is due. */
static void reject(profile_plan_t *plan)
{
    undo_to(plan, plan->top.mark);
    plan->top.need = CHOOSING;
}

/* A link that can be undone. */
static void link_input(profile_plan_t *plan, uint8_t input, uint8_t output)
{
    set_source(plan, input, output);
    plan->log[plan->logged++] = input;
}

/* Gives the input of the top frame its next candidate. */
static void choose(profile_plan_t *plan)
{
    profile_frame_t *top = &plan->top;
    const uint8_t output = next_source(plan);
    if (output == NOT_YET) {
        return;
    }
    top->tried = output;
    if (output != PDCP_NONE) {
        top->need = NEED_BY_OUTPUT;
        top->cursor = PDCP_NONE;
        link_input(plan, top->input, output);
    } else if (plan->depth != 0 && top->source < plan->needs_last) {
        top->source++;
    } else {
        ascend(plan);
        if (top->need < DESIRED_BY_OUTPUT) {
            reject(plan); /* what it required cannot be had */
        }
    }
}

/* Goes on with the top frame: to the next need of its link, required ones first. */
static void advance(profile_plan_t *plan)
{
    profile_frame_t *top = &plan->top;
    if (top->need == CHOOSING) {
        choose(plan);
        return;
    }
    top->cursor = next_need(plan, top->input, top->need, top->cursor);
    if (top->cursor == PDCP_NONE) {
        top->need++;
        if (top->need == NEEDS_END) {
            ascend(plan); /* the link holds */
        }
    } else if (plan->depth < PROFILE_PLAN_DEPTH - 1) {
        descend(plan, top->cursor);
    } else if (top->need < DESIRED_BY_OUTPUT) {
        reject(plan); /* too deep */
    }
}

/* Connects the phase's input and all that its link requires, and of what it desires as much as can be. Loops
 * end: an input that is being connected counts as connected. If it cannot be, nothing has changed when the
 * phase goes on. */
static void connect(profile_plan_t *plan, source_t source)
{
    plan->connecting = true;
    plan->depth = 0;
    plan->logged = 0;
    plan->needs_last = SOURCE_SIMILAR;
    begin_search(plan);
    push(plan, plan->input, source);
}

/* --- What links require --- */

/* The entry of an input that hears the output which it names; PDCP_NONE: it has none, or hears another one.
 */
static uint8_t original_of(profile_plan_t *plan, uint8_t input)
{
    const uint8_t entry = entry_of(plan, input);
    return entry != PDCP_NONE && hears_output_of(plan, input, entry) ? entry : PDCP_NONE;
}

/* Does the link of this input lack something that it requires, which takes it away? */
static bool is_lacking(profile_plan_t *plan, uint8_t input)
{
    if (!is_connected(plan, input)) {
        return false;
    }
    if (next_need(plan, input, NEED_BY_OUTPUT, PDCP_NONE) == PDCP_NONE &&
        next_need(plan, input, NEED_BY_INPUT, PDCP_NONE) == PDCP_NONE) {
        return false;
    }
    const uint8_t original = original_of(plan, input);
    if (original == PDCP_NONE) {
        return true;
    }
    return !entry_at(plan, original)->by_host;
}

/* Goes to the next entry or input of a phase. True: it was the last one, from the first one again. */
static bool was_last(profile_plan_t *plan, uint8_t count)
{
    plan->at++;
    if (plan->at < count) {
        return false;
    }
    plan->at = 0;
    return true;
}

static bool was_last_entry(profile_plan_t *plan)
{
    return was_last(plan, plan->links->count);
}

/* Begins to mark as gone the links that lack something they require, and those that require one of these. The
 * phase then goes on. */
static void find_gone(profile_plan_t *plan)
{
    memset(plan->of.bits.gone, 0, sizeof plan->of.bits.gone);
    plan->finding = true;
    plan->spoilt = false;
    plan->changed = false;
    plan->input_at = 0;
}

/* One input more, until nothing changes. */
static void find_next(profile_plan_t *plan)
{
    const uint8_t input = plan->input_at;
    if (is_lacking(plan, input)) {
        pdcp_set_bit(plan->of.bits.gone, input, true);
        plan->changed = true;
        if (input == plan->input ||
            (!pdcp_bit(plan->of.bits.lacking, input) && original_of(plan, input) != PDCP_NONE)) {
            plan->spoilt = true;
        }
    }
    plan->input_at++;
    if (plan->input_at == PDCP_CHANNELS_MAX) {
        plan->input_at = 0;
        plan->finding = plan->changed;
        plan->changed = false;
    }
}

/* Goes to the part of a round that comes behind this one, of those that are to be planned. */
static void go_on(profile_plan_t *plan, phase_t done)
{
    static const uint8_t whats[] = {
        [PHASE_ENFORCE] = PROFILE_PLAN_ENFORCE, [PHASE_ORIGINAL] = PROFILE_PLAN_ORIGINALS,
        [PHASE_REPAIR] = PROFILE_PLAN_REPLACE,  [PHASE_SETTLE] = ALWAYS,
        [PHASE_AUTO] = PROFILE_PLAN_AUTO,
    };
    uint8_t phase = (uint8_t)done;
    do {
        phase++;
    } while (phase != (uint8_t)PHASE_ROUND_END && (plan->what & whats[phase]) == 0);
    plan->phase = phase;
    plan->pass = 0;
    plan->input = PDCP_NONE;
}

/* --- Originals [PROFILE listing 4.3], D-PRO-6 --- */

/* Does this input stand in for a missing one? */
static bool stands_in(profile_plan_t *plan, uint8_t input)
{
    plan->left -= EFFORT_FIND;
    return memchr(plan->stand_in, input, plan->links->count) != NULL;
}

/* Inputs that do not stand in any more. */
static void forget_stand_ins(profile_plan_t *plan)
{
    uint8_t *stand_in = plan->stand_in;
    for (uint8_t e = 0; e < plan->links->count; e++, stand_in++) {
        if (*stand_in != PDCP_NONE && !hears_output_of(plan, *stand_in, e)) {
            *stand_in = PDCP_NONE;
        }
    }
    plan->left -= EFFORT_SCAN;
}

static void next_original(profile_plan_t *plan)
{
    plan->phase = PHASE_ORIGINAL;
    plan->at++;
}

/* The rival of the input, if its source only stands in for the one that the configuration names, or the rival
 * itself for another input; PDCP_NONE: there is none. */
static uint8_t rival_to_go(profile_plan_t *plan)
{
    const uint8_t rival = rival_of(plan, plan->input, plan->output);
    if (rival == PDCP_NONE) {
        return PDCP_NONE;
    }
    const uint8_t own = entry_of(plan, rival);
    if (own != PDCP_NONE ? hears_output_of(plan, rival, own) : !stands_in(plan, rival)) {
        return PDCP_NONE;
    }
    return rival;
}

/* Makes a link of the configuration whose ends are both there, in the second pass a terminal one, if there is
 * something to bring back; what stood in for them goes. */
static void bring_back(profile_plan_t *plan)
{
    if (plan->at >= plan->links->count) {
        plan->at = 0;
        plan->pass++;
        if (plan->pass == 2) {
            go_on(plan, PHASE_ORIGINAL);
        }
        return;
    }
    look_at_ends(plan);
    const uint8_t input = plan->input;
    const uint8_t *stand_in = &plan->stand_in[plan->at];
    if (input == PDCP_NONE || plan->output == PDCP_NONE ||
        profile_is_terminal(channel_of(plan, input)) != plan->pass ||
        (plan->want[input] == plan->output && *stand_in == PDCP_NONE)) {
        next_original(plan);
        return;
    }
    forget_stand_ins(plan);
    plan->phase = PHASE_ORIGINAL_TAKE;
    plan->source = plan->want[input];
    plan->rival = rival_to_go(plan);
    plan->costs = false;
    if (plan->rival != PDCP_NONE || plan->source != PDCP_NONE || *stand_in != PDCP_NONE) {
        plan->costs = true;
        find_gone(plan);
    }
}

/* Gives what an original replaces its sources back, or takes them away (PDCP_NONE). */
static void set_replaced(profile_plan_t *plan, uint8_t output, uint8_t source)
{
    set_source(plan, plan->rival, output);
    set_source(plan, plan->stand_in[plan->at], output);
    set_source(plan, plan->input, source);
}

/* What a terminal one needs is searched for; another one must find it connected, or in other originals. */
static void take_for_original(profile_plan_t *plan)
{
    memcpy(plan->of.bits.lacking, plan->of.bits.gone, sizeof plan->of.bits.lacking);
    set_replaced(plan, PDCP_NONE, PDCP_NONE);
    connect(plan, SOURCE_GIVEN);
    if (!profile_is_terminal(channel_of(plan, plan->input))) {
        plan->needs_last = SOURCE_ORIGINAL;
    }
    plan->phase = PHASE_ORIGINAL_LINK;
}

/* What the host has made needs nothing (D-PRO-9). */
static void link_original(profile_plan_t *plan)
{
    const uint8_t input = plan->input;
    if (plan->want[input] == PDCP_NONE && entry_at(plan, plan->at)->by_host &&
        may_link(plan, plan->output, input)) {
        link_input(plan, input, plan->output);
    }
    plan->phase = PHASE_ORIGINAL_JUDGE;
    plan->spoilt = true;
    if (plan->want[input] != PDCP_NONE) {
        plan->spoilt = false;
        if (plan->costs) {
            find_gone(plan);
        }
    }
}

/* Is the original linked with all that it requires, and has no other one lost what it had (D-PRO-24)? */
static void judge_original(profile_plan_t *plan)
{
    if (plan->spoilt) {
        undo_to(plan, 0);
        set_replaced(plan, plan->output, plan->source);
    } else {
        plan->stand_in[plan->at] = PDCP_NONE;
    }
    next_original(plan);
}

/* --- Replacements [PROFILE listing 4.6], D-PRO-10 --- */

/* The missing end of a link that has exactly one, and nothing that stands in for the other; NULL: it is not
 * broken. Notes its ends. */
static const profile_ref_t *broken_end(profile_plan_t *plan)
{
    const profile_entry_t *entry = entry_at(plan, plan->at);
    const profile_ref_t *missing = &entry->output;
    look_at_ends(plan);
    if (plan->input == PDCP_NONE) {
        missing = &entry->input;
        if (plan->output == PDCP_NONE || plan->stand_in[plan->at] != PDCP_NONE) {
            return NULL;
        }
    } else if (plan->output != PDCP_NONE || plan->want[plan->input] != PDCP_NONE) {
        return NULL;
    }
    return profile_scene_is_awaited(plan->scene, missing) ? NULL : missing;
}

/* How alike the two ends would be with the best replacement, plus 1; 0: there is none. NOT_YET. */
static uint8_t repair_key(profile_plan_t *plan)
{
    if (plan->search_at == 0) {
        begin_search(plan);
    }
    const profile_ref_t *missing = broken_end(plan);
    if (missing == NULL) {
        return 0;
    }
    const uint8_t partner = plan->input != PDCP_NONE ? plan->input : plan->output;
    const uint8_t best = search(plan, partner, missing, PDCP_NONE);
    if (best == NOT_YET) {
        return NOT_YET;
    }
    if (best == PDCP_NONE) {
        return 0;
    }
    const pdcp_channel_t *one = channel_of(plan, partner);
    const pdcp_channel_t *other = channel_of(plan, best);
    return (uint8_t)(profile_similarity(one->type, one->profile, other->type, other->profile) + 1u);
}

/* Which links are to be repaired first: those whose repaired ends are most alike. */
static void sort_repairs(profile_plan_t *plan)
{
    if (plan->at == 0 && plan->search_at == 0) {
        forget_stand_ins(plan);
    }
    if (plan->at < plan->links->count) {
        const uint8_t key = repair_key(plan);
        if (key == NOT_YET) {
            return;
        }
        plan->of.keys[plan->at] = key;
    }
    if (was_last_entry(plan)) {
        plan->phase = PHASE_REPAIR_CHOOSE;
    }
}

static void repair(profile_plan_t *plan)
{
    uint8_t best_key = 0;
    for (uint8_t e = 0; e < plan->links->count; e++) {
        if (plan->of.keys[e] > best_key) {
            best_key = plan->of.keys[e];
            plan->at = e;
        }
    }
    plan->left -= EFFORT_FIND;
    if (best_key == 0) {
        plan->at = 0;
        plan->phase = PHASE_NAME;
        return;
    }
    plan->of.keys[plan->at] = 0;
    if (broken_end(plan) == NULL) { /* it may have been connected as a need of another */
        return;
    }
    if (plan->input != PDCP_NONE) {
        connect(plan, SOURCE_REPLACEMENT);
        return;
    }
    begin_search(plan);
    plan->phase = PHASE_REPAIR_INPUT; /* input is PDCP_NONE: none was tried yet */
}

static void try_input(profile_plan_t *plan)
{
    const uint8_t input = search(plan, plan->output, &entry_at(plan, plan->at)->input, plan->input);
    if (input == NOT_YET) {
        return;
    }
    plan->phase = PHASE_REPAIR_CHOOSE;
    if (input != PDCP_NONE) {
        plan->input = input;
        plan->phase = PHASE_REPAIR_LINK;
        connect(plan, SOURCE_GIVEN);
    }
}

static void end_try(profile_plan_t *plan)
{
    plan->phase = PHASE_REPAIR_INPUT;
    if (plan->want[plan->input] != PDCP_NONE) {
        plan->stand_in[plan->at] = plan->input;
        plan->phase = PHASE_REPAIR_CHOOSE;
    }
}

/* The input, nobody's, that the output feeds and that is most like the missing one; PDCP_NONE: there is none.
 */
static uint8_t fed_instead(profile_plan_t *plan)
{
    plan->best = PDCP_NONE;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        if (plan->want[i] == plan->output && !stands_in(plan, i) && entry_of(plan, i) == PDCP_NONE) {
            compare(plan, &entry_at(plan, plan->at)->input, i);
        }
    }
    plan->left -= EFFORT_SCAN;
    return plan->best;
}

/* An output whose input is missing may have been connected as what a replacement requires: it stands in, too,
 * and goes when the original comes back. */
static void name_stand_in(profile_plan_t *plan)
{
    uint8_t *stand_in = &plan->stand_in[plan->at];
    if (plan->at < plan->links->count && *stand_in == PDCP_NONE) {
        look_at_ends(plan);
        if (plan->input == PDCP_NONE && plan->output != PDCP_NONE) {
            *stand_in = fed_instead(plan);
            if (*stand_in != PDCP_NONE) {
                plan->named = true;
            }
        }
    }
    if (was_last_entry(plan)) {
        go_on(plan, PHASE_REPAIR);
    }
}

/* --- Autoconfiguration [PROFILE listing 4.7] --- */

static void autoconfigure(profile_plan_t *plan)
{
    const uint8_t input = search(plan, PDCP_NONE, NULL, plan->input);
    if (input == NOT_YET) {
        return;
    }
    plan->input = input;
    if (input == PDCP_NONE) {
        go_on(plan, PHASE_AUTO);
    } else if (plan->want[input] == PDCP_NONE && !(plan->waits && entry_of(plan, input) != PDCP_NONE)) {
        connect(plan, SOURCE_SIMILAR);
    }
}

/* --- The whole --- */

/* A hash (FNV-1a) of the links of a plan, or of those that work. */
static uint32_t hash_links(const profile_plan_t *plan, const profile_scene_t *scene)
{
    uint32_t sum = 2166136261uL;
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        sum = (sum ^ (plan != NULL ? plan->want[i] : profile_scene_feed(scene, i))) * 16777619uL;
    }
    return sum;
}

static uint32_t hash_want(profile_plan_t *plan)
{
    plan->left -= 2 * EFFORT_SCAN;
    return hash_links(plan, NULL);
}

static void look(profile_plan_t *plan)
{
    set_source(plan, plan->at, profile_scene_feed(plan->scene, plan->at));
    if (was_last(plan, PDCP_CHANNELS_MAX)) {
        plan->base = hash_want(plan);
        plan->before = plan->base;
        plan->phase = PHASE_AWAITED;
    }
}

static void find_awaited(profile_plan_t *plan)
{
    const profile_entry_t *entry = entry_at(plan, plan->at);
    if (plan->at < plan->links->count) {
        plan->left -= 2 * EFFORT_FIND;
        if (profile_scene_is_awaited(plan->scene, &entry->output) ||
            profile_scene_is_awaited(plan->scene, &entry->input)) {
            plan->waits = true;
        }
    }
    if (was_last_entry(plan)) {
        forget_stand_ins(plan);
        go_on(plan, PHASE_ROUND);
    }
}

/* Takes away, until nothing changes, links that require an input which is not connected (D-PRO-9). A loop in
 * which all are connected stays. */
static void settle(profile_plan_t *plan)
{
    if (is_lacking(plan, plan->at)) {
        set_source(plan, plan->at, PDCP_NONE);
        plan->changed = true;
    }
    if (was_last(plan, PDCP_CHANNELS_MAX)) {
        if (plan->changed) {
            plan->changed = false;
        } else {
            go_on(plan, PHASE_SETTLE);
        }
    }
}

/* What a plan takes away may make room for what it has passed over: it goes round until nothing changes. */
static void end_round(profile_plan_t *plan)
{
    const uint32_t now = hash_want(plan);
    plan->rounds++;
    if (plan->rounds == ROUNDS_MAX || (now == plan->before && !plan->named)) {
        plan->phase = PHASE_FINISH;
    } else {
        plan->before = now;
        plan->named = false;
        go_on(plan, PHASE_ROUND);
    }
}

/* Of the sole-access inputs of one output the first one keeps it. The others are marked as gone: when the
 * plan is done they give it up in the configuration, too. */
static void enforce(profile_plan_t *plan)
{
    const uint8_t rival = rival_of(plan, plan->at, plan->want[plan->at]);
    if (rival != PDCP_NONE) {
        const uint8_t last = profile_is_before(plan->nodes, rival, plan->at) ? plan->at : rival;
        set_source(plan, last, PDCP_NONE);
        pdcp_set_bit(plan->of.bits.gone, last, true);
    } else if (was_last(plan, PDCP_CHANNELS_MAX)) {
        go_on(plan, PHASE_ENFORCE);
    }
}

static void remove_dropped(const profile_plan_t *plan)
{
    for (uint8_t i = 0; i < PDCP_CHANNELS_MAX; i++) {
        const uint8_t entry =
            pdcp_bit(plan->of.bits.gone, i) ? profile_links_of(plan->links, plan->nodes, i) : PDCP_NONE;
        if (entry != PDCP_NONE) {
            profile_links_remove(plan->links, entry);
        }
    }
}

static void finish(profile_plan_t *plan)
{
    forget_stand_ins(plan);
    for (uint8_t e = 0; e < plan->links->count; e++) {
        entry_at(plan, e)->stand_in = plan->stand_in[e];
    }
    if ((plan->what & PROFILE_PLAN_ENFORCE) != 0) {
        remove_dropped(plan);
    }
    plan->phase = PHASE_DONE;
}

/* A unit of the phase that the plan is at. */
static void do_phase(profile_plan_t *plan)
{
    switch ((phase_t)plan->phase) {
    case PHASE_LOOK:
        look(plan);
        break;
    case PHASE_AWAITED:
        find_awaited(plan);
        break;
    case PHASE_ORIGINAL:
        bring_back(plan);
        break;
    case PHASE_REPAIR:
        sort_repairs(plan);
        break;
    case PHASE_SETTLE:
        settle(plan);
        break;
    case PHASE_AUTO:
        autoconfigure(plan);
        break;
    case PHASE_ROUND_END:
        end_round(plan);
        break;
    case PHASE_ORIGINAL_TAKE:
        take_for_original(plan);
        break;
    case PHASE_ORIGINAL_LINK:
        link_original(plan);
        break;
    case PHASE_ORIGINAL_JUDGE:
        judge_original(plan);
        break;
    case PHASE_REPAIR_CHOOSE:
        repair(plan);
        break;
    case PHASE_REPAIR_INPUT:
        try_input(plan);
        break;
    case PHASE_REPAIR_LINK:
        end_try(plan);
        break;
    case PHASE_NAME:
        name_stand_in(plan);
        break;
    case PHASE_ENFORCE:
        enforce(plan);
        break;
    default:
        finish(plan);
        break;
    }
}

bool profile_plan_is_stale(profile_plan_t *plan, const profile_scene_t *scene)
{
    const pdcp_node_t *node = scene->nodes->nodes;
    bool stale = false;
    for (uint8_t i = 0; i < PDCP_DEVICES_MAX; i++, node++) {
        const bool ready = node->state == PDCP_NODE_READY;
        if (ready != pdcp_bit(plan->ready, i)) {
            pdcp_set_bit(plan->ready, i, ready);
            stale = true;
        }
    }
    return stale;
}

void profile_plan_begin(profile_plan_t *plan, const profile_scene_t *scene, uint8_t what)
{
    memset(plan, 0, sizeof *plan);
    memset(plan->want, PDCP_NONE, sizeof plan->want);
    plan->what = what | ALWAYS;
    (void)profile_plan_is_stale(plan, scene); /* notes which devices are set up */
    for (uint8_t e = 0; e < scene->links->count; e++) {
        plan->stand_in[e] = scene->links->entries[e].stand_in;
    }
}

bool profile_plan_step(profile_plan_t *plan, const profile_scene_t *scene, int16_t effort)
{
    plan->scene = scene;
    plan->nodes = scene->nodes;
    plan->links = scene->links;
    plan->left = effort;
    while (plan->phase != PHASE_DONE && plan->left > 0) {
        plan->left--;
        if (plan->connecting) {
            advance(plan);
        } else if (plan->finding) {
            find_next(plan);
        } else {
            do_phase(plan);
        }
    }
    return plan->phase == PHASE_DONE;
}

bool profile_plan_links_differ(const profile_plan_t *plan, const profile_scene_t *scene)
{
    return hash_links(NULL, scene) != plan->base;
}
