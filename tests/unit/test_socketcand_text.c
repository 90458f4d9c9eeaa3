/* The text of socketcand. Elements that are expected, or read, are those of the protocol's description as the
 * headers and python-can's client have it: "< send 123 3 1 22 33 >", "< frame 123 23.424242 012233 >". */
#include <string.h>

#include "socketcand_text.h"
#include "unity.h"

static socketcand_text_splitter_t splitter;

void setUp(void)
{
    splitter = (socketcand_text_splitter_t){.longest = SOCKETCAND_TEXT_MAX};
}

void tearDown(void) {}

static socketcand_text_t text_of(const char *text)
{
    return (socketcand_text_t){.text = text, .length = strlen(text)};
}

/* --- elements --- */

/* Feeds stream and writes one character for each event: s stray, l too long, e element, E cut element. */
static const char *events_of(const char *stream)
{
    static char events[64];
    size_t n = 0;
    for (; *stream != '\0'; stream++) {
        socketcand_text_event_t event = socketcand_text_take(&splitter, *stream);
        TEST_ASSERT_LESS_THAN(sizeof events - 1, n);
        if (event == SOCKETCAND_TEXT_STRAY) {
            events[n++] = 's';
        } else if (event == SOCKETCAND_TEXT_TOO_LONG) {
            events[n++] = 'l';
        } else if (event == SOCKETCAND_TEXT_ELEMENT) {
            events[n++] = splitter.cut ? 'E' : 'e';
        }
    }
    events[n] = '\0';
    return events;
}

static void expect_element(const char *expected)
{
    socketcand_text_t element = socketcand_text_element(&splitter);
    TEST_ASSERT_EQUAL_UINT(strlen(expected), element.length);
    TEST_ASSERT_EQUAL_STRING_LEN(expected, element.text, element.length);
}

static void test_element_is_what_stands_between_the_brackets(void)
{
    TEST_ASSERT_EQUAL_STRING("", events_of("< hi "));
    TEST_ASSERT_TRUE(splitter.inside);
    TEST_ASSERT_EQUAL_STRING("e", events_of(">"));
    TEST_ASSERT_FALSE(splitter.inside);
    expect_element(" hi ");
    TEST_ASSERT_EQUAL_STRING("eee", events_of("<ok>\r\n < ok >\t<>"));
    expect_element("");
}

static void test_text_between_elements_is_told_once(void)
{
    TEST_ASSERT_EQUAL_STRING("ses", events_of(" noise > more < hi >x y"));
    TEST_ASSERT_EQUAL_STRING("", events_of("z\n"));
    TEST_ASSERT_EQUAL_STRING("es", events_of("<hi>>"));
}

static void test_longest_element_and_one_more(void)
{
    splitter.longest = 4;
    TEST_ASSERT_EQUAL_STRING("e", events_of("<1234>"));
    expect_element("1234");
    TEST_ASSERT_EQUAL_STRING("lE", events_of("<12345>"));
    expect_element("1234");
    TEST_ASSERT_EQUAL_STRING("lEe", events_of("<1234567 < 9><12>"));
    expect_element("12");
}

static void test_every_place_of_the_text_is_used(void)
{
    TEST_ASSERT_EQUAL_STRING("", events_of("<"));
    for (unsigned i = 0; i < SOCKETCAND_TEXT_MAX; i++) {
        TEST_ASSERT_EQUAL_INT(SOCKETCAND_TEXT_MORE, socketcand_text_take(&splitter, 'a'));
    }
    TEST_ASSERT_EQUAL_STRING("l", events_of("bcd"));
    TEST_ASSERT_EQUAL_STRING("E", events_of(">"));
    TEST_ASSERT_EQUAL_UINT(SOCKETCAND_TEXT_MAX, socketcand_text_element(&splitter).length);
}

