#include "node_type.h"

#include <stdio.h>
#include <string.h>

#include "node_text.h"

#define SPACES " ,\t"
#define HEX_DIGITS "0123456789ABCDEFabcdef"

/* What a word sets. Two words of one field exclude each other. */
enum {
    FIELD_SIZE = 1,
    FIELD_DATA = 2,
    FIELD_CONTROL = 4,
    FIELD_SOLE = 8,
    FIELD_TERMINAL = 16,
    FIELD_PRESCALER = 32,
    FIELDS_NEEDED = FIELD_SIZE | FIELD_DATA
};

static const struct {
    const char *word;
    uint8_t field;
    uint8_t value;
} words[] = {
    {"4bit", FIELD_SIZE, PROFILE_SIZE_4},
    {"8bit", FIELD_SIZE, PROFILE_SIZE_8},
    {"12bit", FIELD_SIZE, PROFILE_SIZE_12},
    {"16bit", FIELD_SIZE, PROFILE_SIZE_16},
    {"signed", FIELD_DATA, PROFILE_SIGNED},
    {"unsigned", FIELD_DATA, PROFILE_UNSIGNED},
    {"float", FIELD_DATA, PROFILE_FLOAT},
    {"boolean", FIELD_DATA, PROFILE_BOOLEAN},
    {"position", FIELD_CONTROL, PROFILE_POSITION},
    {"velocity", FIELD_CONTROL, PROFILE_VELOCITY},
    {"acceleration", FIELD_CONTROL, PROFILE_ACCELERATION},
    {"other", FIELD_CONTROL, PROFILE_OTHER},
    {"sole", FIELD_SOLE, 1},
    {"terminal", FIELD_TERMINAL, 1},
    {"x1", FIELD_PRESCALER, 0},
    {"x1e-6", FIELD_PRESCALER, 1},
    {"x1e-3", FIELD_PRESCALER, 2},
    {"x1e-1", FIELD_PRESCALER, 3},
    {"x1e1", FIELD_PRESCALER, 4},
    {"x1e2", FIELD_PRESCALER, 5},
    {"x1e3", FIELD_PRESCALER, 6},
    {"x1e6", FIELD_PRESCALER, 7},
};

static void set_field(profile_type_t *type, uint8_t field, uint8_t value)
{
    switch (field) {
    case FIELD_SIZE:
        type->size = value;
        break;
    case FIELD_DATA:
        type->data = value;
        break;
    case FIELD_CONTROL:
        type->control = value;
        break;
    case FIELD_SOLE:
        type->sole_access = true;
        break;
    case FIELD_TERMINAL:
        type->terminal = true;
        break;
    default:
        type->prescaler = value;
        break;
    }
}

/* Takes one word and adds its field to *fields. */
static bool take_word(const char *word, size_t length, profile_type_t *type, unsigned *fields, char *error,
                      size_t error_size)
{
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strlen(words[i].word) != length || memcmp(word, words[i].word, length) != 0) {
            continue;
        }
        if ((*fields & words[i].field) != 0) {
            (void)snprintf(error, error_size, "'%.*s' contradicts or repeats a word before it", (int)length,
                           word);
            return false;
        }
        *fields |= words[i].field;
        set_field(type, words[i].field, words[i].value);
        return true;
    }
    (void)snprintf(error, error_size, "unknown word '%.*s'", (int)length, word);
    return false;
}

static bool parse_words(const char *text, uint16_t *word, char *error, size_t error_size)
{
    profile_type_t type = {0};
    unsigned fields = 0;
    for (const char *at = text + strspn(text, SPACES); *at != '\0'; at += strspn(at, SPACES)) {
        const size_t length = strcspn(at, SPACES);
        if (!take_word(at, length, &type, &fields, error, error_size)) {
            return false;
        }
        at += length;
    }
    if ((fields & FIELDS_NEEDED) != FIELDS_NEEDED) {
        (void)snprintf(error, error_size, "needs a size (such as 8bit) and a data type (such as unsigned)");
        return false;
    }
    *word = profile_type_encode(&type);
    return true;
}

static bool parse_number(const char *text, uint16_t *word, char *error, size_t error_size)
{
    long long number;
    if (!node_text_number(text, &number)) {
        (void)snprintf(error, error_size, "'%s' is not a number", text);
        return false;
    }
    if (number > UINT16_MAX) {
        (void)snprintf(error, error_size, "%s is not in the range 0 to %d", text, UINT16_MAX);
        return false;
    }
    *word = (uint16_t)number;
    return true;
}

/* A number looks like one even where it is none, such as 8F: no word is made of hexadecimal digits alone. */
static bool looks_like_number(const char *text)
{
    const char *digits = strncmp(text, "0x", 2) == 0 ? &text[2] : text;
    return text[0] != '\0' && digits[strspn(digits, HEX_DIGITS)] == '\0';
}

bool node_type_parse(const char *text, uint16_t *word, profile_type_t *type, char *error, size_t error_size)
{
    if (!(looks_like_number(text) ? parse_number : parse_words)(text, word, error, error_size)) {
        return false;
    }
    if (!profile_type_decode(*word, type)) {
        (void)snprintf(error, error_size, "a float has 16 bits");
        return false;
    }
    if (type->data == PROFILE_FLOAT) {
        (void)snprintf(error, error_size, "float channels cannot be simulated");
        return false;
    }
    return true;
}
