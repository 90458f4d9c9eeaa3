/* What a complaint quotes cannot steer the terminal that shows it. */
#include "complaint.h"
#include "unity.h"

void setUp(void) {}

void tearDown(void) {}

static void expect(const char *escaped, const char *text)
{
    char line[COMPLAINT_TEXT];
    complaint_escape(line, sizeof line, text);
    TEST_ASSERT_EQUAL_STRING(escaped, line);
}

static void test_letters_stand_as_they_are(void)
{
    expect(
        "d1.ini:3: unknown key 'gr\xC3\xB6\xC3\x9F"
        "e \xE2\x82\xAC \xE2\x80\x93'",
        "d1.ini:3: unknown key 'gr\xC3\xB6\xC3\x9F"
        "e \xE2\x82\xAC \xE2\x80\x93'");
}

static void test_controls_are_escaped(void)
{
    expect("a\\x1B[31mb\\x07\\x0A\\x7F", "a\x1B[31mb\x07\n\x7F");
    expect(
        "\\xC2\\x9B"
        "31m\xC2\xA0",
        "\xC2\x9B"
        "31m\xC2\xA0"); /* U+009B begins a sequence as well */
}

static void test_what_turns_the_direction_is_escaped(void)
{
    expect(
        "a\\xE2\\x80\\xAE"
        "b",
        "a\xE2\x80\xAE"
        "b");
    expect("\\xE2\\x80\\x8E\\xE2\\x81\\xA6\\xE2\\x81\\xA9\\xE2\\x80\\xA8",
           "\xE2\x80\x8E\xE2\x81\xA6\xE2\x81\xA9\xE2\x80\xA8");
}

static void test_broken_utf_8_ends_where_it_ends(void)
{
    expect("\xE2", "\xE2");
    expect("\xE2\x80", "\xE2\x80");
    expect("\xC2", "\xC2");
}

static void test_long_text_is_cut(void)
{
    char line[8];
    complaint_escape(line, sizeof line, "\x1B\x1B\x1B\x1B");
    TEST_ASSERT_EQUAL_STRING("\\x1B", line);
    complaint_escape(line, sizeof line, "abcdefghij");
    TEST_ASSERT_EQUAL_STRING("abcd", line);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_letters_stand_as_they_are);
    RUN_TEST(test_controls_are_escaped);
    RUN_TEST(test_what_turns_the_direction_is_escaped);
    RUN_TEST(test_broken_utf_8_ends_where_it_ends);
    RUN_TEST(test_long_text_is_cut);
    return UNITY_END();
}