static void test_bracket_inside_restarts_or_belongs_to_the_element(void)
{
    TEST_ASSERT_EQUAL_STRING("e", events_of("< send 1 < hi >"));
    expect_element(" send 1 < hi ");
    splitter.restarts = true;
    TEST_ASSERT_EQUAL_STRING("e", events_of("< send 1 < hi >"));
    expect_element(" hi ");
    splitter.longest = 4;
    TEST_ASSERT_EQUAL_STRING("le", events_of("< too long < hi >"));
    expect_element(" hi ");
}

static void test_any_byte_is_a_character(void)
{
    TEST_ASSERT_EQUAL_INT(SOCKETCAND_TEXT_MORE, socketcand_text_take(&splitter, '<'));
    for (int byte = 0; byte < 256; byte++) {
        if (byte != '>' && splitter.length < SOCKETCAND_TEXT_MAX) {
            TEST_ASSERT_EQUAL_INT(SOCKETCAND_TEXT_MORE, socketcand_text_take(&splitter, (char)byte));
        }
    }
    TEST_ASSERT_EQUAL_INT(SOCKETCAND_TEXT_ELEMENT, socketcand_text_take(&splitter, '>'));
    TEST_ASSERT_EQUAL_UINT(255, socketcand_text_element(&splitter).length);
}

/* --- words --- */

static void test_words_end_at_white_space(void)
{
    socketcand_text_t words[3];
    TEST_ASSERT_EQUAL_UINT(2, socketcand_text_split(text_of(" \topen\r\n can0 "), words, 3));
    TEST_ASSERT_TRUE(socketcand_text_is(words[0], "open"));
    TEST_ASSERT_TRUE(socketcand_text_is(words[1], "can0"));
    TEST_ASSERT_FALSE(socketcand_text_is(words[1], "can"));
    TEST_ASSERT_FALSE(socketcand_text_is(words[1], "can00"));
    TEST_ASSERT_EQUAL_UINT(3, socketcand_text_split(text_of("a b c d"), words, 3));
    TEST_ASSERT_TRUE(socketcand_text_is(words[2], "c"));
    TEST_ASSERT_EQUAL_UINT(0, socketcand_text_split(text_of(" \r\n\t"), words, 3));
}

static void test_rest_is_what_follows_the_word(void)
{
    socketcand_text_t rest = text_of("error no such bus");
    socketcand_text_t word;
    TEST_ASSERT_TRUE(socketcand_text_next(&rest, &word));
    TEST_ASSERT_TRUE(socketcand_text_is(rest, " no such bus"));
    rest.length = 0;
    TEST_ASSERT_FALSE(socketcand_text_next(&rest, &word));
    TEST_ASSERT_EQUAL_UINT(0, word.length);
}

/* --- frames to the client --- */

static void expect_frame(const char *rest, can_frame_kind_t kind, uint16_t id, uint8_t dlc, const char *data)
{
    can_frame_t frame;
    memset(&frame, 0xA5, sizeof frame);
    TEST_ASSERT_TRUE_MESSAGE(socketcand_text_parse_frame(text_of(rest), &frame), rest);
    TEST_ASSERT_EQUAL_INT(kind, frame.kind);
    TEST_ASSERT_EQUAL_HEX16(id, frame.id);
    TEST_ASSERT_EQUAL_UINT8(dlc, frame.dlc);
    for (unsigned i = 0; i < CAN_FRAME_DATA_MAX; i++) {
        TEST_ASSERT_EQUAL_HEX8(i < dlc ? (uint8_t)data[i] : 0, frame.data[i]);
    }
}

