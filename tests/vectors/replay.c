/* Replays a golden exchange against an arbitrator in virtual time; README.md says how the logs are written.
 *
 * Frames marked R are handed in at their time, frames marked T must leave exactly at their time and in this
 * order, and nothing else may leave. Exit status: 0 it did, 1 it did not or the log makes no sense, 2 wrong
 * use. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pdcp_arb.h"
#include "pdcp_bind.h"
#include "pdcp_link.h"

#define CLOCK_MS 0xFFFFF000uL /* the arbitrator's clock at the log's 0: it wraps after four seconds */

enum {
    SEED = 253,   /* the first output gets id 254, the next ones count downwards (D-BUS-36) */
    SERIAL = 256, /* of the arbitrator: bind requests are held for 5 ms, its standby ends after 1856 ms
                     (D-BUS-42) */
    LINE_SIZE = 256,
    WORDS_MAX = 5,
    OUTCOMES_MAX = 8,
    INCLUDES_MAX = 8,
    FRAME_TEXT_SIZE = 32
};

/* What the arbitrator has told about a request of the host. */
typedef struct {
    pdcp_status_t status;
    uint16_t len;
} outcome_t;

typedef struct {
    pdcp_arb_t arb;
    uint32_t now_ms;      /* on the log's clock */
    uint32_t deadline_ms; /* on the arbitrator's clock: as its last step said */
    bool hide_beacons;
    outcome_t outcomes[OUTCOMES_MAX]; /* not yet asked for with "done" */
    size_t outcome_count;
    size_t frame_count;
    uint8_t value[PDCP_PARAMETER_MAX]; /* of the host's request */
    const char *path;                  /* of the log being read, and its line */
    unsigned line;
    unsigned depth; /* of includes */
} replay_t;

static void fail(const replay_t *replay, const char *format, ...)
{
    va_list arguments;
    (void)fprintf(stderr, "%s:%u: at %u ms: ", replay->path, replay->line, (unsigned)replay->now_ms);
    va_start(arguments, format);
    (void)vfprintf(stderr, format, arguments);
    va_end(arguments);
    (void)fputc('\n', stderr);
    exit(EXIT_FAILURE);
}

static void on_event(void *ctx, uint32_t now_ms, const pdcp_event_t *event)
{
    replay_t *replay = ctx;
    (void)now_ms;
    if (event->kind != PDCP_EVENT_REQUEST && event->kind != PDCP_EVENT_LINK_REQUEST &&
        event->kind != PDCP_EVENT_RESET) {
        return;
    }
    if (replay->outcome_count == OUTCOMES_MAX) {
        fail(replay, "more than %d outcomes without a line \"done\"", OUTCOMES_MAX);
    }
    replay->outcomes[replay->outcome_count].status = (pdcp_status_t)event->status;
    replay->outcomes[replay->outcome_count].len = event->kind == PDCP_EVENT_REQUEST ? event->len : 0;
    replay->outcome_count++;
}

/* Words and numbers */

/* Returns how many words there are, room + 1 if more than fit; those that are missing are empty. */
static size_t split(char *line, char *words[], size_t room)
{
    size_t count = 0;
    for (size_t i = 0; i < room; i++) {
        words[i] = line + strlen(line);
    }
    char *at = line + strspn(line, " \t\r\n");
    while (*at != '\0' && count < room) {
        words[count++] = at;
        at += strcspn(at, " \t\r\n");
        if (*at != '\0') {
            *at++ = '\0';
        }
        at += strspn(at, " \t\r\n");
    }
    return *at == '\0' ? count : room + 1;
}

/* The number at the start of text, which the character behind must end. */
static uint32_t number(const replay_t *replay, const char *text, int base, uint32_t max, char behind)
{
    char *end;
    const unsigned long value = strtoul(text, &end, base);
    if (end == text || *end != behind || value > max) {
        fail(replay, "\"%s\" is no number, or too large", text);
    }
    return (uint32_t)value;
}

static uint8_t byte_of(const replay_t *replay, const char *word)
{
    return (uint8_t)number(replay, word, 16, 0xFF, '\0');
}

/* Pairs of hexadecimal digits. Returns how many bytes. */
static uint16_t bytes_of(const replay_t *replay, const char *text, uint8_t *bytes, size_t room)
{
    const size_t len = strlen(text);
    if (len % 2 != 0 || len / 2 > room) {
        fail(replay, "\"%s\" has half a byte, or too many", text);
    }
    for (size_t i = 0; i < len / 2; i++) {
        const char pair[3] = {text[2 * i], text[2 * i + 1], '\0'};
        bytes[i] = byte_of(replay, pair);
    }
    return (uint16_t)(len / 2);
}

/* Seconds with six decimals, of whole milliseconds. */
static uint32_t time_of(const replay_t *replay, const char *text, char behind)
{
    const char *point = strchr(text, '.');
    if (point == NULL || strcspn(point + 1, ")") != 6) {
        fail(replay, "\"%s\" is no time with six decimals", text);
        return 0;
    }
    const uint32_t seconds = number(replay, text, 10, 1000000, '.');
    const uint32_t micros = number(replay, point + 1, 10, 999999, behind);
    if (micros % 1000 != 0) {
        fail(replay, "times are whole milliseconds");
    }
    return seconds * 1000 + micros / 1000;
}

/* A frame as candump writes it: 123#1122, 00000123#1122 extended, 123#R remote, 123##1122 CAN FD. */
static can_frame_t frame_of(const replay_t *replay, const char *text)
{
    can_frame_t frame;
    const size_t digits = strcspn(text, "#");
    memset(&frame, 0, sizeof frame);
    if (text[digits] != '#' || (digits != 3 && digits != 8)) {
        fail(replay, "\"%s\" is no frame", text);
    }
    if (digits == 8) {
        frame.kind = CAN_FRAME_EXTENDED;
    } else if (text[digits + 1] == 'R') {
        frame.kind = CAN_FRAME_REMOTE;
    } else if (text[digits + 1] == '#') {
        frame.kind = CAN_FRAME_FD;
    } else {
        frame.id = (uint16_t)number(replay, text, 16, CAN_FRAME_ID_MAX, '#');
    }
    if (frame.kind == CAN_FRAME_BASE || frame.kind == CAN_FRAME_EXTENDED) {
        frame.dlc = (uint8_t)bytes_of(replay, &text[digits + 1], frame.data, sizeof frame.data);
    }
    return frame;
}

static void to_text(const can_frame_t *frame, char *text)
{
    int used = snprintf(text, FRAME_TEXT_SIZE, "%03X#", frame->id);
    for (uint8_t i = 0; i < frame->dlc && used > 0 && used < FRAME_TEXT_SIZE; i++) {
        used += snprintf(&text[used], (size_t)(FRAME_TEXT_SIZE - used), "%02X", frame->data[i]);
    }
}

/* Time and frames */

static uint32_t clock_ms(const replay_t *replay)
{
    return (uint32_t)(CLOCK_MS + replay->now_ms);
}

static void step(replay_t *replay)
{
    replay->deadline_ms = pdcp_arb_step(&replay->arb, clock_ms(replay));
}

static bool is_beacon(const can_frame_t *frame)
{
    return frame->id == 0x100 && frame->dlc == 1 && frame->data[0] == 0x0A;
}

/* The frame that leaves next, NULL: none. Beacons that are hidden are taken away. */
static const can_frame_t *leaving(replay_t *replay, bool beacons_too)
{
    const can_frame_t *frame = pdcp_arb_tx_peek(&replay->arb);
    while (frame != NULL && replay->hide_beacons && !beacons_too && is_beacon(frame)) {
        pdcp_arb_tx_pop(&replay->arb);
        frame = pdcp_arb_tx_peek(&replay->arb);
    }
    return frame;
}

static void expect_nothing(replay_t *replay)
{
    char have[FRAME_TEXT_SIZE];
    const can_frame_t *frame = leaving(replay, false);
    if (frame != NULL) {
        to_text(frame, have);
        fail(replay, "%s leaves, which the log does not have here", have);
    }
}

/* Millisecond by millisecond, so that nothing can leave late or unseen; and nothing may leave that the last
 * step had not announced. */
static void advance(replay_t *replay, uint32_t to_ms)
{
    if (to_ms < replay->now_ms) {
        fail(replay, "%u ms has passed already", (unsigned)to_ms);
    }
    while (replay->now_ms < to_ms) {
        expect_nothing(replay);
        replay->now_ms++;
        const bool due = (int32_t)(clock_ms(replay) - replay->deadline_ms) >= 0;
        step(replay);
        if (!due && pdcp_arb_tx_peek(&replay->arb) != NULL) {
            fail(replay, "a frame leaves earlier than the last step said");
        }
    }
}