static void test_frames_are_read(void)
{
    expect_frame("123 23.424242 012233 ", CAN_FRAME_BASE, 0x123, 3, "\x01\x22\x33");
    expect_frame("123 23.424242  ", CAN_FRAME_BASE, 0x123, 0, "");
    expect_frame("7ff 0.0 01 02 0a", CAN_FRAME_BASE, 0x7FF, 3, "\x01\x02\x0A");
    expect_frame("0 1 0011223344556677", CAN_FRAME_BASE, 0, 8, "\x00\x11\x22\x33\x44\x55\x66\x77");
    expect_frame("00000123 1.0 42", CAN_FRAME_EXTENDED, 0, 1, "\x42");
    expect_frame("0123 1.0", CAN_FRAME_EXTENDED, 0, 0, "");
    expect_frame("123 1.0 000102030405060708", CAN_FRAME_FD, 0, 8, "\x00\x01\x02\x03\x04\x05\x06\x07");
}

static void test_malformed_frames_are_none(void)
{
    const char *const malformed[] = {"",
                                     "123",
                                     "800 1.0 00",
                                     "XYZ 1.0 01",
                                     "123456789 1.0 00",
                                     "-12 1.0 00",
                                     "123 1.0 0",
                                     "123 1.0 012",
                                     "123 1.0 0g",
                                     "123 1.0 0x01",
                                     "123 1.0 01 2",
                                     "0x1 1.0 00",
                                     "123 1.0 01 ,"};
    for (size_t i = 0; i < sizeof malformed / sizeof malformed[0]; i++) {
        can_frame_t frame;
        TEST_ASSERT_FALSE_MESSAGE(socketcand_text_parse_frame(text_of(malformed[i]), &frame), malformed[i]);
    }
}

static void test_errors_of_the_bus_and_of_the_server_differ(void)
{
    TEST_ASSERT_TRUE(socketcand_text_parse_error(text_of(" 004 23.424242")));
    TEST_ASSERT_FALSE(socketcand_text_parse_error(text_of(" could not send")));
    TEST_ASSERT_FALSE(socketcand_text_parse_error(text_of(" bus v1.0")));
    TEST_ASSERT_FALSE(socketcand_text_parse_error(text_of(" 004")));
    TEST_ASSERT_FALSE(socketcand_text_parse_error(text_of("")));
}

static void expect_frame_text(const char *expected, uint64_t time_us, can_frame_t frame)
{
    char line[SOCKETCAND_TEXT_FRAME_BYTES];
    TEST_ASSERT_EQUAL_UINT(strlen(expected),
                           socketcand_text_format_frame(line, sizeof line, time_us, &frame));
    TEST_ASSERT_EQUAL_STRING(expected, line);
}

static void test_frames_are_written_with_time_and_one_word_of_data(void)
{
    expect_frame_text("< frame 123 23.424242 012233 >", 23424242,
                      (can_frame_t){.id = 0x123, .dlc = 3, .data = {0x01, 0x22, 0x33}});
    expect_frame_text("< frame 00A 0.000001  >", 1, (can_frame_t){.id = 0x00A});
    expect_frame_text("< frame 00000000 1.000000 FF >", 1000000,
                      (can_frame_t){.kind = CAN_FRAME_EXTENDED, .dlc = 1, .data = {0xFF}});
    expect_frame_text(
        "< frame 7FF 18446744073709.551615 AABBCCDDEEFF0011 >", UINT64_MAX,
        (can_frame_t){.id = 0x7FF, .dlc = 8, .data = {0xAA, 0xBB, 0xCC, 0xDD, 0xEE, 0xFF, 0x00, 0x11}});
}

/* --- frames to the server --- */

static const char *parse_send(const char *text, can_frame_t *frame)
{
    socketcand_text_t words[12];
    size_t count = socketcand_text_split(text_of(text), words, 12);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(2, count);
    return socketcand_text_parse_send(words, count, frame);
}