static void receive(replay_t *replay, const can_frame_t *frame)
{
    expect_nothing(replay);
    if (pdcp_arb_on_frame(&replay->arb, clock_ms(replay), frame)) {
        step(replay);
    }
}

static void transmit(replay_t *replay, const can_frame_t *frame)
{
    char want[FRAME_TEXT_SIZE];
    char have[FRAME_TEXT_SIZE] = "nothing";
    const can_frame_t *sent = leaving(replay, is_beacon(frame));
    to_text(frame, want);
    if (sent != NULL) {
        to_text(sent, have);
    }
    if (strcmp(want, have) != 0) {
        fail(replay, "%s leaves instead of %s", have, want);
    }
    pdcp_arb_tx_pop(&replay->arb);
}

/* What comes from outside */

static uint8_t place_of(const replay_t *replay, const char *word, char behind)
{
    uint8_t place;
    const uint8_t id = (uint8_t)number(replay, word, 16, 0xFF, behind);
    if (!pdcp_tables_owner(&replay->arb.bus.tables, id, &place) || place == PDCP_NONE) {
        fail(replay, "no device has the id %02X", id);
    }
    return place;
}

/* NODE.INDEX */
static uint8_t channel_of(const replay_t *replay, const char *word)
{
    const uint8_t place = place_of(replay, word, '.');
    const uint8_t index = byte_of(replay, strchr(word, '.') + 1);
    return pdcp_tables_channel(&replay->arb.bus.tables, place, index);
}

static void must(const replay_t *replay, bool accepted)
{
    if (!accepted) {
        fail(replay, "the arbitrator does not accept this");
    }
}

static void do_get(replay_t *replay, char *words[], size_t count)
{
    (void)count;
    must(replay, pdcp_arb_get(&replay->arb, place_of(replay, words[1], '\0'), byte_of(replay, words[2]),
                              byte_of(replay, words[3]), replay->value, sizeof replay->value) == PDCP_OK);
}

static void do_set(replay_t *replay, char *words[], size_t count)
{
    const uint16_t len = bytes_of(replay, words[4], replay->value, sizeof replay->value);
    (void)count;
    must(replay, pdcp_arb_set(&replay->arb, place_of(replay, words[1], '\0'), byte_of(replay, words[2]),
                              byte_of(replay, words[3]), replay->value, len) == PDCP_OK);
}

static void do_link(replay_t *replay, char *words[], size_t count)
{
    (void)count;
    must(replay, pdcp_arb_connect(&replay->arb, channel_of(replay, words[1]), channel_of(replay, words[2])) ==
                     PDCP_OK);
}

static void do_unlink(replay_t *replay, char *words[], size_t count)
{
    (void)count;
    pdcp_link_remove(&replay->arb.bus, channel_of(replay, words[1]));
}

static void command(replay_t *replay, const char *node, uint8_t code, uint16_t time_ms)
{
    if (byte_of(replay, node) == PDCP_NODE_BROADCAST) {
        must(replay, pdcp_arb_broadcast(&replay->arb, code, time_ms));
    } else {
        must(replay, pdcp_arb_command(&replay->arb, place_of(replay, node, '\0'), code, time_ms) == PDCP_OK);
    }
}

static void do_suspend(replay_t *replay, char *words[], size_t count)
{
    (void)count;
    command(replay, words[1], PDCP_SUSPEND, (uint16_t)number(replay, words[2], 10, 0xFFFF, '\0'));
}

static void do_release(replay_t *replay, char *words[], size_t count)
{
    (void)count;
    command(replay, words[1], PDCP_RELEASE, 0);
}

static void do_reset(replay_t *replay, char *words[], size_t count)
{
    (void)count;
    must(replay, pdcp_arb_reset(&replay->arb, clock_ms(replay), place_of(replay, words[1], '\0')));
}

static void do_audit(replay_t *replay, char *words[], size_t count)
{
    (void)words;
    (void)count;
    pdcp_arb_audit(&replay->arb, clock_ms(replay));
}

/* VID:PID:SN */
static void do_remember(replay_t *replay, char *words[], size_t count)
{
    pdcp_remembered_t entry;
    const char *pid = strchr(words[1], ':');
    const char *serial = pid != NULL ? strchr(pid + 1, ':') : NULL;
    (void)count;
    if (serial == NULL) {
        fail(replay, "\"%s\" is no identity", words[1]);
        return;
    }
    entry.identity.vid = (uint16_t)number(replay, words[1], 16, 0xFFFF, ':');
    entry.identity.pid = (uint16_t)number(replay, pid + 1, 16, 0xFFFF, ':');
    entry.identity.sn = (uint16_t)number(replay, serial + 1, 16, 0xFFFF, '\0');
    entry.node_id = byte_of(replay, words[2]);
    must(replay, pdcp_bind_remember_stored(&replay->arb.bus.bind, &entry));
}