static void test_frames_to_send_are_read(void)
{
    can_frame_t frame;
    memset(&frame, 0xA5, sizeof frame);
    TEST_ASSERT_NULL(parse_send("123 3 1 22 33", &frame));
    TEST_ASSERT_EQUAL_INT(CAN_FRAME_BASE, frame.kind);
    TEST_ASSERT_EQUAL_HEX16(0x123, frame.id);
    TEST_ASSERT_EQUAL_UINT8(3, frame.dlc);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\x01\x22\x33\x00\x00\x00\x00\x00", frame.data, 8);
    TEST_ASSERT_NULL(parse_send("1FFFFFFF 0", &frame));
    TEST_ASSERT_EQUAL_INT(CAN_FRAME_EXTENDED, frame.kind);
    TEST_ASSERT_EQUAL_HEX16(0, frame.id);
    TEST_ASSERT_NULL(parse_send("5 8 0 1 2 3 4 5 6 fF", &frame));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\x00\x01\x02\x03\x04\x05\x06\xFF", frame.data, 8);
}

static void test_malformed_frames_to_send_are_named(void)
{
    static const struct {
        const char *text;
        const char *wrong;
    } rows[] = {
        {"800 0", "identifier over 7FF with three digits"},
        {"20000000 0", "identifier over 1FFFFFFF"},
        {"0000000001 0", "identifier is not one to eight hexadecimal digits"},
        {"1g 0", "identifier is not one to eight hexadecimal digits"},
        {"123 9 1 2 3 4 5 6 7 8 9", "DLC is not 0 to 8"},
        {"123 01 1", "DLC is not 0 to 8"},
        {"123 2 1", "DLC and number of data bytes differ"},
        {"123 0 1", "DLC and number of data bytes differ"},
        {"123 1 123", "data byte is not one or two hexadecimal digits"},
        {"123 1 0x", "data byte is not one or two hexadecimal digits"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        can_frame_t frame;
        TEST_ASSERT_EQUAL_STRING(rows[i].wrong, parse_send(rows[i].text, &frame));
    }
}

static void expect_send_text(const char *expected, can_frame_t frame)
{
    char line[SOCKETCAND_TEXT_FRAME_BYTES];
    TEST_ASSERT_EQUAL_UINT(strlen(expected), socketcand_text_format_send(line, sizeof line, &frame));
    TEST_ASSERT_EQUAL_STRING(expected, line);
}

static void test_frames_to_send_are_written_without_leading_zeros(void)
{
    expect_send_text("< send 123 3 1 22 33 >",
                     (can_frame_t){.id = 0x123, .dlc = 3, .data = {0x01, 0x22, 0x33}});
    expect_send_text("< send 00A 0 >", (can_frame_t){.id = 0x00A});
    expect_send_text(
        "< send 7FF 8 0 10 FF 80 F AA 1 0 >",
        (can_frame_t){.id = 0x7FF, .dlc = 8, .data = {0x00, 0x10, 0xFF, 0x80, 0x0F, 0xAA, 0x01, 0x00}});
    /* A wrong frame overruns nothing. */
    expect_send_text(
        "< send 7FF 8 FF FF FF FF FF FF FF FF >",
        (can_frame_t){.id = 0xFFFF, .dlc = 255, .data = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}});
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_element_is_what_stands_between_the_brackets);
    RUN_TEST(test_text_between_elements_is_told_once);
    RUN_TEST(test_longest_element_and_one_more);
    RUN_TEST(test_every_place_of_the_text_is_used);
    RUN_TEST(test_bracket_inside_restarts_or_belongs_to_the_element);
    RUN_TEST(test_any_byte_is_a_character);
    RUN_TEST(test_words_end_at_white_space);
    RUN_TEST(test_rest_is_what_follows_the_word);
    RUN_TEST(test_frames_are_read);
    RUN_TEST(test_malformed_frames_are_none);
    RUN_TEST(test_errors_of_the_bus_and_of_the_server_differ);
    RUN_TEST(test_frames_are_written_with_time_and_one_word_of_data);
    RUN_TEST(test_frames_to_send_are_read);
    RUN_TEST(test_malformed_frames_to_send_are_named);
    RUN_TEST(test_frames_to_send_are_written_without_leading_zeros);
    return UNITY_END();
}