/* As many devices bind as there are places; their frames are not shown. */
static void do_full_bus(replay_t *replay, char *words[], size_t count)
{
    can_frame_t request = {.dlc = 7, .data = {0x01, 0x01, 0x00, 0x01, 0x00, 0x00, 0x00}};
    (void)words;
    (void)count;
    for (unsigned i = 1; i <= PDCP_DEVICES_MAX; i++) {
        request.id = (uint16_t)(0x600u + i);
        request.data[5] = (uint8_t)i;
        receive(replay, &request);
        while (pdcp_arb_tx_peek(&replay->arb) != NULL) {
            pdcp_arb_tx_pop(&replay->arb);
        }
    }
}

/* A device that says nothing and is not lost. */
static void do_in_service(replay_t *replay, char *words[], size_t count)
{
    static const pdcp_identity_t identity = {0xF000, 0xF000, 0xF000};
    pdcp_tables_t *tables = &replay->arb.bus.tables;
    (void)words;
    (void)count;
    if (tables->devices[PDCP_DEVICES_MAX - 1].state == PDCP_PLACE_FREE) {
        pdcp_tables_add(tables, PDCP_DEVICES_MAX - 1, &identity, 0xC8);
        tables->devices[PDCP_DEVICES_MAX - 1].state = PDCP_PLACE_READY;
        tables->devices[PDCP_DEVICES_MAX - 1].ack_ms = PDCP_ACK_MS;
    }
}

static void do_hide_beacons(replay_t *replay, char *words[], size_t count)
{
    (void)words;
    (void)count;
    replay->hide_beacons = true;
}

static void do_until(replay_t *replay, char *words[], size_t count)
{
    (void)words;
    (void)count;
    expect_nothing(replay); /* the time has moved on already */
}

/* The outcome of the oldest request that was not asked for yet. */
static void do_done(replay_t *replay, char *words[], size_t count)
{
    static const char *const names[] = {"ok", "no-answer", "refused", "bulk"}; /* by status, negated */
    uint8_t value[PDCP_PARAMETER_MAX];
    const uint16_t len = count > 2 ? bytes_of(replay, words[2], value, sizeof value) : 0;
    if (replay->outcome_count == 0) {
        fail(replay, "nothing has been done yet");
    }
    const outcome_t outcome = replay->outcomes[0];
    const unsigned index = (unsigned)-outcome.status;
    const char *name = index < sizeof names / sizeof names[0] ? names[index] : "something else";
    if (strcmp(name, words[1]) != 0) {
        fail(replay, "the outcome is %s, not %s", name, words[1]);
    }
    if (outcome.len != len || memcmp(replay->value, value, len) != 0) {
        fail(replay, "the value is another one, of %u bytes", (unsigned)outcome.len);
    }
    replay->outcome_count--;
    memmove(&replay->outcomes[0], &replay->outcomes[1], replay->outcome_count * sizeof replay->outcomes[0]);
}

static void play(replay_t *replay, const char *path);

static void do_include(replay_t *replay, char *words[], size_t count)
{
    char path[LINE_SIZE];
    const char *outer_path = replay->path;
    const unsigned outer_line = replay->line;
    const char *slash = strrchr(outer_path, '/');
    const int folder = slash != NULL ? (int)(slash - outer_path) + 1 : 0;
    (void)count;
    if (replay->depth == INCLUDES_MAX ||
        snprintf(path, sizeof path, "%.*s%s", folder, outer_path, words[1]) >= (int)sizeof path) {
        fail(replay, "includes too deep, or a path too long");
    }
    replay->depth++;
    play(replay, path);
    replay->depth--;
    replay->path = outer_path;
    replay->line = outer_line;
}

typedef struct {
    const char *name;
    size_t words; /* with the name */
    size_t more;  /* that may follow */
    bool happens; /* at the time of the next frame; otherwise now */
    void (*act)(replay_t *replay, char *words[], size_t count);
} action_t;

static const action_t actions[] = {
    {"include", 2, 0, false, do_include},  {"hide-beacons", 1, 0, false, do_hide_beacons},
    {"done", 2, 1, false, do_done},        {"until", 2, 0, true, do_until},
    {"get", 4, 0, true, do_get},           {"set", 5, 0, true, do_set},
    {"link", 3, 0, true, do_link},         {"unlink", 2, 0, true, do_unlink},
    {"suspend", 3, 0, true, do_suspend},   {"release", 2, 0, true, do_release},
    {"reset", 2, 0, true, do_reset},       {"remember", 3, 0, true, do_remember},
    {"full-bus", 1, 0, true, do_full_bus}, {"in-service", 1, 0, false, do_in_service},
    {"audit", 1, 0, true, do_audit},
};

/* Lines */

/* The time of this line, or of the next one behind it that has one. */
static uint32_t time_ahead(const replay_t *replay, FILE *log, const char *line)
{
    static const char until[] = "#! until ";
    const size_t skip = sizeof until - 1;
    char ahead[LINE_SIZE];
    const long at = ftell(log);
    (void)snprintf(ahead, sizeof ahead, "%s", line);
    while (ahead[0] != '(' && strncmp(ahead, until, skip) != 0) {
        if (fgets(ahead, sizeof ahead, log) == NULL) {
            fail(replay, "no frame and no \"until\" follows");
        }
    }
    if (at < 0 || fseek(log, at, SEEK_SET) != 0) {
        fail(replay, "cannot be read again");
    }
    ahead[strcspn(ahead, "\r\n")] = '\0';
    return ahead[0] == '(' ? time_of(replay, &ahead[1], ')') : time_of(replay, &ahead[skip], '\0');
}

static void play_action(replay_t *replay, FILE *log, const char *line)
{
    char *words[WORDS_MAX];
    char copy[LINE_SIZE];
    (void)snprintf(copy, sizeof copy, "%s", line);
    const size_t count = split(&copy[2], words, WORDS_MAX);
    for (size_t i = 0; count != 0 && i < sizeof actions / sizeof actions[0]; i++) {
        const action_t *action = &actions[i];
        if (strcmp(action->name, words[0]) != 0) {
            continue;
        }
        if (count < action->words || count > action->words + action->more) {
            fail(replay, "wrong number of words");
        }
        if (action->happens) {
            advance(replay, time_ahead(replay, log, line));
            expect_nothing(replay);
        }
        action->act(replay, words, count);
        if (action->happens) {
            step(replay);
        }
        return;
    }
    fail(replay, "unknown action");
}

/* (0.000000) can0 123#112233 R */
static void play_frame(replay_t *replay, char *line)
{
    char *words[WORDS_MAX];
    if (split(line, words, WORDS_MAX) != 4 || words[0][0] != '(') {
        fail(replay, "neither a frame nor a comment");
    }
    advance(replay, time_of(replay, &words[0][1], ')'));
    const can_frame_t frame = frame_of(replay, words[2]);
    replay->frame_count++;
    if (strcmp(words[3], "R") == 0) {
        receive(replay, &frame);
    } else if (strcmp(words[3], "T") == 0) {
        transmit(replay, &frame);
    } else {
        fail(replay, "a frame is R or T, not %s", words[3]);
    }
}

static void play(replay_t *replay, const char *path)
{
    char line[LINE_SIZE];
    FILE *log = fopen(path, "r");
    replay->path = path;
    replay->line = 0;
    if (log == NULL) {
        fail(replay, "cannot be opened");
        return;
    }
    while (fgets(line, sizeof line, log) != NULL) {
        replay->line++;
        if (strchr(line, '\n') == NULL) {
            fail(replay, "the line is too long, or does not end");
        }
        if (strncmp(line, "#!", 2) == 0) {
            play_action(replay, log, line);
        } else if (line[0] != '#' && line[0] != '\n') {
            play_frame(replay, line);
        }
    }
    (void)fclose(log);
}

int main(int argc, char **argv)
{
    static replay_t replay;
    if (argc != 2) {
        (void)fputs("usage: replay LOG\n", stderr);
        return 2;
    }
    pdcp_arb_init(&replay.arb, clock_ms(&replay), SERIAL, SEED, on_event, &replay);
    step(&replay);
    play(&replay, argv[1]);
    expect_nothing(&replay);
    if (replay.outcome_count != 0) {
        fail(&replay, "an outcome was not asked for with \"done\"");
    }
    if (replay.frame_count == 0) {
        fail(&replay, "the log holds no frame");
    }
    (void)printf("%s: %u frames\n", argv[1], (unsigned)replay.frame_count);
    return EXIT_SUCCESS;
}
